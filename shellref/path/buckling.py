"""Buckling of a loaded shell: the critical load by linearisation (SLEPc) and by bisection on the inertia.

At an equilibrium u(t) of the path, with K the reduced tangent and K' its derivative along the path,

    (K(t) + x K'(t)) v = 0 ,   t_c = t + x + O(x^2)

so the smallest x > 0 estimates the distance to the singular tangent, with an error that falls with its square as t
approaches t_c (docs/theory.md, eq. (7.12)). K' is the central difference of K along the path's tangent, with tangent
vectors of the directors carried over. Bisection looks only at the signs of the pivots of K at equilibria on the path:
nothing is shared but K itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shellref.fenics import dolfinx_api as api
from shellref.fenics import petsc_api as petsc
from shellref.path.arc import Point, locate
from shellref.path.walk import Walk, Walker
from shellref.shell.director import Bases, retract
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem
from shellref.shell.result import ShellStatus

DIFFERENCE = 1e-3  # of the load, for K'


@dataclass(frozen=True)
class Estimate:
    """A linearised critical load: from the state at `load`, the first singular tangent is expected at `critical`."""

    load: float
    critical: float


@dataclass(frozen=True)
class Buckling:
    """The first singular tangent on a stage of the path; loads are fractions of the stage.

    status: CONVERGED when both methods found it; message: what went wrong otherwise. inertia: middle of `bracket` (last
    stable, first unstable load). estimates: linearised critical loads, the last from closest by; linearised: the one
    that settled.
    mode (2 nx + 1, 2 ny + 1, 6): critical mode on the grid, largest component 1. factor: what a load of 1 stands for
    (Gamma, for a strip under its weight); critical = factor * inertia.
    """

    status: ShellStatus
    message: str
    inertia: float | None = None
    bracket: tuple[float, float] | None = None
    linearised: float | None = None
    estimates: tuple[Estimate, ...] = ()
    mode: np.ndarray | None = None
    factor: float = 1.0
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def critical(self) -> float | None:
        """The critical load, factor included."""
        return None if self.inertia is None else self.factor * self.inertia

    @property
    def difference(self) -> float | None:
        """Relative difference of the two methods."""
        if self.inertia is None or self.linearised is None:
            return None
        return abs(self.linearised / self.inertia - 1.0)


def tangent_change(walker: Walker, walk: Walk) -> Any:
    """dK/dload (PETSc) along the path at the walk's point, in the tangent vectors of its state.

    None when there is no du/dload.
    """
    e, stage, point = walker.equilibrium, walker.stages[walk.stage], walk.point
    sway, _ = e.tangent_of(point.state, stage, point.load)
    if sway is None:
        return None
    bases = e.last_bases
    matrices = []
    for sign in (1.0, -1.0):
        state = retract(point.state, sign * DIFFERENCE * sway)
        e.model.set_control(stage.at(point.load + sign * DIFFERENCE))
        stress = e.model.stress(state)
        tangents = e.increments.edge_tangents(state, e.model.control)
        nearby = Bases(carried(bases.directors, state[:, 3:]), tangents)
        e.assemble(state, stress, e.model.force(state, stress), bases=nearby)
        matrices.append(e.matrix.copy())
    plus, minus = matrices
    plus.axpy(-1.0, minus)
    plus.scale(0.5 / DIFFERENCE)
    minus.destroy()
    return plus


def carried(bases: np.ndarray, directors: np.ndarray) -> np.ndarray:
    """Tangent vectors (n, 3, 2) of nearby directors made tangent and orthonormal at these (n, 3)."""
    first, second = (b - directors * np.sum(b * directors, axis=1)[:, None] for b in (bases[..., 0], bases[..., 1]))
    first = first / np.linalg.norm(first, axis=1)[:, None]
    second = second - first * np.sum(first * second, axis=1)[:, None]
    return np.stack([first, second / np.linalg.norm(second, axis=1)[:, None]], axis=2)


def linearised(walker: Walker, walk: Walk) -> tuple[Estimate | None, np.ndarray | None]:
    """Critical load expected from the walk's point, and its mode (nodes, 6); None when that point is not stable."""
    e, stage, point = walker.equilibrium, walker.stages[walk.stage], walk.point
    change = tangent_change(walker, walk)
    if change is None:
        return None, None
    if e.negative_eigenvalues(point.state, stage, point.load) != 0:  # K itself, factored
        change.destroy()
        return None, None
    distances, vectors = petsc.buckling_pairs(e.matrix, change, 1, e.factors)
    change.destroy()
    if not len(distances):
        return None, None
    mode = e.expand(vectors[0], e.last_bases)
    return Estimate(point.load, point.load + float(distances[0])), mode / e.largest(mode)


def settled(estimates: list[Estimate]) -> float | None:
    """The critical load of the estimate that changed least from the one before.

    The error falls with the square of the distance until, very near to a thin strip's singular tangent, rounding grows.
    """
    if len(estimates) < 2:
        return estimates[-1].critical if estimates else None
    critical = np.array([e.critical for e in estimates])
    return float(critical[1 + int(np.argmin(np.abs(np.diff(critical))))])


def find(walker: Walker, walk: Walk, factor: float = 1.0, closeness: float = 1e-4) -> Buckling:
    """The first singular tangent on the walk's stage, from its point on.

    Walks in load steps without leaving unstable states until the inertia changes, then bisects to `event_tolerance`.
    Linearised estimates are made at every stable point on the way, then ever nearer, until the state is within
    `closeness` of the critical load: the bracket itself is not used in them.
    """
    stage = walker.stages[walk.stage]
    estimates: list[Estimate] = []
    before = walk.point
    step = walker.options.first_step
    while not walk.point.negative:
        if walk.point.load >= 1.0:
            message = f"{stage.name} is stable up to its full value: raise the load"
            return Buckling(ShellStatus.CONVERGED, message, estimates=tuple(estimates), factor=factor)
        before = walk.point
        if before.load > 0.0 and step == walker.options.first_step:
            estimates += [e for e in [linearised(walker, walk)[0]] if e is not None]
        load = min(1.0, before.load + step)
        begin = walker.predict(walk, load)
        attempt = walker.equilibrium.solve(begin.state, begin.stress, stage, load)
        negative = None
        if attempt.converged:
            negative = walker.equilibrium.negative_eigenvalues(attempt.state, stage, load)
        walker.log(walk, "load", load, attempt, negative is not None)
        if negative is None:  # not solved for, or not known to be stable or not
            step *= walker.options.cut
            walk.older = None
            if step < walker.options.min_step:
                return Buckling(
                    ShellStatus.NOT_CONVERGED,
                    f"{stage.name} stopped at {before.load:.6g} of its full value, before any instability",
                    estimates=tuple(estimates),
                    factor=factor,
                )
            continue
        walk.older, walk.point = before, Point(load, attempt.state, attempt.stress, negative)
    low, high = locate(walker, walk, before, walk.point)
    bracket = (low.load, high.load)
    middle = 0.5 * (low.load + high.load)
    mode = None
    for distance in (0.1, 0.01, 1e-3, closeness):
        load = middle * (1.0 - distance)
        if not before.load < load < low.load or distance < closeness:
            continue
        t = (load - before.load) / (low.load - before.load) if low.load > before.load else 1.0
        state = retract(before.state, t * (low.state - before.state))
        attempt = walker.equilibrium.solve(state, before.stress.extrapolate(low.stress, -t), stage, load)
        if not attempt.converged:
            continue
        walk.older, walk.point = None, Point(load, attempt.state, attempt.stress, 0)
        estimate, mode_here = linearised(walker, walk)
        if estimate is not None:
            estimates.append(estimate)
            mode = mode_here
    last = settled(estimates)
    return Buckling(
        ShellStatus.CONVERGED if last is not None else ShellStatus.NOT_CONVERGED,
        "critical load by inertia and by linearisation" if last is not None else "no linearised estimate converged",
        middle,
        bracket,
        last,
        tuple(estimates),
        None if mode is None else walker.model.on_grid(mode),
        factor,
    )


def buckling(problem: ShellProblem, options: ShellOptions | None = None, progress: Any = None) -> Buckling:
    """The weight at which a strip under its own weight becomes unstable: `critical` is Gamma. Of a weightless strip
    with a force at its end: the fraction of that force.

    problem.gamma is the largest weight looked at (problem.tip the largest force). The path before the last stage
    is walked as `solve` does.
    """
    import dataclasses

    from shellref.path.solve import Solver
    from shellref.shell.strip import build_strip

    options = options or ShellOptions(event_tolerance=1e-6)
    if not problem.loaded and not problem.pulled:
        from shellref.inputs import ShellInputError

        raise ShellInputError("gamma", problem.gamma, "buckling under a load needs one: gamma above 0 and up, or tip")
    quiet = dataclasses.replace(options, kick=False, switch=False, arc_length="never")
    solver = Solver(build_strip(problem, quiet), quiet, api.communicator("self"), progress or (lambda event: None))
    stages = solver.strip.stages
    walker = Walker(solver.equilibrium, stages, quiet, solver.report, solver.observe)
    walk = Walk(Point(0.0, solver.strip.initial_state(solver.model.nodes), None))  # type: ignore[arg-type]
    walker.start(walk)
    while walk.status is None and walk.stage < len(stages) - 1:
        walker.load_steps(walk)
        walk.stage, walk.older, walk.step = walk.stage + 1, None, None
        walk.point.load = 0.0
    factor = problem.gamma if problem.loaded else 1.0
    if walk.status is not None:
        return Buckling(walk.status, walk.message, factor=factor)
    return find(walker, walk, factor)
