"""Folds of a tape spring: pure bending in both senses, the cantilever, jumps, what is refused."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from ribbon.tape.held import Hold
from ribbon.tape.law import greatest, plateau, uniform
from ribbon.tape.path import LoadPath, begun, standing
from ribbon.tape.rod import Rod
from ribbon.tape.section import Section
from ribbon.tape.solve import Status, refined, solve
from ribbon.tape.surface import densities, profile

D = 210000.0 * 0.15**3 / 12.0 / (1.0 - 0.3**2)
MOMENT, FORCE = D * 60.0 / 1000.0, D * 60.0 / 1e6  # N mm of D w / l, N of D w / l^2


def section(terms):
    return Section(0.06, 1.5e-4, 0.3, 20.0, terms)


@cache
def bent(terms, angle, n):
    straight = Hold((0.0, 0.0), None, 0.0), Hold((1.0, 0.0), 0.0, 0.0)
    turned = Hold((0.0, 0.0), None, -angle), Hold((1.0, 0.0), 0.0, angle)
    return solve(section(terms), [straight, turned], np.full(n, 1.0 / n))


def test_pure_bending_folds_in_the_middle_past_a_snap_back():
    found = bent(1, 0.35, 800)
    assert found.status is Status.CONVERGED
    assert not any(mark.jumped for mark in found.marks)
    moments = np.array([mark.moments[1] for mark in found.marks]) * MOMENT
    # a little above the uniform one, 1510.60 N mm: the held sections stiffen the ends
    assert 1510.6 < moments.max() < 1.01 * 1510.6
    assert moments[-1] == pytest.approx(101.25, rel=5e-3)
    shares = np.array([mark.share for mark in found.marks])
    assert np.any(np.diff(shares) < 0.0)  # it snaps back
    assert any(mark.negative == 1 for mark in found.marks)
    assert found.marks[-1].fold == pytest.approx(0.5, abs=0.03)
    # both ends feel the same moment, no force across, none along
    last = found.marks[-1]
    assert last.moments[0] == pytest.approx(-last.moments[1], rel=1e-6)
    assert np.abs(last.force).max() < 1e-5


def test_the_enriched_tape_is_weaker_by_a_sixth():
    plain, rich = (bent(terms, 0.35, n) for terms, n in ((1, 800), (3, 400)))
    greatest_moments = [max(mark.moments[1] for mark in found.marks) * MOMENT for found in (plain, rich)]
    assert greatest_moments[1] / greatest_moments[0] == pytest.approx(5.0 / 6.0, abs=0.01)
    assert greatest_moments[1] > greatest(lambda k: uniform(section(3), k), 40.0)[0] * MOMENT
    assert rich.marks[-1].moments[1] == pytest.approx(plateau(lambda k: uniform(section(3), k), 20.0).moment, rel=5e-3)


def test_equal_sense_jumps_to_a_fold_in_the_middle():
    found = bent(1, -0.2, 400)
    assert found.status is Status.CONVERGED
    assert any(mark.jumped for mark in found.marks)
    assert found.marks[-1].moments[1] * MOMENT == pytest.approx(-54.52, rel=0.02)
    assert found.marks[-1].fold == pytest.approx(0.5, abs=0.03)


def test_every_mark_is_an_equilibrium_and_the_moment_is_the_slope_of_the_energy():
    # d(energy) / d(angle) = M: along the stable way between marks, by the trapezoidal rule
    found = bent(3, 0.35, 400)
    marks = [mark for mark in found.marks if mark.share > 0.3][-6:]
    energies = [found.rod.energy(mark.x)[0] for mark in marks]
    angles = [mark.angles[1] - mark.angles[0] for mark in marks]
    for a, b, u, v, one, other in zip(angles, angles[1:], energies, energies[1:], marks, marks[1:], strict=False):
        assert (v - u) == pytest.approx(0.5 * (b - a) * (one.moments[1] + other.moments[1]), rel=1e-2)


def test_cantilever_folds_near_the_clamp_and_the_fold_moves_towards_it():
    straight = Hold((0.0, 0.0), None, 0.0), Hold((1.0, 0.0), 0.0, None)
    moved = Hold((0.0, 0.0), None, 0.0), Hold((1.0, 0.2), 0.0, None)
    found = solve(section(1), [straight, moved], np.full(800, 1.0 / 800))
    assert found.status is Status.CONVERGED
    forces = np.array([mark.force[1] for mark in found.marks]) * FORCE
    assert forces.max() == pytest.approx(1.957, rel=5e-3)
    born = found.marks[int(np.argmax(forces))].fold
    assert 0.135 < born < 0.155
    assert 0.10 < found.marks[-1].fold < born
    assert found.marks[-1].moments[1] == 0.0
    # the clamp carries the force times its arm
    last = found.marks[-1]
    assert last.moments[0] == pytest.approx(-last.force[1] * last.end[0], rel=1e-4)


def test_refined_state_stays_where_it_is():
    coarse = bent(3, 0.35, 400)
    fine = refined(coarse)
    assert fine is not None
    assert fine.status is Status.CONVERGED
    assert len(fine.rod.lengths) == 800
    s = np.linspace(0.0, 1.0, 21)
    assert np.abs(coarse.rod.at(coarse.x, s)[:, :2, 0] - fine.rod.at(fine.x, s)[:, :2, 0]).max() < 3e-3


def test_sections_are_round_at_rest_and_flat_in_the_fold():
    found = bent(3, 0.35, 400)
    s, v = np.array([0.0, found.marks[-1].fold]), np.array([-0.03, 0.0, 0.03])
    y, z, beta = profile(found.rod, found.x, s, v)
    np.testing.assert_allclose(y[0], [-0.05 * np.sin(0.6), 0.0, 0.05 * np.sin(0.6)], rtol=1e-9)
    np.testing.assert_allclose(z[0], [0.05 * (1 - np.cos(0.6)), 0.0, 0.05 * (1 - np.cos(0.6))], rtol=1e-9)
    assert np.abs(beta[1]).max() < 0.1
    assert np.abs(densities(found.rod, found.x, s, v)["curvature"][1]).max() == pytest.approx(1 / 0.0535, rel=0.05)


def test_free_section_of_an_end_flattens_earlier():
    straight = Hold((0.0, 0.0), None, 0.0, False), Hold((1.0, 0.0), 0.0, 0.0, False)
    turned = Hold((0.0, 0.0), None, -0.06, False), Hold((1.0, 0.0), 0.0, 0.06, False)
    free = solve(section(3), [straight, turned], np.full(100, 0.01))
    held = bent(3, 0.06, 100)
    assert free.ok
    assert held.ok
    assert free.marks[-1].moments[1] < held.marks[-1].moments[1]
    assert free.rod.nodes(free.x)[0, 4] < 19.9
    assert held.rod.nodes(held.x)[0, 4] == 20.0


def test_stages_that_hold_different_things_are_refused():
    one, other = (Hold((0.0, 0.0), None, 0.0), Hold()), (Hold((0.0, 0.0), None, 0.0), Hold((1.0, 0.0), 0.0))
    with pytest.raises(ValueError, match="different things"):
        solve(section(1), [one, other], np.full(10, 0.1))


def test_a_section_needs_a_term_and_a_thickness_below_its_width():
    with pytest.raises(ValueError, match="terms = 0"):
        Section(0.06, 1e-4, 0.3, 20.0, 0)
    with pytest.raises(ValueError, match="thickness"):
        Section(0.06, 0.1, 0.3, 20.0)


def test_warping_of_the_membrane_lets_the_clamps_reach_farther():
    # the fold of the cantilever is born at 200 mm, and not at 140 mm: the shell's too (results/tape)
    born = []
    for warped in (False, True):
        shape = Section(0.06, 1.5e-4, 0.3, 20.0, 1, warped)
        ends = Hold((0.0, 0.0), None, 0.0), Hold((1.0, 0.12), 0.0)
        x = begun(Rod(shape, np.full(100, 0.01), ends[0], Hold((1.0, 0.0), 0.0)))
        rod = Rod(shape, np.full(100, 0.01), *ends)
        path = LoadPath(rod, standing(rod, x), rod.targets(*ends))
        for point in path.walk(path.settled(x, 0.0)):
            if point.negative:
                break
        born.append(float(rod.s[int(np.argmin(rod.nodes(point.x)[:, 4]))]))
    assert born == pytest.approx([0.14, 0.20], abs=0.011)


def test_a_nearly_flat_tape_takes_the_steps_of_a_flat_one():
    """It bends across by far more than its own curvature: steps measured by that were a thousand times too short."""
    straight = Hold((0.0, 0.0), None, 0.0), Hold((1.0, 0.0), 0.0, 0.0)
    turned = Hold((0.0, 0.0), None, -0.5), Hold((1.0, 0.0), 0.0, 0.5)
    found = [
        solve(Section(0.06, 1.5e-4, 0.3, across, 3), [straight, turned], np.full(100, 0.01))
        for across in (0.0, 1e-3, -1e-3)
    ]
    assert all(one.status is Status.CONVERGED for one in found)
    moments = [one.marks[-1].moments[1] for one in found]
    assert moments == pytest.approx(moments[:1] * 3, rel=1e-3)
    assert {len(one.marks) for one in found} <= set(range(len(found[0].marks) - 2, len(found[0].marks) + 3))
