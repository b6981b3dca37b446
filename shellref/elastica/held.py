"""From a natural shape to the problem, along a `LoadPath`: by arc length, or by plain steps that stop at limit points.

The way begins where nothing pulls: no loads, and the held end and the given angles where the natural shape has them. A
strip without natural curvature between two held points would begin straight and taut, where its support's force is not
determined; its way begins with a natural curvature of its own, `ElasticaOptions.bow`, that is gone at the end (the sign
chooses the side to which it bends).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ribbonbench import clock
from shellref import law
from shellref.elastica.arc import ArcOptions, Branch, Point, point_at, states_at, switch, trace
from shellref.elastica.path import ElasticaOptions
from shellref.elastica.problem import Array, ElasticaProblem, LoadPath
from shellref.elastica.system import System

TAUT = 0.999
"""Chord of the natural shape, over the length, from which it counts as straight."""

BEYOND = 2.0
"""How far the path is followed, over the way, when it arrives unstable."""

FLAT = 0.1
"""Share of dt/dsigma left, below which the end of plain steps is taken for a limit point."""


@dataclass(frozen=True)
class Arrival:
    """Where the way ended: the last point, counts, and `stopped`: "", "limit" or "failed"."""

    system: System
    point: Point
    iterations: int
    steps: int
    limits: int
    switches: int
    stopped: str


def suitable_bow(problem: ElasticaProblem) -> float:
    """Curvature of an arc that leaves the start at its angle and turns as the end asks; 2 when that is too little."""
    turn = 0.0
    if problem.start_angle is not None and problem.end_angle is not None:
        turn = problem.end_angle - problem.start_angle
    elif problem.start_angle is not None and problem.end is not None:
        aim = math.atan2(problem.end[1], problem.end[0]) - problem.start_angle
        turn = 2.0 * math.remainder(aim, 2.0 * math.pi)
    return max(-6.0, min(6.0, turn)) if abs(turn) > 0.5 else 2.0


def path_to(problem: ElasticaProblem, bow: float | None = None) -> LoadPath:
    """The way that begins at the natural shape of `problem`, or of one bent by `bow` when that is straight."""
    curvature = problem.curvature
    chord = problem.natural_chord()
    if len(problem.normals) == 2 and abs(chord) > TAUT:
        bow = suitable_bow(problem) if bow is None else bow
        curvature = law.shifted(curvature, bow)
        chord = replace(problem, curvature=curvature).natural_chord()
    start = problem.start_angle
    if start is None and problem.end is not None:  # turned so that the chord points at the end
        start = math.atan2(problem.end[1], problem.end[0]) - math.atan2(chord.imag, chord.real)
    chord *= complex(math.cos(start or 0.0), math.sin(start or 0.0))
    first = replace(
        problem,
        gamma=0.0,
        force=(0.0, 0.0),
        curvature=curvature,
        end=None if problem.end is None else (chord.real, chord.imag),
        end_angle=None if problem.end_angle is None else (start or 0.0) + float(law.integral(curvature, 1.0)),
    )
    return LoadPath(first, problem)


def natural_state(system: System) -> Array:
    """z (N + m,) of the way's first problem: the natural shape, no force at the end."""
    first = system.way.at(0.0)
    start = first.start_angle
    if start is None:
        assert first.end is not None  # `ElasticaProblem` sees to it
        chord = first.natural_chord()
        start = math.atan2(first.end[1], first.end[0]) - math.atan2(chord.imag, chord.real)
    z = np.zeros(system.size)
    z[: system.count] = system.discrete.projected(start + first.natural_turn(system.discrete.s))
    return z


def drive(
    problem: ElasticaProblem, nodes: Array, degree: int, hermite: bool, tolerance: float, options: ElasticaOptions
) -> Arrival:
    """The end of the way to `problem`; `options.arc_length` "never" takes plain steps, anything else arc length."""
    system = System(nodes, degree, path_to(problem, options.bow), hermite)
    arc = ArcOptions(tolerance=tolerance, steps=options.arc_steps)
    natural = natural_state(system)
    start = point_at(system, natural, 0.0, arc)
    if start is None:
        return not_begun(system, natural)
    if options.arc_length == "never":
        return plain_steps(system, start, tolerance, options)
    branch = trace(system, start, 1.0, (-1.0, 1.0), arc)
    return best_end(system, branch, arc, options)


def not_begun(system: System, z: Array) -> Arrival:
    """The way that cannot begin at z (N + m,): it is no equilibrium, or its tangent is singular."""
    norm, values = system.norm(system.residual(z, 0.0)), system.eigenpairs(z, 0.0)[0]
    point = Point(0.0, z, (np.zeros_like(z), 0.0), values, norm, 0, system.rounding(z, 0.0))
    return Arrival(system, point, 0, 0, 0, 0, "failed")


def best_end(system: System, branch: Branch, arc: ArcOptions, options: ElasticaOptions) -> Arrival:
    """The path's end; when that is unstable, the stable end of a branch that leaves the path, or a stable state where
    the path, followed beyond its end, comes back to it; if there is one. An end at a fold or a bifurcation is left as
    it is: on which side of the last step the event lies, rounding decides."""
    iterations, switches = branch.iterations, 0
    chosen = branch
    if options.switch and branch.points[-1].stable is False:
        for event in branch.bifurcations():
            points = switch(system, event, arc)
            for point in points[::-1] if (options.bow or 0.0) < 0.0 else points:
                other = trace(system, point, math.copysign(1.0, point.tangent[1]), (-1.0, 1.0), arc)
                iterations += other.iterations
                if other.ended == "reached" and other.points[-1].stable is True:
                    chosen, switches = other, 1
                    break
            if switches:
                break
    stopped = "" if chosen.ended == "reached" else "failed"
    steps = len(branch.points) - 1 + (len(chosen.points) if switches else 0)
    limits = len(branch.limits()) + (len(chosen.limits()) if switches else 0)
    end = chosen.points[-1]
    if options.switch and not stopped and end.stable is False:
        beyond = trace(system, end, 1.0, (-1.0, BEYOND), arc)
        iterations, steps = iterations + beyond.iterations, steps + len(beyond.points) - 1
        back = [point for point in states_at(system, beyond, np.array([1.0]), arc)[0] if point.stable is True]
        if back:
            end, limits = back[0], limits + len(beyond.limits())
    return Arrival(system, end, iterations, steps, limits, switches, stopped)


def plain_steps(system: System, start: Point, tolerance: float, options: ElasticaOptions) -> Arrival:
    """Steps in t, shorter after a failure, until they end at 1 or cannot go on."""
    point, step, steps, spent = start, 0.1, 0, 0
    steepest = abs(start.tangent[1])
    while point.t < 1.0:
        if clock.spent():
            return Arrival(system, point, spent, steps, 0, 0, "failed")
        t = min(1.0, point.t + step)
        solved = system.newton(point.z, t, tolerance, options.iterations, most_turn=1.0)
        spent += solved.iterations
        found = None if solved.z is None else point_at(system, solved.z, t, ArcOptions(tolerance=tolerance))
        if found is None or found.unstable > point.unstable:
            step *= options.cut
            if step > options.smallest * 1e-2:
                continue
            flat = abs(point.tangent[1]) < FLAT * steepest or abs(point.eigenvalues[0]) < FLAT
            return Arrival(system, point, spent, steps, 0, 0, "limit" if flat else "failed")
        point, steps = found, steps + 1
        steepest = max(steepest, abs(point.tangent[1]))
        if solved.iterations <= 5:
            step = min(step * options.growth, 0.25)
    return Arrival(system, point, spent, steps, 0, 0, "")
