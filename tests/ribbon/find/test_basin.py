"""A seed between two clamps says on which side the strip is meant to stand: the answer is that state, or says so."""

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip, solve
from ribbon.find import relax, seeds
from ribbon.find.adaptive import solve_to_tolerance
from ribbon.find.solve import build, starting_shapes
from ribbon.result import Branch

#: A steel strip 12 mm wide between clamps 0.32 m apart, seeds in 1/m, as `ribbonbench new` wrote them: (l in m, h in
#: m). Of a sweep over both, 20 x 20, these hung on b061e3f; their neighbours stood.
HUNG = [
    (0.3957894736842105, 0.00026723784733481866),
    (0.4015789473684211, 0.00018889831972687224),
    (0.4826315789473684, 0.00013352365898580768),
    (0.4942105263157895, 0.00014147179695468828),
    (0.5, 0.00014147179695468828),
]
#: The one of them that hung where its segments are placed.
HUNG_PLACED = 0.395789473684, 0.00017828567509
UP = (0.0, 1.0, 0.0)
SEED = np.array([-14.05, 14.05, 14.05, -14.05])


def steel(length, thickness, up=UP, sign=1.0):
    """Arguments of `solve` for that strip, in units of its length; sign: of the seed."""
    stiffness = 2.1e11 * thickness**3 / (12.0 * (1.0 - 0.3**2))
    gamma = 7850.0 * thickness * 9.81 * length**3 / stiffness
    along = {"tangent": (0, 0, 1), "normal": (0, 1, 0)}
    return {
        "strip": Strip(1.0, 0.012 / length, 0.3, gamma=gamma), "clamp": Clamp(**along), "gravity": Gravity(up),
        "end": Clamp((0.0, 0.0, 0.32 / length), **along), "seed_curvature": tuple(sign * SEED * length),
    }  # fmt: skip


def turned(height, angles, gamma, up, seed, aside=0.0, apart=0.48, **keywords):
    """A strip between clamps whose tangents are turned by `angles` (rad) about e_x, the second one aside."""
    frames = [{"tangent": (0, np.sin(a), np.cos(a)), "normal": (0, np.cos(a), -np.sin(a))} for a in angles]
    end = Clamp((aside, height, apart), **frames[1])
    return solve(
        Strip(1.0, 0.03, 0.3, gamma=gamma), Clamp(**frames[0]), Gravity(up), end=end, seed_curvature=seed, **keywords
    )


@pytest.mark.parametrize(("length", "thickness"), HUNG)
def test_a_strip_stands_where_its_seed_does(length, thickness):
    found = solve(**steel(length, thickness))
    assert found.ok
    assert found.branch is Branch.OWN
    assert found.middle.position[1] > 0.2
    # the other side is a state too, and lower: only the seed tells them apart
    hangs = solve(**steel(length, thickness, sign=-1.0))
    assert hangs.branch is Branch.OWN
    assert hangs.middle.position[1] < -0.2
    assert hangs.energy.total < found.energy.total - 0.5


@pytest.mark.parametrize("solver", ["newton", "ipopt"])
def test_both_minimisers_stay_on_the_side_of_the_seed(solver):
    found = solve(**steel(*HUNG[0]), solver=solver)
    assert found.branch is Branch.OWN
    assert found.middle.position[1] > 0.2


def test_placed_segments_stay_on_the_side_of_the_seed():
    equilibrium = solve_to_tolerance(**steel(*HUNG_PLACED), tolerance=1e-3, strict=False)
    assert equilibrium.ok
    assert equilibrium.branch is Branch.OWN
    assert equilibrium.middle.position[1] > 0.2


def test_many_segments_stay_on_the_side_of_the_seed():
    few = solve(**steel(*HUNG[3]))
    many = solve(**steel(*HUNG[3]), segments=320)
    assert many.branch is Branch.OWN
    assert many.energy.total == pytest.approx(few.energy.total, rel=1e-3)


def test_a_scene_and_its_seed_upside_down_give_the_state_upside_down():
    found = solve(**steel(*HUNG[1]))
    mirrored = solve(**steel(*HUNG[1], up=(0.0, -1.0, 0.0), sign=-1.0))
    assert mirrored.branch is Branch.OWN
    assert mirrored.energy.total == pytest.approx(found.energy.total, rel=1e-9)
    assert mirrored.middle.position[1] == pytest.approx(-found.middle.position[1], rel=1e-6)


def test_where_long_steps_change_the_side_short_ones_find_the_state_of_the_seed():
    up = np.array([0.09, 0.83, 0.55])
    requested = {
        "height": 0.0,
        "angles": (-0.33, 0.29),
        "gamma": 540.0,
        "up": tuple(up / np.linalg.norm(up)),
        "aside": -0.06,
    }
    stands = turned(**requested, seed=(-12.0, 12.0, -12.0))
    hangs = turned(**requested, seed=(12.0, -12.0, 12.0))
    assert stands.ok
    assert hangs.ok
    assert stands.branch is hangs.branch is Branch.OWN
    assert stands.energy.total - hangs.energy.total == pytest.approx(134.4, abs=0.5)


def test_an_arch_that_its_weight_pushes_through_says_that_it_slid():
    """At Gamma = 1222 no arch stands: from its seed the energy falls to the state that hangs."""
    requested = {"height": 0.0, "angles": (0.0, 0.0), "gamma": 1222.0, "up": UP, "apart": 0.69}
    slid = turned(**requested, seed=(-6.3, 6.3, -6.3))
    hangs = turned(**requested, seed=(6.3, -6.3, 6.3))
    assert slid.ok
    assert slid.branch is Branch.SLID
    assert hangs.branch is Branch.OWN
    assert slid.energy.total == pytest.approx(hangs.energy.total, rel=1e-9)


def test_no_seed_means_no_side():
    arguments = steel(*HUNG[0])
    del arguments["seed_curvature"]
    assert solve(**arguments).branch is None
    assert solve(**arguments, seed_curvature=0.0).branch is None
    assert solve(Strip(1.0, 0.03, gamma=5.0), gravity=Gravity(UP), seed_curvature=2.0).branch is None


def test_a_seed_is_brought_between_the_clamps_with_its_detail():
    problem = build(**{k: v for k, v in steel(*HUNG[0]).items() if k != "seed_curvature"}, segments=40)
    s = seeds.joints(problem.lengths)
    wavy = 8.0 * np.cos(2.0 * np.pi * s) + 0.8 * np.sin(18.0 * np.pi * s)
    none = np.zeros(s.size)
    assert relax.misfit(problem, problem.state(-wavy, none)) > 0.05
    omega, eta = seeds.brought(problem, -wavy, none)
    assert relax.misfit(problem, problem.state(omega, eta)) < 0.03
    fast = np.sin(18.0 * np.pi * s)
    assert float(omega @ fast) == pytest.approx(float(-wavy @ fast), rel=0.05)
    # a shape whose end is in its place is left alone
    again = seeds.brought(problem, omega, eta)
    assert relax.misfit(problem, problem.state(*again)) < 0.03
    (shape,) = starting_shapes(problem, tuple(omega), 0.0)
    np.testing.assert_allclose(shape[0], omega, atol=1.0)


def test_a_seed_that_ends_half_a_turn_away_is_no_coil():
    """[6, -12, 6] turns its end by 3 rad: fitted it was a coil of energy 320; the strip bows down, by 8.19."""
    along = {"tangent": (0.0, 0.0, 1.0), "normal": (1.0, 0.0, 0.0)}
    found = solve(
        Strip(1.0, 0.05, 0.4, gamma=1.0), Clamp(**along), Gravity((1.0, 0.0, 0.0)),
        end=Clamp((0.0, 0.0, 0.8), **along), seed_curvature=(6.0, -12.0, 6.0), segments=20,
    )  # fmt: skip
    assert found.ok
    assert found.energy.total == pytest.approx(8.19, abs=0.05)
