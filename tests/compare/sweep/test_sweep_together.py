"""Slices of a sweep that are solved as one batch, against the same cases one by one."""

import signal
from dataclasses import replace

import pytest

from compare.cli import DONE, NOT_CONVERGED, main
from compare.scene.scene import load
from compare.sweep.case import Task, run_case, run_cases, slice_key
from compare.sweep.run import sliced
from compare.sweep.workers import LocalCrew, jobs_of
from tests.compare.sweep.test_sweep import result_of, rows_of

#: Differ from run to run, or say which way it was.
TIMES = ("seconds", "time", "together", "worker")


def tasks_of(*changes, scene="cantilever", folder="."):
    """Tasks of one slice: the scene with each of the changes."""
    base = load(scene).replace({"model.elements": 12})
    scenes = [base.replace(change) if change else base for change in changes]
    return [Task(f"{k:064d}", found, "ribbon", False, False, folder, 0) for k, found in enumerate(scenes)]


def told(record):
    return {name: value for name, value in record.items() if name not in TIMES}


CURLED = {"strip.natural_curvature": 5.0, "gravity.up": [0.0, 0.6, 0.8]}
THICK = {"model.energy": "kirchhoff", "strip.thickness": 1e-3, "shell.width_to_thickness": None}
KINDS = {
    "weights": [
        {"strip.gamma": gamma, "strip.natural_curvature": curl} for gamma in (1.0, 90.0) for curl in (0.0, 2.0)
    ],
    "turned": [{"gravity.up": [0.48, 0.36, 0.8], "strip.gamma": g, "model.energy": "sadowsky"} for g in (3.0, 300.0)],
    "unstable": [{**CURLED, "strip.gamma": gamma} for gamma in (1.0, 6.7, 45.0, 300.0)],
    "seeds": [{"strip.gamma": 500.0, "seed.curvature": c, "seed.ruling": [0.0, 0.1]} for c in (-9.0, [3.0, 0.0])],
    "free twist": [
        {**THICK, "clamp.start.ruling": None, "gravity.up": [0.48, 0.36, 0.8], "strip.gamma": g} for g in (5.0, 50.0)
    ],
    "tip": [{"tip.force": [0.5, 1.0, 0.0]}, {"strip.gamma": 5.0}, {"tip.force": [0.0, 0.0, 3.0]}],
    "no time": [{"model.budget": 1e-9, "strip.gamma": gamma} for gamma in (10.0, 80.0)],
    "graded": [{"model.grading": "clamp", "strip.length": length} for length in (1.0, 1.0)],
}


@pytest.mark.parametrize("kind", KINDS)
def test_together_is_one_by_one_to_the_last_digit(kind):
    tasks = tasks_of(*KINDS[kind])
    assert len({slice_key(task) for task in tasks}) == 1
    assert slice_key(tasks[0]) is not None
    for task, record in zip(tasks, run_cases(tasks), strict=True):
        assert record["together"] is True
        assert record["seconds"] > 0.0
        assert told(record) == told(run_case(task))


def test_the_kinds_end_in_more_than_one_way():
    ends = {record["status"] for kind in ("unstable", "no time") for record in run_cases(tasks_of(*KINDS[kind]))}
    assert ends == {"converged", "saddle", "not_converged"}


def test_one_that_is_refused_speaks_for_itself_alone():
    """A ruling is held of an energy that knows none: the others are solved."""
    thick = {**THICK, "clamp.start.ruling": None}
    tasks = tasks_of({**thick, "strip.gamma": 1.0}, THICK, thick)
    records = run_cases(tasks)
    assert [record["status"] for record in records] == ["converged", "refused", "converged"]
    assert [told(record) for record in records] == [told(run_case(task)) for task in tasks]


MORE = {
    "closed": ("moebius_6_1", {"model.elements": 20}, {}),
    "held at both ends": ("two_clamps_5_3_2", {"model.elements": 20}, {}),
    "a way": ("two_clamps_5_3_2", {}, {}),
    "a wall": ("cantilever", {"wall": [{"point": [0.0, -0.5, 0.0], "normal": [0.0, 1.0, 0.0]}]}, {}),
    "placed": ("cantilever", {"model.tolerance": 1e-3}, {}),
    "weight of the surface": ("cantilever", {"gravity.exact": True}, {}),
    "the judge": ("cantilever", {"model.solver": "ipopt"}, {}),
    "glued": ("cantilever", {"model.formulation": "mixed"}, {}),
    "an error": ("cantilever", {}, {"errors": True}),
    "no saddle": ("cantilever", {}, {"leave_saddle": True}),
    "another model": ("cantilever", {}, {"solver": "elastica"}),
}


@pytest.mark.parametrize("why", MORE)
def test_what_asks_for_more_goes_alone(why):
    name, keys, options = MORE[why]
    scene = load(name)
    task = replace(Task("0" * 64, scene.replace(keys) if keys else scene, "ribbon", False, False, "."), **options)
    assert slice_key(task) is None
    assert sliced([task], 1)[0].slice is None


def test_slices_are_cases_that_fit_in_their_order():
    weights = [{"strip.gamma": float(gamma)} for gamma in range(1, 11)]
    others = [{"strip.gamma": float(gamma), "model.energy": "sadowsky"} for gamma in range(1, 4)]
    tasks = [replace(task, slice=None) for task in tasks_of(*weights, *others, {"model.solver": "ipopt"})]
    found = [task.slice for task in sliced(tasks, 1)]
    assert found == [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 4, 5, 6, None]
    assert jobs_of(sliced(tasks, 1))[0] == (0, 1, 2)
    assert jobs_of(sliced(tasks, 1))[-1] == (13,)
    many = sliced(tasks[:1] * 1000, 2)
    assert max(sum(task.slice == k for task in many) for k in range(20)) == 64


class Deadly:
    """A scene that kills the worker that unpacks it."""

    def __reduce__(self):
        return signal.raise_signal, (signal.SIGKILL,)


def test_a_worker_that_dies_takes_one_case_of_its_slice(tmp_path):
    tasks = tasks_of({"strip.gamma": 1.0}, {}, {"strip.gamma": 3.0}, {"strip.gamma": 4.0}, folder=str(tmp_path))
    tasks[1] = replace(tasks[1], scene=Deadly())
    tasks[3] = replace(tasks[3], slice=1)
    records = dict(LocalCrew(1).run(tasks))
    assert [records[k]["status"] for k in range(4)] == ["converged", "crashed", "converged", "converged"]
    assert records[1]["message"] == "the worker process was killed by SIGKILL, 2 times"
    assert "together" not in records[0]
    assert records[3]["together"] is True


@pytest.mark.parametrize("more", [[], ["--stay"]])
def test_the_table_is_the_same_and_the_output_says_which_way(tmp_path, monkeypatch, capsys, more):
    """Saddles are left of themselves, each alone; with --stay all cases go together and three are saddles."""
    fixed = ["--set", "model.elements=12", "--set", "gravity.up=[0.0,0.6,0.8]", "--workers", "1", *more]
    varied = ["--vary", "strip.natural_curvature=0,5", "--vary", "strip.gamma=log(1,300,4)"]
    command = ["sweep", "cantilever", *fixed, *varied]
    end = NOT_CONVERGED if more else DONE
    assert main([*command, "--out", str(tmp_path / "a")]) == end
    assert "8 cases together in 4 slices" in " ".join(capsys.readouterr().err.split())
    monkeypatch.setattr("compare.sweep.run.slice_key", lambda task: None)
    assert main([*command, "--out", str(tmp_path / "b")]) == end
    assert "each case alone" in " ".join(capsys.readouterr().err.split())
    tables = [rows_of(tmp_path / path) for path in "ab"]
    assert {row["status"] for row in tables[0]} == ({"converged", "saddle"} if more else {"converged"})
    unstable = sum(row["stable"] == "false" for row in tables[0])
    left = [float(row["left_saddle"]) for row in tables[0] if row.get("left_saddle")]
    assert (unstable > 0, len(left) > 0) == (bool(more), not more)
    assert all(above > 0.0 for above in left)
    assert [result_of(tmp_path / path)["together"] for path in "ab"] == [8 - len(left), 0]
    for row in (*tables[0], *tables[1]):
        del row["seconds"]
    assert tables[0] == tables[1]
    monkeypatch.undo()
    assert main([*command, "--out", str(tmp_path / "a"), "--quiet"]) == end
    assert result_of(tmp_path / "a")["new"] == 0
