"""The recursion against dense linear algebra, Newton's method against Ipopt, eigenvalues against all of them."""

import numpy as np
import pytest
import scipy

from ribbon import Clamp, Gravity, Strip
from ribbon.find import nested
from ribbon.find.solve import build, refine, solve
from ribbon.judge import stability
from ribbon.judge.inertia import Pencil
from ribbon.solvers import choose, ipopt, newton, riccati
from ribbon.solvers.problem import kkt_residual

UP = Gravity((0.48, 0.36, 0.8))


def chained(energy="wunderlich", segments=17, tip=None, gravity=UP, **strip):
    """A chained ribbon that is heavy and curled."""
    thickness = {"thickness": 0.001} if energy in ("kirchhoff", "finite") else {}
    body = Strip(**{"length": 1.0, "width": 0.1, "gamma": 20.0, "natural_curvature": (3.0, 1.0), **thickness, **strip})
    return build(body, Clamp(), gravity, energy=energy, segments=segments, tip=tip, formulation="chained")


@pytest.mark.parametrize("energy", ["wunderlich", "sadowsky", "kirchhoff", "finite"])
@pytest.mark.parametrize("tip", [None, (0.3, 1.0, -0.5)])
@pytest.mark.parametrize(("shift", "part_held", "extra"), [(0.0, 0.0, 0.0), (5.0, 0.0, 3.0), (-3.0, 0.3, 0.0)])
def test_recursion_is_the_dense_system(energy, tip, shift, part_held, extra):
    rng = np.random.default_rng(3)
    problem = chained(energy, tip=tip)
    n, p, f = problem.size, problem.lengths.size, problem.fields.count
    x = 0.5 * rng.standard_normal(n)
    held = rng.random(n) < part_held
    more = extra * rng.random(n)
    local, u, v = problem.jets(x)
    gains, inverses, first = np.empty((p, f, f + 3)), np.empty((p, f, f)), np.empty((f, f))
    negative = riccati.factor(problem.lengths, local, True, u, v, shift, more, held, gains, inverses, first)
    dense = (problem.hessian(x) + shift * problem.metric() + np.diag(more))[np.ix_(~held, ~held)]
    assert negative == int((np.linalg.eigvalsh(dense) <= 0.0).sum())
    right, step, turned = rng.standard_normal(n), np.empty(n), np.empty(3)
    riccati.solve(problem.lengths, True, u, gains, inverses, first, right, step, turned)
    expected = np.linalg.solve(dense, right[~held])
    assert np.allclose(step[~held], expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())
    assert not step[held].any()


def test_metric_times_a_vector():
    problem = chained("kirchhoff")
    y, out = np.random.default_rng(1).standard_normal((2, problem.size))
    riccati.mass_times(problem.lengths, problem.fields.count, y, out)
    assert np.allclose(out, problem.metric() @ y, rtol=0.0, atol=1e-13)


def test_a_weightless_strip_needs_no_rotation():
    problem = chained(gamma=0.0, gravity=None)
    minimum = newton.minimise(problem, problem.linear((1.0, 2.0), (0.3, -0.2)))
    assert minimum.finished
    assert np.allclose(minimum.x, ipopt.minimise(problem, minimum.x).x, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("energy", ["wunderlich", "sadowsky", "kirchhoff", "finite"])
@pytest.mark.parametrize("tip", [None, (3.0, 1.0, -2.0)])
def test_newton_agrees_with_ipopt(energy, tip):
    problem = chained(energy, 20, tip)
    found, judge = (each.minimise(problem, problem.natural_state()) for each in (newton, ipopt))
    assert found.residual <= 1e-10
    assert np.abs(problem.joints(found.x)[0] - problem.joints(judge.x)[0]).max() <= 1e-9


def test_rulings_on_their_bound():
    """A wide Sadowsky strip whose rulings meet on the edge: the multipliers press, and Ipopt finds the same."""
    problem = chained("sadowsky", 40, (20.0, 5.0, -10.0), gamma=0.0, width=0.2, natural_curvature=(-6.0, 6.0))
    minimum = newton.minimise(problem, problem.natural_state())
    pressed = minimum.multipliers != 0.0
    assert pressed.any()
    assert kkt_residual(problem, minimum.x, minimum.multipliers) <= 1e-9
    judge = ipopt.minimise(problem, minimum.x)
    assert np.abs(problem.joints(minimum.x)[0] - problem.joints(judge.x)[0]).max() <= 1e-8


@pytest.mark.parametrize("gamma", [20.0, 300.0])
def test_lowest_eigenvalue_is_that_of_the_dense_pencil(gamma):
    problem = chained(gamma=gamma, segments=30)
    for x in (problem.natural_state(), newton.minimise(problem, problem.natural_state()).x):
        lower, upper = problem.bounds()
        held = lower == upper
        values, _ = scipy.linalg.eigh(*(m[np.ix_(~held, ~held)] for m in (problem.hessian(x), problem.metric())))
        pencil = Pencil(problem, x, held)
        lowest, mode = pencil.lowest()
        assert lowest == pytest.approx(values[0], rel=1e-8, abs=1e-10)
        assert mode @ problem.hessian(x) @ mode == pytest.approx(lowest, rel=1e-7, abs=1e-9)
        assert values[-1] <= pencil.largest() <= 4.0 * max(1.0, values[-1])


@pytest.mark.parametrize("segments", [1, 2, 5, 90])
def test_stability_is_that_of_all_eigenvalues(segments, monkeypatch):
    problem = chained(segments=segments, gamma=60.0)
    x = newton.minimise(problem, problem.natural_state()).x
    quick = stability.check(problem, x)
    monkeypatch.setattr(stability, "_by_inertia", lambda *_: None)
    slow = stability.check(problem, x)
    assert quick.stable == slow.stable
    assert quick.eigenvalue == pytest.approx(slow.eigenvalue, rel=1e-7)
    assert abs(quick.mode @ problem.metric() @ slow.mode) == pytest.approx(1.0, abs=1e-5)


def test_nested_start_is_the_same_state_and_says_what_is_missing():
    problem = chained(segments=320, gamma=100.0)
    at_once = newton.minimise(problem, problem.natural_state())
    minimum = nested.minimum(problem, problem.natural_state())
    assert np.abs(minimum.x - at_once.x).max() <= 1e-8 * np.abs(at_once.x).max()
    finer = problem.with_changes(lengths=np.repeat(problem.lengths / 2.0, 2))
    there = nested.minimum(finer, finer.natural_state())
    missing = np.abs(problem.joints(minimum.x)[0] - finer.joints(there.x)[0][::2]).max()
    assert missing <= minimum.moved <= 40.0 * missing


def test_many_segments_in_one_go():
    found = solve(Strip(1.0, 0.01, gamma=50.0, natural_curvature=5.0), Clamp(), UP, segments=5000)
    assert found.ok
    assert found.solver == "Newton"
    assert found.problem.formulation == "chained"
    assert found.moved <= 1e-5


def test_solver_asked_for():
    strip = Strip(1.0, 0.1, gamma=20.0, natural_curvature=3.0)
    by = {name: solve(strip, Clamp(), UP, solver=name) for name in choose.SOLVERS}
    assert [by[name].solver for name in choose.SOLVERS] == ["Newton", "Newton", "Ipopt"]
    assert np.abs(by["newton"].joints[0] - by["ipopt"].joints[0]).max() <= 1e-10
    with choose.using("ipopt"):
        assert refine(by["newton"]).solver == "Newton, dense"  # from so near that no barrier is wanted
    assert refine(by["ipopt"]).solver == "Newton"
    with pytest.raises(Exception, match="solver"):
        solve(strip, Clamp(), UP, solver="bfgs")
