"""From a problem to a result: natural shape, gravity in adaptive steps with cut-back, stability, report."""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shellref.clamps import reactions
from shellref.midsurface import flat_strip, natural_strip
from shellref.problem import ShellOptions, ShellProblem
from shellref.result import LoadStep, ShellResult, ShellStatus
from shellref.surface import ShellSurface

Progress = Callable[[dict[str, Any]], None]
EASY_ITERATIONS = 7
MOST_KICKS = 20


@dataclass
class _Point:
    """A state on the load path: fraction of the stage's load, nodal values (nodes, 6), stress."""

    load: float
    state: np.ndarray
    stress: Any


@dataclass
class _Path:
    """The walk so far: the last good point, the fractions reached and every attempt."""

    point: _Point
    natural: float = 0.0
    gravity: float = 0.0
    steps: list[LoadStep] = field(default_factory=list)
    negative: int | None = None
    eigenvalue: float | None = None
    failure: str = ""
    kicks: int = 0
    left: bool = True


def solve(problem: ShellProblem, options: ShellOptions | None = None, progress: Progress | None = None) -> ShellResult:
    """Equilibrium of a clamped strip under natural curvature and weight (units: see ShellProblem, ShellResult).

    `progress` is called with a plain dict at every event ("built", "step", "kick", "done"). A load step that cannot be
    made is a status of the result, not an exception. Raises `dolfinx_api.DolfinxMissing` when dolfinx is not there.
    """
    options = options or ShellOptions()
    report = progress or (lambda event: None)
    begin = time.perf_counter()
    from shellref import dolfinx_api as api
    from shellref.naghdi import NaghdiModel
    from shellref.newton import Equilibrium

    imported = time.perf_counter()
    model = NaghdiModel(problem, options)
    equilibrium = Equilibrium(model, options)
    built = time.perf_counter()
    report({"event": "built", "unknowns": equilibrium.unknowns, "seconds": built - begin})

    frame, position = np.array(problem.clamp_frame), np.array(problem.clamp_position)
    s, v = model.nodes.T
    if options.natural_path == "exact":
        start = natural_strip(s, v, position, frame, problem.natural_curvature)
    else:
        start = flat_strip(s, v, position, frame)
    state = np.hstack(start)
    walker = _Walker(model, equilibrium, options, report)
    exact = options.natural_path == "exact" or problem.natural_curvature == (0.0, 0.0)
    path = _Path(_Point(0.0, state, None), natural=1.0 if exact else 0.0)
    walker.start(path)
    first = time.perf_counter()
    if not path.failure and path.natural < 1.0:
        walker.stage(path, "natural")
    if not path.failure and problem.loaded:
        walker.stage(path, "gravity")
    elif not path.failure:
        path.gravity = 1.0
    status, message = walker.verdict(path)
    seconds = {
        "import": imported - begin,
        "compile": built - imported,
        "first": first - built,
        **{name: round(value, 6) for name, value in equilibrium.seconds.items()},
        "total": time.perf_counter() - begin,
    }
    result = _result(problem, options, model, equilibrium, path, status, message, seconds, api.versions())
    report({"event": "done", "status": result.status.value, "message": result.message, "seconds": seconds["total"]})
    return result


class _Walker:
    """Moves a path along its load stages."""

    def __init__(self, model: Any, equilibrium: Any, options: ShellOptions, report: Progress):
        self.model, self.equilibrium, self.options, self.report = model, equilibrium, options, report

    def _log(self, path: _Path, step: LoadStep) -> None:
        path.steps.append(step)
        self.report({"event": "step", **step.to_dict()})

    def start(self, path: _Path) -> None:
        """Newton on the starting shape, without weight."""
        self.model.set_load(path.natural, 0.0)
        attempt = self.equilibrium.solve(path.point.state)
        self._log(
            path,
            LoadStep(
                "natural",
                path.natural,
                attempt.converged,
                attempt.iterations,
                attempt.correction,
                attempt.negative,
                "start",
            ),
        )
        if not attempt.converged:
            path.failure = f"the starting shape did not converge in {attempt.iterations} iterations: raise max_newton"
            path.point.stress = self.model.stress(path.point.state)
            return
        path.point = _Point(0.0, attempt.state, attempt.stress)
        self._settle(path, "natural", attempt.negative)

    def stage(self, path: _Path, name: str) -> None:
        """Bring one load ("natural" or "gravity") from 0 to 1."""
        o = self.options
        path.point.load = 0.0
        older: _Point | None = None
        step = o.first_step
        while path.point.load < 1.0:
            load = min(1.0, path.point.load + step)
            if 1.0 - load < 0.2 * step:
                load = 1.0
            self.model.set_load(*((load, 0.0) if name == "natural" else (1.0, load)))
            state, stress = self._predict(path.point, older, load)
            attempt = self.equilibrium.solve(state, stress)
            self._log(
                path, LoadStep(name, load, attempt.converged, attempt.iterations, attempt.correction, attempt.negative)
            )
            if not attempt.converged:
                older = None
                step = o.cut * (load - path.point.load)
                if step < o.min_step:
                    path.failure = (
                        f"{name} stopped at {path.point.load:.6g} of its full value: the next step fell under min_step"
                        f" = {o.min_step:g}; a smaller min_step, a larger max_newton or a finer mesh may pass, a limit"
                        " point will not"
                    )
                    return
                continue
            older, path.point = path.point, _Point(load, attempt.state, attempt.stress)
            if name == "natural":
                path.natural = load
            else:
                path.gravity = load
            if self._settle(path, name, attempt.negative):
                older = None
            if attempt.iterations <= EASY_ITERATIONS:
                step = min(o.max_step, o.growth * step)

    def _predict(self, point: _Point, older: _Point | None, load: float) -> tuple[np.ndarray, Any]:
        """Linear extrapolation of the last two points to `load`."""
        if older is None or not self.options.predict:
            return point.state, point.stress
        from shellref.director import retract

        ratio = (load - point.load) / (point.load - older.load)
        return retract(point.state, ratio * (point.state - older.state)), point.stress.extrapolate(older.stress, ratio)

    def _settle(self, path: _Path, name: str, negative: int | None) -> bool:
        """Check stability at a converged point; leave an unstable one when asked. True when the state jumped."""
        if not self.options.stability:
            return False
        path.negative = negative
        if not negative or not self.options.kick or path.kicks >= MOST_KICKS:
            return False
        path.kicks += 1
        attempt = self.equilibrium.leave_saddle(path.point.state, negative)
        moved = float(np.max(np.abs(attempt.state - path.point.state)))
        self.report({"event": "kick", "load": path.point.load, "converged": attempt.converged, "moved": moved})
        self._log(
            path,
            LoadStep(
                "relax",
                path.point.load,
                attempt.converged,
                attempt.iterations,
                attempt.correction,
                attempt.negative,
                f"left an unstable {name} state with {negative} negative eigenvalue(s); moved by {moved:.3g}",
            ),
        )
        if not attempt.converged:
            path.kicks = MOST_KICKS  # the path goes on along the unstable branch, and its end says so
            path.left = False
            return False
        path.negative = attempt.negative
        path.point = _Point(path.point.load, attempt.state, attempt.stress)
        return True

    def verdict(self, path: _Path) -> tuple[ShellStatus, str]:
        """Status and message of the end of a path; the inertia is checked afresh at the final state."""
        if path.failure:
            path.negative = None
            return ShellStatus.NOT_CONVERGED, path.failure
        if self.options.stability:
            path.negative = self.equilibrium.negative_eigenvalues(path.point.state)
            path.eigenvalue, _ = self.equilibrium.lowest_mode(path.point.state, path.negative)
        if path.negative:
            remedy = "set kick = true to leave it" if not self.options.kick else "try smaller steps (max_step)"
            return ShellStatus.UNSTABLE, f"unstable equilibrium, {path.negative} negative eigenvalue(s): {remedy}"
        note = f"; left {path.kicks} unstable state(s) on the way" if path.kicks and path.left else ""
        return ShellStatus.CONVERGED, f"equilibrium at the full load{note}"


def _upright(surface: ShellSurface) -> float:
    """Smallest cosine between director and normal over the elements: normal from the diagonals of each element."""
    p, d = surface.points, surface.directors[1::2, 1::2]
    normal = np.cross(p[2::2, 2::2] - p[:-2:2, :-2:2], p[:-2:2, 2::2] - p[2::2, :-2:2])
    length = np.linalg.norm(normal, axis=-1)
    return float(np.min(np.sum(normal * d, axis=-1) / np.where(length > 0, length, np.inf)))


def _result(
    problem: ShellProblem,
    options: ShellOptions,
    model: Any,
    equilibrium: Any,
    path: _Path,
    status: ShellStatus,
    message: str,
    seconds: dict[str, float],
    versions: dict[str, str],
) -> ShellResult:
    """Collect everything known about the last good state of a path."""
    state = path.point.state
    model.set_load(path.natural, path.gravity)
    residual = model.residual(state)
    reduced = equilibrium.reduced_residual(state)
    absolute = float(np.linalg.norm(reduced))
    scale = float(np.linalg.norm(model.weight_forces())) + float(np.linalg.norm(residual[equilibrium.held]))
    energies = model.energies(state)
    order = model.grid.order(model.nodes)
    surface = ShellSurface(model.grid.s_nodes, model.grid.v_nodes, state[order, :3], state[order, 3:])
    if status is not ShellStatus.NOT_CONVERGED and _upright(surface) < 0.5:
        status = ShellStatus.INVALID
        message = "the director is over 60 degrees from the normal somewhere: refine the mesh"
    parts = {"bending": energies.bending, "membrane": energies.membrane, "shear": energies.shear}
    elastic = energies.elastic
    force, moment = reactions(state, residual, equilibrium.held, np.array(problem.clamp_position))
    return ShellResult(
        problem=problem,
        options=options,
        status=status,
        message=message,
        surface=surface,
        load_factor=path.gravity,
        natural_factor=path.natural,
        stable=None if path.negative is None else path.negative == 0,
        negative_eigenvalues=path.negative,
        lowest_eigenvalue=path.eigenvalue,
        residual={"absolute": absolute, "relative": absolute / max(1.0, scale)},
        newton_iterations=equilibrium.iterations,
        factorisations=equilibrium.factorisations,
        steps=tuple(path.steps),
        energy={**parts, "elastic": elastic, "gravity": energies.gravity, "total": energies.total},
        share={name: part / elastic if elastic > 0 else 0.0 for name, part in parts.items()},
        stabilisation={
            "c": options.stabilisation,
            "alpha": model.alpha,
            "energy": energies.stabilisation,
            "share": energies.stabilisation / elastic if elastic > 0 else 0.0,
        },
        clamp_force=force,
        clamp_moment=moment,
        cell_midpoints=model.midpoints,
        energy_density=energies.density,
        unknowns=equilibrium.unknowns,
        seconds=seconds,
        memory_mb=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
        provenance={
            "versions": versions,
            "linear_solver": "MUMPS L D L^T",
            "processes": 1,
            "threads": os.environ.get("OMP_NUM_THREADS", "default"),
        },
    )
