"""The shell's report goes over the fields of its result: what a solve knows is in shell.json or shell.npz."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem
from shellref.shell.result import ON_SURFACE, LoadStep, ShellResult, ShellStatus
from shellref.shell.surface import ShellSurface

PROBLEM = ShellProblem(width=0.1, thickness=0.01, poisson=0.3, elements=(2, 1))


def result(kind=ShellResult, **more):
    """A flat strip as a result, every field of its own kind."""
    s, v = np.linspace(0.0, 1.0, 5), np.linspace(-0.05, 0.05, 3)
    points = np.stack([np.add.outer(0.0 * s, v), np.zeros((5, 3)), np.add.outer(s, 0.0 * v)], axis=-1)
    surface = ShellSurface(s, v, points, np.broadcast_to([0.0, 1.0, 0.0], points.shape).copy(), 2)
    step = LoadStep("gravity", 0.5, True, 3, np.inf, None, "", "arc", 4, 0.25, {"end": [0.0, 0.0, 1.0]})
    force = {"force": np.array([1.0, 2.0, 3.0]), "moment": np.zeros(3)}
    return kind(
        problem=PROBLEM, options=ShellOptions(), status=ShellStatus.LIMIT_POINT, message="turned back",
        surface=surface, elements=(2, 1), load_factor=0.5, natural_factor=1.0, path_factor=0.75, stable=None,
        negative_eigenvalues=None, lowest_eigenvalue=-0.5, residual={"absolute": 1e-9, "relative": 1e-10},
        newton_iterations=7, factorisations=8, steps=(step,), energy={"elastic": 1.0}, share={"bending": 1.0},
        stabilisation={"energy": 0.0}, clamps={"start": force}, cell_midpoints=np.zeros((2, 2)),
        energy_density=np.ones((2, 3)), unknowns=90, seconds={"total": 1.5}, memory_mb=12.0, provenance={"a": "b"},
        walls=(), contact=None, pairs=(), discretisation=None, **more,
    )  # fmt: skip


def test_every_field_is_in_the_report(tmp_path):
    found = result()
    found.save(tmp_path, "shell", {"start": "path"})
    data = json.loads((tmp_path / "shell.json").read_text())
    fields = {field.name for field in dataclasses.fields(ShellResult)} - set(ON_SURFACE)
    assert set(data) == (fields - {"unknowns"}) | {"dofs", "end", "middle", "start"}
    assert (data["status"], data["dofs"], data["elements"]) == ("limit_point", 90, [2, 1])
    assert data["clamps"]["start"]["force"] == [1.0, 2.0, 3.0]
    assert data["problem"] == json.loads(json.dumps(PROBLEM.to_dict()))
    assert data["problem"]["degree"] == PROBLEM.degree
    assert data["options"] == json.loads(json.dumps(ShellOptions().to_dict()))
    (step,) = data["steps"]
    assert set(step) == {field.name for field in dataclasses.fields(LoadStep)}
    assert (step["correction"], step["method"]) == (None, "arc")
    with np.load(tmp_path / "shell.npz") as stored:
        assert np.array_equal(stored["energy_density"], found.energy_density)
        assert np.array_equal(stored["cell_midpoints"], found.cell_midpoints)


def test_a_new_field_is_in_the_report():
    more = dataclasses.make_dataclass("More", [("extra", float)], bases=(ShellResult,), frozen=True, kw_only=True)
    assert result(more, extra=2.5).to_dict()["extra"] == 2.5


@pytest.mark.parametrize("kind", [ShellResult, LoadStep])
def test_what_can_be_false_has_no_default(kind):
    """But `discretisation`, which is None where nothing estimated it."""
    none = dataclasses.MISSING
    given = {one.name for one in dataclasses.fields(kind) if one.default is not none or one.default_factory is not none}
    assert given <= {"discretisation"}
