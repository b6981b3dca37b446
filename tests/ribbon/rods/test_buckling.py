"""Where rods lose stability in twist: Michell's ring, a rod between clamps; which shape takes over."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ribbon.rods.rod import STRAIGHT, Rod, RodEnd, marched, rotation
from ribbon.rods.solve import Found, multipliers, newton, solve
from ribbon.rods.stability import judged
from ribbon.rods.start import from_frames

#: G J / E I.
TORSION = 0.7
#: A ring may turn about its seam's tangent for nothing when its section is round: that eigenvalue is zero.
ZERO = 1e-5


def turned(n: int, turn: float, bend: float, slide: bool) -> Found:
    """A round rod of n edges bent evenly to the curvature `bend`, its end turned by `turn` about its tangent."""
    rod = Rod(np.full(n, 1.0 / n), (1.0, 1.0, TORSION))
    strains = np.tile([bend, 0.0, 0.0], (n + 1, 1))
    points, frames = marched(rod, np.zeros(3), np.eye(3), strains)
    middles = 0.5 * (rod.vertices[1:] + rod.vertices[:-1])
    frames = np.array([f @ rotation(np.array([0.0, 0.0, turn * s])) for f, s in zip(frames, middles, strict=True)])
    end = marched(rod, np.zeros(3), np.eye(3), strains)[1][-1] @ rotation(0.5 / n * strains[0])
    end = end @ rotation(np.array([0.0, 0.0, turn]))
    held = Rod(
        rod.lengths, rod.stiffness, STRAIGHT, RodEnd(np.zeros(3), np.eye(3)),
        RodEnd(points[-1], end, np.array([0.0, 0.0, 1.0]) if slide else None),
    )  # fmt: skip
    return newton(*from_frames(held, points, frames))


def critical(at: Callable[[float], Found], low: float, high: float, steps: int = 8) -> float:
    """The turn between `low` and `high` at which the lowest eigenvalue changes sign."""
    values = [judged(at(turn)).eigenvalue for turn in (low, high)]
    assert values[0] > -ZERO > values[1]
    for _ in range(steps):
        middle = 0.5 * (low + high)
        if judged(at(middle)).eigenvalue > -ZERO:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@pytest.mark.parametrize(
    ("bend", "slide", "exact"),
    [(2.0 * math.pi, False, 2.0 * math.pi * math.sqrt(3.0)), (0.0, True, 2.0 * 4.493409457909064)],
    ids=["ring of Michell", "straight, clamped"],
)
def test_critical_turn(bend, slide, exact):
    """G J turn / E I where the shape is lost: 2 pi sqrt(3) and twice the least root of tan u = u; order 2 in the edges,
    extrapolated from 40 and 80."""
    found = []
    for n in (40, 80):
        close = exact * (1.0 - 27.0 / n**2) / TORSION
        found.append(TORSION * critical(lambda turn, n=n: turned(n, turn, bend, slide), 0.98 * close, 1.02 * close))
    assert abs(found[1] - exact) < 0.3 * abs(found[0] - exact)
    assert (4.0 * found[1] - found[0]) / 3.0 == pytest.approx(exact, rel=1e-3)


def test_the_twist_is_even():
    """Round and straight at rest: tau is the same all along a bent rod (4.2.7), up to order 2 or better."""
    misses = []
    for n in (20, 40, 80):
        found = turned(n, 6.0, 3.0, False)
        assert found.ok
        tau = found.problem.evaluated(found.y).strain[:, 2] / found.problem.rod.cells
        misses.append(np.abs(tau[1:-1] - 6.0).max())
    assert np.all(np.log2(np.array(misses[:-1]) / misses[1:]) > 1.8)
    assert misses[-1] < 1e-4


def test_rows_that_repeat_one_another_leave_finite_multipliers():
    """A straight rod between two clamps that are as far apart as it is long: nothing tells its tension."""
    straight = turned(40, 0.0, 0.0, False).problem
    rod = replace(straight.rod, end=replace(straight.rod.end, position=np.array([0.0, 0.0, 1.0])))
    points, frames = marched(rod, np.zeros(3), np.eye(3), np.zeros((41, 3)))
    problem, y = from_frames(rod, points, frames)[:2]
    rows = multipliers(problem.anchored(y), y)
    assert np.all(np.isfinite(rows))
    assert np.abs(rows).max() < 1e-9


def test_clamped_frames_couple_twist_and_shape():
    """The seed's 4.2.7: the shape does not know the twist. So it is where an end may spin; clamped frames turn a bow
    out of its plane, with a force (Q kb)' that is not 0 (an arc of a circle stays: there kb is constant)."""
    heights = []
    for turn in (0.0, 3.0):
        bow = turned(40, turn, 0.0, False).problem
        rod = replace(bow.rod, end=replace(bow.rod.end, position=np.array([0.0, 0.0, 0.8])))
        strains = np.zeros((41, 3))
        strains[:, 0] = 5.0 * np.cos(2.0 * math.pi * rod.middles)
        points, frames = marched(rod, np.zeros(3), np.eye(3), strains)
        spun = [f @ rotation(np.array([0.0, 0.0, turn * (j + 0.5) / 40])) for j, f in enumerate(frames)]
        found = solve(*from_frames(rod, points, np.array(spun)))
        assert found.ok
        heights.append(np.abs(found.problem.positions(found.y)[:, 0]).max())
    assert heights[0] < 1e-7
    assert heights[1] > 0.03
