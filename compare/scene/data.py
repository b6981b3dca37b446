"""A scene as numbers: the sections with the values of the file in its own units, and what follows from them.

The derived, dimensionless numbers that the solvers take (lengths in l, energies in D w / l; theory sheet, section 2;
thesis 4.1) are properties: `width`, `curvature`, `gamma`, `up`, `start_position`, `start_frame`, `end_position`, ...
Nothing here reads, checks or changes a scene: that is built on it.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.scene.inputs import law
from compare.scene.inputs.bodies import Body
from compare.scene.loads import force_scale, gamma_of, load_of
from compare.scene.spec import (
    ClampSpec,
    ClosureSpec,
    ContactSpec,
    GravitySpec,
    ModelSpec,
    ObstacleSpec,
    RodSpec,
    SeedSpec,
    ShellSpec,
    StageSpec,
    StripSpec,
    TipSpec,
    UncertaintySpec,
    WallSpec,
)
from compare.scene.units import Units
from ribbonbench.errors import BadInput
from ribbonbench.statics import cross

#: Keys of a stage that changes the weight alone.
_WEIGHT = frozenset({"strip.gamma", "gravity.acceleration"})


def unit(vector: Any) -> NDArray[np.float64]:
    """The vector normalised to rounding."""
    array = np.array(vector, dtype=float)
    return array / np.linalg.norm(array)


@functools.lru_cache(maxsize=64)  # cases of a sweep have one clamp
def frame_of(clamp: ClampSpec | None) -> NDArray[np.float64] | None:
    """The held frame, 3x3 with columns t_x = t_y x t_z, t_y, t_z, orthonormal to rounding, read only; None: not
    held."""
    if clamp is None or clamp.tangent is None or clamp.normal is None:
        return None
    tangent = unit(clamp.tangent)
    given = np.array(clamp.normal)
    normal = unit(given - (given @ tangent) * tangent)
    frame = np.column_stack([cross(normal, tangent), normal, tangent])
    frame.setflags(write=False)
    return frame


@dataclass(frozen=True)
class Sections:
    """What a scene file says, section by section; None: the section is absent and so is its effect."""

    title: str
    strip: StripSpec
    gravity: GravitySpec | None
    tip: TipSpec | None
    clamp_start: ClampSpec | None
    clamp_end: ClampSpec | None
    closure: ClosureSpec | None
    walls: tuple[WallSpec, ...]
    obstacles: tuple[ObstacleSpec, ...]
    model: ModelSpec
    seed: SeedSpec
    path: tuple[StageSpec, ...]
    shell: ShellSpec
    uncertainty: UncertaintySpec
    rod: RodSpec | None
    contact: ContactSpec | None


@dataclass(frozen=True)
class SceneData(Sections):
    """One scene: a strip, what holds and loads it, the ribbon's model, the way to the scene and the shell runs.

    `name` and `source`: where it was read; `own_keys`: the dotted keys that it sets itself, without those of its path.
    """

    name: str
    source: str
    own_keys: frozenset[str] = field(default=frozenset(), compare=False, repr=False)

    @property
    def units(self) -> Units:
        """What its dimensionless numbers are in SI; without values where it gives no stiffness."""
        return Units.of(self.strip)

    @property
    def strict(self) -> bool:
        """Whether the scene itself says `model.tolerance`, which is then met or missed; a default is only aimed at."""
        return "model.tolerance" in self.own_keys

    # -- dimensionless: l = 1, D = 1 ---------------------------------------------------------------------------------

    @property
    def width(self) -> float:
        """w / l."""
        return self.strip.width / self.strip.length

    @property
    def thickness(self) -> float | None:
        """h / l, or None when the scene gives no thickness."""
        return None if self.strip.thickness is None else self.strip.thickness / self.strip.length

    @property
    def curvature(self) -> law.Law:
        """Natural normal curvature times l, at s = 0 and at s = 1, or the points (s / l, K l) of a table."""
        return law.scaled(self.strip.natural_curvature, self.strip.length)

    @property
    def twist(self) -> law.Law:
        """Twist at rest times l, as `curvature`: that of [strip], or of [rod]."""
        given = self.strip.natural_twist
        if self.rod is not None and any(self.rod.natural_twist):
            given = self.rod.natural_twist
        return law.scaled(given, self.strip.length)

    @property
    def geodesic(self) -> law.Law:
        """Curvature at rest in the strip's plane times l, as `twist`."""
        given = self.strip.natural_geodesic_curvature
        if self.rod is not None and any(self.rod.natural_in_plane):
            given = self.rod.natural_in_plane
        return law.scaled(given, self.strip.length)

    @property
    def shaped(self) -> bool:
        """Whether the strip at rest is twisted or curved in its plane."""
        return any(law.values(self.twist)) or any(law.values(self.geodesic))

    @property
    def transverse_curvature(self) -> float:
        """Natural curvature across the strip times l; > 0 where the edges stand away from the normal t_y."""
        return self.strip.transverse_curvature * self.strip.length

    @property
    def gamma(self) -> float:
        """Gamma = rho h g l^3 / D with D = Y h^3 / (12 (1 - nu^2)); 0.0 without gravity."""
        return 0.0 if self.gravity is None else gamma_of(self.strip, self.gravity.acceleration)

    @property
    def apart(self) -> float | None:
        """Distance over l that parts of the strip keep from each other; None: they may pass through each other."""
        if self.contact is None or not self.contact.itself:
            return None
        given = self.strip.thickness if self.contact.distance is None else self.contact.distance
        return None if given is None else given / self.strip.length

    @property
    def round_rod(self) -> bool:
        """Whether the strip touches itself as a round rod about its centreline."""
        return self.apart is not None and self.contact is not None and self.contact.section == "round"

    @property
    def follows(self) -> bool:
        """Whether segments follow what the rod touches itself with."""
        return self.round_rod and self.contact is not None and self.contact.joints == "follow"

    @property
    def seed_points(self) -> NDArray[np.float64] | None:
        """The drawn curve in units of l, shape (k, 3); None: there is none."""
        return None if self.seed.curve is None else np.array(self.seed.curve) / self.strip.length

    @property
    def tip_load(self) -> float:
        """Load at s = 1 along -up in D w / l^2 (Y I / l^2 of a rod): M g l^2 / (Y I) of a mass M; 0.0 without one."""
        if self.tip is None or self.gravity is None:
            return 0.0
        return load_of(self.tip, self.strip, self.gravity.acceleration)

    @property
    def tip_force(self) -> NDArray[np.float64]:
        """Dead force at s = 1 in D w / l^2, shape (3,): all that `[tip]` says; 0 without it."""
        force = np.zeros(3)
        if self.tip is None:
            return force
        if self.up is not None:
            force -= self.tip_load * self.up
        scale = force_scale(self.strip)
        if self.tip.force is not None:
            force += scale * np.array(self.tip.force)
        along = self.tension_direction
        if self.tip.tension is not None and along is not None:
            force += scale * self.tip.tension * along
        return force

    @property
    def tip_moment(self) -> NDArray[np.float64]:
        """Dead moment at s = 1 in D w / l, shape (3,); 0 without `tip.moment`."""
        if self.tip is None or self.tip.moment is None:
            return np.zeros(3)
        scale = force_scale(self.strip) / (1.0 if self.strip.young is None else self.strip.length)
        return scale * np.array(self.tip.moment)

    @property
    def tension_direction(self) -> NDArray[np.float64] | None:
        """The unit vector (3,) of `tip.tension`: the tangent held at s = 1, else that held at s = 0; None: neither."""
        frame = self.end_frame if self.end_frame is not None else self.start_frame
        return None if frame is None else frame[:, 2]

    @property
    def guided(self) -> bool:
        """True when the end holds its frame and not its position."""
        return self.end_frame is not None and self.end_position is None

    @property
    def several_equilibria(self) -> bool:
        """Whether there may be several: a model beside another then begins at that one's shape, to be on its branch."""
        return self.clamp_end is not None or self.closure is not None or bool(self.path)

    @property
    def only_raised(self) -> bool:
        """Whether it has no path, or one that changes its weight alone: the states on such a path are no answers, and
        an unstable one is left; along another path it may be what is asked for."""
        return all(set(stage) <= _WEIGHT for stage in self.path)

    @property
    def up(self) -> NDArray[np.float64] | None:
        """Unit vector against the weight, shape (3,), normalised to rounding; None without gravity."""
        return None if self.gravity is None else unit(self.gravity.up)

    @property
    def start_position(self) -> NDArray[np.float64] | None:
        """The point held at s = 0 in units of l, shape (3,); None: not held."""
        return self._position(self.clamp_start)

    @property
    def start_frame(self) -> NDArray[np.float64] | None:
        """The frame held at s = 0, 3x3 with columns t_x = t_y x t_z, t_y, t_z, orthonormal to rounding, or None."""
        return frame_of(self.clamp_start)

    @property
    def end_position(self) -> NDArray[np.float64] | None:
        """The point held at s = length in units of l, shape (3,); None: not held."""
        return self._position(self.clamp_end)

    @property
    def end_frame(self) -> NDArray[np.float64] | None:
        """The frame held at s = length, as `start_frame`; None: not held."""
        return frame_of(self.clamp_end)

    @property
    def position(self) -> NDArray[np.float64]:
        """`start_position` of a scene whose start is fully clamped; `BadInput` for another one."""
        position = self.start_position
        if position is None or not self.start_clamped:
            raise self._start_not_clamped()
        return position

    @property
    def frame(self) -> NDArray[np.float64]:
        """`start_frame` of a scene whose start is fully clamped; `BadInput` for another one."""
        frame = self.start_frame
        if frame is None or not self.start_clamped:
            raise self._start_not_clamped()
        return frame

    @property
    def start_clamped(self) -> bool:
        """True when position and frame are held at s = 0."""
        return self.clamp_start is not None and self.clamp_start.holds_all

    @property
    def wall_points(self) -> NDArray[np.float64]:
        """A point of every wall in units of l, shape (walls, 3); of a pressure plate, where it rests."""
        return np.array([wall.point for wall in self.walls]).reshape(-1, 3) / self.strip.length

    @property
    def wall_normals(self) -> NDArray[np.float64]:
        """Unit normals of the walls towards the ribbon, shape (walls, 3), normalised to rounding."""
        return np.array([unit(wall.normal) for wall in self.walls]).reshape(-1, 3)

    @property
    def barriers(self) -> tuple[WallSpec | ObstacleSpec, ...]:
        """What the strip cannot cross: its walls, then its obstacles; forces are listed in this order."""
        return (*self.walls, *self.obstacles)

    @property
    def barrier_names(self) -> tuple[str, ...]:
        """How results call them: by name, a wall without one by its number, an obstacle as "obstacle_0"."""
        walls = (str(number) if one.name is None else one.name for number, one in enumerate(self.walls))
        others = (f"obstacle_{number}" if one.name is None else one.name for number, one in enumerate(self.obstacles))
        return (*walls, *others)

    @property
    def obstacle_axes(self) -> tuple[NDArray[np.float64] | None, ...]:
        """Unit vectors along the axes of the obstacles, normalised to rounding; None: a sphere."""
        return tuple(None if one.axis is None else unit(one.axis) for one in self.obstacles)

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The obstacles as geometry, lengths in l."""
        return tuple(Body.of(one, self.strip.length).scaled(self.strip.length) for one in self.obstacles)

    @property
    def seed_curvature(self) -> tuple[float, ...]:
        """Curvature of the starting shape times l ("natural" resolved) at equal distances from s = 0 to s = 1.

        Two values or more; linear in between.
        """
        if self.seed.curvature is None:
            return law.even(self.curvature)
        return tuple(value * self.strip.length for value in self.seed.curvature)

    def _position(self, clamp: ClampSpec | None) -> NDArray[np.float64] | None:
        if clamp is None or clamp.position is None:
            return None
        return np.array(clamp.position) / self.strip.length

    def _start_not_clamped(self) -> BadInput:
        return BadInput(
            "clamp.start",
            None,
            "does not hold position and frame, which this needs",
            "add [clamp.start] with position, tangent and normal",
        )

    @property
    def shell_corner(self) -> float | None:
        """Size of the shell's held corner cells in units of l; None: one cell of its mesh."""
        return None if self.shell.corner is None else self.shell.corner / self.strip.length

    @property
    def shell_edge_layer(self) -> float | str | None:
        """Width in units of l of the layer at the shell's clamps and edges, or "auto"; None: the mesh is graded."""
        layer = self.shell.edge_layer
        return layer if layer is None or isinstance(layer, str) else layer / self.strip.length

    @property
    def shell_start_curvature(self) -> float | None:
        """Curvature times l of the arc where the shell's path begins; None: not said."""
        curvature = self.shell.start_curvature
        return None if curvature is None else curvature * self.strip.length
