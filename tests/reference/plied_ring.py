"""Michell's ring that touches itself at two places, at three, or at places and along a line: by shooting.

As `tests.reference.touching_ring` has it, from the apex s = 0 on e_1 to s = 1/4 on e_3, contact with the image about
e_1 by `tests.reference.strand`. At s = 1/4: r_1 = r_2 = u_3 = m_3 = 0; n_3 = 0, or on a third place r_3 = d / 2 (what
it pushes with is 2 n_3); on a line that goes through, r_1 = r_2 = m_3 = 0, the rest is the line's.

The turn is found without Gauss's integral: a direction w carried from e_1 along a quarter without twist has turned by b
about the tangent, from e_3, and by the ring's three axes T = t + 4 b up to whole turns (F. B. Fuller 1978,
doi:10.1073/pnas.75.8.3557: writhe and the turn of a direction carried along are the same, up to an integer).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from tests.reference import strand

FloatArray = NDArray[np.float64]

#: What touches from the apex to s = 1/4: one place beside each apex, another halfway, or a line through it.
TWO, THREE, LINE = "p", "p.", "pm"


@dataclass(frozen=True)
class Ring:
    """A ring at rest: turn T and twist t (rad), energy, what touches on a quarter (a third place: the last one, with
    all of its force), largest mismatch, and the unknowns (x, a, t, n_2, n_3, curvature at the apex, then those of
    `strand.along`)."""

    turn: float
    twist: float
    energy: float
    touched: strand.Touched
    mismatch: float
    unknowns: FloatArray


def _quarter(v: FloatArray, touch: str, torsion: float, diameter: float) -> tuple[FloatArray, list[float]]:
    return strand.along(strand.begun(*v[:6], torsion), touch.rstrip("."), v[6:], diameter, 0.25)


def carried(y: FloatArray) -> float:
    """The angle b of the direction w carried along, about the tangent, from e_3."""
    u, w, axis = y[3:6], y[13:16], np.array([0.0, 0.0, 1.0])
    return float(np.arctan2(w @ np.cross(u, axis), w @ axis))


def ring(turn: float, torsion: float, diameter: float, touch: str, guess: FloatArray) -> Ring:
    """The ring of the turn T (up to whole turns) that touches itself so, from a guess of the unknowns. `ValueError`
    where the shooting does not end."""

    def missed(v: FloatArray) -> FloatArray:
        y, own = _quarter(v, touch, torsion, diameter)
        last = [y[8], y[0], y[1]]
        if touch != LINE:
            last += [y[5], y[11] if touch == TWO else y[2] - 0.5 * diameter]
        return np.array([*own, *last, np.sin(0.5 * (turn - v[2]) - 2.0 * carried(y))])

    found = root(missed, guess, method="hybr", tol=1e-10)
    v = np.asarray(found.x)
    mismatch = float(np.abs(missed(v)).max())
    if not mismatch < 1e-7:
        raise ValueError(f"no ring from there: {mismatch:.1e}, {found.message}")
    y, _ = _quarter(v, touch, torsion, diameter)
    own = strand.touched(strand.begun(*v[:6], torsion), touch.rstrip("."), v[6:], diameter, 0.25)
    if touch == THREE:
        own.places.append(0.25)
        own.forces.append(2.0 * float(y[11]))
    energy = 4.0 * float(y[12]) + 0.5 * torsion * float(v[2]) ** 2
    return Ring(turn, float(v[2]), energy, own, mismatch, v)
