"""What is refused before anything is computed: numbers beyond what is known to work, and what contradicts itself.

Every function raises `RibbonInputError`, naming the argument of `ribbon.solve`, and returns nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbon.contact import Barrier, Wall
from ribbon.errors import RibbonInputError
from ribbon.find import relax
from ribbon.find.solving.request import Request, Seed
from ribbon.judge import nearness
from ribbon.obstacle import Obstacle
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.solid import Face, Solid
from ribbon.strip import check_known, known
from ribbonbench import statics

#: Least distance (l) that parts of a strip are kept apart by: ten times what may be missed of it, and more.
_LEAST_APART = 1e-4
#: Part of the distance to be kept from which parts that begin nearer are through each other: nothing opens them again.
_THROUGH = 0.5


def numbers(request: Request) -> None:
    """What a strip is, and what holds and loads it, beyond what the models are known to work for."""
    strip, lengths = request.strip, request.lengths
    check_known(strip)
    known("segments", lengths.size, [float(lengths.min())])
    for key, clamp in (("clamp.position", request.start), ("end.position", request.end)):
        if clamp is not None and clamp.position is not None:
            known(key, clamp.position, np.asarray(clamp.position) / strip.length)
    for wall in request.walls:
        known("wall.point", wall.point, np.asarray(wall.point) / strip.length)
        if isinstance(wall, Solid):
            known("rounding", wall.radius, [wall.radius / strip.length])
            known("size", wall.size, np.asarray(() if wall.size is None else wall.size) / strip.length)
        elif isinstance(wall, Obstacle) and not isinstance(wall, Face):
            known("radius", wall.radius, [wall.radius / strip.length])
        elif wall.stiffness is not None:
            known("wall.stiffness", wall.stiffness, [wall.stiffness])
    if request.closure is not None:
        known("closure.turns", request.closure.turns, [request.closure.turns])
    if request.tip is not None:
        known("tip", request.tip, request.tip)
    if request.apart is not None and not _LEAST_APART <= request.apart < 0.5:
        raise RibbonInputError(
            "apart", request.apart, f"use a distance over l from {_LEAST_APART:g} to below 0.5, or None"
        )


def rubs(request: Request) -> None:
    """Friction without a path: a state that rubs depends on the way to it."""
    for wall in request.walls:
        if wall.friction:
            raise RibbonInputError(
                "friction", wall.friction, "acts along a path: solve with 0, then ribbon.find.friction.path.follow"
            )


def pulled(request: Request, chosen: str) -> None:
    """A force at s = l that has nothing to act on, or nothing to act against; chosen: the formulation."""
    force, start, end = request.tip, request.start, request.end
    if force is None:
        return
    if request.closure is not None:
        raise RibbonInputError("tip", force, "a closed band has no end to pull at; remove one")
    if end is not None and end.position is not None:
        raise RibbonInputError("tip", force, "pulls at a point that the end clamp holds; free its position")
    if start is None or start.position is None:
        raise RibbonInputError("tip", force, "pulls the ribbon away: hold its start")
    if chosen != "mixed":
        raise RibbonInputError("formulation", chosen, 'a force at a guided end needs "mixed" or "auto"')


def rulings(problem: Problem) -> None:
    """A straight ruling that the energy does not know, or a formulation that knows rulings only."""
    fields = problem.fields
    if fields.free and problem.formulation not in ("chained", "mixed"):
        raise RibbonInputError("formulation", problem.formulation, f'"{problem.energy}" needs "mixed" or "auto"')
    if fields.free and problem.formulation == "chained" and problem.row_count:
        raise RibbonInputError("formulation", "chained", f'"{problem.energy}" with a clamp at the end needs "mixed"')
    if not fields.free or fields.held_straight:
        return
    clamps = [clamp for clamp in (problem.start, problem.end) if clamp is not None and clamp.ruling_given]
    held = [clamp.ruling for clamp in clamps] + ([] if problem.closure is None else [problem.closure.ruling])
    if "straight" in held:
        remedy = f'the energy "{problem.energy}" knows no ruling; leave it out, or use energy "finite"'
        raise RibbonInputError("ruling", "straight", remedy)


def walls(problem: Problem) -> None:
    """A held point, or an edge of a held frame, behind a rigid wall.

    Not asked of a path, which stops at the last scene that can be.
    """
    strip = problem.strip
    for key, clamp in (("clamp", problem.start), ("end", problem.end)):
        if clamp is None or clamp.position is None:
            continue
        points = [np.asarray(clamp.position)]
        if clamp.holds_frame:
            points += [points[0] + side * 0.5 * strip.width * clamp.frame[:, 0] for side in (1.0, -1.0)]
        for k, wall in enumerate(problem.walls):
            deepest = _depth(wall, points)
            if wall.stiffness is None and deepest > statics.BEHIND_WALL * strip.length:
                remedy = f"it holds the strip {deepest:.6g} behind wall {k}: move it, or the wall back"
                raise RibbonInputError(f"{key}.position", clamp.position, remedy)


def _depth(wall: Barrier, points: list[NDArray[np.float64]]) -> float:
    """How far behind a surface the points of a held edge, middle and both ends, are, and what is between them."""
    if isinstance(wall, Wall):
        return float(statics.depth(points, wall.point, wall.normal).max())
    if len(points) > 1 and wall.between:
        across = float(np.clip(wall.nearest(points[0][None, :], (points[1] - points[0])[None, :])[0], -1.0, 1.0))
        points = [*points, points[0] + across * (points[1] - points[0])]
    return float(-wall.gaps(np.array(points)).min())


def carried(problem: Problem) -> None:
    """A weight that finds nothing to rest on: no point is held and walls, which have no friction, do not carry it.

    What carries it is a sum of their normals, none of them pulling; otherwise there is a direction along which the
    ribbon falls or slides for ever (Farkas' lemma)."""
    held = any(clamp is not None and clamp.position is not None for clamp in (problem.start, problem.end))
    if held or problem.gravity is None or not problem.has_gravity:
        return
    normals = [
        direction
        for wall in problem.walls
        for direction in (wall.directions if isinstance(wall, Obstacle) else np.array([wall.normal], dtype=float))
    ]
    if statics.is_carried(normals, problem.gravity.up):
        return
    raise RibbonInputError(
        "gravity", problem.gravity.up, "the ribbon falls or slides for ever: hold a point of it, or put a wall below it"
    )


def begins(problem: Problem, omega: NDArray[np.float64], eta: NDArray[np.float64], seed: Seed) -> None:
    """A strip whose parts are kept apart and that begins through itself, with the places: of a shape that was given,
    and of the one at rest where nothing but a clamp holds it (others are guesses, of which one may do)."""
    if not isinstance(problem, MixedProblem) or not problem.apart:
        return
    if isinstance(seed.curvature, str) and (problem.end is not None or problem.closure is not None):
        return
    near = nearness.minima(problem, relax.placed(problem, omega, eta), -_THROUGH * problem.apart)
    if near:
        gap, pair = near[0]
        at_rest = isinstance(seed.curvature, str)
        how = "at rest, as which it begins, goes through itself" if at_rest else "begins the strip through itself"
        remedy = (
            "give a seed.curvature with which they are clear of each other, or come here by a path from less curvature"
            if at_rest
            else "begin where they are clear of each other and come here by a path"
        )
        raise RibbonInputError(
            "seed_curvature", seed.curvature if isinstance(seed.curvature, str | float) else list(seed.curvature),
            f"{how}: its parts at s = {pair.s:.4g} l and s = {pair.s_other:.4g} l are "
            f"{max(0.0, gap + problem.apart):.3g} l from each other and kept {problem.apart:.3g} l apart; {remedy}",
        )  # fmt: skip
