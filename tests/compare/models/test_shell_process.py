"""The shell's process as compare uses it: checkpoints that survive a kill, one worker a case, starts."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from compare.models import solve as solve_scene
from compare.models.ribbon.state import RibbonShape
from compare.models.shell import START, starting_surface
from compare.models.shell_build import shell_problem
from compare.models.shell_process import ShellCase, event_text, run_shell, shell_key
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.store.store import CaseStore, case_key
from compare.studies.compare import compare
from shellref.path.begin import PATH_AGAIN
from shellref.shell.options import ShellOptions
from shellref.shell.surface import ShellSurface
from tests.patience import PATIENCE

SMALL = {"shell.width_to_thickness": [50], "shell.elements": [12, 2]}
KEY = case_key("a case")


# -- the store's unfinished cases -------------------------------------------------------------------------------------


def stopped(store, key, work):
    """The folder of a case on which `work` was done before it stopped."""
    folders = []

    def case():
        with store.unfinished(key) as kept:
            folders.append(kept.folder)
            work(kept)
            raise RuntimeError("stopped")

    with pytest.raises(RuntimeError, match="stopped"):
        case()
    return folders[0]


def leave(kept):
    """A checkpoint."""
    (kept.folder / "checkpoint").write_text("half way")


def test_an_unfinished_case_keeps_its_folder_until_it_is_finished(tmp_path):
    store = CaseStore(tmp_path)
    folder = stopped(store, KEY, leave)
    assert (folder / "checkpoint").read_text() == "half way"
    with store.unfinished(KEY) as again:
        assert again.folder == folder
        assert (again.folder / "checkpoint").exists()
    assert not folder.exists()


def test_an_unfinished_case_with_nothing_in_it_is_not_kept(tmp_path):
    assert not stopped(CaseStore(tmp_path), KEY, lambda kept: None).exists()


def test_one_at_a_time_works_on_a_case(tmp_path):
    """Eight threads, each with a lock of its own: never two inside, and whoever waits says so. The first stays until
    all others wait."""
    inside, most, waited = [], [], []
    others_wait = threading.Event()

    def wait(number):
        waited.append(number)
        if len(waited) == 7:
            others_wait.set()

    def work(number):
        with CaseStore(tmp_path).unfinished(KEY, lambda: wait(number)):
            inside.append(number)
            most.append(len(inside))
            assert others_wait.wait(PATIENCE)
            inside.remove(number)

    threads = [threading.Thread(target=work, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=PATIENCE)
    assert most == [1] * 8
    assert len(set(waited)) == len(waited) == 7


def test_a_child_that_inherits_the_lock_holds_the_case(tmp_path):
    """As a worker does whose compare was killed."""
    store = CaseStore(tmp_path)
    children, waited = [], []

    def work(kept):
        leave(kept)
        child = [sys.executable, "-c", "input()"]
        children.append(subprocess.Popen(child, stdin=subprocess.PIPE, pass_fds=(kept.lock,)))

    def release():
        waited.append(children[0].poll())
        children[0].communicate(b"\n")

    stopped(store, KEY, work)
    with store.unfinished(KEY, release):
        assert waited == [None]
        assert children[0].poll() == 0


def test_leftovers_nobody_went_on_with_are_removed_after_a_week(tmp_path):
    store = CaseStore(tmp_path)
    for age, name in ((8, KEY), (6, case_key("another"))):
        os.utime(stopped(store, name, leave), (time.time() - age * 86400,) * 2)
    store.put(case_key("third"), lambda folder: (folder / "x").touch())
    assert [path.name for path in (tmp_path / ".unfinished").iterdir()] == [case_key("another")]


# -- starts -----------------------------------------------------------------------------------------------------------


def test_the_ribbons_surface_at_the_shells_nodes():
    """At a mesh of equal elements these are the points of the ribbon's own surface; the director is its normal."""
    scene = load("shift_7_2").replace({"shell.width_to_thickness": 50, "shell.grading": [1.0, 1.0], "path": None})
    scene = scene.replace({"clamp.end.position": [0.5, 0.01, 0.0], "model.elements": 20})
    e = solve_scene(scene, "ribbon").native
    surface = starting_surface(RibbonShape(e), shell_problem(scene, 50.0, (30, 4), way=False))
    assert np.abs(surface.points - e.surface(60, 8).grid).max() < 1e-12
    assert np.linalg.norm(surface.directors, axis=-1) == pytest.approx(1.0)
    along = np.gradient(surface.points, surface.s_nodes, axis=0)
    across = np.gradient(surface.points, surface.v_nodes, axis=1)
    normal = np.cross(along, across)[1:-1]
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    assert np.abs(normal - surface.directors[1:-1]).max() < 0.05
    assert surface.directors[0] == pytest.approx(np.broadcast_to([0.0, 0.0, 1.0], (9, 3)))


def test_a_start_is_part_of_a_cases_key_but_not_its_last_digits():
    problem = shell_problem(load("curl_4_3"), 50.0, (4, 1))
    s, v = np.linspace(0, 1, 9), np.linspace(-0.015, 0.015, 3)
    points = np.random.default_rng(0).standard_normal((9, 3, 3)).round(3)
    surface = ShellSurface(s, v, points, points / np.linalg.norm(points, axis=-1, keepdims=True).round(2))
    near = ShellSurface(s, v, points + 1e-9, surface.directors)
    far = ShellSurface(s, v, points + 1e-4, surface.directors)
    plain = shell_key(problem, ShellOptions())
    given = shell_key(problem, ShellOptions(), surface)
    assert shell_key(problem, ShellOptions(), near) == given
    assert len({plain, given, shell_key(problem, ShellOptions(), far)}) == 3


def flat(width):
    """A flat strip as a shell's surface."""
    s, v = np.linspace(0, 1, 5), np.linspace(-0.5, 0.5, 3) * width
    points = np.stack(np.broadcast_arrays(v, 0.0, s[:, None]), axis=-1)
    return ShellSurface(s, v, points, np.broadcast_to([0.0, 1.0, 0.0], points.shape).copy())


@pytest.mark.parametrize(
    ("name", "start", "believed", "coarse"),
    [
        ("shift_7_2", "auto", "given", False),
        ("shift_7_2", "path", None, False),
        ("curl_4_3", "auto", "checked", True),
        ("curl_4_3", "ribbon", "stable", True),
        ("curl_4_3", "coarse", None, True),
        ("curl_4_3", "path", None, False),
    ],
)
def test_compare_begins_at_the_ribbon_and_believes_it_where_it_selects(
    tmp_path, monkeypatch, name, start, believed, coarse
):
    """And the other mesh, for the error, at the state of the first: both are on one branch, unless the path is asked
    for."""
    requested = []

    def fake(problem, store, options=None, progress=None, start=None):
        requested.append((problem.elements, options, start))
        surface = start or flat(problem.width)
        folder = tmp_path / f"{len(requested)}"
        folder.mkdir()
        surface.save(folder / "shell.npz")
        data = {"status": "converged", "stable": True, "seconds": {"total": 1.0}, "start": "given" if start else "path"}
        return ShellCase(data, folder, False)

    monkeypatch.setattr("compare.models.shell.run_shell", fake)
    scene = load(name).replace({**SMALL, "model.elements": 20, "shell.start": start})
    found = compare(scene, CaseStore(tmp_path / "cases"), Reporter(quiet=True))
    (fine, first, surface), (check, second, again) = requested
    assert (fine, check) == ((12, 2), (24, 4))
    assert (first.begin if surface is not None else None) == believed
    assert first.coarse is coarse
    assert (again is None) == (start == "path")
    assert second.begin == "given"
    assert found.rows[0].start == ("ribbon" if believed else "path")
    if believed:
        assert found.rows[0].hausdorff < 5e-2  # the stand-in is the ribbon itself, biquadratic on twelve elements
        assert again.points.shape == surface.points.shape


def test_a_tolerance_brings_its_own_estimate(tmp_path, monkeypatch):
    requested = []

    def fake(problem, store, options=None, progress=None, start=None):
        requested.append(options.accuracy)
        start.save(tmp_path / "shell.npz")
        mesh = {"accuracy": 1e-3, "reached": True, "estimate": 4e-4, "meshes": []}
        data = {"status": "converged", "stable": True, "seconds": {}, "discretisation": mesh, "start": "given"}
        return ShellCase(data, tmp_path, False)

    monkeypatch.setattr("compare.models.shell.run_shell", fake)
    scene = load("shift_7_2").replace({**SMALL, "shell.tolerance": 1e-3, "model.elements": 20})
    found = compare(scene, CaseStore(tmp_path / "cases"), Reporter(quiet=True))
    assert requested == [1e-3]
    assert found.rows[0].shell_error == 4e-4


def test_every_word_of_the_worker_about_its_start_is_known():
    assert set(START) == {
        "path", "coarse path", "given", "given, as the coarse path", "given, by way of thicker strips",
        *PATH_AGAIN.values(),
    }  # fmt: skip


def test_progress_names_the_stage():
    step = {"event": "step", "stage": "path 2", "load": 0.25, "iterations": 4, "accepted": True, "method": "load"}
    assert event_text(step) == "path 2 25%, 4 it"
    assert event_text({**step, "accepted": False, "method": "arc"}) == "path 2 (arc) 25%, 4 it, cut back"
    assert "2 x 3" in event_text({"event": "mesh", "elements": [2, 3], "estimate": 1e-3})
    assert event_text({"event": "thinner", "width_to_thickness": 500.0}) == "settles at w/h = 500"
    assert event_text({}) is None


# -- with the shell ---------------------------------------------------------------------------------------------------

COMPARE = """
import sys
from compare.cli import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.shell
def test_a_killed_compare_goes_on_from_its_checkpoint(tmp_path):
    """Killed with its worker at work: the worker ends at its next word, and the same command keeps the steps made."""
    pytest.importorskip("dolfinx")
    arguments = ["compare", "curl_4_3", "--out", str(tmp_path), "--quiet", "--set", "shell.width_to_thickness=50",
                 "--set", "shell.elements=[30, 2]"]  # fmt: skip
    command = [sys.executable, "-c", COMPARE, *arguments]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    process = subprocess.Popen(command, env=environment)
    kept = tmp_path / "cases" / ".unfinished"
    logs: list = []
    while process.poll() is None:
        logs = [path for path in kept.glob("*/path/steps.jsonl") if path.read_text().count("\n") >= 2]
        if logs and (logs[0].parent / "checkpoint.npz").exists():
            break
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    assert process.wait(timeout=PATIENCE) == -signal.SIGKILL
    assert logs, "the shell was never at work"
    first = json.loads(logs[0].read_text().splitlines()[0])
    assert subprocess.run(command, env=environment, check=False).returncode == 0
    key = logs[0].parent.parent.name
    data = json.loads((tmp_path / "cases" / key / "shell.json").read_text())
    assert data["steps"][0] == first
    assert data["newton_iterations"] == sum(step["iterations"] for step in data["steps"])
    assert list(kept.iterdir()) == []
    row = json.loads((tmp_path / "result.json").read_text())["rows"][0]
    assert row["status"] == "converged"
    assert row["start"] == "path"


@pytest.mark.shell
def test_two_runs_of_one_case_make_it_once(tmp_path):
    pytest.importorskip("dolfinx")
    problem = shell_problem(load("curl_4_3"), 50.0, (12, 1))
    found, said = [], []

    def work():
        found.append(run_shell(problem, CaseStore(tmp_path), ShellOptions(), said.append))

    threads = [threading.Thread(target=work) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=PATIENCE)
    assert sorted(case.reused for case in found) == [False, True]
    assert found[0].data == found[1].data
    assert "another run works on this case: waiting for it" in said
