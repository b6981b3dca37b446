"""The ribbon element against the Euler-Lagrange equations of the Sadowsky ribbon (thesis, 4.2), solved by collocation.

First the reference itself against what it was derived from, then the ribbon's convergence to it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip, refine, solve
from tests.reference.strong_form import StrongForm, continued

HALF = 2**-0.5
CLAMP = Clamp((0, 0, 0), (0, 0, 1), (-HALF, HALF, 0), ruling="free")
UP = (1.0, 0.0, 0.0)
#: Gamma of figure 4.1: rho h g l^3 / D with D = Y h^3 / (12 (1 - nu^2)).
FIGURE_4_1 = 1000 * 1e-4 * 9.81 * 0.5**3 / (1.8e9 * 1e-12 / (12 * 0.75))
#: name -> Gamma, K l at both ends, nu
SCENES = {
    "figure 4.1": (FIGURE_4_1, (15.0, 15.0), 0.5),
    "K = 10": (100.0, (10.0, 10.0), 0.4),
    "K = -10": (100.0, (-10.0, -10.0), 0.4),
    "K linear": (100.0, (12.0, 5.0), 0.3),
}


def problem(name):
    gamma, curvature, poisson = SCENES[name]
    return StrongForm(gamma, curvature, poisson, UP, CLAMP.frame)


@pytest.fixture(scope="module")
def solutions():
    """Each scene by continuation in Gamma from the natural shape, tolerance 1e-9."""
    return {name: continued(problem(name), 1e-9, nodes=30, growth=1.3) for name in SCENES}


def states(count=6):
    rng = np.random.default_rng(3)
    y = rng.normal(size=(6, count))
    y[3] += 9.0
    return rng.random(count), y


def test_jacobian_of_the_right_side_by_complex_step():
    p, (s, y) = problem("K linear"), states()
    step = 1e-30
    columns = [np.imag(p.right_side(s, y + 1j * step * np.eye(6)[i][:, None])) / step for i in range(6)]
    assert p.jacobian(s, y) == pytest.approx(np.stack(columns, axis=1), rel=1e-12, abs=1e-12)


def test_moments_are_the_derivatives_of_sadowskys_density():
    """M_1, M_3 by kappa_1 and kappa_3 = eta omega, by complex step on the density as a function of the two."""
    p, (s, y) = problem("K linear"), states()
    step = 1e-30

    def density(first, third):
        natural = p.natural(s) * (first + p.poisson * third**2 / first)
        return (first**2 + third**2) ** 2 / (2 * first**2) - natural

    omega, third = y[3], y[3] * y[4]
    moment = p.moment(s, y)
    assert moment[0] == pytest.approx(np.imag(density(omega + 1j * step, third)) / step, rel=1e-12)
    assert moment[2] == pytest.approx(np.imag(density(omega, third + 1j * step)) / step, rel=1e-12)
    assert np.array_equal(moment[1], y[5])


def test_right_side_is_the_balance_of_moments():
    """``M' + kappa x M + e_z x R^T n = 0`` and ``g' = -kappa x g``, with M' along the right side by complex step."""
    p, (s, y) = problem("K linear"), states()
    along = p.right_side(s, y)
    step = 1e-30
    moved = StrongForm.moment(p, s + 1j * step, y + 1j * step * along)
    kappa = np.stack([y[3], 0 * y[3], y[3] * y[4]])
    force = -p.gamma * (1 - s) * y[:3]
    balance = np.imag(moved) / step + np.cross(kappa.T, p.moment(s, y).T).T
    balance += np.cross([0.0, 0.0, 1.0], force.T).T
    assert np.abs(balance).max() < 1e-12 * np.abs(p.moment(s, y)).max() * np.abs(kappa).max()
    assert along[:3] == pytest.approx(-np.cross(kappa.T, y[:3].T).T, rel=1e-12, abs=1e-12)


def test_the_natural_shape_solves_the_weightless_equations():
    p = replace(problem("K linear"), gamma=0.0)
    s, y = p.natural_shape(5)
    step = 1e-6
    ahead = p.natural_shape(1 + round(1 / step))[1]
    assert np.abs(p.moment(s, y)).max() < 1e-12
    slope = (ahead[:, 1] - ahead[:, 0]) / step
    assert slope == pytest.approx(p.right_side(s[:1], y[:, :1])[:, 0], abs=1e-3)
    assert np.abs(p.boundary(y[:, 0], y[:, -1])).max() < 1e-12


@pytest.mark.parametrize("name", SCENES)
def test_first_integrals_and_height(solutions, name):
    """|g| = 1, no torque about the vertical, and the height of the tip by g_3 alone instead of by the frames."""
    found = solutions[name]
    assert found.converged
    g, moment = found.y[:3], found.problem.moment(found.s, found.y)
    assert np.abs(np.sum(g**2, axis=0) - 1).max() < 1e-7
    assert np.abs(np.sum(g * moment, axis=0)).max() < 1e-5
    nodes, weights = np.polynomial.legendre.leggauss(4)
    h = np.diff(found.s)
    at = (found.s[:-1, None] + 0.5 * h[:, None] * (nodes + 1)).ravel()
    height = (0.5 * h[:, None] * weights).ravel() @ found(at)[2]
    assert found.tip() @ UP == pytest.approx(height, abs=1e-8)


def test_the_quadrature_of_the_frames_is_of_fourth_order():
    coarse = continued(problem("K = 10"), 1e-1, nodes=15)
    assert coarse.converged
    tips = np.array([coarse.tip(parts) for parts in (1, 2, 4, 8, 64)])
    errors = np.linalg.norm(tips[:-1] - tips[-1], axis=1)
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.all(np.abs(orders - 4) < 0.5)


@pytest.mark.parametrize("name", SCENES)
def test_the_ribbon_converges_to_the_strong_form_with_the_fourth_power(solutions, name):
    reference = solutions[name]
    gamma, curvature, poisson = SCENES[name]
    strip = Strip(1.0, 1e-3, poisson, curvature, gamma)  # so narrow that the bound on eta' is far away
    ribbon = solve(strip, CLAMP, Gravity(UP), energy="sadowsky", segments=20)
    s, line = reference.centreline()
    tips, lines, energies = [], [], []
    for level in range(3):
        ribbon = refine(ribbon) if level else ribbon
        assert ribbon.ok
        tips.append(np.linalg.norm(ribbon.end.position - line[-1]))
        lines.append(np.linalg.norm(ribbon.position(s) - line, axis=1).max())
        energies.append(ribbon.energy.total - reference.energy())
    orders = np.log2(np.array(tips[:-1]) / tips[1:])
    assert np.all(orders > 3.7), orders
    assert np.all(orders < 4.5), orders
    assert tips[-1] < 5e-6
    assert lines[-1] < 1e-5
    # the ribbon's space is contained in the continuous one: its energy is above, and falls with the same power
    assert np.all(np.array(energies) > 0)
    assert np.all(np.diff(np.log2(energies)) < -3.7)
    assert energies[-1] < 1e-6 * abs(reference.energy())


def test_a_free_end_without_natural_curvature_is_refused():
    with pytest.raises(ValueError, match="natural curvature"):
        StrongForm(1.0, (1.0, 0.0), 0.3, UP, CLAMP.frame)


def test_a_continuation_that_cannot_go_on_says_so():
    stuck = continued(problem("figure 4.1"), 1e-6, nodes=5, first=1.0, smallest=0.9, most=1)
    assert not stuck.converged
