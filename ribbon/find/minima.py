"""Which of several minima: those that the segments make, those that the ribbon has, and the lowest of what was seen.

Where the curvature passes zero and the strip is twisted, the ruling flips: omega and eta change sign together, so that
the twist eta omega keeps its own, within a layer about one width long (|eta'| <= 2 / w). Segments longer than that
cannot place it: the discrete energy has a minimum for each segment that may hold the flip (as a dislocation is pinned
by its lattice, R. Peierls 1940, doi:10.1088/0959-5309/52/1/305), and rounding chooses among them. They merge on
segments shorter than the layer; on given ones the lowest stands for all. Changing the signs of omega and eta at a joint
beside a flip moves it by a segment and leaves the twist as it is: such steps are relaxed until none goes down.

What the ribbon itself has (a strip that hangs, or arches) are other states: the built-in starts are all solved, and the
lowest is kept. A seed that was given decides, unless flips make its answer one of rounding's: then the state with the
signs of omega and eta changed everywhere, which has the same twist, is its rival.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ribbon.find import relax
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.result import Equilibrium, Minima
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import FloatArray, force_scale

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


def lowest(found: Equilibrium, others: Iterable[tuple[FloatArray, FloatArray]], relaxed: Relaxed) -> Equilibrium:
    """The lowest state of those that are reached from `found`, with what was seen in its `minima`.

    others: further starts, omega and eta (p + 1,) at the joints; relaxed: solves from a shape that is near. A ribbon
    that is held at one end, and a state without flips where there are no further starts, cost nothing.
    """
    if not found.ok or not has_several(found.problem):
        return found
    problem: MixedProblem = found.problem  # type: ignore[assignment]
    few = problem
    while few.lengths.size > MOVED:
        few = few.with_changes(lengths=relax.merged(few.lengths))
    x = found.x if few is problem else None
    seen = Seen()
    for omega, eta in others:
        x = _few(few, found) if x is None else x
        if x is None or spent():
            return found
        seen.tries += 1
        start = few.state(*relax.resampled(omega, eta, problem.lengths, few.lengths))
        beside = relax.once(few, start, _BESIDE)
        if beside.residual > relax.RESIDUAL_TOLERANCE:
            continue
        here = seen.add(few, x)
        there = seen.add(few, beside.x)
        if lower(there, here):
            better = relaxed(problem, beside.x if few is problem else relax.transferred(few, beside.x, problem))
            if better.ok and not lower(found.energy.total, better.energy.total):  # walls may have pushed it back
                found, x = replace(better, iterations=found.iterations + better.iterations), beside.x
    if not flips(problem, found.x):
        return found if x is None or not seen.energies else _told(found, seen, few, x, False)
    x = _few(few, found) if x is None else x
    if x is None:
        return found
    y = _moved_down(few, x, seen)
    omega, eta = few.joint_values(y)
    seen.tries += 1
    rival = relax.from_near(few, few.state(-omega, -eta))
    if rival.residual <= relax.RESIDUAL_TOLERANCE:
        z = _moved_down(few, rival.x, seen)
        y = z if lower(few.value(z), few.value(y)) else y
    if few is not problem or lower(few.value(y), few.value(x)):
        better = relaxed(problem, y if few is problem else relax.transferred(few, y, problem))
        if better.ok:
            found, x = replace(better, iterations=found.iterations + better.iterations), y
    return _told(found, seen, few, x, True)


def _few(few: MixedProblem, found: Equilibrium) -> FloatArray | None:
    """The state on few segments; None where it is not found there."""
    near = relax.from_near(few, relax.transferred(found.problem, found.x, few))  # type: ignore[arg-type]
    return near.x if near.residual <= relax.RESIDUAL_TOLERANCE else None


def _told(found: Equilibrium, seen: Seen, few: MixedProblem, x: FloatArray, flipped: bool) -> Equilibrium:
    """`found` with what was seen on few segments, where it is x."""
    energies = tuple(sorted(seen.energies))
    told = Minima(energies, seen.add(few, x), int(few.lengths.size), seen.tries, flipped)
    return replace(found, minima=told, message=f"{found.message}; {told}" if len(energies) > 1 else found.message)


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
            found = relax.from_near(problem, start)
            if found.residual > relax.RESIDUAL_TOLERANCE:
                continue
            energy = seen.add(problem, found.x)
            if lower(energy, best):
                best, x, goes = energy, found.x, True
                break
    return x
