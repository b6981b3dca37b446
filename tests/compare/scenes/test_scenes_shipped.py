"""The scenes that come with the package: their numbers, and that every key carries its unit and meaning."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from compare.models.scope import require_shell
from compare.scene.scene import load, loads, shipped
from shellref.elastica.solve import ElasticaProblem, ElasticaStatus, solve, to_plane

HALF = math.sqrt(0.5)
THESIS_FRAME = np.column_stack([[HALF, HALF, 0.0], [-HALF, HALF, 0.0], [0.0, 0.0, 1.0]])

# name: K, Gamma, w/l, nu, energy, elements
EXPECTED = {
    "curl_4_3": (10.0, 100.0, 0.03, 0.4, "wunderlich", 20),
    "curl_4_3_down": (-10.0, 100.0, 0.03, 0.4, "wunderlich", 20),
    "coil_10_100": (10.0, 100.0, 0.03, 0.4, "sadowsky", 10),
    "coil_40_1200": (40.0, 1200.0, 0.03, 0.4, "sadowsky", 20),
    "coil_100_7500": (100.0, 7500.0, 0.03, 0.4, "sadowsky", 20),
    "figure_4_1": (15.0, 613.125, 0.03, 0.5, "sadowsky", 20),
    "cantilever": (0.0, 10.0, 0.05, 0.4, "wunderlich", 20),
}


#: Scenes whose numbers are asserted in the other test_scenes_*: chapter5, moebius, roman, limits, daisy, published.
ELSEWHERE = {
    *("arc_5_1", "hanging_5_3_1", "two_clamps_5_3_2", "two_clamps_5_3_2_level", "two_clamps_5_3_2_twist"),
    *(f"start_5_3_3_{k}" for k in range(1, 6)),
    *("moebius_6_1", "moebius_6_1_clamped", "moebius_6_1_straight", "moebius_narrow", "moebius_wide"),
    *("moebius_table_edge", "moebius_table_fallen", "roman_6_2", "roman_folds", "roman_plate"),
    *("curl_4_4_short", "curl_4_4_long"),
    *("lateral_7_1", "shift_7_2", "limits_7_3"),
    *("daisy_5g", "daisy_10g", "daisy_straight", "daisy_sheet"),
    *("edge_published", "jfig_5_2", "rod_4_5", "bend_45", "roll_up"),
    *("tape_4_1", "tape_4_1_equal", "tape_4_2"),
    *("ring_twisted", "rod_wrung"),
    *("curled_end", "pretwisted_macneal", "slit_annulus"),
}


def test_the_list_is_complete():
    assert set(shipped()) == set(EXPECTED) | ELSEWHERE
    tested = "".join(
        path.read_text() for path in Path(__file__).parent.glob("test_scenes_*.py") if path != Path(__file__)
    )
    for name in ELSEWHERE:
        assert name in tested or name[:-1] in tested, name


@pytest.mark.parametrize("name", EXPECTED)
def test_parameters(name):
    curvature, gamma, width, poisson, energy, elements = EXPECTED[name]
    scene = load(name)
    assert scene.name == name
    assert scene.title != name
    assert scene.curvature == (curvature, curvature)
    assert scene.gamma == pytest.approx(gamma, rel=1e-13)
    assert scene.width == pytest.approx(width, rel=1e-15)
    assert scene.strip.poisson == poisson
    assert scene.model.energy == energy
    assert scene.model.elements == elements
    assert scene.position.tolist() == [0.0, 0.0, 0.0]
    assert scene.notes() == ()


@pytest.mark.parametrize("name", sorted(set(EXPECTED) - {"cantilever"}))
def test_clamp_of_3_5_2(name):
    """t_z = e_z, t_x = (e_x + e_y)/sqrt 2, up = e_x: not planar."""
    scene = load(name)
    np.testing.assert_allclose(scene.frame, THESIS_FRAME, atol=1e-16)
    assert scene.up.tolist() == [1.0, 0.0, 0.0]
    assert not scene.is_planar()
    assert scene.seed_curvature == scene.curvature
    assert scene.seed.ruling == (0.0, 0.0)


def test_shell_runs():
    assert require_shell(load("curl_4_3")) == (10.0, 20.0, 50.0, 100.0, 200.0)
    assert require_shell(load("curl_4_3_down")) == (10.0, 20.0, 50.0, 100.0, 200.0)
    assert require_shell(load("cantilever")) == (20.0, 50.0, 100.0, 200.0)
    assert require_shell(load("figure_4_1")) == (pytest.approx(150.0),)


def test_the_two_curls_differ_by_the_sign_only():
    up, down = load("curl_4_3"), load("curl_4_3_down")
    assert up.replace({"strip.natural_curvature": [-10.0, -10.0]}).canonical() == down.canonical()
    # positive curvature turns the tangent towards -t_y, here upwards
    assert -up.frame[:, 1] @ up.up > 0.7


UNITS = {
    "length": r"\bm\b|the unit of length",
    "width": r"\bm\b|in the unit of length",
    "thickness": r"\bm\b|in the unit of length",
    "position": r"\bm\b|in the unit of length",
    **dict.fromkeys(("natural_curvature", "natural_twist", "natural_geodesic_curvature"), r"1/m|1/length"),
    "curvature": r"1/m|1/length|natural curvature",
    "young": r"\bPa\b",
    "density": r"kg/m\^3",
    "acceleration": r"m/s\^2",
    "second_moment": r"m\^4",
    "elements": "number of",
    "bending": "unit of stiffness|in D w",
    "torsion": "same unit|in D w",
    "twist": "rad",
    **dict.fromkeys(("poisson", "gamma", "up", "tangent", "normal", "width_to_thickness"), "no unit"),
}


@pytest.mark.parametrize("name", sorted(shipped()))
def test_every_key_carries_its_unit_and_meaning(name):
    assignments = 0
    for line in shipped()[name].read_text().splitlines():
        assert len(line) <= 120
        found = re.match(r"(\w+) = [^#]*(#.*)?$", line)
        if found is None or found[1] == "title":
            continue
        assignments += 1
        assert found[2], f"no comment: {line}"
        assert len(found[2]) > 8, f"no meaning: {line}"
        assert re.search(UNITS.get(found[1], ""), found[2]), f"no unit: {line}"
    assert assignments >= 6


@pytest.mark.parametrize("name", EXPECTED)
def test_round_trip(name):
    scene = load(name)
    assert loads(scene.to_toml(), scene.source) == scene


def test_the_cantilever_is_planar_and_solved_by_the_elastica():
    """Its elastica: reach and drop at Gamma = 10 (collocation to 1e-10 in shellref's tests gives the same)."""
    scene = load("cantilever")
    assert scene.is_planar()
    up, across = to_plane(scene.frame, scene.up)
    assert across == 0.0
    result = solve(ElasticaProblem(scene.gamma, up, scene.curvature), 40)
    assert result.status is ElasticaStatus.CONVERGED
    assert result.error is not None
    assert result.error < 1e-7
    x, y = result.end
    drop = -float(np.array(up) @ [x, y])
    assert drop / x == pytest.approx(1.0668023, abs=1e-6)
