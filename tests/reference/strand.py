"""A strand that lies on its image about an axis at places and along a line: by Kirchhoff's equations.

The image about e_1 of a round rod is d from it where the rod is at d / 2 from e_1, and nearest to it there as long as
the rod is steeper than 45 degrees across e_1. With r, tangent u, moment m, force n (bending stiffness 1)::

    r' = u ,   u' = m x u ,   m' = n x u ,   n' = -p c ,

c the direction away from e_1, p the push per length. With G = (r_2^2 + r_3^2 - d^2 / 4) / 2 (primes by s; a star: the
parts across e_1)::

    G'  = r* . u* ,   G'' = u* . u* + r* . u'* ,   G''' = 3 u* . u'* + r* . u''* ,
    G'''' = 3 u'* . u'* + 4 u* . u''* + r* . u'''* .

A force F across makes G''' jump by F d / 2, a push p adds p d / 2 to G''''. So:

a place   G = G' = 0, a force F.
a line    it begins where G = G' = G'' = 0 (nothing exerts a moment at a point), with the force that makes G''' zero;
          on it p is what keeps G'''' zero; it ends where one likes, with a force. Before and behind it G rises with the
          cube of the distance, so that both forces push (B. D. Coleman and D. Swigon 2000,
          doi:10.1023/A:1010911113919, point - line - point).

No code is shared with any solver of the package.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

FloatArray = NDArray[np.float64]

#: Unknowns of a place (s, F), of a line (first s, last s, last F), and of one that goes on to the end (first s).
UNKNOWNS = {"p": 2, "l": 3, "m": 1}


@dataclass
class Touched:
    """What a strand touches with, in order: places and forces; the line's ends, and states (16, k) of the strand at
    abscissae along it with the push per length there."""

    places: list[float] = field(default_factory=list)
    forces: list[float] = field(default_factory=list)
    line: tuple[float, float] = (np.nan, np.nan)
    s: FloatArray = field(default_factory=lambda: np.empty(0))
    push: FloatArray = field(default_factory=lambda: np.empty(0))
    angle: FloatArray = field(default_factory=lambda: np.empty(0))


def _cross(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, float, float]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dot(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """Across e_1."""
    return a[1] * b[1] + a[2] * b[2]


def slopes(y: FloatArray | list[float]) -> tuple[float, float, float, float]:
    """G', G'', G''' and the push per length that keeps G'''' zero, of a state (r, u, m, n, ...)."""
    r, u, m, n = (tuple(float(v) for v in y[k : k + 3]) for k in (0, 3, 6, 9))
    du, dm = _cross(m, u), _cross(n, u)
    ddu = tuple(a + b for a, b in zip(_cross(dm, u), _cross(m, du), strict=True))
    three = [a + 2.0 * b + c for a, b, c in
             zip(_cross(_cross(n, du), u), _cross(dm, du), _cross(m, ddu), strict=True)]  # fmt: skip
    fourth = 3.0 * _dot(du, du) + 4.0 * _dot(u, ddu) + _dot(r, tuple(three))
    out = np.hypot(r[1], r[2])
    return _dot(r, u), _dot(u, u) + _dot(r, du), 3.0 * _dot(u, du) + _dot(r, ddu), -fourth / float(out)


def _rate(_: float, y: FloatArray, line: bool) -> list[float]:
    """Of (r, u, m, n, energy of bending, w): w is carried along without twist (Bishop 1975), w' = -(w . u') u."""
    a, b, c, m1, m2, m3, f, g, h = y[3:12].tolist()
    d1, d2, d3 = m2 * c - m3 * b, m3 * a - m1 * c, m1 * b - m2 * a
    w = y[13] * d1 + y[14] * d2 + y[15] * d3
    across = slopes(y)[3] / np.hypot(y[1], y[2]) if line else 0.0
    return [a, b, c, d1, d2, d3, g * c - h * b, h * a - f * c, f * b - g * a, 0.0, -across * y[1], -across * y[2],
            0.5 * (d1 * d1 + d2 * d2 + d3 * d3), -w * a, -w * b, -w * c]  # fmt: skip


def walked(y: FloatArray, low: float, high: float, line: bool = False, at: FloatArray | None = None) -> FloatArray:
    """The state (16,) at `high`, or states (16, k) at `at`."""
    found = solve_ivp(_rate, (low, high), y, method="DOP853", rtol=1e-11, atol=1e-12, t_eval=at, args=(line,))
    return np.asarray(found.y[:, -1] if at is None else found.y)


def pushed(y: FloatArray, force: float) -> FloatArray:
    """The state behind a force F across."""
    out = y.copy()
    out[10:12] -= force * y[1:3] / np.hypot(*y[1:3])
    return out


def begun(x: float, a: float, twist: float, second: float, third: float, bend: float, torsion: float) -> FloatArray:
    """The state (16,) on e_1, about which the rod is alike: by r_1, the angle a of the tangent against e_2, the twist,
    n_2, n_3 and the curvature there."""
    u = np.array([0.0, np.cos(a), np.sin(a)])
    m = bend * np.cross(u, [-1.0, 0.0, 0.0]) + torsion * twist * u
    return np.concatenate([[x, 0.0, 0.0], u, m, [0.0, second, third, 0.0, 1.0, 0.0, 0.0]])


def along(y: FloatArray, touch: str, v: FloatArray, diameter: float, end: float) -> tuple[FloatArray, list[float]]:
    """The state at `end` of a strand begun at s = 0 that touches as `touch` says, letters of `UNKNOWNS` in order, with
    the unknowns v; and what its places and lines miss."""
    s, missed, k = 0.0, [], 0
    for letter in touch:
        own = v[k : k + UNKNOWNS[letter]]
        k += UNKNOWNS[letter]
        y, s = walked(y, s, float(own[0])), float(own[0])
        first, second, third, _ = slopes(y)
        missed += [float(np.hypot(y[1], y[2])) - 0.5 * diameter, first / diameter]
        if letter == "p":
            y = pushed(y, float(own[1]))
            continue
        missed.append(second)
        y = pushed(y, -2.0 * third / diameter)
        last = end if letter == "m" else float(own[1])
        y, s = walked(y, s, last, True), last
        if letter == "l":
            y = pushed(y, float(own[2]))
    return (walked(y, s, end) if s != end else y), missed


def touched(y: FloatArray, touch: str, v: FloatArray, diameter: float, end: float, count: int = 41) -> Touched:
    """As `along`: what it touches with, the line looked at in `count` places."""
    found, s, k = Touched(), 0.0, 0
    for letter in touch:
        own = [float(each) for each in v[k : k + UNKNOWNS[letter]]]
        k += UNKNOWNS[letter]
        y, s = walked(y, s, own[0]), own[0]
        force = own[1] if letter == "p" else -2.0 * slopes(y)[2] / diameter
        found.places.append(s)
        found.forces.append(force)
        y = pushed(y, force)
        if letter == "p":
            continue
        last = end if letter == "m" else own[1]
        found.line, found.s = (s, last), np.linspace(s, last, count)
        states = walked(y, s, last, True, found.s)
        found.push = np.array([slopes(state)[3] for state in states.T])
        found.angle = np.arccos(np.abs(states[3]))
        y, s = states[:, -1], last
        if letter == "l":
            found.places.append(last)
            found.forces.append(own[2])
            y = pushed(y, own[2])
    return found


def states(y: FloatArray, touch: str, v: FloatArray, diameter: float, end: float, at: FloatArray) -> FloatArray:
    """The states (16, k) at abscissae `at` (k,), ascending, of the strand of `along`."""
    parts: list[FloatArray] = []
    s, k, line = 0.0, 0, False

    def on(y: FloatArray, to: float) -> FloatArray:
        inside = at[(at > s) & (at <= to)] if parts else at[at <= to]
        parts.append(walked(y, s, to, line, inside) if inside.size else np.empty((16, 0)))
        return walked(y, s, to, line) if to > s else y

    for letter in touch:
        own = [float(each) for each in v[k : k + UNKNOWNS[letter]]]
        k += UNKNOWNS[letter]
        y, s = on(y, own[0]), own[0]
        y = pushed(y, own[1] if letter == "p" else -2.0 * slopes(y)[2] / diameter)
        if letter == "p":
            continue
        line, last = True, end if letter == "m" else own[1]
        y, s = on(y, last), last
        line = False
        if letter == "l":
            y = pushed(y, own[2])
    if s < end:
        on(y, end)
    return np.concatenate(parts, axis=1)
