"""A straight strip that meets a wall head on bends aside; how far it reaches beyond one is that of one piece."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from ribbon import Clamp, Gravity, Strip, Wall, solve
from ribbon.find.continuation import follow
from ribbon.find.solve import build, solve_from
from ribbon.result import Status


def ahead(place: float) -> tuple[Wall, ...]:
    return (Wall((0.0, 0.0, place), (0.0, 0.0, -1.0)),)


def strut(place: float) -> float:
    """Force of a clamped elastica whose tip slides on a plane square to it, at `place`: quarter of an inflexional one.

    With m = sin^2(tip angle / 2) it is K(m)^2, and the tip's place 2 E(m) / K(m) - 1 (A. E. H. Love, Mathematical
    Theory of Elasticity, 1927, sections 262 and 263).
    """
    m = brentq(lambda m: 2.0 * ellipe(m) / ellipk(m) - 1.0 - place, 1e-9, 0.9)
    return float(ellipk(m) ** 2)


@pytest.mark.parametrize("seed", ["natural", 0.0])
@pytest.mark.parametrize("place", [0.99, 0.9, 0.5])
def test_it_buckles_as_the_elastica(place, seed):
    found = solve(Strip(1.0, 0.05), Clamp(), walls=ahead(place), segments=24, seed_curvature=seed)
    assert found.ok
    assert -found.walls[0].force[2] == pytest.approx(strut(place), rel=2e-3)
    assert found.penetration <= 1e-6
    beside = solve(Strip(1.0, 0.05), Clamp(), walls=ahead(place), segments=24, seed_curvature=1.0)
    assert found.energy.total == pytest.approx(beside.energy.total, rel=1e-8)


@pytest.mark.parametrize(
    ("energy", "thickness"), [("wunderlich", None), ("sadowsky", None), ("kirchhoff", 1e-3), ("finite", 1e-3)]
)
@pytest.mark.parametrize("place", [0.9, 0.2])
def test_whatever_its_energy(place, energy, thickness):
    strip = Strip(1.0, 0.05, thickness=thickness)
    found = solve(strip, Clamp(), walls=ahead(place), segments=24, energy=energy)
    beside = solve(strip, Clamp(), walls=ahead(place), segments=24, energy=energy, seed_curvature=1.0)
    assert found.ok
    assert found.energy.total == pytest.approx(beside.energy.total, rel=1e-6)


def test_a_free_strip_between_two_walls():
    """Both tips slide: the first mode of a strut without clamps, pi^2."""
    walls = (Wall((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), Wall((0.0, 0.0, 0.99), (0.0, 0.0, -1.0)))
    found = solve(Strip(1.0, 0.05), Clamp(None, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)), walls=walls, segments=24)
    assert found.status in (Status.CONVERGED, Status.SADDLE)
    assert found.penetration <= 1e-6
    assert found.energy.total > 0.0


def test_what_pushes_it_aside_still_decides():
    weight = Gravity((0.0, 1.0, 0.0))
    found = solve(Strip(1.0, 0.05, gamma=1e-3), Clamp(), weight, walls=ahead(0.9), segments=24)
    assert found.ok
    assert found.end.position[1] < 0.0


def test_a_wall_that_sinks_onto_its_tip():
    strip = Strip(1.0, 0.05)
    start = solve(strip, Clamp(), walls=ahead(1.1), segments=16)
    found = follow(lambda t: build(strip, Clamp(), walls=ahead(1.1 - 0.2 * t), segments=16), start)
    assert found.ok
    assert -found.walls[0].force[2] == pytest.approx(strut(0.9), rel=5e-3)


@pytest.mark.parametrize("place", [0.99, 0.9, 0.5])
def test_a_strip_in_pieces_reaches_as_far_beyond_a_wall_as_in_one(place):
    """The minimiser leaves the straight strip in pieces, each before the wall: its own length is beyond it."""
    problem = build(Strip(1.0, 0.05), Clamp(), walls=ahead(place), segments=24)
    straight = np.zeros(25)
    equilibrium = solve_from(problem, problem.state(straight, straight))
    assert equilibrium.status is Status.INFEASIBLE
    assert equilibrium.penetration == pytest.approx(1.0 - place, rel=1e-6)
