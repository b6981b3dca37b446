"""The site takes every page, its reference every public name; nothing of it needs Sphinx (`make docs` builds it)."""

from __future__ import annotations

import importlib
import importlib.util
import json
import re

import pytest

from docs import site, site_math, site_reference
from tests.test_setup import ROOT


def test_every_page_has_one_place():
    names = [*site.pages(), *site.notebooks(ROOT)]
    assert {"docs/theory", "docs/commands/sweep", "results/README", "CHANGELOG", "docs/notebooks/first_strip"} <= set(
        names
    )
    reference = [f"reference/{module}" for module in site_reference.MODULES]
    placed = [name for listed in site.tree([*names, *reference]).values() for name in listed]
    assert sorted(placed) == sorted([*names, *reference])
    every = {path.relative_to(ROOT).with_suffix("").as_posix() for path in (ROOT / "docs").rglob("*.md")}
    assert every <= set(placed)
    with pytest.raises(ValueError, match="elsewhere/page"):
        site.tree(["elsewhere/page"])


def test_links_hold_or_are_left_out():
    known = ["docs/theory", "results/README"]
    text = (
        "[t](theory.md#1-geometry) [r](../results/README.md) [m](../README.md) [c](../compare/cli.py) ![p](rooms.svg)"
    )
    expected = "[t](theory.md#1-geometry) [r](../results/README.md) [m](../index.md) c ![p](rooms.svg)"
    assert site.adapted(f"# T\n{text}", "docs/api", known) == f"# T\n{expected}"
    code = "# T\n```text\n[c](../compare/cli.py)\n```\n"
    assert site.adapted(code, "docs/api", known) == code
    assert site.adapted("# T\n```math\na = b \\tag{1.1}\n```\n", "docs/api", known) == "# T\n$$\na = b \\tag{1.1}\n$$\n"
    assert site.adapted("| a |\n", "results/x/table", known).startswith("# results/x/table\n")
    text = "# T\n[n](notebooks/force_curve.py#a) [s](site.py)"
    expected = "# T\n[n](notebooks/force_curve.ipynb#a) s"
    assert site.adapted(text, "docs/api", ["docs/notebooks/force_curve"]) == expected


def test_the_source_is_whole(tmp_path):
    """All pages, all pictures that they show, no link to a page that is not there."""
    site.source(tmp_path / "s")
    for name in site.pages():
        page = tmp_path / "s" / f"{name}.md"
        text = page.read_text(encoding="utf-8")
        prose = "".join(piece for prose, piece in site._outside_code(text) if prose)
        prose = re.sub(r"`[^`\n]*`", "", prose)
        for target in re.findall(r"\]\(([^()\s#]+)(?:#[^()\s]*)?\)", prose):
            if not re.match(r"[a-z]+:", target):
                assert (page.parent / target).exists() or target.endswith("index.md"), f"{name}: {target}"
    for name in site.notebooks(ROOT):
        made = json.loads((tmp_path / "s" / f"{name}.ipynb").read_text(encoding="utf-8"))
        first = "".join(made["cells"][0]["source"])
        assert first.startswith("# ")
        for target in re.findall(r"{download}`[^<]*<([^>]*)>`", first):
            assert ((tmp_path / "s" / name).parent / target).exists()
        prose = "".join("".join(cell["source"]) for cell in made["cells"] if cell["cell_type"] == "markdown")
        for target in re.findall(r"\]\(([^()\s#]+)(?:#[^()\s]*)?\)", prose):
            assert ((tmp_path / "s" / name).parent / target).exists(), f"{name}: {target}"
    assert (tmp_path / "s" / "index.md").read_text().count("```{toctree}") == len(site.TREE)
    conf = (tmp_path / "s" / "conf.py").read_text()
    compile(conf, "conf.py", "exec")
    assert re.search(r'html_title = "ribbonbench \d+\.\d+.*, 20\d\d-\d\d-\d\d"', conf)


@pytest.mark.parametrize("module", site_reference.MODULES)
def test_the_reference_has_every_public_name(module):
    page = site_reference.reference(module, ROOT)
    names = importlib.import_module(module).__all__
    for name in names:
        assert f"## {name}\n" in page
    assert page.count("\n## ") == len(names)


@pytest.mark.parametrize("module", site_reference.MODULES)
def test_types_of_the_reference_lead_to_places_that_are_there(module):
    """Our own to a target of these pages; NumPy's to the address of a name that NumPy has."""
    pages = {name: site_reference.reference(name, ROOT) for name in site_reference.MODULES}
    targets = {target for page in pages.values() for target in re.findall(r"^\((\S+)\)=$", page, re.M)}
    assert len(targets) == sum(len(importlib.import_module(name).__all__) for name in site_reference.MODULES)
    links = re.findall(r"\[`([\w.]+)`\]\((\S+?)\)", pages[module])
    assert len(links) >= 5
    for name, there in links:
        if there.startswith("#"):
            assert there[1:] in targets, there
        else:
            where, _, word = name.rpartition(".")
            assert word in dir(importlib.import_module(where)), name
            assert there == site_reference.address(name)


def test_addresses_are_those_of_numpy_and_scipy():
    """As their own pages have them."""
    for name, there in {
        "numpy.ndarray": "https://numpy.org/doc/stable/reference/generated/numpy.ndarray.html",
        "numpy.typing.NDArray": "https://numpy.org/doc/stable/reference/typing.html#numpy.typing.NDArray",
        "numpy.float64": "https://numpy.org/doc/stable/reference/arrays.scalars.html#numpy.float64",
        "scipy.optimize.least_squares":
            "https://docs.scipy.org/doc/scipy/reference/generated/scipy.optimize.least_squares.html",
    }.items():  # fmt: skip
        assert site_reference.address(name) == there
    assert site_reference.address("numba.njit") is None


def test_a_signature_is_that_of_the_function():
    page = site_reference.reference("ribbon", ROOT)
    solve = page.partition("## solve\n")[2].partition("\n## ")[0]
    assert "solve(strip: Strip" in solve
    assert "Raises" in solve
    assert "[`Strip`](#ribbon.strip.class)" in solve
    assert "ruling_given" not in page.partition("## Clamp\n")[2].partition("\n## ")[0]  # no argument of __init__


def test_what_leads_nowhere_and_what_is_foreign_is_found(tmp_path):
    (tmp_path / "a.html").write_text('<h1 id="x"></h1><a href="b.html#y"><a href="#x"><a href="c.html">')
    (tmp_path / "b.html").write_text('<script src="https://else.where/m.js"></script><a href="a.html#x">')
    assert sorted(site.broken(tmp_path)) == ["a.html: b.html#y", "a.html: c.html"]
    assert site.foreign(tmp_path) == ["b.html: https://else.where/m.js"]


@pytest.mark.skipif(importlib.util.find_spec("latex2mathml") is None, reason="no latex2mathml (make docs brings it)")
def test_formulas_become_mathml():
    assert site_math.mathml(r"\frac{a}{b}", True).startswith("<math")
