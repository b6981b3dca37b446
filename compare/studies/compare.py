"""One ribbon against shells of several thicknesses: distances, energies, errors and times, row by row (thesis, 4.3).

Every row carries three lengths (design rule 7): the distance between the two models, and the discretisation error of
each. The ribbon's error is extrapolated from its own solutions on segments cut in two and in four
(`ribbon_discretisation_error`); the shell's is the distance between
its solution and that on a mesh with half as many elements each way, which bounds the finer mesh's own error from above
as long as halving the elements more than halves the error; where `shell.tolerance` refines the mesh, the estimate that
comes with it. A difference between the models is claimed only when the distance exceeds the sum of both errors.

Where a scene has several equilibria (two clamps, a path, a saddle left), the shell begins at the ribbon's surface and
settles at the full load: both are then on one branch. The shell's equilibrium satisfies its own equations all the same.
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.errors import BadInput
from compare.measure.align import aligned
from compare.measure.distance import cells_across, cells_along, centreline_distance, grid_hausdorff
from compare.models.ribbon_run import ElasticaRun, RibbonRun, run_elastica, run_ribbon
from compare.models.shell_build import (
    natural_constant,
    shell_elements,
    shell_options,
    shell_problem,
    starts_at_ribbon,
)
from compare.models.shell_process import ShellCase, run_shell
from compare.models.shell_start import ribbon_surface
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from ribbon import Equilibrium, refine
from shellref.shell.problem import ShellProblem
from shellref.shell.surface import ShellSurface

FloatArray = NDArray[np.float64]


#: Segments up to which a ribbon is solved again for the error estimate: with a dense Hessian, with a sparse one. Once
#: beyond is allowed, for the cruder of the two estimates.
MOST_SEGMENTS = 320
MOST_SPARSE_SEGMENTS = 4000


@dataclass(frozen=True)
class Grid:
    """Material coordinates on which surfaces are compared: s (k,) in [0, 1], v (m,) in [-w/2, w/2], units of l."""

    s: FloatArray
    v: FloatArray

    @classmethod
    def for_shape(cls, scene: Scene, largest_curvature: float) -> Grid:
        """Fine enough for the curvature (1/l) of the shapes."""
        along = cells_along(largest_curvature)
        across = cells_across(scene.width, along)
        half = 0.5 * scene.width
        return cls(np.linspace(0.0, 1.0, along + 1), np.linspace(-half, half, across + 1))

    def ribbon(self, equilibrium: Equilibrium) -> FloatArray:
        """Points (k, m, 3) of a ribbon."""
        return equilibrium.surface(self.s.size - 1, self.v.size - 1).grid

    def shell(self, case: ShellCase) -> FloatArray:
        """Points (k, m, 3) of a shell."""
        return case.surface.grid(self.s, self.v)


@dataclass(frozen=True)
class Row:
    """A shell run beside the ribbon. Lengths in l, energies in D w / l, times in s; None where there is no surface.

    hausdorff, centreline: distances between the models; ribbon_error, shell_error: of the discretisations (Hausdorff);
    claimed: the distance exceeds the sum of the errors; energy: shell's parts (`elastic` includes the constant of the
    natural curvature, `elastic_ribbon` leaves it out like the ribbon's); share: of its elastic energy; elastica:
    distance of the shell's centreline to the elastica's, in planar scenes; start: how the shell's solve began, `START`;
    share_error: change of the membrane share from the coarser mesh, where one was solved.
    """

    width_to_thickness: float
    status: str
    stable: bool | None
    message: str
    hausdorff: float | None
    centreline: float | None
    ribbon_error: float | None
    shell_error: float | None
    claimed: bool
    energy: dict[str, float] | None
    share: dict[str, float] | None
    shell_end: dict[str, Any] | None
    shell_middle: dict[str, Any] | None
    seconds: dict[str, float | None]
    elements: tuple[int, int]
    newton_iterations: int | None
    reused: bool
    elastica: float | None = None
    start: str = "path"
    share_error: float | None = None

    @property
    def ratio(self) -> float | None:
        """How many times longer the shell takes than the ribbon."""
        ribbon, shell = self.seconds["ribbon"], self.seconds["shell"]
        return None if not ribbon or shell is None else shell / ribbon


@dataclass(frozen=True)
class Slope:
    """Least-squares slope of log(distance) against log(h/w) over the claimed rows; spread: of the slopes between
    neighbouring rows, smallest and largest."""

    value: float
    rows: int
    spread: tuple[float, float]


@dataclass(frozen=True)
class Comparison:
    """A finished comparison; `shells` holds the cases in the order of `rows`."""

    scene: Scene
    ribbon: RibbonRun
    ribbon_error: float | None
    elastica: ElasticaRun | None
    elastica_distance: float | None
    rows: tuple[Row, ...]
    shells: tuple[ShellCase, ...]
    grid: Grid
    slope: Slope | None

    @property
    def ok(self) -> bool:
        """Every solve converged to a stable equilibrium."""
        return self.ribbon.equilibrium.ok and all(row.status == "converged" for row in self.rows)

    @property
    def falls(self) -> bool | None:
        """Whether the distance falls as h/w falls, over the claimed rows; None with fewer than two of them."""
        claimed = sorted((r.width_to_thickness, r.hausdorff) for r in self.rows if r.claimed and r.hausdorff)
        if len(claimed) < 2:
            return None
        return all(later < earlier for (_, earlier), (_, later) in pairwise(claimed))


def ribbon_discretisation_error(equilibrium: Equilibrium, grid: Grid, reporter: Reporter) -> float | None:
    """Distance (Hausdorff / l) from a ribbon to its own limit of many segments, on the same branch; None when unknown.

    With d_1, d_2 the distances from p to 2 p and from 2 p to 4 p segments and q = d_2 / d_1, the rest is a geometric
    series: error = d(p, 4 p) + d_2 q / (1 - q), q taken as 1/2 at the most. Where 4 p segments are too many, 2 d_1,
    which bounds the error when halving the segments halves it at least. Rigid motions that nothing resists are no
    error (`compare.measure.align`). Segments placed by a tolerance bring their own estimate (`ribbon.find.adaptive`).
    """
    if not equilibrium.ok:
        return None
    if equilibrium.tolerance_error is not None:
        return equilibrium.tolerance_error
    most = MOST_SEGMENTS if equilibrium.problem.formulation == "chained" else MOST_SPARSE_SEGMENTS
    shapes = [grid.ribbon(equilibrium)]
    current = equilibrium
    for _ in range(2):
        segments = 2 * current.problem.lengths.size
        if segments > (2 * most if len(shapes) == 1 else most):
            break
        reporter.step(f"ribbon: {segments} segments, for the discretisation error")
        current = refine(current)
        if not current.ok:
            return None
        shapes.append(aligned(grid.ribbon(current), shapes[-1], current))
    if len(shapes) == 1:
        return None
    first = grid_hausdorff(shapes[0], shapes[1])
    if len(shapes) == 2:
        return 2.0 * first
    second = grid_hausdorff(shapes[1], shapes[2])
    ratio = min(second / first, 0.5) if first > 0.0 else 0.5
    return grid_hausdorff(shapes[0], shapes[2]) + second * ratio / (1.0 - ratio)


def coarser(elements: tuple[int, int]) -> tuple[int, int]:
    """Half as many elements each way, at least one."""
    return max(1, elements[0] // 2), max(1, elements[1] // 2)


def fit_slope(rows: tuple[Row, ...]) -> Slope | None:
    """Slope over the rows whose distance is claimed; None with fewer than two of them."""
    pairs = sorted((1.0 / r.width_to_thickness, r.hausdorff) for r in rows if r.claimed and r.hausdorff)
    if len(pairs) < 2:
        return None
    x, y = np.log(np.array(pairs, dtype=float)).T
    steps = np.diff(y) / np.diff(x)
    return Slope(float(np.polyfit(x, y, 1)[0]), len(pairs), (float(steps.min()), float(steps.max())))


def compare(scene: Scene, store: CaseStore, reporter: Reporter, *, leave_saddle: bool = False) -> Comparison:
    """Runs the ribbon, the elastica where the scene is planar, and one shell per w/h of the scene.

    Finished shell cases are taken from `store` and new ones are kept there at once; the state of an interrupted path of
    the ribbon stands beside them. leave_saddle: the ribbon leaves a saddle for a stable state.
    """
    thicknesses = scene.require_shell()
    elements = shell_elements(scene)
    for ratio in thicknesses:
        shell_problem(scene, ratio, elements, way=False)  # what the shell refuses is said before anything is solved
    ribbon = run_ribbon(
        scene, reporter.step, leave_saddle=leave_saddle, folder=store.root.parent, detail=reporter.detail
    )
    sample = np.linspace(0.0, 1.0, 2001)
    grid = Grid.for_shape(scene, float(np.abs(ribbon.equilibrium.omega(sample)).max()))
    ribbon_points = grid.ribbon(ribbon.equilibrium)
    ribbon_error = ribbon_discretisation_error(ribbon.equilibrium, grid, reporter)
    ribbon_line = ribbon.equilibrium.position(grid.s)
    beside = ribbon.equilibrium if ribbon.equilibrium.ok else None
    elastica = run_elastica(scene, reporter.step, beside) if scene.is_planar() else None
    elastica_line = elastica.centreline(grid.s) if elastica is not None else None
    rows: list[Row] = []
    shells: list[ShellCase] = []
    near = ribbon.equilibrium if ribbon.equilibrium.ok and starts_at_ribbon(scene, leave_saddle) else None
    for ratio in thicknesses:
        reporter.step(f"shell: w/h = {ratio:g}, {elements[0]} x {elements[1]} elements")
        case = _shell(scene, ratio, elements, store, reporter, near)
        coarse: ShellCase | None = None
        if scene.shell.tolerance is None:
            check = coarser(elements)
            reporter.step(f"shell: w/h = {ratio:g}, {check[0]} x {check[1]} elements, for the discretisation error")
            with contextlib.suppress(BadInput):  # a mesh that cannot have the held corners' knots: error unknown
                coarse = _shell(scene, ratio, check, store, reporter, case if near is not None and case.ok else near)
        rows.append(
            _row(scene, ribbon, grid, ribbon_points, ribbon_line, ribbon_error, elastica_line, ratio, case, coarse)
        )
        shells.append(case)
    found = tuple(rows)
    return Comparison(
        scene=scene,
        ribbon=ribbon,
        ribbon_error=ribbon_error,
        elastica=elastica,
        elastica_distance=None if elastica_line is None else centreline_distance(ribbon_line, elastica_line),
        rows=found,
        shells=tuple(shells),
        grid=grid,
        slope=fit_slope(found),
    )


#: How a shell's solve began, from the worker's words (shellref.worker.Settled).
START = {
    "path": "path",
    "given": "ribbon",
    "given, by way of thicker strips": "ribbon (thicker first)",
    "path (none near the start)": "path (none near the ribbon)",
}


def _shell(
    scene: Scene,
    ratio: float,
    elements: tuple[int, int],
    store: CaseStore,
    reporter: Reporter,
    near: Equilibrium | ShellCase | None,
) -> ShellCase:
    """One shell run, begun at the surface of `near` (a ribbon's equilibrium, or the same shell on another mesh)."""
    options = shell_options(scene)
    if near is None:
        return run_shell(_problem(scene, ratio, elements), store, options, progress=reporter.detail)
    problem = _problem(scene, ratio, elements)
    start: ShellSurface = near.surface if isinstance(near, ShellCase) else ribbon_surface(near, problem)
    return run_shell(problem, store, options, progress=reporter.detail, start=start)


def _problem(scene: Scene, ratio: float, elements: tuple[int, int]) -> ShellProblem:
    """The shell with the scene's path to fall back on; without it where the shell cannot follow that path."""
    try:
        return shell_problem(scene, ratio, elements)
    except BadInput:
        return shell_problem(scene, ratio, elements, way=False)


def _row(
    scene: Scene,
    ribbon: RibbonRun,
    grid: Grid,
    ribbon_points: FloatArray,
    ribbon_line: FloatArray,
    ribbon_error: float | None,
    elastica_line: FloatArray | None,
    ratio: float,
    case: ShellCase,
    coarse: ShellCase | None,
) -> Row:
    """The row of one shell run; without a converged surface it keeps the status and no distances."""
    data = case.data
    hausdorff = centreline = shell_error = planar = share_error = None
    energy = dict(data["energy"]) if data.get("energy") else None
    if energy is not None:
        energy["elastic_ribbon"] = energy["elastic"] - natural_constant(scene)
    if case.ok:
        points = grid.shell(case)
        line = case.surface.centreline(grid.s)
        hausdorff = grid_hausdorff(ribbon_points, points)
        centreline = centreline_distance(ribbon_line, line)
        if elastica_line is not None:
            planar = centreline_distance(elastica_line, line)
        if coarse is None:
            shell_error = (data.get("discretisation") or {}).get("estimate")
        elif coarse.ok:
            shell_error = grid_hausdorff(points, grid.shell(coarse))
            here, there = ((found.get("share") or {}).get("membrane") for found in (data, coarse.data))
            share_error = None if here is None or there is None else abs(here - there)
    known = hausdorff is not None and shell_error is not None and ribbon_error is not None
    claimed = known and hausdorff > shell_error + ribbon_error  # type: ignore[operator]
    seconds = case.seconds
    return Row(
        width_to_thickness=ratio,
        status=case.status if case.ok or case.status != "converged" else "unstable",
        stable=data.get("stable"),
        message=str(data.get("message", "")),
        hausdorff=hausdorff,
        centreline=centreline,
        ribbon_error=ribbon_error,
        shell_error=shell_error,
        claimed=claimed,
        energy=energy,
        share=data.get("share"),
        shell_end=data.get("end"),
        shell_middle=data.get("middle"),
        seconds={"ribbon": ribbon.warm, "shell": None if math.isnan(seconds) else seconds},
        elements=tuple(data.get("elements", shell_elements(scene))),  # type: ignore[arg-type]
        newton_iterations=data.get("newton_iterations"),
        reused=case.reused,
        elastica=planar,
        start=START[case.start or "path"],
        share_error=share_error,
    )
