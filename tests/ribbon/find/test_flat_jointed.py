"""A flat strip on segments that end where it touches itself."""

import numpy as np
import pytest

from ribbon.find.jointed.flat import GRADED, graded
from tests.validation.ribbon.ribbon_loop import ROD, finer, over_meshes, touches


def test_segments_halve_towards_a_place():
    s = graded(np.linspace(0.0, 1.0, 11), ((0.3, 0.8),))
    assert s.size == 11 + 4 * GRADED
    assert (np.diff(s) > 0.0).all()
    for place in (0.3, 0.8):
        k = int(np.argmin(np.abs(s - place)))
        assert s[k] == pytest.approx(place, abs=1e-15)
        assert np.diff(s)[k - 1 : k + 1] == pytest.approx(0.1 * 0.5**GRADED, rel=1e-9)


@pytest.mark.validate
def test_angles_and_forces_of_a_loop_settle_on_segments_that_end_where_it_touches():
    """Not on equal ones, where they change by 2e-3 degrees and 5e-4 D w / l^2 to and fro."""
    strands, normals, on, push, tension, *_ = over_meshes(ROD)
    assert max(strands.error, on.error, push.error, tension.error) < 2e-4
    assert normals.error < 5e-4
    found = finer(ROD, 2)
    assert found is not None
    joints = np.concatenate([[0.0], np.cumsum(found.state.problem.lengths)])
    (one,) = touches(found.state, ROD)
    assert np.abs(joints[:, None] - [one.s, one.other]).min(axis=0).max() < 1e-6
