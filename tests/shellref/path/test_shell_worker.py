"""The shell as a process: files, progress, exit codes."""

import dataclasses
import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from shellref import ShellOptions, ShellProblem, ShellStatus, ShellSurface
from shellref.path.begin import begun as solved
from tests.patience import PATIENCE

PROBLEM = {
    "width": 0.1,
    "thickness": 2e-3,
    "poisson": 0.3,
    "natural_curvature": [2.0, 1.0],
    "gamma": 3.0,
    "up": [0.0, 1.0, 0.0],
    "elements": [12, 2],
}


def run(folder, request, environment=None):
    """Completed process of the worker on `request` (text, or an object to dump)."""
    path = folder / "request.json"
    path.write_text(request if isinstance(request, str) else json.dumps(request))
    command = [sys.executable, "-m", "shellref.worker", str(path), str(folder / "out")]
    merged = {**os.environ, **(environment or {})}
    return subprocess.run(command, capture_output=True, text=True, check=False, env=merged)


@pytest.mark.parametrize(
    ("request_", "word"),
    [
        ("{", "JSON"),
        ({}, "problem"),
        ({"problem": {**PROBLEM, "thickness": 0.0}}, "thickness"),
        ({"problem": PROBLEM, "option": {}}, "option"),
        ({"problem": PROBLEM, "options": {"kikc": True}}, "kikc"),
        ({"problem": {**PROBLEM, "elements": [0, 1]}}, "elements"),
        ({"problem": PROBLEM, "states_for_error": [[6, 1]]}, "states_for_error"),
        ('{"problem": {"width": NaN, "thickness": 1, "poisson": 0}}', "width"),
        ({"problem": PROBLEM, "start": "nowhere.npz"}, "nowhere.npz"),
        ({"problem": PROBLEM, "start": "request.json"}, "request.json"),
        ({"problem": PROBLEM, "start": 3}, "start"),
        ({"problem": PROBLEM, "folder": ["a"]}, "folder"),
        ({"problem": {**PROBLEM, "clamp": "corners", "corner": 0.06}}, "corner"),
    ],
)
def test_bad_requests_exit_with_2_and_one_line(tmp_path, request_, word):
    done = run(tmp_path, request_)
    assert done.returncode == 2
    assert word in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out" / "shell.json").exists()


def test_missing_dolfinx_exits_with_3_and_the_remedy(tmp_path):
    """A package of that name that cannot be imported stands in for none."""
    (tmp_path / "dolfinx.py").write_text("raise ImportError('not here')\n")
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = run(tmp_path, {"problem": PROBLEM}, {"PYTHONPATH": path})
    assert done.returncode == 3
    assert "apt-get install python3-dolfinx" in done.stderr
    assert "make setup" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.shell
def test_files_and_progress(tmp_path):
    pytest.importorskip("dolfinx")
    done = run(tmp_path, {"problem": PROBLEM}, {"OMP_NUM_THREADS": "1"})
    assert done.returncode == 0, done.stderr
    events = [json.loads(line) for line in done.stdout.splitlines()]
    assert events[0]["event"] == "start"
    assert events[-1] == {"event": "written", "status": "converged", "ok": True}
    steps = [event for event in events if event["event"] == "step"]
    assert steps
    assert all({"stage", "load", "iterations", "accepted"} <= set(step) for step in steps)
    out = tmp_path / "out"
    names = {path.name for path in out.iterdir()}
    assert names == {"shell.json", "shell.npz"}
    result = json.loads((out / "shell.json").read_text())
    surface = ShellSurface.load(out / "shell.npz")
    assert surface.points.shape == (25, 5, 3)
    np.testing.assert_allclose(result["end"]["position"], surface.points[-1, 2], atol=1e-14)
    np.testing.assert_allclose(result["clamps"]["start"]["force"], [0, 3, 0], atol=1e-7)
    assert set(result["clamps"]) == {"start"}
    assert result["elements"] == [12, 2]
    assert result["start"] == "path"
    assert result["status"] == "converged"
    assert result["stable"] is True
    assert result["provenance"]["threads"] == "1"
    assert result["provenance"]["versions"]["dolfinx"]
    assert sum(result["share"].values()) == pytest.approx(1.0)
    assert {"import", "compile", "first", "tangent", "factor", "total"} <= set(result["seconds"])
    frame = np.array(result["end"]["frame"])
    np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-12)


@pytest.mark.shell
def test_a_solve_that_does_not_converge_still_exits_with_0(tmp_path):
    pytest.importorskip("dolfinx")
    done = run(tmp_path, {"problem": PROBLEM, "options": {"max_newton": 1}})
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "out" / "shell.json").read_text())
    assert result["status"] == "not_converged"
    assert result["message"]
    assert result["stable"] is None


def flat_start(path, width=0.1):
    """The flat strip along e_z as a start, on a coarse mesh of its own."""
    s, v = np.linspace(0.0, 1.0, 5), np.linspace(-0.5 * width, 0.5 * width, 3)
    points = np.stack(np.broadcast_arrays(v, 0.0, s[:, None]), axis=-1)
    ShellSurface(s, v, points, np.broadcast_to([0.0, 1.0, 0.0], points.shape).copy()).save(path)


def test_a_start_of_another_strip_is_refused(tmp_path):
    flat_start(tmp_path / "start.npz", width=0.2)
    done = run(tmp_path, {"problem": PROBLEM, "start": "start.npz"})
    assert done.returncode == 2
    assert "width 0.1" in done.stderr


def test_a_mesh_that_cannot_hold_the_corners_is_a_bad_request(tmp_path):
    pytest.importorskip("dolfinx")
    done = run(tmp_path, {"problem": {**PROBLEM, "clamp": "corners", "corner": 0.01, "elements": [12, 1]}})
    assert done.returncode == 2
    assert "elements" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.shell
def test_a_start_beside_the_request_is_settled_at_the_full_load(tmp_path):
    """The flat strip is near a light strip's state: one Newton solve, and the state that the path reaches."""
    pytest.importorskip("dolfinx")
    flat_start(tmp_path / "start.npz")
    light = {**PROBLEM, "natural_curvature": [0.2, 0.1], "gamma": 0.3}
    done = run(tmp_path, {"problem": light, "start": "start.npz"})
    assert done.returncode == 0, done.stderr
    near = json.loads((tmp_path / "out" / "shell.json").read_text())
    assert (near["status"], near["start"]) == ("converged", "given")
    assert [step["method"] for step in near["steps"]] == ["start"]
    walked = solved(ShellProblem.from_dict(light), ShellOptions(), lambda event: None)
    assert walked.how == "path"
    assert len(walked.result.steps) > 1
    assert near["end"]["position"] == pytest.approx(walked.result.section(1.0)["position"], abs=1e-8)


class Reach:
    """A stand-in for shellref.path.solve.solve: a start serves strips of at least `reach` times its own thickness.

    The start's thickness stands in its points; every solve counts one second.
    """

    def __init__(self, reach, surface):
        self.reach, self.surface, self.asked = reach, surface, []

    def __call__(self, problem, options, progress, start=None, processes="self", folder=None):
        self.asked.append((problem.thickness, None if start is None else start.points[0, 0, 0], options.accuracy))
        near = start is None or problem.thickness >= self.reach * start.points[0, 0, 0] * (1 - 1e-12)
        points = np.full_like(self.surface.points, problem.thickness)
        surface = ShellSurface(self.surface.s_nodes, self.surface.v_nodes, points, self.surface.directors)
        return Found(problem, surface, ShellStatus.CONVERGED if near else ShellStatus.NOT_CONVERGED)


@dataclasses.dataclass(frozen=True)
class Found:
    """As much of a ShellResult as the worker looks at."""

    problem: ShellProblem
    surface: ShellSurface
    status: ShellStatus
    seconds: dict = dataclasses.field(default_factory=lambda: {"import": 0.25, "compile": 0.25, "total": 1.0})

    def with_seconds(self, seconds):
        return dataclasses.replace(self, seconds=seconds)


@pytest.mark.parametrize(
    ("reach", "how", "down"),
    [
        (0.5, "given, by way of thicker strips", [1000]),
        (0.6, "given, by way of thicker strips", [500, 250 * 2**0.5, 500, 500 * 2**0.5, 1000]),
        (1.5, "path (none near the start)", None),
    ],
)
def test_a_start_too_far_for_a_thin_strip_is_settled_by_way_of_thicker_ones(tmp_path, monkeypatch, reach, how, down):
    """The start stands for w/h = 250: 1000 cannot settle there, nor 500 where the reach is short of two."""
    flat_start(tmp_path / "start.npz")
    flat = ShellSurface.load(tmp_path / "start.npz")
    fake = Reach(reach, flat)
    monkeypatch.setattr("shellref.path.solve.solve", fake)
    problem = ShellProblem.from_dict({**PROBLEM, "thickness": 1e-4})
    start = ShellSurface(flat.s_nodes, flat.v_nodes, np.full_like(flat.points, 4e-4), flat.directors)
    events = []
    found = solved(problem, ShellOptions(accuracy=1e-3), events.append, start=start)
    assert (found.how, found.result.problem) == (how, problem)
    assert found.result.seconds["total"] == len(fake.asked)
    thinner = [event["width_to_thickness"] for event in events if event["event"] == "thinner"]
    assert all(accuracy is None for thickness, _, accuracy in fake.asked if thickness > 1.5e-4)
    assert fake.asked[-1][2] == 1e-3
    if down is None:
        assert fake.asked[-1][1] is None
        assert events[-1] == {"event": "path"}
    else:
        assert thinner == pytest.approx(down)
        assert fake.asked[-1][0] == pytest.approx(1e-4)
        assert max(a[0] for a in fake.asked) == pytest.approx(2e-4 if reach == 0.5 else 4e-4)


@pytest.mark.shell
def test_a_start_near_nothing_falls_back_on_the_path():
    pytest.importorskip("dolfinx")
    problem = ShellProblem.from_dict({**PROBLEM, "elements": [8, 1]})
    flat = solved(problem, ShellOptions(), lambda event: None).result.surface
    rng = np.random.default_rng(1)
    scrambled = ShellSurface(flat.s_nodes, flat.v_nodes, rng.standard_normal(flat.points.shape), flat.directors)
    found = solved(problem, ShellOptions(), lambda event: None, start=scrambled)
    assert found.how == "path (none near the start)"
    assert found.result.status is ShellStatus.CONVERGED


@pytest.mark.shell
def test_a_killed_worker_goes_on_from_its_checkpoint(tmp_path):
    """Killed once the first checkpoint is there; the second worker keeps the steps of the first, seconds and all."""
    pytest.importorskip("dolfinx")
    request = tmp_path / "request.json"
    problem = {**PROBLEM, "elements": [30, 3], "gamma": 50.0}
    options = {"first_step": 0.05, "max_step": 0.05}
    request.write_text(json.dumps({"problem": problem, "options": options, "folder": "kept"}))
    command = [sys.executable, "-m", "shellref.worker", str(request), str(tmp_path / "out")]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    checkpoint = tmp_path / "kept" / "path" / "checkpoint.npz"
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    steps = 0
    for line in process.stdout:
        steps += json.loads(line)["event"] == "step"
        if steps >= 3 and checkpoint.exists():
            process.send_signal(signal.SIGKILL)
            break
    process.stdout.close()
    assert process.wait(timeout=PATIENCE) == -signal.SIGKILL
    log = (tmp_path / "kept" / "path" / "steps.jsonl").read_text().splitlines()
    first = json.loads(log[0])
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "out" / "shell.json").read_text())
    assert result["status"] == "converged"
    assert result["steps"][0] == first
    assert sum(step["iterations"] for step in result["steps"]) == result["newton_iterations"]
    assert not checkpoint.exists()
