r"""What a clamp at s = l asks of a strip that bends in a plane: two coordinates, an angle, or some of these.

The mixed problem holds them by rows e(x) = A x - b (`ribbon.problems.held`): of the end's position those along t_y and
t_z of the start, of its frame the turn about t_x; the others are zero in the plane. With dx = Z domega of eq. (5.22) of
docs/theory.md, eq. (5.23):

    de/domega = A Z ,   dE/domega - sum_k mu_k dg_k/domega - (A Z)^T nu = 0 ,

nu a force and a moment; A is constant, so that second derivatives come with the glue's multipliers alone. A step stays
on e = 0 to first order, and is put back on it by Newton's steps of least length.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.element import quaternion
from ribbon.problems.conditions import LinearRows
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]

#: How far (l, rad) an end's clamp may be out of the plane of the start's.
_FLAT = 1e-9


class Tied(NamedTuple):
    """At a shape: de/domega (m, p + 1), nu (m,), and orthonormal columns (p + 1, p + 1 - m) along which e stays."""

    slopes: FloatArray
    nu: FloatArray
    along: FloatArray


class Ends:
    """The rows of one problem; `count` of them, none where its end is free."""

    def __init__(self, problem: MixedProblem) -> None:
        self._problem = problem
        parts: list[tuple[str, FloatArray]] = []
        blocks = problem.blocks()
        if problem.end is not None and problem.start_quaternion is not None:
            across = quaternion.matrix(np.asarray(problem.start_quaternion)[None, :])[0][:, 1:]
            parts = [("end_position", across.T), ("end_frame", np.array([[1.0, 0.0, 0.0]]))]
        self._parts = [part for part in parts if part[0] in blocks]
        self.count = sum(len(part) for _, part in self._parts)
        self._matrix = np.zeros((self.count, problem.size))
        self._value = np.zeros(self.count)
        at = 0
        for name, part in self._parts:
            rows, own = blocks[name], slice(at, at + len(part))
            assert isinstance(rows, LinearRows)
            self._matrix[own, rows.columns] = part @ rows.coefficients
            self._value[own] = part @ rows.value
            at += len(part)

    def off(self, x: FloatArray) -> FloatArray:
        """e (m,) of the unknowns x (n,), l and rad."""
        return np.asarray(self._matrix @ x - self._value)

    def slopes(self, moves: FloatArray) -> FloatArray:
        """de/domega (m, p + 1)."""
        return np.asarray(self._matrix @ moves)

    def tied(self, moves: FloatArray, left: FloatArray) -> Tied:
        """With the nu that leaves least of what is left (p + 1,) without it."""
        slopes = self.slopes(moves)
        if not self.count:
            return Tied(slopes, np.zeros(0), np.eye(left.size))
        base, _ = np.linalg.qr(slopes.T, mode="complete")
        nu = np.linalg.lstsq(slopes.T, left, rcond=None)[0]
        return Tied(slopes, nu, base[:, self.count :])

    def pull(self, nu: FloatArray) -> FloatArray:
        """A^T nu (n,)."""
        return np.asarray(nu @ self._matrix)

    def write(self, problem: MixedProblem, nu: FloatArray, rows: FloatArray) -> None:
        """The multipliers of these rows into those of all rows of a problem that has them too."""
        at = 0
        for name, part in self._parts:
            rows[problem.block_slices()[name]] = -(nu[at : at + len(part)] @ part)
            at += len(part)


def in_plane(problem: MixedProblem) -> bool:
    """Whether what is held at s = l is in the plane of a start that is held; True where nothing is."""
    if problem.end is None:
        return True
    if problem.start_position is None or problem.start_quaternion is None:
        return False
    axis = quaternion.matrix(np.asarray(problem.start_quaternion)[None, :])[0][:, 0]
    place, frame = problem.end_position, problem.end_quaternion
    flat = place is None or abs(float(axis @ (place - problem.start_position))) <= _FLAT
    if frame is None:
        return flat
    other = quaternion.matrix(np.asarray(frame)[None, :])[0][:, 0]
    return flat and float(np.abs(other - axis).max()) <= _FLAT
