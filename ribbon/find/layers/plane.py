"""A strip that lies on itself in a plane: layers of a fold or a coil, held at stations, all of them inequalities.

Places that are held one by one where they are deepest (`ribbon.find.apart`) come and go round in circles where layers
lie along each other, and a minimiser that knows of no contact lets a coil curl up through itself. Here every joint that
another layer could soon touch has its row (`ribbon.judge.layers`), steps are shorter than the distance to where rows
begin, and what is found is a point of the plane: the strip is kept in it by its own symmetry, ruling and twist zero.
Between joints rows are put where it is too deep, until nothing is. The state is then told, and judged, with all its
freedom, and held at both ends of each ruling; it is none where forces aside of the plane would move it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ribbon.find.solving.request import Options, Progress
from ribbon.judge import layers, nearness, passage
from ribbon.problems.itself.pairs import BEYOND, Pair
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers import newton_rows
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum, kkt_residual

FloatArray = NDArray[np.float64]

#: Steps between two looks, and looks; how far a place may go in a step, and from where joints have their rows, both
#: over the distance to be kept.
_STEPS, _LOOKS, _TRAVEL, _REACH = 8, 60, 1.0, 4.0
#: Steps between two looks where it hardly moves any more.
_MOST = 60
#: Part of the travel below which a way that leads through the strip is given up.
_SHORTEST = 0.05
#: Rounds of places between joints, and depth (l) from which they are put there.
_BETWEEN, _DEPTH = 8, 0.9 * nearness.TOLERANCE
#: Stations, at the least, of layers that lie on each other.
_FEWEST = 3
#: Bound on |omega| (1/l), which bounds nothing, where that on |eta| is zero.
_BOX = 1e4
#: Pushes over the largest one from which stations are told: the first with which they balance.
_CLEARLY = (1e-7, 1e-9, 1e-12)


def lain(
    problem: MixedProblem, x: FloatArray, options: Options | None = None, progress: Progress | None = None
) -> tuple[MixedProblem, Minimum] | None:
    """The problem with the stations that push, and its plane equilibrium downhill of the unknowns x (n,), whose parts
    are nowhere too near; None: x is not in a plane, no layers lie on each other, or none is found."""
    if not _in_a_plane(problem, x) or len(layers.stations(problem, x, _REACH * problem.apart)) < _FEWEST:
        return None
    plane = problem.with_changes(box=(_BOX, 0.0), pairs=())
    found = _downhill(plane, x, (), options, progress)
    more: list[float] = []
    for _ in range(_BETWEEN):
        if found is None or spent():
            return None
        deep = nearness.minima(found[0], found[1].x, -_DEPTH)
        if not deep:
            return _freed(problem, *found)
        more += [pair.s for _, pair in deep if all(abs(pair.s - s) > 1e-3 * problem.lengths.min() for s in more)]
        found = _downhill(*_from(found), more, options, progress)
    return None


def stands(problem: MixedProblem, minimum: Minimum) -> bool:
    """Whether a minimiser's end is an equilibrium whose parts are nowhere too near."""
    return minimum.residual <= RESIDUAL_TOLERANCE and not nearness.minima(problem, minimum.x, -nearness.TOLERANCE)


def is_layered(problem: MixedProblem, x: FloatArray) -> bool:
    """Whether a shape is in a plane and held at stations of its layers."""
    return bool(problem.pairs) and all(pair.stays for pair in problem.pairs) and _in_a_plane(problem, x)


def _in_a_plane(problem: MixedProblem, x: FloatArray) -> bool:
    """Whether a shape bends about its rulings alone, and nothing but itself is in its way."""
    sideways = problem.in_plane_values(x)
    flat = not problem.joint_values(x)[1].any() and (sideways is None or not sideways.any())
    alone = not problem.round and not problem.walls and not problem.rubs and problem.end is None
    return flat and alone and problem.formulation == "mixed" and not problem.joined


def _from(found: tuple[MixedProblem, Minimum]) -> tuple[MixedProblem, FloatArray]:
    return found[0], found[1].x


def _downhill(
    problem: MixedProblem, x: FloatArray, more: Iterable[float], options: Options | None, progress: Progress | None
) -> tuple[MixedProblem, Minimum] | None:
    """The plane equilibrium downhill of x, its stations at joints and at `more`; None where it does not arrive."""
    more, far = list(more), _TRAVEL * problem.apart
    known = {key: value for key, value in (options or {}).items() if key in ("tol",)}
    minimum: Minimum | None = None
    spent_on, steps = (0, 0.0), _STEPS
    for _ in range(_LOOKS):
        held = layers.stations(problem, x, _REACH * problem.apart, more)
        fresh = problem.with_changes(pairs=tuple(pair for _, pair in held)).anchored(problem.anchor(x))
        fresh.counters.add(problem.counters)
        chosen = {
            **known, "mu_init": 1e-4 if minimum is None else 1e-5, "max_iter": steps, "travel": far,
            "sliding": newton_rows.SLIDING if held else 0.0,
        }  # fmt: skip
        warm = None if minimum is None else (_rows_of(problem, fresh, minimum), minimum.multipliers)
        there = newton_rows.minimise(fresh, x, chosen, progress, warm)
        spent_on = spent_on[0] + there.iterations, spent_on[1] + there.seconds
        finite = bool(np.isfinite(there.x).all())
        if not finite or passage.passage(fresh, x, fresh, there.x) is not None:
            far, minimum = 0.5 * far, None
            if far < _SHORTEST * problem.apart:
                return None
            continue
        moved = float(np.abs(problem.layout.positions(there.x) - problem.layout.positions(x)).max())
        steps = _STEPS if moved > 0.1 * far else _MOST
        problem, x, minimum = fresh, there.x, there
        if there.residual <= RESIDUAL_TOLERANCE and _has_its_rows(problem, x, more):
            return problem, replace(there, iterations=spent_on[0], seconds=spent_on[1])
        if spent():
            return None
        if there.code not in (newton_rows.SOLVED, newton_rows.MOST):
            minimum = None
    return None


def _has_its_rows(problem: MixedProblem, x: FloatArray, more: Iterable[float]) -> bool:
    """Whether nothing is too deep at a station that is not held, and no place lies beyond its segment."""
    known = _slid(problem, x)
    deep = [pair for gap, pair in layers.stations(problem, x, -_DEPTH, more)]
    if known:
        rows = problem.pair_rows()
        if (np.abs(rows.past(x)[:, 1]) > BEYOND * rows.long[:, 1]).any():
            return False
    return all(any(layers.alike(problem, pair, other) for other in known) for pair in deep)


def _slid(problem: MixedProblem, x: FloatArray) -> list[Pair]:
    """The stations, each with the place to which its foot has gone."""
    if not problem.pairs:
        return []
    return [pair.at(at) for pair, at in zip(problem.pairs, problem.pair_rows().places(x), strict=True)]


def _rows_of(old: MixedProblem, fresh: MixedProblem, minimum: Minimum) -> FloatArray:
    """Multipliers of the rows of `fresh`: those of `old`, of stations those that hold the same."""
    rows = np.zeros(fresh.row_count)
    here, there = fresh.block_slices(), old.block_slices()
    first = fresh.row_count - sum(block.count for block in fresh.blocks().values())
    rows[:first] = minimum.rows[:first]
    for name, where in there.items():
        if name != "pairs" and name in here:
            rows[here[name]] = minimum.rows[where]
    known = list(zip(_slid(old, minimum.x), minimum.rows[there["pairs"]], strict=True)) if old.pairs else []
    for k, pair in enumerate(fresh.pairs if known else ()):
        same = [row for other, row in known if layers.alike(fresh, pair, other)]
        rows[here["pairs"]][k] = sum(same)
    return rows


def _freed(problem: MixedProblem, plane: MixedProblem, minimum: Minimum) -> tuple[MixedProblem, Minimum] | None:
    """The same state of the problem with all its freedom, what pushes held at both ends of each ruling with half the
    force, as few of them as tell it; None where it is no equilibrium of it."""
    multipliers = minimum.multipliers.copy()
    multipliers[problem.layout.omega] = multipliers[problem.layout.eta] = 0.0
    pairs = _slid(plane, minimum.x)
    push = -minimum.rows[plane.block_slices()["pairs"]] if pairs else np.empty(0)
    anchor = plane.anchor(minimum.x)
    for least in _CLEARLY:
        kept = np.flatnonzero(push > least * push.max(initial=0.0))
        edges = layers.at_edges(problem, minimum.x, [pairs[k] for k in kept]) if kept.size else []
        free = problem.with_changes(pairs=tuple(edges)).anchored(anchor)
        rows = _rows_of(plane, free, minimum)
        if edges:
            rows[free.block_slices()["pairs"]] = -0.5 * np.repeat(push[kept], 2)
        residual = kkt_residual(free, minimum.x, multipliers, rows)
        if residual <= RESIDUAL_TOLERANCE:
            free.counters.add(plane.counters)
            return free, replace(minimum, rows=rows, multipliers=multipliers, residual=residual)
    return None
