"""A measurement of `ribbonbench cost` under way: references, ladders of sizes, first calls, within a budget of time."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from compare.measure.align import aligned
from compare.measure.distance import grid_hausdorff
from compare.models.ribbon_run import run_ribbon
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import Grid
from compare.studies.cost_plan import Plan, Reference, Start
from compare.studies.cost_runs import (
    Kept,
    Run,
    elastica_points,
    elastica_problem,
    elastica_run,
    ribbon_run,
    ribbon_solver,
    shell_case,
    shell_label,
    shell_of,
    shell_run,
    sized,
)
from compare.studies.cost_start import seconds_of_first
from ribbon import Equilibrium, refine
from shellref.elastica.solve import solve as solve_elastica


class Bench:
    """A measurement under way."""

    def __init__(self, scene: Scene, plan: Plan, kept: Kept, reporter: Reporter, began: float) -> None:
        self.scene, self.plan, self.kept, self.reporter, self.began = scene, plan, kept, reporter, began
        self.left_out: list[str] = []
        self.base = run_ribbon(scene, reporter.step, leave_saddle=plan.leave_saddle, detail=reporter.detail)
        bend = self.base.equilibrium.omega(np.linspace(0.0, 1.0, 2001))
        self.grid = Grid.for_shape(scene, float(np.abs(bend).max()))
        self.store = CaseStore(kept.root)  # untimed shells: references
        self.key = [scene.canonical(), plan.leave_saddle, self.grid.s.size, self.grid.v.size]

    @property
    def _left(self) -> float:
        return self.plan.budget - (time.perf_counter() - self.began)

    # -- references ---------------------------------------------------------------------------------------------------

    def ribbon_reference(self, solvers: list[str]) -> Reference | None:
        """The largest size cut in four; its error from the one cut in eight, the rest as a geometric series."""
        formulation = "mixed" if "mixed" in solvers or self.scene.path else "chained"
        if solvers == ["placed"]:
            formulation = "mixed"
        most = max(self.plan.segments)
        self.reporter.step(f"reference of the ribbon: {4 * most} and {8 * most} segments")
        store, key = self.kept, ["ribbon reference", self.key, most, formulation]

        def make(parts: int) -> Run:
            found: Equilibrium = self._refined(formulation, most)[parts]
            points = self.grid.ribbon(found)
            points = aligned(points, self.grid.ribbon(self.base.equilibrium), found)
            return Run("ribbon", str(found.problem.lengths.size), 0, found.status.code, found.ok, (), None, points)

        found = [store.run([*key, parts], lambda parts=parts: make(parts)) for parts in range(3)]  # type: ignore[misc]
        coarse, fine, finest = found
        if fine.points is None or not fine.ok:
            self.left_out.append(f"the ribbon's reference on {fine.label} segments is {fine.status}")
            return None
        what = f"{fine.label} segments"
        if coarse.points is None or finest.points is None or not finest.ok:
            return Reference("ribbon", what, fine.points, None, f"{finest.label} segments: {finest.status}")
        first, last = grid_hausdorff(coarse.points, fine.points), grid_hausdorff(fine.points, finest.points)
        ratio = min(last / first, 0.5) if first > 0.0 else 0.5
        return Reference("ribbon", what, fine.points, last / (1.0 - ratio), f"{finest.label} segments")

    def _refined(self, formulation: str, most: int) -> list[Equilibrium]:
        """The largest size cut in 2, 4 and 8."""
        if not hasattr(self, "_chain"):
            current = ribbon_solver(sized(self.scene, formulation, most), self.plan.leave_saddle)()
            self._chain = []
            for _ in range(3):
                current = refine(current) if current.ok else current
                self._chain.append(current)
        return self._chain

    def elastica_reference(self) -> Reference | None:
        """Degree 4 on four times the elements."""
        most = 4 * max(self.plan.elastica_elements)
        self.reporter.step(f"reference of the elastica: {most} elements of degree 4")
        found = solve_elastica(elastica_problem(self.scene), most, 4)
        if found.status.value != "converged":
            self.left_out.append(f"the elastica's reference is {found.status.value}: {found.message}")
            return None
        points = elastica_points(self.scene, found, self.grid)
        return Reference("elastica", f"{most} elements of degree 4", points, found.error, f"{2 * most} of them")

    def shell_reference(self) -> Reference | None:
        """Degree 3 on the largest mesh; its error from degree 2 on half as many elements more each way."""
        mesh = max(self.plan.meshes, key=lambda m: m[0] * m[1])
        check = (-(-3 * mesh[0] // 2), -(-3 * mesh[1] // 2))
        cases = []
        self.check: tuple[str, Any] | None = None
        for size, degree, store in ((mesh, 3, self.store), (check, 2, self.kept.shells(0))):
            self.reporter.step(f"reference of the shell: w/h = {self.plan.ratio:g}, {shell_label(size, degree)}")
            cases.append(self._shell(size, degree, store))
        self.check = shell_label(check), cases[1]
        fine, other = (case for case, _ in cases)
        what, checked = f"{shell_label(mesh, 3)}, w/h = {self.plan.ratio:g}", shell_label(check)
        if not fine.ok:
            self.left_out.append(f"the shell's reference is {fine.status}: {fine.data['message']}")
            return None
        points = self.grid.shell(fine)
        error = grid_hausdorff(points, self.grid.shell(other)) if other.ok else None
        return Reference("shell", what, points, error, checked if other.ok else f"{checked}: {other.status}")

    def _shell(self, mesh: tuple[int, int], degree: int, store: CaseStore) -> Any:
        assert self.plan.ratio is not None
        problem = shell_of(self.scene, self.plan.ratio, mesh, degree)
        base = self.base.equilibrium
        return shell_case(self.scene, problem, base, store, self.plan.leave_saddle, self.reporter.detail)

    # -- ladders ------------------------------------------------------------------------------------------------------

    def ladder(self, solver: str) -> list[Run]:
        """All sizes of ribbon or elastica, small ones first."""
        found: list[Run] = []
        self.reporter.step(f"{solver}: {self.plan.repeats} runs of each size")
        for name, size, make in self._sizes(solver):
            last = next((r for r in reversed(found) if r.solver == name and r.warm is not None), None)
            if last is not None and last.warm is not None and 8.0 * last.warm > max(self._left, 0.0):
                self.left_out.append(f"{name} {size:g}: it may take longer than what is left of the budget")
                continue
            self.reporter.detail(f"{name}, {size:g}")
            run = self.kept.run([name, size, self.plan.repeats, self.key], make)
            if solver != "placed" or last is None or run.unknowns != last.unknowns:  # a tolerance may change nothing
                found.append(run)
        return found

    def _sizes(self, solver: str) -> list[tuple[str, float, Callable[[], Run]]]:
        scene, plan, grid, repeats = self.scene, self.plan, self.grid, self.plan.repeats
        base = self.base.equilibrium
        if solver == "elastica":
            problem = elastica_problem(scene)
            return [
                (f"elastica {q}", n, lambda q=q, n=n: elastica_run(scene, problem, q, n, grid, repeats))  # type: ignore[misc]
                for q in plan.degrees
                for n in sorted(plan.elastica_elements)
            ]
        sizes: list[float] = (
            sorted(plan.tolerances, reverse=True) if solver == "placed" else [float(p) for p in sorted(plan.segments)]
        )
        return [
            (solver, size, lambda size=size: ribbon_run(scene, solver, size, base, grid, repeats, plan.leave_saddle))  # type: ignore[misc]
            for size in sizes
        ]

    def shells(self) -> list[Run]:
        """All meshes once, small ones first, then again and again while the budget lasts; last the one that the
        reference was checked on, timed once."""
        meshes = sorted(self.plan.meshes, key=lambda m: m[0] * m[1])
        cases: dict[tuple[int, int], list[Any]] = {}
        for number in range(self.plan.repeats):
            store = self.kept.shells(number)
            for mesh in meshes:
                if number and mesh not in cases:
                    continue
                self.reporter.step(f"shell: {shell_label(mesh)}, run {number + 1} of {self.plan.repeats}")
                if self._predicted(mesh, cases) > self._left:
                    if not number:
                        self.left_out.append(f"shell {shell_label(mesh)}: no time left of {self.plan.budget:g} s")
                    elif number == 1:
                        self.left_out.append(
                            f"shell {shell_label(mesh)}: timed once (budget of {self.plan.budget:g} s)"
                        )
                    continue
                cases.setdefault(mesh, []).append(self._shell(mesh, 2, store))
        found = [shell_run(shell_label(mesh), runs, self.grid) for mesh, runs in cases.items()]
        label, checked = self.check or ("", None)
        return found if checked is None else [*found, shell_run(label, [checked], self.grid)]

    def _predicted(self, mesh: tuple[int, int], cases: dict[tuple[int, int], list[Any]]) -> float:
        """Seconds that a run of this mesh may take: as it did, or in proportion to the cells of another one."""
        for known in [mesh, *reversed(cases)]:
            if cases.get(known):
                case, wall = cases[known][0]
                spent = wall if wall is not None else case.seconds
                return float(spent) * mesh[0] * mesh[1] / (known[0] * known[1])
        return 0.0

    # -- first calls --------------------------------------------------------------------------------------------------

    def starts(self, solvers: tuple[str, ...], runs: list[Run]) -> tuple[Start, ...]:
        """First calls of every solver in fresh processes, beyond the warm solve."""
        found = []
        text = self.scene.to_toml()
        for solver in solvers:
            mine = [run for run in runs if run.solver.startswith(solver) and run.warm is not None]
            if solver == "shell":
                values = [run.start for run in mine if run.start is not None]
                if values:
                    found.append(Start("shell", float(np.median(values)), None))
                continue
            if solver == "placed" or self.scene.path or not mine:
                continue
            size = min(self.plan.elastica_elements if solver == "elastica" else self.plan.segments)
            degree = self.plan.degrees[0]
            request = {"scene": text, "solver": solver, "elements": size, "degree": degree, "formulation": solver}
            self.reporter.step(f"{solver}: first calls in fresh processes")
            seconds = [seconds_of_first(request) for _ in range(self.plan.repeats)]
            good = [s for s in seconds if s is not None]
            if not good:
                continue
            compiled = None
            if self.plan.compilation and solver != "elastica":
                self.reporter.step(f"{solver}: a first call that compiles everything")
                with tempfile.TemporaryDirectory(prefix="ribbonbench-cache-") as cache:
                    compiled = seconds_of_first(request, Path(cache))
            warm = mine[0].warm or 0.0
            over = compiled - warm if compiled is not None else None
            found.append(Start(solver, float(np.median(good)) - warm, over))
        return tuple(found)
