"""Rows of contact with a curved surface, ``gap >= 0``: of both edges at joints, and of points between them.

At joint i an edge stands at ``r_i + R(q_i) y`` with ``y = +- (w/2) (e_x + eta_i e_z)``, between joints with the y of
`ribbon.problems.touching`, at any place across: what that module says of planes is said here with the surface's own
gradient and second derivative (`ribbon.problems.curved.placed`). Where a point slides along its edge the row is the
least gap of its segment, with ``g_h = n . x_h`` and ``g_hh = x_h . B x_h + n . x_hh``.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.obstacle import Obstacle
from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.curved.placed import Placed, form_of, placed, rotations, times
from ribbon.problems.layout import ETA, OMEGA, POSITION, QUATERNION
from ribbon.problems.touching import FLAT, TouchRows

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def _triangle(columns: IntArray) -> tuple[IntArray, IntArray]:
    """Places of the lower triangle of (k, n, n) blocks at columns (k, n), row by row of one triangle."""
    one, other = np.tril_indices(columns.shape[1])
    left, right = columns[:, one].ravel(), columns[:, other].ravel()
    return np.maximum(left, right), np.minimum(left, right)


def _triangles(blocks: FloatArray) -> FloatArray:
    """The entries of the blocks (k, n, n) in the order of `_triangle`."""
    one, other = np.tril_indices(blocks.shape[1])
    return np.asarray(blocks[:, one, other].ravel())


@dataclass(frozen=True)
class CurvedJointRows:
    """Both edges of the rulings at `joints` on the surface's side, two rows a joint; fields as in
    `ribbon.problems.conditions.WallRows`, surface in units of l."""

    joints: IntArray
    stride: int
    surface: Obstacle
    half_width: float
    lower: float = 0.0
    upper: float = np.inf
    oblique: float = 1.0
    plate: int = -1
    _kept: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def count(self) -> int:
        """Two rows a joint."""
        return 2 * len(self.joints)

    @cached_property
    def _columns(self) -> IntArray:
        """(count, 8): r, q, eta."""
        local = np.array([*range(POSITION, OMEGA), ETA])
        return np.repeat(self.stride * self.joints, 2)[:, None] + local

    def _at(self, x: FloatArray) -> Placed:
        x = np.ascontiguousarray(x, dtype=float)
        key = x.tobytes()
        if self._kept.get("key") != key:
            own = x[self._columns]
            side = self.half_width * np.tile([1.0, -1.0], len(self.joints))
            y = np.column_stack([side, np.zeros(self.count), self.oblique * side * own[:, 7]])
            by_eta = np.zeros((self.count, 3, 1))
            by_eta[:, 2, 0] = self.oblique * side
            self._kept["placed"] = placed(self.surface, own[:, :3], own[:, 3:7], y, by_eta, None)
            self._kept["key"] = key
        return self._kept["placed"]  # type: ignore[no-any-return]

    def values(self, x: FloatArray) -> FloatArray:
        """Gaps (count,) of the edges."""
        return self._at(x).gap

    def normals(self, x: FloatArray) -> FloatArray:
        """Unit normals (count, 3) of the surface towards the ribbon, where its edges are."""
        return self._at(x).normal

    def points(self, x: FloatArray) -> FloatArray:
        """The edges (count, 3) in units of l."""
        own = x[self._columns]
        side = self.half_width * np.tile([1.0, -1.0], len(self.joints))
        y = np.column_stack([side, np.zeros(self.count), self.oblique * side * own[:, 7]])
        return np.asarray(own[:, :3] + times(self._at(x).matrix, y))

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """r, q, eta of the joint."""
        return np.repeat(np.arange(self.count), 8), self._columns.ravel()

    def jacobian(self, x: FloatArray) -> FloatArray:
        """In the order of the structure."""
        here = self._at(x)
        return np.asarray(np.einsum("ka,kac->kc", here.normal, here.slopes).ravel())

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """r, q and eta by themselves."""
        return _triangle(self._columns)

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray:
        """In the order of the structure."""
        return _triangles(multipliers[:, None, None] * self._at(x).second)


class _Across(NamedTuple):
    """Of points that are nearest across their ruling: sides (k,), where that is; free (k,): whether it is between the
    edges, so that it moves with the shape; ruling (k, 3, 1 + z): y_v and its derivatives by z, v from -1 to 1."""

    sides: FloatArray
    free: NDArray[np.bool_]
    ruling: FloatArray


@dataclass(frozen=True)
class CurvedTouchRows(TouchRows):
    """Points between joints on the surface's side, or where they slide the least gap of their segment along an edge.

    surface in units of l; sides (k,): 1 or -1, an edge; between them the row is the least gap of the ruling, wherever
    across that is. `point` and `normal` are a plane's and are not asked."""

    surface: Obstacle | None = None

    @cached_property
    def _follows(self) -> NDArray[np.bool_]:
        return np.abs(self.sides) < 1.0

    @cached_property
    def _edges(self) -> tuple[TouchRows, TouchRows]:
        """The same points in the middle and at one edge: what stands across is the difference."""
        return replace(self, sides=np.zeros(self.count), _kept={}), replace(self, sides=np.ones(self.count), _kept={})

    def _body(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """r (k, 3) and R (k, 3, 3) of the joints before the points."""
        own = x[self._columns]
        return own[:, POSITION:QUATERNION], rotations(own[:, QUATERNION:OMEGA])

    def _nearest_across(self, x: FloatArray, q: FloatArray, h: FloatArray, states: FloatArray) -> FloatArray:
        """Sides (k,) at distances h (k,) behind the segments' starts."""
        if not self._follows.any():
            return self.sides
        assert self.surface is not None
        r, matrix = self._body(x)
        middle, edge = (rows._edge(states, q, h) for rows in self._edges)
        points = r + times(matrix, middle)
        across = self.surface.nearest(points, times(matrix, edge - middle))
        return np.where(self._follows, np.clip(across, -1.0, 1.0), self.sides)

    def _placed(self, x: FloatArray) -> Placed:
        here = self._at(x)
        key = x.tobytes()
        if self._kept.get("placed_key") != key:
            assert self.surface is not None
            own, count = x[self._columns], self._parameters
            jets = here.jets
            second = np.empty((self.count, 3, count, count))
            one, other = np.triu_indices(count)
            second[:, :, one, other] = second[:, :, other, one] = jets[:, :, 1 + count :]
            found = placed(
                self.surface, own[:, POSITION:QUATERNION], own[:, QUATERNION:OMEGA], jets[:, :, 0],
                jets[:, :, 1 : 1 + count], second,
            )  # fmt: skip
            self._kept["placed"], self._kept["placed_key"] = found, key
        return self._kept["placed"]  # type: ignore[no-any-return]

    def _along(
        self, x: FloatArray, q: FloatArray, h: FloatArray, states: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gap, g_h and g_hh (k,) at distances h (k,) behind the segments' starts; of the least gap of the ruling."""
        assert self.surface is not None
        states = self._walked(q, h) if states is None else states
        at = replace(self, sides=self._nearest_across(x, q, h, states), _kept={}) if self._follows.any() else self
        r, matrix = self._body(x)
        first = times(matrix, at._along_edge(states, q, h)[:, :, 0])
        second = times(matrix, at._curved_edge(states, q, h))
        gap, normal, bend = self.surface.derivatives(r + times(matrix, at._edge(states, q, h)))
        slope = np.einsum("ka,ka->k", normal, first)
        curvature = np.einsum("ka,kab,kb->k", first, bend, first) + np.einsum("ka,ka->k", normal, second)
        if at is not self:
            across, mixed = self._across_along(states, q, h)
            across, mixed = (times(matrix, part) for part in (across, mixed))
            crossed = np.einsum("ka,kab,kb->k", first, bend, across) + np.einsum("ka,ka->k", normal, mixed)
            bent = np.einsum("ka,kab,kb->k", across, bend, across)
            moves = self._follows & (np.abs(at.sides) < 1.0) & (bent > FLAT)
            curvature = curvature - np.where(moves, crossed**2 / np.maximum(bent, FLAT), 0.0)
        return gap, slope, curvature

    def _across_along(self, states: FloatArray, q: FloatArray, h: FloatArray) -> tuple[FloatArray, FloatArray]:
        """y_v and y_hv (k, 3)."""
        middle, edge = self._edges
        along = [rows._along_edge(states, q, h)[:, :, 0] for rows in self._edges]
        return edge._edge(states, q, h) - middle._edge(states, q, h), along[1] - along[0]

    def across(self, x: FloatArray) -> FloatArray:
        """Where across (k,), from -1 to 1, the points are."""
        return self._moved(np.ascontiguousarray(x, dtype=float)).sides

    def _moved(self, x: FloatArray) -> _Across:
        """What moves across at x."""
        key = x.tobytes()
        if self._kept.get("across_key") != key:
            near = self._at(x)
            q = self._own(x)
            states = self._walked(q, near.along)
            sides = self._nearest_across(x, q, near.along, states)
            middle, edge = (rows._jets_of(states, q, near.along, rows.sides) for rows in self._edges)
            ruling = edge - middle
            for row, length in enumerate(self.lengths[self.segments]):
                for r in range(3):
                    kernels.by_unknowns(ruling[row, r], length)
            free = self._follows & (np.abs(sides) < 1.0)
            self._kept["across"] = _Across(sides, free, ruling[:, :, : 1 + self._parameters])
            self._kept["across_key"] = key
        return self._kept["across"]  # type: ignore[no-any-return]

    def values(self, x: FloatArray) -> FloatArray:
        """Gaps (count,)."""
        return self._placed(np.ascontiguousarray(x, dtype=float)).gap

    def normals(self, x: FloatArray) -> FloatArray:
        """Unit normals (count, 3) of the surface towards the ribbon, where the points are."""
        return self._placed(np.ascontiguousarray(x, dtype=float)).normal

    def points(self, x: FloatArray) -> FloatArray:
        """The points (count, 3) in units of l."""
        own, here = x[self._columns], self._placed(np.ascontiguousarray(x, dtype=float))
        return np.asarray(own[:, :3] + times(here.matrix, self._at(x).jets[:, :, 0]))

    def jacobian(self, x: FloatArray) -> FloatArray:
        """In the order of the structure."""
        here = self._placed(np.ascontiguousarray(x, dtype=float))
        return np.asarray(np.einsum("ka,kac->kc", here.normal, here.slopes).ravel())

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """r, q and what bends the segment by themselves."""
        return _triangle(self._columns)

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray:
        """In the order of the structure."""
        x = np.ascontiguousarray(x, dtype=float)
        here, near = self._placed(x), self._at(x)
        full = here.second
        if self._follows.any():
            moved = self._moved(x)
            crossed = self._crossed(x, here, moved.ruling)
            across = times(here.matrix, moved.ruling[:, :, 0])
            bent = np.einsum("ka,kab,kb->k", across, here.bend, across)
            stiff = np.where(moved.free & (bent > FLAT), 1.0 / np.maximum(bent, FLAT), 0.0)
            full = full - stiff[:, None, None] * crossed[:, :, None] * crossed[:, None, :]
        # g_hc = x_h . B J + n . x_hc, without what v takes of it: the point of contact moves
        along = self._crossed(x, here, near.slopes)
        if self._follows.any():
            first = times(here.matrix, near.slopes[:, :, 0])
            q = self._own(x)
            mixed = self._across_along(self._walked(q, near.along), q, near.along)[1]
            both = np.einsum("ka,kab,kb->k", first, here.bend, across) + np.einsum("ka,ka->k", here.turned, mixed)
            along = along - (stiff * both)[:, None] * crossed
        full = full - near.bent[:, None, None] * along[:, :, None] * along[:, None, :]
        return _triangles(multipliers[:, None, None] * full)

    def _crossed(self, x: FloatArray, here: Placed, way: FloatArray) -> FloatArray:
        """(k, c): derivatives by c = (r, q, z) of the gap's slope along a way y_t (k, 3) in the body, given with its
        own derivatives by z (k, 3, 1 + z)."""
        moved = times(here.matrix, way[:, :, 0])
        found = ((here.bend @ moved[:, :, None])[:, None, :, 0] @ here.slopes)[:, 0]
        q = x[self._columns[:, QUATERNION:OMEGA]]
        found[:, 3:7] += 2.0 * times(form_of(here.normal, way[:, :, 0]), q)
        found[:, 7:] += np.einsum("kb,kbz->kz", here.turned, way[:, :, 1:])
        return np.asarray(found)
