"""The coil in a tube: touchdown angle and free arc as published and by shooting, which shares nothing with elements."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation.ribbon.obstacles import FREE_ARC, TOUCHDOWN, angles, coiled, shot


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
