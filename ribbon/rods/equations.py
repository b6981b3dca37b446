"""Equilibria of a curve-angle rod over one parameter as one square system: what a branch is followed of.

z = (positions and angles that nothing holds, multipliers of the rows)::

    G = ( grad E + A^T y , c )        K = [ H  A^T ; A  0 ]

(docs/theory.md, eq. (11.1)), H the exact second derivative, y the tensions and what slides (`CurveAngle`). As many
eigenvalues as K has below zero beyond the number of rows are unstable modes (Nocedal and Wright 2006, theorem 16.3).
The reference frames stay while a branch is followed, and are told anew at the shape where an edge has turned far.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ribbon.rods import layers
from ribbon.rods.curve_angle import Anchors, CurveAngle
from ribbon.rods.result import RodShape
from ribbon.rods.rod import FloatArray, Rod
from ribbon.rods.solve import Found, multipliers, rounding, size_of_forces
from ribbon.rods.start import from_frames
from ribbon.solvers.frontal import Factored, Pattern

BoolArray = NDArray[np.bool_]
#: t, without unit -> the rod there, of edges of these lengths (n,).
RodAt = Callable[[float, FloatArray], Rod]

#: Step in t by which G is differenced.
_STEP = 1e-4
#: Cosine of the turn of an edge from its reference tangent below which the frames are told anew.
_FAR = 0.5
#: Weight of an angle (rad) beside a position (l) in the metric; size of G that counts as one of rounding.
_ANGLE, _ROUNDED = 0.1, 1e-10
_KEPT = 12
#: Root of the energy's relative error from which edges move, and the part of it that is worth it; above which a point
#: is not resolved: edges are of second order.
FITTED, WORTH, RESOLVED = 2e-2, 0.5, 2e-1


@dataclass(frozen=True)
class Equations:
    """rod_at: the rod over t, held alike at every t; lengths (n,) of its edges; anchors: of its angles; free (4 n +
    3,): unknowns that nothing holds."""

    rod_at: RodAt
    lengths: FloatArray
    anchors: Anchors
    free: BoolArray

    @classmethod
    def of(cls, rod_at: RodAt, found: Found) -> tuple[Equations, FloatArray]:
        """The system around an equilibrium, and its z."""
        lower, upper = found.problem.bounds()
        system = cls(rod_at, found.problem.rod.lengths, found.problem.anchors, lower < upper)
        return system, np.concatenate([found.y[system.free], found.rows])

    @cached_property
    def _problems(self) -> dict[float, CurveAngle]:
        return {}

    def problem(self, t: float) -> CurveAngle:
        """The rod at t, its ends' reference frames where it is held there."""
        if t not in self._problems:
            rod = self.rod_at(t, self.lengths)
            frames = self.anchors.frames.copy()
            for at, end in ((0, rod.start.frame), (-1, rod.end.frame)):
                if end is not None:
                    frames[at] = end
            while len(self._problems) >= _KEPT:
                self._problems.pop(next(iter(self._problems)))
            self._problems[t] = CurveAngle(rod, Anchors(frames, self.anchors.twists))
        return self._problems[t]

    @cached_property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.problem(0.0).constraint_bounds()[0].size)

    @property
    def size(self) -> int:
        """Unknowns and rows."""
        return int(self.free.sum()) + self.rows

    def whole(self, z: FloatArray, t: float) -> tuple[FloatArray, FloatArray]:
        """All unknowns (4 n + 3,) and multipliers."""
        y = self.problem(t).bounds()[0].copy()
        y[self.free] = z[: z.size - self.rows]
        return y, z[z.size - self.rows :]

    def residual(self, z: FloatArray, t: float) -> FloatArray:
        """G (n,); nan where the scene cannot be."""
        try:
            problem = self.problem(t)
        except ValueError:
            return np.full(self.size, np.nan)
        y, rows = self.whole(z, t)
        left = problem.gradient(y) + problem.jacobian_matrix(y).T @ rows
        return np.concatenate([left[self.free], problem.constraints(y)])

    def norm(self, residual: FloatArray) -> float:
        """Forces over their size and what rounding leaves of them, or lengths that are missed."""
        if not np.all(np.isfinite(residual)):
            return float("nan")
        problem = self.problem(0.0)
        size = size_of_forces(problem)
        noise = max(1.0, rounding(problem) / size / _ROUNDED)
        forces, missed = residual[: residual.size - self.rows], residual[residual.size - self.rows :]
        return max(float(np.abs(forces).max()) / size / noise, float(np.abs(missed).max(initial=0.0)))

    def rate(self, z: FloatArray, t: float) -> FloatArray:
        """dG/dt by central differences, from one side where there is no rod on the other."""
        after, before = self.residual(z, t + _STEP), self.residual(z, t - _STEP)
        if np.all(np.isfinite(after)) and np.all(np.isfinite(before)):
            return (after - before) / (2.0 * _STEP)
        side = _STEP if np.all(np.isfinite(after)) else -_STEP
        near, far = self.residual(z, t + side), self.residual(z, t + 2.0 * side)
        return (4.0 * near - 3.0 * self.residual(z, t) - far) / (2.0 * side)

    @cached_property
    def _pattern(self) -> Pattern:
        problem = self.problem(0.0)
        place = np.where(self.free, np.cumsum(self.free) - 1, -1)
        count = int(self.free.sum())
        row, column = problem.hessian_structure()
        condition, unknown = problem.jacobian_structure()
        last = problem.rod.edges
        groups = np.concatenate([np.arange(self.free.size)[self.free] // 4, np.minimum(np.arange(self.rows) + 1, last)])
        return Pattern(
            np.concatenate([place[row], count + condition]), np.concatenate([place[column], place[unknown]]),
            groups.astype(np.int64),
        )  # fmt: skip

    def factor(self, z: FloatArray, t: float) -> Factored | None:
        """K, factored along the rod; rows that repeat one another (a straight rod between two clamps) are softened."""
        problem = self.problem(t)
        y, rows = self.whole(z, t)
        values = np.concatenate([problem.hessian(y, rows), problem.jacobian(y)])
        found = self._pattern.factor(values)
        if found.finite and found.negative + found.zero < self.rows:
            found = self._pattern.factor(values, soft=int(self.free.sum()) + np.arange(self.rows))
        return Factored(found, self.rows) if found.finite else None

    @cached_property
    def _weights(self) -> FloatArray:
        rod = self.problem(0.0).rod
        weights = np.zeros((rod.edges + 1, 4))
        weights[:, :3] = rod.cells[:, None]
        weights[:-1, 3] = _ANGLE * rod.lengths
        return np.concatenate([weights.reshape(-1)[:-1][self.free], np.zeros(self.rows)])

    def mass(self, v: FloatArray) -> FloatArray:
        """M v (n,): int |dr|^2 + a little of the angles'."""
        return self._weights * v

    def stepped(self, z: FloatArray, dz: FloatArray) -> FloatArray:
        """z + dz."""
        return z + dz

    def moved(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Equations, FloatArray, FloatArray]:
        """As many edges where the rod is pulled into layers (`ribbon.rods.layers`); or the same edges with their
        reference frames told anew where one has turned far from its own: z is the same there."""
        coarse = self.shape(z, t, 0.0)
        before = layers.missed(coarse)
        if before > FITTED:
            lengths = layers.fitted(coarse)
            if layers.missed(coarse, lengths) < WORTH * before:
                return self._carried(lengths, coarse, t, directions)
        y, _ = self.whole(z, t)
        turned = np.einsum("ij,ij->i", self.problem(t).tangents(y), self.anchors.frames[1:-1, :, 2])
        if float(turned.min()) > _FAR:
            return self, z, directions
        return replace(self, anchors=self.problem(t).anchored(y).anchors), z, directions

    def resolved(self, z: FloatArray, t: float) -> bool:
        """Whether its edges resolve the layers of a rod that is pulled."""
        return layers.missed(self.shape(z, t, 0.0)) <= RESOLVED

    def shape(self, z: FloatArray, t: float, norm: float) -> RodShape:
        """The rod at a point, seen from where it is solved."""
        y, rows = self.whole(z, t)
        problem = self.problem(t).anchored(y)
        return RodShape(Found(problem, y, rows, norm, 0, True, "on a branch", 0.0))

    def finer(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Equations, FloatArray, FloatArray]:
        """Every edge cut in two."""
        return self._carried(np.repeat(0.5 * self.lengths, 2), self.shape(z, t, 0.0), t, directions)

    def _carried(
        self, lengths: FloatArray, coarse: RodShape, t: float, directions: FloatArray
    ) -> tuple[Equations, FloatArray, FloatArray]:
        """The system of edges of these lengths, with vertices on the spline through those of the shape."""
        rod = self.rod_at(t, lengths)
        s = rod.vertices
        middle = 0.5 * (s[1:] + s[:-1])
        turn = 0.5 * float(coarse.problem.evaluated(coarse.found.y).strain[-1, 2])
        problem, y = from_frames(rod, coarse.centreline(s), coarse.frames(middle), turn)
        lower, upper = problem.bounds()
        new = Equations(self.rod_at, lengths, problem.anchors, lower < upper)
        wide = np.zeros((y.size, directions.shape[1]))
        here = coarse.rod.vertices
        edge = np.clip(np.searchsorted(here, middle) - 1, 0, here.size - 2)
        for k in range(directions.shape[1]):
            v = np.zeros(self.free.size)
            v[self.free] = directions[: self.size - self.rows, k]
            for i in range(3):
                wide[i::4, k] = np.interp(s, here, v[i::4])
            wide[3::4, k] = v[3::4][edge]
        carried = np.concatenate([wide[new.free], np.zeros((new.rows, directions.shape[1]))])
        return new, np.concatenate([y[new.free], multipliers(problem, y)]), carried

    def energy(self, z: FloatArray, t: float) -> float:
        """Elastic, of bending against rest, and of the dead forces, D w / l, seen from where the rod is solved."""
        return self.problem(t).value(self.whole(z, t)[0])
