"""Coils of the planar elastica that lie on themselves: ever more layers, ever more places that push."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from compare.battery.case import Case, Check, Rung, holds
from shellref.elastica.problem import ElasticaProblem
from shellref.elastica.result import ElasticaResult
from shellref.elastica.start import natural_start, solve_along

FloatArray = NDArray[np.float64]

#: Thickness (l), natural curvature (1/l), elements of a coil, by turns.
COILS = {
    1.05: (0.02, 8.0, 20),
    1.5: (0.01, 12.0, 30),
    2.5: (0.01, 20.0, 40),
    5.5: (0.003, 42.0, 110),
    10.5: (0.0008, 80.0, 420),
}
#: Turns and elements of a coil with so many places at the least; thickness and curvature as above.
PLACES = {1: (1.05, 20), 10: (2.5, 20), 100: (5.5, 90), 400: (10.5, 500)}
#: Nearer than layers are kept (l), push times gap (D w / l), what is left of virtual work over the largest push.
_CLOSEST, _COMPLEMENTARY, _BALANCED = 1e-6, 1e-8, 1e-8
#: Push aside of the line between its places, over the largest.
_ASIDE = 1e-6


def coil(turns: float, elements: int) -> ElasticaResult:
    """A strip clamped at its inner end, wound loosely, its curvature falling along it, and let go."""
    thick, curved, _ = COILS[turns]
    mean, half = 1.0 / (2.0 * math.pi * turns), 0.75 * thick * turns
    light = ElasticaProblem(curvature=(curved, curved), apart=thick)
    loose = natural_start(light, (1.0 / (mean - half), 1.0 / (mean + half)))
    return solve_along([loose, light], elements, 3, estimate_error=False)


def judged(found: ElasticaResult) -> Iterator[Check]:
    """Distances, pushes and statics of its curve and of the places told, by nothing of the solver's."""
    thick = found.problem.apart or 0.0
    yield holds("arrived, stable in its plane", found.load_factor >= 1.0 and found.stable is True, found.message)
    yield Check("nearer than its thickness (l)", _deepest(found, thick), _CLOSEST)
    gaps = max((abs(touch.push * touch.gap) for touch in found.touches), default=math.nan)
    yield Check("push times gap (D w / l)", gaps, _COMPLEMENTARY)
    yield from _pushed(found)
    yield _balanced(found)


def _pushed(found: ElasticaResult) -> Iterator[Check]:
    """Every push told, against the places of the curve that it is between."""
    here, there = (found.position(np.array([p[k] for p in _pairs(found)])) for k in (0, 1))
    between = (here - there) / np.linalg.norm(here - there, axis=1)[:, None]
    pushes = np.array([touch.force for touch in found.touches])
    along, largest = np.einsum("ki,ki->k", pushes, between), float(np.linalg.norm(pushes, axis=1).max())
    aside = np.linalg.norm(pushes - along[:, None] * between, axis=1)
    yield Check("a push that pulls, over the largest", max(0.0, -float(along.min())) / largest, 0.0)
    yield Check("push aside of what is between the places, over the largest", float(aside.max()) / largest, _ASIDE)


def _pairs(found: ElasticaResult) -> list[tuple[float, float]]:
    return [(touch.s, touch.other) for touch in found.touches if touch.other is not None]


def _deepest(found: ElasticaResult, thick: float) -> float:
    """By how much (l) layers are nearer than they are kept, of a polygon's edges (sagitta below 3e-8 l)."""
    s = np.linspace(0.0, 1.0, 20_001)
    r = found.position(s)
    far = 0.5 * 2.0 * math.pi / (float(np.abs(np.diff(found.angle(s))).max()) / s[1])
    deepest = 0.0
    step = np.diff(r, axis=0)
    for i, close in enumerate(cKDTree(r).query_ball_point(r[::10], thick + 2.0 * s[1])):
        own = r[10 * i]
        j = np.asarray([k for k in close if abs(s[k] - s[10 * i]) > far and k < len(step)], dtype=int)
        if j.size:
            t = np.clip(np.einsum("ki,ki->k", own - r[j], step[j]) / np.einsum("ki,ki->k", step[j], step[j]), 0.0, 1.0)
            distance = float(np.linalg.norm(r[j] + t[:, None] * step[j] - own, axis=1).min())
            deepest = max(deepest, thick - distance)
    return deepest


def _balanced(found: ElasticaResult) -> Check:
    """Virtual work of sections that turn by a hat between joints: int (theta' - K) phi' = int F . n phi, F the pushes
    told on what is beyond s, n the direction in which a turn moves it. Exact for elements that contain the hats."""
    joints = found.nodes
    elastic = np.diff(found.theta) / np.diff(joints) - float(found.problem.natural_curvature(np.array(0.5)))
    at = np.array([place for pair in _pairs(found) for place in pair])
    pushes = np.array([sign * np.asarray(touch.force) for touch in found.touches for sign in (1.0, -1.0)])
    order = np.argsort(at)
    beyond = np.vstack([np.cumsum(pushes[order][::-1], axis=0)[::-1], np.zeros((1, 2))])
    breaks = np.unique(np.concatenate([joints, at]))
    x, weight = np.polynomial.legendre.leggauss(8)
    half, middle = 0.5 * np.diff(breaks)[:, None], 0.5 * (breaks[1:] + breaks[:-1])[:, None]
    s, w = (middle + half * x).ravel(), (half * weight).ravel()
    force, theta = beyond[np.searchsorted(at[order], s, side="right")], found.angle(s)
    density = w * (np.cos(theta) * force[:, 1] - np.sin(theta) * force[:, 0])
    element = np.clip(np.searchsorted(joints, s, side="right") - 1, 0, len(joints) - 2)
    along = (s - joints[element]) / np.diff(joints)[element]
    work = np.zeros(len(joints))
    np.add.at(work, element, (1.0 - along) * density)
    np.add.at(work, element + 1, along * density)
    left = np.append(elastic, 0.0)[1:] * -1.0 + elastic - work[1:]
    largest = max((touch.push for touch in found.touches), default=math.nan)
    return Check("virtual work of turns, over the largest push", float(np.abs(left).max()) / largest, _BALANCED)


def _layers(rung: Rung) -> Iterator[Check]:
    turns = float(rung)
    yield from judged(coil(turns, COILS[turns][2]))


def _places(rung: Rung) -> Iterator[Check]:
    count = int(rung)
    found = coil(*PLACES[count])
    yield holds("so many places push", len(found.touches) >= count, f"{len(found.touches)} places")
    yield from judged(found)


_HELD = "stable in its plane; nowhere nearer than its thickness by more than 1e-6 l; pushes times gaps vanish, and "

CASES: tuple[Case, ...] = (
    Case(
        "touching/layers",
        "a coil of the planar elastica wound loosely and let go, of ever more layers that lie on each other",
        _HELD + "pushes balance what bends it (virtual work)",
        "turns",
        _layers,
        (1.5,),
        (2.5, 5.5, 10.5),
    ),
    Case(
        "touching/places",
        "coils of more turns and shorter elements: ever more places that push at once",
        _HELD + "pushes balance what bends it (virtual work)",
        "places, at the least",
        _places,
        (1, 10),
        (100, 400),
    ),
)
