"""`ribbonbench solve --all`: other equilibria of a scene, stable or not, by two models; what is written."""

import json

import numpy as np
import pytest

from compare.commands.main import main
from compare.pages.branches.states import sentences
from compare.scene.scene import loads
from compare.studies.branches.bars import Bars
from compare.studies.branches.states import Seen, States, states
from ribbonbench.errors import BadInput
from tests.compare.studies.test_branches import HELD

ARCH = HELD.replace("[0.96, 0.0, -0.28]", "[1.0, 0.0, 0.0]").replace("[0.28, 0.0, 0.96]", "[0.0, 0.0, 1.0]")


@pytest.fixture(scope="module")
def seen():
    return {
        "elastica": states(loads(ARCH), tries=0),
        "wunderlich": states(loads(ARCH).replace({"model.energy": "wunderlich", "model.elements": 20}), tries=3),
    }


def test_an_arch_has_its_image_and_the_two_saddles_between_by_both_models(seen):
    for found in seen.values():
        own = found.seen[found.own]
        assert own.distance == 0.0
        assert own.stable
        lowest, saddles = found.seen[:2], found.seen[2:4]
        assert [s.unstable for s in lowest] == [0, 0]
        assert [s.unstable for s in saddles] == [1, 1]
        assert lowest[1].energy == pytest.approx(lowest[0].energy, rel=1e-9)
        assert saddles[1].image_of == 2
        assert lowest[1].image_of == 0
        line, image = (s.centreline for s in lowest)
        assert image[:, 2] == pytest.approx(-line[:, 2], abs=1e-6)
        assert found.distances()[0, 1] == pytest.approx(2.0 * np.abs(line[:, 2]).max(), rel=1e-3)
        assert not found.lower
    for k in (0, 2):
        ribbon, elastica = (seen[model].seen[k].energy for model in ("wunderlich", "elastica"))
        assert ribbon == pytest.approx(elastica, rel=1e-4)
        assert abs(ribbon - elastica) <= seen["wunderlich"].seen[k].bars.energy


def test_a_barrier_is_the_height_of_the_saddle_between_two_states(seen):
    """Over it the arch goes to its image: as high as the elastica's saddle over its arch."""
    found, other = seen["wunderlich"], [s.energy for s in seen["elastica"].seen]
    between = [b for b in found.barriers if b.ends == (0, 1)]
    assert between
    assert min(b.heights[0] for b in between) == pytest.approx(other[2] - other[0], rel=2e-4)
    for b in between:
        assert found.seen[b.saddle].unstable == 1
        assert b.heights[0] == pytest.approx(b.heights[1], rel=1e-6)
        assert abs(b.heights[0] - (other[2] - other[0])) <= b.errors[0] + 1e-6 * other[0]


ROOF = """
[strip]
length = 1.0
width = 0.05
poisson = 0.3
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[clamp.end]
position = [0.0, 0.0, 0.95]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[[wall]]
name = "roof"
point = [0.0, 0.12, 0.0]
normal = [0.0, -1.0, 0.0]
[model]
energy = "wunderlich"
elements = 40
"""


def test_steps_downhill_stay_on_their_side_of_a_saddle():
    """Under a roof one image of the arch is pressed; long steps go there from both sides of the saddle between."""
    found = states(loads(ROOF), tries=0)
    (between,) = [b for b in found.barriers if found.own in b.ends]
    assert found.seen[between.saddle].unstable == 1
    one, other = (found.seen[k].energy for k in between.ends)
    assert other - one > 0.5  # the roof pushes on the other
    assert between.heights[0] - between.heights[1] == pytest.approx(other - one, rel=1e-9)


def test_a_state_is_settled_where_finer_elements_have_it_too(seen):
    """Twists by whole turns that stand on the kinks of twelve segments of Sadowsky's strip are no states of it."""
    scene = loads(ARCH).replace({"model.energy": "sadowsky", "model.elements": 12})
    found = states(scene, tries=6)
    assert found.seen[found.own].settles
    assert found.unsettled > 0
    for s in found.seen:
        if s.image_of is not None:
            assert s.bars is found.seen[s.image_of].bars
    assert all(s.settles for s in seen["wunderlich"].seen[:4])


@pytest.mark.parametrize(("costly", "why"), [(True, "cost too much"), (False, "time was spent")])
def test_errors_that_were_not_asked_for_are_told_with_the_reason(costly, why):
    """They looked like those of states that do not settle."""
    bars = (None, Bars(0.0, 1e-3, 1e-3, None, True), Bars(0.0, 1e-3, 1e-3, None, False), None)
    some = tuple(Seen(float(k), 0, 0.0, "", None, np.zeros((101, 3)), None, one) for k, one in enumerate(bars))
    assert (States(some, 0, 1, True).unasked, States(some, 0, 1, True).unsettled) == (2, 1)
    (said,) = (line for line in sentences(States(some, 0, 1, True, costly)) if "asked" in line)
    assert "2 of 4 states" in said
    assert why in said
    assert not any("asked" in line for line in sentences(States(some[1:3], 0, 1, True, costly)))


def test_every_state_is_an_equilibrium_that_its_own_solver_confirms(seen):
    for state in seen["wunderlich"].seen:
        equilibrium = state.shape.equilibrium
        assert equilibrium.residual < 1e-8
        assert equilibrium.energy.total == pytest.approx(state.energy, abs=1e-9)
        line = state.centreline
        assert np.linalg.norm(np.diff(line, axis=0), axis=1).max() < 1.0 / 100 + 1e-9
        assert line[-1] == pytest.approx([0.8, 0.0, 0.0], abs=1e-8)


def test_a_model_without_a_tangent_is_refused():
    with pytest.raises(BadInput) as caught:
        states(loads(ARCH).replace({"model.energy": "tape", "strip.thickness": 1e-3}))
    assert caught.value.key == "--all"


def test_the_command_lists_them_and_says_that_a_list_is_no_proof(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arch.toml").write_text(ARCH)
    line = ["solve", "arch.toml", "--all", "--set", "model.energy=wunderlich", "--set", "model.elements=12"]
    assert main([*line, "--out", "out"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "A list is no proof" in said
    found = json.loads((tmp_path / "out" / "result.json").read_text())
    assert [s["own"] for s in found["states"]].count(True) == 1
    assert found["states_search"]["proof"] is False
    energies = [s["energy"] for s in found["states"]]
    assert np.diff(energies).min() > -1e-8
    assert len({s["unstable_modes"] for s in found["states"]}) >= 2
    lines = np.load(tmp_path / "out" / "states.npz")["centreline"]
    assert lines.shape == (len(energies), 101, 3)
    plain = json.loads((tmp_path / "out" / "page.json").read_text())
    assert any(t["title"] == "Equilibria that were seen" for t in plain["tables"])
