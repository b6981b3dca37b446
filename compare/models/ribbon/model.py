"""The ribbon on curvature elements as a model: what it reads of a scene, its sizes, its answer."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.measure.grid import Grid
from compare.models import half_turns, keys
from compare.models.base import (
    Effect,
    Ladder,
    Model,
    Options,
    Rivals,
    Seconds,
    Shape,
    Size,
    State,
    Status,
    Variant,
)  # fmt: skip
from compare.models.capabilities import Choice as Chosen
from compare.models.capabilities import Evaluation, Reference
from compare.models.quantities.ribbon import QUANTITIES
from compare.models.reference import cut
from compare.models.ribbon import neutral
from compare.models.ribbon.refinement import judged, left, refined
from compare.models.ribbon.solving import solved, solved_line, solved_together, together
from compare.models.ribbon.state import own_size, state_of
from compare.models.scope import beyond_the_ribbon
from compare.models.timing import LONG, compiled, compiling
from compare.registry import name_for
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.models.capabilities import BranchStart, Estimate, Followed, Line, Moves, Priced
    from compare.models.ribbon.rivals import Probed
    from compare.models.ribbon.stages import LoadPath
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from ribbon import Equilibrium

FloatArray = NDArray[np.float64]

#: Usual sizes: segments of equal length, tolerances that place them.
SEGMENTS = (5, 10, 20, 40, 80, 160, 320)
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)


class RibbonModel(Model):
    """The inextensible ribbon of the thesis, chained or glued."""

    name = "ribbon"
    quantities = QUANTITIES
    presenter = "compare.pages.ribbon:PRESENTER"
    remedies: Mapping[str, str] = {
        "saddle": ": leave it along its unstable direction (without --stay; on a [[path]] --leave-saddle), or start "
        "from another [seed]: a bent one, e.g. curvature = 0.5, or out of its plane, e.g. ruling = 0.01",
        "not_converged": "; try another [seed], more segments, or a smaller load first",
        "failed": "; try another [seed] or a smaller load",
        "infeasible": ", or declare a [[path]] that leads there",
        "flipped": "; start from a nearer [seed] or a [[path]]",
    }
    reads = (
        keys.STRIP | keys.SHAPED | keys.TIP | keys.WEIGHT | keys.OVER_THE_SURFACE | keys.BOTH_CLAMPS | keys.CLOSURE
        | keys.HALF_TURNS | keys.WALLS | keys.OBSTACLES | keys.FRICTION | keys.CONTACT
        | keys.FOLLOWED | keys.DRAWN
        | keys.MODEL - keys.ARC_LENGTH | keys.SEED
        | keys.PATH
    )  # fmt: skip
    without_effect = keys.because(
        keys.UNSURE,
        (keys.SHELL, "how the shell beside it is made and held (an energy with a thickness takes it from an only w/h)"),
        (keys.ARC_LENGTH, "how the elastica beside it passes limit points"),
    )

    def refusal(self, scene: Scene) -> BadInput | None:
        """A rod; keys of which one would be ignored."""
        beyond = beyond_the_ribbon(scene)
        if beyond is not None:
            from compare.models.effects.elsewhere import remedy_elsewhere

            problem = f"is in the scene: the ribbon {beyond[1]}"
            return BadInput(beyond[0], None, problem, remedy_elsewhere(scene, beyond[0]))
        if name_for(scene.model.energy) not in (self.name, "elastica"):
            return BadInput("model.energy", scene.model.energy, "is another model's than the ribbon's")
        if scene.model.tolerance is not None and scene.model.formulation == "matrix":
            return BadInput(
                "model.formulation", scene.model.formulation, "cannot place its segments by model.tolerance",
                'choose formulation = "auto", "chained" or "mixed", or give model.elements',
            )  # fmt: skip
        from compare.models.holds.friction import refused
        from compare.models.ribbon.free import of_a_curve, refusal

        return refused(scene) or refusal(scene) or of_a_curve(scene)

    def variants(self, scene: Scene) -> tuple[Variant, ...]:
        """One; of an energy with a thickness one for each w/h of the scene."""
        from compare.models.ribbon.free import per_thickness

        return per_thickness(scene) or (Variant({}, scene),)

    def together(self, scene: Scene) -> Hashable | None:
        """Ribbons of which nothing is asked but the state of a strip that is held at s = 0 only."""
        return together(scene)

    def solve_together(self, scenes: Sequence[Scene]) -> list[State]:
        """One batch, without what is made ready for a scene alone."""
        return solved_together(scenes)

    def solve_line(
        self, gamma: FloatArray, curvature: FloatArray, solved: Callable[[Sequence[int]], Sequence[State]]
    ) -> Line | None:
        """Each between two solved alone begun at its neighbours' states."""
        return solved_line(gamma, curvature, solved)

    def ladders(self, scene: Scene) -> tuple[Ladder, ...]:
        """Chained, glued, and with segments placed by a tolerance."""
        mixed = Ladder("mixed", tuple(Size("mixed", (p,)) for p in SEGMENTS))
        if scene.path:
            return (
                Ladder("chained", why="a [[path]] is gone in the mixed model"),
                mixed,
                Ladder("placed", why="a [[path]] names its own segments"),
            )
        why = self._no_chain(scene)
        return (
            Ladder("chained", () if why else tuple(Size("chained", (p,)) for p in SEGMENTS), why),
            mixed,
            Ladder("placed", tuple(Size("placed", (x,)) for x in TOLERANCES)),
        )

    def _no_chain(self, scene: Scene) -> str | None:
        from compare.models.ribbon.build import ribbon_problem
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
        options = _as_solved(scene, options or Options())
        if scene.model.accuracy is not None:
            return half_turns.counted(scene, self._chosen(scene, size, options, say))
        return half_turns.counted(scene, self._solved(scene, size, options, say))

    def _chosen(self, scene: Scene, size: Size | None, options: Options, say: Reporter | None) -> State:
        """With the energy that the scene's accuracy chooses, on the elements of the scene itself."""
        from compare.models.ribbon.auto import LADDER, choose, with_energy
        from ribbon.solvers.budget import within

        with self._admitted(scene), within(scene.model.budget), compiling(say):
            choice = choose(scene, options, say)
        done = choice.solved.get(choice.energy) if size is None and not options.repeats else None
        seen = None if done is None or choice.energy != LADDER[0] else (done[1], choice.rival)
        state = self._solved(with_energy(scene, choice.energy), size, options, say, done, seen)
        return replace(state, numbers={**state.numbers, "auto": choice.to_dict()})

    def _solved(
        self,
        scene: Scene,
        size: Size | None,
        options: Options,
        say: Reporter | None,
        done: tuple[LoadPath | None, Equilibrium, Seconds] | None = None,
        seen: Probed | None = None,
    ) -> State:
        """With the energy of the scene; done: what is solved already; seen: what a probe has seen already."""
        from compare.models.ribbon.build import ribbon_energy
        from ribbon.solvers import choose

        scene = scene if size is None else sized(scene, size)
        with self._admitted(scene), choose.using(scene.model.solver):
            tolerance = scene.model.tolerance
            if say is not None:
                what = f"tolerance {tolerance:g}" if tolerance is not None else f"{len(scene.model.lengths)} segments"
                stages = f", {len(scene.path) + 1} stages" if scene.path else ""
                say.step(f"ribbon: {ribbon_energy(scene)}, {what}{stages}")
            with compiling(say):
                path, found, seconds = done or solved(scene, options, say)
        state = state_of(scene, found, own_size(found) if size is None else _shown(size, found), seconds, path)
        return self._judged(scene, state, options, say, seen) if options.error else state

    def _judged(
        self, scene: Scene, state: State, options: Options, say: Reporter | None = None, seen: Probed | None = None
    ) -> State:
        """With its errors and with what is beside it."""
        from ribbon.solvers import choose
        from ribbon.solvers.budget import within

        found = state.native
        with within(scene.model.budget), choose.using(scene.model.solver):
            state = judged(state, say, options.grid, scene)
            state = neutral.told(scene, _beside_rivals(scene, state, seen))
            if options.leave_saddle and state.status is Status.UNSTABLE and state.native is not found:
                state = left(scene, state, say, options)
        return state

    def followed(self, first: Scene, last: Scene, near: State) -> Followed:
        """By a session in the hand (`compare.models.follow.ribbon`)."""
        from compare.models.follow.ribbon import followed

        with self._admitted(last):
            return followed(first, last, near)

    def judged(self, scene: Scene, state: State) -> State:
        """As by `solve` (`compare.models.capabilities.Follows`); a saddle stays one."""
        with self._admitted(scene):
            return self._judged(scene, state, Options(leave_saddle=False, error=True))

    def seeded(self, scene: Scene, state: State) -> Scene:
        """With the curvature and the ruling of the state (`compare.models.follow.ribbon`)."""
        from compare.models.follow.ribbon import seeded

        return seeded(scene, state)

    def refined(self, state: State) -> State | None:
        """Every segment cut in two, solved again from the state; None where it is not stable."""
        return refined(state)

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
        mixed = bool(scene.path) or "mixed" in ladders or "chained" not in ladders
        most = max((size.values[0] for size in sizes if size.ladder != "placed"), default=SEGMENTS[-1])
        start = Size("mixed" if mixed else "chained", (most,))
        if say is not None:
            say.step(f"reference of the ribbon: {4 * most:g} and {8 * most:g} segments")
        quick = replace(options or Options(), error=False, repeats=0, store=None)
        return cut(self, self.solve(scene, start, options=quick, say=say), _grid(quick), "segments")

    def error(self, state: State, say: Reporter | None = None, grid: Grid | None = None) -> float | None:
        """The discretisation error alone (`compare.models.ribbon.refinement.judged`)."""
        return judged(state, say, grid).error

    def estimate(self, scene: Scene, state: State, width_to_thickness: float, say: Reporter | None = None) -> Estimate:
        """How far a shell of this w/h would be from the state (`compare.models.ribbon.estimate`, `remaining`)."""
        from compare.models.ribbon.estimate import estimate
        from compare.models.ribbon.neglected_free import remaining

        found = remaining if state.native.has_free_twist else estimate
        seen = None if state.rivals is None else state.rivals.seen
        with compiling(say):
            return found(scene, state.native, width_to_thickness, seen)

    def rests(self, scene: Scene, state: State, near: Shape, finer: int = 1) -> State | None:
        """Where the ribbon comes to rest from another model's shape (`compare.models.capabilities.Rests`)."""
        from compare.models.ribbon import rivals
        from ribbon.solvers import choose
        from ribbon.solvers.budget import within

        with self._admitted(scene), within(scene.model.budget), choose.using(scene.model.solver):
            found = rivals.near(state.native, near, finer)
        return state_of(scene, found, own_size(found), Seconds(sum(found.seconds.values()))) if found.ok else None

    def branch_start(
        self, scene_at: Callable[[float], Scene], say: Reporter | None = None, *, moving: bool = False
    ) -> BranchStart:
        """A branch of the glued ribbon (`compare.models.branches.ribbon`), of one energy."""
        from compare.models.branches.ribbon import branch_start, refused
        from compare.models.ribbon.auto import with_energy

        with self._admitted(scene_at(0.0)):
            unknown = refused(scene_at(0.0), moving)
            if unknown is not None:
                raise unknown
            first = self.settled(scene_at(0.0))
            energy = first.model.energy

            def one_energy(t: float) -> Scene:
                scene = scene_at(t)
                return scene if scene.model.accuracy is None else with_energy(scene, energy)

            return branch_start(one_energy, self.solve(first, options=Options(error=False), say=say), moving)

    @property
    def by_keys(self) -> tuple[str, ...]:
        """The keys by which a state has derivatives (`compare.models.capabilities.Differentiates`)."""
        from compare.models.ribbon.inputs import KEYS

        return KEYS

    def derivatives(
        self, scene: Scene, state: State, keys: Sequence[str], of: Callable[[Moves], dict[str, FloatArray]]
    ) -> dict[str, FloatArray]:
        """d(output) / d(key) by the chain rule (`compare.models.ribbon.inputs`)."""
        from compare.models.ribbon.inputs import derivatives

        return derivatives(scene, state, keys, of)

    def solved_near(self, scene: Scene, near: State | None) -> State:
        """From a neighbouring scene's state; from the scene's own seed, on from a saddle, where that leads nowhere."""
        from compare.models.ribbon.inputs import solved_near

        return solved_near(scene, near) or self.solve(scene, options=Options(leave_saddle=True))

    def effects(self, scene: Scene) -> tuple[Effect, ...]:
        """Loads, shape, ends, walls and procedures, measured where they are on (`compare.models.effects.ribbon`)."""
        from compare.models.effects.ribbon import effects

        if scene.model.accuracy is not None:
            choice = self.choice(scene)
            return (*self.effects(choice.scene), *choice.effects)
        with self._admitted(scene):
            return effects(scene)

    def choice(self, scene: Scene, say: Reporter | None = None) -> Chosen:
        """As `solve` makes it, within the scene's budget (`compare.models.capabilities.Chooses`)."""
        from compare.models.effects.ribbon import skipped
        from compare.models.ribbon.auto import choose, with_energy
        from ribbon.solvers.budget import within

        with self._admitted(scene), within(scene.model.budget), compiled() as count, compiling(say):
            choice = choose(scene, _as_solved(scene, Options()), say)
            fresh = count() > 0
        one, done = with_energy(scene, choice.energy), choice.solved.get(choice.energy)
        if fresh or (done is not None and done[2].first < LONG):  # solved again, its time tells what a solve takes
            done = None

        def solve(options: Options, say: Reporter | None) -> State:
            options = _as_solved(one, options)
            return half_turns.counted(one, self._solved(one, None, options, say, None if options.repeats else done))

        return Chosen(one, skipped(choice), solve)

    def settled(self, scene: Scene) -> Scene:
        """With the energy that its accuracy chooses (`compare.models.capabilities.Chooses`)."""
        from compare.models.ribbon.auto import choose, with_energy
        from ribbon.solvers.budget import within

        if scene.model.accuracy is None:
            return scene
        with self._admitted(scene), within(scene.model.budget):
            return with_energy(scene, choose(scene).energy)

    def barriers(self, scene: Scene, state: State, points: FloatArray) -> list[FloatArray]:
        """As they stand (`compare.models.holds.ribbon`)."""
        from compare.models.holds.ribbon import nets

        return nets(state.native, points)

    def prices(self, scene: Scene, state: State) -> tuple[Priced, ...]:
        """What every effect changes of a state, to first order (`compare.models.effects.moved`)."""
        from compare.models.effects.moved import prices

        return prices(scene, state)

    def evaluation(self, scene: Scene) -> Evaluation:
        """The size of the problem, and the time of one evaluation (`compare.models.capabilities.Evaluates`)."""
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
            if error.key == "seed_curvature":
                given = scene.seed.curvature
                rest = scene.strip.natural_curvature
                if given is None and any(rest):
                    value = rest[0] if len(set(rest)) == 1 else list(rest)
                    raise BadInput("strip.natural_curvature", value, error.remedy) from None
                raise BadInput("seed.curvature", None if given is None else list(given), error.remedy) from None
            raise BadInput("scene", scene.name, str(error)) from None


def _as_solved(scene: Scene, options: Options) -> Options:
    """The options with what the scene itself says about leaving a saddle, where they do not."""
    if half_turns.are_several(scene):  # what such a saddle is left for has fewer
        return replace(options, leave_saddle=False)
    return options if options.leave_saddle is not None else replace(options, leave_saddle=scene.only_raised)


def _beside_rivals(scene: Scene, state: State, seen: Probed | None = None) -> State:
    """The state with the other states that were looked for beside it, where it is known of none yet: of a strip that is
    held at one end by the probe (`compare.models.ribbon.rivals`), which is not asked twice of one equilibrium."""
    from compare.models.ribbon.rivals import TRIES, is_probed, probe_once

    if state.rivals is not None or not state.ok or state.native is None or not is_probed(scene):
        return state
    found = probe_once(scene, state.native, seen)
    asked = (state.native, found)
    if found is None:
        return replace(state, rivals=Rivals(TRIES, 0.0, "none lower was seen", asked))
    return replace(state, rivals=Rivals(TRIES, found.own - found.energy, found.text, asked))


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


def _shown(size: Size, equilibrium: Equilibrium) -> Size:
    """A size that was asked for, with the number of segments that a tolerance has led to."""
    if size.ladder != "placed":
        return size
    return replace(size, words=f"{equilibrium.problem.lengths.size} (for {size.values[0]:.0e})")
