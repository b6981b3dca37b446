"""Elastic energy of one segment whose twist is free, with gradient and Hessian: its integral in any state (numba).

Curvature k, twist t and natural curvature are linear on the segment; the density (`ribbon.energies.free`) is no
polynomial. Its singularities nearest to the real axis lie at ``k = +- i r``, r = `FreeTwist.reach` / zeta
(docs/theory.md, eq. (10.26)): where the curvature passes zero the density has a peak 1 / (zeta |k'|) long. A rule that
is fixed while the state moves has minima whose peaks stand between its points; so the rule follows the state:

- where ``u = asinh(k / r)`` changes by less than `SPAN` on the segment, `FreeTwist.points` Gauss points;
- elsewhere panels of equal width in u, at most `WIDE`, that grow with the distance from k = 0 as a graded mesh does:
  in every one of them the singularities are equally far away, over its length (sinh-transformation, P. Johnston,
  D. Elliott 2005, doi:10.1002/nme.1208), and Gauss' rule of `POINTS` points errs equally little;
- a panel is halved while the last Legendre coefficients of the density on it promise more than `ERROR` (relative, on
  the panel): coefficients that fall from the middle to the end of the rule by A / B leave A (A / B)^2.

The integral is that of the continuous density to about `ERROR`, so that derivatives of the density on the same points
are the derivatives of the value, although panels move with the state. r = 0 (Sadowsky's energy): a segment on which
the curvature changes its sign, twisted, has no finite energy: it is infinite. `ribbon.judge.quadrature` checks it
all by a rule of its own.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ribbon.energies.codes import among_free
from ribbon.energies.free import FREE_ENERGIES, add_pretwist, free_density, free_value
from ribbon.energies.names import FREE

#: Neither a natural twist nor a natural curvature in the plane.
NOTHING = (0.0, 0.0, 0.0, 0.0)
#: Change of u = asinh(k / r) up to which a segment takes the energy's own number of points.
SPAN = 0.2
#: Widest panel in u, and most panels.
WIDE = 0.7
MOST = 120
#: Points of a panel, error that they may promise, and shortest panel over the first one.
POINTS = 8
ERROR = 1e-10
_SHORTEST = 2.0**-14
#: Size of the last coefficients, over the density, that is rounding.
_ROUNDING = 1e-13

_ENERGIES = [FREE_ENERGIES[name] for name in FREE]
_COUNT = np.array([energy.points for energy in _ENERGIES])
_REACH = np.array([energy.reach for energy in _ENERGIES])
_TESTED = np.array([energy.tested for energy in _ENERGIES])
#: Points and weights on [0, 1] of every energy's own rule, and of a panel's.
_OWN_POINTS = np.zeros((_COUNT.size, _COUNT.max()))
_OWN_WEIGHTS = np.zeros_like(_OWN_POINTS)
for _code, _count in enumerate(_COUNT):
    _NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_count)
    _OWN_POINTS[_code, :_count], _OWN_WEIGHTS[_code, :_count] = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(POINTS)
_PANEL_POINTS, _PANEL_WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
#: From the values at a panel's points to the Legendre coefficients in the middle and at the end of what they tell.
_PLACES = np.array([POINTS // 2 - 1, POINTS // 2, POINTS - 2, POINTS - 1])
_TAIL = ((_PLACES + 0.5) * np.polynomial.legendre.legvander(_NODES, POINTS - 1)[:, _PLACES]).T * _WEIGHTS


@njit(cache=True)
def free_jet(code, q, length, k_start, k_slope, section, jet, rest=NOTHING, alone=False):
    """Fills `jet` (15 or 28,) with the elastic energy (D w / l) of a segment with free twist, parameters q (4 or 6,).
    alone: its first component is wanted alone, and of the others nothing is known.

    kappa_1 = q_0 s + q_1, kappa_3 = q_2 s + q_3, kappa_2 = q_4 s + q_5; K(s) = k_start + k_slope s; section: w / (2 l),
    h / l, nu, plate (`ribbon.energies.free`); rest: natural twist at the start and its slope, natural curvature in the
    plane and its slope. Layout of the jet: `ribbon.element.free_series`.
    """
    jet[:] = 0.0
    code = among_free(code)
    reach = _reach(code, q, section)
    if _TESTED[code] or _changes(q[1], q[0] * length + q[1], reach):
        _composite(code, q, length, k_start, k_slope, section, rest, reach, jet, alone)
    else:
        d = np.empty(15)
        for g in range(_COUNT[code]):
            s = _OWN_POINTS[code, g] * length
            natural = k_start + k_slope * s
            _local(code, q, s, natural, k_slope, section, d, alone)
            twist = rest[0] + rest[1] * s
            if twist != 0.0:
                add_pretwist(code, q[0] * s + q[1], q[2] * s + q[3], natural, twist, section, d)
            _gather(d, s, _OWN_WEIGHTS[code, g] * length, q.size, jet, alone)
    if q.size == 6:
        _in_plane(q, length, section, rest, jet)


@njit(cache=True)
def _local(code, q, s, natural, k_slope, section, d, alone):
    """The density's numbers d (15,) at s; alone: the first of them."""
    if alone:
        free_value(code, q[0] * s + q[1], q[2] * s + q[3], q[0], q[2], natural, k_slope, section, d)
    else:
        free_density(code, q[0] * s + q[1], q[2] * s + q[3], q[0], q[2], natural, k_slope, section, d)


@njit(cache=True)
def _reach(code, q, section):
    """Distance r of the density's nearest singularity from the real axis of the curvature, on this segment."""
    reach = _REACH[code]
    if reach == 0.0:
        # where twist and curvature vanish together the density is a polynomial
        small = 1e-14 * (abs(q[0] * q[3]) + abs(q[1] * q[2]))
        return math.inf if abs(q[0] * q[3] - q[1] * q[2]) <= small else 0.0
    if reach == math.inf:
        return reach
    half_width, thickness, nu = section[0], section[1], section[2]
    return reach * math.sqrt(60.0 / (1.0 - nu * nu)) * thickness / (4.0 * half_width * half_width)


@njit(cache=True)
def _changes(first, last, reach):
    """Whether u changes by more than SPAN between the curvatures `first` and `last`, or may."""
    near = 0.0 if first * last <= 0.0 else min(abs(first), abs(last))
    return abs(last - first) > SPAN * max(reach, near)


@njit(cache=True)
def _composite(code, q, length, k_start, k_slope, section, rest, reach, jet, alone):
    """Adds to `jet` the integral on panels graded towards k = 0; infinite where a singular density is passed."""
    first, last = q[1], q[0] * length + q[1]
    if not _changes(first, last, reach):
        _panel(code, q, 0.0, length, k_start, k_slope, section, rest, jet, alone)
        return
    if reach == 0.0:
        if first * last <= 0.0:
            jet[:] = math.inf
            return
        begin, change = math.log(abs(first)), math.log(last / first)
    else:
        begin = math.asinh(first / reach)
        change = math.asinh(last / reach) - begin
    count = int(min(max(1.0, math.ceil(abs(change) / WIDE)), MOST))
    done = 0.0
    for j in range(count):
        end = length
        if j < count - 1:
            u = begin + change * (j + 1) / count
            k = math.copysign(math.exp(u), first) if reach == 0.0 else reach * math.sinh(u)
            end = min(max((k - first) / q[0], done), length)
        if end > done:
            _panel(code, q, done, end, k_start, k_slope, section, rest, jet, alone)
        done = end


@njit(cache=True)
def _panel(code, q, begin, end, k_start, k_slope, section, rest, jet, alone):
    """Adds to `jet` the integral from `begin` to `end`, halved where the density is not smooth enough."""
    d = np.empty((POINTS, 15))
    ends = np.empty(64)  # of the panels that wait, the next one last
    ends[0] = end
    waiting = 1
    shortest = _SHORTEST * (end - begin)
    done = begin
    while waiting > 0:
        h = ends[waiting - 1] - done
        floor = 0.0
        for g in range(POINTS):
            s = done + _PANEL_POINTS[g] * h
            natural = k_start + k_slope * s
            _local(code, q, s, natural, k_slope, section, d[g], alone)
            twist = rest[0] + rest[1] * s
            if twist != 0.0:
                add_pretwist(code, q[0] * s + q[1], q[2] * s + q[3], natural, twist, section, d[g])
            floor = max(floor, natural * natural + twist * twist)
        middle = done + 0.5 * h
        within = done < middle < ends[waiting - 1]  # a panel of neighbouring numbers has no middle
        if h > shortest and within and not _smooth(d, floor):
            ends[waiting] = middle
            waiting += 1
            continue
        for g in range(POINTS):
            _gather(d[g], done + _PANEL_POINTS[g] * h, _PANEL_WEIGHTS[g] * h, q.size, jet, alone)
        waiting -= 1
        done = ends[waiting]


@njit(cache=True)
def _smooth(d, floor):
    """Whether the density's values d[:, 0] at a panel's points promise an error below ERROR; floor: size of the terms
    that may cancel in it."""
    size = 0.0
    for g in range(POINTS):
        size = max(size, abs(d[g, 0]))
    if not size < math.inf:
        return True  # no halving mends it
    middle, tail = 0.0, 0.0
    for k in range(4):
        c = 0.0
        for g in range(POINTS):
            c += _TAIL[k, g] * d[g, 0]
        if k < 2:
            middle = max(middle, abs(c))
        else:
            tail = max(tail, abs(c))
    if tail <= _ROUNDING * (size + floor):
        return True
    fall = tail / max(middle, tail)
    return tail * fall * fall <= ERROR * size


@njit(cache=True)
def _gather(d, s, w, count, jet, alone):
    """Adds w times the numbers d (15,) of the density at s to the jet by `count` parameters (chain rule)."""
    jet[0] += w * d[0]
    if alone:
        return
    o = 7 if count == 6 else 5  # places of second derivatives: rows a, b, n, m
    ob = o + count
    on = ob + count - 1
    om = on + count - 2
    jet[1] += w * (s * d[1] + d[3])
    jet[2] += w * d[1]
    jet[3] += w * (s * d[2] + d[4])
    jet[4] += w * d[2]
    jet[o] += w * (s * (s * d[5] + 2.0 * d[7]) + d[12])
    jet[o + 1] += w * (s * d[5] + d[7])
    jet[o + 2] += w * (s * (s * d[6] + d[8] + d[10]) + d[13])
    jet[o + 3] += w * (s * d[6] + d[10])
    jet[ob] += w * d[5]
    jet[ob + 1] += w * (s * d[6] + d[8])
    jet[ob + 2] += w * d[6]
    jet[on] += w * (s * (s * d[9] + 2.0 * d[11]) + d[14])
    jet[on + 1] += w * (s * d[9] + d[11])
    jet[om] += w * d[9]


@njit(cache=True)
def _in_plane(q, length, section, rest, jet):
    """Adds to `jet` (28,) the energy of bending in the strip's plane (`ribbon.energies.free.in_plane_stiffness`)."""
    stiffness = 4.0 * (1.0 - section[2] * section[2]) * (section[0] / section[1]) ** 2
    c, e = q[4] - rest[3], q[5] - rest[2]
    first, second, third = stiffness * length, 0.5 * stiffness * length**2, stiffness * length**3 / 3.0
    jet[0] += 0.5 * (third * c * c + first * e * e) + second * c * e
    jet[5] += third * c + second * e
    jet[6] += second * c + first * e
    jet[25] += third
    jet[26] += second
    jet[27] += first
