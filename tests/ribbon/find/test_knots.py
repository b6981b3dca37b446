"""An overhand knot in a round rod: its strands run the same way where they lie along each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import simpson
from scipy.optimize import root

from ribbon.find.jointed.rounds import settled
from ribbon.find.jointed.touching import Line, Touching, joints, short_line
from tests.reference import braid
from tests.reference.braid import overhand
from tests.reference.knot_type import crossings, determinant
from tests.validation.ribbon.knots import DIAMETER, DISTANCE, SEGMENTS, downhill, kept, measured, rod


def torus(p, q):
    """A curve that goes p times round the axis of a torus and q times round its tube, (200, 3)."""
    t = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    out = 2.0 + np.cos(q * t)
    return np.stack([out * np.cos(p * t), out * np.sin(p * t), np.sin(q * t)], axis=1)


@pytest.mark.validate
def test_downhill_of_a_drawn_curve_is_the_knot_that_is_kept():
    assert downhill().jointed.state.energy.total == pytest.approx(kept().jointed.state.energy.total, rel=1e-5)


@pytest.mark.parametrize(("p", "q", "expected"), [(1, 3, 1), (2, 3, 3), (2, 5, 5), (2, 7, 7), (3, 4, 3), (3, 5, 1)])
def test_a_knot_is_told_by_its_determinant(p, q, expected):
    points = torus(p, q)
    assert {determinant(points, d) for d in ((0.3, 0.8, 0.4), (1.0, 0.1, 0.2), (0.1, 0.2, 1.0))} == {expected}


def test_strands_pushed_through_each_other_are_another_knot():
    """A crossing of the trefoil seen from its axis, changed by hand, leaves no knot."""
    points, up = torus(2, 3), (0.01, 0.02, 1.0)
    below, _, _ = crossings(points, up)[0]
    near = np.abs((np.arange(200) - below + 100) % 200 - 100) < 12
    points[near, 2] += 4.0
    assert determinant(points, up) == 1


def test_the_braid_of_a_loose_knot():
    """Three half turns of two strands about each other, held apart by pushes alone, which all of it balances: beyond
    the last place the moment of what pushes is the curvature of the loop."""
    one = overhand()
    assert one.turned == pytest.approx(1.5 * np.pi, abs=1e-9)
    assert min(one.ends, one.force, one.least) > 0.0
    assert one.closest > 1.0
    assert 0.0 < one.line < one.place


def test_the_pushes_of_the_braid_balance_and_bend_it_as_they_should():
    """On the line v'''' = q v by differentiating a polynomial through v; and of all pushes, whose sum the shooting does
    not take: it is -v''' in the middle, and their moment about it the change of v'' to (-1, 0)."""
    one = overhand()
    first, third, end, place, force = root(braid._missed, np.array(braid._GUESS), tol=1e-13).x
    t = 0.5 * end * (1.0 - np.cos(np.linspace(0.0, np.pi, 81)))
    a, b, c, d = braid._line(first, third, end, t)
    v = np.array([np.sin(a), np.cos(a)])
    q = b**4 - 3.0 * c**2 - 4.0 * b * d
    for own in v:
        fourth = np.polynomial.Chebyshev.fit(t, own, 9).deriv(4)(t)
        assert np.abs(fourth - q * own)[10:-10].max() < 1e-3
    far = braid._walked(braid._left(first, third, end, force), place - end)[0]
    pushes = simpson(q * v, x=t) + one.ends * v[:, -1] + one.force * far
    assert pushes == pytest.approx([first**3 - third, 0.0], abs=1e-6)
    turning = simpson(t * q * v, x=t) + end * one.ends * v[:, -1] + place * one.force * far
    assert turning == pytest.approx([1.0, -(first**2)], abs=1e-6)
    assert one.push == pytest.approx(2.0 * (one.ends + simpson(q, x=t)), abs=1e-6)


def test_a_knot_is_in_equilibrium_with_a_place_a_line_and_a_place():
    """Settled from its kept shape: alike about its middle, nothing too near, still tied; the force of a loose knot's
    place by shooting is the leading term of its own, the root of h / R beyond."""
    knot = kept()
    here, own = knot.jointed, measured(knot.jointed)
    assert here.state.ok
    assert here.state.lowest_eigenvalue > 0.0
    assert own.determinant == 3
    line = here.touching.lines[0]
    assert line.way == 1
    assert 0.5 * (line.begin + line.facing[-1] + line.end + line.facing[0]) == pytest.approx(1.0, abs=2e-3)
    assert here.pushes[0] == pytest.approx(here.pushes[1], rel=1e-3)
    assert abs(here.state.tau([0.5])[0]) < 1e-5
    assert here.pushes.min() > 0.0
    thickness, _, _, force, _ = own.scaled(DIAMETER)
    assert 1.0 < force / overhand().force < 1.0 + 3.0 * np.sqrt(thickness)


def test_joints_of_a_line_whose_strands_run_the_same_way():
    line = Line(0.2, 0.26, (0.74, 0.77, 0.785, 0.81))
    assert line.way == 1
    s, _ = joints(Touching(((0.1, 0.9),), (line,)), 0.02, False)
    assert (np.diff(s) > 0.0).all()
    assert np.abs(s[:, None] - [0.2, 0.22, 0.24, 0.26, 0.74, 0.77, 0.785, 0.81]).min(axis=0).max() < 1e-14
    assert line.to(0.18, 0.28).facing[0] == pytest.approx(0.74 - 0.02 * 1.5)


def test_a_line_begins_the_way_its_strands_run():
    here = kept().jointed
    (s, other), _ = here.touching.places
    line = short_line(here.state, s, other, 1e-3)
    assert line.way == 1
    assert line.facing == pytest.approx((other - 1e-3, other, other + 1e-3))


def test_a_knot_that_is_pulled_takes_the_work_of_its_pull_and_stays_even():
    """Energy by the pull's work (trapezium), of which the solver knows nothing; begun with joints put aside, what
    touches goes to itself under half a turn, and so do the pushes."""
    knot, step = kept(), 2e-3
    aside = replace(knot.jointed, touching=moved(knot.jointed.touching, 2e-4), even=True)
    found = [settled(rod(knot.turn, DISTANCE + dz, DIAMETER, SEGMENTS), aside) for dz in (0.0, step)]
    energies, pulls = zip(*((each.state.energy.total, measured(each).pull) for each in found), strict=True)
    assert energies[1] - energies[0] == pytest.approx(0.5 * step * sum(pulls), rel=1e-3)
    assert pulls[1] > pulls[0]
    for each in found:
        (first, last), (line,) = each.touching.places, each.touching.lines
        assert np.add(first, last[::-1]) == pytest.approx([1.0, 1.0], abs=2e-5)
        assert abs(line.uneven()) < 2e-5
        assert each.pushes[0] == pytest.approx(each.pushes[1], rel=1e-4)
        assert each.pushes[2] == pytest.approx(each.pushes[-1], rel=0.05)


def moved(touching, by):
    lines = [replace(line.to(line.begin + by, line.end + by)) for line in touching.lines]
    return Touching(tuple((s + by, other + by) for s, other in touching.places), tuple(lines))


def test_places_of_an_even_state_go_to_each_other():
    even = Touching(((0.1, 0.7), (0.302, 0.9), (0.25, 0.752)), ()).even().places
    assert np.array(even) == pytest.approx(np.array([(0.1, 0.699), (0.301, 0.9), (0.249, 0.751)]))
    assert Line(0.2, 0.24, (0.76, 0.78, 0.81)).uneven() == pytest.approx(0.0025)
