"""From a strip, what holds it and its loads to an `Equilibrium`."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ribbon.boundary import Clamp, Closure
from ribbon.contact import Wall
from ribbon.errors import RibbonInputError
from ribbon.find import band, climb, contacts, minima, nested, other_models, relax, seeds, stretched
from ribbon.judge import convexity, penetration, quadrature, stability
from ribbon.loads import Gravity, tip_force
from ribbon.problems import formulation, transfer
from ribbon.problems.chained import ChainedProblem, segment_lengths
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem as Problem
from ribbon.result import Energy, Equilibrium, Left, Status
from ribbon.solvers import choose, ipopt, newton
from ribbon.solvers.budget import SPENT, spent, within
from ribbon.solvers.problem import (
    DENSE,
    IPOPT,
    KNOWN,
    RESIDUAL_TOLERANCE,
    FloatArray,
    Minimum,
    approach,
    force_scale,
    kkt_residual,
    polish,
    slack_of,
    violation,
)
from ribbon.strip import Strip, check_known, finite, known
from ribbonbench import statics
from ribbonbench.threads import alone

Progress = Callable[[int, float, float], None]
Values = float | tuple[float, ...] | list[float]

#: What the message of a state says whose stability is open to rounding.
INDIFFERENT_WORDS = "; indifferent to at least one mode (eigenvalue zero to rounding)"
#: What the message of a band says that lies on walls and is held nowhere.
FREE_BAND_WORDS = (
    "; nothing holds the band: where it begins in space (its seam at the origin, tangent e_z, normal e_y) chooses "
    "among its states, and another may have less energy"
)
#: Part of the largest multiplier above which what keeps a free band from sliding is told.
_SLIDES = 1e-7
#: Violation of the rows above which a stationary point is called infeasible.
_INFEASIBLE = 1e-6
_IPOPT_INFEASIBLE = (2, -10)
#: Slack (l) between held ends below which rounding is the likely reason of a solve that ends early.
_LEAST_SLACK = 1e-9


@alone
def solve(
    strip: Strip,
    clamp: Clamp | None = None,
    gravity: Gravity | None = None,
    *,
    end: Clamp | None = None,
    closure: Closure | None = None,
    walls: tuple[Wall, ...] | list[Wall] = (),
    energy: str = "wunderlich",
    segments: int | ArrayLike = 20,
    seed_curvature: Values | str = "natural",
    seed_ruling: Values = 0.0,
    formulation: str = "auto",
    held_by: str = "elimination",
    stiffness: str | None = None,
    in_plane: bool | None = None,
    tip: ArrayLike | None = None,
    leave_saddle: bool = False,
    budget: float | None = None,
    solver: str | None = None,
    options: dict[str, Any] | None = None,
    progress: Progress | None = None,
) -> Equilibrium:
    """Equilibrium of a ribbon (thesis, chapters 3, 5 and 6).

    Parameters
    ----------
    strip, gravity: what it is and which way is up; no `gravity`, no weight.
    clamp, end: how s = 0 and s = l are held. `clamp` None: at the origin, tangent e_z, normal e_y, unless there is a
        `closure`; a `Clamp` that holds nothing (all parts None) is a free end. `end` None: free.
    closure: of a band; walls: planes that the ribbon cannot cross.
    energy: "wunderlich" (finite width) or "sadowsky", whose ribbons are inextensible; or, with a thickness, "finite",
        "extensible", "sano", "sadowsky_kt" or the rod "kirchhoff", whose twist is free (docs/theory.md, chapter 10).
    stiffness: of "kirchhoff": "matched" (D w, default) or "plate" (Y I); in_plane: whether the strip bends in its own
        plane (energies with a free twist; default: "kirchhoff" does).
    tip: dead force (3,) at s = l, in D w / l^2.
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
        problem = build(
            strip, clamp, gravity, end=end, closure=closure, walls=walls, energy=energy, segments=segments,
            formulation=formulation, held_by=held_by, stiffness=stiffness, in_plane=in_plane, tip=tip,
        )  # fmt: skip
    check_walls(strip, problem.start, problem.end, problem.walls)
    check_carried(problem)
    if stretched.is_stretched(problem):
        return stretched.straight(problem)
    asked = {"options": options, "progress": progress}
    with within(budget), choose.using(solver):
        if problem.lengths.size >= 4 * climb.FEWEST and climb.can(problem, options):
            glued: Any = problem
            few = _searched(climb.few(glued), seed_curvature, seed_ruling, leave_saddle, asked)
            found = _climbed(few, glued) if few.ok else None
            if found is not None and found.ok:
                return found
        return _searched(problem, seed_curvature, seed_ruling, leave_saddle, asked)


def _searched(
    problem: Problem, curvature: Values | str, ruling: Values, leave_saddle: bool, asked: dict[str, Any]
) -> Equilibrium:
    """The state that the starting shapes lead to, the lowest of those seen; asked: options, progress."""
    best: Equilibrium | None = None
    shapes = iter(starting_shapes(problem, curvature, ruling, asked["progress"]))
    for omega, eta in shapes:
        found = solve_shape(problem, omega, eta, leave_saddle=leave_saddle, **asked)
        if best is None or _rank(found) < _rank(best):
            best = found
        if found.ok or spent():
            break
    assert best is not None

    def relaxed(near: Problem, x: FloatArray) -> Equilibrium:
        return _from_near(near, x, **asked)

    sides = (
        None if isinstance(curvature, str) else minima.sides(problem, _given(problem, curvature, ruling), (omega, eta))
    )
    if sides is not None:
        best = minima.held(best, sides, relaxed)
    return minima.lowest(best, shapes, relaxed, sides)


def _climbed(few: Equilibrium, problem: MixedProblem) -> Equilibrium | None:
    """The state of `problem` above that on few segments, judged; None where it is not followed up to there."""
    coarse: Any = few.problem
    start = Minimum(
        few.x, few.multipliers, few.rows, few.residual, few.iterations, 0, "", True, few.seconds["solve"], few.solver
    )
    minimum = None if few.active_bounds else climb.climbed(coarse, start, problem)
    if minimum is None:
        return None
    found = found_at(problem, minimum)
    told = "" if few.minima is None or len(few.minima.energies) < 2 else f"; {few.minima}"
    return replace(found, minima=few.minima, branch=few.branch, message=found.message + told)


def _rank(found: Equilibrium) -> tuple[int, float]:
    order = {Status.CONVERGED: 0, Status.SADDLE: 1, Status.NOT_CONVERGED: 2}
    return order.get(found.status, 3), found.residual if np.isfinite(found.residual) else np.inf


def _nothing(clamp: Clamp | None) -> bool:
    return clamp is None or (clamp.position is None and not clamp.holds_frame and clamp.ruling == "free")


def build(
    strip: Strip,
    clamp: Clamp | None = None,
    gravity: Gravity | None = None,
    *,
    end: Clamp | None = None,
    closure: Closure | None = None,
    walls: tuple[Wall, ...] | list[Wall] = (),
    energy: str = "wunderlich",
    segments: int | ArrayLike = 20,
    formulation: str = "auto",
    held_by: str = "elimination",
    stiffness: str | None = None,
    in_plane: bool | None = None,
    tip: ArrayLike | None = None,
) -> Problem:
    """The minimisation problem of a ribbon in the formulation asked for; arguments as in `solve`.

    `RibbonInputError` for arguments that contradict each other, or beyond what the models are known to work for."""
    lengths = segment_lengths(segments)
    if clamp is None and closure is None:
        clamp = Clamp()
    check_known(strip)
    known("segments", segments, [float(lengths.min())])
    start = None if _nothing(clamp) else clamp
    end = None if _nothing(end) else end
    walls = tuple(walls)
    force = tip_force(tip)
    _check_known_places(strip, start, end, closure, walls, force)
    chosen, _ = _formulation(formulation, start, end, closure, walls, gravity, lengths.size, choose.asked())
    if chosen == "chained" and end is None:
        assert start is not None
        chain = ChainedProblem(
            strip, start, gravity, energy, lengths, stiffness=stiffness, in_plane=in_plane, tip=force
        )
        check_rulings(chain)
        return chain
    if closure is not None and lengths.size < 3:
        raise RibbonInputError("segments", lengths.size, "a closed band needs at least three segments")
    stretched.check_distance(strip, start, end)
    if chosen == "matrix" and gravity is not None and gravity.exact:
        raise RibbonInputError("formulation", chosen, 'the weight of the surface needs "mixed"')
    if force is not None:
        _check_pulled(chosen, start, end, closure, force)
    frame = None if start is None or not start.holds_frame else start
    reference = (1.0, 0.0, 0.0, 0.0)
    if frame is not None:
        from ribbon.element.quaternion import from_matrix

        reference = tuple(from_matrix(frame.frame).tolist())
    arguments: dict[str, Any] = {
        "strip": strip, "start": start, "end": end, "closure": closure, "walls": walls, "gravity": gravity,
        "energy": energy, "lengths": lengths, "held_by": held_by, "reference": reference, "model": chosen,
        "stiffness": stiffness, "in_plane": in_plane, "tip": force,
    }  # fmt: skip
    glued = MixedProblem(**arguments)
    check_rulings(glued)
    return glued


_formulation = formulation.choose


def _check_known_places(
    strip: Strip, start: Clamp | None, end: Clamp | None, closure: Closure | None, walls: tuple[Wall, ...],
    force: tuple[float, ...] | None,
) -> None:  # fmt: skip
    """`RibbonInputError` for what holds and loads a strip beyond what the models are known to work for."""
    for key, clamp in (("clamp.position", start), ("end.position", end)):
        if clamp is not None and clamp.position is not None:
            known(key, clamp.position, np.asarray(clamp.position) / strip.length)
    for wall in walls:
        known("wall.point", wall.point, np.asarray(wall.point) / strip.length)
        if wall.stiffness is not None:
            known("wall.stiffness", wall.stiffness, [wall.stiffness])
    if closure is not None:
        known("closure.turns", closure.turns, [closure.turns])
    if force is not None:
        known("tip", force, force)


def check_walls(strip: Strip, start: Clamp | None, end: Clamp | None, walls: tuple[Wall, ...]) -> None:
    """`RibbonInputError` where a held point, or an edge of a held frame, stands behind a rigid wall.

    Not asked of a way, which stops at the last scene that can be.
    """
    for key, clamp in (("clamp", start), ("end", end)):
        if clamp is None or clamp.position is None:
            continue
        points = [np.asarray(clamp.position)]
        if clamp.holds_frame:
            points += [points[0] + side * 0.5 * strip.width * clamp.frame[:, 0] for side in (1.0, -1.0)]
        for k, wall in enumerate(walls):
            deepest = float(statics.depth(points, wall.point, wall.normal).max())
            if wall.stiffness is None and deepest > statics.BEHIND_WALL * strip.length:
                raise RibbonInputError(
                    f"{key}.position", clamp.position, f"it holds the strip {deepest:.6g} behind wall {k}: move it, "
                    "or the wall back",
                )  # fmt: skip


def check_carried(problem: Problem) -> None:
    """`RibbonInputError` where the weight finds nothing to rest on: no point is held and walls, which have no friction,
    do not carry it. What carries it is a sum of their normals, none of them pulling; otherwise there is a direction
    along which the ribbon falls or slides for ever (Farkas' lemma)."""
    held = any(clamp is not None and clamp.position is not None for clamp in (problem.start, problem.end))
    if held or problem.gravity is None or not problem.has_gravity:
        return
    normals = np.array([wall.normal for wall in problem.walls], dtype=float)
    if statics.is_carried(normals, problem.gravity.up):
        return
    raise RibbonInputError(
        "gravity", problem.gravity.up, "the ribbon falls or slides for ever: hold a point of it, or put a wall below it"
    )


def _check_pulled(
    chosen: str, start: Clamp | None, end: Clamp | None, closure: Closure | None, force: tuple[float, ...]
) -> None:
    """`RibbonInputError` where a force at s = l has nothing to act on, or nothing to act against."""
    if closure is not None:
        raise RibbonInputError("tip", force, "a closed band has no end to pull at; remove one")
    if end is not None and end.position is not None:
        raise RibbonInputError("tip", force, "pulls at a point that the end clamp holds; free its position")
    if start is None or start.position is None:
        raise RibbonInputError("tip", force, "pulls the ribbon away: hold its start")
    if chosen != "mixed":
        raise RibbonInputError("formulation", chosen, 'a force at a guided end needs "mixed" or "auto"')


def check_rulings(problem: Problem) -> None:
    """`RibbonInputError` where a straight ruling is asked for that the energy does not know, or a formulation that
    knows rulings only."""
    fields = problem.fields
    if fields.free and problem.formulation not in ("chained", "mixed"):
        raise RibbonInputError("formulation", problem.formulation, f'"{problem.energy}" needs "mixed" or "auto"')
    if fields.free and problem.formulation == "chained" and problem.row_count:
        raise RibbonInputError("formulation", "chained", f'"{problem.energy}" with a clamp at the end needs "mixed"')
    if not fields.free or fields.held_straight:
        return
    for clamp in (problem.start, problem.end):
        if clamp is not None and clamp.ruling_given and clamp.ruling == "straight":
            remedy = f'the energy "{problem.energy}" knows no ruling; leave it out, or use energy "finite"'
            raise RibbonInputError("ruling", clamp.ruling, remedy)
    if problem.closure is not None and problem.closure.ruling == "straight":
        remedy = f'the energy "{problem.energy}" knows no ruling; leave it out, or use energy "finite"'
        raise RibbonInputError("ruling", problem.closure.ruling, remedy)


def starting_shapes(
    problem: Problem, curvature: Values | str, ruling: Values, progress: Progress | None = None
) -> Iterable[tuple[FloatArray, FloatArray]]:
    """omega and eta (p + 1,) at the joints to start from, the most promising first; several only if none was given."""
    s = seeds.joints(problem.lengths)
    rulings = _values("seed_ruling", ruling)
    known("seed_ruling", ruling, rulings)
    eta = seeds.held_straight(problem, seeds.sampled(rulings, s))
    slopes = np.abs(np.diff(eta)) / problem.lengths * problem.half_width
    if slopes.max(initial=0.0) >= 1.0 and not problem.fields.free:
        raise RibbonInputError(
            "seed_ruling", ruling, "rulings of the starting shape cross inside the strip: keep |eta'| below 2 / width"
        )
    if not isinstance(curvature, str):
        given = _given(problem, curvature, ruling)
        held: Any = problem
        free = problem.end is None or bool(problem.walls)  # a fit knows no walls
        return _from_the_walls(problem, *given) if free else [seeds.brought(held, *given)]
    if curvature != "natural":
        raise RibbonInputError("seed_curvature", curvature, 'a number, a list of numbers, or "natural"')
    natural = seeds.sampled(problem.strip.curvature, s)
    glued: Any = problem
    if problem.closure is not None:
        if problem.closure.sign < 0:
            return [band.moebius(glued, progress)]
        omega, _ = band.circle(problem)
        return [(omega, eta)]
    if problem.end is None:
        layer = seeds.hanging(problem)
        return _from_the_walls(problem, natural if layer is None else layer, eta)
    shapes = seeds.guesses(glued)
    if problem.has_natural_curvature:  # which coils, and may end far above what the arcs do
        shapes = [(natural, eta), *shapes]
    return _fitted_in_turn(glued, shapes)


def _from_the_walls(problem: Problem, omega: FloatArray, eta: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """The shape; before it those that bend aside where it is straight and meets a wall head on."""
    glued: Any = problem
    aside = contacts.bent_aside(glued, omega, eta) if problem.walls and problem.end is None else []
    return [*aside, (omega, eta)]


def _given(problem: Problem, curvature: Values, ruling: Values) -> tuple[FloatArray, FloatArray]:
    """omega and eta (p + 1,) of a seed as it was given."""
    s = seeds.joints(problem.lengths)
    values = np.array(_values("seed_curvature", curvature)) * problem.strip.length
    known("seed_curvature", curvature, values)
    omega = seeds.sampled(tuple(values), s)
    return omega, seeds.held_straight(problem, seeds.sampled(_values("seed_ruling", ruling), s))


#: Mismatch (l, rad) up to which a fitted shape is a promising one, and most shapes to start from.
_FITS = 1e-2
_MOST_STARTS = 5


def _fitted_in_turn(
    problem: MixedProblem, shapes: list[tuple[FloatArray, FloatArray]]
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """The shapes fitted to what is held, those that fit first; each is fitted when it is asked for."""
    poor = []
    given = 0
    for shape in shapes:
        omega, eta, missing = seeds.fitted(problem, *shape)
        if missing > _FITS:
            poor.append((omega, eta))
        elif given < _MOST_STARTS:
            given += 1
            yield omega, eta
    yield from poor[: _MOST_STARTS - given]


def _values(key: str, value: Values) -> tuple[float, ...]:
    if isinstance(value, (tuple, list)):
        if not value:
            raise RibbonInputError(key, value, "one number, or values from s = 0 to s = l")
        return tuple(finite(key, v) for v in value)
    return (finite(key, value),)


def solve_shape(problem: Problem, omega: FloatArray, eta: FloatArray, **keywords: Any) -> Equilibrium:
    """Equilibrium of `problem` from omega and eta (p + 1,) at the joints; keywords as in `solve_from`."""
    return solve_from(problem, relax.placed(problem, omega, eta), **keywords)


@alone
def solve_from(
    problem: Problem,
    x: np.ndarray,
    *,
    warm: tuple[FloatArray, FloatArray] | None = None,
    options: dict[str, Any] | None = None,
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
    if stretched.is_stretched(problem):
        return stretched.straight(problem)
    first = found = _solve_once(problem, x, warm, options, progress, check, near, hold)
    gone: tuple[Equilibrium, float] | None = None
    if leave_saddle:
        for _ in range(_DEPARTURES):
            if found.status is not Status.SADDLE or spent():
                break
            better = _depart(found, options, progress)
            if better is None:
                break
            gone, found = gone or better, better[0]
    return found if gone is None else _told_left(first, found, *gone, options, progress)


def _told_left(
    saddle: Equilibrium, found: Equilibrium, beside: Equilibrium, step: float, options: Any, progress: Progress | None
) -> Equilibrium:
    """`found` with the saddle that was left for it by `step`, which led to `beside`, and where the other way leads."""
    if not found.ok:
        return found
    other = None if spent() else _kicked(saddle, -step, options, progress)
    mirrored = None
    if other is not None and other.status in (Status.CONVERGED, Status.SADDLE) and _below(other, saddle):
        mirrored = abs(other.energy.total - beside.energy.total) <= _SAME * max(1.0, abs(beside.energy.total))
    left = Left(saddle.energy.total - found.energy.total, mirrored)
    return replace(found, left=left, message=f"{found.message}; {left}")


#: Saddles that are left in turn, and sizes of the first step along the unstable mode (largest change of omega or eta,
#: relative to 1 + the largest omega).
_DEPARTURES = 6
_KICKS = (0.03, 0.3)


#: Difference of energies, relative (at least 1), up to which they are the same.
_SAME = 1e-6


def _depart(
    saddle: Equilibrium, options: dict[str, Any] | None, progress: Progress | None
) -> tuple[Equilibrium, float] | None:
    """The equilibrium of lower energy reached from a saddle along its unstable mode, either way, and the step; or
    None."""
    best: tuple[Equilibrium, float] | None = None
    for kick in _KICKS:
        for step in (kick, -kick):
            found = _kicked(saddle, step, options, progress)
            if found.status in (Status.CONVERGED, Status.SADDLE) and _below(found, saddle):
                if best is None or (found.ok and not best[0].ok):
                    best = found, step
                if best[0].ok:
                    return best
    return best


def _below(found: Equilibrium, saddle: Equilibrium) -> bool:
    return found.energy.total < saddle.energy.total - 1e-12 * max(1.0, abs(saddle.energy.total))


def _kicked(saddle: Equilibrium, step: float, options: dict[str, Any] | None, progress: Progress | None) -> Equilibrium:
    """Where a saddle leads to that is moved by `step` along its unstable mode."""
    problem = saddle.problem
    omega, eta = problem.joint_values(saddle.at if saddle.at is not None else saddle.x)
    d_omega, d_eta = problem.joint_values(saddle.mode)
    size = max(np.abs(d_omega).max() / (1.0 + np.abs(omega).max()), np.abs(d_eta).max(), 1e-300)
    turned = eta + step / size * d_eta
    shape = omega + step / size * d_omega, turned if problem.fields.free else np.clip(turned, -5.0, 5.0)
    return _solve_once(problem, problem.state(*shape), None, options, progress, True)


def _minimum(
    problem: Problem,
    x: FloatArray,
    warm: tuple[FloatArray, FloatArray] | None,
    options: dict[str, Any] | None,
    progress: Progress | None,
) -> Minimum:
    asked: Any = problem
    if not problem.row_count:
        return _without_rows(asked, x, options, progress)
    if problem.formulation != "mixed":
        return other_models.minimum(asked, x, options, progress)
    return relax.minimum(asked, x, options, progress, warm)


def _without_rows(
    problem: ChainedProblem, x: FloatArray, options: dict[str, Any] | None, progress: Progress | None
) -> Minimum:
    minimum = nested.minimum(problem, x, options, progress)
    if not minimum.finished and minimum.residual > RESIDUAL_TOLERANCE and np.all(np.isfinite(minimum.x)):
        none = np.zeros_like(minimum.x)
        polished = polish(problem, minimum.x)
        residual = kkt_residual(problem, polished, none)
        if residual < minimum.residual:
            minimum = replace(minimum, x=polished, multipliers=none, residual=residual, solver=DENSE)
    if minimum.residual > RESIDUAL_TOLERANCE and not np.any(problem.joint_values(x)[1]):
        # a start without torsion stays without it to rounding: the planar state is stationary, if hardly a minimum
        none = np.zeros_like(x)
        flat = choose.minimise(problem.with_changes(planar=True), x, options, progress)
        residual = kkt_residual(problem, flat.x, none)
        if residual <= RESIDUAL_TOLERANCE:
            return replace(flat, multipliers=none, residual=residual, iterations=flat.iterations + minimum.iterations)
    return minimum


def _kept(problem: Problem, x: FloatArray) -> Minimum | None:
    """x itself when it is stationary with no bound active (a problem without rows), else None."""
    if problem.row_count:
        return None
    asked: Any = problem
    clock = time.perf_counter()
    none = np.zeros_like(x)
    residual = kkt_residual(asked, x, none)
    if not residual <= RESIDUAL_TOLERANCE:
        return None
    seconds = time.perf_counter() - clock
    return Minimum(x, none, np.empty(0), residual, 0, 0, "stationary from the start", True, seconds, KNOWN)


def _solve_once(
    problem: Problem,
    x: FloatArray,
    warm: tuple[FloatArray, FloatArray] | None,
    options: dict[str, Any] | None,
    progress: Progress | None,
    want_check: bool,
    near: bool = False,
    hold: bool = True,
) -> Equilibrium:
    minimum = (_kept(problem, x) if near else None) or _minimum(problem, x, warm, options, progress)
    if problem.walls and hold:
        glued: Any = problem
        problem, minimum = contacts.held(glued, minimum, options, progress)
    return found_at(problem, minimum, options, want_check, hold)


def found_at(
    problem: Problem,
    minimum: Minimum,
    options: dict[str, Any] | None = None,
    want_check: bool = True,
    hold: bool = True,
) -> Equilibrium:
    """What a minimiser's end is: its status and stability, and what it says of itself; keywords as in `solve_from`."""
    evaluations = {k: getattr(problem.counters, k) for k in ("value", "gradient", "hessian", "series")}
    parts = problem.energy_parts(minimum.x)
    clock = time.perf_counter()
    judged = want_check and bool(np.all(np.isfinite(minimum.x)) and np.all(np.isfinite(parts)))
    judged = judged and (not problem.row_count or minimum.residual <= RESIDUAL_TOLERANCE)
    check = stability.judge(problem, minimum) if judged else None
    steepest = 0.0
    if not problem.fields.free:
        steepest = float(np.abs(problem.parameters(minimum.x)[:, 2]).max() * problem.half_width)
    status = _status(problem, minimum, check, parts, steepest, want_check)
    beyond = penetration.deepest(problem, minimum.x)
    known = status in (Status.CONVERGED, Status.SADDLE)
    why = SPENT if spent() else f"{minimum.solver}: {minimum.message}"
    message = status.value if known else f"{status.value} ({why})"
    slack = slack_of(problem)
    if status is Status.NOT_CONVERGED and slack is not None and slack < _LEAST_SLACK:
        message += (
            f"; held ends that leave a slack of {slack:.2g} l are lost in rounding: give more slack, or none at all"
        )
    if known and check is not None and check.eigenvalue == np.inf:
        message += "; what holds the strip leaves these segments no freedom: nothing can be unstable there"
    if known and minimum.solver == IPOPT and choose.asked() == "auto":
        message += "; found by Ipopt"
    if known and beyond is not None and not beyond <= penetration.TOLERANCE:
        deep = f"the strip reaches {beyond:.2g} l beyond a wall between its joints"
        if hold:
            status, known, message = Status.NOT_CONVERGED, False, f"not converged: {deep}; use more segments"
        else:
            message += f"; on its way {deep}"
    integral = quadrature.error(problem, minimum.x, float(parts[0])) if known else None
    if integral is not None and not integral <= quadrature.TOLERANCE:
        status, known = Status.NOT_CONVERGED, False
        message = (
            "not converged: the elastic energy hangs on its quadrature, an adaptive integral differs by "
            f"{integral:.2g} of it; use more segments"
        )
    if known and check is not None and check.stable is None:
        message += "; stability could not be judged"
    if known and check is not None and check.indifferent:
        message += INDIFFERENT_WORDS
    if known and problem.closure is not None and problem.start is None and problem.walls:
        message += FREE_BAND_WORDS
    if known:
        message += _held_from_sliding(problem, minimum)
    return Equilibrium(
        problem=problem,
        status=status,
        message=message,
        x=minimum.x,
        multipliers=minimum.multipliers,
        rows=minimum.rows,
        residual=minimum.residual,
        iterations=minimum.iterations,
        evaluations=evaluations,
        energy=Energy(*(float(v) for v in parts)),
        stable=check.stable if known and check is not None else None,
        lowest_eigenvalue=check.eigenvalue if check is not None else float("nan"),
        mode=check.mode if check is not None else np.zeros_like(minimum.x),
        at=check.at if check is not None else None,
        active_bounds=check.active if check is not None else 0,
        seconds={"solve": minimum.seconds, "stability": time.perf_counter() - clock},
        penetration=beyond,
        options={**ipopt.DEFAULT_OPTIONS, **(options or {})} if minimum.solver == IPOPT else {},
        solver=minimum.solver,
        moved=minimum.moved,
        quadrature_error=integral,
        nonconvex=convexity.share(problem, minimum.x) if known else None,
    )


def _held_from_sliding(problem: Problem, minimum: Minimum) -> str:
    """What a band says whose segments push it along itself; "" where they do not.

    Sliding changes no energy of the strip but that of the segments, unless these are their own mirror image about the
    middle of the first (`ribbon.problems.held.Held.slides`). With c = eta_0 + eta_1 = 0 held by a multiplier y, the
    push is y dc/ds = 2 y eta'.
    """
    where = problem.block_slices().get("gauge_slide") if problem.row_count else None
    if where is None:
        return ""
    held = float(minimum.rows[where][0])
    if not abs(held) > _SLIDES * max(1.0, float(np.abs(minimum.rows).max())):
        return ""
    push = 2.0 * abs(held * problem.parameters(minimum.x)[0, 0 if problem.fields.free else 2])
    return (
        f"; its segments push it along itself with {push:.2g} D w / l^2: make them mirror images about the middle of "
        "the first"
    )


def _status(
    problem: Problem,
    minimum: Minimum,
    check: stability.Stability | None,
    parts: FloatArray,
    steepest: float,
    wanted: bool,
) -> Status:
    if not np.all(np.isfinite(minimum.x)) or not np.all(np.isfinite(parts)):
        return Status.FAILED
    if not np.isfinite(minimum.residual):
        return Status.NOT_CONVERGED if spent() else Status.FAILED
    if minimum.code == other_models.FLIPPED:
        return Status.FLIPPED
    if steepest > 1.0:
        return Status.RULINGS_CROSS
    if minimum.residual > RESIDUAL_TOLERANCE:
        if spent():
            return Status.NOT_CONVERGED
        if minimum.code in _IPOPT_INFEASIBLE or violation(problem, minimum.x) > _INFEASIBLE:
            return Status.INFEASIBLE
        return Status.NOT_CONVERGED
    if check is None and wanted:
        return Status.FAILED
    return Status.SADDLE if check is not None and check.stable is False else Status.CONVERGED


def split_state(lengths: np.ndarray, x: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Segments cut into `parts` equal pieces and the chained unknowns of the same shape on them (exactly the same)."""
    finer = np.repeat(lengths / parts, parts)
    by_segment = x.reshape(lengths.size + 1, -1)
    return finer, np.concatenate([by_segment[0], np.repeat(by_segment[1:], parts, axis=0).ravel()])


@alone
def refine(equilibrium: Equilibrium, parts: int = 2, **keywords: Any) -> Equilibrium:
    """The same scene on segments cut into `parts`, started from `equilibrium`: the same branch, a smaller error.

    The distance to the coarser result estimates the coarser result's discretisation error.
    """
    if parts < 1:
        raise RibbonInputError("parts", parts, "cut every segment into at least one piece")
    old: Any = equilibrium.problem
    if not old.row_count:
        lengths, x = split_state(old.lengths, equilibrium.x, parts)
        fresh = old.with_changes(lengths=lengths)
        return _beside(fresh, x, **keywords)
    return on_segments(equilibrium, np.repeat(old.lengths / parts, parts), **keywords)


def _beside(problem: ChainedProblem, x: FloatArray, **keywords: Any) -> Equilibrium:
    """Equilibrium of a problem without rows close to x (n,); keywords as in `solve_from`."""
    # a few steps of Newton's from so near; a minimiser with a barrier loses the start
    clock = time.perf_counter()
    x, steps, solver = _approached(problem, x)
    spent = time.perf_counter() - clock
    found = solve_from(problem, x, near=True, **keywords)
    seconds = {**found.seconds, "solve": found.seconds["solve"] + spent}
    arrived = found.solver == KNOWN and steps
    return replace(
        found, iterations=found.iterations + steps, seconds=seconds, solver=solver if arrived else found.solver
    )


def _approached(problem: ChainedProblem, x: FloatArray) -> tuple[FloatArray, int, str]:
    """The stationary point close to x (n,), the steps there and what made them; x itself, or near it, where there is
    none."""
    if choose.asked() == "ipopt":
        return *approach(problem, x, 0.01 * RESIDUAL_TOLERANCE * force_scale(problem)), DENSE
    found = newton.minimise(problem, x, near=True)
    return found.x if found.residual <= RESIDUAL_TOLERANCE else x, found.iterations, found.solver


def on_segments(equilibrium: Equilibrium, lengths: FloatArray, **keywords: Any) -> Equilibrium:
    """The same scene on segments of other `lengths` (k,), started from `equilibrium`, whose shape is close."""
    old: Any = equilibrium.problem
    fresh = old.with_changes(lengths=lengths)
    if old.touching:
        fresh = fresh.with_changes(touching=tuple(touch for touch in old.touching if not touch.slides))
    if not old.row_count:
        return _beside(fresh, transfer.on_joints(old, equilibrium.x, fresh), **keywords)
    if stretched.is_stretched(fresh):
        return stretched.straight(fresh)
    plain = set(keywords) <= {"options", "progress", "leave_saddle"} and climb.can(fresh, keywords.get("options"))
    if plain and equilibrium.ok and climb.nested(old, fresh):
        found = _climbed(equilibrium, fresh)
        if found is not None and found.ok:
            return found
    start = transfer.transferred(old, equilibrium.x, fresh)
    found = _from_near(fresh, start, **keywords)
    alike = found.ok and equilibrium.ok and not fresh.walls and climb.nested(old, fresh)
    if not alike or not climb.above(fresh, found.x, start):
        return found
    ended = f"not converged: on {fresh.lengths.size} segments it ended above the state it began at, in another one"
    return replace(found, status=Status.NOT_CONVERGED, stable=None, message=ended)


def _from_near(problem: Problem, x: FloatArray, **keywords: Any) -> Equilibrium:
    """Equilibrium of a problem of the mixed model from a shape close to it; keywords as in `solve_from`."""
    asked: Any = problem
    minimum = relax.from_near(asked, x, keywords.get("options"), keywords.get("progress"))
    return solve_from(problem, minimum.x, warm=(minimum.rows, minimum.multipliers), **keywords)
