"""From several strips to an equilibrium of all of them: where they begin, how they reach their joints, the verdict.

Strips begin in shapes of their own, put one after the other where a clamp or a joint holds them; joints that close a
loop are then open. They are led together: the rows of all joints are met up to a part of what they miss, which goes to
zero in steps, each an equilibrium that the next one begins at.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.contact import Barrier
from ribbon.errors import RibbonInputError
from ribbon.find.strips import facing, lain, moment, touch
from ribbon.find.strips import walls as touching_walls
from ribbon.find.strips.assemble import Member, assembled, shapes
from ribbon.find.strips.result import StripsEquilibrium
from ribbon.judge import penetration, stability
from ribbon.judge.reduction import metric, tangent
from ribbon.judge.spectrum import SecondVariation
from ribbon.loads import Gravity
from ribbon.problems.strips.joint import Joint
from ribbon.problems.strips.place import placed
from ribbon.problems.strips.problem import START, StripsProblem
from ribbon.problems.transfer import transferred
from ribbon.result import Energy, Equilibrium, Status
from ribbon.solvers import choose, ipopt, newton_rows
from ribbon.solvers.budget import spent, within
from ribbon.solvers.cyipopt_api import is_there
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum, violation
from ribbonbench.threads import alone

FloatArray = NDArray[np.float64]

#: Misfit (l_0, rad) of joints up to which a start is near, and the longest and shortest step that leads them together.
NEAR, STEP, LEAST = 1e-6, 0.25, 1.0 / 64.0
#: Curvatures (1/l) that are tried where a flat strip says nothing of which way it bends.
BENDS = (1.0, -1.0, 3.0)
#: Bounds of |eta| and of |omega| l on the way.
BOX = (60.0, 3.0)
#: Options of a second attempt: no unknown goes farther in a step than this part of 1 + its size.
SHORT: dict[str, float] = {"reach": 0.3, "max_iter": 300, "mu_init": 1e-5}
#: How far (largest omega l of the mode) a saddle is left along its unstable mode.
AWAY = (0.3, 0.05)
#: Iterations beside walls, after which shorter steps are tried.
_FEW = 150
#: Turns of what is held apart and what is held by walls, at an equilibrium.
_TURNS = 5
#: Samples of a strip where two shapes are compared.
_SAMPLES = 201


@alone
def solve(
    members: Sequence[Member],
    joints: Sequence[Joint] = (),
    gravity: Gravity | None = None,
    energy: str = "wunderlich",
    apart: float = 0.0,
    rulings: Sequence[str | None] | None = None,
    leave_saddle: bool = True,
    budget: float | None = None,
    walls: Sequence[Barrier] = (),
    friction: float = 0.0,
    itself: bool = False,
    **choices: bool | str | None,
) -> StripsEquilibrium:
    """Equilibrium of several strips; arguments as of `assembled`. leave_saddle: follow its unstable mode to a stable
    state; budget: time in s on the processor. Moments at ends grow from nothing, from the equilibrium without them.
    `RibbonInputError` on bad input."""
    if friction or any(wall.friction for wall in walls):
        key, value = ("friction", friction) if friction else ("walls", len(walls))
        raise RibbonInputError(
            key, value, "friction acts along a path only (`ribbon.find.strips.path`): without one every state "
            "within mu N is an equilibrium",
        )  # fmt: skip
    problem = assembled(members, joints, gravity, energy, apart, rulings, walls, 0.0, itself, **choices)
    moments = [part.moment for part in problem.parts]
    problem = problem.with_parts([{"moment": None} for _ in moments])
    with within(budget):
        best: StripsEquilibrium | None = None
        for bend in _bends(problem, members):
            x = placed(problem, shapes(problem, members, bend))
            _check_start(problem, x, members)
            state = judged(*settled(*reached(problem, x)))
            if leave_saddle and state.status is Status.SADDLE:
                state = left(state)
            if best is None or _rank(state) < _rank(best):
                best = state
            if best.ok or spent():
                break
        assert best is not None
        if not any(moments) or not best.ok:
            return best
        return moment.grown(best, moments, lambda near, point: judged(*settled(near, point)))


def settled(problem: StripsProblem, point: Minimum) -> tuple[StripsProblem, Minimum, float | None]:
    """The equilibrium with what is to be held apart and on its walls' side, and how far (l_0) strips are nearer to each
    other than they are kept; None where nothing keeps them; moments as they are where their ends stand."""
    return moment.balanced(problem, point, _held) if moment.loaded(problem) else _held(problem, point)


def _held(problem: StripsProblem, point: Minimum) -> tuple[StripsProblem, Minimum, float | None]:
    depth: float | None = None
    if facing.is_held(problem):
        return _lain(problem, point)
    for _ in range(_TURNS):
        problem, point, depth = touch.kept(problem, point)
        if not touching_walls.has_walls(problem):
            break
        problem, point = touching_walls.held(problem, point)
        if depth is None or not touch.minima(problem, point.x, -touch.TOLERANCE):
            break
    return problem, point, depth


def _lain(problem: StripsProblem, point: Minimum) -> tuple[StripsProblem, Minimum, float | None]:
    """The same where strips are held at stations: searched for again where they are too near, or behind a wall."""
    depth, beyond = lain.depth(problem, point.x), touching_walls.deepest(problem, point.x)
    good = point.residual <= RESIDUAL_TOLERANCE and depth <= touch.TOLERANCE
    if spent() or (good and (beyond is None or beyond <= penetration.TOLERANCE)):
        return problem, point, depth
    found = lain.lain(problem, point.x, weights(problem))
    return (problem, point, depth) if found is None else (*found, lain.depth(found[0], found[1].x))


def _check_start(problem: StripsProblem, x: FloatArray, members: Sequence[Member]) -> None:
    """Refuses strips that begin nearer to each other than they are kept, or through each other."""
    near = touch.minima(problem, x, -touch.DEPTH) if problem.apart else []
    if near:
        gap, where = near[0]
        names = [members[k].name or str(k) for k in (where.one, where.other)]
        places = [sigma * s for sigma, s in zip((problem.lengths_over[where.one], problem.lengths_over[where.other]),
                                                (where.pair.s, where.pair.s_other), strict=True)]  # fmt: skip
        raise RibbonInputError(
            "start", f"{names[0]} at s = {places[0]:.4g} l, {names[1]} at s = {places[1]:.4g} l",
            f"these begin {gap + problem.apart:.3g} l from each other, nearer than they are kept ({problem.apart:.3g} "
            "l): move a clamp, or give a seed.curvature from which they are clear of each other",
        )  # fmt: skip


def _rank(state: StripsEquilibrium) -> tuple[int, float]:
    order = {Status.CONVERGED: 0, Status.SADDLE: 1, Status.NOT_CONVERGED: 2}
    return order.get(state.status, 3), state.residual if np.isfinite(state.residual) else np.inf


def _bends(problem: StripsProblem, members: Sequence[Member]) -> Iterator[list[float] | None]:
    """What is added to the curvatures that are not given: nothing, unless loops have to be closed by strips that are
    flat; then all the same way, and every other one the other way."""
    flat = [member.curvature is None and member.strip.naturally_straight for member in members]
    x = placed(problem, shapes(problem, members, None))
    if not any(flat) or misfit(problem, x) <= NEAR:
        yield None
        return
    for size in BENDS:
        yield [size * each for each in flat]
        yield [size * each * (-1.0) ** k for k, each in enumerate(flat)]
    yield None


def misfit(problem: StripsProblem, x: FloatArray) -> float:
    """How far joints and clamped ends are from where they are to be, l_0 and rad."""
    first = int(sum(8 * part.lengths.size for part in problem.parts))
    lower, upper = problem.constraint_bounds()
    c = problem.constraints(x)
    missed = np.where(lower == upper, np.abs(c - lower), 0.0)  # walls, which a start may cross, are none of it
    return float(missed[first:].max(initial=0.0))


def reached(problem: StripsProblem, x: FloatArray) -> tuple[StripsProblem, Minimum]:
    """The equilibrium that a start leads to, its joints brought together step by step."""
    c = problem.constraints(x)
    open_rows = c[problem.joint_rows].copy()
    if misfit(problem, x) <= NEAR:
        few = {"max_iter": _FEW} if touching_walls.has_walls(problem) else {}
        return _found(problem, x, {"mu_init": 1e-3, **few}, None)
    done, step, iterations, seconds = 0.0, STEP, 0, 0.0
    point: Minimum | None = None
    while done < 1.0 and step >= LEAST and not spent():
        part = min(1.0, done + step)
        near = problem.with_changes(missed=tuple(((1.0 - part) * open_rows).tolist()) if part < 1.0 else None)
        warm = None if point is None else (point.rows, point.multipliers)
        reached, tried = _found(near, x if point is None else point.x, {"max_iter": 150}, warm)
        iterations, seconds = iterations + tried.iterations, seconds + tried.seconds
        if tried.residual <= RESIDUAL_TOLERANCE:
            done, point, step = part, tried, min(2.0 * step, 0.5)
            problem = reached.with_changes(missed=None)
        else:
            step *= 0.5
    if point is None or done < 1.0:
        problem, point = _found(problem, x if point is None else point.x, {"mu_init": 1e-2, "max_iter": 300}, None)
    return problem, replace(point, iterations=point.iterations + iterations, seconds=point.seconds + seconds)


def _found(
    problem: StripsProblem, x: FloatArray, options: dict[str, float], warm: tuple[FloatArray, FloatArray] | None
) -> tuple[StripsProblem, Minimum]:
    """Stationary point from x; of strips that are kept apart by short steps, and with the places held that it needs."""
    return descended(problem, x) if problem.apart else (problem, minimised(problem, x, options, warm))


def descended(problem: StripsProblem, x: FloatArray) -> tuple[StripsProblem, Minimum]:
    """Stationary point downhill of x of strips that are kept apart: on stations where they lie along each other, else
    and where none is found so with places that slide."""
    tried = bool(facing.along(problem, x))
    found = lain.lain(problem, x, weights(problem)) if tried else None
    if found is not None:
        return found
    near, point = touch.downhill(problem, x, None if tried else facing.along)
    if tried or point.residual <= RESIDUAL_TOLERANCE or spent() or not facing.along(near, point.x):
        return near, point
    found = lain.lain(near, point.x, weights(problem))
    near, fresh = found or touch.downhill(near, point.x)
    return near, replace(fresh, iterations=fresh.iterations + point.iterations, seconds=fresh.seconds + point.seconds)


def minimised(
    problem: StripsProblem,
    x: FloatArray,
    options: dict[str, float] | None = None,
    warm: tuple[FloatArray, FloatArray] | None = None,
) -> Minimum:
    """Stationary point from x: in a box first, by Newton's iteration, and where that ends early by Ipopt."""
    if choose.asked() == "ipopt":
        return ipopt.minimise(problem, x, dict(options or {}), None, warm)
    boxed = problem.with_parts([{"box": _box(problem, x, k)} for k in range(len(problem.parts))])
    point: Minimum | None = None
    for more in ({}, SHORT):
        tried = newton_rows.minimise(boxed, x, {**(options or {}), **more}, None, warm)
        if _touches_box(boxed, tried.x):
            free = newton_rows.minimise(problem, tried.x, dict(options or {}), None, None)
            tried = replace(free, iterations=free.iterations + tried.iterations, seconds=free.seconds + tried.seconds)
        if point is None or tried.residual < point.residual or not np.isfinite(point.residual):
            point = tried
        if point.residual <= RESIDUAL_TOLERANCE or spent():
            return point
    assert point is not None
    if choose.asked() == "newton" or not is_there():
        return point
    other = ipopt.minimise(problem, x, {"max_iter": 200}, None, warm)
    return other if other.residual < point.residual else point


def _box(problem: StripsProblem, x: FloatArray, k: int) -> tuple[float, float]:
    part = problem.parts[k]
    omega, eta = (float(np.abs(values).max()) for values in part.joint_values(problem.own(x, k)))
    return max(BOX[0], 3.0 * omega), max(BOX[0] if part.fields.free else BOX[1], 2.0 * eta)


def _touches_box(problem: StripsProblem, x: FloatArray) -> bool:
    for k, part in enumerate(problem.parts):
        assert part.box is not None
        omega, eta = (np.abs(values).max() for values in part.joint_values(problem.own(x, k)))
        if omega > 0.999 * part.box[0] or eta > 0.999 * part.box[1]:
            return True
    return False


def weights(problem: StripsProblem) -> scipy.sparse.csr_matrix:
    """The metric of all strips in units of l_0: ``int (domega^2 + deta^2) ds`` of each, and where strips may turn at
    hinges and pins their starts too."""
    turning = any(joint.kind in ("hinge", "pin") for joint in problem.joints)
    each = []
    for part, sigma in zip(problem.parts, problem.lengths_over, strict=True):
        scale = np.ones(part.size)
        scale[:START] = 1.0 if turning else 0.0
        scale[part.layout.omega] = sigma**-0.5
        scale[part.layout.eta] = sigma**-0.5 if part.fields.free else sigma**0.5
        scale[part.layout.sideways] = sigma**-0.5
        turned = scipy.sparse.diags(scale)
        each.append(turned @ metric(part) @ turned)
    return scipy.sparse.block_diag(each, format="csr")


def judged(problem: StripsProblem, point: Minimum, depth: float | None = None) -> StripsEquilibrium:
    """The verdict at a minimiser's end."""
    clock = time.perf_counter()
    x = point.x
    status, message, check = _verdict(problem, point, depth)
    strips = tuple(_by_itself(problem, point, k, status, check) for k in range(len(problem.parts)))
    return StripsEquilibrium(
        problem, status, message, x, point.rows, point.multipliers, point.residual, point.iterations,
        None if check is None else check.stable, np.nan if check is None else check.eigenvalue,
        np.zeros_like(x) if check is None else check.mode, None if check is None else check.negative,
        {"solve": point.seconds, "stability": time.perf_counter() - clock}, point.solver, strips, depth,
    )  # fmt: skip


def _verdict(
    problem: StripsProblem, point: Minimum, depth: float | None
) -> tuple[Status, str, stability.Stability | None]:
    if not np.all(np.isfinite(point.x)) or not np.isfinite(point.residual):
        return Status.FAILED, Status.FAILED.value, None
    if point.residual > RESIDUAL_TOLERANCE:
        status = Status.INFEASIBLE if violation(problem, point.x) > 1e-6 and not spent() else Status.NOT_CONVERGED
        return status, f"{status.value} ({point.message})", None
    if depth is not None and depth > touch.TOLERANCE:
        return Status.NOT_CONVERGED, f"strips are {depth:.2g} l nearer to each other than they are kept", None
    beyond = touching_walls.deepest(problem, point.x)
    if beyond is not None and beyond > penetration.TOLERANCE:
        text = f"a strip reaches {beyond:.2g} of its length beyond a wall between its joints; use more elements"
        return Status.NOT_CONVERGED, text, None
    check = _stability(problem, point)
    if moment.loaded(problem):
        check = replace(check, stable=None)  # of the tangent's symmetric part: there is no energy
    if check.stable is None:
        return Status.CONVERGED, "converged: an equilibrium, whose stability is not known", check
    status = Status.CONVERGED if check.stable else Status.SADDLE
    return status, status.value, check


def _stability(problem: StripsProblem, point: Minimum) -> stability.Stability:
    """The second variation on what joints, clamps and contacts hold; of the worst ruling where strips are straight."""
    held = tangent(problem, point.x, point.multipliers, point.rows)  # type: ignore[arg-type]
    metric_of = weights(problem)
    best: stability.Stability | None = None
    for x in (point.x, *_other_rulings(problem, point.x)):
        second = SecondVariation(problem, x, point.rows, held, metric_of)  # type: ignore[arg-type]
        check = stability.of_variation(second, x, held)
        if best is None or check.eigenvalue < best.eigenvalue:
            best = check
        if best.stable is not True:
            break
    assert best is not None
    return best


def _other_rulings(problem: StripsProblem, x: FloatArray) -> Iterator[FloatArray]:
    """The same shapes with other rulings where strips are straight and they move nothing."""
    each = [stability.other_rulings(part, problem.own(x, k)) for k, part in enumerate(problem.parts)]
    for number in range(max(map(len, each))):
        yield np.concatenate(
            [found[number] if number < len(found) else problem.own(x, k) for k, found in enumerate(each)]
        )


def _by_itself(
    problem: StripsProblem, point: Minimum, k: int, status: Status, check: stability.Stability | None
) -> Equilibrium:
    part, where = problem.parts[k], slice(problem.offsets[k], problem.offsets[k + 1])
    if problem.touching:
        part = part.with_changes(touched=problem.touched(point.x, point.rows)[k])
    x = problem.own(point.x, k)
    return Equilibrium(
        problem=part, status=status, message=status.value, x=x, multipliers=point.multipliers[where],
        residual=point.residual, iterations=point.iterations, evaluations=part.counters.by_name(),
        energy=Energy(*(float(v) for v in part.energy_parts(x))), stable=None if check is None else check.stable,
        lowest_eigenvalue=np.nan if check is None else check.eigenvalue,
        mode=np.zeros(part.size) if check is None else check.mode[where], active_bounds=0,
        seconds={"solve": point.seconds, "stability": 0.0}, options={}, rows=problem.rows_of(point.rows, k),
        penetration=penetration.deepest(part, x), solver=point.solver,
    )  # fmt: skip


def left(state: StripsEquilibrium) -> StripsEquilibrium:
    """The lowest state that a saddle's unstable mode leads to, either way; the saddle where it leads to none."""
    best = state
    problem = state.problem
    size = max(float(np.abs(state.mode[at]).max(initial=0.0)) for at in _fields(problem))
    for away in AWAY:
        for sign in (1.0, -1.0):
            x = state.x + sign * away / max(size, 1e-12) * state.mode
            if problem.apart:
                near, point = descended(problem, x)
            else:
                near, point = problem, minimised(problem, x, {"mu_init": 1e-5, "max_iter": 300, "reach": 0.3})
            if point.residual > RESIDUAL_TOLERANCE:
                continue
            other = judged(*settled(near, point))
            if other.ok and other.energy.total < min(best.energy.total, state.energy.total - 1e-9):
                best = replace(other, left=state.energy.total - other.energy.total)
        if best is not state:
            break
    return best


def _fields(problem: StripsProblem) -> Iterator[slice]:
    for k, part in enumerate(problem.parts):
        at = part.layout.omega
        yield slice(int(problem.offsets[k]) + at.start, int(problem.offsets[k]) + at.stop, at.step)


def begun_near(problem: StripsProblem, x: FloatArray) -> StripsEquilibrium:
    """The equilibrium of `problem` beside x."""
    return judged(*settled(*_found(problem, x, {"mu_init": 1e-5}, None)))


def carried(state: StripsEquilibrium, fresh: StripsProblem) -> FloatArray:
    """The unknowns of `fresh`, the same strips on other segments, in the shape of `state`."""
    old = state.problem
    each = [transferred(part, old.own(state.x, k), fresh.parts[k]) for k, part in enumerate(old.parts)]
    return np.concatenate(each)


def distance(one: StripsEquilibrium, other: StripsEquilibrium) -> float:
    """The largest distance (l_0) between the centrelines of two states of the same strips, at equal abscissae."""
    s = np.linspace(0.0, 1.0, _SAMPLES)
    return max(
        float(np.linalg.norm(one.positions(k, s) - other.positions(k, s), axis=1).max()) for k in range(len(one.strips))
    )
