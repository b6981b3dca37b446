"""A strip that lies on itself in a plane: layers of a fold or a coil, held at stations, all of them inequalities.

Places that are held one by one where they are deepest (`ribbon.find.apart`) come and go round in circles where layers
lie along each other, and a minimiser that knows of no contact lets a coil curl up through itself. Here the strip is
kept in its plane by its own symmetry, ruling and twist zero, and is searched for by its joints' curvatures alone
(`ribbon.find.layers.curvatures`), every joint that another layer could soon touch with its row. Between joints rows are
put where it is too deep, until nothing is. The state is then told, and judged, with all its freedom, and held at two
places of each ruling (`ribbon.judge.layers.across`); it is none where forces aside of the plane would move it.
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from ribbon.find.layers import ends
from ribbon.find.layers.bent import Bent
from ribbon.find.layers.curvatures import Lain, Search
from ribbon.find.solving.request import Options, Progress
from ribbon.judge import layers, nearness
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.mixed_kernels import ROWS
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import NEWTON, RESIDUAL_TOLERANCE, Minimum, force_scale, kkt_residual

FloatArray = NDArray[np.float64]

#: Gap over the distance to be kept within which layers lie on each other to begin with, and stations, at the least.
_REACH, _FEWEST = 40.0, 3
#: Rounds of places between joints, and depth (l) from which they are put there.
_BETWEEN, _DEPTH = 8, 0.9 * nearness.TOLERANCE
#: What is left of the equations over their unit.
_LEFT = 1e-10
#: Pushes over the largest one from which stations are told: the first with which they balance.
_CLEARLY = (1e-7, 1e-9, 1e-12)
_DONE = "Newton's iteration in the plane converged."


def lain(
    problem: MixedProblem, x: FloatArray, options: Options | None = None, progress: Progress | None = None
) -> tuple[MixedProblem, Minimum] | None:
    """The problem with the stations that push, and its plane equilibrium downhill of the unknowns x (n,), whose parts
    are nowhere too near; None: x is not in a plane, no layers lie on each other, or none is found."""
    if not _in_a_plane(problem, x) or len(layers.stations(problem, x, _REACH * problem.apart)) < _FEWEST:
        return None
    clock, steps = time.perf_counter(), 0
    plane = problem.with_changes(box=None, pairs=(), held_by="elimination").anchored(problem.anchor(x))
    more: list[float] = []
    known: dict[tuple[float, int], float] = {}
    for _ in range(_BETWEEN):
        search = Search(plane, np.array(more), options, progress)
        found = search.settle(x, known, _LEFT * force_scale(problem))
        steps += found.steps
        if not found.found or spent():
            return None
        deep = nearness.minima(plane, found.x, -_DEPTH)
        if not deep:
            return _freed(problem, plane, found, steps, time.perf_counter() - clock)
        more += [pair.s for _, pair in deep if all(abs(pair.s - s) > 1e-3 * problem.lengths.min() for s in more)]
        x, known = found.x, found.by_place
    return None


def stands(problem: MixedProblem, minimum: Minimum) -> bool:
    """Whether a minimiser's end is an equilibrium whose parts are nowhere too near."""
    if minimum.residual > RESIDUAL_TOLERANCE or layers.is_through(problem, minimum.x):
        return False
    return not nearness.minima(problem, minimum.x, -nearness.TOLERANCE)


def is_layered(problem: MixedProblem, x: FloatArray) -> bool:
    """Whether a shape is in a plane and held at stations of its layers."""
    return bool(problem.pairs) and all(pair.stays for pair in problem.pairs) and _in_a_plane(problem, x)


def _in_a_plane(problem: MixedProblem, x: FloatArray) -> bool:
    """Whether a shape bends about its rulings alone, and nothing but itself and what holds its start is in its way."""
    sideways = problem.in_plane_values(x)
    flat = not problem.joint_values(x)[1].any() and (sideways is None or not sideways.any())
    alone = not problem.round and not problem.walls and not problem.rubs
    plain = problem.formulation == "mixed" and not problem.joined
    return flat and alone and plain and _is_held(problem) and ends.in_plane(problem)


def _is_held(problem: MixedProblem) -> bool:
    """Whether the start is held, or nothing moves it."""
    if problem.start_position is not None and problem.start_quaternion is not None:
        return True
    return not problem.has_gravity and problem.tip is None


def _slid(found: Lain) -> list[Pair]:
    """The stations, each with the place to which its foot has gone."""
    rows = found.gaps.rows
    if rows is None:
        return []
    return [pair.at(at) for pair, at in zip(found.faced.pairs, rows.places(found.x), strict=True)]


def _freed(
    problem: MixedProblem, plane: MixedProblem, found: Lain, steps: int, seconds: float
) -> tuple[MixedProblem, Minimum] | None:
    """The same state of the problem with all its freedom, what pushes held at two places of each ruling with half the
    force, as few of them as tell it; None where it is no equilibrium of it."""
    x, pairs = found.x, _slid(found)
    by_row = found.pushes * found.gaps.share
    held = ends.Ends(plane)
    pull = -held.pull(found.nu) - (found.gaps.jacobian.T @ by_row if pairs else 0.0)
    glue = Bent(plane, x).multipliers(pull)[: ROWS * plane.lengths.size]
    none, anchor = np.zeros(x.size), plane.anchor(x)
    for least in _CLEARLY:
        kept = np.flatnonzero(by_row > least * by_row.max(initial=0.0))
        edges = layers.across(problem, x, [pairs[k] for k in kept]) if kept.size else []
        free = problem.with_changes(pairs=tuple(edges)).anchored(anchor)
        rows = np.zeros(free.row_count)
        rows[: glue.size] = glue
        held.write(free, found.nu, rows)
        if edges:
            rows[free.block_slices()["pairs"]] = -0.5 * np.repeat(by_row[kept], 2)
        _hold(free, x, rows)
        residual = kkt_residual(free, x, none, rows)
        if residual <= RESIDUAL_TOLERANCE:
            free.counters.add(plane.counters)
            return free, Minimum(x, none, rows, residual, steps, 0, _DONE, True, seconds, NEWTON)
    return None


def _hold(problem: MixedProblem, x: FloatArray, rows: FloatArray) -> None:
    """Writes into the rows' multipliers those of rows that hold the start."""
    first, held = problem.layout.joint(0), problem.block_slices()
    left = problem.gradient(x) + problem.jacobian_matrix(x).T @ rows
    for name, columns in (("start_position", first.position), ("start_frame", first.quaternion)):
        if name in held:
            rows[held[name]] = -left[columns]
