"""The coil in a tube: touchdown angle and free arc as published and by shooting, which shares nothing with elements."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation.ribbon.obstacles import FREE_ARC, TOUCHDOWN, angles, coiled, gained, lowered, pressed, shot, wound


def test_shooting_has_the_published_angles():
    assert shot()[:2] == pytest.approx((TOUCHDOWN, FREE_ARC), abs=0.05)


def test_the_strip_has_them_too():
    found = coiled(60)
    assert angles(found) == pytest.approx((TOUCHDOWN, FREE_ARC), abs=0.1)
    assert angles(found) == pytest.approx(shot()[:2], abs=0.05)
    assert np.linalg.norm(found.end.position) == pytest.approx(found.problem.walls[0].radius, abs=1e-6)
    assert found.end.position[0] == pytest.approx(0.0, abs=1e-9)
    (tube,) = found.walls
    assert tube.force + found.start.force == pytest.approx(np.zeros(3), abs=1e-7)
    moment = found.start.moment + np.cross([0.0, -found.problem.walls[0].radius, 0.0], found.start.force) + tube.moment
    assert moment == pytest.approx(np.zeros(3), abs=1e-6)
    assert tube.moment == pytest.approx(np.zeros(3), abs=1e-8)  # pushes go through the axis


@pytest.mark.parametrize(("turn", "segments", "missed"), [(30.0, 40, 2e-3), (30.0, 120, 2e-4), (100.0, 120, 5e-3)])
def test_a_strip_wound_by_many_radians_keeps_to_the_wall_by_a_thrust_alone(turn: float, segments: int, missed: float):
    """Stable and in its plane; the push of a line is D w / R^3, and the end gains what the elastica's free arc does."""
    found = wound(turn, segments)
    assert np.abs(found.joints[0][:, 0]).max() < 1e-8
    assert found.penetration < 1e-6
    assert lowered(turn, segments) == pytest.approx(gained(), abs=missed)
    assert pressed(turn, segments) == pytest.approx(1.0, abs=missed)
    assert found.walls[0].force + found.start.force == pytest.approx(np.zeros(3), abs=1e-8 * turn**2)
