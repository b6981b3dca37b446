"""A twisted strip whose ends come together: its fold, none of an inextensible one, and where it lies after the snap."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon.judge import nearness
from tests.validation.ribbon import ribbon_plectoneme as page


def work(distance, states) -> float:
    """Of the tension over the distance of the ends, D w / l."""
    force = np.array([state.end_support.force[2] for state in states])
    return float((0.5 * (force[1:] + force[:-1]) * np.diff(distance)).sum())


def test_an_inextensible_strip_bends_into_its_loop_without_a_snap():
    run = page.run_of(page.INEXTENSIBLE[0], page.SOFT, page.NEAR)
    assert run.ended == "range"
    assert run.specials == ()
    assert {point.unstable for point in run.points} == {0}
    last = page.shape(run.points[-1])
    assert page.link(last) == pytest.approx(page.TURNS, abs=1e-3)
    distance = np.array([page.SOFT + (page.NEAR - page.SOFT) * point.t for point in run.points])
    states = [page.shape(point) for point in run.points]
    done = work(distance, states)
    assert states[-1].energy.total - states[0].energy.total == pytest.approx(done, rel=5e-3)


@pytest.mark.validate
def test_a_strip_snaps_before_the_rod_does():
    """Both folds settle to 1e-7 on finer elements; the strip has bent to its loop at more tension."""
    fold = [next(s for s in page.branch(case).specials if s.kind == "fold") for case in (page.ROD, page.FINITE[1])]
    assert [page.distance(one.point) for one in fold] == pytest.approx([0.551503, 0.577765], abs=1e-5)
    rod, strip = (page.numbers_at(one) for one in fold)
    assert strip[1] > 1.2 * rod[1]
    assert [one.change for one in fold] == [1, 1]


@pytest.mark.validate
def test_a_thin_strip_that_snaps_arrives_and_lies_on_itself_edge_on_edge():
    """By steps of an eighth of its thickness it did not arrive."""
    case = page.FINITE[1]
    path = page.carried(case, page.DISTANCES[:1])
    state = path.state
    assert state.ok
    assert len(path.jumps) == 1
    assert page.link(state) == pytest.approx(page.TURNS, abs=1e-3)
    (pair,) = [p for p in state.pairs if np.linalg.norm(p.force) > 1e-3]
    assert (pair.v / case.width, pair.v_other / case.width) == pytest.approx((0.5, -0.5), abs=1e-9)
    assert pair.gap == pytest.approx(case.width / case.slender, abs=1e-8)
    assert min((gap for gap, _ in nearness.minima(state.problem, state.x, 0.0)), default=0.0) > -nearness.TOLERANCE
    assert np.abs(state.start.force + state.end_support.force).max() < 1e-5 * np.linalg.norm(pair.force)
    touching = [(z, one) for z, one in path.film if one.pairs]
    done = work([z for z, _ in touching], [one for _, one in touching])  # without friction all that changes the energy
    assert touching[-1][1].energy.total - touching[0][1].energy.total == pytest.approx(done, rel=2e-3)
