"""Factors along a mesh against dense ones: solutions, inertia, the bound on their growth, and what they cost."""

import numpy as np
import pytest

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref import ShellOptions, ShellProblem  # noqa: E402
from shellref.kernels.tree import Structure, Tree  # noqa: E402
from shellref.path import linear  # noqa: E402
from shellref.path.ldl import Tangent, batches  # noqa: E402
from shellref.path.solve import Solver, solve  # noqa: E402
from shellref.shell.cells import Cells  # noqa: E402

RNG = np.random.default_rng(3)


class Given(Cells):
    """Elements of a mesh (nx, ny) of degree k with given tangents (c, 5 n, 5 n), in any order."""

    def __init__(self, elements, degree, tangents):
        nx, ny = elements
        order = RNG.permutation(nx * ny)
        self.along, self.across = order // ny, order % ny
        near = np.arange(degree + 1)
        rows, columns = degree * self.along[:, None] + near, degree * self.across[:, None] + near
        numbers = RNG.permutation((degree * nx + 1) * (degree * ny + 1)).reshape(degree * nx + 1, -1)
        self.nodes = numbers[rows[:, :, None], columns[:, None, :]].reshape(nx * ny, -1)
        self.count, self.degree, self.elements = numbers.size, degree, elements
        self.given = tangents

    def tangents(self, state, stress, bases, some):
        return np.ascontiguousarray(self.given[some])

    def stresses(self, full, reduced):
        return full


def tangent(elements, degree, shift, held=0.2):
    """Of random symmetric elements, `shift` times one added to each, a share of the unknowns held; and the matrix."""
    n = 5 * (degree + 1) ** 2
    own = RNG.standard_normal((elements[0] * elements[1], n, n))
    cells = Given(elements, degree, own + np.swapaxes(own, 1, 2) + shift * np.eye(n))
    active = RNG.random((cells.count, 5)) > held
    found = Tangent(cells, active)
    diagonal = RNG.standard_normal(int(active.sum()))
    none = np.zeros((cells.count, 6))
    found.assemble(none, none, none, none, diagonal)
    dense = np.diag(diagonal)
    for k, number in zip(cells.given, found.number, strict=True):
        there = number >= 0
        dense[np.ix_(number[there], number[there])] += k[np.ix_(there, there)]
    return found, dense


@pytest.mark.parametrize(("elements", "degree"), [((1, 1), 2), ((7, 1), 2), ((9, 3), 2), ((3, 8), 2), ((4, 2), 3)])
@pytest.mark.parametrize("shift", [60.0, 6.0])
def test_solutions_inertia_and_rows(elements, degree, shift):
    """Positive definite ones, and ones of which a third of the eigenvalues are negative."""
    found, dense = tangent(elements, degree, shift)
    spent = []
    assert found.factor(lambda name, start: spent.append(name))
    assert set(spent) == {"tangent", "factor"}
    negative = int(np.sum(np.linalg.eigvalsh(dense) < 0.0))
    assert found.inertia() == (negative, 0, len(dense) - negative)
    assert (negative == 0) == (shift == 60.0) == (found.growth == 1.0)
    right = RNG.standard_normal(len(dense))
    x = found.solve(right)
    error = np.abs(dense @ x - right)
    assert np.all(error < 1e-14 * found.growth * len(dense) * (np.abs(dense) @ np.abs(x) + np.abs(right)))
    indptr, indices, values = found.compressed()
    rows = np.zeros_like(dense)
    for i in range(len(dense)):
        rows[i, indices[indptr[i] : indptr[i + 1]]] = values[indptr[i] : indptr[i + 1]]
    np.testing.assert_allclose(rows, dense, atol=1e-12)


def test_the_bound_is_the_growth_of_the_factors():
    """A small pivot of an indefinite matrix: g_i = sum_k l_ik^2 |d_k| by the factors of NumPy, in the same order."""
    found, dense = tangent((1, 1), 2, 6.0, held=0.0)
    diagonal = found.diagonal
    for size in (-1e-3, -1e-6):
        diagonal[:] = 0.0
        number = found.structure.index[0]
        diagonal[number] = size - (dense - np.diag(np.diag(dense)))[number, number] - found.cells.given[0, 0, 0]
        assert found.factor(lambda name, start: None)
        order = found.structure.index
        own = found.cells.given[0][np.ix_(*[np.argsort(found.number[0])[order]] * 2)] + np.diag(diagonal[order])
        lower, d, rest = np.eye(len(own)), np.zeros(len(own)), own.copy()
        for k in range(len(own)):
            d[k], lower[k:, k] = rest[k, k], rest[k:, k] / rest[k, k]
            rest -= d[k] * np.outer(lower[:, k] * (np.arange(len(own)) >= k), lower[:, k] * (np.arange(len(own)) >= k))
        size_of = np.abs(np.diag(found.cells.given[0]))[np.argsort(found.number[0])[order]] + np.abs(diagonal[order])
        g = lower**2 @ np.abs(d)
        assert found.growth == pytest.approx(1.0 + np.max((g - np.diag(own)) / size_of), rel=1e-4)
    assert found.growth > 1e4


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_a_pivot_of_nothing_is_refused(value):
    found, _ = tangent((3, 2), 2, 60.0)
    first = found.structure.index[0]
    element = np.argwhere(found.number == first)[0]
    found.diagonal[first] = -found.cells.given[element[0], element[1], element[1]] if value == 0.0 else value
    assert not found.factor(lambda name, start: None)
    assert found.growth == np.inf


@pytest.mark.parametrize(("elements", "degree"), [((13, 5), 2), ((3, 10), 3), ((40, 4), 2)])
def test_every_element_is_in_the_tree_once(elements, degree):
    tree = Tree(elements, degree)
    cells = tree.cells[tree.cells >= 0]
    np.testing.assert_array_equal(np.sort(cells), np.arange(elements[0] * elements[1]))
    children = tree.children[tree.children[:, 0] >= 0]
    np.testing.assert_array_equal(np.sort(children.ravel()), np.arange(len(tree.cells) - 1))
    runs = batches(tree)
    assert [first for first, _ in runs[1:]] == [last for _, last in runs[:-1]]
    assert (runs[0][0], runs[-1][1]) == (0, len(tree.cells))


def structure(elements, degree=2):
    nx, ny = elements
    nodes = np.arange((degree * nx + 1) * (degree * ny + 1)).reshape(degree * nx + 1, -1)
    near = np.arange(degree + 1)
    rows = degree * np.repeat(np.arange(nx), ny)[:, None] + near
    columns = degree * np.tile(np.arange(ny), nx)[:, None] + near
    own = nodes[rows[:, :, None], columns[:, None, :]].reshape(nx * ny, -1)
    return Structure(Tree(elements, degree), (5 * own[:, None, :] + np.arange(5)[:, None]).reshape(nx * ny, -1))


@pytest.mark.parametrize("across", [2, 8])
def test_work_and_memory_are_linear_in_the_length(across):
    """Four times the length: four times the work and the factors, the same fronts; less than a band would take."""
    short, long = structure((100, across)), structure((400, across))
    assert 3.9 < long.multiplications / short.multiplications < 4.1
    assert 3.9 < long.rows[-1] / short.rows[-1] < 4.1
    assert (long.most_size, long.most_kept) == (short.most_size, short.most_kept)
    band = 5 * (2 * (2 * across + 1) + 3)
    assert short.multiplications < 0.5 * short.unknowns * band**2 / 2


def test_mumps_is_taken_where_the_factors_are_not_safe(monkeypatch):
    """The bound made small: the same walk, by the matrix put together and factored with a search for pivots."""
    problem = ShellProblem(0.1, 5e-3, 0.3, (2.0, 1.0), 6.0, (0.6, 0.8, 0.0), elements=(8, 2))
    clean = solve(problem)
    monkeypatch.setattr(linear, "MOST_GROWTH", 0.0)
    other = solve(problem)
    assert other.seconds["mumps"] > 0.0
    assert "mumps" not in clean.seconds
    assert np.max(np.abs(other.surface.points - clean.surface.points)) < 1e-10
    assert other.lowest_eigenvalue == pytest.approx(clean.lowest_eigenvalue, rel=1e-6)
    assert other.newton_iterations == clean.newton_iterations


def test_the_blas_takes_one_thread_while_factors_are_made(monkeypatch):
    """Where the user has set nothing, and as many as before afterwards."""
    from ribbonbench import threads

    count = [4]
    monkeypatch.setattr(threads, "loaded", lambda: ((lambda: count[0], lambda n: count.__setitem__(0, n)),))
    for name in threads.VARIABLES:
        monkeypatch.delenv(name, raising=False)
    with threads.one_thread():
        assert count == [1]
    assert count == [4]
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    with threads.one_thread():
        assert count == [4]


def test_inertia_along_a_path_is_that_of_mumps():
    """Random states of a strip, far from balance, with shifts through its spectrum."""
    from shellref.fenics import dolfinx_api as api
    from shellref.fenics import petsc_api as petsc
    from shellref.shell.director import retract
    from shellref.shell.strip import build_strip

    problem = ShellProblem(0.1, 1e-3, 0.3, (5.0, 1.0), 20.0, (0.6, 0.8, 0.0), elements=(20, 3))
    solver = Solver(build_strip(problem, ShellOptions()), ShellOptions(), api.communicator("self"), lambda event: None)
    e, model = solver.equilibrium, solver.model
    seen = set()
    for shift in (0.0, -30.0, -1e3, -1e5):
        state = retract(solver.strip.initial_state(model.nodes), 1e-4 * RNG.standard_normal((len(model.nodes), 6)))
        stress = model.stress(state)
        e.factor(state, stress, model.force(state, stress), shift)
        judge = petsc.SymmetricFactor(e.matrix)
        judge.factor()
        assert e.factors.safe
        assert e.factors.inertia() == judge.inertia()
        right = RNG.standard_normal(e.unknowns)
        size = np.abs(petsc.to_scipy(e.matrix)) @ np.abs(e.factors.solve(right))
        error = petsc.multiply(e.matrix, e.factors.solve(right)) - right
        assert np.max(np.abs(error) / size) < 1e-12
        seen.add(judge.inertia()[0])
    assert len(seen) > 2
