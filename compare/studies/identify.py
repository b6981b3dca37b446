"""Keys of a scene fitted to measured points of its centreline, with intervals (`ribbonbench identify`).

Least squares of the distances between points and centreline by Gauss-Newton's Jacobian, which comes from the exact
derivatives of the equilibrium (docs/theory.md, eq. (11.2)) and not from differences. A point without an abscissa
belongs to the nearest point r(s) of the centreline, tangent t there, which moves with the shape::

    r - P = d ,   ds/dk = -(t . dr/dk + d . dt/dk) / (1 + d . t') ,   t' = -omega t_y

(s = 0 and s = l stay where they are nearest). Intervals: 95 %, Student's t on ``sigma^2 (J^T J)^-1`` with sigma^2 from
the residuals; noise is taken as independent and alike in all directions.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from compare.errors import BadInput
from compare.models.base import State
from compare.scene.keys import KEYS
from compare.scene.scene import Scene

FloatArray = NDArray[np.float64]

#: Points along the centreline among which the nearest is looked for, and steps of Newton's iteration from there.
_ALONG, _STEPS = 1001, 8
#: Condition of the Jacobian (columns of length one) from which keys cannot be told apart, and from which hardly.
_ALIKE, _HARDLY = 1e9, 1e3
_CONFIDENCE = 0.95
_PENALTY = 1e3


@dataclass(frozen=True)
class Points:
    """Measured points (n, 3) and, where they were given, their abscissae (n,), in l."""

    places: FloatArray
    s: FloatArray | None = None


@dataclass(frozen=True)
class Fitted:
    """A fitted key, in its unit: value, where it began, standard error and 95 % interval (None: as many unknowns as
    numbers)."""

    key: str
    value: float
    start: float
    error: float | None
    interval: tuple[float, float] | None


@dataclass(frozen=True)
class Identified:
    """Scene and state of the fit, the fitted keys, what is left.

    rms: root mean square of the distances between points and centreline, in l; feet (n,): abscissae of the nearest
    points; condition: of the Jacobian with columns of length one; correlation (k, k); iterations: of the fit, each one
    equilibrium; converged: whether the fit met its tolerance.
    """

    scene: Scene
    state: State
    points: Points
    keys: tuple[Fitted, ...]
    rms: float
    feet: FloatArray
    condition: float
    correlation: FloatArray
    iterations: int
    converged: bool

    @property
    def ok(self) -> bool:
        """A fit that met its tolerance at a stable equilibrium."""
        return self.converged and self.state.ok

    @property
    def hardly(self) -> bool:
        """Whether the keys can hardly be told apart by these points."""
        return self.condition > _HARDLY


def read_points(path: str | Path, length: float) -> Points:
    """Points of a CSV file with the columns x, y, z and, if known, s, in the unit of `length` (the strip's).

    Raises `BadInput` for a file that cannot be read, a missing column and, by its line, whatever is no number.
    """
    try:
        rows = list(csv.reader(Path(path).read_text("utf-8-sig").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise BadInput("POINTS", str(path), f"cannot be read ({error})", "give a CSV file") from None
    head = [name.strip().lower() for name in rows[0]] if rows else []
    missing = [name for name in "xyz" if name not in head]
    if missing:
        raise BadInput(
            "POINTS", str(path), f"line 1 has no column {', '.join(missing)}",
            "begin with a line x,y,z or s,x,y,z (in the unit of strip.length)",
        )  # fmt: skip
    wanted = [*"xyz", *(["s"] if "s" in head else [])]
    found = []
    for number, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        try:
            values = [float(row[head.index(name)]) for name in wanted]
        except (ValueError, IndexError):
            values = [math.nan]
        if not all(map(math.isfinite, values)):
            raise BadInput(
                "POINTS", str(path), f"line {number} has not {len(wanted)} finite numbers: {','.join(row)!r}",
                "mend that line or leave it out",
            )  # fmt: skip
        if "s" in head and not -1e-9 <= values[3] / length <= 1.0 + 1e-9:
            raise BadInput(
                "POINTS", str(path), f"line {number}: s = {values[3]:g} is not on the strip",
                f"give abscissae from 0 to strip.length = {length:g}",
            )  # fmt: skip
        found.append(values)
    table = np.array(found, dtype=float).reshape(-1, len(wanted)) / length
    return Points(table[:, :3], np.clip(table[:, 3], 0.0, 1.0) if "s" in head else None)


def check_free(scene: Scene, free: Sequence[str]) -> tuple[str, ...]:
    """The keys to fit; `BadInput` for none, one twice, and one that the scene does not give or that no fit can find."""
    from compare.models.ribbon.inputs import KEYS as POSSIBLE

    keys = tuple(key.strip() for key in free if key.strip())
    if not keys:
        raise BadInput("--free", None, "names no key", "e.g. --free strip.young,strip.natural_curvature")
    for key in keys:
        if keys.count(key) > 1:
            raise BadInput("--free", key, "is named twice", "name every key once")
        if key not in POSSIBLE:
            raise BadInput("--free", key, "cannot be fitted", f"choose from {', '.join(POSSIBLE)}")
        if getattr(scene.strip, key.removeprefix("strip.")) is None:
            raise BadInput("--free", key, "is not given by the scene", "give it a first value in the scene")
    return keys


def identify(scene: Scene, points: Points, free: Sequence[str], say: Callable[[str], None] | None = None) -> Identified:
    """The values of the keys `free` with which the scene's ribbon comes nearest to the points.

    Begins at the scene's own values; every equilibrium starts from the one before. A natural curvature that is a law is
    shifted as a whole. Points are not moved: they stand in the scene's own axes.

    Raises `BadInput` for keys that do not move the centreline, that cannot be told apart (young and density act through
    Gamma alone), for too few points and a scene without a stable ribbon to begin at.
    """
    from scipy.optimize import least_squares
    from scipy.stats import t as student

    keys = check_free(scene, free)
    count = points.places.size if points.s is not None else 2 * len(points.places)
    if count < len(keys) or not len(points.places):
        raise BadInput("POINTS", len(points.places), f"points are too few for {len(keys)} keys", "measure more")
    fit = _Fit(scene, points, keys)
    if not fit.at(fit.start).ok:
        raise BadInput("scene", scene.name, "has no stable ribbon to begin at", "see what ribbonbench solve says of it")
    _tell_apart(keys, fit.jacobian(fit.start))
    lower, upper = np.array([_range(key, scale) for key, scale in zip(keys, fit.scales, strict=True)]).T
    found = least_squares(
        fit.residuals, fit.start, fit.jacobian, bounds=(lower, upper), xtol=1e-12, ftol=1e-14, gtol=1e-14, max_nfev=60
    )
    if say is not None:
        say(f"{found.nfev} equilibria")
    state = fit.at(found.x)
    residuals, jacobian = fit.residuals(found.x), fit.jacobian(found.x)
    freedom = count - len(keys)
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    errors = np.sqrt(np.diag(inverse) * (residuals @ residuals) / freedom) if freedom else None
    spread = np.sqrt(np.diag(inverse))
    factor = float(student.ppf(0.5 + 0.5 * _CONFIDENCE, freedom)) if freedom else math.nan
    values = []
    for k, key in enumerate(keys):
        value, first = float(found.x[k] * fit.scales[k]), float(fit.start[k] * fit.scales[k])
        error = None if errors is None else float(errors[k] * fit.scales[k])
        interval = None if error is None else (value - factor * error, value + factor * error)
        values.append(Fitted(key, value, first, error, interval))
    return Identified(
        fit.scene_at(found.x), state, points, tuple(values),
        float(np.sqrt(np.mean(np.sum(residuals.reshape(-1, 3) ** 2, axis=1)))), fit.feet(state), _condition(jacobian),
        inverse / np.outer(spread, spread), int(found.nfev), bool(found.success),
    )  # fmt: skip


class _Fit:
    """Residuals and their Jacobian at scaled values of the keys; the last equilibrium is kept."""

    def __init__(self, scene: Scene, points: Points, keys: tuple[str, ...]) -> None:
        self.scene, self.points, self.keys = scene, points, keys
        firsts = np.array([_value(scene, key) for key in keys])
        least = np.array([1.0 / scene.strip.length if key == "strip.natural_curvature" else 0.0 for key in keys])
        self.scales = np.where(np.abs(firsts) > least, np.abs(firsts), np.maximum(least, 1e-300))
        self.scales = np.where(self.scales < 1e-200, 1.0, self.scales)
        self.start = firsts / self.scales
        self._seen: dict[bytes, State] = {}
        self._last: State | None = None

    def scene_at(self, x: FloatArray) -> Scene:
        """The scene with these values."""
        changes = {}
        for key, value in zip(self.keys, x * self.scales, strict=True):
            if key == "strip.natural_curvature":
                start, end = self.scene.strip.natural_curvature
                changes[key] = [float(value), float(value + end - start)] if end != start else float(value)
            else:
                changes[key] = float(value)
        return self.scene.replace(changes)

    def at(self, x: FloatArray) -> State:
        """The equilibrium, from the last stable one."""
        key = np.asarray(x, dtype=float).tobytes()
        if key not in self._seen:
            from compare.models.ribbon.inputs import solved_near

            state = solved_near(self.scene_at(x), self._last)
            self._seen[key] = state
            if state.ok:
                self._last = state
        return self._seen[key]

    def feet(self, state: State) -> FloatArray:
        """Abscissae (n,) that belong to the points."""
        if self.points.s is not None:
            return self.points.s
        assert state.shape is not None
        return nearest(state, self.points.places)

    def residuals(self, x: FloatArray) -> FloatArray:
        """Places of the centreline less the points, (3 n,), in l."""
        state = self.at(x)
        if not state.ok or state.shape is None:
            return np.full(self.points.places.size, _PENALTY)
        return np.asarray((state.shape.centreline(self.feet(state)) - self.points.places).ravel())

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Derivatives (3 n, k) of the residuals by the scaled values."""
        from compare.models.ribbon.inputs import derivatives

        state, scene = self.at(x), self.scene_at(x)
        if not state.ok or state.shape is None:
            return np.zeros((self.points.places.size, len(self.keys)))
        s = self.feet(state)
        places = derivatives(scene, state, self.keys, lambda g: g.position(s))
        columns = [places[key] for key in self.keys]
        if self.points.s is None:
            turns = derivatives(scene, state, self.keys, lambda g: g.rotation(s))
            frames = state.shape.frames(s)
            tangent, normal = frames[:, :, 2], frames[:, :, 1]
            off = state.shape.centreline(s) - self.points.places
            bend = 1.0 - state.native.omega(s) * np.sum(off * normal, axis=1)
            inside = (s > 0.0) & (s < 1.0)
            for k, key in enumerate(self.keys):
                spun = np.cross(turns[key], tangent)
                slide = -(np.sum(tangent * columns[k], axis=1) + np.sum(off * spun, axis=1)) / bend
                columns[k] = columns[k] + np.where(inside, slide, 0.0)[:, None] * tangent
        return np.stack([column.ravel() for column in columns], axis=1) * self.scales


def nearest(state: State, places: FloatArray) -> FloatArray:
    """Abscissae (n,) of the points of the centreline that are nearest to `places` (n, 3), to rounding."""
    from scipy.spatial import cKDTree

    assert state.shape is not None
    along = np.linspace(0.0, 1.0, _ALONG)
    s = along[cKDTree(state.shape.centreline(along)).query(places)[1]]
    for _ in range(_STEPS):
        frames = state.shape.frames(s)
        off = state.shape.centreline(s) - places
        bend = 1.0 - state.native.omega(s) * np.sum(off * frames[:, :, 1], axis=1)
        step = np.sum(off * frames[:, :, 2], axis=1) / np.maximum(bend, 0.1)
        s = np.clip(s - np.clip(step, -2.0 / _ALONG, 2.0 / _ALONG), 0.0, 1.0)
    return np.asarray(s)


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


def _condition(jacobian: FloatArray) -> float:
    lengths = np.linalg.norm(jacobian, axis=0)
    if not np.all(lengths > 0.0):
        return math.inf
    return float(np.linalg.cond(jacobian / lengths))


def _tell_apart(keys: tuple[str, ...], jacobian: FloatArray) -> None:
    """`BadInput` for keys without effect on the centreline, or whose effects are multiples of each other."""
    lengths = np.linalg.norm(jacobian, axis=0)
    for key, length in zip(keys, lengths, strict=True):
        if not length > 1e-12:
            raise BadInput(
                "--free", key, "does not move the centreline of this scene", "free another key, or change the scene"
            )
    if _condition(jacobian) > _ALIKE:
        alike = np.abs(np.linalg.svd(jacobian / lengths)[2][-1])
        names = [key for key, share in zip(keys, alike, strict=True) if share > 0.1 * alike.max()]
        raise BadInput(
            "--free", ",".join(names), "cannot be told apart: their effects on the shape are multiples of each other",
            "free one of them (young, density and thickness act through Gamma alone)",
        )  # fmt: skip
