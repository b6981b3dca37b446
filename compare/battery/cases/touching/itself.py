"""A strip that touches itself: folds of ever less thickness, ever further pressed, coils of ever more layers."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from compare.battery.case import Case, Check, Rung, holds
from compare.battery.judge.touching import Sheet, balanced, kept, of_itself
from ribbon import Clamp, Equilibrium, Strip, solve
from ribbon.find.continuation import follow, switch
from ribbon.find.solve import Problem, build
from ribbon.solvers.budget import within
from shellref.elastica.problem import ElasticaProblem
from shellref.elastica.result import ElasticaResult
from shellref.elastica.start import natural_start, solve_along

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


#: Thickness (l), natural curvature (1/l), elements of a coil, by turns.
COILS = {1.5: (0.01, 12.0, 30), 2.5: (0.01, 20.0, 40), 5.5: (0.003, 42.0, 110)}
#: Closest (l) that layers may be nearer than they are kept, and push times gap (D w / l).
_CLOSEST, _COMPLEMENTARY = 1e-6, 1e-8


def _layers(rung: Rung) -> Iterator[Check]:
    """A coil let go: the planar elastica's layers, their distances by points of its curve alone."""
    turns = float(rung)
    thick, curved, elements = COILS[turns]
    mean, half = 1.0 / (2.0 * math.pi * turns), 0.75 * thick * turns
    light = ElasticaProblem(curvature=(curved, curved), apart=thick)
    loose = natural_start(light, (1.0 / (mean - half), 1.0 / (mean + half)))
    found = solve_along([loose, light], elements, 3, estimate_error=False)
    yield holds("arrived, stable in its plane", found.load_factor >= 1.0 and found.stable is True, found.message)
    yield Check("nearer than its thickness (l)", _deepest(found, thick), _CLOSEST)
    gaps = max(abs(touch.push * touch.gap) for touch in found.touches)
    yield Check("push times gap (D w / l)", gaps, _COMPLEMENTARY)
    yield Check("pushes that pull (D w / l^2)", max(0.0, -min(touch.push for touch in found.touches)), 0.0)


def _deepest(found: ElasticaResult, thick: float) -> float:
    """By how much (l) layers are nearer than they are kept, of a polygon's edges (sagitta below 1e-8 l)."""
    s = np.linspace(0.0, 1.0, 20_001)
    r = found.position(s)
    far = 0.5 * 2.0 * math.pi / (float(np.abs(np.diff(found.angle(s))).max()) / s[1])
    deepest = 0.0
    step = np.diff(r, axis=0)
    for i, near in enumerate(cKDTree(r).query_ball_point(r[::10], thick + 2.0 * s[1])):
        own = r[10 * i]
        j = np.asarray([k for k in near if abs(s[k] - s[10 * i]) > far and k < len(step)], dtype=int)
        if j.size:
            t = np.clip(np.einsum("ki,ki->k", own - r[j], step[j]) / np.einsum("ki,ki->k", step[j], step[j]), 0.0, 1.0)
            distance = float(np.linalg.norm(r[j] + t[:, None] * step[j] - own, axis=1).min())
            deepest = max(deepest, thick - distance)
    return deepest


CASES: tuple[Case, ...] = (
    Case(
        "touching/layers",
        "a coil of the planar elastica wound loosely and let go, of ever more layers that lie on each other",
        "stable in its plane; nowhere nearer than its thickness by more than 1e-6 l; pushes times gaps below 1e-8",
        "turns",
        _layers,
        (1.5,),
        (2.5, 5.5),
    ),
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
