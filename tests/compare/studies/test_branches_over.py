"""`ribbonbench branches --over`: curves of folds and branch points over a second number, and where two folds meet."""

import csv
import json

import pytest
from scipy.optimize import brentq
from scipy.special import jv

from compare.commands.main import main
from compare.scene.scene import loads
from compare.studies.branches import over as study
from compare.studies.branches.over import Cut, Mark, asked_values, curves
from compare.studies.branches.run import Asked
from ribbonbench.errors import BadInput
from tests.compare.studies.test_branches import EDGE, MAST
from tests.validation.workbench.on_edge_linear import developable, smooth

CURL = "strip.natural_curvature"


@pytest.fixture(scope="module")
def stem(tmp_path_factory):
    """A heavy mast over its curl, for several weights; and the folder in which that is kept."""
    keep = tmp_path_factory.mktemp("cuts")
    scene = loads(MAST)
    found = curves(scene, CURL, -1.0, 1.0, "strip.gamma", (7.0, 9.0), ("elastica", "wunderlich"), keep=keep)
    return scene, found, keep


def test_two_folds_meet_where_the_straight_mast_falls_over(stem):
    """Greenhill 1881: the cusp of the curled mast is the pitchfork of the straight one, by both models."""
    _, found, _ = stem
    exact = brentq(lambda gamma: jv(-1.0 / 3.0, 2.0 / 3.0 * gamma**0.5), 6.0, 9.0)
    assert [met.model for met in found.meetings] == ["elastica", "wunderlich"]
    for met in found.meetings:
        low, high = met.between
        assert high - low == pytest.approx(2.0 / 2**study.HALVED)
        assert low < exact < high
        assert met.at == pytest.approx(exact, abs=2e-3)
        assert abs(met.value) < 1e-6
    assert found.ok


def test_curves_are_mirror_images_and_those_of_another_model(stem):
    _, found, _ = stem
    elastica, wunderlich = ([c for c in found.curves if c.model == m] for m in ("elastica", "wunderlich"))
    assert len(elastica) == len(wunderlich) == 2
    for low, high in (elastica, wunderlich):
        assert {c.kind for c in (low, high)} == {"fold"}
        assert [m.other for m in low.marks] == [m.other for m in high.marks]
        for a, b in zip(low.marks, high.marks, strict=True):
            assert abs(a.value + b.value) <= 2.0 * (a.error + b.error)
    for one, other in zip(elastica, wunderlich, strict=True):
        for a, b in zip(one.marks, other.marks, strict=True):
            assert abs(a.value - b.value) <= 1.5 * (a.error + b.error) < 1e-4


def test_what_is_finished_is_not_followed_again(stem, monkeypatch):
    scene, found, keep = stem
    asked = []

    def followed(self, value):
        asked.append(value)
        return Cut(value, ())

    monkeypatch.setattr(study._Study, "_followed", followed)
    words = ("elastica", "wunderlich")
    again = curves(scene, CURL, -1.0, 1.0, "strip.gamma", (7.0, 9.0), words, keep=keep)
    assert asked == []
    assert again.curves == found.curves
    curves(scene, CURL, -1.0, 1.0, "strip.gamma", (7.0, 13.0), words, keep=keep)
    assert 13.0 in asked
    asked.clear()
    curves(scene.replace({"model.elements": 7}), CURL, -1.0, 1.0, "strip.gamma", (7.0, 9.0), words, keep=keep)
    assert asked[:2] == [7.0, 9.0]  # of another scene


def test_the_critical_weight_on_edge_over_the_width():
    """Thesis, figure 7.3: the quotient to second order, which shares nothing with `ribbon`, has the same curves."""
    scene = loads(EDGE).replace({"strip.thickness": 1e-3, "clamp.start.ruling": "free", "strip.poisson": 0.35})
    widths = (0.05, 0.1)
    found = curves(
        scene, "strip.gamma", 5.0, 30.0, "strip.width", widths, ("sano", "wunderlich"), Asked(branches=1)
    )  # fmt: skip
    sano, wunderlich = found.curves
    assert (sano.kind, wunderlich.kind) == ("branch_point", "ruling")
    for mark in sano.marks:
        assert mark.value == pytest.approx(smooth(1.0 - 0.35**2, 2.0 * (1.0 - 0.35)), rel=1e-4)
    for mark, width in zip(wunderlich.marks, widths, strict=True):
        exact = developable(width, True, False, count=60).gamma
        assert 0.999 * exact <= mark.value <= 1.005 * exact
        assert mark.error is None


def _cut(other, *marks):
    return Cut(other, tuple(Mark(other, "m", kind, 0, value, 1e-6, True, 0.0) for kind, value in marks))


def test_neighbours_are_joined_by_what_they_are_extrapolated_to():
    cuts = [_cut(k, ("fold", 0.1 * k), ("fold", 1.0 - 0.1 * k), ("branch_point", 0.5)) for k in range(9)]
    rising, flat, falling = sorted(study._joined(cuts, 1.0), key=lambda c: c.marks[-1].value, reverse=True)
    assert [m.value for m in rising.marks] == [0.1 * k for k in range(9)]  # through the crossing, not bent at it
    assert [m.value for m in falling.marks] == [1.0 - 0.1 * k for k in range(9)]
    assert flat.kind == "branch_point"
    assert {c.begins for c in (rising, flat, falling)} == {None}


def test_a_curve_that_begins_or_ends_says_between_which_values():
    cuts = [_cut(0.0, ("fold", 0.5)), _cut(1.0, ("fold", 0.6), ("fold", 0.0)), _cut(2.0, ("fold", 0.1)), _cut(3.0)]
    first, second = study._joined(cuts, 1.0)
    assert (first.begins, first.ends) == (None, (1.0, 2.0))
    assert (second.begins, second.ends) == ((0.0, 1.0), (2.0, 3.0))
    assert study._meetings([first, second]) == []


def test_a_value_without_a_diagram_is_named_and_spoils_nothing(monkeypatch):
    followed = study._Study._followed

    def refused(self, value):
        return Cut(value, (), why="no") if value == 9.0 else followed(self, value)

    monkeypatch.setattr(study._Study, "_followed", refused)
    found = curves(loads(MAST), CURL, -1.0, 1.0, "strip.gamma", (9.0, 10.0, 11.0), ("elastica",), Asked(errors=False))
    assert not found.ok
    assert [len(c.marks) for c in found.curves] == [2, 2]
    assert [cut.why for cut in found.cuts] == ["no", "", ""]


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("strip.gamma=3", "--over"), ("strip.gamma", "--over"), ("strip.gamma=1,nan", "--over"),
        ('model.energy="a","b"', "--over"),
    ],
)  # fmt: skip
def test_values_that_are_none(text, key):
    with pytest.raises(BadInput) as raised:
        asked_values(text)
    assert raised.value.key == key


@pytest.mark.parametrize("over", ["strip.nothing", CURL, "clamp.start.position[7]", "strip.width[0]"])
def test_keys_that_are_none(over):
    with pytest.raises(BadInput) as raised:
        curves(loads(MAST), CURL, -1.0, 1.0, over, (0.01, 0.02), ("elastica",))
    assert raised.value.key == "--over"


def test_a_component_may_be_named():
    assert asked_values("clamp.end.position[1]=0:0.2:3") == ("clamp.end.position[1]", (0.0, 0.1, 0.2))


def test_the_command_writes_curves_and_a_picture(tmp_path, capsys):
    (tmp_path / "mast.toml").write_text(MAST)
    words = ["branches", str(tmp_path / "mast.toml"), "--along", CURL, "--from", "-1", "--to", "1", "--no-errors"]
    out = tmp_path / "out"
    code = main([*words, "--over", "strip.gamma=9,11", "--out", str(out), "--model", "elastica"])
    assert code == 0
    with (out / "curves.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    kept = json.loads((out / "curves.json").read_text())
    assert [float(row["parameter"]) for row in rows] == [
        point["parameter"] for curve in kept["curves"] for point in curve["points"]
    ]
    assert {row["other"] for row in rows} == {"9.0", "11.0"}
    assert (out / "curves.png").stat().st_size > 1e4
    assert json.loads((out / "result.json").read_text())["branches"]["over"] == "strip.gamma"
    assert ": fair" in capsys.readouterr().out.replace("\n", " ")  # errors were not asked for


def test_all_values_have_one_energy(monkeypatch):
    """A choice for each value would join curves of two energies."""
    asked = []

    def followed(self, value):
        asked.append(self.words)
        return Cut(value, ())

    monkeypatch.setattr(study._Study, "_followed", followed)
    scene = loads(EDGE.replace('energy = "wunderlich"\n', "")).replace(
        {"strip.thickness": 1e-3, "strip.natural_curvature": 5.0, "gravity.up": [1.0, 0.0, 0.0]}
    )
    curves(scene, "strip.gamma", 5.0, 15.0, "strip.width", (0.02, 0.2))
    assert len(asked) == 2
    assert asked[0] == asked[1]
    assert asked[0][0] in ("sadowsky", "wunderlich", "finite")
