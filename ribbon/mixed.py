"""Mixed (glued) problem: every segment on its own, glued by constraints; sparse, cost linear in p (thesis, 5.2).

Nine unknowns a joint and one a segment (`ribbon.mixed_kernels`), eight rows of glue a segment, then the rows of what
holds the ribbon (`ribbon.conditions`). Position, frame and ruling that a clamp holds at s = 0 are eliminated (they are
fixed unknowns), or held by rows when ``held_by = "constraints"`` (thesis, 5.3.3). Rigid motions that nothing resists
are removed by rows that fix the start (`gauge`), whose multipliers vanish at equilibrium.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ribbon import chained_kernels, quaternion
from ribbon import mixed_kernels as kernels
from ribbon.body_series import body_jets_many
from ribbon.boundary import Clamp, Closure
from ribbon.chained import Counters, too_far
from ribbon.conditions import LinearRows, Rows, SeamRows, UnitRow, WallRows, imaginary_part
from ribbon.contact import Wall
from ribbon.energies import CODES
from ribbon.errors import RibbonInputError
from ribbon.loads import Gravity
from ribbon.series import EXPONENT_LIMIT
from ribbon.strip import Strip

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

STRIDE = kernels.STRIDE
_POSITION = np.arange(3)
_FRAME = np.arange(3, 7)
_OMEGA, _ETA, _SLOPE = 7, 8, 9
_ENDS = np.array([3, 4, 5, 6, _ETA])
#: Quaternion of half a turn about the tangent: the seam of a Moebius band.
HALF_TURN = np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True)
class MixedProblem:
    """Energy of the glued ribbon with constraints, sparse Jacobian and Hessian of the Lagrangian.

    strip, gravity, energy, lengths: as in `ribbon.chained.ChainedProblem`; start, end: clamps or None (free end);
    closure: of a band, then `end` is None; walls: planes; held_by: "elimination" or "constraints"; reference:
    quaternion (4,) to which the gauge of free rotations refers, the start's of the seed, and origin (3,) the same for
    positions; box: bounds on |omega| and |eta| that keep a far start from running away; a solution must not touch them;
    model: "mixed", or the formulation that finds the point ("matrix", "chained"), for comparison.
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
    box: tuple[float, float] | None = None
    model: str = "mixed"
    counters: Counters = field(default_factory=Counters, compare=False)
    _cache: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def formulation(self) -> str:
        """The model's name."""
        return self.model

    def __post_init__(self) -> None:
        if self.energy not in CODES:
            raise RibbonInputError("energy", self.energy, f"use one of {', '.join(sorted(CODES))}")
        if self.held_by not in ("elimination", "constraints"):
            raise RibbonInputError("held_by", self.held_by, 'use "elimination" or "constraints"')
        if self.closure is not None and self.end is not None:
            raise RibbonInputError("closure", self.closure.kind, "a closed band has no clamp at its end; remove one")

    # -- sizes and switches -------------------------------------------------------------------------------------------

    @property
    def size(self) -> int:
        """Number of unknowns, 10 p + 9 and one for every pressure plate."""
        return STRIDE * self.lengths.size + 9 + len(self.plates)

    @property
    def plates(self) -> tuple[int, ...]:
        """Indices of the walls that are pressure plates."""
        return tuple(k for k, wall in enumerate(self.walls) if wall.stiffness is not None)

    @property
    def has_gravity(self) -> bool:
        """Whether weight acts."""
        return self.gravity is not None and self.strip.gamma > 0

    @property
    def has_natural_curvature(self) -> bool:
        """Whether the strip is naturally curved; otherwise the term is absent."""
        return self.strip.curvature != (0.0, 0.0)

    @property
    def half_width(self) -> float:
        """w / (2 l)."""
        return 0.5 * self.strip.relative_width

    @property
    def last(self) -> int:
        """First column of the last joint."""
        return STRIDE * self.lengths.size

    @property
    def _level(self) -> int:
        if not self.has_gravity:
            return 0
        return 2 if self.gravity is not None and self.gravity.exact else 1

    def _gravity_arguments(self) -> tuple[float, FloatArray, bool]:
        if self.gravity is None or not self.has_gravity:
            return 0.0, np.zeros(3), False
        return float(self.strip.gamma), np.asarray(self.gravity.up), self.gravity.exact

    def with_changes(self, **changes: Any) -> MixedProblem:
        """The same problem with fields replaced and nothing cached."""
        return replace(self, counters=Counters(), _cache={}, **changes)

    # -- what holds the ribbon ----------------------------------------------------------------------------------------

    def _scaled(self, clamp: Clamp) -> FloatArray | None:
        return None if clamp.position is None else np.asarray(clamp.position) / self.strip.length

    @property
    def start_position(self) -> FloatArray | None:
        """r (3,) held at s = 0, units of l, or None."""
        return None if self.start is None else self._scaled(self.start)

    @property
    def start_quaternion(self) -> FloatArray | None:
        """Quaternion (4,) held at s = 0, of the sign of the reference, or None."""
        if self.start is None or not self.start.holds_frame:
            return None
        q = quaternion.from_matrix(self.start.frame)
        return -q if q @ np.asarray(self.reference) < 0 else q

    @property
    def end_position(self) -> FloatArray | None:
        """r (3,) held at s = l, units of l, or None."""
        return None if self.end is None else self._scaled(self.end)

    @property
    def end_quaternion(self) -> FloatArray | None:
        """Quaternion (4,) held at s = l, or None."""
        return quaternion.from_matrix(self.end.frame) if self.end is not None and self.end.holds_frame else None

    @property
    def seam(self) -> FloatArray:
        """Quaternion delta (4,) of the seam: q_p = +- q_0 o delta."""
        return HALF_TURN if self.closure is not None and self.closure.sign < 0 else np.array([1.0, 0.0, 0.0, 0.0])

    @property
    def slides(self) -> bool:
        """Whether the seam of a Moebius band may slide along it without changing anything (thesis, 6.1.1).

        The ruling is straight somewhere on every such band, as eta(l) = -eta(0); the seam is put there.
        """
        return (
            self.closure is not None
            and self.closure.sign < 0
            and not self.walls
            and not self.has_gravity
            and not self.has_natural_curvature
        )

    @property
    def start_straight(self) -> bool:
        """Whether eta = 0 at s = 0."""
        return (
            self.slides
            or (self.start is not None and self.start.ruling == "straight")
            or (self.closure is not None and self.closure.ruling == "straight")
        )

    @property
    def end_straight(self) -> bool:
        """Whether eta = 0 at s = l."""
        return (
            self.slides
            or (self.end is not None and self.end.ruling == "straight")
            or (self.closure is not None and self.closure.ruling == "straight")
        )

    def free_motions(self) -> tuple[FloatArray, FloatArray]:
        """Unit translations (k, 3) and axes of rotation (m, 3) that change neither energy nor constraints."""
        fixed = [] if self.gravity is None or not self.has_gravity else [np.asarray(self.gravity.up)]
        fixed += [np.asarray(wall.normal) for wall in self.walls]
        directions = np.array(fixed).reshape(-1, 3)
        points = [r for r in (self.start_position, self.end_position) if r is not None]
        translations = np.empty((0, 3))
        if not points:
            translations = np.eye(3) if not len(directions) else _complement(directions)
        frames = self.start_quaternion is not None or self.end_quaternion is not None
        if frames:
            return translations, np.empty((0, 3))
        if len(points) == 2 and np.linalg.norm(points[1] - points[0]) > 1e-12:
            chord = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
            directions = np.vstack([directions, chord])
        if not len(directions):
            return translations, np.eye(3)
        axis = directions[0]
        parallel = np.linalg.norm(np.cross(directions, axis), axis=1).max() < 1e-9
        return translations, axis[None, :] if parallel else np.empty((0, 3))

    def blocks(self) -> dict[str, Rows]:
        """The rows beside the glue, by name, in order."""
        if "blocks" not in self._cache:
            self._cache["blocks"] = self._make_blocks()
        return self._cache["blocks"]  # type: ignore[no-any-return]

    def _make_blocks(self) -> dict[str, Rows]:
        found: dict[str, Rows] = {}
        last = self.last
        start, turned = self.start_position, self.start_quaternion
        if self.held_by == "constraints":
            if start is not None:
                found["start_position"] = LinearRows(np.eye(3), _POSITION, start)
            if turned is not None:
                found["start_frame"] = LinearRows(np.eye(4), _FRAME, turned)
        translations, axes = self.free_motions()
        if turned is None and len(axes) < 3:
            found["start_norm"] = UnitRow(_FRAME)
        if 0 < len(translations) < 3:
            found["gauge_position"] = LinearRows(translations, _POSITION, translations @ np.asarray(self.origin))
        if len(axes) == 1:
            spun = 0.5 * quaternion.compose(np.concatenate([[0.0], axes[0]]), self.reference)
            found["gauge_frame"] = LinearRows(spun[None, :], _FRAME, np.zeros(1))
        end, held = self.end_position, self.end_quaternion
        if end is not None:
            found["end_position"] = LinearRows(np.eye(3), last + _POSITION, end)
        if held is not None:
            found["end_frame"] = LinearRows(imaginary_part(held), last + _FRAME, np.zeros(3))
        if self.closure is not None:
            both = np.hstack([-np.eye(3), np.eye(3)])
            found["end_position"] = LinearRows(both, np.concatenate([_POSITION, last + _POSITION]), np.zeros(3))
            found["end_frame"] = SeamRows(_FRAME, last + _FRAME, self.seam)
            pair = np.array([[-float(self.closure.sign), 1.0]])
            found["seam_omega"] = LinearRows(pair, np.array([_OMEGA, last + _OMEGA]), np.zeros(1))
            if self.closure.ruling == "free" and not self.slides:
                found["seam_eta"] = LinearRows(pair, np.array([_ETA, last + _ETA]), np.zeros(1))
        found.update(self._wall_blocks())
        return found

    def _wall_blocks(self) -> dict[str, Rows]:
        found: dict[str, Rows] = {}
        joints = np.arange(self.lengths.size + 1)
        if self.start is not None and self.start.is_whole and self.start_straight:
            joints = joints[1:]  # constant there
        if self.closure is not None or (self.end is not None and self.end.is_whole and self.end_straight):
            joints = joints[:-1]
        plate = STRIDE * self.lengths.size + 9
        for k, wall in enumerate(self.walls):
            column = -1
            if wall.stiffness is not None:
                column, plate = plate, plate + 1
            point = np.asarray(wall.point) / self.strip.length
            found[f"wall_{k}"] = WallRows(joints, STRIDE, point, np.asarray(wall.normal), self.half_width, column)
        return found

    # -- the problem --------------------------------------------------------------------------------------------------

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the unknowns; what is eliminated is fixed."""
        upper = np.full(self.size, np.inf)
        upper[_SLOPE : self.last : STRIDE] = 1.0 / self.half_width
        if self.box is not None:
            upper[_OMEGA : self.last + 9 : STRIDE] = self.box[0]
            upper[_ETA : self.last + 9 : STRIDE] = self.box[1]
        lower = -upper
        translations, axes = self.free_motions()
        fixed: list[tuple[IntArray, FloatArray]] = []
        if self.held_by == "elimination":
            if self.start_position is not None:
                fixed.append((_POSITION, self.start_position))
            if self.start_quaternion is not None:
                fixed.append((_FRAME, self.start_quaternion))
        if len(translations) == 3:
            fixed.append((_POSITION, np.asarray(self.origin)))
        if len(axes) == 3:
            fixed.append((_FRAME, np.asarray(self.reference)))
        if self.start_straight:
            fixed.append((np.array([_ETA]), np.zeros(1)))
        if self.end_straight:
            fixed.append((np.array([self.last + _ETA]), np.zeros(1)))
        for columns, values in fixed:
            lower[columns] = upper[columns] = values
        return lower, upper

    def constraint_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the rows: the glue, then the blocks."""
        lower = [np.zeros(kernels.ROWS * self.lengths.size)]
        upper = [np.zeros(kernels.ROWS * self.lengths.size)]
        for rows in self.blocks().values():
            lower.append(np.full(rows.count, rows.lower))
            upper.append(np.full(rows.count, rows.upper))
        return np.concatenate(lower), np.concatenate(upper)

    def block_slices(self) -> dict[str, slice]:
        """Where the rows of each block stand."""
        at = kernels.ROWS * self.lengths.size
        found = {}
        for name, rows in self.blocks().items():
            found[name] = slice(at, at + rows.count)
            at += rows.count
        return found

    def energy_parts(self, x: FloatArray) -> FloatArray:
        """Bending, natural-curvature and gravity energy and that of the pressure plates (4,), units D w / l."""
        parts = np.append(self._parts_and_glue(x, False)[0], self._plate_energy(x))
        parts[2] += sum(end[1] for end in self._oblique_ends(x))
        return parts

    def _oblique_ends(self, x: FloatArray) -> list[tuple[int, float, FloatArray, FloatArray]]:
        """Of either end with an exact weight: first column, energy, derivatives (5,), second ones (15,) by q, eta."""
        gamma, up, exact = self._gravity_arguments()
        found: list[tuple[int, float, FloatArray, FloatArray]] = []
        if not exact or self.closure is not None:
            return found
        factor = gamma * self.half_width**2 / 3.0
        for column, sign in ((0, 1.0), (self.last, -1.0)):
            by, second = np.empty(5), np.empty(15)
            q = np.ascontiguousarray(x[column + 3 : column + 7])
            energy = kernels.end_weight(q, x[column + _ETA], up, sign * factor, by, second)
            found.append((column, energy, by, second))
        return found

    def _plate_energy(self, x: FloatArray) -> float:
        heights = x[STRIDE * self.lengths.size + 9 :]
        return 0.5 * float(sum(self.walls[k].stiffness * h * h for k, h in zip(self.plates, heights, strict=True)))  # type: ignore[misc,operator]

    def _parts_and_glue(self, x: FloatArray, want_glue: bool) -> tuple[FloatArray, FloatArray]:
        gamma, up, exact = self._gravity_arguments()
        parts = np.empty(3)
        glue = np.empty(kernels.ROWS * self.lengths.size)
        self.counters.value += 1
        if too_far(self.parameters(x), self.lengths):
            return np.full(3, np.nan), np.full(glue.size, np.nan)
        self.counters.series += self.lengths.size * (want_glue or gamma != 0.0)
        kernels.energy_and_glue(
            np.ascontiguousarray(x, dtype=float), self.lengths, CODES[self.energy], self.half_width,
            self.has_natural_curvature, np.asarray(self.strip.curvature), self.strip.poisson, gamma, up, exact,
            self.exponent_limit, want_glue, parts, glue,
        )  # fmt: skip
        return parts, glue

    def _evaluated(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Energies and glue of x, one evaluation for both."""
        key = np.ascontiguousarray(x, dtype=float).tobytes()
        if self._cache.get("value_key") != key:
            self._cache["values"] = self._parts_and_glue(x, True)
            self._cache["value_key"] = key
        return self._cache["values"]  # type: ignore[no-any-return]

    def value(self, x: FloatArray) -> float:
        """Total energy, units D w / l."""
        ends = sum(end[1] for end in self._oblique_ends(x))
        return float(self._evaluated(x)[0].sum() + self._plate_energy(x) + ends)

    def constraints(self, x: FloatArray) -> FloatArray:
        """The rows: the glue, then the blocks."""
        return np.concatenate([self._evaluated(x)[1], *(rows.values(x) for rows in self.blocks().values())])

    def parameters(self, x: FloatArray) -> FloatArray:
        """(a, b, n, m) of every segment, (p, 4)."""
        q = np.empty((self.lengths.size, 4))
        kernels.parameters(np.ascontiguousarray(x, dtype=float), self.lengths, q)
        return q

    def _jets(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        key = np.ascontiguousarray(x, dtype=float).tobytes()
        if self._cache.get("key") != key:
            p = self.lengths.size
            gamma, _, exact = self._gravity_arguments()
            q = self.parameters(x)
            if "jets" not in self._cache:
                self._cache["jets"] = (
                    np.empty((p, 15)), np.empty((p, 13, 15)), np.empty((p if gamma else 1, 3, 15))
                )  # fmt: skip
            local, jets, weight = self._cache["jets"]
            if too_far(q, self.lengths):
                self._cache.pop("key", None)
                return np.full_like(local, np.nan), np.full_like(jets, np.nan), np.full_like(weight, np.nan)
            chained_kernels.local_derivatives(
                q, self.lengths, CODES[self.energy], self.half_width, self.has_natural_curvature,
                np.asarray(self.strip.curvature), self.strip.poisson, local,
            )  # fmt: skip
            body_jets_many(q, self.lengths, self.exponent_limit, self._level, jets)
            self.counters.series += p
            if gamma:
                kernels.weight_jets(jets, q, self.lengths, self.half_width, exact, weight)
            kernels.all_by_unknowns(self.lengths, local, jets, 7, weight, gamma != 0.0)
            self._cache["key"] = key
        return self._cache["jets"]  # type: ignore[no-any-return]

    def gradient(self, x: FloatArray) -> FloatArray:
        """Gradient (size,) of the energy."""
        self.counters.gradient += 1
        local, _, weight = self._jets(x)
        gamma, up, _ = self._gravity_arguments()
        out = np.empty(self.size)
        kernels.gradient(x, self.lengths, local, gamma, up, weight, out)
        for k, column in zip(self.plates, range(STRIDE * self.lengths.size + 9, self.size), strict=True):
            out[column] = self.walls[k].stiffness * x[column]  # type: ignore[operator]
        for column, _, by, _ in self._oblique_ends(x):
            out[column + _ENDS] += by
        return out

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the Jacobian's entries."""
        if "jacobian" not in self._cache:
            rows, columns = kernels.jacobian_structure(self.lengths.size)
            parts = [(rows, columns)]
            for name, where in self.block_slices().items():
                r, c = self.blocks()[name].jacobian_structure()
                parts.append((r + where.start, c))
            self._cache["jacobian"] = tuple(np.concatenate(part) for part in zip(*parts, strict=True))
        return self._cache["jacobian"]  # type: ignore[no-any-return]

    def jacobian(self, x: FloatArray) -> FloatArray:
        """The Jacobian's entries in the order of the structure."""
        _, jets, _ = self._jets(x)
        out = np.empty(kernels.JACOBIAN_ENTRIES * self.lengths.size)
        kernels.jacobian(x, self.lengths, jets, out)
        return np.concatenate([out, *(rows.jacobian(x) for rows in self.blocks().values())])

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the entries of the Hessian's lower triangle; entries of one place add up."""
        if "hessian" not in self._cache:
            parts = [kernels.hessian_structure(self.lengths.size)]
            parts += [rows.hessian_structure() for rows in self.blocks().values()]
            columns = np.arange(STRIDE * self.lengths.size + 9, self.size)
            parts.append((columns, columns))
            for column, *_ in self._oblique_ends(np.zeros(self.size)):
                rows, places = np.tril_indices(5)
                parts.append((column + _ENDS[rows], column + _ENDS[places]))
            self._cache["hessian"] = tuple(np.concatenate(part) for part in zip(*parts, strict=True))
        return self._cache["hessian"]  # type: ignore[no-any-return]

    def hessian(self, x: FloatArray, multipliers: FloatArray, factor: float = 1.0) -> FloatArray:
        """Entries of the lower triangle of ``factor d2E + sum multipliers d2c`` in the order of the structure."""
        self.counters.hessian += 1
        local, jets, weight = self._jets(x)
        gamma, up, _ = self._gravity_arguments()
        out = np.empty(kernels.HESSIAN_ENTRIES * self.lengths.size)
        kernels.hessian(x, self.lengths, multipliers, factor, local, jets, gamma, up, weight, out)
        parts = [out]
        for name, where in self.block_slices().items():
            parts.append(self.blocks()[name].hessian(x, multipliers[where]))
        parts.append(factor * np.array([self.walls[k].stiffness for k in self.plates], dtype=float))
        parts.extend(factor * second for *_, second in self._oblique_ends(x))
        return np.concatenate(parts)

    # -- as sparse matrices -------------------------------------------------------------------------------------------

    def jacobian_matrix(self, x: FloatArray) -> sp.csr_matrix:
        """The Jacobian (rows, size)."""
        rows, columns = self.jacobian_structure()
        count = len(self.constraint_bounds()[0])
        return sp.csr_matrix((self.jacobian(x), (rows, columns)), shape=(count, self.size))

    def hessian_matrix(self, x: FloatArray, multipliers: FloatArray) -> sp.csr_matrix:
        """Hessian (size, size) of the Lagrangian, both triangles."""
        rows, columns = self.hessian_structure()
        values = self.hessian(x, multipliers)
        lower = sp.csr_matrix((values, (rows, columns)), shape=(self.size, self.size))
        return lower + sp.tril(lower, -1).T

    # -- states -------------------------------------------------------------------------------------------------------

    def state(self, omega: FloatArray, eta: FloatArray) -> FloatArray:
        """Unknowns of the shape with omega, eta (p + 1,) at the joints, glued, put where something holds it."""
        p = self.lengths.size
        x = np.zeros(self.size)
        x[3:7] = self.reference if self.start_quaternion is None else self.start_quaternion
        x[0:3] = self.origin if self.start_position is None else self.start_position
        x[_OMEGA : self.last + 9 : STRIDE] = omega
        x[_ETA] = eta[0]
        x[_SLOPE : self.last : STRIDE] = np.diff(eta) / self.lengths
        kernels.walk(x, self.lengths, self.exponent_limit)
        x[_ETA : self.last + 9 : STRIDE] = eta  # no rounding where a clamp holds it straight
        turned = self.start_quaternion
        if turned is None and self.end_quaternion is not None:
            last = x[self.last + 3 : self.last + 7]
            spin = quaternion.compose(self.end_quaternion, quaternion.conjugate(last))
            x[3:7] = quaternion.compose(spin, x[3:7])
            kernels.walk(x, self.lengths, self.exponent_limit)
        if self.start_position is None and self.end_position is not None:
            shift = self.end_position - x[self.last : self.last + 3]
            for k in range(3):
                x[k : self.last + 9 : STRIDE] += shift[k]
        assert x.size >= STRIDE * p + 9
        return x

    def joints(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions (p + 1, 3) in units of l and frames (p + 1, 3, 3) at the joints."""
        table = np.append(x[: self.last + 9], 0.0).reshape(-1, STRIDE)
        return table[:, :3].copy(), quaternion.matrix(table[:, 3:7])


def _complement(directions: FloatArray) -> FloatArray:
    """Orthonormal rows (k, 3) orthogonal to all `directions` (m, 3)."""
    _, singular, rows = np.linalg.svd(directions)
    rank = int((singular > 1e-9).sum())
    return rows[rank:]
