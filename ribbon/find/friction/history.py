"""Where the particles of a strip were on its walls at the end of the last increment (docs/theory.md, eq. (5.16))."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ribbon.contact import Barrier, Wall
from ribbon.result import Equilibrium

FloatArray = NDArray[np.float64]

#: How far (l) along the strip, or how many segments, a place of contact may go in an increment and be the same one.
FAR, SEGMENTS = 0.1, 2.5


@dataclass(frozen=True)
class History:
    """The end of the last increment: the state, and the walls as they stood; contacts: of each wall the abscissae (k,)
    of the rulings that it pushed."""

    state: Equilibrium
    walls: tuple[Barrier, ...]
    contacts: tuple[FloatArray, ...]

    @classmethod
    def of(cls, state: Equilibrium) -> History:
        """Of the state at the end of an increment, or where a path begins; what stood before it is forgotten."""
        contacts = tuple(np.sort(wall.ends[:, 0]) for wall in state.walls)
        return cls(replace(state, before=None), tuple(state.problem.walls), contacts)

    def known(self, wall: int, s: float) -> bool:
        """Whether the wall pushed the strip near s: what touches anew has no friction in its first increment."""
        if wall >= len(self.contacts) or not self.contacts[wall].size:
            return False
        far = max(FAR, SEGMENTS * float(self.state.problem.lengths.max()))
        return float(np.abs(self.contacts[wall] - s).min()) <= far

    def places(self, wall: int, now: Barrier, particles: FloatArray) -> FloatArray:
        """Where (k, 3) on a wall, as it stands `now`, the particles (S, v) (k, 2) were: it has carried them with it."""
        then = self.state.rulings(particles)[1]
        turn, shift = motion(self.walls[wall], now, self.state.problem.strip.length)
        return np.asarray(then @ turn.T + shift)


def motion(before: Barrier, now: Barrier, unit: float) -> tuple[FloatArray, FloatArray]:
    """Rotation (3, 3) and shift (3,) in l of a wall's body: its point goes with it, and its normal, or a cylinder's
    axis, turns on the shortest way."""
    turn = np.eye(3)
    first, last = _direction(before), _direction(now)
    if first is not None and last is not None:
        turn = _shortest(first, last)
    here, there = np.asarray(before.point) / unit, np.asarray(now.point) / unit
    return turn, there - turn @ here


def _direction(wall: Barrier) -> FloatArray | None:
    found = wall.normal if isinstance(wall, Wall) else wall.axis
    return None if found is None else np.asarray(found, dtype=float)


def _shortest(one: FloatArray, other: FloatArray) -> FloatArray:
    """The rotation (3, 3) by the smallest angle that takes one unit vector to another (O. Rodrigues 1840)."""
    axis, cosine = np.cross(one, other), float(one @ other)
    if not axis.any():
        return np.eye(3)
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1.0 + cosine))
