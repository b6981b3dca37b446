r"""Gaps of places that may touch, with exact first and second derivatives by the coefficients c of theta.

**Two places of the strip**, s and s' (angles theta, theta'; t, n of s'; k' = theta'_s(s')), D = r(s) - r(s'). The
second is the foot of the first, and the first one, where it slides, stands where the distance is least:

    C = (<t, D>, sin(theta - theta')) = 0 ,   g = side <n, D> - distance ,

side 1 or -1 the side of the second place on which the first one stays, so that g is a signed distance which goes
through zero smoothly (docs/theory.md, eq. (8.7)): the centrelines may touch (distance 0).
With T = <t, dr(s) - dr(s')>, e = cos(theta - theta'),
eta = <n, D>, phi and phi' the basis functions at both,

    dg     = side <n, dr(s) - dr(s')>
    dC     = (eta phi' + T, e (phi - phi')) ,   C_(s,s') = [[e, k' eta - 1], [e k, -e k']] ,   ds = - C_(s,s')^-1 dC
    d^2 g  = side [<n, d^2 r(s) - d^2 r(s')> - phi' T - T phi' - eta phi' phi' + dC_2 (x) ds - k' dC_1 (x) ds']

(the envelope theorem twice: g does not change with s and s' where C = 0). Where the first place is held, C_1 = 0 alone.

**A place and a circle or a line**: u the unit vector from the centre (or the line's normal), rho the distance from
the centre,

    g = side (|r(s) - centre| - radius) ,   dg = side <u, dr> ,   C = <t, u> ,
    d^2 g = side [<u, d^2 r> + <t, dr> <t, dr> / rho] - (dg_s)(dg_s) / g_ss ,
    dg_s = side [<u, n> phi + <t, dr> / rho] ,   g_ss = side [theta_s <u, n> + 1 / rho] ,

the last term where the place slides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from shellref.elastica.contact.barrier import Barrier
from shellref.elastica.contact.places import Moving
from shellref.elastica.problem import Array

#: Newton steps of a search for places, the last one's size, and how far the first steps may go, l.
_STEPS, _FOUND, _STRIDE = 30, 1e-14, 0.02
#: Turn (rad) within which the tangents of places that slide are parallel where their search ends.
_PARALLEL = 1e-9


@dataclass(frozen=True)
class Pair:
    """Two places, s on the given side of the foot at `other`, `distance` (l) apart; held: s is as it is."""

    s: float
    other: float
    side: float
    distance: float
    held: bool = False

    @property
    def label(self) -> str:
        """What is touched."""
        return "itself"


@dataclass(frozen=True)
class Beside:
    """A place s beside the barrier of a number; held: s is as it is."""

    s: float
    barrier: Barrier
    number: int
    held: bool = False

    @property
    def label(self) -> str:
        """What is touched."""
        return f"barrier {self.number}"


Row = Pair | Beside


@dataclass(frozen=True)
class Gap:
    """Of a row where it has slid to: the row, its gap (l), derivatives (N,) and (N, N), how sharp the minimum is (the
    second derivative of the gap along the strip, 1/l; inf of what is held), the direction (2,) in which the first place
    is pushed, and where that is (2,)."""

    row: Row
    gap: float
    slope: Array
    bend: Array | None
    sharp: float
    push: Array
    place: Array


def slid(moving: Moving, row: Row) -> Row | None:
    """The row where it slides to from where it is; None: there is no such place beside it."""
    if isinstance(row, Beside):
        return row if row.held else _along_barrier(moving, row)
    return _foot(moving, row) if row.held else _nearest(moving, row)


def evaluated(moving: Moving, row: Row, second: bool = True) -> Gap:
    """A row that has slid, with its derivatives."""
    return _barrier_gap(moving, row, second) if isinstance(row, Beside) else _pair_gap(moving, row, second)


def _along_barrier(moving: Moving, row: Beside) -> Beside | None:
    s = row.s
    for _ in range(_STEPS):
        theta, curvature, r = (part[0] for part in moving.shape(np.array([s])))
        u, near = row.barrier.outward(r)
        t, n = np.array([math.cos(theta), math.sin(theta)]), np.array([-math.sin(theta), math.cos(theta)])
        rate = row.barrier.side * (curvature * float(u @ n) + near * (1.0 - float(u @ t) ** 2))
        if rate <= 0.0:
            return None
        step = float(np.clip(-row.barrier.side * float(u @ t) / rate, -_STRIDE, _STRIDE))
        if not 0.0 <= s + step <= 1.0:
            return None
        s += step
        if abs(step) < _FOUND:
            break
    return replace(row, s=s) if abs(step) < 1e-9 else None


def _foot(moving: Moving, row: Pair) -> Pair | None:
    r = moving.shape(np.array([row.s]))[2][0]
    foot = row.other
    for _ in range(_STEPS):
        theta, curvature, at = (part[0] for part in moving.shape(np.array([foot])))
        t, n = np.array([math.cos(theta), math.sin(theta)]), np.array([-math.sin(theta), math.cos(theta)])
        rate = curvature * float(n @ (r - at)) - 1.0
        if rate > -1e-3:
            return None
        step = float(np.clip(-float(t @ (r - at)) / rate, -_STRIDE, _STRIDE))
        if not 0.0 <= foot + step <= 1.0:
            return None
        foot += step
        if abs(step) < _FOUND:
            break
    return replace(row, other=foot) if abs(step) < 1e-9 else None


def _nearest(moving: Moving, row: Pair) -> Pair | None:
    places = np.array([row.s, row.other])
    for _ in range(_STEPS):
        theta, curvature, r = moving.shape(places)
        apart, t = r[0] - r[1], np.array([math.cos(theta[1]), math.sin(theta[1])])
        n = np.array([-t[1], t[0]])
        e = math.cos(theta[0] - theta[1])
        missed = np.array([float(t @ apart), math.sin(theta[0] - theta[1])])
        rates = np.array([[e, curvature[1] * float(n @ apart) - 1.0], [e * curvature[0], -e * curvature[1]]])
        if abs(np.linalg.det(rates)) < 1e-6:
            return None
        step = -np.linalg.solve(rates, missed)
        step *= min(1.0, _STRIDE / float(np.abs(step).max() + 1e-300))
        places = places + step
        if places.min() < 0.0 or places.max() > 1.0:
            return None
        if np.abs(step).max() < _FOUND:
            break
    if np.abs(step).max() > 1e-9 or abs(missed[1]) > _PARALLEL:
        return None
    return replace(row, s=float(places[0]), other=float(places[1]))


def _barrier_gap(moving: Moving, row: Beside, second: bool) -> Gap:
    at = moving.at(np.array([row.s]))
    u, near = row.barrier.outward(at.position[0])
    side = row.barrier.side
    t, n, phi, moves = at.tangent[0], at.normal[0], at.phi[0], at.moves[0]
    gap = float(row.barrier.gaps(at.position)[0])
    bend, sharp = None, math.inf
    along = side * (float(u @ n) * phi + near * (t @ moves))
    rate = side * (float(at.curvature[0]) * float(u @ n) + near)
    if not row.held:
        sharp = rate
    if second:
        across = t @ moves if row.held is False else moves - np.outer(u, u @ moves)
        curved = near * (np.outer(across, across) if row.held is False else across.T @ across)
        bend = side * (moving.bent(row.s, u) + curved)
        if not row.held:
            bend -= np.outer(along, along) / rate
    return Gap(row, gap, side * (u @ moves), bend, sharp, side * u, at.position[0])


def _pair_gap(moving: Moving, row: Pair, second: bool) -> Gap:
    both = moving.at(np.array([row.s, row.other]))
    apart = both.position[0] - both.position[1]
    t, n = both.tangent[1], both.normal[1]
    k, k_other = both.curvature
    phi, phi_other = both.phi
    moves = both.moves[0] - both.moves[1]
    eta, e = float(n @ apart), math.cos(float(both.theta[0] - both.theta[1]))
    pull = t @ moves
    first = eta * phi_other + pull
    sharp = math.inf if row.held else row.side * e * (k - e * k_other / (1.0 - k_other * eta))
    bend = None
    if second:
        bend = moving.bent(row.s, n) - moving.bent(row.other, n) - eta * np.outer(phi_other, phi_other)
        bend -= np.outer(phi_other, pull) + np.outer(pull, phi_other)
        if row.held:
            slides = -first / (k_other * eta - 1.0)
            bend -= k_other * np.outer(first, slides)
        else:
            then = e * (phi - phi_other)
            rates = np.array([[e, k_other * eta - 1.0], [e * k, -e * k_other]])
            slides = -np.linalg.solve(rates, np.stack([first, then]))
            bend += np.outer(then, slides[0]) - k_other * np.outer(first, slides[1])
        bend *= row.side
    return Gap(row, row.side * eta - row.distance, row.side * (n @ moves), bend, sharp, row.side * n, both.position[0])
