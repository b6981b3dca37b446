"""The table of what holds a strip in every model: signs, errors and gaps where they belong."""

from __future__ import annotations

import json

import numpy as np
import pytest

from compare.pages.compare import write
from compare.pages.models.supports import side_by_side
from compare.scene.scene import load, loads
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import compare
from tests.compare.models.test_contact_itself import FOLD
from tests.reference.touching_fold import folds

CHANGE = {
    "strip.poisson": 0.0, "shell.width_to_thickness": [100.0], "shell.elements": [24, 2], "shell.grading": [1.0, 1.0],
    "model.elements": 24,
}  # fmt: skip


def test_ribbon_and_shell_are_carried_by_the_same_forces(tmp_path):
    """Roman's fold between floor and roof: each model's forces and weight balance, both roofs agree to 2 %, and the
    table is in the files."""
    found = compare(load("roman_6_2").replace(CHANGE), CaseStore(tmp_path / "cases"), Reporter(quiet=True), bare=True)
    table = side_by_side(found.fast, found.rows)
    assert table is not None
    records = table.records()
    assert {r["support"] for r in records} == {"clamp start", "clamp end", "wall floor", "wall roof"}
    roofs = {r["model"]: r for r in records if r["support"] == "wall roof"}
    assert roofs["w/h = 100"]["force_y"] == pytest.approx(roofs["ribbon"]["force_y"], rel=0.02)
    assert roofs["w/h = 100"]["force_error"] > 0.0
    assert abs(roofs["w/h = 100"]["gap"]) < 1e-9
    for name in ("ribbon", "w/h = 100"):
        total = np.sum([[r[f"force_{axis}"] for axis in "xyz"] for r in records if r["model"] == name], axis=0)
        np.testing.assert_allclose(total, [0.0, 10.0, 0.0], atol=1e-5)  # Gamma = 10, upwards
    write(tmp_path, found, "again")
    assert "wall roof" in (tmp_path / "supports.csv").read_text()
    page = json.loads((tmp_path / "page.json").read_text())
    assert "Forces, side by side" in json.dumps(page)


@pytest.mark.validate
def test_parts_that_push_each_other_stand_side_by_side(tmp_path):
    """The fold whose sides meet: ribbon and shell say what its parts at larger s exert on the others, with errors."""
    changes = {"strip.poisson": 0.0, "shell.width_to_thickness": [100.0], "shell.elements": [40, 1]}
    scene = loads(FOLD, "fold").replace(changes)
    found = compare(scene, CaseStore(tmp_path / "cases"), Reporter(quiet=True), bare=True)
    (row,) = found.rows
    assert row.shell_contacts is not None
    assert row.shell_contacts["count"] == len(row.shell_contacts["pairs"]) > 0
    table = side_by_side(found.fast, found.rows)
    assert table is not None
    own = {r["model"]: r for r in table.records() if r["support"] == "itself"}
    (known,) = folds(np.array([0.16]), 0.02)
    assert own["ribbon"]["force_z"] == pytest.approx(-known.push, rel=5e-3)
    assert own["w/h = 100"]["force_z"] == pytest.approx(-known.push, rel=0.1)
    assert own["w/h = 100"]["force_error"] > 0.0
    assert own["ribbon"]["force_error"] > 0.0
