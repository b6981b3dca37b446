"""The scenes of the thesis's chapter 7, where the inextensible ribbon meets its limits: numbers, compare end to end.

7.1 lateral_7_1, 7.2 shift_7_2, 7.3 limits_7_3.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from compare.models import solve as solve_scene
from compare.models.scope import require_shell
from compare.models.shell_build import shell_problem
from compare.models.shell_process import run_shell
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import compare
from compare.studies.effects import explain
from ribbon import Equilibrium, refine

# name: w/l, nu, Gamma, elements, w/h of the shells
NUMBERS = {
    "shift_7_2": (0.05, 0.35, 0.0, 100, (50, 100, 200)),
    "lateral_7_1": (0.05, 0.35, 40.0, 40, (50,)),
    "limits_7_3": (0.1, 0.4, 100.0, 40, (100,)),
}

# name: energy on the scene's elements, and on twice as many (on four times: 23.338233, -1.591917, -32.616094)
ENERGIES = {
    "shift_7_2": (23.347717, 23.340199),
    "lateral_7_1": (-1.587602, -1.591044),
    "limits_7_3": (-32.616025, -32.616079),
}


@cache
def equilibrium(name: str) -> Equilibrium:
    return solve_scene(load(name), "ribbon").native


@pytest.mark.parametrize("name", NUMBERS)
def test_parameters(name):
    width, poisson, gamma, elements, ratios = NUMBERS[name]
    scene = load(name)
    assert scene.title != name
    assert scene.notes() == ()
    assert (scene.width, scene.strip.poisson, scene.gamma) == (width, poisson, gamma)
    assert scene.model.elements == elements
    assert require_shell(scene) == pytest.approx(ratios)
    assert scene.model.energy == "wunderlich"
    assert scene.curvature == (0.0, 0.0)


def test_frames():
    shift = load("shift_7_2")
    frame = np.column_stack([[0, 1, 0], [0, 0, 1], [1, 0, 0]])  # t_x = e_y, t_y = e_z, t_z = e_x
    assert np.array_equal(shift.start_frame, frame)
    assert np.array_equal(shift.end_frame, frame)
    assert shift.end_position == pytest.approx([0.5, 0.1, 0.0])
    assert {shift.clamp_start.ruling, shift.clamp_end.ruling} == {"straight"}
    lateral = load("lateral_7_1")
    assert lateral.clamp_start.ruling == "straight"
    assert lateral.frame[:, 0] == pytest.approx([0, 0, -1])  # the width is vertical
    assert lateral.frame[:, 2] == pytest.approx([1, 0, 0])
    rolled = lateral.stages()[0].frame
    assert math.acos(np.clip(rolled[:, 1] @ lateral.frame[:, 1], -1, 1)) == pytest.approx(0.4)
    limits = load("limits_7_3")
    assert limits.frame[:, 2] == pytest.approx([1, 0, 0])
    assert abs(limits.frame[:, 0] @ [0, 0, 1]) == pytest.approx(math.sqrt(0.5))
    assert limits.shell_corner == 0.01


def test_the_critical_weight_of_the_shell_in_7_1_is_passed():
    scene = load("lateral_7_1")
    nu = scene.strip.poisson
    assert 18.2 * (1 - nu) * math.sqrt(1 + nu) + 14.5 * scene.width == pytest.approx(14.5, abs=0.05)
    assert scene.gamma > 2 * 14.5


@pytest.mark.parametrize("name", NUMBERS)
def test_ribbon(name):
    e = equilibrium(name)
    assert e.ok
    assert e.stable
    assert e.residual < 1e-9
    coarse, fine = ENERGIES[name]
    assert e.energy.total == pytest.approx(coarse, abs=2e-6)
    finer = refine(e)
    assert finer.ok
    assert finer.energy.total == pytest.approx(fine, abs=2e-6)
    assert fine < coarse
    scene = load(name)
    weight = np.zeros(3) if scene.up is None else scene.gamma * scene.up
    other = np.zeros(3) if e.end_support is None else e.end_support.force
    assert e.start.force + other == pytest.approx(weight, abs=1e-6)


def test_the_arch_of_7_2_stands_and_is_symmetric():
    """Region U of figure 7.6: half a turn about the vertical through the middle maps the arch onto itself."""
    e = equilibrium("shift_7_2")
    assert e.middle.position == pytest.approx([0.25, 0.05, 0.36903], abs=2e-5)
    s = np.linspace(0, 1, 101)
    turned = np.array([0.5, 0.1, 0.0]) + e.position(1 - s) * [-1, -1, 1]
    assert np.abs(turned - e.position(s)).max() < 1e-9


def test_the_strip_of_7_1_has_fallen_over():
    e = equilibrium("lateral_7_1")
    assert e.end.position == pytest.approx([0.3131, -0.6869, -0.4260], abs=1e-3)


def test_what_explain_says_of_the_shell():
    assert "both ends" in explain(load("shift_7_2")).shell
    assert "corners" in explain(load("limits_7_3")).shell
    assert explain(load("moebius_6_1")).shell.startswith("none: shell.width_to_thickness")
    assert explain(load("moebius_table_edge")).shell.startswith("none: shell.width_to_thickness")
    table = load("moebius_table_edge").replace({"shell.width_to_thickness": 50})
    assert "walls" in explain(table).shell


# -- beside shells ----------------------------------------------------------------------------------------------------


def compared(name, tmp_path, keys):
    pytest.importorskip("dolfinx")
    found = compare(load(name).replace(keys), CaseStore(tmp_path), Reporter(quiet=True))
    assert found.ok, [row.message for row in found.rows]
    return found


@pytest.mark.shell
def test_shells_of_7_2_tend_to_the_ribbon(tmp_path):
    found = compared("shift_7_2", tmp_path, {"shell.width_to_thickness": [50, 200], "shell.elements": [40, 4]})
    assert [row.start for row in found.rows] == ["ribbon", "ribbon"]
    assert [row.hausdorff for row in found.rows] == pytest.approx([4.08e-3, 1.76e-3], rel=0.1)
    assert all(row.claimed for row in found.rows)
    assert 0.5 < found.slope.value < 0.75
    assert found.rows[1].shell_middle["position"] == pytest.approx([0.25, 0.05, 0.3690], abs=1e-4)
    assert found.rows[0].share["membrane"] == pytest.approx(0.0139, rel=0.1)


@pytest.mark.shell
def test_the_shell_of_7_1_is_far_from_the_ribbon(tmp_path):
    """It loses stability at less weight (14.5, the ribbon between 20 and 25), and hangs another way."""
    found = compared("lateral_7_1", tmp_path, {"shell.elements": [40, 4]})
    (row,) = found.rows
    assert row.start == "ribbon"
    assert row.hausdorff == pytest.approx(0.153, abs=3e-3)
    assert row.claimed
    assert row.shell_end["position"] == pytest.approx([0.364, -0.577, -0.519], abs=5e-3)
    assert row.share["membrane"] == pytest.approx(0.104, abs=0.01)


@pytest.mark.shell
def test_between_both_critical_weights_only_the_shell_of_7_1_falls(tmp_path):
    pytest.importorskip("dolfinx")
    for gamma, fallen in ((12.5, False), (18.0, True)):
        keys = {"strip.gamma": gamma, "model.elements": 10, "shell.elements": [24, 3]}
        scene = load("lateral_7_1").replace(keys)
        assert abs(solve_scene(scene, "ribbon").native.end.position[1]) < 1e-6
        case = run_shell(shell_problem(scene, 50.0), CaseStore(tmp_path))
        assert case.ok
        assert (abs(case.data["end"]["position"][1]) > 0.2) == fallen


@pytest.mark.shell
def test_the_shell_of_7_3_bulges_between_its_corners(tmp_path):
    found = compared("limits_7_3", tmp_path, {"shell.elements": [40, 6]})
    (row,) = found.rows
    assert row.start == "ribbon (as the coarse path)"
    assert row.hausdorff == pytest.approx(0.0385, abs=1.5e-3)
    assert row.claimed
    assert row.share["membrane"] + row.share["shear"] == pytest.approx(0.0255, abs=0.003)
    surface = found.shells[0].shape.surface
    edge = surface.evaluate(np.zeros(9), np.linspace(-0.05, 0.05, 9))
    assert np.abs(edge @ [1, 0, 0]).max() > 1e-6 or np.abs(edge @ load("limits_7_3").frame[:, 1]).max() > 1e-4
    assert np.abs(edge[[0, -1]] @ load("limits_7_3").frame[:, 1]).max() < 1e-12
