"""Roman's confined strip (thesis, 6.2.2) and the curl of growing length (4.4) as shipped scenes, with their numbers."""

from __future__ import annotations

import itertools
import re

import numpy as np
import pytest

from compare.models import solve as solve_scene
from compare.models.base import Options
from compare.models.ribbon.build import ribbon_problem
from compare.scene.scene import load, loads, shipped
from ribbon import Equilibrium, switch
from tests.validation.ribbon.roman import folds, line_contact, press

NAMES = ("roman_6_2", "roman_plate", "roman_folds", "curl_4_4_short", "curl_4_4_long")
DELTA, GAMMA = 0.1, 10.0


@pytest.fixture(scope="module")
def solved() -> dict[str, Equilibrium]:
    return {name: solve_scene(load(name), "ribbon").native for name in NAMES}


@pytest.mark.parametrize("name", NAMES)
def test_they_end_in_a_stable_equilibrium(solved, name):
    found = solved[name]
    assert found.ok, found.message
    assert found.residual < 1e-8
    assert found.lowest_eigenvalue > 0.05


@pytest.mark.parametrize("name", NAMES)
def test_round_trip_and_comments(name):
    scene = load(name)
    assert loads(scene.to_toml(), scene.source) == scene
    for line in shipped()[name].read_text().splitlines():
        assert len(line) <= 120
        given = re.match(r'"?([\w.]+)"? = [^#]*(#.*)?$', line)
        if given is not None and given[1] != "title":
            assert given[2], f"no comment: {line}"


@pytest.mark.parametrize("name", ["roman_6_2", "roman_plate", "roman_folds"])
def test_roman_s_parameters(name):
    """Algorithm 3: w = 0.2, Gamma = 10, frames that are the identity, 1 - Delta apart."""
    scene = load(name)
    assert (scene.width, scene.gamma, scene.strip.poisson) == (0.2, GAMMA, 0.5)
    np.testing.assert_array_equal(scene.start_frame, np.eye(3))
    np.testing.assert_array_equal(scene.end_frame, np.eye(3))
    np.testing.assert_allclose(scene.end_position - scene.start_position, [0.0, 0.0, 1.0 - DELTA], atol=1e-15)
    assert [wall.name for wall in scene.walls] == ["floor", "roof"]


@pytest.mark.parametrize(
    ("name", "count", "height", "tolerance"), [("roman_6_2", 1, 0.185, 3e-3), ("roman_folds", 3, 0.0625, 0.02)]
)
def test_folds_and_force_of_roman_s_elastica(solved, name, count, height, tolerance):
    """Line contacts; the force on the roof is N times that of one fold of the elastica (eq. 6.3, with its weight)."""
    found = solved[name]
    seen = folds(found, height)
    assert seen.count == count
    assert seen.kind(1.01 / found.problem.lengths.size) == "line"
    exact = count * line_contact(height, DELTA, GAMMA, count).force
    assert press(found) == pytest.approx(exact, rel=tolerance)
    assert found.max_abs_eta < 1e-9


@pytest.mark.parametrize(
    ("name", "height"), [("roman_6_2", 0.185), pytest.param("roman_folds", 0.0625, marks=pytest.mark.validate)]
)
def test_virtual_work_and_balance(solved, name, height):
    found, scene = solved[name], load(name)
    h = 1e-4 * height
    near = []
    for k in (-2, -1, 1, 2):
        moved = scene.replace({"path": ()}).replace({"wall.roof.point": [0.0, height + k * h, 0.0]})
        near.append(switch(ribbon_problem(moved, "mixed"), found).energy.total)
    slope = (near[0] - 8.0 * near[1] + 8.0 * near[2] - near[3]) / (12.0 * h)
    assert -slope == pytest.approx(press(found), rel=1e-6)
    held = [wall.force for wall in found.walls] + [found.start.force, found.end_support.force]
    np.testing.assert_allclose(np.sum(held, axis=0), [0.0, GAMMA, 0.0], atol=1e-8)


def test_the_path_of_the_folds(solved):
    """One fold that snaps into two and those into three: the energy falls twice though the roof sinks."""
    log = solved["roman_folds"].log
    energies = [entry["energy"] for entry in log if entry["accepted"] and entry["stage"] == 2]
    falls = [a - b for a, b in itertools.pairwise(energies) if b < a]
    assert sum(fall > 1.0 for fall in falls) == 2
    assert log[-1]["stage"] == 4


def test_the_plate_exerts_what_the_roof_does(solved):
    plate, roof = solved["roman_plate"], solved["roman_6_2"]
    given = plate.walls[1].height
    assert given is not None
    height = 0.16746055999 - given
    # its place at rest is that of a force of 70.158, which contact at joints alone had given; the elastica's is 70.272
    assert height == pytest.approx(0.185, abs=(70.2723 - 70.158) / 4000.0)
    assert press(plate) == pytest.approx(-4000.0 * given, rel=1e-9)
    wall = switch(ribbon_problem(load("roman_6_2").replace({"wall.roof.point": [0.0, height, 0.0]}), "mixed"), plate)
    assert wall.ok
    assert press(wall) == pytest.approx(press(plate), rel=1e-8)
    assert press(roof) == pytest.approx(press(plate), rel=1e-3)


def test_the_curl_of_25_cm_is_planar(solved):
    """The ribbon is then the elastica; its groups from the thesis's SI data."""
    scene, found = load("curl_4_4_short"), solved["curl_4_4_short"]
    assert scene.gamma == pytest.approx(1000.0 * 1e-4 * 9.81 * 0.25**3 / 2e-4, rel=1e-12)
    assert scene.curvature == (15.0, 15.0)
    s = np.linspace(0.0, 1.0, 101)
    assert np.abs(found.position(s)[:, 0]).max() < 1e-9
    assert scene.is_planar()
    tip = solve_scene(scene, "elastica", options=Options(error=True)).shape.centreline(np.array([1.0]))[0]
    np.testing.assert_allclose(found.end.position, tip, atol=1e-4)
    assert found.energy.total == pytest.approx(-119.539, abs=1e-3)


def test_the_curl_of_40_cm_is_not(solved):
    scene, found = load("curl_4_4_long"), solved["curl_4_4_long"]
    assert scene.curvature == (24.0, 24.0)
    out = np.abs(found.position(np.linspace(0.0, 1.0, 401))[:, 0]).max()
    assert 100 * out * scene.strip.length == pytest.approx(3.31, abs=0.01)  # cm
    assert found.energy.total == pytest.approx(-322.591, abs=1e-3)
    np.testing.assert_allclose(found.start.force, [0.0, scene.gamma, 0.0], atol=1e-9)
