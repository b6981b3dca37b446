"""Thesis 7.1: the weight at which a strip on edge falls over, by inertia and by linearisation, on refined meshes."""

from __future__ import annotations

import functools
import time
from pathlib import Path

import numpy as np

from shellref import ShellProblem
from shellref.path.buckling import Buckling, buckling
from tests.validation import page
from tests.validation.number import Number

#: It takes no times that its page rests on.
ALONE = False

NU, H = 0.35, 1e-3
WIDTHS = (0.02, 0.05, 0.1)
MESHES = (((20, 4), 2), ((40, 8), 2), ((30, 6), 3), ((40, 8), 3))
#: The reference of the thesis (7.1), from a thick-shell code; and by how much the finest meshes may still differ.
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
    rows, worst = [], 0.0
    numbers: dict[str, Number] = {}
    for width in WIDTHS:
        last: Buckling | None = None
        met: list[tuple[float, float]] = []  # critical weight, by bisection and by linearisation
        for mesh, degree in MESHES:
            began = time.perf_counter()
            found = buckling(problem(width, H, mesh, degree, 0.5 * H))
            seconds = time.perf_counter() - began
            if found.critical is None or found.linearised is None:
                raise AssertionError(f"w = {width:g}: {found.message}")
            change = abs(found.critical / last.critical - 1) if last and last.critical else np.nan
            last = found
            met.append((found.critical, found.factor * found.linearised))
            low, high = (found.factor * x for x in found.bracket or (0.0, 0.0))
            kirchhoff = 18.17 * (1 - NU) * np.sqrt(1 + NU) * np.sqrt(torsion(width / H))
            rows.append([
                f"{width:g}", f"{H:g}", f"Q{degree} {mesh[0]} x {mesh[1]}", f"{found.critical:.4f}",
                f"{high - low:.0e}", f"{found.factor * found.linearised:.4f}", f"{found.difference:.0e}",
                f"{change:.1e}" if np.isfinite(change) else "", f"{published(width):.3f}",
                f"{100 * (found.critical / published(width) - 1):+.1f}", f"{kirchhoff:.3f}",
                f"{(found.critical - kirchhoff) / width:.1f}", f"{seconds:.0f}",
            ])  # fmt: skip
        worst = max(worst, change)
        name = f"{width:g}".replace(".", "")
        for k, kind in enumerate(("critical", "linearised")):
            values = [pair[k] for pair in met]
            numbers[f"{kind}_{name}"] = Number(values[-1], abs(values[-1] - values[-2]), "D w / l^2", ".4f")
            numbers[f"{kind}_{name}_coarse"] = Number(values[0], abs(values[1] - values[0]), "D w / l^2", ".4f")
        numbers[f"below_{name}"] = Number(100.0 * (1.0 - met[-1][0] / published(width)), 100.0 * change, "%", ".1f")
    page.write(
        out / "shell_lateral.md", "A strip on edge under its weight (thesis 7.1)",
        "python -m tests.validation shell_lateral",
        f"nu = {NU:g}, whole edge clamped. Critical weight Gamma: by bisection on the inertia (bracket width "
        "beside it) and "
        "by the linearised eigenproblem (SLEPc) from a state within 1e-4 of it; difference: relative. change: from the "
        "mesh above, the discretisation error. thesis: 18.2 (1 - nu) sqrt(1 + nu) + 14.5 w/l. Kirchhoff: 18.17 "
        "(1 - nu) "
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
    if not worst < CONVERGED:
        raise AssertionError(f"the critical weight still changes by {worst:.1e} between the finest meshes")
    below = [number for name, number in numbers.items() if name.startswith("below_")]
    pairs = [
        (number, numbers[name.replace("critical", "linearised")])
        for name, number in numbers.items()
        if name.startswith("critical_") and not name.endswith("_coarse")
    ]
    apart = max(abs(one.value / other.value - 1.0) for one, other in pairs)
    return numbers | {
        "worst_change": Number(worst, worst, shown=".1e"),
        "below_least": min(below, key=lambda number: number.value),
        "below_most": max(below, key=lambda number: number.value),
        "kinds_apart": Number(apart, apart + worst, shown=".0e"),
    }
