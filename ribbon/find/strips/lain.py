r"""Strips that lie along each other, found on what joins and holds them, with all stations as inequalities.

With all equations c(x) = 0 of the problem met (glue, clamps, joints), Z (n, k) an orthonormal base of the moves that
keep them, and g_i >= 0 the rows of stations and walls, each step solves (docs/theory.md, eq. (5.25))::

    min 1/2 z Z^T H Z z + (Z^T E_x) z ,   g_x Z z + g >= 0 ,    H = E_xx + sum_j lambda_j c_j,xx - sum_i mu_i g_i,xx

goes downhill in energy and what is left of gaps (an exact penalty; J. Nocedal and S. Wright, Numerical Optimization,
2nd ed., Springer 2006, chapter 18), and moves no place by more than half the reach: strips are seen before they are
met. Between steps c = 0 is met again by the least change. Rows that repeat each other (faces that lie on each other
have more stations than the strips have moves there) are no matter to the steps, and of their pushes those are told that
balance with the fewest places.
"""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.find import contacts
from ribbon.find.layers import quadratic
from ribbon.find.strips import facing, touch, walls
from ribbon.find.strips.facing import Station
from ribbon.problems.strips.between import Touching
from ribbon.problems.strips.problem import StripsProblem
from ribbon.problems.touching import Touch
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import NEWTON, Minimum, force_scale, kkt_residual

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Key = Station | int

#: Steps of a search, halvings of one, rounds of stations put between.
_STEPS, _HALVINGS, _BETWEEN = 300, 14, 25
#: Gap (l_0) up to which a station has its row.
_REACH = 0.04
#: What is left of the equations over their unit, and of gaps (l_0, rounded by 1e-14 over what is kept), where it is
#: found; of c.
_LEFT, _CLOSED, _MET = 1e-10, 1e-10, 1e-13
#: Steps that put c right, and how often they may not make it less.
_RIGHT = 12
#: The first shift of H in the metric of all strips.
_SHIFT = 0.1
#: The most (over what is left of the equations) of the metric that is added to H at every step.
_DAMPED = 0.1
#: Gap (l_0) up to which a row may push, and part of the largest push from which it is told.
_TOUCHES, _CLEARLY = 1e-9, 1e-9
_DONE = "Newton's iteration on stations converged."


@dataclass(frozen=True)
class _Rows:
    """Rows g (k,) >= 0 at x of a problem with its stations: values, the problem's rows that they are, with which sign,
    and what each is known by."""

    problem: StripsProblem
    x: FloatArray
    which: IntArray
    sign: FloatArray
    value: FloatArray
    keys: tuple[Key, ...]

    def jacobian(self, free: NDArray[np.bool_]) -> FloatArray:
        """g_x (k, free ones)."""
        found = self.problem.jacobian_matrix(self.x)[self.which][:, free]
        return np.asarray(self.sign[:, None] * found.toarray())


class _Moves:
    """The moves that keep c = 0 at x, by strips that hang together: Z, and what puts c right."""

    def __init__(self, problem: StripsProblem, x: FloatArray, equal: IntArray, free: NDArray[np.bool_]) -> None:
        matrix = problem.jacobian_matrix(x)[equal][:, free].tocsr()
        m, n = matrix.shape
        graph = scipy.sparse.bmat([[None, matrix != 0], [(matrix != 0).T, None]], format="csr")
        count, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
        self._blocks = []
        base: list[FloatArray] = []
        self._m, self._n = m, n
        for k in range(count):
            rows, columns = np.flatnonzero(label[:m] == k), np.flatnonzero(label[m:] == k)
            if not columns.size:
                continue
            q, r, order = scipy.linalg.qr(matrix[rows][:, columns].toarray().T, pivoting=True)
            size = np.abs(np.diag(r))
            rank = int((size > 1e-11 * size.max(initial=1e-300)).sum())
            self._blocks.append((rows[order[:rank]], columns, q[:, :rank], r[:rank, :rank]))
            part = np.zeros((n, columns.size - rank))
            part[columns] = q[:, rank:]
            base.append(part)
        self.z = np.hstack(base)

    def right(self, c: FloatArray) -> FloatArray:
        """The least change (free ones,) that makes c (equal ones,) zero to first order."""
        out = np.zeros(self._n)
        for rows, columns, q, r in self._blocks:
            out[columns] = q @ scipy.linalg.solve_triangular(r, -c[rows], trans="T")
        return out

    def multipliers(self, slope: FloatArray) -> FloatArray:
        """lambda (equal ones,) with slope + c_x^T lambda = 0 as nearly as may be."""
        out = np.zeros(self._m)
        for rows, columns, q, r in self._blocks:
            out[rows] = scipy.linalg.solve_triangular(r, -q.T @ slope[columns])
        return out


@dataclass(frozen=True)
class _Lain:
    """Where a search ended: rows, pushes (k,), steps, and whether nothing is left."""

    rows: _Rows
    pushes: FloatArray
    steps: int
    found: bool


class _Search:
    """Of one problem and its stations."""

    def __init__(self, problem: StripsProblem, stations: list[Station], metric: scipy.sparse.csr_matrix) -> None:
        self.problem, self._stations, self._metric = problem.with_changes(touching=()), stations, metric
        lower, upper = problem.bounds()
        self.free = lower < upper
        below, above = self.problem.constraint_bounds()
        self.equal = np.flatnonzero(below == above)
        self.one_sided = np.flatnonzero(below < above)
        self._target, self._below, self._above = np.where(below == above, below, 0.0), below, above
        self._travel = self.problem.limits(0.5 * _REACH)[self.free]

    def settle(self, x: FloatArray, known: dict[Key, float], tolerance: float) -> _Lain:
        """The equilibrium downhill of x (n,), whose rows push by `known` to begin with."""
        moves = self.moves(x)
        now = self._seen(self._met(x, moves))
        own = _given(now, known)
        for count in range(_STEPS + 1):
            moves = self.moves(now.x)
            slope = self.problem.gradient(now.x)[self.free]
            jacobian = now.jacobian(self.free)
            reduced = jacobian @ moves.z
            left = float(np.abs(slope @ moves.z - reduced.T @ own).max(initial=0.0))
            found = left <= tolerance and _closed(now.value, own)
            if found or count == _STEPS or spent():
                break
            moved = self._step(now, moves, slope, jacobian, reduced, own)
            if moved is None:
                break
            now, own = moved
        return _Lain(now, own, count, found)

    def multipliers(self, now: _Rows, own: FloatArray) -> FloatArray:
        """Those of all rows of the problem with its stations."""
        moves = self.moves(now.x)
        slope = self.problem.gradient(now.x)[self.free]
        return self._all(now, moves, slope - now.jacobian(self.free).T @ own, own)

    def _all(self, now: _Rows, moves: _Moves, slope: FloatArray, own: FloatArray) -> FloatArray:
        found = np.zeros(now.problem.row_count)
        found[self.equal] = moves.multipliers(slope)
        found[now.which] = -now.sign * own
        return found

    def moves(self, x: FloatArray) -> _Moves:
        return _Moves(self.problem, x, self.equal, self.free)

    def _misses(self, x: FloatArray) -> FloatArray:
        return np.asarray((self.problem.constraints(x) - self._target)[self.equal])

    def _met(self, x: FloatArray, moves: _Moves) -> FloatArray:
        """x with c = 0 met by the least change; as near as it comes."""
        x = x.copy()
        c = self._misses(x)
        for _ in range(_RIGHT):
            size = float(np.abs(c).max(initial=0.0))
            if size <= _MET:
                break
            tried = x.copy()
            tried[self.free] += moves.right(c)
            again = self._misses(tried)
            if not float(np.abs(again).max(initial=0.0)) < size:
                break
            x, c = tried, again
        return x

    def _seen(self, x: FloatArray) -> _Rows:
        kept, touching = facing.faced(self.problem, x, self._stations, _REACH)
        full = self.problem.with_changes(touching=tuple(touching))
        c = full.constraints(x)
        one = self.one_sided
        from_below = np.isfinite(self._below[one])
        sign = np.concatenate([np.where(from_below, 1.0, -1.0), np.ones(len(kept))])
        bound = np.where(from_below, self._below[one], self._above[one])
        which = np.concatenate([one, np.arange(c.size - len(kept), c.size)])
        value = sign * (c[which] - np.concatenate([bound, np.zeros(len(kept))]))
        return _Rows(full, x, which, sign, value, (*(int(k) for k in one), *kept))

    def _merit(self, now: _Rows, penalty: float) -> float:
        return self.problem.value(now.x) - penalty * float(np.minimum(now.value, 0.0).sum())

    def _step(
        self, now: _Rows, moves: _Moves, slope: FloatArray, jacobian: FloatArray, reduced: FloatArray, own: FloatArray
    ) -> tuple[_Rows, FloatArray] | None:
        """What is seen and pushes after a step; None: none goes downhill."""
        rows = self._all(now, moves, slope - jacobian.T @ own, own)
        inner = now.problem.hessian_matrix(now.x, rows)[self.free][:, self.free]
        hessian = moves.z.T @ (inner @ moves.z)
        held = np.flatnonzero(own > 0.0)
        left = float(np.abs(slope @ moves.z - reduced.T @ own).max(initial=0.0))
        mass = moves.z.T @ (self._metric[self.free][:, self.free] @ moves.z)
        hessian = 0.5 * (hessian + hessian.T) + min(_DAMPED, left) * mass  # rulings of what is straight move nothing
        try:
            factor, added = quadratic.positive(hessian, reduced[held], mass, _SHIFT)
        except np.linalg.LinAlgError:
            return None
        gradient = slope @ moves.z
        if added:
            gradient = gradient + added * reduced[held].T @ now.value[held]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", scipy.linalg.LinAlgWarning)  # rows repeat each other
            step, fresh = quadratic.least(factor, gradient, reduced, now.value, own > 0.0)
        if added:
            fresh[held] = np.maximum(fresh[held] - added * (reduced[held] @ step + now.value[held]), 0.0)
        move = moves.z @ step
        size = min(1.0, float((self._travel / np.maximum(np.abs(move), 1e-300)).min()))
        penalty = 2.0 * max(float(fresh.max(initial=0.0)), 1.0)
        before = self._merit(now, penalty)
        rate = float(slope @ move) + penalty * float(np.minimum(now.value, 0.0).sum())
        for _ in range(_HALVINGS):
            x = now.x.copy()
            x[self.free] += size * move
            x = self._met(x, moves)
            if np.abs(self._misses(x)).max(initial=0.0) <= 1e-10:
                after = self._seen(x)
                if self._merit(after, penalty) <= before + min(1e-4 * size * rate, 0.0) + 1e-12 * max(1.0, abs(before)):
                    mixed = own + size * (fresh - own)
                    return after, _given(after, dict(zip(now.keys, mixed.tolist(), strict=True)))
            size *= 0.5
        return None


def _closed(value: FloatArray, pushes: FloatArray) -> bool:
    """Whether nothing is too near, nothing pulls, and what pushes touches."""
    off = np.abs(np.where(pushes > 0.0, value, np.minimum(value, 0.0)))
    return bool(off.max(initial=0.0) <= _CLOSED and pushes.min(initial=0.0) >= 0.0)


def _given(now: _Rows, known: dict[Key, float]) -> FloatArray:
    """Pushes (k,) of rows, those known of the same ones."""
    return np.array([known.get(key, 0.0) for key in now.keys])


def lain(
    problem: StripsProblem, x: FloatArray, metric: scipy.sparse.csr_matrix
) -> tuple[StripsProblem, Minimum] | None:
    """The problem with the stations that push and its equilibrium downhill of the unknowns x (n,), nowhere nearer than
    strips are kept, nor behind walls; None: no strips lie along each other, or none is found. metric (n, n): of all
    strips, by which H is shifted."""
    pairs = facing.along(problem, x) or _held_pairs(problem)
    if not pairs:
        return None
    clock, steps = time.perf_counter(), 0
    stations = facing.stations(problem, pairs)
    known: dict[Key, float] = {}
    for _ in range(_BETWEEN):
        search = _Search(problem, stations, metric)
        found = search.settle(x, known, _LEFT * force_scale(problem))
        steps += found.steps
        if not found.found or spent():
            return None
        x = found.rows.x
        deep, lines = _deep(search.problem, x, pairs)
        more = facing.deeper(problem, deep, lines, stations)
        behind = _behind(search.problem, x)
        if not more and not any(behind):
            return _told(search, found, steps, time.perf_counter() - clock)
        stations = stations + more
        problem = search.problem.with_parts(
            [{"touching": (*part.touching, *own)} for part, own in zip(search.problem.parts, behind, strict=True)]
        )
        known = {key: push for key, push in zip(found.rows.keys, found.pushes, strict=True) if isinstance(key, Station)}
    return None


def depth(problem: StripsProblem, x: FloatArray) -> float:
    """How far (l_0) strips are nearer to each other than they are kept at the unknowns x (n,)."""
    deep, lines = _deep(problem, x, facing.along(problem, x) or _held_pairs(problem))
    return max([0.0, *(-gap for gap, _ in deep), *(-gap for gap, _ in lines)])


def _held_pairs(problem: StripsProblem) -> list[tuple[int, int]]:
    """The strips one < other that are held at stations."""
    held = {(touching.one, touching.other) for touching in problem.touching if touching.pair.stays}
    return sorted({(min(pair), max(pair)) for pair in held})


def _deep(
    problem: StripsProblem, x: FloatArray, pairs: list[tuple[int, int]]
) -> tuple[list[tuple[float, Touching]], list[tuple[float, Station]]]:
    """Places that are too near each other, wherever they are, and on lines along strips that face each other."""
    return touch.minima(problem, x, -touch.DEPTH), facing.deepest(problem, x, pairs, touch.DEPTH)


def _behind(problem: StripsProblem, x: FloatArray) -> list[tuple[Touch, ...]]:
    """Points of each strip to hold on its walls' side between its joints."""
    if not walls.has_walls(problem):
        return [()] * len(problem.parts)
    minima = walls.deep_places(problem, x, contacts.DEPTH)
    return [
        contacts.points_beyond(part, problem.own(x, k), own)
        for k, (part, own) in enumerate(zip(problem.parts, minima, strict=True))
    ]


def _told(search: _Search, found: _Lain, steps: int, seconds: float) -> tuple[StripsProblem, Minimum]:
    """The problem with those stations alone that push, as few of them as balance."""
    now = found.rows
    pushes = _fewest(search, now, found.pushes)
    first = search.one_sided.size
    kept = first + np.flatnonzero(pushes[first:] > 0.0)
    problem = search.problem.with_changes(touching=tuple(now.problem.touching[k - first] for k in kept))
    rows = np.append(search.multipliers(now, pushes)[: search.problem.row_count], -pushes[kept])
    none = np.zeros(problem.size)
    residual = kkt_residual(problem, now.x, none, rows)
    return problem, Minimum(now.x, none, rows, residual, steps, 0, _DONE, True, seconds, NEWTON)


def _fewest(search: _Search, now: _Rows, pushes: FloatArray) -> FloatArray:
    """Pushes (k,) >= 0 of what touches that balance as those given do, as few as do (C. Lawson, R. Hanson 1974: rows of
    them are independent); those given where that leaves a pull."""
    moves = search.moves(now.x)
    near = np.flatnonzero(now.value <= _TOUCHES)
    slope = search.problem.gradient(now.x)[search.free] @ moves.z
    reduced = (now.jacobian(search.free) @ moves.z)[near]
    if not near.size:
        return pushes
    push, _ = scipy.optimize.nnls(reduced.T, slope, maxiter=30 * near.size)
    on = np.flatnonzero(push > _CLEARLY * push.max())
    sharp = np.linalg.lstsq(reduced[on].T, slope, rcond=None)[0]
    if sharp.min(initial=0.0) < 0.0:
        return pushes
    fewest = np.zeros_like(pushes)
    fewest[near[on]] = sharp
    return fewest
