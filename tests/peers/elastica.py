"""PyElastica (`cosserat.py`): dynamic Cosserat rods, damped until they rest, in a Python of their own: PEERS_PYTHON.

Two rods that both have: a heavy cantilever, planar, and the naturally curved rod of the thesis's figure 4.5, whose
section is a rectangle (stiffnesses of `rod_4_5`). Stretching and shear, which ours forbids, are as soft as the error
allows; a run is over at the first moment after which its free end stays within the error asked for, which nobody knows
who does not know the answer.
"""

from __future__ import annotations

import functools
import itertools
import json
import os
import statistics
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from compare.scene.scene import load
from ribbon import Clamp, Equilibrium, Gravity, Strip, solve
from ribbon.energies.free import in_plane_stiffness
from ribbon.energies.section.rod import stiffnesses
from shellref.elastica.problem import ElasticaProblem
from tests.peers import optimal
from tests.peers.cases import FloatArray, Run
from tests.reference.elastica_collocation import collocation

SCRIPT = Path(__file__).with_name("cosserat.py")
NAME = "PyElastica"
#: Distances of the free end (l) asked for.
REQUESTED = (1e-3, 1e-4)
#: Searched at 1e-3: elements, stiffness of stretching and shear (over that of bending / l^2), damping (1 / time).
SEARCH = tuple(itertools.product((45, 60, 30, 20, 14), (1e5, 5e4, 2e4, 2e5), (4.0,)))
DAMPING = (2.5, 6.0, 9.0, 13.0)
#: For a smaller error: elements and stiffness of the best at 1e-3, by the square root and the first power of the ratio,
#: times these.
FINER = ((1.0, 1.0), (1.2, 1.0))
#: Share of the longest stable step; longest run in its time, in CPU s.
SHARE, UNTIL, BUDGET = 0.9, 15.0, 120.0
LADDER = (3, 4, 5, 7, 10, 14, 20, 28, 40, 56, 80)
#: Timed in turn; ours, of a few ms, this often each time.
ROUNDS, WARM = 2, 7


@dataclass(frozen=True)
class Settings:
    """Elements, stiffness of stretching and shear, damping."""

    elements: int
    stiff: float
    damping: float

    def __str__(self) -> str:
        return f"{self.elements} elements, EA = GA = {self.stiff:.2g} EI / l^2, damping {self.damping:g}"


@dataclass(frozen=True)
class Rod:
    """A rod: K l, Gamma, direction up (3,), frame (3, 3) of the clamp, (w, h) over l, nu, whether it stays planar."""

    name: str
    curvature: float
    gamma: float
    up: tuple[float, float, float]
    frame: FloatArray
    section: tuple[float, float]
    poisson: float
    planar: bool

    def solved(self, segments: int) -> Equilibrium:
        """`ribbon.solve` of the rod."""
        width, thickness = self.section
        strip = Strip(1.0, width, self.poisson, self.curvature, self.gamma, thickness)
        clamp = Clamp((0.0, 0.0, 0.0), self.frame[:, 2], self.frame[:, 1], ruling="free")
        return solve(strip, clamp, Gravity(self.up), energy="kirchhoff", segments=segments)

    def stiffnesses(self) -> tuple[float, float, float]:
        """Of bending about t_x and t_y and of torsion; a planar rod's other two are free, and 1 is fastest."""
        width, thickness = self.section
        section = np.array([0.5 * width, thickness, self.poisson, 0.0])
        bending, torsion = stiffnesses(section)
        return (1.0, 1.0, 1.0) if self.planar else (bending, in_plane_stiffness(section), torsion)

    def ours(self, asked: float) -> Run:
        """The fewest segments within `asked`, a warm solve with its stability check."""
        for segments in LADDER:
            error = float(np.linalg.norm(np.asarray(self.solved(segments).end.position) - reference(self.name)))
            if error <= asked:
                seconds = []
                for _ in range(WARM):
                    begun = time.process_time()
                    self.solved(segments).end.position  # noqa: B018
                    seconds.append(time.process_time() - begun)
                return Run(f"p = {segments}", error, statistics.median(seconds))
        raise AssertionError(f"{self.name}: no more than {LADDER[-1]} segments reach {asked:g}")


def names() -> list[str]:
    """What `measured` is asked for."""
    return [rod.name for rod in rods()]


@functools.cache
def rods() -> tuple[Rod, ...]:
    """Both."""
    out = []
    for name, planar in (("cantilever", True), ("rod_4_5", False)):
        scene = load(name)
        width = scene.strip.width
        out.append(
            Rod(
                f"{name}, Gamma = {scene.gamma:g}", float(scene.curvature[0]), float(scene.gamma),
                tuple(map(float, scene.up)), np.asarray(scene.frame), (width, width / 10.0), scene.strip.poisson,
                planar,
            )
        )  # fmt: skip
    return tuple(out)


@functools.cache
def reference(name: str) -> FloatArray:
    """Free end (3,) of a rod: the planar one by collocation of the elastica, the other by ours on 320 segments (its
    distance to the axis of gravity is known to 1e-5 from another code: `tests.validation.ribbon.curve_angle.TIPS`)."""
    (rod,) = [r for r in rods() if r.name == name]
    if not rod.planar:
        return np.asarray(rod.solved(320).end.position)
    # the elastica's plane: x along t_z, y along -t_y
    problem = ElasticaProblem(gamma=rod.gamma, up=(float(rod.frame[:, 2] @ rod.up), -float(rod.frame[:, 1] @ rod.up)))
    found = collocation(problem, lambda s: np.vstack([0.0 * s, 0.0 * s, s, 0.0 * s]), tolerance=1e-9)
    x, y = found.sol(1.0)[2:]
    return np.asarray(x * rod.frame[:, 2] - y * rod.frame[:, 1])


@functools.cache
def absent() -> str | None:
    """Why it cannot be run; None: it can."""
    if subprocess.run([optimal.python(), "-P", "-c", "import elastica"], capture_output=True).returncode:
        return "no PyElastica: PEERS_PYTHON names no Python that has it (tests/peers/requirements.txt)"
    return None


def version() -> str:
    """Its version."""
    told = subprocess.run(
        [optimal.python(), "-P", str(SCRIPT), "--version"], capture_output=True, text=True, check=True
    )
    return told.stdout.strip()


def relaxed(rod: Rod, settings: Settings, asked: float, budget: float = BUDGET) -> dict[str, Any]:
    """What `cosserat.py` answers."""
    given = {
        "curvature": rod.curvature, "gamma": rod.gamma, "up": rod.up, "frame": rod.frame.tolist(),
        "stiffnesses": rod.stiffnesses(), "elements": settings.elements, "stiff": settings.stiff,
        "damping": settings.damping, "until": UNTIL, "share": SHARE, "tip": reference(rod.name).tolist(),
        "asked": asked, "budget": budget,
    }  # fmt: skip
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    done = subprocess.run(
        [optimal.python(), "-P", str(SCRIPT)], input=json.dumps(given) + "\n", capture_output=True, text=True,
        check=True, env=environment,
    )  # fmt: skip
    return dict(json.loads(done.stdout.splitlines()[-1]))


def run(rod: Rod, settings: Settings, asked: float, budget: float = BUDGET) -> Run:
    """CPU time to the first moment after which the free end stays within `asked`; never: infinite, the last error."""
    answer = relaxed(rod, settings, asked, budget)
    errors = np.array(answer["errors"])
    late = np.flatnonzero(~(errors <= asked))
    k = int(late[-1]) + 1 if late.size else 0
    over = k >= errors.size or not answer["settled"]
    seconds = np.inf if over else answer["seconds"][k]
    words = "" if over else f", {answer['stepped'][k]:,} steps to t = {answer['times'][k]:.2g}"
    return Run(f"{settings}{words}", float(errors[-1]) if over else float(errors[k:].max()), seconds)


def _fastest(rod: Rod, tried: list[Settings], asked: float, budget: float) -> tuple[float, Settings] | None:
    """CPU s and settings of the fastest that gets there; none may take longer than the best before it."""
    best: tuple[float, Settings] | None = None
    for settings in tried:
        found = run(rod, settings, asked, budget if best is None else min(budget, 1.5 * best[0]))
        print(f"    {rod.name}, {asked:g}: {found}", flush=True)
        if np.isfinite(found.seconds) and (best is None or found.seconds < best[0]):
            best = found.seconds, settings
    return best


def best(rod: Rod) -> dict[float, Settings]:
    """The fastest settings of every error of `REQUESTED` that it reaches within `BUDGET`."""
    out: dict[float, Settings] = {}
    first = _fastest(rod, [Settings(*given) for given in SEARCH], REQUESTED[0], BUDGET)
    if first is None:
        raise AssertionError(f"{rod.name}: none of {len(SEARCH)} settings of {NAME} reaches {REQUESTED[0]:g}")
    found = first[1]
    again = _fastest(rod, [found, *(Settings(found.elements, found.stiff, c) for c in DAMPING)], REQUESTED[0], BUDGET)
    out[REQUESTED[0]] = (again or first)[1]
    for requested in REQUESTED[1:]:
        ratio, found = REQUESTED[0] / requested, out[REQUESTED[0]]
        tried = [
            Settings(round(found.elements * ratio**0.5 * n), found.stiff * ratio * k, found.damping) for n, k in FINER
        ]
        finer = _fastest(rod, tried, requested, BUDGET)
        if finer is not None:
            out[requested] = finer[1]
    return out


def measured(name: str, _: dict[str, dict[str, Run]]) -> dict[str, dict[str, Run]]:
    """Rod of this name and error asked for -> peer -> median of `ROUNDS`, in turn."""
    out = {}
    for rod in (r for r in rods() if r.name == name):
        for requested, settings in best(rod).items():
            runs = [(rod.ours(requested), run(rod, settings, requested)) for _ in range(ROUNDS)]
            out[f"{rod.name}, {requested:g} l"] = {
                name: Run(done[0].settings, max(r.error for r in done), statistics.median(r.seconds for r in done))
                for name, done in zip(("ribbon.solve", NAME), zip(*runs, strict=True), strict=True)
            }
            print(f"  {rod.name}, {requested:g}: {out[f'{rod.name}, {requested:g} l']}", flush=True)
    return out
