"""What is felt: CPU time of commands in processes of their own, what of it is libraries alone, and of the same work
warm (results/felt.md). In turns, one after the other, so that a busy minute falls on all of them alike."""

from __future__ import annotations

import functools
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from compare.models.ribbon.auto import LADDER, REFERENCE, choose, with_energy
from compare.models.ribbon.solving import solver
from compare.scene.scene import Scene, load
from compare.studies import limits
from tests.validation import one_core, page
from tests.validation.number import Number
from tests.validation.ribbon.newton_glued import BODIES, MANY, STRIP
from tests.validation.workbench.million import few

_TIME = "CPU time, median of rounds in turns"
#: Rounds of commands, and of what is warm.
ROUNDS, WARM = 5, 9
#: CPU time (s) that was hoped for of a solve.
HOPED = 0.7
OWN = """title = "A curled gift ribbon"
[strip]
length = 0.30
width = 0.009
thickness = 9e-5
poisson = 0.4
young = 4.0e9
density = 1400.0
natural_curvature = 50.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.7071067811865476, -0.7071067811865476]
"""
_RIBBONBENCH = ("-m", "compare.cli")
_PICTURE = """
import io
import matplotlib
matplotlib.use("Agg")
from matplotlib.figure import Figure
figure = Figure()
figure.add_subplot().plot([0, 1])
figure.savefig(io.BytesIO())
"""
#: Name -> arguments of the interpreter, what it is, and the time (s) that was hoped for (None: none was).
COMMANDS: Mapping[str, tuple[tuple[str, ...], str, float | None]] = {
    "solve": ((*_RIBBONBENCH, "solve", "own.toml"), "`solve` of a film, energy left open, with its picture", HOPED),
    "quick": ((*_RIBBONBENCH, "limits", "own.toml", "--quick"), "`limits --quick` of it", None),
    "compare": ((*_RIBBONBENCH, "compare", "curl_4_3"), "`compare` of the demo: five shells, report, pictures", 6.0),
    "numeric": (("-c", "import numpy, numba, scipy.spatial"), "NumPy, Numba and SciPy imported, no more", None),
    "picture": (("-c", _PICTURE), "Matplotlib imported, one line drawn", None),
}  # fmt: skip


@functools.cache
def own() -> Scene:
    """The film."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "own.toml"
        path.write_text(OWN, encoding="utf-8")
        return load(path)


def command(arguments: tuple[str, ...], folder: Path) -> float:
    """CPU time (s) of a process and of all that it waits for."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    code = subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        check=False,
    ).returncode  # fmt: skip
    if code > 1:
        raise RuntimeError(f"{' '.join(arguments)} ended with code {code}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def commands() -> dict[str, list[float]]:
    """CPU times (s) of every command, round after round; what kernels and caches it lacks is made in one round more."""
    times: dict[str, list[float]] = {name: [] for name in COMMANDS}
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "own.toml").write_text(OWN, encoding="utf-8")
        for k in range(ROUNDS + 1):
            for name, (arguments, _, _) in COMMANDS.items():
                spent = command(arguments, Path(folder))
                if k:
                    times[name].append(spent)
    return times


def _tasks() -> dict[str, Callable[[], Any]]:
    from ribbon import solve

    film = own()
    glued = {"strip": STRIP, "segments": MANY, **BODIES["two clamps"]}
    thresholds = limits.Thresholds()
    return {
        "sadowsky": solver(with_energy(film, LADDER[0])),
        "wunderlich": solver(with_energy(film, "wunderlich")),
        "finite": solver(with_energy(film, REFERENCE)),
        "choice": lambda: choose(film),
        "estimate": lambda: limits.quick(with_energy(film, "wunderlich"), thresholds),
        "glued": lambda: solve(**glued),
    }


#: What is measured warm, and how often in a round: the longest once in all.
TASKS: Mapping[str, str] = {
    "sadowsky": "Sadowsky's strip, to the scene's tolerance",
    "wunderlich": "Wunderlich's, in the same way",
    "finite": "the strip of finite thickness, in the same way",
    "choice": "the choice of an energy",
    "estimate": "`limits --quick` without its process",
    "glued": f"a strip between two clamps on {MANY} segments, stability included",
}


def warm() -> dict[str, list[float]]:
    """CPU times (s) of the tasks, in turns, after one round that is not counted."""
    tasks = _tasks()
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for k in range(WARM + 1):
        for name, task in tasks.items():
            if name == "glued" and k > WARM // 3:
                continue
            clock = time.process_time()
            task()
            if k:
                times[name].append(time.process_time() - clock)
    return times


def estimate() -> float:
    """The estimate (% of l) of what the film's choice ends at."""
    found = choose(own()).steps[-1].estimate
    if found is None:
        raise AssertionError("the choice ends without an estimate")
    return 100.0 * found


PROBES = {"estimate": estimate, "stable_of_few": lambda: few()[0], "energy_of_few": lambda: few()[1]}


def _spread(times: list[float], unit: float, digits: str) -> str:
    low, high = min(times) * unit, max(times) * unit
    return f"{format(statistics.median(times) * unit, digits)} ({format(low, digits)} to {format(high, digits)})"


def run(folder: Path) -> dict[str, Number]:
    """Writes felt.md into the folder."""
    cold, hot = commands(), one_core.call(warm)
    middle = {name: statistics.median(times) for name, times in (cold | hot).items()}
    floor = middle["numeric"] + middle["picture"]
    rows = [
        [words, _spread(cold[name], 1.0, ".2f"), "" if aim is None else f"{aim:g}"]
        for name, (_, words, aim) in COMMANDS.items()
    ]
    warmed = [[words, _spread(hot[name], 1e3, ".3g")] for name, words in TASKS.items()]
    page.write(
        folder / "felt.md",
        "What is felt",
        "python -m tests.validation felt",
        "CPU time of a process with all that it starts (s): median, least and most of "
        f"{ROUNDS} rounds in turns; kernels are kept. Files and pictures are written.",
        page.table(["what", "CPU s", "hoped for"], rows),
        f"Libraries alone take {floor:.2f} s of `solve`'s {middle['solve']:.2f} s: what was hoped for ({HOPED:g} s) "
        + ("cannot" if floor > HOPED else "could")
        + " be had beside a picture that Matplotlib draws and kernels that Numba loads. Warm, in one process and one "
        "thread (ms, the same way):",
        page.table(["what", "CPU ms"], warmed),
        f"The choice costs {middle['choice'] / middle['finite']:.1f} solves of the strip of finite thickness (hoped "
        f"for: at most 3): it also solves Sadowsky's strip, asks probes for lower states and measures what each model "
        f"leaves out. That strip takes {middle['finite'] / middle['wunderlich']:.1f} times Wunderlich's (at most 2).",
    )
    numbers = {name: Number(middle[name], None, "s", ".2f", why=_TIME) for name in cold}
    numbers |= {name: Number(1e3 * middle[name], None, "ms", ".3g", why=_TIME) for name in hot}
    stable, energy = few()
    return numbers | {
        "floor": Number(floor, None, "s", ".2f", why=_TIME),
        "solves": Number(middle["choice"] / middle["finite"], None, shown=".1f", why=_TIME),
        "over_wunderlich": Number(middle["finite"] / middle["wunderlich"], None, shown=".1f", why=_TIME),
        "estimate": Number(estimate(), 0.01, "% of l", ".2f"),
        "stable_of_few": Number(stable, 0, shown="d"),
        "energy_of_few": Number(energy, 1e-6 * abs(energy), "D w / l", ".6g"),
    }
