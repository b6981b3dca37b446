"""The problems of Sze, Liu and Lo (2004) as bodies of `shellref`, and their load-displacement paths.

Axes: e_2 is the paper's z and e_3 its x, so e_1 is its y, in every problem. Cylinders are curved along S = radius * phi
(phi = 0 at the crown, in the plane of A), v runs along the generator from mid-length; the strips run along S; the
annulus has S as angle from the clamped face and v as radius. Lengths are the paper's; forces are over D =
E h^3 / (12 (1 - nu^2)), so that D = 1, and load = 1 is `p_max`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from shellref.shell.body import Body, Control, Stage, Supports, line_force, point_force
from shellref.shell.director import HELD, retract
from shellref.shell.grid import Grid
from shellref.shell.midsurface import Annulus, Cylinder
from shellref.shell.options import ShellOptions
from tests.reference import sze2004

LOAD = (Stage("load", Control(1.0, 0.0, 0.0, 0.0), Control(1.0, 0.0, 1.0, 0.0)),)
NEAR = 1e-9  # of the size: which nodes lie on an edge
UNLIMITED = 10.0  # `max_strain`: a point force strains its element without bound
#: c of the stabilisation, see results/shell_formulation.md: with less, point forces bend the elements under them in the
#: modes that the reduced rule does not see.
STABILISATION = 1.0


@dataclass(frozen=True)
class Probe:
    """What a column of the table holds: sign * displacement along an axis of the node at (S, v)."""

    column: str
    place: tuple[float, float]
    axis: int
    sign: float = 1.0


@dataclass(frozen=True)
class Case:
    """A problem on a mesh: `options` are those with which its path is walked."""

    name: str
    benchmark: sze2004.Benchmark
    body: Body
    probes: tuple[Probe, ...]
    options: ShellOptions
    stages: tuple[Stage, ...] = LOAD

    @property
    def mesh(self) -> tuple[int, int]:
        """(along S, along v)."""
        return self.body.grid.elements

    def until(self, load: float) -> Case:
        """The same up to this fraction of p_max."""
        start = LOAD[0].start
        return replace(self, stages=(Stage("load", start, start._replace(load=load)),))

    def of_degree(self, degree: int) -> Case:
        """The same knots with elements of this degree."""
        grid = self.body.grid
        return replace(self, body=replace(self.body, grid=Grid(grid.s_knots, grid.v_knots, degree)))


def graded(length: float, count: int, finest: float = 1.0, both: bool = False) -> np.ndarray:
    """(count + 1,) knots on [0, length] in geometric progression: first element `finest` times the last.

    both: the same towards the other end.
    """
    if both:
        half = graded(0.5 * length, count // 2, finest)
        return np.concatenate([half, length - half[-2::-1]])
    if finest == 1.0:
        return np.linspace(0.0, length, count + 1)
    ratio = finest ** (-1.0 / (count - 1))
    sizes = ratio ** np.arange(count)
    return length * np.concatenate([[0.0], np.cumsum(sizes)]) / sizes.sum()


def _options(**more: Any) -> ShellOptions:
    """Options of all problems: unstable states are not left, a point force may strain its element as it likes."""
    given = {"max_newton": 12, "kick": False, "max_strain": UNLIMITED, "max_steps": 400, "stabilisation": STABILISATION}
    return ShellOptions(**{**given, **more})


def _load_steps(step: float) -> ShellOptions:
    """Even load steps, on the rows of the table."""
    return _options(first_step=step, max_step=step, min_step=1e-5, cut=0.5, max_newton=20)


def _arc(largest: float, first: float = 2e-3) -> ShellOptions:
    """Arc length all the way: no step is lost where the load stands still or jumps."""
    return _options(arc_length="always", arc_step=first, max_arc=largest)


def stiffness(benchmark: sze2004.Benchmark) -> float:
    """D of the problem."""
    return benchmark.young * benchmark.thickness**3 / (12.0 * (1.0 - benchmark.poisson**2))


def force(benchmark: sze2004.Benchmark) -> float:
    """p_max on the modelled part, over D."""
    return benchmark.p_max * benchmark.load_share / stiffness(benchmark)


def _clamped_start(grid: Grid, nodes: np.ndarray) -> Supports:
    return Supports.none(len(nodes)).hold(nodes[:, 0] < NEAR, "xyz", HELD)


def _strip(mesh: tuple[int, int], moment: bool) -> Case:
    b = sze2004.END_MOMENT if moment else sze2004.END_SHEAR
    per_length = force(b) / b.width
    body = Body(
        surface=Cylinder(),
        grid=Grid(np.linspace(0.0, b.length, mesh[0] + 1), np.linspace(0.0, b.width, mesh[1] + 1)),
        thickness=b.thickness,
        poisson=b.poisson,
        supports=_clamped_start,
        forces=None if moment else line_force(0, b.length, (0.0, per_length, 0.0)),
        couples=line_force(0, b.length, (-per_length, 0.0, 0.0)) if moment else None,
    )
    tip = (b.length, 0.5 * b.width)
    probes = (Probe("-U_tip", tip, 2, -1.0), Probe("W_tip", tip, 1))
    return Case("end moment" if moment else "end shear", b, body, probes, _load_steps(0.05))


def end_shear(mesh: tuple[int, int]) -> Case:
    """Cantilever under a dead end shear force."""
    return _strip(mesh, False)


def end_moment(mesh: tuple[int, int]) -> Case:
    """Cantilever rolled up by an end moment."""
    return _strip(mesh, True)


def slit_annulus(mesh: tuple[int, int], finest: float = 1.0) -> Case:
    """Annulus with a slit, one face clamped and the other lifted; mesh (around, along the radius)."""
    b = sze2004.SLIT_ANNULUS
    around, outer = 2.0 * np.pi, b.outer_radius
    body = Body(
        surface=Annulus(),
        grid=Grid(graded(around, mesh[0], finest), np.linspace(b.inner_radius, outer, mesh[1] + 1)),
        thickness=b.thickness,
        poisson=b.poisson,
        supports=_clamped_start,
        forces=line_force(0, around, (0.0, force(b), 0.0)),
    )
    probes = (Probe("W_A", (around, b.inner_radius), 1), Probe("W_B", (around, outer), 1))
    return Case("slit annulus", b, body, probes, _load_steps(0.025))


def _edges(
    grid: Grid, nodes: np.ndarray, end: Callable[[Supports, np.ndarray], Supports], top: tuple[str, int | None] | None
) -> Supports:
    """Symmetry at S = 0; end: what the last edge along S has; top: axes held and director at the last along v."""
    s, v = nodes.T
    size_s, size_v = grid.s_knots[-1], grid.v_knots[-1]
    supports = Supports.none(len(nodes)).hold(s < NEAR * size_s, "z", 2)
    supports = end(supports, s > (1.0 - NEAR) * size_s)
    if top is not None:
        supports = supports.hold(v > (1.0 - NEAR) * size_v, *top)
    return supports


def _quarter_turn(supports: Supports, where: np.ndarray) -> Supports:
    """The symmetry plane that cuts a cylinder at phi = pi/2."""
    return supports.hold(where, "y", 1)


def _hinge(supports: Supports, where: np.ndarray) -> Supports:
    """Immovable, free to turn."""
    return supports.hold(where, "xyz")


def _cylinder_supports(grid: Grid, nodes: np.ndarray, end: Callable, top: tuple | None, symmetric: bool) -> Supports:
    supports = _edges(grid, nodes, end, top)
    return supports.hold(nodes[:, 1] < NEAR * grid.v_knots[-1], "x", 0) if symmetric else supports


def _cylinder(
    b: sze2004.Cylinder,
    mesh: tuple[int, int],
    load: tuple[float, float, float],
    end: Callable,
    top: tuple | None,
    symmetric: bool,
    finest: tuple[float, float],
) -> Body:
    arc = b.radius * (min(b.half_angle, 0.5 * np.pi))
    length = 0.5 * b.length if symmetric else b.length
    return Body(
        surface=Cylinder(curvature_along=1.0 / b.radius),
        grid=Grid(graded(arc, mesh[0], finest[0]), graded(length, mesh[1], finest[1])),
        thickness=b.thickness,
        poisson=b.poisson,
        supports=partial(_cylinder_supports, end=end, top=top, symmetric=symmetric),
        forces=point_force((0.0, 0.0), load),
    )


def open_cylinder(mesh: tuple[int, int], finest: tuple[float, float] = (1.0, 1.0)) -> Case:
    """Cylinder with free ends pulled outwards by two forces."""
    b = sze2004.OPEN_CYLINDER
    body = _cylinder(b, mesh, (0.0, force(b), 0.0), _quarter_turn, None, True, finest)
    last, end = body.grid.s_knots[-1], body.grid.v_knots[-1]
    probes = (
        Probe("W_A", (0.0, 0.0), 1),
        Probe("-U_B", (last, 0.0), 2, -1.0),
        Probe("-U_C", (last, end), 2, -1.0),
    )
    return Case("open cylinder", b, body, probes, _arc(0.02))


def pinched_cylinder(mesh: tuple[int, int], finest: tuple[float, float] = (1.0, 1.0)) -> Case:
    """Cylinder on rigid diaphragms pinched by two forces."""
    b = sze2004.PINCHED_CYLINDER
    body = _cylinder(b, mesh, (0.0, -force(b), 0.0), _quarter_turn, ("yz", None), True, finest)
    probes = (Probe("-W_A", (0.0, 0.0), 1, -1.0), Probe("U_B", (body.grid.s_knots[-1], 0.0), 2))
    return Case("pinched cylinder", b, body, probes, _arc(0.02))


def semicylinder(mesh: tuple[int, int], finest: tuple[float, float] = (1.0, 1.0)) -> Case:
    """Clamped semicylinder pushed by a force at its free edge."""
    b = sze2004.SEMICYLINDER
    body = _cylinder(b, mesh, (0.0, -force(b), 0.0), _quarter_turn, ("xyz", HELD), False, finest)
    return Case("semicylinder", b, body, (Probe("-W_A", (0.0, 0.0), 1, -1.0),), _arc(0.01))


def hinged_roof(thin: bool, mesh: tuple[int, int], finest: tuple[float, float] = (1.0, 1.0)) -> Case:
    """Shallow roof on hinges pushed through by a force, by arc length."""
    b = sze2004.HINGED_ROOF_THIN if thin else sze2004.HINGED_ROOF_THICK
    body = _cylinder(b, mesh, (0.0, -force(b), 0.0), _hinge, None, True, finest)
    probes = (Probe("-W_C", (0.0, 0.0), 1, -1.0),)
    return Case(f"hinged roof {'thin' if thin else 'thick'}", b, body, probes, _arc(2e-3))


@dataclass
class Track:
    """A walked path: loads (n,), displacements (n, probes), states (n of (nodes, 6)), inertias; what it cost."""

    case: Case
    equilibrium: Any
    probe: Callable[[np.ndarray], np.ndarray]
    status: str
    message: str
    steps: list[Any]
    loads: np.ndarray
    displacements: np.ndarray
    states: list[np.ndarray]
    negative: list[int | None]
    seconds: float
    polish: int = 0
    unsolved: int = 0

    @property
    def model(self) -> Any:
        """The discrete shell."""
        return self.equilibrium.model

    @property
    def rejected(self) -> int:
        """Attempts that failed."""
        return sum(not step.accepted for step in self.steps)

    def curve(self) -> CubicSpline:
        """(load, displacements) as cubic spline over the chord length, each divided by its range in the table."""
        table = self.case.benchmark.table
        columns = [0] + [self.case.benchmark.columns.index(p.column) for p in self.case.probes]
        points = np.column_stack([self.loads, self.displacements])
        chords = np.linalg.norm(np.diff(points / np.ptp(table[:, columns], axis=0), axis=0), axis=1)
        return CubicSpline(np.concatenate([[0.0], np.cumsum(chords)]), points)

    def at_loads(self, loads: np.ndarray, solve: bool = True) -> np.ndarray:
        """(rows, probes) displacements where the path first carries each load; NaN where it does not.

        solve: Newton at exactly that load from the interpolated state; else the spline through the points.
        """
        spline, states = self.curve(), None
        out = np.full((len(loads), len(self.case.probes)), np.nan)
        for row, load in enumerate(loads):
            exact = np.flatnonzero(np.abs(self.loads - load) < 1e-9)
            passed = np.flatnonzero((self.loads[:-1] - load) * (self.loads[1:] - load) < 0.0)
            if len(exact) and (not len(passed) or exact[0] <= passed[0]):
                out[row] = self.displacements[exact[0]]
            elif len(passed):
                k = passed[0]
                low, high = spline.x[k], spline.x[k + 1]
                place = brentq(lambda x, load=load: spline(x)[0] - load, low, high)
                if solve:
                    states = CubicSpline(spline.x, np.array(self.states)) if states is None else states
                    out[row] = self.solved(states(place), load, k, (place - low) / (high - low))
                else:
                    out[row] = spline(place)[1:]
        return out

    def solved(self, state: np.ndarray, load: float, k: int, share: float) -> np.ndarray:
        """(probes,) displacements of the equilibrium at this load near a state this share of the way from point k on.

        Newton starts there, then from both points; where all of them fail or jump (the load nearly stands still) the
        interpolated displacements, and `unsolved` counts them.
        """
        near = retract(state, np.zeros_like(state))
        self.model.set_control(LOAD[0].at(load))
        older, newer = (self.model.stress(x) for x in self.states[k : k + 2])
        guess = self.probe(near)
        ranges = [np.ptp(self.case.benchmark.column(p.column)) for p in self.case.probes]
        starts = ((near, older.extrapolate(newer, -share)), (self.states[k], older), (self.states[k + 1], newer))
        for start, stress in starts:
            attempt = self.equilibrium.solve(start, stress, LOAD[0], load)
            self.polish += attempt.iterations
            found = self.probe(attempt.state)
            if attempt.converged and np.max(np.abs(found - guess) / ranges) < 0.02:
                return found
        self.unsolved += 1
        return guess

    def deviations(self, factor: float = 1.0, solve: bool = True) -> np.ndarray:
        """(rows, probes) displacement minus the table's, over the table's largest of that column.

        factor: what the same comparison gives for a load (or a 1 / E) that is wrong by this factor.
        """
        b = self.case.benchmark
        table = np.column_stack([b.column(p.column) for p in self.case.probes])
        return (self.at_loads(b.table[:, 0] * factor, solve) - table) / np.max(np.abs(table), axis=0)

    def distances(self, factor: float = 1.0) -> np.ndarray:
        """(rows,) distance of the table's rows from the path, load and displacement over their ranges in the table.

        Rows beyond the path's end are left out.
        """
        b = self.case.benchmark
        table = np.column_stack([b.table[:, 0] * factor, b.column(self.case.probes[0].column)])
        ranges = np.ptp(b.table[:, [0, b.columns.index(self.case.probes[0].column)]], axis=0)
        spline = self.curve()
        path = spline(np.linspace(0.0, spline.x[-1], 4001))[:, :2]
        table = table[table[:, 1] < path[-1, 1]]
        gaps = np.linalg.norm((table[:, None] - path[None]) / ranges, axis=2)
        return np.min(gaps, axis=1)

    def limit_points(self) -> np.ndarray:
        """(k, 2) load and first displacement where the load turns back, on the spline through the points."""
        spline = self.curve()
        turns = spline.derivative().roots(extrapolate=False)[0]
        return spline(turns)[:, :2]


def walk(case: Case, options: ShellOptions | None = None) -> Track:
    """Walk a case along its path and look at its probes at every accepted point."""
    from shellref.fenics import dolfinx_api as api
    from shellref.path.arc import Point
    from shellref.path.newton import Equilibrium
    from shellref.path.walk import Walk, Walker
    from shellref.shell.naghdi import NaghdiModel

    options = options or case.options
    begin = time.perf_counter()
    model = NaghdiModel(case.body, options.stabilisation, comm=api.communicator("self"))
    equilibrium = Equilibrium(model, options)
    order = model.grid.order(model.nodes)
    where = [order[model.grid.positions(np.array([p.place]))][0] for p in case.probes]
    axes, signs = [p.axis for p in case.probes], np.array([p.sign for p in case.probes])

    def probe(state: np.ndarray) -> np.ndarray:
        return signs * (state[where, axes] - model.reference[where, axes])

    states: list[np.ndarray] = []

    def observe(state: np.ndarray) -> dict[str, Any]:
        states.append(state.copy())
        return {"state": len(states) - 1}

    walker = Walker(equilibrium, case.stages, options, observe=observe)
    path = Walk(Point(0.0, model.reference, None))  # type: ignore[arg-type]
    walker.start(path)
    walker.run(path)
    good = [step for step in path.steps if step.accepted and step.method in ("start", "load", "arc")]
    kept = [states[step.values["state"]] for step in good]
    return Track(
        case=case,
        equilibrium=equilibrium,
        probe=probe,
        status="converged" if path.status is None else path.status.value,
        message=path.message,
        steps=path.steps,
        loads=np.array([step.load for step in good]) * case.stages[0].end.load,
        displacements=np.array([probe(state) for state in kept]),
        states=kept,
        negative=[step.negative for step in good],
        seconds=time.perf_counter() - begin,
    )
