"""Drawn curves as rods without twist: polygons whose strands push each other away, to begin a search at.

A rod of bending stiffness 1, length 1 and diameter d is a polygon of n edges of length h. It bends (energy sum
|r_(i+1) - 2 r_i + r_(i-1)|^2 / (2 h^3)), its edges are all but stiff, and vertices farther from each other along it
than pi d / 2 push where they are nearer than d, with a spring. That is minimised by L-BFGS. A spring is soft, vertices
are not strands: energies are good to percents. No code is shared with any solver of the package.

What becomes of it on segments: `ribbon.find.jointed.drawn`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Stiffness of an edge, of a spring over h^2 / d; iterations.
_EDGE, _SPRING, _MOST = 2e5, 1e8, 6000


class Ends(NamedTuple):
    """Where a curve begins and ends, points (3,) in l, and its tangents there, unit vectors (3,)."""

    first: FloatArray
    last: FloatArray
    leaves: FloatArray
    arrives: FloatArray


def along_z(distance: float) -> Ends:
    """Ends so far apart (l) along z, the first at the origin, with tangents along z."""
    up = np.array([0.0, 0.0, 1.0])
    return Ends(np.zeros(3), distance * up, up, up)


@dataclass(frozen=True)
class Cluster:
    """Vertices that push each other and follow each other on both strands: the middles s, s' of their forces, the sum
    of these, and the standard deviation of s under them."""

    s: float
    other: float
    force: float
    spread: float


@dataclass(frozen=True)
class Polyline:
    """points (n + 1,) x 3, the first again at the end where it is closed; energy of bending; what pushes."""

    points: FloatArray
    energy: float
    clusters: tuple[Cluster, ...]


def overhand(distance: float) -> FloatArray:
    """Points (k, 3) of an overhand knot of length 1 along z, alike about x, ends about `distance` apart."""
    a, b, big = 0.03, 0.12, 0.09
    z = np.linspace(-b, b, 13)
    turn = 1.5 * np.pi * z / b
    strand = np.stack([np.sin(turn), np.cos(turn), z / a], axis=1) * a
    strand[:, 0] *= np.sign(strand[0, 0])  # the one that comes out of the loop
    other = strand[::-1] * [1.0, -1.0, -1.0]
    t = np.linspace(-0.5 * np.pi, 1.5 * np.pi, 19)[3:-3]
    loop = np.stack([big * (1.0 + np.sin(t)), 0.0 * t, big * np.cos(t)], axis=1)
    ways = np.vstack([other, loop, strand])
    tail = 0.22
    for _ in range(60):
        low = np.stack([np.zeros(6), np.zeros(6), np.linspace(-b - tail, -b - 0.35 * tail, 6)], axis=1)
        points = np.vstack([low, ways, low[::-1] * [1.0, 1.0, -1.0]])
        length = length_of(points, along_z(distance))
        off = distance - 2.0 * (b + tail) / length
        if abs(off) < 1e-6:
            break
        tail = max(0.05, tail + 0.5 * off * length)
    return points / length


def trefoil(radius: float = 0.35) -> FloatArray:
    """Points (k, 3) of a closed trefoil of length 1, the first again at the end; radius: of the tube over that of the
    circle on which it lies."""
    t = np.linspace(0.0, 2.0 * np.pi, 241)
    out = 1.0 + radius * np.cos(3.0 * t)
    points = np.stack([out * np.cos(2.0 * t), out * np.sin(2.0 * t), radius * np.sin(3.0 * t)], axis=1)
    return points / length_of(points, None)


def relaxed(points: FloatArray, diameter: float, edges: int, ends: Ends | None = None) -> Polyline:
    """The polygon of so many edges that an equilibrium of points (k, 3), of any length, has become; ends: to which it
    is moved, and along which it is held; None: it is closed."""
    closed = ends is None
    x = _even(points, edges, ends)
    if ends is not None:
        share = (np.arange(edges + 1) / edges)[:, None]
        x += (1.0 - share) * (ends.first - x[0]) + share * (ends.last - x[-1])
    h, free = 1.0 / edges, edges if closed else edges + 1
    i, j = np.triu_indices(free, int(np.ceil(0.5 * np.pi * diameter / h)) + 1)
    if closed or np.allclose(ends.first, ends.last, atol=1e-12):  # type: ignore[union-attr]
        near = edges - (j - i) > 0.5 * np.pi * diameter / h
        i, j = i[near], j[near]
    stiff = _SPRING * h * h / diameter

    def pushing(x: FloatArray) -> tuple[NDArray[np.bool_], FloatArray, FloatArray]:
        d = x[i] - x[j]
        r = np.sqrt(np.einsum("ki,ki->k", d, d))
        here = r < diameter
        return here, d[here], r[here]

    def bent(x: FloatArray) -> FloatArray:
        if closed:
            return np.asarray(np.roll(x, -1, axis=0) - 2.0 * x + np.roll(x, 1, axis=0))
        return np.asarray(x[2:] - 2.0 * x[1:-1] + x[:-2])

    def value(v: FloatArray) -> tuple[float, FloatArray]:
        x, slope = v.reshape(-1, 3), np.zeros((free, 3))
        k = bent(x)
        q = k / h**3
        if closed:
            slope += np.roll(q, 1, axis=0) - 2.0 * q + np.roll(q, -1, axis=0)
            e = np.roll(x, -1, axis=0) - x
        else:
            slope[2:] += q
            slope[1:-1] -= 2.0 * q
            slope[:-2] += q
            e = np.diff(x, axis=0)
        length = np.linalg.norm(e, axis=1)
        pull = (_EDGE * (length / h - 1.0) / length)[:, None] * e
        if closed:
            slope += np.roll(pull, 1, axis=0) - pull
        else:
            slope[1:] += pull
            slope[:-1] -= pull
        here, d, r = pushing(x)
        push = (stiff * (diameter - r) / r)[:, None] * d
        np.add.at(slope, i[here], -push)
        np.add.at(slope, j[here], push)
        if not closed:
            slope[[0, 1, -2, -1]] = 0.0
        energy = 0.5 * (k**2).sum() / h**3 + 0.5 * _EDGE * h * ((length / h - 1.0) ** 2).sum()
        return energy + 0.5 * stiff * ((diameter - r) ** 2).sum(), slope.ravel()

    found = scipy.optimize.minimize(
        value, x[:free].ravel(), jac=True, method="L-BFGS-B",
        options={"maxiter": _MOST, "maxfun": 2 * _MOST, "maxcor": 30, "ftol": 1e-13, "gtol": 1e-4},
    )  # fmt: skip
    x = found.x.reshape(-1, 3)
    here, _, r = pushing(x)
    force = stiff * (diameter - r)
    clusters = _clusters(i[here] * h, j[here] * h, force, 3.0 * h)
    energy = 0.5 * float((bent(x) ** 2).sum()) / h**3
    return Polyline(np.vstack([x, x[:1]]) if closed else x, energy, clusters)


def fields(
    points: FloatArray, at: FloatArray, ends: Ends | None, normal: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Of a smooth curve through points (k, 3), scaled to length 1, at abscissae `at` (p,): the curvature vector's parts
    (p,) along two directions that are carried along without twist (R. L. Bishop 1975), `normal` (e_2 where None) at
    first and its cross product with the tangent; that normal (3,) as it arrives, and places (p, 3). ends: whose
    tangents it has; None: a closed curve, which is turned, so that it begins along e_3."""
    d = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    fine = np.linspace(0.0, d[-1], 6001)
    if ends is None:
        spline = smooth_ring(points, d)
    else:
        along = tuple([(1, tangent), (2, np.zeros(3))] for tangent in (ends.leaves, ends.arrives))
        spline = scipy.interpolate.make_interp_spline(d, points, k=5, bc_type=along)
    r, first, second = spline(fine), spline(fine, 1), spline(fine, 2)
    speed = np.linalg.norm(first, axis=1)
    u = first / speed[:, None]
    if ends is None:
        turn = onto(u[0], np.array([0.0, 0.0, 1.0]))
        r, u, second = r @ turn.T, u @ turn.T, second @ turn.T
    bend = (second - np.einsum("ki,ki->k", second, u)[:, None] * u) / speed[:, None] ** 2
    s = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(fine))])
    w = _carried(np.array([0.0, 1.0, 0.0]) if normal is None else normal, r, u)
    parts = (bend * w).sum(axis=1) * s[-1], (bend * np.cross(w, u)).sum(axis=1) * s[-1]
    where = s / s[-1]
    places = np.stack([np.interp(at, where, (r[:, k] - r[0, k]) / s[-1]) for k in range(3)], axis=1)
    return np.interp(at, where, parts[0]), np.interp(at, where, parts[1]), w[-1], places


def smooth_ring(points: FloatArray, d: FloatArray | None = None) -> scipy.interpolate.BSpline:
    """A closed curve through points (k, 3), the last of them the first, of d (k,), None: of how far it is from the
    first along the polygon, over the whole."""
    if d is None:
        d = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        d = d / d[-1]
    return scipy.interpolate.make_interp_spline(d, np.vstack([points[:-1], points[:1]]), k=5, bc_type="periodic")


def _carried(normal: FloatArray, r: FloatArray, u: FloatArray) -> FloatArray:
    """A normal (3,) carried without twist along points r (k, 3) with tangents u (k, 3): (k, 3), by double reflection
    (W. Wang et al. 2008, doi:10.1145/1330511.1330513)."""
    w = np.empty_like(u)
    w[0] = normal
    for k in range(len(u) - 1):
        a = r[k + 1] - r[k]
        one, tangent = (v - 2.0 * (a @ v) / (a @ a) * a for v in (w[k], u[k]))
        b = u[k + 1] - tangent
        w[k + 1] = one - 2.0 * (b @ one) / (b @ b) * b if b @ b > 1e-30 else one
    return w


def about_z(normal: FloatArray) -> float:
    """The angle (rad) from e_2 to a normal (3,) across e_3, about e_3."""
    return float(np.arctan2(-normal[0], normal[1]))


def _clusters(s: FloatArray, other: FloatArray, force: FloatArray, near: float) -> tuple[Cluster, ...]:
    """Pairs of vertices (k,) that are near each other on both strands, together; what hardly pushes is left out."""
    left, out = set(range(s.size)), []
    while left:
        group, edge = set(), {left.pop()}
        while edge:
            k = edge.pop()
            group.add(k)
            beside = {m for m in left if abs(s[m] - s[k]) < near and abs(other[m] - other[k]) < near}
            left -= beside
            edge |= beside
        own = sorted(group)
        f, a, b = force[own], s[own], other[own]
        if f.sum() > 0.0:
            middle = float(a @ f / f.sum())
            out.append(Cluster(middle, float(b @ f / f.sum()), float(f.sum()),
                               float(np.sqrt(((a - middle) ** 2) @ f / f.sum()))))  # fmt: skip
    most = max((each.force for each in out), default=0.0)
    return tuple(sorted((each for each in out if each.force > 0.02 * most), key=lambda each: each.s))


def _spline(points: FloatArray, ends: Ends | None) -> tuple[scipy.interpolate.CubicSpline, FloatArray, FloatArray]:
    d = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    if ends is None:
        spline = scipy.interpolate.CubicSpline(d, np.vstack([points[:-1], points[:1]]), bc_type="periodic")
    else:
        spline = scipy.interpolate.CubicSpline(d, points, bc_type=((1, ends.leaves), (1, ends.arrives)))
    t = np.linspace(0.0, d[-1], 20001)
    speed = np.linalg.norm(spline(t, 1), axis=1)
    return spline, t, np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))])


def length_of(points: FloatArray, ends: Ends | None) -> float:
    """The length of the smooth curve through points (k, 3)."""
    return float(_spline(points, ends)[2][-1])


def _even(points: FloatArray, edges: int, ends: Ends | None) -> FloatArray:
    """edges + 1 points at equal arc lengths."""
    spline, t, s = _spline(points, ends)
    return np.asarray(spline(np.interp(np.linspace(0.0, s[-1], edges + 1), s, t))) / s[-1]


def onto(a: FloatArray, b: FloatArray) -> FloatArray:
    """The rotation (3, 3) that takes the unit vector a to b about their normal, any of them where they are opposite."""
    if a @ b < -1.0 + 1e-12:
        one = np.cross(a, np.eye(3)[int(np.argmin(np.abs(a)))])
        return np.asarray(2.0 * np.outer(one, one) / (one @ one) - np.eye(3))
    v = np.cross(a, b)
    cross = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1.0 + a @ b))
