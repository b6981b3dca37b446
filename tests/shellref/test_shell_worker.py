"""The shell as a process: files, progress, exit codes."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from shellref import ShellSurface
from shellref.worker import distances

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
        ({"problem": PROBLEM, "states_for_error": [[0, 1]]}, "elements"),
        ('{"problem": {"width": NaN, "thickness": 1, "poisson": 0}}', "width"),
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
def test_files_progress_and_states_for_error(tmp_path):
    pytest.importorskip("dolfinx")
    done = run(tmp_path, {"problem": PROBLEM, "states_for_error": [[6, 1], [24, 2]]}, {"OMP_NUM_THREADS": "1"})
    assert done.returncode == 0, done.stderr
    events = [json.loads(line) for line in done.stdout.splitlines()]
    assert events[0]["event"] == "start"
    assert events[-1] == {"event": "written", "status": "converged", "ok": True}
    steps = [event for event in events if event["event"] == "step"]
    assert steps
    assert all({"stage", "load", "iterations", "accepted"} <= set(step) for step in steps)
    out = tmp_path / "out"
    names = {path.name for path in out.iterdir()}
    assert names == {f"shell{tag}.{ext}" for tag in ("", "_6x1", "_24x2") for ext in ("json", "npz")}
    result = json.loads((out / "shell.json").read_text())
    surface = ShellSurface.load(out / "shell.npz")
    assert surface.points.shape == (25, 5, 3)
    np.testing.assert_allclose(result["end"]["position"], surface.points[-1, 2])
    np.testing.assert_allclose(result["clamp"]["force"], [0, 3, 0], atol=1e-7)
    assert result["status"] == "converged"
    assert result["stable"] is True
    assert result["provenance"]["threads"] == "1"
    assert result["provenance"]["versions"]["dolfinx"]
    assert sum(result["share"].values()) == pytest.approx(1.0)
    assert {"import", "compile", "first", "tangent", "factor", "total"} <= set(result["seconds"])
    frame = np.array(result["end"]["frame"])
    np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-12)
    coarse, fine = (row["distance"]["largest"] for row in result["error_states"])
    assert [row["elements"] for row in result["error_states"]] == [[6, 1], [24, 2]]
    assert coarse > 3 * fine > 0
    assert distances(surface, ShellSurface.load(out / "shell_6x1.npz"))["largest"] == coarse


@pytest.mark.shell
def test_a_solve_that_does_not_converge_still_exits_with_0(tmp_path):
    pytest.importorskip("dolfinx")
    done = run(tmp_path, {"problem": PROBLEM, "options": {"max_newton": 1}})
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "out" / "shell.json").read_text())
    assert result["status"] == "not_converged"
    assert result["message"]
    assert result["stable"] is None
