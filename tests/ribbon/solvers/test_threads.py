"""Linear algebra inside a solve: one thread, and afterwards what the program had."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

#: Threads of every OpenBLAS of the process before, inside and after a solve in a program that imported NumPy first.
SCRIPT = """
import json, sys
import numpy as np
import scipy.linalg
from ribbon import Clamp, Gravity, Strip, refine, solve
from ribbonbench import threads
def now():
    return [get() for get, _ in threads.loaded()]
seen = [now()]
def inside(*_):
    seen.append(now())
strip = Strip(length=1.0, width=0.03, poisson=0.4, natural_curvature=10.0, gamma=100.0)
given = {"energy": "sadowsky", "segments": 6, "progress": inside, **json.loads(sys.argv[1])}
try:
    solve(strip, Clamp(), Gravity(up=(1, 0, 0)), **given)
except ValueError:
    pass
print(json.dumps([seen[0], seen[1:], now()]))
"""


def threads(keywords: dict[str, object] | None = None, **environment: str) -> list[list[int]]:
    kept = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    words = [sys.executable, "-c", SCRIPT, json.dumps(keywords or {})]
    done = subprocess.run(words, capture_output=True, text=True, check=True, env={**kept, **environment})
    return json.loads(done.stdout)  # type: ignore[no-any-return]


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one core: OpenBLAS has one thread anyway")
def test_a_solve_takes_one_thread_and_gives_back_what_there_was():
    before, inside, after = threads()
    assert before
    assert min(before) > 1
    assert after == before
    assert len(inside) > 3  # every step of the minimiser
    assert all(seen == [1] * len(before) for seen in inside)


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one core: OpenBLAS has one thread anyway")
def test_threads_come_back_after_bad_input():
    before, inside, after = threads({"energy": "no such"})
    assert not inside
    assert after == before


@pytest.mark.parametrize("name", ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"])
def test_what_the_user_has_set_stays(name):
    before, inside, after = threads(**{name: "2"})
    assert before == after
    assert all(seen == before for seen in inside)
