"""A mesh that reaches an accuracy: hierarchical refinement along and across, each with its own error estimate.

The state on the mesh is compared with the states on the meshes cut in two along and across (nested; started from the
interpolated state, so a few Newton iterations each). The larger distances say which direction to refine. Where the
error falls at least fourfold with a cut, the distance to the finer state is 3/4 of the coarser one's error or more; the
estimate is the sum of both distances over 3/4.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from shellref.path.solver import Solver
from shellref.shell.result import ShellResult, ShellStatus
from shellref.shell.strip import build_strip
from shellref.shell.surface import ShellSurface

SAFETY = 4.0 / 3.0
#: Numbers of `ShellResult.walls` that have an error.
OF_WALLS = ("force", "moment", "gap", "mean_pressure", "greatest_pressure")


def gap(one: ShellSurface, other: ShellSurface) -> float:
    """Largest distance between two surfaces at equal material points, on 201 x 17 of them (units l)."""
    s, v = np.linspace(0.0, 1.0, 201), np.linspace(one.v_nodes[0], one.v_nodes[-1], 17)
    return float(np.max(np.linalg.norm(one.grid(s, v) - other.grid(s, v), axis=-1)))


def _errors(result: ShellResult, along: ShellResult, across: ShellResult) -> dict[str, float]:
    """Error of what is told of a result, as that of its surface: by dotted name ("energy.total", "forces.start",
    "moments.end", "gaps.walls.0", "lowest_eigenvalue") the sum of the changes (of a vector its 2-norm) in both
    directions over 3/4."""

    def numbers(of: ShellResult) -> dict[str, np.ndarray]:
        found: dict[str, Any] = {f"energy.{name}": value for name, value in of.energy.items()}
        for where, clamp in of.clamps.items():
            found |= {f"forces.{where}": clamp["force"], f"moments.{where}": clamp["moment"]}
        for k, wall in enumerate(of.walls):
            told = {f"{kind}s.walls.{k}": wall[kind] for kind in OF_WALLS}
            found |= {name: value for name, value in told.items() if value is not None}
        if of.lowest_eigenvalue is not None:
            found["lowest_eigenvalue"] = of.lowest_eigenvalue
        return {name: np.atleast_1d(np.asarray(value, dtype=float)) for name, value in found.items()}

    own, *others = (numbers(one) for one in (result, along, across))
    known = [name for name in own if all(name in other for other in others)]
    return {name: SAFETY * sum(float(np.linalg.norm(other[name] - own[name])) for other in others) for name in known}


def refine(result: ShellResult, solver: Solver) -> ShellResult:
    """Refine from a converged result until the estimated error is below `options.accuracy`, or max_cells are reached.

    `discretisation` states the estimate for the mesh of the result, and the meshes tried; the two finer ones that the
    last estimate rests on are not kept, and may have twice max_cells.
    """
    options = solver.options
    accuracy = options.accuracy
    assert accuracy is not None
    factors, rows = (1, 1), []

    def solved(near: ShellResult, cuts: tuple[int, int]) -> ShellResult:
        strip = build_strip(solver.strip.problem, options, cuts)
        other = Solver(strip, options, solver.comm, solver.report)
        found = other.run(near.surface)
        if found.status is not ShellStatus.CONVERGED and not solver.strip.problem.half_turns:
            found = Solver(strip, options, solver.comm, solver.report).run()  # the whole path on this mesh
        return dataclasses.replace(
            found,
            steps=near.steps + found.steps,
            newton_iterations=near.newton_iterations + found.newton_iterations,
            factorisations=near.factorisations + found.factorisations,
        )

    def cells(cuts: tuple[int, int]) -> int:
        nx, ny = solver.strip.problem.elements
        return nx * cuts[0] * ny * cuts[1]

    while True:
        a, b = factors
        along, across = solved(result, (2 * a, b)), solved(result, (a, 2 * b))
        if along.status is not ShellStatus.CONVERGED or across.status is not ShellStatus.CONVERGED:
            worst = along if along.status is not ShellStatus.CONVERGED else across
            message = f"no equilibrium on the refined mesh {worst.elements}: {worst.message}"
            return dataclasses.replace(result, status=ShellStatus.NOT_CONVERGED, message=message)
        distance = gap(result.surface, along.surface), gap(result.surface, across.surface)
        row: dict[str, Any] = {
            "elements": list(result.elements),
            "along": distance[0],
            "across": distance[1],
            "estimate": SAFETY * sum(distance),
            "share": {k: max(abs(x.share[k] - result.share[k]) for x in (along, across)) for k in result.share},
            "errors": _errors(result, along, across),
        }
        rows.append(row)
        solver.report({"event": "mesh", **row})
        done = row["estimate"] <= accuracy
        if not done:
            half = 0.5 * accuracy / SAFETY
            cuts = (2 * a if distance[0] > half else a, 2 * b if distance[1] > half else b)
            if cells(cuts) <= options.max_cells:
                factors = cuts
                if cuts == (2 * a, b):
                    result = along
                elif cuts == (a, 2 * b):
                    result = across
                else:
                    result = solved(along, cuts)
                    if result.status is not ShellStatus.CONVERGED:
                        return result
                continue
        found = {"accuracy": accuracy, "reached": done, "estimate": row["estimate"], "meshes": rows}
        note = "" if done else f"; accuracy {accuracy:g} not reached within max_cells = {options.max_cells}"
        return dataclasses.replace(result, discretisation=found, message=result.message + note)
