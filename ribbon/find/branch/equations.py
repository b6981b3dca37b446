"""Equilibria of a glued ribbon over one parameter as one square system: what a branch is followed of.

z = (unknowns that nothing holds, multipliers of the rows in force)::

    G = ( grad E + A^T y ,  c - its bound )        K = [ H  A^T ; A  0 ]

(docs/theory.md, eq. (11.1)). Held: what clamps and gauges fix, which moves with t, slopes of rulings on their bound,
and rulings of joints amid straight ones, which move nothing. In force: rows of equality, and those of one side that
push. K is factored along the strip (`ribbon.solvers.saddle`); as many eigenvalues as it has below zero beyond the
number of rows are unstable modes (Nocedal and Wright 2006, theorem 16.3). Metric: ``int 4 |dq|^2 + |dr|^2 ds``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.find.branch import itself, layers, walls
from ribbon.find.branch.passages import Grading, passed
from ribbon.judge.convexity import curved_slack, least_slack
from ribbon.problems import prolonged
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.layout import ETA, POSITION, QUATERNION, SLOPE, STRIDE
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.touching import Touch
from ribbon.solvers.frontal import Factored
from ribbon.solvers.problem import force_scale, row_scale
from ribbon.solvers.saddle import Saddle

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
#: t, without unit -> the problem there, on segments of these lengths (p,).
ProblemAt = Callable[[float, FloatArray], MixedProblem]

#: |omega| l and |eta| below which a joint is straight.
STRAIGHT = 1e-9
#: Relative error of the curvature from which elements move into layers, the part of it that is worth it, and that above
#: which a point is not resolved.
FITTED, WORTH, RESOLVED = 1e-2, 0.5, 1e-1
#: Step in t by which G is differenced.
_STEP = 1e-4
#: Part of the way to a bound that a step goes at most.
_WAY = 0.9
_KEPT = 12
#: Part of a least element by which a passage may be beside its joint: within an element it has a stiffness of its own.
_STANDS = 0.05
#: Norm of the residual from which multipliers are balanced anew.
_BALANCED = 1e-11
#: Part of a bound up to which slopes are inside it, and the largest change of xi in a step.
_INSIDE, _LONGEST = 1.0 - 1e-13, 1.5
#: Step along the branch by which it is told which way places slide.
_AHEAD = 1e-6


def differenced(residual: Callable[[float], FloatArray], t: float, step: float) -> FloatArray:
    """d residual(t) / dt (n,) by differences of second order, from one side where it is not finite on the other."""
    after, before = residual(t + step), residual(t - step)
    if np.all(np.isfinite(after)) and np.all(np.isfinite(before)):
        return (after - before) / (2.0 * step)
    side = step if np.all(np.isfinite(after)) else -step
    return (4.0 * residual(t + side) - 3.0 * residual(t) - residual(t + 2.0 * side)) / (2.0 * side)


@dataclass(frozen=True)
class Equations:
    """problem_at: the ribbon over t; lengths (p,): its segments; base (n,): what held unknowns are that do not follow
    from t; free (n,), active (m,): unknowns and rows of z; side (n,): 1 or -1 for slopes on their upper or lower bound.

    anchor: of the gauges (`ribbon.problems.protocol.Problem.anchor`); grading: of elements that follow the passages
    of the curvature through zero, those that stand at `placed` (m,); None: elements stay; touching: places that are
    held on walls' sides between joints, on every segment where they slide (`ribbon.find.branch.walls`); pairs: places
    of the strip that are held from each other, or were up to here (`ribbon.find.branch.itself`); begun: rows of those
    that have come into force at the last event."""

    problem_at: ProblemAt
    lengths: FloatArray
    base: FloatArray
    free: BoolArray
    active: BoolArray
    side: FloatArray
    anchor: tuple[tuple[float, ...], tuple[float, ...]] | None
    grading: Grading | None = None
    placed: FloatArray = field(default_factory=lambda: np.zeros(0))
    touching: tuple[Touch, ...] = ()
    pairs: tuple[Pair, ...] = ()
    begun: tuple[int, ...] = ()

    @classmethod
    def of(
        cls,
        problem_at: ProblemAt,
        lengths: FloatArray,
        t: float,
        x: FloatArray,
        rows: FloatArray,
        bounds: FloatArray,
        grading: Grading | None = None,
        touching: tuple[Touch, ...] = (),
        pairs: tuple[Pair, ...] = (),
    ) -> tuple[Equations, FloatArray]:
        """The system around an equilibrium x (n,) with multipliers rows (m,) and bounds (n,), and its z; touching,
        pairs: of the problem of which it is one."""
        problem = _with(problem_at(t, lengths), touching, pairs)
        if walls.slides(problem):
            own, touching = problem, walls.everywhere(problem)
            problem = own.with_changes(touching=touching)
            rows = walls.carried(own, x, rows, problem, x)
        anchor = problem.anchor(x)
        problem = problem.anchored(anchor)
        lower, upper = problem.bounds()
        fixed = lower == upper
        reach = np.minimum(x - lower, upper - x)
        held = ~fixed & (np.abs(bounds) > np.maximum(reach, 1e-9))
        side = np.where(held, np.where(x - lower < upper - x, -1.0, 1.0), 0.0)
        free = ~(fixed | held | _rulings_of_nothing(problem, x))
        below, above = problem.constraint_bounds()
        c = problem.constraints(x)
        gap = np.minimum(c - below, above - c)
        active = (below == above) | (np.abs(rows) > np.maximum(gap, 1e-9))
        if walls.slides(problem):
            active = (below == above) | (rows != 0.0)
        system = cls(problem_at, lengths, x.copy(), free, active, side, anchor, grading, touching=touching, pairs=pairs)
        return system, np.concatenate([x[free], rows[active]])

    @property
    def size(self) -> int:
        """Unknowns and rows in force."""
        return int(self.free.sum() + self.active.sum())

    @cached_property
    def _count(self) -> int:
        return int(self.free.sum())

    @cached_property
    def _problems(self) -> dict[float, MixedProblem]:
        return {}

    def problem(self, t: float) -> MixedProblem:
        """The ribbon at t."""
        if t not in self._problems:
            while len(self._problems) >= _KEPT:
                self._problems.pop(next(iter(self._problems)))
            self._problems[t] = self._made(t, self.lengths, self.touching, self.pairs)
        return self._problems[t]

    def _made(
        self, t: float, lengths: FloatArray, touching: tuple[Touch, ...], pairs: tuple[Pair, ...]
    ) -> MixedProblem:
        return _with(self.problem_at(t, lengths), touching, pairs).anchored(self.anchor)

    @cached_property
    def _slides(self) -> bool:
        return walls.slides(next(iter(self._problems.values())))

    def whole(self, z: FloatArray, t: float) -> tuple[FloatArray, FloatArray]:
        """All unknowns (n,) and multipliers of rows (m,)."""
        problem = self.problem(t)
        lower, upper = problem.bounds()
        x = self.base.copy()
        fixed = lower == upper
        x[fixed] = lower[fixed]
        x[self.side > 0] = upper[self.side > 0]
        x[self.side < 0] = lower[self.side < 0]
        x[self.free] = z[: self._count]
        rows = np.zeros(self.active.size)
        rows[self.active] = z[self._count :]
        return x, rows

    def slope(self, problem: MixedProblem, x: FloatArray, rows: FloatArray) -> FloatArray:
        row, column = problem.jacobian_structure()
        return problem.gradient(x) + np.bincount(column, problem.jacobian(x) * rows[row], minlength=x.size)

    def _targets(self, problem: MixedProblem) -> FloatArray:
        below, above = problem.constraint_bounds()
        return np.where(np.isfinite(below), below, above)

    def residual(self, z: FloatArray, t: float) -> FloatArray:
        """G (n,); nan where the scene cannot be."""
        try:
            problem = self.problem(t)
        except ValueError:
            return np.full(self.size, np.nan)
        x, rows = self.whole(z, t)
        missed = (problem.constraints(x) - self._targets(problem))[self.active]
        if self.pairs and not np.isfinite(missed).all():  # no shape, of which nearest places are not looked for
            return np.full(self.size, np.nan)
        return np.concatenate([self.slope(problem, x, rows)[self.free], missed])

    def norm(self, residual: FloatArray) -> float:
        """The largest residual, forces over their unit."""
        if not np.all(np.isfinite(residual)):
            return float("nan")
        problem = next(iter(self._problems.values()))
        left = float(np.abs(residual[: self._count]).max(initial=0.0)) / force_scale(problem)
        return max(left, float(np.abs(residual[self._count :]).max(initial=0.0)) / row_scale(problem))

    def rate(self, z: FloatArray, t: float) -> FloatArray:
        """dG/dt by central differences, from one side where there is no strip on the other."""
        return differenced(lambda at: self.residual(z, at), t, _STEP)

    @cached_property
    def _saddle(self) -> Saddle:
        return Saddle(next(iter(self._problems.values())), self.free, self.active)

    def factor(self, z: FloatArray, t: float) -> Factored | None:
        """K, factored along the strip."""
        problem = self.problem(t)
        x, rows = self.whole(z, t)
        saddle = self._saddle
        found = saddle.factor(problem.hessian(x, rows), problem.jacobian(x))
        if found.finite and found.negative + found.zero < saddle.count:
            found = saddle.factor(problem.hessian(x, rows), problem.jacobian(x), soft=np.arange(saddle.count))
        return Factored(found, saddle.count) if found.finite else None

    @cached_property
    def _weights(self) -> FloatArray:
        p = self.lengths.size
        joint = np.zeros(p + 1)
        joint[:-1] += 0.5 * self.lengths
        joint[1:] += 0.5 * self.lengths
        weights = np.zeros(self.base.size)
        for place in range(POSITION, QUATERNION + 4):
            weights[place : STRIDE * p + QUATERNION + 4 : STRIDE] = joint * (4.0 if place >= QUATERNION else 1.0)
        return np.concatenate([weights[self.free], np.zeros(int(self.active.sum()))])

    def mass(self, v: FloatArray) -> FloatArray:
        """M v (n,)."""
        return self._weights * v

    def reach(self, z: FloatArray, dz: FloatArray) -> float:
        """The part of a step that leaves a tenth of the way of every slope to a bound where the energy has no end."""
        problem = next(iter(self._problems.values()))
        if problem.energy in FINITE_ON_BOUNDS:
            return 1.0
        upper = problem.bounds()[1][self.free]
        finite = np.isfinite(upper)
        if not finite.any():
            return 1.0
        x, dx, most = z[: self._count][finite], dz[: self._count][finite], upper[finite]
        room = np.where(dx > 0.0, most - x, most + x)
        moving = np.abs(dx) > 0.0
        if not moving.any():
            return 1.0
        return float(min(1.0, (_WAY * np.maximum(room[moving], 0.0) / np.abs(dx[moving])).min()))

    def stepped(self, z: FloatArray, dz: FloatArray) -> FloatArray:
        """z + dz; slopes n of an energy that is infinite on their bound b move in xi, ``n = b tanh xi``, as in
        `ribbon.solvers.newton_near`."""
        problem = next(iter(self._problems.values()))
        y = z + dz
        if problem.energy in FINITE_ON_BOUNDS:
            return y
        upper = problem.bounds()[1][self.free]
        slopes = np.flatnonzero(np.isfinite(upper))
        most = upper[slopes]
        here = np.clip(z[slopes] / most, -_INSIDE, _INSIDE)
        change = np.clip(dz[slopes] / most / (1.0 - here * here), -_LONGEST, _LONGEST)
        y[slopes] = most * np.tanh(np.arctanh(here) + change)
        return y

    # -- conditions of one side -----------------------------------------------------------------------------------

    @cached_property
    def _bounded(self) -> NDArray[np.int64]:
        """Slopes that may come to lie on their bound: of energies that are finite there."""
        problem = next(iter(self._problems.values()))
        lower, upper = problem.bounds()
        if problem.energy not in FINITE_ON_BOUNDS:
            return np.zeros(0, dtype=np.int64)
        return np.flatnonzero((lower < upper) & np.isfinite(upper))

    @cached_property
    def _kept(self) -> bool:
        """Whether parts of the strip keep from each other: a condition before those of the rows says of all their gaps
        that have no row, that with a row have more behind them."""
        return next(iter(self._problems.values())).apart > 0.0

    @cached_property
    def _pushed(self) -> slice:
        """Rows of pairs."""
        none = slice(self.active.size, self.active.size)
        return next(iter(self._problems.values())).block_slices().get("pairs", none)

    @cached_property
    def _one_sided(self) -> NDArray[np.int64]:
        problem = next(iter(self._problems.values()))
        below, above = problem.constraint_bounds()
        return np.flatnonzero(below != above)

    def slacks(self, z: FloatArray, t: float) -> FloatArray:
        """Of slopes of rulings and of rows of one side: how far they are from their bound, or how much they push."""
        problem = self.problem(t)
        if not (self._bounded.size or self._one_sided.size or self._kept):
            return np.zeros(0)
        x, rows = self.whole(z, t)
        found = []
        if self._bounded.size:
            lower, upper = problem.bounds()
            push = -self.slope(problem, x, rows) * self.side
            gap = np.minimum(x - lower, upper - x)
            found.append(np.where(self.side != 0.0, push, gap)[self._bounded])
        below, above = problem.constraint_bounds()
        c = problem.constraints(x)
        gap = np.minimum(c - below, above - c)
        push = np.where(np.isfinite(below), -rows, rows)
        slack = np.where(self.active, push, gap)
        if self._kept:
            least = np.array([itself.least(problem, x)])
            found.append(slack[list(self.begun)].min(keepdims=True) if self.begun else least)
        if self._slides:
            slack[walls.represented(problem, self.active)] = 1.0
        found.append(slack[self._one_sided])
        if self._slides:
            found.append(walls.on_way(problem, x, self.active))
        if self._kept:
            held = self.active[self._pushed]
            found += [itself.sliding(problem, x, held), itself.bends(problem, x, held)]
            found += [least] if self.begun else []
        return np.concatenate(found)

    def beyond(
        self, z: FloatArray, t: float, condition: int, directions: FloatArray
    ) -> tuple[Equations, FloatArray, FloatArray, str]:
        """The system in which a bound or contact has begun or ended."""
        if self._kept and condition >= self._bounded.size:
            return self._beyond_itself(z, t, condition - self._bounded.size - 1, directions)
        x, rows = self.whole(z, t)
        free, active, side = self.free.copy(), self.active.copy(), self.side.copy()
        if condition < self._bounded.size:
            column = int(self._bounded[condition])
            ends = side[column] != 0.0
            side[column] = 0.0 if ends else float(np.sign(x[column]))
            free[column] = ends
            s = float(np.cumsum(self.lengths)[column // STRIDE] - 0.5 * self.lengths[column // STRIDE])
            what = f"the ruling at s = {s:.3g} l {'leaves' if ends else 'comes to'} its bound"
        elif condition >= self._bounded.size + self._one_sided.size:
            over = condition - self._bounded.size - self._one_sided.size
            active, rows, what = walls.handed_over(self.problem(t), over, self.active, rows)
        else:
            row = int(self._one_sided[condition - self._bounded.size])
            ends = bool(active[row])
            active[row] = not ends
            what = f"{self._named(row, t)} {'lets go' if ends else 'touches'}"
        new = replace(self, free=free, active=active, side=side, base=x)
        wide = np.zeros((x.size + rows.size, directions.shape[1]))
        wide[np.concatenate([self.free, self.active])] = directions
        there = np.concatenate([free, active])
        new.problem(t)
        return new, new.balanced(np.concatenate([x[free], rows[active]]), t), wide[there], what

    def _beyond_itself(
        self, z: FloatArray, t: float, number: int, directions: FloatArray
    ) -> tuple[Equations, FloatArray, FloatArray, str]:
        """The same of what parts of the strip do to each other; number: of the row of one side, -1 for a gap without
        one, behind the rows places that slide, then pairs that spread. Itself where no branch goes on."""
        problem, (x, rows) = self.problem(t), self.whole(z, t)
        active, pairs, begun, places = self.active.copy(), self.pairs, self.begun, number - self._one_sided.size
        if number < 0 or places >= 3 * len(pairs):
            more = itself.closed(problem, x)
            if not more:
                return self, z, directions, itself.SPREAD
            begun = tuple(range(active.size, active.size + len(more)))
            active, rows = np.append(active, np.ones(len(more), dtype=bool)), np.append(rows, np.zeros(len(more)))
            pairs, what = (*itself.slid(problem, x), *more), itself.named(more, "touch")
        elif places < 0:
            row = int(self._one_sided[number])
            active[row] = not active[row]
            k = row - self._pushed.start
            what = itself.named(itself.slid(problem, x)[k : k + 1], "touch" if active[row] else "let go")
        elif places < 2 * len(pairs):
            ahead = x.copy()
            if directions.shape[1]:
                ahead[self.free] += _AHEAD * directions[: self._count, 0]
            pairs, what = itself.gone_over(problem, x, places, ahead)
        else:
            return self, z, directions, itself.SPREAD
        new = replace(self, active=active, base=x, pairs=pairs, begun=begun)
        new.problem(t)
        wide = np.zeros((active.size, directions.shape[1]))
        wide[np.flatnonzero(self.active)] = directions[self._count :]
        carried = np.vstack([directions[: self._count], wide[active]])
        there = np.concatenate([x[self.free], rows[active]])
        slid = 0 <= places < 2 * len(self.pairs)
        return new, new.balanced(there, t) if slid else there, carried, what

    def _without_idle(self, z: FloatArray, t: float) -> Equations:
        """The system without pairs that are not in force: their gaps are among all the others."""
        held = self.active[self._pushed]
        if held.all() and not self.begun:
            return self
        where = itself.slid(self.problem(t), self.whole(z, t)[0])
        pairs = tuple(pair for pair, on in zip(where, held, strict=True) if on)
        active = np.concatenate([self.active[: self._pushed.start], held[held]])
        new = replace(self, active=active, pairs=pairs, begun=())
        new.problem(t)
        return new

    def balanced(self, z: FloatArray, t: float) -> FloatArray:
        """z with the multipliers that balance where rows in force have been exchanged for others that say the same."""
        left = self.residual(z, t)
        exchanged = self._slides or bool(self.pairs)
        factor = self.factor(z, t) if exchanged and self.norm(left) > _BALANCED else None
        return z if factor is None else z - factor.solve(left)

    def _named(self, row: int, t: float) -> str:
        for name, where in self.problem(t).block_slices().items():
            if where.start <= row < where.stop:
                return f"{name.replace('_', ' ')}, row {row - where.start}"
        return f"row {row}"

    def renewed(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Equations, FloatArray, FloatArray]:
        """The system in which rulings are free that move something now."""
        problem = self.problem(t)
        x, rows = self.whole(z, t)
        lower, upper = problem.bounds()
        free = (lower != upper) & (self.side == 0.0) & ~_rulings_of_nothing(problem, x)
        if np.array_equal(free, self.free):
            return self, z, directions
        new = replace(self, free=free, base=x)
        new.problem(t)
        wide = np.zeros((x.size + rows.size, directions.shape[1]))
        wide[np.concatenate([self.free, self.active])] = directions
        return new, np.concatenate([x[free], rows[self.active]]), wide[np.concatenate([free, self.active])]

    # -- elements -----------------------------------------------------------------------------------------------------

    def moved(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Equations, FloatArray, FloatArray]:
        """Elements graded to where the curvature passes zero now, itself where no passage has moved by more than half a
        least element; without a grading as many elements where layers need them, itself where they resolve these."""
        if self.grading is None:
            new, z, directions = (self._without_idle(z, t) if self._kept else self).renewed(z, t, directions)
            return new._in_layers(z, t, directions)
        problem = self.problem(t)
        now = passed(self.lengths, problem.joint_values(self.whole(z, t)[0])[0])
        if now.size == self.placed.size and (
            not now.size or float(np.abs(now - self.placed).max()) <= _STANDS * self.grading.least
        ):
            return self, z, directions
        found = self._carried(z, t, directions, self.grading.lengths(now), self.grading, now)
        self._forget(t)
        return found

    def _forget(self, t: float) -> None:
        """Drops what can be made again: a branch on moving elements has a system for every point."""
        for other in [key for key in self._problems if key != t]:
            del self._problems[other]
        self.__dict__.pop("_saddle", None)

    def _in_layers(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Equations, FloatArray, FloatArray]:
        problem, (x, rows) = self.problem(t), self.whole(z, t)
        before = layers.missed(problem, x, rows)
        if not before > FITTED or self._one_sided.size:
            return self, z, directions
        lengths = layers.fitted(problem, x, rows)
        if not layers.missed(problem, x, rows, lengths) < WORTH * before:
            return self, z, directions
        return self._carried(z, t, directions, lengths, None, self.placed)

    def resolved(self, z: FloatArray, t: float) -> bool:
        """Whether its elements resolve the layers of a strip that is pulled; what they leave elsewhere is told by finer
        ones."""
        return layers.missed(self.problem(t), *self.whole(z, t)) <= RESOLVED

    def convexity(self, z: FloatArray, t: float) -> float:
        """Least slack of Legendre's condition at the joints whose ruling is free and between two of these
        (docs/theory.md, eq. (6.4)), 1/l^2; inf for energies that have gradients of what varies, and a naturally flat
        strip."""
        problem = self.problem(t)
        strip = problem.strip
        if problem.energy not in WITHOUT_GRADIENTS or not strip.poisson:
            return float("inf")
        joints = np.concatenate([[0.0], np.cumsum(self.lengths)])
        natural = law.at(strip.curvature, joints)
        if not natural.any():
            return float("inf")
        omega, eta = problem.joint_values(self.whole(z, t)[0])
        lower, upper = problem.bounds()
        turns = (lower != upper)[problem.layout.columns(ETA)]
        at_joints = curved_slack(omega, eta, natural, strip.poisson)[turns]
        between = least_slack(omega, eta, natural, strip.poisson)[turns[1:] & turns[:-1]]
        return float(min(at_joints.min(initial=np.inf), between.min(initial=np.inf)))

    def finer(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Equations, FloatArray, FloatArray]:
        """Every segment cut in two; graded ones by the grading that is twice as fine."""
        if self.grading is None:
            return self._carried(z, t, directions, np.repeat(0.5 * self.lengths, 2), None, self.placed)
        half = self.grading.finer()
        return self._carried(z, t, directions, half.lengths(self.placed), half, self.placed)

    def on_lengths(self, z: FloatArray, t: float, lengths: FloatArray) -> tuple[Equations, FloatArray]:
        """The system on elements of these lengths (p,) over l, which stay where they are, and z on them.

        z (size,): a solution of this system at the branch's parameter t, without units (l = 1, D w = 1); lengths:
        positive, their sum 1, which is not checked. What is returned, (size,) of the new system, is near a solution,
        not one: `residual` says how near. Raises ValueError where there is no strip at t.
        """
        new, there, _ = self._carried(z, t, np.zeros((z.size, 0)), lengths, None, self.placed)
        return new, there

    def _carried(
        self,
        z: FloatArray,
        t: float,
        directions: FloatArray,
        lengths: FloatArray,
        grading: Grading | None,
        placed: FloatArray,
    ) -> tuple[Equations, FloatArray, FloatArray]:
        """The system on other elements, z and directions on them: bounds and contacts where they were."""
        few = self.problem(t)
        x, rows = self.whole(z, t)
        pairs = itself.slid(few, x)
        many = self._made(t, lengths, self.touching, pairs)
        if self._slides:
            many = self._made(t, lengths, walls.everywhere(many), pairs)
        y = prolonged.shape(few, x, many)
        multipliers = walls.carried(few, x, rows, many, y)
        free = many.bounds()[0] != many.bounds()[1]
        free &= ~_rulings_of_nothing(many, y)
        side = np.zeros(many.size)
        here, there = prolonged.joints(self.lengths), prolonged.joints(lengths)
        middle = np.clip(np.searchsorted(here, 0.5 * (there[1:] + there[:-1])) - 1, 0, self.lengths.size - 1)
        side[SLOPE : STRIDE * lengths.size : STRIDE] = self.side[SLOPE : STRIDE * self.lengths.size : STRIDE][middle]
        free[side != 0.0] = False
        below, above = many.constraint_bounds()
        active = (below == above) | (multipliers != 0.0)
        new = Equations(
            self.problem_at, lengths, y, free, active, side, self.anchor, grading, placed, many.touching, pairs
        )  # fmt: skip
        new.problem(t)
        wide = np.zeros((many.size, directions.shape[1]))
        for k in range(directions.shape[1]):
            v = np.zeros(self.base.size)
            v[self.free] = directions[: self._count, k]
            for place in range(POSITION, ETA + 1):
                coarse = v[place : STRIDE * self.lengths.size + ETA + 1 : STRIDE]
                wide[place : STRIDE * lengths.size + ETA + 1 : STRIDE, k] = np.interp(there, here, coarse)
        moved = np.vstack([wide[free], np.zeros((int(active.sum()), directions.shape[1]))])
        return new, np.concatenate([y[free], multipliers[active]]), moved

    def energy(self, z: FloatArray, t: float) -> float:
        """Total energy, D w / l."""
        return float(self.problem(t).value(self.whole(z, t)[0]))


#: Energies that are finite where a ruling's slope is on its bound.
FINITE_ON_BOUNDS = ("sadowsky",)
#: Energies of rulings without a gradient in the density.
WITHOUT_GRADIENTS = ("sadowsky",)


def _with(problem: MixedProblem, touching: tuple[Touch, ...], pairs: tuple[Pair, ...]) -> MixedProblem:
    """The problem with places held on walls' sides and from each other."""
    if not (touching or pairs):
        return problem
    return problem.with_changes(touching=touching, pairs=itself.on_edges(problem, pairs))


def _rulings_of_nothing(problem: MixedProblem, x: FloatArray) -> BoolArray:
    """Unknowns (n,) of rulings amid straight joints, which move nothing: eta there, and slopes between."""
    held = np.zeros(problem.size, dtype=bool)
    if problem.fields.free:
        return held
    layout = problem.layout
    omega = np.abs(x[layout.omega])
    straight = omega < STRAIGHT * max(1.0, float(omega.max()) ** 2)  # what rounding leaves of their stiffness omega^2
    inner = straight.copy()
    inner[1:] &= straight[:-1]
    inner[:-1] &= straight[1:]
    held[layout.columns(ETA)[inner]] = True
    return held
