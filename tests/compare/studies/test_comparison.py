"""The comparison layer on stored shells: rows, errors, claims, slope; tables, pictures and files made from them."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import replace

import meshio
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compare.measure.align import aligned
from compare.measure.distance import centreline_distance
from compare.measure.grid import Grid
from compare.models import solve as solve_scene
from compare.models.base import Options, State, natural_constant
from compare.models.reference import coarser
from compare.models.ribbon.model import RibbonModel
from compare.models.shell_process import ShellCase, shell_problem
from compare.page.csv import as_csv
from compare.page.markdown import as_markdown
from compare.page.page import read_page
from compare.page.pair import Times
from compare.pages import compare as report
from compare.pages import comparison as tables
from compare.pages import ribbon as ribbon_page
from compare.pages.models.supports import side_by_side
from compare.pages.pictures import comparison as figures
from compare.pages.pictures import ribbon as profile
from compare.pages.report.write import read_report, write_report
from compare.pages.result import comparison_result
from compare.pages.written import write_fast
from compare.scene.scene import Scene, load, loads
from compare.scene.units import Units
from compare.store.progress import Reporter
from compare.store.store import CaseStore, jsonable
from compare.studies.compare import Comparison, Row, compare, fit_slope
from ribbon.find.solve import solve
from shellref.shell.surface import ShellSurface
from tests.compare.scene import held_scenes

FLOOR_BELOW = """
[gravity]
up = [0.0, 0.0, 1.0]
[[wall]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
"""


class Shells:
    """Shells that are the ribbon itself, moved by (h/w) / 10 in space and by 1e-5 on the coarse mesh."""

    def __init__(self, tmp_path, failing=()):
        self.folder, self.failing, self.calls = tmp_path, failing, 0

    def __call__(self, problem, store, options=None, progress=None, start=None):
        self.calls += 1
        ratio = round(problem.width / problem.thickness)
        if ratio in self.failing:
            data = {"status": "not_converged", "stable": None, "message": "stopped at load 0.4", "seconds": {}}
            return ShellCase(data, None, False)
        scene = load("curl_4_3")
        from compare.models.ribbon.build import ribbon_clamp, ribbon_gravity, ribbon_strip

        e = solve(ribbon_strip(scene), ribbon_clamp(scene), ribbon_gravity(scene), segments=scene.model.lengths)
        shift = 0.1 / ratio + (1e-5 if problem.elements == (50, 4) else 0.0)
        points = e.surface(200, 4).grid + np.array([0, 0, shift])
        s, v = np.linspace(0, 1, 201), np.linspace(-0.015, 0.015, 5)
        surface = ShellSurface(s, v, points, np.broadcast_to([0.0, 1.0, 0.0], points.shape).copy())
        folder = self.folder / f"{ratio}-{problem.elements[0]}"
        folder.mkdir(exist_ok=True)
        surface.save(folder / "shell.npz")
        data = {
            "status": "converged", "stable": True, "message": "fine", "elements": list(problem.elements),
            "energy": {"bending": 12.0, "membrane": 0.2, "shear": 0.1, "elastic": 12.3, "gravity": -16.0},
            "share": {"bending": 12 / 12.3, "membrane": 0.2 / 12.3, "shear": 0.1 / 12.3}, "newton_iterations": 40,
            "seconds": {"total": 7.5, "import": 0.5, "compile": 2.0}, "provenance": {"versions": {"dolfinx": "0.5.2"}},
            "end": {"position": [0, 0, 0], "frame": np.eye(3).tolist()}, "middle": None,
        }  # fmt: skip
        return ShellCase(data, folder, False)


def reported(out, found):
    """report.md of what `ribbonbench compare` writes."""
    report.write(out, found, "")
    return write_report(out, read_report([out])).markdown


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Comparisons with such shells, each made once: they are not changed by what is written about them."""
    found: dict[str, Comparison] = {}

    def run(failing=(), assignments=None, leave=None) -> Comparison:
        key = repr((failing, assignments, leave))
        if key not in found:
            place = tmp_path_factory.mktemp("made")
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr("compare.models.shell.run_shell", Shells(place, failing))
                scene = load("curl_4_3").replace({"shell.width_to_thickness": [10, 20, 100], **(assignments or {})})
                found[key] = compare(scene, CaseStore(place / "cases"), Reporter(quiet=True), leave_saddle=leave)
        return found[key]

    return run


def test_rows_carry_three_lengths_and_the_slope_is_found(made):
    found = made()
    assert found.ok
    assert found.falls
    for row, ratio in zip(found.rows, (10, 20, 100), strict=True):
        assert row.centreline == pytest.approx(0.1 / ratio, abs=5e-6)  # the stored shell is interpolated
        assert 0.2 * row.centreline < row.hausdorff <= row.centreline * 1.01
        assert row.shell_error == pytest.approx(1e-5, rel=0.7)
        assert row.ribbon_error == found.fast.error > 0
        assert row.claimed
        assert row.energy.elastic == pytest.approx(12.3 - 50.0)
        assert row.seconds == Times(found.fast.seconds.warm, pytest.approx(5.0))
        assert row.warm == bool(found.fast.seconds.repeats)
    assert found.slope.value == pytest.approx(1.0, abs=0.05)
    assert found.slope.rows == 3


def test_a_failed_shell_is_a_row_with_its_status_and_stops_nothing(made, tmp_path):
    found = made(failing=(20,))
    assert not found.ok
    failed = found.rows[1]
    assert (failed.status, failed.hausdorff, failed.claimed) == ("not_converged", None, False)
    assert found.slope.rows == 2
    assert any("stopped at load 0.4" in sentence for sentence in tables.verdict(found))
    page = reported(tmp_path / "out", found)
    assert "not_converged" in page.read_text()
    assert not (tmp_path / "out" / "shell_w20.vtu").exists()


def test_no_difference_is_claimed_below_the_errors(made):
    found = made(assignments={"shell.width_to_thickness": [10, 100000]})
    assert found.fast.error > 1e-4
    assert found.rows[0].claimed
    assert not found.rows[1].claimed
    assert found.slope is None
    assert any("no difference is claimed" in sentence for sentence in tables.verdict(found))


def test_the_answer_is_of_the_thinnest_shell(made):
    found = made(assignments={"shell.width_to_thickness": [100, 10]})
    thin = found.rows[0]
    said = tables.answer(found)
    assert said.grade == "good"
    assert float(re.search(r"([0-9.]+) %", said.text)[1]) == pytest.approx(100 * thin.hausdorff, rel=0.02)
    assert tables.answer(made(assignments={"shell.width_to_thickness": [10]})).grade == "fair"
    si = tables.answer(found, Units(0.25, 0.01, 1e-3))
    assert float(re.search(r"([0-9.]+) mm", si.text)[1]) == pytest.approx(250 * thin.hausdorff, rel=0.01)
    assert tables.answer(made(failing=(100,))).grade == "poor"


def test_a_distance_within_the_errors_is_a_bound(made):
    found = made(assignments={"shell.width_to_thickness": [10, 100000]})
    row = found.rows[1]
    bound = row.hausdorff + row.ribbon_error + row.shell_error
    assert float(re.search(r"([0-9.]+) %", tables.answer(found).text)[1]) == pytest.approx(100 * bound, rel=0.05)
    (words,) = tables.separable(found)
    assert words.count("separable") == 2
    assert words.count("not separable") == 1
    unknown = replace(found, rows=(replace(found.rows[0], shell_error=None, claimed=False),))
    assert tables.answer(unknown).grade == "unknown"
    assert tables.separable(unknown) == []


def row(ratio, distance, claimed=True):
    return Row(ratio, "converged", True, "", distance, distance, 1e-5, 1e-5, claimed, None, None, None, None,
               Times(1.0, 2.0), (1, 1), 1, False, True, "", warm=True, searched=False)  # fmt: skip


def test_slope_uses_claimed_rows_only():
    rows = (row(10, 1e-1), row(100, 1e-2), row(1000, 5e-3, claimed=False))
    assert fit_slope(rows).value == pytest.approx(1.0)
    assert fit_slope(rows[:1]) is None
    assert coarser((100, 4)) == (50, 2)
    assert coarser((1, 1)) == (1, 1)


@pytest.mark.parametrize(
    ("shell", "start", "words"),
    [
        (70.0, "path", "a factor 70 or more (the shell on its own, along its path)"),
        (70.0, "ribbon", "a factor 70 or more (the shell begun at the surface of the tape)"),
        (70.0, "ribbon (as the coarse path)", "tape and checked by its own path on a coarse mesh)"),
        (0.02, "coarse path", "the shell is the faster one, by a factor 50 or more (the shell on its own"),
    ],
)
def test_the_factor_says_who_is_faster_and_where_the_shell_began(made, shell, start, words):
    """And tables of another model than the ribbon are not headed ribbon."""
    found = made()
    seconds = Times(1.0, shell)
    errors = {"ribbon_error": 1e-4, "shell_error": 1e-4}
    rows = tuple(replace(r, seconds=seconds, start=start, warm=True, reused=False, **errors) for r in found.rows)
    fast = replace(found.fast, model="tape")
    tape = replace(found, fast=fast, rows=rows)
    assert any(words in text and text.startswith("Time:") for text in tables.verdict(tape))
    table = tables.table(tape)
    assert table.title == "Tape against shell"
    assert not any("ribbon" in column.heading for column in table.columns)
    assert "tape s" in [column.heading for column in table.columns]
    assert as_csv(table).splitlines()[0] == as_csv(tables.table(found)).splitlines()[0]  # keys stay
    assert tables.table(found).title == "Ribbon against shell"


@pytest.mark.parametrize(
    ("shell", "errors", "more", "ratio"),
    [
        (70.0, (1e-5, 1e-4), {}, 70.0),
        (70.0, (1e-4, 1e-4), {"searched": True}, 70.0),  # it takes less still without the search
        (70.0, (1e-5, 1e-4), {"warm": False}, None),
        (0.02, (1e-4, 1e-5), {"warm": False}, None),
        (70.0, (1e-4, 1e-5), {}, None),
        (0.02, (1e-5, 1e-4), {}, None),
        (0.02, (1e-4, 1e-5), {}, 0.02),
        (0.02, (1e-4, 1e-5), {"searched": True}, None),
        (70.0, (None, 1e-4), {}, None),
        (None, (1e-5, 1e-4), {}, None),
    ],
)
def test_times_are_compared_like_for_like_or_not_at_all(made, shell, errors, more, ratio):
    """Both warm, the faster one no less exact, no search that the other is spared: else both times, and no factor."""
    found = made()
    keys = {"ribbon_error": errors[0], "shell_error": errors[1], "seconds": Times(1.0, shell)}
    rows = tuple(replace(r, **{**keys, "warm": True, "searched": False, **more}) for r in found.rows)
    assert [r.ratio for r in rows] == [ratio] * len(rows)
    said = [text for text in tables.verdict(replace(found, rows=rows)) if text.startswith("Time:")]
    assert len(said) == (None not in (shell, *errors))
    assert all(("no factor" in text) == (ratio is None) for text in said)


def test_a_ribbon_that_was_solved_once_has_no_ratio(tmp_path, monkeypatch):
    """Its first solve loads, compiles, and searches."""
    monkeypatch.setattr("compare.models.shell.run_shell", Shells(tmp_path))
    scene = load("curl_4_3").replace({"shell.width_to_thickness": [10, 20]})
    found = compare(scene, CaseStore(tmp_path / "cases"), Reporter(quiet=True), bare=True)
    assert [(row.warm, row.ratio, row.seconds.ribbon > 0.0) for row in found.rows] == [(False, None, True)] * 2


def test_natural_constant():
    scene = load("curl_4_3").replace({"strip.natural_curvature": [2.0, -1.0]})
    s = (np.arange(100000) + 0.5) / 100000
    assert natural_constant(scene.curvature) == pytest.approx(0.5 * np.mean((2 - 3 * s) ** 2), rel=1e-8)


def test_shell_problem_keeps_d_and_gamma():
    problem = shell_problem(load("curl_4_3"), 50.0, (10, 2))
    assert problem.thickness == pytest.approx(0.03 / 50)
    assert problem.gamma == 100.0
    assert problem.natural_curvature == (10.0, 10.0)


def test_tables_say_the_same_thing(made):
    found = made()
    table = tables.table(found)
    rows = list(csv.DictReader(io.StringIO(as_csv(table))))
    assert [float(r["width_to_thickness"]) for r in rows] == [10, 20, 100]
    assert float(rows[1]["hausdorff"]) == found.rows[1].hausdorff
    assert [r["claimed"] for r in rows] == [str(row.claimed).lower() for row in found.rows]
    markdown = as_markdown(table).splitlines()[: 2 + 3 + 1]
    assert len({line.count("|") for line in markdown}) == 1
    assert f"{found.rows[0].hausdorff:.2e}" in markdown[2]
    energy = found.fast.energy
    limit = dict(zip(table.keys, table.below[0], strict=True))
    assert (limit["elastic"], limit["gravity"], limit["total"]) == (energy.elastic, energy.gravity, energy.total)
    assert len(table.texts()) == 4


def test_every_key_of_the_table_holds_what_it_says(made):
    """Each column against the row that it is taken from, by another way than the table's own."""
    found = made()
    rows = [
        {
            **{name: getattr(row, name) for name in row.__dataclass_fields__},
            "membrane_share": (row.share or {}).get("membrane"), "shear_share": (row.share or {}).get("shear"),
            **{name: row.energy and getattr(row.energy, name) for name in ("elastic", "gravity", "total")},
            **{f"{name}_error": row.shell_errors["energy"][name] for name in ("elastic", "gravity", "total")},
            "seconds_ribbon": row.seconds.ribbon, "seconds_shell": row.seconds.shell, "ratio": row.ratio,
        }
        for row in found.rows
    ]  # fmt: skip
    table = tables.table(found)
    for key in table.keys:
        assert table.values(key) == tuple(row[key] for row in rows), key


def test_result_json_keeps_the_contract(made):
    result = json.loads(json.dumps(jsonable(comparison_result(made())), allow_nan=False))
    keys = """status stable lowest_eigenvalue residual iterations energy end middle max_abs_eta max_abs_eta_prime_w_half
        forces seconds model provenance rows"""
    for key in keys.split():
        assert key in result, key
    assert {"elastic", "gravity", "total"} <= result["energy"].keys()
    assert {"first", "warm"} <= result["seconds"].keys()
    assert {"energy", "formulation", "elements"} <= result["model"].keys()
    assert np.array(result["end"]["frame"]).shape == (3, 3)
    for r in result["rows"]:
        keys = "width_to_thickness hausdorff centreline ribbon_error shell_error share shell_end shell_middle seconds"
        for key in keys.split():
            assert key in r, key
        assert {"bending", "membrane", "shear"} <= r["share"].keys()
        assert {"ribbon", "shell"} <= r["seconds"].keys()


def test_report_folder_is_complete_and_its_pictures_are_drawn(made, tmp_path):
    out = tmp_path / "out"
    found = made()
    page = reported(out, found).read_text()
    names = {path.name for path in out.iterdir()}
    wanted = {"report.md", "report.html", "page.json", "surfaces.png", "ribbon.npz", "result.json", "table.csv",
              "table.md", "supports.csv", "convergence.png", "shapes.png", "ribbon.png",
              "centreline.csv", "ribbon.vtu", "shell_w10.vtu", "shell_w20.vtu", "shell_w100.vtu"}  # fmt: skip
    assert names == wanted
    for name in ("convergence.png", "shapes.png", "ribbon.png"):
        assert name in page
        from matplotlib.image import imread

        pixels = imread(out / name)[:, :, :3]
        assert pixels.shape[0] > 300
        assert pixels.std() > 0.02
    stored = read_page(out)
    assert stored.sentences == tuple(tables.verdict(found))
    assert stored.verdict == tables.answer(found)
    assert json.loads((out / "result.json").read_text())["answer"] == jsonable(stored.verdict)
    assert [(s.file, s.width_to_thickness) for s in stored.surfaces] == [
        ("ribbon.vtu", None), ("shell_w10.vtu", 10.0), ("shell_w20.vtu", 20.0), ("shell_w100.vtu", 100.0),
    ]  # fmt: skip
    assert stored.tables == (tables.table(found), side_by_side(found.fast, found.rows))
    assert set(stored.files) <= names
    assert "Ribbon against shell" in (out / "report.html").read_text()


def test_surfaces_read_back(made, tmp_path):
    found = made()
    write_fast(tmp_path, found, "_x")
    mesh = meshio.read(tmp_path / "ribbon_x.vtu")
    points = found.grid.of(found.fast.shape).reshape(-1, 3)
    assert np.abs(mesh.points - points).max() == 0
    assert mesh.cells_dict["triangle"].max() == len(points) - 1
    for name in ("S", "v", "omega", "eta", "ruling_foot", "ruling", "normal"):
        assert name in mesh.point_data
    on_axis = mesh.point_data["v"] == 0
    assert on_axis.sum() == found.grid.s.size
    assert np.abs(mesh.point_data["ruling_foot"][on_axis] - mesh.point_data["S"][on_axis]).max() < 1e-14
    line = np.loadtxt(io.BytesIO(ribbon_page.centreline_csv(found.fast.native, Units())), delimiter=",", skiprows=1)
    assert np.allclose(line[:, 1:4], found.fast.native.position(line[:, 0]), atol=1e-11)


def test_rendering_falls_back_when_vtk_cannot(made, tmp_path, monkeypatch):
    def broken(*_):
        raise RuntimeError("no GL")

    monkeypatch.setattr(figures, "_render", broken)
    assert figures.shapes(tmp_path / "s.png", made()).stat().st_size > 20_000


@pytest.fixture(scope="module")
def heavy() -> tuple[Scene, State]:
    """A heavy flat cantilever, and its elastica."""
    scene = load("cantilever").replace({"strip.gamma": 1e4, "shell.width_to_thickness": 100})
    elastica = solve_scene(scene, "elastica", options=Options(error=True))
    assert elastica.error < 1e-6
    return scene, elastica


@pytest.mark.parametrize(
    ("elements", "grading"),
    [
        (20, "clamp"),
        (20, "uniform"),
        *(pytest.param(n, "uniform", marks=pytest.mark.validate) for n in (40, 200)),
    ],
)
def test_the_ribbons_error_is_not_underestimated(heavy, elements, grading):
    """Against the elastica, whose own error is far smaller: heavy flat cantilever, a layer of width Gamma^(-1/2)."""
    base, elastica = heavy
    scene = base.replace({"model.elements": elements, "model.grading": grading})
    ribbon = solve_scene(scene, "ribbon")
    grid = Grid.for_shape(scene, 150.0)
    estimate = RibbonModel().error(ribbon, None, grid)
    line = elastica.shape.centreline
    true = centreline_distance(ribbon.shape.centreline(grid.s), line(grid.s))
    surface = grid.of(ribbon.shape)[:, grid.v.size // 2]
    gap = min(true, np.linalg.norm(surface[:, None, :] - line(np.linspace(0, 1, 4001)), axis=2).min(1).max())
    assert 0.9 * gap - 2e-6 < estimate < 3.0 * true + 2e-6


def test_a_ribbon_on_a_saddle_claims_nothing(made, tmp_path):
    """Planar and unbent by its weight (omega between 0 and nu K): the row keeps its distance, without a claim."""
    keys = {
        "clamp.start.tangent": [0.0, 0.0, 1.0], "clamp.start.normal": [-1.0, 0.0, 0.0], "strip.gamma": 300.0,
        "strip.natural_curvature": [-0.35, -0.49], "model.grading": "uniform",
    }  # fmt: skip
    found = made(assignments=keys, leave=False)
    assert found.fast.word == "saddle"
    assert not found.ok
    assert found.fast.error is None
    assert not any(r.claimed for r in found.rows)
    assert any("discretisation error is unknown" in sentence for sentence in tables.verdict(found))
    assert reported(tmp_path / "out", found).exists()
    assert comparison_result(found)["complete"] is False


@pytest.mark.parametrize("name", ["TWO_CLAMPS", "CIRCLE", "MOEBIUS", "FLOOR", "PATH"])
def test_the_picture_shows_what_holds_the_ribbon(tmp_path, name):
    """Clamps in their orange, walls in their grey, the ribbon in its blue; a closed band is no filled disc."""
    from matplotlib.image import imread

    scene = loads(getattr(held_scenes, name))
    e = solve_scene(scene, "ribbon").native
    pixels = imread(profile.ribbon_profile(tmp_path / "r.png", e, scene.title))[:, :, :3]
    orange = np.array([0xC2, 0x66, 0x2D]) / 255.0
    shown = (np.abs(pixels - orange).max(axis=2) < 0.02).sum()
    assert (shown > 100) == bool(profile.held(e))
    assert len(profile.held(e)) == {"TWO_CLAMPS": 2, "PATH": 2, "FLOOR": 1}.get(name, 0)
    grey = np.abs(pixels - 0x8A / 255.0).max(axis=2) < 0.02
    assert (grey.sum() > 800) == bool(scene.walls)
    blue = (pixels[:, :, 2] > pixels[:, :, 0] + 0.2).mean()
    assert 0.005 < blue < 0.15


def test_the_back_of_the_ribbon_is_paler_than_its_front():
    """One cell with its normal upwards, seen from above and from below; lit alike from both sides."""
    cell = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]])
    front, back = (profile.shades(cell, np.array([0.2, 0.1, z]))[0] for z in (1.0, -1.0))
    assert (back - front).min() > 0.05
    assert front[2] - front[0] > 0.4


def test_a_clipped_wall_covers_the_box_and_lies_in_its_plane():
    """Every corner of the box, dropped onto the plane, lies in the rectangle, and some on each of its sides."""
    normal = np.array([0.6, 0.0, 0.8])
    point = np.array([0.1, 0.2, -0.3])
    low, high = np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.5, 2.0])
    corners = profile.clipped(point, normal, low, high)
    assert np.abs((corners - point) @ normal).max() < 1e-14
    sides = np.array([corners[1] - corners[0], corners[3] - corners[0]])
    assert abs(sides[0] @ sides[1]) < 1e-14
    assert corners[2] == pytest.approx(corners[0] + sides.sum(axis=0))
    box = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1).reshape(-1, 3)
    parts = (box - corners[0]) @ (sides / (sides**2).sum(axis=1)[:, None]).T
    assert parts.min(axis=0) == pytest.approx([0.0, 0.0], abs=1e-13)
    assert parts.max(axis=0) == pytest.approx([1.0, 1.0])


def test_free_motions_are_no_distance():
    """A ring that nothing holds, turned and moved; a strip on a floor, moved along it; a clamped one, not moved."""
    turn = Rotation.from_rotvec([0.3, -0.2, 0.5])
    ring = solve_scene(loads(held_scenes.CIRCLE), "ribbon")
    points = ring.native.surface(100, 4).grid
    moved = turn.apply(points.reshape(-1, 3)).reshape(points.shape) + np.array([0.1, 0.2, 0.3])
    assert np.abs(aligned(moved, points, ring.motions) - points).max() < 1e-12
    lying = loads(held_scenes.CIRCLE.replace("poisson = 0.3", "poisson = 0.3\ngamma = 5.0") + FLOOR_BELOW)
    e = solve_scene(lying, "ribbon")
    points = e.native.surface(100, 4).grid
    spun = Rotation.from_rotvec([0.0, 0.0, 0.4]).apply(points.reshape(-1, 3)).reshape(points.shape)
    assert np.abs(aligned(spun + np.array([0.1, -0.2, 0.0]), points, e.motions) - points).max() < 1e-12
    lifted = aligned(points + np.array([0.0, 0.0, 0.01]), points, e.motions)
    assert np.abs(lifted - points).max() == pytest.approx(0.01)
    clamped = solve_scene(load("curl_4_3"), "ribbon").motions
    assert aligned(points + 0.1, points, clamped) is not points
    assert np.array_equal(aligned(points + 0.1, points, clamped), points + 0.1)
