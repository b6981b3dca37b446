"""`ribbonbench solve --all`: other equilibria of a scene, stable or not, by two models; what is written."""

import json

import numpy as np
import pytest

from compare.commands.main import main
from compare.pages.branches.states import record, sentences, table
from compare.scene.scene import loads
from compare.scene.units import Units
from compare.studies.branches import states as search
from compare.studies.branches.bars import Bars
from compare.studies.branches.states import ONE_END, Barrier, Left, Seen, States, states
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
    (said,) = (line for line in sentences(States(some, 0, 1, True, costly), Units()) if "asked" in line)
    assert "2 of 4 states" in said
    assert why in said
    assert not any("asked" in line for line in sentences(States(some[1:3], 0, 1, True, costly), Units()))


def arch_of(barriers=(), left=(), downhill=True):
    """An arch with its image and two saddles of one energy; a third one higher."""
    energies, unstable, images = (1.0, 1.0, 3.0, 3.0, 8.0), (0, 0, 1, 1, 1), (None, 0, None, 2, None)
    bars, line = Bars(0.0, 1e-3, 1e-3, None, True), np.zeros((101, 3))
    some = (
        Seen(e, n, 0.1, "", image, line, None, bars) for e, n, image in zip(energies, unstable, images, strict=True)
    )
    return States(tuple(some), 0, 1, True, False, tuple(barriers), tuple(left), downhill)


def test_barriers_are_told_in_si_and_saddles_of_one_energy_once():
    """Each of two images had a sentence of its own, in D w / l of a strip whose joule is known."""
    units = Units(0.5, 0.01, 5e-4)  # D w / l is 1 mJ
    both = [Barrier(k, (0, 1), (2.0, 2.0), (2e-3, 2e-3)) for k in (2, 3)]
    found = arch_of([*both, Barrier(4, (0, 1), (7.0, 7.0), (2e-3, None))])
    said = [line for line in sentences(found, units) if "falls to" in line]
    assert len(said) == 2
    assert "2 saddles of one energy (states 2, 3)" in said[0]
    assert said[0].count("2 mJ, within 0.002 mJ") == 2
    assert "7 mJ, its error is not known" in said[1]
    assert not any("D w" in line for line in sentences(found, units))
    barriers = record(found, units)["states_search"]["barriers"]
    assert barriers[0]["si"]["heights"] == pytest.approx([2e-3, 2e-3])
    assert barriers[2]["si"]["errors_why"] == barriers[2]["errors_why"]
    assert "energy mJ" in [column.heading for column in table(found, units).columns]
    assert "energy / (D w / l)" in [column.heading for column in table(found, Units()).columns]


def test_saddles_without_a_barrier_are_told_with_the_reason():
    """Nothing was written of them: "none between" and "not found" read the same."""
    found = arch_of(left=[Left(2, ONE_END), Left(3, ONE_END), Left(4, search.SPENT)])
    written = record(found, Units())["states_search"]
    assert written["barriers"] == []
    assert written["saddles"]["tried"] == 2
    assert written["saddles"]["left"][2] == {"saddle": 4, "why": "the time was spent"}
    said = written["barriers_why"]
    assert said in sentences(found, Units())
    assert "3 of 3 saddles" in said
    assert "both sides fall to one state (states 2, 3)" in said
    none = record(arch_of(downhill=False), Units())["states_search"]
    assert none["barriers"] is None
    assert "no steps downhill" in none["barriers_why"]


def test_a_saddle_whose_sides_end_nowhere_is_kept_with_the_reason(seen, monkeypatch):
    scene = loads(ARCH).replace({"model.energy": "wunderlich", "model.elements": 12})
    monkeypatch.setattr("compare.models.branches.ribbon.downhill", lambda point, dz: None)
    found = states(scene, tries=0)
    assert found.barriers == ()
    assert len(found.left) == found.saddles >= 2
    assert {one.why for one in found.left} == {search.NO_END}
    assert all(found.seen[one.saddle].unstable == 1 for one in found.left)


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


def test_a_strip_that_rubs_has_no_list_of_states():
    """How it lies depends on its way there: refused, before anything is solved."""
    floor = '[[wall]]\nname = "floor"\npoint = [0.0, -1.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\nfriction = 0.3\n'
    way = '[[path]]\n"wall.floor.point" = [0.0, -1.1, 0.0]\n'
    rough = loads(ARCH.replace('"elastica"', '"wunderlich"') + floor + way)
    smooth = rough.replace({"wall.floor.friction": 0.0})
    assert search.able(smooth)
    with pytest.raises(BadInput, match="friction"):
        search.able(rough)
