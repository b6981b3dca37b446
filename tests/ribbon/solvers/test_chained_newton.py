"""Newton's iteration of chained ribbons: its shifts, and steps that a bound of the rulings would cut short."""

import time

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip
from ribbon.find import nested
from ribbon.find.relax import placed
from ribbon.find.solve import build, starting_shapes
from ribbon.problems import prolonged, transfer
from ribbon.problems.chained import ChainedProblem
from ribbon.solvers import budget, chained_newton, newton, riccati
from ribbon.solvers.problem import force_scale
from ribbonbench import clock

HALF_DOWN = Gravity((0.6, 0.0, 0.8))


def heavy(gamma, curl, segments=40):
    return build(
        Strip(1.0, 0.05, gamma=gamma, natural_curvature=curl), Clamp(), HALF_DOWN, segments=segments,
        formulation="chained",
    )  # fmt: skip


def started(problem):
    return placed(problem, *next(iter(starting_shapes(problem, "natural", 0.0))))


def factored(problem, x):
    """What `riccati.factor` takes at x, but for the shift: before it, and behind it; all of it as `Linear`."""
    local, u, v = problem.jets(x)
    p, lower, upper = problem.lengths.size, *problem.bounds()
    behind = np.zeros(x.size), lower == upper, np.empty((p, 2, 5)), np.empty((p, 2, 2)), np.empty((2, 2))
    before = problem.lengths, local, problem.is_loaded, u, v
    return before, behind, chained_newton.Linear(*before, *behind)


@pytest.mark.parametrize("last", [0.0, 1e-9, 0.3, 1e6])
def test_a_shift_is_enough_and_little_more(last):
    problem = heavy(300.0, 1.0)
    x = started(problem)
    before, behind, linear = factored(problem, x)
    assert riccati.factor(*before, 0.0, *behind) > 0
    shift = chained_newton._least_shift(last, 10.0, linear)
    kept = [array.copy() for array in behind[2:]]
    assert riccati.factor(*before, shift, *behind) == 0
    for array, found in zip(kept, behind[2:], strict=True):  # the factors are those of the shift
        assert np.array_equal(array, found)
    assert riccati.factor(*before, shift / chained_newton._NARROW, *behind) > 0


def test_a_ruling_at_its_bound_does_not_shorten_the_step_of_the_others():
    """One ruling is put close to its bound and pressed beyond: the step goes half of the way to it there, and is
    otherwise that of the quadratic energy with this unknown as it is."""
    problem = heavy(20.0, 1.0, 12)
    x = newton.minimise(problem, started(problem)).x
    lower, upper = problem.bounds()
    place = np.arange(x.size)[problem.layout.eta_slope][4]
    assert np.isfinite(upper[place])
    x[place] = upper[place] * (1.0 - 1e-3)
    slopes = 1e-2 * np.cos(np.arange(x.size))
    slopes[place] = -1e3
    before, behind, linear = factored(problem, x)
    held = behind[1]
    step, turned = np.empty(x.size), np.empty(3)
    shift = chained_newton._least_shift(0.0, 100.0, linear)
    right = -slopes
    riccati.solve(before[0], before[2], before[3], *behind[2:], right, step, turned)
    assert step[place] > upper[place] - x[place]
    bounds = chained_newton.Bounds(lower, upper, 1.0)
    chained_newton._inside(linear, shift, x, slopes, bounds, 1e10, right, step, turned)
    path = chained_newton._SHARE * (upper[place] - x[place])
    assert step[place] == pytest.approx(path, rel=1e-4)
    free = ~held
    free[place] = False
    hessian = problem.hessian(x) + shift * problem.metric()
    expected = np.linalg.solve(hessian[np.ix_(free, free)], -slopes[free] - hessian[free, place] * step[place])
    assert np.abs(step[free] - expected).max() <= 1e-6 * np.abs(expected).max()
    assert slopes @ step < 0.0


def test_heavy_strips_take_few_steps():
    """Rulings that come to their bound on the way: 50 steps in the mean when one of them cut the step of
    all, 33 with all but `_inside`, 28 now."""
    steps = []
    for gamma in (300.0, 500.0, 700.0, 900.0):
        for curl in (-1.9, -0.7, 0.4, 1.6):
            problem = heavy(gamma, curl)
            minimum = newton.minimise(problem, started(problem))
            assert minimum.residual <= 1e-9
            steps.append(minimum.iterations)
    assert np.mean(steps) <= 31.0


def test_a_call_ends_soon_where_series_are_long():
    """The clock and signals are looked at between calls: a call goes through `_TURNED` rad of series, and a step at
    least, however many steps it may make."""
    for curl, most in ((100.0, 200), (9e3, 12), (9e4, 2)):
        problem = ChainedProblem(
            Strip(1.0, 0.05, natural_curvature=curl, gamma=1e3), Clamp(), Gravity(), "wunderlich", np.full(20, 0.05)
        )
        x = problem.natural_state()
        x[0] *= 1.001
        state, gradient = np.zeros(chained_newton.STATE), np.empty(x.size)
        own = chained_newton.jets(problem.lengths.size, problem.fields.count, problem.is_loaded)
        below, above = np.zeros((2, x.size))
        given = newton.arguments(problem)
        chained_newton.descend(x, *given, (0.0, 0.0), 200, state, gradient, below, above, own)
        assert state[chained_newton.DERIVATIVES] <= most + 1
        assert state[chained_newton.ITERATIONS] <= most


def _counted() -> float:
    """Time (s) of this thread on the processor, without compiling: what a budget counts."""
    return time.thread_time() - sum(seconds() for seconds in clock.UNCOUNTED)


@pytest.mark.parametrize("curl", [1e5, 1e7, 1e10, 1e200])
def test_a_budget_is_kept_whatever_the_curl(curl):
    """Beyond what `solve` takes, too: 9 to 18 minutes once."""
    problem = ChainedProblem(
        Strip(1.0, 0.05, natural_curvature=curl, gamma=10.0), Clamp(), Gravity(), "wunderlich", np.full(20, 0.05)
    )
    began = _counted()
    with budget.within(0.5):
        newton.minimise(problem, problem.natural_state())
    assert _counted() - began < 60.0


def test_what_the_iteration_leaves_is_of_its_last_point():
    """Jets that are kept for the verdict are those of the state itself, not of a point beside."""
    for gamma, curl in ((0.0, 3.0), (30.0, 5.0), (300.0, -8.0)):
        problem = ChainedProblem(
            Strip(1.0, 0.05, natural_curvature=curl, gamma=gamma), Clamp(), Gravity(), "wunderlich", np.full(20, 0.05)
        )
        found = newton.minimise(problem, problem.natural_state())
        kept = problem.jets(found.x)
        fresh = problem.with_changes().jets(found.x)
        for one, other in zip(kept, fresh, strict=True):
            assert np.abs(one - other).max() <= 1e-12 * np.abs(other).max()


def test_twice_as_many_segments_are_few_steps_away_and_none_is_roundings():
    """A coil between smooth curves: what few segments have, put together to fourth order, is 8 times nearer than linear
    pieces of it, and the iteration ends when the last two steps say that nothing is left but rounding."""
    strip = Strip(1.0, 1e-3, 0.4, 40.0, 1200.0)
    few = ChainedProblem(strip, Clamp(ruling="free"), HALF_DOWN, "sadowsky", np.full(160, 1.0 / 160.0))
    many = few.with_changes(lengths=np.full(320, 1.0 / 320.0))
    coarse = nested.minimum(few, few.natural_state())
    start = prolonged.fields(few, coarse.x, many)
    found = newton.minimise(many, start, near=True)
    assert found.residual <= newton.TOLERANCE * force_scale(many)
    from_linear = newton.minimise(many, transfer.on_joints(few, coarse.x, many), near=True)
    assert found.iterations <= from_linear.iterations  # fewer by one where rounding lets it
    right = many.joint_values(found.x)
    linear = many.joint_values(transfer.on_joints(few, coarse.x, many))
    for field, (there, plain) in enumerate(zip(many.joint_values(start), linear, strict=True)):
        assert 8.0 * np.abs(there - right[field]).max() < np.abs(plain - right[field]).max()
    longer = newton.minimise(many, found.x, near=True)
    assert np.abs(longer.x - found.x).max() <= 1e-9 * np.abs(found.x).max()


def test_a_step_with_a_barrier_does_not_say_how_the_next_ones_converge():
    """Two whole Newton steps tell what is left: one that follows the barrier's last leaves more than they would say."""
    problem = ChainedProblem(
        Strip(1.0, 0.05, gamma=3.0, natural_curvature=3.0), Clamp(), HALF_DOWN, "sadowsky", np.full(8, 0.125)
    )

    def ended(exact, most):
        x, state = started(problem), np.zeros(chained_newton.STATE)
        own = chained_newton.jets(problem.lengths.size, problem.fields.count, problem.is_loaded)
        below, above = np.zeros((2, x.size))
        given = newton.arguments(problem)
        chained_newton.descend(x, *given, exact, most, state, np.empty(x.size), below, above, own)
        return state[[chained_newton.RESIDUAL, chained_newton.BARRIER]]

    residual, barrier = np.array([ended((0.0, 0.0), k) for k in range(8)]).T
    first = int(np.argmax(barrier == 0.0))
    assert barrier[first - 1] > 0.0
    good = 1.001 * residual[first] ** 3 / residual[first - 1] ** 2
    assert residual[first + 1] > good
    assert ended((1e-3, good), 20)[0] <= good
