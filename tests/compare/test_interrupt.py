"""Ctrl-C while an archive of arrays is written: one line is said, no file is damaged, the next run goes on."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.compare.scene import held_scenes

ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}

#: The command of argv[2:], interrupted while array number argv[1] goes into an archive; every step of a shell is kept.
SCRIPT = """
import sys
from numpy.lib import format
import shellref.path.journal
from compare.cli import main
shellref.path.journal.EVERY = 0.0
whole, left = format.write_array, [int(sys.argv[1])]
def write_array(stream, *rest, **more):
    left[0] -= 1
    if left[0] == 0:
        stream.write(b"half of an array")
        raise KeyboardInterrupt
    return whole(stream, *rest, **more)
format.write_array = write_array
sys.exit(main(sys.argv[2:]))
"""


def interrupted(number: int, *arguments: object) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own, interrupted at array `number`."""
    words = [sys.executable, "-c", SCRIPT, str(number), *map(str, arguments)]
    return subprocess.run(words, capture_output=True, text=True, check=False, env=ENVIRONMENT)


def whole_files(folder: Path) -> list[str]:
    """The names of the files under `folder`, every archive among them read to its end; asserts that none is left over
    from a write that was not finished."""
    found = [path for path in folder.rglob("*") if path.is_file()]
    for path in found:
        assert not path.name.endswith(".tmp"), path
        if path.suffix == ".npz":
            with np.load(path, allow_pickle=False) as stored:
                assert all(stored[name] is not None for name in stored.files)
    return [path.name for path in found]


def said_one_line(done: subprocess.CompletedProcess[str]) -> None:
    """Asserts the exit code of an interrupted command and that its one line is all it says on stderr."""
    assert done.returncode == 130, done.stderr
    assert done.stderr.startswith("ribbonbench: interrupted"), done.stderr
    assert done.stderr.count("\n") == 1, done.stderr


@pytest.mark.shell
def test_a_checkpoint_of_the_shell(tmp_path):
    """The third checkpoint (two arrays each) is interrupted: the second one is whole, and the run goes on from it."""
    pytest.importorskip("dolfinx")
    command = ("shell", "limits_7_3", "--elements", "16", "4", "--out", tmp_path, "--quiet")
    said_one_line(interrupted(6, *command))
    assert "checkpoint.npz" in whole_files(tmp_path)
    (log,) = tmp_path.glob("cases/.unfinished/*/path/steps.jsonl")
    first = json.loads(log.read_text().splitlines()[0])
    done = interrupted(0, *command)
    assert done.returncode == 0, done.stderr
    rows = (tmp_path / "path.csv").read_text().splitlines()
    column = rows[0].split(",").index("seconds")
    assert float(rows[1].split(",")[column]) == first["seconds"], "the first step was not taken over"
    assert json.loads((tmp_path / "result.json").read_text())["status"] == "converged"
    assert "checkpoint.npz" not in whole_files(tmp_path)


#: A surface is saved twice, the second time interrupted in its fourth array.
SAVE = """
import sys
import numpy as np
from shellref.shell.surface import ShellSurface
s, v = np.linspace(0, 1, 5), np.linspace(-0.1, 0.1, 3)
points = np.stack(np.broadcast_arrays(v, 0.0, s[:, None]), axis=-1)
surface = ShellSurface(s, v, points, np.broadcast_to([0.0, 1.0, 0.0], points.shape).copy())
surface.save(sys.argv[1], energy_density=np.ones(2))
whole, left = np.lib.format.write_array, [4]
def write_array(stream, *rest, **more):
    left[0] -= 1
    if left[0] == 0:
        stream.write(b"half of an array")
        raise KeyboardInterrupt
    return whole(stream, *rest, **more)
np.lib.format.write_array = write_array
try:
    surface.save(sys.argv[1], energy_density=np.zeros(2))
except KeyboardInterrupt:
    sys.exit(130)
"""


def test_the_surface_of_a_shell(tmp_path):
    """The file keeps its old content, and nothing stands beside it."""
    path = tmp_path / "shell.npz"
    words = [sys.executable, "-c", SAVE, str(path)]
    done = subprocess.run(words, capture_output=True, text=True, check=False, env=ENVIRONMENT)
    assert (done.returncode, done.stderr) == (130, "")
    assert whole_files(tmp_path) == ["shell.npz"]
    with np.load(path) as stored:
        assert stored["energy_density"].tolist() == [1.0, 1.0]


def test_a_step_of_a_path(tmp_path):
    """The state after the second step of a path (sixteen arrays each) is interrupted: the first one's is whole."""
    scene = tmp_path / "path.toml"
    scene.write_text(held_scenes.PATH)
    command = ("solve", scene, "--out", tmp_path / "o", "--quiet")
    said_one_line(interrupted(24, *command))
    assert "path_state.npz" in whole_files(tmp_path)
    done = interrupted(0, *command)
    assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "o" / "result.json").read_text())["status"] == "converged"
    assert "path_state.npz" not in whole_files(tmp_path)


@pytest.mark.parametrize(
    ("command", "numbers"),
    [
        (("export", "coil_10_100", "--set", "model.elements=6", "--format", "npz"), (3, 20)),  # the solve's, its own
        (("cost", "cantilever", "--solvers", "chained", "--segments", "2", "3", "--repeats", "1"), (1,)),
    ],
)
def test_results_and_kept_runs(tmp_path, command, numbers):
    command = (*command, "--out", tmp_path, "--quiet")
    for number in numbers:
        said_one_line(interrupted(number, *command))
        whole_files(tmp_path)
    done = interrupted(0, *command)
    assert done.returncode == 0, done.stderr
    assert "page.json" in whole_files(tmp_path)
