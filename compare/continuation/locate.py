"""Special points between two neighbours of a branch, located: folds, branch points, conditions that change.

    fold            dt/darc passes zero, and with it one eigenvalue
    branch point    an eigenvalue passes zero, dt/darc does not; or, on a branch that leaves it, the other way round
    event           a condition of one side begins or ends to hold

Eigenvalues are counted by inertia; each that passes is a smooth function of the arc length, of which a root is found
(Brent), and so is one of dt/darc. A double one is two roots at one place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from compare.continuation import bordered
from compare.continuation.correct import Direction, at, tangent
from compare.continuation.journal import journalled
from compare.continuation.point import Options, Point, Special, length, product
from compare.continuation.system import FloatArray

#: Roots nearer to each other than this part of a step, and 1e-7 in arc length, are one.
TOGETHER, APART = 1e-5, 1e-7
#: Part of a step within which an eigenvalue passes zero where dt/darc does: its own place is the rougher one.
FOLDED = 1e-2
#: What changes sign without coming nearer to zero than this part of its change has not changed on this branch.
JUMP = 1e-4
#: Distance over the step from which points beside a branch point have tangents that are its branch's, and the least
#: cosine between theirs and its own that is believed.
ASIDE, ALONG = 1e-3, 0.98
#: Slack below zero that is rounding.
BROKEN = 1e-10
#: Points around a branch that is left, their distance at the least (arc length), and the part of the eigenvalues there
#: that is none at the place itself.
_NODES, _AROUND, TOUCH = np.array([-2.5, -1.5, -0.5, 0.5, 1.5, 2.5]), 0.01, 1e-2
#: Cosine with the tangent that was come along from which on a branch is that one, gone back.
_BACK = -1.0 + 1e-6
#: What happens where the density is no more convex, and the number that this has among conditions of one side.
UNPOSED, LOST = "its energy is no more convex in curvature and twist: beyond, elements alone set its modes", -1
#: The number of an event behind which a system knows of no branch: `System.beyond` gives itself.
ENDS = -2
#: Slack of a condition that is met where another one is, and how many of them are gone through at the most.
TIGHT, MANY = 1e-6, 5
#: Step along the tangent by which it is told on which side a condition is kept.
_TRIED = 1e-6
#: Change of a slack in that step below which it falls.
_FALLS = 1e-11


class Between:
    """Points between `before` and what lies `reach` ahead of it along its tangent, computed once each."""

    def __init__(self, before: Point, reach: float, after: Point | None, options: Options) -> None:
        self.before, self.reach, self.options = before, reach, options
        self._seen: dict[float, Point] = {0.0: before}
        if after is not None:
            self._seen[reach] = after

    def point(self, ahead: float) -> Point:
        """The point there. Raises ArithmeticError where there is none."""
        if ahead not in self._seen:
            near = sorted(self._seen, key=lambda known: abs(known - ahead))[:2]
            low, high = min(near), max(near)
            guess = None
            if low < ahead < high:
                share = (ahead - low) / (high - low)
                a, b = self._seen[low], self._seen[high]
                guess = (1.0 - share) * a.z + share * b.z, (1.0 - share) * a.t + share * b.t
            found = at(self.before, ahead, self.options.tolerance, guess) or at(
                self.before, ahead, self.options.tolerance
            )
            if found is None:
                raise ArithmeticError
            self._seen[ahead] = found
        return self._seen[ahead]

    def with_tangent(self, ahead: float) -> Point:
        """The point at a branch point, where (K, dG/dt) has two null vectors and rounding says which of them is the
        tangent: with that between its neighbours where its own is another."""
        point = self.point(ahead)
        away = [x for x in self._seen if abs(x - ahead) >= ASIDE * abs(self.reach)]
        low, high = max((x for x in away if x < ahead), default=None), min((x for x in away if x > ahead), default=None)
        if low is None or high is None:
            return point
        share, (a, b) = (ahead - low) / (high - low), (self._seen[x].tangent for x in (low, high))
        dz, dt = (1.0 - share) * a[0] + share * b[0], (1.0 - share) * a[1] + share * b[1]
        size = length(point.system, dz, dt)
        middle = dz / size, dt / size
        return point if product(point.system, point.tangent, middle) >= ALONG else replace(point, tangent=middle)

    def last_alike(self, first: float) -> Point:
        """The last point with as many unstable modes as at `first`, which at `reach` there are not, to `APART`."""
        low, high, count = first, self.reach, self.point(first).unstable
        while high - low > APART:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.point(middle).unstable == count else (low, middle)
        return self.point(low)

    def root(self, value: Callable[[Point], float]) -> float | None:
        """Where `value` passes zero; None where it does not, or leaps over it."""
        a, b = value(self.before), value(self.point(self.reach))
        if a == 0.0 or a * b > 0.0:
            return None
        x = scipy.optimize.brentq(
            lambda ahead: value(self.point(float(ahead))), 0.0, self.reach,
            xtol=self.options.events * max(abs(self.reach), 1e-3), rtol=1e-14, maxiter=60, disp=False,
        )  # fmt: skip
        known = min(self._seen, key=lambda ahead: abs(value(self._seen[ahead])) + abs(ahead - float(x)))
        return known if abs(value(self._seen[known])) <= JUMP * abs(b - a) else None


def _critical(index: int, count: int, seen: dict[int, FloatArray]) -> Callable[[Point], float]:
    """The eigenvalue that is number `index` of all, ascending, as far as it is one of the `count` nearest zero; seen:
    those of points that others have asked for already."""

    def value(point: Point) -> float:
        if id(point) not in seen:
            seen[id(point)] = _values(point, count)
        values = seen[id(point)]
        place = index - point.unstable + int((values < 0.0).sum())
        if 0 <= place < values.size:
            return float(values[place])
        far = float(np.abs(values).max()) * 2.0
        return -far if index < point.unstable else far

    return value


@journalled(lambda point, count: (point.z, point.t, count), lambda values: [values], lambda kept: kept[0])
def _values(point: Point, count: int) -> FloatArray:
    """Eigenvalues (count,) nearest zero. Raises ArithmeticError where there are none."""
    factor = point.system.factor(point.z, point.t)
    if factor is None:
        raise ArithmeticError
    return bordered.near_zero(point.system, factor, count)[0]


@journalled(lambda point, count: (point.z, point.t, count), list, lambda kept: (kept[0], kept[1]))
def modes_at(point: Point, count: int) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues (count,) nearest zero and their vectors (n, count)."""
    factor = point.system.factor(point.z, point.t)
    if factor is None:
        return np.zeros(0), np.zeros((point.system.size, 0))
    return bordered.near_zero(point.system, factor, count)


def specials(before: Point, after: Point, reach: float, options: Options) -> list[Special] | None:
    """Folds and branch points between two neighbours, in order; None where what changes leaps: the step has gone over
    to another branch, or is too long."""
    change = after.unstable - before.unstable
    folds = before.tangent[1] * after.tangent[1] < 0.0
    if not change and not folds:
        return []
    between = Between(before, reach, after, options)
    low = min(before.unstable, after.unstable)
    if not change:
        touched = _touched(between, after)
        return None if touched is None else [Special("branch_point", *touched, before, reach, 0)]
    try:
        roots = []
        seen: dict[int, FloatArray] = {}
        for index in range(low, low + abs(change)):
            found = between.root(_critical(index, abs(change) + 2, seen))
            if found is None:
                return None
            roots.append(found)
        turn = between.root(lambda point: point.tangent[1]) if folds else None
    except ArithmeticError:
        return None
    if folds and turn is None:
        return None
    near = max(TOGETHER * reach, APART)
    fold_at = None
    if turn is not None:
        close = [root for root in roots if abs(root - turn) <= FOLDED * reach]
        if not close:
            return None
        fold_at = min(close, key=lambda root: abs(root - turn))
        roots.remove(fold_at)
    sign = int(np.sign(change))
    found_here: list[tuple[float, Special]] = []
    if turn is not None:
        at_turn = between.point(turn)
        values, modes = modes_at(at_turn, 1)
        rest = change - sign * len(roots)
        found_here.append((turn, Special("fold", at_turn, modes, tuple(values), before, reach, rest)))
    for group in _groups(sorted(roots), near):
        special = _branch_point(between, group[len(group) // 2], len(group), sign)
        if len(group) > 1:
            special = replace(special, apart=tuple(_branch_point(between, root, 1, sign) for root in group))
        found_here.append((group[len(group) // 2], special))
    return [special for _, special in sorted(found_here, key=lambda pair: pair[0])]


def _branch_point(between: Between, place: float, count: int, sign: int) -> Special:
    """Where so many eigenvalues pass zero, all the same way."""
    values, modes = modes_at(between.point(place), count)
    point = between.with_tangent(place)
    return Special("branch_point", point, modes, tuple(values), between.before, between.reach, sign * count)


def _touched(between: Between, after: Point) -> tuple[Point, FloatArray, tuple[float, ...]] | None:
    """A branch point passed on the branch that leaves it: dt/darc passes zero, an eigenvalue comes to zero and goes
    back (the side branch of a pitchfork). None where no eigenvalue is zero there.

    Nothing can be solved at the place itself, where (K, dG/dt) has two null vectors and the tangent is none: it is
    interpolated through six points of the branch around it.
    """
    before, reach = between.before, between.reach
    a, b = before.tangent[1], after.tangent[1]
    middle = reach * a / (a - b)
    gap = max(_AROUND, 0.125 * reach)
    try:
        for _ in range(3):
            nodes = middle + gap * _NODES
            points = [between.point(float(s)) for s in nodes]
            slope = np.polynomial.Polynomial.fit(nodes, [p.tangent[1] for p in points], nodes.size - 1)
            real = [float(r.real) for r in slope.roots() if abs(r.imag) < 1e-9 and abs(r.real - middle) < 2.0 * gap]
            if not real:
                return None
            root = min(real, key=lambda r: abs(r - middle))
            if abs(root - middle) < 1e-3 * gap:
                break
            middle = root
        lowest = [float(modes_at(p, 1)[0][0]) for p in points]
    except (ArithmeticError, IndexError):
        return None
    weights = np.array([np.prod([(root - n) / (m - n) for n in nodes if n != m]) for m in nodes])
    zero = float(weights @ lowest)
    if abs(zero) > TOUCH * float(np.abs(lowest).max()):
        return None
    z, t = sum(w * p.z for w, p in zip(weights, points, strict=True)), float(weights @ [p.t for p in points])
    norm = before.system.norm(before.system.residual(z, t))
    direction = sum(w * p.tangent[0] for w, p in zip(weights, points, strict=True))
    size = length(before.system, direction, 0.0)
    arc = before.arc + root
    place = Point(before.system, z, t, (direction / size, 0.0), before.unstable, arc, 0, norm)
    values, modes = modes_at(place, 1)
    return place, modes, tuple(values)


def _groups(roots: list[float], near: float) -> list[list[float]]:
    groups: list[list[float]] = []
    for root in roots:
        if groups and root - groups[-1][-1] <= near:
            groups[-1].append(root)
        else:
            groups.append([root])
    return groups


def broken(before: Point, after: Point, reach: float, options: Options) -> tuple[list[Special], Point] | None:
    """The first condition of one side that is broken between two neighbours, where it is, with those that change with
    it there, and the branch's next point behind it; None where that cannot be told."""
    slacks = after.system.slacks(after.z, after.t)
    between = Between(before, reach, after, options)
    first: tuple[float, int] | None = None
    try:
        for k in np.flatnonzero(slacks < -BROKEN):
            one = int(k)

            def slack(point: Point, one: int = one) -> float:
                return float(point.system.slacks(point.z, point.t)[one])

            if slack(before) <= BROKEN:
                if slack(before) >= -BROKEN and _rates(before)[one] > _FALLS:
                    return None  # it is kept first, and broken further on
                place: float | None = 0.0
            else:
                place = between.root(slack)
            if place is None and first is not None and slack(between.point(first[0])) > BROKEN:
                continue  # it is kept where another one is broken
            if place is None:
                return None
            if first is None or place < first[0]:
                first = place, one
        if first is None:
            return None
        here = between.point(first[0])
    except ArithmeticError:
        return None
    numbers: tuple[int, ...] = (first[1],)
    carried, words = _carried(here, first[1])
    if carried is None:
        return None
    if carried.system is here.system:
        nothing = np.zeros((here.system.size, 0))
        return [Special("event", here, nothing, (), before, reach, 0, words[0], condition=ENDS)], here
    tight = _tight(here, carried)
    if len(tight) > 1:
        carried, words, numbers = _together(here, tight) or (carried, words, numbers)
    change = carried.unstable - here.unstable
    nothing = np.zeros((here.system.size, 0))
    *rest, last = (
        Special("event", here, nothing, (), before, reach, 0, what, condition=number)
        for what, number in zip(words, numbers, strict=True)
    )
    return [*rest, replace(last, change=change)], carried


def leaves_convexity(before: Point, after: Point) -> bool:
    """Whether between two neighbours the density ceases to be convex, or the number of modes changes where it is not so
    already, and it matters: a state without an unstable mode (a ruling that turns beside a clamp that holds it
    straight) has none of the elements' own."""
    if not after.unstable or after.system.convexity(after.z, after.t) >= -BROKEN:
        return False
    return after.unstable != before.unstable or before.system.convexity(before.z, before.t) > BROKEN


def unposed(before: Point, after: Point, reach: float, options: Options) -> Special | None:
    """Where the density between two neighbours ceases to be convex, or, of a branch that is stable there or has come
    beyond, where the number of modes changes next: an event behind which no branch is followed; None where it cannot be
    told."""

    def slack(point: Point) -> float:
        return point.system.convexity(point.z, point.t)

    between = Between(before, reach, after, options)
    try:
        convex = slack(before) > BROKEN
        place = between.root(slack) if convex else 0.0
        if place is None:
            return None
        here = between.point(place)
        if not (convex and here.unstable):
            here = between.last_alike(place)
    except ArithmeticError:
        return None
    return Special("event", here, np.zeros((here.system.size, 0)), (), before, reach, 0, UNPOSED, condition=LOST)


def _carried(here: Point, condition: int) -> tuple[Point | None, list[str]]:
    """The same equilibrium in the system in which the condition has changed, its tangent on the side on which it is
    kept, and what happened."""
    point, words, _ = _changed(here, (condition,))
    if point is None:
        return None, words
    return (point if _rates(point)[condition] >= 0.0 else point.turned()), words


def _changed(here: Point, conditions: Sequence[int]) -> tuple[Point | None, list[str], Direction]:
    """The same equilibrium in the system in which these conditions have changed, what happened, of each, and what is
    left there of the tangent that was come along."""
    dz, dt = here.tangent
    system, z, directions, words = here.system, here.z, dz[:, None], []
    for condition in conditions:
        system, z, directions, what = system.beyond(z, here.t, condition, directions)
        words.append(what)
    along = directions[:, 0], dt
    found = tangent(system, z, here.t, along)
    point = None if found is None else replace(here, system=system, z=z, tangent=found[0], unstable=found[1])
    return point, words, along


def _rates(point: Point) -> FloatArray:
    """Change of every slack (k,) in a step of `_TRIED` along the tangent."""
    system, (dz, dt) = point.system, point.tangent
    step = _TRIED * system.reach(point.z, dz)
    return system.slacks(point.z + step * dz, point.t + step * dt) - system.slacks(point.z, point.t)


def _tight(here: Point, carried: Point) -> list[int]:
    """Conditions that are met at one place, if the branch behind a change of one of them breaks another there: else
    none. With their numbers the same before and behind it."""
    slacks, after = (one.system.slacks(one.z, one.t) for one in (here, carried))
    if slacks.size != after.size:
        return []
    met = np.flatnonzero((np.abs(slacks) <= TIGHT) & (np.abs(after) <= TIGHT))
    several = 1 < met.size <= MANY and not _keeps(carried, met)
    return [int(one) for one in met] if several else []


def _keeps(point: Point, conditions: Sequence[int] | NDArray[np.int64]) -> bool:
    """Whether these are kept at a point and do not fall along its tangent."""
    slacks = point.system.slacks(point.z, point.t)[conditions]
    return bool((slacks >= -BROKEN).all() and (_rates(point)[conditions] >= -_FALLS).all())


def _together(here: Point, tight: Sequence[int]) -> tuple[Point, list[str], tuple[int, ...]] | None:
    """The same equilibrium with those of the conditions changed behind which none of them is broken; None where there
    are none.

    Branches that end at one place are rays, one for every choice of conditions in force that keeps all slacks at their
    bound from falling: a linear complementarity problem in the rates (S. M. Robinson 1980, doi:10.1287/moor.5.1.43;
    R. W. Cottle, J.-S. Pang & R. E. Stone 1992). One is the ray that was come along; of others, itself gone back
    apart, the one most ahead in (z, t) is taken: near a fold dt alone says nothing.
    """
    best: tuple[float, Point, list[str], tuple[int, ...]] | None = None
    for count in range(1, len(tight) + 1):
        for chosen in combinations(tight, count):
            point, words, along = _changed(here, chosen)
            if point is None:
                continue
            for one in (point, point.turned()):
                ahead = product(one.system, one.tangent, along)
                if ahead <= _BACK or not _keeps(one, tight):
                    continue
                if best is None or ahead > best[0]:
                    best = ahead, one, words, chosen
    return None if best is None else best[1:]
