"""What a model may do beyond answering a scene, declared: a study asks with `isinstance`, and can go without.

Every capability is a Protocol of its own with what it gives: a reference (`Refers`), an estimate of what a shell would
do (`Estimates`), the size of what is evaluated (`Evaluates`), derivatives by the scene's keys (`Differentiates`), what
to do about a state that is none (`Advises`), where it rests from another model's shape (`Rests`), a state that goes
along while its scene changes (`Follows`), branches of equilibria (`Branches`), several scenes at once (`Batches`).
Units: as `compare.models.base`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from compare.models.base import Model

if TYPE_CHECKING:
    from compare.continuation.point import Point
    from compare.continuation.system import System
    from compare.models.base import Effect, Options, Shape, Size, State
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Reference:
    """The finest state that a model has of a scene: what it is, its own error (Hausdorff over l) by the comparison that
    `checked` names; None where that did not converge. against: the state it was compared with, where that was solved
    from its start as any size is, so that its time is one of that size."""

    state: State
    what: str
    error: float | None
    checked: str
    against: State | None = None


@dataclass(frozen=True)
class Evaluation:
    """What a model evaluates again and again while it solves a scene: its formulation, why that one, unknowns that
    nothing fixes, how many of them have bounds, constraints, what one evaluation is `of`, and its seconds (s)."""

    formulation: str
    why: str
    unknowns: int
    bounds: int
    constraints: int
    of: str
    seconds: float


@dataclass(frozen=True)
class Priced:
    """What switching one effect of a state on or off changes, to first order.

    moves: largest distance that a particle moves (l), None: not known; moves_error: how far first order may be off
    (l), None: not known; doubtful: the step that would follow is no shorter than half of this one, so that first order
    says nothing of the move; energy: what the effect holds or releases in this state, and of a load the work
    that it does, over the elastic energy; force: change of the force of what holds the strip (D w / l^2), and
    force_share: over that force; why: what was switched, or why a number is not known; pair: keys of the scene without
    and with the effect, whose solves tell what it costs, None: it is in none.
    """

    effect: str
    on: bool
    moves: float | None
    moves_error: float | None = None
    energy: float | None = None
    force: float | None = None
    force_share: float | None = None
    why: str = ""
    pair: tuple[Mapping[str, Any], Mapping[str, Any]] | None = None
    doubtful: bool = False


@runtime_checkable
class Prices(Protocol):
    """A model that can say what every effect, on or off, changes of its state, without solving the scene again."""

    def prices(self, scene: Scene, state: State) -> tuple[Priced, ...]:
        """Each effect once. Raises `NotDifferentiable` for a state that has no tangent."""


@dataclass(frozen=True)
class Rival:
    """A stable state of lower energy than the one that a model returns, in the same energy.

    model: the energy in which both were found; energy, own: of the rival and of the returned state (total, D w / l,
    without the constant of the natural curvature); distance: between the two (Hausdorff / l).
    """

    model: str
    energy: float
    own: float
    distance: float

    def to_dict(self) -> dict[str, Any]:
        """As in result.json."""
        return {"model": self.model, "energy": self.energy, "own": self.own, "distance": self.distance}

    @property
    def text(self) -> str:
        """What was seen, in a sentence without its full stop."""
        return (
            f"another stable state of lower energy was seen ({self.energy:.6g} against {self.own:.6g} D w / l by "
            f'"{self.model}", {100 * self.distance:.2g} % of l away): in which of them a shell rests is not known'
        )


@dataclass(frozen=True)
class Sides:
    """Two stable states of the strip of finite thickness, one on either side of the model's own: in which of them a
    shell rests is not known.

    energies: of both (total, D w / l); distances: estimated between the model and a shell in either (Hausdorff / l,
    None where it is not known); first that of which everything else is told, the worse one.
    """

    energies: tuple[float, float]
    distances: tuple[float | None, float | None]

    def to_dict(self) -> dict[str, Any]:
        """As in result.json."""
        return {"energies": list(self.energies), "distances": list(self.distances)}


@dataclass(frozen=True)
class Estimate:
    """What a model says about the shell of this w/h without solving one.

    parts: share of the elastic energy that would be stretching and shear, by cause ("edges", "shear", "in_plane",
    "tension", "clamps"); distance: Hausdorff / l between the model and the shell, None where the strip of finite
    thickness was not found; rival: a lower state that was seen beside its own, with which nothing here is sure, None
    where none was seen or looked for (`compare.models.ribbon.rivals`); own: the part of that share which the model has
    in its own energy; passages: by how much more of the elastic energy it may stretch where its curvature passes zero
    (`compare.models.ribbon.neglected.passages`); crowded: the same beside its clamps, where its rulings all but
    meet (`compare.models.ribbon.neglected.crowded_energy`); sides: where the thin strip has a state on either side of
    its own (`compare.models.ribbon.rivals.either_side`), None where one was seen or none looked for; scale: z of the
    strip's edges at the mean curvature (below about 2 the layers of both edges meet); seconds: for the estimate, its
    own solve not included; why: why nothing can be said, "" where it can; there are then no parts; bends: whether the
    strip does, so that there is an elastic energy to have a share of: the shares of one that hangs straight down, and
    is stretched by its weight alone, are of the weight's energy.
    """

    width_to_thickness: float
    parts: Mapping[str, float]
    distance: float | None
    scale: float
    seconds: float
    rival: Rival | None
    own: float = 0.0
    why: str = ""
    bends: bool = True
    passages: float = 0.0
    crowded: float = 0.0
    sides: Sides | None = None

    @property
    def more(self) -> float:
        """By how much the share may be too small in all."""
        return self.passages + self.crowded

    @property
    def worst(self) -> float:
        """The larger of distance and share that is missing, with what it may be more; infinite where the first is not
        known. Both have the same bounds for a grade."""
        return math.inf if self.distance is None else max(self.distance, self.missing + self.more)

    @property
    def missing(self) -> float:
        """Estimated share of the membrane and shear energy that the model leaves out."""
        return self.share - self.own

    @property
    def share(self) -> float:
        """Estimated share of membrane and shear energy in the elastic energy."""
        return float(sum(self.parts.values()))

    @property
    def cause(self) -> str:
        """The part that is largest; "" without any."""
        return max(self.parts, key=lambda name: self.parts[name], default="")


@runtime_checkable
class Refers(Protocol):
    """A model with a reference of its own; of any other `compare.models.reference.usual` is taken."""

    def reference(
        self,
        scene: Scene,
        sizes: Sequence[Size],
        *,
        near: Shape | None = None,
        options: Options | None = None,
        say: Reporter | None = None,
    ) -> Reference:
        """A state as fine as the finest of `sizes` or finer, and its own error, on `options.grid`."""


@runtime_checkable
class Estimates(Protocol):
    """A model that can say how far a shell would be from its state, without solving one."""

    def estimate(self, scene: Scene, state: State, width_to_thickness: float, say: Reporter | None = None) -> Estimate:
        """The distance to a shell of this w/h, and the share of its energy that stretches it."""


@dataclass(frozen=True)
class Choice:
    """What a model has chosen for a scene: the scene with that energy; effects: what the energy leaves out; solve: the
    scene's state as by `Model.solve`, from what the choice has solved on its way where that took long."""

    scene: Scene
    effects: tuple[Effect, ...]
    solve: Callable[[Options, Reporter | None], State]


@runtime_checkable
class Chooses(Protocol):
    """A model that chooses among its energies where a scene names none."""

    def choice(self, scene: Scene, say: Reporter | None = None) -> Choice:
        """The choice for a scene with `model.accuracy`, made once. Raises `BadInput` like `Model.solve`."""

    def settled(self, scene: Scene) -> Scene:
        """The scene with the energy that would be chosen for it, so that its neighbours are solved with the same one.
        Raises `BadInput` like `Model.solve`."""


@runtime_checkable
class Surrounds(Protocol):
    """A model that can draw what its strip cannot cross."""

    def barriers(self, scene: Scene, state: State, points: FloatArray) -> list[FloatArray]:
        """Walls and obstacles in the scene's order as they stand at the state, each a grid (k, m, 3) in l around the
        strip's points (n, 3)."""


class Moves(Protocol):
    """How points of a state's centreline move when keys of its scene change, key by key."""

    def position(self, s: FloatArray) -> dict[str, FloatArray]:
        """Derivatives (k, 3) of the positions (l) at abscissae s (k,)."""

    def rotation(self, s: FloatArray) -> dict[str, FloatArray]:
        """Derivatives (k, 3) of the frames, as rotation vectors (rad)."""


class NotDifferentiable(Exception):
    """A state that has no derivatives by its scene's keys, and why."""


@runtime_checkable
class Differentiates(Protocol):
    """A model that knows how its state changes with keys of the scene.

    by_keys: the keys by which it does.
    """

    by_keys: tuple[str, ...]

    def derivatives(
        self, scene: Scene, state: State, keys: Sequence[str], of: Callable[[Moves], dict[str, FloatArray]]
    ) -> dict[str, FloatArray]:
        """d(output) / d(key) by key, in the output's unit per unit of the key in the scene.

        of: which output of a state of the scene, e.g. ``lambda moves: moves.position(s)``. Raises `BadInput` for a key
        by which there is no derivative or that the scene does not give, `NotDifferentiable` where the state has none.
        """

    def solved_near(self, scene: Scene, near: State | None) -> State:
        """The state of a scene from a neighbouring one's. Raises `BadInput` like `Model.solve`."""


class Fittable(Model, Differentiates, Protocol):
    """A model that solves a scene and knows how its state changes with it."""


@runtime_checkable
class Advises(Protocol):
    """A model that says what the user of a scene can do about a state that is no stable equilibrium.

    remedies: the solver's own word for the end -> what follows its message, in keys of scenes and flags of commands.
    """

    remedies: Mapping[str, str]


@runtime_checkable
class Evaluates(Protocol):
    """A model that can say what it evaluates, without solving the scene; a model need not."""

    def evaluation(self, scene: Scene) -> Evaluation:
        """The scene's problem as the model sees it. Raises `BadInput` like `Model.solve`."""


@runtime_checkable
class Rests(Protocol):
    """A model that can say where it comes to rest from another model's shape; a model need not."""

    def rests(self, scene: Scene, state: State, near: Shape, finer: int = 1) -> State | None:
        """The state of the scene, on the elements of `state` cut into `finer` parts each, that is reached from `near`,
        whether or not it is `state` again; None where none is found."""


@dataclass(frozen=True)
class Followed:
    """A state that went along from one scene to another.

    state: where it arrived, or the last equilibrium on the way there; scene: the one that it is the state of; reached:
    how much of the way is behind it, 0 to 1; jumps: where on the way (0 to 1) it jumped to another shape; text: why
    it stopped, "" where it arrived.
    """

    state: State
    scene: Scene
    reached: float
    jumps: tuple[float, ...]
    text: str = ""


@runtime_checkable
class Follows(Protocol):
    """A model whose state goes along, warm, while numbers of its scene change: for a hand that moves them."""

    def followed(self, first: Scene, last: Scene, near: State) -> Followed:
        """From `near`, the state of `first`, to that of `last`, two scenes that hold the same things. Raises `BadInput`
        like `Model.solve`, and where the way is not to be had (half a turn)."""

    def judged(self, scene: Scene, state: State) -> State:
        """The state with all that `Model.solve` finds out of it with `Options.error`, as it would."""

    def seeded(self, scene: Scene, state: State) -> Scene:
        """The scene with a seed from which `Model.solve` begins at the state's own shape."""


@dataclass(frozen=True)
class Freed:
    """A point where what moves nothing (a ruling where the strip is straight) may be chosen, and decides whether the
    shape is stable. stable: for every choice, as far as was looked for, None: not known; beside: systems and z of
    states that the strip falls to by the worst choice."""

    stable: bool | None
    beside: Callable[[], Iterator[tuple[System, FloatArray]]]


@dataclass(frozen=True)
class BranchStart:
    """Where a branch of a model begins: its system and z at the state that its solve gives (`compare.continuation`),
    the shape at a point of it, and where others may be near: others(n) gives n committed random starts and those that
    follow from its own shape, each with what it is, its system and z, relaxed where the model can relax it; freed: what
    is free at a point whose count of unstable modes is therefore not all, None: nothing is; force: on the strip (3,),
    D w / l^2, of what holds s = l at a point of this shape, None: nothing does, or the model does not say; costly:
    elements half as long cost so much that regular points have no errors of theirs unless asked for; planar: whether
    the unknowns keep the shape in a plane; aside: then the lowest eigenvalues (k,) of the second variation aside of it
    at a point, ascending, k above the number of unstable ones: None: no model of what is aside; downhill: systems and
    z of where the model's minimiser goes from a point moved by dz (n,), None: it has none for that.
    """

    state: State
    system: System
    z: FloatArray
    shape: Callable[[Point], Shape]
    others: Callable[[int], Iterator[tuple[str, System, FloatArray]]]
    freed: Callable[[Point], Freed | None] = lambda point: None
    force: Callable[[Point, Shape], FloatArray | None] = lambda point, shape: None
    costly: bool = False
    planar: bool = False
    aside: Callable[[Point], FloatArray] | None = None
    downhill: Callable[[Point, FloatArray], tuple[System, FloatArray] | None] | None = None


@runtime_checkable
class Branches(Protocol):
    """A model of which branches of equilibria can be followed while a scene changes; a model need not."""

    def branch_start(
        self, scene_at: Callable[[float], Scene], say: Reporter | None = None, *, moving: bool = False
    ) -> BranchStart:
        """Its equilibrium at t = 0 as a system over t; scene_at: t in [0, 1] -> scene; moving: on elements that follow
        what is sudden in its shapes, where it has such. Raises `BadInput` like `Model.solve`, and for a start that is
        no equilibrium."""


@runtime_checkable
class Batches(Protocol):
    """A model that can solve several scenes at once; a model need not."""

    def together(self, scene: Scene) -> Hashable | None:
        """What scenes have in common that `solve_together` takes at once; None: this scene goes alone."""

    def solve_together(self, scenes: Sequence[Scene]) -> list[State]:
        """States of scenes with the same `together`, each as `Model.solve` finds it, to the last digit. Whatever it
        raises of one of them, it raises for all."""


@dataclass(frozen=True)
class Line:
    """States of neighbouring scenes. alone: of those that were solved alone, by their place; numbers: the others', of
    every place by the names of a sweep's columns, NaN where they are not known."""

    alone: Mapping[int, State]
    numbers: Mapping[str, FloatArray]


@runtime_checkable
class Lines(Protocol):
    """A model that can begin scenes at the states of their neighbours; a model need not."""

    def solve_line(
        self, gamma: FloatArray, curvature: FloatArray, solved: Callable[[Sequence[int]], Sequence[State]]
    ) -> Line | None:
        """States of scenes that differ in Gamma (k,) and natural curvature K l (k,) alone, by little from one to the
        next; solved: the states of some (places) alone. Each is what it is alone, to the tolerance of the solver, as
        far as the solver can tell. None: there is no such way for them."""
