"""A ribbon with straight rulings between floor and roof over one parameter: the branch whose places of contact are
unknowns (`ribbon.find.branch.confined`), where the scene is such a strip."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from compare.continuation.point import Point
from compare.models.base import Shape, State, on_strip
from compare.models.capabilities import BranchStart
from compare.models.line import Line
from compare.scene.scene import Scene
from ribbon.find.branch import aside, chain, folds
from ribbon.find.branch.chain import Setting
from ribbon.find.branch.confined import Confined
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]

#: How far (l) the floor may be under the clamps, and any direction from its place; slope of rulings that is none.
LEVEL, TURNED, STRAIGHT = 2e-6, 1e-9, 1e-6
#: Elements of an arc, for how many of the scene's on the whole strip, at the least.
SHARE, LEAST = 15, 8
#: Eigenvalues aside of the plane that are asked for, more where all are below zero; most elements of a piece, even.
_ASIDE, _FINEST = 12, 8
#: Samples of an arc for its shape.
_SAMPLES = 81
#: A place between the ends of the range, and what is off a straight line there at the most.
_BETWEEN, _LINEAR = 0.37, 1e-13


def setting_of(scene: Scene) -> Setting | None:
    """What a strip is given that lies between a floor, on which both its ends are clamped flat, and a roof; None for
    another scene. Its energy has no part in it while rulings are straight across and the strip is naturally flat."""
    end, frame = scene.end_position, scene.frame
    if len(scene.walls) != 2 or any(wall.stiffness is not None for wall in scene.walls) or scene.obstacles:
        return None
    if end is None or scene.end_frame is None or scene.apart is not None or scene.tip is not None:
        return None
    if scene.model.energy not in ("wunderlich", "sadowsky") or np.any(np.asarray(scene.curvature)):
        return None
    up, along = frame[:, 1], frame[:, 2]
    span = end - scene.position
    heights = [float((np.asarray(point) - scene.position) @ up) for point in scene.wall_points]
    signs = [float(np.asarray(normal) @ up) for normal in scene.wall_normals]
    if sorted(round(sign, 9) for sign in signs) != [-1.0, 1.0]:
        return None
    floor, roof = heights[int(np.argmax(signs))], heights[int(np.argmin(signs))]
    away = max(float(np.abs(scene.end_frame - frame).max()), abs(float(span @ up)), abs(float(span @ frame[:, 0])))
    weighs = bool(scene.gamma) and scene.up is not None
    if weighs and float(np.abs(np.asarray(scene.up) - up).max()) > TURNED:
        return None
    delta = 1.0 - float(span @ along)
    if away > TURNED or not -LEVEL <= floor <= 0.0 or not roof > 0.0 or not 0.0 < delta < 1.0:
        return None
    return Setting(roof, delta, scene.gamma if weighs else 0.0)


def branch_start(scene_at: Callable[[float], Scene], state: State) -> BranchStart | None:
    """The branch through a ribbon's state at t = 0, where it is such a strip; None where it is not."""
    setting, found = setting_of(scene_at(0.0)), state.native
    if setting is None or found.max_abs_eta > STRAIGHT:
        return None

    setting_at = _given(scene_at)
    scene = scene_at(0.0)
    s = np.concatenate([[0.0], np.cumsum(found.problem.lengths)])
    s[-1] = 1.0
    tangents = found.frame(s)[:, :, 2]
    theta = np.arctan2(tangents @ scene.frame[:, 1], tangents @ scene.frame[:, 2])
    floor, roof = (found.walls[k].contacts for k in np.argsort([-float(np.asarray(n) @ scene.frame[:, 1])
                                                               for n in scene.wall_normals]))  # fmt: skip
    elements = max(LEAST, s.size // SHARE)
    own, z = folds.touching(setting, s, np.unwrap(theta), floor, roof, elements)
    system = Confined(setting_at, own)

    def shape(point: Point) -> Shape:
        assert isinstance(point.system, Confined)
        here = scene_at(point.t)
        return ConfinedShape(point.system, point.z, point.t, np.asarray(here.position), here.frame, here.width)

    def beside(point: Point) -> FloatArray:
        assert isinstance(point.system, Confined)
        here, own = scene_at(point.t), point.system.chain
        width = here.width if here.model.energy == "wunderlich" else 0.0
        first, last = (held is not None and held.ruling == "straight" for held in (here.clamp_start, here.clamp_end))
        elements = min(own.elements // 4 * 2, _FINEST)
        form = aside.of_chain(own, point.z, setting_at(point.t), width, (first, last), elements)
        return form.through_zero(_ASIDE)

    return BranchStart(state, system, z, shape, lambda count: iter(()), planar=True, aside=beside)


def _given(scene_at: Callable[[float], Scene]) -> Callable[[float], Setting]:
    """What is given over t: where that is linear between the ends and at a place between them, without a scene for
    every t."""

    @lru_cache(maxsize=256)
    def own(t: float) -> Setting:
        made = setting_of(scene_at(t))
        if made is None:
            raise ValueError(f"t = {t}: no strip between floor and roof")
        return made

    try:
        first, middle, last = (np.array(own(t)) for t in (0.0, _BETWEEN, 1.0))
    except (ValueError, BadInput):
        return own
    weighs = (first[2] > 0.0) == (last[2] > 0.0)
    if not weighs or float(np.abs(first + _BETWEEN * (last - first) - middle).max()) > _LINEAR:
        return own

    def linear(t: float) -> Setting:
        height, delta, gamma = (float(v) for v in first + t * (last - first))
        if not (height > 0.0 and 0.0 < delta < 1.0):
            raise ValueError(f"t = {t}: no strip between floor and roof")
        return Setting(height, delta, gamma)

    return linear


@dataclass(frozen=True)
class ConfinedShape(Line):
    """A point of the branch as a strip in space; flat parts share out their length alike (`Confined.starts`)."""

    system: Confined
    z: FloatArray
    t: float
    position: FloatArray
    frame: FloatArray
    width: float

    @cached_property
    def _samples(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """s (k,), theta (k,), its slope (k,), and points (k, 2): along, up."""
        setting, own = self.system.setting_at(self.t), self.system.chain
        s, theta, bent, places = [0.0], [0.0], [0.0], [np.zeros(2)]
        xi = np.linspace(0.0, 1.0, _SAMPLES)
        values, slopes = chain.at(own.elements, xi)
        x, w = np.polynomial.legendre.leggauss(6)
        inner = chain.at(own.elements, (xi[:-1, None] + 0.5 * (x + 1.0) / (_SAMPLES - 1)).ravel())[0]
        for k, start in enumerate(self.system.starts(self.z)):
            length, angle = float(own.lengths(self.z)[k]), own.angle(self.z, k)
            if start > s[-1] + 1e-9:  # a flat part before it
                places.append(places[-1] + np.array([start - s[-1], 0.0]))
                s.append(float(start))
                theta.append(0.0)
                bent.append(0.0)
            along = np.exp(1j * (inner @ angle)).reshape(-1, x.size) @ w * (0.5 * length / (_SAMPLES - 1))
            line = np.concatenate([[0.0], np.cumsum(along)])
            first = places[-1] * np.array([1.0, 0.0]) + np.array([0.0, own.heights(setting)[k]])
            places += list(first + np.column_stack([line.real, line.imag])[1:])
            s += (start + length * xi[1:]).tolist()
            theta += (values[1:] @ angle).tolist()
            bent += (slopes[1:] @ angle / length).tolist()
        if s[-1] < 1.0 - 1e-9:
            places.append(places[-1] + np.array([1.0 - s[-1], 0.0]))
            s.append(1.0)
            theta.append(0.0)
            bent.append(0.0)
        s[-1] = 1.0
        return np.array(s), np.array(theta), np.array(bent), np.array(places)

    @property
    def bend(self) -> float:
        """Largest curvature, 1/l."""
        return float(np.abs(self._samples[2]).max())

    def angle(self, s: FloatArray) -> FloatArray:
        """theta (k,)."""
        return np.interp(s, *self._samples[:2])

    def plane(self, s: FloatArray) -> FloatArray:
        """Points (k, 2) along and over the floor, l."""
        at, theta, _, places = self._samples
        slopes = np.column_stack([np.cos(theta), np.sin(theta)])
        return np.asarray(CubicHermiteSpline(at, places, slopes)(on_strip(s)))

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3)."""
        found = self.plane(s)
        return self.position + np.outer(found[:, 0], self.frame[:, 2]) + np.outer(found[:, 1], self.frame[:, 1])

    def frames(self, s: FloatArray) -> FloatArray:
        """Frames (k, 3, 3), columns t_x t_y t_z."""
        theta = self.angle(on_strip(s))[:, None]
        along = np.cos(theta) * self.frame[:, 2] + np.sin(theta) * self.frame[:, 1]
        normal = np.cos(theta) * self.frame[:, 1] - np.sin(theta) * self.frame[:, 2]
        return np.stack([np.broadcast_to(self.frame[:, 0], along.shape), normal, along], axis=2)

    def along(self, s: FloatArray) -> dict[str, FloatArray]:
        """omega, which is minus the slope of theta, and energy_density."""
        omega = -np.interp(s, self._samples[0], self._samples[2])
        return {"omega": omega, "energy_density": 0.5 * omega**2}
