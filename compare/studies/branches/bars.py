"""Errors of every point of a branch: the same point on elements halved twice, and what its numbers still change.

A regular point is put again at its own value of the number; where the branch goes all but across it (beside a fold)
across its tangent, so that the value too has an error. What a point's own elements give is compared with the limit
(`compare.measure.error.error_of_first`); it settles where the last change is smaller than the one before by the order
`compare.measure.mesh_limit.LEAST_ORDER` at least, or both are rounding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from compare.measure.error import error_of_first
from compare.measure.mesh_limit import LEAST_ORDER

FloatArray = NDArray[np.float64]

#: Rounding of a parameter and an energy (relative, at least 1), of a place on the strip (l), of a force (as energies).
PARAMETER, ENERGY, PLACE, FORCE = 1e-9, 1e-9, 1e-8, 1e-6


@dataclass(frozen=True)
class Numbers:
    """Of a point on some elements: its parameter, energy (D w / l), centreline (k, 3) in l, and the force (3,) in
    D w / l^2 that what holds s = l exerts on it, None: nothing does, or the model does not say."""

    parameter: float
    energy: float
    centreline: FloatArray
    force: FloatArray | None = None


@dataclass(frozen=True)
class Bars:
    """How far a point's own numbers are from those of the limit of finer elements.

    parameter: in its unit, 0 where it was put again at its own value; energy: D w / l; shape: largest distance between
    particles of the centreline, l; force: D w / l^2, None: there is none; settles: whether all of them settle, so that
    they are errors; else they are what is known, nan where finer elements have no such point."""

    parameter: float
    energy: float
    shape: float
    force: float | None
    settles: bool


def known(found: Bars | None, name: str) -> float | None:
    """One of them, "energy" and so on; None: not asked for, or nothing is known."""
    value = None if found is None else getattr(found, name)
    return None if value is None or not math.isfinite(value) else float(value)


def bars(found: Sequence[Numbers | None], level: bool) -> Bars:
    """Of the first of three points, each on elements half as long as the one before (None: there is none), put again at
    the same parameter (level) or where their branch is."""
    own = found[0]
    assert own is not None
    known = [numbers for numbers in found if numbers is not None]
    if len(known) < 3:
        none = float("nan")
        return Bars(0.0 if level else none, none, none, None if own.force is None else none, False)
    energy, ok_energy = _of([n.energy for n in known], ENERGY * max(1.0, abs(own.energy)))
    shape, ok_shape = _of_shapes([n.centreline for n in known])
    parameter, ok_parameter = (0.0, True)
    if not level:
        parameter, ok_parameter = _of([n.parameter for n in known], PARAMETER * max(1.0, abs(own.parameter)))
    force: float | None = None
    ok_force = True
    if own.force is not None:
        size = max(1.0, float(np.linalg.norm(own.force)))
        force, ok_force = _of([np.asarray(n.force) for n in known], FORCE * size)
    return Bars(parameter, energy, shape, force, ok_energy and ok_shape and ok_parameter and ok_force)


def _of(values: Sequence[ArrayLike], rounding: float) -> tuple[float, bool]:
    error = error_of_first(values)
    first, second = (float(np.linalg.norm(np.subtract(b, a))) for a, b in pairwise(values))
    if error is None:
        return float("nan"), False
    return error + rounding, falls(first, second, rounding)


def _of_shapes(lines: Sequence[FloatArray]) -> tuple[float, bool]:
    apart = np.array([np.linalg.norm(b - a, axis=1).max() for a, b in pairwise(lines)])
    error, _ = _of([0.0, apart[0], apart[0] + apart[1]], PLACE)  # as if all went one way: the furthest
    return error, falls(float(apart[0]), float(apart[1]), PLACE)


def falls(first: float, second: float, rounding: float) -> bool:
    """Whether a change falls enough with the halving of the elements, or both are rounding."""
    return second <= 2.0**-LEAST_ORDER * first + rounding
