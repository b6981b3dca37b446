"""What `finite` leaves out: its section against the energy's own functions, its layer at a clamp against quadrature."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon.energies.free import FREE_CODES, FREE_ENERGIES, free_density
from ribbon.energies.section import relaxed
from ribbon.energies.section.dropped import _A, _NODES, _SLOPE, _WEIGHTS, Dropped
from ribbon.energies.section.profile import Local

STRIPS = ((0.03, 20.0, 0.4), (0.05, 100.0, 0.25), (0.3, 300.0, 0.45), (0.1, 10.0, 0.0))
STATES = ((5.0, 1.0, 0.0), (-8.0, 2.5, 3.0), (0.3, -1.5, -4.0), (10.0, 0.0, 0.0))


@pytest.mark.parametrize(("width", "ratio", "poisson"), STRIPS)
@pytest.mark.parametrize(("k", "t", "natural"), STATES)
def test_the_section_gains_what_the_energy_gains(width, ratio, poisson, k, t, natural):
    """Flat against relaxed: nu^2 kb^2 / 2 + c4 t^4 / 360 - c4 B^2 (1/2 - g) / y, and <f_y^2> by quadrature."""
    dropped = Dropped(width, width / ratio, poisson)
    c4 = 3.0 * (1.0 - poisson**2) * width**2 * ratio**2
    y, b = c4 * k * k, poisson * k * (k - natural) + t * t
    curl = dropped.curl(np.array(k), np.array(t), np.array(natural))
    gained = 0.5 * float(np.sum(curl**2 * (1.0 + y * _A)))
    expected = 0.5 * (poisson * (k - natural)) ** 2 + c4 * t**4 / 360.0 - c4 * b * b * relaxed.gain(y)[0]
    assert gained == pytest.approx(expected, rel=1e-9, abs=1e-14)
    state = (np.array([v]) for v in (k, t, 0.0, 0.0, natural, 0.0))
    xi, weight = np.polynomial.legendre.leggauss(60)
    section = (0.5 * width, width / ratio, poisson, 0.0)
    across = FREE_ENERGIES["finite"].section.shape(Local(*state), 0.5 * width * xi, section).across[0]
    assert width**2 * float(curl @ _SLOPE @ curl) == pytest.approx(0.5 * weight @ across**2, rel=1e-9)


def test_the_layer_at_a_clamp_is_a_minimum():
    """sqrt(A (B + 2 sqrt(A C))) against the minimum over p of int A p^2 + B p'^2 + C p''^2, p(0) = 1, p'(0) = 0."""
    dropped = Dropped(0.1, 0.005, 0.4)
    k, t, natural = 6.0, 0.5, 0.0
    curl = dropped.curl(np.array(k), np.array(t), np.array(natural))
    y = 3.0 * (1.0 - 0.4**2) * 0.1**4 / 0.005**2 * k * k
    a = 0.5 * float(np.sum(curl**2 * (1.0 + y * _A)))
    b = 0.6 * 0.01 * float(curl @ _SLOPE @ curl)
    c = 0.125 * 1e-4 * float(np.sum(curl**2 * _A))
    length = (c / a) ** 0.25
    s = np.linspace(0.0, 12.0 * length, 241)
    ds = s[1] - s[0]
    n = s.size
    first = (np.eye(n, k=1) - np.eye(n))[:-1] / ds
    second = first[:-1, :-1] @ first
    matrix = ds * (a * np.eye(n) + b * first.T @ first + c * second.T @ second)
    free = np.arange(2, n)
    known = np.zeros(n)
    known[:2] = 1.0
    p = known.copy()
    p[free] = np.linalg.solve(matrix[np.ix_(free, free)], -(matrix @ known)[free])
    energy = float(p @ matrix @ p) - 0.5 * ds * a
    found = float(dropped.clamp(np.array([k]), np.array([t]), np.array([natural]))[0])
    assert found == pytest.approx(energy, rel=0.03)


def free_value(name, *state):
    out = np.empty(15)
    free_density(FREE_CODES[name], *state, 0.0, 0.0, (0.05, 0.02, 0.3, 0.0), out)
    return out[0]


def test_terms_along_the_strip():
    """(1 - psi) (1 - nu) <f_sy^2> by differences of the shape, the odd part, and what is between the two ways; the same
    for the mirror image of a twisted strip; none of them where the section is stiff."""
    lengths = np.array([0.2, 0.3])
    natural = np.full((2, 5), 1.5)
    q = np.array([[1.0, 4.0, 2.0, 0.5], [-3.0, 4.2, -1.0, 0.9]])
    dropped = Dropped(0.1, 0.02, 0.3)
    here, mirrored = dropped.along(q, lengths, natural), dropped.along(q * [1.0, 1.0, -1.0, -1.0], lengths, natural)
    s, step = np.linspace(0.0, 0.2, 401), 1e-4
    curls = [dropped.curl(s * 1.0 + 4.0 + d, (s + d) * 2.0 + 0.5, np.full(s.size, 1.5)) for d in (-step, step)]
    by_s = (curls[1] - curls[0]) / (2.0 * step)
    soft = 1.0 - (s + 4.0) ** 2 / ((s + 4.0) ** 2 + 60.0 * 0.02**2 / (0.91 * 0.1**4))
    density = soft * 0.7 * 0.1**2 * np.einsum("sn,nm,sm->s", by_s, _SLOPE, by_s)
    assert here["along"][0] == pytest.approx(float(0.5 * ((density[1:] + density[:-1]) * np.diff(s)).sum()), rel=0.01)
    plain = -(0.3**2) * 0.01 / 24.0 * q[:, 2] ** 2
    soft = 1.0 - dropped.stiff(q[:, :1] * lengths[:, None] * _NODES + q[:, 1:2]) @ _WEIGHTS
    assert here["odd"] == pytest.approx(plain * lengths * soft, rel=1e-12)
    k, t = 4.0, 0.5
    ruled = [free_value("finite", k, t, 1.0, 2.0) - free_value("extensible", k, t, 1.0, 2.0)]
    at = Dropped(0.1, 0.02, 0.3).along(np.array([[1.0, k, 2.0, t]]), np.array([1e-5]), natural[:1])
    psi = k * k / (k * k + 60.0 * 0.02**2 / (0.91 * 0.1**4))
    ruled[0] -= (1.0 - psi) * 0.01 / 24.0 * 4.0
    assert at["between"][0] == pytest.approx(1e-5 * (1.0 - psi**2) * ruled[0], rel=1e-3)
    for name, energy in here.items():
        assert mirrored[name] == pytest.approx(energy, rel=1e-12)
        assert np.all(np.abs(Dropped(0.1, 1e-5, 0.3).along(q, lengths, natural)[name]) < 1e-3 * np.abs(energy))
