"""`ribbonbench live` in headless Chromium: a slider is dragged, the number that is read is that of a solve."""

from __future__ import annotations

import json

import pytest

from compare.models import solve
from compare.scene.scene import load
from tests.compare.live.served import Served
from tests.compare.live.test_live_server import SCENE, TITLE
from tests.compare.report.browser import CHROMIUM, Browser

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium (make setup installs it)")

GAMMA = '.slider[data-name="strip.gamma"]'


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    found = Browser(tmp_path_factory.mktemp("profile"))
    with found:
        yield found
    assert found.processes() == []


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    folder = tmp_path_factory.mktemp("live")
    (folder / "arch.toml").write_text(SCENE)
    with Served("arch.toml", folder) as found:
        yield found


@pytest.fixture
def page(browser, served):
    browser.visit(served.address, height=1000)
    browser.until("document.body.dataset.judged")
    return browser


def told(page, name):
    return json.loads(page.run(f"document.body.dataset.{name}"))


def settled(page, action):
    """Does something that moves the strip, and waits until its verdict is there."""
    count = page.run("Number(document.body.dataset.shown)")
    action()
    page.until(f"Number(document.body.dataset.shown) > {count}")
    page.until("document.body.dataset.judged === document.body.dataset.shown")


def middle(page, selector):
    box = page.run(
        f"JSON.parse(JSON.stringify(document.querySelector({json.dumps(selector)}).getBoundingClientRect()))"
    )
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, box["width"]


def typed(page, text):
    page.run(f"""(() => {{
      const typed = document.querySelector({json.dumps(GAMMA + ' input[type="text"]')});
      typed.value = {json.dumps(text)};
      typed.dispatchEvent(new Event("change"));
    }})()""")


def as_solved(served, page):
    """The scene of what the page says that its sliders are at, solved by itself."""
    values = told(page, "values")
    position = [values[f"clamp.end.position.{axis}"] for axis in range(3)]
    keys = {"strip.gamma": values["strip.gamma"], "clamp.end.position": position, "model.formulation": "mixed"}
    return solve(load(served.folder / "arch.toml").replace(keys))


def test_a_dragged_slider_tells_the_numbers_of_a_solve(page, served):
    x, y, width = middle(page, GAMMA + ' input[type="range"]')
    start = x - width / 2 + 8 + (width - 16) * 5.0 / 20.0  # where the thumb stands: gamma = 5 of 0 to 20
    settled(page, lambda: page.drag((start, y), (0.3 * width, 0.0)))
    gamma = told(page, "values")["strip.gamma"]
    assert 8.0 < gamma < 15.0
    found = as_solved(served, page)
    numbers = told(page, "numbers")
    assert numbers["energy.total"] == pytest.approx(found.energy.total, rel=1e-8)
    assert numbers["force.start.z"] == pytest.approx(found.supports.start.force[2], rel=1e-6)
    assert f"{numbers['energy.total']:.6f}" in page.run('document.getElementById("rows").textContent')
    assert page.run('Number(document.getElementById("plot").dataset.points)') >= 2
    assert "equilibrium" in page.run('document.getElementById("verdict").textContent')
    assert "w/h = 100" in page.run('document.getElementById("estimate").textContent')
    before = numbers
    settled(page, lambda: page.run('document.getElementById("undo").click()'))
    assert told(page, "values")["strip.gamma"] == 5.0
    assert told(page, "numbers") != before
    assert page.run(f"document.querySelector({json.dumps(GAMMA + ' input[type=text]')}).value") == "5"


def test_the_end_is_dragged_by_its_handle(page, served):
    x, y, _ = middle(page, "#handle")
    settled(page, lambda: page.drag((x, y), (-40.0, 5.0)))
    values = told(page, "values")
    assert [values[f"clamp.end.position.{axis}"] for axis in range(3)] != [0.85, 0.0, 0.0]
    found = as_solved(served, page)
    assert told(page, "numbers")["energy.total"] == pytest.approx(found.energy.total, rel=1e-7)
    assert page.run('document.getElementById("plot").dataset.what').startswith("force.end.")


def test_nothing_foreign_is_loaded_nothing_is_complained_of_and_the_title_is_text(page, served):
    assert page.complaints() == []
    assert all(url.startswith(served.address) for url in page.requests())
    assert page.run("document.querySelector('h1').textContent") == TITLE
    assert page.run("window.evil === undefined")
    assert page.run('document.querySelector("#view .stage").classList.contains("live")')
    assert page.run("document.querySelectorAll('script').length") == 1


def test_nonsense_is_said_and_the_strip_stays(page):
    before = told(page, "numbers")
    typed(page, "a lot")
    page.until("Number(document.body.dataset.refused) === 1")
    assert "strip.gamma" in page.run('document.getElementById("said").textContent')
    typed(page, "-3")
    page.until("Number(document.body.dataset.refused) === 2")
    assert told(page, "numbers") == before
    settled(page, lambda: typed(page, "6.5"))
    assert told(page, "values")["strip.gamma"] == 6.5
    assert page.run('document.getElementById("said").hidden')


def test_what_is_kept_is_said_and_is_the_same_strip(page, served):
    settled(page, lambda: typed(page, "7.5"))
    page.run('document.getElementById("keep").click()')
    page.until("document.body.dataset.kept")
    file = page.run("document.body.dataset.kept")
    assert f"ribbonbench solve {file}" in page.run('document.getElementById("kept").textContent')
    again = solve(load(served.folder / file))
    assert told(page, "numbers")["energy.total"] == pytest.approx(again.energy.total, rel=1e-8)


def test_a_shell_is_laid_over_the_strip(page):
    page.run('document.getElementById("shell").click()')
    page.until("document.body.dataset.shell")
    assert page.run("document.body.dataset.shell") == "there"
    assert "w/h = 100" in page.run('document.getElementById("beside").textContent')
    labels = page.run("[...document.querySelectorAll('.surfaces label')].map((e) => e.textContent.trim())")
    assert labels == ["strip", "shell, w/h = 100"]
    assert page.run("document.querySelectorAll('canvas.turn').length") == 1
    settled(page, lambda: typed(page, "7"))
    assert page.complaints() == []


def test_a_page_loaded_again_stands_where_it_stood_and_a_new_one_begins_anew(page):
    settled(page, lambda: typed(page, "8.25"))
    page.run("window.before = true")
    page("Page.reload")
    page.until("!window.before && document.readyState === 'complete' && Boolean(document.body.dataset.values)")
    assert told(page, "values")["strip.gamma"] == 8.25
    assert page.run('document.getElementById("undo").disabled') is False


def test_a_server_that_has_gone_is_said_and_nothing_is_lost(browser, tmp_path):
    (tmp_path / "arch.toml").write_text(SCENE)
    with Served("arch.toml", tmp_path) as served:
        browser.visit(served.address)
        browser.until("document.body.dataset.judged")
        settled(browser, lambda: typed(browser, "6"))
    typed(browser, "9")
    browser.until("document.body.dataset.lost === '1'")
    assert "strip.gamma = 9" in browser.run('document.getElementById("said").textContent')
    assert told(browser, "values")["strip.gamma"] == 6.0
