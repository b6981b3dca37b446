"""The three scenes of 3.5.2 from the natural shape: iterations and times beside the thesis's table 3.2, and errors."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.models import solve as solve_scene
from compare.models.base import Options
from compare.models.ribbon.solving import solver
from compare.models.ribbon.state import RibbonShape
from compare.scene.scene import Scene, load
from ribbon import Equilibrium, refine
from ribbon.find.solve import solve_from
from ribbon.solvers import choose
from tests.validation import one_core, page
from tests.validation.number import Number, rounding

#: Scene -> what table 3.2 gives for Ipopt with exact Hessian (steps, seconds) and for AUTO.
THESIS = {
    "coil_10_100": ("11, 0.09 s", "30, 0.11 s"),
    "coil_40_1200": ("23, 0.9 s", "45, 0.16 s"),
    "coil_100_7500": ("35, 5.8 s", "167, 0.9 s"),
}
FINEST = 320
#: Distance (in l) between p and 2 p segments above which the finer solve has left the branch.
JUMP = 0.03


def _reference(start: Equilibrium, grid: Grid) -> tuple[Equilibrium, bool, float, float]:
    """The finest solve reached by cutting segments in two, whether it stayed near at every cut, and the last cut's
    changes of shape (l) and of energy."""
    current, stayed, moved, energy = start, True, 0.0, 0.0
    while current.problem.lengths.size * 2 <= FINEST:
        finer = refine(current)
        moved = grid_hausdorff(grid.of(RibbonShape(current)), grid.of(RibbonShape(finer)))
        energy = abs(finer.energy.total - current.energy.total)
        stayed = stayed and moved < JUMP
        current = finer
    return current, stayed, moved, energy


def _nearest(coarse: Equilibrium, reference: Equilibrium) -> Equilibrium:
    """The solve on the coarse segments that starts from the reference's omega and eta at the joints."""
    joints = np.concatenate([[0.0], np.cumsum(coarse.problem.lengths)])
    joints[-1] = 1.0
    x = np.empty_like(coarse.x)
    for first, values in ((0, reference.omega(joints)), (1, reference.eta(joints))):
        x[first] = values[0]
        x[2 + first :: 2] = np.diff(values) / coarse.problem.lengths
    return solve_from(coarse.problem, x)


def _run(scene: Scene, minimiser: str) -> Equilibrium:
    """The scene from its natural shape by one of the minimisers."""
    return solve_scene(scene.replace({"model.solver": minimiser}), "ribbon", options=Options(repeats=0)).native


def _signed(name: str, sign: int) -> Scene:
    scene = load(name)
    return scene.replace({"strip.natural_curvature": scene.curvature[0] * sign})


@dataclass(frozen=True)
class Coil:
    """A scene's state by Ipopt and what it becomes on finer segments. error, near: distance (l) to the reference of
    the state and of the one nearest to it on as many segments, None where that is on another branch; moved, energy:
    last changes of the reference."""

    scene: Scene
    state: Equilibrium
    reference: Equilibrium
    stayed: bool
    error: float
    near: float
    near_ok: bool
    moved: float
    energy: float


@functools.cache
def coil(name: str, sign: int) -> Coil:
    """One of them, measured."""
    scene = _signed(name, sign)
    e = _run(scene, "ipopt")
    grid = Grid.for_shape(scene, 1.5 * abs(scene.curvature[0]))
    reference, stayed, moved, energy = _reference(e, grid)
    near = _nearest(e, reference)
    error, near_error = (grid_hausdorff(grid.of(RibbonShape(x)), grid.of(RibbonShape(reference))) for x in (e, near))
    if not (e.ok and reference.ok and e.residual < 1e-8):
        raise AssertionError(f"{scene.name}, K = {scene.curvature[0]:g}: {e.message}")
    return Coil(scene, e, reference, stayed, error, near_error, near.ok and near_error < JUMP, moved, energy)


PROBES = {
    "error_10_up": lambda: coil("coil_10_100", 1).error,
    "energy_10_up": lambda: coil("coil_10_100", 1).reference.energy.total,
}


def _measured(name: str, sign: int) -> tuple[list[str], dict[str, Number]]:
    """Row of the table, and the numbers of one of them."""
    found = coil(name, sign)
    e, reference, k = found.state, found.reference, found.scene.curvature[0]
    own, times = _run(found.scene, "auto"), {}
    for minimiser in ("ipopt", "auto"):
        with choose.using(minimiser):
            times[minimiser] = 1e3 * one_core.timed(solver(found.scene))[1]
    thesis, auto = THESIS[name]
    row = [
        f"{k:g}", f"{found.scene.gamma:g}", str(e.problem.lengths.size), str(e.iterations), f"{times['ipopt']:.3g}",
        str(own.iterations), f"{times['auto']:.3g}", f"{max(e.residual, own.residual):.0e}",
        f"{e.lowest_eigenvalue:.3f}", f"{e.energy.total:.4f}", f"{reference.energy.total:.4f}",
        f"{found.error:.1e}" if found.stayed else f"({found.error:.1e})", "yes" if found.stayed else "no",
        f"{found.near:.1e}" if found.near_ok else f"({found.near:.1e})", thesis, auto,
    ]  # fmt: skip
    ending = f"_{abs(k):.0f}_{'up' if sign > 0 else 'down'}"
    numbers = {
        "iterations": Number(e.iterations, 0, shown="d"),
        "newton_iterations": Number(own.iterations, 0, shown="d"),
        "ms": Number(times["ipopt"], None, "ms", ".3g", why="median CPU time of one machine"),
        "newton_ms": Number(times["auto"], None, "ms", ".3g", why="median CPU time of one machine"),
        "residual": rounding(max(e.residual, own.residual)),
        "energy": Number(reference.energy.total, found.energy, "D w / l", ".4f"),
    }
    if found.stayed:
        numbers["error"] = Number(found.error, found.moved, "l", ".1e")
    return row, {what + ending: number for what, number in numbers.items()}


def _over(numbers: dict[str, Number]) -> dict[str, Number]:
    """The least and the most of each over the scenes."""
    found: dict[str, Number] = {}
    for what in ("iterations", "newton_iterations", "ms", "newton_ms", "residual", "error"):
        these = sorted((n for name, n in numbers.items() if name.startswith(f"{what}_")), key=lambda n: n.value)
        found |= {f"{what}_least": these[0], f"{what}_most": these[-1]}
    return found


def run(out: Path) -> dict[str, Number]:
    rows, numbers = [], {}
    for name in THESIS:
        for sign in (1, -1):
            row, found = _measured(name, sign)
            rows.append(row)
            numbers.update(found)
    heads = [
        "K l", "Gamma", "p", "iterations", "ms", "by `solve`: iterations", "ms", "residual", "lowest eigenvalue",
        "energy", f"energy, p = {FINEST}", "error / l", "same branch", "error of the nearest at this p",
        "thesis: Ipopt", "thesis: AUTO",
    ]  # fmt: skip
    page.write(
        out / "coils.md", "The three scenes of 3.5.2", "python -m tests.validation coils",
        "Sadowsky's energy, from the natural shape, Ipopt with exact Hessian and the same options for all; beside it "
        "`solve` as it is, by its own Newton's method. ms: median "
        "CPU time of one solve, warm. residual: the larger one. error: Hausdorff distance, in l, to the solve on "
        f"{FINEST} segments that is reached by "
        "cutting segments in two from this one; in brackets where a cut moved the shape by more than "
        f"{JUMP} l (the finer space has left the branch: at K = 100 there are several minima and 20 segments are "
        "coarse). The column after it starts on the same p from the finest shape's omega and eta: the error of p "
        "segments on that branch, in brackets when that branch has no minimum at this p. The thesis's times are from "
        "another machine and stand for scale only.",
        page.table(heads, rows),
    )  # fmt: skip
    return numbers | _over(numbers)
