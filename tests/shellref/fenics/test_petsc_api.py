"""PETSc matrices, factors and eigenproblems against NumPy and SciPy, on one process and on two."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse

pytest.importorskip("slepc4py")
from mpi4py import MPI

from shellref.fenics import petsc_api as la
from tests.patience import PATIENCE

pytestmark = pytest.mark.shell
SELF = MPI.COMM_SELF


def symmetric(n: int, negative: int = 0, seed: int = 0) -> np.ndarray:
    """A dense symmetric matrix with eigenvalues +-(1 .. n), the first `negative` of them below zero."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, n)))
    return (q * np.where(np.arange(n) < negative, -1.0, 1.0) * np.arange(1.0, n + 1)) @ q.T


def distributed(dense: np.ndarray, comm=SELF):
    """The matrix, its rows dealt out over the processes, and the slice of rows that this process has."""
    ends = np.arange(comm.size + 1) * len(dense) // comm.size
    mine = slice(ends[comm.rank], ends[comm.rank + 1])
    rows = scipy.sparse.csr_matrix(dense[mine])
    return la.sparse_matrix(comm, (rows.shape[0], rows.shape[0]), (rows.indptr, rows.indices, rows.data)), mine


def test_products_refill_and_diagonal():
    dense, projection = symmetric(12), np.random.default_rng(1).standard_normal((12, 7))
    matrix, _ = distributed(dense)
    rows = scipy.sparse.csr_matrix(projection)
    p = la.sparse_matrix(SELF, (12, 7), (rows.indptr, rows.indices, rows.data))
    reduced = la.ptap(matrix, p)
    assert np.allclose(la.to_scipy(reduced).toarray(), projection.T @ dense @ projection, atol=1e-12)
    la.refill(p, (rows.indptr, rows.indices, 2.0 * rows.data))
    la.refill(matrix, scipy_csr(3.0 * dense))
    again = la.ptap(matrix, p, reduced)
    assert again.handle == reduced.handle
    diagonal = np.arange(7.0)
    la.add_diagonal(reduced, diagonal)
    expected = 12.0 * projection.T @ dense @ projection + np.diag(diagonal)
    assert np.allclose(la.to_scipy(reduced).toarray(), expected, atol=1e-11)
    assert np.allclose(la.multiply(p, diagonal), 2.0 * projection @ diagonal, atol=1e-12)


def scipy_csr(dense: np.ndarray):
    rows = scipy.sparse.csr_matrix(dense)
    return rows.indptr, rows.indices, rows.data


@pytest.mark.parametrize("negative", [0, 1, 7])
def test_inertia_and_solutions(negative):
    dense = symmetric(30, negative)
    matrix, _ = distributed(dense)
    factor = la.SymmetricFactor(matrix)
    factor.factor()
    spectrum = np.linalg.eigvalsh(dense)
    assert factor.inertia() == (np.sum(spectrum < 0), 0, np.sum(spectrum > 0))
    right = np.arange(30.0)
    assert np.allclose(factor.solve(right), np.linalg.solve(dense, right), atol=1e-10)
    assert factor.memory_mb() >= 0
    # the next values of the same matrix
    la.add_diagonal(matrix, np.full(30, 4.5))
    factor.factor()
    assert factor.inertia()[0] == np.sum(spectrum < -4.5)
    factor.destroy()


def saddle(n: int = 300):
    """[[tiny, B], [B^T, tiny]]: pivots are delayed, so MUMPS's estimate of its workspace is far too small."""
    b = scipy.sparse.random(n, n, 0.02, random_state=0) + scipy.sparse.eye(n)
    tiny = 1e-9 * scipy.sparse.eye(n)
    return scipy.sparse.bmat([[tiny, b], [b.T, tiny]]).tocsr()


def test_workspace_grows_when_it_is_too_small(monkeypatch):
    rows = saddle()
    matrix = la.sparse_matrix(SELF, rows.shape, (rows.indptr, rows.indices, rows.data))
    monkeypatch.setattr(la, "WORKSPACES", (0, 1000))
    factor = la.SymmetricFactor(matrix)
    factor.factor()
    assert factor._workspace == 1, "the first workspace sufficed: this tests nothing"
    right = np.ones(rows.shape[0])
    assert np.allclose(rows @ factor.solve(right), right, atol=1e-8)
    assert factor.inertia() == (300, 0, 300)
    monkeypatch.setattr(la, "WORKSPACES", (0,))
    with pytest.raises(la.FactorisationFailed, match=r"INFOG\(1\) = -9"):
        la.SymmetricFactor(matrix).factor()


@pytest.mark.parametrize("ends", ["destroyed", "collected"])
def test_a_factor_that_is_done_with_leaves_no_memory(ends):
    """Ten of them, one after the other, take no more memory than two, but for what the allocator keeps."""
    n = 1500
    rows = scipy.sparse.random(n, n, 3.0 / n, random_state=1, format="csr")
    rows = (rows + rows.T + 20.0 * scipy.sparse.identity(n)).tocsr()
    rows.sort_indices()

    def in_use() -> float:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2.0**20

    known = []
    for _ in range(10):
        factor = la.SymmetricFactor(la.sparse_matrix(SELF, (n, n), (rows.indptr, rows.indices, rows.data)))
        factor.factor()
        size = factor.memory_mb()
        if ends == "destroyed":
            factor.destroy()
            factor.matrix.destroy()
        del factor
        if ends == "collected":
            la.collected(SELF)
        known.append(in_use())
    assert size >= 4
    assert known[-1] - known[1] < 2.0 * size  # eight stay otherwise


def test_what_cannot_be_factored_says_so_and_spoils_nothing():
    dense = symmetric(6)
    matrix, _ = distributed(dense)
    factor = la.SymmetricFactor(matrix)
    la.refill(matrix, scipy_csr(np.where(dense == dense[2, 2], np.nan, dense)))
    with pytest.raises(la.FactorisationFailed, match="not finite"):
        factor.factor()
    la.refill(matrix, scipy_csr(np.ones((6, 6))))
    factor.factor()
    assert factor.inertia() == (0, 5, 1)
    with pytest.raises(la.FactorisationFailed, match="singular"):
        factor.solve(np.ones(6))
    la.refill(matrix, scipy_csr(dense))
    factor.factor()
    with pytest.raises(la.FactorisationFailed, match="not finite"):
        factor.solve(np.full(6, np.nan))
    assert np.allclose(dense @ factor.solve(np.ones(6)), 1.0)


@pytest.mark.parametrize(("end", "count"), [("negative", 4), ("negative", 9), ("positive", 3)])
def test_lowest_pairs_against_scipy(end, count):
    dense, mass = symmetric(40, negative=4), 1.0 + np.arange(40.0) ** 2 / 100.0
    factor = la.SymmetricFactor(distributed(dense)[0])
    factor.factor()
    values, vectors = la.lowest_pairs(factor, mass, count, end)
    spectrum = scipy.linalg.eigh(dense, np.diag(mass), eigvals_only=True)
    expected = spectrum[spectrum < 0] if end == "negative" else spectrum[spectrum > 0][:count]
    assert values.shape == expected.shape == (min(count, 4),)
    assert np.allclose(values, expected, rtol=1e-8, atol=0.0)
    off = np.abs(vectors @ dense - values[:, None] * vectors * mass)
    assert np.max(off) < 1e-7
    assert np.allclose(np.einsum("ki,i,ki->k", vectors, mass, vectors), 1.0)
    again = la.lowest_pairs(factor, mass, count, end)
    assert np.array_equal(again[0], values)
    assert np.array_equal(again[1], vectors)


@pytest.mark.parametrize("good", [0, 1, 5])
def test_a_solution_that_fails_within_slepc_gives_no_pairs_and_spoils_nothing(monkeypatch, good):
    """An exception that crosses SLEPc's callback leaves its objects locked, and PETSc ends the process."""
    dense = symmetric(40, negative=4)
    matrix, _ = distributed(dense)
    factor = la.SymmetricFactor(matrix)
    factor.factor()
    solve, left = la.SymmetricFactor.solve, good

    def failing(self, right):
        nonlocal left
        left -= 1
        if left < 0:
            raise la.FactorisationFailed("injected")
        return solve(self, right)

    monkeypatch.setattr(la.SymmetricFactor, "solve", failing)
    values, vectors = la.lowest_pairs(factor, np.ones(40), 4, "negative")
    assert (values.shape, vectors.shape) == ((0,), (0, 40))
    monkeypatch.undo()
    values, _ = la.lowest_pairs(factor, np.ones(40), 4, "negative")
    assert np.allclose(values, np.linalg.eigvalsh(dense)[:4])


def test_rounding_is_that_of_the_entries():
    rng, dense = np.random.default_rng(3), symmetric(9)
    matrix, _ = distributed(dense)
    x = rng.standard_normal(9)
    bound = la.rounding(matrix, x)
    assert bound == pytest.approx(np.finfo(float).eps * np.abs(x) @ np.abs(dense) @ np.abs(x), rel=1e-12)
    assert np.array_equal(la.to_scipy(matrix).toarray(), dense)


def test_lowest_pairs_of_a_stable_matrix_has_no_negative_end():
    factor = la.SymmetricFactor(distributed(symmetric(9))[0])
    factor.factor()
    values, vectors = la.lowest_pairs(factor, np.ones(9), 2, "negative")
    assert values.shape == (0,)
    assert vectors.shape == (0, 9)


def test_without_convergence_there_are_no_pairs(monkeypatch):
    monkeypatch.setattr(la, "EIGEN_ITERATIONS", 1)
    factor = la.SymmetricFactor(distributed(np.diag(1.0 + 1e-3 * np.arange(400.0)))[0])
    factor.factor()
    values, vectors = la.lowest_pairs(factor, np.ones(400), 3, "positive")
    assert len(values) == len(vectors) == 0


def buckling(dense: np.ndarray, change: np.ndarray) -> np.ndarray:
    """All t > 0 with det(K + t dK) = 0, ascending."""
    inverse = scipy.linalg.eigh(-change, dense, eigvals_only=True)
    return np.sort(1.0 / inverse[inverse > 1e-9])


@pytest.mark.parametrize("given", [False, True])
def test_buckling_pairs_against_scipy(given):
    dense, change = symmetric(25), symmetric(25, negative=10, seed=3)
    matrix, other = distributed(dense)[0], distributed(change)[0]
    factor = la.SymmetricFactor(matrix) if given else None
    if factor:
        factor.factor()
    ts, vectors = la.buckling_pairs(matrix, other, 3, factor)
    assert np.allclose(ts, buckling(dense, change)[:3], rtol=1e-8)
    for t, x in zip(ts, vectors, strict=True):
        assert np.linalg.norm((dense + t * change) @ x) < 1e-6 * np.linalg.norm(dense @ x)
        assert np.linalg.norm(x) == pytest.approx(1.0)
    assert np.array_equal(la.to_scipy(other).toarray(), change), "the caller's matrix was changed"


def test_buckling_close_to_a_singular_matrix():
    """A chain of springs of stiffness 1e9 on ground of stiffness 4e-6, which softens: it moves as one."""
    n, ground, softening = 60, 2.0**-18, 1.0 + np.arange(60.0) / 120.0
    path = np.diag([1.0, *[2.0] * (n - 2), 1.0]) - np.eye(n, k=1) - np.eye(n, k=-1)
    matrix, change = distributed(2.0**30 * path + ground * np.eye(n))[0], distributed(-np.diag(softening))[0]
    ts, vectors = la.buckling_pairs(matrix, change, 1)
    assert ts == pytest.approx([ground / softening.mean()], rel=0.02)
    assert np.allclose(np.abs(vectors), 1.0 / np.sqrt(n), rtol=1e-6)


def test_buckling_has_only_the_pairs_that_there_are():
    dense, change = np.diag(np.arange(1.0, 9.0)), np.zeros((8, 8))
    change[0, 0], change[1, 1] = -0.5, 2.0
    ts, vectors = la.buckling_pairs(distributed(dense)[0], distributed(change)[0], 3)
    assert ts == pytest.approx([2.0])  # one, not none: an empty array is close to anything
    assert vectors.shape == (1, 8)
    assert np.allclose(np.abs(vectors), np.eye(8)[:1])
    with pytest.raises(ValueError, match="positive definite"):
        la.buckling_pairs(distributed(-dense)[0], distributed(change)[0], 1)


def two_processes() -> None:
    """What each of the two processes of the next test does."""
    comm = MPI.COMM_WORLD
    assert comm.size == 2
    dense, mass, change = symmetric(41, negative=4), np.linspace(1.0, 2.0, 41), symmetric(41, negative=10, seed=3)
    matrix, mine = distributed(dense, comm)
    factor = la.SymmetricFactor(matrix)
    factor.factor()
    assert factor.inertia() == (4, 0, 37)
    right = np.arange(41.0)
    assert np.allclose(factor.solve(right[mine]), np.linalg.solve(dense, right)[mine], atol=1e-10)
    assert np.allclose(la.multiply(matrix, right[mine]), (dense @ right)[mine], atol=1e-10)
    spectrum = scipy.linalg.eigh(dense, np.diag(mass), eigvals_only=True)
    values, vectors = la.lowest_pairs(factor, mass[mine], 4, "negative")
    assert np.allclose(values, spectrum[:4], rtol=1e-8, atol=0.0)
    whole = np.concatenate(comm.allgather(vectors), axis=1)
    assert np.allclose(whole @ dense, values[:, None] * whole * mass, rtol=0.0, atol=1e-7)
    assert np.allclose(la.lowest_pairs(factor, mass[mine], 2, "positive")[0], spectrum[4:6], rtol=1e-8)
    la.refill(matrix, scipy_csr(symmetric(41)[mine]))
    ts, _ = la.buckling_pairs(matrix, distributed(change, comm)[0], 2)
    assert np.allclose(ts, buckling(symmetric(41), change)[:2], rtol=1e-8)
    la.add_diagonal(matrix, np.full(mine.stop - mine.start, -2.5))
    factor.factor()
    assert factor.inertia() == (2, 0, 39)


def test_two_processes():
    mpirun = shutil.which("mpirun")
    if not mpirun:
        pytest.skip("no mpirun")
    call = f"from {__name__} import two_processes; two_processes(); print('fine', flush=True)"
    env = os.environ | {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMP_NUM_THREADS": "1"}
    command = [mpirun, "--oversubscribe", "-n", "2", sys.executable, "-m", "mpi4py", "-c", call]
    run = subprocess.run(
        command, cwd=Path(__file__).parents[3], env=env, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.count("fine") == 2
