"""A strip among others, and a moment at its end whose axis is fixed in space (docs/theory.md, eq. (5.20)).

On a turn of the end by the small vector phi, ``dq = phi o q / 2``, such a moment M does the work M . phi, so that its
generalised force on the end's quaternion is linear in it::

    f(q) = A q ,   A q = 2 (0, M) o q ,   A^T = -A ,   q . f = 0

It has no potential. That of the force as it is at a quaternion q*, ``-f(q*) . q``, has the same gradient where q = q*;
`ribbon.find.strips.moment` makes them one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ribbon.element import quaternion
from ribbon.problems import supports
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]
Vector = tuple[float, float, float]


def turning(moment: Vector) -> FloatArray:
    """A (4, 4) of the module, for a moment (3,)."""
    out = np.empty((4, 4))
    quaternion.left_matrix(np.array([0.0, *moment]), out)
    return 2.0 * out


@dataclass(frozen=True)
class Part(MixedProblem):
    """A strip among others: its joints hold it, so that none of its rigid motions is taken out.

    moment: at s = l, its axis fixed in space, in D w / l, None: none; turned: the quaternion (4,) of that end at which
    its force is taken, None: nowhere yet, and it does nothing; touched: what other strips that touch it on its first
    segment add to the Lagrangian's slope by position and quaternion of its start (7,), in its own units, None: nothing.
    """

    moment: Vector | None = None
    turned: tuple[float, ...] | None = None
    touched: tuple[float, ...] | None = None

    def free_motions(self) -> tuple[FloatArray, FloatArray]:
        """None: what is free of it is the whole's."""
        return np.empty((0, 3)), np.empty((0, 3))

    @property
    def is_held(self) -> bool:
        """Whether a clamp holds position and frame of its start."""
        return self.start_position is not None and self.start_quaternion is not None

    def start_force(self, x: FloatArray, rows: FloatArray) -> supports.Force:
        """What the clamp at s = 0 exerts, about that point, from the multipliers of its own rows and `touched`."""
        own = super().start_force(x, rows)
        if self.touched is None or self.start is None:
            return own
        force, turning = np.asarray(self.touched[:3]), np.asarray(self.touched[3:])
        q = x[self.layout.joint(0).quaternion]
        moment = np.array([0.5 * turning @ quaternion.compose(turn, q) for turn in np.eye(4)[1:]])
        return supports.Force(
            own.force + (force if self.start.position is not None else 0.0),
            own.moment + (moment if self.start.holds_frame else 0.0),
        )

    @property
    def turns(self) -> FloatArray | None:
        """What the moment does on the quaternion of the end (4,), as it is at `turned`; None: nothing."""
        if self.moment is None or self.turned is None:
            return None
        return np.asarray(turning(self.moment) @ np.asarray(self.turned))

    def value(self, x: FloatArray) -> float:
        """Total energy, with the potential of the moment's force as it is at `turned`; units D w / l."""
        force = self.turns
        return super().value(x) - (0.0 if force is None else float(force @ x[self.layout.joint(-1).quaternion]))

    def gradient(self, x: FloatArray) -> FloatArray:
        """Gradient (size,) of it."""
        out, force = super().gradient(x), self.turns
        if force is not None:
            out[self.layout.joint(-1).quaternion] -= force
        return out
