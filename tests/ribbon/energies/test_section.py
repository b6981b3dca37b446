"""Sections of energies of free twist: functions to near rounding, the plate's own minimum, shapes and shares."""

from __future__ import annotations

from itertools import pairwise

import mpmath as mp
import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from ribbon.energies import edge_layer
from ribbon.energies.free import FREE_CODES, FREE_ENERGIES, free_density
from ribbon.energies.section import relaxed
from ribbon.energies.section.profile import Local
from ribbon.energies.section.unit import unit

#: w / (2 l), h / l, nu, stiffness: w/h = 2, 20, 100, 1000.
SECTIONS = [(1e-3, 1e-3, 0.4, 1.0), (0.015, 1.5e-3, 0.3, 0.0), (0.015, 3e-4, 0.4, 0.0), (0.05, 1e-4, -0.2, 0.0)]
_NODES, _WEIGHTS = leggauss(24)


def rule(decay):
    """Gauss points and weights over xi in [-1/2, 1/2], graded towards the edges, for layers of width 1 / decay."""
    count = 2 + max(0, int(np.ceil(np.log2(decay / 8.0))))
    ends = np.array([0.0, *(0.5 - 0.5 ** np.arange(2, 2 + count)), 0.5])
    x = np.concatenate([a + (b - a) * 0.5 * (_NODES + 1.0) for a, b in pairwise(ends)])
    w = np.concatenate([(b - a) * 0.5 * _WEIGHTS for a, b in pairwise(ends)])
    return np.concatenate([-x[::-1], x]), np.concatenate([w[::-1], w])


def exact_gain(y):
    """phi = (1/2 - g)/y and two derivatives by y, 60 digits, by the coefficients of a Taylor polynomial."""
    with mp.workdps(80):
        y = mp.mpf(y)

        def phi(u):
            z = mp.root(u, 4)
            return (mp.mpf(1) / 2 - (mp.cosh(z) - mp.cos(z)) / (z * (mp.sinh(z) + mp.sin(z)))) / u

        h = y * mp.mpf(10) ** -18
        a, b, c = phi(y - h), phi(y), phi(y + h)
        return b, (c - a) / (2 * h), (c - 2 * b + a) / h**2


V = [1e-4, 1e-2, 1.0, 3.0, 9.0, 17.9, 22.3, 50.0, 180.0, 611.0, 1.4e3, 2311.0, 2313.0, 1e4, 1e5, 1e6]


@pytest.mark.parametrize("v", V)
def test_phi_and_two_derivatives_by_v(v):
    """To 1e-12 relative for v up to 1e6 (issue): by v, from those by y = v^2 / 4."""
    p, q, r = relaxed.gain(v * v / 4)
    a, b, c = exact_gain(mp.mpf(v) ** 2 / 4)
    assert p == pytest.approx(float(a), rel=1e-12)
    assert 0.5 * v * q == pytest.approx(float(b * v / 2), rel=1e-12)
    assert 0.5 * q + 0.25 * v * v * r == pytest.approx(float(b / 2 + c * mp.mpf(v) ** 2 / 4), rel=1e-12)


def test_phi_at_zero():
    p, q, r = relaxed.gain(0.0)
    assert p == pytest.approx(1.0 / 360.0, rel=1e-14)
    assert q < 0.0 < r
    for y in (0.0, 1.0, 30.0):
        half_minus_g = 0.5 - edge_layer.layer(np.array([y**0.25]))[0][0]
        assert y * relaxed.gain(y)[0] == pytest.approx(half_minus_g, rel=1e-12)


def test_the_two_ways_to_the_unit_profile_meet():
    """Series and closed form at z = 2: smooth; at z = 300 finite, and the edge's known values there."""
    xi = np.linspace(-0.5, 0.5, 21)
    for name in ("value", "slope", "curvature", "by_y"):
        below, at = (getattr(unit(np.array([y]), xi), name) for y in (16.0 * (1 - 1e-13), 16.0))
        np.testing.assert_allclose(below, at, rtol=0.0, atol=1e-10 * np.abs(at).max())
    z = 300.0
    psi = unit(np.array([z**4]), np.array([0.5]))
    assert (1.0 / 12.0 - z**4 * psi.value[0, 0]) == pytest.approx(0.5 / z**2, rel=1e-10)
    assert 0.5 - z**4 * psi.slope[0, 0] == pytest.approx(1.0 / z, rel=1e-10)
    assert 1.0 - z**4 * psi.curvature[0, 0] == pytest.approx(1.0, rel=1e-10)


def local(*numbers):
    return Local(*(np.array([float(v)]) for v in numbers))


#: k, t, dk, dt, K, dK/ds.
STATES = [(7.0, 3.0, 20.0, -30.0, 4.0, 2.0), (-12.0, -1.3, 10.0, 8.0, 5.0, 0.0), (1e-3, 2.0, 40.0, 5.0, 0.0, 0.0)]


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("section", SECTIONS)
@pytest.mark.parametrize("name", FREE_CODES)
def test_shares_have_the_energy_as_their_mean(name, section, state):
    """Over the width, K^2 / 2 counted; no share is negative, and the membrane's mean is the envelope theorem's."""
    width, thickness, nu = 2.0 * section[0], section[1], section[2]
    z = ((3.0 * (1 - nu**2)) ** 0.5 * width**2 / thickness * abs(state[0])) ** 0.5
    xi, w = rule(max(z, 3.2 * width / thickness, 20.0))
    shares = FREE_ENERGIES[name].section.shares(local(*state), width * xi, section)
    out = np.empty(15)
    free_density(FREE_CODES[name], *state, section, out)
    assert (shares.total @ w)[0] == pytest.approx(out[0] + 0.5 * state[4] ** 2, rel=1e-9)
    assert shares.bending.min() >= 0.0
    assert shares.membrane.min() >= 0.0
    assert shares.shear.min() >= 0.0
    if name in ("extensible", "finite"):
        b = nu * (state[0] - state[4]) + state[1] ** 2 / state[0]
        zg = edge_layer.layer(np.array([z]))[1][0]
        assert (shares.membrane @ w)[0] == pytest.approx(-0.25 * zg * b * b, rel=1e-8)
        shear = edge_layer.Section(nu, width, thickness).twist_shear
        assert (shares.shear @ w)[0] == pytest.approx((1 - nu) * state[1] ** 2 * shear, rel=1e-9)


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("section", SECTIONS)
@pytest.mark.parametrize("name", FREE_CODES)
def test_shapes_and_their_slopes(name, section, state):
    """f has mean zero, f_y and f_s are its derivatives across and along."""
    width = 2.0 * section[0]
    shape = FREE_ENERGIES[name].section.shape
    xi, w = rule(300.0)
    y = width * xi
    found = shape(local(*state), y, section)
    assert abs((found.f @ w)[0]) < 1e-12 * np.abs(found.f).max() + 1e-30
    step = 1e-4 * width
    at = [shape(local(*state), y + n * step, section).f for n in (-2, -1, 1, 2)]
    across = (8.0 * (at[2] - at[1]) - (at[3] - at[0])) / (12.0 * step)
    np.testing.assert_allclose(across, found.across, rtol=0.0, atol=1e-7 * np.abs(found.across).max() + 1e-30)
    k, t, dk, dt, natural, slope = state
    step = 1e-4 * min(1.0, abs(k)) / max(abs(dk), 1.0)
    at = [
        shape(local(k + n * step * dk, t + n * step * dt, dk, dt, natural + n * step * slope, slope), y, section).f
        for n in (-2, -1, 1, 2)
    ]
    along = (8.0 * (at[2] - at[1]) - (at[3] - at[0])) / (12.0 * step)
    rounding = 1e-14 * np.abs(found.f).max() / step
    np.testing.assert_allclose(along, found.along, rtol=0.0, atol=1e-7 * np.abs(found.along).max() + rounding + 1e-30)


@pytest.mark.parametrize("natural", [0.0, 5.0])
def test_shapes_pass_through_inflections(natural):
    """At k = 0 the shape is the rod's; on both sides it is next to it."""
    section = SECTIONS[2]
    y = 2.0 * section[0] * np.linspace(-0.5, 0.5, 11)
    for name in ("extensible", "finite", "sano"):
        at = [
            FREE_ENERGIES[name].section.shape(local(k, 2.0, 3.0, 1.0, natural, 0.0), y, section).f[0]
            for k in (-1e-6, 0.0, 1e-6)
        ]
        rod = -section[2] * natural * (0.5 * y**2 - section[0] ** 2 / 6.0)
        np.testing.assert_allclose(at[1], rod, atol=1e-16)
        np.testing.assert_allclose(at[2] + at[0], 2.0 * at[1], atol=1e-9)


@pytest.mark.parametrize("state", [(7.0, 3.0, 4.0), (-12.0, 1.3, 5.0), (0.5, 2.0, 3.0), (0.0, 4.0, 2.0)])
@pytest.mark.parametrize("section", SECTIONS[1:3])
def test_the_section_minimises_the_plates_energy(section, state):
    """(10.9) minimised by cubic Hermite elements across the width: energy and shape of `extensible`."""
    k, t, natural = state
    nu, width, thickness = section[2], 2.0 * section[0], section[1]
    count = 60
    nodes = 0.5 * width * np.sin(0.5 * np.pi * np.linspace(-1.0, 1.0, count + 1))
    gauss, weights = leggauss(4)
    gauss, weights = 0.5 * (gauss + 1.0), 0.5 * weights
    hermite = [
        np.polynomial.Polynomial(c) for c in ([1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1])
    ]  # values and slopes at both ends
    stiff, load, constant = np.zeros((2 * count + 2,) * 2), np.zeros(2 * count + 2), 0.0
    stretch = 12.0 * (1.0 - nu**2) / thickness**2
    for e in range(count):
        size = nodes[e + 1] - nodes[e]
        scale = np.array([1.0, size, 1.0, size])
        own = slice(2 * e, 2 * e + 4)
        for x, weight in zip(gauss, weights * size / width, strict=True):
            f = scale * [p(x) for p in hermite]
            second = scale * [p.deriv(2)(x) for p in hermite] / size**2
            more = t * t * (0.5 * (nodes[e] + size * x) ** 2 - width**2 / 24.0)
            stiff[own, own] += weight * (np.outer(second, second) + stretch * k * k * np.outer(f, f))
            load[own] += weight * (-nu * (k - natural) * second + stretch * k * more * f)
            constant += weight * 0.5 * stretch * more * more
    if k == 0.0:
        stiff[[0, -2], [0, -2]] += 1.0 / width**4  # hold the rigid motions, which nothing else does; they carry no load
    q = np.linalg.solve(stiff, -load)
    least = 0.5 * (k - natural) ** 2 + constant + 0.5 * load @ q
    out = np.empty(15)
    free_density(FREE_CODES["extensible"], k, t, 0.0, 0.0, natural, 0.0, section, out)
    loss = relaxed.torsion_loss(width, thickness)
    assert out[0] + 0.5 * natural**2 == pytest.approx(least + (1 - nu) * (1 - loss) * t * t, rel=1e-6)
    if k:
        f = FREE_ENERGIES["extensible"].section.shape(local(k, t, 0, 0, natural, 0), nodes, section).f[0]
        np.testing.assert_allclose(q[::2], f, rtol=0.0, atol=1e-4 * np.abs(f).max())
