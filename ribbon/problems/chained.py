"""Chained problem: the clamped-free ribbon in 2 p + 2 unknowns (thesis, chapter 3)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon import law
from ribbon.boundary import Clamp
from ribbon.contact import Barrier
from ribbon.element.series import EXPONENT_LIMIT, FURTHEST
from ribbon.energies import chosen
from ribbon.errors import RibbonInputError
from ribbon.forces import Force, WallForce
from ribbon.loads import Gravity
from ribbon.problems import chained_kernels as kernels
from ribbon.problems.arguments import Loads, Material
from ribbon.problems.fields import Fields
from ribbon.problems.layout import ChainedLayout
from ribbon.problems.protocol import Anchor
from ribbon.problems.protocol import Counters as Counters
from ribbon.problems.touching import Touch
from ribbon.strip import Strip
from ribbonbench.statics import cross

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def segment_lengths(segments: int | ArrayLike) -> FloatArray:
    """Lengths (p,) of the segments as fractions of l: `segments` equal ones, or the lengths themselves (any, sum 1).

    Raises `RibbonInputError` for no segments, lengths that are not positive, or a sum that is not 1 to 1e-9.
    """
    if isinstance(segments, (int, np.integer)) and not isinstance(segments, bool):
        if segments < 1:
            raise RibbonInputError("segments", segments, "at least one segment is needed")
        return np.full(int(segments), 1.0 / int(segments))
    lengths = np.asarray(segments, dtype=float)
    if lengths.ndim != 1 or lengths.size == 0 or not np.all(np.isfinite(lengths)) or np.any(lengths <= 0):
        raise RibbonInputError("segments", segments, "a number of segments, or their positive lengths in units of l")
    total = float(lengths.sum())
    if abs(total - 1.0) > 1e-9:
        raise RibbonInputError("segments", segments, f"the lengths add up to {total:.12g}, not to 1 (units of l)")
    return lengths / total


def too_far(q: FloatArray, lengths: FloatArray, free: bool = False) -> bool:
    """Whether a strip with parameters q (p, 4 or 6) turns by more than `FURTHEST`, or is not finite: its series would
    take too long; free: its twist is, and q has no ruling."""
    bend = np.abs(q[:, 1]) + np.abs(q[:, 0]) * lengths
    if free:
        whole = np.abs(q[:, 1::2]).sum(axis=1) + np.abs(q[:, 0::2]).sum(axis=1) * lengths
        return not bool((whole * lengths).sum() <= FURTHEST)
    slant = 1.0 + np.abs(q[:, 3]) + np.abs(q[:, 2]) * lengths
    return not bool((bend * slant * lengths).sum() <= FURTHEST)


@dataclass(frozen=True)
class ChainedProblem:
    """Energy of the chained ribbon with gradient and Hessian, as a bounded minimisation problem.

    Unknowns x (2 p + 2,): ``b_1, m_1, a_1, n_1, ... a_p, n_p`` (order and formulas: `ribbon.problems.chained_kernels`),
    bounds ``|n_i| <= 2 l / w``: rulings do not cross inside the strip (thesis, eq. 2.7, 3.5; docs/theory.md, eq.
    (1.5)); their energy: docs/theory.md, eq. (2.11); a straight clamp fixes m_1 = 0, `planar` every ruling. Where the
    energy's twist is free it stands in the place of eta, without bounds (docs/theory.md, chapter 10), and an in-plane
    curvature behind it where there is one. stiffness, in_plane: `ribbon.problems.fields.Fields`. tip: dead force (3,)
    at s = l, D w / l^2, or None.
    """

    strip: Strip
    clamp: Clamp
    gravity: Gravity | None
    energy: str
    lengths: FloatArray
    exponent_limit: float = EXPONENT_LIMIT
    planar: bool = False
    stiffness: str | None = None
    in_plane: bool | None = None
    tip: tuple[float, float, float] | None = None
    counters: Counters = field(default_factory=Counters, compare=False)
    _cache: dict[str, object] = field(default_factory=dict, repr=False, compare=False)

    formulation = "chained"

    def __post_init__(self) -> None:
        chosen(self.energy, self.strip)

    @cached_property
    def fields(self) -> Fields:
        """What bends the strip, and the energy's arguments for the kernels."""
        return Fields.of(self.strip, self.energy, self.stiffness, self.in_plane)

    @cached_property
    def material(self) -> Material:
        """What the elastic energy depends on, for the kernels."""
        return Material.of(self.strip, self.fields, self.lengths)

    @cached_property
    def loads(self) -> Loads:
        """What loads the ribbon, for the kernels."""
        gravity = self.gravity if self.has_gravity else None
        return Loads(
            gamma=0.0 if gravity is None else float(self.strip.gamma),
            up=np.zeros(3) if gravity is None else np.asarray(gravity.up, dtype=float),
            force=np.asarray(self.tip or (0.0, 0.0, 0.0)),
            pulled=self.tip is not None,
            frame=self.clamp.frame,
            limit=self.exponent_limit,
        )

    @cached_property
    def size(self) -> int:
        """Number of unknowns, 2 p + 2, or 3 p + 3 with an in-plane curvature."""
        return self.layout.size

    @cached_property
    def layout(self) -> ChainedLayout:
        """Where the unknowns stand."""
        return ChainedLayout(self.lengths.size, self.fields.count)

    @property
    def start(self) -> Clamp:
        """The clamp, at s = 0."""
        return self.clamp

    @property
    def end(self) -> None:
        """Free."""
        return None

    @property
    def closure(self) -> None:
        """Open."""
        return None

    @property
    def walls(self) -> tuple[Barrier, ...]:
        """None."""
        return ()

    @property
    def touching(self) -> tuple[Touch, ...]:
        """None."""
        return ()

    @property
    def rows(self) -> None:
        """There are none."""

    @property
    def slack(self) -> None:
        """One point is held."""

    @property
    def row_count(self) -> int:
        """No rows of constraints."""
        return 0

    def block_slices(self) -> dict[str, slice]:
        """No rows."""
        return {}

    def free_motions(self) -> tuple[FloatArray, FloatArray]:
        """None: the clamp holds them all."""
        return np.empty((0, 3)), np.empty((0, 3))

    def with_changes(self, **changes: Any) -> Self:
        """The problem with fields replaced and nothing counted or cached."""
        return replace(self, counters=Counters(), _cache={}, **changes)

    def anchor(self, x: FloatArray) -> Anchor:
        """None: the start is no unknown."""
        return None

    def anchored(self, anchor: Anchor) -> Self:
        """The problem as it is: it refers to its clamp."""
        return self

    @property
    def has_gravity(self) -> bool:
        """Whether weight acts; otherwise no series is evaluated during a solve."""
        return self.gravity is not None and self.strip.gamma > 0

    @property
    def has_natural_curvature(self) -> bool:
        """Whether the strip is naturally curved; otherwise the term is absent."""
        return not self.strip.naturally_straight

    @property
    def half_width(self) -> float:
        """w / (2 l)."""
        return 0.5 * self.strip.relative_width

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds (2 p + 2,) of the unknowns."""
        lower, upper = self._bounds
        return lower.copy(), upper.copy()

    @cached_property
    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        upper = np.full(self.size, np.inf)
        layout = self.layout
        if not self.fields.free:
            upper[layout.eta_slope] = 1.0 / self.half_width
        lower = -upper
        if self.clamp.ruling == "straight" and self.fields.held_straight:
            lower[layout.eta] = upper[layout.eta] = 0.0
        if self.planar:
            for held in (layout.ruling, layout.sideways):
                lower[held] = upper[held] = 0.0
        return lower, upper

    def natural_state(self) -> FloatArray:
        """The stress-free shape omega = K(s), eta = 0 as unknowns (2 p + 2,)."""
        if law.is_table(self.strip.curvature):
            joints = np.concatenate([[0.0], np.cumsum(self.lengths)])
            return self.state(law.at(self.strip.curvature, joints), np.zeros(joints.size))
        return self.linear(self.strip.curvature, (0.0, 0.0))  # type: ignore[arg-type]

    def linear(self, curvature: tuple[float, float], ruling: tuple[float, float]) -> FloatArray:
        """Unknowns of omega and eta linear along the whole ribbon, from their values at both ends (omega in 1/l)."""
        x = np.zeros(self.size)
        layout = self.layout
        x[layout.omega], x[layout.eta] = curvature[0], ruling[0]
        x[layout.omega_slope] = curvature[1] - curvature[0]
        x[layout.eta_slope] = ruling[1] - ruling[0]
        return x

    def state(self, omega: FloatArray, eta: FloatArray, in_plane: FloatArray | None = None) -> FloatArray:
        """Unknowns of the shape with omega, eta and in-plane curvature (p + 1,; None: the natural one) at the joints,
        linear between them."""
        if in_plane is None:
            in_plane = law.at(self.strip.geodesic, np.concatenate([[0.0], np.cumsum(self.lengths)]))
        return self.layout.unknowns(omega, eta, self.lengths, in_plane)

    def joint_values(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """omega and eta (p + 1,) at the joints, of unknowns or of a mode."""
        return self.layout.values(x, self.lengths)

    def in_plane_values(self, x: FloatArray) -> FloatArray | None:
        """In-plane curvature (p + 1,) at the joints; None without."""
        if self.fields.count == 2:
            return None
        steps = x[self.layout.sideways].copy()
        steps[1:] *= self.lengths
        return np.cumsum(steps)

    @classmethod
    def twin(cls, problem: Any, lengths: FloatArray) -> ChainedProblem:
        """The chained problem of a glued one that is held at s = 0 only, on segments of `lengths`."""
        gravity = None if problem.gravity is None else Gravity(problem.gravity.up)
        return cls(
            problem.strip, problem.start, gravity, problem.energy, lengths, problem.exponent_limit,
            stiffness=problem.stiffness, in_plane=problem.in_plane, tip=problem.tip,
        )  # fmt: skip

    def parameters(self, x: FloatArray) -> FloatArray:
        """(a, b, n, m) of every segment, (p, 4), or with (c, d) of an in-plane curvature (p, 6)."""
        q = np.empty((self.lengths.size, 2 * self.fields.count))
        kernels.unpack(np.ascontiguousarray(x, dtype=float), self.lengths, q)
        return q

    def energy_parts(self, x: FloatArray) -> FloatArray:
        """Bending, natural-curvature and gravity energy (3,), D w / l; with an end force 0 and its own too (5,)."""
        parts = np.empty(3)
        self.counters.value += 1
        q = self.parameters(x)
        if too_far(q, self.lengths, self.fields.free):
            return np.full(3, np.nan)
        self.counters.series += self.lengths.size * self.has_gravity
        position = np.asarray(self.clamp.position) / self.strip.length
        kernels.energy_parts(q, self.lengths, self.material, self.loads, position, parts)
        if self.tip is None:
            return parts
        self.counters.series += self.lengths.size
        return np.append(parts, [0.0, -float(self.joints(x)[0][-1] @ np.asarray(self.tip))])

    def value(self, x: FloatArray) -> float:
        """Total energy, units D w / l."""
        return float(self.energy_parts(x).sum())

    @property
    def is_loaded(self) -> bool:
        """Whether weight or an end force acts: segments then know of each other."""
        return self.has_gravity or self.tip is not None

    def jets(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Jets (p, 15 or 28) of the segments' energies, loads among them, and the factors u, v (p, 4 or 6, 3) of the
        second derivatives by two segments (`ribbon.problems.chained_kernels`)."""
        key = np.ascontiguousarray(x, dtype=float).tobytes()
        if self._cache.get("key") != key:
            p = self.lengths.size
            q = self.parameters(x)
            fields = self.fields
            components, count = fields.components, 2 * fields.count
            local = np.empty((p, components))
            if too_far(q, self.lengths, fields.free):
                return np.full((p, components), np.nan), np.zeros((p, count, 3)), np.zeros((p, count, 3))
            kernels.local_derivatives(q, self.lengths, self.material, local)
            u = v = np.zeros((1, count, 3))
            if self.is_loaded:
                u, v = np.empty((p, count, 3)), np.empty((p, count, 3))
                kernels.load_derivatives(fields.free, q, self.lengths, self.loads, local, u, v)
                self.counters.series += p
            self._cache["key"], self._cache["jets"] = key, (local, u, v)
        return self._cache["jets"]  # type: ignore[return-value]

    def keep(self, x: FloatArray, jets: tuple[FloatArray, FloatArray, FloatArray]) -> None:
        """The jets of x (n,), which a minimiser has computed."""
        self._cache["key"], self._cache["jets"] = np.ascontiguousarray(x, dtype=float).tobytes(), jets

    def gradient(self, x: FloatArray) -> FloatArray:
        """Gradient (2 p + 2,) of the total energy."""
        self.counters.gradient += 1
        local, _, _ = self.jets(x)
        gradient = np.empty(self.size)
        kernels.assemble_gradient(self.lengths, local, gradient)
        return gradient

    def hessian(self, x: FloatArray) -> FloatArray:
        """Exact Hessian (2 p + 2, 2 p + 2) of the total energy, symmetric."""
        self.counters.hessian += 1
        local, u, v = self.jets(x)
        hessian = np.empty((self.size, self.size))
        kernels.assemble_hessian(self.lengths, local, self.is_loaded, u, v, hessian)
        return hessian

    def metric(self) -> FloatArray:
        """Gram matrix of ``int (domega^2 + deta^2) ds`` in the unknowns; eigenvalues of the Hessian are taken in it."""
        mass = np.empty((self.size, self.size))
        kernels.mass_matrix(self.lengths, self.fields.count, mass)
        return mass

    def joints(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions (p + 1, 3) in units of l and frames (p + 1, 3, 3) at the joints."""
        return self._walked(x, np.asarray(self.clamp.position) / self.strip.length)[:2]

    def _walked(self, x: FloatArray, position: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Positions and frames at the joints of a strip that begins at `position` (3,), and int r ds (3,)."""
        p = self.lengths.size
        points, frames, moment = np.empty((p + 1, 3)), np.empty((p + 1, 3, 3)), np.empty(3)
        kernels.walk(
            self.fields.free, self.parameters(x), self.lengths, position, self.clamp.frame, self.exponent_limit,
            points, frames, moment,
        )  # fmt: skip
        return points, frames, moment

    def parameter_map(self) -> tuple[IntArray, FloatArray]:
        """All columns (p, n) and slopes (p, 4 or 6, n) of the segments' parameters by the n unknowns."""
        p = self.lengths.size
        zero = self.parameters(np.zeros(self.size))
        slopes = np.stack([self.parameters(unit) - zero for unit in np.eye(self.size)], axis=-1)
        return np.tile(np.arange(self.size), (p, 1)), slopes

    # -- what holds the ribbon ----------------------------------------------------------------------------------------

    def start_force(self, x: FloatArray, rows: FloatArray) -> Force:
        """What the clamp exerts, about its point: it carries the weight of the centreline and the force at the end."""
        force, moment = np.zeros(3), np.zeros(3)
        if self.gravity is not None:
            weight = self.strip.gamma * np.asarray(self.gravity.up)
            force, moment = weight, cross(self._first_moment(x), weight)
        if self.tip is not None:
            points, _ = self.joints(x)
            pull = np.asarray(self.tip)
            force, moment = force - pull, moment - cross(points[-1] - points[0], pull)
        return Force(force, moment)

    def _first_moment(self, x: FloatArray) -> FloatArray:
        """int (r - r(0)) ds (3,)."""
        return self._walked(x, np.zeros(3))[2]

    def end_force(self, x: FloatArray, rows: FloatArray) -> Force | None:
        """None: free."""
        return None

    def wall_forces(self, x: FloatArray, rows: FloatArray) -> tuple[WallForce, ...]:
        """None."""
        return ()
