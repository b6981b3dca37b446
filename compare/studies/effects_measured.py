"""Whole solves of a scene with each of its effects switched off alone: iterations, warm time, how far the shape moves.

The shape's move is the Hausdorff distance (over l) between the surfaces with and without the effect; where nothing
resists rigid motions they are taken out (`_laid_on`). Beside it stands the discretisation error of the scene's own
ribbon: a move below it is none that the model could show.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from compare.errors import BadInput
from compare.measure.align import aligned
from compare.measure.distance import grid_hausdorff
from compare.models.ribbon_run import RibbonRun, run_ribbon
from compare.models.shell_build import FIRST_ELEMENTS, shell_elements, shell_options, shell_problem
from compare.models.shell_process import ShellCase, run_shell
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import Grid, ribbon_discretisation_error
from compare.studies.effects import Explanation
from compare.studies.effects_off import refused, without
from ribbon import Equilibrium, RibbonInputError

#: Warm time (s) of the scene's own solve up to which those without each effect are made unasked.
CHEAP = 0.5
#: Effects that the shell has too, and that can be off in it.
SHELL_EFFECTS = ("gravity", "natural curvature", "clamp at the end")
_SOLVED = ("converged", "saddle")


@dataclass(frozen=True)
class Without:
    """A solve with one effect off. first, warm in s; moved: Hausdorff / l to the scene's own shape, None: no shape.

    iterations: of all solves of a path, of the last one for placed segments; reason: why there was no solve, or "".
    """

    status: str
    iterations: int | None
    first: float | None
    warm: float | None
    moved: float | None
    reason: str = ""


@dataclass(frozen=True)
class Solves:
    """The scene's own run with its discretisation error (Hausdorff / l; None: unknown), and those without an effect.

    without: by name of the effect, empty when they were not made (too long unasked).
    """

    run: RibbonRun
    error: float | None
    grid: Grid
    without: Mapping[str, Without]


def iterations(run: RibbonRun) -> int:
    """Iterations of the minimiser, over all steps of a path."""
    if run.way is None:
        return run.equilibrium.iterations
    return sum(int(entry["iterations"] or 0) for entry in run.equilibrium.log)


def solves(scene: Scene, found: Explanation, reporter: Reporter, *, always: bool | None = None) -> Solves:
    """Solves the scene, and again without each effect that is on and can be off alone.

    always: True, False, or None for: when the scene's own solve takes less than `CHEAP`.
    """
    own = run_ribbon(scene, reporter.step, detail=reporter.detail)
    equilibrium = own.equilibrium
    sample = np.linspace(0.0, 1.0, 2001)
    grid = Grid.for_shape(scene, float(np.abs(equilibrium.omega(sample)).max()))
    error = ribbon_discretisation_error(equilibrium, grid, reporter)
    if always is False or (always is None and own.warm > CHEAP):
        return Solves(own, error, grid, {})
    points = grid.ribbon(equilibrium) if equilibrium.status.code in _SOLVED else None
    table: dict[str, Without] = {}
    for effect in found.effects:
        if effect.on and not effect.fixed:
            reporter.step(f"without {effect.name}")
            table[effect.name] = _solved(scene, effect.name, own, grid, points, reporter)
    return Solves(own, error, grid, table)


def _solved(
    scene: Scene, name: str, own: RibbonRun, grid: Grid, points: np.ndarray | None, reporter: Reporter
) -> Without:
    """The scene without the effect `name` beside its own surface `points` (k, m, 3)."""
    problem = own.equilibrium.problem
    try:
        off = without(scene, name, problem.formulation, problem.lengths.size)
        if off.scene is None:
            return Without("not solved", None, None, None, None, off.reason)
        run = run_ribbon(off.scene, detail=reporter.detail)
    except (BadInput, RibbonInputError) as refusal:
        return Without("not solved", None, None, None, None, refused(refusal))
    e = run.equilibrium
    moved = None
    if points is not None and e.status.code in _SOLVED:
        moved = grid_hausdorff(points, _laid_on(off.scene, grid.ribbon(e), points, e))
    return Without(e.status.code, iterations(run), run.first, run.warm, moved)


def _laid_on(scene: Scene, moved: np.ndarray, points: np.ndarray, e: Equilibrium) -> np.ndarray:
    """The surface `moved` (k, m, 3) of `e` laid on `points` as far as nothing resists; where no clamp holds, any way.

    (Without its weight a strip beside a wall may be anywhere.)
    """
    if scene.clamp_start is not None or scene.clamp_end is not None:
        return aligned(moved, points, e)
    a, b = moved.reshape(-1, 3), points.reshape(-1, 3)
    middles = a.mean(axis=0), b.mean(axis=0)
    turn = Rotation.align_vectors(b - middles[1], a - middles[0])[0]
    return (turn.apply(a - middles[0]) + middles[1]).reshape(points.shape)


@dataclass(frozen=True)
class ShellWithout:
    """A shell with one effect off ("": with all). seconds: of the solve; moved: Hausdorff / l to that with all."""

    name: str
    status: str
    iterations: int | None
    seconds: float | None
    moved: float | None
    error: float | None = None
    reason: str = ""


@dataclass(frozen=True)
class ShellSolves:
    """Shells of one w/h on one mesh (along, across), the first with all effects; its error: to half the mesh."""

    width_to_thickness: float
    elements: tuple[int, int]
    rows: tuple[ShellWithout, ...]


def shells(scene: Scene, found: Explanation, grid: Grid, store: CaseStore, reporter: Reporter) -> ShellSolves:
    """Solves the scene's thickest shell, on a mesh of `FIRST_ELEMENTS` at most, and again without each effect it has.

    Raises `BadInput` for a scene without a shell.
    """
    ratio = min(scene.require_shell())
    asked = shell_elements(scene)
    mesh = min(asked[0], FIRST_ELEMENTS[0]), min(asked[1], FIRST_ELEMENTS[1])
    half = max(1, mesh[0] // 2), max(1, mesh[1] // 2)

    def solved(of: Scene, elements: tuple[int, int]) -> ShellCase:
        plain = of.replace({"shell.tolerance": None})
        return run_shell(shell_problem(plain, ratio, elements), store, shell_options(plain), reporter.detail)

    reporter.step(f"shell: w/h = {ratio:g}, {mesh[0]} x {mesh[1]} elements")
    own, coarse = solved(scene, mesh), solved(scene, half)
    points = grid.shell(own) if own.ok else None
    error = grid_hausdorff(points, grid.shell(coarse)) if points is not None and coarse.ok else None
    rows = [ShellWithout("", own.status, own.data.get("newton_iterations"), own.seconds, None, error)]
    for effect in found.effects:
        if not effect.on or effect.name not in SHELL_EFFECTS:
            continue
        reporter.step(f"shell: without {effect.name}")
        try:
            off = without(scene, effect.name, found.formulation)
            case = solved(off.scene or scene, mesh)
        except BadInput as refusal:
            rows.append(ShellWithout(effect.name, "not solved", None, None, None, None, refused(refusal)))
            continue
        moved = grid_hausdorff(points, grid.shell(case)) if points is not None and case.ok else None
        rows.append(ShellWithout(effect.name, case.status, case.data.get("newton_iterations"), case.seconds, moved))
    return ShellSolves(ratio, mesh, tuple(rows))
