"""What a ribbon is on finer segments: its discretisation error, those of the numbers that are told of it, and whether
it is stable there too."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.measure.align import aligned
from compare.measure.distance import grid_hausdorff
from compare.measure.error import error_of_first, error_of_last, extrapolated
from compare.measure.grid import Grid
from compare.measure.limit import Limit, limit_of
from compare.measure.numbers import errors_of
from compare.models.base import Options, Refinement, Seconds, Size, State, Status
from compare.models.drawn import touches
from compare.models.ribbon.state import own_size, state_of

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from ribbon import Equilibrium
    from ribbon.forces import WallForce

#: Segments up to which a ribbon is solved again for the error estimate: with a dense Hessian (a chained ribbon where
#: Ipopt is asked for), without one. Once beyond is allowed, for the cruder of the two estimates.
MOST_SEGMENTS = 320
MOST_SPARSE_SEGMENTS = 4000
#: Further halvings while the sign of the lowest eigenvalue's limit is open; size (relative to 1) from which it has one.
MORE = 2
SIGNED = 1e-6


def refined(state: State) -> State | None:
    """Every segment cut in two, solved again from the state; None where it is not stable, nor a saddle that is kept."""
    from ribbon import refine

    if not state.ok and not kept(state):
        return None
    finer = refine(state.native)
    size = Size(state.size.ladder, (float(finer.problem.lengths.size),))
    return state_of(None, finer, size, Seconds(float("nan")), None)


def kept(state: State) -> bool:
    """Whether a saddle is followed to finer segments as one: a band of several half turns, which is the same by its
    symmetry (`ribbon.find.bands.folds`) and has nothing stable beside it."""
    closure = state.native.problem.closure
    return state.status is Status.UNSTABLE and closure is not None and closure.folded


def judged(state: State, say: Reporter | None = None, grid: Grid | None = None, scene: Scene | None = None) -> State:
    """The state with its discretisation error, the distance (Hausdorff / l) to its own limit of many segments on
    the same branch, and with what it is on finer segments.

    The error is `compare.measure.error.extrapolated` over segments cut in two and in four; rigid motions that
    nothing resists are none. Segments placed by a tolerance bring their own. A state that is a saddle on finer
    segments is one, and a saddle that is stable on finer ones is none: the answer is then what was found there. The
    limit of the lowest eigenvalue is among its `numbers` (`eigenvalue_limit`: value, error, order); where its sign is
    open after `MORE` halvings, so is `stable`. `errors`: of forces, moments, energies and others, each by its own
    changes on the same segments. scene: names its walls.
    """
    from ribbon.solvers import choose
    from ribbon.solvers.budget import SPENT, spent

    if state.status is Status.UNSTABLE and state.shape is not None and not kept(state) and not spent():
        return _of_a_saddle(state, say, grid, scene)
    if not (state.ok or kept(state)) or state.shape is None:
        unknown = errors_of([state.native.numbers], error_of_first)
        why = "it is no stable equilibrium"
        return replace(state, errors=unknown, refinements=_all_tried(state.native), error_why=why)
    e = state.native
    if e.tolerance_error is not None:
        error = float(e.tolerance_error)
        errors, why = _of_placed(e)
        placed = replace(state, error=error, errors=errors, refinements=_all_tried(e), error_why=why)
        last = [low for one in placed.refinements if (low := one.lowest_eigenvalue) is not None][-2:]
        return _in_the_limit(placed, state, last, scene)
    dense = e.problem.formulation == "chained" and not choose.by_recursion(e.problem)
    most = MOST_SEGMENTS if dense else MOST_SPARSE_SEGMENTS
    grid = grid or Grid.for_shape(_Wide(2.0 * e.problem.half_width), state.shape.bend)
    shapes, chain, natives = [grid.of(state.shape)], [e.numbers], [e]
    tried = [*_all_tried(e)]
    why = "extrapolated from two and four times the segments"
    current = state
    for _ in range(2):
        segments = 2 * current.native.problem.lengths.size
        if segments > (2 * most if len(shapes) == 1 else most):
            why = f"from one refinement: {segments} segments are more than are tried"
            break
        if spent():
            why = f"{SPENT} before {segments} segments were tried"
            break
        if say is not None:
            say.step(f"ribbon: {segments} segments, for the discretisation error")
        finer = refined(current)
        assert finer is not None  # `current` is stable, or kept
        if finer.shape is None or not finer.is_equilibrium:
            tried.append(_tried(finer.native, None))
            why = f"not known beyond: on {segments} segments {finer.message}"
            break
        there = aligned(grid.of(finer.shape), shapes[-1], finer.motions)
        tried.append(_tried(finer.native, grid_hausdorff(shapes[-1], there)))
        if finer.status is not state.status:
            there_too = state_of(scene, finer.native, own_size(finer.native), state.seconds)
            return _hidden_saddle(state, there_too, tuple(tried), scene)
        shapes.append(there)
        chain.append(finer.native.numbers)
        natives.append(finer.native)
        current = finer
    errors = _errors(e, chain, error_of_first)
    found = replace(state, error=extrapolated(shapes), errors=errors, refinements=tuple(tried), error_why=why)
    if touches.asked(scene):
        known = {touches.ERRORS: touches.errors(natives, error_of_first)}
        found = replace(found, numbers={**found.numbers, **known})
    halved = [one.lowest_eigenvalue for one in tried[-len(shapes) :] if one.lowest_eigenvalue is not None]
    return _in_the_limit(found, current, halved, scene)


def _errors(
    e: Equilibrium,
    chain: Sequence[Mapping[str, Any]],
    estimate: Callable[[Sequence[Any]], float | None],
) -> dict[str, Any]:
    """The errors of the numbers of an equilibrium, one of a chain of meshes; none is less than what its forces are out
    of balance by, that of a line's end not less than what its segments leave open, nor that of a pressure than what
    its line's do."""
    from ribbon.solvers.problem import force_scale

    found = errors_of(chain, estimate, float(e.residual) * force_scale(e.problem))
    within = [float(wall.within.max(initial=0.0)) for wall in e.walls]
    lines = [None if error is None else max(error, most) for error, most in zip(found["lines"], within, strict=True)]
    told = {**found, "lines": lines}
    if "mean_pressures" in found:  # and of what is spread over a line, what these ends leave open of its length
        left = [_unspread(wall) for wall in e.walls]
        each = zip(found["mean_pressures"]["walls"], left, strict=True)
        told["mean_pressures"] = {"walls": [None if error is None else max(error, most) for error, most in each]}
    return told


def _unspread(wall: WallForce) -> float:
    """How much less a wall's mean pressure is (D / l^3) where its lines reach as far as they may."""
    length, more = float(np.sum(wall.lines[:, 1] - wall.lines[:, 0])), float(np.sum(wall.within))
    return 0.0 if wall.mean_pressure is None else wall.mean_pressure * more / (length + more)


def _of_placed(e: Equilibrium) -> tuple[dict[str, Any], str]:
    """The errors of the numbers of an equilibrium on placed segments, and how they were found: by the changes of all
    rounds where the last one halved the segments, else by halving them once more."""
    from ribbon import refine

    rounds = [one for one in e.refinements if one.before is not None]
    if rounds and e.refinements[-1] is rounds[-1]:
        chain = [numbers for one in rounds for numbers in (one.before, one.numbers) if numbers is not None]
        return _errors(e, chain, error_of_last), "of the placed segments"
    finer = refine(e)
    chain = [e.numbers, finer.numbers] if finer.ok else [e.numbers]
    text = "forces and energies from one refinement" if finer.ok else f"on segments cut in two {finer.message}"
    return _errors(e, chain, error_of_first), f"of the placed segments; {text}"


def _in_the_limit(state: State, finest: State, values: list[float], scene: Scene | None) -> State:
    """`state` with the limit of its lowest eigenvalue. finest: the same on the finest segments that were tried; values:
    the eigenvalues on them and on those before, each halved, or two of placed ones. Segments are halved while the
    limit's sign is open."""
    from ribbon.solvers.budget import spent

    if not values or not np.isfinite(values[-1]) or state.stable is None:
        return state
    found, tried = limit_of(values), list(state.refinements)
    for _ in range(MORE):
        if (found is not None and _is_told(found)) or abs(values[-1]) <= SIGNED:
            break
        if spent() or 2 * finest.native.problem.lengths.size > MOST_SPARSE_SEGMENTS:
            break
        finer = refined(finest)
        if finer is None or not finer.is_equilibrium or finer.lowest_eigenvalue is None:
            break
        tried.append(_tried(finer.native, None))
        if finer.status is not finest.status:
            there = state_of(scene, finer.native, own_size(finer.native), state.seconds)
            return _hidden_saddle(state, there, tuple(tried), scene)
        values.append(finer.lowest_eigenvalue)
        finest, found = finer, limit_of(values)
    state = replace(state, refinements=tuple(tried))
    return state if found is None else _with_limit(state, found)


def _is_told(limit: Limit) -> bool:
    """Whether the limit has a sign, or is zero to rounding and so is its error: what is within more than `SIGNED` of
    zero may be of either sign."""
    return limit.signed or max(abs(limit.value), limit.error) <= SIGNED


def _with_limit(state: State, limit: Limit) -> State:
    """The state with the limit of its lowest eigenvalue; its stability is open where the limit's sign is."""
    state = replace(state, numbers={**state.numbers, "eigenvalue_limit": asdict(limit)})
    own, known = state.errors.get("lowest_eigenvalue"), state.lowest_eigenvalue
    if own is not None and known is not None:
        own = max(own, abs(known - limit.value) + limit.error)
        state = replace(state, errors={**state.errors, "lowest_eigenvalue": own})
    if _is_told(limit) or state.stable is None:
        return state
    text = f"its lowest eigenvalue tends to {limit.value:.2g} within {limit.error:.2g}: whether it is stable is open"
    message = state.message.replace("a stable equilibrium", "an equilibrium")
    return replace(state, stable=None, message=f"{message}; {text}")


def _of_a_saddle(state: State, say: Reporter | None, grid: Grid | None, scene: Scene | None) -> State:
    """A saddle, on its own segments and on halved ones; where it is stable there, that state, judged in its turn."""
    from ribbon import refine

    e = state.native
    tried = [*_all_tried(e)]
    unknown = errors_of([e.numbers], error_of_first)
    known = replace(state, errors=unknown, refinements=tuple(tried), error_why="it is no stable equilibrium")
    if 2 * e.problem.lengths.size > MOST_SPARSE_SEGMENTS:
        return known
    finer = refine(e)
    if finer.status.code not in ("converged", "saddle"):
        return known
    tried.append(_tried(finer, None))
    if finer.ok:
        few, many = e.problem.lengths.size, finer.problem.lengths.size
        there = state_of(scene, finer, own_size(finer), state.seconds)
        found = judged(there, say, grid, scene)
        text = f"{found.message}; a saddle on {few} segments only, stable on {many}"
        return replace(
            found, message=text, log=state.log, start=state.start, reused=state.reused,
            refinements=(*tried[:-1], *found.refinements),
        )  # fmt: skip
    finest, limit, chain = _finer_saddle(finer, tried)
    there = state_of(scene, finest, own_size(finest), state.seconds)
    there = replace(
        there, log=state.log, start=state.start, reused=state.reused, refinements=tuple(tried),
        errors=_errors(finest, [e.numbers, *chain], error_of_last), error_why=known.error_why,
    )  # fmt: skip
    return there if limit is None else _with_limit(there, limit)


def _finer_saddle(
    saddle: Equilibrium, tried: list[Refinement]
) -> tuple[Equilibrium, Limit | None, list[dict[str, Any]]]:
    """A saddle, its segments halved while the sign of its eigenvalue's limit is open and it stays one; that limit, and
    the numbers of all of them. What is tried is added to `tried`, whose last entry is the saddle."""
    from ribbon import refine
    from ribbon.solvers.budget import spent

    def limit() -> Limit | None:
        halved = [tried[-1]]
        for one in reversed(tried[:-1]):
            if 2 * one.elements != halved[0].elements:
                break
            halved.insert(0, one)
        return limit_of([low for one in halved[-3:] if (low := one.lowest_eigenvalue) is not None])

    found, chain = limit(), [saddle.numbers]
    for _ in range(MORE):
        if (found is not None and found.signed) or spent():
            break
        if 2 * saddle.problem.lengths.size > MOST_SPARSE_SEGMENTS:
            break
        finer = refine(saddle)
        if finer.status is not saddle.status:
            break
        tried.append(_tried(finer, None))
        chain.append(finer.numbers)
        saddle, found = finer, limit()
    return saddle, found, chain


def left(scene: Scene, state: State, say: Reporter | None, options: Options) -> State:
    """From a saddle that only finer segments show (the native of `state`) along its unstable direction."""
    from ribbon import switch

    saddle = state.native
    found = switch(saddle.problem, saddle, leave_saddle=True)
    if not found.ok:
        return state
    fresh = state_of(scene, found, own_size(found), state.seconds)
    finer = judged(fresh, say, options.grid, scene)
    return replace(finer, log=state.log, refinements=(*state.refinements, *finer.refinements))


@dataclass(frozen=True)
class _Wide:
    """w / l of a strip whose scene is not at hand (`compare.measure.grid.Wide`)."""

    width: float


def _tried(equilibrium: Equilibrium, distance: float | None) -> Refinement:
    """One equilibrium as a refinement."""
    return _refinement(
        equilibrium.problem.lengths.size, equilibrium.status.code, equilibrium.lowest_eigenvalue, distance
    )


def _all_tried(equilibrium: Equilibrium) -> tuple[Refinement, ...]:
    """The equilibrium itself, or all on the way of a tolerance that placed its segments."""
    if not equilibrium.refinements:
        return (_tried(equilibrium, None),)
    return tuple(
        _refinement(one.segments, one.status.code, one.lowest_eigenvalue, one.distance)
        for one in equilibrium.refinements
    )


def _refinement(segments: int, word: str, lowest: float, distance: float | None) -> Refinement:
    return Refinement(int(segments), word, float(lowest) if np.isfinite(lowest) else None, distance)


def _hidden_saddle(state: State, finer: State, tried: tuple[Refinement, ...], scene: Scene | None) -> State:
    """A state that is stable on its own segments and a saddle on finer ones: the saddle, of which all is known."""
    few, many = state.native.problem.lengths.size, finer.native.problem.lengths.size
    told = list(tried)
    saddle, limit, chain = _finer_saddle(finer.native, told)
    lowest = f"{finer.lowest_eigenvalue:.2g}"
    tends = "" if limit is None else f" and tends to {limit.value:.2g} within {limit.error:.2g}"
    found = state_of(scene, saddle, own_size(saddle), state.seconds)
    numbers = {} if limit is None else {"eigenvalue_limit": asdict(limit)}
    return replace(
        found,
        message=f"saddle: stable on {few} segments only; on {many} the lowest eigenvalue is {lowest}{tends}, it is not "
        "stable",
        log=state.log,
        start=state.start,
        reused=state.reused,
        numbers={**found.numbers, **numbers},
        refinements=tuple(told),
        errors=_errors(saddle, [state.native.numbers, *chain], error_of_last),
        error_why=f"on {many} segments the state is a saddle",
    )
