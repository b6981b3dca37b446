"""Walking a shell along its stages: load steps with cut-back, arc length, instabilities. Status instead of exception.

A point of the path is an equilibrium at a load of its stage (docs/theory.md, eq. (7.9), (7.11)). Every attempt is a
`LoadStep` in the log; after every accepted one the journal may keep a checkpoint, from which an interrupted walk goes
on.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from shellref.fenics import dolfinx_api as api
from shellref.path.arc import follow, switch
from shellref.path.newton import PASSING, Attempt, Equilibrium
from shellref.path.point import Journal, Point, Walk
from shellref.path.predictor import Predicted, hasty, jumped, next_step, predicted
from shellref.path.stability import hourglass_hint, leave_saddle, lowest_mode, settled
from shellref.shell.body import Control, Stage
from shellref.shell.edges import FreeEdge, PivotEdge
from shellref.shell.naghdi import MEMBRANE, Stress
from shellref.shell.options import ShellOptions
from shellref.shell.result import LoadStep, ShellStatus

MOST_KICKS = 20
STILL = 1e-3  # mean displacement of a stage, over the size of the surface, below which it is walked in load steps
ARC_BELOW = 0.01  # load steps smaller than this (of a stage) are left to arc length, when that is allowed
NEARLY = 100.0 * PASSING  # a passed point may move by so much when it is kept
START_FAILED = "the starting shape did not converge in {} iterations: use more elements, or raise max_newton"
DEEP = 1e-3  # of l: how deep in a wall a start that does not converge is told to begin
BEHIND = (
    "the shape with which it begins stands up to {:.3g} l behind a wall or an obstacle, and its contact does not bring"
    " it back from there: begin near the ribbon's surface (compare does), or let the wall come along a path"
)
Progress = Callable[[dict[str, Any]], None]
Observe = Callable[[np.ndarray], dict[str, Any]]


class Verdict(NamedTuple):
    """How a walk ended: negative eigenvalues and the lowest one of its last tangent, None where not known.

    stable: None when it was not checked, is not known, or the state is at a fold.
    """

    status: ShellStatus
    message: str
    negative: int | None = None
    eigenvalue: float | None = None
    stable: bool | None = None


class Silent:
    """A journal that keeps nothing."""

    def step(self, step: LoadStep) -> None:
        """Ignored."""

    def point(self, walk: Walk) -> None:
        """Ignored."""


class Walker:
    """Moves a walk along its stages; see shellref.path.arc for the arc-length part."""

    def __init__(
        self,
        equilibrium: Equilibrium,
        stages: tuple[Stage, ...],
        options: ShellOptions,
        report: Progress | None = None,
        observe: Observe | None = None,
        journal: Journal | None = None,
    ):
        self.equilibrium, self.model, self.stages, self.options = equilibrium, equilibrium.model, stages, options
        self.report = report or (lambda event: None)
        self.observe = observe or (lambda state: {})
        self.journal: Journal = journal or Silent()
        self._clock, self._count = time.perf_counter(), equilibrium.factorisations

    def log(self, walk: Walk, method: str, load: float, attempt: Attempt, accepted: bool, note: str = "") -> None:
        """Write one attempt down, with what it cost since the last one."""
        now, count = time.perf_counter(), self.equilibrium.factorisations
        step = LoadStep(
            stage=self.stages[walk.stage].name if self.stages else "start",
            load=load,
            accepted=accepted,
            iterations=attempt.iterations,
            correction=attempt.correction,
            negative=attempt.negative,
            note=note or attempt.reason,
            method=method,
            factorisations=count - self._count,
            seconds=now - self._clock,
            values=self.observe(attempt.state) if accepted else {},
        )
        self._clock, self._count = now, count
        walk.steps.append(step)
        self.journal.step(step)
        self.report({"event": "step", **step.to_dict()})

    def start(self, walk: Walk) -> None:
        """Newton on the starting shape at the first stage's beginning."""
        if self._begin(walk, 0.0, START_FAILED):
            self.know_rate(walk)
            self.journal.point(walk)

    def _on_walls(self, walk: Walk, stress: Stress | None, load: float) -> Stress | None:
        """Puts the walk where a strip on walls comes to rest from its state, if it does; the stress to go on with.

        A strip that walls carry may stand on one place: without stress it falls over in the first step. One that is
        pressed between walls is near to giving way to a side, where whole steps of Newton's overshoot: then downwards.
        """
        contact = self.equilibrium.contact
        assert contact is not None
        before = contact.snapshot()
        if self.equilibrium.supports.floating is None:
            attempt = self.equilibrium.solve(walk.point.state, stress, self._stage(walk), load)
            if attempt.converged:
                walk.point.state = attempt.state
                return attempt.stress
            contact.restore(before)
        found = settled(self.equilibrium, walk.point.state, self._stage(walk), load)
        if found is None:
            return stress
        walk.point.state = found.state
        return found.stress

    def settle_at_end(self, walk: Walk) -> None:
        """Newton from the walk's state at the end of the last stage: a start that is near the solution."""
        walk.stage = max(len(self.stages) - 1, 0)
        # the membrane stress of an interpolated thin shell is wrong by far: the mixed iteration begins with none
        stress = self.model.no_stress() if self.options.iteration == "mixed" else None
        load, supports = 1.0 if self.stages else 0.0, self.equilibrium.supports
        swings = supports.swings or any(isinstance(edge, (FreeEdge, PivotEdge)) for edge in supports.edges)
        if stress is not None and swings:
            # without stress nothing resists that it swings about its point: that of the state, where the other fails
            attempt = self.equilibrium.solve(walk.point.state, stress, self._stage(walk), load)
            stress = attempt.stress if attempt.converged else None
            walk.point.state = attempt.state if attempt.converged else walk.point.state
        if self.equilibrium.contact is not None:
            stress = self._on_walls(walk, stress, load)
        self._begin(walk, load, "no equilibrium near the given start in {} iterations", stress)

    def _begin(self, walk: Walk, load: float, failure: str, stress: Stress | None = None) -> bool:
        """Newton from the walk's state at this load of its stage: its first point. False: the walk is stopped."""
        contact = self.equilibrium.contact
        place = None if contact is None else contact.crossing(walk.point.state)
        if place is not None:
            why = "the shape with which it begins crosses itself at S = {:.4g} and {:.4g}: begin with another one"
            walk.stop(ShellStatus.NOT_CONVERGED, why.format(*place))
            walk.point.stress = self.model.stress(walk.point.state)
            return False
        attempt = self.equilibrium.solve(walk.point.state, stress, self._stage(walk), load)
        walk.point.stress = self.model.stress(walk.point.state)
        if attempt.converged and self._stretched(walk, "start", attempt):
            return False
        self.log(walk, "start", load, attempt, attempt.converged)
        if not attempt.converged:
            why = f" ({attempt.reason})" if attempt.reason else ""
            deep = self._deep(walk)
            failed = failure.format(attempt.iterations) if deep < DEEP else BEHIND.format(deep)
            walk.stop(ShellStatus.NOT_CONVERGED, failed + why)
            return False
        walk.point = Point(load, attempt.state, attempt.stress, attempt.negative)
        self.settle(walk)
        return True

    def _deep(self, walk: Walk) -> float:
        """How deep (l) the walk's state stands behind what it may touch; 0 where nothing is."""
        contact = self.equilibrium.contact
        if contact is None:
            return 0.0
        gaps = contact.gaps(walk.point.state, self.equilibrium.standing())
        return max(0.0, -float(np.min(gaps, initial=0.0)))

    def _stage(self, walk: Walk) -> Stage:
        if self.stages:
            return self.stages[min(walk.stage, len(self.stages) - 1)]
        control = Control(self.model.control.natural, 0.0, 0.0, 0.0)
        return Stage("start", control, control)

    def run(self, walk: Walk) -> None:
        """All stages from where the walk is."""
        while walk.status is None and walk.stage < len(self.stages):
            if walk.point.load < 1.0:
                if walk.arc or (self.options.arc_length == "always" and self._moves(walk)):
                    follow(self, walk)
                else:
                    self.load_steps(walk)
            if walk.status is not None:
                self._keep(walk)
                return
            walk.stage, walk.older, walk.step, walk.arc = walk.stage + 1, None, None, False
            if walk.stage < len(self.stages):
                walk.point.load, walk.point.rate = 0.0, None
                self.know_rate(walk)
                self.journal.point(walk)

    def _keep(self, walk: Walk) -> None:
        """A walk that stopped on the way keeps its last point: to the tolerance, where load steps passed it."""
        point = walk.point
        attempt = self.equilibrium.solve(point.state, point.stress, self._stage(walk), point.load)
        if attempt.converged and self.equilibrium.largest(attempt.state - point.state) < NEARLY:
            point.state, point.stress = attempt.state, attempt.stress

    def _moves(self, walk: Walk) -> bool:
        """True when the stage's load moves the surface: where it does not, there is no arc to go along."""
        sway, _ = self.equilibrium.tangent_of(walk.point.state, self._stage(walk), walk.point.load)
        if sway is None:  # load steps, each with its own factors, say what is wrong
            return False
        return float(np.sqrt(self.equilibrium.mean(sway, sway))) > STILL * self.equilibrium.length

    def load_steps(self, walk: Walk) -> None:
        """Bring the stage's load from where it is to 1."""
        o, stage = self.options, self._stage(walk)
        step, tried = walk.step or o.first_step, 0
        smallest = max(o.min_step, ARC_BELOW) if o.arc_length == "auto" else o.min_step
        while walk.point.load < 1.0 and walk.status is None:
            tried += 1
            if tried > o.max_steps:
                walk.stop(ShellStatus.NOT_CONVERGED, f"{stage.name} took more than max_steps = {o.max_steps} steps")
                return
            load = min(1.0, walk.point.load + step)
            if 1.0 - load < 0.2 * step:
                load = 1.0
            begin = self.predict(walk, load)
            if self._hasty(walk, begin) and o.cut * (load - walk.point.load) >= smallest:
                step = o.cut * (load - walk.point.load)
                continue
            attempt = self.equilibrium.solve(begin.state, begin.stress, stage, load, passing=load < 1.0)
            off = self._off(walk, begin, attempt)
            if not attempt.converged:
                self.log(walk, "load", attempt.load, attempt, False)
                walk.older = None
                step = o.cut * (load - walk.point.load)
                if step < smallest:
                    self._stuck(walk, attempt)
                continue
            step = load - walk.point.load
            misled = attempt.changes > 0 or off > self.equilibrium.largest(attempt.state - walk.point.state)
            self.accept(walk, "load", attempt)
            if walk.status is None:
                step = min(o.max_step, next_step(step, off, begin.order, o.growth, o.cut))
            walk.step = step
            if misled:  # next to a soft mode a rate is worse than none: from the state as it is
                walk.older, walk.point.rate = None, None
            else:
                self.know_rate(walk)
            self.journal.point(walk)

    def _stuck(self, walk: Walk, attempt: Attempt) -> None:
        """Load steps became too small: go on by arc length when that is allowed."""
        o, stage = self.options, self._stage(walk)
        if o.arc_length == "auto":
            follow(self, walk)
            return
        why = f" ({attempt.reason})" if attempt.reason else ""
        walk.stop(
            ShellStatus.NOT_CONVERGED,
            f"{stage.name} stopped at {walk.point.load:.6g} of its full value: the next step fell under min_step ="
            f" {o.min_step:g}{why}; a smaller min_step, a larger max_newton or a finer mesh may pass;"
            ' arc_length = "auto" passes limit points',
        )

    def predict(self, walk: Walk, load: float) -> Predicted:
        """The walk's state at `load`, from its last points and their rates."""
        if not self.options.predict:
            return Predicted(walk.point.state, walk.point.stress, 1)
        return predicted(walk, load)

    def _hasty(self, walk: Walk, begin: Predicted) -> bool:
        """Whether a prediction is further away than the last step bears out."""
        if walk.older is None or begin.order < 3:
            return False
        e, here = self.equilibrium, walk.point.state
        return hasty(e.largest(begin.state - here), e.largest(here - walk.older.state), begin.order)

    def _off(self, walk: Walk, begin: Predicted, attempt: Attempt) -> float:
        """How far an attempt ended from its prediction; one that ended on another branch did not converge."""
        if not attempt.converged:
            return 0.0
        e, here = self.equilibrium, walk.point.state
        moved, foreseen = e.largest(attempt.state - here), e.largest(begin.state - here)
        if e.passed(here, walk.point.load, attempt, self._stage(walk)):
            attempt.converged, attempt.reason = False, "it went through an obstacle or through itself"
        elif not attempt.changes and jumped(moved, foreseen, begin.order):  # no rate knows of a wall before it is met
            attempt.converged = False
            attempt.reason = f"it moved by {moved:.2g} where {foreseen:.2g} was foreseen: another branch"
        return e.largest(attempt.state - begin.state)

    def know_rate(self, walk: Walk) -> None:
        """The rate at the walk's point, where predictors may use it and the last factors belong to the point."""
        point = walk.point
        if self.options.predict and self.stages and walk.stage < len(self.stages) and point.load < 1.0:
            point.rate = self.equilibrium.rate(point.state, self._stage(walk), point.load)

    def accept(self, walk: Walk, method: str, attempt: Attempt, note: str = "", settle: bool = True) -> None:
        """Take a converged attempt as the walk's new point; look at its strain, and at its stability when it should
        settle (beyond a limit point the path is unstable, and stays so)."""
        before = walk.point
        if self._stretched(walk, method, attempt):
            walk.older = None
            return
        self.log(walk, method, attempt.load, attempt, True, note)
        walk.older = before
        walk.point = Point(attempt.load, attempt.state, attempt.stress, attempt.negative)
        if settle and self.settle(walk, before):
            walk.older = None

    def _stretched(self, walk: Walk, method: str, attempt: Attempt) -> bool:
        """Stop the walk before an attempt whose membrane strain is over the limit."""
        strain, limit = self.largest_strain(attempt), self.options.max_strain
        if strain <= limit:
            return False
        self.log(walk, method, attempt.load, attempt, False, f"membrane strain {strain:.2g}")
        walk.stop(
            ShellStatus.STRETCHED,
            f"the strip is stretched: its membrane strain reaches {strain:.2g} at {attempt.load:.6g} of"
            f" {self._stage(walk).name} (limit max_strain = {limit:g}); a clamp path that is longer than the strip does"
            f" that, or a mesh too coarse for its shape. Kept: the state at {walk.point.load:.6g}",
        )
        return True

    def largest_strain(self, attempt: Attempt) -> float:
        """Largest membrane strain component at the reduced Gauss points."""
        strain = self.model.strains(attempt.state)[1][..., : MEMBRANE.stop - MEMBRANE.start]
        return float(api.max_over(self.model.comm, float(np.max(np.abs(strain), initial=0.0))))

    def settle(self, walk: Walk, before: Point | None = None) -> bool:
        """What to do about an unstable point: switch branches, or kick, or stay. True when the state jumped."""
        o, point = self.options, walk.point
        if not o.stability or not point.negative or not self.model.potential:  # no way down without one
            return False
        if walk.kicks >= MOST_KICKS or (before is not None and before.negative and point.load < 1.0):
            return False
        if o.switch and before is not None and before.negative == 0 and switch(self, walk, before):
            return True
        if not o.kick:
            return False
        mode, _ = lowest_mode(self.equilibrium, point.state, self._stage(walk), point.load)
        if mode.at_fold:  # no way leads down from it that rounding would not have chosen
            return False
        walk.kicks += 1
        attempt = leave_saddle(self.equilibrium, point.state, self._stage(walk), point.load, mode)
        moved = self.equilibrium.largest(attempt.state - point.state)
        self.report({"event": "kick", "load": point.load, "converged": attempt.converged, "moved": moved})
        note = f"left an unstable state with {point.negative} negative eigenvalue(s); moved by {moved:.3g}"
        self.log(walk, "relax", attempt.load, attempt, attempt.converged, note)
        if not attempt.converged:
            walk.kicks = MOST_KICKS  # the path goes on along the unstable branch, and its end says so
            walk.left = False
            return False
        walk.point = Point(point.load, attempt.state, attempt.stress, attempt.negative)
        return True

    def verdict(self, walk: Walk) -> Verdict:
        """How the walk ended; the inertia is checked afresh."""
        if walk.status is not None:
            return Verdict(walk.status, walk.message)
        there = "equilibrium at the full load"
        if not self.options.stability:
            return Verdict(ShellStatus.CONVERGED, f"{there}; stability not checked")
        if not self.model.potential:
            message = f"{there}; a moment of fixed direction has no potential: its stability is not asked"
            return Verdict(ShellStatus.CONVERGED, message)
        at = min(walk.stage, len(self.stages) - 1)
        load = 1.0 if self.stages else 0.0
        stage = self.stages[at] if self.stages else self._stage(walk)
        mode, negative = lowest_mode(self.equilibrium, walk.point.state, stage, load)
        if mode.at_fold:
            text = f"its lowest eigenvalue {mode.value:.2g} is zero to rounding ({mode.rounding:.2g})"
            message = f"{there}, at a fold: {text}, neither stable nor unstable{self.equilibrium.thin()}"
            return Verdict(ShellStatus.CONVERGED, message, None, mode.value)
        if negative is None and mode.value is None:
            message = f"{there}; its stability is not known: {self.equilibrium.trouble}"
            return Verdict(ShellStatus.CONVERGED, message)
        if negative or (negative is None and mode.value is not None and mode.value < 0.0):
            remedy = "set kick = true to leave it" if not self.options.kick else "try smaller steps (max_step)"
            hint = hourglass_hint(self.model, walk.point.state, self.options.stabilisation)
            message = f"unstable equilibrium, {negative or 'some'} negative eigenvalue(s): {remedy}{hint}"
            return Verdict(ShellStatus.UNSTABLE, message, negative, mode.value, False)
        note = f"; left {walk.kicks} unstable state(s) on the way" if walk.kicks and walk.left else ""
        return Verdict(ShellStatus.CONVERGED, f"{there}{note}", negative, mode.value, True)
