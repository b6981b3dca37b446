"""Equilibria that are neutral: a fold that may slide, at one energy, as far as was tried.

A fold between a floor and a roof without friction, with flat parts on the floor beside it, may slide: its shape is the
same wherever it stands, and flat parts lie at one height. The second variation has a zero there, and segments, whose
joints fall differently into the fold at each place, make of it a ripple: a lowest eigenvalue that is small and of no
order, of either sign, and as many minima as there are places. None of them is the strip's.

Asked is where a strip touches a wall and the eigenvalue is below SOFT: the curvature is moved along the strip by MOVES,
to either side, and comes to rest. Where it rests elsewhere each time, farther for the longer move, with its energy the
same to SAME of its size, the state is neutral: whether it is stable has no answer, and a force is known to what it
differs by along the way. Two wells with a pass between them are not enough for that: it takes three places on one side.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.models.base import State
from compare.models.ribbon.state import own_size, state_of

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from ribbon import Equilibrium

#: Lowest eigenvalue from which nothing is asked (the fold that cannot slide, roman_6_2, has 0.12), largest change of
#: the energy over its size (at least 1), moves along the strip (l), and part of the first that counts as moved.
SOFT, SAME, MOVES, MOVED = 1e-3, 1e-4, (0.01, 0.03), 0.1


@dataclass(frozen=True)
class Neutral:
    """What was found along the strip: places where the strip rests too, how far the farthest joint stands from
    where it stood (l), and by how much the energies differ at most (D w / l)."""

    places: int
    distance: float
    energy: float

    @property
    def text(self) -> str:
        """In a sentence, without its full stop."""
        return (
            f"it is free to slide: it rests in {self.places} more places within {100 * self.distance:.1g} % "
            f"of l, at the same energy to {self.energy:.1g} D w / l"
        )


def told(scene: Scene, state: State) -> State:
    """The state, of which it is said where it is neutral: `stable` None, `numbers["neutral"]`, an eigenvalue of zero
    within its error, and forces and moments within what they are at the places that were found."""
    e = state.native
    lowest = state.lowest_eigenvalue
    if not state.ok or lowest is None or not abs(lowest) <= SOFT or not scene.barriers or state.motions or e.before:
        return state
    found = _along(e)
    if not found:
        return state
    apart = max(_apart(e, one) for one in found)
    energies = [one.energy.total - e.energy.total for one in found]
    neutral = Neutral(len(found), apart, max(abs(change) for change in energies))
    known = [low for one in state.refinements if (low := one.lowest_eigenvalue) is not None]
    size = max(abs(low) for low in (lowest, *known, *(one.lowest_eigenvalue for one in found)))
    limit = {"value": 0.0, "error": float(size), "order": None}
    numbers = {**state.numbers, "neutral": asdict(neutral), "eigenvalue_limit": limit}
    return replace(
        state, stable=None, numbers=numbers, message=f"converged: a neutral equilibrium, {neutral.text}",
        errors=_widened(scene, state, found, float(size)),
    )  # fmt: skip


def _along(e: Equilibrium) -> list[Equilibrium]:
    """Where the strip rests on the first side that has a place for every move, each farther than the one before and at
    the same energy; none where neither has."""
    for side in (1.0, -1.0):
        found = list(_rests(e, side))
        if len(found) == len(MOVES):
            return found
    return []


def _rests(e: Equilibrium, side: float) -> Iterator[Equilibrium]:
    """Where the strip rests from its own curvature, moved to one side by each of the moves, while that is neutral."""
    from ribbon.find.solve import solve_shape
    from ribbon.solvers.budget import spent

    omega, eta = e.problem.joint_values(e.x)
    s = np.concatenate([[0.0], np.cumsum(e.problem.lengths)])
    free = e.problem.with_changes(touching=())
    before = 0.0
    for move in MOVES:
        if spent():
            return
        there = solve_shape(free, *(np.interp(s - side * move, s, one, left=0.0, right=0.0) for one in (omega, eta)))
        far = _apart(e, there)
        change = abs(there.energy.total - e.energy.total)
        if not there.ok or far < before + MOVED * MOVES[0] or change > SAME * max(1.0, abs(e.energy.total)):
            return
        before = far
        yield there


def _apart(one: Equilibrium, other: Equilibrium) -> float:
    return float(np.abs(one.joints[0] - other.joints[0]).max())


def _widened(scene: Scene, state: State, found: list[Equilibrium], lowest: float) -> dict[str, Any]:
    """The state's errors, none below what its numbers differ by at the places along its way."""
    errors = dict(state.errors)
    own = state.supports
    for name in ("forces", "moments"):
        known = dict(errors.get(name) or {})
        for one in found:
            there = state_of(scene, one, own_size(one), state.seconds).supports
            for end in ("start", "end"):
                here, other = getattr(own, end), getattr(there, end)
                if here is not None and other is not None and known.get(end) is not None:
                    change = np.subtract(getattr(here, name[:-1]), getattr(other, name[:-1]))
                    known[end] = max(known[end], float(np.linalg.norm(change)))
            if name == "forces" and known.get("walls"):
                known["walls"] = [
                    None if error is None else max(error, math.dist(a["force"], b["force"]))
                    for error, a, b in zip(known["walls"], own.walls, there.walls, strict=True)
                ]
        errors[name] = known
    if errors.get("lowest_eigenvalue") is not None:
        errors["lowest_eigenvalue"] = max(errors["lowest_eigenvalue"], lowest)
    return errors
