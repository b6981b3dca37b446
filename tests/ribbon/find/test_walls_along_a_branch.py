"""Places of contact that slide along a branch: a Moebius band on a table, and what a rigid band says of it."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon.find.branch.equations import Equations
from tests.validation.ribbon import moebius_saddle as page

#: Few segments: a branch in a second or two.
SEGMENTS = 25


def test_the_standing_band_is_lost_in_a_pitchfork_of_its_half_turn():
    standing = page.standing(SEGMENTS)
    lost = page.pitchfork(SEGMENTS)
    assert standing.run.ended == "range"
    assert lost.change == 1
    assert abs(lost.values[0]) < 1e-8
    (one, edge, share), (other, far_edge, _) = page.places(standing.run.points[-1])
    assert one == pytest.approx(0.5, abs=1e-9)
    assert other == pytest.approx(0.5, abs=1e-9)
    assert edge == -far_edge
    assert share == pytest.approx(0.5, abs=1e-9)


def test_the_branch_that_leaves_is_the_saddle_and_its_light_end_is_a_rigid_balance():
    branch = page.saddle(SEGMENTS)
    point = branch.run.points[-1]
    assert point.unstable == 1
    ((_, _, share),) = page.places(point)
    assert share == pytest.approx(1.0, abs=1e-9)
    for name, height in page.rigid(SEGMENTS).items():
        assert page.light(SEGMENTS, name) == pytest.approx(height, abs=3e-5)


def test_places_stay_inside_their_segments_and_nothing_is_behind_the_table():
    """A place that has gone over a joint is the next segment's: its slope there says so."""
    points = page.saddle(SEGMENTS).run.points + page.fallen(SEGMENTS).run.points
    assert any("slides" in special.what for special in page.fallen(SEGMENTS).run.specials)
    for point in points:
        system = point.system
        assert isinstance(system, Equations)
        problem = system.problem(point.t)
        x, rows = system.whole(point.z, point.t)
        block, where = problem.touch_rows(0), problem.block_slices()["touch_0"]
        on = np.flatnonzero(rows[where] != 0.0)
        slope = problem.joints(x)[1][:, :, 2] @ np.asarray(problem.walls[0].normal)
        before, behind = slope[block.segments[on]], slope[block.segments[on] + 1]
        assert np.all(before <= 2e-7)
        assert np.all(behind >= -2e-7)
        assert problem.constraints(x)[where].min() > -1e-7


def test_contacts_are_carried_to_elements_half_as_long():
    point = page.three(SEGMENTS)["fallen"][0]
    finer, z, _ = point.system.finer(point.z, point.t, point.tangent[0][:, None])
    assert isinstance(finer, Equations)
    problem = finer.problem(point.t)
    x, rows = finer.whole(z, point.t)
    where, block = problem.block_slices()["touch_0"], problem.touch_rows(0)
    on = np.flatnonzero(finer.active[where])
    s = np.concatenate([[0.0], np.cumsum(problem.lengths)])[block.segments[on]] + block.places(x)[on]
    before = page.places(point)
    assert sorted(s) == pytest.approx(sorted(place for place, *_ in before), abs=2.0 / SEGMENTS)
    assert -rows[where].sum() == pytest.approx(page.GAMMA, rel=1e-9)
