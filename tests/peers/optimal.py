"""CasADi with its own Ipopt and MUMPS (`control.py`), in a Python of their own: PEERS_PYTHON."""

from __future__ import annotations

import functools
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from tests.peers.cases import TARGET, Case, Run

SCRIPT = Path(__file__).with_name("control.py")
#: Tolerance of Ipopt; searched: intervals, degree of the collocation.
TOLERANCE = 1e-9
SEARCH = tuple((n, d) for d in (4, 5) for n in (10, 15, 20, 30, 45, 65, 90, 130, 180))


def python() -> str:
    """The peers' own Python."""
    return os.environ.get("PEERS_PYTHON", sys.executable)


@functools.cache
def absent() -> str | None:
    """Why it cannot be run; None: it can."""
    found = subprocess.run([python(), "-P", "-c", "import casadi"], capture_output=True)
    return (
        "no CasADi: PEERS_PYTHON names no Python that has it (tests/peers/requirements.txt)"
        if found.returncode
        else None
    )


def version() -> str:
    """Its version."""
    told = subprocess.run([python(), "-P", str(SCRIPT), "--version"], capture_output=True, text=True, check=True)
    return f"{told.stdout.strip()}, its own Ipopt and MUMPS"


def run(found: Case, settings: tuple[int, int], repeats: int = 1) -> Run:
    """Median CPU time of a warm solve, building the problem (once a structure) not counted."""
    given = {
        "gamma": found.gamma, "curvature": found.curvature, "poisson": found.poisson, "up": found.first_up.tolist(),
        "intervals": settings[0], "degree": settings[1], "repeats": repeats, "tolerance": TOLERANCE,
    }  # fmt: skip
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    words = [python(), "-P", str(SCRIPT)]
    done = subprocess.run(
        words, input=json.dumps(given) + "\n", capture_output=True, text=True, check=True, env=environment
    )
    answer = json.loads(done.stdout.splitlines()[-1])
    error = np.inf
    if answer["word"] == "Solve_Succeeded":
        s, y = np.array(answer["s"]), np.array(answer["y"])
        # M_2 is no unknown here, and the free end's place does not ask for it
        error = found.error(_tip(found, s, y, settings[1]))
    return Run(f"{settings[0]} intervals, Radau {settings[1]}", error, float(np.median(answer["seconds"])))


def _tip(found: Case, s: np.ndarray, y: np.ndarray, degree: int) -> np.ndarray:
    """r(1) - r(0): frames from omega and eta by their collocation polynomials (degree d - 1) on Gauss points."""
    from tests.reference.strong_form import _rotations

    frame, place = np.asarray(found.frame), np.zeros(3)
    nodes = np.array([-0.5773502691896257, 0.5773502691896257])
    for begin in range(0, s.size, degree):
        x, v = s[begin : begin + degree], y[3:5, begin : begin + degree]
        left = s[begin - 1] if begin else 0.0
        fit = [np.polynomial.Polynomial.fit(x, row, degree - 1) for row in v]
        parts = 16
        h = (x[-1] - left) / parts
        at = left + h * np.arange(parts)
        kappa = []
        for node in nodes:
            w, e = (p(at + 0.5 * h * (1 + node)) for p in fit)
            kappa.append(np.stack([w, np.zeros_like(w), e * w], axis=1))
        turn = 0.5 * h * (kappa[0] + kappa[1]) + np.sqrt(3) / 12 * h * h * np.cross(kappa[0], kappa[1])
        bend = -fit[0](left + h * np.arange(parts + 1))  # t_z' = -omega t_y
        for i, rotation in enumerate(_rotations(turn)):
            after = frame @ rotation
            ends = bend[i] * frame[:, 1] - bend[i + 1] * after[:, 1]
            place = place + 0.5 * h * (frame[:, 2] + after[:, 2]) + h * h / 12 * ends
            frame = after
    return place


def best(found: Case) -> tuple[int, int]:
    """The fastest of SEARCH whose free end is within the target."""
    good = []
    for degree in sorted({d for _, d in SEARCH}):
        for settings in (pair for pair in SEARCH if pair[1] == degree):
            tried = run(found, settings)
            if tried.error <= TARGET:
                good.append((run(found, settings, 3).seconds, settings))
                break
    if not good:
        raise AssertionError(f"{found.name}: CasADi reaches {TARGET:g} with none of {len(SEARCH)} settings")
    return min(good)[1]
