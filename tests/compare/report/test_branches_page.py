"""branches.html: one file with every point's numbers and shape; slider and diagram lead to them."""

import base64
import json
import re

import numpy as np
import pytest

from compare.battery.cases.branches.scenes import mast
from compare.pages.branches import page as write
from compare.scene.scene import loads
from compare.studies.branches.run import Asked, diagram
from tests.compare.report.browser import CHROMIUM, Browser

MAST = mast("Mast <b>", 0.3, 2.0, "elastica", 6)


@pytest.fixture(scope="module")
def masts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mast")
    found = diagram(loads(MAST, "mast"), "strip.gamma", 5.0, 12.0, asked=Asked(branches=3, errors=True))
    write.write(folder, found, "")
    return found, folder / write.HTML


def data_of(text):
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)[1])


def test_the_page_is_one_file_and_holds_the_numbers_of_every_point(masts):
    found, path = masts
    text = path.read_text()
    assert "default-src 'none'" in text
    assert re.findall(r'(?:src|href)="(?!data:|#)', text) == []
    assert "Mast <b>" not in text.split("</head>")[1].split("<script")[0]  # names are text
    data, points = data_of(text), [p for b in found.branches for p in b.points]
    assert len(data["points"]) == len(points) > 10
    for told, point in zip(data["points"], points, strict=True):
        assert told["parameter"] == point.parameter
        assert told["energy"] == point.energy
        assert told["unstable"] == point.unstable
        assert told["error"] == point.error
    kinds = [told["kind"] for told in data["points"]]
    assert kinds.count("branch_point") == 1
    assert data["points"][kinds.index("branch_point")]["error"] > 0.0
    assert sum(branch["count"] for branch in data["branches"]) == len(points)


def test_the_shapes_are_those_of_the_points(masts):
    found, path = masts
    view = data_of(path.read_text())["view"]
    frames = view["surfaces"][0]["frames"]
    along, across = frames["grid"]
    packed = np.frombuffer(base64.b64decode(frames["places"]), "<u2").reshape(-1, along, across, 3)
    places = np.array(view["low"]) + np.array(view["span"]) * packed / 65535
    points = [p for b in found.branches for p in b.points]
    assert len(places) == len(points)
    for place, point in zip(places, points, strict=True):
        assert np.abs(place[-1, across // 2] - point.end).max() < 1e-4
        assert np.linalg.norm(place[0, 0] - place[0, -1]) == pytest.approx(0.02, abs=1e-4)
    assert max(np.abs(place[-1, 1, 0]) for place in places) > 0.1  # it leans


@pytest.mark.validate
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium (make setup installs it)")
def test_a_click_on_the_diagram_and_the_slider_show_the_strip_there(masts, tmp_path):
    found, path = masts
    points = [p for b in found.branches for p in b.points]
    with Browser(tmp_path / "profile") as browser:
        browser.open(path, 1300, 1000)
        browser.until("document.body.dataset.chosen === '0'")
        browser.until("document.querySelector('canvas.turn').dataset.drawn")
        before = browser.screenshot(tmp_path / "first.png").read_bytes()
        assert browser.run("document.querySelectorAll('#plot .unstable').length") == 1
        assert browser.run("document.querySelectorAll('#plot .bar').length") == 1
        k = max(range(len(points)), key=lambda k: points[k].unstable == 0 and abs(points[k].end[0]))
        drawn = browser.run("Number(document.querySelector('canvas.turn').dataset.drawn)")
        x, y = browser.run(f"""(() => {{
          const box = document.getElementById("plot").getBoundingClientRect();
          const s = document.querySelector("#view input.path");
          s.value = {k};
          s.dispatchEvent(new Event("input"));
          const ring = document.querySelector("#plot .chosen");
          return [box.x + Number(ring.getAttribute("cx")), box.y + Number(ring.getAttribute("cy"))];
        }})()""")
        assert browser.run("document.body.dataset.chosen") == str(k)
        browser.until(f"Number(document.querySelector('canvas.turn').dataset.drawn) > {drawn}")
        assert browser.screenshot(tmp_path / "bent.png").read_bytes() != before
        told = browser.run("document.getElementById('numbers').textContent")
        assert f"{points[k].parameter:.6g}"[:5] in told
        assert "0 (stable)" in told
        browser.run("""(() => {
          const s = document.querySelector("#view input.path");
          s.value = 0;
          s.dispatchEvent(new Event("input"));
        })()""")
        assert browser.run("document.body.dataset.chosen") == "0"
        browser.drag((x, y), (0.0, 0.0))  # a click where the ring was leads back
        assert browser.run("document.body.dataset.chosen") == str(k)
        assert browser.complaints() == []
        assert browser.requests() == [path.resolve().as_uri()]
