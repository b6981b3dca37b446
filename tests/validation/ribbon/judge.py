"""Every shipped ribbon as `solve` gives it, by Newton's method and by Ipopt, its judge: one state, two times."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.ribbon.build import ribbon_energy
from compare.models.ribbon.solving import solver
from compare.scene.scene import Scene, load, shipped
from ribbon import Equilibrium
from ribbon.energies.names import FREE, NAMES
from ribbon.solvers import choose
from tests.validation import one_core, page
from tests.validation.number import Number, rounding

_POINTS = 201
#: The scene's own symmetries, by which one state may be the other's image: signs of x, y, z, and s -> l - s.
IMAGES = {"roman_folds": ((1.0, 1.0, -1.0), True)}


def scenes() -> dict[str, Scene]:
    """The shipped scenes that the ribbon solves."""
    found = {name: load(name) for name in shipped()}
    return {name: scene for name, scene in found.items() if ribbon_energy(scene) in (*NAMES, *FREE)}


def states(scene: Scene) -> dict[str, tuple[Equilibrium, float]]:
    """Solver -> the scene's state and the CPU time (s)."""
    found = {}
    for name in ("auto", "ipopt"):
        begun = time.process_time()
        with choose.using(name):
            state = solver(scene)()
        found[name] = state, time.process_time() - begun
    return found


def apart(name: str, one: Equilibrium, other: Equilibrium) -> float:
    """Largest distance (l) of points of the two centrelines, of the nearer image where the scene has one."""
    s = np.linspace(0.0, 1.0, _POINTS)
    a, b = one.position(s), other.position(s)
    best = float(np.abs(a - b).max())
    if name in IMAGES:
        signs, turned = IMAGES[name]
        image: Any = b * np.array(signs)
        image = image[::-1] if turned else image
        best = min(best, float(np.abs(a - image - (a - image).mean(axis=0)).max()))
    return best


def _energy(name: str) -> float:
    """Energy of a scene's state as `solve` gives it."""
    return solver(load(name))().energy.total


PROBES = {
    f"energy_{name}": partial(_energy, name)
    for name in ("arc_5_1", "coil_40_1200", "daisy_10g", "start_5_3_3_4", "two_clamps_5_3_2")
}


def _measured() -> tuple[list[list[str]], dict[str, Number], dict[str, list[float]]]:
    """Rows of the table, the energies, and what is told of all: distances and ratios of times."""
    rows, energies, over = [], {}, {"apart": [], "ratio": []}  # type: ignore[var-annotated]
    for name, scene in scenes().items():
        states(scene)  # compiles
        found = states(scene)
        (newton, quick), (ipopt, slow) = found["auto"], found["ipopt"]
        codes = " / ".join(dict.fromkeys(state.status.code for state, _ in found.values()))
        rows.append([
            name, str(newton.problem.lengths.size), newton.problem.formulation, codes,
            f"{apart(name, newton, ipopt):.1e}", f"{newton.energy.total:.10g}", f"{ipopt.energy.total:.10g}",
            f"{1e3 * quick:.1f}", f"{1e3 * slow:.1f}", f"{slow / quick:.1f}",
        ])  # fmt: skip
        over["apart"].append(apart(name, newton, ipopt))
        over["ratio"].append(slow / quick)
        energy, other = newton.energy.total, ipopt.energy.total
        energies[f"energy_{name}"] = Number(
            energy, max(1e-8 * abs(energy), 2.0 * abs(energy - other)), "D w / l", ".9g"
        )
        print(" ".join(rows[-1]), flush=True)
    return rows, energies, over


def run(out: Path) -> dict[str, Number]:
    """Writes judge.md."""
    rows, energies, over = one_core.call(_measured)
    heads = [
        "scene", "p", "model", "status", "apart (l)", "energy, Newton", "energy, Ipopt", "Newton (CPU ms)",
        "Ipopt (CPU ms)", "ratio",
    ]  # fmt: skip
    page.write(
        out / "judge.md", "The shipped ribbons by Newton's method and by Ipopt", "python -m tests.validation judge",
        "Each as `solve` gives it (its path, closure, walls, stability and search for a lower state included), with "
        'model.solver = "auto" and "ipopt". apart: largest distance of the centrelines, mirror images being one '
        "(`roman_folds`, which has two of one energy). Both converge to a gradient of 1e-08 (D w / l).",
        f"{len(rows)} scenes.",
        page.table(heads, rows),
    )  # fmt: skip
    why = "CPU times of one run"
    return energies | {
        "scenes": Number(len(rows), 0, shown="d"),
        "apart": rounding(max(over["apart"]), "l", ".1e"),
        "ratio_least": Number(min(over["ratio"]), None, shown=".1f", why=why),
        "ratio_most": Number(max(over["ratio"]), None, shown=".1f", why=why),
    }
