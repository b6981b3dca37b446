"""Thesis 7.1: the weight at which a strip on edge falls over, by inertia and by linearisation, on refined meshes."""

from __future__ import annotations

import functools
import time
from pathlib import Path

import numpy as np

from compare.measure.mesh_limit import Settled, settled
from shellref import ShellProblem
from shellref.path.buckling import Buckling, buckling
from tests.validation import page
from tests.validation.number import Number, of_settled

#: It takes no times that its page rests on.
ALONE = False

NU, H = 0.35, 1e-3
WIDTHS = (0.02, 0.05, 0.1)
#: Mesh and degree: three of one degree, each with elements half as long, and a higher degree as their judge.
MESHES = (((20, 4), 2), ((40, 8), 2), ((80, 16), 2), ((30, 6), 3))
#: By how much, relative, the limit may still be uncertain.
CONVERGED = 1e-3


def published(width: float) -> float:
    """18.2 (1 - nu) sqrt(1 + nu) + 14.5 w / l (thesis 7.1)."""
    return float(18.2 * (1 - NU) * np.sqrt(1 + NU) + 14.5 * width)


def torsion(ratio: float) -> float:
    """Torsion constant of a rectangle w x h over w h^3 / 3 (theory.md, section 6)."""
    k = np.arange(1, 200, 2)
    return float(1 - 192 / (np.pi**5 * ratio) * np.sum(np.tanh(k * np.pi * ratio / 2) / k**5))


def problem(width: float, thickness: float, mesh: tuple[int, int], degree: int, layer: float) -> ShellProblem:
    """A strip on edge; weight up to 1.3 times the published critical one."""
    return ShellProblem(
        width, thickness, NU, gamma=1.3 * published(width), up=(1.0, 0.0, 0.0), elements=mesh, degree=degree,
        edge_layer=layer,
    )  # fmt: skip


@functools.cache
def coarsest() -> Buckling:
    """w/l = 0.05 on the coarsest mesh."""
    mesh, degree = MESHES[0]
    return buckling(problem(WIDTHS[1], H, mesh, degree, 0.5 * H))


PROBES = {
    "critical_005_coarse": lambda: float(coarsest().critical or 0.0),
    "linearised_005_coarse": lambda: coarsest().factor * float(coarsest().linearised or 0.0),
}


def run(out: Path) -> dict[str, Number]:
    rows: list[list[str]] = []
    numbers: dict[str, Number] = {}
    limits: dict[float, Settled] = {}
    judged = 0.0
    for width in WIDTHS:
        met: list[Buckling] = []
        for mesh, degree in MESHES:
            began = time.perf_counter()
            met.append(buckling(problem(width, H, mesh, degree, 0.5 * H)))
            seconds = time.perf_counter() - began
            rows.append(_row(width, f"Q{degree} {mesh[0]} x {mesh[1]}", met, seconds))
        by_inertia = [_weights(found)[0] for found in met[:-1]]
        limits[width] = settled(by_inertia, max(_bracket(found) for found in met[:-1]))
        judge = _weights(met[-1])[0]
        judged = max(judged, abs(judge / limits[width].value - 1.0))
        numbers |= _numbers(width, met, limits[width])
    page.write(
        out / "shell_lateral.md", "A strip on edge under its weight (thesis 7.1)",
        "python -m tests.validation shell_lateral",
        f"Gamma_c over three meshes: {'; '.join(f'w/l = {w:g}: {one.text}' for w, one in limits.items())}. Elements of "
        f"degree 3 are within {judged:.0e} of these, relative.",
        f"nu = {NU:g}, whole edge clamped. Critical weight Gamma: by bisection on the inertia (bracket width "
        "beside it) and "
        "by the linearised eigenproblem (SLEPc) from a state within 1e-4 of it; difference: relative. change: from the "
        "mesh above. thesis: 18.2 (1 - nu) sqrt(1 + nu) + 14.5 w/l. Kirchhoff: 18.17 (1 - nu) "
        "sqrt(1 + nu) sqrt(J / (w h^3 / 3)), the rod with the torsion constant J of its rectangle; slope: (this - "
        "Kirchhoff) / (w / l), 14.5 in the thesis's fit.",
        page.table(
            ["w/l", "h/l", "mesh", "Gamma_c", "bracket", "linearised", "difference", "change", "thesis", "to it %",
             "Kirchhoff", "slope", "s"], rows,
        ),
        "The shell lies below the thesis's line. Its fit has the limit of a thin rod's torsion (J = w h^3 / 3) "
        "at w = 0; at "
        "h/l = 1e-3 a strip of w/l = 0.02 has w/h = 20 and loses 3 % of J, 1.6 % of the critical weight. With that "
        "counted, what the width adds is the slope column.",
    )  # fmt: skip
    worst = max(one.error / one.value for one in limits.values())
    if not (worst < CONVERGED and judged < CONVERGED and all(one.settles for one in limits.values())):
        raise AssertionError(f"critical weights: {limits}, those of degree 3 {judged:.1e} away")
    below = [number for name, number in numbers.items() if name.startswith("below_")]
    apart = max(number.value for name, number in numbers.items() if name.startswith("apart_"))
    return {name: number for name, number in numbers.items() if not name.startswith("apart_")} | {
        "worst_change": Number(worst, worst, shown=".1e"),
        "degree_apart": Number(judged, judged + worst, shown=".0e"),
        "below_least": min(below, key=lambda number: number.value),
        "below_most": max(below, key=lambda number: number.value),
        "kinds_apart": Number(apart, apart + worst, shown=".0e"),
    }


def _weights(found: Buckling) -> tuple[float, float]:
    """Critical weight by bisection and by linearisation. Raises AssertionError where there is none."""
    if found.critical is None or found.linearised is None:
        raise AssertionError(found.message)
    return float(found.critical), float(found.factor * found.linearised)


def _bracket(found: Buckling) -> float:
    """Width of the bracket of the bisection (D w / l^2)."""
    low, high = (found.factor * x for x in found.bracket or (0.0, 0.0))
    return float(high - low)


def _row(width: float, mesh: str, met: list[Buckling], seconds: float) -> list[str]:
    """The page's row of the last of `met`."""
    found = met[-1]
    critical, linearised = _weights(found)
    change = f"{abs(critical / _weights(met[-2])[0] - 1.0):.1e}" if len(met) > 1 else ""
    kirchhoff = 18.17 * (1 - NU) * np.sqrt(1 + NU) * np.sqrt(torsion(width / H))
    return [
        f"{width:g}", f"{H:g}", mesh, f"{critical:.4f}", f"{_bracket(found):.0e}", f"{linearised:.4f}",
        f"{found.difference:.0e}", change, f"{published(width):.3f}",
        f"{100 * (critical / published(width) - 1):+.1f}", f"{kirchhoff:.3f}",
        f"{(critical - kirchhoff) / width:.1f}", f"{seconds:.0f}",
    ]  # fmt: skip


def _numbers(width: float, met: list[Buckling], limit: Settled) -> dict[str, Number]:
    """Of one width: the limit, how far below the thesis's line it lies, both kinds on the coarsest mesh with the change
    to the next, and how far the kinds are apart on any mesh."""
    name = f"{width:g}".replace(".", "")
    coarse, finer = (_weights(found) for found in met[:2])
    found = {
        f"critical_{name}": of_settled(limit.record("D w / l^2")),
        f"below_{name}": Number(
            100.0 * (1.0 - limit.value / published(width)), 100.0 * limit.error / published(width), "%", ".1f"
        ),
        f"apart_{name}": Number(max(abs(a / b - 1.0) for a, b in map(_weights, met)), 0.0),
    }
    for kind, value, other in zip(("critical", "linearised"), coarse, finer, strict=True):
        found[f"{kind}_{name}_coarse"] = Number(value, abs(value - other), "D w / l^2", ".4f")
    return found
