"""What the operating system gives: on this one, and as on one that has nothing of POSIX or Linux."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys

import pytest

from ribbonbench import system
from ribbonbench.sources import Sources
from tests.test_setup import ROOT
from tests.waiting import comes

#: Runs a command of ours in a process from which POSIX and Linux are taken away, as far as Python can; `msvcrt` is one
#: whose locks are this system's own.
ELSEWHERE = """
import fcntl, multiprocessing.popen_spawn_posix, os, signal, subprocess, sys, types

def locking(handle, mode, count):
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise OSError(13, "Permission denied") from error

sys.modules["msvcrt"] = types.SimpleNamespace(locking=locking, LK_NBLCK=2)
for name in ("fcntl", "resource"):
    sys.modules[name] = None
for name in ("sched_getaffinity", "killpg", "O_CLOEXEC"):
    delattr(os, name)
for name in ("setitimer", "SIGALRM", "pthread_sigmask"):
    delattr(signal, name)
from ribbonbench import main, system
assert (system._fcntl, system._resource, system.TIMERS) == (None, None, False)
sys.argv = ["ribbonbench", *sys.argv[1:]]
sys.exit(main())
"""
HOLDER = """
import sys
from ribbonbench import system
file = open(sys.argv[1], "a")
system.lock(file.fileno(), wait=True)
print("has", flush=True)
input()
"""
PARENT = """
import subprocess, sys
print(subprocess.Popen([sys.executable, "-c", "input()"]).pid, flush=True)
input()
"""
SCENE = """
[strip]
length = 0.3
width = 0.009
thickness = 9e-5
poisson = 0.4
young = 4.0e9
density = 1400.0
natural_curvature = 20.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
"""


def holder(place):
    """A process that has the lock, until it ends."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER, place], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "has\n"
    return process


def test_a_lock_is_one_process_s_until_it_ends(tmp_path):
    place = tmp_path / "lock"
    other = holder(place)
    with place.open("a") as file:
        with pytest.raises(BlockingIOError):
            system.lock(file.fileno(), wait=False)
        other.kill()
        other.wait()
        system.lock(file.fileno(), wait=True)
        assert not system.alive(other.pid)
        assert system.alive(os.getpid())


def test_a_process_and_what_it_started_end_together():
    process = subprocess.Popen(
        [sys.executable, "-c", PARENT], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert process.stdout is not None
    child = int(process.stdout.readline())
    system.end_tree(process)
    process.wait()
    assert comes(lambda: not running(child))


def running(process):
    """Whether it exists and is no corpse that nobody has buried."""
    state = subprocess.run(
        ["ps", "-o", "stat=", "-p", str(process)], capture_output=True, text=True, check=False
    ).stdout
    return bool(state.strip()) and not state.strip().startswith("Z")


def test_what_there_is():
    assert 1 <= system.cores() <= (os.cpu_count() or 1)
    assert system.processor()
    words = (
        "from ribbonbench import system; before = system.peak_memory(); "
        "block = bytearray(int(1e6 * before) + 200_000_000); block[::4096] = b'x' * len(block[::4096]); "
        "print(before, system.peak_memory())"
    )
    done = subprocess.run([sys.executable, "-c", words], cwd=ROOT, capture_output=True, text=True, check=True)
    # a child begins with its parent's peak: the block is larger than that
    before, after = map(float, done.stdout.split())
    assert before + 30.0 < after < 1e5
    assert system.address_space() > 1e9


@pytest.mark.parametrize("words", [["solve", "strip.toml"], ["limits", "strip.toml", "--quick"]])
def test_commands_answer_alike_where_nothing_of_posix_is_there(tmp_path, words):
    (tmp_path / "strip.toml").write_text(SCENE)
    (tmp_path / "elsewhere.py").write_text(ELSEWHERE)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "RIBBONBENCH_STORE": str(tmp_path / "store")}
    answers = []
    for name, begin in (("here", ["-m", "ribbonbench"]), ("there", ["elsewhere.py"])):
        done = subprocess.run(
            [sys.executable, *begin, *words, "--out", name],
            cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        answers.append(json.loads((tmp_path / name / "result.json").read_text()))
    here, there = (numbers(answer) for answer in answers)
    assert len(here) > 50
    assert {key: value for key, value in there.items() if not timed(key)} == {
        key: value for key, value in here.items() if not timed(key)
    }


def numbers(value, key=""):
    """Every number of a result, by the way to it."""
    if isinstance(value, dict):
        return {k: v for name, part in value.items() for k, v in numbers(part, f"{key}.{name}").items()}
    if isinstance(value, list):
        return {k: v for i, part in enumerate(value) for k, v in numbers(part, f"{key}.{i}").items()}
    return (
        {key: value} if isinstance(value, int | float) and not (isinstance(value, float) and math.isnan(value)) else {}
    )


def timed(key):
    """Whether a number is one of this run, not of the strip."""
    return any(word in key for word in ("seconds", "provenance", "times", "cpu", "memory"))


_SYSTEM = re.compile(
    r"\bimport (fcntl|resource|msvcrt)\b|\bsched_getaffinity\b|\bprctl\b|\bkillpg\b|\bSIGALRM\b|\bsetitimer\b|"
    r"\bpthread_sigmask\b|\bgetrusage\b|/proc/cpuinfo"
)
#: Cases of the battery that take memory and disk away from a process.
_ALLOWED = {"ribbonbench.system", "compare.battery.cases.process"}


def test_one_module_asks_the_operating_system():
    modules = Sources(ROOT).every("ribbon", "shellref", "compare", "ribbonbench")
    asking = {name for name, path in modules.items() if _SYSTEM.search(path.read_text(encoding="utf-8"))}
    assert asking - _ALLOWED == set()
    assert "ribbonbench.system" in asking
