"""How the distance between ribbon and shell falls with h/w: slope, limit, and the ribbon's place in it (thesis, 4.3).

Given are rows (h/w, distance, ribbon's error, shell's error), lengths in l, and scalars of the shell. Rows whose
distance is not above the sum of both errors take no part (design rule 7).

**Slope.** Least squares of log d on log(h/w). Two sources of uncertainty, each at 95 %, stated apart and together:

- scatter about the line: value +- t(n - 2) s / sqrt(sum (x - mean x)^2), Student's t;
- the discretisation errors, which are bounds: d is moved within them, uniformly, by one common amount for the ribbon
  (the same ribbon stands in every row) and one for each shell;
- together: quantiles of the sum of both, sampled (`SAMPLES`, fixed seed).

**Limit.** d = d0 + c (h/w)^q, at least four rows, residuals relative to d, q in `POWERS`: for every q linear in d0 and
c, the best q by search. d0 is what is left at h/w = 0. Uncertainty as above, with t(n - 3) and the linearised
covariance.

**Scalars** (Richardson's extrapolation): v = v0 + a (h/w)^q with the q of the limit (without one, the slope), taken
anew in every sample from that q's own distribution, and t(n - 2).

Where the rows are not yet in the asymptotic range, scatter shows only part of it: intervals say what the model fitted
to these rows allows, no more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

LEVEL = 0.95
SAMPLES = 4000
SEED = 20211
#: Powers of h/w that are tried for the limit.
POWERS = (0.1, 4.0)
_TRIED = 391
LEAST_FOR_LIMIT = 4

Interval = tuple[float, float]


@dataclass(frozen=True)
class Points:
    """Rows that take part, by falling h/w: x = h/w (n,), distance, ribbon_error, shell_error (n,) over l."""

    x: FloatArray
    distance: FloatArray
    ribbon_error: FloatArray
    shell_error: FloatArray

    @classmethod
    def of(cls, x: ArrayLike, distance: ArrayLike, ribbon_error: ArrayLike, shell_error: ArrayLike) -> Points:
        """The rows whose distance exceeds the sum of both errors; ValueError for other shapes or h/w <= 0."""
        columns = [np.asarray(c, dtype=float) for c in (x, distance, ribbon_error, shell_error)]
        size = columns[0].size
        columns = [np.broadcast_to(c, (size,)) for c in columns]
        if not np.all(columns[0] > 0.0):
            raise ValueError("h/w must be above zero")
        kept = columns[1] > columns[2] + columns[3]
        order = np.argsort(-columns[0][kept], kind="stable")
        return cls(*(np.array(c[kept][order]) for c in columns))

    def __len__(self) -> int:
        return int(self.x.size)

    def moved(self, random: np.random.Generator, samples: int) -> FloatArray:
        """Distances (samples, n) moved within their errors: the ribbon's by one amount in all rows of a sample."""
        common = random.uniform(-1.0, 1.0, (samples, 1)) * self.ribbon_error
        return np.asarray(self.distance + common + random.uniform(-1.0, 1.0, (samples, len(self))) * self.shell_error)


@dataclass(frozen=True)
class Estimate:
    """A value and its 95 % intervals: scatter (None: as many parameters as rows), errors, both together."""

    value: float
    scatter: Interval | None
    errors: Interval
    both: Interval


@dataclass(frozen=True)
class Limit:
    """d = d0 + c (h/w)^q fitted to the claimed rows; `d0` and `power` with intervals, `c`, and the largest relative
    residual."""

    d0: Estimate
    c: float
    power: Estimate
    residual: float

    def at(self, x: ArrayLike) -> FloatArray:
        """The fitted distance at h/w."""
        return np.asarray(self.d0.value + self.c * np.asarray(x, dtype=float) ** self.power.value)


def _quantiles(samples: FloatArray) -> Interval:
    low, high = np.quantile(samples, [(1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0])
    return float(low), float(high)


def _estimate(value: float, spread: float, freedom: int, moved: FloatArray, random: np.random.Generator) -> Estimate:
    """From the value, its standard error by scatter with `freedom`, and samples (m,) moved within the errors."""
    if freedom < 1:
        interval = _quantiles(moved)
        return Estimate(value, None, interval, interval)
    half = float(scipy.stats.t.ppf((1.0 + LEVEL) / 2.0, freedom)) * spread
    both = moved + spread * random.standard_t(freedom, moved.size)
    return Estimate(value, (value - half, value + half), _quantiles(moved), _quantiles(both))


def line(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Least squares y = a + b x for many y (..., n): a, b (...,), and the standard error of b (...,) with n - 2 (zero
    for n = 2)."""
    centred = x - x.mean()
    weight = float(centred @ centred)
    b = (y * centred).sum(axis=-1) / weight
    a = y.mean(axis=-1) - b * x.mean()
    rest = y - a[..., None] - b[..., None] * x
    freedom = max(x.size - 2, 1)
    return a, b, np.sqrt((rest**2).sum(axis=-1) / freedom / weight)


def slope(points: Points) -> Estimate | None:
    """Slope of log d against log(h/w); None with fewer than two rows."""
    if len(points) < 2:
        return None
    random = np.random.default_rng(SEED)
    value, spread, moved = _slope(points, random)
    return _estimate(value, spread, len(points) - 2, moved, random)


def _slope(points: Points, random: np.random.Generator) -> tuple[float, float, FloatArray]:
    """The slope, its standard error by scatter, and slopes (SAMPLES,) within the errors."""
    x = np.log(points.x)
    _, value, spread = line(x, np.log(points.distance))
    _, moved, _ = line(x, np.log(points.moved(random, SAMPLES)))
    return float(value), float(spread), moved


def line_band(points: Points, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The fitted line at h/w = x (m,) and its 95 % band: quantiles of lines within the errors and, with three rows and
    more, of their scatter (Student's t of the line's mean, Working's formula at a point)."""
    random = np.random.default_rng(SEED)
    known, at = np.log(points.x), np.log(x)
    a, b, spread = line(known, np.log(points.distance))
    a_moved, b_moved, _ = line(known, np.log(points.moved(random, SAMPLES)))
    lines = a_moved[:, None] + b_moved[:, None] * at
    if len(points) > 2:
        centred = known - known.mean()
        scatter = float(spread) * np.sqrt(float(centred @ centred) / len(points) + (at - known.mean()) ** 2)
        lines = lines + random.standard_t(len(points) - 2, SAMPLES)[:, None] * scatter
    low, high = np.quantile(lines, [(1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0], axis=0)
    return np.exp(a + b * at), np.exp(low), np.exp(high)


def _fit(x: FloatArray, d: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """d0, c, q (m,) of d = d0 + c x^q for distances (m, n), least squares of residuals relative to d.

    For every q of a fine grid the two linear parameters are those of the normal equations; the best q is then refined
    by the parabola through it and its neighbours.
    """
    powers = np.linspace(*POWERS, _TRIED)
    misfit = np.stack([_linear(x, d, np.full(d.shape[0], q))[2] for q in powers])
    best = np.clip(np.argmin(misfit, axis=0), 1, _TRIED - 2)
    rows = np.arange(d.shape[0])
    left, middle, right = (misfit[best + k, rows] for k in (-1, 0, 1))
    bend = left - 2.0 * middle + right
    shift = np.where(bend > 0.0, 0.5 * (left - right) / np.where(bend > 0.0, bend, 1.0), 0.0)
    q = powers[best] + np.clip(shift, -1.0, 1.0) * (powers[1] - powers[0])
    d0, c, _ = _linear(x, d, q)
    return d0, c, q


def _linear(x: FloatArray, d: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """d0, c and the sum of squared relative residuals (m,) for distances (m, n) and powers (m,)."""
    z = x ** q[:, None]
    w = 1.0 / d**2
    s, sz, szz = w.sum(axis=1), (w * z).sum(axis=1), (w * z * z).sum(axis=1)
    sd, szd = (w * d).sum(axis=1), (w * z * d).sum(axis=1)
    c = (s * szd - sz * sd) / (s * szz - sz * sz)
    d0 = (sd - c * sz) / s
    rest = (d - d0[:, None] - c[:, None] * z) / d
    return d0, c, np.asarray((rest**2).sum(axis=1))


def limit(points: Points) -> Limit | None:
    """The limit of the distance; None with fewer than four claimed rows."""
    if len(points) < LEAST_FOR_LIMIT:
        return None
    d0, c, power, _ = _limit(points)
    fitted = d0.value + c * points.x**power.value
    return Limit(d0, c, power, float(np.abs(fitted / points.distance - 1.0).max()))


def _limit(points: Points) -> tuple[Estimate, float, Estimate, FloatArray]:
    """d0, c, q, and samples of q (SAMPLES,) with both uncertainties."""
    random = np.random.default_rng(SEED)
    x, d = points.x, points.distance
    d0, c, q = (float(v[0]) for v in _fit(x, d[None, :]))
    z = x**q
    rest = (d - d0 - c * z) / d
    jacobian = np.column_stack([np.ones_like(x), z, c * z * np.log(x)]) / d[:, None]
    freedom = len(points) - 3
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * float(rest @ rest) / freedom
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    moved = _fit(x, points.moved(random, SAMPLES))
    left = _estimate(d0, float(spread[0]), freedom, moved[0], random)
    power = _estimate(q, float(spread[2]), freedom, moved[2], random)
    sampled = moved[2] + float(spread[2]) * random.standard_t(freedom, SAMPLES)
    return left, c, power, sampled


@dataclass(frozen=True)
class Scalar:
    """A quantity of the shell at h/w = 0: its extrapolated value with intervals, the ribbon's, and whether that lies in
    the interval widened by the ribbon's own error (None: no ribbon value)."""

    name: str
    value: Estimate
    ribbon: float | None
    inside: bool | None


def powers(points: Points) -> tuple[float, FloatArray]:
    """The power of h/w with which the rows converge, and samples (SAMPLES,) of it: of the limit with four rows and
    more, otherwise of the slope (three rows at least)."""
    if len(points) >= LEAST_FOR_LIMIT:
        _, _, power, sampled = _limit(points)
        q = power.value
    else:
        random = np.random.default_rng(SEED)
        q, spread, drawn = _slope(points, random)
        sampled = drawn + spread * random.standard_t(len(points) - 2, SAMPLES)
    low, high = POWERS
    return q, np.minimum(np.maximum(sampled, low), high)


def richardson(
    points: Points,
    values: ArrayLike,
    errors: ArrayLike | None = None,
    power: tuple[float, FloatArray] | None = None,
) -> Estimate | None:
    """v0 of v = v0 + a (h/w)^q for values (n,) at the rows of `points`, known to `errors` (n,); None below three rows.

    q and its samples are `power`, by default `powers(points)`.
    """
    v = np.asarray(values, dtype=float)
    if v.shape != points.x.shape:
        raise ValueError(f"values of shape {v.shape}: one for each of the {len(points)} rows")
    if len(points) < 3:
        return None
    random = np.random.default_rng(SEED + 1)
    q, sampled = powers(points) if power is None else power
    value, spread = _intercept(points.x, v[None, :], np.array([q]))
    bounds = np.zeros(v.size) if errors is None else np.asarray(errors, dtype=float)
    moved: FloatArray = np.add(v, random.uniform(-1.0, 1.0, (SAMPLES, v.size)) * bounds)
    there, _ = _intercept(points.x, moved, sampled)
    return _estimate(float(value[0]), float(spread[0]), len(points) - 2, there, random)


def _intercept(x: FloatArray, v: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """v0 and its standard error (m,) of least squares v = v0 + a x^q for values (m, n) and powers (m,)."""
    z = x ** q[:, None]
    mean = z.mean(axis=1)
    centred = z - mean[:, None]
    weight = (centred**2).sum(axis=1)
    a = (v * centred).sum(axis=1) / weight
    v0 = v.mean(axis=1) - a * mean
    rest = v - v0[:, None] - a[:, None] * z
    variance = (rest**2).sum(axis=1) / max(x.size - 2, 1)
    return v0, np.sqrt(variance * (1.0 / x.size + mean**2 / weight))


def scalars(
    points: Points,
    shell: Mapping[str, Sequence[float]],
    ribbon: Mapping[str, float],
    errors: Mapping[str, FloatArray],
    ribbon_errors: Mapping[str, float],
) -> list[Scalar]:
    """Every quantity of the shell (one value for each row of `points`) at h/w = 0, beside the ribbon's.

    errors, ribbon_errors: bounds of the discretisation errors by name, where they are known.
    """
    if len(points) < 3:
        return []
    found = []
    power = powers(points)
    for name, values in shell.items():
        estimate = richardson(points, values, errors.get(name), power)
        assert estimate is not None
        there = ribbon.get(name)
        inside = None
        if there is not None:
            own = ribbon_errors.get(name, 0.0)
            inside = estimate.both[0] - own <= there <= estimate.both[1] + own
        found.append(Scalar(name, estimate, there, inside))
    return found
