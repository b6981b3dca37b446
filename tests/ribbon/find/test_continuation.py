"""Ways of problems, and segments placed by a tolerance."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Closure, Gravity, RibbonInputError, Status, Strip, Wall, follow, refine, solve, switch
from ribbon.find.adaptive import cut, distance, solve_to_tolerance
from ribbon.find.solve import build, solve_from
from ribbon.find.tubes import swept
from ribbon.obstacle import Obstacle
from ribbon.solid import Solid

STRIP = Strip(1.0, 0.05, 0.5, gamma=5.0)
UP = Gravity((0, 1, 0))


def arch(height: float, segments: int = 12):
    """Two clamps, the end lifted."""
    return build(STRIP, Clamp(ruling="free"), UP, end=Clamp((0.0, height, 0.8), ruling="free"), segments=segments)


@pytest.fixture(scope="module")
def low():
    return solve(
        STRIP,
        Clamp(ruling="free"),
        UP,
        end=Clamp((0.0, 0.0, 0.8), ruling="free"),
        segments=12,
        seed_curvature=(-3, 3, 3, -3),
    )


def test_a_way_ends_where_a_direct_solve_does_and_logs_every_step(low):
    seen = []
    end = follow(lambda t: arch(0.2 * t), low, on_step=lambda record, e: seen.append((record.t, e.ok)))
    assert end.ok
    assert end.log[-1]["t"] == 1.0
    assert [t for t, _ in seen] == [step["t"] for step in end.log if step["accepted"]]
    direct = switch(arch(0.2), end)
    assert direct.energy.total == pytest.approx(end.energy.total, rel=1e-10)
    assert end.end.position == pytest.approx([0, 0.2, 0.8], abs=1e-10)


def test_warm_steps_are_cheap(low):
    end = follow(lambda t: arch(0.1 * t), low, steps=5)
    assert [step["t"] for step in end.log] == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
    assert max(step["iterations"] for step in end.log[1:]) <= 12


def test_forces_along_a_way_integrate_to_the_energy(low):
    found = []
    end = follow(lambda t: arch(0.2 * t), low, steps=20, on_step=lambda record, e: found.append(e))
    heights = np.linspace(0.0, 0.2, 21)
    forces = np.array([low.end_support.force[1], *(e.end_support.force[1] for e in found)])
    simpson = np.array([1.0, *([4.0, 2.0] * 9), 4.0, 1.0]) @ forces * (heights[1] - heights[0]) / 3.0
    assert simpson == pytest.approx(end.energy.total - low.energy.total, rel=1e-5)


def test_a_way_that_cannot_be_gone_keeps_the_last_good_state(low):
    def beyond(t):
        return build(STRIP, Clamp(ruling="free"), UP, end=Clamp((0.0, 0.0, 0.8), ruling="free"), segments=12, walls=(
            Wall((0, -0.5 + 2.0 * t, 0.4), (0, 1, 0)), Wall((0, 0.5 - 0.0 * t, 0.4), (0, -1, 0)),
        ))  # fmt: skip

    start = switch(beyond(0.0), low)
    assert start.ok
    stopped = follow(beyond, start, smallest=0.1)
    assert stopped.status not in (Status.CONVERGED, Status.SADDLE)
    assert "the way stopped at t = " in stopped.message
    assert stopped.stable is None
    assert any(not step["accepted"] for step in stopped.log)


def test_a_step_that_cannot_be_cut_has_the_time_of_a_first_solve(low, monkeypatch):
    # the corrector gives up at once, as before a snap that no shorter step brings nearer
    monkeypatch.setattr("ribbon.find.continuation.MOST", 1)
    end = follow(lambda t: arch(0.2 * t), low, steps=2, smallest=0.3)
    assert end.status is Status.CONVERGED
    assert [step["t"] for step in end.log if step["accepted"]] == [0.5, 1.0]
    assert end.energy.total == pytest.approx(switch(arch(0.2), low).energy.total, rel=1e-10)


def test_a_straight_strip_buckles_when_its_ends_approach():
    straight = solve(STRIP, Clamp(ruling="free"), UP, end=Clamp((0, 0, 1.0), ruling="free"), segments=12)
    end = follow(
        lambda t: build(STRIP, Clamp(ruling="free"), UP, end=Clamp((0, 0, 1.0 - 0.2 * t), ruling="free"), segments=12),
        straight,
    )
    assert end.ok
    assert abs(end.middle.position[1]) > 0.1


def test_a_shape_goes_over_to_other_segments_and_formulations(low):
    fine = switch(arch(0.0, 48), low)
    assert fine.ok
    assert distance(low, fine) < 5e-3
    curl = Strip(1.0, 0.03, 0.4, natural_curvature=10.0, gamma=20.0)
    chained = solve(curl, Clamp(ruling="free"), UP, segments=12)
    mixed = switch(build(curl, Clamp(ruling="free"), UP, segments=12, formulation="mixed"), chained)
    assert mixed.ok
    assert mixed.energy.total == pytest.approx(chained.energy.total, rel=1e-10)


@pytest.mark.parametrize("tolerance", [3e-3, 1e-4])
def test_a_tolerance_is_kept_on_a_curl(tolerance):
    strip = Strip(1.0, 0.03, 0.4, natural_curvature=10.0, gamma=100.0)
    clamp = Clamp((0, 0, 0), (0, 0, 1), (-(2.0**-0.5), 2.0**-0.5, 0), "straight")
    equilibrium = solve_to_tolerance(strip, clamp, Gravity((1, 0, 0)), tolerance=tolerance)
    assert equilibrium.ok
    assert equilibrium.tolerance_error <= tolerance
    finer = refine(equilibrium, 4)
    assert distance(equilibrium, finer) <= tolerance
    lengths = equilibrium.problem.lengths
    assert lengths[0] < lengths.max()  # the straight ruling turns near the clamp


def test_a_wunderlich_event_is_resolved_without_segments_placed_by_hand():
    strip = Strip(1.0, 0.03, 0.5)
    equilibrium = solve_to_tolerance(strip, closure=Closure("moebius"), tolerance=2e-4)
    assert equilibrium.ok
    assert equilibrium.tolerance_error <= 2e-4
    lengths = equilibrium.problem.lengths
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    assert s[int(np.argmin(lengths))] < 0.03 or s[int(np.argmin(lengths))] > 0.96  # the event sits at the seam
    assert lengths.min() < 0.2 * 0.03
    uniform = solve(strip, closure=Closure("moebius"), segments=lengths.size)
    reference = solve(strip, closure=Closure("moebius"), segments=1600)
    errors = [abs(e.energy.total - reference.energy.total) for e in (equilibrium, uniform)]
    assert errors[0] < 0.2 * errors[1]


def test_segments_with_most_error_are_cut():
    lengths = cut(np.full(4, 0.25), np.array([1.0, 1e-3, 1e-3, 1e-3]))
    assert lengths == pytest.approx([0.125, 0.125, 0.25, 0.25, 0.25])
    assert cut(np.full(2, 0.5), np.array([100.0, 40.0])).sum() == pytest.approx(1.0)


def test_bad_tolerances():
    with pytest.raises(RibbonInputError, match="tolerance"):
        solve_to_tolerance(STRIP, Clamp(ruling="free"), tolerance=0.5)
    with pytest.raises(RibbonInputError, match="not both"):
        solve_to_tolerance(STRIP, Clamp(ruling="free"), tolerance=1e-3, segments=10)


def test_a_bar_that_is_lifted_takes_the_strip_along():
    """A strip lies over a bar; lifted by a fifth of the strip's length the bar bears it, however long the first steps
    would be. A step as long as the bar is thick left the strip hanging below it, as if it had gone through."""
    strip, bar = Strip(1.0, 0.05, 0.3, gamma=6.0), ((0.0, -0.1, 0.5), 0.05, (1.0, 0.0, 0.0))

    def over(t: float):
        moved = Obstacle("cylinder", (0.0, -0.1 + 0.2 * t, 0.5), bar[1], bar[2])
        return build(strip, Clamp(), UP, walls=(moved,), segments=15)

    start = solve(strip, Clamp(), UP, walls=(Obstacle("cylinder", *bar),), segments=15)
    end = follow(over, start)
    assert end.ok
    assert not end.log[0]["accepted"]
    assert end.energy.total > start.energy.total + 1.0
    assert end.walls[0].force[1] > 3.0
    assert end.penetration < 1e-6


def test_a_lever_that_turns_takes_the_strip_along():
    """A thin box below the strip turns about its middle and lifts it; in one step it would have gone through."""

    def over(t: float):
        a = 1.25 * t - 0.25
        axis, normal = (0.0, np.sin(a), np.cos(a)), (0.0, np.cos(a), -np.sin(a))
        lever = Solid("box", (0.0, -0.12, 0.75), 0.004, axis, normal=normal, size=(0.5, 0.03, 0.4))
        return build(Strip(1.0, 0.05, 0.3, gamma=6.0), Clamp(), UP, walls=(lever,), segments=15)

    first = over(0.0)
    start = solve_from(first, first.state(np.zeros(16), np.zeros(16)))
    end = follow(over, start, first=1.0)
    assert start.ok
    assert end.ok
    assert not end.log[0]["accepted"]
    assert end.energy.total > start.energy.total + 0.3
    assert end.walls[0].force[1] > 1.0
    assert end.penetration < 1e-6


def test_where_a_body_is_seen_from_when_it_turns():
    """What is fixed to it keeps its gap; a cylinder's axis is a line, and turns by the shortest way."""
    rng = np.random.default_rng(3)
    points = rng.normal(size=(20, 3))
    one, two = rng.normal(size=(2, 3))
    for sign in (1.0, -1.0):
        before = Obstacle("cylinder", (0.0, 0.0, 0.0), 0.3, tuple(one / np.linalg.norm(one)))
        after = Obstacle("cylinder", (0.1, 0.2, 0.3), 0.3, tuple(sign * two / np.linalg.norm(two)))
        turn = swept.turned(before, after)
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-14)
        assert np.arccos(0.5 * (np.trace(turn) - 1.0)) <= 0.5 * np.pi
        np.testing.assert_allclose(
            after.gaps(points @ turn.T + np.asarray(after.point)), before.gaps(points), atol=1e-14
        )
    frames = (((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), ((0.0, -0.6, 0.8), (-1.0, 0.0, 0.0)))
    boxes = [Solid("box", (0.0, 0.0, 0.0), 0.01, axis, normal=n, size=(0.2, 0.5, 0.9)) for axis, n in frames]
    np.testing.assert_allclose(boxes[1].gaps(points @ swept.turned(*boxes).T), boxes[0].gaps(points), atol=1e-14)
