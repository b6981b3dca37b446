"""The strict scene reader: bad input names its key, value and remedy in one line."""

from __future__ import annotations

import os

import pytest

from compare.scene.scene import load, loads
from ribbonbench.errors import BadInput
from tests.compare.scene.scene_texts import BASE, PLANAR, SI, fault, text
from tests.compare.store.ordinary_user import NOBODY, not_root, public_folder

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
    ({"model.tolerance": "0.0"}, "model.tolerance", "0.0", "0 < tolerance < 0.1"),
    ({"model.tolerance": "0.1"}, "model.tolerance", "0.1", "0 < tolerance < 0.1"),
    ({"model.tolerance": "nan"}, "model.tolerance", "nan", "0 < tolerance < 0.1"),
    ({"model.tolerance": '"fine"'}, "model.tolerance", "fine", "0 < tolerance < 0.1"),
    ({"model.tolerance": "1e-3", "model.elements": "20"}, "model.elements", "20", "remove one of the two"),
    ({"model.tolerance": "1e-3", "model.grading": '"clamp"'}, "model.grading", "clamp", "remove one of the two"),
    (
        {"model.tolerance": "1e-3", "model.element_lengths": "[0.5, 0.5]"},
        "model.element_lengths",
        "[0.5, 0.5]",
        "remove one of the two",
    ),
    ({"model.formulation": '"glued"'}, "model.formulation", "glued", "'mixed', 'matrix'"),
    ({"model.held_by": '"hand"'}, "model.held_by", "hand", "'elimination', 'constraints'"),
    (
        {"model.formulation": '"chained"', "model.held_by": '"constraints"'},
        "model.held_by",
        "constraints",
        'formulation = "mixed"',
    ),
    ({"seed.curvature": '"flat"'}, "seed.curvature", "flat", '"natural"'),
    ({"seed.curvature": "[]"}, "seed.curvature", "[]", "[at start, at end]"),
    ({"seed.curvature": "[1.0, 2.0, inf]"}, "seed.curvature", "inf", "at equal distances"),
    ({"seed.ruling": "[0.0, nan]"}, "seed.ruling", "nan", "[at start, at end]"),
    ({"seed.ruling": "[0.0, 70.0]"}, "seed.ruling", "70.0", "66.6667"),
    ({"seed.ruling": "[0.0, 34.0, 0.0]"}, "seed.ruling", "34.0", "below 2 length/width / 2 = 33.3333"),
    ({"seed.ruling": "[0.0, 0.0, 0.0, 23.0]"}, "seed.ruling", "23.0", "22.2222"),
    ({"shell.width_to_thickness": "1"}, "shell.width_to_thickness", "1", "each > 1"),
    ({"shell.width_to_thickness": "[20, 0.5]"}, "shell.width_to_thickness", "0.5", "each > 1"),
    ({"shell.width_to_thickness": "[]"}, "shell.width_to_thickness", "[]", "each > 1"),
    ({"shell.width_to_thickness": '["20"]'}, "shell.width_to_thickness", "20", "each > 1"),
    ({"shell.clamp": '"corner"'}, "shell.clamp", "corner", "did you mean 'corners'"),
    ({"shell.corner": "0.005"}, "shell.corner", "0.005", 'shell.clamp = "corners"'),
    ({"shell.clamp": '"corners"', "shell.corner": "0.015"}, "shell.corner", "0.015", "below 0.015"),
    ({"shell.clamp": '"corners"', "shell.corner": "0.0"}, "shell.corner", "0.0", "e.g. corner = 0.01"),
    ({"shell.tolerance": "0.1"}, "shell.tolerance", "0.1", "0 < tolerance < 0.1"),
    ({"shell.tolerance": "0.0"}, "shell.tolerance", "0.0", "0 < tolerance < 0.1"),
    ({"shell.grading": "0.2"}, "shell.grading", "0.2", "e.g. grading = [0.2, 0.1]"),
    ({"shell.grading": "[0.2, 1.5]"}, "shell.grading", "[0.2, 1.5]", "0 < each <= 1"),
    ({"shell.grading": "[0.2, 0.0]"}, "shell.grading", "[0.2, 0.0]", "0 < each <= 1"),
    ({"shell.grading": "[0.2, 0.1]", "shell.edge_layer": '"auto"'}, "shell.edge_layer", "auto", "remove one"),
    ({"shell.edge_layer": '"thin"'}, "shell.edge_layer", "thin", '"auto"'),
    ({"shell.edge_layer": "0.015"}, "shell.edge_layer", "0.015", "below 0.015"),
    ({"shell.edge_layer": "-1.0"}, "shell.edge_layer", "-1.0", '"auto"'),
    ({"shell.start_curvature": '"natural"'}, "shell.start_curvature", "natural", "1/length"),
    ({"shell.start_curvature": "inf"}, "shell.start_curvature", "inf", "1/length"),
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
    ({"model.xyzzy": "1"}, "model.xyzzy", "1", "known keys here: accuracy, arc_length, budget, element_lengths"),
    ({"gravty.up": "[1.0, 0.0, 0.0]"}, "gravty", "", "did you mean gravity?"),
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
    assert "the frame is then free" in error.remedy


def test_missing_up():
    assert fault(text({"gravity.up": None}, extra="[gravity]\n")).key == "gravity.up"


def test_left_handed_axes():
    right = "[0.70710678118654757, 0.70710678118654757, 0.0]"
    assert loads(text({"clamp.start.across": right})).canonical() == loads(text()).canonical()
    error = fault(text({"clamp.start.across": "[-0.70710678118654757, -0.70710678118654757, 0.0]"}))
    assert error.key == "clamp.start.across"
    assert "left-handed" in error.problem
    assert "0.7071067811865476, 0.7071067811865476" in error.remedy
    assert "t_x = t_y x t_z" in fault(text({"clamp.start.across": "[1.0, 0.0, 0.0]"})).problem


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
    assert "did you mean curl_4_3 " in error.remedy


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


def test_a_quoted_key_is_no_path():
    """`"strip.gamma" = 1.0` above all sections names no section, though a key of this name is known."""
    with pytest.raises(BadInput, match="not a known key"):
        loads('"strip.gamma" = 1.0\n[strip]\nlength = 1.0\nwidth = 0.1\n')


DOTS = "a" + ".a" * 2000


@pytest.mark.parametrize(
    "content", [f"{DOTS} = 1\n", f"[{DOTS}]\n", f"[strip]\n{DOTS} = 1\n", f"x = {{{DOTS} = 1}}\n", "a . " * 2000]
)
def test_a_key_of_thousands_of_dots_never_reaches_the_parser(monkeypatch, content):
    """Its time and memory go with the square of the dots: 100,000 of them took minutes and tens of gigabytes."""
    monkeypatch.setattr("compare.scene.scene.tomllib.loads", lambda text: pytest.fail("it was parsed"))
    assert fault(content).key == "scene"


@pytest.mark.parametrize("quoted", [f'"{DOTS}"', f"'{DOTS}'", f"'''\n{DOTS}'''", f'"\\"{DOTS}"'])
def test_dots_in_a_text_or_a_comment_are_none_of_a_key(quoted):
    if "\n" not in quoted:
        assert loads(f"title = {quoted} # {DOTS}\n" + text()).title.count(".") == 2000
    assert len(fault(f"[path]\n{quoted.strip()} = 1\n" if "\n" not in quoted else f"title = {quoted} 1").key) < 2e4


def test_a_dotted_key_of_thousands_of_dots_is_unknown_and_shown_short():
    for change in (
        lambda: loads(text()).replace({f"strip.{DOTS}": 1.0}),
        lambda: loads(text(extra=f'[[path]]\n"{DOTS}" = 1\n')),
    ):
        with pytest.raises(BadInput, match="is not a known key") as caught:
            change()
        assert len(str(caught.value)) < 1000
