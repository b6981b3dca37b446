"""What is asked of the shell: a strip with its clamps, loads and path, validated before dolfinx is touched."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sized
from dataclasses import asdict, dataclass
from typing import Any

from ribbonbench import statics
from shellref import law
from shellref.contact.limits import check_contact, points_of
from shellref.contact.obstacles import Obstacle
from shellref.contact.walls import FACES, MIDSURFACE, SURFACES, Wall, depth
from shellref.holds import parts
from shellref.inputs import (
    FRAME_TOLERANCE,
    Matrix,
    ShellInputError,
    Vector,
    build,
    choice,
    frame,
    integer,
    number,
    numbers,
    plain,
    positive,
)
from shellref.law import Law
from shellref.shell.material import SHEAR_FACTOR

CLAMPS = ("edge", "corners", "free")
SECTIONS = ("undeformed", "free")
MOST_DEGREE = 5
FEWEST_CLOSED = 6  # elements along a closed strip
IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Pose:
    """Where a clamp is: position (3,) of the centreline (units l), frame (3, 3) with columns t_x t_y t_z."""

    position: Vector
    frame: Matrix

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", numbers("position", self.position, 3))
        object.__setattr__(self, "frame", frame("frame", self.frame))

    @classmethod
    def read(cls, key: str, value: Any) -> Pose | None:
        """A pose from itself, from a mapping of its fields, or None."""
        if value is None or isinstance(value, Pose):
            return value
        if not isinstance(value, Mapping) or set(value) != {"position", "frame"}:
            raise ShellInputError(key, value, "must be a table with the keys position and frame")
        try:
            return cls(value["position"], value["frame"])
        except ShellInputError as error:
            raise ShellInputError(f"{key}.{error.key}", error.value, error.remedy) from None


@dataclass(frozen=True)
class Waypoint:
    """A place on the way to the problem's own state; what is None stays as it is.

    natural, gravity, tip: fractions of the natural curvature (0: that of the start), of the weight and of the force at
    the end. start, end: poses of the clamps, reached on straight lines with frames turning about a fixed axis. Where
    waypoints move the clamp at S = 0, the path begins at the first pose that they give it. walls: points of all walls,
    reached on straight lines; where waypoints move walls, the path begins where the first of them has them; obstacles:
    the same of obstacles.
    """

    natural: float | None = None
    gravity: float | None = None
    start: Pose | None = None
    end: Pose | None = None
    name: str = "path"
    tip: float | None = None
    walls: tuple[Vector, ...] | None = None
    obstacles: tuple[Vector, ...] | None = None

    def __post_init__(self) -> None:
        for key in ("natural", "gravity", "tip"):
            value = getattr(self, key)
            if value is not None:
                object.__setattr__(self, key, number(f"path.{key}", value))
        for key in ("start", "end"):
            object.__setattr__(self, key, Pose.read(f"path.{key}", getattr(self, key)))
        for key in ("walls", "obstacles"):
            if getattr(self, key) is not None:
                object.__setattr__(self, key, points_of(f"path.{key}", getattr(self, key)))
        if not isinstance(self.name, str):
            raise ShellInputError("path.name", self.name, "must be a text")

    @property
    def for_walls(self) -> bool:
        """Whether it moves walls and obstacles alone."""
        return self.natural is self.gravity is self.start is self.end is self.tip is None

    @classmethod
    def read(cls, value: Any) -> Waypoint:
        """A waypoint from itself or from a mapping of its fields."""
        if isinstance(value, Waypoint):
            return value
        waypoint: Waypoint = build(cls, "path", value)
        return waypoint


@dataclass(frozen=True)
class ShellProblem:
    """A strip of length 1 with its clamps, natural curvature and weight, and the path to that state.

    width, thickness: over the length, > 0. poisson: in (-1, 0.5].
    natural_curvature: K l at S = 0 and S = 1, linear between, or points (S, K l) of a table (`shellref.law`);
    k_nat = K e_S (x) e_S. Positive curvature turns the tangent towards -t_y (t_z' = -K t_y). transverse_curvature: that
    of the unstressed strip's section (a tape spring), convex towards t_y when positive (bending stiffness:
    docs/theory.md, eq. (7.16)); clamps hold the curved section. natural_twist, natural_geodesic_curvature: kappa_3 l
    and kappa_2 l of the unstressed strip, laws as well; with one of them the reference surface is curved
    (`shellref.shell.midsurface.Ruled`) and has natural_curvature in it.
    gamma: rho h g l^3 / D, weight against bending stiffness; `up` (3,): unit vector against gravity, None = weightless.
    clamp: "edge" holds the whole edge S = 0, "corners" its two corner cells, "free" nothing (weightless only).
    clamp_position (3,), clamp_frame (3, 3) with columns t_x (across), t_y (normal), t_z (tangent). end: the pose of the
    clamp at S = 1, of the same kind; None = free. guided: of `end` the frame is held and the position is free: what is
    held there moves as one, without turning (one process only). tip (3,): dead force at S = 1, in D w / l^2, spread
    evenly over the end edge, so that it has no moment about the edge's middle.
    slide: unit vectors along which the held edges at S = 0 and S = 1 slide freely; None: they do not. turns: of `end`
    the position is held, and the rigid edge turns freely about t_x through it (no guide). sections, at S = 0 and S = 1:
    "undeformed" edges are rigid, "free" ones stay in the plane across the tangent, with their middle held and the rest
    of them free in it. What slides, turns or is free needs one process and clamp = "edge". corner:
    size (over l) of the corner cells; None: one cell of the mesh.
    start_curvature: the path starts from the planar arc of this curvature, unstressed there, with the end clamp where
    the arc ends; None: the natural curvature (the flat strip where that is no equilibrium).
    half_turns: the ends are joined after so many half turns about the tangent (0 a circle, 1 or -1 a Moebius band, two
    hands), None: the strip is open. A closed strip is held at its seam (clamp "edge") or nowhere ("free"); its path
    begins with a circle of curvature start_curvature, whole turns of it.
    holds: what is held at S = 0 and S = 1 (shellref.holds.parts): "all", "frame" (at S = 1 that is `guided`),
    "position", "section" or "nothing"; of what is not held clamp_position, clamp_frame and `end` say where the
    beginning has it. The section of "position" is `sections`: "undeformed" is a straight edge that turns, "free" one of
    which the middle is held. Rigid motions that nothing resists are taken out.
    path: waypoints before the problem's own state.
    walls: planes that it cannot cross (shellref.contact.walls.Wall); contact: what of it meets them,
    its "midsurface" or both "faces". A strip that nothing holds may have weight where walls carry it.
    shear_factor: k of the transverse shear stiffness k G h (docs/theory.md, eq. (7.4)); large: none.
    obstacles: bodies that it cannot enter or leave (shellref.contact.obstacles.Obstacle), met as
    walls are. apart: distance (over l) that parts of it which face each other keep, middle surface from middle surface
    (shellref.contact.pairs); None: it may run through itself. tip_moment (3,): moment of fixed direction on the mean
    frame of the end edge (shellref.holds.moment), in D w / l; the start is held as a whole and the end may turn (one
    process only).
    elements: (along, across). degree: of the elements, 2 or more. grading: size of the first element at a clamp, and of
    the elements at the two long edges, over the size of the even ones in the middle, in (0, 1]; 1 is an even mesh.
    edge_layer: width of the layer (over l) that gets two elements at clamps and edges instead of `grading`; "auto":
    sqrt(h / curvature).
    """

    width: float
    thickness: float
    poisson: float
    natural_curvature: Law = (0.0, 0.0)
    gamma: float = 0.0
    up: Vector | None = None
    clamp_position: Vector = (0.0, 0.0, 0.0)
    clamp_frame: Matrix = IDENTITY
    clamp: str = "edge"
    elements: tuple[int, int] = (100, 4)
    grading: tuple[float, float] = (0.2, 1.0)
    end: Pose | None = None
    corner: float | None = None
    transverse_curvature: float = 0.0
    start_curvature: float | None = None
    path: tuple[Waypoint, ...] = ()
    edge_layer: float | str | None = None
    degree: int = 2
    tip: Vector | None = None
    guided: bool = False
    slide: tuple[Vector | None, Vector | None] = (None, None)
    turns: bool = False
    sections: tuple[str, str] = ("undeformed", "undeformed")
    half_turns: int | None = None
    holds: tuple[str, str] = (parts.ALL, parts.ALL)
    walls: tuple[Wall, ...] = ()
    contact: str = MIDSURFACE
    natural_twist: Law = (0.0, 0.0)
    natural_geodesic_curvature: Law = (0.0, 0.0)
    shear_factor: float = SHEAR_FACTOR
    obstacles: tuple[Obstacle, ...] = ()
    apart: float | None = None
    tip_moment: Vector | None = None

    def __post_init__(self) -> None:
        def put(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        put("width", positive("width", self.width))
        put("thickness", positive("thickness", self.thickness))
        put("poisson", number("poisson", self.poisson))
        put("shear_factor", positive("shear_factor", self.shear_factor))
        if not -1.0 < self.poisson <= 0.5:
            raise ShellInputError("poisson", self.poisson, "must lie above -1 and not above 0.5")
        for name in ("natural_curvature", "natural_twist", "natural_geodesic_curvature"):
            why = law.fault(getattr(self, name))
            if why is not None:
                raise ShellInputError(name, getattr(self, name), why)
            put(name, law.plain(getattr(self, name)))
        put("transverse_curvature", number("transverse_curvature", self.transverse_curvature))
        if abs(self.transverse_curvature) * self.width >= math.pi:
            raise ShellInputError(
                "transverse_curvature", self.transverse_curvature, "the section must turn by less than half a turn"
            )
        put("gamma", number("gamma", self.gamma))
        if self.gamma < 0:
            raise ShellInputError("gamma", self.gamma, "must not be negative: turn `up` round instead")
        if self.up is not None:
            put("up", numbers("up", self.up, 3))
            if abs(math.hypot(*self.up) - 1.0) > FRAME_TOLERANCE:
                raise ShellInputError("up", self.up, "must be a unit vector (to 1e-9)")
        elif self.gamma > 0:
            raise ShellInputError("up", None, "a unit vector is needed when gamma is above 0")
        put("clamp_position", numbers("clamp_position", self.clamp_position, 3))
        put("clamp_frame", frame("clamp_frame", self.clamp_frame))
        put("clamp", choice("clamp", self.clamp, CLAMPS))
        put("end", Pose.read("end", self.end))
        if self.tip is not None:
            put("tip", numbers("tip", self.tip, 3))
        if self.tip_moment is not None:
            put("tip_moment", numbers("tip_moment", self.tip_moment, 3))
        if not isinstance(self.guided, bool):
            raise ShellInputError("guided", self.guided, "must be true or false")
        if self.guided and self.end is None:
            raise ShellInputError("guided", True, "is about a clamp at the end: add `end`")
        self._check_holds(put)
        self._check_edges(put)
        self._check_rest()
        self._check_pull()
        self._check_moment()
        self._check_walls(put)
        check_contact(self, put)
        self._check_path(put)
        self._check_mesh(put)
        if self.half_turns is not None:
            self._check_closed(put)

    def _check_pull(self) -> None:
        """A force at S = 1 does work there: nothing holds the point, or it slides, and not across the force."""
        if not self.pulled or not parts.at_a_point(self.ends[1]):
            return
        along, force = self.slide[1], self.tip or ()
        if along is None:
            remedy = "pulls at an end that `end` holds: leave one of them out, guide it, or let it slide"
            raise ShellInputError("tip", self.tip, remedy)
        if abs(sum(a * b for a, b in zip(along, force, strict=True))) <= FRAME_TOLERANCE * math.hypot(*force):
            raise ShellInputError("tip", self.tip, "pulls across the way on which `end` slides: leave it out")

    def _check_moment(self) -> None:
        """A moment at S = 1 does work there, and the strip does not spin."""
        if not self.twisted:
            return
        if self.closed:
            raise ShellInputError("tip_moment", self.tip_moment, "turns an end, and a closed strip has none")
        if self.ends[0] != parts.ALL:
            remedy = "spins a strip whose start turns: hold position and frame of the start"
            raise ShellInputError("tip_moment", self.tip_moment, remedy)
        if self.ends[1] not in (parts.NOTHING, parts.POSITION) and not self.turns:
            remedy = "turns an end whose section `end` holds: leave one of them out, or hold the position alone"
            raise ShellInputError("tip_moment", self.tip_moment, remedy)

    def _check_rest(self) -> None:
        """What a strip that is no plane at rest allows."""
        if not self.shaped:
            return
        first = "natural_twist" if any(law.sizes(self.natural_twist)) else "natural_geodesic_curvature"
        if max(law.sizes(self.natural_geodesic_curvature)) * self.width >= 2.0:
            raise ShellInputError(
                "natural_geodesic_curvature", self.natural_geodesic_curvature,
                f"must stay below 2 / width = {2.0 / self.width:g}: the inner edge would have no length",
            )  # fmt: skip
        for key, given in (
            ("transverse_curvature", bool(self.transverse_curvature)), ("half_turns", self.half_turns is not None),
            ("clamp", self.clamp == "corners"), ("sections", "free" in self.sections), ("turns", self.turns),
            ("holds", self.partly_held), ("start_curvature", self.start_curvature is not None),
        ):  # fmt: skip
            if given:
                remedy = f"is for strips that are plane at rest or naturally bent: leave it out, or {first}"
                raise ShellInputError(key, getattr(self, key), remedy)

    def _check_holds(self, put: Any) -> None:
        """What is held of each end."""
        if isinstance(self.holds, str) or not isinstance(self.holds, Sized) or len(self.holds) != 2:
            raise ShellInputError("holds", self.holds, "must be two values, for the start and for the end")
        put("holds", tuple(choice("holds", x, parts.PARTS) for x in self.holds))
        if self.guided:
            put("holds", (self.holds[0], parts.FRAME))
        if not self.partly_held:
            return
        if self.holds[1] == parts.FRAME and not self.guided:
            raise ShellInputError("holds", self.holds, "the end's frame alone is held where `guided` is true")
        if self.holds[1] in (parts.POSITION, parts.SECTION) and self.end is None:
            raise ShellInputError("end", None, "must say where the end is held")
        if self.holds[1] == parts.NOTHING and self.end is not None:
            raise ShellInputError("end", self.end, "is a clamp at an end that nothing holds: remove it")
        if self.clamp != "edge":
            raise ShellInputError("clamp", self.clamp, 'must be "edge" where a part of an end is held')
        if self.transverse_curvature or self.turns:
            remedy = "a curved section is held as a whole, or turns at its end: use holds = all"
            raise ShellInputError("holds", self.holds, remedy)
        if self.closed and self.holds[0] not in (parts.ALL, parts.POSITION):
            raise ShellInputError("holds", self.holds, 'a closed strip is held at its seam, or use clamp = "free"')
        if self.closed and self.holds[0] == parts.POSITION and self.sections[0] != "free":
            raise ShellInputError("sections", self.sections, "must be free where a closed strip is held at a point")
        if (self.loaded or self.pulled) and not any(map(parts.at_a_point, self.ends)) and not self.walls:
            raise ShellInputError("holds", self.holds, "a strip with loads flies away: hold a position")

    def _check_walls(self, put: Any) -> None:
        """Walls that leave the clamps alone, and carry a strip that nothing else holds."""
        if isinstance(self.walls, (str, bytes, Mapping)) or not isinstance(self.walls, Iterable):
            raise ShellInputError("walls", self.walls, "must be a list of walls")
        put("walls", tuple(Wall.read(item) for item in self.walls))
        put("contact", choice("contact", self.contact, SURFACES))
        if not self.walls:
            return
        lever = 0.5 * self.thickness if self.contact == FACES else 0.0
        for pose in self.held_poses:
            axes, place = list(zip(*pose.frame, strict=True)), pose.position
            corners = [
                [x + a * 0.5 * self.width * t + b * lever * n for x, t, n in zip(place, axes[0], axes[1], strict=True)]
                for a in (-1.0, 1.0) for b in (-1.0, 1.0)
            ]  # fmt: skip
            for k, wall in enumerate(self.walls):
                behind = depth(wall, corners)
                if wall.stiffness is None and behind > statics.BEHIND_WALL:
                    what = "face of a held edge" if lever else "held edge"
                    remedy = f"cuts a clamp: a {what} is {behind:.3g} l behind it; move one of them"
                    raise ShellInputError(f"walls[{k}].point", wall.point, remedy)
        if (
            self.clamp == "free"
            and self.loaded
            and not statics.is_carried([w.normal for w in self.walls], self.up or ())
        ):
            remedy = "no clamp holds the strip and its walls do not carry it: it falls or slides away for ever"
            raise ShellInputError("up", self.up, remedy)

    def _check_closed(self, put: Any) -> None:
        """A strip whose ends are one."""
        if isinstance(self.half_turns, bool) or not isinstance(self.half_turns, int):
            raise ShellInputError("half_turns", self.half_turns, "must be a whole number, or None for an open strip")
        for key, given in (
            ("end", self.end is not None), ("tip", self.pulled), ("slide", any(x is not None for x in self.slide)),
            ("sections", "free" in self.sections and not self.partly_held),
            ("path", any(w.walls is w.obstacles is None or not w.for_walls for w in self.path)),
        ):  # fmt: skip
            if given:
                raise ShellInputError(key, getattr(self, key), "a closed strip has no end of its own: remove it")
        if self.transverse_curvature:
            remedy = "a curved section is not joined here: leave the strip open, or flat across"
            raise ShellInputError("transverse_curvature", self.transverse_curvature, remedy)
        if self.clamp == "corners":
            raise ShellInputError(
                "clamp", self.clamp, 'a closed strip is held at its seam ("edge") or nowhere ("free")'
            )
        if self.elements[0] < FEWEST_CLOSED:
            raise ShellInputError("elements", self.elements, f"a closed strip needs {FEWEST_CLOSED} along, or more")
        if self.start_curvature is None:
            put("start_curvature", math.copysign(2.0 * math.pi, float(law.integral(self.natural_curvature, 1.0))))
        turns = (self.start_curvature or 0.0) / (2.0 * math.pi)
        if not round(turns) or abs(turns - round(turns)) > FRAME_TOLERANCE * abs(turns):
            raise ShellInputError(
                "start_curvature", self.start_curvature, "a closed strip begins as a circle: give a multiple of 2 pi"
            )

    def _check_edges(self, put: Any) -> None:
        """What is free at the held edges."""
        if not isinstance(self.turns, bool):
            raise ShellInputError("turns", self.turns, "must be true or false")
        for name, values in (("slide", self.slide), ("sections", self.sections)):
            if isinstance(values, str) or not isinstance(values, Sized) or len(values) != 2:
                raise ShellInputError(name, values, "must be two values, for the start and for the end")
        slides = tuple(None if x is None else numbers("slide", x, 3) for x in self.slide)
        if any(x is not None and abs(math.hypot(*x) - 1.0) > FRAME_TOLERANCE for x in slides):
            raise ShellInputError("slide", self.slide, "must be unit vectors (to 1e-9)")
        put("slide", slides)
        put("sections", tuple(choice("sections", x, SECTIONS) for x in self.sections))
        at_end = self.turns or slides[1] is not None or (self.sections[1] == "free" and self.holds[1] == parts.ALL)
        if at_end and (self.end is None or self.guided):
            why = "is held there and not guided"
            raise ShellInputError("end", self.end, f"must say where the end {why}, if it slides, turns or is free")
        if (at_end or slides[0] is not None or self.sections[0] == "free") and self.clamp != "edge":
            raise ShellInputError("clamp", self.clamp, 'must be "edge" where an edge slides, turns or is free')
        for part, slide, section in zip(self.holds, slides, self.sections, strict=True):
            if slide is not None and part != parts.ALL and (part != parts.POSITION or section == "free"):
                raise ShellInputError("slide", slide, "a point slides where the section through it is undeformed")
        if self.turns and self.sections[1] == "free":
            raise ShellInputError("sections", self.sections, "must be undeformed at an end that turns")

    def _check_path(self, put: Any) -> None:
        if self.start_curvature is not None:
            put("start_curvature", number("start_curvature", self.start_curvature))
            if self.transverse_curvature and self.start_curvature:
                raise ShellInputError(
                    "start_curvature", self.start_curvature, "a strip with a curved section starts flat: 0"
                )
        if isinstance(self.path, (str, bytes, Mapping)) or not isinstance(self.path, Iterable):
            raise ShellInputError("path", self.path, "must be a list of waypoints")
        put("path", tuple(Waypoint.read(item) for item in self.path))
        if self.clamp == "free":
            if (self.loaded and not self.walls) or self.pulled:
                raise ShellInputError("clamp", "free", "a strip with loads flies away: clamp it, or leave them out")
            moved = bool(self.path) and not all(waypoint.start is waypoint.end is None for waypoint in self.path)
            if self.end is not None or moved or self.clamp_position != (0.0,) * 3 or self.clamp_frame != IDENTITY:
                raise ShellInputError("clamp", "free", "a strip held nowhere has no clamps, poses or path")
        for waypoint in self.path:
            for key, given, own in (
                ("walls", waypoint.walls, self.walls), ("obstacles", waypoint.obstacles, self.obstacles)
            ):  # fmt: skip
                if given is not None and len(given) != len(own):
                    raise ShellInputError(f"path.{key}", given, f"must have a point of each of the {len(own)} {key}")
        if self.end is None:
            for waypoint in self.path:
                if waypoint.end is not None:
                    raise ShellInputError("path.end", waypoint.end, "the problem has no clamp at its end: add `end`")

    def _check_mesh(self, put: Any) -> None:
        if isinstance(self.elements, (str, bytes)) or not isinstance(self.elements, Sized) or len(self.elements) != 2:
            raise ShellInputError("elements", self.elements, "must be two whole numbers (along, across)")
        put("elements", tuple(integer("elements", n, 1) for n in self.elements))
        put("degree", integer("degree", self.degree, 2))
        if self.degree > MOST_DEGREE:
            raise ShellInputError("degree", self.degree, f"must be at most {MOST_DEGREE}")
        put("grading", numbers("grading", self.grading, 2))
        if not all(0 < g <= 1 for g in self.grading):
            raise ShellInputError("grading", self.grading, "must be two numbers above 0 and at most 1")
        if self.corner is not None:
            put("corner", positive("corner", self.corner))
            if self.clamp != "corners":
                raise ShellInputError("corner", self.corner, 'is the size of held corner cells: set clamp = "corners"')
            if not 2 * self.corner < self.width or not 2 * self.corner < 1:
                raise ShellInputError("corner", self.corner, f"two must fit across the width {self.width:g}")
        if self.edge_layer is not None and self.edge_layer != "auto":
            put("edge_layer", positive("edge_layer", self.edge_layer))

    @property
    def shaped(self) -> bool:
        """True when the strip at rest has a twist or a curvature in its plane."""
        return any(any(law.sizes(one)) for one in (self.natural_twist, self.natural_geodesic_curvature))

    @property
    def loaded(self) -> bool:
        """True when the strip weighs something."""
        return self.up is not None and self.gamma > 0

    @property
    def pulled(self) -> bool:
        """True when a force acts at the end."""
        return self.tip is not None and any(self.tip)

    @property
    def twisted(self) -> bool:
        """True when a moment acts at the end."""
        return self.tip_moment is not None and any(self.tip_moment)

    @property
    def closed(self) -> bool:
        """True when the ends are joined."""
        return self.half_turns is not None

    @property
    def slides(self) -> bool:
        """True when every place along a closed strip that nothing holds is as good as the next: it slides freely."""
        size = law.sizes(self.natural_curvature)
        even = self.half_turns is not None and self.half_turns % 2 == 0
        return self.closed and self.clamp == "free" and law.constant(self.natural_curvature) and (even or not any(size))

    @property
    def ends(self) -> tuple[str, str]:
        """What is held of each end, "nothing" of one that is not there or where no clamp is."""
        first = parts.NOTHING if self.clamp == "free" else self.holds[0]
        return first, parts.NOTHING if self.end is None else self.holds[1]

    @property
    def held_poses(self) -> tuple[Pose, ...]:
        """Of the ends that are held as a whole."""
        ends = zip(self.ends, (self.start, None if self.closed else self.end), strict=True)
        return tuple(pose for part, pose in ends if pose is not None and part == parts.ALL)

    @property
    def partly_held(self) -> bool:
        """Whether a part of an end is held (the guide of `guided` alone is not counted), or the end alone."""
        return self.holds[0] != parts.ALL or self.holds[1] not in (parts.ALL, parts.FRAME)

    @property
    def rests(self) -> bool:
        """Whether walls are all that holds it."""
        return self.clamp == "free" and bool(self.walls)

    @property
    def touches(self) -> bool:
        """Whether there is anything that it may touch."""
        return bool(self.walls or self.obstacles) or self.apart is not None

    @property
    def released(self) -> bool:
        """True when a held edge has freedoms of its own."""
        rigid = any(part in (parts.FRAME, parts.SECTION, parts.POSITION) for part in self.holds)
        return rigid or self.turns or any(x is not None for x in self.slide) or "free" in self.sections

    def without_goal(self, goal: str) -> str | None:
        """Why the mesh cannot be refined for this goal (shellref.path.weighted); None: it can."""
        if goal == "surface":
            return None
        if self.twisted:
            return "is not known where a moment acts, which has no potential"
        if self.touches:
            return "is not known where something touches the strip"
        if self.partly_held:
            return "is not known where a part of an end is held"
        if self.released:
            return "is not known for edges that slide, turn or deform"
        if self.transverse_curvature:
            return "is not known for a curved section"
        if self.shaped:
            return "is not known for a strip that is curved at rest"
        if self.closed:
            return "is not known for a closed strip"
        if self.clamp == "free":
            return "is not known for a strip that is held nowhere"
        if goal == "end" and self.end is not None:
            return "is held by a clamp"
        return None

    @property
    def start(self) -> Pose:
        """The pose of the clamp at S = 0."""
        return Pose(self.clamp_position, self.clamp_frame)

    def to_dict(self) -> dict[str, Any]:
        """The fields as plain numbers, strings and lists (for JSON)."""
        data: dict[str, Any] = plain(asdict(self))
        return data

    @classmethod
    def from_dict(cls, data: Any) -> ShellProblem:
        """A problem from a mapping of its fields; an unknown or a missing key is an error."""
        problem: ShellProblem = build(cls, "problem", data, required=("width", "thickness", "poisson"))
        return problem
