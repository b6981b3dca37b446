"""What users see of strips whose twist is free: fields, pages, files, estimate; end to end through the command line."""

from __future__ import annotations

import csv
import json

import meshio
import numpy as np
import pytest

from compare.cli import DONE, main
from compare.models import solve
from compare.models.ribbon.fields import stretching
from compare.models.ribbon.neglected_free import remaining
from compare.scene.scene import load
from ribbon.analysis.parts import parts

KEYS = {"model.energy": "finite", "model.elements": 10, "shell.width_to_thickness": [100.0]}
SET = ["--set", "model.energy=finite", "--set", "model.elements=10", "--set", "shell.width_to_thickness=[100]"]


@pytest.fixture(scope="module")
def scene():
    return load("curl_4_3").replace(KEYS)


@pytest.fixture(scope="module")
def state(scene):
    found = solve(scene, "ribbon")
    assert found.ok
    return found


def test_a_state_has_parts_and_no_rulings(scene, state):
    energy = state.energy
    assert dict(energy.parts) == parts(state.native)
    assert sum(energy.parts.values()) == pytest.approx(energy.elastic, rel=1e-12)
    assert state.numbers["knows_width"]
    assert 5.0 < state.numbers["max_abs_tau"] < 7.0
    assert not {"max_abs_eta", "max_abs_eta_prime_w_half"} & set(state.numbers)
    held = stretching(scene, state)
    assert sum(held.share.values()) == pytest.approx(1.0, abs=1e-12)
    assert 0.004 < held.share["membrane"] < 0.01
    assert sum(held.zones.values()) == pytest.approx(1.0, abs=1e-12)
    assert held.zones["edges"] > 0.9
    assert stretching(load("curl_4_3"), solve(load("curl_4_3"), "ribbon")) is None


def test_fields_are_those_of_the_section(state):
    s, v = np.linspace(0.0, 1.0, 101), np.linspace(-0.015, 0.015, 9)
    found = state.shape.fields(s, v)
    assert not {"eta", "ruling", "ruling_foot"} & set(found)
    assert found["tau"][:, 3] == pytest.approx(state.native.tau(s))
    whole = sum(found[f"{name}_energy"] for name in ("bending", "membrane", "shear"))
    assert found["energy_density"] == pytest.approx(whole - 50.0, abs=1e-9)
    assert found["membrane_share"].max() > 0.02
    points = state.shape.points(s, v)
    assert points[:, 4] == pytest.approx(state.shape.centreline(s), abs=1e-15)
    sagitta = np.linalg.norm(0.5 * (points[:, 0] + points[:, 8]) - points[:, 4], axis=1)
    assert sagitta.max() == pytest.approx(3.0e-4, rel=0.1)  # as a shell has it, 2.9e-4 (w/h = 100)


def test_the_estimate_counts_what_the_energy_leaves_out(scene, state):
    estimate = remaining(scene, state.native, 100.0)
    assert estimate.own == pytest.approx(estimate.parts["edges"] + estimate.parts["shear"])
    assert estimate.missing == pytest.approx(estimate.parts["in_plane"] + estimate.parts["tension"], abs=1e-12)
    assert estimate.missing < 1e-4
    assert 1.2e-3 < estimate.distance < 6e-3  # the shell: 1.2e-3
    loose = scene.replace({"model.energy": "extensible", "clamp.start.ruling": None})
    other = remaining(loose, solve(loose, "ribbon").native, 100.0)
    assert other.distance > 0.01  # the shell: 1.1e-2
    assert other.cause == "edges"
    assert other.parts["clamps"] > 1e-4


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    out = tmp_path_factory.mktemp("finite") / "solve"
    assert main(["solve", "curl_4_3", *SET, "--out", str(out), "--quiet"]) == DONE
    return out


def test_solve_says_twist_and_stretching(solved):
    result = json.loads((solved / "result.json").read_text())
    assert result["model"]["energy"] == "finite"
    assert result["max_abs_eta"] is None
    assert result["max_abs_tau"] == pytest.approx(5.8, abs=0.5)
    energy = result["energy"]
    assert energy["bending"] + energy["membrane"] + energy["shear"] == pytest.approx(energy["elastic"], rel=1e-12)
    assert sum(result["share"].values()) == pytest.approx(1.0)
    assert set(result["zones"]) == {"clamps", "edges", "rest"}
    page = json.loads((solved / "page.json").read_text())
    quantities = {row[0] for row in page["tables"][0]["rows"]}
    assert {"largest |tau|", "stretching"} <= quantities
    assert "largest |eta|" not in quantities
    header = (solved / "centreline.csv").read_text().splitlines()[0].split(",")
    assert header[:6] == ["s", "x", "y", "z", "omega", "tau"]
    with np.load(solved / "ribbon.npz") as arrays:
        assert arrays["curvature_parameters"].shape == (10, 4)
        assert not {"parameters", "line_eta", "line_ruling"} & set(arrays)
    mesh = meshio.read(solved / "ribbon.vtu")
    assert {"tau", "omega", "membrane_energy", "normal"} <= set(mesh.point_data)


def test_export_and_report(solved, tmp_path):
    assert main(["export", str(solved), "--out", str(tmp_path / "e"), "--scale", "2", "--quiet"]) == DONE
    assert (tmp_path / "e" / "surfaces.glb").stat().st_size > 10_000
    with (tmp_path / "e" / "centreline.csv").open() as file:
        rows = list(csv.DictReader(file))
    own = np.loadtxt(solved / "centreline.csv", delimiter=",", skiprows=1)
    assert "ruling_x" not in rows[0]
    assert float(rows[200]["tau"]) == pytest.approx(own[200, 5] / 2.0, rel=1e-9)
    assert float(rows[200]["membrane_energy"]) > 0.0
    segments = (tmp_path / "e" / "segments.csv").read_text().splitlines()
    assert segments[0] == "segment,start,length,a,b,n,m,x,y,z"
    first = [float(cell) for cell in segments[1].split(",")]
    assert first[6] * 2.0 == pytest.approx(own[0, 5], abs=1e-9)  # m of tau, per length
    assert main(["report", str(solved), "--out", str(tmp_path / "r"), "--quiet"]) == DONE
    assert "twist tau (1/l)" in (tmp_path / "r" / "report.html").read_text()


def test_a_quick_limit_names_the_energy(tmp_path):
    assert main(["limits", "curl_4_3", "--quick", *SET, "--out", str(tmp_path), "--quiet"]) == DONE
    result = json.loads((tmp_path / "result.json").read_text())
    assert "inextensible" not in json.dumps(result["answer"])
    assert "finite" in json.dumps(result["answer"])
    assert result["rows"][0]["estimate"]["level"] == "good"
