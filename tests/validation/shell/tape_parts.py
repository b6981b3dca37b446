"""Symmetric parts of the seed's tape spring as bodies of the shell, and their folding paths.

The tape (Martin et al. 2017): 1000 mm x 60 mm, 0.15 mm thick, R = 50 mm, nu = 0.3, E = 210 GPa; here l = 1, D = 1.
Test 4.1 is symmetric about v = 0 and about its middle: a quarter, S in [0, 1/2], v in [0, w/2], whose clamp turns by
theta and slides along z. Test 4.2 is symmetric about v = 0: a half, whose end is moved by u3, turns and slides.
Forces and moments are those of the whole tape, in N and N mm.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shellref.path.newton import Equilibrium
from shellref.path.point import Point, Walk
from shellref.path.stability import leave_saddle, lowest_mode
from shellref.path.walk import Walker
from shellref.shell.body import Body, Control, Stage, Supports
from shellref.shell.clamps import PosePath, reactions, rotation
from shellref.shell.director import HELD
from shellref.shell.edges import RigidEdge
from shellref.shell.grid import Grid
from shellref.shell.midsurface import Cylinder
from shellref.shell.naghdi import NaghdiModel
from shellref.shell.options import ShellOptions
from shellref.shell.problem import Pose
from shellref.shell.result import LoadStep, ShellStatus

LENGTH, HALF_WIDTH, THICKNESS, CURVATURE, POISSON, YOUNG = 1000.0, 30.0, 0.15, 0.02, 0.3, 210000.0  # mm, N/mm^2
STIFFNESS = YOUNG * THICKNESS**3 / (12.0 * (1.0 - POISSON**2))  # D, N mm
MOMENT = STIFFNESS * 2.0 * HALF_WIDTH / LENGTH  # D w / l, N mm
FORCE = MOMENT / LENGTH  # D w / l^2, N
#: How far each test goes: rad at either end, u3 / l.
FARTHEST = {"opposite": 0.5, "equal": 0.5, "cantilever": 0.4, "two_folds": 0.15}
MOST_FALLS, MOST_DESCENT = 12, 240  # snaps of one test, iterations down from one
STATIONS = 101  # of the section's opening along the tape


@dataclass(frozen=True)
class Case:
    """test: "opposite", "equal" (4.1, a quarter), "cantilever" (4.2, a half) or "two_folds" (both ends held in their
    frames, one moved sideways: a half); elements of it, their degree; step: largest of the arc length."""

    test: str
    along: int
    across: int
    degree: int = 2
    step: float = 0.01

    @property
    def name(self) -> str:
        """Of its piece."""
        return f"{self.test}_{self.along}x{self.across}_q{self.degree}"

    @property
    def span(self) -> float:
        """Largest S."""
        return 0.5 if self.turned else 1.0

    @property
    def turned(self) -> bool:
        """Driven by a turn, and not by a displacement."""
        return self.test in ("opposite", "equal")

    @property
    def sign(self) -> float:
        """Of the turn about t_x at the start."""
        return -1.0 if self.test == "equal" else 1.0


def frame(angle: float) -> Any:
    """Axes turned about t_x, as rows of a matrix."""
    return tuple(map(tuple, rotation(np.array([angle, 0.0, 0.0])).tolist()))


def body(case: Case) -> Body:
    """The part, with normaliser w / 2: energies in units of the half tape's width, reactions are those of the whole."""
    surface = Cylinder(curvature_across=CURVATURE * LENGTH)
    half = HALF_WIDTH / LENGTH
    s, v = np.linspace(0.0, case.span, case.along + 1), np.linspace(0.0, half, case.across + 1)
    rest = Pose((0.0, 0.0, 0.0), frame(0.0))

    def edge(name: str, nodes: np.ndarray, at: float, path: PosePath, slides: bool, turns: bool) -> RigidEdge:
        where = np.flatnonzero(np.abs(nodes[:, 0] - at) < 1e-9)
        arms, directors = surface.place(np.zeros(len(where)), nodes[where, 1])
        along = np.array([[0.0, 0.0, 1.0]]) if slides else np.zeros((0, 3))
        return RigidEdge(name, where, arms, directors, path, along, np.array([1.0, 0.0, 0.0]) if turns else None)

    def supports(grid: Grid, nodes: np.ndarray) -> Supports:
        held = Supports.none(len(nodes)).hold(np.abs(nodes[:, 1]) < 1e-9, "x", 0)
        far = FARTHEST[case.test]
        edges: tuple[RigidEdge, ...]
        if not case.turned:
            moved = PosePath((Pose((0.0, 0.0, 1.0), frame(0.0)), Pose((0.0, far, 1.0), frame(0.0))))
            edges = (edge("start", nodes, 0.0, PosePath((rest,)), False, False),
                     edge("end", nodes, 1.0, moved, True, case.test == "cantilever"))  # fmt: skip
        else:
            turned = PosePath((rest, Pose((0.0, 0.0, 0.0), frame(case.sign * far))))
            edges = (edge("start", nodes, 0.0, turned, True, False),)
            held = held.hold(np.abs(nodes[:, 0] - 0.5) < 1e-9, "z", 2)
        for one in edges:
            where = np.zeros(len(nodes), dtype=bool)
            where[one.nodes] = True
            held = held.hold(where, "xyz", HELD)
        return Supports(held.translations, held.directors, None, edges)

    return Body(
        surface, Grid(s, v, case.degree), THICKNESS / LENGTH, POISSON, supports, normaliser=half, bends_along=True
    )


class _Turned(Exception):
    """The load has turned back."""


class Path:
    """A part on its way: the model, the walker, what is observed of a state."""

    def __init__(self, case: Case, say: Any = None):
        self.case = case
        options = ShellOptions(
            arc_length="always", kick=False, first_step=0.01, arc_step=0.002, max_arc=case.step, max_newton=8,
            max_steps=250,
        )  # fmt: skip
        self.model = NaghdiModel(body(case), options.stabilisation)
        self.equilibrium = Equilibrium(self.model, options)
        self.stage = Stage("move", Control(1.0, 0.0, 0.0, 0.0), Control(1.0, 0.0, 0.0, 1.0))
        self._clock, self._state, self._load = time.perf_counter(), self.model.reference, 0.0
        self.walker = Walker(self.equilibrium, (self.stage,), options, say, self.observe)

    def observe(self, state: np.ndarray) -> dict[str, Any]:
        """What is held, where (rad, mm), what it takes (N mm, N); energy (N mm); openings (rad) of the sections."""
        self._state = state
        residual = self.model.residual(state)
        end = self.equilibrium.supports.edges[-1]
        where = np.zeros(len(state), dtype=bool)
        where[end.nodes] = True
        force, moment = reactions(state, residual, where, end.point(state))
        on = self.model.on_grid(state)
        middle, side = on[:, 0, 3:], on[:, -1, 3:]
        opening = np.arctan2(np.linalg.norm(np.cross(middle, side), axis=1), np.sum(middle * side, axis=1))
        opening *= np.sign(np.sum(side * np.array([1.0, 0.0, 0.0]), axis=1))  # against the normal: kappa of that sign
        case = self.case
        load = case.sign * moment[0] * MOMENT if case.turned else force[1] * FORCE
        return {
            "moved": self.model.control.move * FARTHEST[case.test] * (1.0 if case.turned else LENGTH),
            "load": float(load),
            "end_moment": float(moment[0] * MOMENT),
            "along": float(force[2] * FORCE),
            "energy": self.model.energies(state).total * MOMENT / case.span,
            "opening": [float(x) for x in np.interp(
                np.linspace(0.0, case.span, STATIONS), self.model.grid.s_nodes, opening)],
        }  # fmt: skip

    def walk(self) -> dict[str, Any]:
        """Along the equilibria, stable or not, to the end of the test."""
        walk = self._begun()
        if walk.status is None:
            self.walker.run(walk)
        return self._found(walk, {"path": self._points(walk)})

    def snap(self) -> dict[str, Any]:
        """Stable states alone: to a limit point, down from it at the same load, on to the next one or the end of the
        test; and from below the first limit point back to where its fold vanishes."""
        walk = self._begun()
        finer = replace(self.walker.options, max_arc=0.2 * self.case.step)  # where the load is greatest
        first = Walker(self.equilibrium, (self.stage,), finer, self.walker.report, self.observe)
        up, turned = self._to_turn(first, walk)
        ahead: list[LoadStep] = []
        falls: list[Point] = []
        while turned and len(falls) < MOST_FALLS:
            below = self._down(walk.point.state)
            if below is None:
                break
            falls.append(below)
            walk = Walk(replace(falls[-1]))
            steps, turned = self._to_turn(self.walker, walk)
            ahead += steps
        if turned:
            walk.stop(ShellStatus.LIMIT_POINT, f"no stable state was found below {self._load:.4g}")
        legs, snapped = {"up": up, "ahead": ahead}, []
        if falls:
            home = Stage("back", self.stage.at(falls[0].load), Control(1.0, 0.0, 0.0, 0.0))
            backwards = Walker(self.equilibrium, (home,), self.walker.options, self.walker.report, self.observe)
            legs["back"], _ = self._to_turn(backwards, Walk(replace(falls[0], load=0.0)))
        for point in falls:
            self.model.set_control(self.stage.at(point.load))
            snapped.append(self.observe(point.state))
        return {**self._found(walk, legs), "snapped": snapped}

    def _down(self, before: np.ndarray) -> Point | None:
        """From the unstable state seen last to a stable one at its load, away from the state before (nodes, 6)."""
        e, load = self.equilibrium, self._load
        mode, _ = lowest_mode(e, self._state, self.stage, load)
        if e.mean(mode.vector, self._state - before) < 0.0:
            mode = replace(mode, vector=-mode.vector)
        down = leave_saddle(e, self._state, self.stage, load, mode, MOST_DESCENT)
        return Point(load, down.state, down.stress, 0) if down.converged else None

    def _begun(self) -> Walk:
        walk = Walk(Point(0.0, self.model.reference.copy(), None))  # type: ignore[arg-type]
        self.walker.start(walk)
        return walk

    def _to_turn(self, walker: Walker, walk: Walk) -> tuple[list[LoadStep], bool]:
        """Walks until the load turns back: the points before, and whether it did; then `_state` is the first beyond."""
        said, highest = walker.report, [-np.inf]

        def watch(event: dict[str, Any]) -> None:
            said(event)
            if event["event"] == "step" and event["accepted"] and event["method"] == "arc":
                if event["load"] < highest[0]:
                    self._load = event["load"]
                    raise _Turned
                highest[0] = event["load"]

        walker.report = watch
        try:
            walker.run(walk)
        except _Turned:
            return self._points(walk)[:-1], True
        finally:
            walker.report = said
        return self._points(walk), False

    def _points(self, walk: Walk) -> list[LoadStep]:
        return [step for step in walk.steps if step.accepted and step.method in ("arc", "start", "load")]

    def _found(self, walk: Walk, legs: dict[str, Any]) -> dict[str, Any]:
        """Rows of accepted points by leg, the verdict, and what it cost."""
        verdict = self.walker.verdict(walk)
        e = self.equilibrium
        return {
            "rows": [
                {**step.values, "negative": step.negative, "leg": leg, "note": step.note}
                for leg, steps in legs.items()
                for step in steps
            ],
            "status": verdict.status.value,
            "stable": verdict.stable,
            "message": verdict.message,
            "unknowns": e.unknowns,
            "iterations": e.iterations,
            "seconds": time.perf_counter() - self._clock,
            "surface": self.model.on_grid(walk.point.state)[..., :3].tolist(),
        }
