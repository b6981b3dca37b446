"""One strip on one mesh: its discrete model, the walk along its path, and the result of that."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ribbonbench import sources, system
from shellref import law
from shellref.contact import report as contact_report
from shellref.holds import parts
from shellref.shell.body import Control, Supports
from shellref.shell.clamps import reactions
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem
from shellref.shell.result import ShellResult, ShellStatus
from shellref.shell.strip import Strip
from shellref.shell.surface import ShellSurface

if TYPE_CHECKING:
    from shellref.path.point import Walk
    from shellref.path.walk import Verdict

Progress = Callable[[dict[str, Any]], None]
HOURGLASS = 0.02  # share of the elastic energy in the stabilisation, above which a state is no shell's


@dataclass
class Solver:
    """One strip on one mesh: model, Newton and walker, and the result of a walk."""

    strip: Strip
    options: ShellOptions
    comm: Any
    report: Progress
    unfinished: Any = None  # the journal of a walk that has reached its end

    def __post_init__(self) -> None:
        from shellref.fenics import petsc_api as petsc
        from shellref.path.newton import Equilibrium
        from shellref.shell.naghdi import NaghdiModel

        begin = time.perf_counter()
        petsc.collected(self.comm)  # of meshes before this one
        self.model = NaghdiModel(self.strip.body, self.options.stabilisation, self.comm, self.options.engine)
        self.equilibrium = Equilibrium(self.model, self.options)
        seconds = time.perf_counter() - begin
        self.report({"event": "built", "unknowns": self.equilibrium.unknowns, "seconds": seconds})

    def observe(self, state: np.ndarray) -> dict[str, Any]:
        """Middle and end of the centreline (units l); of a tape spring what its clamps carry too, see `carried`."""
        surface = self.surface(state)
        found: dict[str, Any] = {
            name: surface.centreline(np.array(s)).tolist() for name, s in (("middle", 0.5), ("end", 1.0))
        }
        if self.strip.problem.transverse_curvature:
            found["clamps"] = {
                where: {name: vector.tolist() for name, vector in clamp.items()}
                for where, clamp in self.carried(state).items()
            }
        return found

    def surface(self, state: np.ndarray) -> ShellSurface:
        """The surface of a state, whole on every process."""
        grid, field = self.model.grid, self.model.on_grid(state)
        return ShellSurface(grid.s_nodes, grid.v_nodes, field[..., :3], field[..., 3:], grid.degree)

    def state_of(self, surface: ShellSurface) -> np.ndarray:
        """Nodal values (nodes, 6) of a surface on another mesh of the same strip."""
        s, v = self.model.nodes.T
        return np.hstack([surface.evaluate(s, v), surface.director(s, v)])

    def _held(self, state: np.ndarray) -> np.ndarray:
        """The state (nodes, 6) with its seam closed; a strip that may move as a whole is held near it."""
        tie = self.equilibrium.supports.tie
        if tie is not None:
            state = tie.placed(state)
        supports = self._supports_near(state)
        if supports is not None:
            from shellref.path.newton import Equilibrium

            self.equilibrium = Equilibrium(self.model, self.options, supports)
        return state

    def _supports_near(self, state: np.ndarray) -> Supports | None:
        """What holds a strip that may move as a whole near a state (nodes, 6); on several processes found by each of
        them for all nodes, and dealt out."""
        model = self.model
        where = self.equilibrium.everywhere
        whole = self.strip.supports_near(where.every(state), where.nodes)
        if whole is None or where.alone:
            return whole
        return whole.dealt(model.grid.numbers(model.nodes), self.equilibrium.supports.tie, where.every)

    def run(self, start: ShellSurface | None = None, folder: str | os.PathLike[str] | None = None) -> ShellResult:
        """Walk the path, or settle from a surface at the full load."""
        from shellref.path.point import Point, Walk
        from shellref.path.walk import Walker

        begin = time.perf_counter()
        stages = self.strip.stages
        journal = None
        if folder is not None:
            from shellref.path.journal import FolderJournal, digest

            made_by = {"source": sources.digest(__name__)}
            key = digest(self.strip.problem.to_dict(), self.options.to_dict(), made_by)
            journal = FolderJournal(folder, key, self.model, stages)
        walk = journal.resume() if journal is not None and start is None else None
        first = 0.0
        if walk is not None:
            state = walk.point.state
        elif start is not None:
            state = self.state_of(start)
        else:
            where = self.equilibrium.everywhere  # it may lie on a wall with its lowest node, whosever that is
            state = where.own(self.strip.initial_state(where.nodes))
        state = self._held(state)
        walker = Walker(self.equilibrium, stages, self.options, self.report, self.observe, journal)
        if walk is None:
            walk = Walk(Point(0.0, state, None))  # type: ignore[arg-type]
            if start is None and not self.strip.problem.rests:
                walker.start(walk)
            else:  # what only lies on walls has no place without its weight
                walker.settle_at_end(walk)
            first = time.perf_counter() - begin
        else:
            self.equilibrium.iterations = sum(step.iterations for step in walk.steps)
            self.equilibrium.factorisations = sum(step.factorisations for step in walk.steps)
        walker.run(walk)
        verdict = walker.verdict(walk)
        if journal is not None and walk.status is None:
            self.unfinished = journal  # refinement may follow; until then the end of the walk is what is resumed
            journal.point(walk, now=True)
        seconds = {"first": first, **{name: round(value, 6) for name, value in self.equilibrium.seconds.items()}}
        return self._result(walk, verdict, seconds)

    def _result(self, walk: Walk, verdict: Verdict, seconds: dict[str, float]) -> ShellResult:
        """Collect everything known about the last good state of a walk."""
        from shellref.fenics import dolfinx_api as api

        problem, model, equilibrium, stages = self.strip.problem, self.model, self.equilibrium, self.strip.stages
        state, status, message = walk.point.state, verdict.status, verdict.message
        if stages:
            at = min(walk.stage, len(stages) - 1)
            model.set_control(stages[at].at(walk.point.load if walk.stage == at else 1.0))
        control = model.control
        residual = equilibrium.less_walls(model.residual(state), state)
        absolute = float(np.sqrt(equilibrium.total_of(equilibrium.reduced_residual(state) ** 2)))
        floats = equilibrium.supports.motions  # of what nothing holds: reactions are no forces of supports
        held = np.where(self._clamped, residual, 0.0)
        weight = model.external(state, control)
        scale = sum(float(np.sqrt(equilibrium.total(field**2))) for field in (weight, held))
        energies = model.energies(state)
        surface = self.surface(state)
        bad = (ShellStatus.NOT_CONVERGED, ShellStatus.LIMIT_POINT, ShellStatus.STRETCHED)
        if status not in bad and upright(surface) < 0.5:
            status = ShellStatus.INVALID
            message = "the director is over 60 degrees from the normal somewhere: refine the mesh"
        elif status not in bad and energies.stabilisation > HOURGLASS * max(energies.elastic, flattening(problem)) > 0:
            status = ShellStatus.INVALID
            message = (
                f"the stabilisation carries {energies.stabilisation / energies.elastic:.1%} of the elastic energy"
                " (hourglass modes): use more elements, two or more across"
            )
        crossed = None if equilibrium.contact is None else equilibrium.contact.crossing(state)
        if status not in bad and crossed is not None:
            status = ShellStatus.INVALID
            message = "it crosses itself at S = {:.4g} and {:.4g}: use smaller steps (max_step)".format(*crossed)
        parts = {"bending": energies.bending, "membrane": energies.membrane, "shear": energies.shear}
        elastic, stored = energies.elastic, sum(parts.values())
        clamps = self.carried(state, residual)
        touch = equilibrium.contact
        plates = 0.0 if touch is None else touch.energy
        return ShellResult(
            problem=problem,
            options=self.options,
            status=status,
            message=message,
            surface=surface,
            elements=model.grid.elements,
            load_factor=_factor(control, problem, walk.status is None),
            natural_factor=control.natural,
            path_factor=(walk.stage + (walk.point.load if walk.stage < len(stages) else 0.0)) / max(len(stages), 1),
            stable=verdict.stable,
            negative_eigenvalues=verdict.negative,
            lowest_eigenvalue=verdict.eigenvalue,
            residual={
                "absolute": absolute,
                "relative": absolute / max(1.0, scale),
                **({} if floats is None else self._sliding_force(floats(state), residual)),
            },
            newton_iterations=equilibrium.iterations,
            factorisations=equilibrium.factorisations,
            steps=tuple(walk.steps),
            energy={
                **parts,
                "stabilisation": energies.stabilisation,
                "elastic": elastic,
                "gravity": energies.gravity,
                **({} if problem.tip is None else {"tip": energies.tip}),
                **({} if touch is None else {"plates": plates}),
                "total": energies.total + plates,
            },
            share={name: part / stored if stored > 0 else 0.0 for name, part in parts.items()},
            stabilisation={
                "c": self.options.stabilisation,
                "alpha": model.largest_alpha,
                "energy": energies.stabilisation,
                "share": energies.stabilisation / elastic if elastic > 0 else 0.0,
            },
            clamps=clamps,
            walls=() if touch is None else tuple(contact_report.walls(touch, state, equilibrium.standing())),
            contact=None
            if touch is None
            else contact_report.contact(touch, state, equilibrium.standing(), surface, problem.thickness),
            pairs=() if touch is None else tuple(contact_report.pairs(touch)),
            cell_midpoints=api.gather_rows(model.comm, model.midpoints),
            energy_density=api.gather_rows(model.comm, energies.density),
            unknowns=equilibrium.unknowns,
            seconds=seconds,
            memory_mb=api.sum_over(model.comm, system.peak_memory()),
            provenance={
                "versions": api.versions(),
                "linear_solver": equilibrium.linear.name,
                "processes": model.comm.size,
                "threads": os.environ.get("OMP_NUM_THREADS", "default"),
            },
        )

    def _sliding_force(self, motions: np.ndarray, residual: np.ndarray) -> dict[str, float]:
        """{"sliding": dE/ds, D w / l^2}: the force with which the mesh resists that a band slides along itself, the
        last of its motions (k, nodes, 6); nothing where that turns it. residual (nodes, 6)."""
        problem = self.strip.problem
        fewer = problem.slides and bool(problem.walls)  # rigid motions are free on walls
        return {"sliding": self.equilibrium.total(motions[-1] * residual)} if len(motions) > 6 or fewer else {}

    @property
    def _clamped(self) -> np.ndarray:
        """(nodes, 6): what clamps hold, without what only keeps the strip from moving as a whole."""
        held, floating = self.equilibrium.held.copy(), self.equilibrium.supports.floating
        if floating is not None:
            held[:, :3] &= ~floating
        return held

    def carried(self, state: np.ndarray, residual: np.ndarray | None = None) -> dict[str, dict[str, np.ndarray]]:
        """{"start": {"force", "moment"}, "end": ...} of each clamp on the strip at its held point, D w / l^2, D w / l.

        residual (nodes, 6): of the state at the present control, when known.
        """
        residual = self.equilibrium.less_walls(self.model.residual(state), state) if residual is None else residual
        control, held = self.model.control, self._clamped.astype(float)
        origins = {edge.name: edge.point(state) for edge in self.equilibrium.supports.edges}
        fields = [self.model.on_grid(field).reshape(-1, 6) for field in (state, residual, held)]
        grid = self.model.grid
        s = np.repeat(grid.s_nodes, len(grid.v_nodes))
        out = {}
        sides = (("start", self.strip.start, s < 0.5), ("end", self.strip.end, s >= 0.5))
        for k, (name, path, side) in enumerate(sides):
            if path is not None and self.strip.problem.ends[k] != parts.NOTHING:
                where = (side | self.strip.problem.closed) & (fields[2].max(axis=1) > 0.5)
                origin = origins.get(name, path.at(control.move)[0])
                force, moment = reactions(fields[0], fields[1], where, origin)
                out[name] = {"force": force, "moment": moment}
        return out


def _factor(control: Control, problem: ShellProblem, arrived: bool) -> float:
    """The share of the loads that acts: of the weight, of what acts at the end, or 1 at the end of a path without."""
    if problem.loaded:
        return control.weight
    return control.load if problem.pulled or problem.twisted else float(arrived)


def flattening(problem: ShellProblem) -> float:
    """Energy (D w / l) that makes the natural shape flat: a scale for a strip that is in that shape; and, for one that
    hangs straight, that with which its weight bends a cantilever (Gamma^2 / 40 where light, Gamma / 2 where heavy).
    """
    rest = (problem.natural_curvature, problem.natural_twist)
    weight = min(problem.gamma**2 / 40.0, 0.5 * problem.gamma)
    return sum(0.5 * law.square(one) for one in rest) + 0.5 * problem.transverse_curvature**2 + weight


def upright(surface: ShellSurface) -> float:
    """Smallest cosine between director and normal over the elements: normal from the diagonals of each element."""
    k = surface.degree
    p, ends = surface.points[::k, ::k], (surface.s_nodes[::k], surface.v_nodes[::k])
    s, v = (0.5 * (x[1:] + x[:-1]) for x in ends)
    d = surface.director(s[:, None], v[None, :])
    normal = np.cross(p[1:, 1:] - p[:-1, :-1], p[:-1, 1:] - p[1:, :-1])
    length = np.linalg.norm(normal, axis=-1)
    return float(np.min(np.sum(normal * d, axis=-1) / np.where(length > 0, length, np.inf)))
