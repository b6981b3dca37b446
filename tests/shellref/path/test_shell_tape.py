"""A tape spring's symmetric parts are the whole tape; it folds through limit points, and lies on its plateau."""

import numpy as np
import pytest

from shellref import Pose, ShellOptions, ShellProblem, ShellStatus, Waypoint

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.path.point import Point, Walk  # noqa: E402
from shellref.path.solve import solve  # noqa: E402
from tests.validation.shell import tape_parts as parts  # noqa: E402


def _whole(case, move):
    """The whole tape of a part, on the same even elements, at a share of the test's way."""
    width, far = 2.0 * parts.HALF_WIDTH / parts.LENGTH, move * parts.FARTHEST[case.test]
    along = case.along * (2 if case.turned else 1)
    straight = Waypoint(start=Pose((0, 0, 0), parts.frame(0.0)), end=Pose((0, 0, 1.0), parts.frame(0.0)))
    turn, lift = (case.sign * far, 0.0) if case.turned else (0.0, far)
    return ShellProblem(
        width=width, thickness=parts.THICKNESS / parts.LENGTH, poisson=parts.POISSON,
        transverse_curvature=parts.CURVATURE * parts.LENGTH, elements=(along, 2 * case.across), grading=(1.0, 1.0),
        clamp_frame=parts.frame(turn), end=Pose((0.0, lift, 1.0), parts.frame(-turn)), slide=(None, (0.0, 0.0, 1.0)),
        turns=case.test == "cantilever", path=(straight,),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("test", "move"), [("opposite", 0.1), ("equal", 0.04), ("cantilever", 0.05), ("two_folds", 0.05)]
)
def test_a_part_is_the_whole(test, move):
    """Load and energy of the part are those of the whole tape on the same elements."""
    case = parts.Case(test, 8, 2)
    path = parts.Path(case)
    attempt = None
    state, stress = path.model.reference, None
    for share in (0.5, 1.0):
        attempt = path.equilibrium.solve(state, stress, path.stage, share * move)
        assert attempt.converged
        state, stress = attempt.state, attempt.stress
    seen = path.observe(state)
    options = ShellOptions(arc_length="never", kick=False, stability=False, first_step=0.5, max_step=0.5)
    whole = solve(_whole(case, move), options)
    assert whole.status is ShellStatus.CONVERGED
    if case.turned:
        load = case.sign * whole.clamps["start"]["moment"][0] * parts.MOMENT
    else:
        load = whole.clamps["end"]["force"][1] * parts.FORCE
    assert seen["load"] == pytest.approx(load, rel=1e-7)
    assert seen["energy"] == pytest.approx(whole.energy["total"] * parts.MOMENT, rel=1e-7)
    assert abs(seen["along"]) < 1e-6 * abs(load)


@pytest.mark.validate
def test_the_tape_folds_snaps_back_and_rests_on_its_plateau():
    """A coarse quarter, opposite sense: stable to a limit point, back and on again, stable fold; the moment then is
    (1 + nu) D 2 beta0 but for the waves of a fold that grows over coarse elements."""
    path = parts.Path(parts.Case("opposite", 20, 3))
    walk = Walk(Point(0.0, path.model.reference.copy(), None))
    path.walker.start(walk)
    path.walker.run(walk)
    verdict = path.walker.verdict(walk)
    assert verdict.status is ShellStatus.CONVERGED
    assert verdict.stable
    moved = np.array([step.values["moved"] for step in walk.steps if step.accepted])
    load = np.array([step.values["load"] for step in walk.steps if step.accepted])
    assert 1240.0 < load.max() < 1340.0
    ways = np.sign(np.diff(moved))
    assert np.any(ways < 0)
    assert moved[np.argmin(ways) :].min() < 0.6 * moved[np.argmax(load)]
    assert sum("limit point" in step.note for step in walk.steps) >= 2
    plateau = 1.3 * parts.STIFFNESS * 1.2
    assert load[-1] == pytest.approx(plateau, rel=0.25)
    assert walk.steps[-1].values["opening"][-1] == pytest.approx(0.0, abs=0.1)
