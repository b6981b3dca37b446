"""Which of several minima: those that the segments make, those that the ribbon has, and the lowest of what was seen.

Where the curvature passes zero and the strip is twisted, the ruling flips: omega and eta change sign together, so that
the twist eta omega keeps its own, within a layer about one width long (|eta'| <= 2 / w). Segments longer than that
cannot place it: the discrete energy has a minimum for each segment that may hold the flip (as a dislocation is pinned
by its lattice, R. Peierls 1940, doi:10.1088/0959-5309/52/1/305), and rounding chooses among them. They merge on
segments shorter than the layer; on given ones the lowest stands for all. Changing the signs of omega and eta at a joint
beside a flip moves it by a segment and leaves the twist as it is: such steps are relaxed until none goes down.

What the ribbon itself has (a strip that hangs, or arches) are other states: the built-in starts are all solved, and the
lowest is kept. A seed that was given decides which side is meant (`Sides`); only where it means none, flips
make its answer one of rounding's: then the state with the signs of omega and eta changed everywhere, which has the same
twist, is its rival.

A given seed says by the side to which it bends which of several states is meant. Its rival is the shape with omega and
eta changed in sign, both brought between the clamps (`ribbon.find.seeds.brought`); a state belongs to the nearer one,
in the metric of bending and twist::

    d(u, v)^2 = int (omega_u - omega_v)^2 + (tau_u - tau_v)^2 ds ,    tau = eta omega

A minimiser's long steps may change the side although the seed's own side has a state. Where that is seen the way is
gone again by short steps (`ribbon.solvers.newton_rows`, "reach"): a Levenberg-Marquardt path, which in the limit of
short steps is the steepest descent along the rows, and ends in the basin that it begins in (Nocedal and Wright 2006,
4.1 and 10.3). What it leads to is the answer, and `Equilibrium.branch` says what that is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ribbon.find import probe, relax, seeds
from ribbon.problems import transfer
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.result import Branch, Equilibrium, Minima
from ribbon.solvers import choose
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, FloatArray, Minimum, force_scale

#: Least change of eta across a segment that counts as a flip of the ruling.
FLIP = 0.3
#: Segments up to which flips are moved; with more it is done on joined ones, and the shape refined.
MOVED = 40
#: Most relaxations of moved flips for one solve.
MOST_TRIES = 60
#: Difference of energies, relative (at least 1), up to which they are the same; that of positions (l).
SAME_ENERGY = 1e-9
_SAME_PLACE = 1e-5
#: How steep rulings may be after a move, over the bound.
_STEEP = 0.95

#: Barrier and iterations of a start beside the first.
_BESIDE = {"mu_init": 1e-3, "max_iter": 250}
#: The same of a probe, which is cheap or nothing.
_PROBE = {**_BESIDE, "max_iter": 80}
#: How much nearer the rival has to be, over the distance of both seeds; distance to the seed (over its size) within
#: which no rival is looked for.
_NEARER, _OWN = 0.25, 0.3
#: Size of the given shape, over that between the clamps and alone, below which it means no side.
_MEANT, _STRAIGHT = 0.3, 0.1
#: Reach, barrier and steps between looks at the side of the way that is gone again, and its steps at the most.
_WAY: dict[str, Any] = {"reach": 0.3, "mu_init": 1e-5, "max_iter": 20}
_STEPS = 300

Shape = tuple[FloatArray, FloatArray]
Relaxed = Callable[[Problem, FloatArray], Equilibrium]


@dataclass
class Seen:
    """Distinct minima on one set of segments: energies and joints (p + 1, 3); tries: solves that looked for them."""

    energies: list[float] = field(default_factory=list)
    places: list[FloatArray] = field(default_factory=list)
    tries: int = 0

    def add(self, problem: Problem, x: FloatArray) -> float:
        """A minimum at which a search ended; its energy."""
        energy, positions = problem.value(x), problem.joints(x)[0]
        for known, there in zip(self.energies, self.places, strict=True):
            close = abs(known - energy) <= SAME_ENERGY * max(force_scale(problem), abs(energy))
            if close and float(np.abs(there - positions).max()) <= _SAME_PLACE:
                return energy
        self.energies.append(energy)
        self.places.append(positions)
        return energy


def lower(one: float, other: float) -> bool:
    """Whether an energy is lower than another beyond rounding."""
    return one < other - SAME_ENERGY * max(1.0, abs(other))


def has_several(problem: Problem) -> bool:
    """Whether a ribbon may rest in several ways for its clamps alone: both ends held, in the glued model."""
    return problem.end is not None and problem.formulation == "mixed"


def flips(problem: Problem, x: FloatArray) -> list[int]:
    """Segments in which omega and eta change sign together, eta by more than FLIP."""
    if problem.fields.free:
        return []
    omega, eta = problem.joint_values(x)
    turned = (omega[:-1] * omega[1:] < 0.0) & (eta[:-1] * eta[1:] < 0.0) & (np.abs(np.diff(eta)) > FLIP)
    return [int(i) for i in np.nonzero(turned)[0]]


def lowest(
    state: Equilibrium,
    others: Iterable[tuple[FloatArray, FloatArray]],
    relaxed: Relaxed,
    sides: Sides | None = None,
    probing: bool = False,
) -> Equilibrium:
    """The lowest state of those that are reached from `state`, with what was seen in its `minima`.

    others: further starts, omega and eta (p + 1,) at the joints; relaxed: solves from a shape that is near; sides: of
    the seed that was given, where it means one: what lies on the other is no rival; probing: whether what
    `ribbon.find.probe` begins with is asked too. A ribbon that is held at one end, and a state without flips where
    there are no further starts, cost nothing.
    """
    if not state.ok or not has_several(state.problem):
        return state
    problem: MixedProblem = state.problem  # type: ignore[assignment]
    few = problem
    while few.lengths.size > MOVED:
        few = few.with_changes(lengths=transfer.merged(few.lengths))
    x = state.x if few is problem else None
    seen = Seen()
    for omega, eta in others:
        x = _few(few, state) if x is None else x
        if x is None or spent():
            return state
        seen.tries += 1
        start = few.state(*transfer.resampled(omega, eta, problem.lengths, few.lengths))
        beside = relax.once(few, start, _BESIDE)
        if beside.residual > RESIDUAL_TOLERANCE:
            continue
        here = seen.add(few, x)
        there = seen.add(few, beside.x)
        if lower(there, here):
            better = relaxed(problem, beside.x if few is problem else transfer.transferred(few, beside.x, problem))
            if better.ok and not lower(state.energy.total, better.energy.total):  # walls may have pushed it back
                state, x = replace(better, iterations=state.iterations + better.iterations), beside.x
    told, flipped = bool(seen.energies), bool(flips(problem, state.x))
    if flipped:
        x = _few(few, state) if x is None else x
        if x is None:
            return state
        state, x = _placed(state, few, x, seen, relaxed, sides)
        told = True
    if probing and not spent():
        x = _few(few, state) if x is None else x
        if x is None:
            return state
        y, told = _probed(few, x, seen), True
        if lower(few.value(y), few.value(x)):
            better = relaxed(problem, y if few is problem else transfer.transferred(few, y, problem))
            if better.ok and not lower(state.energy.total, better.energy.total):
                state, x = replace(better, iterations=state.iterations + better.iterations), y
                flipped = bool(flips(problem, state.x))
                if flipped:
                    state, x = _placed(state, few, x, seen, relaxed, sides)
    return state if x is None or not told else _told(state, seen, few, x, flipped)


def _placed(
    state: Equilibrium, few: MixedProblem, x: FloatArray, seen: Seen, relaxed: Relaxed, sides: Sides | None
) -> tuple[Equilibrium, FloatArray]:
    """The state, x on few segments, with its flips where the segments have them lowest."""
    problem: MixedProblem = state.problem  # type: ignore[assignment]
    y = _moved_down(few, x, seen)
    if sides is None:
        omega, eta = few.joint_values(y)
        seen.tries += 1
        rival = relax.from_near(few, few.state(-omega, -eta))
        if rival.residual <= RESIDUAL_TOLERANCE:
            z = _moved_down(few, rival.x, seen)
            y = z if lower(few.value(z), few.value(y)) else y
    if few is not problem or lower(few.value(y), few.value(x)):
        better = relaxed(problem, y if few is problem else transfer.transferred(few, y, problem))
        if better.ok and not (sides is not None and sides.other(problem, better.x) and state.branch is Branch.OWN):
            return replace(better, iterations=state.iterations + better.iterations, branch=state.branch), y
    return state, x


def _probed(few: MixedProblem, x: FloatArray, seen: Seen) -> FloatArray:
    """The lowest shape that cheap starts lead to; all that was reached is `seen`."""
    best, energy, first = x, seen.add(few, x), x

    def ask(shapes: Iterable[Shape]) -> None:
        nonlocal best, energy
        for shape in shapes:
            if spent():
                return
            seen.tries += 1
            found = relax.once(few, few.state(*shape), dict(_PROBE))
            if found.residual <= RESIDUAL_TOLERANCE:
                there = seen.add(few, found.x)
                if lower(there, energy):
                    best, energy = found.x, there

    ask(probe.images(few, x))
    ask(probe.further(few))
    if best is not first:
        ask(probe.images(few, best, kept=True))
    return best


def _few(few: MixedProblem, state: Equilibrium) -> FloatArray | None:
    """The state on few segments; None where it is not found there."""
    near = relax.from_near(few, transfer.transferred(state.problem, state.x, few))  # type: ignore[arg-type]
    return near.x if near.residual <= RESIDUAL_TOLERANCE else None


def _told(state: Equilibrium, seen: Seen, few: MixedProblem, x: FloatArray, flipped: bool) -> Equilibrium:
    """`state` with what was seen on few segments, where it is x."""
    energies = tuple(sorted(seen.energies))
    told = Minima(energies, seen.add(few, x), int(few.lengths.size), seen.tries, flipped)
    return replace(state, minima=told, message=f"{state.message}; {told}" if len(energies) > 1 else state.message)


def _moved(problem: MixedProblem, x: FloatArray) -> Iterator[tuple[tuple[bool, ...], FloatArray]]:
    """The shapes with one flip moved by one segment, each with the signs of omega, by which it is known."""
    omega, eta = problem.joint_values(x)
    below, above = problem.bounds()
    held = (below == above)[problem.layout.eta]
    steepest = _STEEP / problem.half_width
    for i in flips(problem, x):
        for joint in (i, i + 1):
            if held[joint]:
                continue
            bent, turned = omega.copy(), eta.copy()
            bent[joint], turned[joint] = -omega[joint], -eta[joint]
            if float(np.max(np.abs(np.diff(turned)) / problem.lengths)) < steepest:
                yield tuple(bool(v) for v in bent > 0.0), problem.state(bent, turned)


def _moved_down(problem: MixedProblem, x: FloatArray, seen: Seen) -> FloatArray:
    """The shape from which no move of a flip goes down; all that was reached is `seen`."""
    best = seen.add(problem, x)
    tried = {tuple(bool(v) for v in problem.joint_values(x)[0] > 0.0)}
    goes = True
    while goes:
        goes = False
        for signs, start in _moved(problem, x):
            if signs in tried:
                continue
            if spent() or seen.tries >= MOST_TRIES:
                return x
            tried.add(signs)
            seen.tries += 1
            minimum = relax.from_near(problem, start)
            if minimum.residual > RESIDUAL_TOLERANCE:
                continue
            energy = seen.add(problem, minimum.x)
            if lower(energy, best):
                best, x, goes = energy, minimum.x, True
                break
    return x


class Sides:
    """A seed between its clamps, and its rival, which is fitted when it is first needed.

    given, brought: omega and eta (p + 1,) of the seed, as it was given and between the clamps, where the search began.
    """

    def __init__(self, problem: MixedProblem, given: Shape, brought: Shape) -> None:
        self.problem, self.given, self.brought = problem, given, brought
        self.own = self._strains(brought)
        self.size = self._norm(self.own)
        #: Whether the seed says which side is meant: it is not nearly straight, or all bent by the clamps.
        self.meant = self._norm(self._strains(given)) >= max(_MEANT * self.size, _STRAIGHT)
        self._rival: FloatArray | None = None

    def other(self, problem: Problem, x: FloatArray) -> bool:
        """Whether the shape x of `problem`, on any segments, lies clearly on the rival's side."""
        omega, eta = problem.joint_values(x)
        here = self._strains(transfer.resampled(omega, eta, problem.lengths, self.problem.lengths))
        away = self._norm(here - self.own)
        if not self.meant or away <= _OWN * self.size:
            return False
        if self._rival is None:
            omega, eta = self.given
            self._rival = self._strains(seeds.brought(self.problem, -omega, -eta))
        apart = self._norm(self._rival - self.own)
        return away > self._norm(here - self._rival) + _NEARER * apart

    def _strains(self, shape: Shape) -> FloatArray:
        """omega and tau (2, p + 1) at the joints."""
        omega, eta = shape
        return np.stack([omega, eta if self.problem.fields.free else eta * omega])

    def _norm(self, strains: FloatArray) -> float:
        """Root of the integral of their squares, by the trapezoidal rule."""
        squares = (strains * strains).sum(axis=0)
        return float(np.sqrt(np.sum(0.5 * (squares[1:] + squares[:-1]) * self.problem.lengths)))


def sides(problem: Problem, given: Shape, brought: Shape) -> Sides | None:
    """The sides of a seed; None where it means none: without both ends held, or beside walls, which a fit knows not."""
    if not has_several(problem) or problem.walls or (isinstance(problem, MixedProblem) and problem.apart):
        return None
    both = Sides(problem, given, brought)  # type: ignore[arg-type]
    return both if both.meant else None


def held(state: Equilibrium, of: Sides, relaxed: Relaxed) -> Equilibrium:
    """The state that a seed leads to, with its `branch`; `state` itself where that is on the seed's side.

    relaxed: solves from a shape that is near.
    """
    if not state.ok:
        return state
    if not of.other(state.problem, state.x):
        return replace(state, branch=Branch.OWN)
    if spent():
        return replace(state, branch=Branch.LEFT)
    start = relax.placed(of.problem, *of.brought)
    path = _walked(of, start)
    if path.residual <= RESIDUAL_TOLERANCE:
        walked = relaxed(of.problem, path.x)
        if walked.ok:
            state = replace(walked, iterations=walked.iterations + path.iterations + state.iterations)
    if not of.other(state.problem, state.x):
        return replace(state, branch=Branch.OWN)
    down = of.other(of.problem, path.x) and of.problem.value(path.x) < of.problem.value(start)
    return replace(state, branch=Branch.SLID if down else Branch.LEFT)


def _walked(of: Sides, start: FloatArray) -> Minimum:
    """Where short steps lead from a shape, or where they come to the other side; Newton's, whatever else was asked for:
    it is a start for that."""
    x, steps = start, 0
    with choose.using("newton"):
        while True:
            path = relax.once(of.problem, x, dict(_WAY))
            x, steps = path.x, steps + path.iterations
            if path.residual <= RESIDUAL_TOLERANCE or steps >= _STEPS or spent() or of.other(of.problem, x):
                return replace(path, iterations=steps)
