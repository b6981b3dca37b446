"""AUTO-07p (Doedel and others; Debian: auto-07p): `ribbon.f90` compiled once, every run a process of its own.

Found and linked, and its solutions read, as by the suite (`compare.suite.peers.auto`). Its continuation in
the weight from the natural shape gets analytic derivatives and, case by case, the fastest of `SEARCH`.
"""

from __future__ import annotations

import itertools
import os
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compare.suite.answers import Absent
from compare.suite.peers import auto
from tests.peers.cases import TARGET, Case, FloatArray, Run

SOURCE = Path(__file__).with_name("ribbon.f90")
#: Searched: collocation points, (first, largest) step in the share of the weight, tolerance of Newton's corrections,
#: after how many of these its Jacobian is kept (NWTN); with each of them the fewest of these intervals that reach the
#: target.
SEARCH = tuple(itertools.product((4, 7), ((0.05, 0.3), (0.1, 0.5), (0.2, 1.0)), (1e-3, 1e-4, 1e-5), (1, 3)))
INTERVALS = (7, 10, 14, 20, 28, 40, 56, 80)


@dataclass(frozen=True)
class Settings:
    """intervals, points: of the collocation; first, largest: steps; tolerance: of Newton's corrections; derivatives:
    analytic ones (False: differences); newton: full Newton steps before its Jacobian is kept."""

    intervals: int
    points: int
    first: float
    largest: float
    tolerance: float
    derivatives: bool = True
    newton: int = 3

    def __str__(self) -> str:
        return (
            f"NTST {self.intervals}, NCOL {self.points}, DS {self.first:g}, DSMAX {self.largest:g}, "
            f"EPSL {self.tolerance:g}, JAC {int(self.derivatives)}, NWTN {self.newton}"
        )


def absent() -> str | None:
    """Why it cannot be run; None: it can."""
    try:
        program()
    except Absent as reason:
        return str(reason)
    return None


def version() -> str:
    """As Debian names the package, or where it lies."""
    compiler = subprocess.run(["gfortran", "-dumpfullversion"], capture_output=True, text=True, check=True)
    return f"{auto.version()}, gfortran {compiler.stdout.strip()} -O3"


def program() -> Path:
    """The linked case. Raises `Absent`."""
    return auto.linked(SOURCE)


def constants(settings: Settings) -> str:
    """AUTO's constants (its manual, chapter 10): steps are measured in the share alone (THU 0)."""
    thu = ", ".join(f"{k}: 0.0" for k in range(1, 8))
    return f"""
NDIM=7, IPS=4, IRS=0, ILP=0, ICP=[1], NTST={settings.intervals}, NCOL={settings.points}, IAD=3, ISP=0, ISW=1
IPLT=0, NBC=7, NINT=0, NMX=400, NPR=0, MXBF=0, IID=0, ITMX=8, ITNW=7, NWTN={settings.newton}
JAC={int(settings.derivatives)}, RL0=-1.0, RL1=2.0
EPSL={settings.tolerance}, EPSU={settings.tolerance}, EPSS={10 * settings.tolerance}
DS={settings.first}, DSMIN=1e-4, DSMAX={settings.largest}, IADS=1, NPAR=1
THL={{1: 1.0}}, THU={{{thu}}}, UZSTOP={{1: 1.0}}
"""


def solved(found: Case, settings: Settings) -> tuple[FloatArray, FloatArray] | None:
    """Abscissae (k,) and y (6, k) at the full weight, as `run`; None: it does not get there."""
    return _run(found, settings)[0]


def _run(found: Case, settings: Settings) -> tuple[tuple[FloatArray, FloatArray] | None, float]:
    values = [found.gamma, found.curvature, found.poisson, *found.first_up]
    with tempfile.TemporaryDirectory(prefix="ribbonbench-auto-") as folder:
        (Path(folder) / "case.txt").write_text(" ".join(f"{float(v):.17g}" for v in values) + "\n")
        (Path(folder) / "fort.2").write_text(constants(settings))
        (Path(folder) / "fort.3").write_text("")
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        with subprocess.Popen(
            [str(program())], cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as process:
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        path = Path(folder) / "fort.8"
        table = auto.last(path.read_text())[0] if path.exists() else None
    solution = None if table is None else (table[:, 0], table[:, 1:7].T)
    return solution, used.ru_utime + used.ru_stime


def run(found: Case, settings: Settings) -> Run:
    """CPU time of a whole process; the free end's error is found afterwards and not timed."""
    solution, seconds = _run(found, settings)
    error = np.inf if solution is None else found.error(found.tip(*solution, settings.points))
    return Run(str(settings), error, seconds)


def best(found: Case) -> Settings:
    """The fastest of SEARCH whose free end is within the target; the fastest five are timed three times more."""
    good = []
    for points, (first, largest), tolerance, newton in SEARCH:
        for intervals in INTERVALS:
            settings = Settings(intervals, points, first, largest, tolerance, newton=newton)
            tried = run(found, settings)
            if tried.error <= TARGET:
                good.append((tried.seconds, settings))
                break
    if not good:
        raise AssertionError(
            f"{found.name}: AUTO reaches {TARGET:g} with none of {len(SEARCH) * len(INTERVALS)} settings"
        )
    good.sort(key=lambda pair: pair[0])
    again = [(float(np.median([run(found, s).seconds for _ in range(3)])), s) for _, s in good[:5]]
    return min(again, key=lambda pair: pair[0])[1]
