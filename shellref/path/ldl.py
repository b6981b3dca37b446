"""The tangent of a shell's elements: factored along its tree with the inertia, or put together in compressed rows."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import scipy.linalg  # noqa: F401  brings the BLAS in which kernels multiply, which `one_thread` holds

from ribbonbench.threads import one_thread
from shellref.kernels import element, fronts
from shellref.kernels.tree import Structure, Tree
from shellref.shell.cells import Cells

AT_ONCE = 64  # elements whose tangents are made before they are used, at least
Spend = Callable[[str, float], None]


class Tangent:
    """P^T K P + diagonal over the unknowns of some elements: what it is made of, its factors, its rows.

    growth: the largest g_i over what comes to the diagonal's entry (fronts.py), of the factors last made; infinite
    where they were given up.
    """

    def __init__(self, cells: Cells, active: np.ndarray, owners: np.ndarray | None = None):
        """active (nodes, 5): increments that are unknowns; owners (nodes,): whose they are at the nodes of a seam. A
        seam's unknowns are in the first and the last element: they stay in the fronts until the strip is closed."""
        self.cells, self.active, self._owners = cells, active, owners
        self.number = cells.numbers(active, owners)
        at = np.empty(cells.elements, dtype=np.int64)
        at[cells.along, cells.across] = np.arange(len(cells.nodes))
        tree = Tree(cells.elements, cells.degree)
        self.structure = s = Structure(tree, self.number[at.ravel()])
        self._batches = batches(tree)
        self._elements = np.where(tree.cells >= 0, at.ravel()[tree.cells], -1)
        self._pattern: tuple[np.ndarray, np.ndarray] | None = None
        self._state: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        self.diagonal = np.zeros(0)
        self._factors, self._pivots = np.empty(s.rows[-1]), np.empty(s.unknowns)
        self.growth = np.inf

    def assemble(self, state: np.ndarray, full: np.ndarray, reduced: np.ndarray, bases: np.ndarray, diagonal) -> None:
        """Of a state (nodes, 6), stresses of both rules, bases (nodes, 3, 2), diagonal (unknowns,)."""
        self._state = np.ascontiguousarray(state), self.cells.stresses(full, reduced), bases
        self.diagonal = diagonal

    def _tangents(self, some: np.ndarray) -> np.ndarray:
        assert self._state is not None
        return self.cells.tangents(*self._state, some)

    def factor(self, spend: Spend) -> bool:
        """Make the factors; False: a pivot is zero, lost in rounding or not finite, there are none."""
        s = self.structure
        stack, work = np.empty(s.most_kept), np.empty(s.most_size**2)
        size, growth = np.zeros(s.unknowns), np.zeros(s.unknowns)
        self.growth = np.inf
        with one_thread():
            return self._factored(spend, stack, work, size, growth)

    def _factored(
        self, spend: Spend, stack: np.ndarray, work: np.ndarray, size: np.ndarray, growth: np.ndarray
    ) -> bool:
        s, top = self.structure, 0
        for begin, end in self._batches:
            start = time.perf_counter()
            some = self._elements[begin:end]
            tangents = self._tangents(some[some >= 0])
            spend("tangent", start)
            start = time.perf_counter()
            top = fronts.factored(
                begin, end, s.tree.children, tangents, s.start, s.index, s.pivots, s.where, s.place, s.rows, s.first,
                self.diagonal, size, growth, top, stack, work, self._factors, self._pivots,
            )  # fmt: skip
            spend("factor", start)
            if top < 0:
                return False
        self.growth = 1.0 + float(np.max(growth / size, initial=0.0))
        return True

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Its inverse times right (unknowns,)."""
        s, x = self.structure, np.array(right, dtype=float)
        fronts.solved(x, s.start, s.index, s.pivots, s.rows, s.first, self._factors, self._pivots)
        return x

    def inertia(self) -> tuple[int, int, int]:
        """Numbers of negative, zero and positive eigenvalues: of pivots (Sylvester)."""
        negative = int(np.sum(self._pivots < 0.0))
        return negative, 0, len(self._pivots) - negative

    @property
    def memory(self) -> int:
        """Bytes of the factors."""
        return self._factors.nbytes + self._pivots.nbytes

    def compressed(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(indptr, indices, values) of its rows."""
        if self._pattern is None:
            self._pattern = self.cells.pattern(self.active, self._owners)
        indptr, indices = self._pattern
        values = np.zeros(len(indices))
        everything = np.arange(len(self.number))
        for some in np.array_split(everything, -(-len(everything) // AT_ONCE)):
            element.scattered(self._tangents(some), self.number[some], indptr, indices, values)
        element.on_diagonal(self.diagonal, indptr, indices, values)
        return indptr, indices, values


def batches(tree: Tree) -> list[tuple[int, int]]:
    """Runs of fronts (first, after the last) that end with pieces, AT_ONCE elements or more in each."""
    found, begin, count = [], 0, np.cumsum(tree.cells >= 0)
    for end in tree.pieces[1:]:
        elements = count[end - 1] - (count[begin - 1] if begin else 0)
        if elements >= AT_ONCE or end == tree.pieces[-1]:
            found.append((begin, end))
            begin = end
    return found
