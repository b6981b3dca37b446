"""The braid of a loose overhand knot: two strands that pass each other three times, by shooting.

A thin rod (bending stiffness B, diameter h) without twist or friction is knotted and pulled by F. Its loop is a
circle, whose radius R makes pi B / R + 2 pi R F least, so that F R^2 = B / 2; its tails are straight. Where they pass,
both strands are nearly parallel for a length of about (h R)^(1/2), along which tension does next to nothing. With
x = (h R)^(1/2) t and the difference h v(t) of both strands across, of two components (along and across the loop's axis
of symmetry, about which half a turn takes one strand to the other: v_1 is odd, v_2 even)::

    v'''' = q v ,   |v| >= 1 ,   q >= 0 ,   q (|v| - 1) = 0 ,   v'' -> (-1, 0) ,  v''' -> 0  as t -> oo ,

since one strand comes out of the loop (curvature 1 / R) where the other is a tail (none). As of B. Audoly, N. Clauvelin
and S. Neukirch (2007, doi:10.1103/PhysRevLett.99.164301); derived here anew, of their numbers none is used. What
touches is of this kind: a line |t| <= t_1 and a place at t_2 on either side. On the line v = (sin a, cos a) and::

    a'''' = 6 a'^2 a'' ,   q = a'^4 - 3 a''^2 - 4 a' a''' ;

at its ends and at the places forces make v''' jump by f v; behind the places v'' is constant.

The force of a place in the rod is f B h / (2 (h R)^(3/2)): each strand bends by half of the difference. No code is
shared with any solver of the package.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import simpson, solve_ivp
from scipy.optimize import root

FloatArray = NDArray[np.float64]

#: Unknowns to begin with: a' and a''' in the middle, t_1, t_2, force at the line's end.
_GUESS = (0.77, 0.03, 0.35, 2.68, 0.17)


@dataclass(frozen=True)
class Braid:
    """Contact of a loose overhand knot, lengths over (h R)^(1/2), forces over B h / (2 (h R)^(3/2)).

    line: half the length of the line; place: of the place from the middle; ends, force: at an end of the line and at
    the place; push: all that the line pushes with, ends too; least: the least push per length on the line; turned: by
    which angle (rad) the strands turn about each other from the middle to infinity; closest: the least |v| off what
    touches.
    """

    line: float
    place: float
    ends: float
    force: float
    push: float
    least: float
    turned: float
    closest: float


def _line(first: float, third: float, to: float, at: FloatArray | None = None) -> FloatArray:
    """a, a', a'', a''' (4, k) along the line."""
    found = solve_ivp(
        lambda _, y: [y[1], y[2], y[3], 6.0 * y[1] ** 2 * y[2]], (0.0, to), [0.0, first, 0.0, third], rtol=1e-11,
        atol=1e-12, t_eval=at,
    )  # fmt: skip
    return np.asarray(found.y)


def _left(first: float, third: float, end: float, force: float) -> tuple[FloatArray, ...]:
    """v, v', v'', v''' (2,) behind the end of the line and its force."""
    a, b, c, d = _line(first, third, end)[:, -1]
    out, on = np.array([np.sin(a), np.cos(a)]), np.array([np.cos(a), -np.sin(a)])
    return out, b * on, c * on - b * b * out, (d - b**3) * on - 3.0 * b * c * out + force * out


def _walked(v: tuple[FloatArray, ...], t: float | FloatArray) -> tuple[FloatArray, ...]:
    """v, v', v'' a distance t on where nothing touches."""
    t = np.asarray(t)[..., None]
    a, b, c, d = v
    return a + b * t + c * t**2 / 2.0 + d * t**3 / 6.0, b + c * t + d * t**2 / 2.0, c + d * t


def _missed(p: FloatArray) -> list[float]:
    first, third, end, place, force = p
    v = _left(first, third, end, force)
    w, dw, ddw = _walked(v, place - end)
    return [w @ w - 1.0, w @ dw, ddw[0] + 1.0, ddw[1], v[3][0] * w[1] - v[3][1] * w[0]]


def overhand() -> Braid:
    """The braid of one overhand knot. Raises ValueError where the shooting does not arrive."""
    found = root(_missed, np.array(_GUESS), tol=1e-13)
    if np.abs(found.fun).max() > 1e-10:
        raise ValueError(f"the shooting misses by {np.abs(found.fun).max():.1e}")
    first, third, end, place, force = map(float, found.x)
    t = np.linspace(0.0, end, 201)
    _, b, c, d = _line(first, third, end, t)
    q = b**4 - 3.0 * c**2 - 4.0 * b * d
    v = _left(first, third, end, force)
    w, dw, ddw = _walked(v, place - end)
    between = _walked(v, np.linspace(0.0, place - end, 400)[1:-1])[0]
    beyond = _walked((w, dw, ddw, np.zeros(2)), np.linspace(0.0, 20.0, 2001)[1:])[0]
    path = np.concatenate([[v[0]], between, [w], beyond])
    angle = np.unwrap(np.arctan2(path[:, 0], path[:, 1]))
    limit = angle[-1] + float(np.angle(np.exp(1j * (-0.5 * np.pi - angle[-1]))))  # v -> (-1, 0)
    off = np.concatenate([between[20:-20], beyond[50:]])
    return Braid(
        end, place, force, float(-(v[3] @ w)), 2.0 * (force + float(simpson(q, x=t))), float(q.min()), limit,
        float(np.linalg.norm(off, axis=1).min()),
    )  # fmt: skip
