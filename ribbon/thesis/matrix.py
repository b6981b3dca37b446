"""The thesis's own mixed problem: sixteen unknowns a segment, frames as full matrices (thesis, 5.2, 6.1), to compare.

`ribbon.problems.mixed` is what this project uses; here are the unknowns and rows of the thesis
(`ribbon.thesis.matrix_kernels`): six rows of orthonormality a segment (5.5), eight of glue with off-diagonal products
(5.6), the start held by fixed unknowns or by rows (5.7), the end by rows (5.1, 5.3): docs/theory.md, eq. (4.8). Same
scene in, same interface out, same units: lengths in l, energies in D w / l. Rows of a frame are in the order x, y, z of
the axes about which they forbid turns and have the signs of `ribbon.problems.mixed`: the multipliers of what holds the
ribbon are the same forces and moments.

These rows do not exclude frames that are flipped; `MatrixProblem.flipped` tells.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.boundary import Clamp, Closure
from ribbon.contact import Wall
from ribbon.element import quaternion
from ribbon.element.series import EXPONENT_LIMIT, product, walk
from ribbon.energies import CODES
from ribbon.errors import RibbonInputError
from ribbon.loads import Gravity
from ribbon.problems import chained_kernels, mixed_kernels
from ribbon.problems.chained import Counters
from ribbon.problems.conditions import LinearRows
from ribbon.problems.layout import MATRIX_A as A
from ribbon.problems.layout import MATRIX_FRAME as FRAME
from ribbon.problems.layout import MATRIX_M as M
from ribbon.problems.layout import MATRIX_N as N
from ribbon.problems.layout import MATRIX_STRIDE as STRIDE
from ribbon.problems.layout import MatrixLayout
from ribbon.problems.mixed import MixedProblem
from ribbon.strip import Strip
from ribbon.thesis import matrix_kernels as kernels
from ribbon.thesis.matrix_kernels import EndRows

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_POSITION = np.arange(FRAME)
_FRAME = np.arange(FRAME, A)
#: Places of R_x, R_z.
_AXES = np.array([*range(FRAME, A, 3), *range(FRAME + 2, A, 3)])
#: A frame is right where the diagonal products of the glue exceed this; where the rows hold they are 1, 0 or -1.
_RIGHT = 0.5


@dataclass(frozen=True)
class SegmentWallRows:
    """Both edges of the rulings at the starts of `segments` on the wall's side (thesis, eq. 6.2), two rows a segment.

    ``<r +- (w/2) (R_x + m R_z) - point, normal> - height >= 0``; fields as in `ribbon.problems.conditions.WallRows`.
    """

    segments: IntArray
    point: FloatArray
    normal: FloatArray
    half_width: float
    plate: int = -1
    lower: float = 0.0
    upper: float = np.inf

    @property
    def count(self) -> int:
        """Two rows a segment."""
        return 2 * self.segments.size

    def _places(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """r, R_x, R_z (k, 3) and m (k, 1)."""
        table = x[STRIDE * self.segments[:, None] + np.arange(STRIDE)]
        return table[:, :FRAME], table[:, _AXES[:3]], table[:, _AXES[3:]], table[:, M:]

    def values(self, x: FloatArray) -> FloatArray:
        """Distances (count,) of the edges from the wall."""
        place, across, along, m = self._places(x)
        edge = self.half_width * ((across + m * along) @ self.normal)
        distance = (place - self.point) @ self.normal - (x[self.plate] if self.plate >= 0 else 0.0)
        return np.column_stack([distance + edge, distance - edge]).ravel()

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """r, R_x, R_z, m (and the plate's height)."""
        local = np.array([*range(FRAME), *_AXES, M])
        columns = np.repeat(STRIDE * self.segments, 2)[:, None] + local
        if self.plate >= 0:
            columns = np.column_stack([columns, np.full(self.count, self.plate)])
        return np.repeat(np.arange(self.count), columns.shape[1]), columns.ravel()

    def jacobian(self, x: FloatArray) -> FloatArray:
        """In the order of the structure."""
        _, _, along, m = self._places(x)
        out = np.empty((self.segments.size, 2, 11 if self.plate >= 0 else 10))
        out[:, :, :3] = self.normal
        for side, f in enumerate((self.half_width, -self.half_width)):
            out[:, side, 3:6] = f * self.normal
            out[:, side, 6:9] = f * m * self.normal
            out[:, side, 9] = f * (along @ self.normal)
        out[:, :, 10:] = -1.0
        return out.ravel()

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """m by R_z."""
        base = STRIDE * self.segments[:, None]
        return (base + np.full(3, M)).ravel(), (base + _AXES[3:]).ravel()

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray:
        """In the order of the structure."""
        pull = self.half_width * (multipliers[0::2] - multipliers[1::2])
        return (pull[:, None] * self.normal).ravel()


Part = LinearRows | SegmentWallRows | EndRows


@dataclass(frozen=True)
class MatrixProblem:
    """Energy of the glued ribbon in the thesis's unknowns; fields and methods as in
    `ribbon.problems.mixed.MixedProblem`.
    """

    strip: Strip
    start: Clamp | None
    end: Clamp | None
    closure: Closure | None
    walls: tuple[Wall, ...]
    gravity: Gravity | None
    energy: str
    lengths: FloatArray
    held_by: str = "elimination"
    reference: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)
    origin: tuple[float, ...] = (0.0, 0.0, 0.0)
    exponent_limit: float = EXPONENT_LIMIT
    counters: Counters = field(default_factory=Counters, compare=False)
    _cache: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)
    #: The same scene in quaternions: what is held, what is free, starting states.
    _twin: MixedProblem = field(init=False, repr=False, compare=False)

    formulation = "matrix"

    def __post_init__(self) -> None:
        if self.closure is not None and self.lengths.size < 2:
            raise RibbonInputError("segments", self.lengths.size, "a closed band of matrices needs two at least")
        twin = MixedProblem(
            self.strip, self.start, self.end, self.closure, self.walls, self.gravity, self.energy, self.lengths,
            self.held_by, self.reference, self.origin, self.exponent_limit,
        )  # fmt: skip
        object.__setattr__(self, "_twin", twin)

    @property
    def rows(self) -> MatrixProblem:
        """All of it has rows."""
        return self

    @property
    def slack(self) -> float | None:
        """As the mixed problem has it."""
        return self._twin.slack

    @property
    def size(self) -> int:
        """Number of unknowns, 16 p and one for every pressure plate."""
        return self.layout.size

    @property
    def layout(self) -> MatrixLayout:
        """Where the unknowns stand."""
        return MatrixLayout(self.lengths.size, len(self.plates))

    @property
    def plates(self) -> tuple[int, ...]:
        """Indices of the walls that are pressure plates."""
        return self._twin.plates

    @property
    def has_gravity(self) -> bool:
        """Whether weight acts."""
        return self._twin.has_gravity

    @property
    def has_natural_curvature(self) -> bool:
        """Whether the strip is naturally curved; otherwise the term is absent."""
        return self._twin.has_natural_curvature

    @property
    def half_width(self) -> float:
        """w / (2 l)."""
        return self._twin.half_width

    @property
    def last(self) -> int:
        """First column of the last segment."""
        return self.layout.last

    @property
    def _seam(self) -> int:
        return 0 if self.closure is None else self.closure.sign

    @cached_property
    def _free_motions(self) -> tuple[FloatArray, FloatArray]:
        return self._twin.free_motions()

    @cached_property
    def _known(self) -> int:
        """1 where the first frame is fixed or held by nine rows: it needs no rows of orthonormality."""
        held = self.start is not None and self.start.holds_frame
        return int(held or len(self._free_motions[1]) == 3)

    @cached_property
    def _stiffness(self) -> FloatArray:
        return np.array([self.walls[k].stiffness for k in self.plates], dtype=float)

    def with_changes(self, **changes: Any) -> MatrixProblem:
        """The same problem with fields replaced and nothing cached."""
        return replace(self, counters=Counters(), _cache={}, **changes)

    @cached_property
    def _blocks(self) -> dict[str, list[Part]]:
        """The rows behind orthonormality and glue, by name, in order."""
        found: dict[str, list[Part]] = {}
        place = self._twin.start_position
        if self.held_by == "constraints":
            if place is not None:
                found["start_position"] = [LinearRows(np.eye(3), _POSITION, place)]
            if self.start is not None and self.start.holds_frame:
                found["start_frame"] = [LinearRows(np.eye(9), _FRAME, self.start.frame.ravel())]
        translations, axes = self._free_motions
        if 0 < len(translations) < 3:
            origin = translations @ np.asarray(self.origin)
            found["gauge_position"] = [LinearRows(translations, _POSITION, origin)]
        if len(axes) == 1:
            x, y, z = axes[0]
            spun = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ quaternion.matrix(self.reference)
            found["gauge_frame"] = [LinearRows(spun.reshape(1, 9), _FRAME, np.zeros(1))]
        end = self._twin.end_position
        if end is not None:
            mix = np.tile([0.0, 0.0, 0.0, 1.0, 0.0], (3, 1))
            found["end_position"] = [EndRows(np.eye(3), mix, end, self.last)]
        if self.end is not None and self.end.holds_frame:
            # <G_y, H_z>, <G_z, H_x>, <G_x, H_y>
            found["end_frame"] = [EndRows(self.end.frame.T[[2, 0, 1]], np.eye(5)[[1, 2, 0]], np.zeros(3), self.last)]
        if self.end is not None and self.end.ruling == "straight":
            slope = np.array([[self.lengths[-1], 1.0]])
            found["end_ruling"] = [LinearRows(slope, self.last + np.array([N, M]), np.zeros(1))]
        return {**found, **self._walls()}

    def _walls(self) -> dict[str, list[Part]]:
        """Rows at all joints but those where they are constant (or repeated, at a seam)."""
        found: dict[str, list[Part]] = {}
        skip = self.start is not None and self.start.is_whole and self._twin.start_straight
        segments = np.arange(int(skip), self.lengths.size)
        at_end = self.closure is None and not (self.end is not None and self.end.is_whole and self._twin.end_straight)
        mix = np.array([[0.0, 0.0, 0.0, 1.0, self.half_width], [0.0, 0.0, 0.0, 1.0, -self.half_width]])
        for k, wall in enumerate(self.walls):
            column = self.layout.ribbon + self.plates.index(k) if k in self.plates else -1
            point, normal = np.asarray(wall.point) / self.strip.length, np.asarray(wall.normal)
            found[f"wall_{k}"] = [SegmentWallRows(segments, point, normal, self.half_width, column)]
            if at_end:
                forms, value = np.tile(normal, (2, 1)), np.full(2, point @ normal)
                found[f"wall_{k}"].append(EndRows(forms, mix, value, self.last, column, 0.0, np.inf))
        return found

    @cached_property
    def _parts(self) -> list[tuple[slice, Part]]:
        """All blocks' rows and where they stand."""
        at = kernels.core_rows(self.lengths.size, self._known, self._seam)
        found = []
        for part in (part for parts in self._blocks.values() for part in parts):
            found.append((slice(at, at + part.count), part))
            at += part.count
        return found

    def block_slices(self) -> dict[str, slice]:
        """Where the rows of each block stand; those of a seam are the last of the core."""
        at = kernels.core_rows(self.lengths.size, self._known, self._seam)
        found = {}
        if self._seam:
            found = {"end_position": slice(at - 8, at - 5), "end_frame": slice(at - 5, at - 2)}
            found |= {"seam_omega": slice(at - 2, at - 1), "seam_eta": slice(at - 1, at)}
        for name, parts in self._blocks.items():
            count = sum(part.count for part in parts)
            found[name] = slice(at, at + count)
            at += count
        return found

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the unknowns; what is eliminated is fixed."""
        upper = np.full(self.size, np.inf)
        upper[self.layout.slope] = 1.0 / self.half_width
        lower = -upper
        translations, axes = self._free_motions
        place = self._twin.start_position
        fixed: list[tuple[Any, Any]] = []
        if self.held_by == "elimination":
            if place is not None:
                fixed.append((_POSITION, place))
            if self.start is not None and self.start.holds_frame:
                fixed.append((_FRAME, self.start.frame.ravel()))
        if len(translations) == 3:
            fixed.append((_POSITION, self.origin))
        if len(axes) == 3:
            fixed.append((_FRAME, quaternion.matrix(self.reference).ravel()))
        if self._twin.start_straight:
            fixed.append(([M], 0.0))
        for columns, values in fixed:
            lower[columns] = upper[columns] = values
        return lower, upper

    def constraint_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the rows: the core, then the blocks."""
        limits = [np.zeros((2, kernels.core_rows(self.lengths.size, self._known, self._seam)))]
        limits += [np.tile([[part.lower], [part.upper]], part.count) for _, part in self._parts]
        lower, upper = np.hstack(limits)
        return lower, upper

    def parameters(self, x: FloatArray) -> FloatArray:
        """(a, b, n, m) of every segment, (p, 4)."""
        return self.layout.parameters(x).copy()

    def _evaluated(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Energies (4,), core rows and the end of the last segment (5, 3), one evaluation for all."""
        x = np.ascontiguousarray(x, dtype=float)
        if self._cache.get("value_key") != (key := x.tobytes()):
            count = kernels.core_rows(self.lengths.size, self._known, self._seam)
            parts, rows, tail = np.empty(4), np.empty(count), np.empty((5, 3))
            gamma, up, exact = self._twin._gravity_arguments()
            self.counters.value += 1
            self.counters.series += self.lengths.size
            kernels.energy_and_rows(
                x, self.lengths, CODES[self.energy], self.strip.section, self.has_natural_curvature,
                np.asarray(self.strip.curvature), self.strip.poisson, gamma, up, exact, self.exponent_limit,
                self._known, self._seam, parts, rows, tail,
            )  # fmt: skip
            parts[3] = 0.5 * self._stiffness @ x[self.layout.heights] ** 2
            self._cache["values"], self._cache["value_key"] = (parts, rows, tail), key
        return self._cache["values"]  # type: ignore[no-any-return]

    def energy_parts(self, x: FloatArray) -> FloatArray:
        """Bending, natural-curvature and gravity energy and that of the pressure plates (4,), units D w / l."""
        return self._evaluated(x)[0].copy()

    def value(self, x: FloatArray) -> float:
        """Total energy, units D w / l."""
        return float(self._evaluated(x)[0].sum())

    def constraints(self, x: FloatArray) -> FloatArray:
        """The rows: orthonormality and glue, then the blocks."""
        _, rows, tail = self._evaluated(x)
        found = [part.values(x, tail) if isinstance(part, EndRows) else part.values(x) for _, part in self._parts]
        return np.concatenate([rows, *found])

    def _jets(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Jets: elastic (p, 15), series (p, 12 to 18, 15), weight (p, 3, 15), end of the last segment (5, 3, 15)."""
        key = np.ascontiguousarray(x, dtype=float).tobytes()
        if self._cache.get("key") != key:
            p = self.lengths.size
            gamma, _, exact = self._twin._gravity_arguments()
            q = self.parameters(x)
            local, states = np.empty((p, 15)), np.empty((p, 18 if exact else 15 if gamma else 12, 15))
            weight, tail = np.empty((p if gamma else 1, 3, 15)), np.empty((5, 3, 15))
            chained_kernels.local_derivatives(q, self.lengths, self._twin.material, local)
            walk(q, self.lengths, self.exponent_limit, states)
            self.counters.series += p
            if gamma:
                # rows p, J, T in the places of u, v, t: the same formula with vectors seen from the start
                mixed_kernels.weight_jets(states[:, 5:], q, self.lengths, self.half_width, exact, weight)
            tail[:3] = states[-1, :9].reshape(3, 3, 15).transpose(1, 0, 2)
            tail[3:] = states[-1, 9:12], tail[0]
            eta = np.zeros(15)
            eta[0], eta[3], eta[4] = q[-1, 3] + q[-1, 2] * self.lengths[-1], self.lengths[-1], 1.0
            for r in range(3):
                product(eta, tail[2, r], tail[4, r])
            self._cache["jets"], self._cache["key"] = (local, states, weight, tail), key
        return self._cache["jets"]  # type: ignore[no-any-return]

    def gradient(self, x: FloatArray) -> FloatArray:
        """Gradient (size,) of the energy."""
        self.counters.gradient += 1
        local, _, weight, _ = self._jets(x)
        gamma, up, _ = self._twin._gravity_arguments()
        out = np.empty(self.size)
        kernels.gradient(np.ascontiguousarray(x, dtype=float), self.lengths, local, gamma, up, weight, out)
        out[self.layout.heights] = self._stiffness * x[self.layout.heights]
        return out

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the Jacobian's entries."""
        found = [kernels.jacobian_structure(self.lengths.size, self._known, self._seam)]
        for where, part in self._parts:
            rows, columns = part.jacobian_structure()
            found.append((rows + where.start, columns))
        return np.concatenate([f[0] for f in found]), np.concatenate([f[1] for f in found])

    def jacobian(self, x: FloatArray) -> FloatArray:
        """The Jacobian's entries in the order of the structure."""
        _, states, _, tail = self._jets(x)
        out = np.empty(kernels.entries(self.lengths.size, self._known, self._seam)[0])
        kernels.jacobian(np.ascontiguousarray(x, dtype=float), self.lengths, states, self._known, self._seam, out)
        found = [part.jacobian(x, tail) if isinstance(part, EndRows) else part.jacobian(x) for _, part in self._parts]
        return np.concatenate([out, *found])

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the entries of the Hessian's lower triangle; entries of one place add up."""
        found = [kernels.hessian_structure(self.lengths.size, self._known, self._seam)]
        found += [part.hessian_structure() for _, part in self._parts]
        plates = np.arange(self.layout.ribbon, self.size)
        return np.concatenate([*(f[0] for f in found), plates]), np.concatenate([*(f[1] for f in found), plates])

    def hessian(self, x: FloatArray, multipliers: FloatArray, factor: float = 1.0) -> FloatArray:
        """Entries of the lower triangle of ``factor d2E + sum multipliers d2c`` in the order of the structure."""
        self.counters.hessian += 1
        local, states, weight, tail = self._jets(x)
        gamma, up, _ = self._twin._gravity_arguments()
        out = np.empty(kernels.entries(self.lengths.size, self._known, self._seam)[1])
        kernels.hessian(
            np.ascontiguousarray(x, dtype=float), self.lengths, multipliers, factor, local, states, gamma, up, weight,
            self._known, self._seam, out,
        )  # fmt: skip
        found = [out]
        for where, part in self._parts:
            ends = (tail,) if isinstance(part, EndRows) else ()
            found.append(part.hessian(x, multipliers[where], *ends))
        return np.concatenate([*found, factor * self._stiffness])

    def jacobian_matrix(self, x: FloatArray) -> scipy.sparse.csr_matrix:
        """The Jacobian (rows, size)."""
        count = len(self.constraint_bounds()[0])
        return scipy.sparse.csr_matrix((self.jacobian(x), self.jacobian_structure()), shape=(count, self.size))

    def hessian_matrix(self, x: FloatArray, multipliers: FloatArray) -> scipy.sparse.csr_matrix:
        """Hessian (size, size) of the Lagrangian, both triangles."""
        values = self.hessian(x, multipliers)
        lower = scipy.sparse.csr_matrix((values, self.hessian_structure()), shape=(self.size, self.size))
        return lower + scipy.sparse.tril(lower, -1).T

    def state(self, omega: FloatArray, eta: FloatArray) -> FloatArray:
        """Unknowns of the shape with omega, eta (p + 1,) at the joints, glued, put where something holds it."""
        twin = self._twin.state(omega, eta)
        points, frames = self._twin.joints(twin)
        own = np.hstack([points[:-1], frames[:-1].reshape(-1, 9), self._twin.parameters(twin)])
        return np.concatenate([own.ravel(), np.zeros(len(self.plates))])

    def _ends(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        points, frames = np.empty((self.lengths.size, 3)), np.empty((self.lengths.size, 3, 3))
        kernels.ends(np.ascontiguousarray(x, dtype=float), self.lengths, self.exponent_limit, points, frames)
        return points, frames

    def joints(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions (p + 1, 3) in units of l and frames (p + 1, 3, 3) at the joints; the last is the last end."""
        points, frames = self._ends(x)
        own = self.layout
        return np.vstack([own.positions(x), points[-1:]]), np.concatenate([own.frames(x), frames[-1:]])

    def flipped(self, x: FloatArray) -> bool:
        """Whether a frame is left-handed, or a glue, a seam or the end's clamp is met in a frame turned over.

        All rows hold for such frames too (thesis, 5.1): the products ``<R'_k, G_k>`` are then 0 or -1, not 1.
        """
        own = self.layout.frames(x)
        ends = self._ends(x)[1]
        others = [*own[1:]]
        if self.closure is not None:
            others.append(own[0] * np.array([self._seam, self._seam, 1.0]))
        elif self.end is not None and self.end.holds_frame:
            others.append(self.end.frame)
        products = np.einsum("irk,irk->ik", np.array(others).reshape(-1, 3, 3), ends[: len(others)])
        return bool(np.any(np.linalg.det(own) < 0) or np.any(products < _RIGHT))
