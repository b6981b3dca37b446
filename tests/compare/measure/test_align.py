"""What nothing resists is no distance: rigid motions, the sliding of a band along itself, its mirror image."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compare.measure.align import Motions, aligned, alignment, both, even_along, slid

FREE = Motions(np.eye(3), np.eye(3), None, -1, True)


def band(s, v, hand=1):
    """A smooth band of half a turn, of any s: three lobes, and narrower places that tell where it begins."""
    turn, angle = 2.0 * np.pi * s[:, None], hand * np.pi * s[:, None]
    out = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=-1)
    across = np.cos(angle)[..., None] * np.array([0.0, 0.0, 1.0]) + np.sin(angle)[..., None] * out
    radius = 1.0 + 0.1 * np.cos(3.0 * turn) + 0.05 * np.sin(turn)
    return (radius[..., None] * out + v[None, :, None] * across) / 7.0


S, V = np.linspace(0.0, 1.0, 401), np.linspace(-0.3, 0.3, 5)
TURN = Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix()
AWAY = np.array([1.0, -2.0, 0.5])


@pytest.mark.parametrize("slide", [0.0, 0.1234, -0.31, 0.77, 1.0, -0.6])
def test_a_slid_and_moved_band_is_laid_on_itself(slide):
    """As far as linear interpolation between rows tells (kappa^2 ds^2 / 8)."""
    reference = band(S, V) @ TURN.T + AWAY
    points = band(S - slide, V)
    found = alignment(points, reference, FREE)
    assert (found.slide - slide + 1.0) % 2.0 - 1.0 == pytest.approx(0.0, abs=2e-5)
    assert not found.mirrored
    np.testing.assert_allclose(found.turn, TURN, atol=1e-4)
    assert np.abs(found.particles(points) - reference).max() < 3e-5
    assert np.abs(aligned(points, reference, FREE) - (points @ TURN.T + AWAY)).max() < 3e-5
    rigid = alignment(points, reference, Motions(np.eye(3), np.eye(3)))
    assert slide == 0.0 or np.abs(rigid.particles(points) - reference).max() > 0.02


def test_rows_behind_the_seam():
    np.testing.assert_allclose(slid(band(S, V), 0.25, -1), band(S + 0.25, V), atol=1e-12)
    np.testing.assert_allclose(slid(band(S, V), -1.5, -1), band(S - 1.5, V), atol=1e-12)


def test_the_other_hand_only_where_a_mirror_image_is_a_state():
    reference = band(S, V) @ TURN.T
    points = band(S, V, -1) * np.array([1.0, -1.0, 1.0])  # the mirror image
    found = alignment(points * np.array([1.0, 1.0, -1.0]), reference, FREE)
    assert found.mirrored
    one_hand = Motions(np.eye(3), np.eye(3), None, -1)
    assert not alignment(points * np.array([1.0, 1.0, -1.0]), reference, one_hand).mirrored
    assert not alignment(band(S, V), reference, FREE).mirrored


def test_nothing_is_moved_that_is_held():
    points = band(S, V)
    for motions in (None, Motions(np.zeros((0, 3)), np.zeros((0, 3)))):
        found = alignment(points + 0.1, points, motions)
        assert not found.free
        np.testing.assert_array_equal(found.particles(points), points)
        np.testing.assert_array_equal(aligned(points + 0.1, points, motions), points + 0.1)
    unknown = points.copy()
    unknown[3, 2] = np.nan
    assert not alignment(unknown, points, FREE).free


def test_both_and_even():
    plain = Motions(np.eye(3), np.eye(3))
    assert both(plain, FREE).seam == both(FREE, plain).seam == -1
    assert both(None, FREE) is FREE
    assert both(None, None) is None
    assert even_along((0.0, 0.0), -1)
    assert even_along((2.0, 2.0), 1)
    assert not even_along((2.0, 2.0), -1)
    assert not even_along((1.0, 2.0), 1)
