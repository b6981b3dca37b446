"""Contact of a strip with itself that would happen."""

from __future__ import annotations

import numpy as np
import pytest

from compare.measure.nearness import nearest

S = np.linspace(0.0, 1.0, 161)
V = np.array([-0.02, 0.0, 0.02])


def strip(line, across):
    return line[:, None] + V[:, None] * np.broadcast_to(across, line.shape)[:, None]


def circle(turns, pitch=0.0):
    """A helix of length 1 about z, sections along z."""
    angle = 2.0 * np.pi * turns * S
    radius = 1.0 / (2.0 * np.pi * turns)
    line = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), pitch * turns * S])
    return strip(line, [0.0, 0.0, 1.0])


def test_a_straight_strip_is_near_nothing():
    assert nearest(strip(np.column_stack([S, 0.0 * S, 0.0 * S]), [0.0, 1.0, 0.0]), S) is None


def test_turns_of_a_helix_are_a_pitch_less_a_width_apart():
    found = nearest(circle(2.0, 0.1), S)
    assert found is not None
    assert not found.crosses
    assert found.gap == pytest.approx(0.1 - 0.04, rel=0.05)
    assert found.s[1] - found.s[0] == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("lift", [0.0, 0.015])
def test_a_loop_runs_through_itself_or_passes_over(lift):
    """A figure of one loop in a plane, sections square to it: both its ends cross, unless one is lifted."""
    angle = 1.5 * np.pi * (2.0 * S - 1.0)
    t = 2.0 * S - 1.0
    line = np.column_stack([0.2 * np.sin(angle), 0.3 * t**2, np.where(S > 0.5, 5.0 * lift, 0.0) * np.abs(t)])
    found = nearest(strip(line, [0.0, 0.0, 1.0]), S)
    assert found is not None
    assert found.crosses is (lift == 0.0)
    if lift:
        assert found.gap > 0.0


def test_a_closed_band_does_not_meet_itself_at_its_seam():
    assert nearest(circle(1.0), S, closed=True) is None
    assert nearest(circle(1.0), S).gap == pytest.approx(0.0, abs=1e-9)
