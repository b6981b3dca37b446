"""The loop of a twisted strip that lies on itself: a ply of strips holds no turns; how its strands lie, and on what."""

from __future__ import annotations

import numpy as np
import pytest

from compare import registry
from compare.scene.scene import loads
from ribbon.energies.section.rod import stiffnesses
from tests.reference.balanced_ply import of_twist
from tests.reference.touching_ring import writhe
from tests.validation.ribbon import ribbon_loop as page
from tests.validation.ribbon import ribbon_plectoneme


def plied(turns: int, angle: float, radius: float = 1.0) -> tuple[np.ndarray, float]:
    """Polygon of two strands wound round each other by whole turns, joined at both ends; the length of a strand."""
    height = 2.0 * np.pi * turns * radius / np.tan(angle)
    phase = 2.0 * np.pi * turns * np.linspace(0.0, 1.0, 120 * turns + 1)
    z = height * phase / phase[-1]
    strand = np.column_stack([radius * np.cos(phase), radius * np.sin(phase), z])
    half = np.linspace(0.0, np.pi, 60)[1:-1]
    bow = np.column_stack([radius * np.cos(half), 0.0 * half, 2.0 * radius * np.sin(half)])
    over, other = bow + np.array([0.0, 0.0, height]), strand[::-1] * np.array([-1.0, -1.0, 1.0])
    return np.vstack([strand, over, other, bow[::-1] * np.array([1.0, 1.0, -1.0])]), height / np.cos(angle)


@pytest.mark.parametrize("angle", [0.3, 0.7])
def test_a_ply_of_strips_holds_no_turns(angle):
    """Two turns more of a ply whose sections keep their place against its axis: what they twist is what they writhe."""
    (few, short), (many, long) = plied(2, angle), plied(4, angle)
    twisted = 2.0 * (long - short) * np.sin(2.0 * angle) / (4.0 * np.pi)
    assert abs(twisted) > 2.5
    assert abs(abs(writhe(many) - writhe(few)) - twisted) < 5e-3
    assert (writhe(many) - writhe(few)) * twisted < 0.0


def test_a_long_ply_is_that_of_least_energy():
    """Nearly as thick as wide, so that both bendings are nearly one."""
    case = page.ROD._replace(slender=1.0 + 1e-9)
    bending, torsion = stiffnesses((0.5 * case.width, case.strip.thickness, page.NU, 0.0))
    ply = of_twist(20.0, 0.01, torsion / bending)
    assert page.long_ply(torsion * 20.0, 0.02, case) == pytest.approx(np.degrees(ply.angle), rel=1e-6)


def test_segments_whose_joints_are_far_from_what_touches():
    """The rod at Z = 0.2 touches at 0.1 and 0.9, joints of 40 and of 80 segments."""
    first, second = (page.clear_of((0.1, 0.9), counts) for counts in page.BETWEEN)
    assert (first, second) == (45, 85)
    assert all(abs(0.1 * n % 1.0 - 0.5) < 1e-9 for n in (first, second))


@pytest.mark.validate
def test_the_lowest_eigenvalue_is_not_that_of_a_place_held_from_both_sides_of_a_joint():
    """On 40 segments 0.3471: the rod at Z = 0.2."""
    case, state = page.ROD, page.nearer(page.ROD, len(page.NEARER))
    value, change = page.lowest(state, case, page.NEARER[-1], page.TURNS)
    assert value < 0.1 * state.lowest_eigenvalue
    assert change < 0.1 * value


@pytest.mark.validate
def test_a_loop_that_is_turned_further_stays_a_loop_and_balances():
    """At one place, its strands far from a ply's angle; the energy grows by the moment's work."""
    case, state = page.FINITE[0], page.turned(page.FINITE[0], 1)
    assert state.ok
    assert ribbon_plectoneme.link(state) == pytest.approx(page.MORE[0], abs=1e-3)
    (one,) = page.touches(state, case)
    assert one.strands > 3.0 * page.long_ply(state.end_support.moment[2], one.apart, case)
    begin = page.turned(case, 0)
    moments = [e.end_support.moment[2] for e in (begin, state)]
    done = 2.0 * np.pi * (page.MORE[0] - page.TURNS) * np.array(moments)
    assert done.min() < state.energy.total - begin.energy.total < done.max()


@pytest.mark.validate
def test_the_scene_of_the_film_ends_in_the_state_of_the_page():
    """One begins as a helix, the other as an arch whose end is turned by quarters."""
    state = registry.model("ribbon").solve(loads(page.SCENE, "film"))
    known = ribbon_plectoneme.carried(page.FINITE[1], ribbon_plectoneme.DISTANCES[:1]).state
    assert state.stable
    assert state.energy.total == pytest.approx(known.energy.total, rel=1e-6)
