"""Twist that follows the centreline at once (du Peloux 2017, 4.4.4), and the gradient on the Bishop frame.

`QuasiStatic`: the angles are eliminated, at every x those that make the energy stationary, so that the positions alone
are unknowns. Twist goes through the whole rod: the Hessian is dense where that of positions and angles is a band.
`by_bishop`: derivatives by x at fixed theta. theta is p plus the reference twists m up to an edge, so that ::

    dE/dx at fixed theta = dE/dx at fixed p - sum_i (sum_(j >= i) dE/dp_j) dm_i/dx

with the inner sum a backward one, O(n): the int_t^L of eq. (4.62) of the thesis.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy

from ribbon.rods.curve_angle import CurveAngle, IntArray
from ribbon.rods.rod import FloatArray

#: Newton's steps for the angles, the largest of them (rad), and the twisting moment at which they end.
STEPS, REACH, SMALL = 50, 1.0, 1e-11


def angles_settled(problem: CurveAngle, y: FloatArray) -> FloatArray:
    """y with the angles for which no twisting moment is left (eq. 4.29), from those of y. A stiffness that is not
    positive is shifted until it is, so that the steps go down."""
    y = y.copy()
    size = max(problem.rod.stiffness)
    for _ in range(STEPS):
        found = problem.evaluated(y)
        if not np.isfinite(found.energy):
            return y
        moment = found.gradient[3::4]
        if np.abs(moment).max() <= SMALL * size:
            break
        band = np.array([found.band[0, 3::4], found.band[4, 3::4]])
        shift = 0.0
        while True:
            try:
                step = scipy.linalg.solveh_banded(band + np.array([[shift], [0.0]]), -moment, lower=True)
                break
            except np.linalg.LinAlgError:
                shift = max(2.0 * shift, 1e-3 * size)
        share, energy = min(1.0, REACH / max(float(np.abs(step).max()), 1e-300)), found.energy
        while share > 1e-8:
            new = y.copy()
            new[3::4] += share * step
            if problem.evaluated(new).energy <= energy + 1e-13 * max(1.0, abs(energy)):
                break
            share *= 0.5
        y = new
    return y


@dataclass
class QuasiStatic:
    """`ribbon.solvers.problem.ConstrainedProblem` in the positions (3 n + 3,) alone; `angles` (n,): those found last,
    from which the next are looked for."""

    problem: CurveAngle
    angles: FloatArray
    _kept: dict[bytes, FloatArray] = field(default_factory=dict)

    @property
    def rows(self) -> QuasiStatic:
        """All of it has rows, if none of them holds anything."""
        return self

    @property
    def strip(self) -> None:
        """A rod's residuals have the unit 1."""

    @property
    def slack(self) -> None:
        """As those."""

    @property
    def size(self) -> int:
        """3 n + 3."""
        return 3 * (self.problem.rod.edges + 1)

    @property
    def _own(self) -> IntArray:
        """Places of the positions among all unknowns."""
        return np.flatnonzero(np.arange(self.problem.size) % 4 != 3)

    def whole(self, x: FloatArray) -> FloatArray:
        """All unknowns (4 n + 3,) at the positions x."""
        key = x.tobytes()
        if key not in self._kept:
            y = np.empty(self.problem.size)
            y[self._own], y[3::4] = x, self.angles
            self._kept.clear()
            self._kept[key] = angles_settled(self.problem, y)
        y = self._kept[key]
        self.angles = y[3::4]
        return y

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Held positions are fixed unknowns."""
        lower, upper = self.problem.bounds()
        return lower[self._own], upper[self._own]

    def value(self, x: FloatArray) -> float:
        """The energy with twist that has settled."""
        return self.problem.value(self.whole(x))

    def gradient(self, x: FloatArray) -> FloatArray:
        """(3 n + 3,): that at fixed angles, as the energy is stationary in them."""
        return self.problem.gradient(self.whole(x))[self._own]

    def constraint_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Equalities."""
        return self.problem.constraint_bounds()

    def constraints(self, x: FloatArray) -> FloatArray:
        """Those of the rod."""
        return self.problem.constraints(self.whole(x))

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns."""
        row, column = self.problem.jacobian_structure()
        return row, np.searchsorted(self._own, column)

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Values in that structure."""
        return self.problem.jacobian(self.whole(x))

    def jacobian_matrix(self, x: FloatArray) -> Any:
        """Sparse (rows, 3 n + 3)."""
        return self.problem.jacobian_matrix(self.whole(x))[:, self._own]

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """The whole lower half."""
        row, column = np.tril_indices(self.size)
        return row.astype(np.int64), column.astype(np.int64)

    def hessian(self, x: FloatArray, multipliers: FloatArray, factor: float = 1.0) -> FloatArray:
        """Schur's complement of the angles, in that structure."""
        y, own, angles = self.whole(x), self._own, np.arange(3, self.problem.size, 4)
        pull = multipliers / factor if factor else multipliers
        full = self.problem.hessian_matrix(y, pull).toarray() * (factor or 1.0)
        mixed = full[np.ix_(angles, own)]
        dense = full[np.ix_(own, own)] - mixed.T @ np.linalg.solve(full[np.ix_(angles, angles)], mixed)
        return np.asarray(dense[self.hessian_structure()])


def by_bishop(problem: CurveAngle, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Derivatives of the elastic energy by the positions (n + 1, 3) at fixed theta, and by theta (n,), in O(n)."""
    here = problem.anchored(y)
    gradient = here.evaluated(y).gradient
    by_angle = gradient[3::4]
    by_place = here.positions(gradient).copy()
    edges = np.diff(here.positions(y), axis=0)
    sizes = np.linalg.norm(edges, axis=1)[:, None]
    t = edges / sizes
    behind = np.cumsum(by_angle[::-1])[::-1][:, None]  # of the cell before each edge and of all after it
    before = t[:-1] if problem.rod.start.frame is None else np.vstack([problem.rod.start.frame[:, 2], t[:-1]])
    after = t[1:] if problem.rod.start.frame is None else t
    behind = behind[1:] if problem.rod.start.frame is None else behind
    turn = behind * np.cross(before, after) / (1.0 + np.einsum("ij,ij->i", before, after))[:, None]
    first = problem.rod.edges - turn.shape[0]  # 0: the clamp's cell counts; its own edge is fixed
    by_edge = np.zeros_like(edges)
    by_edge[first:] -= turn / sizes[first:]
    inner = turn[1 - first :]
    by_edge[: inner.shape[0]] -= inner / sizes[: inner.shape[0]]
    by_place[1:] += by_edge
    by_place[:-1] -= by_edge
    return by_place, by_angle
