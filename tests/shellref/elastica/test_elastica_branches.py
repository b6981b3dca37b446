"""Bifurcations, pitchforks perfect and not, deflation, and the lab sheet's flower stem."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shellref.elastica.arc import ArcOptions, point_at, states_at, switch, trace
from shellref.elastica.branches import deflated, equilibria
from shellref.elastica.rod import Rod, circular, circular_polar, rectangular
from shellref.elastica.solve import ElasticaOptions, ElasticaProblem, solve
from tests.reference import elastica_closed as closed
from tests.validation.elastica.elastica_daisy import (
    LAB_CURVATURES,
    LAB_MASSES,
    critical_masses,
    from_rest,
    lab_stem,
    mass_deflection,
    sheet_newton,
    stem_equilibria,
    stem_system,
)

CRITICAL = math.pi**2 / 4


#: Every fifth of the sheet's masses: each branch, and each side of each limit point, has some of them.
MASSES = LAB_MASSES[::5]


@pytest.fixture(scope="module")
def curves():
    """The sheet's four diagrams, by natural curvature (1/m)."""
    return {curvature: mass_deflection(lab_stem(curvature, "polar"), MASSES) for curvature in LAB_CURVATURES}


def test_critical_mass_three_ways():
    """Euler's formula, the linear problem and the path; 6.3 g is with the polar moment, 3.2 g with the bending one."""
    for moment, grams in (("polar", 6.321361), ("bending", 3.160681)):
        found = critical_masses(lab_stem(0.0, moment))
        assert 1e3 * found["euler"] == pytest.approx(grams, abs=1e-6)
        assert found["eigenvalue"] == pytest.approx(found["euler"], rel=1e-11)
        assert found["path"] == pytest.approx(found["euler"], rel=1e-10)


def test_the_sheets_five_grams_are_stable_and_ten_end_on_a_saddle():
    """kappa_0 = -1 /m, I as on the sheet; Newton from theta = pi/2 + kappa_0 s keeps to the near-straight branch."""
    stem = lab_stem(-1.0, "polar")
    state, iterations = sheet_newton(stem, 5e-3)
    assert iterations <= 6
    assert state.stable
    assert state.tip == pytest.approx((0.0226775748, 0.0967066448), abs=1e-9)
    saddle, iterations = sheet_newton(stem, 10e-3)
    assert iterations <= 6
    assert not saddle.stable
    assert saddle.lowest_eigenvalue == pytest.approx(-1.408469, abs=1e-5)
    assert saddle.tip == pytest.approx((-0.0091032569, 0.0995059738), abs=1e-9)  # to the other side of its own bend
    above = sheet_newton(lab_stem(-1.0, "bending"), 5e-3)[0]
    assert not above.stable  # with the bending moment 5 g are above critical too


def test_ten_grams_have_three_equilibria_two_of_them_stable():
    found = stem_equilibria(lab_stem(-1.0, "polar"), 10e-3)
    assert [state.stable for state in found] == [True, True, False]
    assert sorted(state.deflection for state in found) == pytest.approx(
        [-0.0793921597, -0.0091032569, 0.0801120738], abs=1e-9
    )
    assert [state.stable for state in stem_equilibria(lab_stem(-1.0, "polar"), 5e-3)] == [True]


def test_the_straight_stems_pitchfork(curves):
    """Straight up to 10 g, unstable from 6.32 g on; two mirror branches whose tips are elliptic integrals."""
    rest, *sides = curves[0.0]
    assert rest.bifurcations == pytest.approx([6.321361198e-3], rel=1e-8)
    assert [s.mass for s in rest.states] == pytest.approx(MASSES)
    assert [s.stable for s in rest.states] == [mass < 6.32e-3 for mass in MASSES]
    assert {c.name for c in sides} == {"left", "right"}
    left, right = sorted(sides, key=lambda c: c.name)
    assert len(left.states) == len(right.states) == 8  # 6.5 to 10 g
    assert all(s.stable for s in left.states + right.states)
    mirrored = [-s.deflection for s in left.states]
    assert [s.deflection for s in right.states] == pytest.approx(mirrored, abs=1e-9)
    unit = lab_stem(0.0, "polar").tip_load(1.0)
    for state in right.states[::2]:
        alpha = math.pi / 2 - state.theta[-1]
        load, along, across = closed.buckled_cantilever(alpha)
        assert load == pytest.approx(unit * state.mass, rel=1e-7)
        assert state.tip == pytest.approx((0.1 * across, 0.1 * along), abs=1e-9)


@pytest.mark.parametrize("curvature", [k for k in LAB_CURVATURES if k])
def test_a_bent_stems_pitchfork_comes_apart(curves, curvature):
    """One branch from rest, stable all the way; one apart with a limit point, stable on one side of it."""
    rest, apart = curves[curvature]
    assert [s.mass for s in rest.states] == pytest.approx(MASSES)
    assert all(s.stable for s in rest.states)
    assert not rest.limits
    assert np.all(np.diff([s.deflection for s in rest.states]) > 0.0)
    assert apart.name == "apart"
    assert len(apart.limits) == 1
    assert not apart.bifurcations
    assert all(s.deflection < 0.0 for s in apart.states)
    on = [mass for mass in MASSES if mass > apart.limits[0]]
    assert len(apart.states) == 2 * len(on)
    for mass in on:
        pair = sorted(apart.at(mass), key=lambda s: s.deflection)
        assert [s.stable for s in pair] == [True, False]


def test_the_limit_point_nears_the_critical_mass_with_the_curvature_to_two_thirds(curves):
    """(3/2) (lambda_c K^2)^(1/3) above lambda_c, with a remainder that falls with K."""
    unit = lab_stem(0.0, "polar").tip_load(1.0)
    misses = []
    for curvature in (-1.0, -0.01, -0.0001):
        excess = unit * curves[curvature][1].limits[0] - CRITICAL
        leading = 1.5 * (CRITICAL * (0.1 * curvature) ** 2) ** (1 / 3)
        misses.append(excess / leading - 1.0)
    assert np.all(np.diff(np.abs(misses)) < 0.0)
    assert abs(misses[1]) < 3e-3
    assert abs(misses[2]) < 2e-4


def test_switched_branches_leave_on_both_sides_and_states_are_found_on_them():
    system = stem_system(lab_stem(0.0, "polar"), 10e-3)
    path = trace(system, point_at(system, from_rest(system), 0.0), 1.0, (0.0, 1.0), stop_at_events=True)
    assert path.ended == "event"
    (event,) = path.bifurcations()
    first, second = switch(system, event)
    ends = []
    for point in (first, second):
        branch = trace(system, point, 1.0, (0.0, 1.0))
        assert branch.ended == "reached"
        assert branch.points[-1].t == 1.0
        found = states_at(system, branch, np.array([0.7, 0.5]))
        assert [len(states) for states in found] == [1, 0]
        ends.append(system.discrete.reach(branch.points[-1].z))
    assert ends[0] == pytest.approx(ends[1] * [-1.0, 1.0], abs=1e-9)


def test_deflation_finds_the_others_and_never_the_known():
    system = stem_system(lab_stem(-1.0, "polar"), 10e-3)
    rest = from_rest(system)
    known: list[np.ndarray] = []
    for _ in range(3):
        z = deflated(system, rest, 1.0, known, 1e-10)
        assert z is not None
        assert system.norm(system.residual(z, 1.0)) < 1e-10
        assert all(system.product(z - other, z - other) > 1e-6 for other in known)
        known.append(z)
    assert equilibria(system, 0.2, [rest])[0].stable


def test_descent_and_branch_switching_find_the_same_post_buckled_stem():
    """Tilted by 1e-6 the load steps of `solve` arrive where the switched branch does."""
    load = lab_stem(0.0, "polar").tip_load(10e-3)
    tilted = solve(ElasticaProblem(force=(-load, 1e-6)), 20, 3, estimate_error=False)
    switched = solve(
        ElasticaProblem(force=(-load, 0.0)), 20, 3, ElasticaOptions(arc_length="always"), estimate_error=False
    )
    assert abs(tilted.end[1]) == pytest.approx(abs(switched.end[1]), abs=1e-6)


def test_rods_in_si_units():
    """lambda, Gamma and K by hand; the two second moments of a circle differ by two."""
    assert circular(2e-3) == pytest.approx(1.2566370614e-11)
    assert circular_polar(2e-3) == pytest.approx(2.0 * circular(2e-3))
    assert rectangular(0.03, 1e-3) == pytest.approx(2.5e-12)
    rod = Rod(0.5, 2e9, 3e-12, curvature=(2.0, 4.0), mass_per_length=0.01, tip_mass=0.002, acceleration=9.81)
    problem = rod.problem()
    assert problem.gamma == pytest.approx(0.01 * 9.81 * 0.125 / 6e-3)
    assert problem.force == pytest.approx((0.0, -0.002 * 9.81 * 0.25 / 6e-3))
    assert problem.curvature == (1.0, 2.0)
    assert problem.start_angle == pytest.approx(math.pi / 2)
    assert rod.critical_mass * rod.acceleration * rod.length**2 / rod.stiffness == pytest.approx(CRITICAL)


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: lab_stem(-1.0, "area"), "second_moment = 'area'"),
        (lambda: Rod(0.0, 1.0, 1.0), "length = 0.0"),
        (lambda: Rod(1.0, 1.0, -1.0), "second_moment = -1.0"),
        (lambda: Rod(1.0, 1.0, 1.0, tip_mass=-1.0), "tip_mass = -1.0"),
        (lambda: Rod(1.0, 1.0, 1.0, curvature=math.nan), "curvature = nan"),
        (lambda: circular(0.0), "radius = 0.0"),
        (lambda: mass_deflection(lab_stem(0.0, "polar"), [-1.0]), "masses"),
        (lambda: mass_deflection(lab_stem(0.0, "polar"), [0.0]), "mass = 0.0"),
        (lambda: stem_equilibria(lab_stem(0.0, "polar"), 0.0), "mass = 0.0"),
        (lambda: ArcOptions(step=1.0), "step = 1.0"),
        (lambda: ArcOptions(tolerance=-1.0), "tolerance = -1.0"),
    ],
)
def test_bad_input_is_named(call, word):
    with pytest.raises(ValueError) as caught:
        call()
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)
