"""Interrupted runs: the log and the checkpoint, and what is made of damaged ones."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from shellref import Pose, ShellOptions, ShellProblem, ShellStatus, Waypoint

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.path import journal  # noqa: E402
from shellref.path.solve import solve  # noqa: E402

FLAT = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # t_x = e_y, t_y = e_z, t_z = e_x
BRIDGE = ShellProblem(
    width=0.05,
    thickness=5e-4,
    poisson=0.3,
    start_curvature=-2.5,
    end=Pose((0.5, 0.01, 0.0), FLAT),
    path=(Waypoint(natural=1.0, name="release"),),
    clamp_frame=FLAT,
    elements=(16, 1),
)
ON_EDGE = ShellProblem(
    width=0.05, thickness=2.5e-3, poisson=0.35, gamma=21.7, up=(1.0, 0.0, 0.0), elements=(16, 2), grading=(0.3, 1.0)
)
CASES = {
    "load steps": (BRIDGE, ShellOptions(), 9),
    "kick": (ON_EDGE, ShellOptions(), 6),
    "arc length": (BRIDGE, ShellOptions(arc_length="always"), 12),
    "branch": (ON_EDGE, ShellOptions(switch=True), 18),
}


class Interrupted(Exception):
    """Stands for whatever stops a run."""


@pytest.fixture(autouse=True)
def every_point(monkeypatch):
    monkeypatch.setattr(journal, "EVERY", 0.0)


def until(count):
    """A progress callback that stops the run at its `count`-th step."""
    seen = []

    def progress(event):
        seen.append(event["event"])
        if seen.count("step") == count:
            raise Interrupted

    return progress


def lines(folder) -> list[dict]:
    return [json.loads(line) for line in (folder / "steps.jsonl").read_text().splitlines()]


@pytest.mark.parametrize("name", CASES)
def test_an_interrupted_run_goes_on_from_its_checkpoint(name, tmp_path):
    problem, options, count = CASES[name]
    whole = solve(problem, options)
    assert whole.status is ShellStatus.CONVERGED
    assert len(whole.steps) > count
    with pytest.raises(Interrupted):
        solve(problem, options, until(count), folder=tmp_path)
    assert (tmp_path / "checkpoint.npz").exists()
    before = lines(tmp_path)
    assert len(before) == count
    events = []
    result = solve(problem, options, events.append, folder=tmp_path)
    new = [event for event in events if event["event"] == "step"]
    assert 0 < len(new) <= len(whole.steps) - count + 3
    assert (result.status, result.stable, result.message) == (whole.status, whole.stable, whole.message)
    np.testing.assert_allclose(result.surface.points, whole.surface.points, atol=1e-9)
    assert result.energy["total"] == pytest.approx(whole.energy["total"], abs=1e-9)
    # the log is whole: what was done before the interruption, as far as it counts, and what came after
    kept = len(result.steps) - len(new)
    assert count - 2 <= kept <= count
    assert lines(tmp_path) == [step.to_dict() for step in result.steps]
    assert lines(tmp_path)[:kept] == before[:kept]
    last = {stage: [s.load for s in result.steps if s.accepted and s.stage == stage] for stage in ("clamps", "gravity")}
    assert all(loads[-1] == 1.0 for loads in last.values() if loads)
    assert not (tmp_path / "checkpoint.npz").exists()  # done: the next run begins anew


def test_a_run_stopped_beyond_a_turn_of_the_load_goes_on_along_its_branch(tmp_path):
    """The branch of the arch in test_shell_branches, stopped where its load falls: arc length goes on, down and up."""
    problem = replace(BRIDGE, thickness=2.5e-3, start_curvature=-1.0, end=Pose((0.985, 0.0, 0.0), FLAT))
    problem = replace(problem, gamma=120.0, up=(0.0, 0.0, -1.0), path=(*BRIDGE.path, Waypoint(end=problem.end)))
    options = ShellOptions(switch=True)
    whole = solve(problem, options)
    falling = [k for k, step in enumerate(whole.steps) if step.method == "arc" and step.load < 0.1]
    with pytest.raises(Interrupted):
        solve(problem, options, until(falling[1] + 1), folder=tmp_path)
    events = []
    result = solve(problem, options, events.append, folder=tmp_path)
    new = [event for event in events if event["event"] == "step"]
    assert {step["method"] for step in new} == {"arc", "locate"}
    assert new[0]["load"] < 0.1
    assert (result.status, result.message) == (whole.status, whole.message)
    np.testing.assert_allclose(result.surface.points, whole.surface.points, atol=1e-8)
    turns = [[step.note for step in run.steps if step.note.startswith("limit point at")] for run in (result, whole)]
    loads = [[float(note.rsplit(maxsplit=1)[1]) for note in notes] for notes in turns]
    assert loads[0] == pytest.approx(loads[1], abs=1.5e-3)


def test_a_killed_process_leaves_a_run_that_goes_on(tmp_path):
    code = f"""
import os, signal, shellref.path.journal
from shellref.path.solve import solve
from shellref import ShellProblem
shellref.path.journal.EVERY = 0.0
seen = []
def progress(event):
    seen.append(event["event"])
    if seen.count("step") == 8:
        os.kill(os.getpid(), signal.SIGKILL)
solve(ShellProblem.from_dict({BRIDGE.to_dict()!r}), progress=progress, folder={str(tmp_path)!r})
"""
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False, env=environment)
    assert done.returncode == -signal.SIGKILL, done.stderr
    assert len(lines(tmp_path)) == 8
    events = []
    result, whole = solve(BRIDGE, progress=events.append, folder=tmp_path), solve(BRIDGE)
    assert sum(event["event"] == "step" for event in events) < len(whole.steps) - 5
    assert result.status is ShellStatus.CONVERGED
    np.testing.assert_allclose(result.surface.points, whole.surface.points, atol=1e-9)
    assert [(s.stage, s.load) for s in result.steps] == [(s.stage, s.load) for s in whole.steps]


def interrupted(folder) -> None:
    with pytest.raises(Interrupted):
        solve(BRIDGE, None, until(9), folder=folder)


@pytest.mark.parametrize("other", ["problem", "options"])
def test_a_checkpoint_of_another_run_is_ignored(other, tmp_path):
    interrupted(tmp_path)
    problem = replace(BRIDGE, poisson=0.31) if other == "problem" else BRIDGE
    options = ShellOptions(max_newton=14) if other == "options" else ShellOptions()
    result, whole = solve(problem, options, folder=tmp_path), solve(problem, options)
    assert len(result.steps) == len(whole.steps)
    np.testing.assert_array_equal(result.surface.points, whole.surface.points)
    assert lines(tmp_path) == [step.to_dict() for step in result.steps]


@pytest.mark.parametrize("damage", ["empty", "half", "rubbish", "no log", "torn log"])
def test_torn_files_are_survived(damage, tmp_path):
    interrupted(tmp_path)
    checkpoint, log = tmp_path / "checkpoint.npz", tmp_path / "steps.jsonl"
    if damage == "no log":
        log.unlink()
    elif damage == "torn log":
        text = log.read_text().splitlines()
        log.write_text("\n".join([*text[:3], text[3][:20], '{"stage": 1}', *text[5:]]) + '\n{"sta')
    else:
        content = {"empty": b"", "half": checkpoint.read_bytes()[:3000], "rubbish": b"rubbish" * 100}[damage]
        checkpoint.write_bytes(content)
    result, whole = solve(BRIDGE, folder=tmp_path), solve(BRIDGE)
    assert result.status is ShellStatus.CONVERGED
    np.testing.assert_allclose(result.surface.points, whole.surface.points, atol=1e-9)
    assert lines(tmp_path) == [step.to_dict() for step in result.steps]
    missing = {"no log": 8, "torn log": 2}.get(damage, 0)
    assert len(result.steps) == len(whole.steps) - missing


def test_a_run_that_failed_keeps_its_checkpoint(tmp_path):
    """Its last good step is what the next run, of the same problem and options, goes on from."""
    problem = replace(BRIDGE, end=Pose((1.2, 0.0, 0.0), FLAT))
    first = solve(problem, folder=tmp_path)
    assert first.status is ShellStatus.STRETCHED
    events = []
    again = solve(problem, progress=events.append, folder=tmp_path)
    assert (again.status, again.path_factor) == (first.status, first.path_factor)
    np.testing.assert_allclose(again.surface.points, first.surface.points, atol=1e-9)
    assert sum(event["event"] == "step" for event in events) < 5
