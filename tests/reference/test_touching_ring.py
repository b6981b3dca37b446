"""The shootings of a ring and of a clamped rod that touch themselves agree with what they do not use."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference import clamped_rod, plectoneme, plied_ring, strand, touching_ring

TORSION, DIAMETER = 2.0 / 3.0, 0.02
#: (x, a, t, n_2, n_3) of a ring of one place, and (..., s, F) of one of two; and of a clamped rod.
ONE = np.array([0.196, -0.008, 4.1, -86.63, 30.97])
TWO = np.array([0.20908, -1.10255, 6.48049, -19.34, 167.567, 0.2308, 201.19])
BOWED = np.array([0.1771634, 0.55806027, 16.90983273, -8.36905827, 39.24286548])
TOUCHING = np.array([0.18441077, -1.77950235, 0.17215523, 165.39492225, 105.14299578, 23.20148149, 169.22395954])

#: As `plied_ring` has them: a ring with a line at 21.1; a rod of 23.93 rad with a line, its clamps 0.41 apart.
LINE = np.array([0.21252688, -1.93437577, 7.89705562, 148.585332, 163.486067, 25.1569603, 0.202971566, 394.697018,
                 0.237325347])  # fmt: skip
PLY = np.array([0.30789323, 0.73071298, 10.408094, -296.3048, -97.289409, 29.793986, 0.17040538, 523.13318, 0.19962869,
                0.21541988, 70.766517, 0.25712288, 434.66209])  # fmt: skip


def test_writhe_of_a_closed_curve():
    """Of a plane curve none; of one in space by quadrature of Gauss's double integral."""
    t = 2.0 * np.pi * np.arange(400) / 400
    assert touching_ring.writhe(np.stack([np.cos(t), 0.5 * np.sin(t), 0.0 * t], axis=1)) == pytest.approx(
        0.0, abs=1e-12
    )

    def curve(t):
        return np.stack([np.cos(t) * (1.0 + 0.4 * np.cos(2.0 * t)), np.sin(t), 0.5 * np.sin(2.0 * t)], axis=-1)

    def slope(t):
        first = -np.sin(t) * (1.0 + 0.4 * np.cos(2.0 * t)) - 0.8 * np.cos(t) * np.sin(2.0 * t)
        return np.stack([first, np.cos(t), np.cos(2.0 * t)], axis=-1)

    n = 400
    one, other = 2.0 * np.pi * np.arange(n) / n, 2.0 * np.pi * (np.arange(n) + 0.5) / n
    r, u = curve(one)[:, None] - curve(other)[None], np.cross(slope(one)[:, None], slope(other)[None])
    gauss = (np.einsum("ijk,ijk->ij", u, r) / np.linalg.norm(r, axis=2) ** 3).sum() * (2.0 * np.pi / n) ** 2
    coarse, fine = (touching_ring.writhe(curve(2.0 * np.pi * np.arange(k) / k)) for k in (200, 400))
    assert (4.0 * fine - coarse) / 3.0 == pytest.approx(gauss / (4.0 * np.pi), abs=1e-5)


@pytest.mark.parametrize(("apex", "guess", "places"), [(17.0, ONE, 1), (22.01, TWO, 2)])
def test_the_moment_is_the_energys_slope_over_the_turn(apex, guess, places):
    """dE/dT = C t along a branch: the writhe in T is a curve's, t and E are those of the shooting."""
    mid = touching_ring.ring(apex, TORSION, DIAMETER, guess, places, chords=60)
    low, high = (
        touching_ring.ring(apex + step, TORSION, DIAMETER, mid.unknowns, places, chords=60) for step in (-0.002, 0.002)
    )
    slope = (high.energy - low.energy) / (high.turn - low.turn)
    assert slope == pytest.approx(TORSION * mid.twist, rel=1e-4)
    assert mid.force > 0.0
    assert mid.neck >= DIAMETER - 1e-9


def test_the_tension_is_the_energys_slope_over_the_distance():
    """dE/dZ = T of a clamped rod, without contact and with it: contact does no work."""

    def free(bend, v):
        return clamped_rod.free(bend, 6.0 * np.pi, TORSION, v)

    def touching(twist, v):
        return clamped_rod.touching(twist, 6.0 * np.pi, TORSION, DIAMETER, v)

    for at, value, guess in ((free, 8.0, BOWED), (touching, 12.56606548, TOUCHING)):
        mid = at(value, guess)
        low, high = (at(value + step, mid.unknowns) for step in (-0.005, 0.005))
        assert (high.energy - low.energy) / (high.distance - low.distance) == pytest.approx(mid.tension, rel=1e-4)


def test_a_loop_on_a_rod_without_end_jumps_where_its_tension_is_least_work():
    """At the fold of R = M / C + 4 arccos(m / 2) both ways along the homoclinic shapes shorten the rod less."""
    least = clamped_rod.without_end(6.0 * np.pi, TORSION)
    for m in (0.9, 1.0, 1.1, 1.2, 1.3):
        moment = TORSION * (6.0 * np.pi - 4.0 * np.arccos(0.5 * m))
        assert 1.0 - 4.0 * m / moment * np.sqrt(1.0 - 0.25 * m * m) >= least - 1e-12


def test_two_places_are_those_of_the_other_shooting():
    """Of a ring: the same equations put together twice, the turn from the writhe or from what is carried along."""
    known = touching_ring.ring(22.01, TORSION, DIAMETER, TWO, 2, chords=60)
    guess = np.array([*known.unknowns[:5], 22.01, *known.unknowns[5:]])
    found = plied_ring.ring(known.turn, TORSION, DIAMETER, plied_ring.TWO, guess)
    assert found.energy == pytest.approx(known.energy, rel=1e-5)
    assert found.touched.forces[0] == pytest.approx(known.force, rel=1e-4)


def test_lines_of_contact_do_no_work():
    """dE/dT = C t of a ring with a line, dE/dZ = T of a rod between clamps with one."""
    mid, low, high = (
        plied_ring.ring(21.1 + step, TORSION, DIAMETER, plied_ring.LINE, LINE) for step in (0.0, -0.005, 0.005)
    )
    assert (high.energy - low.energy) / 0.01 == pytest.approx(TORSION * mid.twist, rel=1e-5)

    def rod(turn, distance):
        return plectoneme.held(distance, turn, TORSION, DIAMETER, "plp", PLY)

    turn, distance = 23.930078, 0.41
    one = rod(turn, distance)
    pulled = (rod(turn, distance + 2e-4).energy - rod(turn, distance - 2e-4).energy) / 4e-4
    assert pulled == pytest.approx(one.tension, rel=1e-4)


def test_a_strand_stays_at_its_distance_along_a_line():
    """On the line the strand is half a diameter from the axis, and all that touches pushes."""
    known = plied_ring.ring(21.1, TORSION, DIAMETER, plied_ring.LINE, LINE)
    own = known.touched
    at = strand.states(strand.begun(*known.unknowns[:6], TORSION), "pm", known.unknowns[6:], DIAMETER, 0.25, own.s[1:])
    assert np.abs(np.hypot(at[1], at[2]) - 0.5 * DIAMETER).max() < 1e-9
    assert min(own.forces) > 0.0
    assert own.push.min() > 0.0
