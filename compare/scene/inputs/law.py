"""A quantity along the strip at rest, as data: linear between its ends, or a table of points.

``(value at s = 0, value at s = length)`` or ``((s, value), ...)``, three points or more from 0 to the length. A table
of two points is the linear law between them and stands as that.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Linear = tuple[float, float]
Law = Linear | tuple[Linear, ...]

FloatArray = NDArray[np.float64]

#: How near, over the length, a table's first and last point are to the strip's ends.
NEAR = 1e-9
#: Values by which a table stands where only values at equal distances are known.
SAMPLES = 201


def is_table(law: Any) -> bool:
    """Whether a law is a table."""
    return isinstance(law, (tuple, list)) and bool(law) and isinstance(law[0], (tuple, list))


def knots(law: Law) -> tuple[FloatArray, FloatArray]:
    """Abscissae, of a law over [0, 1], and values (k,) between which it is linear."""
    if is_table(law):
        table = np.array(law, dtype=float)
        return table[:, 0], table[:, 1]
    return np.array([0.0, 1.0]), np.array(law, dtype=float)


def values(law: Law) -> tuple[float, ...]:
    """The values at the points of a law."""
    return tuple(float(x) for x in knots(law)[1])


def at(law: Law, s: ArrayLike) -> FloatArray:
    """The law over [0, 1] at s, any shape."""
    if is_table(law):
        return np.asarray(np.interp(np.asarray(s, dtype=float), *knots(law)))
    start, end = law
    return np.asarray(start + (end - start) * np.asarray(s))  # type: ignore[operator]


def turn(law: Law) -> float:
    """Its integral over [0, 1]; of a curvature the angle by which the strip turns."""
    s, y = knots(law)
    return float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(s)))


def constant(law: Law) -> float:
    """1/2 of the integral of its square over [0, 1]: of K l what `Energy.elastic` leaves out, D w / l."""
    if not is_table(law):
        start, end = law
        return float((start * start + start * end + end * end) / 6.0)  # type: ignore[operator]
    s, y = knots(law)
    a, b = y[:-1], y[1:]
    return float(np.sum(np.diff(s) * (a * a + a * b + b * b)) / 6.0)


def scaled(law: Law, length: float) -> Law:
    """A law of the scene, abscissae in its unit of length and 1/length, as one over [0, 1] and without unit."""
    if not is_table(law):
        start, end = law
        return start * length, end * length  # type: ignore[operator]
    s, y = knots(law)
    return tuple((float(a), float(b)) for a, b in zip(s / s[-1], y * length, strict=True))


def even(law: Law) -> tuple[float, ...]:
    """Its values at equal distances: two of a linear law, `SAMPLES` of a table."""
    return tuple(at(law, np.linspace(0.0, 1.0, SAMPLES)).tolist()) if is_table(law) else values(law)


def words(law: Law, symbol: str = "K l") -> str:
    """A law without unit in words: "K l = 3", "K l from 1 to 3", "K l from a table of 5 points, -2 to 3"."""
    y = values(law)
    if is_table(law):
        return f"{symbol} from a table of {len(y)} points, {min(y):g} to {max(y):g}"
    start, end = y
    return f"{symbol} = {start:g}" if start == end else f"{symbol} from {start:g} to {end:g}"


def fault(table: Sequence[Sequence[float]], length: float) -> tuple[str, str] | None:
    """What is wrong with the points of a table for a strip of this length, and the remedy; None: nothing."""
    s = [point[0] for point in table]
    if len(s) < 2:
        return "is a table of one point", f"give one number, {table[0][1]:g}, or points from s = 0 to {length:g}"
    if any(b <= a for a, b in pairwise(s)):
        return "has points that are not in the order of s", "write them with s ascending, each s once"
    if abs(s[0]) > NEAR * length or abs(s[-1] - length) > NEAR * length:
        return (
            f"is a table from s = {s[0]:g} to {s[-1]:g}, and the strip goes from 0 to {length:g}",
            f"let its first point be [0, K], its last [{length:g}, K]",
        )
    return None


def read(table: Sequence[Sequence[float]], length: float) -> Law:
    """The law of a table without fault; ends exactly at 0 and `length`."""
    points = [(float(s), float(y)) for s, y in table]
    points[0], points[-1] = (0.0, points[0][1]), (float(length), points[-1][1])
    return (points[0][1], points[-1][1]) if len(points) == 2 else tuple(points)
