"""Least squares of points and centreline: residuals and their Jacobian by keys of the scene and by a rigid motion.

A point without an abscissa belongs to the nearest point r(s) of the centreline, tangent t there, which moves with the
shape::

    r - P = d ,   ds/dk = -(t . (dr/dk - dP/dk) + d . dt/dk) / (1 + d . t') ,   t' = -omega t_y

(s = 0 and s = l stay where they are nearest). Derivatives of the shape are the exact ones of the equilibrium
(docs/theory.md, eq. (11.2)); where it has none (a straight strip whose rulings move nothing, a bifurcation) they are
central differences of equilibria.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from compare.models.base import State
from compare.models.capabilities import NotDifferentiable
from compare.models.choice import differentiable
from compare.scene.keys import KEYS
from compare.scene.scene import Scene
from compare.studies.fit.points import Motion, Points, nearest, placed
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]

_PENALTY = 1e3
#: Step of differences of equilibria, of a key's scale.
_STEP = 1e-3
#: Curvature (1/l) of the seeds from which a saddle is left to either side.
_ASIDE = 1.0


class Fit:
    """Residuals and their Jacobian at scaled values of the keys and, where points are registered, six numbers of their
    rigid motion (rotation vector in rad about their mean, shift in l); the last equilibrium is kept.

    differenced: whether a derivative was a difference; left: whether it began beside a saddle.
    """

    def __init__(self, scene: Scene, points: Points, keys: tuple[str, ...], register: bool = False) -> None:
        self.scene, self.points, self.keys, self.register = scene, points, keys, register
        self.model = differentiable(scene)
        firsts = np.array([_value(scene, key) for key in keys])
        least = np.array([1.0 / scene.strip.length if key == "strip.natural_curvature" else 0.0 for key in keys])
        self.scales = np.where(np.abs(firsts) > least, np.abs(firsts), np.maximum(least, 1e-300))
        self.scales = np.where(self.scales < 1e-200, 1.0, self.scales)
        self.start = np.concatenate([firsts / self.scales, np.zeros(6 if register else 0)])
        self.differenced = self.left = False
        self._pivot = points.places.mean(axis=0)
        self._seen: dict[bytes, State] = {}
        self._last: State | None = None

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest values of all unknowns."""
        ranges = [_range(key, scale) for key, scale in zip(self.keys, self.scales, strict=True)]
        ranges += [(-np.inf, np.inf)] * (self.start.size - len(self.keys))
        lower, upper = np.array(ranges).T
        return lower, upper

    def begin(self) -> State:
        """The stable equilibrium to begin at: the scene's own; beside a saddle the one nearest to the points.

        Places the points where they are registered. Raises `BadInput` where there is none.
        """
        from compare.models.base import Options

        model, key = self.model, self.start[: len(self.keys)].tobytes()
        state = model.solve(self.scene, options=Options(leave_saddle=False))
        if not state.ok and state.stable is False:
            self.left = True
            sides = [(self.scene, model.solve(self.scene, options=Options(leave_saddle=True)))]
            for curvature in (_ASIDE, -_ASIDE):
                try:
                    scene = self.scene.replace({"seed.curvature": curvature / self.scene.strip.length})
                except BadInput:  # a scene without a seed
                    continue
                sides.append((scene, model.solve(scene, options=Options(leave_saddle=True))))
            stable = [(self._apart(found), k) for k, (_, found) in enumerate(sides) if found.ok]
            if stable:
                self.scene, state = sides[min(stable)[1]]
        if not state.ok:
            remedy = "see what ribbonbench solve says of it"
            raise BadInput("scene", self.scene.name, "has no stable ribbon to begin at", remedy)
        self._last = self._seen[key] = state
        if self.register:
            motion = placed(state, self.points)
            self.start[len(self.keys) :] = np.concatenate([motion.turn, motion.shift])
        return state

    def _apart(self, state: State) -> float:
        """Distance of the points from a state's centreline, root mean square."""
        assert state.shape is not None
        places = placed(state, self.points).of(self.points.places) if self.register else self.points.places
        s = nearest(state, places) if self.points.s is None else self.points.s
        return float(np.sqrt(np.mean(np.sum((state.shape.centreline(s) - places) ** 2, axis=1))))

    def scene_at(self, x: FloatArray) -> Scene:
        """The scene with these values."""
        changes = {}
        for key, value in zip(self.keys, x[: len(self.keys)] * self.scales, strict=True):
            if key == "strip.natural_curvature":
                start, end = self.scene.strip.natural_curvature
                changes[key] = [float(value), float(value + end - start)] if end != start else float(value)
            else:
                changes[key] = float(value)
        return self.scene.replace(changes)

    def at(self, x: FloatArray) -> State:
        """The equilibrium, from the last stable one."""
        key = np.asarray(x[: len(self.keys)], dtype=float).tobytes()
        if key not in self._seen:
            state = self.model.solved_near(self.scene_at(x), self._last)
            self._seen[key] = state
            if state.ok:
                self._last = state
        return self._seen[key]

    def motion(self, x: FloatArray) -> Motion:
        """The rigid motion of the points; none where they are not registered."""
        turn, shift = x[len(self.keys) :].reshape(2, 3) if self.register else np.zeros((2, 3))
        return Motion(turn, shift, self._pivot)

    def places(self, x: FloatArray) -> FloatArray:
        """The points (n, 3) where the motion brings them."""
        return self.motion(x).of(self.points.places) if self.register else self.points.places

    def feet(self, x: FloatArray) -> FloatArray:
        """Abscissae (n,) that belong to the points."""
        return self.points.s if self.points.s is not None else nearest(self.at(x), self.places(x))

    def residuals(self, x: FloatArray) -> FloatArray:
        """Places of the centreline less the points, (3 n,), in l."""
        state = self.at(x)
        if not state.ok or state.shape is None:
            return np.full(self.points.places.size, _PENALTY)
        return (state.shape.centreline(self.feet(x)) - self.places(x)).ravel()

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Derivatives (3 n, k) of the residuals by the unknowns."""
        state, scene = self.at(x), self.scene_at(x)
        if not state.ok or state.shape is None:
            return np.zeros((self.points.places.size, x.size))
        s = self.feet(x)
        try:
            both = self.model.derivatives(scene, state, self.keys, lambda g: _with(g.position(s), g.rotation(s)))
        except NotDifferentiable:
            self.differenced = True
            moved = self.moved(x) if self.register else None
            own = np.stack([self._differences(x, k) for k in range(len(self.keys))], axis=1)
            self._last = state
            return own if moved is None else np.concatenate([own, moved], axis=1)
        scaled = zip(self.keys, self.scales, strict=True)
        columns = [self._free(x, s, *np.split(scale * both[key], 2)) for key, scale in scaled]
        own = np.stack([column.ravel() for column in columns], axis=1)
        return np.concatenate([own, self.moved(x)], axis=1) if self.register else own

    def moved(self, x: FloatArray) -> FloatArray:
        """Derivatives (3 n, 6) of the residuals by the rigid motion of the points."""
        s, slopes = self.feet(x), -self.motion(x).slopes(self.points.places)
        columns = [self._free(x, s, slopes[:, :, k], np.zeros(slopes.shape[:2])) for k in range(6)]
        return np.stack([column.ravel() for column in columns], axis=1)

    def _free(self, x: FloatArray, s: FloatArray, move: FloatArray, spin: FloatArray) -> FloatArray:
        """Change (n, 3) of residuals whose centreline less points changes by `move` (n, 3) and turns by `spin` (n, 3)
        at fixed abscissae, where these belong to the nearest points: they slide."""
        if self.points.s is not None:
            return move
        state = self.at(x)
        assert state.shape is not None
        frames = state.shape.frames(s)
        tangent, normal = frames[:, :, 2], frames[:, :, 1]
        off = state.shape.centreline(s) - self.places(x)
        bend = 1.0 - state.native.omega(s) * np.sum(off * normal, axis=1)
        slide = -(np.sum(tangent * move, axis=1) + np.sum(off * np.cross(spin, tangent), axis=1)) / bend
        inside = (s > 0.0) & (s < 1.0)
        return np.asarray(move + np.where(inside, slide, 0.0)[:, None] * tangent)

    def _differences(self, x: FloatArray, k: int) -> FloatArray:
        """Derivative (3 n,) by a key from equilibria on both sides, or on the one where there is a stable one."""
        here, sides = self.residuals(x), []
        for sign in (1.0, -1.0):
            moved = x.copy()
            moved[k] += sign * _STEP
            try:
                stable = self.at(moved).ok
            except BadInput:  # beyond the key's range
                stable = False
            sides.append((sign * _STEP, self.residuals(moved)) if stable else (0.0, here))
        (ahead, after), (back, before) = sides
        return (after - before) / (ahead - back) if ahead > back else np.zeros_like(here)


def _with(moves: dict[str, FloatArray], spins: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Places (n, 3, ...) and turns (n, 3, ...) in one array (2 n, 3, ...), by name."""
    return {name: np.concatenate([moves[name], spins[name]]) for name in moves}


def _value(scene: Scene, key: str) -> float:
    found = getattr(scene.strip, key.removeprefix("strip."))
    return float(found[0] if isinstance(found, tuple) else found)


def _range(key: str, scale: float) -> tuple[float, float]:
    """The values that a key can have, scaled."""
    about = KEYS[key].range
    if about is None:
        return -np.inf, np.inf
    high = np.inf if about.high is None else about.high
    low = about.low if about.includes_low else about.low + 1e-9 * max(scale, abs(about.low))
    return low / scale, high / scale
