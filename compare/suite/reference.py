r"""References that share no code with any solver here: a rod by collocation, planar elastica by elliptic integrals.

The rod (Antman; NumPy and SciPy alone), clamped at s = 0 and free at s = 1, lengths in l, forces in D w / l^2: the
force that the part beyond s exerts is n = F + (1 - s) f, f the weight per length, so that the frame R (a unit
quaternion q) and the moment m are all that is unknown::

    R' = R [kappa]_x ,   kappa = kappa_0 + B^-1 R^T m ,   r' = R (e_3 + C^-1 R^T n) ,   m' = -r' x n

with q(0) and m(1) given. The load grows from nothing in steps that are halved where SciPy's collocation fails.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp, solve_ivp
from scipy.optimize import brentq, root
from scipy.spatial.transform import Rotation
from scipy.special import ellipe, ellipk

FloatArray = NDArray[np.float64]
_LEAST = 1e-3


@dataclass(frozen=True)
class FreeRod:
    """A rod that is clamped at its start: bending stiffnesses about t_x and t_y and torsion (3,), curvatures at rest
    (3,), frame (3, 3) of the clamp with columns t_x t_y t_z, weight per length (3,), force (3,) and moment (3,) on the
    free end, compliances (3,) in shear along t_x, t_y and stretch. Units l, D w."""

    stiffness: FloatArray
    rest: FloatArray
    frame: FloatArray
    weight: FloatArray
    force: FloatArray
    moment: FloatArray
    compliance: FloatArray


def _frames(q: FloatArray) -> FloatArray:
    """Rotations (k, 3, 3) of quaternions (4, k), scalar first, of any length."""
    w, x, y, z = q / np.linalg.norm(q, axis=0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _quaternion(frame: FloatArray) -> FloatArray:
    """Quaternion (4,) of a rotation: the eigenvector of Bar-Itzhack's matrix."""
    (a, b, c), (d, e, f), (g, h, i) = frame
    k = np.array([
        [a + e + i, h - f, c - g, d - b], [h - f, a - e - i, b + d, c + g],
        [c - g, b + d, e - a - i, f + h], [d - b, c + g, f + h, i - a - e],
    ])  # fmt: skip
    found: FloatArray = np.linalg.eigh(k)[1][:, -1]
    return found


def _rates(rod: FreeRod, part: float, s: FloatArray, y: FloatArray) -> FloatArray:
    """y' (10, k) of y = (q, m, r) under `part` of the load."""
    q, m = y[:4], y[4:7]
    frames = _frames(q)
    n = part * (rod.force[:, None] + (1.0 - s) * rod.weight[:, None])
    local = np.einsum("kji,jk->ik", frames, m)
    kappa = rod.rest[:, None] + local / rod.stiffness[:, None]
    strain = rod.compliance[:, None] * np.einsum("kji,jk->ik", frames, n)
    strain[2] += 1.0
    tangent = np.einsum("kij,jk->ik", frames, strain)
    k1, k2, k3 = kappa
    w, x, yy, z = q
    turned = 0.5 * np.array([
        -x * k1 - yy * k2 - z * k3, w * k1 + yy * k3 - z * k2, w * k2 + z * k1 - x * k3, w * k3 + x * k2 - yy * k1,
    ])  # fmt: skip
    return np.vstack([turned, -np.cross(tangent.T, n.T).T, tangent])


def free_rod(rod: FreeRod, s: Sequence[float] = (1.0,), tolerance: float = 1e-9) -> FloatArray:
    """Positions (k, 3) at abscissae s, of the state that follows from the unloaded one as the load grows. Raises
    ArithmeticError where it does not go on."""
    positions: FloatArray = _solution(rod, tolerance).sol(np.asarray(s, dtype=float))[7:].T
    return positions


def _solution(rod: FreeRod, tolerance: float) -> Any:
    """SciPy's solution of y = (q, m, r)."""
    begin = _quaternion(rod.frame)
    nodes = np.linspace(0.0, 1.0, 40 + int(8 * np.abs(rod.rest).max()))

    def solved(part: float, x: FloatArray, y: FloatArray, tolerance: float):  # type: ignore[no-untyped-def]
        def ends(a: FloatArray, b: FloatArray) -> FloatArray:
            return np.concatenate([a[:4] - begin, b[4:7] - part * rod.moment, a[7:]])

        return solve_bvp(lambda t, u: _rates(rod, part, t, u), ends, x, y, tol=tolerance, max_nodes=40000)

    start = np.zeros((10, nodes.size))
    start[:4] = _at_rest(rod, begin, nodes)
    found = solved(0.0, nodes, start, 1e-4)
    part, step = 0.0, 0.1
    while part < 1.0:
        ahead = min(1.0, part + step)
        tried = solved(ahead, found.x, found.y, 1e-4)
        if tried.success and np.abs(tried.sol(found.x) - found.y).max() < 0.3 * (1.0 + np.abs(found.y).max()):
            found, part, step = tried, ahead, 1.5 * step
        elif step < _LEAST:
            raise ArithmeticError(f"the load does not go on from {part:.4f} of it")
        else:
            step *= 0.5
    fine = solved(1.0, found.x, found.y, tolerance)
    if not fine.success:
        raise ArithmeticError(fine.message)
    return fine


def both_ways(rod: FreeRod) -> tuple[FloatArray, FloatArray]:
    """The free end (3,) by collocation and by shooting."""
    fine = _solution(rod, 1e-9)
    return fine.sol(1.0)[7:], shot_rod(rod, _frames(fine.sol(np.array([1.0]))[:4])[0])


def _at_rest(rod: FreeRod, begin: FloatArray, nodes: FloatArray) -> FloatArray:
    """Quaternions (4, k) of the unloaded rod: one rotation about a fixed axis of its own frame."""
    size = float(np.linalg.norm(rod.rest))
    axis = rod.rest / size if size else rod.rest
    half = 0.5 * size * nodes
    w, x, y, z = begin
    left = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    turned: FloatArray = left @ np.vstack([np.cos(half), axis[:, None] * np.sin(half)])
    return turned


def shot_rod(rod: FreeRod, guess: FloatArray) -> FloatArray:
    """The free end (3,) of the same rod in another way: rotation matrices, integrated by Runge and Kutta's method of
    order 8 from the free end, whose frame (3, 3), near `guess`, is shot for until the clamp's comes out. Raises
    ArithmeticError where it does not."""

    def rates(s: float, y: FloatArray) -> FloatArray:
        frame, m = y[:9].reshape(3, 3), y[9:12]
        n = rod.force + (1.0 - s) * rod.weight
        k1, k2, k3 = rod.rest + frame.T @ m / rod.stiffness
        strain = np.array([0.0, 0.0, 1.0]) + rod.compliance * (frame.T @ n)
        spin = np.array([[0.0, -k3, k2], [k3, 0.0, -k1], [-k2, k1, 0.0]])
        tangent = frame @ strain
        return np.concatenate([(frame @ spin).ravel(), -np.cross(tangent, n), tangent])

    def walked(turn: FloatArray) -> tuple[FloatArray, FloatArray]:
        first = guess @ Rotation.from_rotvec(turn).as_matrix()
        begin = np.concatenate([first.ravel(), rod.moment, np.zeros(3)])
        y = solve_ivp(rates, (1.0, 0.0), begin, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
        return Rotation.from_matrix(y[:9].reshape(3, 3).T @ rod.frame).as_rotvec(), -y[12:]

    found = root(lambda turn: walked(turn)[0], np.zeros(3), tol=1e-10)
    if np.abs(walked(found.x)[0]).max() > 1e-7:
        raise ArithmeticError("shooting does not arrive at the clamp")
    return walked(found.x)[1]


# -- the planar elastica by elliptic integrals (Love 1927, sections 262 and 263)


def buckled_cantilever(alpha: float) -> tuple[float, float, float]:
    """Load P l^2 / (D w), height and side of the free end / l of a strip that is clamped upright under a dead load
    at its end, where it leans over by alpha (rad)."""
    m = math.sin(0.5 * alpha) ** 2
    k, e = float(ellipk(m)), float(ellipe(m))
    return k * k, 2.0 * e / k - 1.0, 2.0 * math.sqrt(m) / k


def clamped_arch(shortening: float) -> tuple[float, float]:
    """Thrust P l^2 / (D w) and rise / l of a strip between two clamps on one line, nearer by `shortening` l, that
    buckles to one side: four arcs from inflexion to crest."""

    def short(m: float) -> float:
        return 2.0 * (1.0 - float(ellipe(m)) / float(ellipk(m))) - shortening

    m = float(brentq(short, 1e-12, 1.0 - 1e-9, xtol=1e-15, rtol=1e-14))
    k = float(ellipk(m))
    return 16.0 * k * k, math.sqrt(m) / k
