"""The picture that stands in the place of a 3-D view: the same camera, without a screen, a window or OpenGL."""

from __future__ import annotations

import io

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from compare.page.page import ARROWS, WALL
from compare.pages.report.surfaces import ASPECT, TWO_SIDED, Shown, View, field_range, fields, screen

FloatArray = NDArray[np.float64]

_PAPER = "#edf0f3"
#: How much a wall covers, as in the viewer.
WALL_OPACITY = 0.18
#: By how much of the view's radius the ribbon is drawn nearer than it is, as in the viewer.
FRONT = 0.03
#: Area of a triangle over the square of the view's radius that is none.
_NO_AREA = 1e-12
_UNKNOWN = np.array([0.62, 0.62, 0.62])


def picture(view: View) -> bytes:
    """PNG of the surfaces: triangles from back to front, lit from the camera and above, legend, scale of colours."""
    figure = Figure(figsize=(8.0, 5.0), facecolor=_PAPER)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set(xlim=(-ASPECT, ASPECT), ylim=(-1.0, 1.0))
    scale = _scale(view)
    shown = [one for one in view.surfaces if one.first]
    corners, depths, colours = zip(*(_triangles(view, one, scale) for one in shown), strict=True)
    order = np.argsort(-np.concatenate(depths), kind="stable")
    shades = np.concatenate(colours)[order]
    edges = np.where(shades[:, 3:] < 1.0, [0.0, 0.0, 0.0, 0.0], shades)
    polygons = PolyCollection(list(np.concatenate(corners)[order]), facecolors=shades, edgecolors=edges, lw=0.3)
    axes.add_collection(polygons)
    _axes(axes, view)
    patches = [Patch(color=one.colour, label=one.surface.label) for one in shown]
    if scale is None:
        axes.legend(handles=patches, loc="upper left", fontsize=8, frameon=False)
    else:
        place = figure.add_axes((0.03, 0.93, 0.25, 0.025))
        figure.colorbar(scale, cax=place, orientation="horizontal")
        place.tick_params(labelsize=7)
        place.set_xlabel(fields(view.surfaces)[view.field], fontsize=8)
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=200, facecolor=_PAPER)
    return out.getvalue()


def _scale(view: View) -> ScalarMappable | None:
    """The scale of colours of the view's field over all surfaces; None when each has its own colour."""
    shown = [one.sheet.fields for one in view.surfaces if one.first and view.field in one.sheet.fields]
    ends = [field_range(fields_[view.field])[2:] for fields_ in shown]
    if not ends:
        return None
    low, high = min(e[0] for e in ends), max(e[1] for e in ends)
    diverging = low < 0.0 < high and min(-low, high) > TWO_SIDED * max(-low, high)
    if diverging:
        high = max(-low, high)
        low = -high
    if not high > low:
        low, high = low - 0.5, high + 0.5
    return ScalarMappable(Normalize(low, high), colormaps["coolwarm" if diverging else "viridis"])


def _triangles(view: View, one: Shown, scale: ScalarMappable | None) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Corners on the screen (T, 3, 2), depths (T,) and colours (T, 4) of one surface."""
    sheet, wall = one.sheet, one.surface.kind == WALL
    places, depth = screen(view, sheet.points)
    if one.surface.of_strip or one.surface.kind in ARROWS:
        depth = depth - (1.0 if one.surface.of_strip else 1.5) * FRONT * view.radius
    base = np.tile(np.asarray(one.colour), (len(sheet.triangles), 1))
    if scale is not None and view.field in sheet.fields and one.surface.kind not in ARROWS:
        values = sheet.fields[view.field][sheet.triangles].mean(axis=1)
        base = np.where(np.isfinite(values)[:, None], scale.to_rgba(np.nan_to_num(values))[:, :3], _UNKNOWN)
    middle = sheet.points[sheet.triangles].mean(axis=1)
    normal = sheet.fields["_normal"][sheet.triangles].mean(axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    towards = view.centre + view.distance * view.away - middle
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    facing = np.sum(normal * towards, axis=1)
    normal = np.where(facing[:, None] < 0.0, -normal, normal)
    light = towards + 0.45 * view.upwards
    light /= np.linalg.norm(light, axis=1, keepdims=True)
    shade = (0.6 + 0.4 * np.maximum(np.sum(normal * light, axis=1), 0.0)) * np.where(facing < 0.0, 0.9, 1.0)
    colours = np.column_stack([base * shade[:, None], np.full(len(base), WALL_OPACITY if wall else 1.0)])
    kept = np.ones(len(colours), dtype=bool)
    if one.surface.kind in ARROWS:  # what lies between two arrows has no area
        corners = sheet.points[sheet.triangles]
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        kept = np.linalg.norm(sides, axis=1) > _NO_AREA * view.radius**2
    return places[sheet.triangles][kept], depth[sheet.triangles].mean(axis=1)[kept], colours[kept]


def _axes(axes: Axes, view: View) -> None:
    """The directions of the axes in the lower left corner, and upwards."""
    right = np.cross(view.upwards, view.away)
    right /= np.linalg.norm(right)
    up = np.cross(view.away, right)
    arrows = [("x", np.array([1.0, 0, 0]), "#b3392f"), ("y", np.array([0, 1.0, 0]), "#2f7d3a"),
              ("z", np.array([0, 0, 1.0]), "#2b5fb0")]  # fmt: skip
    if view.up is not None:
        same = [name for name, e, _ in arrows if e @ view.upwards > 0.9999]
        arrows = [(f"{name} up" if name in same else name, e, colour) for name, e, colour in arrows]
        arrows += [] if same else [("up", view.upwards, "#333333")]
    origin = np.array([-ASPECT + 0.22, -0.78])
    for name, e, colour in arrows:
        end = np.array([e @ right, e @ up])
        tip = origin + 0.12 * end
        axes.plot(*zip(origin, tip, strict=True), color=colour, lw=1.4, ls="--" if name == "up" else "-")
        axes.text(
            origin[0] + 0.16 * end[0],
            origin[1] + 0.16 * end[1],
            name,
            color=colour,
            fontsize=8,
            ha="center",
            va="center",
        )
