"""The first correction of a closed trefoil's energy as its rod becomes thin: two strands about each other on a circle.

A closed rod of length l, bending stiffness B, without twist or friction, is tied into a trefoil. As its diameter h goes
to 0 it becomes a circle of radius R = l / (4 pi) covered twice (H. Gerlach, Ph. Reiter, H. von der Mosel 2017,
doi:10.1007/s00205-017-1100-9), of energy 8 pi^2 B / l. For a thin one let both strands be (h / 2) u off that circle,
u = (u_r, u_z)(theta) along its radius and its axis, u(theta + 2 pi) = -u(theta). The second variation of the energy at
one length, whose multiplier is B / (2 R^2), is here (each harmonic k costs (k^2 - 1)^2 along the radius, k^4 - k^2
along the axis)::

    E = 8 pi^2 B / l + (B h^2 / (8 R^3)) int_0^(4 pi) u_r''^2 - 2 u_r'^2 + u_r^2 + u_z''^2 - u_z'^2 dtheta ,  |u| >= 1 .

Where strands touch all along, u = (cos a, sin a), a(theta + 2 pi / 3) = a + pi: three half turns on the way once round.
a is a Fourier series here, whose energy is made least. Each pushes with (B h / (2 R^4)) q per length,

    q = u_r (u_r'''' + 2 u_r'' + u_r) + u_z (u_z'''' + u_z'') ,

which is positive everywhere, so that they do touch all along. Derived here. No code is shared with any solver of the
package.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

FloatArray = NDArray[np.float64]

#: Harmonics of a, and samples of a third of the way round.
_HARMONICS, _SAMPLES = 4, 120


@dataclass(frozen=True)
class Thin:
    """excess: of the energy over that of the circle covered twice, B h^2 / l^3; even: that of a uniform turn, a = 3
    theta / 2; least, most: of the push per length, B h / l^4; series: amplitudes (j,) of sin(3 j theta) in a."""

    excess: float
    even: float
    least: float
    most: float
    series: FloatArray

    def energy(self, diameter: float) -> float:
        """B / l, of a rod of this diameter (l)."""
        return 8.0 * np.pi**2 + self.excess * diameter**2


def _angles(series: FloatArray) -> tuple[FloatArray, ...]:
    """a and its derivatives to the fourth, over a third of the way round."""
    theta = np.arange(_SAMPLES) * 2.0 * np.pi / (3.0 * _SAMPLES)
    k = 3.0 * np.arange(1, series.size + 1)
    sin, cos = np.sin(np.outer(theta, k)), np.cos(np.outer(theta, k))
    return (1.5 * theta + sin @ series, 1.5 + cos @ (k * series), -sin @ (k**2 * series), -cos @ (k**3 * series),
            sin @ (k**4 * series))  # fmt: skip


def _mean(series: FloatArray) -> float:
    """The integrand's mean."""
    a, b, c, _, _ = _angles(series)
    return float(np.mean(c**2 + b**4 - (2.0 * np.sin(a) ** 2 + np.cos(a) ** 2) * b**2 + np.cos(a) ** 2))


def thin() -> Thin:
    """The limit of a thin trefoil."""
    found = minimize(_mean, np.zeros(_HARMONICS), method="BFGS", options={"gtol": 1e-10}).x
    a, b, c, d, _ = _angles(found)
    # along u = (cos a, sin a): u . u'' = -a'^2, u . u'''' = a'^4 - 3 a''^2 - 4 a' a'''
    radial = np.cos(a) * (-c * np.sin(a) - b**2 * np.cos(a))  # u_r u_r''
    q = b**4 - 3.0 * c**2 - 4.0 * b * d - b**2 + radial + np.cos(a) ** 2
    unit = 4.0 * np.pi * (4.0 * np.pi) ** 3 / 8.0
    push = 0.5 * (4.0 * np.pi) ** 4
    return Thin(unit * _mean(found), unit * _mean(np.zeros(1)), push * float(q.min()), push * float(q.max()), found)
