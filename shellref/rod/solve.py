"""From a problem to a result: the way to it, its stability, its error."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ribbonbench import clock
from shellref.law import cut
from shellref.rod.elements import Elements, State
from shellref.rod.newton import Balance, held_exactly
from shellref.rod.problem import RodProblem, rest_shape
from shellref.rod.quaternion import Array, continuous, quaternion
from shellref.rod.result import RodResult, RodStatus, energy_of, reactions
from shellref.rod.stability import descend, leave, lowest_mode
from shellref.rod.walk import Walk, follow

SAMPLES = 1001
"""Abscissae at which shapes are compared."""


UNKNOWN = (RodStatus.LIMIT_POINT, RodStatus.NOT_CONVERGED)
"""Statuses of a rod that is no equilibrium."""

EPSILON = float(np.finfo(float).eps)
LOST = 1e-2
"""Part of the bending lost in the rounding of stretch (`rounding`) from which a way that ends there has no limit point:
rods of h / l = 1e-6 (0.003) are solved, of 3e-7 (0.03) not."""

NEARBY = 100.0
"""First shift of a descent from a given shape, D w / l^4: a straight cantilever's lowest eigenvalue is 12.4."""


@dataclass(frozen=True)
class Start:
    """A shape to begin at: positions (k, 3) and frames (k, 3, 3) at s (k,) of the nodes of a mesh."""

    position: Array
    frames: Array


def solve(
    problems: RodProblem | Sequence[RodProblem],
    elements: int | Array = 20,
    degree: int = 2,
    steps: Sequence[int | None] = (),
    near: Start | None = None,
    leave_saddle: bool = False,
    estimate_error: bool = False,
) -> RodResult:
    """The equilibrium of the last problem.

    Parameters
    ----------
    problems : one, reached from its unloaded rest shape by raising the loads and moving its ends to their places; or
        several, gone through in order from the rest shape of the first.
    elements : number of equal elements, or the joints (E + 1,) themselves from 0 to 1. degree : 1 to 3.
    steps : equal steps that each stage has at least. near : begin at this shape (given at the nodes `mesh` says) and
        look for the equilibrium beside it at once.
    leave_saddle : go on from an unstable equilibrium to a stable one below it. estimate_error : solve once more with
        halved elements, for `RodResult.error`.
    """
    began = time.perf_counter()
    chain = [problems] if isinstance(problems, RodProblem) else list(problems)
    if len(chain) == 1:
        zero = np.zeros(3)
        chain = [replace(chain[0], weight=zero, force=zero, moment=zero), *chain]
    mesh = Elements(joints(elements, chain), degree)
    if near is None:
        r, q = rest_shape(chain[0], mesh.s)
        walk = follow(mesh, State(r, q), chain, steps)
    else:
        walk = _beside(mesh, near, chain[-1])
    result = _judged(mesh, walk, chain, leave_saddle)
    result = replace(result, seconds=time.perf_counter() - began)
    if not estimate_error or result.status in UNKNOWN:
        return result
    return replace(
        result, error=error_of(result, None if near is not None else lambda mesh: solve(chain, mesh, degree, steps))
    )


def joints(elements: int | Array, problems: Sequence[RodProblem] = ()) -> Array:
    """Joints (E + 1,) of so many equal elements, or those given; and the points of the problems' tables at rest."""
    found = _joints(elements)
    for problem in problems:
        found = cut(found, *problem.rest)
    return found


def _joints(elements: int | Array) -> Array:
    if isinstance(elements, (int, np.integer)):
        if elements < 1:
            raise ValueError(f"elements = {elements}: must be 1 or more")
        return np.linspace(0.0, 1.0, int(elements) + 1)
    return np.asarray(elements, dtype=float)


def nodes(elements: int | Array, degree: int, problem: RodProblem | None = None) -> Array:
    """Abscissae (n,) of the nodes of such a mesh (of the problem's), at which `Start` gives a shape."""
    return Elements(joints(elements, () if problem is None else [problem]), degree).s


def _state(near: Start) -> State:
    return State(np.array(near.position), continuous(np.array([quaternion(frame) for frame in near.frames])))


def _beside(mesh: Elements, near: Start, problem: RodProblem) -> Walk:
    """At the problem itself, from a shape; where Newton does not find it, down in energy, or the shape's own forces
    fade."""
    state = held_exactly(_state(near), problem)
    balance = Balance(mesh, problem)
    walk = Walk(state, balance=balance)
    # the shape's bending is trusted, not the stretch and shear of its interpolation: they begin at zero
    stress = mesh.stress(state, problem)
    stress[..., :3] = 0.0
    found = balance.solve(state, problem, stress)
    walk.iterations = found.iterations
    if found.state is None and problem.conservative:
        found = descend(balance, state, problem, NEARBY)
        walk.iterations += found.iterations
    if found.state is None:
        spent = walk.iterations
        walk = follow(mesh, state, [problem, problem])
        walk.iterations += spent
        return walk
    walk.take(found, 0, 1.0, "beside")
    return walk


def _judged(mesh: Elements, walk: Walk, chain: Sequence[RodProblem], leave_saddle: bool) -> RodResult:
    problem, balance = chain[-1], walk.balance
    assert balance is not None
    if not walk.arrived:
        if clock.spent():
            return _result(mesh, walk, problem, RodStatus.NOT_CONVERGED, None, walk.why, None, False)
        lost = rounding(problem)
        if lost > LOST:
            why = f"rounding: stretch or shear is {lost / EPSILON:.1g} times as stiff as bending; {walk.why}"
            return _result(mesh, walk, problem, RodStatus.NOT_CONVERGED, None, why, None, False)
        return _result(mesh, walk, problem, RodStatus.LIMIT_POINT, None, walk.why, None, False)
    mode = lowest_mode(balance, walk.state, problem)
    if mode.stable is False and leave_saddle:
        found = leave(balance, walk.state, problem, mode)
        walk.iterations += found.iterations
        if found.state is not None:
            walk.take(found, walk.stage, 1.0, "left a saddle")
            mode = lowest_mode(balance, walk.state, problem)
    if mode.stable is False:
        word = "flutter" if mode.flutter else "unstable"
        return _result(
            mesh, walk, problem, RodStatus.UNSTABLE, False, f"an equilibrium, {word}", mode.value, mode.flutter
        )
    word = "an equilibrium" if mode.stable is None else "a stable equilibrium"
    return _result(mesh, walk, problem, RodStatus.CONVERGED, mode.stable, word, mode.value, False)


def _result(
    mesh: Elements, walk: Walk, problem: RodProblem, status: RodStatus, stable: bool | None, message: str,
    value: float | None, flutter: bool,
) -> RodResult:  # fmt: skip
    assert walk.balance is not None
    start, end = reactions(mesh, walk.state, problem)
    return RodResult(
        problem=problem, elements=mesh, state=walk.state, status=status, stable=stable, message=message,
        energy=energy_of(mesh, walk.state, problem), start=start, end=end, residual=walk.residual,
        iterations=walk.iterations, lowest_eigenvalue=value, flutter=flutter, unknowns=walk.balance.unknowns,
        log=tuple(walk.steps), snaps=walk.snaps, reached=walk.reached,
    )  # fmt: skip


def rounding(problem: RodProblem) -> float:
    """Part of the bending that is lost in the rounding of the stiffest strain: a strain is known to EPSILON."""
    stiffness = problem.section.stiffness
    return float(EPSILON * stiffness.max() / stiffness.min())


def error_of(result: RodResult, again: Callable[[Array], RodResult] | None) -> float | None:
    """Largest distance of the shapes, within elements too, from that of halved elements, begun at the state; where that
    is not found there (a coarse mesh may lie far off), from the one found `again` on them, the whole way."""
    finer = refined(result)
    if finer.status in UNKNOWN and again is not None:
        finer = again(_halved(result))
    if finer.status in UNKNOWN:
        return None
    s = np.linspace(0.0, 1.0, SAMPLES)
    return float(np.linalg.norm(finer.position(s) - result.position(s), axis=1).max())


def _halved(result: RodResult) -> Array:
    """Joints of elements half as long."""
    old = result.elements.joints
    return np.sort(np.concatenate([old, 0.5 * (old[1:] + old[:-1])]))


def refined(result: RodResult) -> RodResult:
    """The same state on elements half as long."""
    halved = _halved(result)
    s = nodes(halved, result.degree)
    return solve(
        result.problem, halved, result.degree, near=Start(result.position(s), result.frames(s)), estimate_error=False
    )
