"""A twisted round rod between clamps that touches itself at several places, or along a line: by shooting.

As `tests.reference.clamped_rod`, of which it goes on where that ends; the strand's contact with its image is that of
`tests.reference.strand`: from the middle outwards what touches is given by letters, "pp" two places, "plp" a place, a
line and a place. No code is shared with any solver of the package.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from tests.reference import strand

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Plectoneme:
    """A rod at rest: distance Z of its ends, twist t (rad), energy, tension T and moment M along the axis, what touches
    (half of it, by the distance from the middle), largest mismatch, and the shooting's unknowns: (x, a, t, n_2, n_3,
    curvature) in the middle, then those of `strand.along`."""

    distance: float
    twist: float
    energy: float
    tension: float
    moment: float
    touched: strand.Touched
    mismatch: float
    unknowns: FloatArray


def _end(v: FloatArray, touch: str, torsion: float, diameter: float) -> tuple[FloatArray, list[float]]:
    return strand.along(strand.begun(*v[:6], torsion), touch, v[6:], diameter, 0.5)


def held(distance: float, turn: float, torsion: float, diameter: float, touch: str, guess: FloatArray) -> Plectoneme:
    """The rod at a distance of its ends, turned by R (up to whole turns), that touches itself so, from a guess of the
    unknowns. `ValueError` where the shooting does not end."""

    def missed(v: FloatArray) -> FloatArray:
        y, own = _end(v, touch, torsion, diameter)
        turned = np.sin(0.5 * (turn - v[2]) - np.arctan2(y[14], y[13]))
        return np.array([*own, y[0], y[1], y[3], y[4], turned, 2.0 * y[2] - distance])

    found = root(missed, guess, method="hybr", tol=1e-10)
    v = np.asarray(found.x)
    mismatch = float(np.abs(missed(v)).max())
    if not mismatch < 1e-7:
        raise ValueError(f"no rod from there: {mismatch:.1e}, {found.message}")
    y, _ = _end(v, touch, torsion, diameter)
    energy = 2.0 * float(y[12]) + 0.5 * torsion * float(v[2]) ** 2
    own = strand.touched(strand.begun(*v[:6], torsion), touch, v[6:], diameter, 0.5)
    return Plectoneme(2.0 * float(y[2]), float(v[2]), energy, float(y[11]), float(y[8]), own, mismatch, v)
