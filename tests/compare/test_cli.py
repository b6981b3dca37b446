"""The command line as a newcomer uses it, mistakes included: exit codes, one-line errors, nothing half-written."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from compare.cli import BAD_INPUT, DONE, MISSING, NOT_CONVERGED, main
from compare.scene import load, shipped

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
    assert {p.name for p in (tmp_path / "o").iterdir()} == {"result.json", "ribbon.png", "ribbon.vtu", "centreline.csv"}


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


def test_a_saddle_ends_with_exit_code_1(capsys, tmp_path):
    text = """
title = "on edge"
[strip]
length = 1.0
width = 0.02
poisson = 0.3
gamma = 40.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
[model]
energy = "sadowsky"
"""
    path = tmp_path / "edge.toml"
    path.write_text(text)
    code, out, _ = run(capsys, "solve", path, "--out", tmp_path / "o")
    assert code == NOT_CONVERGED
    assert "saddle" in out
    result = json.loads((tmp_path / "o" / "result.json").read_text())
    assert result["status"] == "saddle"
    assert result["stable"] is False


def test_explain_names_every_effect(capsys):
    code, out, _ = run(capsys, "explain", "curl_4_3")
    assert code == DONE
    for word in ("gravity", "natural curvature", "finite width", "rulings do not cross", "41 unknowns", "no elastica"):
        assert word in out
    code, out, _ = run(capsys, "explain", "cantilever")
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
