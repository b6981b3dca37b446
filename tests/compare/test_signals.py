"""Ctrl-C and SIGTERM at any moment: one line, the exit code of the signal, and no process left behind.

The signal is sent by the process to itself when it comes to a certain point, so that no test waits for a moment.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from compare.sweep.case import Task
from tests.patience import PATIENCE

ROOT = Path(__file__).resolve().parents[2]

#: The command of argv[3:], which gets the signal argv[1] when the import of the module argv[2] begins.
AT_IMPORT = """
import os, sys
from importlib.abc import MetaPathFinder
number, module = sys.argv[1:3]
sys.argv = ["ribbonbench", *sys.argv[3:]]
class Sender(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name == module:
            os.kill(os.getpid(), int(number))
sys.meta_path.insert(0, Sender())
import ribbonbench
sys.exit(ribbonbench.main())
"""
#: The command of argv[3:], which gets the signal argv[1] in the middle of the function argv[2] ("module:name").
AT_CALL = """
import importlib, os, sys
number, place = sys.argv[1:3]
sys.argv = ["ribbonbench", *sys.argv[3:]]
module, name = place.split(":")
def sent(*rest, **more):
    os.kill(os.getpid(), int(number))
    return whole(*rest, **more)
found = importlib.import_module(module)
whole = getattr(found, name)
setattr(found, name, sent)
import ribbonbench
sys.exit(ribbonbench.main())
"""
#: The command of argv[3:], which gets the signal argv[1] while a kernel's code is loaded, in a call back of LLVM's.
AT_KERNEL = """
import os, sys
number = int(sys.argv[1])
sys.argv = ["ribbonbench", *sys.argv[3:]]
import numba.core.codegen
class Library(numba.core.codegen.JITCodeLibrary):
    sent = False
    @classmethod
    def _object_getbuffer_hook(cls, module):
        code = super()._object_getbuffer_hook(module)
        if code is not None and not Library.sent:
            Library.sent = True
            os.kill(os.getpid(), number)
        return code
numba.core.codegen.JITCPUCodegen._library_class = Library
import ribbonbench
sys.exit(ribbonbench.main())
"""
#: The command of argv[3:], which gets the signal argv[1] when the file that proves a folder writable is taken away.
AT_PROBE = """
import os, sys, tempfile
number = int(sys.argv[1])
sys.argv = ["ribbonbench", *sys.argv[3:]]
made = tempfile.NamedTemporaryFile
class Probe:
    def __init__(self, **more):
        self.file = made(**more)
    def __enter__(self):
        return self.file
    def __exit__(self, *what):
        os.unlink(self.file.name)
        try:
            os.kill(os.getpid(), number)
        finally:
            self.file.close()
tempfile.NamedTemporaryFile = Probe
import ribbonbench
sys.exit(ribbonbench.main())
"""
SMALL = ("--set", "model.elements=6", "--quiet")


def signalled(script: str, number: int, point: str, *words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", script, str(int(number)), point, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)


def ended_well(done: subprocess.CompletedProcess[str], number: int) -> None:
    """The exit code of the signal, and one line."""
    assert done.returncode == 128 + number, done.stderr
    assert done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith("ribbonbench: "), done.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    "module", ["compare.cli", "numpy", "numba.core.caching", "scipy.linalg", "compare.pages.solve"]
)
def test_while_a_module_is_imported(tmp_path, number, module):
    ended_well(signalled(AT_IMPORT, number, module, "solve", "coil_10_100", "--out", tmp_path, *SMALL), number)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    "place", ["compare.commands.common:scene_of", "ribbon.solvers.newton:minimise", "compare.pages.solve:write"]
)
def test_while_it_works(tmp_path, number, place):
    ended_well(signalled(AT_CALL, number, place, "solve", "coil_10_100", "--out", tmp_path, *SMALL), number)
    assert not [path for path in tmp_path.rglob("*") if path.name.endswith(".tmp")]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("script", [AT_KERNEL, AT_PROBE], ids=["a kernel's code", "a clean-up"])
def test_where_an_exception_is_lost_or_becomes_another(tmp_path, script, number):
    ended_well(signalled(script, number, "-", "solve", "coil_10_100", "--out", tmp_path, *SMALL), number)


def test_a_signal_that_no_exception_can_pass_is_not_lost():
    """Raised in the callback of a weak reference, where Python drops exceptions."""
    script = """
import os, signal, sys, time, weakref
from ribbonbench import start
class Thing: pass
def command():
    thing = Thing()
    seen = weakref.ref(thing, lambda _: os.kill(os.getpid(), signal.SIGTERM))
    del thing
    time.sleep(600)
    return 0
sys.exit(start.run(command))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False, cwd=ROOT)
    ended_well(done, signal.SIGTERM)


def test_nohup_stays_nohup():
    script = "import os, signal, sys\nfrom ribbonbench import start\n" + (
        "signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
        "sys.exit(start.run(lambda: os.kill(os.getpid(), signal.SIGINT) or 7))\n"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False, cwd=ROOT).returncode == 7


# -- processes that work for another one ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Endless(Task):
    """A case that never ends; `folder` is where its worker's number is written when it has begun."""

    @property
    def path(self) -> None:
        return None

    def __getattribute__(self, name: str) -> object:
        if name == "solver":
            place = Path(object.__getattribute__(self, "folder"))
            (place / "new").write_text(str(os.getpid()))
            (place / "new").rename(place / "worker")
            time.sleep(PATIENCE)
        return object.__getattribute__(self, name)


#: A master whose worker has a case that never ends.
MASTER = """
import sys
from compare.sweep.workers import Cases, Worker
from tests.compare.test_signals import Endless
if __name__ == "__main__":
    worker = Worker()
    worker.give(Cases((0,), (Endless("key", None, "ribbon", False, False, sys.argv[1]),)))
    worker.take()
"""
#: A process that runs a module for as long as it lives itself.
PARENT = """
import os, subprocess, sys
environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
words = [sys.executable, "-m", "ribbonbench.start", str(os.getpid()), "waits", sys.argv[1]]
subprocess.Popen(words, env=environment).wait()
"""
WAITS = """
import os, sys, time
from pathlib import Path
Path(sys.argv[1], "new").write_text(str(os.getpid()))
Path(sys.argv[1], "new").rename(Path(sys.argv[1], "worker"))
time.sleep(1800)
"""


def alive(pid: int) -> bool:
    """Whether the process runs (one that has ended and that nobody asked for does not)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def comes(seen) -> bool:
    """Waits until it is so."""
    end = time.monotonic() + PATIENCE
    while not seen() and time.monotonic() < end:
        time.sleep(0.02)
    return seen()


@pytest.mark.parametrize("script", [MASTER, PARENT])
def test_whoever_works_for_a_killed_process_ends_with_it(tmp_path, script):
    (tmp_path / "waits.py").write_text(WAITS)
    (tmp_path / "script.py").write_text(script)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(tmp_path)])}
    parent = subprocess.Popen([sys.executable, str(tmp_path / "script.py"), str(tmp_path)], env=environment)
    try:
        assert comes(lambda: (tmp_path / "worker").is_file() or parent.poll() is not None)
        worker = int((tmp_path / "worker").read_text())
        assert alive(worker)
    finally:
        parent.kill()
        parent.wait()
    assert comes(lambda: not alive(worker))


def test_a_reader_that_has_read_enough_stops_no_writing(tmp_path):
    """`solve ... 2>&1 | head -1`: the answer's first line is read, and the files are there all the same."""
    words = f"{sys.executable} -m compare.cli solve coil_10_100 --set model.elements=6 --out {tmp_path / 'o'}"
    done = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {words} 2>&1 | head -1"], capture_output=True, text=True, check=False
    )
    assert done.stdout.count("\n") == 1
    assert {"result.json", "page.json", "ribbon.vtu"} <= {path.name for path in (tmp_path / "o").iterdir()}
    assert done.returncode == 0


#: The command of argv[2:] whose minimiser never ends, with nothing refused for its size, and which gets the signal
#: argv[1] from a thread while it is in a kernel.
IN_A_KERNEL = """
import os, sys, threading
number = int(sys.argv[1])
sys.argv = ["ribbonbench", *sys.argv[2:]]
import compare.scene.scene, ribbon.find.solving.check
from ribbon.solvers import newton
for module, name in ((compare.scene.scene, "check_known"), (ribbon.find.solving.check, "check_known")):
    setattr(module, name, lambda found: None)
whole = newton.minimise
def endless(*rest, **more):
    threading.Timer(1.0, os.kill, (os.getpid(), number)).start()
    while True:
        whole(*rest, **more)
newton.minimise = endless
import ribbonbench
sys.exit(ribbonbench.main())
"""
#: Seconds in which a kernel comes back, however busy the machine: a call is some 0.5 s, and was 9 to 18 minutes.
BACK = 300.0


@pytest.mark.parametrize("curl", ["9000", "90000", "1e7", "1e200"])
def test_a_kernel_comes_back_for_a_signal(curl, tmp_path):
    command = [sys.executable, "-c", IN_A_KERNEL, str(int(signal.SIGTERM)), "solve", "cantilever"]
    more = ["--set", f"strip.natural_curvature={curl}", "--set", "strip.gamma=1e6", *SMALL, "--out", str(tmp_path)]
    done = subprocess.run([*command, *more], capture_output=True, text=True, check=False, cwd=ROOT, timeout=BACK)
    assert done.returncode == 128 + signal.SIGTERM, done.stderr
    assert "ribbonbench: terminated" in done.stderr
