"""Dual-weighted estimates of asked quantities: their parts, a linear case, finer meshes, single columns, refinement."""

from dataclasses import replace

import numpy as np
import pytest

from shellref import ShellInputError, ShellOptions, ShellProblem, ShellStatus

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.fenics import dolfinx_api as api  # noqa: E402
from shellref.path import weighted  # noqa: E402
from shellref.path.graded import BULK, SAFETY, bulk, judged  # noqa: E402
from shellref.path.solve import solve  # noqa: E402
from shellref.path.solver import Solver  # noqa: E402
from shellref.shell.grid import Grid  # noqa: E402
from shellref.shell.problem import Pose  # noqa: E402
from shellref.shell.strip import build_strip  # noqa: E402
from tests.shellref.path.test_shell_adaptive import CURL  # noqa: E402

ARCH = ShellProblem(
    width=0.1,
    thickness=2e-3,
    poisson=0.3,
    gamma=30.0,
    up=(0.0, 1.0, 0.0),
    end=Pose((0.0, 0.0, 0.7), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))),
    start_curvature=2.5,
    elements=(12, 2),
)
PULLED = ShellProblem(width=0.1, thickness=5e-3, poisson=0.3, tip=(1.0, -2.0, 0.3), elements=(10, 2))


def solver_of(problem, options=None, grid=None):
    options = options or ShellOptions()
    return Solver(build_strip(problem, options, grid=grid), options, api.communicator("self"), lambda event: None)


def asked(result, goal):
    if goal == "energy":
        return np.array([result.energy["total"]])
    return result.surface.centreline(np.array(weighted.PLACES[goal]))


@pytest.fixture(scope="module")
def curl():
    options = ShellOptions(goal="end")
    solver = solver_of(replace(CURL, elements=(12, 2)), options)
    return solver.run(), solver


# -- parts ------------------------------------------------------------------------------------------------------------


def test_columns_and_rows_are_cut_each_for_itself():
    grid = Grid(np.array([0.0, 0.2, 1.0]), np.array([-1.0, 1.0])).refined([1, 2], 3)
    np.testing.assert_allclose(grid.s_knots, [0.0, 0.2, 0.6, 1.0])
    np.testing.assert_allclose(grid.v_knots, [-1.0, -1.0 / 3.0, 1.0 / 3.0, 1.0])
    np.testing.assert_allclose(grid.refined(1, [1, 1, 2]).v_knots[-3:], [1.0 / 3.0, 2.0 / 3.0, 1.0])


def test_the_largest_indicators_that_carry_the_sum():
    each = np.array([1.0, 40.0, 2.0, 50.0, 7.0])
    np.testing.assert_array_equal(bulk(each), [False, True, False, True, False])
    assert each[bulk(each)].sum() >= BULK * each.sum()
    np.testing.assert_array_equal(bulk(np.ones(5)), [True, True, True, True, False])


def test_lifted_and_carried_fields_are_exact_for_their_polynomials(curl):
    _, solver = curl
    coarse = solver.model
    fine = solver_of(CURL, grid=coarse.grid.refined(2, 1)).model

    def cubic(nodes):
        s, v = nodes.T
        return np.stack([s**3 * v, s**2 - v**2, 1.0 + s * v, s**3, v, 0.0 * s], axis=1)

    np.testing.assert_allclose(weighted.lifted(coarse, fine, cubic(coarse.nodes)), cubic(fine.nodes), atol=1e-12)

    def bilinear(points):
        s, v = points[..., 0], points[..., 1]
        return np.stack([1.0 + s, v, s * v, 2.0 * s - v, 0.0 * s], axis=-1)

    thin = weighted.carried(coarse, fine, bilinear(coarse.gauss_points[1]))
    for found, points in zip(thin, fine.gauss_points, strict=True):
        np.testing.assert_allclose(found, bilinear(points), atol=1e-12)


@pytest.mark.parametrize("problem", [CURL, PULLED], ids=["weight", "tip"])
def test_the_mixed_residual_of_own_strains_is_the_residual(problem):
    """Summed over the cells, of a random state; and its energy is the model's."""
    solver = solver_of(problem)
    model, random = solver.model, np.random.default_rng(3)
    weighted.last_stage(solver)
    state = model.reference + 0.1 * random.standard_normal(model.reference.shape)
    z = random.standard_normal(state.shape)
    own, changed = weighted.own_strains(model, state), weighted.own_changes(model, state, z)
    tip = np.array(problem.tip or (0.0, 0.0, 0.0))
    found = weighted.weighed(model, state, z, own, changed) - weighted.load_work(model, z, tip)
    assert found.sum() == pytest.approx(np.sum(model.residual(state) * z), rel=1e-10)
    energy = weighted.mixed_energy(model, state, own) - weighted.load_work(model, state, tip)
    assert energy.sum() == pytest.approx(model.energies(state).total, rel=1e-10)


@pytest.mark.parametrize("place", [0.0, 0.37, 0.5, 1.0])
@pytest.mark.parametrize("elements", [(5, 1), (4, 2)])
def test_the_weights_give_the_centreline(place, elements):
    solver = solver_of(replace(CURL, elements=elements))
    state = solver.strip.initial_state(solver.model.nodes)
    weights = weighted.centre_weights(solver.model, place)
    surface = solver.surface(state)
    np.testing.assert_allclose(weights @ state[:, :3], surface.centreline(np.array(place)), atol=1e-14)


# -- estimates --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("goal", ["end", "middle", "energy"])
def test_of_a_linear_problem_the_change_is_exact(goal, axis):
    """A thick strip under a small force in its plane and out of it: no other stress, so one linear solve is all."""
    options = ShellOptions(goal=goal, tolerance=1e-12)
    problem = replace(PULLED, tip=(1e-5, -2e-5, 0.0), thickness=0.02, elements=(4, 2))
    solver = solver_of(problem, options)
    result = solver.run()
    estimate = weighted.Weighted(result, solver).direction(axis)
    assert estimate.sharp
    cut = solver_of(problem, options, solver.model.grid.refined(*((2, 1), (1, 2))[axis]))
    change = asked(cut.run(), goal) - asked(result, goal)
    assert np.linalg.norm(change) > 0
    np.testing.assert_allclose(estimate.change, change, atol=1e-3 * np.linalg.norm(change))


@pytest.mark.parametrize(
    ("problem", "goal"),
    [
        (replace(CURL, elements=(12, 4)), "end"),
        (replace(CURL, elements=(12, 4)), "energy"),
        (ARCH, "middle"),
        (ARCH, "energy"),
        (PULLED, "end"),
    ],
    ids=["curl", "curl's energy", "two clamps", "two clamps' energy", "force at the tip"],
)
def test_the_error_to_a_much_finer_mesh(problem, goal):
    """Effectivity index between 0.5 and 2; what stops the refinement is not below the error."""
    solver = solver_of(problem, ShellOptions(goal=goal))
    result = solver.run()
    fine = solve(replace(problem, elements=(24, 6), degree=3), ShellOptions(stability=False), start=result.surface)
    assert fine.status is ShellStatus.CONVERGED
    scale = 1.0 / result.energy["elastic"] if goal == "energy" else 1.0
    error = scale * np.linalg.norm(asked(fine, goal) - asked(result, goal))
    row, _ = judged(result, solver, 1e-9)
    assert row["sharp"] == [True, True]
    change = np.linalg.norm(np.sum(row["change"], axis=0))
    assert 0.5 < change / error < 2.0
    assert row["estimate"] > 0.9 * error  # may be larger by far: along and across may cancel, as in the arch's energy


def test_indicators_are_what_single_columns_change(curl):
    """Each column cut alone: the position of the end moves by the column's indicator, to a third of the largest."""
    result, solver = curl
    estimate = weighted.Weighted(result, solver).direction(0)
    before = asked(result, "end")
    single = []
    for column in range(12):
        parts = [1 + (k == column) for k in range(12)]
        single.append(
            asked(solver_of(CURL, grid=solver.model.grid.refined(parts, 1)).run(result.surface), "end") - before
        )
    single = np.linalg.norm(single, axis=1)
    assert np.abs(estimate.each - single).max() < 0.34 * single.max()
    assert np.corrcoef(estimate.each, single)[0, 1] > 0.95
    assert np.linalg.norm(estimate.indicators.sum(axis=0)) == pytest.approx(estimate.size, rel=1.0)


def test_a_mesh_too_coarse_to_be_judged_is_cut_everywhere(curl, monkeypatch):
    """The cut mesh's tangent has another inertia than the state: the indicators' sum stands for the change."""
    result, solver = curl
    other = replace(result, negative_eigenvalues=1)
    estimate = weighted.Weighted(other, solver).direction(0)
    assert not estimate.sharp
    np.testing.assert_allclose(estimate.change, estimate.indicators.sum(axis=0))
    row, parts = judged(other, solver, 1e-9)
    assert row["sharp"] == [False, False]
    assert parts == [[2] * 12, [2] * 2]


# -- refinement -------------------------------------------------------------------------------------------------------


def test_an_accuracy_of_the_end_is_reached_with_fewer_cells():
    fine = solve(replace(CURL, elements=(40, 8), degree=3), ShellOptions(stability=False, coarse=False))
    result = solve(replace(CURL, elements=(12, 2)), ShellOptions(accuracy=2e-4, goal="end"))
    assert result.status is ShellStatus.CONVERGED
    found = result.discretisation
    assert found["reached"] is True
    assert found["goal"] == "end"
    assert found["estimate"] <= 2e-4
    error = np.linalg.norm(asked(result, "end") - asked(fine, "end"))
    assert error <= 1.1 * found["estimate"]
    meshes = found["meshes"]
    assert meshes[-1]["elements"] == list(result.elements)
    assert len(found["columns"]) == result.elements[0] == len(found["s_knots"]) - 1
    assert len(found["rows"]) == result.elements[1] == len(found["v_knots"]) - 1
    assert meshes[-1]["estimate"] == pytest.approx(SAFETY * (meshes[-1]["along"] + meshes[-1]["across"]))
    sizes = np.diff(found["s_knots"])
    assert sizes.max() > 3.0 * sizes.min()  # graded, by more than the first mesh
    np.testing.assert_allclose(found["s_knots"], result.surface.s_nodes[::2])
    assert result.to_dict()["discretisation"]["columns"] == found["columns"]
    settled = [step for step in result.steps if step.method == "start"][1:]
    assert len(settled) == len(meshes) - 1
    assert max(step.iterations for step in settled) <= 6


def test_cells_are_limited():
    result = solve(replace(CURL, elements=(12, 2)), ShellOptions(accuracy=1e-7, goal="end", max_cells=40))
    assert result.discretisation["reached"] is False
    assert "not reached within max_cells = 40" in result.message


@pytest.mark.parametrize(
    ("problem", "options", "why"),
    [
        (ARCH, {"goal": "end"}, "held by a clamp"),
        (replace(ARCH, slide=((0.0, 0.0, 1.0), None)), {"goal": "middle"}, "slide, turn or deform"),
        (replace(CURL, clamp="free", gamma=0.0, up=None), {"goal": "end"}, "held nowhere"),
        (replace(PULLED, transverse_curvature=1.0), {"goal": "end"}, "curved section"),
        (CURL, {"goal": "end", "engine": "forms"}, "compiled elements"),
    ],
)
def test_what_has_no_estimate_is_refused_before_anything_is_solved(problem, options, why):
    events = []
    with pytest.raises(ShellInputError, match=why):
        solve(problem, ShellOptions(accuracy=1e-3, **options), events.append)
    assert not [event for event in events if event["event"] == "step"]
