"""A line as a model: all that models of a centreline with straight sections do alike, so that one says what is its own.

A model of a line (`LineModel`) says what it reads (`keys`, `compare.models.keys`), how it makes its solver's input of a
scene (`problem`), how that is solved (`run`), what the answer is (`state`) and, where it can, the same on finer
elements (`finer`). Refusals, the budget of time, clocks, sizes, the effects of a scene and the errors by refinement are
written here, once.
"""

from __future__ import annotations

import contextlib
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from compare.models.base import Effect, Ladder, Model, Options, Shape, Size, State, on_strip
from compare.models.effects.switches import Switch
from compare.models.timing import clocked
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter

FloatArray = NDArray[np.float64]
Problem = TypeVar("Problem")
Answer = TypeVar("Answer")


class Line(Shape):
    """A line as a strip in space: its sections are straight, along t_x, and nothing changes across.

    A shape of a line says its `bend`, `centreline`, `frames` and what it knows `along` it.
    """

    @abstractmethod
    def along(self, s: FloatArray) -> Mapping[str, FloatArray]:
        """Name -> numbers (k,) at abscissae s (k,) on the strip: "energy_density" (D / l^2, without the constant of the
        natural curvature) among them."""

    def points(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """Positions (k, m, 3)."""
        across = self.frames(s)[:, :, 0]
        return np.asarray(self.centreline(s)[:, None, :] + v[None, :, None] * across[:, None, :])

    def fields(self, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
        """S, v, normal, and what is known along the line."""
        grid_s, grid_v = np.meshgrid(s, v, indexing="ij")
        s = on_strip(s)
        return {
            "S": grid_s,
            "v": grid_v,
            "normal": np.broadcast_to(self.frames(s)[:, None, :, 1], (*grid_s.shape, 3)),
            **{name: np.broadcast_to(values[:, None], grid_s.shape) for name, values in self.along(s).items()},
        }


@dataclass(frozen=True)
class Task(Generic[Problem]):
    """What a line's solver gets: its input, where that begins (`State.start`), and what is said before it is solved
    ("": nothing)."""

    problem: Problem
    begins: str
    said: str = ""


class LineModel(Model, Generic[Problem, Answer]):
    """The base of the models of lines (`compare.models.base.Model`); Problem: the solver's input, Answer: its result.

    sizes, degrees: usual numbers of elements, and of each their degrees (None: they have no degree). halvings: how
    often the elements are halved for the errors of a state, and in what words.
    """

    sizes: ClassVar[tuple[float, ...]]
    degrees: ClassVar[tuple[int | None, ...]] = (None,)
    halvings: ClassVar[tuple[str, ...]] = ("from elements half as long",)
    not_found: ClassVar[str] = "none was found on elements half as long"

    # -- what a model of a line says ----------------------------------------------------------------------------------

    @abstractmethod
    def problem(self, scene: Scene, size: Size | None, near: Shape | None) -> Task[Problem]:
        """The scene at a size (None: its own), begun at `near` where that is given. Raises `BadInput`."""

    @abstractmethod
    def run(self, problem: Problem, options: Options, say: Reporter | None) -> Answer:
        """One solve: nothing else is inside the clock."""

    @abstractmethod
    def state(self, scene: Scene, found: Answer) -> State:
        """The answer as a state; times, start and errors are added by `solve`."""

    @abstractmethod
    def switches(self, scene: Scene) -> Sequence[Effect | Switch]:
        """What the model has of the scene: effects that are always there, and those that a scene may leave out."""

    def finer(self, found: Answer) -> Answer | None:
        """The same on elements half as long, begun at the answer; None where that is not found."""
        return None

    def estimated(self, problem: Problem, found: Answer) -> Answer:
        """The answer with the error of its shape where the solver tells it itself."""
        return found

    def error(self, scene: Scene, chain: Sequence[State], options: Options) -> float | None:
        """The error of the shape (Hausdorff / l) of the first state of a chain, each on elements half as long as the
        one before; here: as the solver has told it."""
        return chain[0].error

    def budget(self, seconds: float) -> AbstractContextManager[None]:
        """The solver's clock: what is solved inside has this much time (s)."""
        return contextlib.nullcontext()

    def ladder(self, scene: Scene, degree: int | None) -> str:
        """The name of the sizes of elements of this degree."""
        return self.name if degree is None else f"{self.name} {degree}"

    def closed_to(self, scene: Scene) -> str | None:
        """Why the scene has none of the sizes; None: it has them all."""
        refused = self.refusal(scene)
        return None if refused is None else str(refused)

    # -- what all of them do alike ------------------------------------------------------------------------------------

    def ladders(self, scene: Scene) -> tuple[Ladder, ...]:
        """The usual sizes, one ladder for each degree of the elements."""
        why = self.closed_to(scene)
        names = {self.ladder(scene, degree): degree for degree in self.degrees}
        return tuple(
            Ladder(name, () if why else tuple(Size(name, (n,), degree) for n in self.sizes), why)
            for name, degree in names.items()
        )

    def admit(self, scene: Scene, options: Options) -> None:
        """`BadInput` for what the model refuses."""
        refused = self.refusal(scene)
        if refused is not None:
            raise refused

    def solve(
        self,
        scene: Scene,
        size: Size | None = None,
        *,
        near: Shape | None = None,
        options: Options | None = None,
        say: Reporter | None = None,
    ) -> State:
        """The scene's state, timed, within its budget; with the errors that `options` ask for, in another one."""
        options = options or Options()
        self.admit(scene, options)
        task = self.problem(scene, size, near)
        if say is not None and task.said:
            say.step(task.said)

        def once() -> Answer:
            with self.budget(scene.model.budget):
                return self.run(task.problem, options, say)

        found, seconds = clocked(once, options.repeats)
        with self.budget(scene.model.budget):
            if options.error:
                found = self.estimated(task.problem, found)
            state = replace(self.state(scene, found), seconds=seconds, start=task.begins, scene=scene)
            return self.with_errors(state, options) if options.error else state

    def refined(self, state: State) -> State | None:
        """The same state on elements half as long, begun at it; None where it is none or the model does not go on."""
        if not state.is_equilibrium or state.scene is None:
            return None
        found, seconds = clocked(lambda: self.finer(state.native), 0)
        if found is None:
            return None
        return replace(self.state(state.scene, found), seconds=seconds, start=state.start, scene=state.scene)

    def with_errors(self, state: State, options: Options) -> State:
        """The state with the errors of its shape and of its forces, moments and energies, from finer elements."""
        from compare.measure.error import error_of_first
        from compare.measure.numbers import errors_of, numbers_of

        assert state.scene is not None
        chain = [state]
        while len(chain) <= len(self.halvings):
            finer = self.refined(chain[-1])
            if finer is None or not finer.is_equilibrium:
                break
            chain.append(finer)
        return replace(
            state,
            error=self.error(state.scene, chain, options),
            errors=errors_of([numbers_of(one) for one in chain], error_of_first, state.residual or 0.0),
            error_why=("" if len(chain) == 1 else self.halvings[len(chain) - 2]) or self.not_found,
        )

    def effects(self, scene: Scene) -> tuple[Effect, ...]:
        """The effects of the scene, with the keys that switch each off alone."""
        return tuple(one.of(scene) if isinstance(one, Switch) else one for one in self.switches(scene))


def another_model(model: Model, scene: Scene) -> BadInput | None:
    """Why a scene whose `model.energy` is another model's is not for this one; None: it is its own."""
    if scene.model.energy == model.name:
        return None
    return BadInput(
        "model.energy", scene.model.energy, f'is not "{model.name}"', f'choose model.energy = "{model.name}"'
    )
