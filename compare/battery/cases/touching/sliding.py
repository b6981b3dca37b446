"""A fold whose sides lie on each other and slide along each other, over joints of both, as an end is moved."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from compare.battery.case import Case, Check, Rung, holds
from compare.battery.cases.touching.itself import STRIP, fold
from compare.battery.judge.touching import Sheet, balanced, kept, of_itself
from ribbon import Clamp, Equilibrium
from ribbon.find.continuation import StepRecord, follow
from ribbon.find.solve import Problem, build
from ribbon.solvers.budget import within

#: Distance kept and that of the clamps (l), how far the end goes to either side of the middle (l), s.
THICKNESS, APART, ASIDE, BUDGET = 0.02, 0.1, 0.12, 120.0
#: Work of the end's force and the energy are one another's but for this times the increment squared, D w / l^3 (the
#: trapezoidal rule; a third of it to three quarters is measured).
WORK = 625.0
#: States at places that are each other's mirror image: energy (relative), places (l).
SAME, PLACES = 1e-8, 1e-5
_GOOD = ("converged", "saddle")


def slid(increments: int, segments: int = 40, aside: float = ASIDE) -> tuple[list[Equilibrium], Equilibrium]:
    """States while the end goes from one side to the other, the first one too, and the last one."""

    def at(y: float) -> Problem:
        end = Clamp((0.0, y, APART), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
        return build(STRIP, Clamp(), end=end, energy="sadowsky", segments=segments, apart=THICKNESS)

    states: list[Equilibrium] = []

    def passed(_: StepRecord, state: Equilibrium) -> None:
        states.append(state)

    with within(BUDGET):
        begin = follow(lambda t: at(-aside * t), fold(THICKNESS, APART, segments), steps=8)
        states.append(begin)
        last = follow(lambda t: at(aside * (2.0 * t - 1.0)), begin, steps=increments, on_step=passed)
    return states, last


def judged(states: list[Equilibrium], last: Equilibrium, increments: int, aside: float = ASIDE) -> Iterator[Check]:
    """Every state at rest and touching, work of the end's force, mirror images, and the last state's surfaces."""
    yield holds("arrived by equal increments", last.status.code in _GOOD and len(states) == increments + 1,
                f"{last.status.code}, {len(states) - 1} increments: {last.message}")  # fmt: skip
    yield holds("touches all along", all(state.pairs for state in states))
    if len(states) != increments + 1 or not all(state.pairs for state in states):
        return
    energies = np.array([state.energy.total for state in states])
    forces = np.array([_pull(state) for state in states])
    work = np.cumsum(0.5 * (forces[1:] + forces[:-1]) * 2.0 * aside / increments)
    off = np.abs(energies[1:] - energies[0] - work).max()
    yield Check("energy less work of the moved end, over the increment squared (D w / l^3)",
                float(off) * (0.5 * increments / aside) ** 2, WORK,
                said=f"{off:.3g} of {np.ptp(energies):.3g}")  # fmt: skip
    first, end = states[0].pairs[0], last.pairs[0]
    passed = min(abs(end.s - first.s), abs(end.s_other - first.s_other)) * len(last.parameters)
    yield holds("slides over joints of both sides", passed >= 1.0, f"by {passed:.1f} segments")
    yield Check("energy of the mirror image, relative", float(np.abs(energies / energies[::-1] - 1.0).max()), SAME)
    mirrored = max(_mirrored(one, other) for one, other in zip(states, states[::-1], strict=True))
    yield Check("places of the mirror image (l)", mirrored, PLACES)
    sheet, told = Sheet(last), of_itself(last)
    yield from kept([sheet], THICKNESS, told)
    yield balanced(last, sheet, told)


def _pull(state: Equilibrium) -> float:
    """Force (D w / l^2) on the moved end along its way."""
    return math.nan if state.end_support is None else float(state.end_support.force[1])


def _mirrored(one: Equilibrium, other: Equilibrium) -> float:
    """By how much (l) the places of one are not those of the other read from its end."""
    here = np.array(sorted((pair.s, pair.s_other) for pair in one.pairs))
    there = np.array(sorted((1.0 - pair.s_other, 1.0 - pair.s) for pair in other.pairs))
    return float(np.abs(here - there).max()) if here.shape == there.shape else math.nan


def _increments(rung: Rung) -> Iterator[Check]:
    yield from judged(*slid(int(rung)), int(rung))


def _segments(rung: Rung) -> Iterator[Check]:
    yield from judged(*slid(16, segments=int(rung)), 16)


def _way(rung: Rung) -> Iterator[Check]:
    yield from judged(*slid(16, aside=float(rung)), 16, float(rung))


_HARD = "a fold whose clamps are 0.1 l apart, its sides on each other; an end goes from one side to the other, and the "
_HARD += "places slide along both sides, over joints: "
_EXPECTED = (
    "the energy is the work of the end's force but for 625 D w / l^3 times the increment squared; states at places "
)
_EXPECTED += "that are mirror images are; nowhere nearer than 0.02 l; pushes times gaps vanish; virtual work balances"

CASES: tuple[Case, ...] = (
    Case("touching/sliding", _HARD + "ever finer", _EXPECTED, "increments", _increments, (16,), (32, 64, 128)),
    Case(
        "touching/sliding_joints", _HARD + "ever more of them", _EXPECTED, "segments", _segments, (20,), (40, 80, 160)
    ),
    Case("touching/sliding_way", _HARD + "ever further", _EXPECTED, "end aside / l", _way, (0.04,), (0.08, 0.12, 0.14)),
)
