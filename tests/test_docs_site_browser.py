"""The built site in headless Chromium: six pages and the search, dark, on a phone, nothing from elsewhere.

The site is built once, with its notebooks executed: a minute or two. RIBBONBENCH_SITE names one that is built already
(`RIBBONBENCH_SITE=out/site/html` after `make docs`).
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import os
import re
import subprocess
import sys
from datetime import date
from pathlib import Path

import pytest

from compare import __version__
from docs.site_reference import MODULES
from tests.compare.report.browser import CHROMIUM, Browser
from tests.test_setup import ROOT

#: Where `make docs` and `make validate` bring Sphinx.
OWN = Path(sys.prefix) / "docs"
pytestmark = [
    pytest.mark.validate,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium (make setup installs it)"),
    pytest.mark.skipif(
        not OWN.is_dir() and importlib.util.find_spec("myst_nb") is None, reason="no Sphinx (make docs brings it)"
    ),
]
PAGES = (
    "index", "docs/theory", "docs/commands/sweep", "reference/ribbon", "docs/notebooks/first_strip", "results/README",
)  # fmt: skip
PHONE = 360

#: What reaches beyond a width and stands in no box of its own that scrolls.
WIDE = """((width) => [...document.querySelectorAll("article *")].filter((e) => {
  for (let p = e.parentElement; p; p = p.parentElement) if (getComputedStyle(p).overflowX !== "visible") return false;
  return e.getBoundingClientRect().right > width + 1;
}).slice(0, 8).map((e) => `${e.tagName}.${e.className}: ${e.textContent.slice(0, 60)}`))"""
#: The contrast (WCAG 2.2, 1.4.3) of what is read against what is behind it, the least of all texts of a kind.
CONTRAST = """((selector) => {
  const light = (c) => {
    const part = c.map((v) => v / 255).map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
    return 0.2126 * part[0] + 0.7152 * part[1] + 0.0722 * part[2];
  };
  const numbers = (text) => text.match(/[\\d.]+/g).map(Number);
  const behind = (e) => {
    for (; e; e = e.parentElement) {
      const colour = numbers(getComputedStyle(e).backgroundColor);
      if (colour.length < 4 || colour[3] > 0.99) return colour.slice(0, 3);
    }
    return [255, 255, 255];
  };
  const found = [...document.querySelectorAll(selector)].filter((e) => e.textContent.trim() && e.offsetParent);
  return found.map((e) => {
    const [a, b] = [light(numbers(getComputedStyle(e).color).slice(0, 3)), light(behind(e))];
    return { contrast: (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), behind: b };
  });
})"""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the built pages."""
    built = os.environ.get("RIBBONBENCH_SITE")
    if built:
        return Path(built).resolve()
    out = tmp_path_factory.mktemp("site")
    paths = [str(ROOT), *([str(OWN)] if OWN.is_dir() else []), os.environ.get("PYTHONPATH", "")]
    done = subprocess.run(
        [sys.executable, "-m", "docs.site", str(out)], cwd=ROOT, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths), "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return out / "html"


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    found = Browser(tmp_path_factory.mktemp("profile"))
    with found:
        yield found
    assert found.processes() == []


def shown(browser, site, name, **options):
    browser.open(site / f"{name}.html", **options)
    return browser


@pytest.mark.parametrize("name", PAGES)
def test_a_page_loads_nothing_foreign_complains_of_nothing_and_has_its_version_and_day(browser, site, name):
    page = shown(browser, site, name)
    assert page.complaints() == []
    top = site.resolve().as_uri()
    assert page.requests()
    assert all(url.startswith(top) for url in page.requests()), page.requests()
    title = page.run("document.title")
    assert f"ribbonbench {__version__}, " in title
    (day,) = re.findall(r"20\d\d-\d\d-\d\d", title)
    assert abs((date.fromisoformat(day) - date.today()).days) <= 1
    assert f"ribbonbench {__version__}, {day}" in page.run("document.querySelector('.sidebar-brand').textContent")
    assert day in page.run("document.querySelector('footer').textContent")
    assert page.run("document.querySelectorAll('h1').length") == 1
    assert (
        page.run("[...document.querySelectorAll('article img')].filter((e) => !e.alt || !e.naturalWidth).length") == 0
    )


@pytest.mark.parametrize("name", PAGES)
def test_on_a_phone_nothing_moves_sideways(browser, site, name):
    page = shown(browser, site, name, width=PHONE, height=740, phone=True)
    assert page.run("document.documentElement.scrollWidth") <= PHONE, page.run(f"{WIDE}({PHONE})")
    assert page.run("getComputedStyle(document.querySelector('.mobile-header')).display") != "none"
    size = page.run("parseFloat(getComputedStyle(document.querySelector('article p')).fontSize)")
    assert size >= 14


@pytest.mark.parametrize("name", PAGES)
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_it_is_read_in_the_light_and_in_the_dark(browser, site, name, dark):
    page = shown(browser, site, name, dark=dark)
    for kind, least in (("article p, article td, article th, h1, h2", 4.5), (".highlight pre, .output pre", 4.5)):
        found = page.run(f"{CONTRAST}({json.dumps(kind)})")
        assert found or "pre" in kind
        assert all((one["behind"] < 0.2) == dark for one in found), kind
        assert min((one["contrast"] for one in found), default=21.0) >= least, kind


def searched(browser, site, words):
    """The pages that the search finds, from the disk."""
    address = (site / "search.html").resolve().as_uri() + "?q=" + words
    browser.visit(address)
    browser.until(
        "/found|did not match|matching/.test((document.querySelector('.search-summary') || {}).textContent || '')"
    )
    return browser.run("[...document.querySelectorAll('#search-results li a')].map((e) => e.getAttribute('href'))")


def test_the_search_works_from_the_disk(browser, site):
    found = searched(browser, site, "executorlib")
    assert any("docs/commands/sweep.html" in one for one in found), found
    assert browser.complaints() == []
    assert all(url.startswith("file:") for url in browser.requests())
    browser.run("document.querySelector('#search-results li a').click()")
    browser.until("!location.pathname.endsWith('search.html') && document.readyState === 'complete'")
    assert "executorlib" in browser.run("document.body.textContent")
    assert any("reference/ribbon.html" in one for one in searched(browser, site, "RibbonInputError"))
    assert searched(browser, site, "xylophonist") == []


def test_formulas_are_drawn_and_numbered(browser, site):
    page = shown(browser, site, "docs/theory")
    count = page.run("document.querySelectorAll('math').length")
    assert count > 300
    drawn = page.run("[...document.querySelectorAll('math')].filter((e) => e.getBoundingClientRect().width > 0).length")
    assert drawn > 0.99 * count
    assert page.run("document.querySelectorAll('.eqno').length") > 50


@pytest.mark.parametrize("module", MODULES)
def test_the_reference_shows_every_public_name(browser, site, module):
    page = shown(browser, site, f"reference/{module}")
    names = importlib.import_module(module).__all__
    headings = page.run("[...document.querySelectorAll('h2')].map((e) => e.firstChild.textContent)")
    assert sorted(headings) == sorted(names)
    within = page.run(
        "[...document.querySelectorAll('article a.reference.internal')].map((e) => e.getAttribute('href'))"
        ".filter((h) => h.startsWith('#') && !document.getElementById(decodeURIComponent(h.slice(1))))"
    )
    assert within == []


def test_the_reference_leads_to_numpy_s(browser, site):
    page = shown(browser, site, "reference/ribbon")
    links = set(page.run("[...document.querySelectorAll('article a.external')].map((e) => e.href)"))
    assert "https://numpy.org/doc/stable/reference/typing.html#numpy.typing.ArrayLike" in links
    assert page.run("document.querySelectorAll('article a.reference.internal').length") > 20


def test_a_notebook_has_its_outputs_and_can_be_taken_along(browser, site):
    page = shown(browser, site, "docs/notebooks/first_strip")
    assert page.run("document.querySelectorAll('.cell_output img').length") == 3
    said = page.run("[...document.querySelectorAll('.cell_output')].map((e) => e.textContent).join(' ')")
    assert "Gamma = 10.812" in said
    assert "Legend object" not in said
    assert "Traceback" not in said
    taken = page.run("[...document.querySelectorAll('a.download')].map((e) => e.getAttribute('href'))")
    assert [Path(one).suffix for one in taken] == [".ipynb", ".py"]
    for one in taken:
        assert (site / "docs" / "notebooks" / one).resolve().is_file()
    page = shown(browser, site, "docs/notebooks/force_curve")
    assert page.run("document.querySelectorAll('.cell_output iframe').length") == 1  # the states, to be turned
    assert page.complaints() == []
