"""PETSc matrices, their factorisation and their eigenproblems, serial or distributed; no dolfinx here.

Matrices are real AIJ, rows and columns split over the processes of their communicator in rank order. Vectors are NumPy
arrays of the entries that this process owns. Every function is collective on the matrix's communicator.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc

Csr = tuple[np.ndarray, np.ndarray, np.ndarray]

# MUMPS's ordering, ICNTL(7), for all factors of this process unless PETSC_OPTIONS says otherwise: PETSc 3.18 forgets
# one that is set on a factor. First factorisation, with analysis, and later ones in seconds, millions of entries of the
# factor; biquadratic strips, 5 unknowns a node, MUMPS 5.5 (Debian's: no METIS, no SCOTCH), one process, OpenBLAS:
#                    AMD                 AMF                 PORD = automatic
#     100 x 8        0.06  0.040   1.5   0.07  0.039   1.4   0.08  0.044   1.7
#     400 x 16       0.61  0.40   15.6   0.80  0.42   16.2   1.04  0.41   16.2
#     1000 x 24      2.7   1.9    71     3.6   1.8    68     5.7   2.0    75
# Debian's plain libblas takes 2.6 times as long as OpenBLAS at 400 x 16.
AMD = 0
if not PETSc.Options().hasName("mat_mumps_icntl_7"):
    PETSc.Options()["mat_mumps_icntl_7"] = AMD
WORKSPACES = (30, 100, 300, 1000)  # ICNTL(14), percent above MUMPS's estimate: the next one when a factor did not fit
TOO_SMALL = (-8, -9, -11, -12, -14, -15, -17, -18, -19, -20)  # INFOG(1) of a workspace that did not suffice
EIGEN_TOLERANCE, EIGEN_ITERATIONS = 1e-10, 200


class FactorisationFailed(ArithmeticError):
    """A matrix cannot be factored or solved with: entries are not finite, it is singular, or memory ran out."""


def sparse_matrix(comm: Any, shape_local: tuple[int, int], csr: Csr) -> Any:
    """An AIJ matrix from the CSR arrays (indptr, global column indices, values) of this process's rows.

    shape_local: numbers of rows and of columns that this process owns.
    """
    rows, columns = shape_local
    matrix = PETSc.Mat().createAIJ(size=((rows, None), (columns, None)), csr=_as_petsc(csr), comm=comm)
    matrix.assemble()
    return matrix


def collected(comm: Any) -> None:
    """Free the objects on `comm` that Python no longer holds (collective): PETSc lets them wait, so that all processes
    free the same ones; until then matrices and factors of meshes that are done with stay in memory."""
    PETSc.garbage_cleanup(comm)


def refill(matrix: Any, csr: Csr) -> None:
    """New values in a matrix made by `sparse_matrix` with the same pattern."""
    matrix.setValuesCSR(*_as_petsc(csr))
    matrix.assemble()


def _as_petsc(csr: Csr) -> Csr:
    indptr, indices, values = csr
    return np.asarray(indptr, PETSc.IntType), np.asarray(indices, PETSc.IntType), np.asarray(values, PETSc.ScalarType)


def ptap(matrix: Any, projection: Any, result: Any = None) -> Any:
    """P^T A P; `result`, what an earlier call with the same patterns returned, is filled again."""
    return matrix.ptap(projection, result=result)


def _vector(comm: Any, array: np.ndarray) -> Any:
    """A PETSc vector on this process's entries: a view when they are contiguous floats."""
    array = np.ascontiguousarray(array, PETSc.ScalarType)
    return PETSc.Vec().createWithArray(array, size=(len(array), None), comm=comm)


def add_diagonal(matrix: Any, diagonal: np.ndarray) -> None:
    """matrix += diag(diagonal), the owned part (local rows,)."""
    vector = _vector(matrix.comm, diagonal)
    matrix.setDiagonal(vector, addv=PETSc.InsertMode.ADD_VALUES)
    vector.destroy()


def add_block(matrix: Any, first: int, block: np.ndarray) -> None:
    """matrix[first:, first:] += block (m, m), whose entries the matrix has; one process."""
    at = np.arange(first, first + len(block), dtype=PETSc.IntType)
    matrix.setValues(at, at, block, addv=PETSc.InsertMode.ADD_VALUES)
    matrix.assemble()


def multiply(matrix: Any, x: np.ndarray) -> np.ndarray:
    """matrix @ x: owned entries (local columns,) -> (local rows,)."""
    y = np.zeros(matrix.getLocalSize()[0])
    source, target = _vector(matrix.comm, x), _vector(matrix.comm, y)
    matrix.mult(source, target)
    source.destroy()
    target.destroy()
    return y


def rounding(matrix: Any, x: np.ndarray) -> float:
    """eps |x|^T |A| |x|, x (local rows,): what relative errors eps of the entries of A can make of x^T A x.

    Bounds the rounding of an eigenvalue whose unit vector is x (N. Higham, Accuracy and Stability of Numerical
    Algorithms, 2nd ed., SIAM 2002, section 7.2: componentwise, since entries of very different size are exact each to
    its own). Strips of 1e-3 to 1e-6 of their length, states rounded anew: the eigenvalue moves by 0.02 to 0.11 of it.
    """
    indptr, indices, values = matrix.getValuesCSR()
    sizes = matrix.duplicate()
    sizes.setValuesCSR(indptr, indices, np.abs(values))
    sizes.assemble()
    y = _vector(matrix.comm, multiply(sizes, np.abs(x)))
    other = _vector(matrix.comm, np.abs(x))
    bound = float(np.finfo(float).eps * y.dot(other))
    for item in (sizes, y, other):
        item.destroy()
    return bound


def to_scipy(matrix: Any) -> Any:
    """The rows of this process as scipy.sparse.csr_matrix, (local rows, global columns)."""
    from scipy.sparse import csr_matrix

    indptr, indices, values = matrix.getValuesCSR()
    return csr_matrix((values, indices, indptr), shape=(matrix.getLocalSize()[0], matrix.getSize()[1]))


class SymmetricFactor:
    """L D L^T of a symmetric matrix by MUMPS: solves, and the inertia that says how stable a state is."""

    def __init__(self, matrix: Any):
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self.matrix = matrix
        self._workspace = 0
        self._create()

    def _create(self) -> None:
        """A factor with nothing in it."""
        self._ksp = PETSc.KSP().create(comm=self.matrix.comm)
        self._ksp.setType(PETSc.KSP.Type.PREONLY)
        pc = self._ksp.getPC()
        pc.setType(PETSc.PC.Type.CHOLESKY)
        pc.setFactorSolverType("mumps")
        self._ksp.setOperators(self.matrix)
        pc.setFactorSetUpSolverType()
        self._mumps = pc.getFactorMatrix()
        # analysis on one process; null pivots detected and the root not split over processes: without these two the
        # inertia is not to be trusted
        for number, value in ((28, 1), (24, 1), (13, 1), (14, WORKSPACES[self._workspace])):
            self._mumps.setMumpsIcntl(number, value)

    def factor(self) -> None:
        """Factorise the matrix's present values; a workspace that is too small is enlarged, for good."""
        if not np.isfinite(self.matrix.norm()):
            raise FactorisationFailed("the matrix has entries that are not finite")
        while True:
            self._ksp.setOperators(self.matrix)
            self._ksp.setUp()
            code, detail = self._mumps.getMumpsInfog(1), self._mumps.getMumpsInfog(2)
            if code >= 0:
                return
            self.destroy()  # PETSc never factorises again where it has failed
            enlarge = code in TOO_SMALL and self._workspace + 1 < len(WORKSPACES)
            self._workspace += enlarge
            self._create()
            if not enlarge:
                raise FactorisationFailed(f"MUMPS failed: INFOG(1) = {code}, INFOG(2) = {detail}")

    def solve(self, right: np.ndarray) -> np.ndarray:
        """matrix^-1 right, owned entries (local rows,).

        FactorisationFailed when the matrix is singular, or what comes out is not finite.
        """
        if self._mumps.getMumpsInfog(28) > 0:
            raise FactorisationFailed(f"the matrix is singular: {self._mumps.getMumpsInfog(28)} zero pivots")
        x = np.zeros(len(right))
        source, target = _vector(self.matrix.comm, right), _vector(self.matrix.comm, x)
        self._ksp.solve(source, target)
        finite = np.isfinite(target.norm())
        source.destroy()
        target.destroy()
        if not finite:
            raise FactorisationFailed("the solution is not finite: the matrix is singular, or its right side is not")
        return x

    def inertia(self) -> tuple[int, int, int]:
        """Numbers of (negative, zero, positive) eigenvalues of the matrix last factored, all processes together."""
        return self._mumps.getInertia()

    def memory_mb(self) -> int:
        """Megabytes that MUMPS allocated for the last factorisation, all processes together."""
        return self._mumps.getMumpsInfog(19)

    def destroy(self) -> None:
        """Free MUMPS's memory; the matrix stays. Its handle too: PETSc keeps what Python alone holds (PETSc 3.18:
        objects that are collected wait for `PETSc.garbage_cleanup`)."""
        self._mumps.destroy()
        self._ksp.destroy()


class _Inverse(ABC):
    """Python-shell matrix with a factor in it; after a failure, kept in `failure`, it is the identity.

    An exception must not cross SLEPc: it leaves its objects half done, and PETSc ends the process.
    """

    def __init__(self, factor: SymmetricFactor):
        self._factor = factor
        self.failure: FactorisationFailed | None = None

    @abstractmethod
    def applied(self, x: np.ndarray) -> np.ndarray:
        """The matrix times x, owned entries (local rows,)."""

    def mult(self, matrix: Any, x: Any, y: Any) -> None:
        array = x.getArray(readonly=True)
        if self.failure is None:
            try:
                y.setArray(self.applied(array))
                return
            except FactorisationFailed as failure:
                self.failure = failure
        y.setArray(array)


class _Scaled(_Inverse):
    """y = S^T K^-1 S x with S S^T = diag(mass) - less less^T.

    With Q = diag(mass)^-1/2 less = U diag(q) V^T the root is S = diag(mass)^1/2 (I - U diag(1 - (1 - q^2)^1/2) U^T).
    """

    def __init__(self, factor: SymmetricFactor, mass: np.ndarray, less: np.ndarray | None):
        super().__init__(factor)
        self._root = np.sqrt(mass)
        self._left: np.ndarray | None = None
        if less is not None:
            self._comm = factor.matrix.comm.tompi4py()
            rows = self._comm.allgather(less / self._root[:, None])  # few columns: every process has them all
            left, size, _ = np.linalg.svd(np.concatenate(rows), full_matrices=False)
            first = sum(len(one) for one in rows[: self._comm.rank])
            self._left = left[first : first + len(less)]
            self._rest = np.sqrt((1.0 - size) * (1.0 + size))  # > 0 where the difference is positive definite

    def applied(self, x: np.ndarray) -> np.ndarray:
        scaled = self._factor.solve(self._root * self._by(x))
        return self._by(self._root * scaled)

    def unscaled(self, vectors: np.ndarray) -> np.ndarray:
        """S^-T of unit vectors (k, local rows)."""
        return np.array([self._by(x, -1) for x in vectors]).reshape(vectors.shape) / self._root

    def _by(self, x: np.ndarray, power: int = 1) -> np.ndarray:
        """(I - U diag(1 - (1 - q^2)^1/2) U^T)^power x, power 1 or -1."""
        if self._left is None:
            return x
        return np.asarray(x + self._left @ ((self._rest**power - 1.0) * self._comm.allreduce(self._left.T @ x)))


class _Softening(_Inverse):
    """y = -K^-1 dK x."""

    def __init__(self, factor: SymmetricFactor, change: Any):
        super().__init__(factor)
        self._change = change

    def applied(self, x: np.ndarray) -> np.ndarray:
        return -self._factor.solve(multiply(self._change, x))


def _extreme(context: _Inverse, like: Any, symmetric: bool, count: int, end: str) -> tuple[np.ndarray, np.ndarray]:
    """Converged real eigenvalues (k,) of a python-shell matrix, from one end on, and unit vectors (k, local rows).

    like: a matrix distributed as the shell is. end: "negative" or "positive", of the spectrum. k <= count; 0 when a
    solution with the factor failed.
    """
    size = (like.getLocalSize()[0], None)
    operator = PETSc.Mat().createPython((size, size), context, comm=like.comm)
    operator.setUp()
    eps = SLEPc.EPS().create(comm=like.comm)
    eps.setOperators(operator)
    eps.setProblemType(SLEPc.EPS.ProblemType.HEP if symmetric else SLEPc.EPS.ProblemType.NHEP)
    ends = {"negative": SLEPc.EPS.Which.SMALLEST_REAL, "positive": SLEPc.EPS.Which.LARGEST_REAL}
    eps.setWhichEigenpairs(ends[end])
    eps.setDimensions(count)
    eps.setTolerances(EIGEN_TOLERANCE, EIGEN_ITERATIONS)
    # the same random vector in every run, whatever the number of processes
    first, last = like.getOwnershipRange()
    start = _vector(like.comm, np.random.default_rng(1).standard_normal(like.getSize()[0])[first:last])
    eps.setInitialSpace(start)
    eps.solve()
    values, vectors, vector = [], [], like.createVecRight()
    for k in range(0 if context.failure else min(count, eps.getConverged())):
        value = eps.getEigenpair(k, vector)
        if value.imag == 0.0:
            values.append(value.real)
            vectors.append(vector.getArray().copy())
    for item in (start, vector, eps, operator):
        item.destroy()
    return np.array(values), np.array(vectors).reshape(len(values), size[0])


def _sorted(values: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    order = np.argsort(values)
    return values[order], vectors[order]


def lowest_pairs(
    factor: SymmetricFactor, mass: np.ndarray, count: int, end: str, less: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Eigenpairs of K x = lambda M x nearest to zero on one side: lambdas (k,) ascending, vectors (k, local rows).

    K is the matrix last factored, M = diag(mass) - less less^T > 0 (owned part; less (rows, few), None:
    nothing); vectors have x^T M x = 1. Krylov-Schur on S^T K^-1 S, S S^T = M. end: "negative" (unstable modes; all
    of them when count = their number) or "positive". There are never more pairs than eigenvalues of that sign, and none
    if the iteration does not converge or K is singular.
    """
    negative, _, positive = factor.inertia()
    count = min(count, {"negative": negative, "positive": positive}[end])
    scaled = _Scaled(factor, mass, less)
    values, vectors = np.zeros(0), np.zeros((0, len(mass)))
    if count:
        values, vectors = _extreme(scaled, factor.matrix, True, count, end)
    if len(values) < count:
        values, vectors = values[:0], vectors[:0]
    return _sorted(1.0 / values, scaled.unscaled(vectors))


def buckling_pairs(
    matrix: Any, change: Any, count: int, factor: SymmetricFactor | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """The smallest t > 0 with (K + t dK) x = 0: t (k,) ascending, unit vectors (k, local rows).

    K = matrix must be positive definite (else ValueError), dK = change symmetric; factor: K factorised, when the caller
    has it. Krylov-Schur on -K^-1 dK x = (1/t) x in the Euclidean product: that of K is lost to rounding where K is
    nearly singular (thin shells: condition 1e15 far from it). Fewer than count pairs when there are fewer such t, or
    fewer converge. Raises FactorisationFailed when K is to be factored here and cannot be.
    """
    own = SymmetricFactor(matrix) if factor is None else factor
    if factor is None:
        own.factor()
    if own.inertia()[:2] != (0, 0):
        raise ValueError(f"buckling needs a positive definite matrix; its inertia is {own.inertia()}")
    count = min(count, matrix.getSize()[0])
    values, vectors = _extreme(_Softening(own, change), matrix, False, count, "positive")
    if factor is None:
        own.destroy()
    positive = values > 1e-12 * np.max(np.abs(values), initial=0.0)
    return _sorted(1.0 / values[positive], vectors[positive])
