"""`ribbonbench sweep`: tables against single solves, resuming, failures, two runs at once, mpiexec."""

from __future__ import annotations

import csv
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from compare.cli import BAD_INPUT, DONE, MISSING, NOT_CONVERGED, main
from compare.page.page import read_page
from compare.scene.scene import load
from compare.store.store import occupied
from compare.sweep.case import Task, run_case
from compare.sweep.workers import LocalCrew
from tests.patience import PATIENCE

ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}
TOGETHER = {**ENVIRONMENT, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "TERM": "dumb"}
#: Three light cantilevers in one worker.
SMALL = ("sweep", "cantilever", "--vary", "strip.gamma=1,10,100", "--set", "model.elements=8", "--workers", "1")
needs_mpirun = pytest.mark.skipif(shutil.which("mpirun") is None, reason="no mpirun")


def rows_of(out: Path) -> list[dict[str, str]]:
    with (out / "cases.csv").open() as stream:
        return list(csv.DictReader(stream))


def result_of(out: Path):
    return json.loads((out / "result.json").read_text())


def process(*arguments, before=(), environment=ENVIRONMENT, **more):
    """A process of `ribbonbench` that is started."""
    return subprocess.Popen(
        [*before, sys.executable, "-m", "compare.cli", *map(str, arguments)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment, **more,
    )  # fmt: skip


def again(*arguments):
    """The exit code of a second run, in a process of its own (its sources are read when the first one's were)."""
    running = process(*arguments, "--quiet")
    running.communicate(timeout=PATIENCE)
    return running.returncode


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """The small sweep, run once."""
    out = tmp_path_factory.mktemp("small")
    assert main([*SMALL, "--out", str(out), "--quiet", "--errors", "--show", "end.y"]) == DONE
    return out


def test_rows_are_what_single_solves_find(small):
    from compare.models import solve as solve_scene

    rows = rows_of(small)
    assert [row["strip.gamma"] for row in rows] == ["1", "10", "100"]
    for row in rows:
        scene = load("cantilever").replace({"model.elements": 8, "strip.gamma": float(row["strip.gamma"])})
        e = solve_scene(scene, "ribbon").native
        assert (row["status"], row["stable"], int(row["iterations"])) == ("converged", "true", e.iterations)
        assert [float(row[f"end.{axis}"]) for axis in "xyz"] == pytest.approx(e.end.position, abs=1e-12)
        assert float(row["energy.total"]) == pytest.approx(e.energy.total, rel=1e-12)
        assert float(row["y_over_x"]) == pytest.approx(-e.end.position[1] / e.end.position[2], rel=1e-9)
        assert 0.0 < float(row["error"]) < 1e-2
        fine = solve_scene(scene.replace({"model.elements": 64}), "ribbon")
        apart = np.linalg.norm(fine.supports.start.moment - [float(row[f"moment.start.{axis}"]) for axis in "xyz"])
        assert 0.2 * apart < float(row["moment_error.start"]) < 10.0 * apart
        assert 0.0 <= float(row["force_error.start"]) < 1e-6  # the weight's, whatever the elements
        off = abs(fine.energy.total - float(row["energy.total"]))
        assert 0.2 * off < float(row["energy_error.total"]) < 10.0 * off
        assert float(row["lowest_eigenvalue_error"]) > 0.0
        assert float(row["lowest_eigenvalue"]) == pytest.approx(e.lowest_eigenvalue, rel=1e-3)


def test_files_of_a_sweep(small):
    names = {
        "cases.csv",
        "cases.json",
        "result.json",
        "page.json",
        "sweep.png",
        "force_displacement.png",
        "journal.jsonl",
    }
    assert {path.name for path in small.iterdir() if path.is_file()} == names
    result = result_of(small)
    assert (result["status"], result["stable"], result["complete"]) == ("converged", True, True)
    assert result["statuses"] == {"converged": 3}
    assert result["residual"] < 1e-8
    assert result["failed"] == []
    cases = json.loads((small / "cases.json").read_text())
    assert [case["values"] for case in cases["cases"]] == [{"strip.gamma": g} for g in (1, 10, 100)]
    assert len({case["scene_hash"] for case in cases["cases"]}) == 3
    assert cases["provenance"]["packages"]["numpy"] == np.__version__
    page = read_page(small)
    assert page.sentences[0] == "3 of 3 cases (3) converged."
    assert "Discretisation errors" in page.sentences[1]
    assert page.verdict.grade == "good"
    assert len(page.tables[1].rows) == 3
    assert "end.y" in page.pictures[0].alt
    assert str(small) not in "".join(path.read_text() for path in small.glob("*.json*"))


def test_what_is_finished_is_found_again_and_fresh_forgets(small, tmp_path, capsys):
    out = shutil.copytree(small, tmp_path / "o")
    command = [*SMALL, "--out", str(out), "--errors"]
    before = (out / "journal.jsonl").read_bytes()
    assert main(command) == DONE
    assert "3 of them finished before" in capsys.readouterr().err
    assert result_of(out)["new"] == 0
    assert (out / "journal.jsonl").read_bytes() == before
    assert main([*command, "--vary", "strip.width=0.05,0.06"]) == DONE  # a grid that contains half of it
    assert result_of(out)["new"] == 3  # 0.05 is the scene's own width
    assert main([*command, "--fresh", "--quiet"]) == DONE
    assert result_of(out)["new"] == 3


def test_failures_are_recorded_and_stop_nothing(tmp_path, capsys):
    """Three segments close no Moebius band, the next time neither, so that this end is kept."""
    arguments = ["sweep", "moebius_6_1", "--vary", "model.elements=3,30", "--workers", "2", "--out", str(tmp_path)]
    assert main(arguments) == NOT_CONVERGED
    said = capsys.readouterr().out
    rows = rows_of(tmp_path)
    assert [(row["status"], row["stable"] == "true") for row in rows] == [("infeasible", False), ("converged", True)]
    assert "1 of 2 cases" in said
    assert "model.elements = 3" in said
    assert [entry["case"] for entry in result_of(tmp_path)["failed"]] == [0]
    assert main([*arguments, "--quiet"]) == NOT_CONVERGED
    assert result_of(tmp_path)["new"] == 0


def test_what_only_the_solver_refuses_is_a_status():
    scene = load("cantilever").replace({"model.elements": None, "model.tolerance": 1e-3, "model.formulation": "matrix"})
    record = run_case(Task("0" * 64, scene, "ribbon", False, False, "."))
    assert record["status"] == "refused"
    assert "model.formulation" in record["message"]
    assert record["rows"] == []


class Deadly:
    """A scene that kills the worker that unpacks it."""

    def __reduce__(self):
        return signal.raise_signal, (signal.SIGKILL,)


def test_a_worker_that_is_killed_ends_only_its_case(tmp_path):
    scene = load("cantilever").replace({"model.elements": 4})
    scenes = [scene, Deadly(), scene.replace({"strip.gamma": 1.0}), scene]
    tasks = [Task("0" * 64, found, "ribbon", False, False, str(tmp_path)) for found in scenes]
    records = dict(LocalCrew(1).run(tasks))
    assert [records[k]["status"] for k in range(4)] == ["converged", "crashed", "converged", "converged"]
    assert records[1]["message"] == "the worker process was killed by SIGKILL, 2 times"
    assert records[0]["rows"] == records[3]["rows"]


def test_crashes_are_tried_again_by_the_next_run(tmp_path, monkeypatch):
    from compare.store.progress import Reporter
    from compare.studies.axes import parse_axis
    from compare.sweep.case import crashed
    from compare.sweep.file import load_sweep
    from compare.sweep.run import check, run

    class Crew:
        size = 1

        def __init__(self, end):
            self.end = end

        def run(self, tasks):
            self.count = len(tasks)
            for k, task in reversed(list(enumerate(tasks))):
                yield k, self.end if task.scene.gamma == 10.0 else run_case(task)

    sweep = load_sweep("cantilever", {"model.elements": 4}, [parse_axis("strip.gamma=1,10,100")])
    grid, quiet = check(sweep), Reporter(quiet=True)
    first = run(sweep, grid, tmp_path, Crew(crashed("killed")), quiet)
    assert [case.status for case in first.cases] == ["converged", "crashed", "converged"]
    again = Crew(crashed("killed"))
    run(sweep, grid, tmp_path, again, quiet)
    assert again.count == 1
    last = run(sweep, grid, tmp_path, Crew({**run_case(Task("", grid[1].scene, "ribbon", False, False, ".")), "w": 1}),
               quiet)  # fmt: skip
    assert last.ok
    monkeypatch.setattr("compare.sweep.run.software_digest", lambda solver: "1" * 64)
    others = Crew(crashed("killed"))
    run(sweep, grid, tmp_path, others, quiet)
    assert others.count == 3  # another version's cases are not mixed in


def test_the_thesis_sweep_lies_on_the_elastica(tmp_path):
    """4.5: ribbon and elastica on nine of the 2500 points, the heaviest among them; both limits."""
    axes = ["--vary", "strip.young=5e5,1e7", "--vary", "strip.length=log(0.05,0.9,3)"]
    common = ["sweep", "cantilever_4_5", *axes, "--workers", "1", "--quiet"]
    assert main([*common, "--out", str(tmp_path / "r")]) == DONE
    assert main([*common, "--solver", "elastica", "--out", str(tmp_path / "e")]) == DONE
    ribbon, elastica = rows_of(tmp_path / "r"), rows_of(tmp_path / "e")
    assert len(ribbon) == len(elastica) == 6
    for a, b in zip(ribbon, elastica, strict=True):
        assert float(a["y_over_x"]) == pytest.approx(float(b["y_over_x"]), rel=1e-3)
        assert float(a["energy.total"]) == pytest.approx(float(b["energy.total"]), rel=1e-3)
    heavy = max(ribbon, key=lambda row: float(row["gamma"]))
    assert float(heavy["y_over_x"]) == pytest.approx((float(heavy["gamma"]) / 2.0) ** 0.5, rel=5e-3)
    light = min(ribbon, key=lambda row: float(row["gamma"]))
    assert float(light["y_over_x"]) == pytest.approx(float(light["gamma"]) / 8.0, rel=0.01)
    assert "Gamma / 8" in read_page(tmp_path / "r").pictures[0].alt


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["cantilever"], "varies nothing"),
        (["cantilevr", "--vary", "strip.gamma=1"], "did you mean cantilever"),
        (["cantilever", "--vary", "strip.gama=1,2"], "strip.gama = 1: is not a known key (point 0"),
        (["cantilever", "--vary", "strip.gamma=1,-2"], "point 1"),
        (["cantilever", "--vary", "strip.gamma"], "KEY=VALUES"),
        (["cantilever", "--vary", "strip.gamma=1,2", "--workers", "0"], "--workers = 0"),
        (["cantilever", "--vary", "strip.gamma=1,2", "--show", "end.q"], "--show = 'end.q'"),
        (["cantilever", "--vary", "strip.gamma=1,2", "--against", "status"], "--against"),
    ],
)
def test_bad_input_is_one_line_before_anything_runs(capsys, tmp_path, arguments, words):
    assert main(["sweep", *arguments, "--out", str(tmp_path / "o")]) == BAD_INPUT
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
    assert not (tmp_path / "o").exists()


def test_two_runs_into_one_folder(tmp_path):
    """Both wait for a third, which is the test; then one runs, and the other finds everything done."""
    arguments = (*SMALL, "--out", tmp_path)
    with occupied(tmp_path):
        both = [process(*arguments) for _ in range(2)]
        for one in both:
            assert any("waiting" in line for line in one.stderr)  # up to that line
    texts = [one.communicate(timeout=PATIENCE)[1] for one in both]
    assert [one.returncode for one in both] == [DONE, DONE]
    assert sum("3 of them finished before" in text for text in texts) == 1


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_a_killed_sweep_goes_on(tmp_path, how):
    arguments = ("sweep", "cantilever", "--vary", "strip.gamma=linear(1,100,400)", "--workers", "1", "--out", tmp_path)
    running = process(*arguments)
    journal = tmp_path / "journal.jsonl"
    while running.poll() is None and not (journal.exists() and journal.read_bytes().count(b"\n") >= 10):
        time.sleep(0.01)
    running.send_signal(how)
    said = running.communicate(timeout=PATIENCE)[1]
    assert running.returncode == (130 if how == signal.SIGINT else -signal.SIGKILL)
    assert how == signal.SIGKILL or "interrupted" in said
    done = journal.read_bytes().count(b"\n") - 1
    assert 9 <= done < 400
    assert again(*arguments) == DONE
    assert result_of(tmp_path)["new"] == 400 - done
    assert len(rows_of(tmp_path)) == 400


def test_a_full_disk_is_one_line_and_the_sweep_goes_on(tmp_path):
    """No file may grow beyond 6000 bytes: some cases fit."""

    def limited():
        resource.setrlimit(resource.RLIMIT_FSIZE, (6000, resource.RLIM_INFINITY))

    arguments = ("sweep", "cantilever", "--vary", "strip.gamma=linear(1,10,12)", "--workers", "1", "--out", tmp_path)
    small = process(*arguments, preexec_fn=limited)
    said = small.communicate(timeout=PATIENCE)[1]
    assert small.returncode == MISSING
    last = said.strip().splitlines()[-1]
    assert last.startswith("ribbonbench: disk full (file too large)")
    assert "Traceback" not in said
    done = (tmp_path / "journal.jsonl").read_bytes().count(b"\n") - 1
    assert 0 < done < 12
    assert again(*arguments) == DONE
    assert result_of(tmp_path)["new"] == 12 - done


def test_pictures_of_every_kind(tmp_path):
    """One axis, two, three, text on an axis; failed cases are crosses."""
    from matplotlib.image import imread

    text = 'model.energy=["sadowsky", "wunderlich"]'
    for name, axes in {
        "map": ["strip.gamma=log(1,1e4,3)", "strip.width=0.05,0.1"],
        "words": [text],
        "three": ["strip.gamma=1,2", "strip.width=0.05,0.1", text],
    }.items():
        out = tmp_path / name
        varied = [word for axis in axes for word in ("--vary", axis)]
        code = main(["sweep", "cantilever", *varied, "--set", "model.elements=4", "--workers", "1", "--quiet",
                     "--show", "end.y", "--out", str(out)])  # fmt: skip
        assert code == DONE
        assert imread(out / "sweep.png").shape[0] > 400
        assert "None of" in read_page(out).pictures[0].alt


@pytest.mark.parametrize("axes", [["strip.gamma=1,10,100"], ["strip.gamma=1,10,100", "strip.width=0.05,0.06"]])
def test_failed_cases_are_red_crosses(tmp_path, axes):
    from matplotlib.image import imread

    from compare.studies.axes import parse_axis
    from compare.sweep.file import load_sweep
    from compare.sweep.finished import Case, Finished
    from compare.sweep.page import rows_of as table
    from compare.sweep.picture import draw
    from compare.sweep.run import check

    sweep = load_sweep("cantilever", {}, [parse_axis(axis) for axis in axes])
    ends = ["saddle", *["converged"] * 5]
    cases = [
        Case(
            point,
            "",
            {"status": end, "message": "", "seconds": 1.0, "rows": [{"status": end, "end.y": 1.0 + k}]},
            False,
        )
        for k, (point, end) in enumerate(zip(check(sweep), ends, strict=False))
    ]
    red = []
    for found in (cases, [*cases[1:], *cases[1:2]]):
        finished = Finished(sweep, tuple(found), 1.0, 1)
        alt = draw(tmp_path / "x.png", finished, table(finished), "end.y", "")
        assert ("red crosses" in alt) == (found is cases)
        pixels = imread(tmp_path / "x.png")[:, :, :3]
        red.append(((pixels[:, :, 0] > 0.6) & (pixels[:, :, 1] < 0.4) & (pixels[:, :, 2] < 0.4)).sum())
    assert red[0] > 20
    assert red[1] == 0


@pytest.mark.shell
def test_shells_and_comparisons_have_a_row_for_each_thickness(tmp_path):
    pytest.importorskip("dolfinx")
    arguments = ["sweep", "cantilever", "--vary", "strip.gamma=1,10", "--set", "shell.width_to_thickness=[20,50]",
                 "--set", "shell.elements=[8,1]", "--workers", "2", "--quiet"]  # fmt: skip
    assert main([*arguments, "--solver", "shell", "--out", str(tmp_path / "s")]) == DONE
    shell = rows_of(tmp_path / "s")
    keys = [(row["strip.gamma"], row["width_to_thickness"]) for row in shell]
    assert keys == [("1", "20.0"), ("1", "50.0"), ("10", "20.0"), ("10", "50.0")]
    assert all(sum(float(row[f"share.{n}"]) for n in ("bending", "membrane", "shear")) > 0.999 for row in shell)
    assert len([p for p in (tmp_path / "s" / "cases").iterdir() if not p.name.startswith(".")]) == 4
    more = [
        "--vary",
        "strip.poisson=0.4",
        "--set",
        "strip.gamma=10",
        "--solver",
        "compare",
        "--out",
        str(tmp_path / "s"),
    ]
    assert main(["sweep", "cantilever", *more, *arguments[4:]]) == DONE
    compare = rows_of(tmp_path / "s")
    assert len(compare) == 2
    for a, b in zip(shell[2:], compare, strict=True):
        assert [float(b[f"shell_end.{x}"]) for x in "yz"] == pytest.approx([float(a[f"end.{x}"]) for x in "yz"])
        assert float(b["hausdorff"]) > 0.0


@needs_mpirun
def test_mpirun_gives_the_same_cases(small, tmp_path):
    words = ("--errors", "--show", "end.y", "--out", tmp_path)
    running = process(*SMALL, *words, before=("mpirun", "--oversubscribe", "-n", "2"), environment=TOGETHER)
    out, error = running.communicate(timeout=PATIENCE)
    assert running.returncode == DONE, error
    assert out.count("3 of 3 cases") == 2  # the answer, and the first sentence: one process speaks
    drop = ("seconds",)
    one, two = ([{k: v for k, v in row.items() if k not in drop} for row in rows_of(f)] for f in (small, tmp_path))
    assert one == two
    workers = {case["worker"] for case in json.loads((tmp_path / "cases.json").read_text())["cases"]}
    assert workers == {1}


@needs_mpirun
def test_mpirun_says_an_error_once(tmp_path):
    running = process("sweep", "cantilever", "--vary", "strip.gama=1", "--out", tmp_path,
                      before=("mpirun", "--oversubscribe", "-n", "3"), environment=TOGETHER)  # fmt: skip
    _, error = running.communicate(timeout=PATIENCE)
    assert running.returncode == BAD_INPUT
    assert error.count("strip.gama = 1: is not a known key") == 1
