"""The centreline from its curvatures: by scipy's `solve_ivp`, and as products of one matrix a segment with derivatives.

With Y = [R | r | z], R the frame (3, 3), r the position and z the integral of r from 0 to s, (1.1) of docs/theory.md is
the linear equation Y' = Y A(s); A (5, 5) holds the curvatures. A segment's matrix P is the product of exponentials of
Magnus's series of order 6 on short steps (Blanes, Casas, Oteo, Ros 2009, doi:10.1016/j.physrep.2008.11.001);
its first derivatives are complex steps, its second ones central differences of order 4 of those.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Largest turn (rad) of one step of Magnus's series, terms of the exponential.
_TURN = 0.05
_TERMS = 11
_TINY = 1e-100
_STEP = 2e-3


def generator(kappa: Any) -> Any:
    """A (..., 5, 5) from curvatures kappa (..., 3)."""
    matrix = np.zeros((*kappa.shape[:-1], 5, 5), dtype=kappa.dtype)
    one, two, three = kappa[..., 0], kappa[..., 1], kappa[..., 2]
    matrix[..., 0, 1], matrix[..., 1, 0] = -three, three
    matrix[..., 0, 2], matrix[..., 2, 0] = two, -two
    matrix[..., 1, 2], matrix[..., 2, 1] = -one, one
    matrix[..., 2, 3] = 1.0  # r' = R e_z
    matrix[..., 3, 4] = 1.0  # z' = r
    return matrix


def integrated(
    kappa: Callable[[float], FloatArray],
    joints: FloatArray,
    frame: FloatArray,
    position: FloatArray,
    wanted: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Positions (k, 3) and frames (k, 3, 3) at the abscissae `wanted` (k,), by the method DOP853 from joint to joint.

    kappa: curvatures (3,) at an abscissa; joints (p + 1,): where their derivatives jump; frame, position: at s = 0.
    """
    from scipy.integrate import solve_ivp

    def slope(s: float, y: FloatArray) -> FloatArray:
        turned = y[:9].reshape(3, 3)
        k1, k2, k3 = kappa(s)
        spin = np.array([[0.0, -k3, k2], [k3, 0.0, -k1], [-k2, k1, 0.0]])
        return np.concatenate([(turned @ spin).ravel(), turned[:, 2]])

    y = np.concatenate([np.asarray(frame, dtype=float).ravel(), position])
    found = np.empty((wanted.size, 12))
    found[wanted <= joints[0]] = y
    for low, high in itertools.pairwise(joints):
        inside = (wanted > low) & (wanted <= high)
        at = np.append(wanted[inside], high)
        path = solve_ivp(slope, (low, high), y, method="DOP853", t_eval=np.unique(at), rtol=1e-12, atol=1e-13)
        places = np.searchsorted(path.t, at)
        found[inside], y = path.y[:, places[:-1]].T, path.y[:, places[-1]]
    return found[:, 9:], found[:, :9].reshape(-1, 3, 3)


def _bracket(x: Any, y: Any) -> Any:
    """The commutator of the transposed equation, since A stands on the right of Y."""
    return y @ x - x @ y


def _matrix(q: Any, lengths: Any, steps: int) -> Any:
    """P (..., 5, 5) of segments with parameters q (..., 4) = (a, b, n, m) and lengths (...,)."""
    h = lengths[..., None, None] / steps
    result = np.broadcast_to(np.eye(5, dtype=q.dtype), (*q.shape[:-1], 5, 5))
    nodes = 0.5 + np.array([-1.0, 0.0, 1.0]) * np.sqrt(0.15)
    for step in range(steps):
        one, two, three = (generator(_curvatures(q, lengths / steps * (step + node))) for node in nodes)
        first = h * two
        second = np.sqrt(15.0) / 3.0 * h * (three - one)
        third = 10.0 / 3.0 * h * (three - 2.0 * two + one)
        both = _bracket(first, second)
        more = -_bracket(first, 2.0 * third + both) / 60.0
        total = first + third / 12.0 + _bracket(-20.0 * first - third + both, second + more) / 240.0
        term = result
        for k in range(1, _TERMS + 1):
            term = term @ total / k
            result = result + term
    return result


def _curvatures(q: Any, s: Any) -> Any:
    omega = q[..., 0] * s + q[..., 1]
    return np.stack([omega, np.zeros_like(omega), omega * (q[..., 2] * s + q[..., 3])], axis=-1)


@dataclass(frozen=True)
class Segments:
    """Matrices of segments: P (p, 5, 5), first (p, 4, 5, 5) and second (p, 4, 4, 5, 5) derivatives by (a, b, n, m)."""

    matrix: FloatArray
    first: FloatArray
    second: FloatArray


def segments(q: FloatArray, lengths: FloatArray) -> Segments:
    """The matrices of developable segments: q (p, 4), omega = a s + b and eta = n s + m on each; lengths (p,)."""
    size = np.maximum(np.abs(q[:, 1]), np.abs(q[:, 1] + q[:, 0] * lengths))
    slope = np.maximum(np.abs(q[:, 3]), np.abs(q[:, 3] + q[:, 2] * lengths))
    turn = float((size * np.hypot(1.0, slope) * lengths).max())
    steps = max(1, int(np.ceil(turn / _TURN)))
    scale = np.stack([1.0 / lengths**2, 1.0 / lengths, 1.0 / lengths, np.ones_like(lengths)], axis=1)
    scale = scale / np.maximum(1.0, (size * lengths)[:, None] * np.array([0.0, 0.0, 1.0, 1.0]))

    def slopes(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        """P (..., 5, 5) and its derivatives (..., 4, 5, 5), the latter times `scale`."""
        shaken = at[..., None, :] + 1j * _TINY * np.eye(4) * scale[:, None, :]
        found = _matrix(shaken, np.broadcast_to(lengths[:, None], shaken.shape[:-1]), steps)
        return found[..., 0, :, :].real, found.imag / _TINY

    matrix, first = slopes(q)
    second = np.zeros((len(q), 4, 4, 5, 5))
    for k in range(4):
        move = _STEP * np.eye(4)[k] * scale
        near = slopes(q + move)[1] - slopes(q - move)[1]
        far = slopes(q + 2.0 * move)[1] - slopes(q - 2.0 * move)[1]
        second[:, k] = (8.0 * near - far) / (12.0 * _STEP)
    second = 0.5 * (second + second.swapaxes(1, 2)) / (scale[:, :, None] * scale[:, None, :])[..., None, None]
    return Segments(matrix, first / scale[..., None, None], second)
