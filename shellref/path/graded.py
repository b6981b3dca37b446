"""A mesh that reaches an accuracy of an asked quantity: columns and rows are cut where its error comes from.

Dual-weighted estimates (shellref.path.weighted) say how far the quantity is from that of the mesh cut in two along, and
across, and how much of it each column (row) is to blame for. Where a direction's part is over half of what is allowed,
the columns (rows) with the largest indicators are cut in two, as few as carry `BULK` of their sum (Doerfler 1996,
doi:10.1137/0733054); all of them where the mesh is too coarse for one linear step to tell. The solve on the new mesh
begins at the state of the old one.

Estimate: the sum of both directions' changes over 3/4, as in shellref.path.adaptive.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from shellref.path.solver import Solver
from shellref.path.weighted import Estimate, Weighted
from shellref.shell.result import ShellResult, ShellStatus
from shellref.shell.strip import build_strip

SAFETY = 4.0 / 3.0
#: Part of the sum of indicators that is cut.
BULK = 0.8
#: Most meshes on the way.
MOST_MESHES = 30


def bulk(each: np.ndarray) -> np.ndarray:
    """Mask (n,) of the largest, as few as have `BULK` of the sum."""
    order = np.argsort(-each, kind="stable")
    count = int(np.searchsorted(np.cumsum(each[order]), BULK * each.sum())) + 1
    mask = np.zeros(len(each), dtype=bool)
    mask[order[:count]] = True
    return mask


def cut(estimate: Estimate, allowed: float) -> np.ndarray:
    """Parts (n,), 1 or 2, of the columns or rows of a direction whose change may be `allowed`."""
    if estimate.size <= allowed:
        return np.ones(len(estimate.indicators), dtype=int)
    return np.where(bulk(estimate.each) if estimate.sharp else True, 2, np.ones(len(estimate.indicators), dtype=int))


def refine(result: ShellResult, solver: Solver) -> ShellResult:
    """Refine from a converged result until the estimated error of `options.goal` is below `options.accuracy`, or
    max_cells are reached.

    `discretisation`: goal, estimate, the meshes tried, and of the last one its knots with the indicators of columns and
    rows. Raises ShellInputError where there is no estimate (weighted.check).
    """
    options = solver.options
    accuracy = options.accuracy
    assert accuracy is not None
    rows: list[dict[str, Any]] = []
    while True:
        row, parts = judged(result, solver, accuracy)
        rows.append(row)
        solver.report({"event": "mesh", **{k: row[k] for k in ("elements", "along", "across", "estimate")}})
        grid = solver.model.grid.refined(*parts)
        done = row["estimate"] <= accuracy
        if done or grid.cells > options.max_cells or len(rows) == MOST_MESHES:
            break
        strip = build_strip(solver.strip.problem, options, grid=grid)
        finer = Solver(strip, options, solver.comm, solver.report)
        found = finer.run(result.surface)
        if found.status is not ShellStatus.CONVERGED:
            found = Solver(strip, options, solver.comm, solver.report).run()  # the whole path on this mesh
        if found.status is not ShellStatus.CONVERGED:
            message = f"no equilibrium on the refined mesh {found.elements}: {found.message}"
            return dataclasses.replace(result, status=ShellStatus.NOT_CONVERGED, message=message)
        result = dataclasses.replace(
            found,
            steps=result.steps + found.steps,
            newton_iterations=result.newton_iterations + found.newton_iterations,
            factorisations=result.factorisations + row["factorisations"] + found.factorisations,
        )
        solver = finer
    grid = solver.model.grid
    report = {
        "accuracy": accuracy,
        "goal": options.goal,
        "reached": done,
        "estimate": rows[-1]["estimate"],
        "s_knots": grid.s_knots.tolist(),
        "v_knots": grid.v_knots.tolist(),
        "columns": rows[-1].pop("columns"),
        "rows": rows[-1].pop("rows"),
        "meshes": [{k: v for k, v in row.items() if k not in ("columns", "rows")} for row in rows],
    }
    limit = f"max_cells = {options.max_cells}" if len(rows) < MOST_MESHES else f"{MOST_MESHES} meshes"
    note = "" if done else f"; accuracy {accuracy:g} not reached within {limit}"
    return dataclasses.replace(result, discretisation=report, message=result.message + note)


def judged(result: ShellResult, solver: Solver, accuracy: float) -> tuple[dict[str, Any], list[Any]]:
    """The row of a mesh: changes along and across and their estimate (in l; of the energy over the elastic one), and
    into how many parts its columns and rows are to be cut."""
    weighted = Weighted(result, solver)
    scale = 1.0 if solver.options.goal != "energy" else 1.0 / result.energy["elastic"]
    found = [weighted.direction(axis) for axis in (0, 1)]
    sizes = [scale * x.size for x in found]
    estimate = SAFETY * sum(sizes)
    half = 0.5 * accuracy / (SAFETY * scale)
    parts = [cut(x, half).tolist() for x in found]
    row = {
        "elements": list(result.elements),
        "along": sizes[0],
        "across": sizes[1],
        "change": [(scale * x.change).tolist() for x in found],
        "sharp": [x.sharp for x in found],
        "estimate": estimate,
        "share": dict(result.share),
        "factorisations": weighted.factorisations,
        "columns": (scale * found[0].each).tolist(),
        "rows": (scale * found[1].each).tolist(),
    }
    return row, parts
