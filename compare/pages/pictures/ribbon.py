"""The picture of one ribbon: omega(s), eta(s) or tau(s), a side view and one in perspective, with what holds it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.proj3d import proj_transform
from numpy.typing import NDArray

from compare.models.holds.bodies import FLAT, ROUND, reach, round_grid
from compare.models.holds.planes import box, clipped
from compare.models.holds.ribbon import obstacles, walls
from compare.models.holds.touches import lines, touches
from compare.page.drawing import RIBBON_COLOUR, WALL_COLOUR, quads, save, screen_axes
from compare.pages.pictures import touches as contacts
from compare.scene.inputs.bodies import Body
from compare.scene.units import Units
from compare.store.touches import Touches
from ribbon import Clamp, Equilibrium

FloatArray = NDArray[np.float64]

CLAMP_COLOUR = "#c2662d"
#: The other side of the ribbon in space; what its outermost cells are darkened by, which draws its edges.
BACK_COLOUR, _EDGE = "#a9bfd8", 0.45
#: Where the shape in space is seen from, in degrees: height over the horizon, of a closed band; turn.
_HEIGHT, _HEIGHT_CLOSED, _TURN = 28.0, 52.0, -62.0
#: Shades of the ribbon seen along its surface and face on, as shares of the colour; light from (unnormalised).
_DARK, _BRIGHT = 0.45, 1.1
_LIGHT = np.array([0.3, -0.5, 0.8])
#: Half the length of a clamp's sign, over the ribbon's largest extent.
_SIGN = 0.05
#: Variation of omega, eta or tau below which it is constant.
_ROUNDING = 1e-6
#: Most radius, over the ribbon's largest extent, of an obstacle that is shown whole.
_SHOWN = 1.0
#: How large the view in perspective is drawn, and what share of its room it fills where it would else end beyond it.
_ZOOM, _MARGIN = 1.04, 0.98
#: Sine of the angle below which a wall is seen from its edge.
_EDGE_ON = 1e-6

#: Where the views stand in the figure, and its dots an inch: with room for what is written at their axes, so that it
#: need not be measured first (which takes as long as drawing it).
_ROOM = {"left": 0.05, "right": 0.995, "bottom": 0.115, "top": 0.865, "wspace": 0.2, "hspace": 0.42}
_DOTS = 150


def held(equilibrium: Equilibrium) -> list[tuple[FloatArray, FloatArray, Clamp]]:
    """Position (3,), frame (3, 3) and clamp of the ends that a clamp holds (wholly or in part), as they stand."""
    problem: Any = equilibrium.problem
    start, end = (problem.clamp, None) if problem.formulation == "chained" else (problem.start, problem.end)
    points, frames = equilibrium.joints
    return [(points[k], frames[k], clamp) for k, clamp in ((0, start), (-1, end)) if clamp is not None]


def _rgb(colour: str) -> FloatArray:
    return np.array([int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)])


def shades(cells: FloatArray, towards: FloatArray) -> FloatArray:
    """Colours (cells, 3) of the ribbon's cells (cells, 4, 3), lit from both sides, of one seen from `towards` (3,): its
    front blue, its back pale, so that a twist is seen."""
    normal = np.cross(cells[:, 2] - cells[:, 0], cells[:, 3] - cells[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    share = np.abs(normal @ (_LIGHT / np.linalg.norm(_LIGHT)))
    base = np.where((normal @ towards < 0.0)[:, None], _rgb(BACK_COLOUR), _rgb(RIBBON_COLOUR))
    return np.clip(base * (_DARK + (_BRIGHT - _DARK) * share)[:, None] + 0.12, 0.0, 1.0)


def _side(axes: Any, equilibrium: Equilibrium, grid: FloatArray, up: FloatArray | None, touching: Touches) -> None:
    screen = screen_axes([grid], up)[0]
    flat = grid @ screen.T
    axes.add_collection(PolyCollection(list(quads(flat)), facecolors=(*_rgb(RIBBON_COLOUR), 0.3), edgecolors="none"))
    middle = flat[:, flat.shape[1] // 2]
    axes.plot(middle[:, 0], middle[:, 1], color=RIBBON_COLOUR, lw=1.3)
    low, high, extent = box(grid.reshape(-1, 3))
    for point, normal in walls(equilibrium):
        seen = screen @ normal
        if 1.0 - float(np.linalg.norm(seen)) < _EDGE_ON:
            ends = clipped(point, normal, low, high) @ screen.T
            axes.plot(ends[:, 0], ends[:, 1], color=WALL_COLOUR, lw=2.5)
    for obstacle in obstacles(equilibrium):
        if obstacle.kind in FLAT:
            _outline(axes, obstacle, screen, grid)
            continue
        along = None if obstacle.axis is None else screen @ np.asarray(obstacle.axis)
        if along is None or float(np.linalg.norm(along)) < _EDGE_ON:
            turns = np.linspace(0.0, 2.0 * np.pi, ROUND)
            ring = screen @ np.asarray(obstacle.point) + obstacle.radius * np.column_stack(
                [np.cos(turns), np.sin(turns)]
            )
            axes.plot(ring[:, 0], ring[:, 1], color=WALL_COLOUR, lw=1.5)
    for position, frame, clamp in held(equilibrium):
        place = screen @ position
        axes.plot(*place, "s" if clamp.holds_frame else "o", color=CLAMP_COLOUR, ms=5)
        if clamp.holds_frame:
            tip = place + _SIGN * 2.0 * extent * (screen @ frame[:, 2])
            axes.plot(*np.column_stack([place, tip]), color=CLAMP_COLOUR, lw=1.5)
    contacts.traced(axes, [line @ screen.T for line in lines(equilibrium)])
    contacts.flat(axes, touching, screen, extent)
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(True, lw=0.3, alpha=0.6)


def _outline(axes: Any, body: Body, screen: FloatArray, grid: FloatArray) -> None:
    """The edges of a box, or what is seen of an edge along its axis."""
    assert body.axis is not None
    end_on = float(np.linalg.norm(screen @ body.axis)) < _EDGE_ON
    if body.kind == "edge" and not end_on:
        return
    points = grid.reshape(-1, 3)
    net = round_grid(body, points.min(axis=0), points.max(axis=0)) @ screen.T
    for line in [net[:, 0]] if body.kind == "edge" else [*net, *np.moveaxis(net[1:3], 1, 0)]:
        axes.plot(line[:, 0], line[:, 1], color=WALL_COLOUR, lw=1.5)


def _space(axes: Any, equilibrium: Equilibrium, grid: FloatArray, up: FloatArray | None, touching: Touches) -> None:
    """The ribbon in perspective, `up` (else the direction of its least extent, of a closed band across the plane of its
    centreline) upwards, walls translucent."""
    closed = equilibrium.seam != 0
    cloud = (grid[:, grid.shape[1] // 2] if closed else grid).reshape(-1, 3)
    if up is None:
        _, _, directions = np.linalg.svd(cloud - cloud.mean(axis=0), full_matrices=False)
        vertical = directions[2]
    else:
        vertical = np.asarray(up, dtype=float)
    first, second = (pair[0] for pair in screen_axes([grid], vertical))
    turn = np.array([first, second, vertical])  # rows: the axes of the picture
    points = grid @ turn.T
    cells = quads(points)
    low, high, extent = box(points.reshape(-1, 3))
    seen = [points.reshape(-1, 3)]
    for point, normal in walls(equilibrium):
        plane = clipped(turn @ point, turn @ normal, low, high)
        axes.add_collection3d(Poly3DCollection([plane], facecolors=(*_rgb(WALL_COLOUR), 0.18), edgecolors=WALL_COLOUR))
        low, high = np.minimum(low, plane.min(axis=0)), np.maximum(high, plane.max(axis=0))
        seen.append(plane)
    least, most = grid.reshape(-1, 3).min(axis=0), grid.reshape(-1, 3).max(axis=0)
    for obstacle in obstacles(equilibrium):
        net = round_grid(obstacle, least, most) @ turn.T
        faces = Poly3DCollection(quads(net), facecolors=(*_rgb(WALL_COLOUR), 0.12), edgecolors="none")
        axes.add_collection3d(faces)
        near = net.reshape(-1, 3)
        if reach(obstacle) <= _SHOWN * extent:  # of a larger one what is beside the strip is seen
            low, high = np.minimum(low, near.min(axis=0)), np.maximum(high, near.max(axis=0))
            seen.append(near)
    height = np.radians(_HEIGHT_CLOSED if closed and up is None else _HEIGHT)
    turned = np.radians(_TURN)
    towards = np.array([np.cos(height) * np.cos(turned), np.cos(height) * np.sin(turned), np.sin(height)])
    colours = shades(cells, towards).reshape(grid.shape[0] - 1, grid.shape[1] - 1, 3)
    colours[:, [0, -1]] *= _EDGE
    colours = colours.reshape(-1, 3)
    axes.add_collection3d(Poly3DCollection(cells, facecolors=colours, edgecolors=colours, linewidths=0.3))
    half = max(0.5 * float(np.linalg.norm(grid[0, -1] - grid[0, 0])), _SIGN * extent)
    for position, frame, clamp in held(equilibrium):
        place, axis = turn @ position, turn @ frame
        if clamp.holds_frame:
            bar = np.array([place - 1.3 * half * axis[:, 0], place + 1.3 * half * axis[:, 0]])
            axes.plot(*bar.T, color=CLAMP_COLOUR, lw=3.0, zorder=10)
            pin = np.array([place, place + 2.0 * _SIGN * extent * axis[:, 1]])
            axes.plot(*pin.T, color=CLAMP_COLOUR, lw=1.5, zorder=10)
        else:
            axes.plot(*place[:, None], "o", color=CLAMP_COLOUR, ms=5, zorder=10)
    contacts.traced(axes, [line @ turn.T for line in lines(equilibrium)], zorder=9)
    contacts.space(axes, touching, turn, extent)
    size = np.maximum(high - low, 0.25 * float((high - low).max()))
    middle = 0.5 * (low + high)
    for setter, a in ((axes.set_xlim, 0), (axes.set_ylim, 1), (axes.set_zlim, 2)):
        setter(middle[a] - 0.5 * size[a], middle[a] + 0.5 * size[a])
    axes.set_box_aspect(size, zoom=_ZOOM)
    axes.view_init(elev=float(np.degrees(height)), azim=_TURN)
    axes.set_axis_off()
    seen += [(points + ways) @ turn.T for points, ways, _ in contacts.arrows(touching, extent)]
    share = room(axes, np.concatenate(seen))
    if share < 1.0:
        axes.set_box_aspect(size, zoom=_ZOOM * share)
    for artist in (*axes.collections, *axes.lines):  # the view's square is narrower than its place
        artist.set_clip_on(False)


def room(axes: Any, points: FloatArray) -> float:
    """How large points (n, 3) of a view in perspective may be drawn over how large they are, to end within its place
    in the figure; 1 where they do, to `_MARGIN`."""
    figure = axes.figure
    place = axes.get_subplotspec().get_position(figure).transformed(figure.transFigure)
    axes.apply_aspect()
    x, y, _ = proj_transform(*points.T, axes.get_proj())
    drawn = axes.transData.transform(np.column_stack([x, y]))
    middle = 0.5 * (axes.bbox.p0 + axes.bbox.p1)
    held = np.minimum(middle - place.p0, place.p1 - middle)
    return float(min(1.0, _MARGIN * (held / np.maximum(np.abs(drawn - middle).max(axis=0), 1e-9)).min()))


def length_axis(units: Units | None) -> tuple[float, str]:
    """What l is on an axis, and in which unit: mm below a metre, m, or l where the scene does not say."""
    return (None if units is None else units.reading(1.0, "l")) or (1.0, "l")


def ribbon_profile(path: Path, equilibrium: Equilibrium, title: str, units: Units | None = None) -> Path:
    """omega(s) and eta(s), or the twist tau(s) where it is free, of a ribbon with its joints marked, and its shape with
    clamps (orange) and walls (grey).

    A clamp's square or bar stands for a held frame (the bar along the width, the pin along the normal), a dot for a
    position alone. A wall is a line in the side view where it is seen from its edge, a cylinder along its axis a
    circle.
    """
    figure = Figure(figsize=(11.5, 4.4))
    size, unit = length_axis(units)
    metre = 1.0 if units is None or units.length is None else units.length
    per = "1/l" if unit == "l" else "1/m"
    places = figure.add_gridspec(2, 3, width_ratios=(1.0, 1.0, 1.3), **_ROOM)
    s = np.linspace(0.0, 1.0, 2001)
    joints = np.minimum(np.concatenate([[0.0], np.cumsum(equilibrium.problem.lengths)]), 1.0)
    for row, (values, at_joints, name) in enumerate(
        (
            (equilibrium.omega(s) / metre, equilibrium.omega(joints) / metre, f"normal curvature omega, {per}"),
            (equilibrium.tau(s) / metre, equilibrium.tau(joints) / metre, f"twist tau, {per}")
            if equilibrium.has_free_twist
            else (equilibrium.eta(s), equilibrium.eta(joints), "ruling eta"),
        )
    ):
        axes = figure.add_subplot(places[row, 0])
        axes.plot(size * s, values, color=RIBBON_COLOUR)
        axes.plot(size * joints, at_joints, ".", color=RIBBON_COLOUR, ms=5 if joints.size < 100 else 2)
        level = float(values.mean())
        if float(np.abs(values - level).max()) < _ROUNDING * (1.0 + abs(level)):  # constant: no picture of rounding
            axes.set_ylim(level - 1.0, level + 1.0)
        axes.set_title(name, fontsize=9)
        axes.grid(True, lw=0.3, alpha=0.6)
        if row == 1:
            axes.set_xlabel(f"s / {unit}")
    along = int(min(max(400, 100 * math.ceil(joints.size / 10)), 4000))
    across = 2 * int(
        np.clip(50.0 * equilibrium.problem.strip.relative_width, 3, 12)
    )  # the outermost cells are its edges
    grid = equilibrium.surface(along, across).grid
    gravity = equilibrium.problem.gravity
    up = None if gravity is None else np.asarray(gravity.up, dtype=float)
    side = figure.add_subplot(places[:, 1])
    touching = touches(equilibrium)
    _side(side, equilibrium, grid, up, touching)
    contacts.legend(side, touching, units, loc="upper center", bbox_to_anchor=(0.5, -0.06), ncols=3, frameon=False)
    side.set_title(f"side view / {unit}", fontsize=9)
    for axis in (side.xaxis, side.yaxis):
        axis.set_major_formatter(lambda value, _: f"{size * value:.4g}")
    _space(figure.add_subplot(places[:, 2], projection="3d"), equilibrium, grid[:: max(1, along // 400)], up, touching)
    figure.suptitle(title, wrap=True)
    return save(figure, path, _DOTS, placed=True)
