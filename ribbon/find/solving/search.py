"""From a start to an equilibrium: the minimiser that fits, contact between the joints, the verdict, saddles left."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from ribbon.find import contacts, nested, other_models, relax, stretched
from ribbon.find.solving import saddle
from ribbon.find.solving.request import How, Options, Progress
from ribbon.find.solving.verdict import judged
from ribbon.judge import penetration
from ribbon.problems.chained import ChainedProblem
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.result import Equilibrium
from ribbon.solvers import choose
from ribbon.solvers.problem import DENSE, KNOWN, RESIDUAL_TOLERANCE, FloatArray, Minimum, kkt_residual, polish

#: Multipliers of rows and bounds, of a neighbouring problem of the same structure.
Warm = tuple[FloatArray, FloatArray]
#: Iterations of a minimiser beside a sharp edge before rounder ones are begun with.
_SOON = 60


def from_state(problem: Problem, x: FloatArray, how: How, warm: Warm | None = None) -> Equilibrium:
    """Equilibrium of `problem` from the unknowns x (n,)."""
    if stretched.is_stretched(problem):
        return stretched.straight(problem)
    state = once(problem, x, how, warm)
    if not how.leave_saddle:
        return state
    if not (isinstance(problem, MixedProblem) and problem.apart):
        return saddle.left(state, how, once)
    from ribbon.find import snap

    return snap.left(state, how)


def from_shape(problem: Problem, omega: FloatArray, eta: FloatArray, how: How) -> Equilibrium:
    """Equilibrium of `problem` from omega and eta (p + 1,) at the joints."""
    return from_state(problem, relax.placed(problem, omega, eta), how)


def from_near(problem: Problem, x: FloatArray, how: How) -> Equilibrium:
    """Equilibrium of a problem with rows from a shape x (n,) close to it."""
    assert isinstance(problem, MixedProblem)
    minimum = relax.from_near(problem, x, how.options, how.progress)
    return from_state(problem, minimum.x, how, (minimum.rows, minimum.multipliers))


def once(problem: Problem, x: FloatArray, how: How, warm: Warm | None = None) -> Equilibrium:
    """What is found from x (n,); a saddle is not left."""
    minimum = _unmoved(problem, x) if how.near else None
    if minimum is None and warm is None and how.hold and isinstance(problem, MixedProblem):
        problem, minimum = _sharpened(problem, x, how)
    minimum = minimum or _minimum(problem, x, how, warm)
    if problem.walls and how.hold:
        assert isinstance(problem, MixedProblem)
        problem, minimum = contacts.held(problem, minimum, how.options, how.progress)
    if isinstance(problem, MixedProblem) and problem.apart:
        problem, minimum = _kept_apart(problem, x, minimum, how)
    return judged(problem, minimum, how)


def _kept_apart(problem: MixedProblem, x: FloatArray, minimum: Minimum, how: How) -> tuple[MixedProblem, Minimum]:
    """With the places where parts of the strip meet, from the start x (n,) and the equilibrium without these."""
    from ribbon.find import apart
    from ribbon.find.layers import plane

    kept, found = apart.kept(problem, minimum, how.options, how.progress)
    if plane.stands(kept, found):
        return kept, found
    return plane.lain(problem, x, how.options, how.progress) or (kept, found)


def _sharpened(problem: MixedProblem, x: FloatArray, how: How) -> tuple[MixedProblem, Minimum | None]:
    """Beside bodies whose edges are thin beside a segment: what is found soon without more, and else from rounder
    ones; None: nothing."""
    ways = contacts.rounder(problem) if problem.formulation == "mixed" else []
    if not ways:
        return problem, None
    soon = replace(how, options={"max_iter": _SOON, **(how.options or {})})
    minimum = _minimum(problem, x, soon, None)
    if minimum.residual <= RESIDUAL_TOLERANCE:
        own, minimum = contacts.held(problem, minimum, soon.options, how.progress)
        if minimum.residual <= RESIDUAL_TOLERANCE and _outside(own, minimum.x):
            return own, minimum
    first = _minimum(ways[0], x, how, None)
    return contacts.sharpened([*ways, problem], first, how.options, how.progress) or (problem, None)


def _outside(problem: MixedProblem, x: FloatArray) -> bool:
    deepest = penetration.deepest(problem, x)
    return deepest is None or deepest <= penetration.TOLERANCE


def _minimum(problem: Problem, x: FloatArray, how: How, warm: Warm | None) -> Minimum:
    if isinstance(problem, ChainedProblem):
        return _without_rows(problem, x, how.options, how.progress)
    assert isinstance(problem, MixedProblem)
    if problem.formulation != "mixed":
        return other_models.minimum(problem, x, how.options, how.progress)
    return relax.minimum(problem, x, how.options, how.progress, warm)


def _without_rows(
    problem: ChainedProblem, x: FloatArray, options: Options | None, progress: Progress | None
) -> Minimum:
    minimum = nested.minimum(problem, x, options, progress)
    if not minimum.finished and minimum.residual > RESIDUAL_TOLERANCE and np.all(np.isfinite(minimum.x)):
        none = np.zeros_like(minimum.x)
        polished = polish(problem, minimum.x)
        residual = kkt_residual(problem, polished, none)
        if residual < minimum.residual:
            minimum = replace(minimum, x=polished, multipliers=none, residual=residual, solver=DENSE)
    if minimum.residual > RESIDUAL_TOLERANCE and not np.any(problem.joint_values(x)[1]):
        # a start without torsion stays without it to rounding: the planar state is stationary, if hardly a minimum
        none = np.zeros_like(x)
        flat = choose.minimise(problem.with_changes(planar=True), x, options, progress)
        residual = kkt_residual(problem, flat.x, none)
        if residual <= RESIDUAL_TOLERANCE:
            return replace(flat, multipliers=none, residual=residual, iterations=flat.iterations + minimum.iterations)
    return minimum


def _unmoved(problem: Problem, x: FloatArray) -> Minimum | None:
    """x itself when it is stationary with no bound active (a problem without rows), else None."""
    if not isinstance(problem, ChainedProblem):
        return None
    clock = time.perf_counter()
    none = np.zeros_like(x)
    residual = kkt_residual(problem, x, none)
    if not residual <= RESIDUAL_TOLERANCE:
        return None
    seconds = time.perf_counter() - clock
    return Minimum(x, none, np.empty(0), residual, 0, 0, "stationary from the start", True, seconds, KNOWN)
