"""Kirchhoff's rod of rectangular section: bending and torsion apart, whatever the width.

Per length in D w / l^2, without the constant K^2 / 2; in-plane bending (`free.in_plane_stiffness`) is a term apart
(docs/theory.md, eq. (10.18))::

    e(k, t) = 1/2 b (k - K)^2 + 1/2 c t^2 - 1/2 K^2 ,   c = G J / (D w) = 2 (1 - nu) J / (w h^3 / 3)
    J = w h^3 / 3 [1 - 192 h / (pi^5 w) sum_(n odd) tanh(n pi w / (2 h)) / n^5]

stiffness = "matched" (section[3] = 0): b = 1, the rod's Y I raised by 1 / (1 - nu^2) to the ribbon's D w, so that both
bend alike (thesis, 4.4); "plate" (section[3] = 1): b = 1 - nu^2, Y I, as a narrow plate whose section may curve across.
"""

from __future__ import annotations

from numba import njit

from ribbon.energies.energy import FreeTwist
from ribbon.energies.section.profile import ROD
from ribbon.energies.section.rod import stiffnesses


@njit(cache=True)
def density(k, t, dk, dt, natural, slope, section, out):
    """Fills `out` (15,) (layout: `ribbon.energies.free`)."""
    bending, torsion = stiffnesses(section)
    kb = k - natural
    out[:] = 0.0
    out[0] = 0.5 * bending * kb * kb - 0.5 * natural * natural + 0.5 * torsion * t * t
    out[1] = bending * kb
    out[2] = torsion * t
    out[5] = bending
    out[9] = torsion


@njit(cache=True)
def pretwist(k, t, natural, rest, section, out):
    """Adds to `out` (15,) what makes 1/2 c t^2 1/2 c (t - rest)^2."""
    _, torsion = stiffnesses(section)
    out[0] += torsion * rest * (0.5 * rest - t)
    out[2] -= torsion * rest


ENERGY = FreeTwist(
    density,
    pretwist=pretwist,
    needs=("thickness",),
    in_plane=True,
    section=ROD,
    words="Kirchhoff's rod of rectangular section",
)
