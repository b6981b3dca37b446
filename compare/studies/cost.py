"""What accuracy costs: error against time for all models of one scene (work-precision).

Two errors, never mixed:

- `error`, of the discretisation: distance to the reference of the run's OWN model, a finer solution of the same
  equations. It falls to zero as the size grows.
- `distance`, to ONE common reference (by default the shell, which is the richer model). For another model it ends on a
  plateau, the difference of the models.

Every reference states its own error by a comparison with another fine solution; a row whose error is not above that
says so. What a model's reference is, and what it is compared with, is the model's own affair
(`compare.models.base.Model.reference`), or the usual one (`compare.models.reference`).

Every model answers the scene as `compare` has it answer: from its own seed and path, or on the branch of the model
beside the shells where the scene may have several equilibria.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from compare.measure.distance import grid_hausdorff
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.studies.cost_bench import Bench
from compare.studies.cost_plan import OWN, Cost, Entry, Plan, Reference, Row, chosen
from compare.studies.cost_runs import CachedRun, Run, machine
from ribbonbench.errors import BadInput

__all__ = ["Cost", "Plan", "available", "measure"]


def available(scene: Scene, plan: Plan) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The names of the plan's ladders that the scene allows, and why others are left out."""
    found, why = chosen(scene, plan)
    return tuple(entry.ladder.name for entry in found), why


def measure(scene: Scene, plan: Plan, folder: Path, reporter: Reporter, *, fresh: bool = False) -> Cost:
    """Runs the plan. Finished runs are kept in `folder` at once and found again on the same machine and versions.

    Raises `BadInput` where no model can do the scene, or the common reference asked for cannot be had.
    """
    began = time.perf_counter()
    entries, why = chosen(scene, plan)
    models: dict[str, list[Entry]] = {}
    for entry in entries:
        models.setdefault(entry.model.name, []).append(entry)
    wanted = plan.reference
    if wanted != OWN and wanted not in models:
        raise BadInput(
            "--reference", wanted, f"is not among the models that are run ({', '.join(sorted(models))})",
            f"choose from {', '.join(sorted(models))}, {OWN}",
        )  # fmt: skip
    bench = Bench(scene, plan, CachedRun(folder, fresh), reporter, began)
    references = {name: bench.reference(mine) for name, mine in models.items()}
    known = tuple(reference for reference, _ in references.values() if reference is not None)
    runs: list[Run] = []
    for name in sorted(models, key=lambda name: name in bench.apart):  # the quick ones first: the budget is for all
        runs += [run for entry in models[name] for run in bench.ladder(entry)]
        against = references[name][1]
        runs += [] if against is None else [against]
    starts = bench.starts(entries, runs)
    reporter.step("distances")
    common = next((r for r in known if r.model == wanted), None)
    rows = tuple(_row(run, known, common) for run in runs)
    left_out = (*why, *bench.left_out)
    return Cost(scene, plan, bench.base, bench.grid, rows, known, common, starts, left_out, machine())


def _row(run: Run, references: tuple[Reference, ...], common: Reference | None) -> Row:
    own = next((r for r in references if r.model == run.model), None)
    return Row(run, run.model, *_errors(run, own), *_errors(run, common))


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
