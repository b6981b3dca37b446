"""Folds and branch points by AUTO-07p: a heavy coil over its weight (`ribbon.f90`), the planar elastica between two
clamps over the shift of one (`arch.f90`, from a solution that it is given)."""

from __future__ import annotations

import itertools
import os
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compare.suite.peers import auto
from tests.peers.auto import SOURCE as RIBBON
from tests.peers.cases import FloatArray

ARCH = Path(__file__).with_name("arch.f90")
#: AUTO's kinds of points that are special.
KINDS = {1: "branch_point", 5: "fold"}
#: Points to either side of a change of sign that its place is interpolated from, and degree.
_AROUND, _DEGREE = 12, 5


@dataclass(frozen=True)
class Followed:
    """special: kind and parameter of every fold and branch point, in order; values: the parameter (n,) at all points;
    ends: the second and third unknown (2,) at s = 1 of the last point; seconds: of the processor, of the process."""

    special: tuple[tuple[str, float], ...]
    values: FloatArray
    seconds: float


def _constants(
    unknowns: int, bounds: int, free: tuple[int, ...], span: tuple[float, float], mesh: int, way: int
) -> str:
    """AUTO's constants (its manual, chapter 10): arc length in shape and parameter."""
    shape = ", ".join(f"{k}: 0.01" for k in range(1, unknowns + 1))
    return f"""
NDIM={unknowns}, IPS=4, IRS=0, ILP=1, ICP={list(free)}, NTST={mesh}, NCOL=4, IAD=3, ISP=2, ISW=1
IPLT=0, NBC={bounds}, NINT=0, NMX=4000, NPR=0, MXBF=0, IID=2, ITMX=6, ITNW=9, NWTN=3
JAC=1, RL0={min(span) - 0.01}, RL1={max(span) + 0.01}, EPSL=1e-10, EPSU=1e-10, EPSS=1e-9
DS={0.002 * way}, DSMIN=1e-8, DSMAX=0.02, IADS=1, NPAR=3
THL={{1: 1.0}}, THU={{{shape}}}, UZSTOP={{1: {[span[1]]}}}
"""


def _run(source: Path, case: str, constants: str) -> Followed:
    with tempfile.TemporaryDirectory(prefix="ribbonbench-auto-") as name:
        folder = Path(name)
        for file, text in (("case.txt", case), ("fort.2", constants), ("fort.3", "")):
            (folder / file).write_text(text)
        begun = os.times()
        subprocess.run(
            [str(auto.linked(source))], cwd=folder, env={**os.environ, "OMP_NUM_THREADS": "1"}, timeout=120,
            capture_output=True, check=False,
        )  # fmt: skip
        ended = os.times()
        lines = [line.split() for line in (folder / "fort.7").read_text().splitlines()]
        told = (folder / "fort.9").read_text()
    rows = [(int(words[2]), float(words[4])) for words in lines if words and words[0] != "0"]
    special = tuple((KINDS[abs(kind) % 10], value) for kind, value in rows if abs(kind) % 10 in KINDS and kind > 0)
    if not special:
        special = tuple(("branch_point", place) for place in _crossings(told, [value for _, value in rows]))
    seconds = ended.children_user - begun.children_user + ended.children_system - begun.children_system
    return Followed(special, np.array([value for _, value in rows]), seconds)


def _crossings(told: str, values: list[float]) -> list[float]:
    """Where AUTO's own function of branch points (IID 2) passes zero over the parameter, by a polynomial through the
    points around: its own search there ends on the other branch of a symmetric fork, whose matrix is singular."""
    tests: dict[int, float] = {}
    for words in (line.split() for line in told.splitlines() if "BP   Function" in line):
        tests.setdefault(int(words[1]), float(words[4]))
    numbers = [k for k in range(2, len(values) + 1) if k in tests]
    found = []
    for here, there in itertools.pairwise(numbers):
        if tests[here] * tests[there] < 0.0:
            near = [k for k in numbers if 1 < abs(k - there) <= _AROUND]
            x, y = np.array([values[k - 1] for k in near]), np.array([tests[k] for k in near])
            scale = np.abs(y).max()
            found.append(float(np.polynomial.Polynomial.fit(y / scale, x, _DEGREE)(0.0)))
    return found


def coil(gamma: float, curvature: float, poisson: float, up: FloatArray, mesh: int) -> Followed:
    """Sadowsky's coil from no weight to `gamma`; up (3,) in the clamp's frame; mesh: intervals of the collocation.
    The parameter is Gamma."""
    case = " ".join(f"{float(v):.17g}" for v in (gamma, curvature, poisson, *up)) + "\n"
    found = _run(RIBBON, case, _constants(7, 7, (1,), (0.0, 1.0), mesh, 1))
    return Followed(tuple((k, v * gamma) for k, v in found.special), found.values * gamma, found.seconds)


def arch(table: FloatArray, end: tuple[float, float], force: tuple[float, float], to: float, mesh: int) -> Followed:
    """The elastica from a solution to the shift `to`. table (k, 5): s evenly, x, z, theta, kappa; end: x and z of its
    end in the solution; force (2,) on it there."""
    head = " ".join(f"{float(v):.17g}" for v in (end[0], table[0, 3], table[-1, 3], end[1], *force))
    rows = "\n".join(" ".join(f"{v:.17g}" for v in row) for row in table)
    way = 1 if to > end[1] else -1
    return _run(ARCH, f"{len(table)} {head}\n{rows}\n", _constants(4, 6, (1, 2, 3), (end[1], to), mesh, way))
