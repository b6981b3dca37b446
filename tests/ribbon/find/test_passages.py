"""Elements that stand where the curvature passes zero, and the critical shift that they make one of the strip's own."""

import itertools

import numpy as np
import pytest

from ribbon import Clamp, RibbonInputError, Strip, follow, solve
from ribbon.find.branch.critical import critical
from ribbon.find.branch.passages import Grading, passages, settled
from ribbon.find.solve import build

FIRST = 0.01
GRADING = Grading(0.01, 0.001, 0.1)


def arguments(shift, segments=60):
    held = {"tangent": (1, 0, 0), "normal": (0, 0, 1), "ruling": "straight"}
    return {
        "strip": Strip(1.0, 0.05, 0.3), "clamp": Clamp((0, 0, 0), **held), "end": Clamp((0.5, shift, 0), **held),
        "energy": "wunderlich", "segments": segments,
    }  # fmt: skip


@pytest.fixture(scope="module")
def arch():
    return solve(**arguments(FIRST), seed_curvature=[-8.0, 8.0, -8.0], seed_ruling=[1e-3, -1e-3])


def problem(shift):
    return build(**arguments(shift))


def tilt(found):
    return np.degrees(np.arccos(np.clip(found.middle.frame[2, 1], -1.0, 1.0)))


def test_an_arch_passes_zero_curvature_twice_at_mirror_places(arch):
    at = passages(arch)
    assert at.shape == (2,)
    assert at.sum() == pytest.approx(1.0, abs=1e-6)
    assert abs(float(arch.omega(at)[0])) < 1e-8


@pytest.mark.parametrize("points", [[0.24, 0.76], [0.5], []])
def test_lengths_have_a_joint_at_every_passage_and_grow_from_there(points):
    grading = Grading(0.02, 1e-3, 0.1)
    lengths = grading.lengths(np.array(points))
    joints = np.concatenate([[0.0], np.cumsum(lengths)])
    assert lengths.sum() == pytest.approx(1.0, abs=1e-12)
    assert lengths.min() > 0.5e-3
    assert lengths.max() < 0.021
    for point in points:
        k = int(np.argmin(np.abs(joints - point)))
        assert joints[k] == pytest.approx(point, abs=1e-12)
        assert max(lengths[k - 1], lengths[k]) < 1.2e-3
    assert max(np.max(lengths[1:] / lengths[:-1]), np.max(lengths[:-1] / lengths[1:])) < 1.3
    finer = grading.finer().lengths(np.array(points))
    assert finer.size == pytest.approx(2 * lengths.size, rel=0.05)


@pytest.mark.parametrize(
    ("values", "key"), [((2.0, 1e-3, 0.1), "longest"), ((0.01, 0.1, 0.1), "least"), ((0.01, 1e-3, 0.0), "growth")]
)
def test_a_grading_that_is_none_is_refused(values, key):
    with pytest.raises(RibbonInputError, match=key):
        Grading(*values)


def test_on_a_way_a_joint_goes_with_the_passage(arch):
    grading, seen = Grading(0.02, 0.004, 0.2), []
    end = follow(
        lambda t: problem(FIRST + 0.29 * t), settled(problem(FIRST), arch, grading), steps=4, place=grading,
        on_step=lambda record, found: seen.append(found),
    )  # fmt: skip
    assert end.ok
    assert passages(seen[0])[0] - passages(end)[0] > 2e-3
    for before, found in itertools.pairwise(seen):
        joints = np.cumsum(found.problem.lengths)
        assert np.abs(joints[:, None] - passages(before)).min(axis=0).max() < 1e-9


@pytest.fixture(scope="module")
def sheared(arch):
    """The arch at a shift of 0.34, on elements that stand at its passages."""
    found = arch
    for shift in (0.1, 0.2, 0.3, 0.34):
        found = settled(problem(shift), found, GRADING)
    return found


def test_the_lowest_eigenvalue_of_the_arch_settles_where_joints_stand_at_its_passages(sheared):
    """On equal elements the eigenvalue at 0.34 scatters with the place of the event in its element; here it settles."""
    grading, found, lows = Grading(0.01, 0.002, 0.1), sheared, []
    for times in (1.0, 2.0, 4.0):
        found = settled(problem(0.34), found, grading.finer(times))
        lows.append(found.lowest_eigenvalue)
    first, second = np.diff(lows)
    assert 0.0 < second < 0.5 * first
    assert lows[-1] == pytest.approx(0.0745, abs=1.5e-3)


def test_wunderlichs_arch_is_lost_after_the_shells(sheared):
    """0.337 on 100 equal elements; 0.385 on the strip (results/shift), 0.3515 of the shell at w/h = 50."""
    found = critical(
        lambda shift, near: settled(problem(shift), near, GRADING), sheared, 0.34, 0.4, 0.01, 3e-3,
        lambda state: tilt(state) < 1e-2,
    )  # fmt: skip
    assert found.kind == "crossing"
    assert found.value == pytest.approx(0.3849, abs=2e-3)
    assert found.located < 3e-3
    shifts, lows = np.array(found.states).T
    assert shifts[-1] < 0.4
    assert np.all(np.diff(lows) < 0.0)


def line(slope, stop=np.inf):
    """A branch whose eigenvalue is 1 - slope * t, and which is no more from `stop` on."""

    class State:
        residual = 0.0

        def __init__(self, t):
            self.t, self.lowest_eigenvalue = t, 1.0 - slope * t

    return (lambda t, near: State(t)), State(0.0), (lambda state: state.t < stop)


def test_a_crossing_is_found_to_what_was_asked():
    solve_at, start, on = line(1.0 / 0.37)
    found = critical(solve_at, start, 0.0, 1.0, 0.1, 1e-6, on)
    assert found.kind == "crossing"
    assert found.value == pytest.approx(0.37, abs=1e-6)
    assert found.last.t < 0.37


def test_a_branch_that_ends_with_a_positive_eigenvalue_is_lost_there():
    solve_at, start, on = line(0.5, stop=0.37)
    found = critical(solve_at, start, 0.0, 1.0, 0.1, 1e-5, on)
    assert found.kind == "lost"
    assert abs(found.value - 0.37) <= found.located <= 1e-5


def test_a_branch_that_stays_stable_has_no_critical_parameter():
    solve_at, start, on = line(0.5)
    found = critical(solve_at, start, 0.0, 1.0, 0.3, 1e-5, on)
    assert found.value is None
    assert found.kind == "stable"
