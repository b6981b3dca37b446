"""Whether what holds a strip balances what loads it: resultant force and moment, from the shape and the loads alone.

For a strip at rest (statics of a body, no constitutive law): with the weight Gamma per length along -up, the dead force
and moment at s = 1, the clamps' forces F and moments M, and walls that push along their normals n,

    sum F - Gamma up + F_tip + sum n f = 0,
    sum (M + r x F) + M_tip + r_1 x F_tip - Gamma G x up + sum f (r_c x n) = 0,     f >= 0,

G the centre of mass of the line (or of the surface, where the weight is that of the surface). How a wall's push is
shared among the points that touch is not asked: it must be possible (least squares with f >= 0, C. L. Lawson and
R. J. Hanson 1974, doi:10.1137/1.9781611971217). No solver's code is used. Lengths in l, forces in D w / l^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Points along s of the integral of the weight (Gauss: exact to rounding for a smooth shape).
_PANELS, _POINTS = 200, 4


@dataclass(frozen=True)
class Push:
    """What a wall does: its unit normal (3,), or of a round obstacle those (k, 3) at the points, its force (3,), the
    points (k, 3) that touch it."""

    normal: FloatArray
    force: FloatArray
    points: FloatArray


@dataclass(frozen=True)
class Wrench:
    """A force (3,) at a point (3,), and a moment (3,)."""

    point: FloatArray
    force: FloatArray
    moment: FloatArray


def abscissae() -> tuple[FloatArray, FloatArray]:
    """Abscissae (k,) from 0 to 1 and weights (k,) of the integral along the strip."""
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    left = np.linspace(0.0, 1.0, _PANELS + 1)[:-1]
    s = (left[:, None] + 0.5 * (nodes + 1.0) / _PANELS).ravel()
    return s, np.tile(0.5 * weights / _PANELS, _PANELS)


def unbalanced(
    wrenches: Sequence[Wrench], weight: FloatArray, centre: FloatArray, pushes: Sequence[Push] = ()
) -> float:
    """What is left of force and moment over the largest of them (at least 1), D w / l^2 and D w / l.

    wrenches: of clamps and of the tip; weight (3,): of the whole strip, at its centre of mass (3,); moments are taken
    about that centre, so that a strip far from the origin is judged as one at it. NaN where a number is not finite.
    """
    force = np.array(weight, dtype=float)
    moment = np.zeros(3)
    size = max(1.0, float(np.abs(force).max()))
    for one in wrenches:
        arm = np.cross(one.point - centre, one.force)
        force += one.force
        moment += one.moment + arm
        size = max(size, *(float(np.abs(part).max()) for part in (one.force, one.moment, arm)))
    for push in pushes:
        force += push.force
        size = max(size, float(np.abs(push.force).max()))
    if not (np.isfinite(force).all() and np.isfinite(moment).all()):
        return float("nan")
    if any(len(push.points) for push in pushes):
        moment = _after_pushes(moment, centre, [push for push in pushes if len(push.points)])
    return float(max(np.abs(force).max(), np.abs(moment).max()) / size)


def _after_pushes(moment: FloatArray, centre: FloatArray, pushes: Sequence[Push]) -> FloatArray:
    """The moment (3,) that the best shares of the walls' pushes leave over."""
    from scipy.optimize import nnls  # not before it is needed: it loads half of scipy

    arms, totals, sums, rows = [], [], [], []
    for number, push in enumerate(pushes):
        normals = np.broadcast_to(push.normal, push.points.shape)
        directions = push.normal[None, :] if push.normal.ndim == 1 else np.eye(3)  # in which its force is known
        for point, normal in zip(push.points, normals, strict=True):
            arms.append(np.cross(point - centre, normal))
            totals.append((number, normal))
        for direction in directions:
            sums.append(float(push.force @ direction))
            rows.append((number, direction))
    shares = np.array(
        [
            [float(normal @ direction) if total == number else 0.0 for total, normal in totals]
            for number, direction in rows
        ]
    )
    matrix = np.vstack([np.array(arms).T, shares])
    found, _ = nnls(matrix, np.concatenate([-moment, sums]))
    left = matrix @ found - np.concatenate([-moment, sums])
    return np.asarray(np.append(left[:3], np.abs(left[3:]).max()))
