"""Round obstacles in pictures: where their points are, and that a cylinder reaches past the strip."""

from __future__ import annotations

import numpy as np
import pytest

from compare.pages.pictures.ribbon import round_grid
from ribbon.obstacle import Obstacle


@pytest.mark.parametrize(
    "obstacle",
    [
        Obstacle("sphere", (0.3, -0.2, 0.5), 0.2),
        Obstacle("cylinder", (0.3, -0.2, 0.5), 0.2, (0.6, 0.0, 0.8)),
        Obstacle("cylinder", (5.0, -0.2, 0.5), 3.0, (1.0, 0.0, 0.0), inside=True),
    ],
)
def test_a_drawn_obstacle_is_its_surface_beside_the_strip(obstacle):
    low, high = np.array([-0.1, -0.3, 0.0]), np.array([0.1, 0.0, 1.0])
    grid = round_grid(obstacle, low, high).reshape(-1, 3)
    assert np.abs(obstacle.gaps(grid)).max() < 1e-12
    if obstacle.axis is not None:
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        along, drawn = corners @ obstacle.axis, grid @ obstacle.axis
        assert drawn.min() <= along.min() + 1e-12
        assert drawn.max() >= along.max() - 1e-12
