"""The tangent on the increments that keep active places on their walls: a saddle system, factored by MUMPS.

With the reduced tangent K, the active rows B over the free increments, and plates (ways q with springs c, and A of
ones: the active rows of each plate),

    | K        B^T | | du      |   | -r  |
    |     c   -A^T | | dq      | = | -r_q|        r_q = c q
    | B   -A    0  | | -lambda |   | -g  |

(docs/theory.md, eq. (7.27)); with -1/stiffness of walls that are soft for a while in the place of the 0. Its inertia is
that of the tangent on the null space of (B, -A) with m more negative and m more positive eigenvalues, m rows of full
rank (Gould 1985, doi:10.1007/BF01585672): stability needs no basis of that space.

On several processes each has its rows of K with their columns of B^T; rows of plates and places come after all of K's
and are the last one's, and what is solved for them is told to all.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import bmat, csr_matrix, diags, hstack, vstack

from shellref.fenics import petsc_api as petsc
from shellref.fenics.rank import Corrected


class Saddle:
    """Factors of the saddle system; solves with the tangent on the null space of the rows as petsc_api.SymmetricFactor
    does with a matrix."""

    def __init__(self, comm: Any):
        self._comm = comm
        self._last = comm.rank == comm.size - 1  # whose the rows of plates and places are, after those of K
        self.matrix: Any = None  # of K alone (PETSc): what its eigenvalues' rounding is told from
        self._factor: Any = None
        self._pattern: tuple[np.ndarray, np.ndarray] | None = None
        self._rows = self._plates = 0
        self._solver: Any = None  # the factors, or what corrects them

    def factor(
        self, tangent: Any, rows: Any, springs: np.ndarray, on_plates: Any, give: np.ndarray, bend: Any = None
    ) -> None:
        """Factorise. tangent: K (PETSc); rows (m, unknowns), on_plates (m, plates) scipy.sparse; springs (plates,);
        give (m,): 1 / stiffness of soft walls, 0 of rigid ones; bend (unknowns, unknowns): what gaps add to K. All but
        K are whole, on every process.

        Raises petsc_api.FactorisationFailed.
        """
        self.matrix = tangent
        self._rows, self._plates = rows.shape[0], len(springs)
        first, last = tangent.getOwnershipRange()
        matrix = petsc.to_scipy(tangent) if bend is None else petsc.to_scipy(tangent) + bend.tocsr()[first:last]
        if self._rows or self._plates:
            count = self._rows  # entries on the diagonal, of value 0 too: a factor wants them
            lower = csr_matrix((-give, np.arange(count), np.arange(count + 1)), shape=(count, count))
            across = hstack([csr_matrix((rows.shape[1], self._plates)), rows.T], format="csr")
            corner = bmat([[diags(springs), -on_plates.T], [-on_plates, lower]]) if self._plates else lower
            matrix = hstack([matrix, across[first:last]], format="csr")
            if self._last:
                matrix = vstack([matrix, hstack([across.T, corner])], format="csr")
        matrix = matrix.tocsr()
        matrix.sort_indices()
        csr = matrix.indptr, matrix.indices, matrix.data
        if self._alike(csr):
            petsc.refill(self._factor.matrix, csr)
        else:
            if self._factor is not None:
                self._factor.destroy()
                self._factor.matrix.destroy()
            self._factor = petsc.SymmetricFactor(petsc.sparse_matrix(self._comm, (matrix.shape[0],) * 2, csr))
            self._pattern = matrix.indptr.copy(), matrix.indices.copy()
        self._factor.factor()
        self._solver = self._factor

    def correct(self, u: np.ndarray, g: np.ndarray) -> None:
        """Solve from now on with K - U G U^T in the place of K, u (unknowns, k), g (k, k); the inertia stays K's."""
        longer = np.vstack([u, np.zeros((self._rows + self._plates, u.shape[1]))])
        self._solver = Corrected(self._factor, longer, g)

    def _alike(self, csr: tuple[np.ndarray, np.ndarray, np.ndarray]) -> bool:
        """Whether the matrix last factored has the entries of this one, on every process."""
        from shellref.fenics import dolfinx_api as api

        known = self._pattern
        alike = known is not None and all(np.array_equal(a, b) for a, b in zip(known, csr[:2], strict=True))
        return bool(-api.max_over(self._comm, -int(alike)))

    def solve(self, right: np.ndarray) -> np.ndarray:
        """The inverse on the null space of the rows, times right (unknowns,)."""
        return self.solve_all(right, np.zeros(self._plates), np.zeros(self._rows))[0]

    def solve_all(
        self, right: np.ndarray, on_plates: np.ndarray, gaps: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(du, dq, multipliers lambda (m,)) of right sides (unknowns of this process,), (plates,) and (m,)."""
        mine = len(right)
        found = self._solver.solve(np.concatenate([right, on_plates, gaps]) if self._last else right)
        others = found[mine:] if self._comm.size == 1 else self._comm.bcast(found[mine:], root=self._comm.size - 1)
        return found[:mine], others[: self._plates], -others[self._plates :]

    def inertia(self) -> tuple[int, int, int]:
        """Numbers of negative, zero and positive eigenvalues on the null space of the rows."""
        negative, zero, positive = self._factor.inertia()
        return negative - self._rows, zero, positive - self._rows

    def memory_mb(self) -> int:
        """Megabytes that MUMPS allocated."""
        return int(self._factor.memory_mb())
