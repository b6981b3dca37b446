"""Following an equilibrium while a parameter varies (thesis, algorithms 2 and 3): predictor, warm corrector, cut-back.

A path is a function t in [0, 1] -> problem: a clamp that moves, a weight that grows, a wall that sinks. Every step
starts from the last equilibrium, unknowns and multipliers extrapolated through the last two (secant; docs/theory.md,
eq. (6.3)), and is cut when the corrector fails, when the shape jumps or when a body went through the strip
(`ribbon.find.tubes.swept`); what is left at the smallest step is a real jump (a snap), recorded.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon.errors import RibbonInputError
from ribbon.find import contacts, relax
from ribbon.find.solving import search
from ribbon.find.solving import start as starts
from ribbon.find.solving.request import How, Options, Progress, Seed
from ribbon.notes import Note
from ribbon.problems import transfer
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.result import Equilibrium, Status
from ribbon.solvers.problem import RESIDUAL_TOLERANCE
from ribbonbench.threads import alone

FloatArray = NDArray[np.float64]

#: Growth of the step after an easy corrector, shrinking after a hard one, cut after a failure.
GROW, SHRINK, CUT = 1.6, 0.7, 0.4
EASY, HARD, MOST = 8, 25, 120
#: A step is a jump when the shape moves this many times further than the last steps let expect, and by more than this
#: share of its size.
JUMP, LEAST_JUMP = 8.0, 0.05
#: Smallest adaptive step.
SMALLEST = 4e-3
#: |omega| l below which a strip counts as straight.
_STRAIGHT = 1e-9
#: Segments up to which every step's stability is judged; beyond, only the last one's.
CHECKED = 160
#: Ends of a corrector at which a path goes on.
_GOOD = (Status.CONVERGED, Status.SADDLE)


@dataclass(frozen=True)
class StepRecord:
    """One step along a path.

    t: where it ends; size; status: code of the result; accepted; iterations; residual; energy (D w / l);
    lowest_eigenvalue (nan where it was not judged); seconds; jump: whether the shape snapped.
    """

    t: float
    size: float
    status: str
    accepted: bool
    iterations: int
    residual: float
    energy: float
    lowest_eigenvalue: float
    seconds: float
    jump: bool


def record_of(t: float, size: float, state: Equilibrium, accepted: bool, seconds: float, jump: bool) -> StepRecord:
    return StepRecord(
        t, size, state.status.code, accepted, state.iterations, state.residual, state.energy.total,
        state.lowest_eigenvalue, seconds, jump,
    )  # fmt: skip


def _shape(state: Equilibrium) -> FloatArray:
    """omega and eta at the joints, for measuring how far a shape moved."""
    return np.concatenate(state.problem.joint_values(state.x))


def _same_structure(problem: Problem, state: Equilibrium) -> bool:
    old = state.problem
    return (
        type(old) is type(problem)
        and np.array_equal(old.lengths, problem.lengths)
        and old.size == problem.size
        and list(old.block_slices()) == list(problem.block_slices())
        and state.rows.size == problem.row_count
        and not state.forces_why
    )


def anchored(problem: Problem, state: Equilibrium) -> Problem:
    """The problem with its gauges and the signs of its quaternions referring to where `state` stands, held on its
    walls' side at the points where `state` is, and apart where that is; places of walls that slide are looked for
    anew."""
    if problem.walls and problem.formulation == "mixed":
        kept = tuple(t for t in state.problem.touching if t.wall < len(problem.walls) and not t.slides)
        problem = problem.with_changes(touching=kept)
    if isinstance(problem, MixedProblem) and isinstance(state.problem, MixedProblem) and problem.apart:
        from ribbon.find import apart

        problem = problem.with_changes(pairs=apart.carried(problem, state.problem, state.x))
    return problem.anchored(state.problem.anchor(state.x))


@alone
def switch(
    problem: Problem,
    start: Equilibrium,
    *,
    leave_saddle: bool = False,
    progress: Progress | None = None,
    check: bool = True,
    hold: bool = True,
    options: Options | None = None,
) -> Equilibrium:
    """Equilibrium of `problem` from the shape of `start`, whatever its segments, clamps, walls or formulation; keywords
    as in `ribbon.find.solve.solve_from`."""
    return switched(problem, start, How(options, progress, leave_saddle, check, hold=hold))


def switched(problem: Problem, start: Equilibrium, how: How) -> Equilibrium:
    """As `switch`."""
    old = start.problem
    if not (problem.row_count and old.row_count):
        omega, eta = old.joint_values(start.x)
        s_old = np.concatenate([[0.0], np.cumsum(old.lengths)])
        s_new = np.concatenate([[0.0], np.cumsum(problem.lengths)])
        shape = np.interp(s_new, s_old, omega), np.interp(s_new, s_old, eta)
        return search.from_state(problem, problem.state(*shape), how)
    problem = anchored(problem, start)
    assert isinstance(problem, MixedProblem)
    assert isinstance(old, MixedProblem)
    shapes: Iterable[tuple[FloatArray, FloatArray]] = ()
    if float(np.abs(old.joint_values(start.x)[0]).max()) < _STRAIGHT:  # nothing tells which way a straight strip bends
        if problem.end is not None:
            shapes = starts.shapes(problem, Seed())
        elif problem.walls:
            flat = np.zeros(problem.lengths.size + 1)
            shapes = contacts.bent_aside(problem, flat, flat)
    tried = [search.from_state(problem, problem.state(omega, eta), how) for omega, eta in shapes]
    if tried:
        return min(tried, key=lambda state: (not state.ok, state.energy.total if state.ok else 0.0))
    x = transfer.transferred(old, start.x, problem)
    minimum = relax.from_near(problem, x, how.options, how.progress)
    if minimum.residual > RESIDUAL_TOLERANCE:
        return search.from_state(problem, x, how)
    return search.from_state(problem, minimum.x, how, (minimum.rows, minimum.multipliers))


def _corrected(
    problem: Problem, state: Equilibrium, before: Equilibrium | None, factor: float, how: How
) -> Equilibrium:
    """The next equilibrium: from the secant's prediction with multipliers, else from the last one without."""
    how = replace(how, options={"max_iter": MOST, **_short_steps(problem)})
    if not problem.row_count:
        x = state.x if before is None else state.x + factor * (state.x - before.x)
        return search.from_state(problem, x, replace(how, options={"max_iter": MOST, "mu_init": 1e-6}))
    if _touches_alike(problem, state):
        assert isinstance(problem, MixedProblem)
        assert isinstance(state.problem, MixedProblem)
        from ribbon.find import apart

        x = state.x if before is None or before.x.size != state.x.size else state.x + factor * (state.x - before.x)
        rows = apart.rows_of(state.problem, problem, state)
        tried = search.from_state(problem, x, how, (rows, state.multipliers))
        if tried.residual <= RESIDUAL_TOLERANCE:
            return tried
    elif _same_structure(problem, state):
        x, rows = state.x, state.rows
        if before is not None and before.x.size == x.size and before.rows.size == rows.size:
            x = x + factor * (x - before.x)
            rows = rows + factor * (rows - before.rows)
        tried = search.from_state(problem, x, how, (rows, state.multipliers))
        if tried.residual <= RESIDUAL_TOLERANCE:
            return tried
    return switched(problem, state, how)


def _touches_alike(problem: Problem, state: Equilibrium) -> bool:
    """Whether parts of the strip touch, and all but what touches is as in `state`: how many rows a place has changes
    with the joints that it is near, and its push goes over to those of the same place (`ribbon.find.apart.rows_of`)."""
    if not (isinstance(problem, MixedProblem) and problem.pairs):
        return False
    bare, old = problem.with_changes(pairs=()), state.problem
    return (
        isinstance(old, MixedProblem)
        and np.array_equal(old.lengths, problem.lengths)
        and old.size == problem.size
        and bare.row_count == old.with_changes(pairs=()).row_count
        and not state.forces_why
    )


def _short_steps(problem: Problem) -> dict[str, Any]:
    """Where strands of a round rod touch no step may lead past each other."""
    if isinstance(problem, MixedProblem) and problem.round and problem.pairs:
        from ribbon.find import apart

        return {"travel": apart.TRAVEL * problem.apart}
    return {}


def _landed(problem: Problem, state: Equilibrium, tried: Equilibrium, how: How) -> Equilibrium:
    """Where a strip that is about to snap lands: a shorter step would not bring it nearer, so that the iteration has
    the time of a first solve, from where the last one stopped, then from the last state; `tried` where both fail."""
    if _keeps(problem):
        assert isinstance(problem, MixedProblem)
        assert isinstance(state.problem, MixedProblem)
        from ribbon.find import snap

        return snap.landed(problem, transfer.transferred(state.problem, state.x, problem), how)
    if problem.row_count and tried.rows.size == problem.row_count and np.all(np.isfinite(tried.x)):
        new = search.from_state(problem, tried.x, how, (tried.rows, tried.multipliers))
        if new.status in _GOOD:
            return new
    new = switched(problem, state, how)
    return new if new.status in _GOOD else tried


@alone
def follow(
    problem_at: Callable[[float], Problem],
    start: Equilibrium,
    *,
    steps: int | None = None,
    first: float = 0.25,
    smallest: float | None = None,
    leave_saddle: bool = False,
    on_step: Callable[[StepRecord, Equilibrium], None] | None = None,
    begin: float = 0.0,
    progress: Progress | None = None,
    place: Callable[[Equilibrium], FloatArray] | None = None,
) -> Equilibrium:
    """The equilibrium at t = 1 of the path ``t -> problem_at(t)`` from `start`, the one at t = `begin`.

    steps: equal ones (cut where one fails); None: adaptive, from the size `first`; never cut below `smallest` (default
    SMALLEST, or a fifth of an equal step).
    leave_saddle: unstable equilibria met along it are left along their unstable mode. on_step: called after every
    accepted step. place: lengths (p,) over l of the next elements, from the last state (`ribbon.find.branch.passages`:
    elements that move with what is sudden on the strip); None: those of `problem_at`. Of the states along it only the
    last is held on its walls' side between the joints. The log (dictionaries of `StepRecord`, rejected steps too) is on
    the result; when the path cannot be followed to its end the last good equilibrium is returned with the status of
    what stopped it.
    """
    size = 1.0 / steps if steps else min(first, 1.0)
    if smallest is None:
        smallest = 0.2 * size if steps else SMALLEST
    t = begin
    state, before, t_before = start, None, 0.0
    speed: float | None = None
    log: list[dict[str, Any]] = []
    last_bad: Equilibrium | None = None
    while t < 1.0 - 1e-12:
        target = min(1.0, t + size)
        if 1.0 - target < 0.1 * size:
            target = 1.0
        step = target - t
        problem = problem_at(target)
        if place is not None:
            problem, before = problem.with_changes(lengths=place(state)), None
        if any(wall.friction for wall in problem.walls):
            raise RibbonInputError("friction", None, "is that of ribbon.find.friction.path.follow")
        problem = anchored(problem, state)
        check = problem.lengths.size <= CHECKED or target == 1.0 or leave_saddle
        clock = time.perf_counter()
        factor = step / (t - t_before) if before is not None and t > t_before else 0.0
        how = How(progress=progress, check=check, hold=False)
        new = _unpassed(state, _corrected(problem, state, before, factor, how))
        if new.status not in _GOOD and CUT * step < smallest:
            new = _landed(problem, state, new, how)
        if leave_saddle and new.status is Status.SADDLE:
            new = _left(new)
        seconds = time.perf_counter() - clock
        good = new.status in _GOOD
        moved, expected, jump = 0.0, None, False
        if good:
            moved, jump, expected = movement(state, new, speed, step)
        if jump and not step > 4.0 * smallest and _keeps(problem):
            new = _landed(problem, state, new, how)
            good = new.status in _GOOD
        went = good and _swept(state, new)  # a snap that it looks like is left in the end
        jump, least = jump or went, min(smallest, SMALLEST) if went else smallest
        if not good or (jump and step > 4.0 * least and (went or not leave_saddle)):
            log.append(asdict(record_of(target, step, new, False, seconds, jump)))
            size = CUT * step
            last_bad = new
            before = None
            if size < least:
                return stopped(state, last_bad, t, start, log)
            continue
        if target == 1.0 and new.problem.walls:
            new = search.from_state(new.problem, new.x, How(progress=progress), (new.rows, new.multipliers))
            if new.status not in _GOOD:
                log.append(asdict(record_of(target, step, new, False, seconds, jump)))
                return stopped(state, new, t, start, log)
        record = record_of(target, step, new, True, seconds, jump)
        log.append(asdict(record))
        before, t_before = (None, t) if jump else (state, t)
        if expected is not None or moved > 0:
            speed = None if jump else moved / step
        state, t = new, target
        if on_step is not None:
            on_step(record, state)
        size = _next_size(size, step, steps, new.iterations)
    return replace(state, log=(*start.log, *log))


def _swept(state: Equilibrium, new: Equilibrium) -> bool:
    """Whether a body went through the strip on the way to the next state."""
    if not new.problem.walls:
        return False
    from ribbon.find.tubes import swept

    return swept.through(state.problem, state.x, new.problem, new.x)


def _keeps(problem: Problem) -> bool:
    """Whether parts of the strip are kept apart."""
    return isinstance(problem, MixedProblem) and problem.apart > 0.0


def _unpassed(state: Equilibrium, new: Equilibrium) -> Equilibrium:
    """The next state; none where parts of the strip, kept apart, would pass through each other on the way to it."""
    if new.status not in _GOOD or not _keeps(new.problem):
        return new
    assert isinstance(state.problem, MixedProblem)
    assert isinstance(new.problem, MixedProblem)
    from ribbon.judge import passage

    found = passage.passage(state.problem, state.x, new.problem, new.x)
    if found is None:
        return new
    text = Note.PASSES.text(s=found.s, other=found.s_other)
    return replace(new, status=Status.NOT_CONVERGED, stable=None, message=text, notes=(Note.PASSES,))


def _left(saddle: Equilibrium) -> Equilibrium:
    """The state beside an unstable one, along its unstable mode; itself where nothing is found there."""
    better = search.from_state(
        saddle.problem, saddle.x, How(leave_saddle=True, hold=False), (saddle.rows, saddle.multipliers)
    )
    return better if better.status in _GOOD else saddle


def _next_size(size: float, step: float, steps: int | None, iterations: int) -> float:
    """The size of the step after an accepted one of size `step`, by how hard it was; of `steps` equal ones at most."""
    if steps:
        return min(1.0 / steps, max(size, step) * GROW)
    if iterations <= EASY:
        return step * GROW
    return step * SHRINK if iterations >= HARD else size


def movement(old: Equilibrium, new: Equilibrium, speed: float | None, step: float) -> tuple[float, bool, float | None]:
    """How far the shape moved (root mean square over the joints), whether that is a jump, what was expected."""
    a, b = _shape(old), _shape(new)
    if a.size != b.size:
        return 0.0, False, None
    moved = float(np.sqrt(np.mean((a - b) ** 2)))
    scale = float(np.sqrt(np.mean(b**2))) + 1e-12
    if speed is None:
        return moved, False, None
    return moved, moved > JUMP * speed * step and moved > LEAST_JUMP * scale, speed * step


def stopped(
    state: Equilibrium, bad: Equilibrium, t: float, start: Equilibrium, log: list[dict[str, Any]]
) -> Equilibrium:
    status = bad.status if bad.status not in _GOOD else Status.NOT_CONVERGED
    return replace(
        state,
        status=status,
        stable=None,
        message=Note.PATH_STOPPED.text(t=t, why=bad.message),
        notes=(Note.PATH_STOPPED,),
        log=(*start.log, *log),
    )
