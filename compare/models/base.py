"""What a model is: one vocabulary for all that solve a scene, whatever they solve it with.

A study asks `compare.registry` for models and gets `State`s; it names no model and imports no solver. Lengths are in
units of l, energies in D w / l, forces in D w / l^2, moments in D w / l, curvatures in 1/l, times in s.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from compare.measure.align import Motions
from compare.measure.crossing import Crossing, crossing
from compare.measure.grid import Grid
from compare.models.shown import Shown
from compare.scene.inputs.law import Law, constant
from compare.scene.units import Units
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from compare.store.states import States
    from compare.store.store import CaseStore

FloatArray = NDArray[np.float64]
_NONE: Mapping[str, Any] = MappingProxyType({})

#: `State.start` begins with this word where the solve began at the shape that it was given as `near`.
BESIDE = "ribbon"

#: Last word of a ladder all of whose sizes begin at the shape given as `near`, even where that selects no state.
NEAR = "near"


class Status(Enum):
    """How a solve ended, in the words that all models share; `State.word` is the solver's own, more precise one."""

    CONVERGED = "converged"
    UNSTABLE = "unstable"
    NOT_CONVERGED = "not_converged"
    LIMIT_POINT = "limit_point"
    INFEASIBLE = "infeasible"
    RULINGS_CROSS = "rulings_cross"
    UNSUPPORTED = "unsupported"
    FAILED = "failed"
    CRASHED = "crashed"

    @property
    def code(self) -> str:
        """The word for files."""
        return self.value

    @property
    def ok(self) -> bool:
        """A converged equilibrium that is not known to be unstable."""
        return self is Status.CONVERGED


@dataclass(frozen=True)
class Energy:
    """Energy of a state, D w / l, in one convention: `elastic` without `constant`, the part 1/2 int K^2 ds that the
    natural curvature alone makes; `gravity` and `tip` against the origin of the scene (not the clamp); `plates` of the
    springs of pressure plates; `parts`: what else the model tells apart (bending, membrane, shear, natural)."""

    elastic: float | None
    gravity: float = 0.0
    tip: float | None = None
    constant: float = 0.0
    plates: float | None = None
    parts: Mapping[str, float] = field(default_factory=dict)

    @property
    def total(self) -> float | None:
        """All of it, without `constant`; None where the elastic energy is not known."""
        if self.elastic is None:
            return None
        return self.elastic + self.gravity + (self.tip or 0.0) + (self.plates or 0.0)

    def to_dict(self) -> dict[str, float | None]:
        """The keys of result.json's ``energy``: parts, elastic, gravity, tip and plates where there are any, total."""
        loads = {"tip": self.tip, "plates": self.plates}
        present = {name: value for name, value in loads.items() if value is not None}
        return {**self.parts, "elastic": self.elastic, "gravity": self.gravity, **present, "total": self.total}


def natural_constant(law: Law) -> float:
    """1/2 int K^2 ds in D w / l, which `Energy.elastic` leaves out; law: K l (`compare.scene.inputs.law`)."""
    return constant(law)


@dataclass(frozen=True)
class Pose:
    """Position (3,) and frame (3, 3), columns t_x t_y t_z, of a point of the centreline."""

    position: FloatArray
    frame: FloatArray


@dataclass(frozen=True)
class Force:
    """Force (3,) and moment (3,) that a support exerts on the strip."""

    force: FloatArray
    moment: FloatArray


@dataclass(frozen=True)
class Supports:
    """What holds the strip exerts on it: at both ends (None: nothing held, or the model does not say), and every
    wall's entry of result.json. itself (3,): the sum of the forces of its parts at larger s on those at smaller s;
    None: they are not kept apart."""

    start: Force | None = None
    end: Force | None = None
    walls: tuple[Mapping[str, Any], ...] = ()
    itself: FloatArray | None = None


def between_parts(pairs: Iterable[tuple[float, float, Any]]) -> FloatArray:
    """`Supports.itself` of pairs of places: s, s_other and the force (3,) on the first."""
    total = np.zeros(3)
    for s, other, force in pairs:
        total += np.sign(other - s) * np.asarray(force, dtype=float)
    return total


@dataclass(frozen=True)
class Seconds:
    """first: the first solve in this process, with all that it has to load; repeats: of the same solve again (s).

    process: of a model that solves in a process of its own the wall time of that process, from its start to its end;
    `first` is then the solve alone. None: solved in this process, or found among finished cases.
    """

    first: float
    repeats: tuple[float, ...] = ()
    process: float | None = None

    @property
    def warm(self) -> float:
        """Median of the repeats; `first` where there are none."""
        return float(np.median(self.repeats)) if self.repeats else self.first


class Shape(Protocol):
    """The deformed strip of any model; the section is the model's own, straight rulings are not assumed. Abscissae s
    and v in l; `BadInput` for an s that is not on the strip (`on_strip`)."""

    @property
    def bend(self) -> float:
        """Largest normal curvature along the strip (1/l), for which a grid has to be fine enough."""

    def points(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """Positions (k, m, 3) of the particles s (k,) x v (m,)."""

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3) at abscissae s (k,)."""

    def frames(self, s: FloatArray) -> FloatArray:
        """Frames (k, 3, 3) at abscissae s (k,), columns across, normal, along."""

    def pose(self, s: float) -> Pose:
        """Position and frame of the centreline at one abscissa; a shape that names this class its base may go without
        a way of its own."""
        return pose_of(self, s)

    def fields(self, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
        """Name -> numbers (k, m) or vectors (k, m, 3) at the particles; "normal" (unit vectors) among them, and
        "energy_density" (D / l^2, without the constant of the natural curvature) where the model knows it."""


def on_strip(s: ArrayLike) -> FloatArray:
    """Abscissae as numbers in [0, 1]; `BadInput` for one beyond the ends (by more than rounding, 1e-9)."""
    at = np.asarray(s, dtype=float)
    outside = ~((at >= -1e-9) & (at <= 1.0 + 1e-9))
    if outside.any():
        raise BadInput("s", float(at[outside].flat[0]), "is not on the strip", "abscissae lie in [0, 1], in units of l")
    return np.clip(at, 0.0, 1.0)


def pose_of(shape: Shape, s: float) -> Pose:
    """Position and frame of a shape's centreline at one abscissa."""
    at = np.array([s])
    return Pose(shape.centreline(at)[0], shape.frames(at)[0])


@dataclass(frozen=True)
class Size:
    """How fine a model is: `ladder`, the name under which the model varies it ("mixed", "elastica 2", "shell"), and
    `values`, one or two numbers (segments; a tolerance; elements along and across); degree of the elements, if any;
    words: how a state's size is shown where the values do not say what came of them."""

    ladder: str
    values: tuple[float, ...]
    degree: int | None = None
    words: str = field(default="", compare=False)

    @property
    def label(self) -> str:
        """E.g. "40", "100 x 8", "92 (for 1e-03)"."""
        return self.words or " x ".join(f"{value:g}" for value in self.values)


@dataclass(frozen=True)
class Ladder:
    """Sizes of one model that `cost` and `converge` climb, small ones first; why: the reason where the scene allows
    none of them (`sizes` is then empty)."""

    name: str
    sizes: tuple[Size, ...] = ()
    why: str | None = None


@dataclass(frozen=True)
class Variant:
    """One of the solves that a scene asks a model for: the keys that tell it from the others, and its own scene."""

    keys: Mapping[str, float]
    scene: Scene


@dataclass(frozen=True)
class Options:
    """How a solve is done, whatever the model.

    leave_saddle: follow the unstable direction of a saddle; None: as the model does of itself (a ribbon without a
    [[path]] leaves one, everything else stays). error: estimate the discretisation error, on `grid` (None:
    one that fits the shape). repeats: timed solves beside the first; None: as many as a short budget allows. store:
    where finished cases and interrupted ways are kept and found. fallback: where the scene's own path cannot be gone,
    the state itself is looked for. selects: a shape `near` says which of several states is asked for; otherwise it is a
    mere beginning, and the state is the one that the model finds on its own. yes: also what takes hours or more memory
    than is usual (`compare.models.effects.price`).
    """

    leave_saddle: bool | None = None
    error: bool = False
    repeats: int | None = 0
    store: CaseStore | None = None
    fallback: bool = False
    grid: Grid | None = None
    selects: bool = True
    yes: bool = False


@dataclass(frozen=True)
class Refinement:
    """What a state is on other elements: how many, the solver's own word for its status there, its lowest eigenvalue,
    and how far (Hausdorff over l) its shape is from that on the elements before; None where it is not known."""

    elements: int
    status: str
    lowest_eigenvalue: float | None
    distance: float | None


@dataclass(frozen=True)
class Rivals:
    """Other states that were looked for beside one: solves that looked for them, and by how much (D w / l) the lowest
    that they found lies below; 0: none does. text: that in words, without a full stop; seen: the solver's own state
    that a probe was asked of, and what it said (`compare.models.ribbon.rivals.probe`), None: it was not."""

    tries: int
    below: float
    text: str
    seen: Any = field(default=None, repr=False, compare=False)


@dataclass(frozen=True, repr=False)
class State(Shown):
    """A model's answer to a scene.

    word: the solver's own word for `status`; stable None: not judged; residual: relative, as the solver measures it;
    error: of the discretisation (Hausdorff over l), share_error: of the stretching's share; errors: of what is told of
    the state, each by its own change between meshes, nested as ``forces``, ``moments`` and ``energy`` of result.json
    and in their units, others by name (`compare.measure.numbers`), None where it is not known (`error_why`); numbers:
    what only some models have, by the name under which a table shows it; motions: rigid motions that nothing resists;
    log: the steps of a way, states: some along it; refinements: the state on all elements that were tried, coarse ones
    first (`status` and `stable` are those of the finest that tells); error_why: why `error` is not known, or how it was
    found; why: the reason of the chosen formulation; native: the solver's own result, for code about one model; units,
    width: of the scene (w / l), where `compare.models.solve` has solved it; whys: why a number of an equilibrium is not
    known, by its key in result.json ("forces", "moments", "lowest_eigenvalue"), where there it stands as KEY_why;
    branch: of a ribbon between two clamps with a given seed (`ribbon.result.Branch`), "own": on the seed's side,
    "slid": on the other, the energy falls all the way there, "left": on the other, whether the seed's side has a state
    is open, None: no seed, or it means no side; rivals: other states that were looked for, None: none were; quadrature:
    by how much of itself the elastic energy differs from its adaptive integral, None: the rule is exact; nonconvex:
    share of the length on which the energy is not convex in curvature and twist, so that elements alone hold the state
    there, None: it always is; left_saddle:
    the saddle that was left for it, `above` (its energy over the state's, D w / l) and `mirrored` (whether the other
    way leads to a state of the same energy; None: to none); None: none was; scene: what it answers, where its model
    goes on from there alone (`compare.models.line`); remedy: what is said behind its message, None: what its model says
    of its word (`compare.page.remedies`); kept: unstable, and all the same what the scene asks for
    (`compare.models.half_turns`).
    """

    model: str
    size: Size
    status: Status
    word: str
    stable: bool | None
    message: str
    energy: Energy | None
    shape: Shape | None
    residual: float | None = None
    iterations: int | None = None
    lowest_eigenvalue: float | None = None
    supports: Supports = field(default_factory=Supports)
    error: float | None = None
    errors: Mapping[str, Any] = field(default_factory=dict)
    seconds: Seconds = field(default_factory=lambda: Seconds(float("nan")))
    unknowns: int = field(kw_only=True)
    numbers: Mapping[str, Any] = field(default_factory=dict)
    motions: Motions | None = None
    log: tuple[Mapping[str, Any], ...] = ()
    refinements: tuple[Refinement, ...] = ()
    error_why: str = ""
    states: States | None = None
    start: str = ""
    reused: bool = False
    native: Any = field(default=None, repr=False)
    units: Units = field(default_factory=Units)
    width: float = 0.0
    whys: Mapping[str, str] = field(default_factory=dict)
    branch: str | None = None
    rivals: Rivals | None = None
    quadrature: float | None = None
    nonconvex: float | None = None
    left_saddle: Mapping[str, Any] | None = None
    scene: Scene | None = field(default=None, repr=False)
    remedy: str | None = None
    kept: bool = False

    @property
    def stands(self) -> bool:
        """What is compared with other states: a stable equilibrium, or an unstable one that is kept as what was asked
        for."""
        return self.ok or (self.kept and self.is_equilibrium)

    @property
    def ok(self) -> bool:
        """Converged, and not known to be unstable."""
        return self.status.ok and self.stable is not False

    @property
    def is_equilibrium(self) -> bool:
        """The forces balance, stable or not: its positions mean something."""
        return self.status in (Status.CONVERGED, Status.UNSTABLE)

    @cached_property
    def end(self) -> Pose | None:
        """The end of the centreline, s = 1; None without a shape."""
        return self._pose(1.0)

    @cached_property
    def middle(self) -> Pose | None:
        """The middle of the centreline, s = 1/2."""
        return self._pose(0.5)

    def crossing(self, width: float) -> Crossing | None:
        """Where its surface, of this w / l, passes through itself; None without a shape, or without a finite one."""
        if self.shape is None:
            return None
        if width not in self._crossings:
            self._crossings[width] = crossing(self.shape, width)
        return self._crossings[width]

    @cached_property
    def _crossings(self) -> dict[float, Crossing | None]:
        return {}

    def _pose(self, s: float) -> Pose | None:
        return None if self.shape is None else self.shape.pose(s)


@dataclass(frozen=True)
class Effect:
    """An effect of a scene: key, its name; words, what it adds; on or off, and why.

    changes: the keys that switch it off alone; None: nothing does, `fixed` says why. same_size: without it the scene is
    solved at the size of its own state, which the effect has chosen. unknowns (those that nothing fixes), constraints,
    seconds (s) of one evaluation: how many more there are with it; None: off, or the model has no such thing.
    """

    key: str
    words: str
    on: bool
    why: str = ""
    changes: Mapping[str, Any] | None = None
    same_size: bool = False
    fixed: str = ""
    unknowns: int | None = None
    constraints: int | None = None
    seconds: float | None = None


class Model(Protocol):
    """A model of a strip: what it reads of a scene, and how it answers.

    reads: the scene keys that it honours; without_effect: keys that it may be given and that change nothing, each with
    the reason (`compare.models.keys` has sets of both). A key that is set and in neither is refused by name
    (`check_keys`).
    What its numbers depend on is not declared: all that its module imports (`compare.registry.home`).
    presenter: where its `compare.pages.presenter.Presenter` stands, as ``module:NAME``; None: what every state has.
    no_branches: why branches of its equilibria are not followed, of a model that is no `capabilities.Branches`.
    """

    name: str
    reads: frozenset[str]
    without_effect: Mapping[str, str]
    presenter: str | None = None
    no_branches: str = "it gives no tangent with its inertia and null vectors at a point that it is handed"

    def refusal(self, scene: Scene) -> BadInput | None:
        """Why this scene is not for this model, beyond its keys; None: it is."""
        return None

    def variants(self, scene: Scene) -> tuple[Variant, ...]:
        """The solves that the scene asks for; here: one."""
        return (Variant({}, scene),)

    def ladders(self, scene: Scene) -> tuple[Ladder, ...]:
        """What `cost` varies, with its usual sizes."""

    def solve(
        self,
        scene: Scene,
        size: Size | None = None,
        *,
        near: Shape | None = None,
        options: Options | None = None,
        say: Reporter | None = None,
    ) -> State:
        """Seed, path, tolerance and all: the state that the scene asks for.

        near: the shape of another model's state, on whose branch the answer is to be. Raises `BadInput` for a scene
        that cannot be, `Missing` for a library that is not there; every other end is a status.
        """

    def refined(self, state: State) -> State | None:
        """The same state on elements half as long, begun at it; None where the model does not go on."""

    def effects(self, scene: Scene) -> tuple[Effect, ...]:
        """The effects that the scene switches on or leaves out."""


def check_keys(model: Model, scene: Scene) -> None:
    """`BadInput` for the first key that the scene sets and the model does not read, and for what it refuses beyond.

    Raises ValueError for a model that names keys by a pattern ("clamp.*"), which would swallow a key that is new.
    """
    patterns = sorted(key for key in (*model.reads, *model.without_effect) if "*" in key)
    if patterns:
        raise ValueError(f"the model {model.name} names {patterns[0]}: name keys, or sets of compare.models.keys")
    refused = model.refusal(scene)
    if refused is not None:
        raise refused
    for key in sorted(scene.given()):
        if key not in model.reads and key not in model.without_effect:
            raise BadInput(
                key, None, f"is set, and the model {model.name} does not read it",
                "leave it out, or choose another model",
            )  # fmt: skip
