"""Bifurcations: noticed by the inertia, located by bisection, left along the critical mode or by a kick."""

from dataclasses import replace

import numpy as np
import pytest

from shellref import Pose, ShellOptions, ShellProblem, ShellStatus, Waypoint

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.path.solve import solve  # noqa: E402

MIRROR = np.array([1.0, -1.0, 1.0])  # the strip on edge is symmetric about y = 0
ON_EDGE = ShellProblem(
    width=0.05, thickness=2.5e-3, poisson=0.35, gamma=21.7, up=(1.0, 0.0, 0.0), elements=(16, 2), grading=(0.3, 1.0)
)
STAY = ShellOptions(kick=False)


@pytest.fixture(scope="module")
def switched():
    return solve(ON_EDGE, ShellOptions(switch=True))


@pytest.fixture(scope="module")
def kicked():
    return solve(ON_EDGE)


def steps(result, method):
    return [step for step in result.steps if step.method == method]


def test_switching_and_kicking_end_at_the_same_state_or_its_mirror_image(switched, kicked):
    assert switched.status is kicked.status is ShellStatus.CONVERGED
    assert switched.stable is kicked.stable is True
    assert switched.energy["total"] == pytest.approx(kicked.energy["total"], abs=1e-9)
    one, other = switched.surface.points, kicked.surface.points
    image = one * MIRROR
    assert min(np.max(np.abs(one - other)), np.max(np.abs(image - other))) < 1e-8
    assert abs(other[-1, 2, 1]) > 0.2  # well out of the plane
    flat = solve(ON_EDGE, STAY)
    assert (flat.status, flat.negative_eigenvalues) == (ShellStatus.UNSTABLE, 1)
    assert switched.energy["total"] < flat.energy["total"] - 0.1


def test_the_log_tells_what_happened(switched, kicked):
    located, (branch,) = steps(switched, "locate"), steps(switched, "switch")
    assert all(step.note == "bifurcation" for step in located)
    assert {step.negative for step in located} == {0, 1}
    assert branch.accepted
    assert "branch of the bifurcation at" in branch.note
    along = steps(switched, "arc")
    assert all(step.negative == 0 for step in along)
    loads = [step.load for step in along]
    assert loads == sorted(loads)
    assert loads[-1] == 1.0
    (kick,) = steps(kicked, "relax")
    assert "unstable" in kick.note
    assert "1 unstable" in switched.message
    assert "1 unstable" in kicked.message
    assert not steps(kicked, "switch")


def test_the_bifurcation_is_bracketed_to_the_tolerance(switched):
    """Below the bracket the flat state is stable, above it is not; half the tolerance halves the bracket."""
    located = steps(switched, "locate")
    below = max(step.load for step in located if step.negative == 0)
    above = min(step.load for step in located if step.negative == 1)
    assert 0 < above - below <= 1e-3
    for load, negative in ((below - 2e-3, 0), (above + 2e-3, 1)):
        assert solve(replace(ON_EDGE, gamma=load * ON_EDGE.gamma), STAY).negative_eigenvalues == negative
    finer = solve(ON_EDGE, ShellOptions(switch=True, event_tolerance=1e-4))
    critical = float(steps(finer, "switch")[0].note.split("at ")[1].split(",")[0])
    assert below < critical < above
    assert critical * ON_EDGE.gamma == pytest.approx(14.1, rel=0.03)


@pytest.mark.parametrize("arc", ["auto", "always"])
def test_branches_do_not_depend_on_how_the_bifurcation_was_come_to(switched, arc):
    other = solve(ON_EDGE, ShellOptions(switch=True, arc_length=arc, first_step=0.07, max_step=0.13))
    assert other.status is ShellStatus.CONVERGED
    assert other.energy["total"] == pytest.approx(switched.energy["total"], abs=1e-9)
    if arc == "always":
        notes = [step.note for step in steps(other, "arc")]
        assert any(note.startswith("bifurcation between") and "0 to 1" in note for note in notes)


def test_the_branch_begins_with_the_square_root_of_the_load(switched):
    """Pitchfork: load = critical + c side^2, so the branch leads back to the load found by bisection."""
    (branch,) = steps(switched, "switch")
    near = [step for step in (branch, *steps(switched, "arc")) if step.load < branch.load + 0.05]
    assert len(near) >= 5
    side = np.array([step.values["end"][1] for step in near])
    loads = np.array([step.load for step in near])
    fit = np.polyfit(side**2, loads, 2)
    assert fit[2] == pytest.approx(float(branch.note.split("at ")[1].split(",")[0]), abs=1e-3)
    assert fit[1] > 0.1
    assert np.max(np.abs(np.polyval(fit, side**2) - loads)) < 1e-3


def test_a_path_told_to_stay_goes_on_through_the_bifurcation():
    events = []
    stay = solve(ON_EDGE, ShellOptions(kick=False, arc_length="always"), events.append)
    assert (stay.status, stay.stable) == (ShellStatus.UNSTABLE, False)
    assert np.max(np.abs(stay.surface.points @ [0.0, 1.0, 0.0])) < 1e-6
    notes = [event["note"] for event in events if event["event"] == "step" and event["note"]]
    assert len(notes) == 1
    assert "bifurcation" in notes[0]
    assert stay.lowest_eigenvalue < 0


CLAMP = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # t_x = e_y, t_y = e_z, t_z = e_x
ARCH = ShellProblem(  # shallow, bulging to -z, pushed to +z by its weight
    width=0.05,
    thickness=2.5e-3,
    poisson=0.3,
    start_curvature=-1.0,
    end=Pose((0.985, 0.0, 0.0), CLAMP),
    path=(Waypoint(natural=1.0, name="release"), Waypoint(end=Pose((0.985, 0.0, 0.0), CLAMP), name="clamps")),
    clamp_frame=CLAMP,
    gamma=120.0,
    up=(0.0, 0.0, -1.0),
    elements=(16, 1),
)


@pytest.fixture(scope="module")
def snapped():
    return solve(ARCH, ShellOptions(switch=True))


def test_an_unstable_branch_is_followed_down_and_up_again(snapped):
    """It leaves the arch at a load, and comes to the inverted arch at minus that load."""
    assert (snapped.status, snapped.stable) == (ShellStatus.CONVERGED, True)
    release = [step.values["middle"][2] for step in snapped.steps if step.stage == "clamps"]
    assert release[-1] < -0.07
    assert snapped.section(0.5)["position"][2] > 0.07
    (branch,) = steps(snapped, "switch")
    critical = float(branch.note.split("at ")[1].split(",")[0])
    assert branch.negative == 1
    assert branch.load < critical
    turns = [step.note for step in snapped.steps if step.note.startswith("limit point at")]
    assert len(turns) == 1
    assert float(turns[0].rsplit(maxsplit=1)[1]) == pytest.approx(-critical, abs=2e-3)
    kicked = solve(ARCH)
    assert kicked.energy["total"] == pytest.approx(snapped.energy["total"], abs=1e-8)


def test_without_switch_and_kick_the_path_passes_its_limit_points_and_stays_unstable(snapped):
    result = solve(ARCH, ShellOptions(arc_length="always", kick=False))
    assert result.status is ShellStatus.UNSTABLE
    assert result.negative_eigenvalues > 1
    assert not steps(result, "relax")
    notes = [step.note for step in result.steps if step.note]
    assert notes[0].startswith("bifurcation between")
    limits = [float(note.rsplit(maxsplit=1)[1]) for note in notes if note.startswith("limit point at")]
    assert limits[0] > 0.3 > 0.0 > limits[1]
    assert result.energy["total"] > snapped.energy["total"] + 1.0


def test_arc_length_kicks_at_the_bifurcation_but_not_beyond_limit_points():
    result = solve(ARCH, ShellOptions(arc_length="always"))
    assert (result.status, result.stable) == (ShellStatus.CONVERGED, True)
    (kick,) = steps(result, "relax")
    assert kick.load < 0.3
    assert result.section(0.5)["position"][2] > 0.07


def test_switching_while_the_clamps_move():
    """Thesis 7.2: the arch between shifted clamps tilts. The moving clamp has a part along the mode, which the branch's
    first point must not be mistaken for: its middle leaves the point half way between the clamps."""
    frame = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    shear = ShellProblem(
        width=0.05,
        thickness=1e-3,
        poisson=0.3,
        clamp_frame=frame,
        end=Pose((0.5, 0.37, 0.0), frame),
        start_curvature=-2.5,
        elements=(24, 2),
        grading=(0.4, 1.0),
        path=(Waypoint(natural=1.0, name="release"), Waypoint(end=Pose((0.5, 0.3, 0.0), frame), name="close")),
    )
    result = solve(shear, ShellOptions(switch=True, kick=False, max_step=0.2))
    assert result.status is ShellStatus.CONVERGED
    branch = [step for step in steps(result, "switch") if step.accepted]
    assert len(branch) == 1
    x, y, _ = branch[0].values["middle"]
    shift = 0.3 + 0.07 * branch[0].load
    assert abs(x - 0.25) > 0.004
    assert abs(y - 0.5 * shift) > 0.004
    x, y, _ = result.section(0.5)["position"]
    assert abs(x - 0.25) > 0.03
    arch = solve(shear, ShellOptions(kick=False, max_step=0.2))
    assert arch.status is ShellStatus.UNSTABLE
    assert arch.section(0.5)["position"][0] == pytest.approx(0.25, abs=1e-6)
    assert result.energy["total"] < arch.energy["total"]
