"""The HTML report in headless Chromium: no complaint, no request, a 3-D view that draws and turns, words."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.image import imread

from compare.cli import DONE, main
from compare.page.page import Page, write_page
from compare.page.table import Column, Table
from tests.compare.report.browser import CHROMIUM, Browser
from tests.compare.report.test_report import EVIL, result

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium (make setup installs it)")

#: Share of the canvas that is drawn on, how many colours, and a small picture of it (software rendering is not exact to
#: the last bit: pictures are compared by their means over 32 x 20 parts).
PIXELS = """(() => {
  const canvas = document.querySelector("canvas.turn");
  const read = (width, height) => {
    const copy = document.createElement("canvas");
    [copy.width, copy.height] = [width, height];
    const context = copy.getContext("2d");
    context.imageSmoothingQuality = "high";
    context.drawImage(canvas, 0, 0, width, height);
    return context.getImageData(0, 0, width, height).data;
  };
  const data = read(canvas.width, canvas.height), seen = new Set();
  let drawn = 0;
  for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 0) {
    drawn++;
    seen.add(data[i] * 65536 + data[i + 1] * 256 + data[i + 2]);
  }
  return { share: 4 * drawn / data.length, colours: seen.size, small: [...read(32, 20)] };
})()"""
DRAWN = 'Number((document.querySelector("canvas.turn") || { dataset: {} }).dataset.drawn || 0)'
NO_WORDS = """[...document.querySelectorAll("img, canvas, [role], select, input, button")].filter(
  (e) => !(e.alt || e.getAttribute("aria-label") || e.getAttribute("aria-hidden") || e.textContent.trim() ||
    (e.closest("label") || e).textContent.trim())).map((e) => e.outerHTML.slice(0, 80))"""


def apart(one, other):
    """Largest difference between two pictures on black, and between what they cover, of 255."""
    found = []
    for pixels in (one, other):
        small = np.array(pixels["small"], dtype=float).reshape(32 * 20, 4)
        small[:, :3] *= small[:, 3:] / 255.0
        found.append(small)
    return np.abs(found[0] - found[1]).max()


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    folder = tmp_path_factory.mktemp("browser")
    result(folder / "a")
    result(folder / "b", title=EVIL, surfaces=3)
    result(folder / "film", film=True)
    for name in ("a", "film"):
        assert main(["report", str(folder / name), "--quiet"]) == DONE
    assert main(["report", str(folder), "--out", str(folder / "all"), "--quiet"]) == DONE
    return folder


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    found = Browser(tmp_path_factory.mktemp("profile"))
    with found:
        yield found
    assert found.processes() == []


def opened(browser, path, **options):
    browser.open(path, **options)
    browser.run('document.querySelector(".stage").scrollIntoView({ block: "center" })')
    browser.until(f"{DRAWN} > 0")
    return browser.run(PIXELS)


def changed(browser, action):
    """Pixels before and after an action that makes the view draw again."""
    before, count = browser.run(PIXELS), browser.run(DRAWN)
    action()
    browser.until(f"{DRAWN} > {count}")
    browser.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")
    return before, browser.run(PIXELS)


@pytest.mark.parametrize("name", ["a", "all"])
def test_no_complaint_and_no_request(browser, report, name):
    path = report / name / "report.html"
    opened(browser, path)
    assert browser.complaints() == []
    assert browser.requests() == [path.resolve().as_uri()]
    assert browser.run("document.images.length") >= 2
    assert browser.run("[...document.images].every((i) => i.complete && i.naturalWidth > 0)")


def test_the_policy_stops_scripts_and_requests(browser, report):
    """What the report does not need is refused, so that words from data could not do it either."""
    opened(browser, report / "a" / "report.html")
    browser.run("""const bad = document.createElement("script");
        bad.textContent = "window.bad = 1";
        document.body.append(bad);
        document.body.append(Object.assign(new Image(), { src: "http://localhost:9/x.png" }))""")
    assert browser.run("window.bad === undefined")
    assert any("Content Security Policy" in text for text in browser.complaints())


def test_the_view_draws_in_colours(browser, report):
    pixels = opened(browser, report / "a" / "report.html")
    assert 0.02 < pixels["share"] < 0.9
    assert pixels["colours"] > 50
    assert browser.run('document.querySelector(".stage").classList.contains("live")')


def middle(browser):
    box = browser.run('JSON.parse(JSON.stringify(document.querySelector("canvas.turn").getBoundingClientRect()))')
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_it_turns_by_mouse_keys_and_touch(browser, report):
    opened(browser, report / "a" / "report.html")
    start = middle(browser)
    first, turned = changed(browser, lambda: browser.drag(start, (120, 40)))
    assert apart(turned, first) > 20
    assert turned["share"] > 0.01
    assert browser.run("document.activeElement.className") == "turn"

    def press(key):
        browser("Input.dispatchKeyEvent", type="keyDown", key=key)
        browser("Input.dispatchKeyEvent", type="keyUp", key=key)

    for key in ("ArrowLeft", "ArrowUp", "-"):
        before, after = changed(browser, lambda key=key: press(key))
        assert apart(after, before) > 20, key
    _, home = changed(browser, lambda: press("0"))
    assert apart(home, first) < 8
    x, y = start

    def zoom():
        browser("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-200)

    before, after = changed(browser, zoom)
    assert after["share"] > before["share"]

    def touch():
        browser("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
        for k in range(1, 4):
            browser("Input.dispatchTouchEvent", type="touchMove", touchPoints=[{"x": x + 20 * k, "y": y}])
        browser("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    before, after = changed(browser, touch)
    assert apart(after, before) > 20
    assert browser.complaints() == []


def test_fields_and_surfaces_are_chosen(browser, report):
    opened(browser, report / "a" / "report.html")
    choose = """(name) => { const s = document.querySelector(".controls select"); s.value = name;
        s.dispatchEvent(new Event("change")); }"""
    plain, coloured = changed(browser, lambda: browser.run(f"({choose})('omega')"))
    assert apart(coloured, plain) > 20
    assert browser.run('[...document.querySelectorAll(".bar > span")].map((e) => e.textContent)') == ["-0.5", "0.5"]
    assert browser.run('!document.querySelector(".bar").hidden')
    # only the shell has an energy: its own range
    changed(browser, lambda: browser.run(f"({choose})('energy')"))
    assert browser.run('[...document.querySelectorAll(".bar > span")].map((e) => e.textContent)') == ["0", "1"]
    before, after = changed(browser, lambda: browser.run('document.querySelectorAll(".surfaces input")[1].click()'))
    assert after["share"] < 0.8 * before["share"]
    assert browser.run('document.querySelector(".bar").hidden')


def slide(browser, name, value):
    """Moves a slider and waits until the view has drawn again; pixels before and after."""
    move = f"""(() => {{ const s = document.querySelector("input.{name}"); s.value = {value};
        s.dispatchEvent(new Event("input")); }})()"""
    return changed(browser, lambda: browser.run(move))


def told(browser, name):
    return browser.run(f'document.querySelector("input.{name} ~ output").textContent')


def test_one_shell_at_a_time_and_its_difference(browser, report):
    """Shells 0.064 and 0.127 over the ribbon, of a view of radius 0.5: one is seen, the slider takes the other."""
    result(report / "b2", surfaces=3)
    assert main(["report", str(report / "b2"), "--quiet"]) == DONE
    opened(browser, report / "b2" / "report.html")
    ticks = '[...document.querySelectorAll(".surfaces input")].map((e) => e.checked)'
    assert browser.run(ticks) == [True, False, True]
    before, after = slide(browser, "ladder", 0)
    assert browser.run(ticks) == [True, True, False]
    assert "10" in told(browser, "ladder")
    assert apart(before, after) > 20
    before, after = slide(browser, "difference", 40)
    assert float(told(browser, "difference").strip("× ")) > 1.5
    assert apart(before, after) > 20
    before, after = slide(browser, "opacity", 10)
    assert apart(before, after) > 20
    assert browser.complaints() == []


def test_the_path_is_a_slider_and_plays(browser, report):
    opened(browser, report / "film" / "report.html")
    last = told(browser, "path")
    before, after = slide(browser, "path", 3)
    assert told(browser, "path") != last
    assert apart(before, after) > 20
    choose = """(() => { const s = document.querySelector(".controls select"); s.value = "omega";
        s.dispatchEvent(new Event("change")); })()"""
    changed(browser, lambda: browser.run(choose))
    # one scale for all states, of s and up to 0.3 more, and for the shell, of s - 0.5: zero is in the middle
    ends = browser.run('[...document.querySelectorAll(".bar > span")].map((e) => parseFloat(e.textContent))')
    assert ends == pytest.approx([-1.3, 1.3], abs=0.05)
    browser.run('document.querySelector("button.play").click()')
    browser.until(f"document.querySelector('input.path ~ output').textContent === {last!r}")
    browser.until("document.querySelector('button.play').textContent === 'play'")
    assert browser.complaints() == []


def test_values_under_the_pointer_and_a_saved_picture(browser, report):
    opened(browser, report / "a" / "report.html")
    spots = [(x, y) for x in np.linspace(0.3, 0.7, 9) for y in np.linspace(0.3, 0.7, 9)]
    box = browser.run('JSON.parse(JSON.stringify(document.querySelector("canvas.turn").getBoundingClientRect()))')
    found = None
    for x, y in spots:
        place = {"x": box["x"] + x * box["width"], "y": box["y"] + y * box["height"]}
        browser("Input.dispatchMouseEvent", type="mouseMoved", **place)
        browser.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")
        if browser.run('!document.querySelector(".tip").hidden'):
            found = browser.run('document.querySelector(".tip").textContent').split("\n")
            break
    assert found is not None
    values = [float(line.rsplit(": ", 1)[1]) for line in found[1:]]
    assert 0.0 <= values[0] <= 1.0
    assert abs(values[1]) <= 0.1
    browser.run(
        """[...document.querySelectorAll(".controls button")].find((b) => /picture/.test(b.textContent)).click()"""
    )
    assert browser.run('Number(document.querySelector("figure.view").dataset.saved)') > 5000
    assert browser.complaints() == []


@pytest.mark.parametrize("name", ["a", "all"])
def test_every_picture_has_words(browser, report, name):
    opened(browser, report / name / "report.html")
    assert browser.run(NO_WORDS) == []
    label = browser.run('document.querySelector("canvas.turn").getAttribute("aria-label")')
    assert "ribbon 0; shell 1" in label


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("name", ["a", "all"])
def test_a_phone_scrolls_no_page_sideways(browser, report, name, dark):
    opened(browser, report / name / "report.html", width=360, height=740, phone=True, dark=dark)
    assert browser.run("document.documentElement.scrollWidth") == 360
    browser.run('document.querySelectorAll("details").forEach((d) => { d.open = true; })')
    assert browser.run("document.documentElement.scrollWidth") == 360
    assert browser.run('[...document.querySelectorAll(".box")].every((b) => b.getBoundingClientRect().right <= 360)')
    shade = browser.run("getComputedStyle(document.body).backgroundColor")
    assert (sum(map(int, shade[4:-1].split(","))) < 200) == dark
    assert browser.complaints() == []


def test_paper_shows_the_still_picture(browser, report):
    opened(browser, report / "a" / "report.html")
    browser("Emulation.setEmulatedMedia", media="print")
    try:
        assert browser.run('getComputedStyle(document.querySelector("canvas.turn")).display') == "none"
        assert browser.run('getComputedStyle(document.querySelector(".stage > img")).visibility') == "visible"
        assert browser.run('getComputedStyle(document.querySelector(".box")).overflowX') == "visible"
        assert browser.run('[...document.querySelectorAll("pre")].every((e) => e.scrollWidth <= e.clientWidth)')
    finally:
        browser("Emulation.setEmulatedMedia", media="")


def test_a_wide_table_is_whole_on_paper_and_on_a_phone(browser, tmp_path):
    """Sixteen columns: six in the main table, all on paper (A4 between its margins) and, unfolded, on a phone."""
    columns = tuple(Column(f"c{k}", f"heading {k}", kind="exponent:2") for k in range(16))
    table = Table("Wide", columns, tuple(tuple(1e-3 * (k + 1) * row for k in range(16)) for row in (1.0, 2.0, 3.0)))
    write_page(tmp_path, Page("compare", "Wide", tables=(table,)))
    assert main(["report", str(tmp_path), "--quiet"]) == DONE
    browser.open(tmp_path / "report.html", width=670, height=900)
    seen = """[...document.querySelectorAll("table")].filter((t) => t.checkVisibility({ contentVisibilityAuto: true }))
        .map((t) => [t.rows[0].cells.length, t.getBoundingClientRect().right])"""
    assert [count for count, _ in browser.run(seen)] == [6]
    browser("Emulation.setEmulatedMedia", media="print")
    try:
        found = browser.run(seen)
        assert [count for count, _ in found] == [6, 6, 6, 6]  # 1 + 3 parts of the row's name and five columns
        assert max(right for _, right in found) <= 670
    finally:
        browser("Emulation.setEmulatedMedia", media="")
    browser.open(tmp_path / "report.html", width=360, height=740, phone=True)
    browser.run('document.querySelectorAll("details").forEach((d) => { d.open = true; })')
    assert browser.run("document.documentElement.scrollWidth") == 360
    assert len(browser.run(seen)) == 4


def test_without_webgl_the_still_picture_stays(tmp_path, report):
    found = Browser(tmp_path, webgl=False)
    with found:
        found.open(report / "a" / "report.html")
        found.until('!!document.querySelector(".note")')
        assert "No WebGL" in found.run('document.querySelector(".note").textContent')
        assert found.run('document.querySelector("canvas.turn")') is None
        assert found.run('getComputedStyle(document.querySelector(".stage > img")).visibility') == "visible"
        pixels = imread(found.screenshot(tmp_path / "page.png"))
        assert pixels[:, :, :3].std() > 0.02
        assert [text for text in found.complaints() if "WebGL" not in text] == []
    assert found.processes() == []
