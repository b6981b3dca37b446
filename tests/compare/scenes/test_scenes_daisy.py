"""The flower stem (daisy_5g, daisy_10g, daisy_straight, daisy_sheet) and what is wrong about a load at the tip."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from compare import registry
from compare.cli import DONE, main
from compare.models import solve as solve_scene
from compare.models.base import Options
from compare.models.elastica.start import elastica_problem
from compare.models.scope import has_shell
from compare.page.remedies import message
from compare.scene.scene import load, loads
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import compare
from ribbonbench.errors import BadInput
from shellref.elastica.result import embed
from shellref.elastica.rod import circular, circular_polar
from shellref.elastica.start import solve_near
from tests.compare.scene.scene_texts import PLANAR, SI, fault, text
from tests.validation.elastica.elastica_daisy import lab_stem, stem_equilibria

POLAR = {"strip.second_moment": 2.5132741228718345e-11}
ELASTICA = {"model.energy": '"elastica"'}
LOAD = {"tip.load": "3.0"}
STEM = SI | PLANAR | ELASTICA | {"strip.density": None, "strip.thickness": None, "strip.second_moment": "1e-11"}


def at_the_tip(name: str, keys: dict | None = None) -> np.ndarray:
    run = solve_scene(load(name).replace(keys or {}), "elastica", options=Options(error=True))
    assert run.native.status.value == "converged"
    return run.shape.centreline(np.array([1.0]))[0]


@pytest.mark.parametrize("name", ["daisy_5g", "daisy_10g", "daisy_straight"])
def test_numbers_of_the_stem(name):
    scene = load(name)
    grams = 10 if name == "daisy_10g" else 5
    assert scene.strip.second_moment == pytest.approx(circular(2e-3), rel=1e-12)
    assert POLAR["strip.second_moment"] == pytest.approx(circular_polar(2e-3), rel=1e-12)
    expected = grams * 1e-3 * 9.81 * 0.1**2 / (10e6 * math.pi * 2e-3**4 / 4)
    assert scene.tip_load == pytest.approx(expected, rel=1e-12)
    assert scene.gamma == 0.0
    assert scene.curvature == ((0.0, 0.0) if name == "daisy_straight" else (-0.1, -0.1))
    assert scene.is_planar()
    assert not has_shell(scene)
    assert scene.notes() == ()
    assert loads(scene.to_toml()).canonical() == scene.canonical()


@pytest.mark.parametrize(
    ("kind", "name", "mass"),
    [
        ("bending", "daisy_5g", 0.005),
        ("polar", "daisy_10g", 0.010),
        pytest.param("bending", "daisy_10g", 0.010, marks=pytest.mark.validate),
        pytest.param("polar", "daisy_5g", 0.005, marks=pytest.mark.validate),
    ],
)
def test_the_equilibria_of_the_lab_sheet(name, mass, kind):
    """On the side of the natural curvature; by deflation on another mesh (`tests/validation/elastica`)."""
    state = next(s for s in stem_equilibria(lab_stem(-1.0, kind), mass) if s.stable and s.tip[0] > 0.0)
    x, y, z = 0.1 * at_the_tip(name, POLAR if kind == "polar" else {})
    assert (x, y) == pytest.approx(state.tip, abs=2e-8)
    assert z == 0.0


def test_the_sheets_own_stem():
    """daisy_sheet is daisy_10g with the sheet's second moment: critical mass 6.32 g instead of 3.16 g."""
    own, bending = load("daisy_sheet"), load("daisy_10g")
    assert own.strip.second_moment == pytest.approx(circular_polar(2e-3), rel=1e-12)
    assert own.canonical()["strip"] == bending.canonical()["strip"] | {"second_moment": own.strip.second_moment}
    assert own.tip_load == pytest.approx(0.5 * bending.tip_load, rel=1e-12)
    assert own.notes() == ()
    for grams, above in ((6.32, False), (6.33, True)):  # about the bifurcation at 6.32136 g of the straight stem
        straight = own.replace({"strip.natural_curvature": 0.0, "tip.mass": grams * 1e-3})
        upright = solve_scene(straight, "elastica", options=Options(error=True))
        assert upright.native.status.value == ("unstable" if above else "converged")
        assert upright.shape.centreline(np.array([1.0]))[0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)


def test_newton_from_rest_ends_on_the_sheets_saddle():
    """Section 3.2 with 10 g: Newton from theta = pi/2 + kappa_0 s goes to the nearly upright, unstable equilibrium."""
    scene = load("daisy_sheet")
    s = np.linspace(0.0, 1.0, 101)
    result = solve_near(elastica_problem(scene), s, scene.curvature[0] * s)
    assert result is not None
    assert result.status.value == "unstable"
    saddle = next(one for one in stem_equilibria(lab_stem(-1.0, "polar"), 0.010) if not one.stable)
    assert 0.1 * embed(result, scene.position, scene.frame, np.array([1.0]))[0][:2] == pytest.approx(
        saddle.tip, abs=2e-8
    )
    assert saddle.tip == pytest.approx((-0.0091033, 0.0995060), abs=1e-7)  # results/daisy.md
    assert at_the_tip("daisy_sheet")[0] > 0.8  # what `solve` gives is the stable one


def test_both_sides_of_the_pitchfork():
    right, left = at_the_tip("daisy_straight"), at_the_tip("daisy_straight", {"seed.curvature": 10.0})
    assert right[0] > 0.5
    assert left == pytest.approx(right * [-1.0, 1.0, 1.0], abs=1e-8)
    upright = solve_scene(
        load("daisy_straight").replace({"seed.curvature": None}), "elastica", options=Options(error=True)
    )
    assert upright.native.status.value == "unstable"
    assert upright.start == "natural"


def test_a_load_without_dimensions_is_the_same():
    scene = load("daisy_5g")
    bare = {"strip.young": None, "strip.second_moment": None, "strip.gamma": 0.0, "tip.load": scene.tip_load}
    assert at_the_tip("daisy_5g", bare) == pytest.approx(at_the_tip("daisy_5g"), abs=1e-14)


def test_a_mass_on_a_strip_of_some_thickness():
    """Bends with D w; density and thickness give it weight besides."""
    scene = loads(text(SI, PLANAR, ELASTICA, {"tip.mass": "1e-6"}))
    stiffness = 1.8e9 * 1e-4**3 / (12 * 0.75) * 0.015
    assert scene.tip_load == pytest.approx(1e-6 * 9.81 * 0.25 / stiffness, rel=1e-12)
    assert scene.gamma > 0.0


BAD = [
    (STEM | {"tip.mass": "-0.001"}, "tip.mass", "must not be negative", "turn gravity.up"),
    (STEM | {"tip.load": "-1"}, "tip.load", "must not be negative", "turn gravity.up"),
    (STEM | {"tip.mass": "nan"}, "tip.mass", "is not finite", "kg"),
    (STEM | {"tip.mass": "1e300", "strip.young": "1e-9"}, "tip.mass", "out of range", "units"),
    (STEM | {"tip.mass": "1.0", "tip.load": "1.0"}, "tip.load", "conflicts with tip.mass", "remove"),
    (STEM | {"tip.weight": "1.0"}, "tip.weight", "is not a known key", "mass"),
    (STEM | LOAD | {"strip.young": None}, "strip.young", "is missing", "second_moment needs strip.young"),
    (STEM | LOAD | {"strip.gamma": "1.0"}, "strip.gamma", "conflicts", "strip.young"),
    (
        STEM | LOAD | {"strip.gamma": "1.0", "strip.young": None},
        "strip.second_moment", "conflicts with strip.gamma", "remove strip.gamma",
    ),
    (STEM | LOAD | {"strip.thickness": "1e-4"}, "strip.second_moment", "conflicts with strip.thickness", "remove"),
    (STEM | LOAD | {"strip.density": "1e3"}, "strip.second_moment", "conflicts with strip.density", "remove"),
    (STEM | LOAD | {"strip.second_moment": "0.0"}, "strip.second_moment", "greater than zero", "m^4"),
    (PLANAR | ELASTICA | {"tip.mass": "1.0"}, "strip.young", "is missing", "tip.load"),
    (
        PLANAR | ELASTICA | LOAD | {"gravity.up": None},
        "gravity.up", "is missing", "[tip] hangs along -up",
    ),
    (STEM | {"model.energy": None}, "model.energy", "that of a rod", '"elastica"'),
    (
        PLANAR | ELASTICA | LOAD | {"clamp.end.position": "[0.0, 0.0, 0.5]"},
        "tip", "clamp.end holds", "remove [tip]",
    ),
    (ELASTICA | LOAD, "model.energy", "gravity.up has the component 0.7071 along t_x", "wunderlich"),
    (PLANAR | {"model.arc_length": '"always"'}, "model.arc_length", "elastica only", "remove"),
    (PLANAR | ELASTICA | {"model.arc_length": '"allways"'}, "model.arc_length", "is not one of", "'always'"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "key", "problem", "remedy"), BAD, ids=[f"{c[1]}-{i}" for i, c in enumerate(BAD)])
def test_bad_tip(change, key, problem, remedy):
    error = fault(text(change))
    assert (error.key, problem in error.problem, remedy in error.remedy) == (key, True, True), str(error)


def test_ribbon_and_shell_say_which_model_knows_a_rod(tmp_path):
    scene = load("daisy_5g")
    refused = registry.model("ribbon").refusal(scene)
    assert refused.key == "strip.second_moment"
    assert "elastica" in str(refused)
    with pytest.raises(BadInput) as caught:
        compare(scene.replace({"shell.width_to_thickness": 10.0}), CaseStore(tmp_path), Reporter(quiet=True))
    assert caught.value.key == "strip.second_moment"
    assert "solve" in caught.value.remedy


def test_without_new_keys_a_scene_is_what_it_was():
    for name in ("cantilever", "curl_4_3"):
        document = json.dumps(load(name).canonical())
        for word in ("tip", "second_moment", "arc_length"):
            assert f'"{word}"' not in document


BACK = {"seed.curvature": 20.0, "path": [{"tip.mass": 0.006}]}


def test_a_path_back_under_the_limit_point_stops_and_offers_arc_length():
    """The branch beside the natural curvature ends at 3.74582 g (results/daisy.md)."""
    scene = load("daisy_5g").replace({"tip.mass": 0.003} | BACK)
    run = solve_scene(scene, "elastica", options=Options(error=True))
    assert (run.native.status.value, run.start) == ("limit_point", "path")
    assert "stage 1 of 1" in run.native.message
    assert "ElasticaOptions" in run.native.message
    assert message(run).endswith("--set model.arc_length=always")
    assert "ElasticaOptions" not in message(run)
    assert 6.0 - 3.0 * run.native.load_factor == pytest.approx(3.74582, abs=2e-3)
    assert run.shape.centreline(np.array([1.0]))[0, 0] < -0.2
    followed = solve_scene(scene.replace({"model.arc_length": "always"}), "elastica", options=Options(error=True))
    assert followed.native.status.value == "not_converged"
    assert "turns round at a limit point" in followed.native.message
    assert followed.native.limits == 1
    there = solve_scene(scene.replace({"tip.mass": 0.0045}), "elastica", options=Options(error=True))
    assert there.native.status.value == "converged"


def test_solve_writes_a_daisy(capsys, tmp_path):
    assert main(["solve", "daisy_5g", "--out", str(tmp_path), "--quiet"]) == 0
    found = json.loads((tmp_path / "result.json").read_text())
    load_at_tip = found["tip_load"]
    assert found["forces"]["start"] == pytest.approx([0.0, load_at_tip, 0.0], abs=1e-9)
    assert found["forces"]["end"] is None
    x, y, _ = found["end"]["position"]
    assert found["moments"]["start"] == pytest.approx([0.0, 0.0, load_at_tip * x], rel=1e-5)  # r x (0, -F)
    assert found["energy"]["tip"] == pytest.approx(load_at_tip * y, rel=1e-7)
    assert found["energy"]["total"] == pytest.approx(found["energy"]["elastic"] + found["energy"]["tip"], rel=1e-12)
    assert (tmp_path / "elastica.png").stat().st_size > 5000
    assert main(["report", str(tmp_path)]) == 0


def test_from_the_command_line(capsys, tmp_path):
    out = ["--out", str(tmp_path)]
    assert main(["solve", "daisy_5g", "--set", "tip.mass=-1", *out]) == 2
    assert "tip.mass" in capsys.readouterr().err
    assert main(["compare", "daisy_5g", *out]) == 2
    assert "second_moment" in capsys.readouterr().err
    assert main(["solve", "daisy_straight", "--set", "seed.curvature=natural", *out]) == 1


def test_explain_switches_the_effects_of_an_elastica_off(tmp_path, capsys):
    assert main(["explain", "daisy_5g", "--out", str(tmp_path)]) == DONE
    said = " ".join(capsys.readouterr().out.split())
    assert "load at the tip" in said
    result = json.loads((tmp_path / "result.json").read_text())
    on = {part["name"] for part in result["effects"] if part["on"]}
    assert on == {
        "planar bending", "load at the tip", "natural curvature", "second moment of area given", "arc length",
    }  # fmt: skip
    moved = {row["name"]: row["moves"] for row in result["without"]}
    assert set(moved) == {"load at the tip", "natural curvature"}
    # without the load the stem is the arc of its natural curvature: K l = -0.1, its end where the arc's is
    arc = np.array([1.0 - np.cos(0.1), np.sin(0.1)]) / 0.1
    end = np.array(result["end"]["position"])[:2]
    assert moved["load at the tip"] == pytest.approx(float(np.linalg.norm(end - arc)), abs=1e-6)
