"""The main jobs of this workbench, each timed beside a calibration kernel; a script that needs no other file of ours.

`python cost_jobs.py [JOB ...]` with a checkout's packages on the path (PYTHONPATH) prints one line of JSON a job: its
name and the median over its repetitions of CPU time over that of the calibration just before and after it. Nothing is
imported of the tests, so that the same script measures any revision. Processes that a job starts count by their own
CPU time.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"
os.environ["MPLBACKEND"] = "Agg"

import numpy as np  # noqa: E402 (reads the threads above)
from numba import njit  # noqa: E402

#: Times a job is repeated, fewer once this much CPU time (s) is spent.
REPEATS, BUDGET = 7, 12.0
#: Cases of the two sweeps whose difference is the cost of one.
SWEEPS = (4, 40)

SWEEP = """
title = "Cost of a case"
scene = "cantilever"
solver = "ribbon"
[set]
"strip.width" = 0.049
"strip.thickness" = 1e-3
"strip.poisson" = 0.5
"strip.density" = 1200.0
"strip.young" = 1e6
"gravity.acceleration" = 9.81
"model.elements" = 40
"model.grading" = "clamp"
"seed.curvature" = [9.0, 0.0, 0.0, 0.0]
[[axis]]
key = "strip.young"
spacing = "log"
first = 0.5e6
last = 10e6
count = COUNT
"""


@njit
def _recurrence(steps: int) -> float:
    x, total = 0.3, 0.0
    for _ in range(steps):
        x = 3.7 * x * (1.0 - x)
        total += np.sqrt(x)
    return total


_MATRIX = np.random.default_rng(0).normal(size=(160, 160)) + 20.0 * np.eye(160)


def _fixed() -> None:
    """A third compiled loop, a third dense factorisations, a third Python: what our own jobs are made of."""
    _recurrence(500_000)
    for _ in range(8):
        np.linalg.solve(_MATRIX, _MATRIX[:, :8])
    kept: dict[int, float] = {}
    for k in range(45_000):
        kept[k % 97] = kept.get(k % 89, 0.0) + 0.5 * k


def calibration() -> float:
    """CPU s of the fixed work, the least of three: what this machine takes for it just now."""
    times = []
    for _ in range(3):
        begun = time.process_time()
        _fixed()
        times.append(time.process_time() - begun)
    return min(times)


def _ratio(once: Callable[[], float]) -> tuple[float, float]:
    """Median of (CPU s of the job) / (CPU s of the calibration around it); median of the CPU s."""
    ratios: list[float] = []
    spent: list[float] = []
    before = calibration()
    while len(ratios) < REPEATS and (not spent or sum(spent) < BUDGET):
        spent.append(once())
        after = calibration()
        ratios.append(spent[-1] / (0.5 * (before + after)))
        before = after
    return statistics.median(ratios), statistics.median(spent)


def _here(once: Callable[[], object]) -> Callable[[], float]:
    def timed() -> float:
        begun = time.process_time()
        once()
        return time.process_time() - begun

    return timed


def _command(*words: str) -> float:
    """CPU s of a command of ours, with whatever it starts."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "RIBBONBENCH_STORE": folder + "/store"}
        given = [sys.executable, "-P", "-m", "ribbonbench", *(word.replace("OUT", folder) for word in words)]
        with subprocess.Popen(given, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode > 1:
            raise RuntimeError(f"{' '.join(words)}: exit code {process.returncode}")
        return used.ru_utime + used.ru_stime


def _python(code: str) -> float:
    with subprocess.Popen([sys.executable, "-P", "-c", code]) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    return used.ru_utime + used.ru_stime


def _chained(segments: int) -> Callable[[], float]:
    from ribbon import Clamp, Gravity, Strip, solve

    strip = Strip(length=1.0, width=1e-3, poisson=0.4, natural_curvature=40.0, gamma=1200.0)
    clamp = Clamp((0.0, 0.0, 0.0), tangent=(0.0, 0.0, 1.0), normal=(0.0, 1.0, 0.0))
    gravity = Gravity(up=(1.0, 0.0, 0.0))
    return _here(lambda: solve(strip, clamp, gravity, energy="sadowsky", segments=segments))


def _glued(segments: int) -> Callable[[], float]:
    from ribbon import Clamp, Gravity, Strip, solve

    strip = Strip(length=1.0, width=0.01, poisson=0.5, natural_curvature=0.0, gamma=1.0)
    clamp = Clamp((0.0, 0.0, 0.0), tangent=(0.0, 0.0, 1.0), normal=(-1.0, 0.0, 0.0))
    end = Clamp((0.67175144212722, 0.0, 0.67175144212722), tangent=(1.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0))
    given = {"end": end, "segments": segments, "seed_curvature": (1e-3, 1.1e-3), "seed_ruling": (1e-3, 1.1e-3)}
    return _here(lambda: solve(strip, clamp, Gravity(up=(0.0, 0.0, 1.0)), **given))  # type: ignore[arg-type]


def _sweep() -> float:
    """CPU s of one case: a long sweep less a short one, over the difference of their cases."""
    spent = []
    for count in SWEEPS:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "cases.toml"
            path.write_text(SWEEP.replace("COUNT", str(count)))
            spent.append(_command("sweep", str(path), "--workers", "1", "--out", "OUT/out"))
    return (spent[1] - spent[0]) / (SWEEPS[1] - SWEEPS[0])


def _shell() -> Callable[[], float]:
    def whole() -> float:
        import resource

        from compare import registry
        from compare.scene.scene import load

        scene = load("curl_4_3").replace({"shell.width_to_thickness": [50.0], "shell.elements": [50, 4]})
        with tempfile.TemporaryDirectory() as folder:
            os.environ["RIBBONBENCH_STORE"] = folder
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            state = registry.model("shell").solve(scene)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        if state.shape is None:
            raise RuntimeError(state.message)
        return seconds

    return whole


JOBS: dict[str, Callable[[], Callable[[], float]]] = {
    "chained solve, p = 40": lambda: _chained(40),
    "chained solve, p = 500": lambda: _chained(500),
    "glued two clamps, p = 40": lambda: _glued(40),
    "glued two clamps, p = 1000": lambda: _glued(1000),
    "shell 50 x 4, whole": _shell,
    "sweep, a case": lambda: _sweep,
    "import ribbon": lambda: lambda: _python("import ribbon"),
    "ribbonbench --help": lambda: lambda: _command("--help"),
    "scene to answer and files": lambda: lambda: _command("solve", "coil_10_100", "--out", "OUT/o", "--quiet"),
}


def main(names: list[str]) -> None:
    """Measures the jobs named, or all; the first run of a job compiles and is not counted."""
    calibration()
    for name in names or JOBS:
        try:
            once = JOBS[name]()
            once()
            ratio, seconds = _ratio(once)
            print(json.dumps({"job": name, "ratio": ratio, "seconds": seconds}), flush=True)
        except Exception as error:
            print(json.dumps({"job": name, "ratio": None, "why": f"{type(error).__name__}: {error}"}), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
