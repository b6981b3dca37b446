"""Contact between the joints: an edge of the strip on a wall's side at any abscissa, one row a point, which slides.

On the segment that starts at joint i, at the distance h behind it, an edge of the strip stands at (docs/theory.md, eq.
(5.3), (5.7))::

    x = r_i + R(q_i) y ,   y = p(h) +- (w/2) (Q(h) e_x + (m + n h) Q(h) e_z)

with the end frame Q and the chord p of the first h of the segment (`ribbon.element.series`), functions of its
parameters (a, b, n, m). With N of `ribbon.element.quaternion` its distance from the wall is ``g = <r_i - point,
normal> + q^T N(normal, y) q``, so that all derivatives follow from the jets of y: linear in those, quadratic in q.

Of a point that slides the row is the least distance of its segment, ``min g(x, h)`` over 0 <= h <= L: where the strip
touches is not chosen, it touches where it is nearest. At a minimum inside ``g_h = 0``, and by the implicit function
theorem (docs/theory.md, eq. (5.8); R. Hettich and K. Kortanek 1993, section 3, doi:10.1137/1035089)::

    (min g)_x = g_x ,   (min g)_xx = g_xx - g_xh g_hx / g_hh ,   h_x = -g_hx / g_hh .

The edge runs along ``y' = (1 +- (w/2) n) Q e_z`` (`_along_edge`; t_x' + eta t_z' = 0 of a developable surface), where
the twist is free along ``y' = Q e_z +- (w/2) (kappa_3 Q e_y - kappa_2 Q e_z)``.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
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


#: How far (of a segment's length) a minimum may lie beyond the ends of its segment, on the element continued there: so
#: that what touches at a joint is smooth too. The continued element leaves the strip with the third power of this.
_BEYOND = 1e-2
#: Rounds of the search for the minimum of a segment, and change of the abscissa (of the length) at which it is found.
_ROUNDS, _FOUND = 40, 1e-13
#: Least curvature (1/l) of the distance along the edge that tells where the minimum is.
FLAT = 1e-9


class Touch(NamedTuple):
    """What is held on a wall's side between joints: number of the wall, abscissa in (0, 1), edge 1.0 or -1.0; the point
    there, or where it slides, the place of the segment around it that is nearest to the wall."""

    wall: int
    s: float
    side: float
    slides: bool = False


class Nearest(NamedTuple):
    """Of the points, wherever they have gone: along (k,) behind their segments' starts; jets (k, 3, components) of y
    and slopes (k, 3, 1 + parameters) of y' with its first derivatives, by what bends the segment; bent (k,): 1 / g_hh
    (l), 0 where the place does not move."""

    along: FloatArray
    jets: FloatArray
    slopes: FloatArray
    bent: FloatArray


@dataclass(frozen=True)
class TouchRows:
    """Edges of the strip on the wall's side at points inside segments, ``distance - height >= 0``, or all along them.

    segments (k,), along (k,): the segment of each point and how far behind its start it is, or where the search for the
    nearest place begins; slides (k,): whether it is that place; sides (k,): 1 or -1; lengths: of all segments;
    sideways: first column of the in-plane curvatures, -1 without; free: whether the twist is free, the sections then
    square to the centreline; limit: of the series; other fields as in `ribbon.problems.conditions.WallRows`.
    """

    segments: IntArray
    along: FloatArray
    sides: FloatArray
    slides: NDArray[np.bool_]
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

    def _at(self, x: FloatArray) -> Nearest:
        """The nearest places at x, and all that is asked for there."""
        x = np.ascontiguousarray(x, dtype=float)
        key = x.tobytes()
        if self._kept.get("key") != key:
            self._kept["nearest"], self._kept["key"] = self._nearest(x), key
        return self._kept["nearest"]  # type: ignore[no-any-return]

    def _nearest(self, x: FloatArray) -> Nearest:
        q = self._own(x)
        own = self.lengths[self.segments]
        along, inside = self._least(x, q, own)
        states = self._walked(q, along)
        sides = self._nearest_across(x, q, along, states)
        at = self if sides is self.sides else replace(self, sides=sides, _kept={})
        jets = self._jets_of(states, q, along, sides)
        slopes = at._along_edge(states, q, along)
        curvature = self._along(x, q, along, states)[2]
        for row, length in enumerate(own):
            for r in range(3):
                kernels.by_unknowns(jets[row, r], length)
                kernels.by_unknowns(slopes[row, r], length)
        bent = np.where(inside & (curvature > FLAT), 1.0 / np.maximum(curvature, FLAT), 0.0)
        return Nearest(along, jets, slopes[:, :, : 1 + self._parameters], bent)

    def _own(self, x: FloatArray) -> FloatArray:
        """Parameters (k, 4 or 6) of the points' segments."""
        q = np.empty((self.count, self._parameters))
        for row, i in enumerate(self.segments):
            kernels.own_parameters(x, self.lengths, i, self.sideways, q[row])
        return q

    def _nearest_across(self, x: FloatArray, q: FloatArray, h: FloatArray, states: FloatArray) -> FloatArray:
        """Where across (k,) the points are: on their edges."""
        return self.sides

    def across(self, x: FloatArray) -> FloatArray:
        """Where across (k,), from -1 to 1, the points are."""
        return self.sides

    def _jets_of(self, states: FloatArray, q: FloatArray, along: FloatArray, sides: FloatArray) -> FloatArray:
        """Jets (k, 3, components) of y at `sides` (k,)."""
        edge = self.half_width * sides[:, None]
        jets = states[:, 9:12].copy()
        for r in range(3):
            jets[:, r] += edge * states[:, 3 * r]
            if not self.free:
                jets[:, r] += edge * _times_ruling(states[:, 3 * r + 2], q, along)
        return jets

    def _walked(self, q: FloatArray, along: FloatArray) -> FloatArray:
        """Jets (k, 12, components) of Q and p at distances `along` (k,) behind the starts of the segments."""
        states = np.empty((self.count, 12, self.components))
        walk(self.free, q, along, self.limit, states)
        return states

    def _along(
        self, x: FloatArray, q: FloatArray, h: FloatArray, states: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The part of the distance that h (k,) changes, its slope and its curvature along the edges (k,) at x; states:
        what `_walked` gives at h."""
        turned, _ = self._turned(x)
        states = self._walked(q, h) if states is None else states
        first = self._along_edge(states, q, h)[:, :, 0]
        parts = self._edge(states, q, h), first, self._curved_edge(states, q, h)
        near, slope, curvature = (np.einsum("kr,kr->k", turned, part) for part in parts)
        return near, slope, curvature

    def _least(self, x: FloatArray, q: FloatArray, own: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Where (k,) the distance is least on each segment of length `own` (k,), and whether it is so by its slope: not
        at an end."""
        if not self.slides.any():
            return self.along, self.slides

        def slope(h: FloatArray) -> tuple[FloatArray, FloatArray]:
            return self._along(x, q, h)[1:]

        low, high = -_BEYOND * own, (1.0 + _BEYOND) * own
        falls, rises = slope(low)[0] < 0.0, slope(high)[0] > 0.0
        inside = self.slides & falls & rises
        h = np.where(inside | ~self.slides, self.along, np.where(falls, own, 0.0))
        both = self.slides & ~falls & ~rises  # the ends are the nearest
        if both.any():
            places = [np.zeros(self.count), own]
            near = [self._along(x, q, at)[0] for at in places]
            h = np.where(both & (near[1] < near[0]), own, np.where(both, 0.0, h))
        for _ in range(_ROUNDS if inside.any() else 0):
            first, second = slope(h)
            low, high = np.where(first < 0.0, h, low), np.where(first < 0.0, high, h)
            step = h - first / np.where(second > FLAT, second, np.inf)
            fits = (second > FLAT) & (step > low) & (step < high)
            fresh = np.where(inside, np.where(fits, step, 0.5 * (low + high)), h)
            moved = float(np.max(np.abs(fresh - h) / own))
            h = fresh
            if moved <= _FOUND:
                break
        return h, inside

    def _edge(self, states: FloatArray, q: FloatArray, along: FloatArray) -> FloatArray:
        """y (k, 3) of the module."""
        edge = self.half_width * self.sides[:, None]
        matrix = states[:, :9, 0].reshape(-1, 3, 3)
        y = states[:, 9:12, 0] + edge * matrix[:, :, 0]
        return y if self.free else y + edge * (q[:, 3] + q[:, 2] * along)[:, None] * matrix[:, :, 2]

    def _bent(self, q: FloatArray, along: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """kappa_1, kappa_2, kappa_3 (k,) of a segment whose twist is free."""
        sideways = q[:, 4] * along + q[:, 5] if self._parameters == 6 else np.zeros(self.count)
        return q[:, 0] * along + q[:, 1], sideways, q[:, 2] * along + q[:, 3]

    def _along_edge(self, states: FloatArray, q: FloatArray, along: FloatArray) -> FloatArray:
        """y' (k, 3) along the edge with its first derivatives by the parameters, as jets (k, 3, components)."""
        edge = self.half_width * self.sides
        out = np.zeros((self.count, 3, self.components))
        count = 1 + self._parameters
        first = states[:, :9, :count].reshape(-1, 3, 3, count)  # rows, columns t_x t_y t_z, jets
        if not self.free:
            out[:, :, :count] = (1.0 + edge * q[:, 2])[:, None, None] * first[:, :, 2]
            out[:, :, 3] += edge[:, None] * first[:, :, 2, 0]
            return out
        _, sideways, twist = self._bent(q, along)
        out[:, :, :count] = (1.0 - edge * sideways)[:, None, None] * first[:, :, 2]
        out[:, :, :count] += (edge * twist)[:, None, None] * first[:, :, 1]
        out[:, :, 3] += (edge * along)[:, None] * first[:, :, 1, 0]
        out[:, :, 4] += edge[:, None] * first[:, :, 1, 0]
        if self._parameters == 6:
            out[:, :, 5] -= (edge * along)[:, None] * first[:, :, 2, 0]
            out[:, :, 6] -= edge[:, None] * first[:, :, 2, 0]
        return out

    def _curved_edge(self, states: FloatArray, q: FloatArray, along: FloatArray) -> FloatArray:
        """y'' (k, 3) along the edge, with t_x' = kappa_3 t_y - kappa_2 t_z, t_y' = kappa_1 t_z - kappa_3 t_x and
        t_z' = kappa_2 t_x - kappa_1 t_y."""
        edge = (self.half_width * self.sides)[:, None]
        t_x, t_y, t_z = np.moveaxis(states[:, :9, 0].reshape(-1, 3, 3), 2, 0)
        one, two, three = (part[:, None] for part in self._bent(q, along))
        if not self.free:
            return np.asarray(-(1.0 + edge * q[:, 2:3]) * one * t_y)
        slope = q[:, 4:5] if self._parameters == 6 else 0.0
        return np.asarray(
            (1.0 - edge * two) * (two * t_x - one * t_y)
            - edge * slope * t_z
            + edge * q[:, 2:3] * t_y
            + edge * three * (one * t_z - three * t_x)
        )

    def places(self, x: FloatArray) -> FloatArray:
        """How far (k,) behind the starts of their segments the points are, within the segments."""
        return np.clip(self._at(x).along, 0.0, self.lengths[self.segments])

    def _turned(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """``R(q)^T normal`` (k, 3) and its derivative by q (k, 3, 4)."""
        q = x[self._columns[:, QUATERNION:OMEGA]]
        by = 2.0 * np.einsum("rab,kb->kra", self._forms, q)
        return 0.5 * np.einsum("kra,ka->kr", by, q), by

    def values(self, x: FloatArray) -> FloatArray:
        """Distances (count,) from the wall."""
        y = self._at(x).jets[:, :, 0]
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
        jets = self._at(x).jets
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
        here = self._at(x)
        jets, slopes, bent = here.jets, here.slopes, here.bent[:, None, None]
        turned, by = self._turned(x)
        count = self._parameters
        full = 2.0 * np.einsum("kr,rab->kab", jets[:, :, 0], self._forms)
        rows, places = np.tril_indices(4)
        one, other = np.triu_indices(count)
        # g_hx / g_hh^(1/2) g_xh / g_hh^(1/2): the point of contact moves
        by_q = np.einsum("kra,kr->ka", by, slopes[:, :, 0])
        by_z = np.einsum("kr,krz->kz", turned, slopes[:, :, 1:])
        parts = [
            (full - bent * by_q[:, :, None] * by_q[:, None, :])[:, rows, places],
            (
                np.einsum("kra,krz->kaz", by, jets[:, :, 1 : 1 + count]) - bent * by_q[:, :, None] * by_z[:, None, :]
            ).reshape(self.count, -1),
            np.einsum("kr,krz->kz", turned, jets[:, :, 1 + count :])
            - (bent * by_z[:, :, None] * by_z[:, None, :])[:, one, other],
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
