"""A curvature or twist at rest along a strip of length 1: linear, or straight lines between the points of a table.

A law is ``(value at s = 0, value at s = 1)`` or ``((s, value), ...)``, three points or more, ascending from 0 to 1.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

Pair = tuple[float, float]
Law = Pair | tuple[Pair, ...]

NEAR = 1e-9
"""Distance (l) within which two abscissae are one."""


def is_table(law: Law) -> bool:
    """Whether a law is a table."""
    return isinstance(law[0], tuple)


def knots(law: Law) -> tuple[np.ndarray, np.ndarray]:
    """Abscissae and values (k,) between which a law is linear."""
    if is_table(law):
        table = np.array(law, dtype=float)
        return table[:, 0], table[:, 1]
    return np.array([0.0, 1.0]), np.array(law, dtype=float)


def sizes(law: Law) -> list[float]:
    """Absolute values at the points of a law."""
    return [abs(float(x)) for x in knots(law)[1]]


def value(law: Law, s: Any) -> np.ndarray:
    """The law at s, any shape."""
    if is_table(law):
        return np.asarray(np.interp(s, *knots(law)))
    start, end = law
    return np.asarray(start * (1.0 - s) + end * s)


def slope(law: Law, s: Any) -> np.ndarray:
    """Its derivative at s; at a kink that of the piece behind it."""
    x, y = knots(law)
    i = np.clip(np.searchsorted(x, s, side="right") - 1, 0, x.size - 2)
    return np.asarray((np.diff(y) / np.diff(x))[i])


def integral(law: Law, s: Any) -> np.ndarray:
    """int_0^s of the law, any shape: of a curvature the angle by which it turns."""
    if not is_table(law):
        start, end = law
        return np.asarray(start * s + 0.5 * (end - start) * s**2)  # type: ignore[operator]
    x, y = knots(law)
    whole = np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(x))])
    i = np.clip(np.searchsorted(x, s, side="right") - 1, 0, x.size - 2)
    h = s - x[i]
    return np.asarray(whole[i] + h * (y[i] + 0.5 * h * (np.diff(y) / np.diff(x))[i]))


def constant(law: Law) -> bool:
    """Whether a law is the same everywhere."""
    return bool(np.ptp(knots(law)[1]) == 0.0)


def square(law: Law) -> float:
    """int_0^1 of the law's square."""
    s, y = knots(law)
    a, b = y[:-1], y[1:]
    return float(np.sum(np.diff(s) * (a * a + a * b + b * b)) / 3.0)


def between(one: Law, other: Law, t: float) -> Law:
    """(1 - t) one + t other, on the points of both."""
    if not is_table(one) and not is_table(other):
        a, b = one, other
        return (1.0 - t) * a[0] + t * b[0], (1.0 - t) * a[1] + t * b[1]  # type: ignore[operator]
    s = np.union1d(knots(one)[0], knots(other)[0])
    y = (1.0 - t) * value(one, s) + t * value(other, s)
    return tuple((float(a), float(b)) for a, b in zip(s, y, strict=True))


def shifted(law: Law, by: float) -> Law:
    """The law plus a constant."""
    s, y = knots(law)
    return plain(np.column_stack([s, y + by]) if is_table(law) else y + by)


def cut(joints: np.ndarray, *laws: Law) -> np.ndarray:
    """Joints (n + 1,) of elements from 0 to 1, and the points of the laws where none of them is near."""
    points = inner(*laws)
    new = points[np.abs(joints[:, None] - points).min(axis=0) > NEAR]
    return joints if not new.size else np.sort(np.concatenate([joints, new]))


def inner(*laws: Law) -> np.ndarray:
    """Points (k,) of the laws between 0 and 1, ascending, none near another or an end."""
    tables = [knots(law)[0][1:-1] for law in laws if is_table(law)]
    points = np.unique(np.concatenate([np.zeros(0), *tables]))
    return points[(np.diff(points, prepend=0.0) > NEAR) & (points < 1.0 - NEAR)]


def fault(law: Any) -> str | None:
    """What is wrong with what is given as a law; None: nothing."""
    try:
        table = np.array(law, dtype=float)
    except (TypeError, ValueError):
        return "must be two numbers, at the start and at the end, or points (s, value)"
    if not np.all(np.isfinite(table)):
        return "must be finite"
    if table.shape == (2,):
        return None
    if table.ndim != 2 or table.shape[1] != 2 or len(table) < 3:
        return "must be two numbers, at the start and at the end, or three points (s, value) or more"
    s = table[:, 0]
    if not np.all(np.diff(s) > 0.0) or not math.isclose(s[-1], 1.0, abs_tol=NEAR) or abs(s[0]) > NEAR:
        return "must have its points in the order of s, from 0 to 1"
    return None


def plain(law: Any) -> Law:
    """A law without fault as nested tuples of floats."""
    table = np.array(law, dtype=float)
    if table.ndim == 1:
        return float(table[0]), float(table[1])
    return tuple((float(a), float(b)) for a, b in table)
