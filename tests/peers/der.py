"""DER-JAX (`lateral.py`): discrete elastic ribbons by implicit Euler, its own example, a strip shifted sideways.

The repository discrete-elastic-ribbon-jax of StructuresComp (or shivamkumarpanda, its author) is on no index: DER_DIR
names a checkout, PEERS_PYTHON a Python with what `requirements.txt` lists. Beside it `ribbon.follow` between the same
clamps. Its clamps hold two nodes and more each; the angle at the last of them has half the stiffness of half an edge,
so that its strip is one edge longer than its free edges, which makes it of second order; the limit of its own that its
error is told against has a third of the edge at the same length. Energies are made equal by its configuration: with
nu = 0 there and here its Sano is ours with our zeta, its rod has our torsion by its Poisson's ratio. It stretches, and
Sano's strip here does not bend in its plane: the limits differ by what the page says. Two are left out. Its Sadowsky
has no value where curvature passes zero and twist does not, as it does on the shifted arch: its nodes step over that
place, and ours did as long as their integral did not follow the state (`sadowsky_kt` is infinite there). Its stepper
calls Wunderlich's energy without eta', when it is 1/2 EI kappa_1^2 and free to twist.
"""

from __future__ import annotations

import functools
import json
import os
import statistics
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ribbon import Clamp, Equilibrium, Strip, follow, solve
from ribbon.energies.section.rod import torsion_constant
from ribbon.find.solve import build
from tests.peers import optimal
from tests.peers.cases import FloatArray, Run

SCRIPT = Path(__file__).with_name("lateral.py")
NAME, OURS = "DER-JAX", "ribbon.follow"
EXAMPLE = Path("examples") / "shear_induced_bifurcation" / "simulate.py"
#: Its nodes, and by what its edges are cut for its limit; section (m) and length of its example, (w, h, l).
NODES, CUT = 45, 2
#: The energy whose limit is computed.
LIMITED = "kirchhoff"
EXAMPLES = (0.1 / 12.0, 1e-3, 0.1)
#: Shifts over l: the first and the last of ours, their step and a wider one (a multiple of it); those nearer than KINK
#: to where the arch gives way or the strip comes to lie flat are not compared: there the dynamic one lags.
FIRST, LAST, STEP, WIDE, KINK = 0.01, 0.55, 0.02, 0.06, 0.03
LEANS, FLAT = 0.5, 5e-3
LADDER, LIMIT = (5, 7, 10, 14, 20, 28, 40, 56, 80), 160
#: Its runs that are timed; ours, of less than a second.
ROUNDS, WARM = 1, 3


@dataclass(frozen=True)
class Energy:
    """Names there and here, what its configuration is changed by."""

    theirs: str
    ours: str
    changes: dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Shifted:
    """What it did: distance of the clamps along (l), width and thickness (l), shifts and heights of the middle forth
    and back (l), CPU s of the run and of compiling, steps."""

    along: float
    width: float
    thickness: float
    forth: FloatArray
    back: FloatArray
    seconds: float
    compiling: float
    words: str

    def heights(self, shifts: FloatArray) -> FloatArray:
        """(2, k): heights at shifts (k,), forth and back."""
        return np.stack([np.interp(shifts, path[0], path[1]) for path in (self.forth, self.back)])


def names() -> list[str]:
    """What `measured` is asked for."""
    return [energy.theirs for energy in energies()]


def energies() -> tuple[Energy, ...]:
    """Those whose energy is one of ours."""
    width, thickness, _ = EXAMPLES
    torsion = 1.0 / torsion_constant(width, thickness) - 1.0
    zeta = width**2 / (60.0**0.5 * thickness)
    return (
        Energy("kirchhoff", "kirchhoff", {"material": {"poisson_rod": torsion}}),
        Energy("sano", "sano", {"material": {"poisson_rod": 0.0}, "energy_model": {"sano_zeta": zeta}}),
    )


@functools.cache
def absent() -> str | None:
    """Why it cannot be run; None: it can."""
    if not (Path(os.environ.get("DER_DIR", "")) / EXAMPLE).is_file() or "DER_DIR" not in os.environ:
        return "no DER-JAX: DER_DIR names no checkout of discrete-elastic-ribbon-jax"
    if subprocess.run([optimal.python(), "-P", "-c", "import jax, equinox, yaml"], capture_output=True).returncode:
        return "no jax, equinox or PyYAML in the Python of PEERS_PYTHON (tests/peers/requirements.txt)"
    return None


def version() -> str:
    """Its commit and the versions of what it stands on; itself it has none."""
    told = subprocess.run(
        [optimal.python(), "-P", str(SCRIPT), "--version"], capture_output=True, text=True, check=True
    )
    folder = Path(os.environ["DER_DIR"])
    banded = (folder / "src" / "dismech_jax" / "banded_solve.py").is_file()
    note = folder / "COMMITS"  # what a copy without a history was put together from
    commit = subprocess.run(["git", "-C", str(folder), "rev-parse", "--short", "HEAD"], capture_output=True, text=True)
    whence = note.read_text().strip() if note.is_file() else commit.stdout.strip() or "no commit known"
    return f"discrete-elastic-ribbon-jax ({whence}), {'banded' if banded else 'dense'} solver, {told.stdout.strip()}"


def finer(cut: int) -> tuple[int, dict[str, Any]]:
    """Nodes and thresholds of the clamps with edges cut into `cut` and the same length of what is free and one edge."""
    length, fixed = EXAMPLES[2], 4
    nodes = cut * (NODES - 1) + 1
    free = cut * (NODES - 2 * fixed) - 1
    first = (nodes - 1 - free) // 2
    edge = length / (nodes - 1)
    return nodes, {"start_x_threshold": (first + 0.5) * edge, "end_x_threshold": (first + free - 0.5) * edge}


def shifted(energy: Energy, cut: int = 1) -> Shifted:
    """One run of its example, single-threaded."""
    nodes, thresholds = (NODES, {}) if cut == 1 else finer(cut)
    changes = {**energy.changes, "boundary_condition": thresholds}
    given = {"energy": energy.theirs, "nodes": nodes, "changes": changes}
    flags = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
    threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "XLA_FLAGS": flags, "JAX_PLATFORMS": "cpu"}
    done = subprocess.run(
        [optimal.python(), "-P", str(SCRIPT), os.environ["DER_DIR"]], input=json.dumps(given) + "\n",
        capture_output=True, text=True, env={**os.environ, **threads},
    )  # fmt: skip
    if done.returncode:
        raise AssertionError(f"{NAME}, {energy.theirs}: {done.stderr[-500:]}")
    return read(json.loads(done.stdout.splitlines()[-1]))


def read(answer: dict[str, Any]) -> Shifted:
    """What `lateral.py` wrote, over the length of what is free and one edge."""
    length = (answer["free"] + 1) * answer["edge"]
    place, height = np.abs(np.array(answer["place"])) / length, np.abs(np.array(answer["middle"])[:, 2]) / length
    across = place[:, 1]
    turn = int(np.argmax(across))
    begin = int(np.flatnonzero(across[: turn + 1] < 1e-9)[-1])
    forth = np.stack([across[begin : turn + 1], height[begin : turn + 1]])
    back = np.stack([across[turn:][::-1], height[turn:][::-1]])
    return Shifted(
        place[turn, 0] + answer["edge"] / length, answer["width"] / length, answer["thickness"] / length, forth, back,
        answer["seconds"], answer["compiling"], f"{answer['steps']} steps, {answer['newton']} Newton steps",
    )  # fmt: skip


@dataclass(frozen=True)
class Followed:
    """Ours: shifts (k,), heights (2, k) of the middle forth and back, where it is upright, leans and lies flat (k,),
    CPU s."""

    shifts: FloatArray
    heights: FloatArray
    phase: FloatArray
    seconds: float

    @property
    def compared(self) -> FloatArray:
        """Which shifts (k,) are no nearer to a change of phase than KINK."""
        kinks = 0.5 * (self.shifts[1:] + self.shifts[:-1])[np.diff(self.phase) != 0]
        far = np.abs(self.shifts[:, None] - kinks[None, :]) > KINK
        return np.asarray(far.all(axis=1))


def followed(energy: Energy, given: Shifted, segments: int, step: float = STEP) -> Followed:
    """The arch, shifted forth and back by `ribbon.follow` in steps (l), unstable states left."""
    strip = Strip(1.0, given.width, 0.0, 0.0, 0.0, given.thickness)
    start = Clamp((0, 0, 0), (1, 0, 0), (0, 0, 1))

    def arguments(shift: float) -> dict[str, Any]:
        end = Clamp((given.along, shift, 0), (1, 0, 0), (0, 0, 1))
        return {"strip": strip, "clamp": start, "end": end, "energy": energy.ours, "segments": segments}

    begun = time.process_time()
    found = solve(**arguments(FIRST), seed_curvature=[-8.0, 8.0, -8.0], seed_ruling=[1e-3, -1e-3])
    rows: dict[str, list[tuple[float, float, float]]] = {"forth": [], "back": []}
    for way, first, last in (("forth", FIRST, LAST), ("back", LAST, FIRST)):

        def on_step(record: Any, new: Equilibrium, way=way, first=first, last=last) -> None:  # type: ignore[no-untyped-def]
            height = abs(float(new.middle.position[2]))
            leans = np.degrees(np.arccos(np.clip(abs(new.middle.frame[2, 1]), 0.0, 1.0))) > LEANS
            rows[way].append((first + (last - first) * record.t, height, 2.0 if height < FLAT else float(leans)))

        found = follow(
            lambda t, first=first, last=last: build(**arguments(first + (last - first) * t)), found,  # type: ignore[misc]
            steps=round((LAST - FIRST) / step), leave_saddle=True, on_step=on_step,
        )  # fmt: skip
        if not found.ok:
            raise AssertionError(f"ours, {energy.ours}, {segments}, {way}: {found.message}")
    seconds = time.process_time() - begun
    forth, back = np.array(rows["forth"])[:-1].T, np.array(rows["back"])[::-1].T[:, 1:]
    back = np.stack([np.interp(forth[0], back[0], row) for row in back])
    return Followed(forth[0], np.stack([forth[1], back[1]]), forth[2], seconds)


def measured(name: str, before: dict[str, dict[str, Run]]) -> dict[str, dict[str, Run]]:
    """Energy of this name -> peer -> its run: largest difference of heights to its own limit, CPU s; ours with as few
    segments as are no further from theirs. Its limit, ten times dearer, is computed for the rod; the others, nan, are
    held to the rod's error in `before`, what was measured already."""
    (energy,) = (e for e in energies() if e.theirs == name)
    coarse = shifted(energy)
    best = followed(energy, coarse, LIMIT)
    at, keep = best.shifts, best.compared
    words = f"N = {NODES}, {coarse.words}; compiled in {coarse.compiling:.3g} s"
    if name == LIMITED:
        limit = shifted(energy, CUT)
        apart = np.abs(limit.heights(at) - best.heights)[:, keep].max()
        # second order: the limit is off by 1 / (CUT^2 - 1) of the difference
        error = float(np.abs(coarse.heights(at) - limit.heights(at))[:, keep].max()) * CUT**2 / (CUT**2 - 1)
        requested, words = error, f"{words}; at N = {finer(CUT)[0]} {apart:.1e} l from ours"
    else:
        apart = np.abs(coarse.heights(at) - best.heights)[:, keep].max()
        requested, error = before[_case(LIMITED)][NAME].error, float("nan")
        words = f"{words}; {apart:.1e} l from ours"
    seconds = [coarse.seconds, *(shifted(energy).seconds for _ in range(ROUNDS - 1))]
    found = {NAME: Run(words, error, statistics.median(seconds))}
    for segments in LADDER:
        ours = [followed(energy, coarse, segments) for _ in range(WARM + 1)][1:]
        far = float(np.abs(ours[0].heights - best.heights)[:, keep].max())
        if far <= requested:
            words = f"p = {segments}, {at.size} shifts forth and back"
            found[OURS] = Run(words, far, statistics.median(o.seconds for o in ours))
            break
    else:
        raise AssertionError(f"ours, {energy.ours}: no more than {LADDER[-1]} segments reach {requested:.1e}")
    few = [followed(energy, coarse, segments, WIDE) for _ in range(WARM + 1)][1:]
    same = np.array([int(np.argmin(np.abs(at - shift))) for shift in few[0].shifts])
    far = float(np.abs(few[0].heights - best.heights[:, same])[:, keep[same]].max())
    words = f"p = {segments}, {same.size} shifts forth and back"
    found[f"{OURS}, wide steps"] = Run(words, far, statistics.median(o.seconds for o in few))
    print(f"  {name}: {found}", flush=True)
    return {_case(name): found}


def _case(name: str) -> str:
    return f"shift, {name}"
