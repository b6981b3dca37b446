"""Points of a branch, what is special about some of them, and how a branch is gone along."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from compare.continuation.system import FloatArray, System

Kind = Literal["regular", "fold", "branch_point", "ruling", "event"]


@dataclass(frozen=True)
class Options:
    """How a branch is followed.

    step, most, least: first, longest and shortest step in arc length (shapes by their metric, t over the range).
    tolerance: of the residual's norm. easy: Newton steps after which the next one is longer; turn: least cosine between
    neighbouring tangents. steps: most points. events: to which part of a step special points are located.
    """

    step: float = 0.02
    most: float = 0.1
    least: float = 1e-7
    tolerance: float = 1e-10
    easy: int = 4
    turn: float = 0.97
    steps: int = 400
    events: float = 1e-13


@dataclass(frozen=True)
class Point:
    """An equilibrium on a branch: z (n,) of `system` at t, unit tangent (dz, dt), number of unstable modes, arc length
    from the branch's first point, Newton steps, norm of the residual."""

    system: System = field(repr=False)
    z: FloatArray = field(repr=False)
    t: float
    tangent: tuple[FloatArray, float] = field(repr=False)
    unstable: int
    arc: float
    iterations: int
    norm: float

    def ahead(self, z: FloatArray, t: float) -> float:
        """The part of (z, t) - here along the tangent."""
        dz, dt = self.tangent
        return float(self.system.mass(dz) @ (z - self.z)) + dt * (t - self.t)

    def turned(self) -> Point:
        """The same point, its tangent the other way."""
        return Point(
            self.system, self.z, self.t, (-self.tangent[0], -self.tangent[1]), self.unstable, self.arc,
            self.iterations, self.norm,
        )  # fmt: skip


@dataclass(frozen=True)
class Special:
    """A fold, branch point or event at `point`, between the points `before` and at `reach` along its tangent.

    modes (n, k): null vectors of unit length in the metric, of an event (n, 0); values (k,): their eigenvalues as
    located; change: of the number of unstable modes across it; what: an event in words, or ""; apart: where it stands
    for several that are nearer to each other than is told apart, each of them, in order; condition: an event's number.
    """

    kind: Kind
    point: Point
    modes: FloatArray = field(repr=False)
    values: tuple[float, ...]
    before: Point
    reach: float
    change: int
    what: str = ""
    apart: tuple[Special, ...] = field(default=(), repr=False)
    condition: int | None = None


@dataclass(frozen=True)
class Run:
    """A followed branch: points in order, special ones apart, and how it ended.

    ended: "range" (t left the range: the last point lies on its end), "closed" (back at its first point), "steps" (as
    many as allowed), "stuck" (no next point at the shortest step), "unresolved" (its elements are too coarse for the
    next point), "unposed" (beyond the last point the density is not convex, and modes are the elements'), "spread"
    (its system knows of no branch beyond the last point: parts come to lie along each other), "stopped" (told to, or
    out of time).
    """

    points: tuple[Point, ...]
    specials: tuple[Special, ...]
    ended: str
    refused: int = 0


def length(system: System, dz: FloatArray, dt: float) -> float:
    """Length of (dz, dt) in the metric of the arc."""
    return math.sqrt(max(float(system.mass(dz) @ dz), 0.0) + dt * dt)


def product(system: System, a: tuple[FloatArray, float], b: tuple[FloatArray, float]) -> float:
    """Product of two tangents in the metric of the arc."""
    return float(np.dot(system.mass(a[0]), b[0])) + a[1] * b[1]
