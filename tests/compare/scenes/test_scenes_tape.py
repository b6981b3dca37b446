"""The tape springs of Martin et al. 2017, table 2: what the scenes say. Their folds: test_tape_model."""

from __future__ import annotations

import numpy as np
import pytest

from compare.scene.scene import load

NAMES = ("tape_4_1", "tape_4_1_equal", "tape_4_2")


@pytest.mark.parametrize("name", NAMES)
def test_numbers_of_table_2(name):
    scene = load(name)
    assert (scene.width, scene.thickness, scene.strip.poisson) == (0.06, 1.5e-4, 0.3)
    assert 0.5 * scene.width * scene.transverse_curvature == pytest.approx(0.6)  # beta0
    assert scene.units.bending * 1e3 == pytest.approx(64.904, rel=1e-5)  # D, N mm
    assert scene.end_position.tolist()[2] == 1.0
    assert scene.clamp_end.slide == (0.0, 0.0, 1.0)
    assert scene.model.energy == "tape"
    first, _ = scene.stages()
    np.testing.assert_allclose(first.frame, np.diag([1.0, 1.0, 1.0]), atol=1e-15)


def test_the_ends_turn_against_each_other_and_the_senses_differ_by_the_sign():
    opposite, equal = load("tape_4_1"), load("tape_4_1_equal")
    np.testing.assert_allclose(opposite.frame, equal.end_frame, atol=1e-15)
    np.testing.assert_allclose(opposite.end_frame, equal.frame, atol=1e-15)
    turn = np.arctan2(opposite.end_frame[1, 2], opposite.end_frame[2, 2])
    assert turn == pytest.approx(0.5)  # towards t_y, the convex side: k > 0, omega kt < 0


def test_the_cantilever_is_moved_towards_its_convex_face():
    scene = load("tape_4_2")
    assert scene.transverse_curvature > 0.0  # the edges stand away from t_y
    assert scene.end_position.tolist() == [0.0, 0.4, 1.0]
    assert scene.end_frame is None
