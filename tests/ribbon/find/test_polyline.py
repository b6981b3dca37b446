"""The largest distance of a line's points from another line: against every piece at once, and known ones."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon.judge import polyline


def every_piece(points, line):
    """The same by brute force: each point (k, 3) against each piece of the line (k, 3)."""
    a, d = line[:-1], np.diff(line, axis=0)
    off = points[:, None] - a
    t = np.clip(np.einsum("kmc,mc->km", off, d) / np.maximum(np.einsum("mc,mc->m", d, d), 1e-300), 0.0, 1.0)
    return float(np.linalg.norm(off - t[:, :, None] * d, axis=2).min(axis=1).max())


def curve(random, many):
    """A smooth line of `many` points that may cross itself; its points are not equally spaced."""
    s = np.sort(random.random(many))
    waves = random.standard_normal((4, 3)) / np.arange(1, 5)[:, None]
    return np.sin(2.0 * np.pi * np.outer(s, np.arange(1, 5)) + random.random(4)) @ waves


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("apart", [1e-3, 0.1, 3.0])
def test_as_against_every_piece(seed, apart):
    """Lines that are near each other, and such as have nothing to do with each other."""
    random = np.random.default_rng(seed)
    line = curve(random, 160)
    points = line + apart * curve(random, 160)
    exact = every_piece(points, line)
    assert polyline.farthest(points, line, 0.0) == pytest.approx(exact, rel=1e-12)
    assert polyline.farthest(points, line, 2.0 * exact) == 2.0 * exact


def test_a_line_that_slides_along_itself():
    """Every like is far, no point is but the last, which is beyond the line's end by what it has slid."""
    s = np.linspace(0.0, 1.0, 301)
    line = np.column_stack([np.cos(s), np.sin(s), 0.0 * s])
    ahead = np.column_stack([np.cos(s + 0.3), np.sin(s + 0.3), 0.0 * s])
    assert polyline.farthest(ahead, line, 0.0) == pytest.approx(2.0 * np.sin(0.15), rel=1e-12)


def test_a_line_that_is_a_point_and_one_that_is_not_finite():
    still = np.zeros((5, 3))
    points = np.outer(np.arange(5.0), [0.0, 3.0, 4.0])
    assert polyline.farthest(points, still, 0.0) == pytest.approx(20.0)
    points[2, 1] = np.nan
    assert np.isnan(polyline.farthest(points, still, 0.0))
    assert np.isnan(polyline.farthest(still, points, 0.0))
