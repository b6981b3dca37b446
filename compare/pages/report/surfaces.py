"""The surfaces of a page for its 3-D view: thinned out, quantised, with a camera that sees all of them."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.page.drawing import PUSH_COLOUR, RIBBON_COLOUR, RUB_COLOUR, WALL_COLOUR, screen_axes, shell_colour
from compare.page.page import ARROWS, PUSH, RUB, STRIP, WALL, Surface
from compare.pages.export.arrows import moving
from compare.pages.export.vtu import Sheet, seam, triangles
from compare.store.states import States

FloatArray = NDArray[np.float64]

#: Points of all surfaces of a report together, and of one: what a page of some megabytes bears.
MOST_POINTS = 30_000
MOST_POINTS_EACH = 8_000
_LEAST_POINTS = 300
_MOST_ACROSS = 9
#: Where the camera stands at first (rad): the turn from the main horizontal direction, the height over the horizon.
AZIMUTH, ELEVATION = -1.03, 0.33
#: Vertical opening of the camera (rad), as in viewer.js; width over height of the view.
FIELD_OF_VIEW, ASPECT = 0.5, 1.6
#: Part of the points at either end of a field that its scale of colours leaves out, and what the view says of it.
OUTLIERS = 0.02
CLIPPED = f"{100 * OUTLIERS:g} % of the points lie beyond either end"
#: Smaller end of a scale over the larger one from which it has two sides, with zero in the middle.
TWO_SIDED = 0.25

WORDS = {
    "S": "S, along the strip (l)",
    "v": "v, across the strip (l)",
    "ruling_foot": "foot of the ruling (l)",
    "segment": "segment of the ribbon",
    "omega": "normal curvature omega (1/l)",
    "eta": "ruling eta",
    "tau": "twist tau (1/l)",
    "energy_density": "elastic energy per area (D/l²)",
    "bending_energy": "bending energy per area (D/l²)",
    "membrane_energy": "membrane energy per area (D/l²)",
    "shear_energy": "shear energy per area (D/l²)",
    "bending_share": "bending share",
    "membrane_share": "membrane share",
    "shear_share": "shear share",
}


@dataclass(frozen=True)
class Shown:
    """A surface as it is shown: its entry in the page, its thinned triangles, its colour (red, green, blue), whether it
    is seen at first, the place of the surface it can be compared with point by point, and its states along a path."""

    surface: Surface
    sheet: Sheet
    colour: tuple[float, float, float]
    first: bool = True
    partner: int | None = None
    states: States | None = None


@dataclass(frozen=True)
class View:
    """Surfaces with the camera: centre (3,), radius (l), orthonormal directions along and upwards.

    high, wide: distances (l) from which the surfaces fill the height, and the width of a square view.
    """

    surfaces: tuple[Shown, ...]
    centre: FloatArray
    high: float
    wide: float
    radius: float
    along: FloatArray
    upwards: FloatArray
    up: tuple[float, float, float] | None
    field: str

    @property
    def distance(self) -> float:
        """From the centre to the camera (l), in a view of `ASPECT`."""
        return max(self.high, self.wide / ASPECT)

    @property
    def away(self) -> FloatArray:
        """From the centre to the camera (3,)."""
        return away(self.along, self.upwards)


def away(along: FloatArray, upwards: FloatArray) -> FloatArray:
    """Unit vector (3,) towards the first place of the camera."""
    side = np.cross(upwards, along)
    level = np.cos(AZIMUTH) * along + np.sin(AZIMUTH) * side
    return np.asarray(np.cos(ELEVATION) * level + np.sin(ELEVATION) * upwards)


def screen(view: View, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Places (N, 2) on the screen (height 2, middle 0) and depths (N,) of points (N, 3)."""
    right = np.cross(view.upwards, view.away)
    right /= np.linalg.norm(right)
    up = np.cross(view.away, right)
    relative = points - view.centre
    depth = view.distance - relative @ view.away
    scale = 1.0 / (np.tan(FIELD_OF_VIEW / 2.0) * depth)
    return np.column_stack([relative @ right, relative @ up]) * scale[:, None], depth


def view(
    pairs: Sequence[tuple[Surface, Sheet]],
    up: tuple[float, float, float] | None,
    points_each: int,
    states: Mapping[str, States] | None = None,
) -> View:
    """Surfaces seen from the side and a little above: the first that is no shell, one shell, the thinnest, walls and
    places of contact; the others are a click away. Without shells all strips are seen.

    points_each: how many points of each are kept; states: along paths, by the file that a surface names.
    """
    shells = [surface for surface, _ in pairs if surface.of_shell]
    ratios = sorted({s.width_to_thickness for s in shells if s.width_to_thickness is not None})
    fast = [place for place, (surface, _) in enumerate(pairs) if surface.of_strip]
    around = (WALL, *ARROWS)
    seen = {place for place, (surface, _) in enumerate(pairs) if surface.kind in around}
    seen |= set(fast[:1] if shells else fast)  # several strips are seen together
    if shells:
        thinnest = max(range(len(shells)), key=lambda k: (shells[k].width_to_thickness or 0.0, -k))
        seen.add([place for place, (surface, _) in enumerate(pairs) if surface.of_shell][thinnest])
    shown = []
    for place, (surface, sheet) in enumerate(pairs):
        if not surface.of_shell:
            colour = {STRIP: RIBBON_COLOUR, PUSH: PUSH_COLOUR, RUB: RUB_COLOUR}.get(surface.kind, WALL_COLOUR)
        elif surface.width_to_thickness is None:
            colour = shell_colour(shells.index(surface))
        else:
            colour = shell_colour(ratios.index(surface.width_to_thickness))
        partner = _partner(sheet, [(k, pairs[k][1]) for k in fast]) if surface.of_shell else None
        path = (states or {}).get(surface.states)
        if surface.kind in ARROWS:
            path = None if path is None else moving(path, surface.kind)
            kept = Sheet(sheet.points, sheet.triangles, {**sheet.scalars(), "_normal": sheet.normals()})
        else:
            kept = thinned(sheet, points_each)
        shown.append(Shown(surface, kept, _rgb(colour), place in seen, partner, path))
    own = [one for one in shown if one.surface.kind not in around]
    clouds = [one.sheet.points for one in own] or [one.sheet.points for one in shown]
    clouds += [one.states.points.reshape(-1, 3) for one in own if one.states is not None]
    cloud = np.concatenate(clouds)
    upwards = np.asarray((0.0, 0.0, 1.0) if up is None else up, dtype=float)
    upwards = upwards / np.linalg.norm(upwards)
    along = screen_axes(clouds, upwards)[0][0]
    if not np.isfinite(along).all():  # a cloud along the direction upwards has no main horizontal direction
        along = np.cross(upwards, np.eye(3)[np.argmin(np.abs(upwards))])
        along /= np.linalg.norm(along)
    centre = 0.5 * (cloud.min(axis=0) + cloud.max(axis=0))
    radius = float(np.linalg.norm(cloud - centre, axis=1).max()) or 1.0
    field = next((s.colour for s, _ in pairs if s.colour), "")
    found = View(tuple(shown), centre, 1.0, 1.0, radius, along, upwards, up, field if field in fields(shown) else "")
    for _ in range(3):
        found = _fitted(found, cloud)
    return found


def _rgb(colour: str) -> tuple[float, float, float]:
    """Red, green and blue (0 to 1) of "#rrggbb"."""
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red, green, blue


def _fitted(found: View, cloud: FloatArray) -> View:
    """The view with the middle of what is seen in the middle, and a distance at which it fills the view."""
    away_ = found.away
    right = np.cross(found.upwards, away_)
    right /= np.linalg.norm(right)
    up = np.cross(away_, right)
    relative = cloud - found.centre
    x, y, z = relative @ right, relative @ up, relative @ away_
    centre = found.centre + 0.5 * (x.min() + x.max()) * right + 0.5 * (y.min() + y.max()) * up
    x, y = x - 0.5 * (x.min() + x.max()), y - 0.5 * (y.min() + y.max())
    tangent = np.tan(FIELD_OF_VIEW / 2.0)
    high = max(float((z + 1.12 * np.abs(y) / tangent).max()), 1.2 * found.radius)
    wide = float((z + 1.12 * np.abs(x) / tangent).max())
    radius = float(np.linalg.norm(cloud - centre, axis=1).max()) or 1.0
    return View(found.surfaces, centre, high, wide, radius, found.along, found.upwards, found.up, found.field)


def _partner(sheet: Sheet, fast: Sequence[tuple[int, Sheet]]) -> int | None:
    """The place of the surface whose points are the same particles as the sheet's; None where there is none."""
    if sheet.shape is None:
        return None
    for place, other in fast:
        if other.shape == sheet.shape and all(np.allclose(other.fields[x], sheet.fields[x], atol=1e-9) for x in "Sv"):
            return place
    return None


def thinned(sheet: Sheet, most: int) -> Sheet:
    """At most about `most` points: rows and columns of a grid, a decimated mesh otherwise; fields by point."""
    scalars = {name: values for name, values in sheet.scalars().items() if np.isfinite(values).any()}
    if sheet.shape is not None:
        along, across = sheet.shape
        columns = _spread(across, _MOST_ACROSS if most >= 1000 else 5)
        rows = _spread(along, max(2, most // len(columns)))
        kept = (rows[:, None] * across + columns).ravel()
        fields_ = {name: values[kept] for name, values in scalars.items()}
        fields_["_normal"] = sheet.normals()[kept]
        return Sheet(sheet.points[kept], triangles(len(rows), len(columns)), fields_)
    if len(sheet.points) <= most:
        return Sheet(sheet.points, sheet.triangles, {**scalars, "_normal": sheet.normals()})
    import pyvista
    from scipy.spatial import cKDTree

    faces = np.column_stack([np.full(len(sheet.triangles), 3), sheet.triangles])
    coarse = pyvista.PolyData(sheet.points, faces.ravel()).decimate(1.0 - most / len(sheet.points))
    points = np.asarray(coarse.points, dtype=float)
    nearest = cKDTree(sheet.points).query(points)[1]
    fields_ = {name: values[nearest] for name, values in scalars.items()}
    fields_["_normal"] = sheet.normals()[nearest]
    return Sheet(points, np.asarray(coarse.faces).reshape(-1, 4)[:, 1:].astype(np.int64), fields_)


def _spread(count: int, most: int) -> NDArray[np.int64]:
    """At most `most` of the indices below `count`, both ends included."""
    return np.unique(np.round(np.linspace(0, count - 1, min(count, max(most, 2)))).astype(np.int64))


def points_each(count: int) -> int:
    """How many points each of `count` surfaces of a report may keep."""
    return int(np.clip(MOST_POINTS // max(count, 1), _LEAST_POINTS, MOST_POINTS_EACH))


def fields(shown: Sequence[Shown]) -> dict[str, str]:
    """Scalar fields of the surfaces and what they are called, in order."""
    names = dict.fromkeys(name for one in shown for name in one.sheet.fields if name != "_normal")
    return {name: WORDS.get(name, name.replace("_", " ")) for name in names}


def field_range(values: FloatArray) -> tuple[float, float, float, float]:
    """Smallest and largest value, and the ends of the scale of colours, which leaves out `OUTLIERS` at either end."""
    known = values[np.isfinite(values)]
    low, high = np.quantile(known, [OUTLIERS, 1.0 - OUTLIERS])
    least, most = float(known.min()), float(known.max())
    wide = high - low > 0.7 * (most - least)  # nothing worth leaving out
    return least, most, *((least, most) if wide else (float(low), float(high)))


def as_data(found: View, alt: str) -> dict[str, Any]:
    """The view for viewer.js: numbers as base64 of little-endian arrays.

    places: uint16 (N, 3), 0 to 65535 over the box from low by span; normals: int16 (N, 3); field: uint16 (N,), 0 to
    65534 from low to high, 65535 where nothing is known; triangles: uint16, left out for a grid (along, across), whose
    seam says how its ends meet (`compare.pages.export.vtu.seam`).
    frames: states along a path, one after another, on a grid of their own, with the same scale for all of them.
    """
    clouds = [one.sheet.points for one in found.surfaces]
    clouds += [one.states.points.reshape(-1, 3) for one in found.surfaces if one.states is not None]
    cloud = np.concatenate(clouds)
    low = cloud.min(axis=0)
    span = np.where(np.ptp(cloud, axis=0) > 0.0, np.ptp(cloud, axis=0), 1.0)
    surfaces = []
    for one in found.surfaces:
        sheet = one.sheet
        entry: dict[str, Any] = {
            "label": one.surface.label,
            "kind": one.surface.kind,
            "colour": one.colour,
            "shown": one.first,
            "ratio": one.surface.width_to_thickness,
            "partner": one.partner,
            "places": _packed(np.round(65535 * (sheet.points - low) / span), "<u2"),
            "normals": _packed(np.round(32767 * sheet.fields["_normal"]), "<i2"),
            "fields": {name: _quantised(values) for name, values in sheet.fields.items() if name != "_normal"},
        }
        shape = sheet.shape
        if shape is None:
            entry["triangles"] = _packed(sheet.triangles, "<u2")
        else:
            entry["grid"] = shape
            entry["seam"] = seam(sheet.points.reshape(*shape, 3))
        if one.states is not None and len(one.states.labels) > 1:
            entry["frames"] = {
                "grid": one.states.points.shape[1:3],
                "labels": one.states.labels,
                "places": _packed(np.round(65535 * (one.states.points - low) / span), "<u2"),
                "fields": {name: _quantised(values) for name, values in one.states.fields.items()},
            }
        surfaces.append(entry)
    return {
        "alt": alt,
        "low": low.tolist(),
        "span": span.tolist(),
        "centre": found.centre.tolist(),
        "high": found.high,
        "wide": found.wide,
        "radius": found.radius,
        "along": found.along.tolist(),
        "upwards": found.upwards.tolist(),
        "up": found.up,
        "azimuth": AZIMUTH,
        "elevation": ELEVATION,
        "field": found.field,
        "clipped": CLIPPED,
        "file": "surfaces.png",
        "names": fields(found.surfaces),
        "surfaces": surfaces,
    }


def _quantised(values: FloatArray) -> dict[str, Any]:
    low, high, first, last = field_range(values)
    scaled = np.round(65534 * (values - low) / ((high - low) or 1.0))
    return {
        "low": low, "high": high, "from": first, "to": last,
        "values": _packed(np.where(np.isfinite(values), scaled, 65535), "<u2"),
    }  # fmt: skip


def _packed(values: NDArray[Any], kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values.astype(kind)).tobytes()).decode("ascii")
