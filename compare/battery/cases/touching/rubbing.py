"""Strips that rub on walls: coefficients, slopes, increments."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from compare.battery.case import Case, Check, Rung, holds
from compare.measure.friction import missed
from ribbon import Clamp, Equilibrium, Gravity, Strip, Wall
from ribbon.find.continuation import StepRecord
from ribbon.find.friction.path import follow
from ribbon.find.solve import Problem, build, solve_from

UP = (0.0, 1.0, 0.0)
#: The pressed end: slope of its clamp below the horizontal (degrees), how far the clamp falls (l), segments.
SLOPE, FALL, SEGMENTS = 30.0, 0.25, 10
#: The same of an end that cannot slide, so that the strip buckles between clamp and end.
SMALL = 0.05
#: Coefficient on the slope and of the increments; Coulomb's law and balance, relative.
MU, LAW, BALANCE = 0.3, 1e-7, 1e-7
#: Work, energy and what friction took are one another's but for this over the number of increments, D w / l.
WORK = 0.1


def _clamp(height: float) -> Clamp:
    a = math.radians(SLOPE)
    return Clamp((0.0, height, 0.0), tangent=(0.0, -math.sin(a), math.cos(a)), normal=(0.0, math.cos(a), math.sin(a)))


def _run(
    problem_at: Callable[[float], Problem], steps: int, start: Equilibrium, smallest: float = 0.05
) -> tuple[list[Equilibrium], bool]:
    """States along a path, its beginning without friction first, and whether it arrived."""
    states = [start]

    def kept(_: StepRecord, state: Equilibrium) -> None:
        states.append(state)

    return states, follow(problem_at, start, steps=steps, on_step=kept, smallest=smallest).ok


def pressed(mu: float, steps: int, fall: float = FALL) -> tuple[list[Equilibrium], bool]:
    """A weightless strip whose end touches a floor, while its clamp falls."""
    top = math.sin(math.radians(SLOPE))

    def at(t: float, friction: float = mu) -> Problem:
        return build(
            Strip(1.0, 0.02), _clamp(top - fall * t), energy="sadowsky", formulation="mixed", segments=SEGMENTS,
            walls=[Wall((0.0, 1e-9, 0.0), UP, friction=friction)],
        )  # fmt: skip

    first, flat = at(0.0, 0.0), np.zeros(SEGMENTS + 1)
    return _run(at, steps, solve_from(first, first.state(flat, flat)))


def _law(states: list[Equilibrium], mu: float) -> Check:
    worst = 0.0
    for state in states:
        rubs = [vars(rub) for rub in state.walls[0].rubs]
        worst = max(worst, missed(rubs, mu, np.broadcast_to(UP, (len(rubs), 3))).most)
    return Check("Coulomb's law is missed, over the largest push", worst, LAW)


def _held(state: Equilibrium, weight: np.ndarray) -> Check:
    """Force and moment about s = 0 of clamp, wall, friction and weight, whose centre is the centreline's."""
    assert state.start is not None
    wall = state.walls[0]
    force, moment = state.start.force - weight, state.start.moment + 0.0
    nodes, weights = np.polynomial.legendre.leggauss(40)
    begin = state.position([0.0])[0]
    centre = 0.5 * weights @ state.position(0.5 * (nodes + 1.0)) - begin
    moment = moment - np.cross(centre, weight)
    for rub in wall.rubs:
        pull = rub.push * np.array(UP) + rub.friction
        force = force + pull
        moment = moment + np.cross(rub.point - begin, pull)
    if not wall.rubs:  # without friction: the pushes
        for (s, v), push in zip(wall.ends, wall.pushes, strict=True):
            frame = state.frame([s])[0]
            place = state.position([s])[0] + v * (frame[:, 0] + float(state.eta([s])[0]) * frame[:, 2])
            force = force + push * np.array(UP)
            moment = moment + np.cross(place - begin, push * np.array(UP))
    off = max(float(np.abs(force).max()), float(np.abs(moment).max()))
    return Check("force and moment are not in balance", off / max(1.0, float(np.abs(wall.force).max())), BALANCE)


def _coefficient(rung: Rung) -> Iterator[Check]:
    mu = float(rung)
    states, arrived = pressed(mu, 4, SMALL if mu > 1.0 / math.tan(math.radians(SLOPE)) else FALL)
    yield holds("arrived", arrived)
    yield _law(states[1:], mu)
    yield _held(states[-1], np.zeros(3))
    deepest = max(float(state.penetration or 0.0) for state in states)
    yield Check("penetration (l)", deepest, 1e-6)


def _slope(rung: Rung) -> Iterator[Check]:
    """Weight turned from the table's normal by a part of arctan mu: at rest below 1, not above."""
    part, gamma = float(rung), 1.0

    def at(t: float, friction: float = MU) -> Problem:
        a = part * t * math.atan(MU)
        return build(
            Strip(1.0, 0.02, gamma=gamma), Clamp(None, None, None), Gravity((0.0, math.cos(a), math.sin(a))),
            walls=[Wall((0.0, 0.0, 0.0), UP, friction=friction)], energy="sadowsky", formulation="mixed", segments=4,
        )  # fmt: skip

    first, flat = at(0.0, 0.0), np.zeros(5)
    states, arrived = _run(at, 4, solve_from(first, first.state(flat, flat)))
    yield holds("at rest" if part < 1.0 else "not at rest", arrived == (part < 1.0))
    yield _law(states[1:], MU)
    if arrived:
        a = part * math.atan(MU)
        pull = states[-1].walls[0].friction
        found = np.nan if pull is None else float(pull[2])
        yield Check("friction apart from the weight along the table", abs(found - gamma * math.sin(a)), 1e-7)


def _increments(rung: Rung) -> Iterator[Check]:
    """Work of the clamp's force less what the energy gained and friction took; both are sums over the increments, of
    the trapezoidal rule and of backward Euler's."""
    steps = int(rung)
    states, arrived = pressed(MU, steps)
    yield holds("arrived", arrived)
    yield _law(states[1:], MU)
    forces = [0.0 if state.start is None else float(state.start.force[1]) for state in states]
    work = sum(-0.5 * (one + two) * FALL / steps for one, two in pairwise(forces))
    gained = states[-1].energy.elastic - states[0].energy.elastic
    lost = float(states[-1].rubbed or 0.0)
    yield Check("work less energy and friction, times the increments", abs(work - gained - lost) * steps, WORK,
                said=f"work {work:.6g}, energy {gained:.6g}, friction {lost:.6g}")  # fmt: skip


CASES: tuple[Case, ...] = (
    Case(
        "touching/coefficients",
        "an end pressed on a floor while its clamp falls by 0.25 l: from no friction to so much that it cannot slide "
        "(above 1.73; the clamp falls by 0.05 l, and the strip buckles)",
        "Coulomb's law holds in every state; clamp, push and friction balance; nothing is below the floor",
        "coefficient of friction",
        _coefficient,
        (0.0, 0.3),
        (1e-6, 1e-3, 0.03, 1.0, 1.5, 3.0, 30.0),
    ),
    Case(
        "touching/slope",
        "a heavy strip on a table, held by friction alone (mu = 0.3), while its weight turns towards arctan mu and "
        "past it",
        "at rest below arctan mu, with the weight's part along the table as friction; above it no state is told",
        "angle / arctan mu",
        _slope,
        (0.9,),
        (0.99, 0.999, 0.9999, 1.0001, 1.001, 1.01, 1.1),
    ),
    Case(
        "touching/increments",
        "the pressed end (mu = 0.3) in ever more increments: what friction takes is a sum over them",
        "work is what the energy gains and what friction takes, but for 0.1 D w / l over the increments",
        "increments",
        _increments,
        (4.0,),
        (8.0, 16.0, 32.0, 64.0),
    ),
)
