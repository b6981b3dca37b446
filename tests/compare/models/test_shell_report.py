"""What the shell's worker answers, read back: typed, whole, and w/h as it was asked for."""

from __future__ import annotations

import json

import pytest

from compare.models.shell import state_of
from compare.models.shell_process import LoadStep, Report, ShellCase
from compare.pages.result import state_result
from compare.scene.scene import load
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem

STEP = LoadStep("gravity", 0.5, True, 4, 1e-9, None, "", "load", 4, 0.25, {"end": [0.0, 0.1, 0.9]})


def answered(width: float, ratio: float) -> dict:
    """The content of a shell.json, through JSON."""
    problem = ShellProblem(width=width, thickness=width / ratio, poisson=0.3)
    place = {"position": [0.0, 0.0, 1.0], "frame": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}
    return json.loads(json.dumps({
        "problem": problem.to_dict(), "options": ShellOptions().to_dict(), "status": "converged",
        "elements": [24, 2], "load_factor": 1.0, "path_factor": 1.0, "negative_eigenvalues": 0,
        "residual": {"absolute": 1e-9, "relative": 1e-10}, "factorisations": 4, "steps": [STEP.to_dict()],
        "energy": {"elastic": 1.0}, "share": {"membrane": 0.1}, "seconds": {"total": 1.0}, "memory_mb": 1.0,
        "discretisation": None, "end": place, "middle": place, "provenance": {"processes": 1},
    }))  # fmt: skip


@pytest.mark.parametrize(("width", "ratio"), [(0.03, 50.0), (0.1 / 3.0, 200.0), (0.07, 10.0)])
def test_a_report_is_what_was_asked_and_found(width, ratio):
    report = ShellCase(answered(width, ratio), None, False).report
    assert report.width_to_thickness == ratio
    assert report.problem == ShellProblem(width=width, thickness=width / ratio, poisson=0.3)
    assert report.options == ShellOptions()
    assert report.elements == (24, 2)
    assert report.steps == (STEP,)


@pytest.mark.parametrize("field", ["problem", "steps", "share", "middle"])
def test_a_report_that_lacks_a_field_is_none(field):
    data = answered(0.03, 50.0)
    del data[field]
    with pytest.raises(KeyError, match=field):
        Report.of(data)


def test_a_worker_that_died_has_no_report():
    with pytest.raises(KeyError):
        _ = ShellCase({"status": "crashed", "stable": None, "message": "killed", "seconds": {}}, None, False).report


def test_the_result_of_a_worker_that_died_is_that_of_every_model():
    dead = ShellCase({"status": "crashed", "stable": None, "message": "killed", "seconds": {}}, None, False)
    scene = load("curl_4_3")
    found = state_result(scene, state_of(scene, dead))
    assert (found["status"], found["message"]) == ("crashed", "killed")
    assert (found["energy"], found["end"], found["forces"]["start"]) == (None, None, None)
    assert "share" not in found
