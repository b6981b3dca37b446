"""Cases that end beside their neighbours are begun again at a neighbour's state, and the row says so."""

import csv
import json
from dataclasses import replace
from types import SimpleNamespace

import pytest

from compare.page.page import read_page
from compare.scene.scene import load, loads
from compare.store.progress import Reporter
from compare.store.store import case_key
from compare.studies.axes import parse_axis
from compare.sweep import page as sweep_page
from compare.sweep.branches import branches
from compare.sweep.case import run_case
from compare.sweep.file import of_scene
from compare.sweep.run import check, run
from tests.compare.sweep.test_branches import SCENE

UP, DOWN = [-5.6, 5.6, 5.6, -5.6], [5.6, -5.6, -5.6, 5.6]
#: The energy is said: chosen for every case, it takes most of a sweep's time.
MODEL = {"model.elements": 20, "model.energy": "wunderlich"}
SEEDED = loads(SCENE).replace(MODEL)
SEEDLESS = loads(SCENE.partition("[seed]")[0]).replace(MODEL)
WEIGHTS = "strip.gamma=3:3.6:7"
GRID = (WEIGHTS, "strip.width=0.02:0.06:5")
PATCH = (0, 1, 5, 6, 10, 11)
#: 4 x 3 cases, and a corner of them whose inmost one has no neighbour outside.
SMALL, CORNER = ("strip.gamma=3:3.6:4", "strip.width=0.02:0.06:3"), (0, 1, 3, 4)


class Faulty:
    """A crew of this process whose cases with some numbers begin on another side than the scene says, or fail.

    seeds: the seed of the case of a number, where it is solved from its own start; None: it does not converge. stop:
    after how many cases it is interrupted.
    """

    size = 1

    def __init__(self, grid, seeds, stop=None):
        self.seeds = {case_key(grid[number].scene.canonical()): seed for number, seed in seeds.items()}
        self.stop, self.walked, self.count = stop, [], 0

    def run(self, tasks):
        for k, task in enumerate(tasks):
            if self.stop is not None and self.count >= self.stop:
                raise KeyboardInterrupt
            self.count += 1
            scene = task.scene
            if scene.path:
                self.walked.append(scene)
            elif (key := case_key(scene.canonical())) in self.seeds:
                seed = self.seeds[key]
                scene = scene.replace({"model.budget": 1e-6} if seed is None else {"seed.curvature": seed})
            yield k, run_case(replace(task, scene=scene))


def swept(scene, axes, seeds, out, stop=None):
    """The finished sweep of a scene with faults, and its crew."""
    sweep = of_scene(scene, {}, [parse_axis(axis) for axis in axes])
    grid = check(sweep)
    crew = Faulty(grid, seeds, stop)
    out.mkdir(exist_ok=True)
    try:
        found = run(sweep, grid, out, crew, Reporter(quiet=True))
    except KeyboardInterrupt:
        return None, crew
    sweep_page.write(out, found, "")
    return found, crew


def rows_of(out):
    with (out / "cases.csv").open() as stream:
        return [{key: row[key] for key in row if "seconds" not in key} for row in csv.DictReader(stream)]


def test_a_case_on_another_branch_is_brought_to_its_neighbours(tmp_path):
    found, crew = swept(SEEDED, [WEIGHTS], {3: DOWN}, tmp_path)
    rows = rows_of(tmp_path)
    assert [row["branch"] for row in rows] == ["1"] * 7
    assert [row["warm"] for row in rows] == ["", "", "", "2", "", "", ""]
    plain, _ = swept(SEEDED, [WEIGHTS], {}, tmp_path / "plain")
    heights = [float(row["middle.y"]) for row in rows]
    assert heights == pytest.approx([float(row["middle.y"]) for row in rows_of(tmp_path / "plain")], abs=1e-9)
    assert min(heights) > 0.25
    assert len(crew.walked) == found.walks == 1
    assert plain.walks == 0
    result = json.loads((tmp_path / "result.json").read_text())
    assert (result["other_branches"], result["warm"]) == ([], [{"case": 3, "start": 2}])
    assert read_page(tmp_path).verdict.grade != "poor"


def test_a_patch_of_a_grid_is_brought_over_from_its_edge_on(tmp_path):
    """3 x 2 cases of 7 x 5, the inner ones with no neighbour on the branch of most at first; and one that failed."""
    patch = dict.fromkeys(PATCH, DOWN)
    swept(SEEDED, GRID, {**patch, 33: None}, tmp_path)
    rows = rows_of(tmp_path)
    assert {row["branch"] for row in rows} == {"1"}
    assert {row["status"] for row in rows} == {"converged"}
    assert [number for number, row in enumerate(rows) if row["warm"]] == [*PATCH, 33]
    assert all(int(row["warm"]) not in patch for row in rows if row["warm"])
    assert min(float(row["middle.y"]) for row in rows) > 0.25


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The rows of a sweep that nothing interrupted: 12 cases, a corner of 4 on the other branch, as many walks."""
    out = tmp_path_factory.mktemp("whole")
    swept(SEEDED, SMALL, dict.fromkeys(CORNER, DOWN), out)
    assert [number for number, row in enumerate(rows_of(out)) if row["warm"]] == [*CORNER]
    return rows_of(out)


@pytest.mark.parametrize("stop", [3, 12, 14])
def test_an_interrupted_sweep_ends_in_the_same_table(tmp_path, whole, stop):
    """Interrupted among its cases, before its walks, among them; and read from the journal alone."""
    seeds = dict.fromkeys(CORNER, DOWN)
    halted, before = swept(SEEDED, SMALL, seeds, tmp_path, stop)
    assert halted is None
    assert (before.count, len(before.walked)) == (stop, max(0, stop - 12))
    swept(SEEDED, SMALL, seeds, tmp_path)
    assert rows_of(tmp_path) == whole
    table = (tmp_path / "cases.csv").read_bytes()
    _, crew = swept(SEEDED, SMALL, seeds, tmp_path)
    assert crew.count == 0
    assert (tmp_path / "cases.csv").read_bytes() == table


def test_without_a_seed_the_lower_state_stays(tmp_path):
    """Six arches stand and one hangs: nothing says which is meant, and the hanging one is lower."""
    found, crew = swept(SEEDLESS, [WEIGHTS], {k: UP for k in range(7) if k != 3}, tmp_path)
    rows = rows_of(tmp_path)
    assert [row["branch"] for row in rows] == ["1", "1", "1", "2", "1", "1", "1"]
    assert float(rows[3]["middle.y"]) < -0.25
    assert (found.walks, len(crew.walked)) == (2, 2)
    assert "one lies on another branch" in read_page(tmp_path).verdict.text
    swept(SEEDLESS, [WEIGHTS], {3: UP}, tmp_path / "other")
    rows = rows_of(tmp_path / "other")
    assert {row["branch"] for row in rows} == {"1"}
    assert rows[3]["warm"] == "2"


def test_a_scene_with_a_path_of_its_own_is_left_alone(tmp_path):
    scene = SEEDED.replace({"path": [{"strip.gamma": 2.0}]})
    grid = [parse_axis(WEIGHTS)]
    sweep = of_scene(scene, {}, grid)

    def ends(tasks):
        for k, task in enumerate(tasks):
            yield k, run_case(replace(task, scene=task.scene.replace({"seed.curvature": DOWN if k == 3 else UP})))

    crew = SimpleNamespace(size=1, run=ends)
    found = run(sweep, check(sweep), tmp_path, crew, Reporter(quiet=True))
    assert (found.walks, [case.warm for case in found.cases]) == (0, [None] * 7)
    assert branches(found)[3] == [2]


@pytest.mark.parametrize("leave", [None, False])
def test_a_saddle_that_is_asked_for_is_no_failure(tmp_path, leave):
    """An upright strip under more and more weight, which buckles: with --stay it stands, and nothing is walked to."""
    standing = {"gravity.up": [0.0, 0.0, 1.0], "seed.curvature": None, "model.elements": 12}
    scene = load("cantilever").replace(standing)
    sweep = replace(of_scene(scene, {}, [parse_axis("strip.gamma=2,5,12,16")]), leave_saddle=leave)
    grid = check(sweep)
    found = run(sweep, grid, tmp_path, Faulty(grid, {}), Reporter(quiet=True))
    assert found.walks == 0
    stable = [case.record["rows"][0]["stable"] for case in found.cases]
    assert stable == ([True, True, True, True] if leave is None else [True, True, False, False])  # 7.837: Greenhill
