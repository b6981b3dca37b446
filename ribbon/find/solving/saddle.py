"""A saddle left along its unstable mode, one way or the other, for an equilibrium of lower energy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ribbon.find.solving.request import How
from ribbon.problems.protocol import Problem
from ribbon.result import Equilibrium, Left, Status
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import FloatArray

#: How an equilibrium is found from unknowns (n,), without leaving it.
Once = Callable[[Problem, FloatArray, How], Equilibrium]

#: Saddles that are left in turn, and sizes of the first step along the unstable mode (largest change of omega or eta,
#: relative to 1 + the largest omega).
_DEPARTURES = 6
_KICKS = (0.03, 0.3)
#: Difference of energies, relative (at least 1), up to which they are the same.
_SAME = 1e-6
#: Largest |eta| of a shape that is moved.
_STEEPEST = 5.0
_STATIONARY = (Status.CONVERGED, Status.SADDLE)


def left(first: Equilibrium, how: How, once: Once) -> Equilibrium:
    """The state that `first` is left for while it is a saddle; `first` itself where it is none or nothing is lower."""
    how = How(options=how.options, progress=how.progress)
    state = first
    departure: tuple[Equilibrium, float] | None = None
    for _ in range(_DEPARTURES):
        if state.status is not Status.SADDLE or spent():
            break
        lower = _departed(state, how, once)
        if lower is None:
            break
        departure, state = departure or lower, lower[0]
    return state if departure is None else _with_saddle(first, state, *departure, how, once)


def _with_saddle(
    saddle: Equilibrium, state: Equilibrium, first: Equilibrium, step: float, how: How, once: Once
) -> Equilibrium:
    """`state` with the saddle that was left for it by `step`, which led to `first`, and where the other way leads."""
    if not state.ok:
        return state
    other = None if spent() else _moved(saddle, -step, how, once)
    mirrored = None
    if other is not None and other.status in _STATIONARY and _below(other, saddle):
        mirrored = abs(other.energy.total - first.energy.total) <= _SAME * max(1.0, abs(first.energy.total))
    told = Left(saddle.energy.total - state.energy.total, mirrored)
    return replace(state, left=told, message=f"{state.message}; {told}")


def _departed(saddle: Equilibrium, how: How, once: Once) -> tuple[Equilibrium, float] | None:
    """The equilibrium of lower energy reached from a saddle along its unstable mode, either way, and the step; or
    None."""
    best: tuple[Equilibrium, float] | None = None
    for kick in _KICKS:
        for step in (kick, -kick):
            state = _moved(saddle, step, how, once)
            if state.status in _STATIONARY and _below(state, saddle):
                if best is None or (state.ok and not best[0].ok):
                    best = state, step
                if best[0].ok:
                    return best
    return best


def _below(state: Equilibrium, saddle: Equilibrium) -> bool:
    return state.energy.total < saddle.energy.total - 1e-12 * max(1.0, abs(saddle.energy.total))


def _moved(saddle: Equilibrium, step: float, how: How, once: Once) -> Equilibrium:
    """Where a saddle leads to that is moved by `step` along its unstable mode."""
    problem = saddle.problem
    omega, eta = problem.joint_values(saddle.at if saddle.at is not None else saddle.x)
    d_omega, d_eta = problem.joint_values(saddle.mode)
    size = max(np.abs(d_omega).max() / (1.0 + np.abs(omega).max()), np.abs(d_eta).max(), 1e-300)
    turned = eta + step / size * d_eta
    turned = turned if problem.fields.free else np.clip(turned, -_STEEPEST, _STEEPEST)
    return once(problem, problem.state(omega + step / size * d_omega, turned), how)
