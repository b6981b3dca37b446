"""The tape spring as a model: a planar rod with a flexible section, its ends held, turned or moved along a path.

Its place in the scene, and what holds it there: `compare.models.tape.plane`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.models import keys
from compare.models.base import (
    Effect,
    Energy,
    Force,
    Options,
    Shape,
    Size,
    State,
    Status,
    Supports,
    on_strip,
)  # fmt: skip
from compare.models.effects.switches import Switch
from compare.models.line import LineModel, Task
from compare.models.quantities.tape import QUANTITIES
from compare.models.tape.effects import switches
from compare.models.tape.plane import holds, leaves, plane_of, unwound
from compare.store.states import Film
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from compare.store.states import States
    from ribbon.tape.held import Hold
    from ribbon.tape.section import Section
    from ribbon.tape.solve import Mark, Tape

FloatArray = NDArray[np.float64]

TERMS = {"tape": 3, "tape_plain": 1}
"""Terms of the section's curvature by `model.energy`."""

FINEST = 800
"""Elements where the scene says none: the finest usual ones."""

DEEPEST = 0.5 * math.pi
"""Angle beta0 (rad) of the section's edge from which no shallow section stands for it."""


@dataclass(frozen=True)
class TapeShape(Shape):
    """A tape in space; origin (3,) and axes (3, 3), columns t_x t_y t_z, of its plane."""

    tape: Tape
    x: FloatArray
    origin: FloatArray
    axes: FloatArray

    @cached_property
    def bend(self) -> float:
        """Largest curvature along the middle line, 1/l."""
        from ribbon.tape.rod import bent

        return float(np.abs(bent(self.tape.rod.at(self.x, self.tape.rod.s))).max())

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3) of the line v = 0."""
        from ribbon.tape.surface import middle

        plane, _ = middle(self.tape.rod, self.x, on_strip(s))
        return np.asarray(self.origin + plane @ self.axes[:, [2, 1]].T)

    def frames(self, s: FloatArray) -> FloatArray:
        """Frames (k, 3, 3) of the sections, columns t_x t_y t_z."""
        from ribbon.tape.surface import middle

        _, phi = middle(self.tape.rod, self.x, on_strip(s))
        x, y, z = self.axes.T
        cosine, sine = np.cos(phi)[:, None], np.sin(phi)[:, None]
        return np.stack([np.broadcast_to(x, (len(phi), 3)), cosine * y - sine * z, cosine * z + sine * y], axis=2)

    def points(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """Positions (k, m, 3): the section's arc about its middle."""
        from ribbon.tape.surface import profile

        y, z, _ = profile(self.tape.rod, self.x, on_strip(s), np.asarray(v, dtype=float))
        frames = self.frames(s)[:, None]
        return np.asarray(self.centreline(s)[:, None] + y[..., None] * frames[..., 0] - z[..., None] * frames[..., 1])

    def fields(self, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
        """S, v, omega, kappa (across), e11, normal, energy_density."""
        from ribbon.tape.surface import densities, profile

        grid_s, grid_v = np.meshgrid(s, v, indexing="ij")
        found = densities(self.tape.rod, self.x, on_strip(s), np.asarray(v, dtype=float))
        _, _, beta = profile(self.tape.rod, self.x, on_strip(s), np.asarray(v, dtype=float))
        frames = self.frames(s)[:, None]
        normal = np.cos(beta)[..., None] * frames[..., 1] + np.sin(beta)[..., None] * frames[..., 0]
        return {
            "S": grid_s, "v": grid_v, "omega": -found["curvature"], "kappa": found["kappa"], "e11": found["e11"],
            "normal": normal, "energy_density": found["energy_density"],
        }  # fmt: skip


@dataclass(frozen=True)
class Folding:
    """What a tape's solver gets: the section, what holds both ends in every stage, lengths (n,) of the elements over l,
    its budget (s)."""

    section: Section
    stages: list[tuple[Hold, Hold]]
    lengths: FloatArray
    budget: float


class TapeModel(LineModel["Folding", "Tape"]):
    """A planar tape spring, enriched ("tape") or plain ("tape_plain")."""

    name = "tape"
    quantities = QUANTITIES
    presenter = "compare.pages.rods.tape:PRESENTER"
    sizes = (100.0, 200.0, 400.0, 800.0)
    not_found = "no equilibrium was found on elements half as long"
    no_branches = (
        "a tape's tangent is known along the way of its holds alone, which it follows by arc length itself: give that "
        "way as a [[path]] and solve it (past snap-backs, with every jump told)"
    )
    reads = (
        keys.STRIP - keys.NATURAL | keys.CROSS_CURVED | keys.BOTH_CLAMPS - keys.RULINGS
        | keys.ENERGY | keys.ELEMENTS | keys.BUDGET | keys.PATH
    )  # fmt: skip
    without_effect = keys.because(
        keys.UNSURE,
        keys.SHELL_BESIDE,
        (keys.HEAVINESS, "a tape has no weight here"),
        (keys.CLAMP_RULINGS, "the section is the tape's own"),
        (keys.TOLERANCE, "the elements are as given"),
    )

    def refusal(self, scene: Scene) -> BadInput | None:
        """A section that is not shallow, and what leaves the plane."""
        if scene.thickness is None:
            return BadInput("strip.thickness", None, "is missing, and a tape stretches", "add strip.thickness")
        edge = abs(0.5 * scene.width * scene.transverse_curvature)
        if edge >= DEEPEST:
            return BadInput(
                "strip.transverse_curvature", scene.strip.transverse_curvature,
                f"turns the section's edge by {edge:.3g} rad, and the tape's section is shallow",
                f"give less than {2.0 * DEEPEST / scene.strip.width:.4g}",
            )  # fmt: skip
        plane = plane_of(scene)
        for stage in scene.stages():
            reason = leaves(stage, plane)
            if reason is not None:
                return BadInput("model.energy", scene.model.energy, f"is planar, but {reason}", "turn the clamp")
        return None

    def closed_to(self, scene: Scene) -> str | None:
        """Nothing: what a scene may not have is refused where it is solved."""
        return None

    def ladder(self, scene: Scene, degree: int | None) -> str:
        """The section that the scene asks for; of a scene of another model the enriched one."""
        return scene.model.energy if scene.model.energy in TERMS else self.name

    def problem(self, scene: Scene, size: Size | None, near: Shape | None) -> Task[Folding]:
        """From rest through the stages of the path; `near` is not used: the path says which state it is."""
        from ribbon.tape.section import Section

        assert scene.thickness is not None
        terms = TERMS[self.ladder(scene, None) if size is None else size.ladder]
        section = Section(scene.width, scene.thickness, scene.strip.poisson, scene.transverse_curvature, terms)
        lengths = _lengths(scene) if size is None else np.full(int(size.values[0]), 1.0 / size.values[0])
        plane = plane_of(scene)
        stages = unwound([holds(stage, plane) for stage in scene.stages()])
        return Task(Folding(section, stages, lengths, scene.model.budget), "path" if scene.path else "rest")

    def run(self, problem: Folding, options: Options, say: Reporter | None) -> Tape:
        """Through the stages. Raises `BadInput` for a path that cannot be gone."""
        from ribbon.tape.solve import solve

        stages = problem.stages

        def told(mark: Mark) -> None:
            if say is not None and len(stages) > 1:
                say.step(f"tape: stage {mark.stage + 1} of {len(stages)}, {mark.share:.3f}, fold at {mark.fold:.3f} l")

        try:
            return solve(problem.section, stages, problem.lengths, told=told, budget=problem.budget)
        except ValueError as error:
            raise BadInput("path", None, f"cannot be gone: {error}", "let every stage hold the same things") from None

    def finer(self, found: Tape) -> Tape | None:
        """Elements half as long, begun at the answer."""
        from ribbon.tape.solve import refined

        return refined(found)

    def refined(self, state: State) -> State | None:
        """The same state on elements half as long, with the steps of the way to it."""
        finer = super().refined(state)
        return None if finer is None else replace(finer, log=state.log, states=state.states)

    def error(self, scene: Scene, chain: Sequence[State], options: Options) -> float | None:
        """The distance (Hausdorff over l) to the same state on elements half as long."""
        shapes = [one.shape for one in chain if one.shape is not None]
        if len(shapes) < 2:
            return None
        grid = options.grid or Grid.for_shape(scene, shapes[0].bend)
        return float(grid_hausdorff(grid.of(shapes[0]), grid.of(shapes[1])))

    def state(self, scene: Scene, found: Tape) -> State:
        """The tape in its plane."""
        from ribbon.tape.surface import parts

        tape = found
        origin, axes = plane_of(scene)
        n = len(tape.rod.lengths)
        membrane, bending = parts(tape.rod, tape.x)
        mark = tape.marks[-1] if tape.marks else None
        return State(
            model=self.name,
            size=Size(_name_of(tape), (float(n),)),
            status=Status(tape.status.value),
            word=tape.status.value,
            stable=None if tape.status.value == "not_converged" else tape.negative == 0,
            message=tape.message,
            energy=Energy(elastic=membrane + bending, parts={"bending": bending, "membrane": membrane}),
            shape=TapeShape(tape, tape.x, origin, axes),
            residual=float(tape.residual),
            iterations=tape.iterations,
            supports=Supports() if mark is None else _supports(mark, axes, scene.clamp_end is not None),
            error_why="not asked for",
            unknowns=tape.rod.size - len(tape.rod.fixed),
            numbers={
                "segments": n,
                "max_abs_eta": 0.0,
                "max_abs_eta_prime_w_half": 0.0,
                **({} if mark is None else {"fold": mark.fold, "flattest": mark.flattest}),
            },
            log=tuple(_entry(one) for one in tape.marks),
            states=_film(scene, tape, origin, axes),
            native=tape,
        )

    def switches(self, scene: Scene) -> Sequence[Effect | Switch]:
        """The section, its rest curvature, the holds."""
        return switches(scene)


def _name_of(tape: Tape) -> str:
    return next((name for name, terms in TERMS.items() if terms == tape.rod.section.terms), "tape")


def _lengths(scene: Scene) -> FloatArray:
    """The scene's elements where it says any, else the finest usual ones: a fold's edge is about h^(1/2) l long."""
    if scene.given() & {"model.elements", "model.element_lengths", "model.grading"}:
        return np.asarray(scene.model.lengths, dtype=float)
    return np.full(FINEST, 1.0 / FINEST)


def _supports(mark: Mark, axes: FloatArray, held: bool) -> Supports:
    """Forces and moments of the clamps, in space; held: whether there is one at s = l."""

    def part(force: tuple[float, float], moment: float) -> Force:
        return Force(force[0] * axes[:, 2] + force[1] * axes[:, 1], -moment * axes[:, 0])

    start = part(mark.start_force, mark.moments[0])
    return Supports(start, None if not held else part(mark.force, mark.moments[1]))


def _entry(mark: Mark) -> dict[str, object]:
    """What a step of the way keeps: D w / l^2, D w / l, rad, l."""
    return {
        "stage": mark.stage + 1, "t": mark.share, "accepted": True, "jump": mark.jumped, "stable": mark.stable,
        "negative": mark.negative, "turn_start": mark.angles[0], "turn_end": mark.angles[1], "end_z": mark.end[0],
        "end_y": mark.end[1], "force_z": mark.force[0], "force_y": mark.force[1], "moment_start": mark.moments[0],
        "moment_end": mark.moments[1], "fold": mark.fold, "flattest": mark.flattest, "iterations": mark.iterations,
    }  # fmt: skip


def _film(scene: Scene, tape: Tape, origin: FloatArray, axes: FloatArray) -> States | None:
    """The states of the way."""
    film = Film(scene.width)
    for mark in tape.marks:
        shape = TapeShape(tape, mark.x, origin, axes)
        film.add(mark.stage + 1, mark.share, shape.points(film.s, film.v), shape.fields(film.s, film.v))
    return film.states
