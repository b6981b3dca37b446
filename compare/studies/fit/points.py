"""Measured points of a centreline: their file, their unit, their place in space, the nearest points of a shape."""

from __future__ import annotations

import csv
import math
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from compare.models.base import State
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]

#: Units of points -> metres; the unit of a strip that is not in SI counts as a metre.
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
#: Points along the centreline among which the nearest is looked for, and steps of Newton's iteration from there.
_ALONG, _STEPS = 1001, 8
#: Rounds of nearest points and best motion in turn where points are placed for the first time.
_ROUNDS = 30
#: A strip of length one reaches no farther; with what a measurement may be off.
REACH = 1.1


@dataclass(frozen=True)
class Points:
    """Measured points (n, 3) and, where they were given, their abscissae (n,), in l."""

    places: FloatArray
    s: FloatArray | None = None

    @property
    def extent(self) -> float:
        """Largest distance between two of them, l."""
        from scipy.spatial.distance import pdist

        return float(pdist(self.places).max(initial=0.0))

    def in_unit(self, factor: float) -> Points:
        """The same numbers read in a unit that is `factor` times as large."""
        return Points(factor * self.places, None if self.s is None else factor * self.s)


@dataclass(frozen=True)
class Motion:
    """A rigid motion of points: turned by the rotation vector `turn` (3,), rad, about `pivot` (3,), then moved by
    `shift` (3,); l."""

    turn: FloatArray
    shift: FloatArray
    pivot: FloatArray

    def of(self, places: FloatArray) -> FloatArray:
        """`places` (n, 3) moved."""
        from scipy.spatial.transform import Rotation

        return np.asarray(Rotation.from_rotvec(self.turn).apply(places - self.pivot) + self.pivot + self.shift)

    def slopes(self, places: FloatArray) -> FloatArray:
        """Derivatives (n, 3, 6) of the moved places by turn and shift.

        ``d(R a) = (J dphi) x (R a)``, J the left Jacobian of the rotation vector (T. D. Barfoot 2017, eq. 7.77).
        """
        angle = float(np.linalg.norm(self.turn))
        x, y, z = self.turn
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        if angle < 1e-4:
            left = np.eye(3) + 0.5 * cross + cross @ cross / 6.0
        else:
            left = (
                np.eye(3)
                + (1.0 - math.cos(angle)) / angle**2 * cross
                + (angle - math.sin(angle)) / angle**3 * cross @ cross
            )
        arms = self.of(places) - self.pivot - self.shift
        turns = np.stack([np.cross(column, arms) for column in left.T], axis=2)
        shifts = np.broadcast_to(np.eye(3), (len(places), 3, 3))
        return np.concatenate([turns, shifts], axis=2)


def unit_of(given: str | None) -> float:
    """--unit in units of the strip's length; `BadInput` for what is neither a unit nor a positive number."""
    if given is None:
        return 1.0
    try:
        found = UNITS.get(given) or float(given)
    except ValueError:
        found = math.nan
    if not (math.isfinite(found) and found > 0.0):
        raise BadInput("--unit", given, "is no unit of points", f"use {', '.join(UNITS)} or a positive number")
    return found


def read_points(path: str | Path, length: float, unit: float = 1.0) -> Points:
    """Points of a CSV file with the columns x, y, z and, if known, s.

    length: of the strip; unit: of the points, in that of `length`. Raises `BadInput` for a file that cannot be read, a
    missing column and, by its line, whatever is no number or no place on the strip.
    """
    try:
        rows = list(csv.reader(Path(path).read_text("utf-8-sig").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise BadInput("POINTS", str(path), f"cannot be read ({error})", "give a CSV file") from None
    head = [name.strip().lower() for name in rows[0]] if rows else []
    missing = [name for name in "xyz" if name not in head]
    if missing:
        raise BadInput(
            "POINTS", str(path), f"line 1 has no column {', '.join(missing)}",
            "begin with a line x,y,z or s,x,y,z (in the unit of strip.length, or of --unit)",
        )  # fmt: skip
    wanted = [*"xyz", *(["s"] if "s" in head else [])]
    found, lines = [], []
    for number, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        try:
            values = [float(row[head.index(name)]) for name in wanted]
        except (ValueError, IndexError):
            values = [math.nan]
        if not all(map(math.isfinite, values)):
            raise BadInput(
                "POINTS", str(path), f"line {number} has not {len(wanted)} finite numbers: {','.join(row)!r}",
                "mend that line or leave it out",
            )  # fmt: skip
        found.append(values)
        lines.append(number)
    table = np.array(found, dtype=float).reshape(-1, len(wanted)) * unit / length
    points = Points(table[:, :3], table[:, 3] if "s" in head else None)
    if points.s is not None:
        off = np.flatnonzero(~((points.s >= -1e-9) & (points.s <= 1.0 + 1e-9)))
        if off.size:
            given = found[off[0]][3]
            others = {name: points.s.max() * f for name, f in UNITS.items() if _reads(points, f / unit)}
            hint = (
                f"; in {' or '.join(others)} all would be: --unit {max(others, key=others.__getitem__)}"
                if others
                else ""
            )
            raise BadInput(
                "POINTS", str(path), f"line {lines[off[0]]}: s = {given:g} is not on the strip",
                f"give abscissae from 0 to strip.length = {length / unit:g}{hint}",
            )  # fmt: skip
        points = Points(points.places, np.clip(points.s, 0.0, 1.0))
    return points


def _reads(points: Points, factor: float) -> bool:
    """Whether points with abscissae could be the strip's in a unit that is `factor` times as large: on it, and on more
    than its first hundredth."""
    read = points.in_unit(factor)
    assert read.s is not None
    return bool(read.s.min() >= -1e-9 and 0.01 < read.s.max() <= 1.0 + 1e-9 and read.extent <= REACH)


def nearest(state: State, places: FloatArray) -> FloatArray:
    """Abscissae (n,) of the points of the centreline that are nearest to `places` (n, 3), to rounding."""
    from scipy.spatial import cKDTree

    assert state.shape is not None
    along = np.linspace(0.0, 1.0, _ALONG)
    s = along[cKDTree(state.shape.centreline(along)).query(places)[1]]
    for _ in range(_STEPS):
        frames = state.shape.frames(s)
        off = state.shape.centreline(s) - places
        bend = 1.0 - state.native.omega(s) * np.sum(off * frames[:, :, 1], axis=1)
        step = np.sum(off * frames[:, :, 2], axis=1) / np.maximum(bend, 0.1)
        s = np.clip(s - np.clip(step, -2.0 / _ALONG, 2.0 / _ALONG), 0.0, 1.0)
    return np.asarray(s)


def placed(state: State, points: Points) -> Motion:
    """The rigid motion that brings the points nearest to the centreline, over turns and shifts of any size.

    Of points with abscissae the best one (W. Kabsch 1976). Others are tried where they stand and as neighbours along
    the strip in the order of the file, both ways, from there by nearest points and best motion in turn (P. Besl and
    N. McKay 1992, doi:10.1109/34.121791); the nearest one is taken.
    """
    from scipy.spatial.transform import Rotation

    shape = state.shape
    assert shape is not None
    pivot = points.places.mean(axis=0)

    def onto(targets: FloatArray) -> Motion:
        away = targets - targets.mean(axis=0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # points on a line: any of the best will do
            turn = Rotation.align_vectors(away, points.places - pivot)[0].as_rotvec()
        return Motion(turn, targets.mean(axis=0) - pivot, pivot)

    if points.s is not None:
        return onto(shape.centreline(points.s))
    steps = np.linalg.norm(np.diff(points.places, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    room = max(1.0 - along[-1], 0.0)
    along = along / max(along[-1], 1.0)
    starts = [nearest(state, points.places)]
    starts += [first + path for first in (0.0, 0.5 * room, room) for path in (along, along[-1] - along)]
    best, least = Motion(np.zeros(3), np.zeros(3), pivot), math.inf
    for begun in starts:
        s = begun
        for _ in range(_ROUNDS):
            motion = onto(shape.centreline(s))
            s = nearest(state, motion.of(points.places))
        motion = onto(shape.centreline(s))
        left = float(np.linalg.norm(shape.centreline(s) - motion.of(points.places)))
        if left < 0.99 * least:
            best, least = motion, left
    return best
