"""The parameter at which a branch of equilibria loses its stability: where its lowest eigenvalue passes zero.

On a branch the lowest eigenvalue is a smooth function of the parameter, unlike the state that a strip falls to beyond
it. So its root is that of a parabola through states of the branch, of those before it where none is found beyond.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ribbon.result import Equilibrium

Solve = Callable[[float, Equilibrium], Equilibrium]
States = list[tuple[float, float]]

#: By how much the steps are shortened near the root, and how often at the most.
SHORTER, MOST = 5.0, 8
#: A state is an equilibrium where its residual is below this.
RESIDUAL = 1e-6


@dataclass(frozen=True)
class Critical:
    """value: the parameter at which stability is lost; None: the branch is stable to the end of the way.

    located: how far `value` may be from it on these elements: the parabola's root from the secant's, or half of what is
    between the last states. kind: "crossing", the eigenvalue passes zero; "lost", the branch is no more where its
    eigenvalue is still above zero (a fold, or elements on which another state is nearer); "stable". states: (parameter,
    lowest eigenvalue) on the branch, in order; last: the last stable state, at `at`.
    """

    value: float | None
    located: float
    kind: str
    states: tuple[tuple[float, float], ...]
    last: Equilibrium
    at: float


def critical(
    solve: Solve,
    start: Equilibrium,
    first: float,
    last: float,
    step: float,
    within: float,
    on: Callable[[Equilibrium], bool],
) -> Critical:
    """Where the branch that `start` lies on, at the parameter `first` < `last`, is no longer stable.

    solve: (parameter, near) -> the state at the parameter near another one, unstable ones not left; on: whether a state
    lies on the branch. Walks in `step` until the eigenvalue is negative or the branch is left, then on from the last
    stable state in steps a fifth as long, until the root is located to `within`.
    """
    stable: list[tuple[float, float, Equilibrium]] = [(first, float(start.lowest_eigenvalue), start)]
    unstable: States = []
    located, value, kind, outside = np.inf, None, "lost", last
    for _ in range(MOST):
        outside = _walk(solve, stable, unstable, last, step, on)
        if not np.isfinite(outside):
            return _told(None, within, "stable", stable, unstable)
        inside = stable[-1][0]
        value, located, kind = _root([(s, low) for s, low, _ in stable], unstable, inside, outside)
        if located <= within:
            break
        step /= SHORTER
    return _told(value, located, kind, stable, unstable)


def _told(
    value: float | None, located: float, kind: str, stable: list[tuple[float, float, Equilibrium]], unstable: States
) -> Critical:
    states = sorted([(s, low) for s, low, _ in stable] + unstable)
    return Critical(value, float(located), kind, tuple(states), stable[-1][2], stable[-1][0])


def _walk(
    solve: Solve,
    stable: list[tuple[float, float, Equilibrium]],
    unstable: States,
    last: float,
    step: float,
    on: Callable[[Equilibrium], bool],
) -> float:
    """Goes on from the last stable state in `step`, adding what it meets; the first parameter without, or inf."""
    while stable[-1][0] < last - 1e-12:
        trial = min(stable[-1][0] + step, last)
        new = solve(trial, stable[-1][2])
        low = float(new.lowest_eigenvalue)
        if not new.residual <= RESIDUAL or not on(new):
            return trial
        if low <= 0.0:
            unstable.append((trial, low))
            return trial
        stable.append((trial, low, new))
    return np.inf


def _root(stable: States, unstable: States, inside: float, outside: float) -> tuple[float, float, str]:
    """Root of the eigenvalue between `inside` and `outside`, how far it may be off, and its kind."""
    half = 0.5 * (outside - inside)
    near = sorted(unstable, key=lambda state: state[0])[:1] if unstable else []
    points = np.array([*stable[-3:], *near][-3:])
    middle, lost = inside + half, (inside + half, half, "lost")
    if len(points) < 2:
        return lost
    (a, at_a), (b, at_b) = points[-2:]
    if at_a == at_b:
        return lost
    secant = a - at_a * (b - a) / (at_b - at_a)
    bent = np.roots(np.polyfit(points[:, 0] - middle, points[:, 1], len(points) - 1)) + middle
    real = np.real(bent[np.abs(np.imag(bent)) < 1e-12])
    if not real.size or not inside <= secant <= outside + half:
        return lost
    root = float(real[np.argmin(np.abs(real - secant))])
    if not inside <= root <= outside + half:
        return lost
    apart = abs(root - secant) if len(points) > 2 else half
    return root, min(apart, 2.0 * half) if near else apart, "crossing"
