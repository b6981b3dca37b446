"""Keys of a scene fitted to measured points of its centreline, with intervals (`ribbonbench identify`).

Least squares of the distances between points and centreline (`compare.studies.fit.problem`). Intervals: 95 %, Student's
t on ``sigma^2 (J^T J)^-1`` with sigma^2 from the residuals; noise is taken as independent and alike in all directions.
How good the fit is: `compare.studies.fit.judged`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from compare.measure.grades import FAIR, GOOD, POOR
from compare.models.base import State
from compare.models.choice import differentiable, settled
from compare.scene.inputs.law import is_table
from compare.scene.scene import Scene
from compare.studies.fit import judged
from compare.studies.fit.judged import Offset
from compare.studies.fit.points import REACH, UNITS, Motion, Points, read_points
from compare.studies.fit.problem import Fit as _Fit
from ribbonbench.errors import BadInput

__all__ = ["Fitted", "Identified", "Points", "Registered", "check_free", "identify", "read_points"]

FloatArray = NDArray[np.float64]

#: Condition of the Jacobian (columns of length one) from which keys cannot be told apart, and from which hardly.
_ALIKE, _HARDLY = 1e9, 1e3
_CONFIDENCE = 0.95
#: First values of a key from which a poor fit is begun anew: added to a natural curvature (1/l), factors of others.
_CURLS, _FACTORS = (2.0, -2.0, 6.0, -6.0), (0.25, 4.0)
#: Shares of the strip that points in a guessed unit cover at least.
_LEAST_EXTENT = 0.05


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
class Registered:
    """The rigid motion that brought the points into the scene's axes, and its standard errors (3,) (None: as many
    unknowns as numbers): of the turn in rad, of the shift in l."""

    motion: Motion
    turn_error: FloatArray | None
    shift_error: FloatArray | None


@dataclass(frozen=True)
class Identified:
    """Scene and state of the fit, the fitted keys, what is left.

    points: in the scene's axes, moved there where they were registered; rms: root mean square of the distances between
    points and centreline, in l; feet (n,): abscissae of the nearest points; condition: of the Jacobian with columns of
    length one; correlation (k, k) of the keys; iterations: of the fit, each one equilibrium; converged: whether the fit
    met its tolerance; scatter: the points' own, in l, None where they are too few; registered: how the points were
    moved, None: not; offset: a motion that would take most of what is left away; grade: of `compare.measure.grades`;
    differenced: whether derivatives were differences of equilibria; began_beside: whether it began beside a saddle.
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
    scatter: float | None
    registered: Registered | None
    offset: Offset | None
    grade: str
    differenced: bool
    began_beside: bool

    @property
    def ok(self) -> bool:
        """A fit that met its tolerance at a stable equilibrium."""
        return self.converged and self.state.ok

    @property
    def passes(self) -> bool:
        """A fit that is no poor one."""
        return self.ok and self.grade != POOR

    @property
    def hardly(self) -> bool:
        """Whether the keys can hardly be told apart by these points."""
        return self.condition > _HARDLY


def check_free(scene: Scene, free: Sequence[str]) -> tuple[str, ...]:
    """The keys to fit; `BadInput` for none, one twice, and one that the scene does not give or that no fit can find."""
    possible = differentiable(scene).by_keys
    keys = tuple(key.strip() for key in free if key.strip())
    if not keys:
        raise BadInput("--free", None, "names no key", "e.g. --free strip.young,strip.natural_curvature")
    for key in keys:
        if keys.count(key) > 1:
            raise BadInput("--free", key, "is named twice", "name every key once")
        if key not in possible:
            raise BadInput("--free", key, "cannot be fitted", f"choose from {', '.join(possible)}")
        if getattr(scene.strip, key.removeprefix("strip.")) is None:
            raise BadInput("--free", key, "is not given by the scene", "give it a first value in the scene")
        if is_table(getattr(scene.strip, key.removeprefix("strip."))):
            remedy = "give one number or [at start, at end], whose level is then fitted"
            raise BadInput("--free", key, "is a table, which has no one value to fit", remedy)
    return keys


def identify(
    scene: Scene,
    points: Points,
    free: Sequence[str],
    say: Callable[[str], None] | None = None,
    *,
    register: bool = False,
    unit: float = 1.0,
) -> Identified:
    """The values of the keys `free` with which the scene's ribbon comes nearest to the points.

    Begins at the scene's own values, beside a saddle at the stable state that is nearest to the points; where that ends
    poorly, at others. Every equilibrium starts from the one before. A natural curvature that is a law is shifted as a
    whole. register: the points are moved as a rigid body too; without it they stand in the scene's own axes. unit: that
    the points were read in, in that of the strip, for what is said of another.

    Raises `BadInput` for keys that do not move the centreline, that cannot be told apart (young and density act through
    Gamma alone), for too few points, points farther apart than the strip is long, points that fit in another unit and
    poorly in theirs, and a scene without a stable ribbon to begin at.
    """
    keys = check_free(scene, free)
    if points.extent > REACH:
        guess = _in_another_unit(scene, points, keys, unit, register, math.inf)
        far = f"lie {points.extent:.3g} times the strip's length apart"
        if guess is not None:
            raise _of_unit(scene, points, far, guess)
        spans = [f"{points.extent * f / unit:.2g} in {n} (--unit {n})" for n, f in _units(scene, points, unit).items()]
        would = f"; they would span {', '.join(spans)}" if spans else ""
        remedy = f"give them in the unit of strip.length, or name theirs{would}"
        raise BadInput("POINTS", len(points.places), far, remedy)
    fit = _identified(scene, points, keys, register)
    dot = points.extent < _LEAST_EXTENT
    if dot or not fit.passes:
        guess = _in_another_unit(scene, points, keys, unit, register, math.inf if dot else fit.rms)
        if guess is not None:
            left = scene.units.text(fit.rms, "l")
            text = f"lie within {points.extent:.2g} of the strip's length" if dot else f"stay {left} from the ribbon"
            raise _of_unit(scene, points, f"{text} in this unit", guess)
    if say is not None:
        say(f"{fit.iterations} equilibria")
    return fit


def _of_unit(scene: Scene, points: Points, said: str, guess: tuple[str, Identified]) -> BadInput:
    name, found = guess
    unit = name if name in UNITS else f"units of {name} times that of strip.length"
    left = scene.units.text(found.rms, "l")
    return BadInput(
        "POINTS", len(points.places), f"{said}, and {left} from it in {unit}: they seem to be in {unit}",
        f"use --unit {name}",
    )  # fmt: skip


def _identified(scene: Scene, points: Points, keys: tuple[str, ...], register: bool) -> Identified:
    """The fit of points in the unit that they are taken in."""
    count = points.places.size if points.s is not None else 2 * len(points.places)
    unknowns = len(keys) + (6 if register else 0)
    if count < unknowns or not len(points.places):
        what = f"{len(keys)} keys" + (" and a rigid motion" if register else "")
        raise BadInput("POINTS", len(points.places), f"points are too few for {what}", "measure more")
    scene = settled(scene)  # one energy for all that is tried
    fit = _Fit(scene, points, keys, register)
    fit.begin()
    _tell_apart(keys, fit.jacobian(fit.start))
    found = _fitted(fit, count)
    if found.grade != GOOD and found.offset is None:
        for start in _others(fit):
            other = _fitted(start, count)
            if other.ok and other.rms < 0.5 * found.rms:
                found = other
    return found


def _others(fit: _Fit) -> list[_Fit]:
    """The fit begun at the other first value that is nearest to the points, if one is."""
    best: tuple[float, _Fit] | None = None
    here = judged.rms_of(fit.residuals(fit.start))
    for k, key in enumerate(fit.keys):
        curl = key == "strip.natural_curvature"
        first = fit.start.copy()
        for change in _CURLS if curl else _FACTORS:
            first[k] = fit.start[k] + change / fit.scene.strip.length / fit.scales[k] if curl else fit.start[k] * change
            try:
                other = _Fit(fit.scene_at(first), fit.points, fit.keys, fit.register)
                other.begin()
            except BadInput:
                continue
            left = judged.rms_of(other.residuals(other.start))
            if left < min(here, best[0] if best else math.inf):
                best = left, other
    return [] if best is None else [best[1]]


def _fitted(fit: _Fit, count: int) -> Identified:
    """The least squares of a fit that has begun, judged; count: of the numbers that the points give."""
    from scipy.optimize import least_squares
    from scipy.stats import t as student

    keys = fit.keys
    found = least_squares(
        fit.residuals, fit.start, fit.jacobian, bounds=fit.bounds, xtol=1e-12, ftol=1e-14, gtol=1e-14, max_nfev=60
    )
    state = fit.at(found.x)
    residuals, jacobian = fit.residuals(found.x), fit.jacobian(found.x)
    freedom = count - found.x.size
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
    places, feet = fit.places(found.x), fit.feet(found.x)
    rms, own = judged.rms_of(residuals), judged.scatter(residuals, feet)
    registered = seen = None
    if fit.register:
        apart = (None, None) if errors is None else tuple(errors[len(keys) :].reshape(2, 3))
        registered = Registered(fit.motion(found.x), *apart)
    elif state.ok:
        seen = judged.offset(residuals, jacobian, fit.moved(found.x), freedom, places)
    of_keys = slice(0, len(keys))
    return Identified(
        fit.scene_at(found.x), state, Points(places, fit.points.s), tuple(values), rms, feet, _condition(jacobian),
        (inverse / np.outer(spread, spread))[of_keys, of_keys], int(found.nfev), bool(found.success), own, registered,
        seen, judged.grade(rms, own, freedom, seen), fit.differenced, fit.left,
    )  # fmt: skip


def _units(scene: Scene, points: Points, unit: float) -> dict[str, float]:
    """The units other than `unit`, as --unit has them, in which points are neither a dot nor longer than the strip."""
    names = {name: factor for name, factor in UNITS.items() if factor != unit}
    if not scene.units.known:  # the strip's unit may be any, and smaller than the points' too
        names |= {f"{1.0 / factor:g}": 1.0 / factor for factor in UNITS.values() if factor < 1.0}
    return {n: f for n, f in names.items() if _LEAST_EXTENT < points.extent * f / unit <= REACH}


def _in_another_unit(
    scene: Scene, points: Points, keys: tuple[str, ...], unit: float, register: bool, than: float
) -> tuple[str, Identified] | None:
    """The unit, as --unit has it, in which points that are poor in `unit` (that of strip.length is 1) are good or fair,
    and the fit there; than: what was left in l. None where there is none."""
    best: tuple[str, Identified] | None = None
    for name, factor in _units(scene, points, unit).items():
        try:
            fit = _identified(scene, points.in_unit(factor / unit), keys, register)
        except BadInput:
            continue
        if fit.ok and fit.grade in (GOOD, FAIR) and fit.rms < (best[1].rms if best else 0.5 * than):
            best = name, fit
    return best


def _condition(jacobian: FloatArray) -> float:
    lengths = np.linalg.norm(jacobian, axis=0)
    if not np.all(lengths > 0.0):
        return math.inf
    return float(np.linalg.cond(jacobian / lengths))


def _tell_apart(keys: tuple[str, ...], jacobian: FloatArray) -> None:
    """`BadInput` for keys without effect on the centreline, or whose effects are multiples of each other or, further
    columns, of motions of the points."""
    own = jacobian[:, : len(keys)]
    lengths = np.linalg.norm(own, axis=0)
    for key, length in zip(keys, lengths, strict=True):
        if not length > 1e-12:
            raise BadInput(
                "--free", key, "does not move the centreline of this scene", "free another key, or change the scene"
            )
    if _condition(own) > _ALIKE:
        alike = np.abs(np.linalg.svd(own / lengths)[2][-1])
        names = [key for key, share in zip(keys, alike, strict=True) if share > 0.1 * alike.max()]
        raise BadInput(
            "--free", ",".join(names), "cannot be told apart: their effects on the shape are multiples of each other",
            "free one of them (young, density and thickness act through Gamma alone)",
        )  # fmt: skip
    if _condition(jacobian) > _ALIKE:
        raise BadInput(
            "--register", None, "these points do not say where they stand: some motion of them is an effect of a key, "
            "or none (points on a line)", "measure points off the line, free fewer keys, or place the points yourself",
        )  # fmt: skip
