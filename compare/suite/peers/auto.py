"""AUTO-07p (Doedel and others; Debian: auto-07p) on a case: a rod by collocation, its loads grown by arc length.

`bar.f90` is linked to AUTO's objects with gfortran once a process. The loads grow from nothing, past folds, until they
are there for the first time; the solution's polynomials are read between the points of its mesh.
"""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BarycentricInterpolator

from compare.suite.answers import Absent, Answers, BrokeDown
from compare.suite.case import Ask, Case
from compare.suite.peers.call import Reply, answers_of, of_points, scenes
from compare.suite.peers.models import of_rotation
from compare.suite.section import Bar, bar_of

FloatArray = NDArray[np.float64]
SOURCE = Path(__file__).with_name("bar.f90")
#: Mesh intervals of both meshes, collocation points in each, unknowns.
INTERVALS, POINTS, UNKNOWNS = (12, 24), 4, 13
#: First and largest step of the loads' share, tolerance of Newton's corrections, steps at most.
FIRST, LARGEST, TOLERANCE, MOST = 0.02, 0.2, 1e-8, 2000
#: Evenly placed points that a centreline is read at.
READ = 401
_KEPT: list[tempfile.TemporaryDirectory[str]] = []


def library() -> Path:
    """The folder of AUTO's objects: of AUTO_DIR, beside `auto-07p` on the path, or where Debian has it. Raises
    `Absent`."""
    places = [Path(os.environ["AUTO_DIR"])] if "AUTO_DIR" in os.environ else []
    program = shutil.which("auto-07p") or shutil.which("auto")
    if program:
        above = Path(program).resolve().parent.parent
        places += [above, above / "lib" / "auto-07p"]
    places.append(Path("/usr/lib/auto-07p"))
    for place in places:
        if (place / "lib" / "bvp.o").exists():
            return place / "lib"
    raise Absent("AUTO-07p is not here: install Debian's auto-07p, or name its folder in AUTO_DIR")


@functools.cache
def linked(source: Path) -> Path:
    """The program of a case's equations, in a folder that goes with this process. Raises `Absent`."""
    # the objects that Debian brings are those of its own link (libauto_c.a: the C interface's)
    objects = sorted(str(path) for path in library().glob("*.o"))
    if shutil.which("gfortran") is None:
        raise Absent("gfortran is not on the path, which links AUTO's cases")
    folder = tempfile.TemporaryDirectory(prefix="ribbonbench-auto-")
    _KEPT.append(folder)
    target = Path(folder.name) / source.stem
    words = ["gfortran", "-O3", "-fopenmp", "-o", str(target), str(source), *objects]
    subprocess.run(words, check=True, cwd=folder.name, capture_output=True)
    return target


def constants(intervals: int) -> str:
    """AUTO's constants (its manual, chapter 10): steps are measured in the loads' share and in the shape."""
    forces = ", ".join(f"{k}: 0.0" for k in range(8, UNKNOWNS + 1))
    return f"""
NDIM={UNKNOWNS}, IPS=4, IRS=0, ILP=0, ICP=[1], NTST={intervals}, NCOL={POINTS}, IAD=3, ISP=0, ISW=1
IPLT=0, NBC={UNKNOWNS}, NINT=0, NMX={MOST}, NPR=0, MXBF=0, IID=0, ITMX=9, ITNW=9, NWTN=3, JAC=0
RL0=-1.0, RL1=2.0, EPSL={TOLERANCE}, EPSU={TOLERANCE}, EPSS={10 * TOLERANCE}
DS={FIRST}, DSMIN=1e-6, DSMAX={LARGEST}, IADS=1, NPAR=1
THL={{1: 1.0}}, THU={{{forces}}}, UZSTOP={{1: 1.0}}
"""


def text_of(bar: Bar) -> str:
    """The numbers that `bar.f90` reads."""
    compliance = np.zeros(3) if bar.shear is None else 1.0 / np.array(bar.shear)
    parts = (
        bar.stiffness, compliance, bar.rest, bar.start, of_rotation(np.array(bar.frame)), bar.weight, bar.force,
        bar.moment,
    )  # fmt: skip
    return " ".join(f"{float(x):.17g}" for part in parts for x in part) + "\n"


def solved(bar: Bar, intervals: int, left: float) -> Reply:
    """The centreline (`READ`, 3) under the whole load. Raises `BrokeDown`."""
    if left <= 0.0:
        raise BrokeDown("out of budget: nothing is left of it for the next mesh")
    with tempfile.TemporaryDirectory(prefix="ribbonbench-auto-") as name:
        folder = Path(name)
        (folder / "bar.txt").write_text(text_of(bar))
        (folder / "fort.2").write_text(constants(intervals))
        (folder / "fort.3").write_text("")
        begun = os.times()
        try:
            subprocess.run(
                [str(linked(SOURCE))], cwd=folder, env={**os.environ, "OMP_NUM_THREADS": "1"}, timeout=left,
                capture_output=True, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise BrokeDown(f"out of budget: it had not ended after {left:.3g} s") from None
        ended = os.times()
        path = folder / "fort.8"
        table, share = last(path.read_text() if path.exists() else "")
    if table is None:
        raise BrokeDown(f"its continuation ended at {share:.3g} of the load")
    seconds = ended.children_user - begun.children_user + ended.children_system - begun.children_system
    return Reply((line(table),), seconds, f"NCOL {POINTS}, EPSL {TOLERANCE:g}, DSMAX {LARGEST:g}")


def last(text: str) -> tuple[FloatArray | None, float]:
    """Mesh and unknowns (k, 1 + n) of the solution at the user's point (type -4) of a file fort.8, None where there is
    none; and the share of the load of its last solution."""
    lines = text.splitlines()
    at, found, share = 0, None, 0.0
    while at < len(lines):
        head = [int(word) for word in lines[at].split()]
        kind, points, width, rows = head[2], head[6], head[7], head[8]
        words = " ".join(lines[at + 1 : at + 1 + rows]).replace("D", "E").split()
        share = float(words[-1])
        if kind % -10 == -4:
            found = np.array(words[: points * width], float).reshape(points, width)
        at += 1 + rows
    return found, share


def line(table: FloatArray) -> FloatArray:
    """Evenly placed points (`READ`, 3) of the solution's polynomials."""
    s = np.linspace(0.0, 1.0, READ)
    places = np.empty((READ, 3))
    for first in range(0, len(table) - 1, POINTS):
        piece = table[first : first + POINTS + 1]
        inside = (s >= piece[0, 0]) & (s <= piece[-1, 0])
        if inside.any():
            places[inside] = BarycentricInterpolator(piece[:, 0], piece[:, 1:4])(s[inside])
    return places


def auto(case: Case, budget: float) -> Answers:
    """AUTO-07p's orthogonal collocation, on two meshes."""
    linked(SOURCE)
    of_points(case)
    until = time.perf_counter() + budget
    bars = {ask.name: [bar_of(scene, case.theory) for scene in scenes(case, ask)] for ask in case.asks}

    def reply(ask: Ask, intervals: int) -> Reply:
        found = [solved(bar, intervals, until - time.perf_counter()) for bar in bars[ask.name]]
        return Reply(
            tuple(one.points[0] for one in found), sum(one.seconds or 0.0 for one in found), found[-1].settings
        )

    return answers_of(case, INTERVALS, reply, version())


def version() -> str:
    """As Debian names the package, or where it is said."""
    told = subprocess.run(
        ["dpkg-query", "-W", "-f", "${Version}", "auto-07p"], capture_output=True, text=True, check=False
    ) if shutil.which("dpkg-query") else None  # fmt: skip
    return f"AUTO-07p {(told.stdout if told else '') or os.environ.get('AUTO_VERSION', '0.9')}"
