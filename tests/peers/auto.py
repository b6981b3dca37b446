"""AUTO-07p (Doedel and others; Debian: auto-07p): `ribbon.f90` compiled once, every run a process of its own.

Found by AUTO_DIR (the folder with lib/), or beside `auto-07p` on the PATH; gfortran links the case. Its continuation in
the weight from the natural shape gets analytic derivatives and, case by case, the fastest of `SEARCH`.
"""

from __future__ import annotations

import functools
import itertools
import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.peers.cases import TARGET, Case, FloatArray, Run

SOURCE = Path(__file__).with_name("ribbon.f90")
#: Searched: collocation points, (first, largest) step in the share of the weight, tolerance of Newton's corrections;
#: with each of them the fewest of these intervals that reach the target.
SEARCH = tuple(itertools.product((4, 7), ((0.05, 0.3), (0.1, 0.5), (0.2, 1.0)), (1e-4, 1e-5)))
INTERVALS = (7, 10, 14, 20, 28, 40, 56, 80)


@dataclass(frozen=True)
class Settings:
    """intervals, points: of the collocation; first, largest: steps; tolerance: of Newton's corrections; derivatives:
    analytic ones (False: differences)."""

    intervals: int
    points: int
    first: float
    largest: float
    tolerance: float
    derivatives: bool = True

    def __str__(self) -> str:
        return (
            f"NTST {self.intervals}, NCOL {self.points}, DS {self.first:g}, DSMAX {self.largest:g}, "
            f"EPSL {self.tolerance:g}, JAC {int(self.derivatives)}"
        )


def library() -> Path | None:
    """The folder of AUTO's objects; None: it is not here."""
    places = [Path(os.environ["AUTO_DIR"])] if "AUTO_DIR" in os.environ else []
    found = shutil.which("auto-07p") or shutil.which("auto")
    if found:
        above = Path(found).resolve().parent.parent
        places += [above, above / "lib" / "auto-07p"]
    places.append(Path("/usr/lib/auto-07p"))
    return next((place / "lib" for place in places if (place / "lib" / "bvp.o").exists()), None)


def absent() -> str | None:
    """Why it cannot be run; None: it can."""
    if library() is None:
        return "no AUTO-07p: set AUTO_DIR to its folder, or install Debian's auto-07p"
    return None if shutil.which("gfortran") else "no gfortran to link AUTO's case"


def version() -> str:
    """As Debian names the package, or where it lies."""
    told = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", "auto-07p"], capture_output=True, text=True)
    compiler = subprocess.run(["gfortran", "-dumpfullversion"], capture_output=True, text=True, check=True)
    return f"AUTO-07p {told.stdout or os.environ.get('AUTO_VERSION', '0.9')}, gfortran {compiler.stdout.strip()} -O3"


@functools.cache
def program() -> Path:
    """The linked case, in a folder that goes with this process."""
    folder = tempfile.TemporaryDirectory(prefix="ribbonbench-auto-")
    _KEPT.append(folder)
    place = library()
    assert place is not None
    target = Path(folder.name) / "ribbon"
    # the objects that Debian brings are those of its own link (libauto_c.a: the C interface's)
    objects = sorted(str(path) for path in place.glob("*.o"))
    words = ["gfortran", "-O3", "-fopenmp", "-o", str(target), str(SOURCE), *objects]
    subprocess.run(words, check=True, cwd=folder.name, capture_output=True)
    return target


_KEPT: list[tempfile.TemporaryDirectory[str]] = []


def constants(settings: Settings) -> str:
    """AUTO's constants (its manual, chapter 10): steps are measured in the share alone (THU 0)."""
    thu = ", ".join(f"{k}: 0.0" for k in range(1, 8))
    return f"""
NDIM=7, IPS=4, IRS=0, ILP=0, ICP=[1], NTST={settings.intervals}, NCOL={settings.points}, IAD=3, ISP=0, ISW=1
IPLT=0, NBC=7, NINT=0, NMX=400, NPR=0, MXBF=0, IID=0, ITMX=8, ITNW=7, NWTN=3, JAC={int(settings.derivatives)}
RL0=-1.0, RL1=2.0, EPSL={settings.tolerance}, EPSU={settings.tolerance}, EPSS={10 * settings.tolerance}
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
        solution = _last(path.read_text()) if path.exists() else None
    return solution, used.ru_utime + used.ru_stime


def _last(text: str) -> tuple[FloatArray, FloatArray] | None:
    """The solution at the user's point (type -4) of a file fort.8."""
    lines = text.splitlines()
    at, found = 0, None
    while at < len(lines):
        head = [int(word) for word in lines[at].split()]
        kind, points, width, rows = head[2], head[6], head[7], head[8]
        if kind % -10 == -4:
            words = " ".join(lines[at + 1 : at + 1 + rows]).replace("D", "E").split()
            table = np.array(words[: points * width], float).reshape(points, width)
            found = table[:, 0], table[:, 1:7].T
        at += 1 + rows
    return found


def run(found: Case, settings: Settings) -> Run:
    """CPU time of a whole process; the free end's error is found afterwards and not timed."""
    solution, seconds = _run(found, settings)
    error = np.inf if solution is None else found.error(found.tip(*solution, settings.points))
    return Run(str(settings), error, seconds)


def best(found: Case) -> Settings:
    """The fastest of SEARCH whose free end is within the target; the fastest five are timed three times more."""
    good = []
    for points, (first, largest), tolerance in SEARCH:
        for intervals in INTERVALS:
            settings = Settings(intervals, points, first, largest, tolerance)
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
