"""What is loaded before the answer, counted in modules and not in seconds; threads; the command in strange folders."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

#: The command of argv[1:]; on stdout the modules that are loaded when the answer is there, and what stands in --out.
SCRIPT = """
import json, os, sys
import compare.pages.solve as pages
def write(out, *rest, **more):
    seen = {"modules": sorted(sys.modules), "files": sorted(os.listdir(out))}
    print(json.dumps({**seen, "threads": os.environ.get("OMP_NUM_THREADS")}))
    return whole(out, *rest, **more)
whole, pages.write = pages.write, write
from compare.cli import main
sys.exit(main(sys.argv[1:]))
"""
#: What a ribbon's answer needs none of: pictures, VTK, files of meshes, the references, half of scipy.
HEAVY = (
    "matplotlib", "mpl_toolkits", "vtkmodules", "vtk", "pyvista", "meshio", "skfem", "dolfinx", "scipy.optimize",
    "scipy.stats", "scipy.integrate", "scipy.interpolate", "scipy.signal", "numba.typed.typedobjectutils", "shellref",
    "compare.models.shell_build", "compare.studies.branches.measured", "urllib.request",
)  # fmt: skip


def command(*words: object, script: str = SCRIPT, **more: object) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    words = (sys.executable, "-c", script, *map(str, words))
    given = {"capture_output": True, "text": True, "check": False, "env": environment, **more}
    return subprocess.run(words, **given)  # type: ignore[call-overload, no-any-return]


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """What stood in the second of two runs when the answer was there: the first one compiles what is missing."""
    out = tmp_path_factory.mktemp("out")
    for _ in range(2):
        done = command("solve", "coil_10_100", "--set", "model.elements=6", "--out", out, "--quiet")
        assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_answer_loads_no_pictures_and_no_meshes(seen):
    loaded = [name for name in seen["modules"] if name in HEAVY]
    assert not loaded
    assert "numba" in seen["modules"]  # the ribbon was solved here


@pytest.mark.parametrize("words", [("--help",), ("new", "--help"), ("--version",)])
def test_help_loads_no_scene_and_no_numbers(words):
    script = """
import sys
from compare.cli import main
try:
    code = main(sys.argv[1:])
except SystemExit as stop:
    code = stop.code
print(code or 0, sorted({"numpy", "numba", "scipy"} & sys.modules.keys()), file=sys.stderr)
"""
    done = command(*words, script=script)
    numbers = [] if words[0] != "new" else ["numpy"]  # it names materials, which stand in the room of scenes
    assert done.stderr.splitlines()[-1] == f"0 {numbers}"


def test_the_command_uses_one_thread(seen):
    assert seen["threads"] == "1"


def test_threads_that_the_user_has_set_stay(tmp_path):
    environment = {**os.environ, "OMP_NUM_THREADS": "2"}
    done = command("solve", "coil_10_100", "--set", "model.elements=6", "--out", tmp_path, "--quiet", env=environment)
    assert json.loads(done.stdout)["threads"] == "2"


def test_the_answer_is_said_before_any_file_of_it_is_made(tmp_path):
    done = command("solve", "coil_10_100", "--set", "model.elements=6", "--out", tmp_path / "o")
    (told,) = [number for number, line in enumerate(done.stdout.splitlines()) if line.startswith('{"modules')]
    assert told > 5  # the answer's lines stand before it
    assert "ribbon.npz" not in json.loads(done.stdout.splitlines()[told])["files"]
    assert (tmp_path / "o" / "ribbon.npz").is_file()


@pytest.mark.parametrize(("words", "repeated"), [((), False), (("--time",), True)])
def test_a_solve_is_repeated_only_when_its_time_is_asked_for(tmp_path, words, repeated):
    script = """
import sys
import ribbon
solves = []
def solve(*rest, **more):
    solves.append(1)
    return whole(*rest, **more)
whole, ribbon.solve = ribbon.solve, solve
from compare.cli import main
code = main(sys.argv[1:])
print(len(solves))
sys.exit(code)
"""
    given = ("solve", "coil_10_100", "--set", "model.elements=6", "--out", tmp_path, "--quiet", *words)
    done = command(*given, script=script)
    assert done.returncode == 0, done.stderr
    assert (int(done.stdout) > 1) is repeated
    seconds = json.loads((tmp_path / "result.json").read_text())["seconds"]
    assert (seconds["warm"] == seconds["first"]) is not repeated


@pytest.mark.parametrize(
    "words", [("-m", "ribbonbench"), ("-c", "import sys, ribbonbench; sys.exit(ribbonbench.main())")]
)
def test_folders_of_the_same_names_do_no_harm(tmp_path, words):
    """A user's own packages in the current folder, whatever is in them. (`-P -c`: as the installed command.)"""
    for name in ("compare", "ribbon", "shellref", "scipy"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise RuntimeError('the user\\'s own')\n")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    safe = () if words[0] == "-m" else ("-P",)
    rest = ("solve", "coil_10_100", "--set", "model.elements=6", "--quiet")
    done = subprocess.run(
        [sys.executable, *safe, *words, *rest],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env=environment,
    )
    assert (done.returncode, done.stderr) == (0, "")


#: A command that leaves work behind for its end: an exit handler, a thread, words in Python's and in C's buffers, an
#: object that says when it is let go.
LEAVING = """
import atexit, ctypes, os, sys, threading, time
{before}
class Kept:
    def __del__(self):
        self.write(1, b" taken ")
    write = staticmethod(os.write)
kept = Kept()
def slow():
    time.sleep(0.2)
    sys.stdout.write("thread ")
def run():
    threading.Thread(target=slow).start()
    atexit.register(lambda: sys.stdout.write("handler "))
    ctypes.CDLL(None).printf(b"c ")
    return 7
from ribbonbench import start
start.command(run)
"""


@pytest.mark.parametrize(
    ("before", "apart"),
    [("", False), ("sys.setprofile(lambda *_: None)", True), ("sys.modules['mpi4py.MPI'] = sys", True)],
)
def test_a_command_ends_at_once_but_with_all_that_its_end_owes(before, apart):
    """Threads are waited for, handlers called, buffers written; whoever looks on, and MPI, get an end as usual."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    words = [sys.executable, "-c", LEAVING.format(before=before)]
    done = subprocess.run(words, capture_output=True, text=True, check=False, env=environment)
    assert (done.returncode, done.stderr) == (7, "")
    said = done.stdout.split()
    assert said.index("thread") < said.index("handler")
    assert "c" in said
    assert ("taken" in said) is apart


def test_a_reader_that_is_gone_is_told_of_as_before():
    """Nobody reads stdout any more: Python's own code for it (120), not that of the command."""
    script = "import sys; from ribbonbench import start; sys.stdout.write('x'); start.command(lambda: 0)"
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [sys.executable, "-c", script], stdout=write, stderr=subprocess.PIPE, text=True, check=False, env=environment
    )
    os.close(write)
    assert done.returncode == 120, done.stderr


#: A picture in a command, or beside other work: whether properties are set, and whether a class can be asked for them.
DRAWING = """
import io, sys
from compare.page.drawing import pictured
from ribbonbench import start
def draw():
    from matplotlib.figure import Figure
    figure = Figure()
    (line,) = figure.add_subplot().plot([0, 1])
    line.set(linewidth=7.0)
    figure.savefig(io.BytesIO())
    print(line.get_linewidth(), "linestyle" in (type(line).set.__doc__ or ""))
def run():
    pictured(draw)
    return 0
"""


@pytest.mark.parametrize(("ends", "told"), [("start.command(run)", "False"), ("run()", "True")])
def test_a_command_makes_no_help_for_its_picture(ends, told):
    done = subprocess.run(
        [sys.executable, "-c", DRAWING + ends], capture_output=True, text=True, check=False, env={**os.environ}
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.split() == ["7.0", told]
