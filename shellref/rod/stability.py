"""Stability of an equilibrium of the rod: lowest squared angular frequencies of small vibrations, and the way down.

Mass per length 1 and the section's rotary inertia make the mass matrix (diagonal); a straight slender cantilever has
1.8751^4 = 12.362 D w / l^4. With a moment of fixed direction at a tip that may turn in space the tangent is not
symmetric: eigenvalues may be complex, which is flutter, and then the state is not stable either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse.linalg

from ribbonbench import clock
from shellref.rod.elements import State
from shellref.rod.newton import LARGEST, Balance, Solved
from shellref.rod.problem import RodProblem
from shellref.rod.quaternion import Array

DENSE = 400
"""Unknowns up to which all eigenvalues are computed."""

FLUTTER = 1e-6
"""Share of its size by which the imaginary part of an eigenvalue tells: below is rounding."""

INVERSE = 10.0
"""Rounding of eigenvalues of the inverse, over eps times the largest of them."""

KICKS = (0.02, 0.05, 0.1, 0.2, 0.4)
"""Sizes in l or radians of the steps along a mode by which a saddle is left."""

DESCENT = 200
"""Most iterations of one descent."""


@dataclass(frozen=True)
class Mode:
    """value: the lowest eigenvalue (None: not found), its real part; vector (n, 6), largest component 1; stable None:
    not known, or zero to rounding; flutter: some eigenvalue is complex."""

    value: float | None
    vector: Array
    stable: bool | None
    flutter: bool = False


def lowest_mode(balance: Balance, state: State, problem: RodProblem) -> Mode:
    """Of tangent x = lambda mass x on what is free."""
    zero = np.zeros((len(balance.elements.s), 6))
    if not balance.unknowns:
        return Mode(None, zero, True)
    whole, factor = balance.factor(state, problem, balance.elements.stress(state, problem))
    root = np.sqrt(balance.free.T.power(2) @ balance.elements.mass(problem).ravel())  # slides lie along one mass
    if factor.solve(root) is None:
        return Mode(0.0, zero, None)
    count = balance.unknowns

    def inverse(x: Array) -> Array:
        found = factor.solve(root * x.ravel())
        return root * (np.zeros(count) if found is None else found)

    if not problem.conservative:
        return _unsymmetric(balance, inverse, root)
    negative = factor.negative
    if count <= DENSE:
        matrix = np.column_stack([inverse(column) for column in np.eye(count)])
        values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    else:
        operator = scipy.sparse.linalg.LinearOperator((count, count), inverse)
        start = np.random.default_rng(0).normal(size=count)
        which, number = ("SA", min(negative, count - 2)) if negative else ("LA", 1)
        values, vectors = scipy.sparse.linalg.eigsh(operator, k=number, which=which, v0=start)
    # eigenvalues of the inverse are known to eps times its largest: the stiffest modes of a thin rod lie below that
    least = INVERSE * float(np.finfo(float).eps) * float(np.max(np.abs(values)))
    below = np.flatnonzero(values < -least)
    index = int(below[np.argmax(values[below])]) if len(below) else int(np.argmax(values))
    value = float(1.0 / values[index])
    mode = (balance.free @ (vectors[:, index] / root)).reshape(-1, 6)
    mode = mode / mode.flat[int(np.argmax(np.abs(mode)))]
    rounding = _rounding(balance, whole, mode, problem)
    if abs(value) <= rounding or (negative and value > 0.0):  # pivots and eigenvalues contradict each other
        return Mode(value, mode, None)
    return Mode(value, mode, value > 0.0)


def _rounding(balance: Balance, whole: scipy.sparse.csc_matrix, mode: Array, problem: RodProblem) -> float:
    """Bound of the rounding of a mode's Rayleigh quotient."""
    x = np.abs(mode).ravel()
    mass = balance.elements.mass(problem).ravel()
    return float(2.0 * np.finfo(float).eps * (x @ (abs(whole) @ x)) / (x @ (mass * x)))


def _unsymmetric(balance: Balance, inverse: object, root: Array) -> Mode:
    """The lowest of the eigenvalues of an unsymmetric tangent."""
    count = len(root)
    assert callable(inverse)
    if count <= DENSE:
        values, vectors = scipy.linalg.eig(np.column_stack([inverse(column) for column in np.eye(count)]))
    else:
        operator = scipy.sparse.linalg.LinearOperator((count, count), inverse)
        start = np.random.default_rng(0).normal(size=count)
        values, vectors = scipy.sparse.linalg.eigs(operator, k=6, which="LM", v0=start)
    near = np.argsort(-np.abs(values))[:6]  # of the inverse: those nearest to zero
    values, vectors = 1.0 / values[near], vectors[:, near]
    flutter = bool(np.any(np.abs(values.imag) > FLUTTER * np.abs(values)))
    index = int(np.argmin(values.real))
    mode = (balance.free @ (vectors[:, index].real / root)).reshape(-1, 6)
    size = mode.flat[int(np.argmax(np.abs(mode)))]
    value = float(values[index].real)
    return Mode(value, mode / size if size else mode, bool(value > 0.0 and not flutter), flutter)


def leave(balance: Balance, state: State, problem: RodProblem, mode: Mode) -> Solved:
    """From an unstable equilibrium along its lowest mode down to a stable one, if there is one near."""
    if mode.value is None or not problem.conservative:
        return Solved(None, None, 0, why="there is no energy to go down in")
    energy, spent = energy_of(balance, state, problem), 0
    for size in KICKS:
        found = descend(balance, state.moved(size * mode.vector), problem, abs(mode.value))
        spent += found.iterations
        settled = found.state is not None and found.negative == 0
        if settled and found.state is not None and energy_of(balance, found.state, problem) < energy:
            found.iterations = spent
            return found
        if spent > DESCENT:
            break
    return Solved(None, None, spent, why="no stable equilibrium below it was found")


def energy_of(balance: Balance, state: State, problem: RodProblem) -> float:
    """Stored energy minus the work of weight and force."""
    loads = balance.elements.loads(state, problem)[:, :3]
    return float(balance.elements.energy(state, problem).sum() - np.sum(loads * state.r))


def descend(balance: Balance, state: State, problem: RodProblem, scale: float) -> Solved:
    """Mixed Newton with the tangent shifted by a multiple of the mass until it is positive definite: every step goes
    down, and the shift falls to zero as the state settles. The held is in place and stays there."""
    elements = balance.elements
    mass = elements.mass(problem)
    mass = np.concatenate([mass[:, :3], np.maximum(mass[:, 3:], 1e-2 * mass[:, :1])], axis=1).ravel()
    stress = elements.stress(state, problem)
    shift, iteration = 2.0 * scale, 0
    for iteration in range(1, DESCENT + 1):
        if clock.spent():
            return Solved(None, None, iteration, why=clock.SPENT)
        _, factor = balance.factor(state, problem, stress, shift * mass)
        change = None if factor.negative else factor.solve(balance.residual(state, problem))
        if change is None:
            shift = max(4.0 * shift, 0.1 * scale)
            if shift > 1e12:
                break
            continue
        step = -(balance.free @ change).reshape(-1, 6)
        size = float(np.abs(step).max())
        if not size <= LARGEST:
            shift = max(4.0 * shift, 0.1 * scale)
            continue
        stress = elements.stress(state, problem, step)
        state = state.moved(step)
        if shift == 0.0 and size < 1e-3:
            found = balance.solve(state, problem, stress)
            found.iterations += iteration
            return found
        shift = 0.4 * shift if shift > 0.05 * scale else 0.0
    return Solved(None, None, iteration, why="the descent does not settle")
