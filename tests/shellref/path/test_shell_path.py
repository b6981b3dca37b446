"""Prescribed paths of clamps, natural curvature and weight; what stops a path, and what is kept then."""

from dataclasses import replace

import numpy as np
import pytest

from shellref import Pose, ShellInputError, ShellOptions, ShellProblem, ShellStatus, Waypoint
from shellref.shell.body import Control
from shellref.shell.clamps import rotation
from shellref.shell.problem import IDENTITY
from shellref.shell.strip import build_strip

FLAT = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # t_x = e_y, t_y = e_z, t_z = e_x


def matrix(rows) -> tuple:
    return tuple(map(tuple, np.asarray(rows).tolist()))


HOME = Pose((0.0, 0.0, 0.0), IDENTITY)
AWAY = Pose((0.2, 0.1, -0.3), matrix(rotation(np.array([0.9, 0.4, 0.0]))))
CANTILEVER = ShellProblem(
    width=0.05,
    thickness=5e-4,
    poisson=0.3,
    natural_curvature=(3.0, 3.0),
    gamma=5.0,
    up=(0.0, 1.0, 0.0),
    elements=(20, 2),
)
BRIDGE = replace(
    CANTILEVER,
    natural_curvature=(0.0, 0.0),
    gamma=0.0,
    up=None,
    start_curvature=-2.5,
    end=Pose((0.5, 0.01, 0.0), FLAT),
    path=(Waypoint(natural=1.0, name="release"),),
    clamp_frame=FLAT,
)


def stages(problem, options=None) -> list[tuple[str, Control, Control]]:
    return [(stage.name, stage.start, stage.end) for stage in build_strip(problem, options or ShellOptions()).stages]


def test_stages_of_a_strip_without_a_path():
    assert stages(CANTILEVER) == [("gravity", Control(1, 0, 0, 0), Control(1, 1, 0, 0))]
    assert stages(CANTILEVER, ShellOptions(natural_path="stepped")) == [
        ("natural", Control(0, 0, 0, 0), Control(1, 0, 0, 0)),
        ("gravity", Control(1, 0, 0, 0), Control(1, 1, 0, 0)),
    ]
    assert stages(replace(CANTILEVER, gamma=0.0, up=None)) == []


def test_stages_follow_the_waypoints_and_end_at_the_problem_itself():
    path = (
        Waypoint(start=AWAY, name="begin"),
        Waypoint(natural=0.5, gravity=0.2, name="load"),
        Waypoint(start=HOME, gravity=0.6, name="home"),
    )
    built = build_strip(replace(CANTILEVER, start_curvature=1.0, path=path), ShellOptions())
    assert [(s.name, s.start, s.end) for s in built.stages] == [
        ("load", Control(0, 0, 0, 0), Control(0.5, 0.2, 0, 0)),
        ("home", Control(0.5, 0.2, 0, 0), Control(0.5, 0.6, 0, 1)),
        ("natural", Control(0.5, 0.6, 0, 1), Control(1, 0.6, 0, 1)),
        ("gravity", Control(1, 0.6, 0, 1), Control(1, 1, 0, 1)),
    ]
    assert built.start.poses == (AWAY, HOME)  # a path that moves the clamp begins where it is first said to be
    assert built.stages[1].at(0.25) == Control(0.5, 0.3, 0, 0.25)
    assert built.stages[1].rate() == pytest.approx(Control(0.0, 0.4, 0.0, 1.0))


def test_zero_thickness_is_an_input_error():
    with pytest.raises(ShellInputError) as caught:
        replace(CANTILEVER, thickness=0.0)
    assert caught.value.key == "thickness"
    assert "thickness" in str(caught.value)


pytest.importorskip("dolfinx")
from shellref.path.solve import solve  # noqa: E402

shell = pytest.mark.shell


@pytest.fixture(scope="module")
def bridge():
    return solve(BRIDGE)


@shell
def test_a_clamp_moved_away_and_back_leaves_the_same_state():
    path = (
        Waypoint(start=HOME, name="begin"),
        Waypoint(gravity=1.0, name="load"),
        Waypoint(start=AWAY, name="away"),
        Waypoint(start=HOME, name="back"),
    )
    still, moved = solve(CANTILEVER), solve(replace(CANTILEVER, path=path))
    assert still.status is moved.status is ShellStatus.CONVERGED
    assert [step.stage for step in moved.steps if step.load == 1.0] == ["load", "away", "back"]
    np.testing.assert_allclose(moved.surface.points, still.surface.points, atol=1e-9)
    np.testing.assert_allclose(moved.clamp_moment, still.clamp_moment, atol=1e-6)
    away = next(step for step in moved.steps if step.stage == "away" and step.load == 1.0)
    assert np.linalg.norm(np.subtract(away.values["end"], still.section(1.0)["position"])) > 0.3
    turned = solve(replace(CANTILEVER, clamp_position=AWAY.position, clamp_frame=AWAY.frame))
    np.testing.assert_allclose(away.values["end"], turned.section(1.0)["position"], atol=1e-7)


@shell
def test_an_end_clamp_moved_away_and_back_leaves_the_same_state(bridge):
    away = Pose((0.6, -0.05, 0.1), matrix(rotation(np.array([0.0, 0.3, 0.2])) @ np.array(FLAT)))
    path = (*BRIDGE.path, Waypoint(end=BRIDGE.end, name="there"), Waypoint(end=away, name="away"))
    moved = solve(replace(BRIDGE, path=path))
    assert moved.status is ShellStatus.CONVERGED
    assert [step.stage for step in moved.steps if step.load == 1.0] == ["release", "there", "away", "clamps"]
    np.testing.assert_allclose(moved.surface.points, bridge.surface.points, atol=1e-9)
    assert moved.energy["total"] == pytest.approx(bridge.energy["total"], rel=1e-9)


@shell
@pytest.mark.parametrize("ratio", [1e2, 1e4])
def test_a_moving_clamp_does_not_stretch_a_thin_strip(ratio):
    """The strip follows its clamp within the first linear solve, so steps do not grow harder as h / w falls."""
    problem = replace(BRIDGE, thickness=0.05 / ratio, elements=(20, 1), end=Pose((0.5, 0.0, 0.0), FLAT))
    result = solve(problem)
    assert result.status is ShellStatus.CONVERGED
    assert all(step.accepted for step in result.steps)
    assert max(step.iterations for step in result.steps) <= 7
    assert result.share["membrane"] < 2e-3
    assert result.energy["elastic"] == pytest.approx(20.3, rel=0.1)


@shell
def test_a_path_longer_than_the_strip_is_stretched_and_keeps_the_last_good_step():
    result = solve(replace(BRIDGE, end=Pose((1.2, 0.0, 0.0), FLAT)))
    assert result.status is ShellStatus.STRETCHED
    assert result.stable is None
    assert "stretched" in result.message
    assert "max_strain" in result.message
    last = [step for step in result.steps if step.accepted][-1]
    assert (last.stage, last.load < 1.0) == ("clamps", True)
    assert f"{last.load:.6g}" in result.message
    assert not result.steps[-1].accepted
    assert "strain" in result.steps[-1].note
    assert result.path_factor == pytest.approx(0.5 * (1 + last.load))
    # what is kept is the equilibrium of that step: both clamps where the path has brought them, in balance
    np.testing.assert_allclose(result.section(1.0)["position"], last.values["end"], atol=1e-12)
    gap = np.linalg.norm(result.section(1.0)["position"])
    assert 0.95 < gap < 1.05
    np.testing.assert_allclose(
        result.clamps["start"]["force"] + result.clamps["end"]["force"],
        0.0,
        atol=1e-8 * np.linalg.norm(result.clamp_force),
    )


@shell
@pytest.mark.parametrize("poisson", [0.3, 0.5])
def test_one_element_along_or_across_is_solved(poisson):
    """A cantilever can be done with one element, roughly; poisson = 1/2 is nothing special in plane stress."""
    light = replace(CANTILEVER, natural_curvature=(0.0, 0.0), gamma=2.0, poisson=poisson)
    tip = solve(light).section(1.0)["position"][1]
    assert -0.32 < tip < -0.25
    for elements in ((1, 1), (1, 4), (20, 1)):
        result = solve(replace(light, elements=elements))
        assert (result.status, result.stable) == (ShellStatus.CONVERGED, True)
        assert result.elements == elements
        assert result.section(1.0)["position"][1] == pytest.approx(tip, rel=0.12)
        np.testing.assert_allclose(result.clamp_force, [0.0, 2.0, 0.0], atol=1e-6)


@shell
@pytest.mark.parametrize("elements", [(1, 1), (1, 4)])
def test_a_shape_one_element_cannot_take_has_a_status_that_names_the_mesh(elements):
    result = solve(replace(BRIDGE, elements=elements, start_curvature=-6.0))
    assert result.status in (ShellStatus.NOT_CONVERGED, ShellStatus.STRETCHED, ShellStatus.INVALID)
    assert "elements" in result.message or "mesh" in result.message
    assert np.all(np.isfinite(result.surface.points))
    result.to_dict()


@shell
def test_a_start_near_the_solution_is_settled_at_once(bridge):
    again = solve(BRIDGE, start=bridge.surface)
    assert again.status is ShellStatus.CONVERGED
    assert len(again.steps) == 1
    np.testing.assert_allclose(again.surface.points, bridge.surface.points, atol=1e-9)
    bad = replace(bridge.surface, points=bridge.surface.points * np.array([1.0, 1.0, 30.0]))
    lost = solve(BRIDGE, start=bad)
    assert lost.status in (ShellStatus.NOT_CONVERGED, ShellStatus.STRETCHED)
    assert lost.stable is None
    lost.to_dict()


def test_arc_length_passes_the_corners_of_a_clamps_path():
    """At the end of a leg the clamp turns elsewhere: arc length must end one leg and begin the next on its own line."""
    corner = replace(
        BRIDGE,
        end=Pose((0.5, 0.12, 0.0), FLAT),
        path=(
            Waypoint(natural=1.0, name="release"),
            Waypoint(end=Pose((0.6, 0.01, 0.0), FLAT), name="close"),
            Waypoint(end=Pose((0.5, 0.01, 0.05), FLAT), name="aside"),
        ),
    )
    by_load = solve(corner, ShellOptions(arc_length="never"))
    by_arc = solve(corner, ShellOptions(arc_length="always", max_arc=0.1))
    assert by_load.status is by_arc.status is ShellStatus.CONVERGED
    np.testing.assert_allclose(by_arc.surface.points, by_load.surface.points, atol=1e-7)
    failed = [step for step in by_arc.steps if not step.accepted]
    assert len(failed) <= 3
    assert len(by_arc.steps) < 4 * len(by_load.steps)
