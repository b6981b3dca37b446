"""The way of a tape from one pair of holds to another by arc length, past snap-backs.

The targets are t0 + load (t1 - t0). A step's length is measured by the curvature of the section over that at rest (at
least 1/l), the tangent of the line and the load:

    ds^2 = sum_nodes h [ (dkappa^0 / kappa0)^2 / LAYER + |dr'|^2 ] + dload^2,

so that a fold that forms where the load falls back is many steps, and so is its motion. A point is stable at its
load where L D L^T has as many negative pivots as there are rows that hold.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ribbon.element import kernel_cache
from ribbon.solvers.budget import spent
from ribbon.tape.rod import Rod
from ribbon.tape.section import FloatArray

with kernel_cache.in_use():
    from ribbon.tape.band import factor, solve

TOLERANCE = 1e-9
"""Largest residual over the largest force of the holds that counts as equilibrium."""

ROUNDING = 2e-14, 5e-15
"""Rounding of positions, over l: (A / D) / h of the first and the unbent tape's stiffness M / k over h^3 of the second
are the residuals that it leaves."""

FLAT = 1.0
"""Curvature across (1/l) that counts as one where that at rest is less: a nearly flat tape bends across by more than
its own, and steps measured by that were a thousand times too short."""

LAYER = 0.05
"""Length of tape (l) whose change from round to flat counts as one."""

ITERATIONS = 12
VISCOUS, JUMP_STEPS = 1e-4, 200
"""Time of the first step of a jump, and how many there may be."""

STRAIGHT, SHORT = 0.7, 0.01
"""Cosine between the ways at both ends of a step, less of which halves it; steps below SHORT of the first are kept."""

GROW, FEW, MANY = 1.5, 4, 7
"""Newton's steps: at most; a step along the way grows where there are FEW, shrinks beyond MANY."""


@dataclass(frozen=True, eq=False)
class Point:
    """An equilibrium on the way: load, unknowns x (size,), negative: unstable directions at this load; residual: the
    next step of Newton's method in the measure above; iterations of it; rate: of the load on the way to this point;
    jumped: found by a jump at a load where the way had become unstable."""

    load: float
    x: FloatArray
    negative: int
    residual: float
    iterations: int
    rate: float = 1.0
    jumped: bool = False

    @property
    def stable(self) -> bool:
        """Whether every other state nearby has more energy, at this load."""
        return self.negative == 0

    @property
    def branched(self) -> bool:
        """Whether there are more unstable directions than the way's turning back explains: a branching was passed."""
        return self.negative > (1 if self.rate < 0.0 else 0)


@dataclass(frozen=True)
class Steps:
    """first, least, most: lengths of a step; points: most of them on a way."""

    first: float = 0.05
    least: float = 1e-6
    most: float = 0.15
    points: int = 3000


@dataclass(frozen=True)
class LoadPath:
    """A tape whose targets go from `begin` to `finish` (rows,)."""

    rod: Rod
    begin: FloatArray
    finish: FloatArray

    def targets(self, load: float) -> FloatArray:
        """Targets at a load in [0, 1]."""
        return np.asarray((1.0 - load) * self.begin + load * self.finish)

    @cached_property
    def metric(self) -> FloatArray:
        """Weights (size,) of the squares of the unknowns' changes."""
        rod = self.rod
        h = np.zeros(len(rod.s))
        h[:-1] += 0.5 * rod.lengths
        h[1:] += 0.5 * rod.lengths
        found = np.zeros(rod.size)
        found[rod.column + 1] = found[rod.column + 3] = h
        scale = max(abs(rod.section.curvature), FLAT)
        found[rod.column + 4] = h / (LAYER * scale**2)
        return found

    def settled(self, x: FloatArray, load: float) -> Point | None:
        """Newton's method at a load; None: it does not converge."""
        x = x.copy()
        targets = self.targets(load)
        for iteration in range(ITERATIONS + 1):
            gradient, band = self.rod.equations(x, targets)
            force = self._force(x)
            worst = float(np.abs(gradient).max())
            negative = factor(band) - self.rod.start.count - self.rod.end.count
            if not np.isfinite(worst):
                return None
            step = -gradient[:, None]
            solve(band, step)
            if worst <= self._allowed(force):
                return Point(load, x, negative, self._size(step[:, 0]), iteration)
            x += step[:, 0]
        return None

    def walk(self, point: Point, steps: Steps | None = None) -> Iterator[Point]:
        """The equilibria from `point` on, the load growing at first; the last lies at load 1, unless the steps became
        too short or too many, or the budget of time is spent."""
        steps = steps or Steps()
        metric, push = self.metric, self.rod.push(self.finish - self.begin)
        length = steps.first
        tangent, rate = self._tangent(point, metric, push)
        for _ in range(steps.points):
            while True:
                if spent():
                    return
                found = self._corrected(point, tangent, rate, length, metric, push)
                if found is not None:
                    ahead, change = found
                    scale = 1.0 / np.sqrt(float(metric @ change**2) + 1.0)
                    turn = scale * (float(metric @ (tangent * change)) + rate)
                    if abs(turn) > STRAIGHT or length < SHORT * steps.first:
                        break
                length *= 0.5
                if length < steps.least:
                    return
            if ahead.load >= 1.0:
                share = (1.0 - point.load) / (ahead.load - point.load)
                last = self.settled(point.x + share * (ahead.x - point.x), 1.0)
                if last is not None:
                    yield last
                    return
                length *= 0.5
                continue
            scale = np.copysign(scale, turn)
            tangent, rate = scale * change, scale
            ahead = replace(ahead, rate=rate)
            yield ahead
            if ahead.iterations <= FEW:
                length = min(GROW * length, steps.most)
            elif ahead.iterations > MANY:
                length *= 0.5
            point = ahead

    def _size(self, step: FloatArray) -> float:
        return float(np.sqrt(self.metric @ step**2))

    def _force(self, x: FloatArray) -> float:
        one, other = self.rod.multipliers
        return max(1.0, float(np.abs(np.concatenate([x[one], x[other]])).max(initial=0.0)))

    def _allowed(self, force: float) -> float:
        section, h = self.rod.section, float(self.rod.lengths.min())
        stiff = 1.0 + section.stretching * section.curvature**2 * float(section.matrices[1][0, 0])
        return TOLERANCE * force + ROUNDING[0] * section.stretching / h + ROUNDING[1] * stiff / h**3

    def _tangent(self, point: Point, metric: FloatArray, push: FloatArray) -> tuple[FloatArray, float]:
        """Unit tangent of the way and its rate of the load, which grows."""
        _, band = self.rod.equations(point.x, self.targets(point.load))
        factor(band)
        change = _by_load(band, push)
        scale = 1.0 / np.sqrt(float(metric @ change**2) + 1.0)
        return scale * change, scale

    def _corrected(
        self, point: Point, tangent: FloatArray, rate: float, length: float, metric: FloatArray, push: FloatArray
    ) -> tuple[Point, FloatArray] | None:
        """The equilibrium at `length` along the tangent and its change by the load, by Newton's method across it."""
        x, load = point.x + length * tangent, point.load + length * rate
        row = metric * tangent
        before = np.inf
        for iteration in range(ITERATIONS + 1):
            gradient, band = self.rod.equations(x, self.targets(load))
            force = self._force(x)
            worst = float(np.abs(gradient).max())
            negative = factor(band) - self.rod.start.count - self.rod.end.count
            if not np.isfinite(worst) or (iteration > 3 and worst > 1e3 * before):
                return None
            before = worst
            both = np.column_stack([-gradient, -push])
            solve(band, both)
            if worst <= self._allowed(force):
                return Point(load, x, negative, self._size(both[:, 0]), iteration), both[:, 1]
            off = length - float(row @ (x - point.x)) - rate * (load - point.load)
            change = (off - float(row @ both[:, 0])) / (float(row @ both[:, 1]) + rate)
            x += both[:, 0] + change * both[:, 1]
            load += change
        return None

    def jump(self, point: Point, push: FloatArray) -> Point | None:
        """Where the tape goes from `point` at its load, viscous: equations + metric dx / time = 0, time growing.

        push: (nodes,), what the first curvature of the section is changed by to begin with. None: it does not settle.
        """
        rod, targets, metric = self.rod, self.targets(point.load), self.metric
        x, time = point.x.copy(), VISCOUS
        x[rod.column + 4] += push
        x[rod.fixed] = point.x[rod.fixed]
        for _ in range(JUMP_STEPS):
            if spent():
                return None
            ahead, needed = self._relaxed(x, targets, metric / time)
            if ahead is None:
                time *= 0.25
                continue
            moved = float(metric @ (ahead - x) ** 2)
            x = ahead
            time *= 3.0 if needed <= FEW else 1.0
            if moved < 1e-6:
                found = self.settled(x, point.load)
                if found is not None and found.stable:
                    return replace(found, jumped=True)
        return None

    def _relaxed(self, x: FloatArray, targets: FloatArray, damping: FloatArray) -> tuple[FloatArray | None, int]:
        """One implicit step of the viscous tape and its iterations; None: it is too long."""
        ahead = x.copy()
        held = self.rod.start.count + self.rod.end.count
        for iteration in range(ITERATIONS):
            gradient, band = self.rod.equations(ahead, targets)
            gradient += damping * (ahead - x)
            band[:, 0] += damping
            worst = float(np.abs(gradient).max())
            if iteration and worst <= 1e2 * self._allowed(self._force(ahead)):
                return ahead, iteration
            if not np.isfinite(worst) or factor(band) > held:
                return None, iteration
            step = -gradient[:, None]
            solve(band, step)
            ahead += step[:, 0]
        return None, ITERATIONS


def _by_load(factors: FloatArray, push: FloatArray) -> FloatArray:
    """Change of the unknowns (size,) by the load, from the factors of the equations' derivative."""
    along = -push[:, None]
    solve(factors, along)
    return along[:, 0]


def begun(rod: Rod) -> FloatArray:
    """The tape at rest where its start is held, (size,), and the values of the rows there are its first targets."""
    return rod.straight()


def standing(rod: Rod, x: FloatArray) -> FloatArray:
    """What the rows of a tape's holds are in the state x: (rows,)."""
    nodes = rod.nodes(x)
    return np.concatenate([rod.start.rows(nodes[0], rod.middle)[0], rod.end.rows(nodes[-1], rod.middle)[0]])
