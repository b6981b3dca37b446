"""Branches of shells by `ribbonbench branches`' own equations (`shellref.follow`): the clamped strut against closed
forms, the strip on edge (thesis 7.1) against a band of two dimensions that shares nothing with the shell, and the
branches U, US and S of the shifted arch (7.2) for shells and ribbons, each with an error on its branch points."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

from compare import registry
from compare.continuation.finer import relocated
from compare.continuation.follow import follow, switched
from compare.continuation.correct import first_point
from compare.continuation.point import Options, Point, Special
from compare.measure.mesh_limit import Settled, settled
from compare.models.capabilities import Branches, BranchStart
from compare.scene.scene import Scene, load, loads
from compare.studies.branches.along import Along
from compare.studies.branches.run import scene_for
from tests.validation import page
from tests.validation.number import Number

STRUT = """
title = "Strut"
[strip]
length = 1.0
width = 0.02
poisson = 0.0
thickness = 1e-3
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[clamp.end]
position = [1.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[shell]
elements = [16, 2]
grading = [1.0, 1.0]
"""
#: Shortening over h^2 / 12, from first to last.
LOADS = (24.0, 120.0)
SHIFT, SPAN = "clamp.end.position[1]", (0.01, 0.6)
#: Models of 7.2: name on the page, word of --model, w/h, elements (of a shell along and across).
MODELS = (
    ("shell 50", "shell", 50.0, (40, 4)),
    ("wunderlich", "wunderlich", 0.0, (100,)),
    ("finite", "finite", 50.0, (100,)),
)
HALVINGS, LOCATED = 2, 1e-9
#: Height (l) below the clamps' plane at which a branch has passed through S.
PASSED = -0.02


@dataclass(frozen=True)
class Found:
    """A branch point with its place on each mesh, and their limit."""

    values: tuple[float, ...]
    limit: Settled
    unstable: int


@dataclass(frozen=True)
class Line:
    """A branch: parameter, height of the middle, energy and number of unstable modes of its points, how it ended."""

    name: str
    parameter: tuple[float, ...]
    height: tuple[float, ...]
    energy: tuple[float, ...]
    unstable: tuple[int, ...]
    ended: str


def located(special: Special, along: Along, finer: int = HALVINGS) -> Found:
    """A branch point on elements halved so many times."""
    values, last = [special.point.t], special
    for _ in range(finer):
        again = None if last is None else relocated(last)
        last = again  # type: ignore[assignment]
        values.append(math.nan if again is None else again.point.t)
    places = [along.value(t) for t in values]
    return Found(tuple(places), settled(places, LOCATED * abs(along.last - along.first)), special.point.unstable)


def begun(scene: Scene, word: str, along: Along, moving: bool = False) -> tuple[BranchStart, Point]:
    """The first point of the scene's own branch."""
    _, name = scene_for(scene, word)
    model = registry.model(name)
    assert isinstance(model, Branches)
    start = model.branch_start(along.scene_at, moving=moving)
    first = first_point(start.system, start.z, 0.0, Options().tolerance)
    assert first is not None
    return start, first


@functools.cache
def strut() -> list[Found]:
    """The first two buckling loads of the clamped strut, as shortenings over h^2 / 12."""
    scene = loads(STRUT)
    thickness = scene.strip.thickness
    assert thickness is not None
    short = thickness**2 / 12.0
    along = Along.of(scene, "clamp.end.position[0]", 1.0 - LOADS[0] * short, 1.0 - LOADS[1] * short)
    _, first = begun(scene, "shell", along)
    run = follow(first)
    found = [located(special, along) for special in run.specials]
    return [
        Found(
            tuple((1.0 - v) / short for v in one.values),
            settled([(1.0 - v) / short for v in one.values], 1e-6),
            one.unstable,
        )
        for one in found
    ]


def closed_forms() -> tuple[float, float]:
    """P l^2 / D w of the clamped strut's first two modes: (2 pi)^2, and (2 k)^2 with tan k = k."""
    return 4.0 * math.pi**2, 4.0 * brentq(lambda k: math.tan(k) - k, 4.4, 4.6) ** 2


@functools.cache
def edge(width: float = 0.05, elements: tuple[int, int] = (20, 4)) -> Found:
    """The critical weight of the strip on edge of `lateral_7_1`."""
    scene = load("lateral_7_1").replace(
        {"path": None, "strip.gamma": 5.0, "strip.width": width, "shell.elements": list(elements)}
    )
    along = Along.of(scene, "strip.gamma", 5.0, 20.0)
    _, first = begun(scene, "shell", along)
    (special, *_) = follow(first, options=Options(most=0.3)).specials
    return located(special, along)


def scene_of(word: str, ratio: float, elements: tuple[int, ...]) -> Scene:
    """`shift_7_2` at the shift where the branch begins, nu = 0.3."""
    scene = load("shift_7_2").replace({"strip.poisson": 0.3})
    if ratio:
        scene = scene.replace({"shell.width_to_thickness": [ratio], "strip.thickness": scene.strip.width / ratio})
    if len(elements) == 2:
        return scene.replace({"shell.elements": list(elements)})
    return scene_for(scene.replace({"model.elements": elements[0]}), word)[0]


def line(name: str, start: BranchStart, points: tuple[Point, ...], ended: str, along: Along) -> Line:
    """What is drawn of a branch."""
    middle = [float(start.shape(p).centreline(np.array([0.5]))[0, 2]) for p in points]
    return Line(
        name, tuple(along.value(p.t) for p in points), tuple(middle),
        tuple(float(p.system.energy(p.z, p.t)) for p in points), tuple(p.unstable for p in points), ended,
    )  # fmt: skip


@functools.cache
def arch(
    word: str, ratio: float, elements: tuple[int, ...], finer: int = HALVINGS
) -> tuple[dict[str, Found], tuple[Line, ...]]:
    """The branches U, US and S of a model: where US leaves U and meets S, and what was followed."""
    scene = scene_of(word, ratio, elements)
    along = Along.of(scene, SHIFT, *SPAN)
    start, first = begun(scene, word, along, moving=len(elements) == 1)
    upright = follow(first, options=Options(steps=80))
    lines = [line("U", start, upright.points, upright.ended, along)]
    forks = [s for s in upright.specials if s.kind == "branch_point"]
    found: dict[str, Found] = {}
    if not forks:
        return found, tuple(lines)
    found["U-US"] = located(forks[0], along, finer)

    def above(point: Point) -> bool:
        return float(start.shape(point).centreline(np.array([0.5]))[0, 2]) > PASSED

    for leaving in switched(forks[0])[:1]:
        tilted = follow(leaving, options=Options(steps=80), on_point=above)
        lines.append(line("US", start, tilted.points, tilted.ended, along))
        for number, fold in enumerate(s for s in tilted.specials if s.kind == "fold"):
            found[f"US fold {number}"] = located(fold, along, finer)
        meets = [s for s in tilted.specials if s.kind == "branch_point"]
        if meets:
            found["US-S"] = located(meets[0], along, finer)
            for flat in switched(meets[0])[:2]:
                ran = follow(flat, options=Options(steps=60))
                lines.append(line("S", start, ran.points, ran.ended, along))
    return found, tuple(lines)
