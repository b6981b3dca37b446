"""A series ends whatever it is asked for: what turns too often, or is no number, is nan, at the price of one piece."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon.element import body_series, free_series, free_values, series

#: Curvatures times the length, from what is asked for in earnest to nonsense.
TURNS = [1e7, 1e10, 1e200, 1e308, np.inf, np.nan]


def values(kind: str, curvature: float, slope: float = 0.0) -> tuple[int, np.ndarray]:
    """Pieces, and everything that a kernel gives of a segment of length 1."""
    q = np.array([slope, curvature, 0.1, 0.2])
    free = np.concatenate([q, [0.3, curvature]])
    frame, chord, integral = np.empty((3, 3)), np.empty(3), np.empty(3)
    one = np.ones(1)
    if kind == "values":
        count = series.segment_values(*q, 1.0, series.EXPONENT_LIMIT, frame, chord, integral)
        return count, np.concatenate([frame.ravel(), chord, integral])
    if kind == "jets":
        jets = np.empty((1, 15, 15))
        return series.walk(q[None], one, series.EXPONENT_LIMIT, jets), jets
    if kind == "body":
        out = np.empty(13)
        return body_series.body_values(*q, 1.0, series.EXPONENT_LIMIT, 2, out), out
    if kind == "free values":
        count = free_values.segment_values(free, 1.0, series.EXPONENT_LIMIT, frame, chord, integral)
        return count, np.concatenate([frame.ravel(), chord, integral])
    jets = np.empty((1, 15, 28))
    return free_series.walk(free[None], one, series.EXPONENT_LIMIT, jets), jets


KINDS = ["values", "jets", "body", "free values", "free jets"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("turn", TURNS)
def test_beyond_all_bounds_there_is_no_number(kind, turn):
    for curvature, slope in ((turn, 0.0), (0.0, turn), (-turn, 0.0)):
        count, found = values(kind, curvature, slope)
        assert count <= 4
        assert np.isnan(found).any()


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_strip_may_have_is_computed(kind):
    """Ten times the largest natural curvature of a scene, as trial points reach it."""
    count, found = values(kind, series.FURTHEST)
    assert 1e4 < count <= series.MOST_PIECES
    assert np.isfinite(found).all()


def test_a_whole_strip_beyond_is_too_far():
    """The bound is of all segments together: many that turn often cost as much as one."""
    from ribbon.problems.chained import too_far

    lengths = np.full(100, 0.01)
    q = np.zeros((100, 4))
    q[:, 1] = 0.9 * series.FURTHEST
    assert not too_far(q, lengths)
    q[:, 1] = 1.1 * series.FURTHEST
    assert too_far(q, lengths)
    q[7, 1] = np.nan
    assert too_far(q, lengths)
