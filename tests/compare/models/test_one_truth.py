"""One truth for each scene and model: solve, a one-point sweep, cost's run and compare's row say the same.

The copies of the glue that once stood in each command had drifted: a sweep that ignored seeds and paths, energies
without the datum of a tip load, a cost on another branch.
"""

from __future__ import annotations

import numpy as np
import pytest

from compare import registry
from compare.models import solve
from compare.models.base import Options
from compare.models.scope import has_shell, require_shell
from compare.models.shell_process import ShellCase
from compare.pages.result import state_result
from compare.scene.scene import Scene, load, shipped
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import compare
from compare.sweep.case import Task, row_of, run_case

#: Scenes whose ribbon is solved within a second or two; the others run under the marker.
QUICK = (
    "cantilever", "coil_10_100", "curl_4_3", "daisy_5g", "daisy_10g", "start_5_3_3_4", "two_clamps_5_3_2",
    "two_clamps_5_3_2_level",
)  # fmt: skip
MODELS = ("ribbon", "elastica")
SOLVED = [
    pytest.param(name, model, marks=() if name in QUICK else pytest.mark.validate)
    for name in shipped()
    for model in MODELS
]
#: Two runs of the same solve differ by rounding only (threads, alignment); two states differ by far more.
SAME = 1e-9


def answers(scene: Scene, model: str) -> bool:
    """Whether the model takes the scene."""
    return registry.model(model).refusal(scene) is None


def in_a_sweep(scene: Scene, model: str, folder) -> dict:
    """The row of a one-point sweep."""
    record = run_case(Task("0" * 64, scene, model, False, False, str(folder)))
    assert len(record["rows"]) == 1, record["message"]
    return record["rows"][0]


@pytest.mark.parametrize(("name", "model"), SOLVED)
def test_a_sweep_says_what_solve_says(name, model, tmp_path):
    scene = load(name)
    if not answers(scene, model):
        with pytest.raises(Exception, match=r"\w"):
            solve(scene, model)
        return
    state = solve(scene, model)
    assert state.energy is not None
    row = in_a_sweep(scene, model, tmp_path)
    assert (row["status"], row["stable"]) == (state.word, state.stable)
    for key, value in (("elastic", state.energy.elastic), ("gravity", state.energy.gravity), ("tip", state.energy.tip)):
        assert row.get(f"energy.{key}") == (None if value is None else pytest.approx(value, rel=SAME, abs=SAME))
    assert row["energy.total"] == pytest.approx(state.energy.total, rel=SAME, abs=SAME)
    for place, pose in (("end", state.end), ("middle", state.middle)):
        assert [row[f"{place}.{axis}"] for axis in "xyz"] == pytest.approx(pose.position, abs=1e-7)
    written = state_result(scene, state)
    assert written["energy"]["total"] == pytest.approx(row["energy.total"], rel=SAME, abs=SAME)
    assert row_of(scene, state)["energy.total"] == written["energy"]["total"]


@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.validate) for n in shipped()])
def test_compare_says_what_solve_says(name, tmp_path, monkeypatch):
    """The ribbon and the third opinion of a comparison whose shells all fail at once."""
    monkeypatch.setattr("compare.models.shell.run_shell", lambda *a, **k: ShellCase({"status": "crashed"}, None, False))
    scene = load(name)
    if not has_shell(scene) or not answers(scene, "ribbon"):
        return
    found = compare(scene, CaseStore(tmp_path / "cases"), Reporter(quiet=True))
    # with its error, as compare has it: where that tells of another stability the state is one on finer elements
    alone = solve(scene, "ribbon", options=Options(error=True))
    assert found.fast.word == alone.word
    assert found.fast.energy.total == pytest.approx(alone.energy.total, rel=SAME, abs=SAME)
    assert found.fast.end.position == pytest.approx(alone.end.position, abs=1e-7)
    assert [row.status for row in found.rows] == ["crashed"] * len(require_shell(scene))
    if found.elastica is not None and found.fast.ok:
        near = solve(scene, "elastica", near=found.fast.shape)
        assert found.elastica.energy.total == pytest.approx(near.energy.total, rel=SAME, abs=SAME)
        assert found.elastica.start == near.start


def test_a_sweep_of_the_elastica_reads_seed_and_path(tmp_path):
    """Fault A: two clamps on a level; the seed chooses the branch, the lower one or its mirror."""
    scene = load("two_clamps_5_3_2_level").replace({"model.energy": "elastica", "clamp.end.position": [0.7, 0.0, 0.0]})
    totals = {}
    for sign in (1.0, -1.0):
        own = scene.replace({"seed.curvature": [-6.0 * sign, 12.0 * sign, -6.0 * sign]})
        row, state = in_a_sweep(own, "elastica", tmp_path), solve(own)
        assert row["energy.total"] == pytest.approx(state.energy.total, rel=SAME)
        totals[sign] = row["energy.total"]
    assert abs(totals[1.0] - totals[-1.0]) > 1.0
    by_path = scene.replace({"seed.curvature": [-6.0, 12.0, -6.0], "path": [{"strip.gamma": 3.0}]})
    assert in_a_sweep(by_path, "elastica", tmp_path)["energy.total"] == pytest.approx(
        solve(by_path).energy.total, rel=SAME
    )


def test_a_tip_load_has_its_datum_everywhere(tmp_path):
    """Fault B: energies are against the origin of the scene, the tip's too: moving the scene up by d adds load x d."""
    keys = {"strip.second_moment": None, "strip.thickness": None, "strip.young": None, "tip": {"load": 2.0}}
    scene = load("cantilever").replace({**{k: v for k, v in keys.items() if k == "tip"}, "model.energy": "elastica"})
    assert scene.up is not None
    moved = scene.replace({"clamp.start.position": (scene.position + 0.5 * scene.up).tolist()})
    rows = [in_a_sweep(one, "elastica", tmp_path) for one in (scene, moved)]
    states = [solve(one) for one in (scene, moved)]
    for row, state in zip(rows, states, strict=True):
        assert row["energy.total"] == pytest.approx(state.energy.total, rel=SAME)
        assert row["energy.tip"] == pytest.approx(state.energy.tip, rel=SAME)
    assert rows[1]["energy.tip"] - rows[0]["energy.tip"] == pytest.approx(2.0 * 0.5, abs=1e-7)
    assert rows[1]["energy.total"] - rows[0]["energy.total"] == pytest.approx((2.0 + scene.gamma) * 0.5, abs=1e-7)


@pytest.mark.shell
def test_energies_of_a_shell_leave_out_the_constant_everywhere(tmp_path):
    """Fault G: `energy.elastic` of a naturally curved shell, in solve's state, a sweep's row and compare's row."""
    pytest.importorskip("dolfinx")
    scene = load("curl_4_3").replace({"shell.width_to_thickness": [10], "shell.elements": [12, 1]})
    store = CaseStore(tmp_path / "cases")
    alone = solve(scene, "shell", options=Options(store=store))
    assert alone.energy.constant == pytest.approx(50.0)
    row = in_a_sweep(scene, "shell", tmp_path)
    assert row["energy.elastic"] == pytest.approx(alone.energy.elastic, rel=SAME)
    assert row["energy.bending"] > 0.0  # parts are of the stored energy, the constant included
    found = compare(scene, store, Reporter(quiet=True))
    assert found.rows[0].energy.elastic == pytest.approx(alone.energy.elastic, rel=1e-6)
    parts = sum(alone.energy.parts.values())
    assert parts == pytest.approx(alone.energy.elastic + alone.energy.constant, rel=1e-3)
    assert np.sign(alone.energy.elastic) == -1.0
