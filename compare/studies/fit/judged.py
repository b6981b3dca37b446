"""How good a fit is: what is left against the length, against the points' own scatter, and whether it is an offset.

What is left is noise of the points, or a systematic difference: of the model, of the keys that are held, of the place
where the points stand. The two are told apart by neighbours along the strip: noise differs from point to point, a
difference of shapes hardly does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from compare.measure.grades import GOOD, GOOD_UP_TO, UNKNOWN, YARDSTICK, graded, worst

FloatArray = NDArray[np.float64]

#: Times the points' own scatter from which what is left is no noise.
SYSTEMATIC = 2.5
#: Share of what is left that a rigid motion has to take away for an offset to be seen, in the variance.
_TAKEN = 0.75


@dataclass(frozen=True)
class Offset:
    """A rigid motion of the points that would take most of what is left away, to first order: shift (l) of their mean,
    turn (rad), rms (l) that would be left, moved: root mean square of how far the points would go, l."""

    shift: float
    turn: float
    rms: float
    moved: float


def rms_of(residuals: FloatArray) -> float:
    """Root mean square of the distances, of residuals (3 n,)."""
    return float(np.sqrt(np.mean(np.sum(residuals.reshape(-1, 3) ** 2, axis=1))))


def scatter(residuals: FloatArray, feet: FloatArray) -> float | None:
    """The points' own scatter (root mean square distance, l) from the residuals (3 n,) of neighbours along the strip.

    Each inner point's residual against the line through its neighbours', ``d_i - a d_(i-1) - b d_(i+1)``, a + b = 1,
    has (1 + a^2 + b^2) times the variance of independent noise, and of a smooth difference only its second derivative
    (J. von Neumann 1941; T. Gasser, L. Sroka, C. Jennen-Steinmetz 1986). None for fewer than five points.
    """
    order = np.argsort(feet, kind="stable")
    s, d = feet[order], residuals.reshape(-1, 3)[order]
    if len(s) < 5:
        return None
    gap = np.maximum(s[2:] - s[:-2], 1e-12)
    after = np.clip((s[1:-1] - s[:-2]) / gap, 0.0, 1.0)
    before = 1.0 - after
    off = d[1:-1] - before[:, None] * d[:-2] - after[:, None] * d[2:]
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1) / (1.0 + before**2 + after**2))))


def offset(
    residuals: FloatArray, keys: FloatArray, moved: FloatArray, freedom: int, places: FloatArray
) -> Offset | None:
    """The rigid motion that the residuals (3 n,) ask for beside the keys; None where they ask for none.

    keys (3 n, k), moved (3 n, 6): derivatives of the residuals by both; freedom: of the fit without the motion; places
    (n, 3): the points.
    """
    if freedom <= 6:
        return None
    both = np.concatenate([keys, moved], axis=1)
    step = np.linalg.lstsq(both, -residuals, rcond=1e-8)[0]
    left = residuals + both @ step
    if left @ left / (freedom - 6) > (1.0 - _TAKEN) * (residuals @ residuals) / freedom:
        return None
    turn, shift = step[-6:-3], step[-3:]
    far = shift + np.cross(turn, places - places.mean(axis=0))
    size = float(np.sqrt(np.mean(np.sum(far**2, axis=1))))
    if size <= YARDSTICK:
        return None
    return Offset(float(np.linalg.norm(shift)), float(np.linalg.norm(turn)), rms_of(left), size)


def grade(rms: float, own: float | None, freedom: int, seen: Offset | None) -> str:
    """The grade of a fit that leaves `rms` (l) of points with their `own` scatter.

    Noise is good up to 1 % of the length (fair to 5 %); a systematic difference up to the eye's 0.1 % (0.5 %), and so
    is what cannot be told apart, and an offset of the points. Unknown where every number is used up by an unknown.
    """
    if freedom <= 0:
        return UNKNOWN if rms <= YARDSTICK else graded(rms, YARDSTICK)
    noise = own is not None and rms <= SYSTEMATIC * own
    left = graded(rms, GOOD_UP_TO["distance"] if noise else YARDSTICK)
    return worst(left, GOOD if seen is None else graded(seen.moved, YARDSTICK))
