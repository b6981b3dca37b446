r"""Modes aside of its plane of a strip between floor and roof: the second variation of a planar developable strip.

A strip with straight rulings that bends in a plane (`ribbon.find.branch.chain`) is an equilibrium of the strip in space
whose rulings are free. By mirror symmetry its second variation is that of the plane (the tangent of the chain) and one
aside of it. With the frame ``R_0 exp([0, a, b] x)``, yaw a about the normal and roll b about the tangent, rulings eta
and the bending ``omega_0`` of the plane, a developable strip has to first order (docs/theory.md, eq. (8.10))::

    a' = omega_0 b ,   b' = tau - omega_0 a ,   tau = omega_0 eta ,   bending to second order: - a tau / 2

and with Lambda, the force and weight that the chain's function has beside the tangent, the second variation is::

    Q = int [ tau^2 + w^2 omega_0^2 eta'^2 / 24 - omega_0 a tau / 2 + Lambda_n a b / 2 - Lambda_t a^2 / 2 ] ds

(docs/theory.md, eq. (8.11); the term with w is Wunderlich's, from (1 + eta^2)^2 artanh(x) / x at x = w eta' / 2;
Sadowsky's strip is without). A clamp holds a and b, both clamps the mean of a.
Where a plane pushes, it does so at both edges: b = 0 there,
and so along a flat part, which may yaw as a whole. Edges add nothing to second order: their height over a place goes
with the odd powers of the distance from the centreline.

Where the bending passes zero a ruling costs nothing, and may jump (as in three dimensions a function may at a point):
elements end there. Sadowsky's strip has tau itself, which may jump at places.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy.linalg
import scipy.optimize
from numpy.typing import NDArray

from ribbon.find.branch import chain
from ribbon.find.branch.chain import Chain, Setting

FloatArray = NDArray[np.float64]

#: Least distance behind an end, over w / sqrt(24), to which elements are graded: a nearer passage is that end's.
_LEAST = 0.01
#: Degree of the elements of a piece between places and passages, and points of Gauss in each.
DEGREE, POINTS = 8, 14
#: Nearest (in xi) that a passage of the bending is to an end of its arc, to one where the strip lies (it is zero
#: there), and places at which it is looked for.
_INSIDE, _ENDS, _SEEN = 1e-6, 0.02, 800
#: Bending (1/l) at a place below which the strip lies there, and rulings are not joined.
_BENT = 1e-6


class Piece(NamedTuple):
    """Part of a strip in its plane on which the bending keeps its sign, between places where planes push. length: l;
    at: abscissae (q,) from its start, l -> angle theta, bending omega, Lambda_t and Lambda_n (4, q); joined: whether
    its rulings go on from the piece before; held: whether roll is held at its end; flat: length (l) of the flat part
    behind it."""

    length: float
    at: Callable[[FloatArray], FloatArray]
    joined: bool = False
    held: bool = False
    flat: float = 0.0


class Form(NamedTuple):
    """Of the unknowns (n,), rulings or twists at nodes: 2 Q is stiffness (n, n), of twist and of rulings that turn, and
    loads (n, n), what the bending and the forces of the plane add; rows (k, n) that clamps and places hold at zero."""

    stiffness: FloatArray
    loads: FloatArray
    rows: FloatArray

    def lowest(self, count: int = 3) -> FloatArray:
        """The lowest eigenvalues (count,) of Q over its stiffness, ascending, no unit: below zero for every unstable
        mode, all but a few near 1."""
        scale = 1.0 / np.sqrt(np.diag(self.stiffness))
        free = scipy.linalg.null_space(self.rows * scale)
        stiff, loads = (free.T @ (scale[:, None] * part * scale) @ free for part in (self.stiffness, self.loads))
        return 1.0 + np.asarray(scipy.linalg.eigh(loads, stiff, eigvals_only=True,
                                                  subset_by_index=(0, min(count, free.shape[1]) - 1)))  # fmt: skip

    def through_zero(self, count: int) -> FloatArray:
        """As many of the lowest at the least, and with them all that are below zero and one that is not."""
        found = self.lowest(count)
        while found.size == count and found[-1] < 0.0:
            count *= 2
            found = self.lowest(count)
        return found


def of_chain(own: Chain, z: FloatArray, setting: Setting, width: float,
             straight: tuple[bool, bool] = (False, False), elements: int = 4) -> Form:  # fmt: skip
    """The second variation aside of a chain's equilibrium, for a strip of Wunderlich's of this width (l; 0: Sadowsky's
    of no width), its rulings at the clamps free or held straight, on so many elements a piece. Flat parts share out
    their length alike, as `ribbon.find.branch.confined.Confined.starts`."""
    return second_variation(pieces(own, z, setting), -own.tension(z), width, straight, elements)


def pieces(own: Chain, z: FloatArray, setting: Setting) -> list[Piece]:
    """Of a chain, in order."""
    flat = own.flat_length(z) if own.flat else 0.0
    shares = [2.0 if own.lies(plane) else 0.0 for plane in own.planes[1:-1]]
    share = flat / (sum(shares) + 2.0)
    found: list[Piece] = []
    for k in range(own.arcs):
        cuts = [0.0, *_passages(own, z, k), 1.0]
        inner = k < own.arcs - 1
        for first, last in pairwise(cuts):
            begins = first == 0.0 and k > 0 and not own.lies(own.planes[k])
            ends = last == 1.0
            found.append(Piece(
                (last - first) * float(own.lengths(z)[k]), _along(own, z, setting, k, first),
                begins and abs(float(own.curvature(z, k, np.zeros(1))[0])) > _BENT, ends and inner,
                share * shares[k] if ends and inner else 0.0,
            ))  # fmt: skip
    return found


def _along(own: Chain, z: FloatArray, setting: Setting, k: int, first: float) -> Callable[[FloatArray], FloatArray]:
    length, theta = float(own.lengths(z)[k]), own.angle(z, k)

    def at(s: FloatArray) -> FloatArray:
        xi = first + s / length
        value, slope = chain.at(own.elements, xi)
        angle = value @ theta
        up = setting.gamma * length * (1.0 - xi) + float(own.lifts(z)[k])
        back = own.tension(z)
        c, s_ = np.cos(angle), np.sin(angle)
        return np.array([angle, -(slope @ theta) / length, up * s_ - back * c, up * c + back * s_])

    return at


def _passages(own: Chain, z: FloatArray, k: int) -> list[float]:
    """xi of arc k, between its ends, at which its bending passes zero."""
    low = _ENDS if own.lies(own.planes[k]) else _INSIDE
    high = 1.0 - (_ENDS if own.lies(own.planes[k + 1]) else _INSIDE)
    seen = np.linspace(low, high, _SEEN)

    def bent(xi: float) -> float:
        return float(own.curvature(z, k, np.array([xi]))[0])

    values = own.curvature(z, k, seen)
    where = np.flatnonzero(np.signbit(values[:-1]) != np.signbit(values[1:]))
    return [float(scipy.optimize.brentq(bent, seen[i], seen[i + 1], xtol=1e-15)) for i in where]


def second_variation(
    strip: list[Piece], thrust: float, width: float, straight: tuple[bool, bool], elements: int
) -> Form:
    """Of these pieces in order, flat parts under this thrust (D w / l^2), clamped at both ends, on an even number of
    elements a piece, else ValueError."""
    if elements < 2 or elements % 2:
        raise ValueError(f"elements = {elements}: an even number of them, two or more")
    columns, size = _columns(strip, elements, bool(width))
    value, slope = _fields(elements)
    stiffness, loads, rows = np.zeros((size, size)), np.zeros((size, size)), []
    turned, aside = np.zeros(size, dtype=complex), np.zeros(size)  # (b + i a) exp(i theta) changes by twist alone
    ends: FloatArray = np.zeros(size)
    for piece, place in zip(strip, columns, strict=True):
        cuts = _cuts(elements, piece, width)
        s, weights = _points(cuts)
        theta, omega, along, across = piece.at(s)
        tau = np.zeros((s.size, size))
        tau[:, place] = value * omega[:, None] if width else value
        grown, whole = _grown(np.exp(1j * theta)[:, None] * tau, cuts)
        both = np.exp(-1j * theta)[:, None] * (turned + grown)
        loads += _density(tau, both.imag, both.real, weights, omega, along, across)
        stiff = 2.0 * tau.T @ (weights[:, None] * tau)
        if width:
            bent = width * omega[:, None] * slope / np.repeat(np.diff(cuts), POINTS)[:, None]
            stiff[np.ix_(place, place)] += bent.T @ (weights[:, None] * bent) / 12.0
        stiffness += stiff
        aside += weights @ both.imag
        turned = turned + whole
        ends = np.exp(-1j * float(piece.at(np.array([piece.length]))[0, 0])) * turned
        if piece.held:
            rows.append(ends.real)
        aside += piece.flat * ends.imag
        loads -= thrust * piece.flat * np.outer(ends.imag, ends.imag)
    rows += [ends.real, ends.imag, aside]
    rows += [np.eye(size)[k] for k, holds in zip((0, size - 1), straight, strict=True) if holds and width]
    return Form(stiffness, loads, np.array(rows))


def _density(
    tau: FloatArray, a: FloatArray, b: FloatArray, weights: FloatArray,
    omega: FloatArray, along: FloatArray, across: FloatArray,
) -> FloatArray:  # fmt: skip
    """Of what is there before it is bent aside, twice its part of Q (n, n) on a piece."""
    mixed = a.T @ ((weights * across)[:, None] * b - (weights * omega)[:, None] * tau)
    return np.asarray(0.5 * (mixed + mixed.T) - a.T @ ((weights * along)[:, None] * a))


def _columns(strip: list[Piece], elements: int, rulings: bool) -> tuple[list[NDArray[np.int64]], int]:
    """Of every piece its nodes' numbers, and how many there are: a ruling that goes on has one number on both sides."""
    count, used = elements * DEGREE + 1, 0
    found: list[NDArray[np.int64]] = []
    for piece in strip:
        first = used - 1 if piece.joined and rulings and found else used
        found.append(first + np.arange(count))
        used = first + count
    return found, used


def _cuts(elements: int, piece: Piece, width: float) -> FloatArray:
    """Ends of a piece's elements (an even number), l: short at both ends, where rulings have layers of w / sqrt(24),
    and of the distance at which the bending would pass zero behind an end."""
    near = 1e-3 * piece.length
    omega = piece.at(np.array([0.0, near, piece.length - near, piece.length]))[1]
    halves = []
    for here, next_one in ((omega[0], omega[1]), (omega[3], omega[2])):
        layer = width / math.sqrt(24.0)
        passes = near * abs(here) / max(abs(next_one) - abs(here), 1e-300)
        if abs(here) > _BENT and passes > _LEAST * layer:
            layer = min(layer, passes)
        grown = math.log1p(0.5 * piece.length / layer) if width else 0.0
        j = np.arange(elements // 2 + 1) / (elements // 2)
        halves.append(0.5 * piece.length * (np.expm1(grown * j) / np.expm1(grown) if grown else j))
    return np.concatenate([halves[0], (piece.length - halves[1])[-2::-1]])


def _points(cuts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Abscissae and weights (q,) of a piece."""
    x, w = np.polynomial.legendre.leggauss(POINTS)
    s = cuts[:-1, None] + np.diff(cuts)[:, None] * 0.5 * (x + 1.0)
    return s.ravel(), (np.diff(cuts)[:, None] * 0.5 * w).ravel()


@lru_cache(maxsize=8)
def _fields(elements: int) -> tuple[FloatArray, FloatArray]:
    """Values (q, n) and slopes, times the elements' lengths, of the polynomials of a piece, on the nodes of Chebyshev
    and Lobatto."""
    x = 0.5 * (np.polynomial.legendre.leggauss(POINTS)[0] + 1.0)
    nodes = 0.5 - 0.5 * np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)
    powers = np.linalg.inv(np.vander(nodes, increasing=True))
    local = np.vander(x, DEGREE + 1, increasing=True) @ powers
    slope = (np.vander(x, DEGREE, increasing=True) * np.arange(1, DEGREE + 1)) @ powers[1:]
    values = np.zeros((2, elements * POINTS, elements * DEGREE + 1))
    for e in range(elements):
        rows, columns = slice(e * POINTS, (e + 1) * POINTS), slice(e * DEGREE, (e + 1) * DEGREE + 1)
        values[0, rows, columns], values[1, rows, columns] = local, slope
    return values[0], values[1]


@lru_cache(maxsize=1)
def _integrals() -> FloatArray:
    """From -1 to the points of Gauss (q, q), of what has these values there: exact for polynomials through them."""
    x = np.polynomial.legendre.leggauss(POINTS)[0]
    integral = np.column_stack([
        np.polynomial.legendre.legval(x, np.polynomial.legendre.legint(unit, lbnd=-1.0)) for unit in np.eye(POINTS)
    ])  # fmt: skip
    return np.asarray(integral @ np.linalg.inv(np.polynomial.legendre.legvander(x, POINTS - 1)))


def _grown(rate: NDArray[np.complex128], cuts: FloatArray) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Integrals of a rate (q, n) from a piece's start to its points (q, n), and to its end (n,)."""
    half = 0.5 * np.diff(cuts)[:, None]
    cut = rate.reshape(half.size, POINTS, -1)
    sums = half * np.einsum("q,eqn->en", np.polynomial.legendre.leggauss(POINTS)[1], cut)
    before = np.cumsum(sums, axis=0) - sums
    inner = half[:, None] * np.einsum("pq,eqn->epn", _integrals(), cut) + before[:, None]
    return inner.reshape(rate.shape), sums.sum(axis=0)
