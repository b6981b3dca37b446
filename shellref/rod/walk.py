"""From one problem to the next: load steps that adapt, and a descent in energy where a path of equilibria ends.

What is out of balance at the beginning of a stage (a seed that is no equilibrium, an end that is let go) acts on as a
force that fades with it, so that every stage begins in equilibrium.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ribbonbench import clock
from shellref.rod.elements import Elements, State
from shellref.rod.newton import Balance, Solved, held_exactly
from shellref.rod.problem import Held, LoadPath, RodProblem
from shellref.rod.quaternion import Array, rotation, turn_between
from shellref.rod.stability import descend, lowest_mode

FIRST_LOAD = 10.0
"""Load in D w / l^2 of the first step of a stage."""

QUICK = 8
"""Iterations of a step after which the next is twice as long."""

SMALLEST = 1e-4
"""Share of a stage below which a step is not cut further."""

MOST_TURN = 1.2
"""Radians by which a section may turn in one step: more is taken for a jump to another branch."""

NOTHING = 1e-9
"""Out-of-balance force in D w / l^2 that is none."""

CLOSE = 0.3
"""Radians by which an equilibrium at the beginning of a stage may lie from the state there to be that state, but for
the discretisation."""

SNAPS = 10
"""Most descents of a way."""


@dataclass(frozen=True)
class Step:
    """One step of a way that was taken: stage (from 0), share of it, iterations, negative eigenvalues."""

    stage: int
    share: float
    iterations: int
    negative: int | None
    kind: str = "load"


@dataclass
class Walk:
    """Where a way has come to: state and its stress, share of the last stage reached, steps, iterations, snaps; why it
    ended."""

    state: State
    stress: Array | None = None
    balance: Balance | None = None
    reached: float = 0.0
    stage: int = 0
    iterations: int = 0
    snaps: int = 0
    residual: float = np.inf
    negative: int | None = None
    steps: list[Step] = field(default_factory=list)
    why: str = ""

    @property
    def arrived(self) -> bool:
        """At the end of the last stage."""
        return self.reached == 1.0 and not self.why

    def take(self, found: Solved, stage: int, share: float, kind: str = "load") -> None:
        """A state that was found."""
        assert found.state is not None
        self.state, self.stress, self.residual = found.state, found.stress, found.residual
        self.negative, self.reached = found.negative, share
        self.steps.append(Step(stage, share, found.iterations, found.negative, kind))


def follow(elements: Elements, state: State, problems: Sequence[RodProblem], steps: Sequence[int | None] = ()) -> Walk:
    """From `state` through the problems in order, beginning at the first of them; steps: how many equal ones the stage
    to each of the others has at least (None: as fit)."""
    walk = Walk(state)
    for stage, (first, last) in enumerate(itertools.pairwise(problems)):
        walk.stage, walk.reached = stage, 0.0
        wanted = steps[stage] if stage < len(steps) else None
        _stage(elements, walk, LoadPath(_joined(first, last, walk.state), last), stage, wanted)
        if walk.why:
            return walk
    assert walk.balance is not None
    walk.state = held_exactly(walk.state, problems[-1])
    return walk


def _joined(first: RodProblem, last: RodProblem, state: State) -> RodProblem:
    """The first problem held as the last one is: what was not held begins where it lies."""

    def begins(held: Held, index: int) -> Held:
        point = None if held.position is None else state.r[index].copy()
        return Held(point, None if held.frame is None else rotation(state.q[index]), held.slide)

    return replace(first, start=begins(last.start, 0), end=begins(last.end, -1))


def _stage(elements: Elements, walk: Walk, way: LoadPath, stage: int, wanted: int | None) -> None:
    """One stage."""
    balance = Balance(elements, way.last)
    walk.balance = balance
    fade = _settled(balance, walk, way.first)
    most = 1.0 / wanted if wanted else 1.0
    step = min(most, FIRST_LOAD / max(FIRST_LOAD, way.last.load, way.first.load))
    here = 0.0
    while here < 1.0:
        if clock.spent():
            walk.why = f"{clock.SPENT} at {here:.6g} of stage {stage + 1}"
            return
        target = min(1.0, here + step)
        target = 1.0 if 1.0 - target < 1e-9 else target
        force = 0.0 if fade is None else (1.0 - target) * fade
        found = balance.solve(walk.state, way.at(target), walk.stress, force)
        walk.iterations += found.iterations
        if found.state is not None and _turn(walk.state, found.state) <= MOST_TURN:
            walk.take(found, stage, target)
            here = target
            if found.iterations <= QUICK:
                step = min(most, 2.0 * step)
            continue
        step *= 0.25
        if step >= SMALLEST:
            continue
        step = 10.0 * SMALLEST
        if not _snap(balance, walk, way, stage, min(1.0, here + step), fade):
            walk.why = f"{found.why or 'the rod turns too far'} at {here:.6g} of stage {stage + 1}"
            return
        here = walk.reached


def _settled(balance: Balance, walk: Walk, problem: RodProblem) -> Array | None:
    """The walk put into equilibrium at the beginning of a stage where there is one close by (None); otherwise what is
    out of balance (n, 6), to fade."""
    elements = balance.elements
    walk.stress = elements.stress(walk.state, problem)
    if np.abs(balance.residual(walk.state, problem)).max(initial=0.0) <= NOTHING:
        return None
    found = balance.solve(walk.state, problem, walk.stress)
    walk.iterations += found.iterations
    if found.state is not None and _turn(walk.state, found.state) <= CLOSE:
        walk.state, walk.stress, walk.residual = found.state, found.stress, found.residual
        return None
    return np.asarray((balance.free @ balance.residual(walk.state, problem)).reshape(-1, 6))


def _turn(one: State, other: State) -> float:
    """Largest turn of a node, rad."""
    return float(np.linalg.norm(turn_between(one.q, other.q), axis=1).max())


def _snap(balance: Balance, walk: Walk, way: LoadPath, stage: int, share: float, fade: Array | None) -> bool:
    """Down in energy at a slightly larger load, where the path ends; False: it did not settle."""
    problem = way.at(share)
    if walk.snaps >= SNAPS or fade is not None or not problem.conservative:
        return False
    walk.snaps += 1
    gap = balance.gap(walk.state, problem)
    state = walk.state.moved(gap)
    mode = lowest_mode(balance, state, problem)
    if mode.value is None:
        return False
    for side in (1.0, -1.0):
        found = descend(balance, state.moved(side * 1e-3 * mode.vector), problem, max(abs(mode.value), 1.0))
        walk.iterations += found.iterations
        if found.state is not None and found.negative == 0:
            walk.take(found, stage, share, "snap")
            return True
    return False
