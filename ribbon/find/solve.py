"""From a strip, what holds it and its loads to an `Equilibrium`: the functions that users call, with their keywords.

All that is behind them takes a `Request` and a `How` (`ribbon.find.solving`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from ribbon.boundary import Clamp, Closure
from ribbon.contact import Barrier
from ribbon.find import doubling, minima, stretched
from ribbon.find.bands import folds
from ribbon.find.solving import check as _check
from ribbon.find.solving import coarse, search, start
from ribbon.find.solving import refine as _refine
from ribbon.find.solving.assemble import assembled
from ribbon.find.solving.request import How, Options, Progress, Request, Seed, StripKeywords, Values
from ribbon.find.solving.verdict import judged
from ribbon.loads import Gravity
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.result import Equilibrium, Status
from ribbon.solvers import choose
from ribbon.solvers.budget import spent, within
from ribbon.solvers.problem import FloatArray
from ribbon.strip import Strip
from ribbonbench.threads import alone

__all__ = [
    "Problem", "build", "on_segments", "refine", "solve", "solve_from", "solve_request", "solve_shape",
    "starting_shapes",
]  # fmt: skip


def solve(
    strip: Strip,
    clamp: Clamp | None = None,
    gravity: Gravity | None = None,
    *,
    end: Clamp | None = None,
    closure: Closure | None = None,
    walls: Sequence[Barrier] = (),
    energy: str = "wunderlich",
    segments: int | ArrayLike = 20,
    seed_curvature: Values | str = "natural",
    seed_ruling: Values = 0.0,
    formulation: str = "auto",
    held_by: str = "elimination",
    stiffness: str | None = None,
    in_plane: bool | None = None,
    tip: ArrayLike | None = None,
    apart: float | None = None,
    round_rod: bool = False,
    leave_saddle: bool = False,
    budget: float | None = None,
    solver: str | None = None,
    options: Options | None = None,
    progress: Progress | None = None,
) -> Equilibrium:
    """Equilibrium of a ribbon (thesis, chapters 3, 5 and 6).

    Parameters
    ----------
    strip, gravity: what it is and which way is up; no `gravity`, no weight.
    clamp, end: how s = 0 and s = l are held. `clamp` None: at the origin, tangent e_z, normal e_y, unless there is a
        `closure`; a `Clamp` that holds nothing (all parts None) is a free end. `end` None: free.
    closure: of a band; walls: planes and round obstacles that the ribbon cannot cross.
    energy: "wunderlich" (finite width) or "sadowsky", whose ribbons are inextensible; or, with a thickness, "finite",
        "extensible", "sano", "sadowsky_kt" or the rod "kirchhoff", whose twist is free (docs/theory.md, chapter 10).
    stiffness: of "kirchhoff": "matched" (D w, default) or "plate" (Y I); in_plane: whether the strip bends in its own
        plane (energies with a free twist; default: "kirchhoff" does).
    tip: dead force (3,) at s = l, in D w / l^2.
    apart: distance in l that parts of the strip which face each other keep, centre surface from centre surface (a
        thickness); None: they may pass through each other.
    round_rod: what touches itself is a round rod of diameter `apart` about the centreline, not the strip's surface.
    segments: how many equal ones, or their lengths in units of l (they add up to 1).
    seed_curvature, seed_ruling: omega (in 1/length) and eta to start from: a number, or values at equally spaced
        abscissae from s = 0 to s = l, linear between them; "natural" is the stress-free shape, and where that says
        nothing (a flat strip held at both ends, a band) one is chosen.
    formulation: "auto", "chained", "mixed", or "matrix" (the thesis's own mixed unknowns); held_by: "elimination" of
        the start clamp's unknowns or "constraints" (thesis, 5.3.3; mixed models).
    leave_saddle: follow the unstable direction of a saddle to a stable state.
    budget: time in s on the processor, without compiling; when it is spent the result is what there is then, "not
        converged" in general. None: none.
    solver: "auto", "newton" (the recursion of `ribbon.solvers.riccati`, where there is one for the problem) or "ipopt";
        None: as `ribbon.solvers.choose.using` says around it, else "auto".
    options: Ipopt's options, over `ribbon.solvers.ipopt.DEFAULT_OPTIONS`; those that Newton's method lacks make
        it Ipopt.
    progress: called with (iteration, energy, dual infeasibility).

    Raises `RibbonInputError` on bad input. Whatever the minimiser meets is a status of the result.
    """
    with choose.using(solver):
        request = Request.of(
            strip, clamp, gravity, end=end, closure=closure, walls=walls, energy=energy, segments=segments,
            formulation=formulation, held_by=held_by, stiffness=stiffness, in_plane=in_plane, tip=tip, apart=apart,
            round_rod=round_rod,
        )  # fmt: skip
        how = How(options=options, progress=progress, leave_saddle=leave_saddle)
        return solve_request(request, Seed(seed_curvature, seed_ruling), how, budget)


@alone
def solve_request(
    request: Request, seed: Seed | None = None, how: How | None = None, budget: float | None = None
) -> Equilibrium:
    """The equilibrium that a seed leads to, the lowest of those seen; budget: time in s on the processor.

    Raises `RibbonInputError` on bad input.
    """
    seed, how = seed or Seed(), how or How()
    _check.rubs(request)
    problem = assembled(request)
    _check.walls(problem)
    _check.carried(problem)
    if stretched.is_stretched(problem):
        return stretched.straight(problem)
    with within(budget):
        if isinstance(problem, MixedProblem) and folds.is_folded(problem) and isinstance(seed.curvature, str):
            return _folded(problem, how)
        if problem.lengths.size >= 4 * doubling.FEWEST and doubling.is_possible(problem, how.options):
            few = _searched(doubling.few(problem), seed, how)
            state = _refine.climbed(few, problem) if few.ok else None
            if state is not None and state.ok:
                return state
        return _searched(problem, seed, how)


def _searched(problem: Problem, seed: Seed, how: How) -> Equilibrium:
    """The state that the starting shapes lead to, the lowest of those seen."""
    best: Equilibrium | None = None
    shapes = iter(start.shapes(problem, seed, how.progress))
    for omega, eta in shapes:
        _check.begins(problem, omega, eta, seed)
        state = search.from_shape(problem, omega, eta, how)
        if best is None or _rank(state) < _rank(best):
            best = state
        if state.ok or spent():
            break
    assert best is not None

    def relaxed(near: Problem, x: FloatArray) -> Equilibrium:
        return search.from_near(near, x, how)

    sides = None
    if isinstance(seed.curvature, str):
        best = coarse.lowest(best, how)
    else:
        sides = minima.sides(problem, start.given(problem, seed.curvature, seed.ruling), (omega, eta))
    if sides is not None:
        best = minima.held(best, sides, relaxed)
    free = not problem.walls and not (isinstance(problem, MixedProblem) and problem.apart)
    return minima.lowest(best, shapes, relaxed, sides, probing=isinstance(seed.curvature, str) and free)


def _folded(problem: MixedProblem, how: How) -> Equilibrium:
    """The band of as many folds as half turns were asked for, a minimum or not: what it is left for has fewer. Where
    weight, walls or what it rests in make its places differ the search begins there."""
    problem = folds.fitting(problem)
    if folds.is_alike(problem):
        return judged(problem, next(folds.states(problem), None) or folds.nothing(problem), how)
    shape = folds.shape(problem)
    if shape is None:
        return judged(problem, folds.nothing(problem), how)
    return search.from_shape(problem, *shape, how)


def _rank(state: Equilibrium) -> tuple[int, float]:
    order = {Status.CONVERGED: 0, Status.SADDLE: 1, Status.NOT_CONVERGED: 2}
    return order.get(state.status, 3), state.residual if np.isfinite(state.residual) else np.inf


def build(
    strip: Strip, clamp: Clamp | None = None, gravity: Gravity | None = None, **keywords: Unpack[StripKeywords]
) -> Problem:
    """The minimisation problem of a ribbon in the formulation asked for; arguments as in `solve`.

    `RibbonInputError` for arguments that contradict each other, or beyond what the models are known to work for."""
    return assembled(Request.of(strip, clamp, gravity, **keywords))


def starting_shapes(
    problem: Problem, curvature: Values | str, ruling: Values, progress: Progress | None = None
) -> Iterable[start.Shape]:
    """omega and eta (p + 1,) at the joints to start from, the most promising first; several only if none was given."""
    return start.shapes(problem, Seed(curvature, ruling), progress)


@alone
def solve_from(
    problem: Problem,
    x: FloatArray,
    *,
    warm: search.Warm | None = None,
    options: Options | None = None,
    progress: Progress | None = None,
    leave_saddle: bool = False,
    check: bool = True,
    near: bool = False,
    hold: bool = True,
) -> Equilibrium:
    """Equilibrium of `problem` from the unknowns x; residual and stability are not taken from Ipopt.

    warm: multipliers of rows and bounds (of a neighbouring problem of the same structure); check: whether stability is
    judged (otherwise `stable` is None); near: x may be the solution already, and is kept if it is; hold: whether the
    strip is held on its walls' side between the joints too (otherwise it may sag through there, and says so).
    """
    return search.from_state(problem, x, How(options, progress, leave_saddle, check, near, hold), warm)


@alone
def solve_shape(
    problem: Problem,
    omega: FloatArray,
    eta: FloatArray,
    *,
    options: Options | None = None,
    progress: Progress | None = None,
    leave_saddle: bool = False,
    check: bool = True,
    hold: bool = True,
) -> Equilibrium:
    """Equilibrium of `problem` from omega and eta (p + 1,) at the joints; keywords as in `solve_from`."""
    how = How(options, progress, leave_saddle, check, hold=hold)
    return search.from_shape(problem, omega, eta, how)


@alone
def refine(
    equilibrium: Equilibrium,
    parts: int = 2,
    *,
    options: Options | None = None,
    progress: Progress | None = None,
    leave_saddle: bool = False,
    check: bool = True,
) -> Equilibrium:
    """The same scene on segments cut into `parts`, started from `equilibrium`: the same branch, a smaller error.

    The distance to the coarser result estimates the coarser result's discretisation error. Keywords as in `solve_from`.
    Segments that follow what a round rod touches follow again when they are cut in two. At the end of a path with
    friction the last increment is gone again on them, from the same places.
    """
    if equilibrium.jointed is not None and parts == 2:
        from ribbon.find.jointed import drawn

        return drawn.halved(equilibrium)
    if equilibrium.before is not None:
        from ribbon.find.friction import path as rubbing

        return rubbing.finer(equilibrium, parts, How(options, progress))
    return _refine.cut_into(equilibrium, parts, How(options, progress, leave_saddle, check))


@alone
def on_segments(equilibrium: Equilibrium, lengths: FloatArray, *, check: bool = True) -> Equilibrium:
    """The same scene on segments of other `lengths` (k,), started from `equilibrium`, whose shape is close."""
    return _refine.onto(equilibrium, lengths, How(check=check))
