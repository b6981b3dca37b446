"""Reports from stored pages: what is in them, what data may not do to them, and mistakes."""

from __future__ import annotations

import base64
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.image import imread

from compare.cli import BAD_INPUT, DONE, main
from compare.page.drawing import save
from compare.page.page import PAGE, Page, Picture, Surface, read_page, write_page
from compare.page.table import Column, Table
from compare.page.verdict import Check, Verdict
from compare.pages.export.vtu import Sheet, write_vtu
from compare.pages.report import surfaces as report_surfaces
from compare.pages.report.folders import folders_of, read_part
from compare.pages.report.surfaces import AZIMUTH, field_range, points_each, thinned, view
from compare.store.states import FILE, MOST, Film, read_states
from compare.store.store import read_json

EVIL = "<script>alert(1)</script> \"quoted\" & 'single' | `tick` [x](http://nowhere)"


def strip(rise=0.0, along=60, across=5):
    """A strip bent to a quarter of a cylinder, moved up by `rise`: points (k, m, 3), S and v."""
    s, v = np.meshgrid(np.linspace(0, 1, along), np.linspace(-0.1, 0.1, across), indexing="ij")
    angle = 0.5 * np.pi * s
    return np.stack([np.sin(angle), v, rise + 1 - np.cos(angle)], axis=2) / (0.5 * np.pi), s, v


def picture(path):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4, 3))
    figure.add_subplot().plot([0, 1], [0, 1])
    return save(figure, path)


def states(count=5):
    """A strip that rises from 0 to 0.3 on the way to the second of two stages."""
    found = Film(0.2)
    for k in range(count):
        rise = 0.3 * k / (count - 1)
        points, s, _ = strip(rise, len(found.s), len(found.v))
        found.add(1 if k == 0 else 2, 1.0 if k == 0 else k / (count - 1), points, {"omega": s + rise})
    return found.states


def result(folder, title="A strip", surfaces=2, film=False, **more):
    """A folder of results as a command would leave it."""
    folder.mkdir(parents=True, exist_ok=True)
    picture(folder / "curve.png")
    listed = []
    for k in range(surfaces):
        points, s, v = strip(0.1 * k)
        name = f"shell_w{10 * k}.vtu" if k else "ribbon.vtu"
        fields = {"S": s, "v": v, "omega": s - 0.5} | ({"energy": s * s} if k else {})
        write_vtu(folder / name, points, fields)
        kind = "shell" if k else "ribbon"
        path = FILE if film and not k else ""
        label = f"{kind} {k}" + EVIL * (title == EVIL)
        listed.append(Surface(name, label, kind, width_to_thickness=10.0 * k or None, states=path))
    if film:
        (folder / FILE).write_bytes(states().to_bytes())
    columns = Column("w", "w/h", kind="digits"), Column("word", "word"), Column("value", "value", "l", "exponent:2")
    rows = (10.0, "yes", 1.25e-3), (20.0, EVIL, None)
    table = Table(f"Rows of {title}", columns, rows, "What the columns mean.")
    page = Page(
        command="compare", title=title,
        verdict=Verdict(f"It holds{EVIL * (title == EVIL)}", "fair", (Check("seen", "fair", EVIL),)),
        sentences=("Said.", EVIL),
        tables=(table,),
        pictures=(Picture("curve.png", "A straight line from 0 to 1", "Rising"),), surfaces=tuple(listed),
        files={"result.json": "numbers"}, scene='title = "x"\n# ``` in a comment\n', up=(0.0, 0.0, 1.0),
        provenance={"time": "2026-01-01", "packages": {"numpy": "1.26"}, "cpu": "a processor", "scene_hash": "ab" * 32},
        again="ribbonbench compare x --set 'a=[1,2]'", **more,
    )  # fmt: skip
    write_page(folder, page)
    return folder


class Reader(HTMLParser):
    """Tags with their attributes, the words outside scripts and styles, and the data of the views."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.words, self.data, self._inside = [], [], [], ""
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        self._inside = tag if tag in ("script", "style") else ""
        self._is_data = dict(attributes).get("type") == "application/json"

    def handle_endtag(self, tag):
        self._inside = "" if tag == self._inside else self._inside

    def handle_data(self, text):
        if self._inside == "script" and self._is_data:
            self.data.append(json.loads(text))
        elif not self._inside:
            self.words.append(text)

    def named(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


def run(capsys, *arguments):
    code = main(["report", *map(str, arguments)])
    said = capsys.readouterr()
    return code, said.out, said.err


def test_one_folder(capsys, tmp_path):
    folder = result(tmp_path / "one")
    code, out, _ = run(capsys, folder)
    assert code == DONE
    assert "report.html" in out.replace("\n", "")
    found = Reader((folder / "report.html").read_text())
    words = " ".join(found.words)
    shown = ("A strip", "It holds: fair.", "Rows of A strip", "1.25e-03", "What the columns mean.", "Rising")
    made = ("ribbonbench compare x --set 'a=[1,2]'", "numpy 1.26", "a processor", "abababababab", 'title = "x"')
    for text in shown + made:
        assert text in words, text
    assert "a=[1,2]" in words
    assert found.named("nav") == []
    images = found.named("img")
    assert len(images) == 2
    assert all(image["src"].startswith("data:image/png;base64,") and len(image["alt"]) > 10 for image in images)
    (data,) = found.data
    assert [s["label"] for s in data["surfaces"]] == ["ribbon 0", "shell 1"]
    assert set(data["names"]) == {"S", "v", "omega", "energy"}
    assert set(data["surfaces"][0]["fields"]) == {"S", "v", "omega"}


def test_nothing_in_it_asks_the_network(capsys, tmp_path):
    assert run(capsys, result(tmp_path / "one"))[0] == DONE
    text = (tmp_path / "one" / "report.html").read_text()
    found = Reader(text)
    (policy,) = [m["content"] for m in found.named("meta") if m.get("http-equiv") == "Content-Security-Policy"]
    assert policy.startswith("default-src 'none';")
    assert "unsafe" not in policy
    for name, attributes in found.tags:
        for key in ("src", "href", "srcset", "action", "data", "poster"):
            value = attributes.get(key) or ""
            assert not value or value.startswith(("data:", "#")), (name, value)
        assert not any(key.startswith("on") for key in attributes), name
        assert "style" not in attributes, name
    script = re.search(r"<script>(.*)</script>", text, re.S)[1]
    assert not re.search(r"https?:|fetch\(|XMLHttpRequest|import\s*\(|WebSocket|sendBeacon", script)
    assert not re.search(r"https?:|@import|url\(", re.search(r"<style>(.*?)</style>", text, re.S)[1])


def test_words_from_data_are_shown_literally(capsys, tmp_path):
    folder = result(tmp_path / "evil", title=EVIL)
    assert run(capsys, folder)[0] == DONE
    text = (folder / "report.html").read_text()
    assert "<script>alert" not in text
    found = Reader(text)
    assert [a.get("type") for a in found.named("script")] == ["application/json", None]
    assert EVIL in " ".join(found.words)
    assert found.data[0]["surfaces"][1]["label"] == f"shell 1{EVIL}"
    assert EVIL in found.data[0]["alt"]
    assert any(EVIL in image["alt"] for image in found.named("img"))
    markdown = (folder / "report.md").read_text()
    assert "<script>" not in markdown
    assert not re.search(r"(?<!\\)\[x\]\(http", markdown)
    assert "\\| " in next(line for line in markdown.splitlines() if line.startswith("| 20"))


def test_markdown_twin_beside_its_pictures(capsys, tmp_path):
    folder = result(tmp_path / "one")
    assert run(capsys, folder, "--quiet") == (DONE, "", "")
    text = (folder / "report.md").read_text()
    links = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", text)
    assert links == ["curve.png", "surfaces.png"]
    assert imread(folder / "surfaces.png")[:, :, :3].std() > 0.02
    assert "| 10 | yes | 1.25e-03 |" in text
    assert "````toml\n" in text  # a fence longer than what is in the scene
    assert {p.name for p in folder.iterdir()} == {
        "curve.png", "ribbon.vtu", "shell_w10.vtu", "page.json", "report.html", "report.md", "surfaces.png",
    }  # fmt: skip


def test_several_folders_elsewhere(capsys, tmp_path):
    result(tmp_path / "all" / "b second", title="Second", surfaces=0)
    result(tmp_path / "all" / "a", title="First")
    other = result(tmp_path / "other", title="Third", surfaces=1)
    (tmp_path / "all" / "cases").mkdir()
    out = tmp_path / "out"
    code, _, _ = run(capsys, tmp_path / "all", other, tmp_path / "all" / "a", "--out", out)
    assert code == DONE
    found = Reader((out / "report.html").read_text())
    assert [a["href"] for a in found.named("a")] == ["#r1", "#r2", "#r3"]
    assert {s["id"] for s in found.named("section")} == {"r1", "r2", "r3"}
    words = " ".join(found.words)
    assert words.index("First") < words.index("Second") < words.index("Third")
    assert len(found.data) == 2
    text = (out / "report.md").read_text()
    for link in re.findall(r"!\[[^\]]+\]\(([^)]+)\)", text):
        assert (out / link).read_bytes().startswith(b"\x89PNG"), link
    assert (out / "report_files" / "02_b_second" / "curve.png").is_file()
    assert not (out / "report_files" / "02_b_second" / "surfaces.png").exists()
    assert str(tmp_path) not in text + (out / "report.html").read_text()


def test_a_report_of_many_surfaces_stays_small(tmp_path):
    along, across = 951, 13
    points, s, v = strip(along=along, across=across)
    for count in (1, 6, 40, 500):
        each = points_each(count)
        sheet = Sheet(points.reshape(-1, 3), np.zeros((0, 3), int), {})
        assert each * count <= max(report_surfaces.MOST_POINTS, count * 300)
        assert sheet.shape is None
    folder = tmp_path / "many"
    folder.mkdir()
    fields = {"S": s, "v": v, "omega": s, "eta": v, "energy_density": s * v}
    listed = []
    for k in range(6):
        write_vtu(folder / f"s{k}.vtu", points + 0.01 * k, fields)
        listed.append(Surface(f"s{k}.vtu", f"shell {k}", "shell"))
    write_page(folder, Page("compare", "Many", surfaces=tuple(listed)))
    assert main(["report", str(folder), "--quiet"]) == DONE
    assert (folder / "report.html").stat().st_size < 3e6


# --- surfaces --------------------------------------------------------------------------------------------------------


def test_thinning_keeps_the_ends_and_the_normals():
    points, s, v = strip(along=501, across=13)
    write = {"S": s.ravel(), "v": v.ravel()}
    from compare.pages.export.vtu import triangles

    sheet = Sheet(points.reshape(-1, 3), triangles(501, 13), write)
    thin = thinned(sheet, 900)
    assert thin.shape is not None
    assert thin.shape[0] * thin.shape[1] <= 900
    for corner, kept in ((0, 0), (-1, -1)):
        assert np.array_equal(thin.points[kept], sheet.points[corner])
    angle = 0.5 * np.pi * thin.fields["S"]
    exact = np.column_stack([-np.sin(angle), 0 * angle, np.cos(angle)])
    assert np.abs(np.abs(np.sum(thin.fields["_normal"] * exact, axis=1)) - 1).max() < 1e-4
    loose = Sheet(sheet.points, sheet.triangles[::-1], {"S": write["S"]})
    assert loose.shape is None
    coarse = thinned(loose, 900)
    assert 100 < len(coarse.points) < 1500
    angle = np.arctan2(coarse.points[:, 0], 2 / np.pi - coarse.points[:, 2])
    assert np.abs(coarse.fields["S"] - angle * 2 / np.pi).max() < 0.01


def test_colours_leave_out_what_stands_alone():
    values = np.append(np.linspace(0, 1, 1000), [1000.0, np.nan])
    least, most, first, last = field_range(values)
    assert (least, most) == (0.0, 1000.0)
    assert first < 0.03
    assert 0.9 < last < 1.1
    assert field_range(np.linspace(0, 1, 1000)) == (0.0, 1.0, 0.0, 1.0)


def test_numbers_survive_the_quantisation():
    points, s, v = strip()
    sheet = Sheet(points.reshape(-1, 3), read_sheet_triangles(60, 5), {"S": s.ravel(), "v": v.ravel(),
                  "omega": np.where(s < 0.5, s, np.nan).ravel()})  # fmt: skip
    found = view([(Surface("x.vtu", "x", "ribbon"), sheet)], None, 8000)
    data = report_surfaces.as_data(found, "alt")
    (entry,) = data["surfaces"]
    raw = np.frombuffer(base64.b64decode(entry["places"]), "<u2").reshape(-1, 3)
    back = np.array(data["low"]) + raw / 65535 * np.array(data["span"])
    assert back.shape == sheet.points.shape
    assert np.abs(back - sheet.points).max() < 1e-5
    omega = entry["fields"]["omega"]
    values = np.frombuffer(base64.b64decode(omega["values"]), "<u2")
    known = s.ravel() < 0.5
    assert (values[~known] == 65535).all()
    assert np.abs(omega["low"] + values[known] / 65534 * (omega["high"] - omega["low"]) - s.ravel()[known]).max() < 1e-5
    assert entry["grid"] == (60, 5)


def read_sheet_triangles(along, across):
    from compare.pages.export.vtu import triangles

    return triangles(along, across)


@pytest.mark.parametrize("up", [None, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 3.0, 4.0)])
def test_the_camera_sees_everything(up):
    points, s, v = strip()
    sheet = Sheet(points.reshape(-1, 3), read_sheet_triangles(60, 5), {"S": s.ravel(), "v": v.ravel()})
    found = view([(Surface("x.vtu", "x", "ribbon"), sheet)], up, 8000)
    places, depth = report_surfaces.screen(found, sheet.points)
    assert (depth > 0).all()
    assert np.abs(places[:, 0]).max() < report_surfaces.ASPECT
    assert np.abs(places[:, 1]).max() < 1.0
    assert max(np.abs(places[:, 0]).max() / report_surfaces.ASPECT, np.abs(places[:, 1]).max()) > 0.6
    assert found.away @ found.upwards == pytest.approx(np.sin(report_surfaces.ELEVATION))
    assert found.away @ found.along == pytest.approx(np.cos(report_surfaces.ELEVATION) * np.cos(AZIMUTH))


def test_a_strip_hanging_straight_down_has_a_view():
    s, v = np.meshgrid(np.linspace(0, 1, 9), np.zeros(1), indexing="ij")
    points = np.stack([0 * s, 0 * s, -s], axis=2).reshape(-1, 3)
    sheet = Sheet(points, np.array([[0, 1, 2]]), {})
    found = view([(Surface("x.vtu", "x", "ribbon"), sheet)], (0.0, 0.0, 1.0), 8000)
    assert np.isfinite(found.along).all()
    assert np.isfinite(found.distance)
    assert v.shape == (9, 1)


# --- mistakes --------------------------------------------------------------------------------------------------------


def refused(capsys, *arguments):
    code, _, err = run(capsys, *arguments)
    assert code == BAD_INPUT
    assert err.count("ribbonbench:") == 1
    assert err.count("\n") == 1  # before anything is begun
    return err


def test_a_folder_with_nothing(capsys, tmp_path):
    assert "holds no results" in refused(capsys, tmp_path)
    assert "is not there" in refused(capsys, tmp_path / "absent")
    path = tmp_path / "file"
    path.write_text("x")
    assert "is a file" in refused(capsys, path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file"]


def test_an_older_store(capsys, tmp_path):
    (tmp_path / "result.json").write_text("{}")
    assert "older version" in refused(capsys, tmp_path)
    (tmp_path / PAGE).write_text('{"format": 0, "provenance": {"packages": {"ribbonbench": "0.0.1"}}}')
    assert "ribbonbench 0.0.1" in refused(capsys, tmp_path)
    (tmp_path / PAGE).write_text('{"format": 1')
    assert "cannot be read" in refused(capsys, tmp_path)


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda f: (f / "curve.png").unlink(), "'curve.png', which is not there"),
        (lambda f: (f / "curve.png").write_text("no picture"), "no PNG"),
        (lambda f: (f / "ribbon.vtu").write_bytes(b"<VTKFile"), "'ribbon.vtu': cannot be read"),
        (lambda f: (f / "ribbon.vtu").unlink(), "'ribbon.vtu', which is not there"),
    ],
)
def test_damaged_results(capsys, tmp_path, damage, words):
    folder = result(tmp_path / "one")
    damage(folder)
    assert words in refused(capsys, folder, "--out", tmp_path / "out")
    assert not (tmp_path / "out" / "report.html").exists()


def test_a_page_that_names_files_elsewhere(capsys, tmp_path):
    (tmp_path / "secret.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    folder = tmp_path / "one"
    folder.mkdir()
    write_page(folder, Page("solve", "x", pictures=(Picture("../secret.png", "alt"),)))
    assert "outside the folder" in refused(capsys, folder)


def test_folders_once_and_in_order(tmp_path):
    a, b = (result(tmp_path / name, surfaces=0) for name in ("a", "b"))
    assert folders_of([b, a, b, tmp_path]) == [b, a]
    assert folders_of([tmp_path]) == [a, b]


# --- the commands' own pages -----------------------------------------------------------------------------------------


def test_solve_leaves_a_page(capsys, tmp_path):
    assert main(["solve", "coil_10_100", "--out", str(tmp_path / "o"), "--set", "strip.gamma=90"]) == DONE
    assert "ribbonbench report" in capsys.readouterr().out
    page = read_page(tmp_path / "o")
    assert page.command == "solve"
    assert page.up == tuple(read_json(tmp_path / "o" / "result.json")["provenance"]["scene"]["gravity"]["up"])
    assert dict(page.tables[0].rows)["status"].startswith("converged")
    assert [s.file for s in page.surfaces] == ["ribbon.vtu"]
    assert set(page.files) == {"result.json", "ribbon.vtu", "ribbon.npz", "centreline.csv"}
    assert str(tmp_path) not in (tmp_path / "o" / PAGE).read_text()
    assert main(["report", str(tmp_path / "o"), "--quiet"]) == DONE


def test_an_elastica_has_a_page_without_surfaces(tmp_path):
    path = tmp_path / "mine.toml"
    from compare.scene.scene import load

    path.write_text(load("cantilever").to_toml().replace("wunderlich", "elastica"))
    out = tmp_path / "o"
    assert main(["solve", str(path), "--out", str(out), "--quiet"]) == DONE
    page = read_page(out)
    assert page.surfaces == ()
    assert main(["report", str(out), "--quiet"]) == DONE
    text = (out / "report.html").read_text()
    assert "<canvas" not in text
    assert "script-src 'none'" in text
    assert not (out / "surfaces.png").exists()


def test_one_shell_is_seen_at_first_and_each_has_its_colour(tmp_path):
    part = read_part(result(tmp_path / "many", surfaces=4))
    found = view(part.surfaces, part.page.up, 1000, part.states)
    assert [one.first for one in found.surfaces] == [True, False, False, True]  # the thinnest
    assert [one.partner for one in found.surfaces] == [None, 0, 0, 0]  # the same particles as the ribbon's
    colours = np.array([one.colour for one in found.surfaces])
    apart = np.linalg.norm(colours[:, None] - colours[None], axis=2) + 9.0 * np.eye(4)
    assert apart.min() > 0.25
    assert np.ptp(colours, axis=1).min() > 0.3  # no greys
    bare = (part.surfaces[1][0], Sheet(part.surfaces[1][1].points, part.surfaces[1][1].triangles))
    assert view([part.surfaces[0], bare], part.page.up, 1000).surfaces[1].partner is None


def test_states_of_a_path_come_along(capsys, tmp_path):
    assert run(capsys, result(tmp_path / "film", film=True))[0] == DONE
    (data,) = Reader((tmp_path / "film" / "report.html").read_text()).data
    frames = data["surfaces"][0]["frames"]
    assert "frames" not in data["surfaces"][1]
    assert len(frames["labels"]) == len(set(frames["labels"])) == 5
    packed = np.frombuffer(base64.b64decode(frames["places"]), dtype="<u2").reshape(5, *frames["grid"], 3)
    places = np.array(data["low"]) + packed / 65535 * np.array(data["span"])
    assert places[:, 0, 0, 2] == pytest.approx(0.3 * np.arange(5) / 4 * 2 / np.pi, abs=1e-4)
    assert (tmp_path / "film" / FILE).read_bytes() == states().to_bytes()
    damaged = result(tmp_path / "damaged", film=True)
    (damaged / FILE).write_bytes(b"PK")
    code, _, err = run(capsys, damaged)
    assert code == BAD_INPUT
    assert FILE in err


def test_a_long_path_keeps_its_ends_and_no_more_than_it_may(tmp_path):
    film = Film(0.1)
    points = np.zeros((len(film.s), len(film.v), 3))
    for stage, steps in ((1, 1), (2, 500), (3, 300)):
        for k in range(1, steps + 1):
            film.add(stage, k / steps, points + stage + k / steps, {})
    found = film.states
    assert MOST // 3 <= len(found.t) <= MOST
    assert (found.stage[0], found.t[0]) == (1, 1)
    assert (found.stage[-1], found.t[-1]) == (3, 1)
    assert (2.0, 1.0) in set(zip(found.stage, found.t, strict=True))
    assert (np.diff(found.seconds) > 0).all()
    assert found.seconds[0] == 0.0
    assert np.diff(found.points[:, 0, 0, 0]).min() > 0
    (tmp_path / FILE).write_bytes(found.to_bytes())
    again = read_states(tmp_path / FILE)
    assert again.points == pytest.approx(found.points, abs=1e-6)
    assert again.labels == found.labels


def test_pictures_are_shown_at_half_their_pixels(capsys, tmp_path):
    folder = result(tmp_path / "sharp")
    assert run(capsys, folder)[0] == DONE
    (image,) = [i for i in Reader((folder / "report.html").read_text()).named("img") if "straight line" in i["alt"]]
    assert int(image["width"]) == imread(folder / "curve.png").shape[1] // 2
