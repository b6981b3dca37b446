"""Stability of shell states: the lowest mode, and the way down from an unstable equilibrium."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shellref.fenics import dolfinx_api as api
from shellref.fenics import petsc_api as petsc
from shellref.path.newton import LARGEST_CORRECTION, Attempt, Equilibrium
from shellref.shell.body import Stage
from shellref.shell.director import retract
from shellref.shell.naghdi import NaghdiModel

MOST_SHIFT = 1e12
MOST_DESCENT = 120  # iterations of all kicks together
EQUAL = 1e-6  # part of the largest entry within which others are as large
HASTY = 0.3  # a larger step down from a state that is no equilibrium is tried again, shorter
FALL = 100.0  # first shift for a strip that falls onto walls, D / (areal mass l^4)
KICKS = (0.02, 0.05, 0.1, 0.2, 0.4)  # over the size of the surface
#: Of a surface on walls these first: a fold that touches along one row of nodes is held there as by a hinge, and rests
#: where it leans on the next row too; a larger kick sends half of it through the wall.
KICKS_ON_WALLS = (0.001, 0.004)


@dataclass(frozen=True)
class Mode:
    """An eigenpair of tangent x = lambda mass x (docs/theory.md, eq. (7.13)).

    value: squared angular frequency of a small vibration, in D / (areal mass l^4); negative = unstable. vector
    (nodes, 6), largest component 1. value None: Lanczos did not converge, or the tangent cannot be factored. rounding:
    bound of the value's own (petsc_api.rounding).
    """

    value: float | None
    vector: np.ndarray
    rounding: float = 0.0

    @property
    def at_fold(self) -> bool:
        """The value is zero to rounding: its sign says nothing, the state is at a fold or a bifurcation."""
        return self.value is not None and abs(self.value) <= self.rounding


def lowest_mode(equilibrium: Equilibrium, state: np.ndarray, stage: Stage, load: float) -> tuple[Mode, int | None]:
    """The lowest mode at a state and the number of its negative eigenvalues (Lanczos on the inverse, SLEPc).

    The number is None when the tangent cannot be factored; the mode may be known all the same, by a shifted one.
    """
    negative = equilibrium.negative_eigenvalues(state, stage, load)
    count, end = (negative, "negative") if negative else (1, "positive")
    values, vectors = np.zeros(0), np.zeros((0, 0))
    if negative is not None:
        less = equilibrium.moving_mass(state)
        values, vectors = petsc.lowest_pairs(equilibrium.factors, equilibrium.mass, count, end, less)
    if not len(values) and negative != 0:
        values, vectors = _shifted(equilibrium, state, stage, load)
    if not len(values):
        return Mode(None, np.zeros_like(state)), negative
    field = equilibrium.expand(vectors[0], equilibrium.last_bases)
    size = equilibrium.largest(field)
    bound = petsc.rounding(equilibrium.matrix, vectors[0])
    return Mode(float(values[0]), field / size * _sign(equilibrium.model, field), bound), negative


def _shifted(equilibrium: Equilibrium, state: np.ndarray, stage: Stage, load: float) -> tuple[np.ndarray, np.ndarray]:
    """The lowest pair with tangent + shift * mass positive definite: finds a mode whose eigenvalue is far below
    zero.
    """
    shift = 1.0
    while shift < MOST_SHIFT:
        shift *= 10.0
        try:
            equilibrium.factor_at(state, stage, load, shift)
        except petsc.FactorisationFailed:
            continue
        if equilibrium.factors.inertia()[:2] == (0, 0):
            # of a shifted tangent the mass itself: what nothing resists is no null vector of it
            values, vectors = petsc.lowest_pairs(equilibrium.factors, equilibrium.mass, 1, "positive")
            return values - shift, vectors
    return np.zeros(0), np.zeros((0, 0))


def hourglass_hint(model: NaghdiModel, state: np.ndarray, c: float) -> str:
    """A word when negative eigenvalues may belong to hourglass modes: where (kappa h_v)^2 / 12 > c.

    kappa: normal curvature along S, h_v: the element's size across. A strip bent to kappa has the membrane stress
    -kappa^2 (it cancels against the bending moment in smooth modes), which the stabilisation must outweigh.
    """
    k = model.gauss_points[0]
    across = np.ptp(k[..., 1], axis=1)
    curvature = np.max(np.abs(model.curvatures(state)), axis=1)
    bound = float(api.max_over(model.comm, float(np.max((curvature * across) ** 2, initial=0.0)))) / 12.0
    if bound <= c:
        return ""
    return (
        f"; on this mesh these may be hourglass modes: (curvature times element width)^2 / 12 is {bound:.2g}, above the"
        f" stabilisation {c:g}: use {np.sqrt(bound / c):.1f} times as many elements across"
    )


def _sign(model: NaghdiModel, field: np.ndarray) -> float:
    """The same sign on every run and every process: the largest entry is positive, the first on the grid of those that
    are as large but for rounding (mirrored ones may differ in sign)."""
    whole = model.on_grid(field)
    size = np.abs(whole)
    return 1.0 if whole.flat[int(np.argmax(size > (1.0 - EQUAL) * size.max()))] > 0 else -1.0


def leave_saddle(
    equilibrium: Equilibrium, state: np.ndarray, stage: Stage, load: float, mode: Mode, max_iterations: int = 60
) -> Attempt:
    """From an unstable equilibrium down its most unstable mode, the lowest one, to a stable one at the same load.

    Kicks along the mode, growing until one succeeds: the mode's strain is followed to first order only (the mixed
    iteration's stress), so a large kick does not stretch a thin strip. Then mixed Newton with the tangent shifted by
    mu * mass so that it is positive definite: every step goes down, and mu falls to zero as the state settles. The
    attempt is converged only when it ends at a lower energy with a positive definite tangent.
    """
    model = equilibrium.model
    if mode.value is None:
        return Attempt(False, state, model.stress(state), 0, np.inf, None, load, "no critical mode was found")
    energy, spent, correction = _energy(equilibrium, state, stage, load), 0, np.inf
    touching = None if equilibrium.contact is None else equilibrium.contact.snapshot()
    small = () if equilibrium.contact is None else KICKS_ON_WALLS
    most = MOST_DESCENT + len(small) * max_iterations
    for size in (*small, *KICKS):
        if equilibrium.contact is not None and touching is not None:
            equilibrium.contact.restore(touching)
        attempt = _descend(equilibrium, state, size * mode.vector, abs(mode.value), stage, load, max_iterations)
        spent, correction = spent + attempt.iterations, attempt.correction
        lower = attempt.converged and _energy(equilibrium, attempt.state, stage, load) < energy
        if lower and equilibrium.negative_eigenvalues(attempt.state, stage, load) == 0:
            attempt.iterations, attempt.negative = spent, 0
            return attempt
        if spent > most:
            break
    if equilibrium.contact is not None and touching is not None:
        equilibrium.contact.restore(touching)
    return Attempt(False, state, model.stress(state), spent, correction, None, load)


def settled(equilibrium: Equilibrium, state: np.ndarray, stage: Stage, load: float) -> Attempt | None:
    """Where a strip that walls carry comes to from a state (nodes, 6) that is no equilibrium: downwards, with the
    tangent shifted as `leave_saddle` does; None where that does not end."""
    contact = equilibrium.contact
    assert contact is not None
    before = contact.snapshot()
    equilibrium.model.set_control(stage.at(load))
    pressed = equilibrium.supports.floating is None  # what falls moves far, what is pressed gives way by little
    none = np.zeros_like(state)
    for most in (HASTY,) if pressed else (None, HASTY):
        attempt = _descend(equilibrium, state, none, FALL, stage, load, MOST_DESCENT, unstressed=True, most=most)
        if attempt.converged:
            return attempt
        contact.restore(before)
    return None


def _energy(equilibrium: Equilibrium, state: np.ndarray, stage: Stage, load: float) -> float:
    """Elastic energy minus the work of the loads that act."""
    model = equilibrium.model
    model.set_control(stage.at(load))
    plates = 0.0 if equilibrium.contact is None else equilibrium.contact.energy
    return model.energies(state).total + plates


def _descend(
    equilibrium: Equilibrium,
    state: np.ndarray,
    kick: np.ndarray,
    scale: float,
    stage: Stage,
    load: float,
    max_iterations: int,
    unstressed: bool = False,
    most: float | None = None,
) -> Attempt:
    """Mixed Newton from state + kick (nodes, 6) with a falling positive shift; then plain mixed Newton. unstressed: the
    iteration begins without the stress of its first state; most: a step larger than that is tried again, shorter, with
    what touched before it; None: one larger than `LARGEST_CORRECTION` is the end.
    """
    model = equilibrium.model
    kick = kick * np.array([equilibrium.length] * 3 + [1.0] * 3)
    stress, state = model.no_stress() if unstressed else model.stress(state, kick), retract(state, kick)
    shift, correction = 2.0 * scale, np.inf
    if equilibrium.contact is not None:
        equilibrium.contact.begin(state, equilibrium.standing())
    for iteration in range(1, max_iterations + 1):
        residual, force = model.residual(state), model.force(state, stress)
        equilibrium.iterations += 1
        try:
            bases = equilibrium.factor(state, stress, force, shift)
            if equilibrium.factors.inertia()[0] > 0:
                raise petsc.FactorisationFailed("not positive definite")
            before = None if equilibrium.contact is None else equilibrium.contact.snapshot()
            step, changed = equilibrium.correction(state, residual, np.zeros_like(state), bases)
        except petsc.FactorisationFailed:
            shift = max(4.0 * shift, scale)
            if shift > MOST_SHIFT:
                break
            continue
        correction = equilibrium.largest(step)
        if not correction < (LARGEST_CORRECTION if most is None else most):
            if most is None or shift > MOST_SHIFT:
                return Attempt(False, state, stress, iteration, correction, None, load)
            if equilibrium.contact is not None and before is not None and equilibrium.supports.floating is not None:
                equilibrium.contact.restore(before)  # of what falls: what that step would have touched
            shift = max(4.0 * shift, scale)  # a smaller step down
            continue
        stress, state = model.stress(state, step), retract(state, step)
        if shift == 0.0 and correction < 1e-3 and not changed:
            attempt = equilibrium.solve(state, stress, stage, load)
            attempt.iterations += iteration
            return attempt
        shift = 0.4 * shift if shift > 0.05 * scale else 0.0
    return Attempt(False, state, stress, max_iterations, correction, None, load)
