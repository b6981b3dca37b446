"""A developable ribbon's discrete problem, stated again in omega and eta at the joints and its start's place.

Nothing of the solver is used but its answer, read as data: curvatures, clamps, walls, loads. Unknowns u: omega (p + 1),
eta (p + 1), then what no clamp holds of the start (shift (3,), turn (3,)). Functionals of the shape are sums over stops
(joints and places of contact) of C_k : Y_k with Y as in `compare.battery.judge.curve`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.battery.judge.barriers import facing, lowest
from compare.battery.judge.curve import segments
from compare.battery.judge.elastic import elastic

FloatArray = NDArray[np.float64]

#: Distance (l) from a wall, or of |eta'| w / 2 from 1, at which a row counts as touching.
TOUCHING = 1e-6
_SPINS = np.zeros((3, 3, 3))
_SPINS[0, 1, 2], _SPINS[0, 2, 1] = -1.0, 1.0
_SPINS[1, 0, 2], _SPINS[1, 2, 0] = 1.0, -1.0
_SPINS[2, 0, 1], _SPINS[2, 1, 0] = -1.0, 1.0


@dataclass(frozen=True)
class Row:
    """A constraint at one stop: coefficients C (3, 5) and, times eta there, `by_eta` (3, 5); value: of the whole row,
    zero where it is kept; relative: it refers to the start and moves with it; one_sided: its multiplier is a push."""

    stop: int
    coefficients: FloatArray
    value: float
    by_eta: FloatArray | None = None
    relative: bool = False
    one_sided: bool = False


@dataclass(frozen=True)
class Linear:
    """A linear constraint: coefficients (n,) of the unknowns; its value; one_sided as of `Row`."""

    coefficients: FloatArray
    value: float
    one_sided: bool = False


class Discrete:
    """The problem at an equilibrium `found` (`ribbon.Equilibrium`, read as data) with the parameters q (p, 4); places:
    abscissae (k,) that are stops too.

    ValueError where the equilibrium is of a kind that is not restated here (`unknown_kind` says which).
    """

    def __init__(self, found: Any, q: FloatArray | None = None, places: FloatArray | None = None) -> None:
        why = unknown_kind(found)
        if why:
            raise ValueError(why)
        self.found = found
        self.problem = found.problem
        self.strip = self.problem.strip
        self.half_width = 0.5 * self.strip.width / self.strip.length
        self.q = np.asarray(found.parameters if q is None else q, dtype=float)
        self.lengths = np.asarray(self.problem.lengths, dtype=float)
        self.more = np.empty(0) if places is None else np.asarray(places, dtype=float)
        points, frames = found.joints
        self.position, self.frame = points[0], frames[0]
        start = self.problem.start
        held = start is not None and start.position is not None, start is not None and start.holds_frame
        moved = self._stands_somewhere()
        self.shifts, self.turns = moved and not held[0], moved and not held[1]

    def _stands_somewhere(self) -> bool:
        """Whether anything depends on where the ribbon is."""
        p = self.problem
        return bool(p.has_gravity or p.walls or p.tip is not None or p.end is not None or p.start is not None)

    @property
    def places(self) -> int:
        """Unknowns of the start's place."""
        return 3 * (self.shifts + self.turns)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return 2 * (len(self.lengths) + 1) + self.places

    # -- segments, split where something touches between joints -------------------------------------------------------

    @cached_property
    def joints(self) -> FloatArray:
        """Abscissae of the segments' ends (p + 1,)."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @cached_property
    def stops(self) -> FloatArray:
        """Abscissae at which rows may stand: the joints, and contacts between them."""
        touched = np.concatenate([self.more, *(np.asarray(w.contacts, dtype=float) for w in self.found.walls)])
        new: list[float] = []
        for s in touched:
            if np.abs(np.append(self.joints, new) - s).min() > 1e-9:
                new.append(float(s))
        return np.sort(np.concatenate([self.joints, new]))

    def by_place(self, s: float, v: float, force: FloatArray) -> FloatArray:
        """Work (n,) of a force (3,) at the place v across (l) of the ruling at a stop s, by the unknowns."""
        stop = int(np.argmin(np.abs(self.stops - s)))
        unit, eta = np.eye(5), self._eta(stop)
        by_eta = np.outer(force, v * unit[2])
        c = np.outer(force, unit[3] + v * unit[0]) + eta * by_eta
        return np.asarray(self._first([Row(stop, c, 0.0, by_eta=by_eta)])[0])

    @cached_property
    def _pieces(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Parameters (k, 4) and lengths (k,) of the pieces between stops, and the map (k, 4, n) from the unknowns."""
        lengths = np.diff(self.stops)
        middle = self.stops[:-1] + 0.5 * lengths
        own = np.clip(np.searchsorted(self.joints, middle) - 1, 0, len(self.lengths) - 1)
        offset = self.stops[:-1] - self.joints[own]
        q = self.q[own].copy()
        q[:, 1] += q[:, 0] * offset
        q[:, 3] += q[:, 2] * offset
        by = np.zeros((len(own), 4, self.size))
        k, p1 = np.arange(len(own)), len(self.lengths) + 1
        for field, first in ((0, 0), (2, p1)):
            inverse = 1.0 / self.lengths[own]
            by[k, field, first + own], by[k, field, first + own + 1] = -inverse, inverse
            by[k, field + 1] = offset[:, None] * by[k, field]
            by[k, field + 1, first + own] += 1.0
        return q, lengths, by

    def eta_at(self, stop: int) -> FloatArray:
        """eta at a stop by the unknowns, (n,)."""
        _, lengths, by = self._pieces
        if stop < len(lengths):
            return np.asarray(by[stop, 3])
        return np.asarray(by[-1, 3] + lengths[-1] * by[-1, 2])

    def _eta(self, stop: int) -> float:
        q, lengths, _ = self._pieces
        return float(q[stop, 3] if stop < len(lengths) else q[-1, 3] + lengths[-1] * q[-1, 2])

    # -- rows ---------------------------------------------------------------------------------------------------------

    @cached_property
    def states(self) -> FloatArray:
        """Y (k + 1, 3, 5) at the stops."""
        found = [np.column_stack([self.frame, self.position, np.zeros(3)])]
        for matrix in self._matrices.matrix:
            found.append(found[-1] @ matrix)
        return np.array(found)

    @cached_property
    def _matrices(self) -> Any:
        q, lengths, _ = self._pieces
        return segments(q, lengths)

    @cached_property
    def rows(self) -> list[Row]:
        """Rows of clamps, closures and walls; of walls only those that touch."""
        last, unit, end = len(self.stops) - 1, np.eye(5)[3], self.problem.end
        length = self.strip.length
        found: list[Row] = []
        if end is not None and end.position is not None:
            where = np.asarray(end.position) / length
            found += [
                Row(last, np.outer(axis, unit), float(axis @ (self.states[last, :, 3] - where))) for axis in np.eye(3)
            ]
        if end is not None and end.holds_frame:
            found += self._turned(last, np.asarray(end.frame), relative=False)
        if self.problem.closure is not None:
            seam = np.diag([1.0, 1.0, 1.0] if self.problem.closure.sign > 0 else [-1.0, -1.0, 1.0])
            apart = self.states[last, :, 3] - self.position
            found += [Row(last, np.outer(axis, unit), float(axis @ apart), relative=True) for axis in self.frame.T]
            found += self._turned(last, self.frame @ seam, relative=True)
        for number, wall in enumerate(self.problem.walls):
            for stop in range(len(self.stops)):
                middle = self.states[stop, :, 3]
                ruling = self.states[stop, :, 0] + self._eta(stop) * self.states[stop, :, 2]
                across = (*lowest(wall, middle, self.half_width * ruling, length), *self._told(number, stop))
                for side in self.half_width * np.array(across):
                    gaps, normals = facing(wall, (middle + side * ruling)[None, :], length)
                    gap, normal = float(gaps[0]), normals[0]
                    by_eta = np.outer(normal, side * np.eye(5)[2])
                    c = np.outer(normal, unit + side * np.eye(5)[0]) + self._eta(stop) * by_eta
                    if gap < TOUCHING:
                        found.append(Row(stop, c, gap, by_eta=by_eta, one_sided=True))
        return found

    def _told(self, wall: int, stop: int) -> tuple[float, ...]:
        """Where across (-1 to 1) an obstacle is told to push between the edges at a stop: a line of contact on a face
        ends there, and no least gap tells."""
        if len(self.found.walls) != len(self.problem.walls):
            return ()
        ends = np.asarray(self.found.walls[wall].ends, dtype=float).reshape(-1, 2)
        own = ends[np.abs(ends[:, 0] - self.stops[stop]) < 1e-9, 1] / self.half_width
        return tuple(float(side) for side in own if abs(side) < 1.0 - 1e-9)

    def _turned(self, stop: int, target: FloatArray, relative: bool) -> list[Row]:
        """Three rows: the skew part of target^T R."""
        found = []
        for i, j in ((2, 1), (0, 2), (1, 0)):
            c = np.zeros((3, 5))
            c[:, j], c[:, i] = 0.5 * target[:, i], -0.5 * target[:, j]
            found.append(Row(stop, c, float((c * self.states[stop]).sum()), relative=relative))
        return found

    @cached_property
    def gauge(self) -> FloatArray:
        """(k, n): what holds a motion along itself that changes nothing but where segments end on the shape. A
        weightless Moebius band, flat and free in space, may slide along its seam; the ruling that is straight stays in
        the middle of its first segment."""
        closure, p = self.problem.closure, self.problem
        flat = not np.any(np.abs(np.asarray(p.strip.natural_curvature, dtype=float)) > 0.0)
        slides = closure is not None and closure.sign < 0 and closure.ruling == "free" and p.start is None
        if not (slides and flat and not p.walls and p.gravity is None):
            return np.zeros((0, self.size))
        row = np.zeros((1, self.size))
        row[0, len(self.lengths) + 1 : len(self.lengths) + 3] = 1.0
        return row

    @cached_property
    def linear(self) -> list[Linear]:
        """Straight rulings at clamps and seams, equal ends of a band, rulings that nearly cross."""
        p1, n = len(self.lengths) + 1, self.size
        omega, eta = self._values
        found = []
        closure = self.problem.closure
        for clamp, joint in ((self.problem.start, 0), (self.problem.end, p1 - 1)):
            if clamp is not None and clamp.ruling == "straight":
                found.append(Linear(np.eye(n)[p1 + joint], eta[joint]))
        if closure is not None:
            for first, values in ((0, omega), (p1, eta)):
                row = np.eye(n)[first + p1 - 1] - closure.sign * np.eye(n)[first]
                found.append(Linear(row, values[-1] - closure.sign * values[0]))
            if closure.ruling == "straight":
                found.append(Linear(np.eye(n)[p1], eta[0]))
        for i in np.flatnonzero(np.abs(self.q[:, 2]) * self.half_width > 1.0 - 1e-7):
            row = (np.eye(n)[p1 + i + 1] - np.eye(n)[p1 + i]) / self.lengths[i] * self.half_width
            side = -np.sign(self.q[i, 2])
            found.append(Linear(side * row, side * self.q[i, 2] * self.half_width + 1.0, one_sided=True))
        return found

    @property
    def _values(self) -> tuple[FloatArray, FloatArray]:
        """omega and eta (p + 1,) at the joints."""
        last = self.q[-1]
        omega = np.append(self.q[:, 1], last[1] + last[0] * self.lengths[-1])
        return omega, np.append(self.q[:, 3], last[3] + last[2] * self.lengths[-1])

    @property
    def jumps(self) -> float:
        """Largest jump of omega or eta from one segment to the next."""
        ends = self.q[:-1, [1, 3]] + self.q[:-1, [0, 2]] * self.lengths[:-1, None]
        return float(np.abs(ends - self.q[1:, [1, 3]]).max(initial=0.0))

    # -- energy, first and second derivatives -------------------------------------------------------------------------

    @cached_property
    def load(self) -> FloatArray:
        """Coefficients (3, 5) of weight and end force at the last stop."""
        c = np.zeros((3, 5))
        if self.problem.has_gravity:
            c[:, 4] += self.strip.gamma * np.asarray(self.problem.gravity.up)
        if self.problem.tip is not None:
            c[:, 3] -= np.asarray(self.problem.tip)
        return c

    @cached_property
    def elastic(self) -> Any:
        """The elastic energy with derivatives by the segments' parameters (`compare.battery.judge.elastic.Elastic`)."""
        width, poisson = 2.0 * self.half_width, self.strip.poisson
        q, lengths = self.q, self.lengths
        return elastic(q, lengths, self.problem.energy, width, poisson, self.strip.curvature)

    @property
    def energy(self) -> float:
        """Elastic energy without the constant of the natural curvature, weight and end force (D w / l)."""
        return float(self.elastic.value + (self.load * self.states[-1]).sum())

    @cached_property
    def by_joints(self) -> FloatArray:
        """Parameters of the segments by the unknowns, (p, 4, n)."""
        p1, p = len(self.lengths) + 1, len(self.lengths)
        k = np.arange(p)
        by = np.zeros((p, 4, self.size))
        for field, first in ((0, 0), (2, p1)):
            by[k, field, first + k], by[k, field, first + k + 1] = -1.0 / self.lengths, 1.0 / self.lengths
            by[k, field + 1, first + k] = 1.0
        return by

    @cached_property
    def _placed(self) -> tuple[FloatArray, FloatArray]:
        """Y at s = 0 by the start's place: first (m, 3, 5) and second (m, m, 3, 5) derivatives."""
        first, second = np.zeros((self.places, 3, 5)), np.zeros((self.places, self.places, 3, 5))
        if self.shifts:
            first[:3, :, 3] = np.eye(3)
        if self.turns:
            k = 3 * self.shifts
            first[k:, :, :3] = _SPINS @ self.frame
            both = np.einsum("aij,bjk,kl->abil", _SPINS, _SPINS, self.frame)
            second[k:, k:, :, :3] = 0.5 * (both + both.swapaxes(0, 1))
        return first, second

    @cached_property
    def gradient(self) -> FloatArray:
        """Of the energy, (n,)."""
        own = np.einsum("pk,pkn->n", self.elastic.gradient, self.by_joints)
        load = Row(len(self.stops) - 1, self.load, 0.0)
        return np.asarray(own + self._first([load])[0])

    @cached_property
    def jacobian(self) -> FloatArray:
        """Of rows and linear rows, (m, n)."""
        curved = self._first(self.rows)
        return np.concatenate([curved, np.array([row.coefficients for row in self.linear]).reshape(-1, self.size)])

    @property
    def one_sided(self) -> NDArray[np.bool_]:
        """Which rows are, (m,)."""
        sides = [row.one_sided for row in self.rows] + [row.one_sided for row in self.linear]
        return np.array(sides, dtype=np.bool_)

    @property
    def missed(self) -> float:
        """Largest violation of what is held (l, rad)."""
        rows = [abs(row.value) for row in self.rows if not row.one_sided]
        return max(rows + [abs(row.value) for row in self.linear if not row.one_sided], default=0.0)

    def _first(self, rows: list[Row]) -> FloatArray:
        """Derivatives (m, n) of rows by the unknowns."""
        found = np.zeros((len(rows), self.size))
        by = self._pieces[2]
        for stop, moved in self._moved({row.stop for row in rows}):
            for k, row in enumerate(rows):
                if row.stop != stop:
                    continue
                slopes = np.einsum("ab,nab->n", row.coefficients, moved)
                placed, local = slopes[: self.places], slopes[self.places :]
                found[k] = local @ by[:stop].reshape(-1, self.size)
                if not row.relative and self.places:
                    found[k, -self.places :] += placed
                if row.by_eta is not None:
                    found[k] += (row.by_eta * self.states[stop]).sum() * self.eta_at(stop)
        return found

    def _moved(self, stops: set[int]) -> Any:
        """(stop, dY (m + 4 stop, 3, 5) there by the start's place and by the parameters of the pieces before)."""
        moved = self._placed[0]
        if 0 in stops:
            yield 0, moved
        for j, (matrix, first) in enumerate(zip(self._matrices.matrix, self._matrices.first, strict=True)):
            moved = np.concatenate([moved @ matrix, self.states[j] @ first])
            if j + 1 in stops:
                yield j + 1, moved

    def hessian(self, multipliers: FloatArray) -> FloatArray:
        """Of the energy plus rows times `multipliers` (m,) (those of linear rows do not matter), (n, n)."""
        n, by = self.size, self._pieces[2]
        own = np.einsum("pkl,pkn,plm->nm", self.elastic.hessian, self.by_joints, self.by_joints, optimize=True)
        at = np.zeros((2, len(self.stops), 3, 5))  # coefficients at every stop: absolute, and of all
        at[:, -1] += self.load
        for row, force in zip(self.rows, multipliers, strict=False):
            at[1, row.stop] += force * row.coefficients
            if not row.relative:
                at[0, row.stop] += force * row.coefficients
        right = np.zeros((2, len(self.stops), 5, 3))
        right[:, -1] = at[:, -1].swapaxes(-1, -2)
        for j in range(len(self.stops) - 2, -1, -1):
            right[:, j] = at[:, j].swapaxes(-1, -2) + self._matrices.matrix[j] @ right[:, j + 1]
        m = self.places
        local = np.zeros((m + by.shape[0] * 4,) * 2)
        if m:
            local[:m, :m] = np.einsum("xyab,ba->xy", self._placed[1], right[0, 0])
        moved = self._placed[0]
        for j, matrix in enumerate(self._matrices.matrix):
            first, second = self._matrices.first[j], self._matrices.second[j]
            here = slice(m + 4 * j, m + 4 * j + 4)
            mixed = np.einsum("nab,xba->nx", moved, first @ right[1, j + 1])
            if m:
                mixed[:m] = np.einsum("nab,xba->nx", moved[:m], first @ right[0, j + 1])
            local[: here.start, here] = mixed
            local[here, : here.start] = mixed.T
            local[here, here] = np.einsum("ab,xybc,ca->xy", self.states[j], second, right[1, j + 1])
            moved = np.concatenate([moved @ matrix, self.states[j] @ first])
        chain = np.zeros((local.shape[0], n))
        if m:
            chain[:m, n - m :] = np.eye(m)
        chain[m:] = by.reshape(-1, n)
        total = own + chain.T @ local @ chain
        for row, force in zip(self.rows, multipliers, strict=False):
            if row.by_eta is not None and force:
                bare = Row(row.stop, row.by_eta, 0.0, relative=row.relative)
                cross = force * np.outer(self._first([bare])[0], self.eta_at(row.stop))
                total += cross + cross.T
        return np.asarray(0.5 * (total + total.T))

    @cached_property
    def metric(self) -> FloatArray:
        """int (domega^2 + deta^2) ds, and one for every unknown of the start's place, (n, n)."""
        p1 = len(self.lengths) + 1
        mass = np.zeros((p1, p1))
        for i, length in enumerate(self.lengths):
            mass[i : i + 2, i : i + 2] += length / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
        whole = np.eye(self.size)
        whole[:p1, :p1], whole[p1 : 2 * p1, p1 : 2 * p1] = mass, mass
        return whole


def unknown_kind(found: Any) -> str:
    """Why an equilibrium is not restated here; "" where it is."""
    problem = found.problem
    if problem.energy not in ("sadowsky", "wunderlich"):
        return f'the energy "{problem.energy}" is not restated here'
    if problem.gravity is not None and problem.gravity.exact:
        return "the weight of the surface is not restated here"
    if any(wall.stiffness is not None for wall in problem.walls):
        return "pressure plates are not restated here"
    return ""
