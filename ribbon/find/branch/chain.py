r"""A strip with straight rulings between two parallel planes: free arcs between places of contact, which are unknowns.

Such a strip bends as the planar elastica (docs/theory.md, eq. (8.8)). Between places where it touches a plane (or is
clamped along it) its angle theta to the planes is free; arc k has the length L_k, joins planes at the heights Y_k and
Y_(k+1), and s = L_k xi along it. With the clamps' shortening Delta the equilibria are the stationary points of::

    sum_k [ int theta_xi^2 / (2 L_k) + Gamma (L_k Y_k + L_k^2 int (1 - xi) sin theta) ] dxi
      + sum_k V_k (L_k int sin theta dxi - Y_(k+1) + Y_k) + T (sum_k L_k int (1 - cos theta) dxi - Delta)
      + mu (sum_k L_k - 1)

in theta, L_k, V_k, T, mu (units l, D w / l). Of a place of contact theta is free: by L it vanishes (Hamilton's function
``theta_s^2 / 2 + V(s) sin theta + ..`` of both arcs is the same and the push P is not zero: P sin theta = 0), so that a
place counts as one row whatever the curvature there, which passes zero without harm. -T is the thrust.

Flat parts on the floor, and without weight at the roof, have no unknowns: theta = 0, no energy, and only their length
in all, ``1 - sum L_k``, counts; how it is shared out is neutral and left out. Then mu = 0, and arcs end with theta free
and without a moment at them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Degree of the elements of an arc; points of Gauss in each.
DEGREE, POINTS = 4, 7
FLOOR, ROOF = 0, 1
#: Nodes of an element (of Chebyshev and Lobatto, 0 to 1), and the coefficients of their polynomials.
_NODES = 0.5 - 0.5 * np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)
_POWERS = np.linalg.inv(np.vander(_NODES, increasing=True))


class Basis(NamedTuple):
    """Polynomials on equal elements of 0 <= xi <= 1: xi (q,), weights (q,), values (q, n), slopes (q, n), stiffness
    (n, n); the first and the last unknown are the ends' values."""

    xi: FloatArray
    weights: FloatArray
    values: FloatArray
    slopes: FloatArray
    stiffness: FloatArray


@lru_cache(maxsize=16)
def basis(elements: int) -> Basis:
    """Of so many elements, Lagrange's on the nodes of Chebyshev and Lobatto."""
    x, w = np.polynomial.legendre.leggauss(POINTS)
    x, w = 0.5 * (x + 1.0), 0.5 * w
    local = np.vander(x, DEGREE + 1, increasing=True) @ _POWERS
    steps = np.arange(1, DEGREE + 1)
    slope = (np.vander(x, DEGREE, increasing=True) * steps) @ _POWERS[1:]
    count = elements * DEGREE + 1
    values, slopes = np.zeros((elements * POINTS, count)), np.zeros((elements * POINTS, count))
    for e in range(elements):
        rows, columns = slice(e * POINTS, (e + 1) * POINTS), slice(e * DEGREE, (e + 1) * DEGREE + 1)
        values[rows, columns], slopes[rows, columns] = local, elements * slope
    xi = (np.arange(elements)[:, None] + x).ravel() / elements
    weights = np.tile(w, elements) / elements
    return Basis(xi, weights, values, slopes, slopes.T @ (weights[:, None] * slopes))


def at(elements: int, xi: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and slopes (k, n) of the basis at xi (k,)."""
    xi = np.atleast_1d(np.asarray(xi, dtype=float))
    which = np.clip((xi * elements).astype(int), 0, elements - 1)
    local = xi * elements - which
    value = np.vander(local, DEGREE + 1, increasing=True) @ _POWERS
    slope = (np.vander(local, DEGREE, increasing=True) * np.arange(1, DEGREE + 1)) @ _POWERS[1:]
    out = np.zeros((2, xi.size, elements * DEGREE + 1))
    columns = which[:, None] * DEGREE + np.arange(DEGREE + 1)
    rows = np.arange(xi.size)[:, None]
    out[0, rows, columns], out[1, rows, columns] = value, elements * slope
    return out[0], out[1]


class Setting(NamedTuple):
    """What is given: height H of the roof over the floor (l), shortening Delta (l), weight Gamma."""

    height: float
    delta: float
    gamma: float


@dataclass(frozen=True)
class Chain:
    """Planes (k + 1,) that the strip is on at the ends of its k arcs, FLOOR or ROOF, the clamps on the floor; flat:
    whether there are flat parts on the floor; elements: of an arc; weightless: whether flat parts are at the roof too.

    Unknowns z: angles of the arcs, in order, L (k,), V (k,), T, and without flat parts mu."""

    planes: tuple[int, ...]
    flat: bool
    elements: int
    weightless: bool = False

    def lies(self, plane: int) -> bool:
        """Whether the strip lies flat on a plane that it is on."""
        return self.flat and (plane == FLOOR or self.weightless)

    @property
    def arcs(self) -> int:
        """Their number k."""
        return len(self.planes) - 1

    @cached_property
    def places(self) -> int:
        """Number of ends of contact that are free to move along the strip, each of which takes one negative eigenvalue
        as a row does."""
        inner = self.planes[1:-1]
        if not self.flat:
            return len(inner)
        return sum(2 if self.lies(plane) else 1 for plane in inner) + 2

    @cached_property
    def columns(self) -> tuple[IntArray, ...]:
        """Of every arc its angles' columns in z; -1 of an angle that is zero (a clamp)."""
        own: list[IntArray] = []
        used = 0
        for k in range(self.arcs):
            count = self.elements * DEGREE + 1
            at_start = self.lies(self.planes[k])
            place = np.empty(count, dtype=np.int64)
            if at_start:
                place[0], used = used, used + 1
            else:
                place[0] = -1 if k == 0 else own[-1][-1]
            place[1:] = used + np.arange(count - 1)
            used += count - 1
            if k == self.arcs - 1 and not self.flat:
                place[-1], used = -1, used - 1
            own.append(place)
        return tuple(own)

    @cached_property
    def angles(self) -> int:
        """Number of unknown angles."""
        return int(max(place.max() for place in self.columns)) + 1

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.angles + 2 * self.arcs + (1 if self.flat else 2)

    @property
    def rows(self) -> int:
        """Number of multipliers."""
        return self.arcs + (1 if self.flat else 2)

    def lengths(self, z: FloatArray) -> FloatArray:
        """L (k,)."""
        return z[self.angles : self.angles + self.arcs]

    def lifts(self, z: FloatArray) -> FloatArray:
        """V (k,)."""
        return z[self.angles + self.arcs : self.angles + 2 * self.arcs]

    def tension(self, z: FloatArray) -> float:
        """T."""
        return float(z[self.angles + 2 * self.arcs])

    def angle(self, z: FloatArray, k: int) -> FloatArray:
        """Values (n,) of arc k."""
        place = self.columns[k]
        return np.where(place >= 0, z[place], 0.0)

    def heights(self, setting: Setting) -> FloatArray:
        """Y (k + 1,)."""
        return setting.height * np.array(self.planes, dtype=float)

    def energy(self, z: FloatArray, setting: Setting) -> float:
        """Bending and weight over the floor, D w / l."""
        b, y = basis(self.elements), self.heights(setting)
        total = 0.0
        for k, length in enumerate(self.lengths(z)):
            theta = self.angle(z, k)
            lifted = length * y[k] + length**2 * float((b.weights * (1.0 - b.xi)) @ np.sin(b.values @ theta))
            total += float(theta @ b.stiffness @ theta) / (2.0 * length) + setting.gamma * lifted
        return total

    def residual(self, z: FloatArray, setting: Setting) -> FloatArray:
        """Gradient (n,) of the module's function."""
        b, y, out = basis(self.elements), self.heights(setting), np.zeros(self.size)
        a, m, gamma = self.angles, self.arcs, setting.gamma
        tension, missing = self.tension(z), -setting.delta
        mu = 0.0 if self.flat else z[-1]
        for k in range(m):
            theta, length, lift = self.angle(z, k), self.lengths(z)[k], self.lifts(z)[k]
            value = b.values @ theta
            c, s, w = np.cos(value), np.sin(value), b.weights
            bent = b.stiffness @ theta
            load = gamma * length**2 * (1.0 - b.xi) + lift * length
            by_angle = bent / length + b.values.T @ (w * (load * c + tension * length * s))
            place = self.columns[k]
            np.add.at(out, place[place >= 0], by_angle[place >= 0])
            arm = float((w * (1.0 - b.xi)) @ s)
            out[a + k] = (-float(theta @ bent) / (2.0 * length**2) + gamma * (y[k] + 2.0 * length * arm)
                          + lift * float(w @ s) + tension * float(w @ (1.0 - c)) + mu)  # fmt: skip
            out[a + m + k] = length * float(w @ s) - y[k + 1] + y[k]
            missing += length * float(w @ (1.0 - c))
        out[a + 2 * m] = missing
        if not self.flat:
            out[-1] = float(self.lengths(z).sum()) - 1.0
        return out

    def jacobian(self, z: FloatArray, setting: Setting) -> FloatArray:
        """Second derivatives (n, n)."""
        b, out = basis(self.elements), np.zeros((self.size, self.size))
        a, m, gamma = self.angles, self.arcs, setting.gamma
        tension = self.tension(z)
        for k in range(m):
            theta, length, lift = self.angle(z, k), self.lengths(z)[k], self.lifts(z)[k]
            value = b.values @ theta
            c, s, w = np.cos(value), np.sin(value), b.weights
            bent = b.stiffness @ theta
            lever = 1.0 - b.xi
            load = gamma * length**2 * lever + lift * length
            block = b.stiffness / length + b.values.T @ ((w * (tension * length * c - load * s))[:, None] * b.values)
            by_length = -bent / length**2 + b.values.T @ (w * ((2.0 * gamma * length * lever + lift) * c + tension * s))
            place = self.columns[k]
            free = place >= 0
            one = place[free]
            out[np.ix_(one, one)] += block[np.ix_(free, free)]
            columns = a + k, a + m + k, a + 2 * m
            for column, values in zip(
                columns, (by_length, length * (b.values.T @ (w * c)), length * (b.values.T @ (w * s))), strict=True
            ):
                out[one, column] += values[free]
                out[column, one] += values[free]
            out[a + k, a + k] = float(theta @ bent) / length**3 + 2.0 * gamma * float((w * lever) @ s)
            for column, value_ in ((a + m + k, float(w @ s)), (a + 2 * m, float(w @ (1.0 - c)))):
                out[a + k, column] = out[column, a + k] = value_
            if not self.flat:
                out[a + k, -1] = out[-1, a + k] = 1.0
        return out

    def by_height(self, z: FloatArray, gamma: float) -> FloatArray:
        """d residual / dH (n,)."""
        out, on = np.zeros(self.size), np.array(self.planes, dtype=float)
        a, m = self.angles, self.arcs
        out[a : a + m] = gamma * on[:-1]
        out[a + m : a + 2 * m] = on[:-1] - on[1:]
        return out

    def curvature(self, z: FloatArray, k: int, xi: FloatArray) -> FloatArray:
        """theta_s at xi (q,) of arc k."""
        return np.asarray(at(self.elements, xi)[1] @ self.angle(z, k) / self.lengths(z)[k])

    def clamped(self, z: FloatArray, setting: Setting) -> float:
        """Mean of theta_s at both clamps where their angles are given, which sliding along does not change: by the
        moments that balance them, of twice the elements' order."""
        b, found = basis(self.elements), []
        for k, end, sign in ((0, 0, -1.0), (self.arcs - 1, -1, 1.0)):
            theta, length = self.angle(z, k), self.lengths(z)[k]
            value = b.values @ theta
            load = setting.gamma * length**2 * (1.0 - b.xi) + self.lifts(z)[k] * length
            turns = b.weights * (load * np.cos(value) + self.tension(z) * length * np.sin(value))
            found.append(sign * float(b.stiffness[end] @ theta / length + b.values[:, end] @ turns))
        return 0.5 * (found[0] + found[1])

    def pushes(self, z: FloatArray, gamma: float) -> FloatArray:
        """What the planes push at the inner places (k - 1,), D w / l^2, without what carries a flat part's weight."""
        lift, length = self.lifts(z), self.lengths(z)
        from_below = lift[1:] - lift[:-1] + gamma * length[1:]
        return np.where(np.array(self.planes[1:-1]) == ROOF, -from_below, from_below)

    def flat_length(self, z: FloatArray) -> float:
        """Of the flat parts."""
        return 1.0 - float(self.lengths(z).sum())


def nodes(elements: int) -> FloatArray:
    """xi (n,) of the unknowns of an arc."""
    return np.concatenate([[0.0], ((np.arange(elements)[:, None] + _NODES[1:]) / elements).ravel()])


def filled(many: Chain, angles: list[FloatArray], rest: FloatArray) -> FloatArray:
    """z of these angles (n,) of every arc, and what follows them."""
    z = np.zeros(many.size)
    for place, values in zip(many.columns, angles, strict=True):
        z[place[place >= 0]] = values[place >= 0]
    z[many.angles :] = rest
    return z
