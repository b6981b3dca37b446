"""The timed runs of `ribbonbench cost`: one size of one solver, its surface and its times, kept as soon as it is done.

warm: the solve alone in a process that has everything loaded. start: what a process that begins fresh adds to it (start
of the process, imports, loading of compiled code). The shell runs in a fresh process every time, and its worker counts
the solve apart; ribbon and elastica are repeated here, and their start is measured once per solver (`cost_start`).
"""

from __future__ import annotations

import shutil
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from compare.arrays import npz_bytes
from compare.errors import BadInput
from compare.measure.align import aligned
from compare.models.ribbon_build import ribbon_arguments
from compare.models.ribbon_run import run_elastica
from compare.models.ribbon_way import run_way
from compare.models.shell_build import shell_problem, starts_at_ribbon
from compare.models.shell_process import ShellCase, run_shell, shell_key, stored_case
from compare.models.shell_start import ribbon_surface
from compare.scene.scene import Scene
from compare.store.provenance import software, versions
from compare.store.store import CaseStore, atomic_write_bytes, atomic_write_json, case_key, read_json
from compare.studies.compare import Grid
from ribbon import Equilibrium, solve
from ribbon.find.adaptive import solve_to_tolerance
from shellref.elastica.solve import ElasticaProblem, ElasticaResult, embed, embed_frames
from shellref.elastica.solve import solve as solve_elastica
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem

FloatArray = NDArray[np.float64]
Progress = Callable[[str], None]

#: A solve that takes longer (s) is not called once more beforehand to load the kernels.
LONG = 2.0
#: Beside the scene's surfaces: the file with a fresh process's wall time.
_WALL = "wall.json"


@dataclass(frozen=True)
class Run:
    """One size of one solver, run one or more times.

    solver: "chained", "mixed", "placed" (segments by tolerance), "elastica 1" to "elastica 4" (degree), "shell"; label:
    its size; unknowns: of the discrete problem; seconds: warm times in s; start: further seconds of a fresh process;
    points (k, m, 3): its surface on the grid, units of l, None when there is none; reused: found among finished runs.
    """

    solver: str
    label: str
    unknowns: int
    status: str
    ok: bool
    seconds: tuple[float, ...]
    start: float | None
    points: FloatArray | None
    reused: bool = False

    @property
    def warm(self) -> float | None:
        """Median warm time (s)."""
        return statistics.median(self.seconds) if self.seconds else None

    @property
    def end(self) -> FloatArray | None:
        """The end of the centreline (3,)."""
        return None if self.points is None else self.points[-1, self.points.shape[1] // 2]


def machine() -> dict[str, Any]:
    """What times belong to: processor, cores that this process may use, threads that the libraries may use."""
    made = versions()
    return {name: made[name] for name in ("cpu", "cores", "threads", "system")}


class Kept:
    """Finished runs in the folder `root`: found again on the same machine, with the same versions and sources.

    fresh: what is there is thrown away first.
    """

    def __init__(self, root: Path, fresh: bool = False) -> None:
        if fresh:
            shutil.rmtree(root, ignore_errors=True)
        self.root = root
        self._machine = case_key(machine())[:8]
        self._software = software()

    def run(self, parts: list[Any], make: Callable[[], Run]) -> Run:
        """The run that `parts` determine, from the folder or made now and kept."""
        store = CaseStore(self.root / "runs")
        key = case_key("cost", parts, self._machine, self._software)
        folder = store.get(key)
        if folder is not None:
            with np.load(folder / "surface.npz", allow_pickle=False) as stored:
                points = stored.get("points")
            data = read_json(folder / "run.json")
            return Run(**{**data, "seconds": tuple(data["seconds"])}, points=points, reused=True)
        found = make()

        def write(place: Path) -> None:
            names = ("solver", "label", "unknowns", "status", "ok", "seconds", "start")
            atomic_write_json(place / "run.json", {name: getattr(found, name) for name in names})
            points = {} if found.points is None else {"points": found.points}
            atomic_write_bytes(place / "surface.npz", npz_bytes(points))

        store.put(key, write)
        return found

    def shells(self, number: int) -> CaseStore:
        """The store of the shells of repetition `number`. A walk that was broken off begins anew: its time counts."""
        root = self.root / f"shell-{self._machine}-{number}"
        shutil.rmtree(root / ".unfinished", ignore_errors=True)
        return CaseStore(root)


class _Timed(Protocol):
    def __call__(self) -> Any: ...


def repeated(once: _Timed, repeats: int) -> tuple[Any, tuple[float, ...]]:
    """The last result of `repeats` calls and their times (s); before them one more, unless it takes long."""
    clock = time.perf_counter()
    result = once()
    first = time.perf_counter() - clock
    times = [first] if first > LONG else []
    while len(times) < repeats:
        clock = time.perf_counter()
        result = once()
        times.append(time.perf_counter() - clock)
    return result, tuple(times)


# -- ribbon -----------------------------------------------------------------------------------------------------------


def sized(scene: Scene, solver: str, size: float) -> Scene:
    """The scene with `size` segments in the formulation `solver`, or ("placed") with `size` as the tolerance."""
    if solver == "placed":
        return scene.replace({"model.tolerance": size, "model.formulation": "auto", "model.grading": None})
    return scene.replace({"model.elements": int(size), "model.formulation": solver})


def ribbon_solver(scene: Scene, leave_saddle: bool = False) -> Callable[[], Equilibrium]:
    """The whole solve of a scene's ribbon as a function: from the seed, along the path or to the tolerance."""
    if scene.path:
        return lambda: run_way(scene, leave_saddle=leave_saddle).equilibrium
    arguments = ribbon_arguments(scene)
    tolerance = scene.model.tolerance
    if tolerance is None:
        return lambda: solve(**arguments, leave_saddle=leave_saddle)
    del arguments["segments"]
    first_three = [arguments.pop(name) for name in ("strip", "clamp", "gravity")]
    return lambda: solve_to_tolerance(*first_three, **arguments, tolerance=tolerance, leave_saddle=leave_saddle)


def ribbon_run(
    scene: Scene, solver: str, size: float, base: Equilibrium, grid: Grid, repeats: int, leave_saddle: bool
) -> Run:
    """One size of the ribbon; motions that nothing resists are taken out against `base`."""
    found, times = repeated(ribbon_solver(sized(scene, solver, size), leave_saddle), repeats)
    lower, upper = found.problem.bounds()
    segments = int(found.problem.lengths.size)
    label = f"{segments}" if solver != "placed" else f"{segments} (for {size:.0e})"
    points = aligned(grid.ribbon(found), grid.ribbon(base), found) if np.all(np.isfinite(found.x)) else None
    unknowns = int(np.sum(np.asarray(lower) < np.asarray(upper)))
    return Run(solver, label, unknowns, found.status.code, found.ok, times, None, points)


# -- elastica ---------------------------------------------------------------------------------------------------------


def elastica_problem(scene: Scene) -> ElasticaProblem:
    """The planar problem of a scene; `BadInput` says what breaks planarity otherwise."""
    return run_elastica(scene).result.problem


def elastica_points(scene: Scene, found: ElasticaResult, grid: Grid) -> FloatArray:
    """The elastica as a strip (k, m, 3): its rulings are straight across."""
    line = embed(found, scene.position, scene.frame, grid.s)
    across = embed_frames(found, scene.frame, grid.s)[:, :, 0]
    return np.asarray(line[:, None, :] + grid.v[None, :, None] * across[:, None, :])


def elastica_run(scene: Scene, problem: ElasticaProblem, degree: int, elements: int, grid: Grid, repeats: int) -> Run:
    """One size of the elastica."""
    found, times = repeated(lambda: solve_elastica(problem, elements, degree, estimate_error=False), repeats)
    status = found.status.value
    points = elastica_points(scene, found, grid)
    return Run(
        f"elastica {degree}", str(elements), degree * elements, status, status == "converged", times, None, points
    )


# -- shell ------------------------------------------------------------------------------------------------------------


def shell_of(scene: Scene, ratio: float, mesh: tuple[int, int], degree: int = 2) -> ShellProblem:
    """The shell on this mesh, with the scene's path to fall back on where it can follow that."""
    try:
        problem = shell_problem(scene, ratio, mesh)
    except BadInput:
        problem = shell_problem(scene, ratio, mesh, way=False)
    return replace(problem, degree=degree)


def shell_case(
    scene: Scene, problem: ShellProblem, base: Equilibrium, store: CaseStore, leave_saddle: bool, progress: Progress
) -> tuple[ShellCase, float | None]:
    """A shell and the wall time (s) of its process; it begins at the ribbon's surface where `compare` does so too."""
    near = ribbon_surface(base, problem) if base.ok and starts_at_ribbon(scene, leave_saddle) else None
    options = ShellOptions()
    kept = stored_case(store, shell_key(problem, options, near))
    if kept is not None and kept.folder is not None:
        path = kept.folder / _WALL
        return kept, float(read_json(path)["seconds"]) if path.exists() else None
    clock = time.perf_counter()
    case = run_shell(problem, store, options, progress, near)
    wall = time.perf_counter() - clock
    if case.folder is not None:
        atomic_write_json(case.folder / _WALL, {"seconds": wall})
    return case, wall


def shell_label(mesh: tuple[int, int], degree: int = 2) -> str:
    """E.g. "100 x 8", with the degree where it is not 2."""
    return f"{mesh[0]} x {mesh[1]}" + ("" if degree == 2 else f", Q{degree}")


def shell_run(label: str, cases: list[tuple[ShellCase, float | None]], grid: Grid) -> Run:
    """The repetitions of one mesh as a run: points from the first."""
    first = cases[0][0]
    times = [case.seconds for case, _ in cases if case.ok]
    starts = [wall - case.seconds for case, wall in cases if wall is not None and case.ok]
    return Run(
        solver="shell",
        label=label,
        unknowns=int(first.data.get("dofs", 0)),
        status=first.status if first.ok or first.status != "converged" else "unstable",
        ok=first.ok,
        seconds=tuple(times),
        start=statistics.median(starts) if starts else None,
        points=grid.shell(first) if first.ok else None,
        reused=any(case.reused for case, _ in cases),
    )
