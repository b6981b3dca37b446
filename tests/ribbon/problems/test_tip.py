"""A dead force at the end of the ribbon: derivatives, one answer in both formulations, balance, limits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ribbon import Clamp, Closure, Gravity, RibbonInputError, Session, Strip, gradients, solve
from ribbon.find.solve import build

FORCE = (1.3, -2.0, 0.7)
STRIP = Strip(1.0, 0.1, 0.3, (1.0, -0.5), 5.0, thickness=0.01)
TURN = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
CLAMP = Clamp((0.1, 0.2, 0.3), TURN[:, 2], TURN[:, 1])
WEIGHT = Gravity((0.0, 0.6, 0.8))
GUIDE = Clamp(None, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))


def slopes(function, x, step=1e-5):
    """Central differences (k, n) of a function of x (n,)."""
    return np.array([(function(x + step * e) - function(x - step * e)) / (2.0 * step) for e in np.eye(x.size)])


@pytest.mark.parametrize("gravity", [WEIGHT, None], ids=["weight", "weightless"])
@pytest.mark.parametrize("energy", ["wunderlich", "kirchhoff"])
def test_gradient_and_hessian_of_the_chained_ribbon(energy, gravity):
    """The force points elsewhere than the weight: both share one semi-separable Hessian."""
    problem = build(STRIP, CLAMP, gravity, energy=energy, segments=5, formulation="chained", tip=FORCE)
    x = 0.7 * np.random.default_rng(3).standard_normal(problem.size)
    assert problem.gradient(x) == pytest.approx(slopes(problem.value, x), abs=1e-8)
    hessian = problem.hessian(x)
    np.testing.assert_allclose(hessian, slopes(problem.gradient, x), atol=1e-7)
    np.testing.assert_array_equal(hessian, hessian.T)
    without = problem.with_changes(tip=None)
    end = problem.joints(x)[0][-1]
    assert problem.value(x) - without.value(x) == pytest.approx(-end @ FORCE, rel=1e-12)


@pytest.fixture(scope="module")
def both():
    keywords = {"energy": "wunderlich", "segments": 12, "tip": FORCE}
    return [solve(STRIP, CLAMP, WEIGHT, formulation=name, **keywords) for name in ("chained", "mixed")]


def test_both_formulations_find_one_shape(both):
    chained, mixed = both
    assert chained.ok
    assert mixed.ok
    s = np.linspace(0.0, 1.0, 21)
    np.testing.assert_allclose(chained.position(s), mixed.position(s), atol=1e-7)
    for part in ("bending", "natural", "gravity", "tip", "total"):
        assert getattr(chained.energy, part) == pytest.approx(getattr(mixed.energy, part), abs=1e-8)
    assert mixed.energy.tip == pytest.approx(-mixed.end.position @ FORCE, rel=1e-12)


def test_the_start_carries_force_and_weight(both):
    for found in both:
        np.testing.assert_allclose(found.start.force, 5.0 * np.array(WEIGHT.up) - FORCE, atol=1e-6)
    np.testing.assert_allclose(both[0].start.moment, both[1].start.moment, atol=1e-6)


@pytest.fixture(scope="module")
def guided():
    return solve(Strip(1.0, 0.1, 0.3), Clamp(), end=GUIDE, tip=(0.5, -3.0, 1.0), segments=12)


def test_a_guided_end_carries_a_moment_and_no_force(guided):
    assert guided.ok
    np.testing.assert_allclose(guided.start.force, [-0.5, 3.0, -1.0], atol=1e-6)
    assert guided.end_support is not None
    np.testing.assert_allclose(guided.end_support.force, 0.0, atol=1e-12)
    np.testing.assert_allclose(guided.end.frame, np.eye(3), atol=1e-9)
    lever = np.cross(guided.end.position, [0.5, -3.0, 1.0])
    np.testing.assert_allclose(guided.start.moment + guided.end_support.moment + lever, 0.0, atol=1e-6)


@pytest.mark.parametrize("which", ["clamped, chained", "guided"])
def test_derivatives_by_the_force_are_those_of_states_solved_again(which, both, guided):
    found = guided if which == "guided" else both[0]
    problem = found.problem
    by = gradients(found, ["tip"])
    energy, place, force = by.energy()["tip"], by.position(1.0)["tip"], by.start_force()["tip"]
    np.testing.assert_allclose(force, -np.eye(3), atol=1e-7)
    np.testing.assert_allclose(energy, -found.end.position, atol=1e-6)
    step = 1e-4
    for k, unit in enumerate(np.eye(3)):
        ends = []
        for sign in (1.0, -1.0):
            pull = np.array(problem.tip) + sign * step * unit
            again = solve(
                problem.strip, problem.start, problem.gravity, end=problem.end, energy=problem.energy,
                segments=12, formulation=problem.formulation, tip=pull,
            )  # fmt: skip
            ends.append(again.end.position)
        np.testing.assert_allclose(place[:, k], (ends[0] - ends[1]) / (2.0 * step), atol=2e-5)


def test_a_session_moves_the_force():
    session = Session(Strip(1.0, 0.05, 0.3), Clamp(), segments=10, tip=(0.0, -1.0, 0.0))
    move = session.move(tip=(0.0, -5.0, 0.0))
    assert move.ok
    again = solve(Strip(1.0, 0.05, 0.3), Clamp(), segments=10, formulation="mixed", tip=(0.0, -5.0, 0.0))
    np.testing.assert_allclose(session.state.end.position, again.end.position, atol=1e-7)
    np.testing.assert_allclose(session.forces["start"].force, [0.0, 5.0, 0.0], atol=1e-6)


@pytest.mark.parametrize(
    ("keywords", "key"),
    [
        ({"tip": (1.0, 2.0)}, "tip"),
        ({"tip": (1.0, float("nan"), 0.0)}, "tip"),
        ({"tip": FORCE, "end": Clamp((0.0, 0.1, 0.8))}, "tip"),
        ({"tip": FORCE, "clamp": Clamp(None, None, None)}, "tip"),
        ({"tip": FORCE, "clamp": None, "closure": Closure("circle")}, "tip"),
        ({"tip": FORCE, "end": GUIDE, "formulation": "matrix"}, "formulation"),
        ({"tip": FORCE, "end": GUIDE, "formulation": "chained"}, "formulation"),
    ],
)
def test_what_cannot_be_pulled(keywords, key):
    with pytest.raises(RibbonInputError) as caught:
        build(Strip(1.0, 0.1, 0.3), **keywords)
    assert caught.value.key == key
    assert "\n" not in str(caught.value)


def test_no_force_is_no_term():
    assert build(Strip(1.0, 0.1, 0.3), Clamp(), tip=(0.0, 0.0, 0.0)).tip is None


@pytest.mark.parametrize("stiffness", ["matched", "plate"])
def test_a_rod_on_edge_buckles_under_prandtl_s_load(stiffness):
    """F l^2 = 4.0126 sqrt(B C) (Prandtl 1899): the straight rod's lowest eigenvalue changes sign there."""
    strip = Strip(1.0, 0.02, 0.3, thickness=2e-4)
    edge = Clamp((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # t_x = -e_z: the width stands upright
    bending = 1.0 if stiffness == "matched" else 1.0 - 0.3**2
    critical = 4.0126 * np.sqrt(bending * 2.0 * (1.0 - 0.3) * (1.0 - 0.6302 * 0.01))
    stable = []
    for factor in (0.999, 1.001):
        tip = (0.0, 0.0, -factor * critical)
        stable.append(solve(strip, edge, energy="kirchhoff", stiffness=stiffness, segments=16, tip=tip).stable)
    assert stable == [True, False]
