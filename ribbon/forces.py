"""What a support exerts on the ribbon, as data."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Force:
    """Force (3,) in D w / l^2 and moment (3,) in D w / l that a support exerts on the ribbon."""

    force: FloatArray
    moment: FloatArray


@dataclass(frozen=True)
class PairForce:
    """Two places of the ribbon that are held apart: abscissae and where across (s, v), (s_other, v_other) of the
    particles, in l; the force (3,) on the first, in D w / l^2, minus that on the other; gap between them, in l."""

    s: float
    v: float
    s_other: float
    v_other: float
    force: FloatArray
    gap: float


@dataclass(frozen=True)
class RubForce:
    """A particle of the ribbon that a wall with friction pushes, at the end of an increment of a path: its place (s, v)
    and point (3,) in l, push N and friction (3,) on the ribbon in D w / l^2; slip (3,): how far it went along the wall
    in the increment, in l; slips: whether friction is all that mu N allows."""

    s: float
    v: float
    point: FloatArray
    push: float
    friction: FloatArray
    slip: FloatArray
    slips: bool


@dataclass(frozen=True)
class WallForce:
    """What a wall exerts on the ribbon: force (3,) in D w / l^2, abscissae (k,) of the points in contact, ends (m, 2)
    of the rulings that it pushes: their abscissa and where across, v = w / 2 or -w / 2 (between them where a round
    obstacle pushes there), in l; height of a pressure
    plate above its place at rest, in l (None: a rigid wall); lines (n, 2): first and last abscissa of what it pushes in
    one piece, equal where that is one point, and within (n, 2): how much farther (l) each may reach on these segments,
    the next joint where a line ends at one; moment (3,) of a round obstacle about the origin, D w / l (None: a plane,
    whose force acts along its normal); pushes (m,): force at each of the ends, along the normal there, in D w / l^2;
    friction (3,): what it exerts along itself, in D w / l^2, and rubs: where, with both of which `force` has nothing to
    do (None and (): without friction)."""

    force: FloatArray
    contacts: FloatArray
    ends: FloatArray
    height: float | None = None
    lines: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    within: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    moment: FloatArray | None = None
    pushes: FloatArray = field(default_factory=lambda: np.empty(0))
    friction: FloatArray | None = None
    rubs: tuple[RubForce, ...] = ()

    @property
    def mean_pressure(self) -> float | None:
        """What pushes, over the width times the length of the `lines` along which it does, in D / l^3: of a strip that
        lies flat the pressure itself. None where it touches along no length: a line across has a force and no pressure.
        """
        length = float(np.sum(self.lines[:, 1] - self.lines[:, 0]))
        return float(np.sum(self.pushes)) / length if length > 0.0 else None
