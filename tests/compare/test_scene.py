"""The strict scene reader: bad input names its key, value and remedy in one line; good scenes survive a round trip."""

from __future__ import annotations

import dataclasses
import json
import math
import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compare.errors import BadInput
from compare.scene import Scene, load, loads, parse_assignment, shipped
from tests.compare.ordinary_user import NOBODY, not_root, public_folder

BASE = {
    "strip.length": "1.0",
    "strip.width": "0.03",
    "strip.poisson": "0.4",
    "strip.natural_curvature": "10.0",
    "strip.gamma": "100.0",
    "gravity.up": "[1.0, 0.0, 0.0]",
    "clamp.start.position": "[0.0, 0.0, 0.0]",
    "clamp.start.tangent": "[0.0, 0.0, 1.0]",
    "clamp.start.normal": "[-0.70710678118654757, 0.70710678118654757, 0.0]",
}
SI = {
    "strip.gamma": None,
    "strip.length": "0.5",
    "strip.width": "0.015",
    "strip.thickness": "1e-4",
    "strip.poisson": "0.5",
    "strip.natural_curvature": "30.0",
    "strip.young": "1.8e9",
    "strip.density": "1000.0",
}
PLANAR = {"clamp.start.normal": "[1.0, 0.0, 0.0]"}


def text(*changes: dict[str, str | None], extra: str = "") -> str:
    """TOML of BASE with dotted keys set to raw TOML (None: left out), then `extra`."""
    keys: dict[str, str | None] = dict(BASE)
    for change in changes:
        keys.update(change)
    sections: dict[str, list[str]] = {}
    for dotted, value in keys.items():
        section, _, name = dotted.rpartition(".")
        if value is not None:
            sections.setdefault(section, []).append(f"{name} = {value}")
    lines = sections.pop("", [])
    for section, entries in sections.items():
        lines += [f"[{section}]", *entries]
    return "\n".join(lines) + "\n" + extra


def fault(content: str) -> BadInput:
    with pytest.raises(BadInput) as caught:
        loads(content)
    error = caught.value
    assert error.exit_code == 2
    assert "\n" not in str(error)
    assert str(error).startswith(error.key)
    assert error.remedy, "an error says what would be right"
    assert " ".join(error.remedy.split()) in str(error)
    return error


# -- each bad input: change, key, what the line shows of the value, what the line offers ------------

VALUES = [
    ({"strip.length": "0.0"}, "strip.length", "0.0", "e.g. length = 1.0"),
    ({"strip.length": "-1"}, "strip.length", "-1", "e.g. length = 1.0"),
    ({"strip.length": "nan"}, "strip.length", "nan", "e.g. length = 1.0"),
    ({"strip.length": "inf"}, "strip.length", "inf", "e.g. length = 1.0"),
    ({"strip.length": '"1 m"'}, "strip.length", "1 m", "e.g. length = 1.0"),
    ({"strip.length": "true"}, "strip.length", "True", "e.g. length = 1.0"),
    ({"strip.length": "[1.0]"}, "strip.length", "[1.0]", "e.g. length = 1.0"),
    ({"strip.length": "2024-01-01"}, "strip.length", "2024-01-01", "e.g. length = 1.0"),
    ({"strip.length": "1" + "0" * 400}, "strip.length", "bits", "e.g. length = 1.0"),
    ({"strip.length": "0x1" + "0" * 5000}, "strip.length", "bits", "e.g. length = 1.0"),
    ({"strip.width": "0"}, "strip.width", "0", "e.g. width = 0.03"),
    ({"strip.width": "1.0"}, "strip.width", "1.0", "below 1.0"),
    ({"strip.width": "2.0"}, "strip.width", "2.0", "below 1.0"),
    ({"strip.thickness": "0.0"}, "strip.thickness", "0.0", "e.g. thickness = 3e-4"),
    ({"strip.thickness": "0.03"}, "strip.thickness", "0.03", "below 0.03"),
    ({"strip.poisson": "-1.0"}, "strip.poisson", "-1.0", "-1 < nu <= 0.5"),
    ({"strip.poisson": "0.51"}, "strip.poisson", "0.51", "-1 < nu <= 0.5"),
    ({"strip.poisson": "nan"}, "strip.poisson", "nan", "-1 < nu <= 0.5"),
    ({"strip.natural_curvature": "[1.0, 2.0, 3.0]"}, "strip.natural_curvature", "3.0", "[at start, at end]"),
    ({"strip.natural_curvature": "[]"}, "strip.natural_curvature", "[]", "[at start, at end]"),
    ({"strip.natural_curvature": "[1.0, inf]"}, "strip.natural_curvature", "inf", "[at start, at end]"),
    ({"strip.natural_curvature": '"round"'}, "strip.natural_curvature", "round", "[at start, at end]"),
    ({"strip.gamma": "-1.0"}, "strip.gamma", "-1.0", ">= 0"),
    ({"strip.gamma": "inf"}, "strip.gamma", "inf", ">= 0"),
    (
        {"strip.gamma": "100.0", "strip.young": "1e9", "strip.density": "1e3"},
        "strip.gamma",
        "100.0",
        "remove strip.gamma",
    ),
    (SI | {"strip.young": "0.0"}, "strip.young", "0.0", "Pa"),
    (SI | {"strip.young": "-1.8e9"}, "strip.young", "-1800000000.0", "Pa"),
    (SI | {"strip.density": "0.0"}, "strip.density", "0.0", "kg/m^3"),
    (SI | {"strip.young": "1e-300"}, "strip.young", "1e-300", "check the units"),
    (SI | {"gravity.acceleration": "0.0"}, "gravity.acceleration", "0.0", "m/s^2"),
    (SI | {"gravity.acceleration": "-9.81"}, "gravity.acceleration", "-9.81", "m/s^2"),
    ({"gravity.up": "[0.0, 0.0, 0.0]"}, "gravity.up", "[0.0, 0.0, 0.0]", "unit vector"),
    ({"gravity.up": "[3.0, 0.0, 4.0]"}, "gravity.up", "[3.0, 0.0, 4.0]", "normalised it is [0.6"),
    ({"gravity.up": "[1e300, 0.0, 1e300]"}, "gravity.up", "1e+300", "normalised it is [0.70710678"),
    ({"gravity.up": "[1.0, 0.0]"}, "gravity.up", "[1.0, 0.0]", "unit vector"),
    ({"gravity.exact": "true"}, "gravity.exact", "True", "remove it"),
    ({"gravity.exact": "1"}, "gravity.exact", "1", "e.g. exact = false"),
    ({"clamp.start.position": "[0.0, 0.0]"}, "clamp.start.position", "[0.0, 0.0]", "three numbers"),
    ({"clamp.start.position": "0.0"}, "clamp.start.position", "0.0", "three numbers"),
    ({"clamp.start.position": '[0.0, 0.0, "a"]'}, "clamp.start.position", "a", "three numbers"),
    ({"clamp.start.tangent": "[0.0, 0.0, 2.0]"}, "clamp.start.tangent", "2.0", "normalised it is [0.0, 0.0, 1.0]"),
    ({"clamp.start.tangent": "[0.0, 0.0, 1.000001]"}, "clamp.start.tangent", "1.000001", "normalised it is"),
    ({"clamp.start.normal": "[-0.7, 0.7, 0.0]"}, "clamp.start.normal", "-0.7", "normalised it is [-0.70710678118654"),
    (
        {"clamp.start.normal": "[0.6, 0.0, 0.8]"},
        "clamp.start.normal",
        "0.8",
        "orthogonal to the tangent is [1.0, 0.0, 0.0]",
    ),
    ({"clamp.start.normal": "[0.0, 0.0, 1.0]"}, "clamp.start.normal", "1.0", "orthogonal to the tangent"),
    ({"clamp.start.ruling": '"loose"'}, "clamp.start.ruling", "loose", "'straight'"),
    ({"clamp.start.ruling": "0.0"}, "clamp.start.ruling", "0.0", "straight"),
    ({"model.energy": '"wunderlch"'}, "model.energy", "wunderlch", "did you mean 'wunderlich'"),
    ({"model.energy": '"extensible"'}, "model.energy", "extensible", "'sadowsky'"),
    ({"model.energy": '"kirchhoff"'}, "model.energy", "kirchhoff", "'sadowsky'"),
    ({"model.energy": '"sano"'}, "model.energy", "sano", "'sadowsky'"),
    ({"model.elements": "0"}, "model.elements", "0", "whole number >= 1"),
    ({"model.elements": "-3"}, "model.elements", "-3", "whole number >= 1"),
    ({"model.elements": "20.0"}, "model.elements", "20.0", "whole number >= 1"),
    ({"model.elements": "true"}, "model.elements", "True", "whole number >= 1"),
    ({"model.elements": "10000000000"}, "model.elements", "10000000000", "whole number >= 1"),
    ({"model.elements": "2", "model.element_lengths": "[0.5, 0.5]"}, "model.elements", "2", "remove one of the two"),
    ({"model.element_lengths": "[0.5, 0.4]"}, "model.element_lengths", "[0.5, 0.4]", "model.elements"),
    ({"model.element_lengths": "[1.5, -0.5]"}, "model.element_lengths", "-0.5", "summing to strip.length"),
    ({"model.element_lengths": "[]"}, "model.element_lengths", "[]", "summing to strip.length"),
    ({"model.element_lengths": "1.0"}, "model.element_lengths", "1.0", "summing to strip.length"),
    ({"model.tolerance": "1e-3"}, "model.tolerance", "0.001", "model.elements"),
    ({"model.formulation": '"mixed"'}, "model.formulation", "mixed", "'chained'"),
    ({"model.formulation": '"glued"'}, "model.formulation", "glued", "'chained'"),
    ({"seed.curvature": '"flat"'}, "seed.curvature", "flat", '"natural"'),
    ({"seed.curvature": "[1.0, 2.0, 3.0]"}, "seed.curvature", "3.0", "[at start, at end]"),
    ({"seed.ruling": "[0.0, nan]"}, "seed.ruling", "nan", "[at start, at end]"),
    ({"seed.ruling": "[0.0, 70.0]"}, "seed.ruling", "70.0", "66.6667"),
    ({"shell.width_to_thickness": "1"}, "shell.width_to_thickness", "1", "each > 1"),
    ({"shell.width_to_thickness": "[20, 0.5]"}, "shell.width_to_thickness", "0.5", "each > 1"),
    ({"shell.width_to_thickness": "[]"}, "shell.width_to_thickness", "[]", "each > 1"),
    ({"shell.width_to_thickness": '["20"]'}, "shell.width_to_thickness", "20", "each > 1"),
    ({"shell.clamp": '"corners"'}, "shell.clamp", "corners", "'edge'"),
    ({"shell.clamp": '"middle"'}, "shell.clamp", "middle", "'edge'"),
    ({"shell.elements": "[100]"}, "shell.elements", "[100]", "[along, across]"),
    ({"shell.elements": "[100, 0]"}, "shell.elements", "[100, 0]", "[along, across]"),
    ({"shell.elements": "[100, 2.0]"}, "shell.elements", "2.0", "[along, across]"),
    ({"title": "3"}, "title", "3", "one line"),
    ({"title": '"two\\nlines"'}, "title", "two", "line breaks"),
    # unknown keys: the closest known one
    ({"strip.widht": "0.03"}, "strip.widht", "0.03", "did you mean strip.width?"),
    ({"strip.Length": "1.0"}, "strip.Length", "1.0", "did you mean strip.length?"),
    ({"gravity.gamma": "1.0"}, "gravity.gamma", "1.0", "did you mean strip.gamma?"),
    ({"clamp.tangent": "[0.0, 0.0, 1.0]"}, "clamp.tangent", "[0.0, 0.0, 1.0]", "did you mean clamp.start.tangent?"),
    ({"clamp.start.tanget": "[0.0, 0.0, 1.0]"}, "clamp.start.tanget", "1.0", "did you mean clamp.start.tangent?"),
    ({"model.xyzzy": "1"}, "model.xyzzy", "1", "known keys here: element_lengths, elements, energy, formulation"),
    ({"gravty.up": "[1.0, 0.0, 0.0]"}, "gravty", "", "did you mean gravity?"),
    # not available yet: said, never silently left out
    ({"clamp.end.position": "[0.0, 0.0, 0.9]"}, "clamp.end", "", "remove [clamp.end]"),
    ({"closure.kind": '"moebius"'}, "closure", "", "[clamp.start]"),
    ({"path": "[]"}, "path", "[]", "remove [[path]]"),
]


@pytest.mark.parametrize(
    ("change", "key", "shown", "offered"), VALUES, ids=[f"{c[1]}-{i}" for i, c in enumerate(VALUES)]
)
def test_bad_value(change, key, shown, offered):
    error = fault(text(change))
    assert error.key == key
    assert shown in str(error).partition(": ")[0]
    assert offered in error.remedy


@pytest.mark.parametrize("key", ["length", "width", "poisson"])
def test_missing_key_of_the_strip(key):
    error = fault(text({f"strip.{key}": None}))
    assert error.key == f"strip.{key}"
    assert error.value is None
    assert "is missing" in str(error)
    assert f"{key} = " in error.remedy


@pytest.mark.parametrize("key", ["thickness", "young", "density"])
def test_young_density_and_thickness_come_together(key):
    error = fault(text(SI, {f"strip.{key}": None}))
    assert error.key == f"strip.{key}"
    assert "together" in error.remedy


def test_gravity_without_weight():
    error = fault(text({"strip.gamma": None}))
    assert error.key == "strip.gamma"
    assert "strip.young" in error.remedy
    assert "remove [gravity]" in error.remedy


@pytest.mark.parametrize("key", ["tangent", "normal"])
def test_missing_clamp_axis(key):
    error = fault(text({f"clamp.start.{key}": None}))
    assert error.key == f"clamp.start.{key}"
    assert "is missing" in str(error)


def test_missing_up():
    assert fault(text({"gravity.up": None}, extra="[gravity]\n")).key == "gravity.up"


def test_a_free_strip_is_not_available():
    error = fault(text({f"clamp.start.{key}": None for key in ("position", "tangent", "normal")}))
    assert error.key == "clamp.start"
    assert "not available" in error.problem
    assert "[clamp.start]" in error.remedy


def test_left_handed_axes():
    right = "[0.70710678118654757, 0.70710678118654757, 0.0]"
    assert loads(text({"clamp.start.across": right})).canonical() == loads(text()).canonical()
    error = fault(text({"clamp.start.across": "[-0.70710678118654757, -0.70710678118654757, 0.0]"}))
    assert error.key == "clamp.start.across"
    assert "left-handed" in error.problem
    assert "0.7071067811865476, 0.7071067811865476" in error.remedy
    assert "t_x = t_y x t_z" in fault(text({"clamp.start.across": "[1.0, 0.0, 0.0]"})).problem


@pytest.mark.parametrize("section", ["wall", "path"])
def test_arrays_of_tables_not_available(section):
    error = fault(text(extra=f"[[{section}]]\npoint = [0.0, 0.0, 0.0]\n"))
    assert error.key == section
    assert "is not available in this version" in error.problem


@pytest.mark.parametrize(
    ("line", "key"), [("strip = 3", "strip"), ("model = []", "model"), ('clamp = "start"', "clamp")]
)
def test_a_section_that_is_no_table(line, key):
    sections = {dotted: None for dotted in BASE if dotted.startswith(key)}
    error = fault(line + "\n" + text(sections))
    assert error.key == key
    assert f"[{key}]" in error.remedy


def test_a_repeated_section():
    error = fault("[[model]]\nelements = 3\n" + text())
    assert error.key == "model"
    assert "[model]" in error.remedy


def test_elastica_names_what_breaks_planarity():
    error = fault(text({"model.energy": '"elastica"'}))
    assert error.key == "model.energy"
    assert "gravity.up has the component 0.7071 along t_x" in str(error)
    assert loads(text(PLANAR, {"model.energy": '"elastica"', "gravity.up": "[1.0, 0.0, 0.0]"})).is_planar()


# -- files ------------------------------------------------------------------------------------------


def file_fault(path) -> BadInput:
    with pytest.raises(BadInput) as caught:
        load(path)
    assert caught.value.key == "scene"
    assert "\n" not in str(caught.value)
    assert caught.value.remedy
    return caught.value


def test_unknown_scene_suggests_a_shipped_one():
    error = file_fault("curl_4_4")
    assert "did you mean curl_4_3?" in error.remedy
    assert "cantilever" in error.remedy


def test_folder(tmp_path):
    assert "is a folder" in file_fault(tmp_path).problem


def test_binary_file(tmp_path):
    (tmp_path / "a.toml").write_bytes(bytes(range(128, 256)))
    assert "not a text file" in file_fault(tmp_path / "a.toml").problem


def test_huge_file(tmp_path):
    (tmp_path / "a.toml").write_text("#" * 1_000_001)
    assert "larger than" in file_fault(tmp_path / "a.toml").problem


def test_forbidden_file():
    with public_folder() as folder:
        (folder / "a.toml").write_text(text())
        with not_root():
            if os.geteuid() == NOBODY:
                assert load(folder / "a.toml").name == "a"  # it is the permission of the file that matters below
        (folder / "a.toml").chmod(0)
        with not_root():
            problem = file_fault(folder / "a.toml").problem
    assert "cannot be read" in problem
    assert "ermission" in problem


def test_a_file_in_the_way_of_the_path(tmp_path):
    (tmp_path / "a").write_text("")
    assert "cannot be read" in file_fault(tmp_path / "a" / "b.toml").problem


def test_invalid_toml_names_the_line():
    error = fault("[strip]\nlength = 1.0\nwidth = 3 cm\n")
    assert error.key == "scene"
    assert "line 3" in error.problem


@pytest.mark.parametrize("content", ["a = " + "[" * 5000, "a = " + "1" * 5000])
def test_toml_beyond_all_bounds(content):
    assert fault(content).key == "scene"


def test_empty_file_asks_for_the_strip():
    assert fault("").key == "strip.length"


def test_a_path_and_a_byte_order_mark(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(b"\xef\xbb\xbf" + text().replace("\n", "\r\n").encode())
    scene = load(path)
    assert scene.name == "mine"
    assert scene.title == "mine"
    assert scene.source == str(path)


# -- what a good scene means ------------------------------------------------------------------------


def test_dimensionless_numbers_of_an_si_scene():
    """Figure 4.1 of the thesis: D = 1.8e9 (1e-4)^3 / 9 = 2e-4 N m, Gamma = 1000 * 1e-4 * 9.81 * 0.5^3 / D."""
    scene = loads(text(SI, {"clamp.start.position": "[1.0, 0.0, -0.5]", "seed.curvature": "[2.0, 4.0]"}))
    assert scene.gamma == pytest.approx(613.125, rel=1e-13)
    assert scene.width == pytest.approx(0.03, rel=1e-15)
    assert scene.curvature == (15.0, 15.0)
    assert scene.seed_curvature == (1.0, 2.0)
    assert scene.thickness == pytest.approx(2e-4, rel=1e-15)
    assert scene.position.tolist() == [2.0, 0.0, -1.0]
    assert scene.require_shell() == (pytest.approx(150.0),)
    heavier = loads(text(SI, {"gravity.acceleration": "19.62"}))
    assert heavier.gamma == pytest.approx(2 * 613.125, rel=1e-13)


def test_the_same_strip_in_other_units_is_the_same_problem():
    """Metres or millimetres: with gamma given, every dimensionless number agrees."""
    one = loads(text({"strip.natural_curvature": "[10.0, 5.0]"}))
    other = loads(text({"strip.length": "1000", "strip.width": "30", "strip.natural_curvature": "[0.01, 0.005]"}))
    assert other.width == pytest.approx(one.width, rel=1e-15)
    assert other.curvature == pytest.approx(one.curvature, rel=1e-15)
    assert other.gamma == one.gamma


def test_frame_is_orthonormal_right_handed_and_in_order():
    nearly = {"clamp.start.normal": "[-0.7071067813, 0.7071067811, 0.0]", "clamp.start.tangent": "[0.0, 5e-10, 1.0]"}
    for scene in (loads(text()), loads(text(nearly))):
        frame = scene.frame
        np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-15)
        assert np.linalg.det(frame) == pytest.approx(1.0, abs=1e-15)
        half = math.sqrt(0.5)
        expected = np.column_stack([[half, half, 0.0], [-half, half, 0.0], [0.0, 0.0, 1.0]])
        np.testing.assert_allclose(frame, expected, atol=2e-9)


def test_defaults():
    scene = loads(text())
    assert scene.model.energy == "auto"
    assert scene.model.elements == 20
    assert scene.model.lengths == (0.05,) * 20
    assert scene.model.formulation == "auto"
    assert scene.clamp_start.ruling == "free"
    assert scene.clamp_end is None
    assert scene.seed_curvature == scene.curvature == (10.0, 10.0)
    assert scene.seed.ruling == (0.0, 0.0)
    assert scene.shell.clamp == "edge"
    assert not scene.gravity.exact
    assert scene.gravity.acceleration == 9.81


def test_element_lengths_are_fractions_of_the_length():
    scene = loads(text(SI, {"model.element_lengths": "[0.1, 0.15, 0.25]"}))
    assert scene.model.elements == 3
    assert scene.model.lengths == pytest.approx((0.2, 0.3, 0.5), rel=1e-15)
    assert math.fsum(scene.model.lengths) == pytest.approx(1.0, rel=1e-15)


def test_absent_gravity_is_weightless_and_says_what_has_no_effect():
    scene = loads(text({"gravity.up": None}))
    assert scene.gamma == 0.0
    assert scene.up is None
    assert scene.is_planar()
    assert any("strip.gamma = 100.0 has no effect" in note for note in scene.notes())
    assert loads(text()).notes() == ()
    si = loads(text(SI, {"gravity.up": None}))
    assert si.gamma == 0.0
    assert any("strip.density" in note for note in si.notes())
    assert any("acceleration" in note for note in loads(text({"gravity.acceleration": "1.62"})).notes())
    both = loads(text({"strip.thickness": "1e-3", "shell.width_to_thickness": "20"}))
    assert any("strip.thickness is replaced" in note for note in both.notes())


def test_shell_needs_a_thickness():
    with pytest.raises(BadInput) as caught:
        loads(text()).require_shell()
    assert caught.value.key == "shell.width_to_thickness"
    assert "strip.thickness" in caught.value.remedy
    assert loads(text({"strip.thickness": "3e-4"})).require_shell() == (pytest.approx(100.0),)
    assert loads(text({"shell.width_to_thickness": "[20, 50]"})).require_shell() == (20.0, 50.0)
    assert loads(text({"shell.width_to_thickness": "30"})).require_shell() == (30.0,)


def test_planarity():
    assert not loads(text()).is_planar()
    assert "t_x" in str(loads(text()).nonplanar_reason())
    assert loads(text(PLANAR)).is_planar()
    assert loads(text(PLANAR)).nonplanar_reason() is None
    assert loads(text({"strip.gamma": "0.0"})).is_planar()
    # a tenth of a milliradian of tilt about the tangent is not planar
    tilt = f"[{math.cos(1e-4)!r}, {math.sin(1e-4)!r}, 0.0]"
    assert not loads(text({"clamp.start.normal": tilt})).is_planar()


def test_a_scene_is_frozen():
    scene = loads(text())
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.title = "other"
    scene.frame[0, 0] = 5.0
    assert scene.frame[0, 0] != 5.0


def test_canonical_changes_with_everything_but_the_title():
    scene = loads(text())
    base = scene.canonical()
    json.dumps(base, allow_nan=False)
    assert loads(text({"title": '"another"'}), "elsewhere.toml").canonical() == base
    assert loads(text({"model.elements": "20", "gravity.exact": "false"})).canonical() == base
    assert loads(text({"strip.length": "1", "strip.gamma": "1e2"})).canonical() == base
    changes = {
        "strip.length": 1.5,
        "strip.width": 0.04,
        "strip.thickness": 1e-3,
        "strip.poisson": 0.3,
        "strip.natural_curvature": [10.0, 9.0],
        "strip.gamma": 101.0,
        "gravity": None,
        "gravity.up": [0.0, 1.0, 0.0],
        "gravity.acceleration": 1.62,
        "clamp.start.position": [0.0, 0.0, 1.0],
        "clamp.start.tangent": [0.0, 0.0, -1.0],
        "clamp.start.normal": [1.0, 0.0, 0.0],
        "clamp.start.ruling": "straight",
        "model.energy": "sadowsky",
        "model.elements": 21,
        "model.formulation": "chained",
        "seed.curvature": 1.0,
        "seed.ruling": 0.1,
        "shell.width_to_thickness": [20],
        "shell.elements": [50, 2],
    }
    for key, value in changes.items():
        assert scene.replace({key: value}).canonical() != base, key


# -- replacing keys ---------------------------------------------------------------------------------


def test_replace_is_checked_again_and_leaves_the_original():
    scene = loads(text())
    other = scene.replace({"strip.gamma": 50, "model.energy": "sadowsky", "clamp.start.position": (0.0, 0.0, 1.0)})
    assert (other.gamma, other.model.energy, other.position.tolist()) == (50.0, "sadowsky", [0.0, 0.0, 1.0])
    assert scene.gamma == 100.0
    assert other.title == scene.title
    assert scene.replace({"gravity.up": np.array([0.0, 1.0, 0.0])}).up.tolist() == [0.0, 1.0, 0.0]
    assert scene.replace({"gravity": None}).gamma == 0.0
    assert scene.replace({"seed.curvature": None}).canonical() == scene.canonical()
    for key, value in (
        ("strip.width", 2.0),
        ("strip.widht", 0.1),
        ("strip.width.x", 0.1),
        ("clamp.end.position", [0, 0, 1]),
    ):
        with pytest.raises(BadInput) as caught:
            scene.replace({key: value})
        assert caught.value.key.startswith(key.rpartition(".")[0])
        assert "\n" not in str(caught.value)
    with pytest.raises(BadInput, match=r"strip\.length: is missing"):
        scene.replace({"strip.length": None})


def test_replace_drops_the_other_way_to_say_it():
    si = loads(text(SI))
    assert si.replace({"strip.gamma": 7.0}).gamma == 7.0
    back = si.replace({"strip.gamma": 7.0}).replace({"strip.young": 1.8e9, "strip.density": 1000.0})
    assert back.canonical() == si.canonical()
    with pytest.raises(BadInput, match="conflicts"):
        si.replace({"strip.gamma": 7.0, "strip.young": 1e9})
    graded = loads(text({"model.element_lengths": "[0.25, 0.75]"}))
    assert graded.replace({"model.elements": 4}).model.lengths == (0.25,) * 4


@pytest.mark.parametrize(
    ("argument", "expected"),
    [
        ("strip.gamma=50", ("strip.gamma", 50)),
        (" strip.gamma = 5e1 ", ("strip.gamma", 50.0)),
        ("model.energy=sadowsky", ("model.energy", "sadowsky")),
        ('model.energy="sadowsky"', ("model.energy", "sadowsky")),
        ("gravity.up=[0.0, 1.0, 0.0]", ("gravity.up", [0.0, 1.0, 0.0])),
        ('title="a = b"', ("title", "a = b")),
        ("gravity.exact=true", ("gravity.exact", True)),
    ],
)
def test_parse_assignment(argument, expected):
    assert parse_assignment(argument) == expected


@pytest.mark.parametrize("argument", ["strip.gamma", "=5", "strip.gamma=", "a=[1", "a=1\nb=2", "a=3 cm"])
def test_parse_assignment_rejects(argument):
    with pytest.raises(BadInput) as caught:
        parse_assignment(argument)
    assert "\n" not in str(caught.value)
    assert "e.g." in caught.value.remedy


# -- round trip -------------------------------------------------------------------------------------

numbers = st.floats(-1e3, 1e3, allow_nan=False)
linear = st.one_of(numbers, st.tuples(numbers, numbers).map(list))


@st.composite
def rotations(draw) -> np.ndarray:
    quaternion = np.array([draw(st.floats(-1, 1)) for _ in range(4)]) + np.array([1e-3, 0, 0, 0])
    if np.linalg.norm(quaternion) < 1e-6:
        quaternion = np.array([1.0, 0, 0, 0])
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


@st.composite
def scenes(draw) -> Scene:
    """Any scene, made by replacing keys of a small one."""
    length = draw(st.floats(1e-3, 1e3))
    width = length * draw(st.floats(1e-4, 0.5))
    thickness = width * draw(st.floats(1e-4, 0.5))
    frame = draw(rotations())
    keys: dict[str, object] = {
        "title": draw(st.text(st.characters(exclude_categories=("Cc", "Cs", "Zl", "Zp")), min_size=1)),
        "strip.length": length,
        "strip.width": width,
        "strip.poisson": draw(st.floats(-0.99, 0.5)),
        "strip.natural_curvature": draw(linear),
        "clamp.start.position": [draw(numbers) for _ in range(3)],
        "clamp.start.tangent": frame[:, 2],
        "clamp.start.normal": frame[:, 1],
        "clamp.start.ruling": draw(st.sampled_from(["free", "straight"])),
        "gravity.up": draw(rotations())[:, 0],
        "model.energy": draw(st.sampled_from(["auto", "sadowsky", "wunderlich"])),
        "model.formulation": draw(st.sampled_from(["auto", "chained"])),
        "seed.curvature": draw(st.one_of(st.just("natural"), linear)),
        "seed.ruling": draw(st.floats(-2, 2)),
        "shell.width_to_thickness": draw(st.one_of(st.none(), st.lists(st.floats(1.1, 1e4), min_size=1))),
        "shell.elements": draw(st.one_of(st.none(), st.tuples(st.integers(1, 500), st.integers(1, 9)))),
    }
    if draw(st.booleans()):
        keys |= {"strip.young": draw(st.floats(1e3, 1e12)), "strip.density": draw(st.floats(1, 1e5))}
        keys |= {"strip.thickness": thickness, "gravity.acceleration": draw(st.floats(1e-3, 100))}
    else:
        keys |= {"strip.gamma": draw(st.floats(0, 1e6)), "strip.thickness": draw(st.sampled_from([None, thickness]))}
    if draw(st.booleans()):
        parts = np.array(draw(st.lists(st.floats(0.1, 1.0), min_size=1, max_size=6)))
        keys["model.element_lengths"] = length * parts / parts.sum()
    else:
        keys["model.elements"] = draw(st.integers(1, 300))
    return loads(text()).replace(keys)


@settings(max_examples=200, deadline=None)
@given(scenes())
def test_round_trip(scene):
    """TOML and back: the same scene to the last bit, and the same dimensionless numbers."""
    again = loads(scene.to_toml(), scene.source)
    assert again == scene
    assert again.canonical() == scene.canonical()
    assert again.gamma == scene.gamma
    assert json.loads(json.dumps(scene.canonical())) == scene.canonical()


def test_to_toml_comments_every_key():
    for name in shipped():
        for line in load(name).to_toml().splitlines():
            assert not line or line.startswith("[") or "  # " in line, line
