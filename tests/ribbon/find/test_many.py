"""Batches: the states that `ribbon.solve` finds, case by case, and what does not plainly converge goes there."""

import numpy as np
import pytest

from ribbon import Clamp, Gravity, RibbonInputError, Status, Strip, solve, solve_many
from ribbon.solvers import choose

UP = Gravity((0.48, 0.36, 0.8))
LEVEL = Clamp((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def strips(count=9):
    rng = np.random.default_rng(2)
    return [
        Strip(1.0, 0.05, gamma=10 ** rng.uniform(0, 2.5), natural_curvature=rng.uniform(-4, 4)) for _ in range(count)
    ]


@pytest.mark.parametrize("energy", ["wunderlich", "sadowsky"])
def test_each_case_is_that_of_solve(energy):
    cases = strips()
    said = []
    many = solve_many(cases, Clamp(), UP, energy=energy, segments=30, progress=lambda *counts: said.append(counts))
    assert said[-1] == (len(cases), len(cases))
    for i, strip in enumerate(cases):
        alone = solve(strip, Clamp(), UP, energy=energy, segments=30)
        assert many.status[i] is alone.status
        assert np.array_equal(many.x[i], alone.x)
        assert np.array_equal(many.ends()[i], alone.joints[0][-1])
        assert many.energies()[i].sum() == alone.energy.total
        assert many.lowest_eigenvalue[i] == alone.lowest_eigenvalue
        assert many.iterations[i] == alone.iterations
        assert many.equilibrium(i).message == alone.message


def test_each_case_has_its_own_seed():
    """A heavy level strip begun downwards and upwards."""
    strip, seeds = Strip(1.0, 0.05, gamma=500.0), [([-9.0, 0.0, 0.0, 0.0], 0.0), (3.0, [0.0, 0.1])]
    many = solve_many([strip, strip], LEVEL, Gravity((0.0, 0.0, 1.0)), segments=24, seeds=seeds)
    for found, (curvature, ruling) in zip(many.found, seeds, strict=True):
        alone = solve(
            strip, LEVEL, Gravity((0.0, 0.0, 1.0)), segments=24, seed_curvature=curvature, seed_ruling=ruling
        )  # fmt: skip
        assert np.array_equal(found.x, alone.x)
    assert many.iterations[0] != many.iterations[1]
    with pytest.raises(RibbonInputError, match="seeds"):
        solve_many([strip], LEVEL, seeds=seeds)
    with pytest.raises(RibbonInputError, match="case 1"):
        solve_many([strip, strip], LEVEL, seeds=[("natural", 0.0), ("straight", 0.0)])


def test_a_budget_is_each_case_s():
    cases = strips(3)
    many = solve_many(cases, Clamp(), UP, segments=30, budget=1e-9)
    assert {found.status for found in many.found} == {Status.NOT_CONVERGED}
    assert not many.ok.any()
    assert set(many.again) == {0, 1, 2}
    assert solve_many(cases, Clamp(), UP, segments=30, budget=100.0).ok.all()


def test_the_solver_asked_for_around_it_solves():
    cases = strips(3)
    with choose.using("ipopt"):
        many = solve_many(cases, Clamp(), UP)
    steps = [solve(strip, Clamp(), UP, solver="ipopt").iterations for strip in cases]
    assert many.iterations.tolist() == steps
    assert steps != solve_many(cases, Clamp(), UP).iterations.tolist()


def test_threads_change_nothing():
    one, two = (solve_many(strips(150), Clamp(), UP, threads=n) for n in (1, 2))
    assert np.array_equal(one.x, two.x)


def test_neighbours_as_starts_along_a_curve_of_states():
    cases = [Strip(1.0, 0.05, gamma=g) for g in np.linspace(5.0, 60.0, 30)]
    cold, warm = (solve_many(cases, LEVEL, UP, warm=warm) for warm in (False, True))
    assert np.abs(cold.ends() - warm.ends()).max() <= 1e-9
    assert warm.iterations.sum() < cold.iterations.sum()


def test_a_saddle_and_an_own_force_for_each():
    """A curled strip in a vertical plane, which it would leave, and the same pulled out of it."""
    strip, up = Strip(1.0, 0.01, gamma=50.0, natural_curvature=5.0), Gravity((0.0, 0.6, 0.8))
    many = solve_many([strip, strip], Clamp(), up, tip=[None, (20.0, 0.0, 0.0)])
    assert many.status == (Status.SADDLE, Status.CONVERGED)
    assert set(many.again) == {0}
    alone = solve(strip, Clamp(), up, tip=(20.0, 0.0, 0.0))
    assert np.abs(many.ends()[1] - alone.joints[0][-1]).max() <= 1e-9


def test_bad_input_names_the_case():
    with pytest.raises(RibbonInputError, match="gravity"):
        solve_many(strips(3), Clamp(), [UP, UP])
    with pytest.raises(RibbonInputError, match="case 1"):
        solve_many(strips(2), Clamp(), UP, tip=[None, (1.0, 2.0)])
    assert len(solve_many([], Clamp(), UP)) == 0
