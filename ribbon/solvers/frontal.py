"""Factors of sparse symmetric indefinite matrices along a strip, with their inertia; time and memory linear in length.

The elimination is `ribbon.solvers.frontal_kernels`'. Nothing here calls a BLAS: the same digits on any number of
threads.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ribbon.solvers import frontal_kernels as kernels

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Least size of a pivot over what stands beside it (u of the kernels). Fronts are refined: 1e-6 delays next to nothing.
THRESHOLD = 1e-6
#: Size of a pivot of the scaled matrix that counts as zero.
_TINY = 1e-20
#: What is taken off the diagonal of soft unknowns of the scaled matrix: rounding of what they may repeat.
SOFT = 3e-14
_ROUNDS = 2
#: Residual of a solution, over its right side, that is refined no more.
EXACT = 1e-14


class Pattern:
    """Where the entries of a symmetric matrix stand, and in which order its unknowns are eliminated.

    one, other (k,): places of the entries of one triangle, those of one place are added; an entry with a negative place
    is left out. group (n,): when each unknown is eliminated, 0, 1, ...
    """

    def __init__(self, one: IntArray, other: IntArray, group: IntArray) -> None:
        kept = np.nonzero((one >= 0) & (other >= 0))[0]
        n, groups = group.size, int(group.max(initial=-1)) + 1
        order = np.empty(kept.size, dtype=np.int64)
        self.group = group
        self.entries, self.touches = np.empty(groups + 1, dtype=np.int64), np.empty(groups + 1, dtype=np.int64)
        self.touched = kernels.arrange(one[kept], other[kept], group, self.entries, order, self.touches)
        self.taken = kept[order]
        self.one, self.other = one[self.taken], other[self.taken]
        self._room, self._capacity = 64, 20 * n + 64
        self._spare: list[kernels.Pivots] = []

    @property
    def size(self) -> int:
        """Number of unknowns n."""
        return self.group.size

    def factor(self, values: FloatArray, soft: IntArray | None = None, threshold: float = THRESHOLD) -> Factor:
        """The factor of the matrix with these entries (k,); soft: unknowns whose diagonal is made smaller by `SOFT`.

        Values that are not finite give a factor that says so.
        """
        n = self.size
        scaled = values[self.taken]
        scale = np.ones(n)
        one, other = self.one, self.other
        finite = bool(np.all(np.isfinite(scaled)))
        if not finite:
            scaled = np.zeros_like(scaled)
        kernels.equilibrate(one, other, scaled, _ROUNDS, scale)
        if soft is not None and soft.size:
            diagonal = self._diagonals()[soft]
            scaled[diagonal] -= SOFT
        matrix = kernels.Entries(self.group, self.entries, one, other, scaled, self.touched, self.touches)
        while True:
            filled = self._spare.pop() if self._spare else self._empty()
            said, pivots, negative, zero, delayed = kernels.eliminate(matrix, threshold, _TINY, self._room, filled)
            if said == kernels.DONE:
                break
            if said == kernels.FRONT_FULL:
                self._room = 2 * max(self._room, int(pivots))
                self.give_back(filled)
            else:
                self._capacity *= 2
                self._spare.clear()
        return Factor(
            self, scaled, scale, int(pivots), int(negative) if finite else -1, int(zero), int(delayed), finite,
            filled,
        )  # fmt: skip

    def _empty(self) -> kernels.Pivots:
        """Room for a factor."""
        n, most = self.size, self._capacity
        return kernels.Pivots(
            np.empty((n, 2), dtype=np.int64), np.empty((n, 3)), np.empty(n + 1, dtype=np.int64),
            np.empty(most, dtype=np.int64), np.empty(most), np.empty(most),
        )  # fmt: skip

    def give_back(self, filled: kernels.Pivots) -> None:
        """The room of a factor that is gone is that of the next."""
        if not self._spare and filled.column.size == self._capacity:
            self._spare.append(filled)

    def _diagonals(self) -> IntArray:
        """Place among the entries of a diagonal one of every unknown (n,), -1 where there is none."""
        found = np.full(self.size, -1)
        on = np.nonzero(self.one == self.other)[0]
        found[self.one[on]] = on
        return found


@dataclass(frozen=True)
class Factor:
    """A factorised matrix: pivots of one or two unknowns, in order; so many eigenvalues are negative and zero.

    delayed: unknowns left to a later front, summed over the fronts. Solutions are those of the matrix with its soft
    unknowns.
    """

    pattern: Pattern
    values: FloatArray
    scale: FloatArray
    pivots: int
    negative: int
    zero: int
    delayed: int
    finite: bool
    filled: kernels.Pivots

    def solve(self, b: FloatArray, refinements: int = 2, enough: float = EXACT) -> FloatArray:
        """x with K x = b, (n,) or (n, k), refined as long as the residual falls and exceeds `enough` of b."""
        scale = self.scale.reshape(-1, 1)
        right = scale * b.reshape(self.scale.size, -1)
        x = right.copy()
        self._substitute(x)
        product = np.empty_like(x)
        last = np.inf
        least = enough * float(np.abs(right).max(initial=0.0))
        for _ in range(refinements):
            kernels.times(self.pattern.one, self.pattern.other, self.values, x, product)
            product = right - product
            worst = float(np.abs(product).max(initial=0.0))
            if not least < worst < last:
                break
            last = worst
            self._substitute(product)
            x += product
        return (scale * x).reshape(b.shape)

    def __del__(self) -> None:
        self.pattern.give_back(self.filled)

    def _substitute(self, b: FloatArray) -> None:
        kernels.substitute(self.pivots, *self.filled, b)


@dataclass(frozen=True)
class Factored:
    """A symmetric saddle matrix K (n + m, n + m), factored, with how many of its lines are rows of constraints."""

    factor: Factor
    rows: int

    @property
    def unstable(self) -> int:
        """Negative eigenvalues on the tangent of the rows in force."""
        return self.factor.negative - self.rows

    def solve(self, b: FloatArray) -> FloatArray:
        """K^-1 b."""
        return self.factor.solve(b, 3)

    def solve_transposed(self, b: FloatArray) -> FloatArray:
        """K is symmetric."""
        return self.factor.solve(b, 3)
