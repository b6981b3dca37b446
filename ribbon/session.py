"""A ribbon in the hand: move its clamps, change its weight, read forces and stiffness, keep where it has been.

    >>> from ribbon import Clamp, Session, Strip
    >>> session = Session(Strip(1.0, 0.05), Clamp(), end=Clamp((0, 0.1, 0.8)), segments=16)  # doctest: +SKIP
    >>> moved = session.move(end=Clamp((0, 0.1, 0.7)))  # doctest: +SKIP
    >>> moved.ok, session.forces["end"].force, session.stiffness.shape  # doctest: +SKIP

Every move is a continuation (`ribbon.follow`): warm starts, adaptive steps, cut-back. What goes in is in the strip's
own unit of length, what comes out in l and D w, and a stiffness is what comes out per what goes in (`ribbon.strip`);
`si` has it in newtons and metres.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ribbon import law, shown
from ribbon.boundary import Clamp
from ribbon.contact import Barrier, Wall
from ribbon.errors import NotDifferentiable, RibbonInputError
from ribbon.find.continuation import StepRecord, follow
from ribbon.find.solve import solve, solve_from
from ribbon.find.solving.assemble import assembled
from ribbon.find.solving.request import Request, SolveKeywords
from ribbon.forces import Force
from ribbon.law import Law
from ribbon.loads import Gravity, tip_force
from ribbon.problems.protocol import Problem
from ribbon.result import Equilibrium, Status
from ribbon.sensitivity.gradients import energy_slopes, gradients
from ribbon.strip import Strip
from ribbon.units import StripUnits

FloatArray = NDArray[np.float64]
OnStep = Callable[[StepRecord, Equilibrium], None]

#: Turn (rad) from which the shortest way between two frames is a matter of chance.
_HALF_TURN = np.pi - 1e-6
#: Energy that a step sets free beyond what the clamps took out of it, over the energies themselves, from which it is a
#: jump to another shape.
_RELEASED = 0.05
#: Part of itself by which a shape may move in a single step over the whole way.
_LEAP = 0.3
#: What a problem has that `_rates` knows no speed of.
_UNRATED = ("natural_twist", "natural_geodesic_curvature")


class _Left(Exception):
    """A path goes on from another state."""


@dataclass(frozen=True)
class Move:
    """How a move went.

    status: "arrived"; "snapped": it arrived, and jumped to another shape at `jumps` (shares of the path, 0 to 1);
    "stopped": no equilibrium was found beyond the share `reached`, and the session stands there. message says more.
    states: the equilibria of all accepted steps; log: every step, the rejected ones too (`StepRecord`).
    """

    status: str
    message: str
    reached: float
    jumps: tuple[float, ...]
    states: tuple[Equilibrium, ...]
    log: tuple[dict[str, Any], ...]

    @property
    def ok(self) -> bool:
        """Arrived without a jump, at a stable state."""
        return self.status == "arrived" and self.states[-1].ok


class Session:
    """A ribbon whose state follows what is done to it.

    Parameters are those of `ribbon.solve`, which finds the first state; formulation: "mixed" unless it is given;
    leave_saddle (here True unless it is given): a state that becomes unstable is left for a stable one, as a real
    ribbon would; otherwise it is followed.

    Raises `RibbonInputError` on bad input, and where the first state is no equilibrium.
    """

    def __init__(
        self,
        strip: Strip,
        clamp: Clamp | None = None,
        gravity: Gravity | None = None,
        **keywords: Unpack[SolveKeywords],
    ) -> None:
        self._leave_saddle = keywords.setdefault("leave_saddle", True)
        keywords.setdefault("formulation", "mixed")
        first = solve(strip, clamp, gravity, **keywords)
        if first.status not in (Status.CONVERGED, Status.SADDLE):
            raise RibbonInputError("clamp", first.status.code, f"the session has no state to begin at: {first.message}")
        #: All states in order, the steps of every move among them.
        self.history: list[Equilibrium] = [first]

    @classmethod
    def at(cls, state: Equilibrium, leave_saddle: bool = True) -> Session:
        """A session that begins at an equilibrium that is known already.

        Raises `RibbonInputError` for a state that is none."""
        if state.status not in (Status.CONVERGED, Status.SADDLE):
            raise RibbonInputError("state", state.status.code, f"the session has no state to begin at: {state.message}")
        found = cls.__new__(cls)
        found._leave_saddle = leave_saddle
        found.history = [state]
        return found

    @property
    def state(self) -> Equilibrium:
        """Where the ribbon is now."""
        return self.history[-1]

    @property
    def forces(self) -> dict[str, Force | None]:
        """What the supports exert on the ribbon, "start" and "end": force in D w / l^2, moment in D w / l; None at an
        end that nothing holds."""
        return {"start": self.state.start, "end": self.state.end_support}

    @property
    def stiffness(self) -> FloatArray:
        """Derivative (6, 6) of force and moment of the end clamp by its displacement and turn, exact: the columns
        "end.position" and "end.rotation" of `ribbon.gradients`.

        Rows: force (3) in D w / l^2, moment (3) in D w / l; columns: displacement in the strip's unit of length, small
        rotation vector in rad, both about the fixed axes. With the displacement in l (its columns times the strip's
        length), as in `si`, it is symmetric, but for the block of moments by turns: turns do not commute, and its skew
        part is half the moment, ``(S - S^T)/2 = -[M]_x / 2`` with ``[M]_x u = M x u``.

        Raises `RibbonInputError` where no clamp holds position and frame of the end, `NotDifferentiable` at a fold.
        """
        end = self.state.problem.end
        if end is None or not end.is_whole:
            raise RibbonInputError("end", None, "a stiffness needs a clamp that holds position and frame at s = l")
        g = gradients(self.state, ["end.position", "end.rotation"], unstable=True)
        force, moment = g.end_force(), g.end_moment()
        return np.block([[part["end.position"], part["end.rotation"]] for part in (force, moment)])

    @property
    def si(self) -> SessionInSI:
        """Forces and stiffness in N and m; `RibbonInputError` where the strip does not know its stiffness."""
        return SessionInSI(self, StripUnits.of(self.state.problem.strip))

    def move(
        self,
        *,
        clamp: Clamp | None = None,
        end: Clamp | None = None,
        gamma: float | None = None,
        natural_curvature: float | Law | None = None,
        tip: ArrayLike | None = None,
        steps: int | str = "auto",
        leap: bool = False,
        on_step: OnStep | None = None,
    ) -> Move:
        """Takes what is given from where it is to its new value, all at once, and the ribbon with it.

        clamp, end: at s = 0 and s = l, places in the strip's unit of length; these move on straight lines, frames by
        the shortest turn (at most half a turn a move). gamma, natural_curvature (per the strip's unit of length): of
        the strip, tip: the force at s = l in D w / l^2, linearly. steps: "auto", or a number of equal ones; leap: as
        `along`. on_step: called with (`StepRecord`, `Equilibrium`) after every accepted step.

        A move that cannot be gone to its end leaves the session at the last equilibrium along the path.
        Raises `RibbonInputError` on bad input.
        """
        if not (steps == "auto" or (isinstance(steps, int) and not isinstance(steps, bool) and steps >= 1)):
            raise RibbonInputError("steps", steps, 'a number of steps, or "auto"')
        problem_at = _problem_at(self.state.problem, clamp, end, gamma, natural_curvature, tip)
        return self.along(problem_at, steps=None if isinstance(steps, str) else steps, leap=leap, on_step=on_step)

    def along(
        self,
        problem_at: Callable[[float], Problem],
        *,
        steps: int | None = None,
        leap: bool = False,
        on_step: OnStep | None = None,
    ) -> Move:
        """Takes the ribbon along any way ``t -> problem_at(t)`` of problems on its segments, t from 0 (where it is) to
        1; steps: so many equal ones, None: adaptive ones; on_step, and where it cannot be gone to its end: as `move`.

        leap: in a single step where that ends at a stable state, moves the shape by little and leaves the balance of
        energy and work whole, else as without: for a hand that moves by little at a time.
        """
        begin = self.state
        rates = _rates(begin.problem, problem_at(1.0))
        if leap and rates is not None:
            leapt = self._leapt(problem_at, rates)
            if leapt is not None:
                if on_step is not None:
                    on_step(StepRecord(**leapt.log[-1]), leapt)
                self.history.append(replace(leapt, log=()))
                return Move("arrived", leapt.message, 1.0, (), (self.state,), leapt.log)
        states: list[Equilibrium] = []
        records: list[StepRecord] = []

        jumps: list[float] = []

        def kept(record: StepRecord, state: Equilibrium) -> None:
            left = self._left(state) if self._leave_saddle and state.status is Status.SADDLE else state
            before = states[-1] if states else begin
            size = record.t - (records[-1].t if records else 0.0)
            jump = record.jump or (rates is not None and _released(before, left, rates, size) > _RELEASED)
            record = replace(record, jump=jump, status=left.status.code)
            states.append(left)
            records.append(record)
            jumps.extend([record.t] if jump else [])
            if on_step is not None:
                on_step(record, left)
            if left is not state:
                raise _Left

        log: tuple[dict[str, Any], ...] = ()
        last = replace(begin, log=())
        while True:
            try:
                last = follow(
                    problem_at, states[-1] if states else last, steps=steps, on_step=kept,
                    begin=records[-1].t if records else 0.0,
                )  # fmt: skip
            except _Left:
                log += tuple(asdict(record) for record in records[len(log) :])
                if records[-1].t < 1.0:
                    continue
                last = replace(states[-1], log=())
            break
        self.history.extend(states)
        reached = records[-1].t if records else 0.0
        if reached < 1.0:
            return Move("stopped", last.message, reached, tuple(jumps), tuple(states), log + last.log)
        status, message = "arrived", self.state.message
        if jumps:
            status, message = "snapped", f"the shape jumped at {', '.join(f'{t:.3g}' for t in jumps)} of the way"
        return Move(status, message, reached, tuple(jumps), tuple(states), log + last.log)

    def _leapt(self, problem_at: Callable[[float], Problem], rates: dict[str, FloatArray]) -> Equilibrium | None:
        """The stable state at the end of the way in a single step; None: there is none, or it may be another's."""
        begin = self.state
        found = follow(problem_at, replace(begin, log=()), first=1.0, smallest=0.5)
        if not (begin.ok and found.ok):
            return None
        here, there = (np.concatenate(e.problem.joint_values(e.x)) for e in (begin, found))
        if np.linalg.norm(there - here) > _LEAP * np.linalg.norm(there) + 1e-9:
            return None
        return found if abs(_released(begin, found, rates, 1.0)) <= _RELEASED else None

    def _left(self, saddle: Equilibrium) -> Equilibrium:
        """The stable equilibrium that a saddle is left for; the saddle itself where none is found."""
        state = solve_from(saddle.problem, saddle.x, warm=(saddle.rows, saddle.multipliers), leave_saddle=True)
        return state if state.ok else saddle

    def show(self, live: bool = False) -> Any:
        """Where the ribbon has been, to be turned and gone through: in a notebook, or saved as an HTML file
        (`ribbon.shown.Seen`). live: a widget with sliders for weight, natural curvature, the end clamp and the force
        at the end, with which the session goes (`ribbon.shown.hand`; ImportError without anywidget)."""
        if live:
            from ribbon.shown.hand import hand

            return hand(self)
        return shown.Seen(self.history, [shown.label(state) for state in self.history])

    def back(self, steps: int = 1) -> Equilibrium:
        """Takes back the last `steps` states; `RibbonInputError` where there are not so many."""
        if not 1 <= steps < len(self.history):
            raise RibbonInputError("steps", steps, f"there are {len(self.history) - 1} states to take back")
        del self.history[-steps:]
        return self.state


@dataclass(frozen=True)
class SessionInSI:
    """Forces and stiffness of a session in N, N m and m."""

    session: Session
    units: StripUnits

    @property
    def forces(self) -> dict[str, Force | None]:
        """What the supports exert on the ribbon, "start" and "end": force in N, moment in N m; None where nothing
        holds."""
        return {
            name: None if held is None else Force(self.units.force * held.force, self.units.energy * held.moment)
            for name, held in self.session.forces.items()
        }

    @property
    def stiffness(self) -> FloatArray:
        """`Session.stiffness` (6, 6) with rows in N and N m, per metre and per rad."""
        return np.repeat([self.units.force, self.units.energy], 3)[:, None] * self.session.stiffness


def _rates(first: Problem, last: Problem) -> dict[str, FloatArray] | None:
    """Speeds of the parameters along the path, by the names of `ribbon.gradients`, for a t from 0 to 1; None where
    something varies that has no name there."""
    rates: dict[str, FloatArray] = {}
    a, b = first.strip, last.strip
    if any(getattr(a, name) != getattr(b, name) for name in _UNRATED) or not _pull_alike(first, last):
        return None
    for name in ("width", "poisson", "thickness"):
        one, other = getattr(a, name), getattr(b, name)
        if one != other:
            if one is None or other is None:
                return None
            rates[name] = np.array(other - one)
    for number, (wall, moved) in enumerate(zip(first.walls, last.walls, strict=True)):
        if not (isinstance(wall, Wall) and isinstance(moved, Wall)):
            if wall != moved:
                return None
            continue
        apart = np.subtract(moved.point, wall.point) @ np.asarray(moved.normal)
        if apart:
            rates[f"wall.{number}.offset"] = np.array(apart)
    if first.gravity is not None and a.gamma != b.gamma:
        rates["gamma"] = np.array(b.gamma - a.gamma)
    if a.natural_curvature != b.natural_curvature:
        laws: tuple[Any, Any] = a.natural_curvature, b.natural_curvature
        if any(law.is_table(one) for one in laws):
            return None
        rates["natural_curvature"] = np.subtract(b.natural_curvature, a.natural_curvature)
    pulls = [np.asarray(problem.tip or (0.0, 0.0, 0.0)) for problem in (first, last)]
    if np.any(pulls[0] != pulls[1]):
        rates["tip"] = pulls[1] - pulls[0]
    for name, old, new in (("start", first.start, last.start), ("end", first.end, last.end)):
        if old is None or new is None:
            continue
        if old.position is not None and new.position is not None:
            rates[f"{name}.position"] = np.subtract(new.position, old.position)
        if old.holds_frame and new.holds_frame:
            rates[f"{name}.rotation"] = Rotation.from_matrix(new.frame @ old.frame.T).as_rotvec()
    return rates


def _pull_alike(first: Problem, last: Problem) -> bool:
    """Whether weights pull one way and walls face one way, as hard, in both; and both strips are as long."""
    if (first.gravity is None) != (last.gravity is None) or len(first.walls) != len(last.walls):
        return False
    if first.gravity is not None and last.gravity is not None and first.gravity != last.gravity:
        return False
    walls = zip(first.walls, last.walls, strict=True)
    return first.strip.length == last.strip.length and all(_face_alike(one, other) for one, other in walls)


def _face_alike(one: Barrier, other: Barrier) -> bool:
    """Whether two planes differ by their places alone; round obstacles are alike where they are the same."""
    if isinstance(one, Wall) and isinstance(other, Wall):
        return np.array_equal(one.normal, other.normal) and one.stiffness == other.stiffness
    return one == other


def _released(before: Equilibrium, after: Equilibrium, rates: dict[str, FloatArray], size: float) -> float:
    """Energy that the step of this size set free beyond the work of what moved (trapezoidal), over the energies."""
    work = 0.0
    for e in (before, after):
        try:
            slopes = energy_slopes(e, list(rates))
        except NotDifferentiable:  # a contact on the point of changing
            return 0.0
        work += 0.5 * size * sum(float(np.sum(slopes[name] * rate)) for name, rate in rates.items())
    scale = sum(abs(e.energy.elastic) + abs(e.energy.gravity) + abs(e.energy.tip) for e in (before, after))
    return (work - (after.energy.total - before.energy.total)) / max(scale, 1e-12)


def _problem_at(
    problem: Problem,
    clamp: Clamp | None,
    end: Clamp | None,
    gamma: float | None,
    natural_curvature: float | Law | None,
    tip: ArrayLike | None,
) -> Callable[[float], Problem]:
    """The problem at the share t of the path from `problem` to what is given."""
    strip = problem.strip
    goal = strip
    if gamma is not None:
        goal = replace(goal, gamma=gamma)
    if natural_curvature is not None:
        goal = replace(goal, natural_curvature=natural_curvature)
    start_at = _between("clamp", problem.start, clamp)
    end_at = _between("end", problem.end, end)
    request = Request.again(problem)
    laws = [one.natural_curvature for one in (strip, goal)]
    if laws[0] != laws[1] and any(law.is_table(one) for one in laws):  # type: ignore[arg-type]
        remedy = "a table of K does not move: give one number or (at s = 0, at s = l), or begin another session"
        raise RibbonInputError("natural_curvature", natural_curvature, remedy)
    pull = np.asarray(problem.tip or (0.0, 0.0, 0.0))
    goal_pull = pull if tip is None else np.asarray(tip_force(tip) or (0.0, 0.0, 0.0))

    def at(t: float) -> Problem:
        natural = laws[1]
        if laws[0] != laws[1]:
            ends: Any = zip(laws[0], laws[1], strict=True)  # type: ignore[arg-type]
            first, last = ((1.0 - t) * a + t * b for a, b in ends)
            natural = (first, last)
        there = replace(strip, gamma=(1.0 - t) * strip.gamma + t * goal.gamma, natural_curvature=natural)
        pulled = tip_force((1.0 - t) * pull + t * goal_pull)
        return assembled(replace(request, strip=there, start=start_at(t), end=end_at(t), tip=pulled))

    return at


def _between(key: str, old: Clamp | None, new: Clamp | None) -> Callable[[float], Clamp | None]:
    """The clamp along the path from `old` to `new` (None: it stays); what is held on one side only switches at once."""
    if new is None or old is None:
        kept = old if new is None else new
        return lambda t: kept
    spin: FloatArray | None = None
    if old.holds_frame and new.holds_frame:
        spin = Rotation.from_matrix(new.frame @ old.frame.T).as_rotvec()
        if np.linalg.norm(spin) > _HALF_TURN:
            raise RibbonInputError(key, "half a turn", "has no shortest way: move there by a clamp in between")

    def at(t: float) -> Clamp:
        clamp = new
        if old.position is not None and new.position is not None:
            clamp = replace(clamp, position=(1.0 - t) * np.asarray(old.position) + t * np.asarray(new.position))
        if spin is not None and t < 1.0:
            frame = Rotation.from_rotvec(t * spin).as_matrix() @ old.frame
            clamp = replace(clamp, tangent=frame[:, 2], normal=frame[:, 1])
        return clamp

    return at
