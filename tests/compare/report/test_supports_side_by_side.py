"""The table of what holds a strip in every model: signs, errors and gaps where they belong."""

from __future__ import annotations

import json

import numpy as np
import pytest

from compare.pages.compare import write
from compare.pages.models.supports import side_by_side
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import compare

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
