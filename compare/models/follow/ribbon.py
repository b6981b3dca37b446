"""A ribbon in the hand of somebody who moves numbers of its scene: warm along the way from one scene to the next.

Every move is one of `ribbon.Session`, along the homotopy between two scenes (`compare.scene.homotopy`), in a single
step where that is safe.
"""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from compare.models.base import Seconds, State
from compare.models.capabilities import Followed
from compare.models.ribbon.build import ribbon_problem
from compare.models.ribbon.state import own_size, state_of
from compare.scene.homotopy import between
from compare.scene.scene import Scene
from ribbon import Equilibrium, Session
from ribbon.find.continuation import switch
from ribbon.find.solve import Problem
from ribbon.solvers import choose
from ribbon.solvers.budget import within

#: Time (s) that a move may take at most: a hand waits for it.
PATIENCE = 2.0
#: Where a way that also switches something begins (`compare.models.ribbon.stages`).
_ENTRY = 1e-9
#: Values of a seed at least, steepest ruling of it, and curvature (1/l) by which a twist is divided to make one.
_VALUES, _STEEPEST, _BENT = 41, 1.5, 1e-6


def followed(first: Scene, last: Scene, near: State) -> Followed:
    """From `near`, the state of `first`, to `last` (`compare.models.capabilities.Follows`)."""
    leg = between(first, last)
    start: Equilibrium = replace(near.native, log=())

    @functools.lru_cache(maxsize=1)
    def problem_at(t: float) -> Problem:
        problem = ribbon_problem(leg(t), start.problem.formulation)
        same = np.array_equal(problem.lengths, start.problem.lengths)
        return problem if same else problem.with_changes(lengths=start.problem.lengths)

    with within(min(PATIENCE, last.model.budget)), choose.using(last.model.solver):
        if leg.switched:
            start = switch(problem_at(_ENTRY if leg.continuous else 1.0), start, leave_saddle=True)
            if not start.ok:
                return Followed(near, first, 0.0, (), start.message)
        elif not leg.continuous:
            return Followed(near, last, 1.0, ())
        session = Session.at(start)
        if not leg.continuous:
            return Followed(_state(last, session.state), last, 1.0, ())
        move = session.along(problem_at, leap=True)
    scene = last if move.reached >= 1.0 else leg(move.reached)
    text = "" if move.reached >= 1.0 else move.message
    state = near if move.reached == 0.0 else _state(scene, session.state)
    return Followed(state, scene, move.reached, move.jumps, text)


def _state(scene: Scene, found: Equilibrium) -> State:
    return state_of(scene, found, own_size(found), Seconds(float("nan")))


def seeded(scene: Scene, state: State) -> Scene:
    """The scene with the state's curvature and ruling as its seed, at equal distances."""
    e: Equilibrium = state.native
    s = np.linspace(0.0, 1.0, max(_VALUES, e.problem.lengths.size + 1))
    omega = e.omega(s)
    if e.has_free_twist:
        ruling = np.clip(e.tau(s) / np.where(np.abs(omega) < _BENT, _BENT, omega), -_STEEPEST, _STEEPEST)
    else:
        ruling = e.eta(s)
    keys = {"seed.curvature": (omega / scene.strip.length).tolist(), "seed.ruling": ruling.tolist()}
    return scene.replace({"path": None, **keys})
