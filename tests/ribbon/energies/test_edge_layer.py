"""The strip's gain across its width: g and its derivatives, limits, the plate's own minimum, stretching and shear."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from scipy.integrate import simpson, solve_bvp

from ribbon.energies import sadowsky
from ribbon.energies.edge_layer import Section, layer

SECTION = Section(poisson=0.4, width=0.1, thickness=1e-3)


def exact(z: float, order: int) -> float:
    """z^k times the k-th derivative of g at z, to 40 digits."""
    with mpmath.workdps(60):
        z = mpmath.mpf(z)

        def g(x):
            return (mpmath.cosh(x) - mpmath.cos(x)) / (x * (mpmath.sinh(x) + mpmath.sin(x)))

        return float(z**order * (mpmath.diff(g, z, order) if order else g(z)))


@pytest.mark.parametrize("z", [1e-3, 0.3, 1.0, 1.199, 1.2, 1.7, 4.0, 30.0, 710.0, 5000.0])
def test_g_and_its_derivatives(z):
    found = layer(np.array([z]))
    for order in range(3):
        assert found[order].shape == (1,)
        assert found[order][0] == pytest.approx(exact(z, order), rel=5e-13, abs=1e-18)


def test_limits_rod_and_sadowsky():
    g, zg, zzg = layer(np.array([0.0, 1e6]))
    assert g[0] == 0.5
    assert zg[0] == zzg[0] == 0.0
    assert g[1] == pytest.approx(1e-6, rel=1e-12)


def test_phi_of_the_paper():
    """3 (1 - nu^2) (w^4 / h^2) (nu kappa^2 + tau^2)^2 phi(v) is b^2 (1/2 - g), phi(0) = 1/360 (Audoly & Neukirch)."""
    nu, w, h, kappa, tau = 0.4, 0.1, 1e-3, 3.0, 0.7
    v = mpmath.sqrt(12 * (1 - nu**2)) * kappa * w**2 / h
    z = mpmath.sqrt(v / 2)
    phi = (4 / v**2) * (mpmath.mpf(1) / 2 - (mpmath.cosh(z) - mpmath.cos(z)) / (z * (mpmath.sinh(z) + mpmath.sin(z))))
    paper = 3 * (1 - nu**2) * w**4 / h**2 * (nu * kappa**2 + tau**2) ** 2 * phi
    ours = (nu * kappa + tau**2 / kappa) ** 2 * (0.5 - float(layer(np.array([SECTION.scale * np.sqrt(kappa)]))[0][0]))
    assert ours == pytest.approx(float(paper), rel=1e-10)


def plate(nu: float, w: float, h: float, kappa: float, tau: float, natural: float) -> tuple[float, float]:
    """(energy, membrane energy) per length over D w of a cross-section, by solve_bvp on the plate's own equation.

    A bent and twisted section deflects by f(y); its fibres stretch by kappa f + tau^2 y^2 / 2 less their mean. With
    kappa u the stretch, the energy is the mean over the section of 1/2 (1 - nu^2) (kappa - K)^2 + (1 - nu) tau^2
    + 1/2 (d2u - b)^2 + 1/2 a u^2, a = 12 (1 - nu^2) kappa^2 / h^2: its minimum has d4u + a u = 0, and at the edges
    d2u = b, d3u = 0. Lengths over w / 2, u over b w^2 / 4.
    """
    half = 0.5 * w
    a = 12.0 * (1.0 - nu**2) * kappa**2 / h**2 * half**4
    b = nu * (kappa - natural) + tau**2 / kappa

    def equation(y, u):
        return np.vstack([u[1], u[2], u[3], -a * u[0]])

    def edges(left, right):
        return np.array([left[1], left[3], right[2] - 1.0, right[3]])

    y = np.linspace(0.0, 1.0, 400)
    found = solve_bvp(equation, edges, y, np.zeros((4, y.size)), tol=1e-7, max_nodes=200000)
    assert found.success
    fine = np.linspace(0.0, 1.0, 20001)
    u, _, second, _ = found.sol(fine)
    stretching = b**2 * float(simpson(0.5 * a * u**2, x=fine))
    bending = b**2 * float(simpson(0.5 * (second - 1.0) ** 2, x=fine))
    base = 0.5 * (1.0 - nu**2) * (kappa - natural) ** 2 + (1.0 - nu) * tau**2
    return base + stretching + bending, stretching


@pytest.mark.parametrize(("kappa", "eta", "natural"), [(3.0, 0.3, 0.0), (0.4, -0.5, 0.0), (8.0, 0.1, 5.0)])
def test_the_minimum_over_the_section_is_the_plates(kappa, eta, natural):
    nu, w, h = SECTION.poisson, SECTION.width, SECTION.thickness
    whole, stretching = plate(nu, w, h, kappa, eta * kappa, natural)
    here = np.array([kappa]), np.array([eta]), np.array([natural])
    thin = Section(nu, w, h)
    gained = thin.softening(*here)[0] + (1.0 - nu) * thin.twist_loss * (eta * kappa) ** 2
    b = nu * (kappa - natural) + eta**2 * kappa
    sadowsky = 0.5 * (1.0 - nu**2) * (kappa - natural) ** 2 + (1.0 - nu) * (eta * kappa) ** 2 + 0.5 * b**2
    assert sadowsky + gained[0] == pytest.approx(whole, rel=2e-6)
    assert thin.membrane(*here)[0] == pytest.approx(stretching, rel=2e-5)


def test_sadowsky_is_the_energy_without_softening():
    """1/2 (1 - nu^2)(kappa - K)^2 + (1 - nu) tau^2 + b^2 / 2 is the thesis's density plus K^2 / 2."""
    rng = np.random.default_rng(3)
    kappa, eta, natural, nu = rng.normal(size=(4, 50))
    b = nu * (kappa - natural) + eta**2 * kappa
    left = 0.5 * (1 - nu**2) * (kappa - natural) ** 2 + (1 - nu) * (eta * kappa) ** 2 + 0.5 * b**2
    bending = np.empty((50, 10))
    for row, k, e in zip(bending, kappa, eta, strict=True):
        sadowsky.density(k, e, 0.0, np.zeros(3), row)
    right = bending[:, 0] - natural * kappa * (1 + nu * eta**2) + 0.5 * natural**2
    np.testing.assert_allclose(left, right, rtol=1e-12, atol=1e-12)


def test_torsion_of_a_thin_rectangle():
    """1 - q is the rectangle's torsion constant over w h^3 / 3, to the order of the plate model (0.63 h / w)."""
    section = Section(0.3, 0.1, 0.01)
    series = sum(np.tanh(k * np.pi * 10 / 2) / k**5 for k in range(1, 60, 2))
    saint_venant = 1.0 - 192.0 / np.pi**5 / 10.0 * series
    assert 1.0 - section.twist_loss == pytest.approx(saint_venant, rel=1e-3)
    energy = section.shear(np.array([2.0]), np.array([0.5]))[0]
    assert energy == pytest.approx(0.7 * 0.5 * section.twist_loss, rel=1e-6)


def test_derivatives_of_the_softening():
    rng = np.random.default_rng(1)
    kappa = np.concatenate([rng.normal(size=20) * 5.0, [1e-3, -1e-5, 0.0]])
    eta, natural = rng.normal(size=23) * 0.6, rng.normal(size=23) * 3.0
    step = 1e-5
    value, gradient, hessian = SECTION.softening(kappa, eta, natural)
    assert value.shape == (23,)
    assert hessian.shape == (23, 2, 2)
    for place, move in enumerate(((step, 0.0), (0.0, step))):
        plus = SECTION.softening(kappa + move[0], eta + move[1], natural)
        minus = SECTION.softening(kappa - move[0], eta - move[1], natural)
        np.testing.assert_allclose((plus[0] - minus[0]) / (2 * step), gradient[:, place], rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose((plus[1] - minus[1]) / (2 * step), hessian[:, place], rtol=1e-5, atol=2e-4)
