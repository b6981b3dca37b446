"""The three scenes of 3.5.2 from the natural shape: iterations and times beside the thesis's table 3.2, and errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.models import solve as solve_scene
from compare.models.base import Options
from compare.models.ribbon.state import RibbonShape
from compare.scene.scene import Scene, load
from ribbon import Equilibrium, refine
from ribbon.find.solve import solve_from
from tests.validation import page

#: Scene -> what table 3.2 gives for Ipopt with exact Hessian (steps, seconds) and for AUTO.
THESIS = {
    "coil_10_100": ("11, 0.09 s", "30, 0.11 s"),
    "coil_40_1200": ("23, 0.9 s", "45, 0.16 s"),
    "coil_100_7500": ("35, 5.8 s", "167, 0.9 s"),
}
FINEST = 320
#: Distance (in l) between p and 2 p segments above which the finer solve has left the branch.
JUMP = 0.03


def _reference(start: Equilibrium, grid: Grid) -> tuple[Equilibrium, bool]:
    """The finest solve reached by cutting segments in two, and whether it stayed near at every cut."""
    current, stayed = start, True
    while current.problem.lengths.size * 2 <= FINEST:
        finer = refine(current)
        stayed = stayed and grid_hausdorff(grid.of(RibbonShape(current)), grid.of(RibbonShape(finer))) < JUMP
        current = finer
    return current, stayed


def _nearest(coarse: Equilibrium, reference: Equilibrium) -> Equilibrium:
    """The solve on the coarse segments that starts from the reference's omega and eta at the joints."""
    joints = np.concatenate([[0.0], np.cumsum(coarse.problem.lengths)])
    joints[-1] = 1.0
    x = np.empty_like(coarse.x)
    for first, values in ((0, reference.omega(joints)), (1, reference.eta(joints))):
        x[first] = values[0]
        x[2 + first :: 2] = np.diff(values) / coarse.problem.lengths
    return solve_from(coarse.problem, x)


def _row(scene: Scene, sign: int) -> list[str]:
    k = scene.curvature[0] * sign
    run = solve_scene(scene.replace({"strip.natural_curvature": k}), "ribbon", options=Options(repeats=None))
    e = run.native
    grid = Grid.for_shape(scene, 1.5 * abs(k))
    reference, stayed = _reference(e, grid)
    error = grid_hausdorff(grid.of(RibbonShape(e)), grid.of(RibbonShape(reference)))
    near = _nearest(e, reference)
    near_error = grid_hausdorff(grid.of(RibbonShape(near)), grid.of(RibbonShape(reference)))
    if not (e.ok and reference.ok and e.residual < 1e-8):
        raise AssertionError(f"{scene.name}, K = {k:g}: {e.message}")
    thesis, auto = THESIS[scene.name]
    return [
        f"{k:g}", f"{scene.gamma:g}", str(e.problem.lengths.size), str(e.iterations), f"{run.seconds.warm * 1e3:.3g}",
        f"{e.residual:.0e}", f"{e.lowest_eigenvalue:.3f}", f"{e.energy.total:.4f}", f"{reference.energy.total:.4f}",
        f"{error:.1e}" if stayed else f"({error:.1e})", "yes" if stayed else "no",
        f"{near_error:.1e}" if near.ok and near_error < JUMP else f"({near_error:.1e})", thesis, auto,
    ]  # fmt: skip


def run(out: Path) -> None:
    rows = [_row(load(name), sign) for name in THESIS for sign in (1, -1)]
    heads = [
        "K l", "Gamma", "p", "iterations", "ms", "residual", "lowest eigenvalue", "energy", f"energy, p = {FINEST}",
        "error / l", "same branch", "error of the nearest at this p", "thesis: Ipopt", "thesis: AUTO",
    ]  # fmt: skip
    page.write(
        out / "coils.md", "The three scenes of 3.5.2", "python -m tests.validation coils",
        "Sadowsky's energy, from the natural shape, Ipopt with exact Hessian and the same options for all. ms: median "
        "warm time of one solve. error: Hausdorff distance, in l, to the solve on 320 segments that is reached by "
        "cutting segments in two from this one; in brackets where a cut moved the shape by more than "
        f"{JUMP} l (the finer space has left the branch: at K = 100 there are several minima and 20 segments are "
        "coarse). The column after it starts on the same p from the finest shape's omega and eta: the error of p "
        "segments on that branch, in brackets when that branch has no minimum at this p. The thesis's times are from "
        "another machine and stand for scale only.",
        page.table(heads, rows),
    )  # fmt: skip
