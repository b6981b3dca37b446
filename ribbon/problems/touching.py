"""Contact between the joints: an edge of the strip on a wall's side at any abscissa, one row a point.

On the segment that starts at joint i, at the distance h behind it, an edge of the strip stands at (docs/theory.md, eq.
(5.3), (5.7))::

    x = r_i + R(q_i) y ,   y = p(h) +- (w/2) (Q(h) e_x + (m + n h) Q(h) e_z)

with the end frame Q and the chord p of the first h of the segment (`ribbon.element.series`), functions of its
parameters (a, b, n, m). With N of `ribbon.element.quaternion` the row is ``<r_i - point, normal> + q^T N(normal, y)
q``, so that all derivatives follow from the jets of y: linear in those, quadratic in q.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.element.kinematics import walk
from ribbon.element.quaternion import form
from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.layout import OMEGA, POSITION, QUATERNION, STRIDE

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Touch(NamedTuple):
    """A point of the strip that is held on a wall's side: number of the wall, abscissa in (0, 1), edge 1.0 or -1.0."""

    wall: int
    s: float
    side: float


@dataclass(frozen=True)
class TouchRows:
    """Edges of the strip on the wall's side at points inside segments, ``distance - height >= 0``.

    segments (k,), along (k,): the segment of each point and how far behind its start it is; sides (k,): 1 or -1;
    lengths: of all segments; sideways: first column of the in-plane curvatures, -1 without; free: whether the twist
    is free, the sections then square to the centreline; limit: of the series; other fields as in
    `ribbon.problems.conditions.WallRows`.
    """

    segments: IntArray
    along: FloatArray
    sides: FloatArray
    lengths: FloatArray
    point: FloatArray
    normal: FloatArray
    half_width: float
    limit: float
    components: int
    free: bool = False
    sideways: int = -1
    plate: int = -1
    lower: float = 0.0
    upper: float = np.inf
    _kept: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def count(self) -> int:
        """One row a point."""
        return len(self.segments)

    @cached_property
    def _parameters(self) -> int:
        return 4 if self.sideways < 0 else 6

    @cached_property
    def _columns(self) -> IntArray:
        """Columns (k, 7 + parameters) of r, q of the joint before each point, and of what bends its segment."""
        own = [STRIDE * self.segments[:, None] + np.arange(POSITION, OMEGA)]
        own += [
            np.array([[kernels.bending_column(i, z, self.sideways)] for i in self.segments])
            for z in range(self._parameters)
        ]
        return np.hstack(own)

    @cached_property
    def _forms(self) -> FloatArray:
        """N(normal, e_r) (3, 4, 4): a row is quadratic in the quaternion and linear in y."""
        forms = np.empty((3, 4, 4))
        for r, axis in enumerate(np.eye(3)):
            form(self.normal, axis, forms[r])
        return forms

    def _jets(self, x: FloatArray) -> FloatArray:
        """Jets (k, 3, components) of y by what bends the segment."""
        x = np.ascontiguousarray(x, dtype=float)
        key = x.tobytes()
        if self._kept.get("key") == key:
            return self._kept["jets"]  # type: ignore[no-any-return]
        k = self.count
        q = np.empty((k, self._parameters))
        for row, i in enumerate(self.segments):
            kernels.own_parameters(x, self.lengths, i, self.sideways, q[row])
        states = np.empty((k, 12, self.components))
        walk(self.free, q, self.along, self.limit, states)
        edge = self.half_width * self.sides[:, None]
        jets = states[:, 9:12].copy()
        for r in range(3):
            jets[:, r] += edge * states[:, 3 * r]
            if not self.free:
                jets[:, r] += edge * _times_ruling(states[:, 3 * r + 2], q, self.along)
        for row, i in enumerate(self.segments):
            for r in range(3):
                kernels.by_unknowns(jets[row, r], self.lengths[i])
        self._kept["key"], self._kept["jets"] = key, jets
        return jets

    def _turned(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """``R(q)^T normal`` (k, 3) and its derivative by q (k, 3, 4)."""
        q = x[self._columns[:, QUATERNION:OMEGA]]
        by = 2.0 * np.einsum("rab,kb->kra", self._forms, q)
        return 0.5 * np.einsum("kra,ka->kr", by, q), by

    def values(self, x: FloatArray) -> FloatArray:
        """Distances (count,) from the wall."""
        y = self._jets(x)[:, :, 0]
        r = x[self._columns[:, POSITION:QUATERNION]]
        height = x[self.plate] if self.plate >= 0 else 0.0
        turned, _ = self._turned(x)
        return np.asarray((r - self.point) @ self.normal + np.einsum("kr,kr->k", turned, y) - height)

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """r, q, what bends the segment (and the plate's height)."""
        columns = self._columns
        if self.plate >= 0:
            columns = np.column_stack([columns, np.full(self.count, self.plate)])
        return np.repeat(np.arange(self.count), columns.shape[1]), columns.ravel()

    def jacobian(self, x: FloatArray) -> FloatArray:
        """In the order of the structure."""
        jets = self._jets(x)
        turned, by = self._turned(x)
        parts = [
            np.tile(self.normal, (self.count, 1)),
            np.einsum("kr,kra->ka", jets[:, :, 0], by),
            np.einsum("kr,krz->kz", turned, jets[:, :, 1 : 1 + self._parameters]),
        ]
        if self.plate >= 0:
            parts.append(np.full((self.count, 1), -1.0))
        return np.hstack(parts).ravel()

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """q by q, q by what bends, what bends by itself."""
        count = self._parameters
        q, z = QUATERNION, OMEGA
        pairs = [(q + a, q + b) for a in range(4) for b in range(a + 1)]
        pairs += [(q + a, z + b) for a in range(4) for b in range(count)]
        pairs += [(z + a, z + b) for a in range(count) for b in range(a, count)]
        one, other = (self._columns[:, list(side)].ravel() for side in zip(*pairs, strict=True))
        return np.maximum(one, other), np.minimum(one, other)

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray:
        """In the order of the structure."""
        jets = self._jets(x)
        turned, by = self._turned(x)
        count = self._parameters
        full = 2.0 * np.einsum("kr,rab->kab", jets[:, :, 0], self._forms)
        rows, places = np.tril_indices(4)
        parts = [
            full[:, rows, places],
            np.einsum("kra,krz->kaz", by, jets[:, :, 1 : 1 + count]).reshape(self.count, -1),
            np.einsum("kr,krz->kz", turned, jets[:, :, 1 + count :]),
        ]
        return np.asarray(multipliers[:, None] * np.hstack(parts)).ravel()


def _times_ruling(jet: FloatArray, q: FloatArray, along: FloatArray) -> FloatArray:
    """Jets (k, 15) of (m + n h) g from those of g (k, 15) by (a, b, n, m), q (k, 4), h = along (k,)."""
    eta = np.zeros((len(jet), 5))
    eta[:, 0], eta[:, 3], eta[:, 4] = q[:, 3] + q[:, 2] * along, along, 1.0
    out = eta[:, :1] * jet
    out[:, 1:5] += jet[:, :1] * eta[:, 1:]
    at = 5
    for i in range(1, 5):
        for j in range(i, 5):
            out[:, at] += eta[:, i] * jet[:, j] + eta[:, j] * jet[:, i]
            at += 1
    return out
