"""Arc length past limit points, events on the path, and switching to a bifurcated branch.

A step goes a length ds along the secant of the last two points (the tangent at first), in the root mean square of the
displacement over the size of the surface, and is corrected on the plane normal to it (newton.Plane; cylindrical arc
length: the load has no share in the length, so a path needs no scale between the two; docs/theory.md, eq. (7.11)).

Events: the number of negative eigenvalues changes where the tangent is singular; if the load turns back there, it is a
limit point (located on the path), else a bifurcation (located by bisection on the inertia before switching).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shellref.path.newton import Attempt, Equilibrium, Plane
from shellref.path.point import Point, Walk, Walker
from shellref.path.stability import lowest_mode
from shellref.shell.director import retract
from shellref.shell.result import ShellStatus

SMALLEST = 1e-4  # smallest arc-length step, over the first one
TANGENT_AFTER = 2  # failed steps along a secant, after which the tangent shows the way
SHARPEST = 0.5  # least cosine between successive directions
FARTHEST = 2.0  # loads outside [-FARTHEST, 1 + FARTHEST] end a path
BISECTIONS = (0.5, 0.35, 0.65, 0.2, 0.8)  # shares of a bracket tried in turn
MOST_LOCATES = 6  # solves to locate a limit point
BRANCH_STEPS = (0.01, 0.02, 0.05, 0.005)  # first amplitudes on a bifurcated branch, over the surface's size


@dataclass(frozen=True)
class Direction:
    """Where a path goes, per arc length: displacement (nodes, 6) and load."""

    state: np.ndarray
    load: float

    @classmethod
    def of(cls, equilibrium: Equilibrium, state: np.ndarray, load: float) -> tuple[Direction, float]:
        """The direction of an increment, and its length: 0 (and no direction) of one that moves nothing."""
        size = float(np.sqrt(equilibrium.mean(state, state))) / equilibrium.length
        if not 0.0 < size < np.inf:
            return cls(np.zeros_like(state), 0.0), 0.0
        return cls(state / size, load / size), size

    def slope(self, equilibrium: Equilibrium, sway: np.ndarray) -> float:
        """d(load) per length along this direction on the path whose du/dload is `sway` (nodes, 6); 0 at a limit,
        infinite where the load does not move the surface this way.
        """
        along = equilibrium.mean(sway, self.state)
        return equilibrium.length**2 / along if along else np.inf

    def cosine(self, equilibrium: Equilibrium, other: Direction) -> float:
        """Cosine of the angle between two directions."""
        return equilibrium.mean(self.state, other.state) / equilibrium.length**2


def _first(walker: Walker, walk: Walk) -> tuple[Direction, float, np.ndarray] | None:
    """Direction and step with which a path begins at the walk's point, and du/dload there (nodes, 6).

    Along the secant when there is one, else along the tangent. None, and the walk is stopped, when there is neither.
    """
    e, point, older, o = walker.equilibrium, walk.point, walk.older, walker.options
    sway, point.negative = e.tangent_of(point.state, walker.stages[walk.stage], point.load)
    if older is not None:
        direction, length = Direction.of(e, point.state - older.state, point.load - older.load)
        if length:
            return direction, min(length, o.max_arc), direction.state if sway is None else sway
    direction, size = Direction.of(e, np.zeros_like(point.state) if sway is None else sway, 1.0)
    if sway is None or not size:
        why = "its load does not move the surface" if sway is not None else f"no tangent of the path there: {e.trouble}"
        where = f"{walker.stages[walk.stage].name} stopped at {point.load:.6g} of its full value"
        walk.stop(ShellStatus.NOT_CONVERGED, f"{where}: {why}; use another mesh or smaller steps (first_step)")
        return None
    return direction, min(o.arc_step, o.first_step * size), sway


def _tangent(walker: Walker, walk: Walk, direction: Direction) -> tuple[Direction, np.ndarray] | None:
    """The tangent at the walk's point instead of the secant, which leads off when the path has changed branches.

    It points to where the secant does; from a stable state to higher loads. With du/dload (nodes, 6); None when there
    is no tangent.
    """
    e, point = walker.equilibrium, walk.point
    sway, point.negative = e.tangent_of(point.state, walker.stages[walk.stage], point.load)
    if sway is None:
        return None
    tangent, size = Direction.of(e, sway, 1.0)
    if not size:
        return None
    walk.older = None
    if point.negative != 0 and tangent.cosine(e, direction) < 0.0:
        return Direction(-tangent.state, -tangent.load), sway
    return tangent, sway


def follow(walker: Walker, walk: Walk, start: tuple[Direction, float] | None = None) -> None:
    """Arc length from the walk's point until the stage's load is 1; the walk is stopped when it cannot get there.

    start: direction and first step (the last solve was at the walk's point); None: along the path so far.
    """
    e, o, stage = walker.equilibrium, walker.options, walker.stages[walk.stage]
    walk.arc = True
    begun = _first(walker, walk) if start is None else (*start, e.last_sway)
    if begun is None:
        return
    direction, ds, sway = begun
    smallest = max(SMALLEST * ds, o.tolerance)
    turned, failures = False, 0
    for _ in range(o.max_steps):
        attempt, fresh, note = _advance(walker, walk, direction, ds)
        passed = fresh is not None and (attempt.load - 1.0) * (walk.point.load - 1.0) <= 0.0
        if passed and _finish(walker, walk, attempt):
            return
        if fresh is None or passed:
            if not passed:
                walker.log(walk, "arc", attempt.load, attempt, False, note)
            ds, failures = o.cut * ds, failures + 1
            if failures == TANGENT_AFTER:
                direction, sway = _tangent(walker, walk, direction) or (direction, sway)
            if ds < smallest:
                why = f" ({attempt.reason})" if attempt.reason else ""
                walk.stop(
                    ShellStatus.NOT_CONVERGED,
                    f"{stage.name} stopped at {walk.point.load:.6g}: arc-length steps fell under {smallest:.2g}{why}; a"
                    " finer mesh or a larger max_newton may pass",
                )
                return
            continue
        ahead, failures = e.last_sway, 0
        limit = (direction.slope(e, sway) > 0.0) != (fresh.slope(e, ahead) > 0.0)
        turned = turned or limit
        if limit:
            note = f"limit point at {_limit(walker, walk, attempt, (sway, ahead)):.6g}"
        elif None not in (walk.point.negative, attempt.negative) and walk.point.negative != attempt.negative:
            note = f"bifurcation between {walk.point.load:.6g} and {attempt.load:.6g}: "
            note += f"{walk.point.negative} to {attempt.negative} negative eigenvalue(s)"
        walker.accept(walk, "arc", attempt, note, settle=not limit)
        if walk.status is not None or walk.point.load >= 1.0:  # a switch may have walked to the end by itself
            return
        direction, sway = fresh, ahead
        if walk.older is None:  # the state jumped
            begun = _first(walker, walk)
            if begun is None:
                return
            direction, ds, sway = begun
        elif attempt.iterations <= 5:
            ds = min(o.growth * ds, o.max_arc)
        elif attempt.iterations >= 10:
            ds *= 0.7
        walker.journal.point(walk)
        if not -FARTHEST <= walk.point.load <= 1.0 + FARTHEST:
            break
    _give_up(walker, walk, turned)


def _give_up(walker: Walker, walk: Walk, turned: bool) -> None:
    """The path did not come to the full load."""
    stage = walker.stages[walk.stage]
    highest = max((s.load for s in walk.steps if s.accepted and s.stage == stage.name), default=0.0)
    text = f"the path was followed to {walk.point.load:.6g} (max_steps = {walker.options.max_steps})"
    if turned or highest > walk.point.load:
        reason = f"{stage.name} does not reach its full value: the highest load carried is {highest:.6g} of it; {text}"
        walk.stop(ShellStatus.LIMIT_POINT, reason)
    else:
        walk.stop(ShellStatus.NOT_CONVERGED, f"{stage.name} is not at its full value yet: {text}")


def _advance(walker: Walker, walk: Walk, direction: Direction, ds: float) -> tuple[Attempt, Direction | None, str]:
    """One arc-length step: the attempt, its direction (None: failed), and why it is refused although it converged."""
    e, point, older = walker.equilibrium, walk.point, walk.older
    state, load = retract(point.state, ds * direction.state), point.load + ds * direction.load
    stress = point.stress
    if older is not None:
        _, last = Direction.of(e, point.state - older.state, 0.0)
        stress = stress.extrapolate(older.stress, ds / last) if last else stress
    plane = Plane(state, load, direction.state, 0.0)
    attempt = e.solve(state, stress, walker.stages[walk.stage], load, plane)
    if not attempt.converged:
        return attempt, None, ""
    fresh, _ = Direction.of(e, attempt.state - point.state, attempt.load - point.load)
    if fresh.cosine(e, direction) < SHARPEST:  # or did not move at all
        return attempt, None, "turned too sharply"
    return attempt, fresh, ""


def _finish(walker: Walker, walk: Walk, attempt: Attempt) -> bool:
    """The step passed the full load: settle the state at load 1 exactly, between the two points."""
    e, point, stage = walker.equilibrium, walk.point, walker.stages[walk.stage]
    share = (1.0 - point.load) / (attempt.load - point.load)
    state = retract(point.state, share * (attempt.state - point.state))
    last = e.solve(state, point.stress.extrapolate(attempt.stress, -share), stage, 1.0)
    path = max(e.largest(attempt.state - point.state), 1e-6)
    if not last.converged or e.largest(last.state - state) > 0.5 * path:
        walker.log(walk, "arc", last.load, last, False, "jumped" if last.converged else "")
        return False
    walker.accept(walk, "arc", last)
    walker.journal.point(walk)
    return True


def _limit(walker: Walker, walk: Walk, attempt: Attempt, sways: tuple[np.ndarray, np.ndarray]) -> float:
    """Load of the limit point between the walk's point and the attempt, to `event_tolerance`.

    Cubic through loads and slopes at both ends, over the distance along their secant; a solve on the plane at its
    extremum replaces one of them. sways: du/dload (nodes, 6) at both.
    """
    e, stage = walker.equilibrium, walker.stages[walk.stage]
    low: Point = walk.point
    high = Point(attempt.load, attempt.state, attempt.stress)
    direction, length = Direction.of(e, high.state - low.state, 0.0)
    x, slopes = [0.0, length], [direction.slope(e, sway) for sway in sways]
    value = np.inf
    for _ in range(MOST_LOCATES):
        share, guess = _extremum((low.load, high.load), (slopes[0] * (x[1] - x[0]), slopes[1] * (x[1] - x[0])))
        if abs(value - guess) <= walker.options.event_tolerance:
            return guess
        share = float(np.clip(share, 0.05, 0.95))
        state = retract(low.state, share * (high.state - low.state))
        stress = low.stress.extrapolate(high.stress, -share)
        found = e.solve(state, stress, stage, guess, Plane(state, guess, direction.state, 0.0))
        walker.log(walk, "locate", found.load, found, found.converged, "limit point")
        if not found.converged:
            return guess
        value, at = found.load, x[0] + share * (x[1] - x[0])
        sway, _ = e.tangent_of(found.state, stage, found.load)
        if sway is None:
            return value
        slope, point = direction.slope(e, sway), Point(found.load, found.state, found.stress)
        if (slope > 0.0) == (slopes[0] > 0.0):
            low, x[0], slopes[0] = point, at, slope
        else:
            high, x[1], slopes[1] = point, at, slope
    return value


def _extremum(values: tuple[float, float], slopes: tuple[float, float]) -> tuple[float, float]:
    """Where in (0, 1), and how large, the cubic with these end values and slopes of opposite sign is extreme."""
    (a, b), (p, q) = values, slopes
    cubic = np.array([2.0 * (a - b) + p + q, 3.0 * (b - a) - 2.0 * p - q, p, a])
    if not np.all(np.isfinite(cubic)):
        return 0.5, 0.5 * (a + b)
    roots = np.roots(np.polyder(cubic))
    roots = roots[np.abs(roots.imag) < 1e-9].real
    inner = roots[(roots > 0.0) & (roots < 1.0)]
    share = float(inner[0] if len(inner) else p / (p - q))
    return share, float(np.polyval(cubic, share))


def locate(walker: Walker, walk: Walk, stable: Point, unstable: Point) -> tuple[Point, Point]:
    """Bisection on the inertia along the load: (last stable, first unstable) points, event_tolerance apart.

    Farther apart when nothing between them can be solved for, or its tangent not factored.
    """
    stage = walker.stages[walk.stage]
    low, high = stable, unstable
    while abs(high.load - low.load) > walker.options.event_tolerance:
        for share in BISECTIONS:  # where the tangent is nearly singular Newton may fail: another place between the two
            load = low.load + share * (high.load - low.load)
            state = retract(low.state, share * (high.state - low.state))
            attempt = walker.equilibrium.solve(state, low.stress.extrapolate(high.stress, -share), stage, load)
            if attempt.converged:
                attempt.negative = walker.equilibrium.negative_eigenvalues(attempt.state, stage, load)
            found = attempt.converged and attempt.negative is not None
            walker.log(walk, "locate", attempt.load, attempt, found, "bifurcation")
            if found:
                break
        else:
            break
        point = Point(load, attempt.state, attempt.stress, attempt.negative)
        low, high = (low, point) if attempt.negative else (point, high)
    return low, high


def switch(walker: Walker, walk: Walk, before: Point) -> bool:
    """From a bifurcation between two points over to the branch that leaves along the critical mode, and along it.

    The walk's point becomes the first one on the branch and the one before it the bifurcation; the branch is followed
    by arc length, as the load may fall on it, and rises with the square of the amplitude at best. False (and the walk
    stays where it is) when no branch was found.
    """
    e, stage = walker.equilibrium, walker.stages[walk.stage]
    after = walk.point
    low, high = locate(walker, walk, before, after)
    mode, _ = lowest_mode(e, high.state, stage, high.load)
    if mode.value is None:
        return False
    shape, _ = Direction.of(e, mode.vector, 0.0)
    # the plane goes along with the old path, whose moving clamps may have a part along the mode
    climb = after.load - before.load
    drift = -e.mean(shape.state, after.state - before.state) / climb if climb else 0.0
    for amplitude in BRANCH_STEPS:
        field = amplitude * shape.state
        state = retract(low.state, field)
        walker.model.set_control(stage.at(low.load))
        stress = walker.model.stress(low.state, field)
        attempt = e.solve(state, stress, stage, low.load, Plane(state, low.load, shape.state, drift))
        good = attempt.converged and attempt.load < 1.0 and abs(attempt.load - low.load) < 0.5
        if good:
            attempt.negative = e.negative_eigenvalues(attempt.state, stage, attempt.load)
        note = f"branch of the bifurcation at {0.5 * (low.load + high.load):.6g}, amplitude {amplitude:g}"
        walker.log(walk, "switch", attempt.load, attempt, good, note)
        if not good:
            continue
        walk.older, walk.point = low, Point(attempt.load, attempt.state, attempt.stress, attempt.negative)
        walk.kicks += 1
        follow(walker, walk, Direction.of(e, attempt.state - low.state, attempt.load - low.load))
        return True
    return False
