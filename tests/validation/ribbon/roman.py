"""Roman's confined strip (thesis, 6.2.2): folds, force on the roof, scaling laws, against Roman's own elastica."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import scipy.integrate
import scipy.optimize
import scipy.special

from ribbon import Clamp, Equilibrium, Gravity, Strip, Wall, solve
from ribbon.find.continuation import follow, switch
from ribbon.find.solve import Problem, build, solve_from
from ribbon.solvers.problem import FloatArray
from tests.validation import page
from tests.validation.number import Number, rounding

matplotlib.use("Agg")
import matplotlib.pyplot as plt

#: Algorithm 3: w / l, nu, Gamma, epsilon, and the last exponent of the lowering.
WIDTH, POISSON, GAMMA, EPSILON, LAST = 0.2, 0.5, 10.0, 1e-6, 2.3
DELTA = 0.1
#: F / N^3 where the contacts become planes at this Delta, without weight: the scale of forces.
FLAT_FORCE = 115.0
#: Segments at full height; 60, 120, 240 ... have joints where 1, 2, 3, 5 and 6 equal folds touch (100 has not).
SEGMENTS = 60
#: Here: step of the exponent, and its last value.
STEP, LOWEST = 0.02, 1.5
COLLAPSE = (0.10, 0.13, 0.16, 0.19, 0.22, 0.25)
#: What shooting leaves of a ratio of forces, and what the minimiser leaves of the ribbon's on given segments.
SHOT, SOLVED = 1e-9, 1e-6

# -- Roman's elastica -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class HalfWave:
    """A half wave of Roman's elastica, from the floor (s = 0) to the roof, units of l and D w.

    length: of it; thrust: horizontal force, compression positive; force: of the whole fold (two half waves) on the
    roof; low, high: its curvature at the floor, >= 0 where the contact is a line, and at the roof, <= 0.
    """

    length: float
    thrust: float
    force: float
    low: float
    high: float


def _ends(length: float, curvature: float, thrust: float, lift: float, gamma: float) -> FloatArray:
    """theta, theta', z, y at s = `length`, from rest: theta'' = -n_y cos theta - T sin theta, n_y = gamma s - lift."""

    def slope(s: float, u: FloatArray) -> list[float]:
        return [u[1], (lift - gamma * s) * math.cos(u[0]) - thrust * math.sin(u[0]), math.cos(u[0]), math.sin(u[0])]

    found = scipy.integrate.solve_ivp(
        slope, (0.0, length), [0.0, curvature, 0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-13
    )
    return found.y[:, -1]


def _root(residual: Callable[[FloatArray], Sequence[float]], guess: Sequence[float], scale: FloatArray) -> FloatArray:
    start = np.asarray(guess) / scale
    found = scipy.optimize.root(lambda u: np.asarray(residual(u * scale)), start, method="hybr", tol=1e-13)
    if np.abs(found.fun).max() > 1e-9:
        raise AssertionError(f"no elastica found: {found.message}")
    return found.x * scale


@cache
def line_contact(height: float, delta: float, gamma: float = 0.0, folds: int = 1) -> HalfWave:
    """The half wave of `folds` equal folds that touch along lines: eq. 6.3 by shooting, from its small-slope solution.

    Length 1/(2N), reach (1 - Delta)/(2N), height given; exact with the weight too: the half waves are mirror images.
    """
    length, reach = 0.5 / folds, 0.5 * (1.0 - delta) / folds

    def small(a: float) -> float:  # y' = C (1 - cos(mu s') / cos a), a = mu L / 2 in (pi/2, pi): excess length
        c = height / (length * (1.0 - math.tan(a) / a))
        mean = 1.0 - 2.0 * math.tan(a) / a + (0.5 + 0.25 * math.sin(2.0 * a) / a) / math.cos(a) ** 2
        return 0.5 * c * c * mean - delta

    grid = np.linspace(0.5 * math.pi + 1e-4, 1.3 * math.pi, 400)
    a = float(grid[np.argmin([abs(small(v)) for v in grid])])
    c = height / (length * (1.0 - math.tan(a) / a))
    mu = 2.0 * a / length
    scale = np.array([c * mu, mu * mu, c * mu * mu])
    found = np.array([-c * mu * math.tan(a), mu * mu, c * mu * mu])
    for weight in dict.fromkeys((0.0, gamma)):

        def residual(u: FloatArray, weight: float = weight) -> tuple[float, float, float]:
            theta, _, z, y = _ends(length, u[0], u[1], u[2], weight)
            return theta, (z - reach) / length, (y - height) / length

        found = _root(residual, found + np.array([0.0, 0.0, 0.5 * weight * length]), scale)
    low, thrust, lift = (float(v) for v in found)
    high = float(_ends(length, low, thrust, lift, gamma)[1])
    return HalfWave(length, thrust, 2.0 * (lift - gamma * length), low, high)


@cache
def plane_contact(height: float, delta: float, folds: int = 1) -> HalfWave:
    """The weightless half wave between flat parts: no moment where it leaves them; the flat parts take the rest of l.

    How the flat parts are shared out among the folds changes nothing.
    """

    def residual(u: FloatArray) -> tuple[float, float, float]:
        theta, _, z, y = _ends(u[0], 0.0, u[1], u[2], 0.0)
        return theta, (u[0] - z - 0.5 * delta / folds) / u[0], (y - height) / height

    length = 1.5 * folds * height**2 / delta
    thrust = (2.0 * math.pi / length) ** 2
    guess = length, thrust, thrust * height / length
    found = _root(residual, guess, np.array(guess))
    theta = _ends(found[0], 0.0, found[1], found[2], 0.0)
    return HalfWave(found[0], found[1], 2.0 * found[2], 0.0, float(theta[1]))


@cache
def free_height(delta: float) -> float:
    """Height of the weightless arch nothing presses on: H = k / K(k), Delta = 2 (1 - E(k) / K(k))."""
    modulus = scipy.optimize.brentq(
        lambda m: 2.0 * (1.0 - scipy.special.ellipe(m) / scipy.special.ellipk(m)) - delta, 1e-9, 0.9, xtol=1e-15
    )
    return math.sqrt(modulus) / float(scipy.special.ellipk(modulus))


def thesis_height(delta: float, fourth: float = 6.0) -> float:
    """H of Delta = (pi^2 / 4) H^2 + c H^4; the thesis found c = 6 by eye."""
    b = 0.25 * math.pi**2
    return math.sqrt((-b + math.sqrt(b * b + 4.0 * fourth * delta)) / (2.0 * fourth))


#: The coefficient of H^4 by expanding the elliptic integrals.
EXACT_FOURTH = 5.0 * math.pi**4 / 128.0

# -- the ribbon -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Experiment:
    """Roman's strip: the missing length, the weight, the segments at full height."""

    delta: float = DELTA
    gamma: float = GAMMA
    segments: int = SEGMENTS

    def problem(self, height: float | None, segments: int | None = None, stiffness: float | None = None) -> Problem:
        """Between the floor and, unless None, a roof (on a spring: a pressure plate) at `height`."""
        walls = [Wall((0.0, -EPSILON, 0.0), (0.0, 1.0, 0.0))]
        if height is not None:
            walls.append(Wall((0.0, height, 0.0), (0.0, -1.0, 0.0), stiffness))
        return build(
            Strip(1.0, WIDTH, POISSON, gamma=self.gamma), Clamp(ruling="free"), Gravity((0.0, 1.0, 0.0)),
            end=Clamp((0.0, 0.0, 1.0 - self.delta), ruling="free"), walls=walls, segments=segments or self.segments,
        )  # fmt: skip

    def arch(self, segments: int | None = None) -> Equilibrium:
        """Without a roof."""
        return solve(
            Strip(1.0, WIDTH, POISSON, gamma=self.gamma), Clamp(ruling="free"), Gravity((0.0, 1.0, 0.0)),
            end=Clamp((0.0, 0.0, 1.0 - self.delta), ruling="free"), walls=[Wall((0.0, -EPSILON, 0.0), (0.0, 1.0, 0.0))],
            segments=segments or self.segments, seed_curvature=(-8.0, 8.0, 8.0, -8.0),
        )  # fmt: skip

    def folded(self, folds: int, height: float, segments: int, stiffness: float | None = None) -> Equilibrium:
        """N equal folds under a roof at `height`, from a wave."""
        s = np.linspace(0.0, 1.0, 40 * folds + 1)
        size = 2.0 * math.pi * folds * math.sqrt(self.delta) * 2.0
        walls = [Wall((0.0, -EPSILON, 0.0), (0.0, 1.0, 0.0)), Wall((0.0, height, 0.0), (0.0, -1.0, 0.0), stiffness)]
        return solve(
            Strip(1.0, WIDTH, POISSON, gamma=self.gamma), Clamp(ruling="free"), Gravity((0.0, 1.0, 0.0)),
            end=Clamp((0.0, 0.0, 1.0 - self.delta), ruling="free"), walls=walls, segments=segments,
            seed_curvature=tuple((-size * np.cos(2.0 * math.pi * folds * s)).tolist()),
        )  # fmt: skip


@dataclass(frozen=True)
class Folds:
    """What a shape between two plates looks like: its folds, from the clamp on.

    roof: for every fold the (first, last) abscissa of its contact with the roof, None where it hangs free; floor: the
    same for the valleys before, between and behind them, of which the first and the last hold the clamps.
    """

    roof: tuple[tuple[float, float] | None, ...]
    floor: tuple[tuple[float, float] | None, ...]

    @property
    def count(self) -> int:
        """N: how often the centreline rises through half the height of the roof."""
        return len(self.roof)

    def kind(self, longest: float) -> str:
        """ "line", "plane" or "hanging": all contacts shorter than `longest`, some longer, or one missing."""
        everything = (*self.roof, *self.floor)
        if any(part is None for part in everything):
            return "hanging"
        return "plane" if any(b - a > longest for a, b in everything) else "line"  # type: ignore[misc]


def folds(equilibrium: Equilibrium, height: float) -> Folds:
    """The folds of an equilibrium with floor and roof."""
    s = np.linspace(0.0, 1.0, 20 * equilibrium.problem.lengths.size + 1)
    above = equilibrium.position(s)[:, 1] > 0.5 * height
    crossings = s[1:][above[1:] != above[:-1]]
    floor, roof = (wall.contacts for wall in equilibrium.walls)

    def within(contacts: FloatArray, a: float, b: float) -> tuple[float, float] | None:
        inside = contacts[(contacts > a) & (contacts < b)]
        return (float(inside[0]), float(inside[-1])) if inside.size else None

    edges = np.concatenate([[-1.0], crossings, [2.0]])
    floor = np.unique(np.concatenate([[0.0], floor, [1.0]]))  # the clamps
    tops = zip(edges[1:-1:2], edges[2:-1:2], strict=True)
    valleys = zip(edges[0::2], edges[1::2], strict=True)
    return Folds(tuple(within(roof, *top) for top in tops), tuple(within(floor, *low) for low in valleys))


def press(equilibrium: Equilibrium) -> float:
    """F: of the ribbon on the roof, units of D w / l^2, the sum of the multipliers."""
    return -float(equilibrium.walls[1].force[1])


@dataclass
class Record:
    """A state on the way down: height, folds, kind of contact, force, energy, whether the shape snapped there."""

    height: float
    count: int
    kind: str
    force: float
    energy: float
    snapped: bool


@dataclass
class LoadPath:
    """Algorithm 3: height of the arch alone, the states, and the last equilibrium."""

    top: float
    records: list[Record]
    last: Equilibrium

    @property
    def exponent(self) -> float:
        """i of the lowest state."""
        return math.log(self.top / self.records[-1].height)

    def reaches(self, last: float) -> bool:
        """Whether the roof came down to i = last."""
        return self.exponent > last - 1e-6


class _Walk:
    """The states seen on a way, in order."""

    def __init__(self, experiment: Experiment, count: int) -> None:
        self.experiment, self.count = experiment, count
        self.records: list[Record] = []

    def see(self, equilibrium: Equilibrium, height: float, jump: bool = False) -> None:
        """Adds a state; it must be a stable equilibrium."""
        if not equilibrium.ok:
            raise AssertionError(f"{self.experiment}, H = {height:.4f}: {equilibrium.message}")
        seen = folds(equilibrium, height)
        kind = seen.kind(1.01 / equilibrium.problem.lengths.size)
        snapped = jump or seen.count != self.count
        self.count = seen.count
        self.records.append(Record(height, seen.count, kind, press(equilibrium), equilibrium.energy.total, snapped))

    def go(self, equilibrium: Equilibrium, first: float, last: float, step: float) -> Equilibrium:
        """The roof goes from one height to another, each `step` (in the logarithm) a state."""
        steps = max(1, round(abs(math.log(last / first)) / step))
        segments = equilibrium.problem.lengths.size

        def height(t: float) -> float:
            return first * (last / first) ** t

        return follow(
            lambda t: self.experiment.problem(height(t), segments), equilibrium, steps=steps, smallest=0.2 / steps,
            on_step=lambda record, new: self.see(new, height(record.t), record.jump),
        )  # fmt: skip


def lower(experiment: Experiment, step: float, last: float = LAST) -> LoadPath:
    """The roof sinks as exp(-i), i = step, 2 step ... `last`; the segments are doubled as H halves (algorithm 3)."""
    found = experiment.arch()
    top = float(found.middle.position[1])
    walk = _Walk(experiment, 1)
    at, segments = top * math.exp(-step), experiment.segments
    found = switch(experiment.problem(at), found)
    walk.see(found, at)
    lowest = top * math.exp(-last)
    halvings = itertools.takewhile(lambda h: h > lowest * (1 + 1e-9), (top * 0.5**k for k in itertools.count(1)))
    for stop in (*halvings, lowest):
        if segments > experiment.segments or at < 0.6 * top:
            found = switch(experiment.problem(at, segments), found)
        found = walk.go(found, at, stop, step)
        at, segments = stop, 2 * segments
    return LoadPath(top, walk.records, found)


def raise_again(experiment: Experiment, count: int, first: float, last: float, step: float, segments: int) -> LoadPath:
    """From `count` folds under a roof at `first` the roof goes up to `last`."""
    equilibrium = experiment.folded(count, first, segments)
    walk = _Walk(experiment, count)
    walk.see(equilibrium, first)
    equilibrium = walk.go(equilibrium, first, last, step)
    return LoadPath(float("nan"), walk.records, equilibrium)


# -- the checks -------------------------------------------------------------------------------------------------------


def virtual_work(experiment: Experiment, equilibrium: Equilibrium, height: float) -> float:
    """Relative difference of the roof's force to -dE/dH, by central differences of fourth order.

    The points that touch are those of `equilibrium`: under a plane contact another height chooses others between the
    joints, and the energy jumps with them (4e-6 of it), which is no work.
    """
    h = 1e-5 * height
    problem: Any = equilibrium.problem
    floor, roof = problem.walls

    def energy(k: int) -> float:
        changed = problem.with_changes(walls=(floor, replace(roof, point=(0.0, height + k * h, 0.0))))
        near = solve_from(
            changed,
            equilibrium.x,
            warm=(equilibrium.rows, equilibrium.multipliers),
            options={"tol": 1e-12},
            check=False,
        )
        if near.residual > 1e-8:
            raise AssertionError(f"{experiment}, H = {height + k * h}: {near.message}")
        return near.energy.total

    near = [energy(k) for k in (-2, -1, 1, 2)]
    return -(near[0] - 8.0 * near[1] + 8.0 * near[2] - near[3]) / (12.0 * h) / press(equilibrium) - 1.0


def imbalance(experiment: Experiment, equilibrium: Equilibrium) -> float:
    """Largest component of the sum of clamps, floor, roof and weight, relative to the roof's force."""
    assert equilibrium.end_support is not None
    pushed = [wall.force for wall in equilibrium.walls] + [equilibrium.start.force, equilibrium.end_support.force]
    return float(np.abs(np.sum(pushed, axis=0) - [0.0, experiment.gamma, 0.0]).max() / press(equilibrium))


def plate(experiment: Experiment, equilibrium: Equilibrium, height: float) -> tuple[float, float]:
    """A pressure plate on a spring in place of the roof: its height and its force, each over the roof's, - 1.

    The spring is at rest at H - F / k and gives way by F / k.
    """
    force = press(equilibrium)
    stiffness = 10.0 * force / height
    segments = equilibrium.problem.lengths.size
    sprung = switch(experiment.problem(height - force / stiffness, segments, stiffness), equilibrium)
    given = sprung.walls[1].height
    if not sprung.ok or given is None:
        raise AssertionError(f"pressure plate, H = {height:.4f}: {sprung.message}")
    if abs(stiffness * given / press(sprung) + 1.0) > 1e-8:
        raise AssertionError(f"pressure plate: force {press(sprung)}, spring {-stiffness * given}")
    return (height - force / stiffness - given) / height - 1.0, press(sprung) / force - 1.0


def _off(gamma: float, scaled: float, count: int, segments: int) -> float:
    """Force of the ribbon's line contacts over the elastica's, - 1."""
    exact = line_contact(scaled / count, DELTA, gamma, count)
    equilibrium = Experiment(gamma=gamma).folded(count, scaled / count, segments)
    seen = folds(equilibrium, scaled / count)
    if not equilibrium.ok or (seen.count, seen.kind(1.01 / segments)) != (count, "line"):
        raise AssertionError(f"{count} folds, NH = {scaled}, p = {segments}: {equilibrium.message}, {seen}")
    return press(equilibrium) / (exact.force * count) - 1.0


def _broken(scaled: float, count: int) -> float:
    """By how much the weight breaks the law F(H / N) = N^3 F(H) of the elastica."""
    one = line_contact(scaled, DELTA, GAMMA).force
    return line_contact(scaled / count, DELTA, GAMMA, count).force / count**2 / one - 1.0


PROBES = {
    "off_1_60": lambda: _off(GAMMA, 0.19, 1, 60),
    "broken_2": lambda: _broken(0.19, 2),
    "broken_3": lambda: _broken(0.19, 3),
    "height": lambda: free_height(DELTA),
}


def _elastica_part() -> tuple[str, str, dict[str, Number]]:
    """Table of the force of N folds against the elastica, what it says of the law, and the numbers."""
    rows, law, off = [], [], {}
    for gamma, scaled in itertools.product((0.0, GAMMA), (0.19, 0.185, 0.1815)):
        one = line_contact(scaled, DELTA, gamma)
        for count in (1, 2, 3):
            exact = line_contact(scaled / count, DELTA, gamma, count)
            force = exact.force * count
            errors = [_off(gamma, scaled, count, segments) for segments in (60, 120, 240)]
            off[count] = max(off.get(count, 0.0), abs(errors[-1]))
            if abs(errors[-1]) * exact.force / count**2 > 5e-3 * FLAT_FORCE:
                raise AssertionError(f"{count} folds, NH = {scaled}, Gamma = {gamma}: off the elastica by {errors[-1]}")
            same = line_contact(scaled, DELTA, gamma / count**3).force
            law.append((gamma, scaled, count, force / count**3 / one.force - 1.0, force / count**3 / same - 1.0))
            rows.append([
                f"{gamma:g}", f"{scaled:g}", str(count), f"{force:.4f}", f"{force / count**3:.4f}",
                *(f"{e:+.1e}" for e in errors), f"{law[-1][3]:+.1e}", f"{law[-1][4]:+.0e}",
            ])  # fmt: skip
    worst = {g: max(abs(v) for gamma, _, _, v, _ in law if gamma == g) for g in (0.0, GAMMA)}
    if worst[0.0] > 1e-8 or max(abs(v[4]) for v in law) > 1e-8:
        raise AssertionError(f"the law does not hold for the elastica: {law}")
    heads = [
        "Gamma", "N H", "N", "F, elastica", "F / N^3", "ribbon, p = 60", "p = 120", "p = 240", "F / (N^3 F_1) - 1",
        "the same with Gamma / N^3 for F_1",
    ]  # fmt: skip
    words = (
        f"Without weight the law is exact. The weight Gamma = {GAMMA:g} breaks it by up to {100 * worst[GAMMA]:.0f} % "
        "of F here (it carries part of one fold, and N^3 times less of N folds): what scales is (F, Gamma) together, "
        "F(H / N; Gamma) = N^3 F(H; Gamma / N^3), to rounding."
    )
    broken = sorted(v for gamma, _, count, v, _ in law if gamma == GAMMA and count > 1)
    numbers = {f"off_{count}": Number(value, SOLVED, shown=".1e") for count, value in off.items()}
    numbers |= {f"broken_{count}": Number(_broken(0.19, count), SHOT, shown="+.1e") for count in (2, 3)}
    return (
        page.table(heads, rows),
        words,
        numbers
        | {
            "off_1_60": Number(_off(GAMMA, 0.19, 1, 60), SOLVED, shown=".1e"),
            "broken_least": Number(broken[0], SHOT, shown="+.1e"),
            "broken_most": Number(broken[-1], SHOT, shown="+.1e"),
            "law": rounding(max(abs(v[4]) for v in law)),
        },
    )


def _plane_part() -> str:
    rows = []
    for count, scaled in ((1, 0.17), (1, 0.16), (2, 0.17)):
        exact = plane_contact(scaled / count, DELTA, count)
        force = exact.force * count
        errors = []
        for segments in (60, 120, 240):
            equilibrium = Experiment(gamma=0.0).folded(count, scaled / count, segments)
            errors.append(f"{press(equilibrium) / force - 1.0:+.1e}" if equilibrium.ok else equilibrium.status.code)
        flat = 1.0 - 2.0 * count * exact.length
        if not abs(press(equilibrium) / force - 1.0) < 3e-3:
            raise AssertionError(f"plane contact, N = {count}, N H = {scaled}: off the elastica")
        rows.append([f"{scaled:g}", str(count), f"{flat:.4f}", f"{force:.4f}", f"{force / count**3:.4f}", *errors])
    heads = ["N H", "N", "flat length / l", "F, elastica", "F / N^3", "ribbon, p = 60", "p = 120", "p = 240"]
    return page.table(heads, rows)


def _checks_part() -> tuple[str, float]:
    """The table, and the largest of what virtual work misses."""
    rows, worst = [], 0.0
    for count, height in ((1, 0.185), (1, 0.16), (2, 0.0925), (3, 0.0617)):
        experiment = Experiment()
        equilibrium = experiment.folded(count, height, 120)
        work, balance = virtual_work(experiment, equilibrium, height), imbalance(experiment, equilibrium)
        where, force = plate(experiment, equilibrium, height)
        if not equilibrium.ok or abs(work) > 1e-6 or max(balance, abs(where), abs(force)) > 1e-8:
            raise AssertionError(f"H = {height}: work {work}, balance {balance}, plate {where}, {force}")
        worst = max(worst, abs(work))
        kind = folds(equilibrium, height).kind(1.01 / 120)
        rows.append([
            f"{height:g}", str(count), kind, f"{press(equilibrium):.4f}", f"{work:.0e}", f"{balance:.0e}",
            f"{where:.0e}", f"{force:.0e}",
        ])  # fmt: skip
    heads = ["H", "N", "contact", "F", "-dE/dH / F - 1", "imbalance / F", "plate: H", "plate: F"]
    return page.table(heads, rows), worst


@dataclass(frozen=True)
class Point:
    """N folds at height H under line contact: Delta, N, k H N, k F / (N^3 w), with w in l and F per unit width."""

    delta: float
    count: int
    height: float
    force: float


def _collapse(step: float = 0.01) -> list[Point]:
    points = []
    for delta, count in itertools.product(COLLAPSE, (1, 2, 3)):
        experiment = Experiment(delta)
        k = 1.0 / free_height(delta)
        found: Equilibrium | None = None
        for share in np.arange(0.985, 0.905, -step):
            height = float(share) / (k * count)
            found = (
                experiment.folded(count, height, 120)
                if found is None
                else switch(experiment.problem(height, 120), found)
            )
            seen = folds(found, height)
            if not found.ok or seen.count != count:
                raise AssertionError(f"Delta = {delta}, N = {count}, H = {height:.4f}: {found.message}")
            if seen.kind(1.01 / 120) == "line":
                points.append(Point(delta, count, float(share), k * press(found) / count**3))
    return points


def master(share: float) -> float:
    """k F of one weightless fold at k H = `share` in the limit of small Delta (k = pi / (2 sqrt(Delta)))."""

    # y' = C (1 - cos(mu s') / cos a), a = mu L / 2, L = 1/2
    def height(a: float) -> float:
        mean = 1.0 - 2.0 * math.tan(a) / a + (0.5 + 0.25 * math.sin(2.0 * a) / a) / math.cos(a) ** 2
        return 0.5 * math.pi * 0.5 * (1.0 - math.tan(a) / a) / math.sqrt(0.5 * mean)

    a = scipy.optimize.brentq(lambda v: height(v) - share, 0.5 * math.pi + 1e-9, math.pi)
    mean = 1.0 - 2.0 * math.tan(a) / a + (0.5 + 0.25 * math.sin(2.0 * a) / a) / math.cos(a) ** 2
    return 0.5 * math.pi * 2.0 * (4.0 * a) ** 2 / math.sqrt(0.5 * mean)


def _height_part() -> str:
    rows = []
    for delta in COLLAPSE:
        exact = free_height(delta)
        six, fourth = thesis_height(delta), thesis_height(delta, EXACT_FOURTH)
        heavy = float(Experiment(delta).arch().middle.position[1])
        rows.append([
            f"{delta:.2f}", f"{exact:.6f}", f"{heavy:.6f}", f"{six:.6f} ({six / exact - 1:+.1%})",
            f"{fourth:.6f} ({fourth / exact - 1:+.1%})", f"{1 / exact:.4f}",
        ])  # fmt: skip
    heads = ["Delta", "H_0: K, E", f"ribbon, Gamma = {GAMMA:g}", "with 6 H^4", "with 5 pi^4/128 H^4", "k = 1 / H_0"]
    return page.table(heads, rows)


KINDS = {"line": "o", "plane": "s", "hanging": "x"}


def _draw(
    path: Path, way: LoadPath, back: LoadPath, points: list[Point], shapes: list[tuple[float, Equilibrium]]
) -> None:
    figure, axes = plt.subplots(2, 2, figsize=(13, 9.5))
    colours = {n: f"C{n - 1}" for n in range(1, 9)}
    first, second, third, fourth = axes.ravel()
    for record in way.records:
        first.plot(record.height, record.force, KINDS[record.kind], color=colours[record.count], ms=4, mfc="none")
        scaled = record.height * record.count, record.force / record.count**3
        second.plot(*scaled, KINDS[record.kind], color=colours[record.count], ms=4, mfc="none")
    first.plot([r.height for r in back.records], [max(r.force, 1e-2) for r in back.records], "k:", label="raised again")
    first.set(xlabel="height of the roof H / l", ylabel="force on the roof F (D w / l^2)", yscale="log", ylim=(1, 1e5))
    first.set_title(f"Delta = {DELTA}, Gamma = {GAMMA:g}: algorithm 3")
    for count, colour in colours.items():
        if any(r.count == count for r in way.records):
            first.plot([], [], "o", color=colour, label=f"N = {count}")
    for kind, marker in KINDS.items():
        first.plot([], [], marker, color="0.4", mfc="none", label=kind)
    first.legend(fontsize=8)
    limit = flat_from(DELTA)
    heights = np.linspace(limit, 0.9999 * free_height(DELTA), 40)
    second.plot(heights, [line_contact(float(h), DELTA).force for h in heights], "k-", lw=1, label="elastica, lines")
    heights = np.linspace(0.13, limit, 30)
    second.plot(heights, [plane_contact(float(h), DELTA).force for h in heights], "k--", lw=1, label="elastica, planes")
    second.set(xlabel="N H / l", ylabel="F / N^3", xlim=(0.12, 0.24), ylim=(0, 500), title="F(H/N) = N^3 F(H)")
    second.legend(fontsize=8)
    for k, delta in enumerate(COLLAPSE):
        for count, marker in ((1, "o"), (2, "^"), (3, "s")):
            some = np.array([(p.height, p.force) for p in points if (p.delta, p.count) == (delta, count)])
            label = f"Delta = {delta}" if count == 1 else None
            third.plot(*some.T, marker, color=f"C{k}", ms=4, mfc="none", label=label)
    shares = np.linspace(math.sqrt(math.pi**2 / 12.0) + 1e-6, 0.9999, 50)
    third.plot(shares, [master(float(v)) for v in shares], "k-", lw=1, label="Delta -> 0, no weight")
    third.set(
        xlabel="k(Delta) N H", ylabel="k(Delta) F / N^3", title="collapse over Delta, lines (o, ^, s: N = 1, 2, 3)"
    )
    third.legend(fontsize=8)
    s = np.linspace(0.0, 1.0, 1001)
    for k, (height, found) in enumerate(shapes):
        r = found.position(s)
        base = -0.24 * k
        fourth.plot(r[:, 2], r[:, 1] + base, color="tab:blue", lw=1.2)
        fourth.plot([-0.02, 0.92], [base, base], color="0.6", lw=0.8)
        fourth.plot([-0.02, 0.92], [base + height, base + height], color="0.6", lw=0.8)
        for wall, level in zip(found.walls, (base, base + height), strict=True):
            at = found.position(wall.contacts)
            fourth.plot(at[:, 2], np.full(len(at), level), ".", color="tab:green", ms=5)
        fourth.text(0.94, base, f"H = {height:.3f}\nF = {press(found):.0f}", fontsize=8)
    fourth.set(aspect="equal", xlim=(-0.04, 1.12), title="shapes; green: joints in contact")
    fourth.set_axis_off()
    figure.tight_layout()
    figure.savefig(path, dpi=100)
    plt.close(figure)


def flat_from(delta: float) -> float:
    """Height below which the contact of one weightless fold is a plane: no curvature where it touches."""
    high = free_height(delta)
    return float(scipy.optimize.brentq(lambda h: line_contact(h, delta).low, 0.88 * high, 0.98 * high, xtol=1e-7))


def _path_part(way: LoadPath, back: LoadPath) -> str:
    parts = []
    for count, group in itertools.groupby(way.records, key=lambda r: r.count):
        states = list(group)
        kinds = ", ".join(f"{kind} {sum(r.kind == kind for r in states)}" for kind in KINDS)
        parts.append([
            str(count), f"{states[0].height:.4f} to {states[-1].height:.4f}",
            f"{states[0].height * count:.4f} to {states[-1].height * count:.4f}", kinds,
            f"{max(r.force for r in states) / count**3:.1f}", f"{states[0].energy:.2f} to {states[-1].energy:.2f}",
        ])  # fmt: skip
    table = page.table(["N", "H", "N H", "states by contact", "largest F / N^3", "energy"], parts)
    snaps = [
        f"- H = {b.height:.4f}: N = {a.count} to {b.count}, F = {a.force:.0f} to {b.force:.0f}, energy "
        f"{a.energy:.2f} to {b.energy:.2f}"
        for a, b in itertools.pairwise(way.records)
        if b.count != a.count
    ]
    returns = [
        f"- going up, H = {b.height:.4f}: N = {a.count} to {b.count}, F = {a.force:.1f} to {b.force:.1f}"
        for a, b in itertools.pairwise(back.records)
        if b.count != a.count
    ]
    return "\n\n".join([table, "Snaps:", "\n".join(snaps + returns)])


def _reached(path: LoadPath) -> str:
    """How far the roof came down."""
    if path.reaches(LOWEST):
        return f"The roof comes down to i = {LOWEST}."
    return (
        f"**The way down ends at i = {path.exponent:.3f} of {LOWEST}**, with {path.records[-1].count} folds, where the "
        f"strip would snap: the next state is not found ({path.last.message}). With heights that differ by less than a "
        "step it goes on, to eight folds ([states](roman_states/README.md)): a jump is found or not by chance."
    )


def _collapse_part(points: list[Point]) -> str:
    full = master(math.sqrt(math.pi**2 / 12.0) + 1e-9)
    rows = []
    for delta in COLLAPSE:
        row = [f"{delta:.2f}"]
        for count in (1, 2, 3):
            off = [(p.force - master(p.height)) / full for p in points if (p.delta, p.count) == (delta, count)]
            row.append(f"{len(off)}: {min(off):+.1%} to {max(off):+.1%}")
        for share in (0.98, 0.95, 0.92):
            height = share * free_height(delta)
            row.append(f"{(line_contact(height, delta).force / free_height(delta) - master(share)) / full:+.1%}")
        rows.append(row)
    heads = ["Delta", "N = 1", "N = 2", "N = 3", "elastica, k N H = 0.98", "0.95", "0.92"]
    return page.table(heads, rows)


def run(out: Path) -> dict[str, Number]:
    experiment = Experiment()
    forces, law, numbers = _elastica_part()
    checks, work = _checks_part()
    points = _collapse()
    path = lower(experiment, STEP, LOWEST)
    counts = [record.count for record in path.records]
    if counts != sorted(counts) or max(counts) < (4 if path.reaches(LOWEST) else 3):
        raise AssertionError(f"folds on the way down: {counts}")
    back = raise_again(experiment, 2, 0.0925, 0.999 * path.top, STEP, SEGMENTS)
    shapes = []
    for count, height in ((1, 0.185), (1, 0.15), (2, 0.105), (2, 0.0925), (3, 0.0617), (4, 0.0462)):
        shapes.append((height, experiment.folded(count, height, 120)))
    _draw(out / "roman.png", path, back, points, shapes)
    page.write(
        out / "roman.md", "Roman's confined strip (6.2.2)", "python -m tests.validation roman",
        _reached(path),
        "The heights at which the strip snaps do not settle here: they are of one mesh and of one way down, in steps "
        f"of {100 * STEP:.0f} % of the height, without an error. Forces stand on three meshes beside the elastica. "
        f"Algorithm 3: clamps at the origin and at (0, 0, 1 - Delta), same frame; w = {WIDTH}, nu = {POISSON}, "
        f"Gamma = {GAMMA:g}, floor at -{EPSILON:g}, Wunderlich's energy; H: height of the roof; F: sum of the "
        "roof's multipliers (units of l and D w / l^2). N: how often the centreline rises through H / 2. Contact: "
        "line where every fold and every valley touches on at most one segment, plane where one does so on more, "
        "hanging where a fold or a valley does not touch.",
        f"Departures from algorithm 3: {SEGMENTS} segments at first instead of 100 (120 have joints where 1, 2, 3 "
        f"and 5 equal folds touch, 100 have not), the exponent of the lowering in steps of {STEP} to {LOWEST} "
        f"instead of 0.01 to {LAST}, for the time it takes.",
        "## Force of line contacts against Roman's elastica",
        "Half wave of length 1 / (2 N), reach (1 - Delta) / (2 N), height H, by shooting (scipy, 1e-12), weight "
        "included: theta'' = (q - Gamma s) cos theta - p sin theta. It multiplies cos theta with the vertical "
        "force and sin theta with the horizontal one; under eq. 6.3 the thesis names them the other way round "
        "(there p, with sin theta, is called the force on the plate; p = 0 would then leave no buckled arch). A "
        "fold has two half waves: F = 2 N q at the roof. Ribbon: F over the elastica's, - 1. Last but one column: "
        "the law F(H / N) = N^3 F(H).",
        forces, law,
        "## Plane contact (weightless)",
        "The elastica with flat parts: no moment where it leaves them, the flat parts take the rest of the length, in "
        "whatever shares. The law holds there too: F / N^3 depends on N H only. How far down this goes is "
        "another matter (the snaps below).",
        _plane_part(),
        "## Multipliers, virtual work, balance, pressure plate (120 segments)",
        "-dE/dH by central differences of fourth order; balance of both clamps, floor, roof and weight; a plate "
        "on a spring of stiffness 10 F / H at rest at H - F / stiffness: its height and force over the roof's, - "
        "1.",
        checks,
        f"## Lowering the roof, Delta = {DELTA}", _path_part(path, back),
        "## Height without force, and k",
        "k N H = 1 where F = 0, so that k = 1 / H_0(Delta). Eq. 6.5 as printed has the same Delta above and "
        "below, so that it does not depend on it; with 0.1 above it reads k(Delta) = H_0(0.1) / (H_0 H_0(Delta)), "
        "which is 1 / H_0(Delta). The elliptic integrals give H_0 = k / K(k), Delta = 2 (1 - E / K): Delta = "
        "pi^2/4 H^2 + 5 pi^4/128 H^4 + ..., 3.81 and not 6 for the coefficient that the thesis found by eye; 6 "
        "stands in for the higher orders, too.",
        _height_part(),
        "## Collapse over Delta",
        "k F / N^3 of line contacts (120 segments, Gamma as above, N equal folds from a seed, then lowered) minus "
        "the small-slope elastica's master curve, in parts of its largest value (573, where planes begin): number "
        "of states, least and largest. Multiplying F by k is exact for small Delta without weight (heights and "
        "forces both go as the root of Delta); the last columns show what is left of it at this Delta without "
        "weight.",
        _collapse_part(points), "![force, laws, shapes](roman.png)",
    )  # fmt: skip
    return numbers | {
        "work": rounding(work),
        "height": Number(free_height(DELTA), 1e-12, "l", ".6f"),
        "snaps": Number(len({record.count for record in path.records}) - 1, 0, shown="d"),
        "exponent": Number(path.exponent, None, shown=".3f", why="where one way down ends"),
    }
