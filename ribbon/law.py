"""A natural curvature along the strip: linear between its ends, or a table of points with straight lines between them.

A law is data: (K at s = 0, K at s = l), or ((s, K), (s, K), ...) with three points or more, abscissae ascending from 0
to the strip's end. Where a table's slope jumps the curvature of a strip has a kink: segments end there (`cut`), so that
K is linear on each of them and no order is lost (docs/theory.md, eq. (2.12)).
"""

from __future__ import annotations

from itertools import pairwise
from typing import SupportsFloat

import numpy as np
from numpy.typing import NDArray

from ribbon.errors import RibbonInputError

FloatArray = NDArray[np.float64]
Linear = tuple[float, float]
Table = tuple[tuple[float, float], ...]
#: What a law is; a table of two points is the linear law between them and stands as that.
Law = Linear | Table

#: Distance (l) within which a joint and a point of a table are one, and a table's ends are the strip's.
SAME = 1e-9


def is_table(law: Law) -> bool:
    """Whether a law is a table."""
    return isinstance(law[0], tuple)


def points(law: Law, end: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """Abscissae and values (k,) between which a law is linear; end: abscissa of the strip's end."""
    if is_table(law):
        s, k = np.array(law, dtype=float).T
        return s, k
    return np.array([0.0, end]), np.array(law, dtype=float)


def values(law: Law) -> tuple[float, ...]:
    """K at the points of a law."""
    return tuple(k for _, k in law) if is_table(law) else law  # type: ignore[misc, return-value, union-attr]


def at(law: Law, s: FloatArray) -> FloatArray:
    """K at abscissae s (any shape) in l."""
    if is_table(law):
        return np.asarray(np.interp(s, *points(law)))
    start, end = law
    return np.asarray(start + (end - start) * s)  # type: ignore[operator]


def pieces(law: Law, lengths: FloatArray) -> FloatArray:
    """K at the start of every segment and its slope there (p, 2), both in l. `RibbonInputError` for a segment inside
    which the slope of a table jumps."""
    starts = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    if not is_table(law):
        start, end = law
        slope = end - start  # type: ignore[operator]
        found = np.empty((lengths.size, 2))
        found[:, 0], found[:, 1] = start + slope * starts, slope
        return found
    s, k = points(law)
    i = np.clip(np.searchsorted(s, starts + 0.5 * lengths) - 1, 0, s.size - 2)
    inside = (s[i + 1] < starts + lengths - SAME) | (s[i] > starts + SAME)
    if inside.any():
        at_fault = float(starts[np.argmax(inside)])
        raise RibbonInputError(
            "natural_curvature", f"a table with a point inside the segment from s = {at_fault:g} l",
            "end segments at its points: `ribbon.solve` cuts them there",
        )  # fmt: skip
    slope = (np.diff(k) / np.diff(s))[i]
    return np.column_stack([k[i] + slope * (starts - s[i]), slope])


def cut(law: Law, lengths: FloatArray) -> FloatArray:
    """Lengths of segments (p,) cut in two where a table has a point inside one; as they are for a linear law."""
    if not is_table(law):
        return lengths
    joints = np.concatenate([[0.0], np.cumsum(lengths)])
    joints[-1] = 1.0
    inner = points(law)[0][1:-1]
    new = inner[np.abs(joints[:, None] - inner).min(axis=0) > SAME]
    return lengths if not new.size else np.diff(np.sort(np.concatenate([joints, new])))


def part(law: Law, first: float, last: float) -> Law:
    """The law of the piece of a strip from `first` to `last` (l), over l as the whole: of a linear law its
    continuation over a whole length from there, of a table what it has there, in lengths of the piece."""
    if not is_table(law):
        start, end = law
        here = start + (end - start) * first  # type: ignore[operator]
        return here, here + (end - start)  # type: ignore[operator]
    s, k = points(law)
    inner = (s > first + SAME) & (s < last - SAME)
    place = np.concatenate([[first], s[inner], [last]])
    found = np.column_stack([(place - first) / (last - first), np.interp(place, s, k)])
    return read("natural_curvature", [tuple(row) for row in found.tolist()], 1.0)


def constant(law: Law) -> float:
    """1/2 int K^2 ds (D w / l)."""
    s, k = points(law)
    if not is_table(law):
        start, end = k.tolist()
        return float((start * start + start * end + end * end) / 6.0)
    return float(np.sum(np.diff(s) * (k[:-1] ** 2 + k[:-1] * k[1:] + k[1:] ** 2)) / 6.0)


def scaled(law: Law, length: float) -> Law:
    """A law of abscissae in a unit of length and 1/length as one of a strip of length 1."""
    if is_table(law):
        s, k = points(law)
        s = s / s[-1]
        return tuple(zip(s.tolist(), (k * length).tolist(), strict=True))
    start, end = law
    return start * length, end * length  # type: ignore[operator]


def read(key: str, value: object, length: float) -> Law:
    """A law from a number, two numbers, or a list of pairs (s, K) that covers [0, length].

    Raises `RibbonInputError` naming `key` for anything else."""
    if isinstance(value, (list, tuple, np.ndarray)):
        rows = list(value)
        if rows and all(isinstance(row, (list, tuple, np.ndarray)) for row in rows):
            return _table(key, rows, length)
        if len(rows) != 2:
            raise RibbonInputError(key, value, "one number, two (at s = 0 and s = l), or pairs [s, K]")
        return _finite(key, rows[0]), _finite(key, rows[1])
    number = _finite(key, value)
    return number, number


def _finite(key: str, value: object) -> float:
    """`value` as a float; RibbonInputError when it is no finite number."""
    if not isinstance(value, float) and (isinstance(value, (bool, str)) or not isinstance(value, SupportsFloat)):
        raise RibbonInputError(key, value, "a finite number is needed")
    number = float(value)
    if not np.isfinite(number):
        raise RibbonInputError(key, value, "a finite number is needed")
    return number


def _table(key: str, rows: list[object], length: float) -> Law:
    """Pairs (s, K); two of them are the linear law."""
    shown = [list(row) for row in rows]  # type: ignore[call-overload]
    if any(len(row) != 2 for row in shown):
        raise RibbonInputError(key, shown, "every point of a table is a pair [s, K]")
    s, k = ([_finite(key, row[c]) for row in shown] for c in (0, 1))
    if len(s) < 2:
        raise RibbonInputError(key, shown, f"a table has two points or more; one number is K = {k[0]:g} everywhere")
    if any(after <= before for before, after in pairwise(s)):
        raise RibbonInputError(key, shown, "the points of a table stand in the order of s, each s once")
    if abs(s[0]) > SAME * length or abs(s[-1] - length) > SAME * length:
        raise RibbonInputError(
            key, shown, f"covers s = {s[0]:g} to {s[-1]:g}: a table goes from 0 to the strip's length, {length:g}"
        )
    s[0], s[-1] = 0.0, length
    return (k[0], k[1]) if len(s) == 2 else tuple(zip(s, k, strict=True))
