"""First order of another theory (`ribbon.sensitivity.theories`): its own solves, closed forms and differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip, solve
from ribbon.element import quaternion
from ribbon.errors import NotDifferentiable
from ribbon.sensitivity import theories
from ribbon.sensitivity.system import point

S = np.linspace(0.0, 1.0, 41)
NU, H = 0.35, 1e-3
CLAMP = Clamp((0.0, 0.0, 0.0), tangent=(1.0, 0.0, 0.0), normal=(0.0, -0.6, 0.8))
UP = Gravity((0.0, 0.0, 1.0))
TILTED = Gravity((float(np.sin(0.05)), 0.0, float(np.cos(0.05))))
STRIP = Strip(length=1.0, width=0.1, poisson=NU, natural_curvature=2.0, gamma=15.0, thickness=H)


def solved(energy="wunderlich", strip=STRIP, clamp=CLAMP, gravity=UP, **more):
    found = solve(strip, clamp, gravity, energy=energy, segments=16, **more)
    assert found.ok, found.message
    return found


def first(found, **asked):
    return theories.responses(found, asked)


def moved(before, after):
    return after.position(S) - before.position(S)


def off(response):
    """How far the first step may be off: twice the sum of those that would follow."""
    one = np.abs(response.position(S)).max()
    two = np.abs(response.beyond.position(S)[response.name]).max()
    assert two < 0.5 * one
    return one, 2.0 * two / (1.0 - two / one)


@pytest.fixture(scope="module")
def ruled():
    return solved()


@pytest.fixture(scope="module")
def finite():
    return solved("finite", strip=replace(STRIP, thickness=5e-3))


@pytest.mark.parametrize(
    ("asked", "keys"),
    [
        ({"energy": "sadowsky"}, {"energy": "sadowsky"}),
        ({"gravity": Gravity((0.0, 0.0, 1.0), exact=True)}, {"gravity": Gravity((0.0, 0.0, 1.0), exact=True)}),
        ({"gravity": TILTED}, {"gravity": TILTED}),
        (
            {"strip": replace(STRIP, natural_curvature=2.05)},
            {"strip": replace(STRIP, natural_curvature=2.05)},
        ),
        ({"tip": (0.0, 0.2, 0.0)}, {"tip": (0.0, 0.2, 0.0)}),
    ],
)  # fmt: skip
def test_another_problem_is_where_its_own_solve_is(ruled, asked, keys):
    response = first(ruled, it=theories.towards(**asked))["it"]
    true = moved(ruled, solved(**keys))
    one, error = off(response)
    missed = np.abs(response.position(S) - true).max()
    assert one > 1e-6
    assert missed < max(error, 1e-3 * one)
    assert missed < 0.35 * np.abs(true).max()


def test_the_thin_strip_of_some_thickness_from_rulings(ruled):
    """Other fields: twist eta omega; its own solve has the twist as a field."""
    response = first(ruled, it=theories.of_energy("finite", H))["it"]
    other = solved("finite")
    one, error = off(response)
    missed = np.abs(response.position(S) - moved(ruled, other)).max()
    assert one > 1e-3
    assert missed < error
    # of the energy first order is the theory's own in the same state: what is gained on the way is of second order
    assert response.energy - response.work == pytest.approx(other.energy.total - ruled.energy.total, rel=0.2)


def test_an_energy_of_other_fields_is_the_same_energy():
    """Wunderlich's by its density on Sadowsky's own state, and by a problem of its own."""
    own = solved("sadowsky")
    found = first(own, dens=theories.of_energy("wunderlich", None), prob=theories.towards(energy="wunderlich"))
    scale = np.abs(found["prob"].position(S)).max()
    assert np.abs(found["dens"].position(S) - found["prob"].position(S)).max() < 1e-6 * scale
    assert found["dens"].energy == pytest.approx(found["prob"].energy, rel=1e-6)


def test_an_energy_with_rulings_on_a_free_twist(finite):
    """Against differences of its energy in the unknowns."""
    here = point(finite)
    load = theories.of_energy("wunderlich", None)(here)
    rng = np.random.default_rng(0)
    for _ in range(3):
        step = 1e-6 * rng.standard_normal(here.x.size)
        up, down = (
            theories.of_energy("wunderlich", None)(replace(here, x=here.x + sign * step)).energy[0]
            for sign in (1.0, -1.0)
        )
        assert 0.5 * (up - down) == pytest.approx(float(load.gradient[:, 0] @ step), rel=1e-5)


# -- strains ----------------------------------------------------------------------------------------------------------


def test_bending_in_the_plane_is_where_its_own_field_brings_it(finite):
    h = finite.problem.strip.thickness
    response = first(finite, it=theories.softer(theories.in_plane(h, NU, 0.1)))["it"]
    other = solved("finite", strip=replace(STRIP, thickness=5e-3), in_plane=True)
    true = moved(finite, other)
    assert np.abs(true).max() > 1e-4
    assert np.abs(response.position(S) - true).max() < 0.03 * np.abs(true).max()
    assert response.energy == pytest.approx(other.energy.total - finite.energy.total, rel=0.05)


def test_a_hanging_strip_is_longer_by_its_own_weight():
    down = Clamp((0.0, 0.0, 0.0), tangent=(0.0, 0.0, -1.0), normal=(1.0, 0.0, 0.0))
    strip = Strip(length=1.0, width=0.1, poisson=NU, gamma=20.0)
    found = solved(strip=strip, clamp=down)
    response = first(found, it=theories.softer(theories.stretching(H, NU)))["it"]
    longer = 20.0 * H**2 / (24.0 * (1.0 - NU**2))
    assert response.position(1.0) == pytest.approx([0.0, 0.0, -longer], rel=1e-9, abs=1e-15)
    assert response.energy == pytest.approx(-(20.0**2) * H**2 / (72.0 * (1.0 - NU**2)), rel=2e-3)


def test_a_level_cantilever_sags_by_shear():
    level = Clamp((0.0, 0.0, 0.0), tangent=(1.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0))
    strip = Strip(length=1.0, width=0.1, poisson=NU, gamma=1e-4, thickness=H)
    response = first(solved("finite", strip=strip, clamp=level), it=theories.softer(theories.shear(H, NU)))["it"]
    sag = 0.5e-4 * H**2 / (5.0 * (1.0 - NU))
    assert response.position(1.0)[2] == pytest.approx(-sag, rel=1e-6)


def test_the_load_of_a_strain_is_the_derivative_of_what_the_lagrangian_gains(finite):
    here = point(finite)
    compliance = np.array([1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3])

    def gained(x, rows):
        there = replace(here, x=x, rows=rows)
        inner, frames = theories.internal(there), quaternion.matrix(here.problem.layout.quaternions(x))
        local = np.hstack([np.einsum("jik,ji->jk", frames, part) for part in (inner.force, inner.moment)])
        ends = np.append(here.problem.lengths, 0.0) + np.append(0.0, here.problem.lengths)
        return -0.25 * float((ends[:, None] * compliance * local**2).sum())

    load = theories.softer(compliance)(here)
    assert load.energy[0] == pytest.approx(gained(here.x, here.rows), rel=1e-12)
    rng = np.random.default_rng(1)
    for _ in range(4):
        dx, drows = 1e-6 * rng.standard_normal(here.x.size), 1e-4 * rng.standard_normal(here.rows.size)
        own, change = (here.problem.layout.quaternions(part) for part in (here.x, dx))
        change -= (own * change).sum(axis=1)[:, None] * own  # on the sphere
        difference = 0.5 * (gained(here.x + dx, here.rows + drows) - gained(here.x - dx, here.rows - drows))
        expected = float(load.gradient[:, 0] @ dx + load.rows[:, 0] @ drows)
        assert difference == pytest.approx(expected, rel=1e-6)


def test_internal_force_is_the_weight_beyond(ruled):
    inner = theories.internal(point(ruled))
    joints = np.concatenate([[0.0], np.cumsum(ruled.problem.lengths)])
    assert inner.force[:, 2] == pytest.approx(-15.0 * (1.0 - joints), abs=1e-6)
    assert inner.moment[-1] == pytest.approx(np.zeros(3), abs=1e-6)


# -- refusals ---------------------------------------------------------------------------------------------------------


def test_a_straight_strip_has_no_ruling_and_is_refused_by_name():
    straight = solved("finite", strip=replace(STRIP, natural_curvature=0.0, gamma=0.0), gravity=None)
    found = first(straight, width=theories.of_energy("wunderlich", None), weight=theories.towards(tip=(0.0, 0.0, -0.1)))
    assert isinstance(found["width"], NotDifferentiable)
    assert found["width"].reason == "not_finite"
    assert "width" in str(found["width"])
    assert np.abs(found["weight"].position(1.0)).max() > 1e-3


def test_without_what_holds_a_motion_there_is_no_step(ruled):
    found = first(ruled, it=theories.towards(start=Clamp(None, None, None)))
    assert isinstance(found["it"], NotDifferentiable)


def test_no_equilibrium_no_first_order():
    bad = solve(STRIP, CLAMP, Gravity((0.0, 0.0, 1.0)), segments=16, options={"max_iter": 1})
    assert not bad.ok
    with pytest.raises(NotDifferentiable):
        theories.responses(bad, {"it": theories.towards(energy="sadowsky")})
