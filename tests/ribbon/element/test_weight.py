"""A strip's weight by the balance of moments, against jets of frames, chords and chord integrals."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon.element import weight
from ribbon.problems import chained_kernels as kernels
from ribbon.problems.arguments import Loads


def strip(p, curvature, turned, seed):
    """Parameters (p, 4) and lengths (p,) of a random strip, and its loads."""
    rng = np.random.default_rng(seed)
    lengths = rng.uniform(0.5, 1.5, p)
    q = rng.normal(size=(p, 4)) * np.array([curvature * p, curvature, turned * p, turned])
    frame, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    up = rng.normal(size=3)
    loads = Loads(
        gamma=300.0, up=up / np.linalg.norm(up), force=np.zeros(3), pulled=False,
        frame=np.ascontiguousarray(frame * np.sign(np.linalg.det(frame))), limit=6.0,
    )  # fmt: skip
    return q, lengths / lengths.sum(), loads


#: Segments, curvature (1/l), ruling, sub-segments at the least.
STRIPS = [(1, 3.0, 1.0, 1), (9, 10.0, 1.0, 9), (20, 40.0, 1.5, 30), (3, 60.0, 1.0, 30), (30, 0.0, 1.0, 30)]


@pytest.mark.parametrize(("p", "curvature", "turned", "pieces"), STRIPS)
def test_both_ways_to_the_derivatives_are_one(p, curvature, turned, pieces):
    q, lengths, loads = strip(p, curvature, turned, 3 + p)
    assert len(weight.cut(q, lengths, loads.limit)[1]) >= pieces
    local, other = np.zeros((2, p, 15))
    u, v, u2, v2 = np.zeros((4, p, 4, 3))
    kernels.framed_derivatives(False, q, lengths, loads, local, u, v)
    weight.derivatives(q, lengths, loads, other, u2, v2)
    for one, two in ((local, other), (u, u2), (v, v2)):
        assert np.abs(one - two).max() <= 1e-12 * np.abs(one).max()


def test_the_last_segments_keep_their_digits():
    """Weight and arm of what is behind them are 1e-4: each segment's derivatives are compared by their own size."""
    p = 10_000
    q, lengths, loads = strip(p, 5.0, 1.0, 1)
    q[:, 0] = q[:, 2] = 0.0
    last = slice(p - 3, p)
    local, other = np.zeros((2, p, 15))
    u, v, u2, v2 = np.zeros((4, p, 4, 3))
    kernels.framed_derivatives(False, q, lengths, loads, local, u, v)
    weight.derivatives(q, lengths, loads, other, u2, v2)
    for one, two in ((local, other), (v, v2)):
        assert np.all(np.abs(one[last] - two[last]).max(axis=0) <= 1e-9 * np.abs(one[last]).max(axis=0))


def test_the_height_is_that_of_the_walked_strip():
    q, lengths, loads = strip(20, 40.0, 1.5, 5)
    position, moment = np.array([0.3, -0.2, 0.7]), np.empty(3)
    points, frames = np.empty((21, 3)), np.empty((21, 3, 3))
    kernels.walk(False, q, lengths, position, loads.frame, loads.limit, points, frames, moment)
    assert weight.height(q, lengths, loads, position) == pytest.approx(moment @ loads.up, abs=1e-13)


def test_what_would_need_too_many_sub_segments_is_no_number():
    q, lengths, loads = strip(3, 1.0, 1.0, 7)
    q[1, 1] = 1e8
    assert np.isnan(weight.height(q, lengths, loads, np.zeros(3)))
