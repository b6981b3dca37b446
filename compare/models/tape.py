"""The tape spring as a model: a planar rod with a flexible section, its ends held, turned or moved along a path.

The plane is that of t_z and t_y at the start of the path. X, Y of `ribbon.tape` are along them; k of the rod is -omega
there, and its moment turns t_z towards t_y.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.errors import BadInput
from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.measure.states import Film
from compare.models.base import (
    Effect,
    Energy,
    Force,
    Ladder,
    Options,
    Pose,
    Seconds,
    Shape,
    Size,
    State,
    Status,
    Supports,
    Variant,
    on_strip,
    pose_of,
)  # fmt: skip
from compare.models.effects.tape import effects
from compare.models.quantities.tape import QUANTITIES
from compare.models.timing import clocked

if TYPE_CHECKING:
    from compare.measure.states import States
    from compare.scene.scene import Scene
    from compare.scene.spec import ClampSpec
    from compare.store.progress import Reporter
    from ribbon.tape.held import Hold
    from ribbon.tape.solve import Mark, Tape

FloatArray = NDArray[np.float64]

TERMS = {"tape": 3, "tape_plain": 1}
"""Terms of the section's curvature by `model.energy`."""

ELEMENTS = (100, 200, 400, 800)
"""Usual sizes."""

OUT_OF_PLANE = 1e-9
"""Component along t_x for which a clamp counts as in the plane."""

DEEPEST = 0.5 * math.pi
"""Angle beta0 (rad) of the section's edge from which no shallow section stands for it."""


@dataclass(frozen=True)
class TapeShape:
    """A tape in space (`compare.models.base.Shape`); origin (3,) and axes (3, 3), columns t_x t_y t_z, of its plane."""

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

    def pose(self, s: float) -> Pose:
        """Position and frame of the line v = 0 at one abscissa."""
        return pose_of(self, s)

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


class TapeModel:
    """`compare.models.base.Model`: a planar tape spring, enriched ("tape") or plain ("tape_plain")."""

    name = "tape"
    quantities = QUANTITIES
    presenter: str | None = "compare.pages.rods.tape"
    reads = frozenset(
        {
            "title", "strip.length", "strip.width", "strip.thickness", "strip.poisson", "strip.young",
            "strip.transverse_curvature", "clamp.start.position", "clamp.start.frame", "clamp.start.tangent",
            "clamp.start.normal", "clamp.start.across", "clamp.start.section", "clamp.start.slide",
            "clamp.end.position", "clamp.end.frame", "clamp.end.tangent", "clamp.end.normal", "clamp.end.across",
            "clamp.end.section", "clamp.end.slide", "model.energy", "model.elements", "model.element_lengths",
            "model.grading", "model.budget", "path",
        }
    )  # fmt: skip
    without_effect: Mapping[str, str] = {
        "uncertainty.*": "how sure the inputs are moves no result (compare.studies.inputs)",
        "strip.gamma": "a tape has no weight here",
        "strip.density": "a tape has no weight here",
        "clamp.start.ruling": "the section is the tape's own",
        "clamp.end.ruling": "the section is the tape's own",
        "model.tolerance": "the elements are as given",
        "shell.*": "how the shell beside it is made and held",
    }

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
        for stage in scene.stages():
            reason = _leaves(stage, _plane(scene))
            if reason is not None:
                return BadInput("model.energy", scene.model.energy, f"is planar, but {reason}", "turn the clamp")
        return None

    def variants(self, scene: Scene) -> tuple[Variant, ...]:
        """One."""
        return (Variant({}, scene),)

    def ladders(self, scene: Scene) -> tuple[Ladder, ...]:
        """The elements of the section that the scene asks for."""
        name = _ladder(scene)
        return (Ladder(name, tuple(Size(name, (float(n),)) for n in ELEMENTS)),)

    def solve(
        self,
        scene: Scene,
        size: Size | None = None,
        *,
        near: Shape | None = None,
        options: Options | None = None,
        say: Reporter | None = None,
    ) -> State:
        """From rest through the stages of the path; `near` is not used: the path says which state it is."""
        from ribbon.tape.section import Section
        from ribbon.tape.solve import solve

        options = options or Options()
        refused = self.refusal(scene)
        if refused is not None:
            raise refused
        assert scene.thickness is not None
        ladder = _ladder(scene) if size is None else size.ladder
        section = Section(scene.width, scene.thickness, scene.strip.poisson, scene.transverse_curvature, TERMS[ladder])
        lengths = _lengths(scene) if size is None else np.full(int(size.values[0]), 1.0 / size.values[0])
        stages = [_holds(stage, _plane(scene)) for stage in scene.stages()]
        stages = _unwound(stages)

        def told(mark: Mark) -> None:
            if say is not None and len(stages) > 1:
                say.step(f"tape: stage {mark.stage + 1} of {len(stages)}, {mark.share:.3f}, fold at {mark.fold:.3f} l")

        try:
            found, seconds = clocked(
                lambda: solve(section, stages, lengths, told=told, budget=scene.model.budget), options.repeats
            )
        except ValueError as error:
            raise BadInput("path", None, f"cannot be gone: {error}", "let every stage hold the same things") from None
        return self._state(scene, found, seconds, options)

    def _state(self, scene: Scene, tape: Tape, seconds: Seconds, options: Options) -> State:
        from ribbon.tape.surface import parts

        origin, axes = _plane(scene)
        shape = TapeShape(tape, tape.x, origin, axes)
        n = len(tape.rod.lengths)
        membrane, bending = parts(tape.rod, tape.x)
        mark = tape.marks[-1] if tape.marks else None
        state = State(
            model=self.name,
            size=Size(_name_of(tape), (float(n),)),
            status=Status(tape.status.value),
            word=tape.status.value,
            stable=None if tape.status.value == "not_converged" else tape.negative == 0,
            message=tape.message,
            energy=Energy(elastic=membrane + bending, parts={"bending": bending, "membrane": membrane}),
            shape=shape,
            residual=float(tape.residual),
            iterations=tape.iterations,
            supports=Supports() if mark is None else _supports(mark, axes, scene.clamp_end is not None),
            error_why="not asked for",
            seconds=seconds,
            unknowns=tape.rod.size - len(tape.rod.fixed),
            numbers={
                "segments": n,
                "max_abs_eta": 0.0,
                "max_abs_eta_prime_w_half": 0.0,
                **({} if mark is None else {"fold": mark.fold, "flattest": mark.flattest}),
            },
            log=tuple(_entry(one) for one in tape.marks),
            states=_film(scene, tape, origin, axes),
            start="path" if scene.path else "rest",
            native=tape,
        )
        known = options.error and tape.status.value != "not_converged"
        return self._with_errors(scene, state, options.grid) if known else state

    def _with_errors(self, scene: Scene, state: State, grid: Grid | None) -> State:
        """With the distance (Hausdorff over l) to the same state on elements half as long, and the errors of forces,
        moments and energies."""
        from dataclasses import replace

        from compare.measure.error import error_of_first
        from compare.measure.numbers import errors_of, numbers_of

        finer, shape = self.refined(state), state.shape
        chain = [numbers_of(one) for one in (state, finer) if one is not None]
        errors = errors_of(chain, error_of_first, state.residual or 0.0)
        if finer is None or shape is None or finer.shape is None:
            return replace(state, errors=errors, error_why="no equilibrium was found on elements half as long")
        grid = grid or Grid.for_shape(scene, shape.bend)
        error = float(grid_hausdorff(grid.of(shape), grid.of(finer.shape)))
        return replace(state, error=error, errors=errors, error_why="from elements half as long")

    def refined(self, state: State) -> State | None:
        """The same state on elements half as long."""
        from dataclasses import replace

        from ribbon.tape.solve import refined
        from ribbon.tape.surface import parts

        finer, seconds = clocked(lambda: refined(state.native), 0)
        if finer is None:
            return None
        shape = state.shape
        assert isinstance(shape, TapeShape)
        membrane, bending = parts(finer.rod, finer.x)
        supports = state.supports
        if finer.marks:
            supports = _supports(finer.marks[-1], shape.axes, state.supports.end is not None)
        return replace(
            state,
            supports=supports,
            size=Size(state.size.ladder, (float(len(finer.rod.lengths)),)),
            status=Status(finer.status.value),
            word=finer.status.value,
            stable=finer.negative == 0,
            energy=Energy(elastic=membrane + bending, parts={"bending": bending, "membrane": membrane}),
            shape=TapeShape(finer, finer.x, shape.origin, shape.axes),
            residual=float(finer.residual),
            iterations=finer.iterations,
            error=None,
            seconds=seconds,
            unknowns=finer.rod.size - len(finer.rod.fixed),
            numbers={**state.numbers, "segments": len(finer.rod.lengths)},
            native=finer,
        )

    def effects(self, scene: Scene) -> tuple[Effect, ...]:
        """The section, its rest curvature, the holds."""
        return effects(scene)


def _ladder(scene: Scene) -> str:
    """The section that the scene asks for; of a scene of another model the enriched one."""
    return scene.model.energy if scene.model.energy in TERMS else "tape"


def _name_of(tape: Tape) -> str:
    return next((name for name, terms in TERMS.items() if terms == tape.rod.section.terms), "tape")


def _lengths(scene: Scene) -> FloatArray:
    """The scene's elements where it says any, else the finest usual ones: a fold's edge is about h^(1/2) l long."""
    if scene.given() & {"model.elements", "model.element_lengths", "model.grading"}:
        return np.asarray(scene.model.lengths, dtype=float)
    return np.full(ELEMENTS[-1], 1.0 / ELEMENTS[-1])


def _plane(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Origin (3,) and axes (3, 3), columns t_x t_y t_z, of the tape's plane: the start clamp as the path begins."""
    first = scene.stages()[0]
    return np.asarray(first.position), np.asarray(first.frame)


def _leaves(scene: Scene, plane: tuple[FloatArray, FloatArray]) -> str | None:
    """The clamp that leaves the plane, with its component along t_x."""
    origin, axes = plane
    across = axes[:, 0]
    for name, position, frame, clamp in (
        ("start", scene.start_position, scene.start_frame, scene.clamp_start),
        ("end", scene.end_position, scene.end_frame, scene.clamp_end),
    ):
        found = {
            "position": None if position is None else float((position - origin) @ across),
            "tangent": None if frame is None else float(frame[:, 2] @ across),
            "normal": None if frame is None else float(frame[:, 1] @ across),
            "slide": None if clamp is None or clamp.slide is None else float(np.array(clamp.slide) @ across),
        }
        for key, component in found.items():
            if component is not None and abs(component) > OUT_OF_PLANE:
                return f"clamp.{name}.{key} has the component {component:.4g} along t_x, out of the plane of t_y, t_z"
        if frame is not None and float(frame[:, 0] @ across) < 0.0:
            return f"clamp.{name} has its t_x against that of the start: half a turn of twist"
    return None


def _holds(scene: Scene, plane: tuple[FloatArray, FloatArray]) -> tuple[Hold, Hold]:
    origin, axes = plane
    return (
        _hold(scene.clamp_start, scene.start_position, scene.start_frame, origin, axes),
        _hold(scene.clamp_end, scene.end_position, scene.end_frame, origin, axes),
    )


def _hold(
    clamp: ClampSpec | None,
    position: FloatArray | None,
    frame: FloatArray | None,
    origin: FloatArray,
    axes: FloatArray,
) -> Hold:
    """A clamp in the plane; a free end has a free section."""
    from ribbon.tape.held import Hold

    if clamp is None:
        return Hold(undeformed=False)

    def angle(vector: FloatArray) -> float:
        return math.atan2(float(vector @ axes[:, 1]), float(vector @ axes[:, 2]))

    point = None if position is None else (position - origin) @ axes
    return Hold(
        point=None if point is None else (float(point[2]), float(point[1])),
        slide=None if clamp.slide is None else angle(np.array(clamp.slide)),
        angle=None if frame is None else angle(frame[:, 2]),
        undeformed=clamp.section != "free",
    )


def _unwound(stages: list[tuple[Hold, Hold]]) -> list[tuple[Hold, Hold]]:
    """The stages with angles that follow each other by the shorter way."""
    from dataclasses import replace

    found: list[tuple[Hold, Hold]] = []
    for stage in stages:
        before = found[-1] if found else (None, None)
        turned = []
        for hold, old in zip(stage, before, strict=True):
            last = 0.0 if old is None or old.angle is None else old.angle
            if hold.angle is not None:
                whole = 2.0 * math.pi * round((last - hold.angle) / (2.0 * math.pi))
                turned.append(replace(hold, angle=hold.angle + whole))
            else:
                turned.append(hold)
        found.append((turned[0], turned[1]))
    return found


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
