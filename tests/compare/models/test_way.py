"""A scene's path: stages one after another, a log of every step, an interrupted run that goes on."""

from __future__ import annotations

import csv
import dataclasses
import io
from dataclasses import replace

import numpy as np
import pytest

from compare.models import solve as solve_scene
from compare.models.base import Options
from compare.models.ribbon import stages
from compare.models.ribbon.build import ribbon_arguments
from compare.models.ribbon.stages import COLUMNS, STATE_FILE, run_key, run_way
from compare.page.csv import as_csv
from compare.pages.result import state_result
from compare.pages.ribbon import path_table
from compare.scene.scene import loads
from ribbon import Equilibrium, Status, solve
from ribbonbench.errors import BadInput
from tests.compare.scene import held_scenes


class Stopped(Exception):
    """What interrupts a run here."""


@pytest.fixture(scope="module")
def scene():
    return loads(held_scenes.PATH)


@pytest.fixture(scope="module")
def whole(scene):
    return run_way(scene)


def interrupted(scene, folder, after):
    """A run that is stopped after so many accepted steps; returns how many it took."""
    taken = []

    def stop(entry):
        taken.append(entry)
        if len(taken) == after:
            raise Stopped

    with pytest.raises(Stopped):
        run_way(scene, folder, on_step=stop)
    return len(taken)


def test_the_way_ends_at_the_scene(scene, whole):
    e = whole.equilibrium
    assert e.ok
    assert e.residual < 1e-8
    assert e.end.position == pytest.approx([0.6, 0.0, 0.1], abs=1e-10)
    assert e.energy.gravity > 1.0
    direct = solve(**{**ribbon_arguments(scene), "formulation": "mixed", "seed_curvature": (-8.0, 8.0, 8.0, -8.0)})
    assert direct.ok
    assert e.energy.total == pytest.approx(direct.energy.total, rel=1e-8)


def test_the_log_has_every_step_of_every_stage(whole):
    log = whole.equilibrium.log
    assert whole.stages == 3
    assert whole.solved == len(log)
    assert not whole.resumed
    assert [entry["stage"] for entry in log] == sorted(entry["stage"] for entry in log)
    accepted = [entry for entry in log if entry["accepted"]]
    for stage in (1, 2, 3):
        assert [entry["t"] for entry in accepted if entry["stage"] == stage][-1] == 1.0
    assert [entry["t"] for entry in accepted if entry["stage"] == 2] == pytest.approx([1 / 3, 2 / 3, 1.0])
    assert accepted[-1]["energy"] == pytest.approx(whole.equilibrium.energy.total, rel=1e-12)
    more = {"moved", "forces", "moments"}
    assert all(set(entry) == set(COLUMNS) | (more if entry["accepted"] else set()) for entry in log)


def test_the_log_as_csv(scene, whole):
    rows = list(csv.DictReader(io.StringIO(as_csv(path_table(whole.equilibrium.log, scene)))))
    assert len(rows) == len(whole.equilibrium.log)
    assert tuple(rows[0])[: len(COLUMNS)] == COLUMNS
    assert [float(row["energy"]) for row in rows] == [entry["energy"] for entry in whole.equilibrium.log]
    assert {row["accepted"] for row in rows} <= {"true", "false"}
    assert as_csv(path_table([{"stage": 1, "t": 1.0, "jump": None}], scene)).splitlines()[1] == "1,1.0" + "," * (
        len(COLUMNS) - 2
    )


@pytest.mark.parametrize("after", [1, 2, 5])
def test_an_interrupted_run_goes_on_where_it_was(scene, whole, tmp_path, after):
    taken = interrupted(scene, tmp_path, after)
    assert (tmp_path / STATE_FILE).exists()
    again = run_way(scene, tmp_path)
    assert again.resumed
    assert again.solved <= whole.solved - taken + 2  # the size of the steps starts afresh
    assert again.solved < whole.solved
    assert [entry["stage"] for entry in again.equilibrium.log[:taken]] == [
        entry["stage"] for entry in whole.equilibrium.log[:taken]
    ]
    assert again.equilibrium.ok
    assert again.equilibrium.energy.total == pytest.approx(whole.equilibrium.energy.total, rel=1e-10)
    assert np.abs(again.equilibrium.position([0.3, 0.6]) - whole.equilibrium.position([0.3, 0.6])).max() < 1e-7
    assert not (tmp_path / STATE_FILE).exists(), "a finished way leaves nothing behind"


def test_a_state_that_is_found_again_is_the_one_that_was_kept(scene, whole, tmp_path):
    """Interrupted at its very end a way has nothing left to do: all that is known of its state comes from the file."""
    interrupted(scene, tmp_path, sum(entry["accepted"] for entry in whole.equilibrium.log))
    again = run_way(scene, tmp_path)
    assert (again.resumed, again.solved) == (True, 0)
    for field in dataclasses.fields(Equilibrium):
        ours, kept = (getattr(path.equilibrium, field.name) for path in (whole, again))
        if field.name not in ("problem", "seconds", "log", "evaluations"):  # what differs from run to run
            assert np.array_equal(ours, kept) if isinstance(ours, np.ndarray) else repr(ours) == repr(kept), field.name


def test_a_state_of_another_scene_or_a_broken_one_is_not_used(scene, whole, tmp_path):
    interrupted(scene, tmp_path, 3)
    heavier = scene.replace({"strip.gamma": 11.0})
    assert run_key(heavier, False) != run_key(scene, False) != run_key(scene, True)
    assert not run_way(heavier, tmp_path).resumed
    interrupted(scene, tmp_path, 3)
    (tmp_path / STATE_FILE).write_bytes((tmp_path / STATE_FILE).read_bytes()[:200])
    again = run_way(scene, tmp_path)
    assert not again.resumed
    assert again.solved == whole.solved


def test_without_a_folder_nothing_is_written(scene, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run_way(scene).equilibrium.ok
    assert list(tmp_path.iterdir()) == []


def test_a_stage_that_fails_stops_the_way_with_its_log(scene, monkeypatch):
    def failing(problem_at, start, **keywords):
        return replace(start, status=Status.INFEASIBLE, stable=None, message="the way stopped at t = 0", log=())

    monkeypatch.setattr(stages, "follow", failing)
    found = run_way(scene).equilibrium
    assert found.status is Status.INFEASIBLE
    assert found.message.startswith("stage 2 of 3: ")
    assert len(found.log) == 1


def test_what_switches_and_varies_switches_first():
    """A wall and other segments on a leg on which the end moves too: first at t = 0, then the steps."""
    wall = '[[wall]]\nname = "floor"\npoint = [0.0, 0.0, -0.02]\nnormal = [0.0, 0.0, 1.0]\n'
    text = held_scenes.PATH.replace("[model]", f"{wall}[model]").replace("gravity = false\n", '"model.elements" = 8\n')
    found = run_way(loads(text)).equilibrium
    assert found.ok
    assert found.problem.lengths.size == 10, "the last stage is the scene itself"
    legs = {stage: [entry["t"] for entry in found.log if entry["stage"] == stage] for stage in (1, 2, 3)}
    assert legs[1] == [1.0]
    assert legs[2][0] > 0.0, "nothing switches between the first two stages"
    assert legs[3][0] == 0.0
    assert legs[3][-1] == 1.0


def test_an_impossible_way_is_refused_before_anything_is_solved(scene):
    def never(entry):
        raise AssertionError

    turned = scene.replace({"path": [{"clamp.end.tangent": [-1.0, 0.0, 0.0], "clamp.end.position": [0.3, 0.0, 0.0]}]})
    with pytest.raises(BadInput, match="half turn"):
        run_way(turned, on_step=never)


def test_a_solve_takes_the_path(scene, whole):
    run = solve_scene(scene, "ribbon", options=Options(repeats=1))
    assert state_result(scene, run)["path"]["stages"] == 3
    assert run.native.energy.total == pytest.approx(whole.equilibrium.energy.total, rel=1e-10)
    assert len(run.seconds.repeats) == 1


def test_the_film_of_a_way_that_was_interrupted_is_whole(scene, tmp_path):
    """States along the way: the last is the scene's own surface; a run that goes on has those of the first part too."""
    found = run_way(scene, film=True)
    states, e = found.states, found.equilibrium
    grid = np.column_stack([x.ravel() for x in np.meshgrid(states.s, states.v, indexing="ij")])
    assert np.abs(states.points[-1].reshape(-1, 3) - e.rulings(grid)[1]).max() < 1e-6
    accepted = [(entry["stage"], entry["t"]) for entry in e.log if entry["accepted"]]
    assert list(zip(states.stage, states.t, strict=True)) == accepted
    assert np.linalg.norm(np.diff(states.points, axis=0), axis=3).max(axis=(1, 2)).min() > 0.0
    taken = []

    def stop(entry):
        taken.append(entry)
        if len(taken) == 3:
            raise Stopped

    with pytest.raises(Stopped):
        run_way(scene, tmp_path, on_step=stop, film=True)
    again = run_way(scene, tmp_path, film=True)
    assert again.resumed
    assert len(again.states.t) == len(states.t)
    assert again.states.points == pytest.approx(states.points, abs=1e-5)
    assert run_way(scene).states is None
