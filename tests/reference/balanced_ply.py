"""A balanced ply of two strands by energy alone: no force, no rod theory, nothing of any solver of the package.

A round rod of bending stiffness 1 and torsional stiffness C that lies upon itself as a double helix of radius R (half
the distance of the strands) and angle b against its axis bends by sin^2 b / R and has the writhe sin 2b / (4 pi R) per
length (Fuller 1971), so that its twist is t = q - sin 2b / (2 R), q the angle per length by which it was turned.
Nothing pulls and nothing turns its free end: b is that of the least energy at a fixed q (J. M. T. Thompson, G. H. M.
van der Heijden and S. Neukirch 2002, doi:10.1098/rspa.2001.0901; Neukirch and Marko 2011,
doi:10.1103/PhysRevLett.106.138104)::

    e(b, R) = sin^4 b / (2 R^2) + C / 2 (q - sin 2b / (2 R))^2

and the strands push each other by p = de/dR per length, by virtual work: both part by 2 dR, and both have the energy e.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize_scalar

#: Angles between which a ply's strands are nearest to each other across its axis.
_LEAST, _MOST = 1e-3, 0.25 * np.pi - 1e-3


@dataclass(frozen=True)
class Ply:
    """Angle of the strands against the axis (rad), twist and turn per length, push per length, in units of the rod."""

    angle: float
    twist: float
    turn: float
    push: float


def _energy(angle: float, radius: float, turn: float, torsion: float) -> float:
    twist = turn - np.sin(2.0 * angle) / (2.0 * radius)
    return float(np.sin(angle) ** 4 / (2.0 * radius**2) + 0.5 * torsion * twist**2)


def _angle(radius: float, turn: float, torsion: float) -> float:
    found = minimize_scalar(
        lambda b: _energy(b, radius, turn, torsion), bounds=(_LEAST, _MOST), method="bounded",
        options={"xatol": 1e-13},
    )  # fmt: skip
    return float(found.x)


def _twist(radius: float, turn: float, torsion: float) -> float:
    return float(turn - np.sin(2.0 * _angle(radius, turn, torsion)) / (2.0 * radius))


def of_twist(twist: float, radius: float, torsion: float) -> Ply:
    """The ply of radius R that is twisted by `twist` per length."""
    turn = brentq(lambda q: _twist(radius, q, torsion) - twist, 1e-3 / radius, 20.0 / radius, xtol=1e-12)
    angle = _angle(radius, turn, torsion)
    step = 1e-4 * radius
    push = (_energy(angle, radius + step, turn, torsion) - _energy(angle, radius - step, turn, torsion)) / (2.0 * step)
    return Ply(angle, twist, float(turn), push)
