"""The notebooks run without Jupyter, and their numbers are those of other solvers; the site executes them with it."""

from __future__ import annotations

import ast
import importlib.util
import json
import re

import numpy as np
import pytest

from docs import site_notebooks
from tests.docs_blocks import anchors
from tests.test_setup import ROOT

NAMES = site_notebooks.notebooks(ROOT)
needs_pictures = pytest.mark.skipif(importlib.util.find_spec("matplotlib") is None, reason="no matplotlib")


def text_of(name):
    return (ROOT / f"{name}.py").read_text(encoding="utf-8")


def ran(name, monkeypatch, tmp_path):
    """What a notebook has found, in a folder of its own, no figure left open."""
    from matplotlib import pyplot

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    try:
        return site_notebooks.run(ROOT / "docs" / "notebooks" / f"{name}.py")
    finally:
        pyplot.close("all")


def test_there_are_four():
    assert {name.rpartition("/")[2] for name in NAMES} >= {
        "first_strip", "force_curve", "band_to_blender", "ribbon_and_shell",
    }  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_it_begins_with_a_heading_and_its_pictures_have_words(name):
    cells = site_notebooks.cells(text_of(name))
    assert cells[0].kind == "markdown"
    assert cells[0].text.startswith("# ")
    assert sum(cell.text.startswith("# ") for cell in cells if cell.kind == "markdown") == 1
    drawn = [cell for cell in cells if cell.kind == "code" and re.search(r"plt\.\w|\.plot\(\)", cell.text)]
    assert len(drawn) >= 2
    for cell in drawn:
        assert len(cell.metadata["mystnb"]["image"]["alt"]) > 20, cell.line
        last = ast.parse(cell.text).body[-1]
        shown = isinstance(last, ast.Expr) and not ast.unparse(last).startswith("print(")
        assert not shown, f"{name}: the cell at line {cell.line} would show what its last line gives"


@pytest.mark.parametrize("name", NAMES)
def test_links_lead_somewhere(name):
    page = ROOT / f"{name}.py"
    prose = "".join(cell.text for cell in site_notebooks.cells(text_of(name)) if cell.kind == "markdown")
    targets = [target for target in re.findall(r"\]\(([^)\s]+)\)", prose) if "://" not in target]
    assert targets
    for target in targets:
        path, _, anchor = target.partition("#")
        there = page.parent / path
        assert there.exists(), target
        assert not anchor or anchor in anchors(there.read_text(encoding="utf-8")), target


@pytest.mark.parametrize("name", NAMES)
def test_jupyter_s_file_has_the_same_cells(name):
    found = json.loads(json.dumps(site_notebooks.notebook(text_of(name), str.upper)))
    cells = site_notebooks.cells(text_of(name))
    assert (found["nbformat"], found["nbformat_minor"]) == (4, 5)
    assert [cell["cell_type"] for cell in found["cells"]] == [cell.kind for cell in cells]
    assert len({cell["id"] for cell in found["cells"]}) == len(cells)
    for made, cell in zip(found["cells"], cells, strict=True):
        text = cell.text if cell.kind == "code" else cell.text.upper()
        assert "".join(made["source"]) == text.rstrip("\n")
        assert made["metadata"] == dict(cell.metadata)
        assert ("outputs" in made) == (cell.kind == "code")


def test_lines_of_code_are_those_of_the_file():
    for name in NAMES:
        lines = text_of(name).splitlines()
        for cell in site_notebooks.cells(text_of(name)):
            if cell.kind == "code":
                first = cell.text.splitlines()[0]
                assert first in lines[cell.line - 1 : cell.line + 1]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import numpy\n# %%\n1\n", "line 1"),
        ("# %% [raw]\n1\n", "line 1"),
        ("# %% [markdown]\n# words\nx = 1\n", "line 3"),
        ('# %% mystnb={"image": \n1\n', "Expecting"),
    ],
)
def test_what_is_no_notebook_is_refused(text, words):
    with pytest.raises(ValueError, match=words):
        site_notebooks.cells(text)


def test_an_error_says_its_line(tmp_path):
    (tmp_path / "n.py").write_text("# %% [markdown]\n# # N\n\n# %%\nx = 1\n\n# %%\nassert x == 2\n")
    with pytest.raises(AssertionError) as caught:
        site_notebooks.run(tmp_path / "n.py")
    assert caught.traceback[-1].lineno + 1 == 8


@needs_pictures
def test_a_first_strip(monkeypatch, tmp_path):
    """Against SciPy's elastica, the weight, and the drop that the tutorial measures."""
    names = ran("first_strip", monkeypatch, tmp_path)
    assert names["off"] < 1e-6
    assert 3.5 < names["order"] < 4.5
    assert abs(names["drop"] - 215.7) < 0.1
    assert abs(names["force"] / (7850.0 * 0.30 * 0.01 * 1e-4 * 9.81) - 1.0) < 1e-9
    assert len(names["drops"]) == 9
    assert np.abs(names["drops"] - names["others"]).max() < 0.1  # mm


@needs_pictures
def test_a_force_curve(monkeypatch, tmp_path):
    """The modulus that the points were made with, Euler's load, work and energy, and a slope by differences."""
    names = ran("force_curve", monkeypatch, tmp_path)
    young = names["young"]
    assert abs(young.value / 195e9 - 1.0) < 0.01
    assert young.interval[0] < 195e9 < young.interval[1]
    stiffness = young.value * 1e-4**3 / (12.0 * (1.0 - 0.3**2)) * 0.01  # D w, N m^2
    assert 1.0 < names["forces"][0] / (4.0 * np.pi**2 * stiffness / 0.30**2) < 1.02
    assert np.all(np.diff(names["forces"]) > 0.0)
    assert abs(names["work"] / names["stored"] - 1.0) < 1e-3
    way = names["ways"]
    parabola = np.polyfit(way[-4:] - way[-1], names["forces"][-4:], 2)
    assert abs(names["slope"] / parabola[1] - 1.0) < 0.01


@needs_pictures
@pytest.mark.validate
def test_a_band_to_blender(monkeypatch, tmp_path):
    names = ran("band_to_blender", monkeypatch, tmp_path)
    assert names["worst"] < 1e-2
    assert abs(names["area"] / names["flat_area"] - 1.0) < 1e-3
    assert names["extent"].max() < 100.0  # mm, of a band that is 200 mm around
    assert np.allclose(np.sort(names["extent"]), np.sort(names["from_obj"]), atol=0.5)


@needs_pictures
@pytest.mark.validate
@pytest.mark.shell
def test_the_ribbon_against_a_shell(monkeypatch, tmp_path):
    """The distance falls as the strip gets thinner; the estimate from the ribbon alone is of its size."""
    names = ran("ribbon_and_shell", monkeypatch, tmp_path)
    apart = names["apart"]
    assert np.all(np.diff(apart) < 0.0)
    assert 0.5 < names["slope"] < 2.0
    estimated = np.array([found.estimate.distance for found in names["estimates"]])
    assert np.all(np.abs(np.log(estimated / apart)) < np.log(2.5))


@needs_pictures
def test_without_a_shell_the_page_says_so(monkeypatch, tmp_path, capsys):
    """Where dolfinx is not installed the notebook runs to its end all the same."""
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *more: None if name == "dolfinx" else found(name, *more)
    )
    names = ran("ribbon_and_shell", monkeypatch, tmp_path)
    assert not names["rows"]
    assert "no shell" in capsys.readouterr().out
