"""What accuracy costs: error against time for ribbon, elastica and shell of one scene (work-precision).

Two errors, never mixed:

- `error`, of the discretisation: distance to the reference of the run's OWN model, a finer solution of the same
  equations. It falls to zero as the size grows.
- `distance`, to ONE common reference (by default the shell, which is the richer model). For another model it ends on a
  plateau, the difference of the models.

Every reference states its own error by a comparison with another fine solution; a row whose error is not above that
says so. References: the ribbon's largest glued size cut in four, against the same cut in eight; the elastica with
degree 4 on four times the elements, against its halves; the shell on its largest mesh with degree 3, against degree 2
on half as many elements more each way. The last is a bound as long as the reference is twice as accurate as that.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from compare.errors import BadInput
from compare.measure.distance import grid_hausdorff
from compare.models.ribbon_build import ribbon_problem
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.studies.cost_bench import Bench
from compare.studies.cost_plan import Cost, Plan, Reference, Row, model_of
from compare.studies.cost_runs import Kept, Run, machine, shell_of, sized
from ribbon import RibbonInputError

__all__ = ["Cost", "Plan", "available", "measure"]


def available(scene: Scene, plan: Plan) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The plan's solvers that the scene allows, and why others are left out."""
    found, why = [], []
    for solver in plan.solvers:
        reason: str | None = None
        if solver == "chained":
            if scene.path:
                reason = "a [[path]] is gone in the mixed model"
            else:
                try:
                    ribbon_problem(sized(scene, "chained", max(plan.segments)), "chained")
                except (RibbonInputError, BadInput) as error:
                    reason = str(error)
        elif solver == "placed" and scene.path:
            reason = "a [[path]] names its own segments"
        elif solver == "elastica":
            reason = scene.nonplanar_reason()
        elif solver == "shell" and not scene.has_shell() and plan.ratio is None:
            reason = "the scene has no thickness, or its supports are not a shell's"
        if reason is None:
            found.append(solver)
        else:
            why.append(f"{solver}: {reason}")
    if not found:
        raise BadInput("--solvers", ", ".join(plan.solvers), f"none can solve the scene ({'; '.join(why)})")
    return tuple(found), tuple(why)


def measure(scene: Scene, plan: Plan, folder: Path, reporter: Reporter, *, fresh: bool = False) -> Cost:
    """Runs the plan. Finished runs are kept in `folder` at once and found again on the same machine and versions.

    Raises `BadInput` where no solver can do the scene, or the common reference asked for cannot be had.
    """
    began = time.perf_counter()
    solvers, why = available(scene, plan)
    models = {model_of(solver) for solver in solvers}
    wanted = plan.reference
    if wanted != "own" and wanted not in models:
        raise BadInput(
            "--reference", wanted, f"is not among the models that are run ({', '.join(sorted(models))})",
            f"choose from {', '.join(sorted(models))}, own",
        )  # fmt: skip
    if "shell" in models:
        assert plan.ratio is not None
        for mesh in plan.meshes:  # what the shell refuses is said before anything is solved
            shell_of(scene, plan.ratio, mesh)
    bench = Bench(scene, plan, Kept(folder, fresh), reporter, began)
    references = []
    if "ribbon" in models:
        references.append(bench.ribbon_reference([s for s in solvers if model_of(s) == "ribbon"]))
    if "elastica" in models:
        references.append(bench.elastica_reference())
    if "shell" in models:
        references.append(bench.shell_reference())
    known = tuple(reference for reference in references if reference is not None)
    runs = [run for solver in solvers if solver != "shell" for run in bench.ladder(solver)]
    runs += bench.shells() if "shell" in solvers else []
    reporter.step("distances")
    common = next((r for r in known if r.model == wanted), None)
    rows = tuple(_row(run, known, common) for run in runs)
    starts = bench.starts(solvers, runs)
    left_out = (*why, *bench.left_out)
    return Cost(scene, plan, bench.base, bench.grid, rows, known, common, starts, left_out, machine())


def _row(run: Run, references: tuple[Reference, ...], common: Reference | None) -> Row:
    model = model_of(run.solver)
    own = next((r for r in references if r.model == model), None)
    return Row(run, model, *_errors(run, own), *_errors(run, common))


def _errors(run: Run, reference: Reference | None) -> tuple[float | None, float | None, bool | None]:
    """Hausdorff distance, distance of the ends, and whether the first is above the reference's own error."""
    if reference is None or run.points is None:
        return None, None, None
    far = grid_hausdorff(run.points, reference.points)
    middle = reference.points.shape[1] // 2
    end = run.end
    assert end is not None
    shown = None if reference.error is None else far > reference.error
    return far, float(np.linalg.norm(end - reference.points[-1, middle])), shown
