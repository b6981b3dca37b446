"""Bands of several half turns: one fold's rows and derivatives, the whole band, its ways down, finer segments."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Closure, RibbonInputError, Strip, refine, solve
from ribbon.find.adaptive import solve_to_tolerance
from ribbon.find.bands import folds
from ribbon.find.solving.assemble import assembled
from ribbon.find.solving.request import Request
from ribbon.judge import reduction
from ribbon.problems.alike.fold import fold_of, unfolded
from ribbon.result import Status
from tests.ribbon.find.dense_tangent import reduce

STRIP = Strip(1.0, 0.05, 0.3, thickness=5e-4)


def closure(n: int) -> Closure:
    return Closure("moebius" if n % 2 else "circle", half_turns=n)


def problem(n: int, segments: int, energy: str = "wunderlich"):
    return assembled(Request.of(STRIP, closure=closure(n), segments=segments, energy=energy))


@pytest.mark.parametrize(("n", "segments"), [(3, 24), (3, 21), (4, 24)])
@pytest.mark.parametrize("energy", ["wunderlich", "kirchhoff"])
def test_a_fold_folded_out_closes(n, segments, energy):
    """Rows met, the ends of the whole band meet; segments of an odd and an even number per period, in-plane too."""
    whole = problem(n, segments, energy)
    fold = fold_of(whole, n)
    assert fold.lengths.sum() == pytest.approx(1.0, abs=1e-12)
    found = min(folds._minima(fold), key=lambda one: fold.value(one.x))
    x = unfolded(fold, found.x, whole)
    rows = whole.constraints(x)
    assert np.abs(rows).max() < 1e-9
    assert whole.value(x) == pytest.approx(4.0 * n * n * fold.value(found.x), rel=1e-9)
    assert folds.turns(whole, x) == n


def test_derivatives_of_the_rows_of_the_axes():
    """By central differences at a shape that meets none of them."""
    fold = fold_of(problem(5, 40), 5)
    rng = np.random.default_rng(4)
    x = fold.state(rng.normal(size=fold.lengths.size + 1), 0.2 * rng.normal(size=fold.lengths.size + 1))
    rows, step, multipliers = fold.blocks()["fold_axes"], 1e-6, np.array([0.7, -1.3])
    at, columns = rows.jacobian_structure()
    one, other = rows.hessian_structure()

    def jacobian(y):
        out = np.zeros((2, fold.size))
        np.add.at(out, (at, columns), rows.jacobian(y))
        return out

    lower = np.zeros((fold.size, fold.size))
    np.add.at(lower, (one, other), rows.hessian(x, multipliers))
    assert np.all(one >= other)
    hessian = lower + np.tril(lower, -1).T
    for column in np.unique(columns):
        ahead, behind = x.copy(), x.copy()
        ahead[column] += step
        behind[column] -= step
        slope = (rows.values(ahead) - rows.values(behind)) / (2.0 * step)
        np.testing.assert_allclose(jacobian(x)[:, column], slope, atol=1e-8)
        bent = multipliers @ (jacobian(ahead) - jacobian(behind)) / (2.0 * step)
        np.testing.assert_allclose(hessian[:, column], bent, atol=1e-8)


def test_three_half_turns_are_those_of_a_minimisation_of_the_whole_band():
    """From three waves of one hand the whole band settles in the same state."""
    wave = np.sin(3.0 * np.pi * np.linspace(0.0, 1.0, 61))
    whole = solve(
        STRIP, closure=Closure("moebius"), segments=120, seed_curvature=(16.0 * wave).tolist(),
        seed_ruling=(0.6 * wave).tolist(),
    )  # fmt: skip
    fold = solve(STRIP, closure=closure(3), segments=120)
    assert fold.status is Status.CONVERGED
    assert fold.unstable_modes == 0
    assert fold.energy.total == pytest.approx(whole.energy.total, rel=1e-8)
    assert fold.energy.total == pytest.approx(132.942, abs=1e-3)


@pytest.mark.parametrize("n", [4, 5])
def test_ways_down_are_counted(n):
    """Against all eigenvalues of the dense Hessian on the null space of the rows."""
    state = solve(STRIP, closure=closure(n), segments=8 * n)
    assert state.status is Status.SADDLE
    held = reduction.tangent(state.problem, state.x, state.multipliers, state.rows)
    values, _ = reduce(state.problem, state.x, state.rows, held).spectrum()
    assert state.unstable_modes == int(np.sum(values < -1e-8)) > 0


def test_finer_segments_are_of_the_same_band():
    """On segments cut in two it is the same saddle; of segments of which a period has no whole number some more are
    taken, unequal ones lead to it too."""
    few = solve(STRIP, closure=closure(5), segments=60)
    lengths = 1.0 + 0.05 * np.sin(np.arange(120))
    many, more = refine(few), solve(STRIP, closure=closure(5), segments=123)
    odd = solve(STRIP, closure=closure(5), segments=lengths / lengths.sum())
    assert [one.status for one in (few, many, more, odd)] == [Status.SADDLE] * 4
    assert (many.problem.lengths.size, more.problem.lengths.size, odd.problem.lengths.size) == (120, 125, 120)
    assert 0.0 < few.energy.total - many.energy.total < 3.0
    assert odd.energy.total == pytest.approx(many.energy.total, rel=2e-3)
    assert folds.turns(odd.problem, odd.x) == 5


@pytest.mark.parametrize(("n", "energy"), [(4, "kirchhoff"), (5, "wunderlich")])
def test_a_tolerance_keeps_the_half_turns(n, energy):
    """On segments placed by an estimate the band would be minimised, and end with fewer."""
    closure = Closure("moebius" if n % 2 else "circle", half_turns=n)
    strip = Strip(1.0, 0.02, 0.3, thickness=4e-4)
    found = solve_to_tolerance(strip, closure=closure, energy=energy, tolerance=4e-3)
    assert found.status is Status.SADDLE
    assert folds.turns(found.problem, found.x) == n
    assert found.tolerance_error <= 4e-3
    assert np.ptp(found.problem.lengths) < 1e-12
    assert found.problem.lengths.size % n == 0
    even = solve(strip, closure=closure, energy=energy, segments=2 * found.problem.lengths.size)
    assert found.energy.total == pytest.approx(even.energy.total, rel=5e-3)


def test_narrow_bands_are_above_the_least_energy_of_their_twist():
    """Sadowsky's density omega^2 (1 + eta^2)^2 / 2 at a twist tau = omega eta is 2 tau^2 at least (eta = 1), and that
    of an even twist the least: E >= 2 (int tau)^2; not far above, as the ribbon bends in a circle too."""
    state = solve(Strip(1.0, 0.005), closure=closure(9), segments=180, energy="sadowsky")
    assert folds.turns(state.problem, state.x) == 9
    s = (np.arange(4000) + 0.5) / 4000
    least = 2.0 * float(np.mean(state.tau(s))) ** 2
    assert 8.0 * np.pi < np.sqrt(least / 2.0) < 10.0 * np.pi
    assert 1.0 < state.energy.total / least < 1.4


@pytest.mark.parametrize(
    ("kind", "given"), [("moebius", 2), ("circle", 3), ("circle", -2), ("moebius", 1.0), ("circle", True)]
)
def test_half_turns_that_do_not_join(kind, given):
    with pytest.raises(RibbonInputError) as caught:
        Closure(kind, half_turns=given)
    assert caught.value.key == "half_turns"
