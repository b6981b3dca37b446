"""Thesis 7.2: folds and branch points of Wunderlich's ribbon without elements (`tests.reference.wunderlich_shooting`).

The tilted branch is begun at one state of the ribbon of w/l = 1/20, taken over to other widths by the equations alone,
and followed from there: up to U, which it meets where the clamps' force along the height is zero, and down to S, at
height zero. Beside both the equations have a second branch, so that the shift is taken at a small distance, half and a
quarter of it, and its limit from these.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ribbon import Equilibrium
from ribbon.find.branch.passages import Grading
from ribbon.find.continuation import follow
from tests.reference.wunderlich_branch import brackets, fold, followed, fork, forks
from tests.reference.wunderlich_shooting import Clamped, Found
from tests.validation.workbench.shift_sweeps import ALONG, FIRST, Case

#: The ribbon's state: 1 over w/l, shift, elements, steps from the arch; points at which its shape is read.
BEGUN, SHIFT, PLACED, STEPS, POINTS = 20.0, 0.395, Grading(0.005, 0.001, 0.05), 12, 1200
#: Height (l) at which the width is changed, and by how much at once.
ACROSS, BY = 0.2, 1.08
#: Intervals and tolerance; every special point once more on twice as many with a tenth of it.
PARTS, TOLERANCE = 120, 1e-9
#: Distances from U (force, D w / l^2) and S (height, l) at which the shift is taken, halved twice. How the shift goes
#: there: with the square of the distance, and, the passages of S meeting in its middle, nearly with its first power.
TO_U, TO_S = 2.0, 2e-3
#: How near to them the branch is followed in whole steps.
NEAR_U, NEAR_S = 6.0, 0.03
#: U is begun at this shift, followed up to that one, or down to a height, l.
EARLY, UPTO, LOW = 0.3, 0.6, 0.1
#: Step along the branch: of its height and shift, l.
STEP = 0.02


def state(narrow: float = BEGUN, shift: float = SHIFT, placed: Grading = PLACED, steps: int = STEPS) -> Equilibrium:
    """The stable tilted ribbon at a shift behind the one at which U is lost."""
    case = Case("wunderlich", narrow)
    return follow(
        lambda t: case.problem(FIRST + (shift - FIRST) * t), case.arch(), steps=steps, leave_saddle=True, place=placed
    )  # fmt: skip


def begun(problem: Clamped, found: Equilibrium, shift: float) -> np.ndarray:
    """Unknowns of the equations from a ribbon's shape, in the axes of its start clamp."""
    s = np.linspace(0.0, 1.0, POINTS + 1)
    axes = found.frame(s[:1])[0]
    frames = np.einsum("ij,kil->kjl", axes, found.frame(s))
    place = (found.position(s) - found.position(s[:1])) @ axes
    joints = np.concatenate([[0.0], np.cumsum(found.problem.lengths)])
    eta = np.asarray(found.problem.joint_values(found.x)[1])  # type: ignore[attr-defined]
    on = np.clip(np.searchsorted(joints, s, side="right") - 1, 0, joints.size - 2)
    x = 0.5 * problem.width * (np.diff(eta) / np.diff(joints))[on]
    return problem.near(s, place, frames, np.stack([found.omega(s), found.eta(s), x], axis=1), shift)


def across(found: Found, narrow: float) -> Found:
    """The state of another w/l = 1 / `narrow` at the same height of its middle, step by step."""
    here, before = 1.0 / found.problem.width, None
    steps = int(np.ceil(abs(np.log(narrow / here)) / np.log(BY)))
    for there in np.geomspace(here, narrow, steps + 1)[1:]:
        start = found.v if before is None else 2.0 * found.v - before.v
        problem = replace(found.problem, width=1.0 / there)
        before, new = found, problem.newton(start, "height", found["height"])
        if new is None:
            raise AssertionError(f"w/l = 1/{there:g}: no state at a height of {found['height']:g} l")
        found = new
    return found


def told(values: Sequence[float], power: float) -> tuple[float, float]:
    """Limit and error of a shift from its values (3,) at a distance, half and a quarter of it, from which it goes by
    that power of the distance: the limit of the last two, and by how much that of the first two differs."""
    first, last = (b + (b - a) / (2.0**power - 1.0) for a, b in itertools.pairwise(values))
    return last, abs(last - first)


def beside(last: Found, control: str, distance: float, power: float) -> dict[str, Any]:
    """Where the branch meets the one of which `control` is zero, approached from `last` by halves."""
    here, kept = last, []
    while len(kept) < 3:
        size = 0.5 * abs(here[control])
        found = here.at(control, math.copysign(size if size > distance or kept else distance, here[control]))
        if found is None:
            raise AssertionError(f"no state at {control} {size:g}")
        here = found
        if abs(here[control]) < 1.000001 * distance:
            kept.append(here)
    finer = here.finer()
    if finer is None:
        raise AssertionError(f"no state at {control} {here[control]:g} on shorter intervals")
    change = finer["shift"] - here["shift"]
    value, error = told([one["shift"] for one in kept], power)
    return {"value": value + change, "error": error + abs(change) + TOLERANCE, "height": here["height"]}


def folds(way: list[Found]) -> list[dict[str, Any]]:
    """Of the branch, in its order."""
    found = []
    for a, b in brackets(way):
        here = fold(a, b)
        finer = [one.finer() for one in (a, b)]
        again = fold(finer[0], finer[1]) if finer[0] and finer[1] else None
        if here is None or again is None:
            raise AssertionError(f"a fold near {a['shift']:g} l is not located")
        change = abs(here["shift"] - again["shift"])
        found.append({"value": again["shift"], "error": change + TOLERANCE, "height": again["height"]})
    return found


@functools.cache
def tilted() -> Found:
    """The branch of w/l = 1 / `BEGUN` at the height where the width may be changed."""
    problem = Clamped(1.0 / BEGUN, ALONG, PARTS, TOLERANCE)
    ribbon = state()
    found = problem.newton(begun(problem, ribbon, SHIFT), "height", float(ribbon.middle.position[2]))
    way = found and followed(replace(found, way=-1.0), lambda one: one["height"] > ACROSS)
    there = way and way[-1].at("height", ACROSS)
    if not there:
        raise AssertionError("the equations have no solution near the ribbon's state")
    return there


@functools.cache
def upright() -> Found:
    """U of w/l = 1 / `BEGUN`, well before it is lost: from the tilted branch near it, made its own image."""
    near = followed(replace(tilted(), way=1.0), lambda one: one["lift"] < -NEAR_U, STEP)[-1]
    found = near.upright()
    start = found and found.at("height", found["height"])
    if not start:
        raise AssertionError("no upright arch beside the tilted strip")
    low = followed(replace(start, way=1.0), lambda one: one["shift"] > EARLY, STEP)[-1]
    there = low.at("height", low["height"])
    assert there is not None
    return there


def arch(narrow: float) -> dict[str, Any]:
    """Of the ribbon of w/l = 1 / `narrow`: "folds" of U and "forks", where another branch leaves, in order along it."""
    start = across(upright(), narrow)
    way = followed(replace(start, way=-1.0), lambda one: one["shift"] < UPTO and one["height"] > LOW, STEP)
    found = [(pair, fork(*pair)) for pair in forks(way)]
    return {
        "folds": folds(way),
        "forks": [
            {"value": there[0], "error": there[1] + TOLERANCE, "height": 0.5 * (a["height"] + b["height"])}
            for (a, b), there in found if there is not None
        ],
        "line": [[one["shift"], one["height"]] for one in way],
    }  # fmt: skip


def measured(narrow: float, first: Callable[[], Found] = tilted) -> dict[str, Any]:
    """Of the ribbon of w/l = 1 / `narrow`: "lost", "folds" in order from U on, "flat", each with value, error, height;
    "line" (shift, height) from U to S; "integral": by how much the first integral changes along the strip, of its
    size, at the most."""
    here = across(first(), narrow)
    up = followed(replace(here, way=1.0), lambda one: one["lift"] < -NEAR_U, STEP)
    down = followed(replace(here, way=-1.0), lambda one: one["height"] > NEAR_S, STEP)
    whole = [*(replace(one, way=-one.way) for one in reversed(up)), *down[1:]]
    integrals = [one.problem.integral(one.v) for one in (up[-1], here, down[-1])]
    return {
        "lost": beside(up[-1], "lift", TO_U, 2.0), "folds": folds(whole), "flat": beside(down[-1], "height", TO_S, 1.0),
        "line": [[one["shift"], one["height"]] for one in whole],
        "integral": max(float(np.ptp(one) / np.abs(one).max()) for one in integrals),
    }  # fmt: skip
