r"""Paths of equilibria of the planar elastica by arc length, past limit points and over to other branches.

The path (z, t) is followed in the arc length sigma with d sigma^2 = int dtheta^2 ds + dt^2 (pseudo-arc-length: H. B.
Keller, in Applications of Bifurcation Theory, Academic Press 1977, pp. 359-384). The unknown is (z, t) and the last row
of the bordered system asks for a given distance along the last tangent, so nothing special happens where dt/dsigma = 0.

    limit point     dt/dsigma changes sign
    bifurcation     the number of negative eigenvalues changes and dt/dsigma does not change sign

Both are located by Brent's method on the arc length of the step in which they happen: on dt/dsigma, or on the
eigenvalue that crosses zero. At a bifurcation the branches leave along the critical mode, one on each side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse
from scipy.optimize import brentq

from ribbonbench import clock
from shellref.elastica.fem import stability
from shellref.elastica.problem import Array
from shellref.elastica.system import System, solve_sparse

JUMP = 1e-5
"""What changes sign (an eigenvalue, or dt/dsigma) without coming nearer to zero than this share of its change has not
changed along a path: the step has gone over to a neighbouring one, as near an imperfect pitchfork; it is repeated
shorter."""


SHORT = 0.005
"""Arc length below which a limit point without a change of sign of an eigenvalue is believed: so does a branch pass the
pitchfork from which it comes. In longer steps it may be a jump over a neighbouring path."""


@dataclass(frozen=True)
class ArcOptions:
    """How a path is followed.

    tolerance : of the out-of-balance moment and of the constraints, absolute. step, most, least : first, longest and
    shortest arc length of a step. steps : most steps accepted. quick : Newton iterations of an easy step, after which
    the next one is longer. turn : cosine between the tangents of neighbouring points below which a step is repeated
    shorter. events : locate limit points and bifurcations to this share of the step's arc length.
    """

    tolerance: float = 1e-10
    step: float = 0.05
    most: float = 0.3
    least: float = 1e-6
    steps: int = 500
    quick: int = 4
    turn: float = 0.95
    events: float = 1e-12

    def __post_init__(self) -> None:
        for name in ("tolerance", "step", "most", "least", "steps", "events"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} = {getattr(self, name)}: must be greater than zero")
        if not self.least < self.step <= self.most:
            raise ValueError(f"step = {self.step}: must lie between least = {self.least} and most = {self.most}")


@dataclass(frozen=True)
class Point:
    """An equilibrium on a path: z (N + m,) at t, unit tangent (dz, dt), lowest eigenvalues (k,) on the constraints.

    rounding : bound of what the eigenvalues are known to; at a located event no less than the one that is zero there.
    """

    t: float
    z: Array
    tangent: tuple[Array, float]
    eigenvalues: Array
    norm: float
    iterations: int
    rounding: float

    @property
    def stable(self) -> bool | None:
        """None at a fold or a bifurcation: the lowest eigenvalue is zero to rounding."""
        return stability(float(self.eigenvalues[0]), self.rounding)

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues, among those followed, by sign alone: so that a change of sign along a path
        lies in one of its steps and not between two, wherever rounding puts it."""
        return int(np.sum(self.eigenvalues < 0.0))

    @property
    def unstable(self) -> int:
        """Number of those that are negative beyond rounding."""
        return int(np.sum(self.eigenvalues < -self.rounding))


@dataclass(frozen=True)
class Event:
    """kind: "limit", "bifurcation" or, inside `trace` only, "jump"; mode (N + m,): of the eigenvalue zero there."""

    kind: str
    point: Point
    mode: Array


@dataclass(frozen=True)
class Branch:
    """Points in order, limit points among them, and events.

    ended: "reached" and "limits" (at the last and the first value of the span), "closed" (back at the start), "event"
    (asked to stop there), "steps" (as many as allowed, or as long) or "failed".
    """

    points: tuple[Point, ...]
    events: tuple[Event, ...]
    ended: str
    iterations: int = field(default=0)

    def limits(self) -> tuple[Event, ...]:
        return tuple(e for e in self.events if e.kind == "limit")

    def bifurcations(self) -> tuple[Event, ...]:
        return tuple(e for e in self.events if e.kind == "bifurcation")


def point_at(system: System, z: Array, t: float, options: ArcOptions | None = None) -> Point | None:
    """The equilibrium that Newton finds at t from z, its tangent towards larger t; None when it finds none."""
    options = options or ArcOptions()
    solved = system.newton(z, t, options.tolerance)
    return None if solved.z is None else _finished(system, solved.z, t, None, solved.norm, solved.iterations)


def trace(
    system: System,
    start: Point,
    direction: float,
    span: tuple[float, float],
    options: ArcOptions | None = None,
    stop_at_events: bool = False,
) -> Branch:
    """The path from `start`, towards larger t (direction 1) or smaller (-1), as long as t stays in `span`.

    The last point lies at the end of the span exactly ("reached" at span[1], "limits" at span[0]).
    """
    options = options or ArcOptions()
    if direction * start.tangent[1] < 0.0 or (start.tangent[1] == 0.0 and direction < 0.0):
        start = _turned(start)
    points: list[Point] = [start]
    events: list[Event] = []
    step, spent = options.step, 0
    while len(points) <= options.steps and not clock.spent():
        here = points[-1]
        there = _step(system, here, step, options)
        if there is None or _agreement(system, here, there) < options.turn:
            step *= 0.5
            if step < options.least:
                return Branch(tuple(points), tuple(events), "failed", spent)
            continue
        spent += there.iterations
        bound = span[1] if there.t > span[1] else span[0] if there.t < span[0] else None
        if bound is not None:
            last = _landed(system, here, there, bound, options)
            if last is None:
                step *= 0.5
                if step < options.least:
                    return Branch(tuple(points), tuple(events), "failed", spent)
                continue
            there = last
        event = _event(system, here, there, step, options)
        if event is not None and event.kind == "jump":
            step *= 0.5
            if step < options.least:
                return Branch(tuple(points), tuple(events), "failed", spent)
            continue
        if event is not None:
            events.append(event)
            if stop_at_events:
                points.append(event.point)
                return Branch(tuple(points), tuple(events), "event", spent)
            if event.kind == "limit":
                points.append(event.point)  # so that t is monotonic between neighbouring points
        points.append(there)
        if bound is not None:
            return Branch(tuple(points), tuple(events), "reached" if bound == span[1] else "limits", spent)
        if len(points) > 8 and _closed(system, start, there, step):
            return Branch(tuple(points), tuple(events), "closed", spent)
        if there.iterations <= options.quick:
            step = min(1.5 * step, options.most)
    return Branch(tuple(points), tuple(events), "steps", spent)


def switch(system: System, event: Event, options: ArcOptions | None = None, size: float = 0.02) -> tuple[Point, ...]:
    """First points of the branches that leave a bifurcation along its mode, tangents away from it: up to two."""
    options = options or ArcOptions()
    found = []
    for sign in (1.0, -1.0):
        away = replace(event.point, tangent=(sign * event.mode, 0.0))
        point = _step(system, away, size, options)
        if point is not None and abs(system.product(point.z - event.point.z, event.mode)) > 0.5 * size:
            change = point.z - event.point.z
            ahead = system.product(change, point.tangent[0]) + (point.t - event.point.t) * point.tangent[1]
            found.append(point if ahead > 0.0 else _turned(point))
    return tuple(found)


def states_at(system: System, branch: Branch, values: Array, options: ArcOptions | None = None) -> list[list[Point]]:
    """For each of these values of t the equilibria of the branch there: as many as the path passes it."""
    options = options or ArcOptions()
    found: list[list[Point]] = [[] for _ in values]
    for index, (a, b) in enumerate(zip(branch.points[:-1], branch.points[1:], strict=True)):
        for k, t in enumerate(values):
            inside = min(a.t, b.t) < t < max(a.t, b.t) or t == b.t or (index == 0 and t == a.t)
            if not inside:
                continue
            point = _landed(system, a, b, float(t), options)
            if point is not None:
                found[k].append(point)
    return found


def _turned(point: Point) -> Point:
    return replace(point, tangent=(-point.tangent[0], -point.tangent[1]))


def _tangent(system: System, z: Array, t: float, along: tuple[Array, float] | None) -> tuple[Array, float] | None:
    """Unit tangent of the path at (z, t), on the side of `along` (None: of larger t)."""
    if along is None:
        dz = solve_sparse(system.jacobian(z, t), -system.rate(z))
        if dz is None:
            return None
        dt = 1.0
    else:
        rhs = np.zeros(system.size + 1)
        rhs[-1] = 1.0
        both = solve_sparse(_bordered(system, z, t, along), rhs)
        if both is None:
            return None
        dz, dt = both[:-1], float(both[-1])
    length = math.sqrt(system.product(dz, dz) + dt * dt)
    return dz / length, dt / length


def _bordered(system: System, z: Array, t: float, along: tuple[Array, float]) -> scipy.sparse.csc_matrix:
    """dG/d(z, t) with the row of the arc length, shape (N + m + 1, N + m + 1)."""
    row = np.zeros(system.size)
    row[: system.count] = system.discrete.weighted(along[0][: system.count])
    column = scipy.sparse.csc_matrix(system.rate(z)[:, None])
    corner = scipy.sparse.csc_matrix([[along[1]]])
    border = scipy.sparse.csc_matrix(row[None, :])
    return scipy.sparse.bmat([[system.jacobian(z, t), column], [border, corner]], format="csc")


def _step(system: System, here: Point, step: float, options: ArcOptions) -> Point | None:
    """The equilibrium at this arc length along the tangent of `here`; None when Newton does not find it."""
    dz, dt = here.tangent
    z, t = here.z + step * dz, here.t + step * dt
    for iteration in range(10):
        residual = system.residual(z, t)
        distance = system.product(z - here.z, dz) + (t - here.t) * dt - step
        norm = system.norm(residual)
        if not math.isfinite(norm) or norm > 1e12:
            return None
        if norm <= options.tolerance and abs(distance) <= 1e-9 * max(step, 1e-3):
            return _finished(system, z, t, here.tangent, norm, iteration)
        change = solve_sparse(_bordered(system, z, t, here.tangent), np.append(residual, distance))
        if change is None:
            return None
        z, t = z - change[:-1], t - float(change[-1])
    return None


def _finished(
    system: System, z: Array, t: float, along: tuple[Array, float] | None, norm: float, iterations: int
) -> Point | None:
    tangent = _tangent(system, z, t, along)
    if tangent is None:
        return None
    return Point(t, z, tangent, system.eigenpairs(z, t)[0], norm, iterations, system.rounding(z, t))


def _agreement(system: System, here: Point, there: Point) -> float:
    """Cosine between two tangents."""
    return system.product(here.tangent[0], there.tangent[0]) + here.tangent[1] * there.tangent[1]


def _landed(system: System, a: Point, b: Point, t: float, options: ArcOptions) -> Point | None:
    """The equilibrium at this t between two neighbouring points, t between theirs, of a path.

    Newton from the cubic through both with their tangents, so that it stays on its side of a limit point near by.
    """
    change = b.z - a.z
    chord = math.sqrt(system.product(change, change) + (b.t - a.t) ** 2)

    def cubic(start: Any, end: Any, start_rate: Any, end_rate: Any, x: float) -> Any:
        h, y = x * x * (3.0 - 2.0 * x), 1.0 - x
        return (1.0 - h) * start + h * end + chord * x * y * (y * start_rate - x * end_rate)

    def miss(x: float) -> float:
        return float(cubic(a.t, b.t, a.tangent[1], b.tangent[1], x)) - t

    x = float(brentq(miss, 0.0, 1.0)) if miss(0.0) * miss(1.0) < 0.0 else float(t == b.t)
    solved = system.newton(cubic(a.z, b.z, a.tangent[0], b.tangent[0], x), t, options.tolerance)
    if solved.z is None:
        return None
    moved = solved.z - a.z
    if math.sqrt(max(system.product(moved, moved), 0.0)) > 2.0 * chord + 1e-6:
        return None  # another branch
    return _finished(system, solved.z, t, a.tangent, solved.norm, solved.iterations)


def _event(system: System, here: Point, there: Point, step: float, options: ArcOptions) -> Event | None:
    """What happens between two neighbouring points, located."""
    limit = here.tangent[1] * there.tangent[1] < 0.0
    if not limit and here.negative == there.negative:
        return None
    if limit and step > SHORT and here.negative == there.negative < len(here.eigenvalues):
        return Event("jump", there, there.tangent[0])
    index = min(here.negative, there.negative)
    reach = system.product(there.z - here.z, here.tangent[0]) + (there.t - here.t) * here.tangent[1]
    seen: dict[float, Point] = {0.0: here, reach: there}

    def value(sigma: float) -> float:
        if sigma not in seen:
            point = _step(system, here, sigma, options)
            if point is None:
                raise ArithmeticError
            seen[sigma] = point
        return seen[sigma].tangent[1] if limit else float(seen[sigma].eigenvalues[index])

    if (not limit and index >= len(here.eigenvalues)) or value(0.0) * value(reach) > 0.0:
        return None
    try:
        root = float(brentq(value, 0.0, reach, xtol=options.events * max(step, 1e-3), rtol=1e-14))
        value(root)
    except ArithmeticError:
        root = min(seen, key=lambda sigma: abs(value(sigma)))
    point = seen[root]
    values, modes = system.eigenpairs(point.z, point.t)
    smallest = int(np.argmin(np.abs(values)))
    if abs(value(root)) > JUMP * abs(value(reach) - value(0.0)):
        return Event("jump", point, modes[:, smallest])
    point = replace(point, rounding=max(point.rounding, float(abs(values[smallest]))))
    return Event("limit" if limit else "bifurcation", point, modes[:, smallest])


def _closed(system: System, start: Point, there: Point, step: float) -> bool:
    """Whether the path is back where it began."""
    change = there.z - start.z
    return math.sqrt(system.product(change, change) + (there.t - start.t) ** 2) < 0.5 * step
