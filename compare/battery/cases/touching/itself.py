"""A strip that touches itself: folds of ever less thickness, ever further pressed."""

from __future__ import annotations

from collections.abc import Iterator

from compare.battery.case import Case, Check, Rung, holds
from compare.battery.judge.touching import Sheet, balanced, kept, of_itself
from ribbon import Clamp, Equilibrium, Strip, solve
from ribbon.find.continuation import follow, switch
from ribbon.find.solve import Problem, build
from ribbon.solvers.budget import within

STRIP = Strip(1.0, 0.05)
#: Where ends are that are apart (l), on the way to where the sides are near each other.
WAY = (0.5, 0.3, 0.22)
#: Time for the way there, s.
BUDGET = 60.0
_STATIONARY = ("converged", "saddle")


def _end(z: float) -> Clamp:
    return Clamp((0.0, 0.0, z), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))


def fold(thickness: float, apart: float, segments: int = 40, energy: str = "sadowsky") -> Equilibrium:
    """A strip whose clamped ends come together to `apart` (l), so that its sides meet, by steps that do not jump."""

    def at(z: float) -> Problem:
        return build(STRIP, Clamp(), end=_end(z), energy=energy, segments=segments, apart=thickness)

    state = solve(STRIP, Clamp(), end=_end(0.6), energy=energy, segments=segments, seed_curvature=(3.0, -3.0, 3.0),
                  apart=thickness)  # fmt: skip
    for z in WAY:
        state = switch(at(z), state)
    first = WAY[-1]
    with within(BUDGET):
        return follow(lambda t: at(first + (apart - first) * t), state, smallest=1e-5)


def _judged(found: Equilibrium, thickness: float) -> Iterator[Check]:
    yield holds("arrived at a state", found.status.code in _STATIONARY, f"{found.status.code}: {found.message}")
    sheet, told = Sheet(found), of_itself(found)
    yield holds("touches", bool(told), f"{len(told)} pairs")
    yield from kept([sheet], thickness, told)
    yield balanced(found, sheet, told)


def _thin(rung: Rung) -> Iterator[Check]:
    yield from _judged(fold(float(rung), 0.15), float(rung))


def _pressed(rung: Rung) -> Iterator[Check]:
    yield from _judged(fold(0.02, float(rung)), 0.02)


def _segments(rung: Rung) -> Iterator[Check]:
    yield from _judged(fold(0.02, 0.15, int(rung)), 0.02)


CASES: tuple[Case, ...] = (
    Case(
        "touching/thickness_to_nothing",
        "a strip folded between clamps 0.15 l apart until its sides meet, ever thinner: steps that go through it are "
        "ever shorter",
        "nowhere nearer than its thickness by more than 1e-6 l; pushes times gaps below 1e-8; virtual work balances",
        "thickness / l",
        _thin,
        (0.02, 5e-3),
        (1e-3, 3e-4, 1e-4),
    ),
    Case(
        "touching/pressed_fold",
        "the same (thickness 0.02 l), its clamps ever nearer: from one pair of places to lines",
        "nowhere nearer than its thickness by more than 1e-6 l; pushes times gaps below 1e-8; virtual work balances",
        "clamps apart / l",
        _pressed,
        (0.17, 0.1),
        (0.14, 0.12, 0.08),
    ),
    Case(
        "touching/segments_of_a_fold",
        "the same (clamps 0.15 l apart) on ever more segments",
        "nowhere nearer than its thickness by more than 1e-6 l; pushes times gaps below 1e-8; virtual work balances",
        "segments",
        _segments,
        (20.0,),
        (80.0, 160.0),
    ),
)
