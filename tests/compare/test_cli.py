"""The command line as a newcomer uses it, mistakes included: exit codes, one-line errors, nothing half-written."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import simpson

from compare.cli import BAD_INPUT, DONE, MISSING, NOT_CONVERGED, main
from compare.scene.scene import load, shipped
from tests.compare.scene import held_scenes

GOOD = load("coil_10_100").to_toml()


@pytest.fixture
def scene(tmp_path):
    """Writes a scene made from a shipped one with a text replaced."""

    def write(old="", new="", name="mine"):
        text = GOOD
        assert old in text, old
        path = tmp_path / f"{name}.toml"
        path.write_text(text.replace(old, new, 1))
        return str(path)

    return write


def run(capsys, *arguments):
    code = main([str(a) for a in arguments])
    out = capsys.readouterr()
    return code, out.out, out.err


def test_solve_writes_the_contract_and_says_what_it_found(capsys, tmp_path):
    code, out, _ = run(capsys, "solve", "coil_10_100", "--out", tmp_path / "o")
    assert code == DONE
    assert "stable equilibrium" in out
    result = json.loads((tmp_path / "o" / "result.json").read_text())
    assert result["status"] == "converged"
    assert result["stable"] is True
    assert result["residual"] < 1e-8
    assert result["energy"]["total"] == pytest.approx(-54.4933, abs=1e-3)
    assert result["end"]["position"] == pytest.approx([-0.27985, -0.16849, 0.13149], abs=1e-4)
    assert 0 < result["discretisation_error"] < 1e-3
    assert result["model"] == {**result["model"], "energy": "sadowsky", "formulation": "chained", "elements": 10}
    names = {"result.json", "page.json", "ribbon.png", "ribbon.vtu", "ribbon.npz", "centreline.csv"}
    assert {p.name for p in (tmp_path / "o").iterdir()} == names


def test_quiet_says_nothing(capsys, tmp_path):
    code, out, err = run(capsys, "solve", "coil_10_100", "--out", tmp_path / "o", "--quiet")
    assert (code, out, err) == (DONE, "", "")


def test_assignments_change_the_scene(capsys, tmp_path):
    code, _, _ = run(
        capsys,
        "solve",
        "coil_10_100",
        "--out",
        tmp_path,
        "--quiet",
        "--set",
        "strip.gamma=0.0",
        "--set",
        "model.elements=4",
    )
    assert code == DONE
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["model"]["elements"] == 4
    assert result["energy"]["gravity"] == 0.0
    assert result["energy"]["elastic"] == pytest.approx(-50.0, rel=1e-9)


def test_elastica_scene_is_solved_by_the_elastica(capsys, tmp_path):
    moved = ("--set", "clamp.start.position=[0.3, -0.2, 0.5]")
    code, _, _ = run(capsys, "solve", "cantilever", "--set", "model.energy=elastica", "--out", tmp_path, *moved)
    assert code == DONE
    elastica = json.loads((tmp_path / "result.json").read_text())
    assert elastica["model"]["energy"] == "elastica"
    code, _, _ = run(capsys, "solve", "cantilever", "--out", tmp_path / "ribbon", "--quiet", *moved)
    ribbon = json.loads((tmp_path / "ribbon" / "result.json").read_text())
    assert code == DONE
    assert ribbon["end"]["position"] == pytest.approx(elastica["end"]["position"], abs=2e-5)
    for a, b in zip(ribbon["end"]["frame"], elastica["end"]["frame"], strict=True):
        assert a == pytest.approx(b, abs=1e-3)
    assert ribbon["energy"]["total"] == pytest.approx(elastica["energy"]["total"], abs=1e-4)
    assert ribbon["forces"]["start"] == pytest.approx(elastica["forces"]["start"], abs=1e-12)
    assert ribbon["moments"]["start"] == pytest.approx(elastica["moments"]["start"], abs=1e-3)


def test_a_visible_discretisation_error_comes_with_a_remedy(capsys, tmp_path):
    uniform = ("solve", "curl_4_3", "--out", tmp_path, "--set", "model.grading=uniform")
    assert 'model.grading = "clamp"' in run(capsys, *uniform)[1]
    coarse = ("solve", "coil_40_1200", "--out", tmp_path, "--set", "model.elements=12")
    assert "raise model.elements" in run(capsys, *coarse)[1]
    assert "permille" not in run(capsys, "solve", "curl_4_3", "--out", tmp_path)[1]


@pytest.fixture
def solved(capsys, tmp_path):
    """Solves the scene of a text with more arguments; exit code, what was printed, result.json and its folder."""

    def solve(text, *arguments):
        path = tmp_path / "scene.toml"
        path.write_text(text)
        code, out, err = run(capsys, "solve", path, "--out", tmp_path / "o", *arguments)
        assert err.count("\n") <= 1 or "ribbonbench:" not in err
        return code, out, json.loads((tmp_path / "o" / "result.json").read_text()), tmp_path / "o"

    return solve


def test_a_saddle_ends_with_exit_code_1(solved):
    code, out, result, _ = solved(held_scenes.ON_EDGE, "--stay")
    assert code == NOT_CONVERGED
    assert "saddle" in out
    assert "--leave-saddle" in out
    assert result["status"] == "saddle"
    assert result["stable"] is False
    assert result["lowest_eigenvalue"] < 0
    assert result["discretisation_error"] is None


def test_leave_saddle_ends_in_a_stable_state_of_lower_energy(solved):
    """A strip on edge above its critical weight (Gamma = 30) turns over sideways."""
    code, _, result, _ = solved(held_scenes.ON_EDGE, "--leave-saddle")
    assert code == DONE
    assert result["stable"] is True
    assert result["energy"]["total"] < -0.1
    assert result["max_abs_eta"] > 0.1
    assert abs(result["end"]["position"][2]) > 0.1


def test_a_saddle_is_left_unless_it_is_to_stay(solved):
    """Either way sideways is as good: a symmetric saddle, of which the answer says that it was left."""
    code, out, result, _ = solved(held_scenes.ON_EDGE)
    assert (code, result["status"], result["stable"]) == (DONE, "converged", True)
    assert result["left_saddle"]["mirrored"] is True
    assert result["left_saddle"]["above"] == pytest.approx(-result["energy"]["total"], rel=1e-6)  # it stood at 0
    assert "saddle" in out
    assert "mirror image" in out


def test_leave_saddle_is_refused_for_the_elastica(capsys, tmp_path):
    arguments = ("--set", "model.energy=elastica", "--leave-saddle", "--out", tmp_path / "o")
    code, _, err = run(capsys, "solve", "cantilever", *arguments)
    assert code == BAD_INPUT
    assert "--leave-saddle" in err


def test_two_clamps_balance_the_weight(solved):
    """Forces and moments (about the origin) of both clamps and the weight add up to nothing."""
    code, out, result, folder = solved(held_scenes.TWO_CLAMPS)
    assert code == DONE
    forces, moments = result["forces"], result["moments"]
    weight = np.array([0.0, 0.0, -20.0])
    assert np.abs(np.array(forces["start"]) + forces["end"] + weight).max() < 1e-8
    line = np.loadtxt(folder / "centreline.csv", delimiter=",", skiprows=1)[:, 1:4]
    centroid = simpson(line, x=np.linspace(0.0, 1.0, len(line)), axis=0)
    total = np.array(moments["start"]) + moments["end"] + np.cross([0.7, 0.1, 0.0], forces["end"])
    assert np.abs(total + np.cross(centroid, weight)).max() < 1e-6
    assert result["end"]["position"] == pytest.approx([0.7, 0.1, 0.0], abs=1e-9)
    assert result["model"]["formulation"] == "mixed"
    assert "a clamp at the end" in result["model"]["why"]
    assert result["model"]["constraints"] == 8 * 16 + 6
    assert result["model"]["unknowns"] == 10 * 16 + 9 - 7
    assert "force at s = l" in out
    assert "path" not in result
    assert "plates" not in result["energy"]


def test_a_closed_circle(solved):
    code, _, result, _ = solved(held_scenes.CIRCLE)
    assert code == DONE
    assert result["energy"]["total"] == pytest.approx(2 * math.pi**2, rel=1e-10)
    assert result["forces"]["start"] == pytest.approx([0.0, 0.0, 0.0])
    assert result["forces"]["end"] is None
    assert result["moments"]["end"] is None
    assert result["discretisation_error"] < 1e-9
    gap = np.subtract(result["end"]["position"], 2 * np.array(result["middle"]["position"]))
    assert np.linalg.norm(gap) == pytest.approx(2 / math.pi, rel=1e-6)


def test_a_moebius_band_from_its_kind_alone(solved):
    """w/l = 1/30; the energy lies a few per cent above the 5.9 pi^2 of long bands on a coarse mesh."""
    code, _, result, _ = solved(held_scenes.MOEBIUS)
    assert code == DONE
    assert result["residual"] < 1e-8
    assert result["stable"] is True
    assert result["energy"]["total"] / math.pi**2 == pytest.approx(5.93, abs=0.05)
    assert result["discretisation_error"] < 0.01


def test_a_wall_carries_part_of_the_weight(solved):
    code, out, result, _ = solved(held_scenes.FLOOR)
    assert code == DONE
    (floor,) = result["walls"]
    assert floor["name"] == "floor"
    assert floor["height"] is None
    assert floor["force"][:2] == [0.0, 0.0]
    assert floor["force"][2] > 1.0
    assert result["forces"]["walls"] == [floor["force"]]
    assert result["forces"]["start"][2] + floor["force"][2] == pytest.approx(40.0, abs=1e-8)
    assert 0.5 < min(floor["contacts"]) <= max(floor["contacts"]) <= 1.0
    assert "force of wall floor" in out


def test_a_pressure_plate_gives_way(solved):
    text = held_scenes.FLOOR.replace('name = "floor"\n', "stiffness = 100.0\n")
    code, _, result, _ = solved(text)
    assert code == DONE
    (plate,) = result["walls"]
    assert plate["name"] == "0"
    assert plate["force"][2] == pytest.approx(-100.0 * plate["height"], rel=1e-6)
    assert result["energy"]["plates"] == pytest.approx(50.0 * plate["height"] ** 2, rel=1e-9)
    parts = result["energy"]
    assert parts["total"] == pytest.approx(parts["elastic"] + parts["gravity"] + parts["plates"], abs=1e-12)


def test_a_path_is_logged(solved):
    code, out, result, folder = solved(held_scenes.PATH)
    assert code == DONE
    path = result["path"]
    assert path["stages"] == 3
    assert path["steps"] + path["rejected"] == len(path["log"])
    assert path["steps"] >= 5
    assert path["resumed"] is False
    assert "3 stages" in out
    rows = (folder / "path.csv").read_text().splitlines()
    assert len(rows) == len(path["log"]) + 1
    assert list(folder.rglob("path_state.npz")) == []


def test_a_tolerance_places_the_segments(solved):
    code, out, result, _ = solved(held_scenes.TWO_CLAMPS.replace("elements = 16", "tolerance = 1e-3"))
    assert code == DONE
    assert 0.0 < result["tolerance_error"] <= 1e-3
    assert result["discretisation_error"] == result["tolerance_error"]
    assert result["model"]["elements"] > 16
    lengths = result["model"]["element_lengths"]
    assert max(lengths) > 1.9 * min(lengths)
    assert "of the placed segments" in out


def test_compare_refuses_what_the_shell_cannot_do(capsys, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(held_scenes.FLOOR.replace("[strip]", "[strip]\nsecond_moment = 1e-12"))
    code, _, err = run(capsys, "compare", path, "--out", tmp_path / "o")
    assert code == BAD_INPUT
    assert "second_moment" in err
    assert not (tmp_path / "o").exists()


def test_explain_names_every_effect(capsys):
    code, out, _ = run(capsys, "explain", "curl_4_3", "--wide")
    assert code == DONE
    for word in ("gravity", "natural curvature", "finite width", "rulings do not cross", "41 unknowns", "no elastica"):
        assert word in out
    code, out, _ = run(capsys, "explain", "cantilever", "--wide")
    assert "planar" in out
    assert "naturally flat" in out


def test_scenes_lists_all(capsys):
    code, out, _ = run(capsys, "scenes")
    assert code == DONE
    for name in shipped():
        assert name in out


def test_no_command_prints_the_help(capsys):
    code, out, _ = run(capsys)
    assert code == BAD_INPUT
    assert "compare" in out
    assert run(capsys, "--version")[1].startswith("ribbonbench ")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("width = 0.03", "widht = 0.03", ("strip.widht", "strip.width")),
        ("length = 1.0", "", ("strip.length",)),
        ("width = 0.03", 'width = "thin"', ("strip.width", "thin")),
        ("width = 0.03", "width = nan", ("strip.width", "nan")),
        ("gamma = 100.0", "gamma = inf", ("strip.gamma", "inf")),
        ("width = 0.03", "width = 1.5", ("strip.width", "1.5")),
        ("width = 0.03", "width = 0.03\nthickness = 0.1", ("strip.thickness", "0.1")),
        ("poisson = 0.4", "poisson = 0.7", ("strip.poisson", "0.7")),
        ("tangent = [0.0, 0.0, 1.0]", "tangent = [0.0, 0.1, 1.0]", ("clamp.start.tangent",)),
        ("elements = 10", "elements = 0", ("model.elements", "0")),
        ('energy = "sadowsky"', 'energy = "sadovsky"', ("model.energy", "sadovsky", "sadowsky")),
        ("[strip]", "[strip", ("TOML",)),
    ],
)
@pytest.mark.parametrize("command", ["solve", "compare", "explain"])
def test_bad_scenes_are_one_line_and_exit_code_2(capsys, scene, tmp_path, command, old, new, words):
    out = tmp_path / "results"
    arguments = [command, scene(old, new)] + ([] if command == "explain" else ["--out", out])
    code, _, err = run(capsys, *arguments)
    assert code == BAD_INPUT
    assert err.count("\n") == 1
    assert "Traceback" not in err
    for word in words:
        assert word in err
    assert not out.exists()


def test_young_must_be_positive(capsys, scene, tmp_path):
    path = scene("gamma = 100.0", "young = 0.0\ndensity = 1000.0\nthickness = 1e-4")
    code, _, err = run(capsys, "solve", path, "--out", tmp_path / "o")
    assert code == BAD_INPUT
    assert "strip.young" in err


def test_missing_and_unreadable_files(capsys, tmp_path):
    for path in (tmp_path / "nowhere.toml", tmp_path):
        code, _, err = run(capsys, "solve", path)
        assert code == BAD_INPUT
        assert err.count("\n") == 1
    code, _, err = run(capsys, "solve", "curl_43")
    assert code == BAD_INPUT
    assert "curl_4_3" in err


@pytest.mark.parametrize("command", ["solve", "compare"])
def test_output_folder_that_cannot_be_written(capsys, tmp_path, command):
    (tmp_path / "file").write_text("in the way")
    code, _, err = run(capsys, command, "curl_4_3", "--out", tmp_path / "file" / "o")
    assert code == BAD_INPUT
    assert "--out" in err
    assert (tmp_path / "file").read_text() == "in the way"


def test_bad_assignments(capsys, tmp_path):
    for text, word in (("strip.gamma", "--set"), ("strip.gama=3", "strip.gamma"), ("strip.gamma=-3", "strip.gamma")):
        code, _, err = run(capsys, "solve", "curl_4_3", "--out", tmp_path / "o", "--set", text)
        assert code == BAD_INPUT
        assert word in err
        assert not (tmp_path / "o").exists()


def test_compare_without_a_thickness_names_the_key(capsys, tmp_path):
    code, _, err = run(capsys, "compare", "coil_10_100", "--out", tmp_path / "o")
    assert code == BAD_INPUT
    assert "shell.width_to_thickness" in err
    assert not (tmp_path / "o").exists()


def test_dolfinx_missing_is_exit_code_3_with_the_remedy(tmp_path):
    """A Python without dolfinx: a package of that name that cannot be imported stands in its way."""
    fake = tmp_path / "fake" / "dolfinx"
    fake.mkdir(parents=True)
    (fake / "__init__.py").write_text("raise ModuleNotFoundError(\"No module named 'dolfinx'\", name='dolfinx')\n")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "fake")}
    done = subprocess.run(
        [sys.executable, "-m", "compare.cli", "compare", "curl_4_3", "--out", str(tmp_path / "o"), "--quiet"],
        capture_output=True, text=True, env=environment, check=False, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == MISSING, done.stderr
    lines = [line for line in done.stderr.splitlines() if line]
    assert len(lines) == 1
    assert "dolfinx" in lines[0]
    assert "make setup" in lines[0] or "apt-get install" in lines[0]
    assert not (tmp_path / "o" / "result.json").exists()
