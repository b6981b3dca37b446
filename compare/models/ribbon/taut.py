"""A strip between clamps one length apart as one that stretches: what an inextensible model leaves undetermined.

Its shape is nearly straight there, and its tension T (D w / l^2) the same all along it. With l = 1, D w = 1 the
deflection v under a weight q across it and the tension obey::

    v'''' - T v'' = q,   v = v' = 0 at both ends,   T = (E A) int v'^2 / 2,   E A = 12 (1 - nu^2) (l / h)^2

(S. Timoshenko and S. Woinowsky-Krieger, Theory of Plates and Shells, 1959, chapter 1, section 3: built-in edges that
cannot come nearer to each other). With k = sqrt(T), y = x - 1/2::

    v  = q / (2 T) (x (1 - x) - (cosh(k / 2) - cosh(k y)) / (k sinh(k / 2)))
    v' = q / (2 T) (sinh(k y) / sinh(k / 2) - 2 y)

The limits of it: slopes are small, strains the same over the width but near the clamps, and the weight acts along t_y.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.scene.inputs.law import values

if TYPE_CHECKING:
    from compare.scene.scene import Scene

FloatArray = NDArray[np.float64]

#: Who else can be asked.
_ASK = 'ask one that stretches: model.energy = "antman", or ribbonbench shell'
#: Weight along the strip, over that across it, up to which it counts as none: it changes the tension from one end to
#: the other by this part of the weight, which is small against the tension.
_ACROSS = 1e-6
#: k below which the tension does not change the deflection (by some k^2 / 40 of it).
_WEAK = 3e-3
#: Layers (1 / k) at each clamp, and Gauss points there and between them.
_LAYERS, _POINTS = 30.0, 24


@dataclass(frozen=True)
class Taut:
    """tension: D w / l^2; sag: of the middle, l; share: "bending" and "membrane" in the elastic energy, or zeros."""

    tension: float
    sag: float
    share: dict[str, float]


def taut(scene: Scene, thickness: float | None = None) -> Taut | None:
    """The strip that stretches in the place of a straight one between clamps; thickness: h / l, None: the scene's own,
    or that of its only w/h. None where there is none, or where the scene is not of this kind."""
    h = thickness or scene.thickness or (
        scene.width / scene.shell.width_to_thickness[0] if len(scene.shell.width_to_thickness) == 1 else None
    )  # fmt: skip
    start, end = scene.start_frame, scene.end_frame
    if h is None or start is None or end is None or scene.barriers or any(values(scene.curvature)) or scene.shaped:
        return None
    up = scene.up
    if up is None or not scene.gamma:
        return Taut(0.0, 0.0, {"bending": 0.0, "membrane": 0.0})
    across, normal, along = np.abs(np.asarray(up, dtype=float) @ start)
    if max(across, along) > _ACROSS * normal:
        return None
    return between_clamps(scene.gamma * float(normal), 12.0 * (1.0 - scene.strip.poisson**2) / h**2)


def words(scene: Scene) -> str:
    """What a strip that stretches does in the place of the scene's, or where to ask; without a full stop."""
    found, units = taut(scene), scene.units
    if found is not None:
        return (
            f"one that stretches sags by {units.text(found.sag, 'l')} and is under a tension of "
            f"{units.text(found.tension, 'D w / l^2')}"
        )
    if scene.thickness is None and not scene.shell.width_to_thickness:
        return f"give strip.thickness, and {_ASK}"
    return _ASK


def between_clamps(weight: float, stretching: float) -> Taut:
    """weight: q, D w / l^3, positive; stretching: E A, D w / l^2."""
    from scipy.optimize import brentq

    def excess(logarithm: float) -> float:
        return logarithm - math.log(0.5 * stretching * _mean_square_slope(weight, math.exp(0.5 * logarithm)))

    stiff = math.log(stretching * weight**2 / 60480.0)  # of the slope that bending alone allows
    string = math.log(stretching * weight**2 / 24.0) / 3.0  # of a string
    tension = math.exp(brentq(excess, min(stiff, string) - 2.0, max(stiff, string) + 1.0, xtol=1e-13))
    k = math.sqrt(tension)
    sag = weight / 384.0 if k < _WEAK else 0.5 * weight / tension * (0.25 - math.tanh(0.25 * k) / k)
    s, rule = _points(k)
    bending = 0.5 * float(rule @ _curvature(weight, k, s) ** 2)
    membrane = 0.5 * tension**2 / stretching
    whole = bending + membrane
    return Taut(tension, sag, {"bending": bending / whole, "membrane": membrane / whole})


def _mean_square_slope(weight: float, k: float) -> float:
    """int v'^2 over the strip."""
    if k < _WEAK:
        return weight**2 / 30240.0
    y, rule = _points(k)
    return float(rule @ (0.5 * weight / k**2 * (_ratio(k, y) - 2.0 * y)) ** 2)


def _curvature(weight: float, k: float, y: FloatArray) -> FloatArray:
    """v'' at y (n,)."""
    if k < _WEAK:
        return weight * (0.5 * y**2 - 1.0 / 24.0)
    grown = np.exp(k * (np.abs(y) - 0.5)) * (1.0 + np.exp(-2.0 * k * np.abs(y))) / -math.expm1(-k)
    return np.asarray(0.5 * weight / k**2 * (k * grown - 2.0))


def _ratio(k: float, y: FloatArray) -> FloatArray:
    """sinh(k y) / sinh(k / 2), no term of which overflows."""
    return np.asarray(np.sign(y) * np.exp(k * (np.abs(y) - 0.5)) * np.expm1(-2.0 * k * np.abs(y)) / math.expm1(-k))


def _points(k: float) -> tuple[FloatArray, FloatArray]:
    """y (n,) in [-1/2, 1/2] and weights (n,) of Gauss's rule, finer in the layers beside the clamps."""
    layer = min(_LAYERS / k, 0.25)
    places = np.array([0.0, 0.01, 0.03, 0.1, 0.3, 1.0]) * layer - 0.5
    cuts = np.concatenate([places, [0.0], -places[::-1]])
    gauss, rule = np.polynomial.legendre.leggauss(_POINTS)
    half, middle = 0.5 * np.diff(cuts)[:, None], 0.5 * (cuts[1:] + cuts[:-1])[:, None]
    return (middle + half * gauss).ravel(), (half * rule).ravel()
