"""The short answer of `ribbonbench cost`: total error against time for every model that reads a scene."""

from __future__ import annotations

import json

import pytest

from compare.cli import DONE, main
from compare.models import RICHEST
from compare.models.base import Options, State
from compare.models.shell import ShellModel
from compare.page.page import read_page
from compare.pages.models import cost as page
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.studies.priced import models as cost_models
from compare.studies.priced.models import ModelCosts, Timed, measure_models

SCENE = load("curl_4_3")


def run(name, size, seconds, error, ok=True):
    return Timed(name, size, 10, "converged" if ok else "saddle", ok, error, seconds, 0.1 * seconds)


ROWS = (
    run("sadowsky", "10", 1e-3, 9e-3), run("sadowsky", "20", 2e-3, 6e-3), run("sadowsky", "40", 4e-3, 5.9e-3),
    run("finite", "10", 4e-3, 8e-3), run("finite", "40", 8e-3, 7e-4), run("wunderlich", "40", 5e-4, 1e-5, ok=False),
    run("kirchhoff", "10", 1e-4, 6e-2), run(RICHEST, "50 x 4", 0.5, 9e-5), run(RICHEST, "100 x 8", 2.0, 3e-5),
)  # fmt: skip


def made(rows=ROWS, error=3e-5):
    return ModelCosts(SCENE, None, 100.0, rows, "100 x 8 elements", error, {"tape": "no curved section"}, {})


def test_one_sentence_says_what_each_target_costs():
    text = page.answer(made()).text
    assert text == (
        "To 1 % of l Sadowsky's strip, 1 ms; to 1 permille of l the strip of finite thickness, 8 ms; to 0.1 permille "
        "of l only the shell, 500 ms"
    )


def test_below_the_shells_own_error_nothing_is_claimed():
    rows = (*(row for row in ROWS if row.name != RICHEST), run(RICHEST, "100 x 8", 2.0, 3e-4))
    text = page.answer(made(rows, error=3e-4)).text
    assert "to 0.1 permille of l nothing here: the finest shell itself is known to 0.03 %" in text


def test_the_table_has_the_best_of_each_model_and_what_targets_took():
    costs = made()
    records = page.table(costs).records()
    assert [(row["name"], row["size"]) for row in records] == [
        (RICHEST, "100 x 8"), (RICHEST, "50 x 4"), ("finite", "40"), ("sadowsky", "20"), ("sadowsky", "10"),
        ("kirchhoff", "10"),
    ]  # fmt: skip
    assert len(page.table(made(ROWS * 3)).rows) <= page.ROWS
    assert len(page.table(costs, whole=True).rows) == len(ROWS)
    said = " ".join(page.sentences(costs))
    assert "kirchhoff (6 %)" in said
    assert "Do not read the scene: tape" in said


def test_an_unstable_run_reaches_nothing():
    assert all(costs.name != "wunderlich" for costs in made().best)
    assert made().reached(1e-9) is None


@pytest.mark.shell
def test_every_model_is_measured_against_the_finest_shell(tmp_path, capsys, monkeypatch):
    pytest.importorskip("dolfinx")
    monkeypatch.setattr(cost_models, "MESHES", ((10, 2), (20, 2)))
    monkeypatch.setattr(cost_models, "SIZES", slice(1, 2))
    monkeypatch.setattr(cost_models, "REPEATS", 2)
    monkeypatch.setattr(
        cost_models, "energies", lambda: ("auto", "sadowsky", "finite", "elastica", "kirchhoff", "tape")
    )
    place = tmp_path / "out"
    scene = ["curl_4_3", "--set", "shell.width_to_thickness=[20]", "--set", "strip.natural_curvature=3.0"]
    assert main(["cost", *scene, "--out", str(place)]) == DONE
    said = " ".join(capsys.readouterr().out.split())
    assert said.startswith("To 1 % of l")
    cost = json.loads((place / "result.json").read_text())["cost"]
    rows = {(row["model"], row["size"]): row for row in cost["rows"]}
    assert {name for name, _ in rows} == {"sadowsky", "finite", RICHEST}
    assert set(cost["left_out"]) == {"elastica", "tape", "kirchhoff"}  # not planar, no curved section, no rulings
    own = cost["reference"]["error"]
    assert rows[RICHEST, "20 x 2"]["error"] == pytest.approx(own, rel=1e-6)  # distance to itself, and its own error
    assert own < rows["finite", "10"]["error"] < rows["sadowsky", "10"]["error"]
    assert all(row["seconds"] > 0.0 for row in cost["rows"])
    found = read_page(place)
    assert (place / found.pictures[0].file).stat().st_size > 5000
    # again: shells come from the store
    kept = []
    solve = ShellModel.solve

    def seen(self, *arguments, **keywords) -> State:
        kept.append(solve(self, *arguments, **keywords))
        return kept[-1]

    monkeypatch.setattr(ShellModel, "solve", seen)
    measure_models(
        load("curl_4_3").replace({"strip.natural_curvature": 3.0}), 20.0, place / "cases", Reporter(quiet=True)
    )
    assert all(state.reused for state in kept)


def test_options_of_the_whole_measurement_ask_for_it(tmp_path, monkeypatch):
    """With any of them, as before; with none, the short answer."""
    asked = []
    monkeypatch.setattr(cost_models, "measure_models", lambda *_: asked.append(True) or pytest.fail("asked"))
    arguments = ["cost", "cantilever", "--solvers", "chained", "--segments", "2", "3", "--reference", "own"]
    assert main([*arguments, "--repeats", "1", "--out", str(tmp_path), "--quiet"]) == DONE
    assert not asked
    assert Options().repeats == 0
