"""The ribbon on curvature elements as a model: what it reads of a scene, its sizes, its answer."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from compare.errors import BadInput
from compare.measure.align import Motions, aligned
from compare.measure.distance import grid_hausdorff
from compare.measure.error import extrapolated
from compare.measure.grid import Grid
from compare.models.base import (
    Effect,
    Energy,
    Evaluation,
    Force,
    Ladder,
    Options,
    Pose,
    Reference,
    Refinement,
    Seconds,
    Shape,
    Size,
    State,
    Status,
    Supports,
    Variant,
    natural_constant,
)  # fmt: skip
from compare.models.reference import cut
from compare.models.timing import clocked, repeated
from compare.registry import name_for
from compare.scene.check import beyond_the_ribbon

if TYPE_CHECKING:
    from compare.models.ribbon_estimate import Estimate
    from compare.models.ribbon_way import Way
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from ribbon import Equilibrium

FloatArray = NDArray[np.float64]

#: Segments up to which a ribbon is solved again for the error estimate: with a dense Hessian, with a sparse one. Once
#: beyond is allowed, for the cruder of the two estimates.
MOST_SEGMENTS = 320
MOST_SPARSE_SEGMENTS = 4000
#: Usual sizes: segments of equal length, tolerances that place them.
SEGMENTS = (5, 10, 20, 40, 80, 160, 320)
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)
#: Abscissae at which the largest curvature is looked for.
_SAMPLES = np.linspace(0.0, 1.0, 2001)

_STATUS = {
    "converged": Status.CONVERGED,
    "saddle": Status.UNSTABLE,
    "not_converged": Status.NOT_CONVERGED,
    "failed": Status.FAILED,
    "infeasible": Status.INFEASIBLE,
    "flipped": Status.FAILED,
    "rulings_cross": Status.RULINGS_CROSS,
}


@dataclass(frozen=True)
class RibbonShape:
    """A ribbon's surface: straight rulings through its centreline (`compare.models.base.Shape`)."""

    equilibrium: Equilibrium

    @property
    def bend(self) -> float:
        """Largest normal curvature, 1/l."""
        return float(np.abs(self.equilibrium.omega(_SAMPLES)).max())

    def points(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """Positions (k, m, 3)."""
        grid_s, grid_v = np.meshgrid(s, v, indexing="ij")
        _, place, _ = self.equilibrium.rulings(np.column_stack([grid_s.ravel(), grid_v.ravel()]))
        return place.reshape(*grid_s.shape, 3)

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3)."""
        return self.equilibrium.position(s)

    def frames(self, s: FloatArray) -> FloatArray:
        """Frames (k, 3, 3), columns t_x t_y t_z."""
        return self.equilibrium.frame(s)

    def pose(self, s: float) -> Pose:
        """Position and frame at one abscissa; at s = 1 those of the last joint, where a clamp holds them."""
        found = self.equilibrium.end if s == 1.0 else self.equilibrium.pose(s)
        return Pose(found.position, found.frame)

    def fields(self, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
        """`compare.models.ribbon_fields.fields`: S, v, omega, eta, rulings, normal, energy_density and others."""
        from compare.models.ribbon_fields import fields

        return fields(self.equilibrium, s, v)


class RibbonModel:
    """`compare.models.base.Model`: the inextensible ribbon of the thesis, chained or glued."""

    name = "ribbon"
    presenter: str | None = "compare.pages.ribbon"
    reads = frozenset(
        {
            "title", "strip.length", "strip.width", "strip.thickness", "strip.poisson", "strip.natural_curvature",
            "strip.gamma", "strip.young", "strip.density", "gravity.*", "clamp.*", "closure.*", "wall.*",
            "model.energy", "model.elements", "model.grading", "model.element_lengths", "model.tolerance",
            "model.formulation", "model.held_by", "model.budget", "seed.*", "path",
        }
    )  # fmt: skip
    without_effect: Mapping[str, str] = {
        "uncertainty.*": "how sure the inputs are moves no result (compare.studies.inputs)",
        "shell.*": "how the shell beside it is made and held",
        "model.arc_length": "how the elastica beside it passes limit points",
    }
    wing: tuple[str, ...] = ("ribbon", "compare/scene", "compare/models", "compare/measure")

    def refusal(self, scene: Scene) -> BadInput | None:
        """A rod, or a load at the tip; keys of which one would be ignored."""
        beyond = beyond_the_ribbon(scene)
        if beyond is not None:
            remedy = 'use ribbonbench solve with model.energy = "elastica"'
            return BadInput(beyond[0], None, f"is in the scene: the ribbon {beyond[1]}", remedy)
        if name_for(scene.model.energy) not in (self.name, "elastica"):
            return BadInput("model.energy", scene.model.energy, "is another model's than the ribbon's")
        if scene.model.tolerance is not None and scene.model.formulation not in ("auto", "mixed"):
            return BadInput(
                "model.formulation", scene.model.formulation, "cannot place its segments by model.tolerance",
                'choose formulation = "mixed" or "auto", or give model.elements',
            )  # fmt: skip
        return None

    def variants(self, scene: Scene) -> tuple[Variant, ...]:
        """One."""
        return (Variant({}, scene),)

    def ladders(self, scene: Scene) -> tuple[Ladder, ...]:
        """Chained, glued, and glued with segments placed by a tolerance."""
        glued = Ladder("mixed", tuple(Size("mixed", (p,)) for p in SEGMENTS))
        if scene.path:
            return (
                Ladder("chained", why="a [[path]] is gone in the mixed model"),
                glued,
                Ladder("placed", why="a [[path]] names its own segments"),
            )
        why = self._no_chain(scene)
        return (
            Ladder("chained", () if why else tuple(Size("chained", (p,)) for p in SEGMENTS), why),
            glued,
            Ladder("placed", tuple(Size("placed", (x,)) for x in TOLERANCES)),
        )

    def _no_chain(self, scene: Scene) -> str | None:
        from compare.models.ribbon_build import ribbon_problem
        from ribbon import RibbonInputError

        try:
            ribbon_problem(sized(scene, Size("chained", (SEGMENTS[0],))), "chained")
        except (RibbonInputError, BadInput) as error:
            return str(error)
        return None

    def solve(
        self,
        scene: Scene,
        size: Size | None = None,
        *,
        near: Shape | None = None,
        options: Options | None = None,
        say: Reporter | None = None,
    ) -> State:
        """From the seed, along the path, or to the tolerance. `near` is not used: the scene's own seed decides."""
        from compare.models.ribbon_build import ribbon_energy
        from ribbon.solvers.budget import within

        options = options or Options()
        scene = scene if size is None else sized(scene, size)
        with self._admitted(scene):
            tolerance = scene.model.tolerance
            if say is not None:
                what = f"tolerance {tolerance:g}" if tolerance is not None else f"{len(scene.model.lengths)} segments"
                stages = f", {len(scene.path) + 1} stages" if scene.path else ""
                say.step(f"ribbon: {ribbon_energy(scene)}, {what}{stages}")
            with _compiling(say):
                way, found, seconds = _solved(scene, options, say)
        state = state_of(scene, found, own_size(found) if size is None else _shown(size, found), seconds, way)
        if not options.error:
            return state
        with within(scene.model.budget):
            state = self.judged(state, say, options.grid, scene)
            if options.leave_saddle and state.status is Status.UNSTABLE and state.native is not found:
                state = self._left(scene, state, say, options)
        return state

    def _left(self, scene: Scene, state: State, say: Reporter | None, options: Options) -> State:
        """From a saddle that only finer segments show (the native of `state`) along its unstable direction."""
        from ribbon import switch

        saddle = state.native
        found = switch(saddle.problem, saddle, leave_saddle=True)
        if not found.ok:
            return state
        fresh = state_of(scene, found, own_size(found), state.seconds)
        judged = self.judged(fresh, say, options.grid, scene)
        return replace(judged, log=state.log, refinements=(*state.refinements, *judged.refinements))

    def refined(self, state: State) -> State | None:
        """Every segment cut in two, solved again from the state; None where it is not stable."""
        from ribbon import refine

        if not state.ok:
            return None
        finer = refine(state.native)
        size = Size(state.size.ladder, (float(finer.problem.lengths.size),))
        return state_of(None, finer, size, Seconds(float("nan")), None)

    def reference(
        self,
        scene: Scene,
        sizes: Sequence[Size],
        *,
        near: Shape | None = None,
        options: Options | None = None,
        say: Reporter | None = None,
    ) -> Reference:
        """The largest number of segments (of `SEGMENTS`, where all sizes are tolerances) cut in four, glued unless only
        chained ones are asked for."""
        ladders = {size.ladder for size in sizes}
        glued = bool(scene.path) or "mixed" in ladders or "chained" not in ladders
        most = max((size.values[0] for size in sizes if size.ladder != "placed"), default=SEGMENTS[-1])
        start = Size("mixed" if glued else "chained", (most,))
        if say is not None:
            say.step(f"reference of the ribbon: {4 * most:g} and {8 * most:g} segments")
        quick = replace(options or Options(), error=False, repeats=0, store=None)
        return cut(self, self.solve(scene, start, options=quick, say=say), _grid(quick), "segments")

    def error(self, state: State, say: Reporter | None = None, grid: Grid | None = None) -> float | None:
        """The error of `judged` alone."""
        return self.judged(state, say, grid).error

    def judged(
        self, state: State, say: Reporter | None = None, grid: Grid | None = None, scene: Scene | None = None
    ) -> State:
        """The state with its discretisation error, the distance (Hausdorff / l) to its own limit of many segments on
        the same branch, and with what it is on finer segments.

        The error is `compare.measure.error.extrapolated` over segments cut in two and in four; rigid motions that
        nothing resists are none. Segments placed by a tolerance bring their own. A state that is a saddle on finer
        segments is one: the answer is then what was found there. scene: names its walls.
        """
        from ribbon.solvers.budget import SPENT, spent

        if not state.ok or state.shape is None:
            return replace(state, refinements=_all_tried(state.native), error_why="it is no stable equilibrium")
        e = state.native
        if e.tolerance_error is not None:
            return replace(
                state, error=float(e.tolerance_error), refinements=_all_tried(e), error_why="of the placed segments"
            )
        most = MOST_SEGMENTS if e.problem.formulation == "chained" else MOST_SPARSE_SEGMENTS
        grid = grid or Grid.for_shape(_Wide(2.0 * e.problem.half_width), state.shape.bend)  # type: ignore[arg-type]
        shapes = [grid.of(state.shape)]
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
            finer = self.refined(current)
            assert finer is not None  # `current` is stable
            if finer.shape is None or not finer.is_equilibrium:
                tried.append(_tried(finer.native, None))
                why = f"not known beyond: on {segments} segments {finer.message}"
                break
            there = aligned(grid.of(finer.shape), shapes[-1], finer.motions)
            tried.append(_tried(finer.native, grid_hausdorff(shapes[-1], there)))
            if not finer.ok:
                there_too = state_of(scene, finer.native, own_size(finer.native), state.seconds)
                return _hidden_saddle(state, there_too, tuple(tried))
            shapes.append(there)
            current = finer
        return replace(state, error=extrapolated(shapes), refinements=tuple(tried), error_why=why)

    def estimate(self, scene: Scene, state: State, width_to_thickness: float, say: Reporter | None = None) -> Estimate:
        """How far a shell of this w/h would be from the state (`compare.models.ribbon_estimate`)."""
        from compare.models.ribbon_estimate import estimate

        with _compiling(say):
            return estimate(scene, state.native, width_to_thickness)

    def effects(self, scene: Scene) -> tuple[Effect, ...]:
        """Loads, shape, ends, walls and procedures, measured where they are on (`compare.models.effects.ribbon`)."""
        from compare.models.effects.ribbon import effects

        with self._admitted(scene):
            return effects(scene)

    def evaluation(self, scene: Scene) -> Evaluation:
        """The size of the problem, and the time of one evaluation (`compare.models.base.Evaluates`)."""
        from compare.models.effects.ribbon import evaluation

        with self._admitted(scene):
            return evaluation(scene)

    @contextlib.contextmanager
    def _admitted(self, scene: Scene) -> Iterator[None]:
        """What the model or its solver refuses, as `BadInput`."""
        from ribbon import RibbonInputError

        refused = self.refusal(scene)
        if refused is not None:
            raise refused
        try:
            yield
        except RibbonInputError as error:
            raise BadInput("scene", scene.name, str(error)) from None


@dataclass(frozen=True)
class _Wide:
    """What `Grid.for_shape` asks of a scene: w / l."""

    width: float


def sized(scene: Scene, size: Size) -> Scene:
    """The scene with the segments of a size: a number of them in the formulation that the ladder names, or ("placed")
    as many as the tolerance asks for."""
    value = size.values[0]
    if size.ladder == "placed":
        return scene.replace({"model.tolerance": value, "model.formulation": "auto", "model.grading": None})
    return scene.replace({"model.elements": int(value), "model.formulation": size.ladder})


def _grid(options: Options) -> Grid:
    """The grid that errors are measured on."""
    assert options.grid is not None, "a reference's error is measured on a grid"
    return options.grid


def _shown(size: Size, found: Equilibrium) -> Size:
    """A size that was asked for, with the number of segments that a tolerance has led to."""
    if size.ladder != "placed":
        return size
    return replace(size, words=f"{found.problem.lengths.size} (for {size.values[0]:.0e})")


def own_size(found: Equilibrium) -> Size:
    """The size that a ribbon has."""
    return Size(found.problem.formulation, (float(found.problem.lengths.size),))


def _solved(scene: Scene, options: Options, say: Reporter | None) -> tuple[Way | None, Equilibrium, Seconds]:
    """The way (None without a path), its end, and the times: of the whole way, from the first stage's seed."""
    from compare.models.ribbon_way import run_key, run_way

    leave = options.leave_saddle
    if not scene.path:
        found, seconds = clocked(solver(scene, leave), options.repeats)
        return None, found, seconds
    folder = None if options.store is None else options.store.way(run_key(scene, leave))
    detail = None if say is None else say.detail
    way, seconds = clocked(lambda: run_way(scene, folder, leave_saddle=leave, progress=detail, film=True), 0)
    if folder is not None:
        with contextlib.suppress(OSError):  # empty: the way is finished
            folder.rmdir()
    if not way.resumed:  # gone again without the folder: nothing kept may shorten it
        seconds = repeated(lambda: run_way(scene, leave_saddle=leave), seconds.first, options.repeats)
    return way, way.equilibrium, seconds


@contextlib.contextmanager
def compiled() -> Iterator[Callable[[], int]]:
    """While inside, compilations of the ribbon's kernels are counted; yields what says how many there were."""
    from ribbon.element.kernel_cache import told

    counts = [0]
    with told(counts.append):
        yield lambda: counts[-1]


@contextlib.contextmanager
def _compiling(say: Reporter | None) -> Iterator[None]:
    """Says that kernels are being compiled, as soon as the first of them is not found in the cache."""
    from ribbon.element.kernel_cache import told

    if say is None:
        yield
        return
    words = "compiling the ribbon's kernels, once after each installation (half a minute to a minute)"
    with told(lambda count: say.aside(words if count == 1 else f"{words}: {count} so far")):
        yield


def solver(scene: Scene, leave_saddle: bool = False) -> Callable[[], Equilibrium]:
    """The whole solve of a scene without a path as a function: from the seed, to the tolerance where there is one."""
    from compare.models.ribbon_build import ribbon_arguments
    from ribbon import solve
    from ribbon.find.adaptive import solve_to_tolerance

    arguments = {**ribbon_arguments(scene), "budget": scene.model.budget}
    tolerance = scene.model.tolerance
    if tolerance is None:
        return lambda: solve(**arguments, leave_saddle=leave_saddle)
    del arguments["segments"]
    first_three = [arguments.pop(name) for name in ("strip", "clamp", "gravity")]
    strict = "model.tolerance" in scene.own_keys
    return lambda: solve_to_tolerance(
        *first_three, **arguments, tolerance=tolerance, leave_saddle=leave_saddle, strict=strict
    )


def state_of(scene: Scene | None, e: Equilibrium, size: Size, seconds: Seconds, way: Way | None = None) -> State:
    """A ribbon's equilibrium as a state; scene: names its walls."""
    from ribbon.energies import ENERGIES

    lower, upper = e.problem.bounds()  # type: ignore[attr-defined]
    plates = any(wall.stiffness is not None for wall in scene.walls) if scene is not None else bool(e.energy.plates)
    lowest = e.lowest_eigenvalue
    return State(
        model="ribbon",
        size=size,
        status=_STATUS[e.status.code],
        word=e.status.code,
        stable=e.stable,
        message=e.message,
        energy=Energy(
            elastic=e.energy.elastic,
            gravity=e.energy.gravity,
            plates=e.energy.plates if plates else None,
            constant=natural_constant(e.problem.strip.curvature),
            parts={"bending": e.energy.bending, "natural": e.energy.natural},
        ),
        shape=RibbonShape(e) if np.all(np.isfinite(e.x)) else None,
        residual=float(e.residual),
        iterations=int(e.iterations),
        lowest_eigenvalue=None if lowest is None else float(lowest),
        supports=_supports(scene, e),
        error=e.tolerance_error,
        seconds=seconds,
        unknowns=int(np.sum(np.asarray(lower) < np.asarray(upper))),
        numbers={
            "segments": int(e.problem.lengths.size),
            "knows_width": ENERGIES[e.problem.energy].knows_width,
            "max_abs_eta": float(e.max_abs_eta),
            "max_abs_eta_prime_w_half": float(e.max_abs_eta_prime_w_half),
        },
        motions=_motions(e),
        log=e.log,
        states=None if way is None else way.states,
        start="path" if way is not None else "seed",
        reused=way.resumed if way is not None else False,
        native=e,
    )


def _motions(e: Equilibrium) -> Motions | None:
    """The rigid motions that nothing resists."""
    problem: Any = e.problem
    translations, axes = problem.free_motions()
    if not len(translations) and not len(axes):
        return None
    held = [r for r in (problem.start_position, problem.end_position) if r is not None]
    return Motions(translations, axes, held[0] if held else None)


def _supports(scene: Scene | None, e: Equilibrium) -> Supports:
    """Forces and moments of clamps and walls.

    The walls of a way that stopped before its last stage may be others than the scene's: they are then not listed. A
    wall without a name goes by its number, as in the keys of the scene.
    """
    end = e.end_support
    walls: tuple[Mapping[str, Any], ...] = ()
    if scene is not None and len(e.walls) == len(scene.walls):
        walls = tuple(
            {
                "name": str(number) if wall.name is None else wall.name,
                "force": found.force,
                "contacts": found.contacts,
                "height": found.height,
            }
            for number, (wall, found) in enumerate(zip(scene.walls, e.walls, strict=True))
        )
    start = Force(e.start.force, e.start.moment)
    return Supports(start, None if end is None else Force(end.force, end.moment), walls)


def _tried(found: Equilibrium, distance: float | None) -> Refinement:
    """One equilibrium as a refinement."""
    return _refinement(found.problem.lengths.size, found.status.code, found.lowest_eigenvalue, distance)


def _all_tried(found: Equilibrium) -> tuple[Refinement, ...]:
    """The equilibrium itself, or all on the way of a tolerance that placed its segments."""
    if not found.refinements:
        return (_tried(found, None),)
    return tuple(
        _refinement(one.segments, one.status.code, one.lowest_eigenvalue, one.distance) for one in found.refinements
    )


def _refinement(segments: int, word: str, lowest: float, distance: float | None) -> Refinement:
    return Refinement(int(segments), word, float(lowest) if np.isfinite(lowest) else None, distance)


def _hidden_saddle(state: State, finer: State, tried: tuple[Refinement, ...]) -> State:
    """A state that is stable on its own segments and a saddle on finer ones: the saddle, of which all is known."""
    few, many = state.native.problem.lengths.size, finer.native.problem.lengths.size
    lowest = f"{finer.lowest_eigenvalue:.2g}"
    return replace(
        finer,
        message=f"saddle: stable on {few} segments only; on {many} the lowest eigenvalue is {lowest}, it is not stable",
        log=state.log,
        start=state.start,
        reused=state.reused,
        refinements=tried,
        error_why=f"on {many} segments the state is a saddle",
    )
