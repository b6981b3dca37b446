"""Starting shapes: omega and eta at the joints, given, or fitted to what is held at the other end.

A shape far from the held end makes a minimiser satisfy the constraints by any means, rulings turned along the strip
among them. A few Gauss-Newton steps on a ribbon of a few segments bring the end near its place first; they need no
energy.
"""

from __future__ import annotations

import math

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.element import quaternion
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem

FloatArray = NDArray[np.float64]

#: Segments of the ribbon that is fitted, and weight of the distance to the shape that was asked for.
_PIECES = 8
_WEIGHT = 1e-2
#: Largest |eta| of a fitted shape (about 60 degrees).
_STEEPEST = 1.7
#: Largest |eta'| w / 2 of a seed beside a clamp that holds the ruling straight.
_STEEP = 0.5


def joints(lengths: FloatArray) -> FloatArray:
    """Abscissae (p + 1,) of the joints, the last exactly 1."""
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    s[-1] = 1.0
    return s


def sampled(values: tuple[float, ...], s: FloatArray) -> FloatArray:
    """A quantity given by `values` at equally spaced abscissae in [0, 1], piecewise linear, at s (k,)."""
    if len(values) == 1:
        return np.full(s.size, values[0])
    return np.interp(s, np.linspace(0.0, 1.0, len(values)), values)


def held_straight(problem: Problem, eta: FloatArray) -> FloatArray:
    """eta (p + 1,) with eta = 0 where a clamp holds the ruling straight, and from there steeply to what was asked for.

    A seed that leaves the plane then leaves it beside such a clamp too, whose bound would flatten a constant ruling.
    """
    s = joints(problem.lengths)
    held = eta.copy()
    for clamp, at in ((problem.start, 0.0), (problem.end, 1.0)):
        if clamp is not None and clamp.ruling == "straight":
            reach = _STEEP / problem.half_width * np.abs(s - at)
            held = np.clip(held, -reach, reach)
    return held


def end_mismatch(problem: MixedProblem, x: FloatArray) -> FloatArray:
    """What is missing at the end: position (3,) in l if held, rotation vector (3,) in rad if the frame is held."""
    first, last = problem.layout.joint(0), problem.layout.joint(-1)
    parts = []
    if problem.closure is not None:
        target_r, target_q = x[first.position], quaternion.compose(x[first.quaternion], problem.seam)
    else:
        target_r, target_q = problem.end_position, problem.end_quaternion  # type: ignore[assignment]
    if target_r is not None:
        parts.append(x[last.position] - target_r)
    if target_q is not None:
        parts.append(_rotation_vector(quaternion.compose(quaternion.conjugate(target_q), x[last.quaternion])))
    return np.concatenate(parts) if parts else np.empty(0)


def _rotation_vector(q: FloatArray) -> FloatArray:
    q = q if q[0] >= 0 else -q
    norm = float(np.linalg.norm(q[1:]))
    if norm < 1e-12:
        return 2.0 * q[1:]
    return 2.0 * math.atan2(norm, q[0]) * q[1:] / norm


def fitted(problem: MixedProblem, omega: FloatArray, eta: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """omega, eta (p + 1,) near the given ones whose end lies near where it is held, and the mismatch."""
    s = joints(problem.lengths)
    coarse = np.linspace(0.0, 1.0, _PIECES + 1)
    small = problem.with_changes(lengths=np.full(_PIECES, 1.0 / _PIECES))
    base = np.concatenate([np.interp(coarse, s, omega), np.interp(coarse, s, eta)])
    scale = np.concatenate([np.full(_PIECES + 1, 1.0 + np.abs(base[: _PIECES + 1]).max()), np.ones(_PIECES + 1)])
    steepest = min(_STEEPEST, 0.4 / (problem.half_width * _PIECES) + np.abs(base[_PIECES + 1 :]).max())

    def state(y: FloatArray) -> FloatArray:
        shape = base + scale * y
        return small.state(shape[: _PIECES + 1], np.clip(shape[_PIECES + 1 :], -steepest, steepest))

    def residual(y: FloatArray) -> FloatArray:
        return np.concatenate([end_mismatch(small, state(y)), _WEIGHT * y])

    found = scipy.optimize.least_squares(residual, np.zeros(base.size), method="lm", max_nfev=3000)
    x = state(found.x)
    missing = float(np.abs(end_mismatch(small, x)).max(initial=0.0))
    there, turned = small.joint_values(x)
    return np.interp(s, coarse, there), np.interp(s, coarse, turned), missing


def guesses(problem: MixedProblem) -> list[tuple[FloatArray, FloatArray]]:
    """Shapes to start from when the natural one says nothing (a flat strip held at both ends): arcs to either side."""
    s = joints(problem.lengths)
    none = np.zeros(s.size)
    distance = 1.0
    if problem.start_position is not None and problem.end_position is not None:
        distance = float(np.linalg.norm(problem.end_position - problem.start_position))
    arc = scipy.optimize.brentq(lambda c: math.sin(0.5 * c) / (0.5 * c) - min(distance, 0.999), 1e-3, 2 * math.pi)
    bend = arc * np.cos(2.0 * math.pi * s)
    return [(sign * shape, none + 0.02) for shape in (np.full(s.size, arc), bend) for sign in (1.0, -1.0)]
