"""The reduced tangent of a shell: assembled and factored, by dolfinx's forms and MUMPS or by the shell's own kernels.

Both give P^T K P + diagonal (director.py) over the unknowns of a process, its factors and their inertia.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from shellref.fenics import petsc_api as petsc
from shellref.path.ldl import Tangent
from shellref.shell.director import Bases, Increments
from shellref.shell.naghdi import NaghdiModel, Stress

#: Growth of the factors' bound over the diagonal, above which MUMPS searches for pivots: ten digits are left.
MOST_GROWTH = 1e5

#: Parts of the tangent that edges add: first unknown and square block of each.
Blocks = Sequence[tuple[int, np.ndarray]]


class Linear(ABC):
    """A tangent with its factors; name: how it is factored; seconds: spent on each part so far."""

    name = ""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def spend(self, part: str, start: float) -> None:
        """Count the seconds since `start` under a name."""
        self.seconds[part] = self.seconds.get(part, 0.0) + time.perf_counter() - start

    @property
    @abstractmethod
    def matrix(self) -> Any:
        """The tangent last assembled (PETSc)."""

    @property
    @abstractmethod
    def factors(self) -> Any:
        """The factors of the tangent last factored (petsc_api.Factor)."""

    @abstractmethod
    def assemble(self, state: np.ndarray, stress: Stress, bases: Bases, diagonal: np.ndarray, blocks: Blocks) -> None:
        """The tangent at a state (nodes, 6), with diagonal (unknowns,) and blocks on it added."""

    @abstractmethod
    def factor(self) -> None:
        """Factorise it. Raises petsc_api.FactorisationFailed."""

    @abstractmethod
    def stiff(self, step: np.ndarray) -> np.ndarray:
        """K step, (nodes, 6), with the full tangent last assembled, nothing held."""


class FormsLinear(Linear):
    """dolfinx's full tangent, P^T K P by PETSc, MUMPS; on any number of processes."""

    name = "MUMPS L D L^T"

    def __init__(self, model: NaghdiModel, increments: Increments, offset: int):
        super().__init__()
        self._model, self._increments, self._offset = model, increments, offset
        self._full = model.create_tangent()
        self._projection: Any = None
        self._reduced: Any = None
        self._factor: Any = None

    @property
    def matrix(self) -> Any:
        return self._reduced

    @property
    def factors(self) -> Any:
        return self._factor

    def assemble(self, state: np.ndarray, stress: Stress, bases: Bases, diagonal: np.ndarray, blocks: Blocks) -> None:
        start = time.perf_counter()
        self._model.tangent(self._full, state, stress)
        self.spend("tangent", start)
        start = time.perf_counter()
        csr = self._increments.projection(bases, self._offset)
        if self._projection is None:
            shape = (6 * self._model.owned, self._increments.unknowns)
            self._projection = petsc.sparse_matrix(self._model.comm, shape, csr)
            self._reduced = petsc.ptap(self._full, self._projection)
            self._factor = petsc.SymmetricFactor(self._reduced)
        else:
            petsc.refill(self._projection, csr)
            petsc.ptap(self._full, self._projection, self._reduced)
        petsc.add_diagonal(self._reduced, diagonal)
        for first, block in blocks:
            petsc.add_block(self._reduced, first, block)
        self.spend("reduce", start)

    def factor(self) -> None:
        start = time.perf_counter()
        self._factor.factor()
        self.spend("factor", start)

    def stiff(self, step: np.ndarray) -> np.ndarray:
        out = np.zeros_like(step)
        owned = self._model.owned
        out[:owned] = petsc.multiply(self._full, step[:owned].ravel()).reshape(-1, 6)
        return out


class MeshFactor:
    """Factors along the mesh, or MUMPS's where those are not safe; as petsc_api.SymmetricFactor."""

    def __init__(self, tangent: Tangent, linear: Linear):
        self.tangent, self._linear = tangent, linear
        self._mumps: Any = None
        self.safe = False  # whether the factors last made are those along the mesh

    @property
    def matrix(self) -> Any:
        """The matrix last assembled (PETSc)."""
        return self._linear.matrix

    def factor(self) -> None:
        """Factorise the tangent. Raises petsc_api.FactorisationFailed."""
        self.safe = self.tangent.factor(self._linear.spend) and self.tangent.growth < MOST_GROWTH
        if not self.safe:
            start = time.perf_counter()
            matrix = self.matrix  # with its present values
            if self._mumps is None:
                self._mumps = petsc.SymmetricFactor(matrix)
            self._mumps.factor()
            self._linear.spend("mumps", start)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """matrix^-1 right (unknowns,); FactorisationFailed when what comes out is not finite."""
        if not self.safe:
            return np.asarray(self._mumps.solve(right))
        x = self.tangent.solve(right)
        if not np.all(np.isfinite(x)):
            raise petsc.FactorisationFailed("the solution is not finite: the matrix is singular, or its right side")
        return x

    def inertia(self) -> tuple[int, int, int]:
        """Numbers of (negative, zero, positive) eigenvalues of the matrix last factored."""
        found: tuple[int, int, int] = self.tangent.inertia() if self.safe else self._mumps.inertia()
        return found

    def memory_mb(self) -> int:
        """Megabytes of the factors."""
        found: int = self.tangent.memory // 2**20 if self.safe else self._mumps.memory_mb()
        return found


class CellsLinear(Linear):
    """Reduced tangents of the elements (shellref.kernels), factored along the mesh."""

    name = "L D L^T along the mesh"

    def __init__(self, model: NaghdiModel, increments: Increments):
        super().__init__()
        assert model.cells is not None
        self._model = model
        self._tangent = Tangent(model.cells, increments.active, increments.owners)
        self._matrix: Any = None  # PETSc's, made when it is asked for
        self._made = False
        self._factors = MeshFactor(self._tangent, self)

    @property
    def matrix(self) -> Any:
        if not self._made:
            csr = self._tangent.compressed()
            if self._matrix is None:
                self._matrix = petsc.sparse_matrix(self._model.comm, (len(csr[0]) - 1,) * 2, csr)
            else:
                petsc.refill(self._matrix, csr)
            self._made = True
        return self._matrix

    @property
    def factors(self) -> Any:
        return self._factors

    def assemble(self, state: np.ndarray, stress: Stress, bases: Bases, diagonal: np.ndarray, blocks: Blocks) -> None:
        assert not blocks, "of edges, which the elements do not know"
        self._at, self._made = (state, stress), False
        self._tangent.assemble(state, stress.full, stress.reduced, bases.directors, diagonal)

    def factor(self) -> None:
        self._factors.factor()

    def stiff(self, step: np.ndarray) -> np.ndarray:
        return self._model.stiff(*self._at, step)


def linear_system(model: NaghdiModel, increments: Increments, offset: int) -> Linear:
    """The shell's own where it knows the model: on one process, without edges that have unknowns of their own."""
    if model.cells is None or increments.edges:
        return FormsLinear(model, increments, offset)
    return CellsLinear(model, increments)
