"""Joints: what holds an end of one strip at an end of another, as rows of constraints (docs/theory.md, eq. (5.17)).

With r, R the position and the frame of either end, sigma l / l_0 of its strip, and delta the turn of the joint::

    sigma' r' - sigma r = 0                                        (all kinds; multipliers: forces)
    R'^T R turned back by delta: 2 Im(conj(q o delta) o q') = 0    ("rigid", "seamless"; moments)
    its components across the hinge                                ("hinge": about t_x of the turned frame)

"seamless" lets the strip go on: omega / sigma and the ruling (or twist, and in-plane curvature) too are the same on
both sides, as at the seam of a band.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.element.quaternion import right_matrix
from ribbon.errors import RibbonInputError
from ribbon.problems.conditions import imaginary_part

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: What a joint holds.
KINDS = ("rigid", "seamless", "hinge", "pin")
#: Components (of the turn from one frame to the other) that a joint of each kind holds at zero.
HELD = {"rigid": (0, 1, 2), "seamless": (0, 1, 2), "hinge": (1, 2), "pin": ()}


class End(NamedTuple):
    """An end of a strip: its number, and 0 for s = 0 or -1 for s = l."""

    strip: int
    joint: int


@dataclass(frozen=True)
class Joint:
    """`other` is held at `one`: its frame is that of `one` turned by the quaternion `turn` (4,), about the axes of
    that frame. kind: of KINDS."""

    one: End
    other: End
    kind: str = "rigid"
    turn: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise RibbonInputError("kind", self.kind, f"use one of {', '.join(KINDS)}")
        if self.kind == "seamless" and (self.one.joint, self.other.joint) != (-1, 0):
            raise RibbonInputError("kind", self.kind, "a strip goes on from the end of one into the start of the other")
        if self.kind == "seamless" and abs(self.turn[0]) < 1.0:
            raise RibbonInputError("turn", self.turn, "a strip that goes on is not turned: leave it out")


@dataclass(frozen=True)
class FrameRows:
    """Components `held` of ``2 Im(conj(q o delta) o q')``: twice the turn, for small ones, from the frame q turned by
    delta to q', about the axes of the former.

    first, last (4,): columns of q and q'; delta (4,).
    """

    first: IntArray
    last: IntArray
    delta: tuple[float, ...]
    held: tuple[int, ...] = (0, 1, 2)
    lower: float = 0.0
    upper: float = 0.0
    forms: FloatArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        right = np.empty((4, 4))
        right_matrix(np.asarray(self.delta, dtype=float), right)
        # bilinear in s = q o delta and q': s^T C_k q', column by column of the unit quaternions s
        forms = np.stack([imaginary_part(unit) for unit in np.eye(4)], axis=1)
        object.__setattr__(self, "forms", np.einsum("sa,ksb->kab", right, forms)[list(self.held)])

    @property
    def count(self) -> int:
        """One row a component."""
        return len(self.held)

    def values(self, x: FloatArray) -> FloatArray:
        """(count,)."""
        return np.einsum("kab,a,b->k", self.forms, x[self.first], x[self.last])

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows of eight."""
        return np.repeat(np.arange(self.count), 8), np.tile(np.concatenate([self.first, self.last]), self.count)

    def jacobian(self, x: FloatArray) -> FloatArray:
        """By q and q'."""
        return np.concatenate([self.forms @ x[self.last], x[self.first] @ self.forms], axis=1).ravel()

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """The block of q' by q, in the lower triangle."""
        one, other = np.repeat(self.last, 4), np.tile(self.first, 4)
        return np.maximum(one, other), np.minimum(one, other)

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray:
        """Constant forms times the multipliers."""
        return np.einsum("k,kab->ba", multipliers, self.forms).ravel()
