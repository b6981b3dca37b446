"""Contact with planes (thesis, 6.2): what a solve with walls must satisfy, whatever the minimiser did."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from ribbon import Clamp, Equilibrium, Gravity, Strip, Wall, solve, switch
from ribbon.find.solve import build
from ribbon.problems.conditions import WallRows

FLOOR = Wall((0.0, -1e-6, 0.0), (0.0, 1.0, 0.0))
GAMMA = 10.0
HEIGHT = 0.18
SEGMENTS = 36
UP = np.array([0.0, 1.0, 0.0])


def roof(height: float, stiffness: float | None = None) -> Wall:
    return Wall((0.0, height, 0.0), (0.0, -1.0, 0.0), stiffness)


def arguments(*walls: Wall) -> dict:
    return {
        "strip": Strip(1.0, 0.2, 0.5, gamma=GAMMA), "clamp": Clamp(ruling="free"), "gravity": Gravity((0.0, 1.0, 0.0)),
        "end": Clamp((0.0, 0.0, 0.9), ruling="free"), "walls": walls, "segments": SEGMENTS,
    }  # fmt: skip


@cache
def arch(*walls: Wall) -> Equilibrium:
    """Roman's strip, an arch over the floor of its clamps."""
    found = solve(**arguments(*walls), seed_curvature=(-8.0, 8.0, 8.0, -8.0))
    assert found.ok, found.message
    return found


def wall_rows(equilibrium: Equilibrium, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Distances of the edges from wall k and its multipliers (what the wall exerts), two a joint, then one for every
    point that is held between them."""
    problem = equilibrium.problem
    blocks, slices = problem.blocks(), problem.block_slices()  # type: ignore[attr-defined]
    assert isinstance(blocks[f"wall_{k}"], WallRows)
    names = [name for name in (f"wall_{k}", f"touch_{k}") if name in blocks]
    values = [blocks[name].values(equilibrium.x) for name in names]
    return np.concatenate(values), -np.concatenate([equilibrium.rows[slices[name]] for name in names])


def edges(equilibrium: Equilibrium) -> np.ndarray:
    """Both edges of the rulings at the joints, from the result and not from the rows: (p + 1, 2, 3)."""
    points, frames = equilibrium.joints
    eta = equilibrium.eta(np.concatenate([[0.0], np.cumsum(equilibrium.problem.lengths)]).clip(0.0, 1.0))
    ruling = frames[:, :, 0] + eta[:, None] * frames[:, :, 2]
    half = 0.5 * equilibrium.problem.strip.relative_width
    return np.stack([points + half * ruling, points - half * ruling], axis=1)


def test_nothing_penetrates_and_multipliers_are_complementary():
    found = arch(FLOOR, roof(HEIGHT))
    heights = edges(found)[:, :, 1]
    assert heights.max() <= HEIGHT + 1e-9
    assert heights.min() >= -1e-6 - 1e-9
    for k in (0, 1):
        distance, push = wall_rows(found, k)
        assert distance.min() > -1e-9
        assert push.min() > -1e-9
        assert np.abs(distance * push).max() < 1e-8
    assert -found.walls[1].force[1] > 50.0
    assert found.position(np.linspace(0.4, 0.6, 2001))[:, 1].max() == pytest.approx(HEIGHT, abs=1e-6)  # it does touch
    # at the middle, or a segment beside it, another minimum of these segments; rounding decides which is found (by
    # processor and BLAS)
    contacts = found.walls[1].contacts
    assert np.ptp(contacts) < 1.01 / SEGMENTS
    assert np.abs(contacts - 0.5).max() < 2.01 / SEGMENTS


def test_forces_balance():
    found = arch(FLOOR, roof(HEIGHT))
    held = [wall.force for wall in found.walls] + [found.start.force, found.end_support.force]
    np.testing.assert_allclose(np.sum(held, axis=0), GAMMA * UP, atol=1e-8)


def test_moments_balance():
    """About the origin: clamps, walls where they touch, weight at its centre."""
    found = arch(FLOOR, roof(HEIGHT))
    points = edges(found)
    moment = found.start.moment + found.end_support.moment
    moment = moment + np.cross([0.0, 0.0, 0.9], found.end_support.force)
    for k, wall in enumerate(found.problem.walls):
        joints = found.problem.blocks()[f"wall_{k}"].joints
        push, between = np.split(wall_rows(found, k)[1], [2 * len(joints)])
        push = push.reshape(-1, 2)
        moment = moment + np.cross(points[joints], push[:, :, None] * np.asarray(wall.normal)).sum(axis=(0, 1))
        half = 0.5 * found.problem.strip.relative_width
        for force, touch in zip(between, [t for t in found.problem.touching if t.wall == k], strict=True):
            frame = found.frame(touch.s)[0]
            place = found.position(touch.s)[0] + touch.side * half * (frame[:, 0] + found.eta(touch.s) * frame[:, 2])
            moment = moment + np.cross(place, force * np.asarray(wall.normal))
    nodes, weights = np.polynomial.legendre.leggauss(6)
    s = (np.arange(SEGMENTS)[:, None] + 0.5 * (nodes + 1.0)) / SEGMENTS
    centre = np.tile(0.5 * weights / SEGMENTS, SEGMENTS) @ found.position(s.ravel())
    np.testing.assert_allclose(moment + np.cross(centre, -GAMMA * UP), 0.0, atol=1e-7)


def test_the_roof_force_is_minus_the_slope_of_the_energy():
    found = arch(FLOOR, roof(HEIGHT))
    h = 1e-5
    near = [switch(build(**arguments(FLOOR, roof(HEIGHT + d))), found).energy.total for d in (-h, h)]
    assert -(near[1] - near[0]) / (2.0 * h) == pytest.approx(-found.walls[1].force[1], rel=1e-6)


def test_a_pressure_plate_exerts_what_a_wall_at_its_height_does():
    stiffness = 3000.0
    plate = arch(FLOOR, roof(0.16, stiffness))
    given = plate.walls[1].height
    assert given is not None
    height = 0.16 - given  # the plate moves along its normal, downwards
    assert 0.17 < height < 0.19
    force = -plate.walls[1].force[1]
    assert force == pytest.approx(-stiffness * given, rel=1e-9)
    assert plate.energy.plates == pytest.approx(0.5 * stiffness * given**2, rel=1e-12)
    wall = switch(build(**arguments(FLOOR, roof(height))), plate)
    assert wall.ok
    assert -wall.walls[1].force[1] == pytest.approx(force, rel=1e-8)
    assert wall.energy.elastic == pytest.approx(plate.energy.elastic, rel=1e-9)


def test_a_wall_that_is_not_touched_changes_nothing():
    without, far = arch(FLOOR), arch(FLOOR, roof(0.3))
    assert far.energy.total == pytest.approx(without.energy.total, abs=1e-10)
    assert np.abs(wall_rows(far, 1)[1]).max() < 1e-9
    assert far.walls[1].contacts.size == 0
    assert np.abs(far.walls[1].force).max() < 1e-7


def test_two_walls_at_the_same_place_share_one_force():
    once = arch(FLOOR, roof(HEIGHT))
    twice = switch(build(**arguments(FLOOR, roof(HEIGHT), roof(HEIGHT))), once)  # in the same minimum
    shared = twice.walls[1].force[1] + twice.walls[2].force[1]
    assert shared == pytest.approx(once.walls[1].force[1], rel=1e-6)
    assert twice.energy.total == pytest.approx(once.energy.total, rel=1e-9)


def test_the_nearer_of_two_walls_carries_all():
    alone = arch(FLOOR, roof(HEIGHT))
    found = switch(build(**arguments(FLOOR, roof(HEIGHT), roof(0.185))), alone)
    assert found.ok
    assert found.walls[1].force[1] == pytest.approx(alone.walls[1].force[1], rel=1e-6)
    assert abs(found.walls[2].force[1]) < 1e-7


@pytest.mark.parametrize("tilt", [0.3, -0.3])
def test_a_tilted_strip_leans_on_its_lower_edge_and_a_level_one_on_both(tilt):
    """A cantilever over a table: turned about its tangent it comes down on its lower edge."""
    strip = Strip(1.0, 0.1, 0.3, gamma=8.0)
    table = Wall((0.0, -0.15, 0.0), (0.0, 1.0, 0.0))
    for angle in (0.0, tilt):
        clamp = Clamp(normal=(-math.sin(angle), math.cos(angle), 0.0), ruling="free")
        found = solve(strip, clamp, Gravity((0.0, 1.0, 0.0)), walls=[table], segments=20)
        assert found.ok, found.message
        push = wall_rows(found, 0)[1].reshape(-1, 2)
        heights = edges(found)[:, :, 1]
        assert heights.min() == pytest.approx(-0.15, abs=1e-8)
        assert found.start.force[1] + found.walls[0].force[1] == pytest.approx(8.0, abs=1e-8)
        if angle == 0.0:
            np.testing.assert_allclose(push[:, 0], push[:, 1], rtol=1e-6, atol=1e-8)
            assert push[-1].min() > 0.5
            continue
        # t_x = (cos, sin, 0): the edge u > 0 is the upper one for a positive angle; the free end lies on both
        upper, lower = push.T if angle > 0.0 else push.T[::-1]
        assert lower[-1] > 1.1 * upper[-1] > 0.5
        assert lower[-2] > 1e-5
        assert upper[-2] < 1e-7


def test_a_sliding_wall_does_no_work_along_itself():
    """Without friction the wall's force has no part along it, though the ends shear the strip sideways."""
    found = solve(
        Strip(1.0, 0.1, 0.3), Clamp(ruling="free"), end=Clamp((0.05, 0.0, 0.9), ruling="free"),
        walls=[FLOOR, roof(HEIGHT)], segments=24, seed_curvature=(-8.0, 8.0, 8.0, -8.0), leave_saddle=True,
    )  # fmt: skip
    assert found.ok, found.message
    force = found.walls[1].force
    assert force[1] < -10.0
    assert np.abs(force[[0, 2]]).max() == 0.0
    total = found.start.force + found.end_support.force + sum(wall.force for wall in found.walls)
    np.testing.assert_allclose(total, 0.0, atol=1e-8)
