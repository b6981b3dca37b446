"""docs/theory.md, chapter 10, the tape spring: its equations by numbers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import trapezoid

from ribbon.tape import law as tape_law
from ribbon.tape.held import Hold as TapeHold
from ribbon.tape.rod import Rod as TapeRod
from ribbon.tape.section import Section as TapeSection

TAPE = {"width": 0.06, "thickness": 1.5e-4, "poisson": 0.3, "curvature": 20.0}


def test_tape_energy_10_20_and_10_21():
    """An arc of uniform section: k, e = eps + k z, b22 = kappa - kappa0 and b11 = -k are constant along it."""
    section, k, stretch, kappa = TapeSection(**TAPE), 1.5, 1.001, np.array([18.0, -0.7, 0.2])
    free = TapeHold(undeformed=False)
    rod = TapeRod(section, np.full(40, 0.025), free, free)
    nodes = np.zeros((41, rod.fields))
    nodes[:, 0], nodes[:, 1] = stretch * np.sin(k * rod.s) / k, stretch * np.cos(k * rod.s)
    nodes[:, 2], nodes[:, 3] = stretch * (1.0 - np.cos(k * rod.s)) / k, stretch * np.sin(k * rod.s)
    nodes[:, 4::2] = kappa
    t, a = np.linspace(-1.0, 1.0, 20001), 0.03
    p = np.array([np.ones_like(t), (3 * t**2 - 1) / 2, (35 * t**4 - 30 * t**2 + 3) / 8])
    r = np.array([t**2 / 2, (t**4 / 4 - t**2 / 2) / 2, (35 * t**6 / 30 - 30 * t**4 / 12 + 3 * t**2 / 2) / 8])
    z = a**2 * kappa @ (r - trapezoid(r, t, axis=1)[:, None] / 2.0)
    e, across = (stretch**2 - 1.0) / 2.0 + k * z, kappa @ p - 20.0
    y = 12.0 * (1.0 - 0.09) / 1.5e-4**2
    wanted = trapezoid(y * e**2 + k**2 + across**2 - 0.6 * k * across, t) / 4.0
    assert rod.energy(nodes.ravel())[0] == pytest.approx(wanted, rel=1e-6)


def test_tape_held_point_10_22():
    rod = TapeRod(TapeSection(**TAPE), np.full(2, 0.5), TapeHold((0.0, 0.0)), TapeHold(undeformed=False))
    phi, node = 0.7, np.zeros(rod.fields)
    node[:4], node[4] = (0.3, 1.1 * np.cos(phi), -0.2, 1.1 * np.sin(phi)), 15.0
    height = -15.0 * 0.03**2 / 6.0  # a^2 kappa r_0(0)
    point = np.array([0.3, -0.2]) - height * np.array([-np.sin(phi), np.cos(phi)])
    np.testing.assert_allclose(rod.start.rows(node, rod.middle)[0], point, rtol=1e-12)


def test_tape_law_10_23_to_10_25():
    plain, y, a = TapeSection(**TAPE, terms=1), 12.0 * 0.91 / 1.5e-4**2, 0.03
    k = 0.25
    kappa = (20.0 + 0.3 * k) / (1.0 + y * k**2 * a**4 / 45.0)
    moment = k * (1.0 + y * kappa**2 * a**4 / 45.0) - 0.3 * (kappa - 20.0)
    assert tape_law.uniform(plain, k)[1] == pytest.approx(moment, rel=1e-12)
    profile, step = tape_law.exact_profile(plain, k), 1e-4
    v = np.linspace(0.0, 0.028, 8)
    (z, bend), more, less = profile(v), profile(v + step)[1], profile(v - step)[1]
    np.testing.assert_allclose(
        (more - 2.0 * bend + less) / step**2, -y * k**2 * z, atol=1e-4 * np.abs(y * k**2 * z).max()
    )
    assert profile(np.array([a]))[1][0] == pytest.approx(20.0 + 0.3 * k, rel=1e-12)
    assert abs(profile(np.array([a + step]))[1][0] - profile(np.array([a - step]))[1][0]) < 1e-4
    for sign in (1.0, -1.0):
        found = tape_law.plateau(lambda k: tape_law.uniform(plain, k), 20.0 * sign)
        assert abs(found.moment) == pytest.approx((1.0 + sign * 0.3) * 20.0, rel=1e-10)
        ends = [tape_law.uniform(plain, one) for one in (found.low, found.high)]
        assert ends[1][0] - ends[0][0] == pytest.approx(found.moment * (found.high - found.low), rel=1e-9)
