"""Michell's ring beyond its critical turn, touching itself at one place or at two: by shooting Kirchhoff's equations.

A round rod of length 1, bending stiffness 1 and torsional stiffness C, straight at rest, joined after a turn T of its
end about the tangent (J. H. Michell 1889; B. D. Coleman and D. Swigon 2000, doi:10.1023/A:1010911113919). Its twist t
is even, and with the tangent u, the moment m = u x u' + C t u and the force n::

    r' = u ,   u' = m x u ,   m' = n x u ,   n' = 0   between places of contact.

It is alike about three axes: e_1 through the apexes s = 0 and 1/2, e_3 through s = 1/4 and 3/4. So it is shot from
s = 0, r = (x, 0, 0), u = (0, cos a, sin a), m = k e_1 x .. + C t u with no part along e_1, n without one either, to
s = 1/4, where r and m are on the axis as the other strand's are: r_1 = r_2 = u_3 = m_3 = 0.

free        n_3 = 0 at s = 1/4 (no force from the other strand).
one place   r_3 = d / 2 at s = 1/4; what the strands push each other with is F = 2 n_3.
two places  s and -s, images about e_1: there they are d apart and nearest to each other, and a force F jumps straight
            across (in the plane of e_2 and e_3); n_3 = 0 at s = 1/4.

T = t + 2 pi Wr (White, Calugareanu), the writhe by Gauss's integral, sum over pairs of chords in closed form (K. Klenin
and J. Langowski 2000, doi:10.1002/1097-0282(20001015)54:5<307::AID-BIP20>3.0.CO;2-Y). No code is shared with any solver
of the package.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root

FloatArray = NDArray[np.float64]

#: Images of a quarter: about e_1 (s -> -s), e_2 (s -> s + 1/2) and e_3 (s -> 1/2 - s).
_E1, _E2, _E3 = np.diag([1.0, -1.0, -1.0]), np.diag([-1.0, 1.0, -1.0]), np.diag([-1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Ring:
    """A ring at rest: its twist t (rad), turn T (rad), writhe, energy, force F of each place of contact, its abscissa s
    (and -s, 1/2 - s, 1/2 + s; nan: free), curvature at the apex, distance of the strands at s = 1/4, largest mismatch
    of the shooting, and the unknowns of the shooting."""

    twist: float
    turn: float
    writhe: float
    energy: float
    force: float
    place: float
    apex: float
    neck: float
    mismatch: float
    unknowns: FloatArray


def _rate(_: float, y: FloatArray) -> list[float]:
    """Of (r, u, m, n, energy of bending)."""
    a, b, c, m1, m2, m3, f, g, h = y[3:12].tolist()
    d1, d2, d3 = m2 * c - m3 * b, m3 * a - m1 * c, m1 * b - m2 * a
    bent = 0.5 * (d1 * d1 + d2 * d2 + d3 * d3)
    return [a, b, c, d1, d2, d3, g * c - h * b, h * a - f * c, f * b - g * a, 0.0, 0.0, 0.0, bent]


def _walked(y: FloatArray, low: float, high: float, at: FloatArray | None = None) -> FloatArray:
    """States (13,) at `high`, or (k, 13) at `at`."""
    found = solve_ivp(_rate, (low, high), y, method="DOP853", rtol=1e-12, atol=1e-12, t_eval=at)
    return found.y[:, -1] if at is None else found.y.T


def _begun(v: FloatArray, apex: float, torsion: float) -> FloatArray:
    """The state at s = 0 by (x, a, t, n_2, n_3) and the curvature at the apex."""
    x, a, twist, second, third = v[:5]
    u = np.array([0.0, np.cos(a), np.sin(a)])
    binormal = np.cross(u, [-1.0, 0.0, 0.0])
    return np.concatenate([[x, 0.0, 0.0], u, apex * binormal + torsion * twist * u, [0.0, second, third, 0.0]])


def _pushed(y: FloatArray, force: float) -> FloatArray:
    """The state behind a place where the image about e_1 pushes it straight off: n' = -f."""
    out = y.copy()
    across = np.array([0.0, *y[1:3]]) / np.hypot(*y[1:3])
    out[9:12] -= force * across
    return out


def _missed(v: FloatArray, apex: float, torsion: float, diameter: float, places: int) -> FloatArray:
    y = _begun(v, apex, torsion)
    if places == 2:
        y = _walked(y, 0.0, v[5])
        near = [np.hypot(y[1], y[2]) - 0.5 * diameter, (y[1] * y[4] + y[2] * y[5]) / (0.5 * diameter)]
        y = _walked(_pushed(y, v[6]), v[5], 0.25)
        return np.array([y[0], y[1], y[5], y[8], y[11], *near])
    y = _walked(y, 0.0, 0.25)
    last = y[11] if places == 0 else y[2] - 0.5 * diameter
    return np.array([y[0], y[1], y[5], y[8], last])


def _curve(begin: FloatArray, v: FloatArray, places: int, count: int) -> FloatArray:
    """The whole ring, (4 count, 3), at equal distances along it."""
    s = np.linspace(0.0, 0.25, count + 1)
    if places == 2:
        there = _walked(begin, 0.0, v[5])
        first, behind = s[s <= v[5]], s[s > v[5]]
        r = np.concatenate([
            _walked(begin, 0.0, v[5], first)[:, :3], _walked(_pushed(there, v[6]), v[5], 0.25, behind)[:, :3],
        ])  # fmt: skip
    else:
        r = _walked(begin, 0.0, 0.25, s)[:, :3]
    half = np.concatenate([r, (r @ _E3)[-2:0:-1]])  # s in [0, 1/2)
    return np.concatenate([half, half @ _E2])


def writhe(r: FloatArray) -> float:
    """Of the closed polygon r (k, 3): the sum of the solid angles of pairs of its chords over 2 pi."""
    a, b = r, np.roll(r, -1, axis=0)
    total = 0.0
    for i in range(len(r) - 2):
        j = slice(i + 2, len(r) if i else len(r) - 1)
        one, two, three, four = a[j] - a[i], b[j] - a[i], b[j] - b[i], a[j] - b[i]
        faces = [np.cross(p, q) for p, q in ((one, two), (two, three), (three, four), (four, one))]
        faces = [f / np.maximum(np.linalg.norm(f, axis=1), 1e-300)[:, None] for f in faces]
        angle = sum(np.arcsin(np.clip(np.einsum("ki,ki->k", f, g), -1.0, 1.0)) for f, g in pairwise([*faces, faces[0]]))
        side = np.einsum("ki,ki->k", np.cross(b[j] - a[j], b[i] - a[i]), one)
        total += float((angle * np.sign(side)).sum())
    return total / (2.0 * np.pi)


def ring(
    apex: float, torsion: float, diameter: float, guess: FloatArray, places: int = 1, *, chords: int = 100
) -> Ring:
    """The ring of the curvature `apex` at s = 0, from a guess (5,) or (7,) of (x, a, t, n_2, n_3, s, F); `places` of
    contact: 0, 1 or 2. chords: of a quarter, and of twice as many, from which the writhe is extrapolated (order 2).

    `ValueError` where the shooting does not end."""
    given = (apex, torsion, diameter, places)
    found = root(_missed, guess, args=given, method="hybr", tol=1e-13)
    v = np.asarray(found.x)
    mismatch = float(np.abs(_missed(v, *given)).max())
    if not mismatch < 1e-8 or (places == 2 and not 0.0 < v[5] < 0.25):
        raise ValueError(f"no ring of the curvature {apex:g}: {found.message}")
    y, twist = _begun(v, apex, torsion), float(v[2])
    coarse, fine = (writhe(_curve(y, v, places, count)) for count in (chords, 2 * chords))
    wr = (4.0 * fine - coarse) / 3.0
    end = _walked(_pushed(_walked(y, 0.0, v[5]), v[6]), v[5], 0.25) if places == 2 else _walked(y, 0.0, 0.25)
    force, place = {0: (0.0, np.nan), 1: (2.0 * float(end[11]), 0.25), 2: (float(v[-1]), float(v[-2]))}[places]
    energy = 4.0 * float(end[12]) + 0.5 * torsion * twist**2
    return Ring(twist, twist + 2.0 * np.pi * wr, wr, energy, force, place, apex, 2.0 * float(end[2]), mismatch, v)


def of_turn(
    turn: float, torsion: float, diameter: float, guess: FloatArray, apices: tuple[float, float], places: int = 1
) -> Ring:
    """The ring of the turn T between two curvatures of the apex, from a guess for the first."""
    known = {"v": np.asarray(guess, dtype=float)}

    def missed(apex: float) -> float:
        found = ring(apex, torsion, diameter, known["v"], places, chords=50)
        known["v"], known["ring"] = found.unknowns, found
        return found.turn - turn

    brentq(missed, *apices, xtol=1e-8)
    return known["ring"]


def opened(torsion: float, diameter: float, guess: FloatArray) -> Ring:
    """The ring whose one place of contact pushes no more, from a guess (6,) of (x, a, t, n_2, n_3) and the curvature of
    the apex. `ValueError` where the shooting does not end."""

    def missed(v: FloatArray) -> FloatArray:
        own = _missed(v[:5], float(v[5]), torsion, diameter, 1)
        return np.append(own, v[4])  # n_3 is the same from s = 0 to 1/4

    v = np.asarray(root(missed, guess, method="hybr", tol=1e-13).x)
    return ring(float(v[5]), torsion, diameter, v[:5])
