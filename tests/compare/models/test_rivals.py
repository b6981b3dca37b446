"""Other states: one of lower energy that the strip alone shows, one in which a shell rests, and what is said of both.

The scene was drawn at random (unseen 29 of the issue on effects): the estimate said 0.41 % of l, "enough"; the shell's
own path ends 5.8 % away, in a state that the ribbon has too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from compare.measure.curvatures import curvatures
from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.models.base import Options, State, Status, Variant
from compare.models.ribbon import auto, rivals
from compare.models.ribbon.auto import choose, with_energy
from compare.models.ribbon.estimate import estimate
from compare.models.ribbon.model import RibbonModel
from compare.models.ribbon.state import RibbonShape
from compare.models.same_state import same_state
from compare.pages.comparison import another_state
from compare.pages.solve import answer
from compare.registry import model
from compare.scene.scene import Scene, load, loads
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import OWN_IS_HIGHER, compare, fit_slope, lower_state
from compare.studies.limits import Thresholds, quick, with_clamp
from ribbon.find.solve import solve_shape
from tests.validation.workbench import drawn, felt

UNSEEN = """
title = "unseen 29"
[strip]
length = 1.0
width = 0.016263314182036376
thickness = 7.259589795343191e-05
poisson = 0.08635045209532023
gamma = 505.76472404473134
natural_curvature = -4.126894445629542
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [-0.1452510724936592, -0.8948740847228545, -0.42202191700298597]
normal = [-0.9525758342546946, 0.24176549006131998, -0.18479374396711185]
[model]
energy = "auto"
accuracy = 0.01
[shell]
tolerance = 2e-3
"""


@pytest.fixture(scope="module")
def unseen() -> Scene:
    return loads(UNSEEN, "unseen.toml")


@pytest.fixture(scope="module")
def ruled(unseen) -> tuple[Scene, State]:
    """Sadowsky's strip of the scene, short segments at the clamp."""
    scene = with_energy(unseen, "sadowsky").replace({"model.elements": 40, "model.grading": "clamp"})
    return scene, model("ribbon").solve(scene, options=Options(error=True))


def shell_at(state: State, equilibrium, start: str) -> State:
    """A state with the shape of a ribbon's equilibrium as a shell would report it."""
    return replace(state, model="shell", shape=RibbonShape(equilibrium), start=start)


def test_a_lower_state_beside_the_ribbons_own_is_seen(ruled):
    scene, state = ruled
    rival = rivals.probe(scene, state.native)
    assert rival is not None
    assert rival.own == pytest.approx(state.energy.total, rel=1e-9)
    assert rival.energy < rival.own - 1.0
    assert rival.distance > 0.05


def test_the_choice_of_an_energy_is_not_sure_where_a_lower_state_was_seen(unseen):
    choice = choose(unseen)
    assert choice.enough
    assert not choice.sure
    assert choice.to_dict()["rival"]["energy"] < choice.to_dict()["rival"]["own"]
    state = model("ribbon").solve(unseen, options=Options(error=True))
    assert answer(unseen, state).grade == "unknown"


def test_the_estimate_gives_no_level_where_a_lower_state_was_seen(unseen):
    """With a strip that has rulings, and by way of one for a strip with a free twist."""
    for energy in ("wunderlich", "finite"):
        strip = with_energy(unseen, energy).replace({"model.elements": 40, "model.grading": "clamp"})
        found = quick(strip, Thresholds())[0]
        assert found.estimate.rival is not None
        assert (found.level, found.estimated_level) == (None, None)
        assert found.distance is not None


@pytest.mark.parametrize("name", ["curl_4_3", "cantilever", "limits_7_3", "curl_4_3_down"])
def test_no_false_alarm_where_the_shell_agrees(name):
    scene = with_clamp(load(name), "edge").replace({"shell.width_to_thickness": [100]})
    state = model("ribbon").solve(scene)
    assert estimate(scene, state.native, 100.0).rival is None


def test_where_the_scene_says_which_state_is_meant_nothing_is_probed():
    scene = load("two_clamps_5_3_2_twist")
    assert not rivals.is_probed(scene)
    assert rivals.probe(scene, model("ribbon").solve(scene).native) is None


def test_curvatures_from_frames_are_those_of_the_strip(ruled):
    """Second order in the window: against the strip's own omega and tau, away from its joints."""
    _, state = ruled
    s = np.array([0.31, 0.52, 0.77])
    kappa = curvatures(state.shape.frames, s, 1e-4)
    assert kappa[:, 0] == pytest.approx(state.native.omega(s), rel=1e-4)
    assert kappa[:, 2] == pytest.approx(state.native.tau(s), rel=1e-3)
    assert np.abs(kappa[:, 1]).max() < 1e-3


def test_a_shell_in_the_ribbons_other_state_is_in_another_state(ruled):
    """The shell stands in for itself by the ribbon's own rival: 8 % of l away, and found again from its shape."""
    scene, state = ruled
    omega, eta = state.native.problem.joint_values(state.native.x)
    s = np.concatenate([[0.0], np.cumsum(state.native.problem.lengths)])
    sign = np.where(s < 2.0 * scene.width, -1.0, 1.0)
    rival = solve_shape(state.native.problem, sign * omega, sign * eta)
    grid = Grid.for_shape(scene, state.shape.bend)
    found = same_state(RibbonModel(), scene, state, shell_at(state, rival, "path (the ribbon's is refused)"), grid)
    assert found.answer is False
    assert found.counterpart.energy == pytest.approx(rival.energy.total, rel=1e-9)
    assert found.counterpart.distance < 1e-6


def test_a_shell_far_away_in_the_ribbons_own_state_is_not(ruled):
    """A softer strip of the same scene, 2 % of l away: from its shape the ribbon comes back, or, by rounding, rests on
    a neighbouring place of the flip that the segments pin: it is never called another state, wherever it began."""
    scene, state = ruled
    grid = Grid.for_shape(scene, state.shape.bend)
    for gamma, answers in ((430.0, (True, None)), (470.0, (True,))):
        softer = model("ribbon").solve(scene.replace({"strip.gamma": gamma}))
        for start in ("path", "path (the ribbon's is refused)", "ribbon"):
            found = same_state(RibbonModel(), scene, state, shell_at(state, softer.native, start), grid)
            assert found.answer in answers
            assert (found.counterpart is None) == (found.answer is True)


def test_a_fold_that_is_shorter_than_the_ribbons_elements_is_another_state(unseen):
    """The state of this scene's shell: curvature of the other sign on the first 0.03 l. The 40 segments of the ribbon,
    of 0.014 l there, do not hold it, and left it undecided."""
    scene = with_energy(unseen, "finite").replace({"model.elements": 40, "model.grading": "clamp"})
    state = model("ribbon").solve(scene, options=Options(error=True))
    fine = state.native.problem.with_changes(lengths=np.repeat(state.native.problem.lengths / 6.0, 6))
    s = np.minimum(np.concatenate([[0.0], np.cumsum(fine.lengths)]), 1.0)
    omega, twist = state.native.omega(s), state.native.tau(s)
    folded = solve_shape(fine, np.where(s < 2.0 * scene.width, -1.0, 1.0) * omega, twist)
    assert folded.ok
    grid = Grid.for_shape(scene, state.shape.bend)
    found = same_state(RibbonModel(), scene, state, shell_at(state, folded, "path"), grid)
    assert found.answer is False
    assert found.counterpart.energy == pytest.approx(folded.energy.total, abs=2.0)


@dataclass
class Comes:
    """Stands for the ribbon: where it comes to rest, wherever it begins."""

    back: State

    def rests(self, scene, state, near, finer=1):
        return self.back


def test_a_ribbon_that_moves_by_as_much_as_states_are_apart_does_not_come_back(ruled):
    """A quarter of the way to the shell was "its own state" (another_state.toml: 1.6 % of 6 % of l)."""
    scene, state = ruled
    back, far = (model("ribbon").solve(scene.replace({"strip.gamma": gamma})) for gamma in (430.0, 250.0))
    grid = Grid.for_shape(scene, state.shape.bend)
    moved, apart = (grid_hausdorff(grid.of(one.shape), grid.of(state.shape)) for one in (back, far))
    assert 0.01 < moved < 0.5 * apart
    shell = shell_at(state, far.native, "path")
    found = same_state(Comes(back), scene, state, shell, grid)
    assert found.answer is None
    assert found.counterpart.distance > 0.5 * apart
    assert same_state(Comes(state), scene, state, shell, grid).answer is True


@pytest.fixture(scope="module")
def coil() -> tuple[Scene, State, State]:
    """The scene of K l = 100 on 20 segments, its lower state, and the higher one that a seed leads to, 0.1 l away and
    computed to 0.1 l: finer segments do not hold it."""
    scene = load("coil_100_7500")
    high = model("ribbon").solve(
        scene.replace({"seed.curvature": 100.0}), options=Options(error=True, grid=Grid.for_shape(scene, 20.0))
    )
    return scene, model("ribbon").solve(scene), high


def test_a_state_within_the_error_of_another_with_another_energy_is_not_the_same(coil):
    """Both are states of the same segments, 139 D w / l apart; the error told of the higher one covers the distance."""
    scene, low, high = coil
    assert low.ok
    assert high.ok
    assert high.energy.total > low.energy.total + 100.0
    grid = Grid.for_shape(scene, 20.0)
    apart = grid_hausdorff(grid.of(low.shape), grid.of(high.shape))
    assert 0.01 < apart < high.error
    found = same_state(RibbonModel(), scene, high, shell_at(high, low.native, "ribbon"), grid)
    assert found.answer is False
    assert found.counterpart.energy == pytest.approx(low.energy.total, rel=1e-9)
    level = replace(low, energy=high.energy)
    assert same_state(Comes(level), scene, high, shell_at(high, low.native, "ribbon"), grid).answer is True
    unsure = replace(high, errors={})
    found = same_state(Comes(low), scene, unsure, shell_at(high, low.native, "ribbon"), grid)
    assert found.answer is not True


def test_a_model_that_cannot_begin_there_does_not_know(ruled):
    scene, state = ruled
    softer = model("ribbon").solve(scene.replace({"strip.gamma": 300.0}))
    grid = Grid.for_shape(scene, state.shape.bend)
    far = shell_at(state, softer.native, "path")
    assert same_state(model("tape"), scene, state, far, grid).answer is None
    assert same_state(model("tape"), scene, state, replace(far, start="ribbon"), grid).answer is True


@dataclass
class Shells:
    """Stands for the shell: where its own path ends, and what is reached from the surface that it is given."""

    path: State
    given: State

    def solve(self, scene, size=None, *, near=None, options=None, say=None):
        assert near is not None
        return self.given if options.selects else self.path


def test_a_shell_whose_own_path_ends_higher_begins_again_at_the_ribbons_surface(ruled):
    """And rests in the ribbon's state; where it ends no lower, or nowhere, its own path stands, and both are said."""
    scene, state = ruled
    omega, eta = state.native.problem.joint_values(state.native.x)
    other = solve_shape(state.native.problem, -omega, eta)
    assert other.ok
    grid = Grid.for_shape(scene, state.shape.bend)
    high = replace(
        shell_at(state, other, "path (the ribbon's is refused)"),
        energy=replace(state.energy, gravity=state.energy.gravity + 5.0),
    )
    low = shell_at(state, state.native, "ribbon")
    quick_one, options = RibbonModel(), Options(grid=grid, selects=False)
    variant = Variant({}, scene)
    first = same_state(quick_one, scene, state, high, grid)
    assert first.answer is not True

    def requested(path: State, given: State, same=first, **changes):
        arguments = Shells(path, given), variant, path, same, quick_one, scene, state
        return lower_state(*arguments, replace(options, **changes))

    found, same = requested(high, low)
    assert found.start == OWN_IS_HIGHER
    assert same.answer is True
    assert f"{high.energy.total:.6g} for {low.energy.total:.6g}" in same.again
    higher = replace(low, energy=replace(high.energy, gravity=high.energy.gravity + 1.0))
    for there, said in ((higher, "no lower"), (replace(low, status=Status.NOT_CONVERGED), "no stable state")):
        found, same = requested(high, there)
        assert found is high
        assert same.answer is first.answer
        assert said in same.again
    assert requested(high, low, selects=True)[0] is high, "the scene says which state is meant"


@pytest.mark.validate
@pytest.mark.parametrize(("name", "energy"), [("held_27", -151.4), ("held_45", -165.9)])
def test_unseen_scenes_whose_shell_ends_higher_are_compared_in_the_ribbons_state(name, energy, tmp_path):
    """Their own paths rest at -116.4 and -89.4; what the ribbon alone says of the distance (3.9, 0.35 % of l) is so."""
    pytest.importorskip("dolfinx")
    scene = dict(drawn.unseen())[name]
    found = compare(scene, CaseStore(tmp_path), Reporter(quiet=True), bare=True)
    (row,) = found.rows
    assert row.same_state is True
    assert row.start == OWN_IS_HIGHER
    assert row.energy.total == pytest.approx(energy, abs=0.1)
    (estimated,) = quick(scene, Thresholds())
    assert row.hausdorff == pytest.approx(estimated.distance, rel=0.1)


@pytest.mark.validate
def test_the_unseen_scene_is_compared_in_no_distance(unseen, tmp_path):
    """The real shell: no claim, no slope, no grade; both energies, and the ribbon's state that is the shell's."""
    pytest.importorskip("dolfinx")
    found = compare(unseen, CaseStore(tmp_path), Reporter(quiet=True), bare=True)
    (row,) = found.rows
    assert row.hausdorff > 0.05
    assert row.same_state is False
    assert not row.claimed
    assert fit_slope(found.rows) is None
    assert row.counterpart.distance < 0.01
    assert row.counterpart.energy < found.fast.energy.total
    text = another_state(row, found.fast, unseen.units)
    assert f"{row.energy.total:.6g}" in text
    assert f"{found.fast.energy.total:.6g}" in text


TABLE = """
[strip]
length = 1.0
width = 0.05
thickness = 5e-4
poisson = 0.3
natural_curvature = 3.0
gamma = 1.0
[gravity]
up = [0.0, 0.0, 1.0]
[[wall]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[model]
energy = "wunderlich"
elements = 24
"""


@pytest.mark.parametrize("segments", [24, 48])
def test_a_strip_that_nothing_holds_begins_as_the_shape_stands(segments):
    """A curled strip stands on its ends and middle; from a cup that rests on its middle, of the same curvature, it does
    not come back to that: the cup is the lower state."""
    from ribbon.find.solve import solve_shape

    scene = loads(TABLE, "table").replace({"model.elements": segments})
    own = model("ribbon").solve(scene, options=Options(error=False))
    assert own.ok
    problem = own.native.problem
    along = np.array([0.0, np.cos(1.5), -np.sin(1.5)])
    normal = -np.array([0.0, np.sin(1.5), np.cos(1.5)])  # the strip curls away from it

    class Cup:
        """An arc of curvature 3 whose middle is down."""

        @staticmethod
        def frames(s):
            t = along[None, :] * np.cos(3.0 * s)[:, None] - normal[None, :] * np.sin(3.0 * s)[:, None]
            n = along[None, :] * np.sin(3.0 * s)[:, None] + normal[None, :] * np.cos(3.0 * s)[:, None]
            return np.stack([np.cross(n, t), n, t], axis=2)

        @staticmethod
        def centreline(s):
            return np.tile([0.0, 0.0, 0.9], (s.size, 1))

    found = rivals.near(own.native, Cup())
    assert found.ok, found.message
    ends, middle = found.position(np.array([0.0, 1.0]))[:, 2], found.position(np.array([0.5]))[0, 2]
    assert np.all(ends > middle + 0.05)
    assert found.energy.total < own.energy.total - 0.05
    plain = solve_shape(problem, *problem.joint_values(found.x))
    assert plain.position(np.array([0.0]))[0, 2] < 0.05  # without its pose it is the other way up


def test_one_equilibrium_is_probed_once(monkeypatch):
    """The choice has looked beside the strip that is then the answer; its word stands, whatever it was."""
    asked = []

    def probe(scene, equilibrium):
        asked.append(equilibrium)

    monkeypatch.setattr(rivals, "probe", probe)
    monkeypatch.setattr(auto, "probe", probe)
    state = model("ribbon").solve(felt.own(), options=Options(error=True, repeats=0))
    assert state.numbers["auto"]["chosen"] == "sadowsky"
    assert len(asked) == 1
    assert asked[0] is state.native
    assert state.rivals is not None
    assert state.rivals.tries == rivals.TRIES


def test_limits_look_beside_a_state_once(monkeypatch):
    """The estimate takes the word of the probe that the solve has asked."""
    from compare.studies import limits

    asked, own = [], rivals.probe
    monkeypatch.setattr(rivals, "probe", lambda scene, found: asked.append(found) or own(scene, found))
    found = limits.quick(auto.with_energy(felt.own(), "wunderlich"), limits.Thresholds())
    assert len(asked) == 1
    assert asked[0] is found[0].ribbon.native
    assert found[0].estimate.rival == found[0].ribbon.rivals.seen[1]
