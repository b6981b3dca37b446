"""One equilibrium of the discrete shell: Newton on the free increments, at fixed load or on a plane of the path.

The reduced tangent is P^T K P + constraint curvature (see director.py), over the free increments only: what is held is
not in it, so its inertia counts the unstable directions of the supported shell. It is factored as L D L^T (linear.py).

Mixed integration point Newton (docs/theory.md, eq. (7.10)): at state u_j with stress sigma_j (an unknown of its own)
solve

    [ int T(u_j, .) C T(u_j, .) + sigma_j . T(., .) ] du = -dE/du(u_j) ,    sigma_{j+1} = C (E(u_j) + T(u_j, du))

so the right-hand side, and the solution, are Newton's; only the geometric stiffness differs on the way. Where supports
move, du at the held components is the way to their new place and enters the right-hand side as -K du_held: the strip
follows its clamps within the first linear solve.

Arc length (Riks 1979, doi:10.1016/0020-7683(79)90081-7): the load t is one more unknown and the state stays on the
plane through the predictor (u*, t*) normal to the tangent (v, r):  <v, u - u*> + r (t - t*) = 0, where <a, b> is the
mean over the surface of the product of positions (docs/theory.md, eq. (7.11)). Two solves with the same factors.

Walls and the like (shellref.contact): active places stay on them in every linear solve, whose tangent is that on the
increments that keep them there, and its inertia too; the active set changes between steps, and must have settled at the
end.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from shellref.contact.active import Contact
from shellref.contact.everywhere import Everywhere
from shellref.contact.sheet import Sheet
from shellref.contact.touching import touching
from shellref.contact.walls import Standing
from shellref.fenics import dolfinx_api as api
from shellref.fenics import petsc_api as petsc
from shellref.fenics.rank import Corrected
from shellref.path.linear import Linear, linear_system
from shellref.shell.body import Control, Stage, Supports
from shellref.shell.director import Bases, Increments, retract
from shellref.shell.edges import FreeEdge, PivotEdge, RigidEdge
from shellref.shell.naghdi import NaghdiModel, Stress
from shellref.shell.options import ShellOptions

THINNEST = 5e-6  # thickness over length at which rounding of the membrane stiffness hides the bending stiffness
SOFT = 1.0  # shift of a singular tangent, D / (areal mass l^4): a clamped-free strip's lowest eigenvalue is 12.4
STEP = 1e-5  # of a stage's load, for the rate of moving supports
WIDE = 0.1  # growing corrections above this are those of a lost iteration
QUADRATIC = 0.1  # a correction below this part of the one before it, and below NEAR, is in the quadratic regime
NEAR = 1e-3
PASSING = 1e-6  # what may be left of a state on the way, by quadratic convergence (positions in l, directors)
MOST_CHANGES = 60  # iterations of a solve that change what touches a wall, beside those of `max_newton`
LARGEST_CORRECTION = 3.0  # a larger component (in the length of the surface, or radians) is a failed solve


@dataclass(frozen=True)
class Plane:
    """The plane of an arc-length step: predictor (nodes, 6) and its load, tangent (nodes, 3) and its load rate."""

    state: np.ndarray
    load: float
    tangent: np.ndarray
    rate: float


@dataclass
class Attempt:
    """What a Newton solve came to; `negative` is the inertia of the last tangent, one correction before the state."""

    converged: bool
    state: np.ndarray
    stress: Stress
    iterations: int
    correction: float
    negative: int | None
    load: float = 0.0
    reason: str = ""  # why it failed, when more is known than that it did not converge
    changes: int = 0  # iterations that changed what touches a wall


def stress_rate(model: NaghdiModel, state: np.ndarray, sway: np.ndarray, stage: Stage, load: float) -> Stress:
    """The rate of the stress that belongs to a rate of nodal values (nodes, 6): C T(u, u') - C k_nat'."""
    model.set_control(stage.at(load))
    actual = model.stress(state)
    model.set_control(stage.at(load + 1.0))  # the stress is linear in the natural curvature
    change = model.stress(state, sway)
    model.set_control(stage.at(load))
    return Stress(change.full - actual.full, change.reduced - actual.reduced)


def _remaining(before: float, correction: float) -> float:
    """The next correction, by quadratic convergence from the last two; infinite where that is not seen."""
    if not (correction <= NEAR and correction <= QUADRATIC * before < np.inf):
        return np.inf
    return correction * (correction / before) ** 2


class Equilibrium:
    """Newton for one model; counts iterations, factorisations and seconds by part."""

    def __init__(self, model: NaghdiModel, options: ShellOptions, supports: Supports | None = None):
        """supports: others than the body's."""
        self.model, self.options = model, options
        self.supports: Supports = model.body.supports(model.grid, model.nodes) if supports is None else supports
        held = self.supports
        self.increments = Increments(held.translations, held.directors, model.owned, held.edges, held.tie)
        everywhere = api.gather_rows(model.comm, np.array([[float(self.increments.unknowns)]]))[:, 0]
        self.unknowns = int(everywhere.sum())
        self._offset = int(everywhere[: model.comm.rank].sum())
        self.held = self.increments.held
        self.everywhere = Everywhere(model)
        self.length = self._size()
        self.iterations = self.factorisations = 0
        self.last_bases, self.last_sway = Bases(np.zeros(0)), np.zeros(0)
        self._found: tuple[np.ndarray | None, Bases] = (None, self.last_bases)  # the state to which the factors belong
        self.trouble = ""  # why a factorisation failed last
        self._corrected: Corrected | None = None
        self._turned: tuple[np.ndarray, float] | None = None  # where a moment acts, and how much of it
        self.linear: Linear = linear_system(model, self.increments, self._offset)
        weights = model.nodal_areas[:, None] * np.ones(3)
        weights[model.owned :] = 0.0
        self._weights = weights / float(api.sum_over(model.comm, weights[:, 0].sum()))
        # areal mass 1, rotary inertia h^2 / 12
        translation = model.nodal_areas
        for edge in held.edges:
            translation = edge.lumped(translation) if isinstance(edge, FreeEdge) else translation
        self._inertia = translation, model.body.thickness**2 / 12.0 * model.nodal_areas
        self.mass = self.increments.nodal(*self._inertia, model.reference)
        self.contact = self._contact()

    def _contact(self) -> Contact | None:
        """What may touch something; None: there is nothing to touch."""
        path, held = self.model.body.walls, self.supports
        if path is None:
            return None
        places = np.ones(len(self.model.reference), dtype=bool)
        if held.tie is not None:
            places[held.tie.nodes] = False
        for edge in held.edges:
            flat = isinstance(edge, PivotEdge) or (isinstance(edge, RigidEdge) and not np.any(edge.arms[:, 1:]))
            if flat:  # a straight edge is before a plane where its corners are
                across = self.model.nodes[edge.nodes, 1]
                places[edge.nodes] = (across == across.min()) | (across == across.max())
        where = self.everywhere
        own = self.unknowns - sum(edge.unknowns for edge in held.edges)
        floating = np.zeros_like(held.translations) if held.floating is None else held.floating
        held_some = float(np.any(held.translations & ~floating))
        model = self.model
        carries = not held.edges and not api.max_over(model.comm, held_some)
        sheet = Sheet(model.grid, model.grid.order(where.nodes))
        closed = held.tie is not None
        projection = self._projection(self._bases(model.reference))
        rows = touching(path, sheet, where.nodes, where.mask(places), model.body.thickness, projection, closed)
        areas = where.every(model.nodal_areas[:, None])[:, 0]
        return Contact(path, rows, model.comm, own, where, areas, carries)

    def _projection(self, bases: Bases) -> Any:
        """P (6 N, unknowns) of all nodes, scipy.sparse."""
        from scipy.sparse import csr_matrix

        indptr, indices, values = self.increments.projection(bases, self._offset)
        return self.everywhere.rows(csr_matrix((values, indices, indptr), shape=(len(indptr) - 1, self.unknowns)))

    def standing(self) -> Standing:
        """Where what may be touched is at the model's control."""
        assert self.model.body.walls is not None
        control = self.model.control
        return self.model.body.walls.at(control.move, int(control.leg))

    def passed(self, state: np.ndarray, load: float, attempt: Attempt, stage: Stage) -> bool:
        """Whether an attempt ended on the other side of something that the strip may touch than the state (nodes, 6) at
        a load of the stage from which it set out."""
        walls = self.model.body.walls
        if self.contact is None or walls is None:
            return False
        controls = (stage.at(load), stage.at(attempt.load))
        one, other = (walls.at(control.move, int(control.leg)) for control in controls)
        return self.contact.passed(state, attempt.state, (one, other))

    def moving_mass(self, state: np.ndarray) -> np.ndarray | None:
        """C (unknowns, k): M - C C^T is the mass of a shell that is free to move as `Supports.motions` says, on the
        unknowns that are left; None: there are no such motions.

        With motions N, M the mass of all components, and M - M N (N^T M N)^-1 N^T M the mass that is left when each
        increment is brought to rest by the motion that takes most from it, C = M N R^-1, R^T R = N^T M N.
        """
        if self.supports.motions is None:
            return None
        increments, bases = self.increments, self._bases(state)
        found = self.supports.motions(state)
        translation, turn = self._inertia
        mass = np.stack([translation] * 3 + [turn] * 3, axis=1)
        heavy = mass * found
        own = self.model.owned
        within = np.tensordot(heavy[:, :own], found[:, :own], axes=([1, 2], [1, 2]))
        root = np.linalg.cholesky(api.sum_over(self.model.comm, within))  # lower: N^T M N = root root^T
        moved = np.tensordot(np.linalg.inv(root), heavy, axes=1)
        return np.ascontiguousarray(np.stack([increments.reduce(field, bases) for field in moved], axis=1))

    def _size(self) -> float:
        """Largest extent of the reference along an axis, to which corrections are compared."""
        reference = self.model.reference[:, :3]
        ends = [
            api.max_over(self.model.comm, float(np.max(sign * reference[:, k]))) for k in range(3) for sign in (1, -1)
        ]
        return float(max(ends[0] + ends[1], ends[2] + ends[3], ends[4] + ends[5]))

    def mean(self, a: np.ndarray, b: np.ndarray) -> float:
        """Mean over the surface of a . b, fields (nodes, 3 or more) of positions first."""
        return float(api.sum_over(self.model.comm, float(np.sum(self._weights * a[:, :3] * b[:, :3]))))

    def total(self, field: np.ndarray) -> float:
        """Sum of a nodal field (nodes, k) over all nodes."""
        return float(api.sum_over(self.model.comm, float(np.sum(field[: self.model.owned]))))

    def total_of(self, reduced: np.ndarray) -> float:
        """Sum of reduced vectors (unknowns of this process,) over all processes."""
        return float(api.sum_over(self.model.comm, float(np.sum(reduced))))

    def largest(self, field: np.ndarray) -> float:
        """Largest component of a field (nodes, 6) over all processes, lengths over the surface's size; infinite when
        not finite.
        """
        size = np.abs(field / np.array([self.length] * 3 + [1.0] * 3))
        value = float(np.max(size)) if np.all(np.isfinite(size)) else np.inf
        return float(api.max_over(self.model.comm, value))

    def target(self, stage: Stage, load: float, state: np.ndarray) -> np.ndarray:
        """The state with everything held put in its place at this load of the stage (nodes, 6).

        Outside [0, 1] (an arc-length step may go there) supports move on straight: at the ends of a stage the clamps'
        path may have a corner, and what comes beyond belongs to another stage.
        """
        inside = min(max(load, 0.0), 1.0)
        placed = self._placed(stage.at(inside).move, state)
        if load != inside and stage.rate().move:
            below, above = max(min(inside, 1.0) - STEP, 0.0), min(max(inside, 0.0) + STEP, 1.0)
            ahead, back = (self._placed(stage.at(x).move, state) for x in (above, below))
            ahead = retract(placed, (load - inside) / (above - below) * (ahead - back))
            placed = np.where(self.held, ahead, state)
        return self._edges_placed(placed, state, stage.at(load))

    def _placed(self, move: float, state: np.ndarray) -> np.ndarray:
        placement = self.supports.placement
        place = self.model.reference if placement is None else placement(move)
        return np.where(self.held, place, state)

    def _edges_placed(self, placed: np.ndarray, state: np.ndarray, control: Control) -> np.ndarray:
        for edge in self.supports.edges:
            placed[edge.nodes] = edge.placed(state, control)
        return placed if self.supports.tie is None else self.supports.tie.placed(placed)

    def _held_rate(self, state: np.ndarray, stage: Stage, load: float) -> np.ndarray:
        """d(target)/dload (nodes, 6): a difference within the stage."""
        below, above = max(min(load, 1.0) - STEP, 0.0), min(max(load, 0.0) + STEP, 1.0)
        ahead, back = (self._placed(stage.at(x).move, state) for x in (above, below))
        rate = (ahead - back) / (above - below)
        for edge in self.supports.edges:
            ahead, back = (edge.placed(state, stage.at(load + x)) for x in (STEP, -STEP))
            rate[edge.nodes] = (ahead - back) / (2.0 * STEP)
        return rate if self.supports.tie is None else self.supports.tie.placed(rate)

    def reduced_residual(self, state: np.ndarray) -> np.ndarray:
        """P^T (dE/du - what the walls exert) on the free increments (unknowns of this process,)."""
        return self.increments.reduce(self.less_walls(self.model.residual(state), state), self._bases(state))

    def less_walls(self, force: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Nodal forces (n, 6) at a state (n, 6) without what is exerted at active places, which balances them."""
        if self.contact is None:
            return force
        self.contact.see(state, self.standing())
        return force - self.contact.forces()

    def _bases(self, state: np.ndarray) -> Bases:
        return self.increments.bases(state, self.model.control)

    def factor(self, state: np.ndarray, stress: Stress, force: np.ndarray, shift: float = 0.0) -> Bases:
        """Factorise the reduced tangent + shift * mass; force (nodes, 6): the residual that belongs to `stress`.

        Returns the bases of its unknowns. Raises petsc_api.FactorisationFailed.
        """
        bases = self.assemble(state, stress, force, shift)
        if self.contact is None:
            self.linear.factor()
        else:
            start = time.perf_counter()
            self.contact.factor(self.linear.matrix, self._projection(bases))
            self.linear.spend("factor", start)
        self.factorisations += 1
        self._corrected = self._with_moment(state, bases)
        return bases

    def _with_moment(self, state: np.ndarray, bases: Bases) -> Corrected | None:
        """The factors with the tangent of a moment, which is not symmetric; None: no moment acts, or the saddle system
        of what touches has it."""
        moment, load = self.model.moment, self.model.control.load
        self._turned = None if moment is None or not load else (state, load)
        if moment is None or not load:
            return None
        columns = np.stack([self.increments.reduce(field, bases) for field in moment.columns(len(state))], axis=1)
        tangent = load * moment.tangent(state)
        if self.contact is None:
            return Corrected(self.linear.factors, columns, tangent)
        self.contact.saddle.correct(columns, tangent)
        return None

    def assemble(
        self,
        state: np.ndarray,
        stress: Stress,
        force: np.ndarray,
        shift: float = 0.0,
        bases: Bases | None = None,
    ) -> Bases:
        """The reduced tangent, not factored; as `factor`. bases: other tangent vectors than usual."""
        self._found = (None, self.last_bases)
        bases = self._bases(state) if bases is None else bases
        force = self.less_walls(force, state)
        diagonal = self.increments.constraint_curvature(state, force, self.model.control)
        blocks = self.increments.couplings(state, force, self.model.control)
        self.linear.assemble(state, stress, bases, diagonal + shift * self.mass, blocks)
        return bases

    @property
    def seconds(self) -> dict[str, float]:
        """What was spent, by part."""
        return self.linear.seconds

    @property
    def matrix(self) -> Any:
        """The reduced tangent last assembled (PETSc)."""
        return self.linear.matrix

    @property
    def factors(self) -> Any:
        """Its factors (petsc_api.Factor), on what keeps active places on their walls where there are some."""
        return self.linear.factors if self.contact is None else self.contact.saddle

    def back(self, full: np.ndarray, bases: Bases) -> np.ndarray:
        """Nodal increments (nodes, 6) = P K^-1 P^T full, active places staying where they are."""
        factors = self.factors if self._corrected is None else self._corrected
        return self.expand(factors.solve(self.increments.reduce(full, bases)), bases)

    def correction(self, state: np.ndarray, right: np.ndarray, gap: np.ndarray, bases: Bases) -> tuple[np.ndarray, int]:
        """A Newton step (nodes, 6) with the last factors, and how many places have come to a wall or left one by it.

        right (nodes, 6): what is out of balance, with gap (nodes, 6), the way of what is held, in it.
        """
        contact = self.contact
        if contact is None:
            return gap - self.back(right, bases), 0
        before = contact.gaps(state, self.standing()) + contact.applied(gap)
        reduced, moved = contact.correct(-self.increments.reduce(right, bases), before)
        step = self.expand(reduced, bases)
        ahead = before + contact.applied(step) - moved[contact.rows.walls]
        return gap + step, contact.update(ahead)

    def stiff(self, step: np.ndarray) -> np.ndarray:
        """The tangent last assembled times nodal increments (nodes, 6) of what is held."""
        found = np.asarray(self.linear.stiff(step))
        if self._turned is not None and self.model.moment is not None:
            state, load = self._turned
            found = found - load * self.model.moment.stiff(state, step)
        bent = None if self.contact is None else self.contact.bent(step)
        return found if bent is None else found - bent

    def expand(self, reduced: np.ndarray, bases: Bases) -> np.ndarray:
        """P q on all local nodes, ghosts included (nodes, 6)."""
        step = self.increments.expand(reduced, bases)
        api.update_ghosts(self.model.space, step)
        return step

    def solve(
        self,
        state: np.ndarray,
        stress: Stress | None,
        stage: Stage,
        load: float,
        plane: Plane | None = None,
        passing: bool = False,
    ) -> Attempt:
        """Newton from `state` (with a stress of its own, when mixed) to equilibrium at `load`, or on a plane.

        passing: on the way, where the state counts as found as soon as the next correction would be below `PASSING` by
        quadratic convergence, and as lost when wide corrections grow.
        """
        before = None if self.contact is None else self.contact.snapshot()
        try:
            attempt = self._solve(state, stress, stage, load, plane, passing)
        except petsc.FactorisationFailed as error:
            self.trouble = str(error) + self.thin()
            attempt = Attempt(False, state, stress or self.model.stress(state), 1, np.inf, None, load, self.trouble)
        if self.contact is not None and before is not None and not attempt.converged:
            self.contact.restore(before)
        return attempt

    def thin(self) -> str:
        """A word on shells so thin that their tangent is singular to rounding."""
        if self.model.body.thickness >= THINNEST * self.length:
            return ""
        return f"; thinner than about {THINNEST:g} of its length a shell is beyond double precision"

    def _solve(
        self, state: np.ndarray, stress: Stress | None, stage: Stage, load: float, plane: Plane | None, passing: bool
    ) -> Attempt:
        model = self.model
        mixed = self.options.iteration == "mixed"
        model.set_control(stage.at(load))
        stress = stress or model.stress(state)
        negative, correction = None, np.inf
        enough = PASSING if mixed else self.options.tolerance  # a state's own stress needs it to the tolerance
        if self.contact is not None:
            self.contact.begin(state, self.standing())
        iteration, changes, changed = 0, 0, 0
        while iteration < self.options.max_newton + min(changes, MOST_CHANGES):
            iteration += 1
            start = time.perf_counter()
            control = stage.at(load)
            model.set_control(control)
            gap = self.target(stage, load, state) - state
            actual = model.stress(state)
            residual = model.force(state, actual)
            used, force = (stress, model.force(state, stress)) if mixed else (actual, residual)
            self.linear.spend("forces", start)
            bases = self.factor(state, used, force)
            negative = self.factors.inertia()[0]
            self.iterations += 1
            moving = self.largest(gap) > 0.0
            right = residual + (self.stiff(gap) if moving else 0.0)
            step, changed = self.correction(state, right, gap, bases)
            changes += changed > 0
            change = 0.0
            if plane is not None:
                sway = self.last_sway = self._sway(state, stage, load, bases)
                miss = self.mean(plane.tangent, state + step - plane.state) + plane.rate * (load - plane.load)
                across = self.mean(plane.tangent, sway) + plane.rate
                if across == 0.0:
                    raise petsc.FactorisationFailed("the path lies in the plane that it should cross")
                change = -miss / across
                step = step + change * sway
            before, correction = correction, max(self.largest(step), abs(change))
            lost = passing and iteration > 2 and not changed and correction > max(before, WIDE)
            if lost or not correction <= LARGEST_CORRECTION:
                return Attempt(False, state, stress, iteration, correction, negative, load)
            if change:
                model.set_control(stage.at(load + change))
            stress = model.stress(state, step)
            state = retract(state, step)
            load += change
            tolerance = self.options.tolerance
            if not changed and (correction <= tolerance or (passing and _remaining(before, correction) <= enough)):
                state = self._settled(state, stage, load)
                self._found = (state, bases)
                return Attempt(True, state, stress, iteration, correction, negative, load, changes=changes)
        reason = "what touches a wall did not settle" if changed else ""
        return Attempt(False, state, stress, iteration, correction, negative, load, reason)

    def rate(self, state: np.ndarray, stage: Stage, load: float) -> tuple[np.ndarray, Stress] | None:
        """(du/dload (nodes, 6), dstress/dload) at the equilibrium found last, with its factors; None at any other."""
        found, bases = self._found
        if found is not state:
            return None
        self.model.set_control(stage.at(load))
        try:
            sway = self._sway(state, stage, load, bases)
        except petsc.FactorisationFailed as error:
            self.trouble = str(error) + self.thin()
            return None
        return sway, stress_rate(self.model, state, sway, stage, load)

    def _settled(self, state: np.ndarray, stage: Stage, load: float) -> np.ndarray:
        """The state with held values exact (an arc step's last change of load moved them to first order)."""
        self.model.set_control(stage.at(load))
        return self.target(stage, load, state)

    def _sway(self, state: np.ndarray, stage: Stage, load: float, bases: Bases) -> np.ndarray:
        """du/dload (nodes, 6) of the tangent last factored: dead loads, natural curvature and moving supports."""
        rate = stage.rate()
        force = self.model.residual_rate(state, rate)
        step = np.zeros_like(state)
        if rate.move:
            step = self._held_rate(state, stage, load)
            force = force + self.stiff(step)
        if self.contact is None:
            return step - self.back(force, bases)
        assert self.model.body.walls is not None
        moved = self.contact.rows.rates(self.model.body.walls.rate(int(self.model.control.leg)))
        rates = rate.move * moved - self.contact.applied(step)
        return step + self.expand(self.contact.solve(-self.increments.reduce(force, bases), rates), bases)

    def tangent_of(self, state: np.ndarray, stage: Stage, load: float) -> tuple[np.ndarray | None, int | None]:
        """(du/dload (nodes, 6), number of negative eigenvalues) at an equilibrium; None for what cannot be had.

        Where the tangent is singular, du/dload is that of the tangent + SOFT * mass: nearly along its null vector.
        """
        negative = self.negative_eigenvalues(state, stage, load)
        for shift in (0.0, SOFT):
            try:
                if shift or negative is None:
                    self.factor_at(state, stage, load, shift)
                self.last_sway = self._sway(state, stage, load, self.last_bases)
            except petsc.FactorisationFailed as error:
                self.trouble = str(error) + self.thin()
                continue
            return self.last_sway, negative
        return None, negative

    def factor_at(self, state: np.ndarray, stage: Stage, load: float, shift: float = 0.0) -> None:
        """Factorise the tangent of the state itself + shift * mass; `last_bases` are those of its unknowns.

        Raises petsc_api.FactorisationFailed.
        """
        self.model.set_control(stage.at(load))
        stress = self.model.stress(state)
        self.last_bases = self.factor(state, stress, self.model.force(state, stress), shift)

    def negative_eigenvalues(self, state: np.ndarray, stage: Stage, load: float) -> int | None:
        """Negative (and zero) eigenvalues of the tangent at a state, by its own factorisation; None when that fails."""
        try:
            self.factor_at(state, stage, load)
        except petsc.FactorisationFailed as error:
            self.trouble = str(error) + self.thin()
            return None
        negative, zero, _ = self.factors.inertia()
        return negative + zero
