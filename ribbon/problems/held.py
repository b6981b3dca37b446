"""What a mixed problem is made of and what holds it: fields, held parts, free rigid motions, rows and bounds.

The rows stand beside the glue (`ribbon.problems.conditions`); `ribbon.problems.mixed` adds energies and derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ribbon.boundary import Clamp, Closure
from ribbon.contact import Barrier, Wall
from ribbon.element import quaternion
from ribbon.element.series import EXPONENT_LIMIT
from ribbon.energies import chosen
from ribbon.errors import RibbonInputError
from ribbon.loads import Gravity
from ribbon.obstacle import Obstacle
from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.alike import ring
from ribbon.problems.arguments import Material
from ribbon.problems.conditions import LinearRows, Rows, SeamRows, UnitRow, WallRows, imaginary_part
from ribbon.problems.curved import motions
from ribbon.problems.curved.rows import CurvedJointRows, CurvedTouchRows
from ribbon.problems.fields import Fields
from ribbon.problems.friction.particles import ParticleRows, Rub
from ribbon.problems.friction.term import Friction, grouped
from ribbon.problems.itself.pairs import BEYOND, BEYOND_ROUND, Pair, PairRows
from ribbon.problems.layout import STRIDE, MixedLayout
from ribbon.problems.protocol import Anchor, Counters
from ribbon.problems.touching import Touch, TouchRows
from ribbon.strip import Strip

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Quaternion of half a turn about the tangent: the seam of a Moebius band.
HALF_TURN = np.array([0.0, 0.0, 0.0, 1.0])
#: Part of a clamp's tangent along a wall's normal that is rounding.
_ALONG = 1e-12
#: How near (l) two ends are that are joined.
JOINED = 1e-9


@dataclass(frozen=True)
class Held:
    """Fields of a glued ribbon and what holds it.

    strip, gravity, energy, lengths: as in `ribbon.problems.chained.ChainedProblem`; start, end: clamps or None (free
    end); closure: of a band, then `end` is None; walls: planes and round obstacles; held_by: "elimination" or
    "constraints"; reference: quaternion (4,) to which the gauge of free rotations refers, the start's of the seed, and
    origin (3,) the same for positions; box: bounds on |omega| and |eta| that keep a far start from running away; a
    solution must not touch them; model: "mixed", or the formulation that finds the point ("matrix", "chained"), for
    comparison; stiffness, in_plane: `ribbon.problems.fields.Fields`; tip: dead force (3,) at s = l, D w / l^2, or
    None; touching: points between the joints that are held on a wall's side too; apart: distance (l) that far parts of
    the strip keep from each other, 0: they may pass through each other; pairs: places of it that are held so; round: it
    touches itself as a round rod of diameter `apart` about its centreline, not with its surface; rubs: particles that
    walls with friction push, in an increment of a path (`ribbon.find.friction`).
    """

    strip: Strip
    start: Clamp | None
    end: Clamp | None
    closure: Closure | None
    walls: tuple[Barrier, ...]
    gravity: Gravity | None
    energy: str
    lengths: FloatArray
    held_by: str = "elimination"
    reference: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)
    origin: tuple[float, ...] = (0.0, 0.0, 0.0)
    exponent_limit: float = EXPONENT_LIMIT
    box: tuple[float, float] | None = None
    model: str = "mixed"
    stiffness: str | None = None
    in_plane: bool | None = None
    tip: tuple[float, float, float] | None = None
    touching: tuple[Touch, ...] = ()
    apart: float = 0.0
    pairs: tuple[Pair, ...] = ()
    round: bool = False
    rubs: tuple[Rub, ...] = ()
    counters: Counters = field(default_factory=Counters, compare=False)
    _cache: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def formulation(self) -> str:
        """The model's name."""
        return self.model

    def __post_init__(self) -> None:
        chosen(self.energy, self.strip)
        if self.held_by not in ("elimination", "constraints"):
            raise RibbonInputError("held_by", self.held_by, 'use "elimination" or "constraints"')
        if self.closure is not None and self.end is not None:
            raise RibbonInputError("closure", self.closure.kind, "a closed band has no clamp at its end; remove one")

    # -- sizes and switches -------------------------------------------------------------------------------------------

    @cached_property
    def size(self) -> int:
        """Number of unknowns, 10 p + 9, p + 1 for an in-plane curvature and one for every pressure plate."""
        return self.layout.size

    @cached_property
    def fields(self) -> Fields:
        """What bends the strip, and the energy's arguments for the kernels."""
        return Fields.of(self.strip, self.energy, self.stiffness, self.in_plane)

    @cached_property
    def material(self) -> Material:
        """What the elastic energy depends on, for the kernels."""
        return Material.of(self.strip, self.fields, self.lengths)

    @property
    def sideways(self) -> int:
        """First column of the in-plane curvatures, -1 without."""
        return self.layout.sideways.start if self.fields.in_plane else -1

    @cached_property
    def layout(self) -> MixedLayout:
        """Where the unknowns stand."""
        return MixedLayout(self.lengths.size, len(self.plates), self.fields.in_plane)

    @property
    def plates(self) -> tuple[int, ...]:
        """Indices of the walls that are pressure plates."""
        return tuple(k for k, wall in enumerate(self.walls) if wall.stiffness is not None)

    @property
    def obstacles(self) -> bool:
        """Whether some of the walls are round."""
        return any(isinstance(wall, Obstacle) for wall in self.walls)

    @property
    def has_gravity(self) -> bool:
        """Whether weight acts."""
        return self.gravity is not None and self.strip.gamma > 0

    @property
    def has_natural_curvature(self) -> bool:
        """Whether the strip is naturally curved; otherwise the term is absent."""
        return not self.strip.naturally_straight

    @property
    def half_width(self) -> float:
        """w / (2 l)."""
        return 0.5 * self.strip.relative_width

    @property
    def last(self) -> int:
        """First column of the last joint."""
        return self.layout.last

    @property
    def _level(self) -> int:
        if not self.has_gravity:
            return 0
        return 2 if self._gravity_arguments()[2] else 1

    def _gravity_arguments(self) -> tuple[float, FloatArray, bool]:
        """Gamma, up, and whether the surface is weighed apart from its centreline: sections that are square to the
        centreline have their middle on it."""
        if self.gravity is None or not self.has_gravity:
            return 0.0, np.zeros(3), False
        return float(self.strip.gamma), np.asarray(self.gravity.up), self.gravity.exact and not self.fields.free

    def with_changes(self, **changes: Any) -> Self:
        """The same problem with fields replaced and nothing cached."""
        return replace(self, counters=Counters(), _cache={}, **changes)

    def limits(self, travel: float) -> FloatArray:
        """How far each of the unknowns (size,) may go in a step in which no joint's position goes farther than
        `travel` (l)."""
        found = np.full(self.size, np.inf)
        self.layout.positions(found)[:] = travel
        return found

    def joint_values(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """omega and eta (p + 1,) at the joints, of unknowns or of a mode."""
        return x[self.layout.omega].copy(), x[self.layout.eta].copy()

    def in_plane_values(self, x: FloatArray) -> FloatArray | None:
        """In-plane curvature (p + 1,) at the joints; None without."""
        return x[self.layout.sideways].copy() if self.fields.in_plane else None

    def anchor(self, x: FloatArray) -> Anchor:
        """Quaternion and position of the start of the shape x."""
        first = self.layout.joint(0)
        return tuple(x[first.quaternion].tolist()), tuple(x[first.position].tolist())

    def anchored(self, anchor: Anchor) -> Self:
        """The problem with its gauges and the signs of its quaternions referring to `anchor`; unchanged for None."""
        return self if anchor is None else self.with_changes(reference=anchor[0], origin=anchor[1])

    # -- what holds the ribbon ----------------------------------------------------------------------------------------

    def _scaled(self, clamp: Clamp) -> FloatArray | None:
        return None if clamp.position is None else np.asarray(clamp.position) / self.strip.length

    @cached_property
    def start_position(self) -> FloatArray | None:
        """r (3,) held at s = 0, units of l, or None."""
        return None if self.start is None else self._scaled(self.start)

    @cached_property
    def start_quaternion(self) -> FloatArray | None:
        """Quaternion (4,) held at s = 0, of the sign of the reference, or None."""
        if self.start is None or not self.start.holds_frame:
            return None
        q = quaternion.from_matrix(self.start.frame)
        return -q if q @ np.asarray(self.reference) < 0 else q

    @cached_property
    def end_position(self) -> FloatArray | None:
        """r (3,) held at s = l, units of l, or None."""
        return None if self.end is None else self._scaled(self.end)

    @cached_property
    def end_quaternion(self) -> FloatArray | None:
        """Quaternion (4,) held at s = l, or None."""
        return quaternion.from_matrix(self.end.frame) if self.end is not None and self.end.holds_frame else None

    @cached_property
    def slack(self) -> float | None:
        """By how much (l) the held ends are nearer to each other than the strip is long; below 0 where they are farther
        apart; None where no two points are held."""
        if self.start_position is None or self.end_position is None:
            return None
        return 1.0 - float(np.linalg.norm(self.end_position - self.start_position))

    @property
    def seam(self) -> FloatArray:
        """Quaternion delta (4,) of the seam: q_p = +- q_0 o delta."""
        return HALF_TURN if self.closure is not None and self.closure.sign < 0 else np.array([1.0, 0.0, 0.0, 0.0])

    @property
    def slides(self) -> bool:
        """Whether the seam of a Moebius band may slide along it without changing anything (thesis, 6.1.1).

        The ruling is straight somewhere on every such band, as eta(l) = -eta(0): the middle of the first segment is put
        there, where a segment's linear eta serves a Wunderlich event best.
        """
        return (
            self.closure is not None
            and self.closure.sign < 0
            and self.closure.ruling == "free"
            and not self.walls
            and not self.has_gravity
            and not self.has_natural_curvature
        )

    @cached_property
    def spins(self) -> bool:
        """Whether it is a round rod that nothing but itself touches and that may turn about the axis of both its ends,
        and, as a ring, slide along itself, for nothing (`ribbon.problems.alike.ring`)."""
        if not (self.round and self.apart) or self.walls or self.has_gravity or self.rubs or self.tip is not None:
            return False
        alike = self.strip.naturally_straight and ring.bends_alike(self.fields)
        return alike and ring.coaxial(self.start, self.end, self.closure)

    @property
    def _turned(self) -> FloatArray:
        """Quaternion (4,) of the start, or of what it is held at where nothing holds it."""
        return np.asarray(self.reference) if self.start_quaternion is None else self.start_quaternion

    def idle_rows(self, x: FloatArray) -> IntArray:
        """Rows that hold nothing at x (n,) of what they are for, and are left out where stability is judged."""
        where = self.block_slices().get("gauge_ring")
        if where is None or not ring.idle(self.blocks()["gauge_ring"], self.layout, x, self._turned):
            return np.empty(0, dtype=np.int64)
        return np.array([where.start])

    @property
    def start_straight(self) -> bool:
        """Whether eta = 0 at s = 0, or the twist where it is free and its energy knows of clamped edges."""
        return self.fields.held_straight and self._straight(self.start)

    @property
    def end_straight(self) -> bool:
        """Whether eta = 0 at s = l, or the twist."""
        return self.fields.held_straight and self._straight(self.end)

    def _straight(self, clamp: Clamp | None) -> bool:
        return (clamp is not None and clamp.ruling == "straight") or (
            self.closure is not None and self.closure.ruling == "straight"
        )

    def free_motions(self) -> tuple[FloatArray, FloatArray]:
        """Unit translations (k, 3) and axes of rotation (m, 3) that change neither energy nor constraints."""
        if self.rubs:
            return np.empty((0, 3)), np.empty((0, 3))
        if self.obstacles:
            return self._motions_beside_obstacles()
        fixed = [] if self.gravity is None or not self.has_gravity else [np.asarray(self.gravity.up)]
        fixed += [np.asarray(wall.normal) for wall in self.walls if isinstance(wall, Wall)]
        fixed += [] if self.tip is None else [np.asarray(self.tip) / np.linalg.norm(self.tip)]
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

    def _motions_beside_obstacles(self) -> tuple[FloatArray, FloatArray]:
        loads = [] if self.gravity is None or not self.has_gravity else [np.asarray(self.gravity.up)]
        loads += [] if self.tip is None else [np.asarray(self.tip) / np.linalg.norm(self.tip)]
        points = [r for r in (self.start_position, self.end_position) if r is not None]
        turns = self.start_quaternion is None and self.end_quaternion is None
        return motions.free([wall.scaled(self.strip.length) for wall in self.walls], loads, points, turns)

    def blocks(self) -> dict[str, Rows]:
        """The rows beside the glue, by name, in order."""
        if "blocks" not in self._cache:
            self._cache["blocks"] = self._make_blocks()
        return self._cache["blocks"]  # type: ignore[no-any-return]

    def wall_rows(self, wall: int) -> WallRows | CurvedJointRows:
        """The rows that hold the joints on the side of one wall."""
        rows = self.blocks()[f"wall_{wall}"]
        assert isinstance(rows, WallRows | CurvedJointRows)
        return rows

    def touch_rows(self, wall: int) -> TouchRows:
        """The rows that hold points between the joints there; KeyError where there are none."""
        rows = self.blocks()[f"touch_{wall}"]
        assert isinstance(rows, TouchRows)
        return rows

    def _make_blocks(self) -> dict[str, Rows]:
        found: dict[str, Rows] = {}
        first, last = self.layout.joint(0), self.layout.joint(-1)
        start, turned = self.start_position, self.start_quaternion
        if self.held_by == "constraints":
            if start is not None:
                found["start_position"] = LinearRows(np.eye(3), first.position, start)
            if turned is not None:
                found["start_frame"] = LinearRows(np.eye(4), first.quaternion, turned)
        translations, axes = self.free_motions()
        if turned is None and len(axes) < 3:
            found["start_norm"] = UnitRow(first.quaternion)
        if 0 < len(translations) < 3:
            found["gauge_position"] = LinearRows(translations, first.position, translations @ np.asarray(self.origin))
        if len(axes) == 1:
            spun = 0.5 * quaternion.compose(np.concatenate([[0.0], axes[0]]), self.reference)
            found["gauge_frame"] = LinearRows(spun[None, :], first.quaternion, np.zeros(1))
        end, held = self.end_position, self.end_quaternion
        if end is not None:
            found["end_position"] = LinearRows(np.eye(3), last.position, end)
        if held is not None:
            found["end_frame"] = LinearRows(imaginary_part(held), last.quaternion, np.zeros(3))
        if self.closure is not None:
            ends_meet = np.hstack([-np.eye(3), np.eye(3)])
            found["end_position"] = LinearRows(ends_meet, np.concatenate([first.position, last.position]), np.zeros(3))
            found["end_frame"] = SeamRows(first.quaternion, last.quaternion, self.seam)
            pair = np.array([[-float(self.closure.sign), 1.0]])
            found["seam_omega"] = LinearRows(pair, np.array([first.omega, last.omega]), np.zeros(1))
            if self.slides:
                second = self.layout.joint(1)
                both = [first.omega, second.omega] if self.fields.free else [first.eta, second.eta]
                found["gauge_slide"] = LinearRows(np.ones((1, 2)), np.array(both), np.zeros(1))
            if not self._straight(None) or not self.fields.held_straight:
                # the twist eta omega keeps its sign where both change theirs
                same = np.array([[-1.0, 1.0]]) if self.fields.free else pair
                found["seam_eta"] = LinearRows(same, np.array([first.eta, last.eta]), np.zeros(1))
            if self.fields.in_plane:
                ends = np.array([self.layout.sideways.start, self.layout.sideways.stop - 1])
                found["seam_in_plane"] = LinearRows(pair, ends, np.zeros(1))
        if self.spins:
            where = np.asarray(self.origin if start is None else start)
            found["gauge_ring"] = ring.gauge(self.layout, where, self._turned, self.joined)
        found.update(self._wall_blocks())
        if self.pairs:
            found["pairs"] = self._pair_rows()
        return found

    @property
    def reach(self) -> float:
        """How far (l) to either side of the centreline it touches itself: half the width, of a round rod nowhere."""
        return 0.0 if self.round else self.half_width

    @property
    def joined(self) -> bool:
        """Whether it ends where it begins: closed, or held so by its clamps."""
        if self.closure is not None or self.start is None or self.end is None:
            return self.closure is not None
        first, last = self.start.position, self.end.position
        if first is None or last is None:
            return False
        return bool(np.abs(np.subtract(first, last)).max() < JOINED * self.strip.length)

    def beside(self, segment: int, step: int) -> int | None:
        """The segment behind (step 1) or before (-1) another one; None: the strip ends there."""
        found, count = segment + step, self.lengths.size
        return found % count if self.joined or 0 <= found < count else None

    def pair_rows(self) -> PairRows:
        """The rows that hold places of the strip apart; KeyError where there are none."""
        rows = self.blocks()["pairs"]
        assert isinstance(rows, PairRows)
        return rows

    def _pair_rows(self) -> PairRows:
        segments = np.array([[self.segment_at(s) for s in (pair.s, pair.s_other)] for pair in self.pairs]).T
        lines = self.round or all(pair.stays for pair in self.pairs)
        over = np.full((2, self.lengths.size), BEYOND_ROUND if lines else BEYOND)
        if not self.joined:  # nothing is beyond the strip's ends
            over[0, 0] = over[1, -1] = 0.0
        return PairRows(
            self.pairs, self.apart, segments, self.lengths, self.reach, self.exponent_limit,
            self.fields.components, self.fields.free, self.sideways, over,
        )  # fmt: skip

    @cached_property
    def friction(self) -> Friction | None:
        """What friction adds to the energy; None where nothing rubs."""
        return Friction(self.rubs, grouped(self.rubs, self._particle_rows)) if self.rubs else None

    def _particle_rows(self, rubs: list[Rub], along: FloatArray) -> ParticleRows:
        starts = np.concatenate([[0.0], np.cumsum(self.lengths)])
        i = np.array([self.segment_at(rub.s) for rub in rubs])
        return ParticleRows(
            i, np.array([rub.particle for rub in rubs]) - starts[i], np.array([rub.side for rub in rubs]),
            np.zeros(len(rubs), dtype=bool), self.lengths, np.zeros(3), along, self.half_width, self.exponent_limit,
            self.fields.components, self.fields.free, self.sideways,
        )  # fmt: skip

    def _wall_blocks(self) -> dict[str, Rows]:
        found: dict[str, Rows] = {}
        plate = self.layout.ribbon
        for k, wall in enumerate(self.walls):
            column = -1
            if wall.stiffness is not None:
                column, plate = plate, plate + 1
            oblique = 0.0 if self.fields.free else 1.0
            touches = [touch for touch in self.touching if touch.wall == k]
            if isinstance(wall, Obstacle):
                surface = wall.scaled(self.strip.length)
                joints = self._joints_apart(self._joints_beside(surface), touches)
                found[f"wall_{k}"] = CurvedJointRows(joints, STRIDE, surface, self.half_width, oblique=oblique)
                if touches:
                    found[f"touch_{k}"] = self._touch_rows(touches, np.zeros(3), np.zeros(3), -1, surface)
                continue
            point = np.asarray(wall.point) / self.strip.length
            normal = np.asarray(wall.normal)
            joints = self._joints_apart(self._joints_beside(normal), touches)
            found[f"wall_{k}"] = WallRows(joints, STRIDE, point, normal, self.half_width, column, oblique=oblique)
            if touches:
                found[f"touch_{k}"] = self._touch_rows(touches, point, normal, column)
        return found

    def _joints_apart(self, joints: IntArray, touches: list[Touch]) -> IntArray:
        """The joints without those at which both edges are held by rows of a segment beside them that slide: their own
        rows would say the same twice."""
        held = np.zeros((2, self.lengths.size + 1), dtype=bool)
        for touch in touches:
            if touch.slides and abs(touch.side) == 1.0:
                i = self.segment_at(touch.s)
                held[int(touch.side < 0.0), i : i + 2] = True
        return joints[~held.all(axis=0)[joints]]

    def segment_at(self, s: float) -> int:
        """The segment around an abscissa, the one behind it where it is a joint's."""
        starts = np.concatenate([[0.0], np.cumsum(self.lengths)])
        return int(np.clip(np.searchsorted(starts, s, side="right") - 1, 0, self.lengths.size - 1))

    def _joints_beside(self, wall: FloatArray | Obstacle) -> IntArray:
        """The joints whose distance from a plane of this normal, or from an obstacle in units of l, is not given by a
        clamp or by the joint at the seam."""
        joints = np.arange(self.lengths.size + 1)
        if self._edge_is_held(self.start, self.start_straight, wall):
            joints = joints[1:]
        if self.closure is not None or self._edge_is_held(self.end, self.end_straight, wall):
            joints = joints[:-1]
        return joints

    def _edge_is_held(self, clamp: Clamp | None, straight: bool, wall: FloatArray | Obstacle) -> bool:
        """Whether a clamp leaves no edge a motion along the normal: an oblique ruling reaches along the tangent."""
        if clamp is None or not clamp.is_whole:
            return False
        if straight or self.fields.free:
            return True
        if isinstance(wall, Obstacle):
            middle, across = np.asarray(clamp.position) / self.strip.length, self.half_width * clamp.frame[:, 0]
            normals = wall.derivatives(np.array([middle + across, middle - across]))[1]
        else:
            normals = wall[None, :]
        return float(np.abs(normals @ clamp.frame[:, 2]).max()) < _ALONG

    def _touch_rows(
        self, touches: list[Touch], point: FloatArray, normal: FloatArray, plate: int, surface: Obstacle | None = None
    ) -> TouchRows:
        starts = np.concatenate([[0.0], np.cumsum(self.lengths)])
        s = np.array([touch.s for touch in touches])
        i = np.array([self.segment_at(touch.s) for touch in touches])
        parts = (
            i, np.minimum(s - starts[i], self.lengths[i]), np.array([touch.side for touch in touches]),
            np.array([touch.slides for touch in touches]), self.lengths, point, normal, self.half_width,
            self.exponent_limit, self.fields.components, self.fields.free, self.sideways, plate,
        )  # fmt: skip
        return TouchRows(*parts) if surface is None else CurvedTouchRows(*parts, surface=surface)

    # -- the problem --------------------------------------------------------------------------------------------------

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the unknowns; what is eliminated is fixed."""
        upper = np.full(self.size, np.inf)
        layout = self.layout
        first, last = layout.joint(0), layout.joint(-1)
        if not self.fields.free:
            upper[layout.slope] = 1.0 / self.half_width
        if self.box is not None:
            upper[layout.omega] = self.box[0]
            upper[layout.eta] = self.box[1]
        lower = -upper
        translations, axes = self.free_motions()
        fixed: list[tuple[IntArray, FloatArray]] = []
        if self.held_by == "elimination":
            if self.start_position is not None:
                fixed.append((first.position, self.start_position))
            if self.start_quaternion is not None:
                fixed.append((first.quaternion, self.start_quaternion))
        if len(translations) == 3:
            fixed.append((first.position, np.asarray(self.origin)))
        if len(axes) == 3:
            fixed.append((first.quaternion, np.asarray(self.reference)))
        if self.start_straight:
            fixed.append((np.array([first.eta]), np.zeros(1)))
        if self.end_straight:
            fixed.append((np.array([last.eta]), np.zeros(1)))
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

    @property
    def row_count(self) -> int:
        """Number of rows: the glue's and the blocks'."""
        return kernels.ROWS * self.lengths.size + sum(rows.count for rows in self.blocks().values())

    def block_slices(self) -> dict[str, slice]:
        """Where the rows of each block stand."""
        at = kernels.ROWS * self.lengths.size
        found = {}
        for name, rows in self.blocks().items():
            found[name] = slice(at, at + rows.count)
            at += rows.count
        return found


def _complement(directions: FloatArray) -> FloatArray:
    """Orthonormal rows (k, 3) orthogonal to all `directions` (m, 3)."""
    _, singular, rows = np.linalg.svd(directions)
    rank = int((singular > 1e-9).sum())
    return rows[rank:]
