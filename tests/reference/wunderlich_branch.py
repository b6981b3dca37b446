"""Branches of a strip between two clamps by `tests.reference.wunderlich_shooting`: followed, with folds and forks."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np

from tests.reference.wunderlich_shooting import SCALES, Found


def followed(first: Found, goes_on: Callable[[Found], bool], step: float = 0.01, least: float = 1e-6) -> list[Found]:
    """The branch from `first` on, as long as `goes_on`, the last point included: in each step the quickest control is
    given. A step is halved, as far as `least`, where none is found or the branch turns by more than 25 degrees."""
    points, now = [first], step
    while now >= least and goes_on(points[-1]):
        last = points[-1]
        control = last.quickest
        found = last.at(control, last[control] + now * SCALES[control] * np.sign(last.ahead(control)))
        if found is None or last.turned(found) < 0.9:
            now *= 0.5
        else:
            points.append(found)
            now = min(step, 1.5 * now)
    return points


def brackets(points: list[Found]) -> list[tuple[Found, Found]]:
    """Neighbours between which the shift turns, in their order along a branch."""
    return [pair for pair in itertools.pairwise(points) if pair[0].ahead("shift") * pair[1].ahead("shift") < 0.0]


def forks(points: list[Found]) -> list[tuple[Found, Found]]:
    """Neighbours between which another branch leaves: the equations' derivative has a sign, which does not change with
    what is given, and changes there."""
    pairs = itertools.pairwise(points)
    return [(a, b) for a, b in pairs if a.way * a.determinant[0] * b.way * b.determinant[0] < 0.0]


def fork(a: Found, b: Found, within: float = 1e-6) -> tuple[float, float] | None:
    """Shift of the one between a and b, and its error: by regula falsi (Illinois) of the determinant at a given value
    of b's control, as near as the equations, which are singular there, are solved; None: they are not on either side.
    """
    first = a if a.control == b.control else a.at(b.control, a[b.control])
    if first is None:
        return None

    def size(one: Found) -> float:
        return one.determinant[0] * math.exp(one.determinant[1] - b.determinant[1])

    low, high, weights = first, b, [1.0, 1.0]
    told = [math.nan, math.nan]
    for _ in range(20):
        fx, fy = weights[0] * size(low), weights[1] * size(high)
        share = fx / (fx - fy)
        told = [told[-1], low["shift"] + share * (high["shift"] - low["shift"])]
        value = low[b.control] + share * (high[b.control] - low[b.control])
        found = (high if share > 0.5 else low).at(b.control, value)
        if found is None or abs(told[1] - told[0]) < within:
            break
        if size(found) * size(high) < 0.0:
            low, weights = high, [weights[1], 1.0]
        else:
            weights[0] *= 0.5
        high, weights[1] = found, 1.0
    return told[1], abs(told[1] - told[0])


def fold(a: Found, b: Found) -> Found | None:
    """The one between a and b, by regula falsi (Illinois) in what moves there, to a change of the shift below ten of
    the integrator's tolerances; None: it is not found."""
    control = max(("height", "lift"), key=lambda one: abs(b[one] - a[one]) / SCALES[one])
    first, near = a.at(control, a[control]), b.at(control, b[control])
    return first and near and _root(first, near, control, lambda one: float(one.rate[-1]))


def _root(first: Found, near: Found, control: str, value: Callable[[Found], float]) -> Found | None:
    """The state between two at which a value of it is zero, by regula falsi (Illinois)."""
    (x, fx), (y, fy) = ((one[control], value(one)) for one in (first, near))
    best, within = near["shift"], 10.0 * near.problem.tolerance
    for _ in range(60):
        found = near.at(control, (x * fy - y * fx) / (fy - fx))
        if found is None:
            return None
        if abs(found["shift"] - best) < within:
            return found
        near, best, f = found, found["shift"], value(found)
        if f * fy < 0.0:
            x, fx = y, fy
        else:
            fx *= 0.5
        y, fy = found[control], f
    return None
