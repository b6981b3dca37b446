"""The published data against the laws printed beside them, and the laws against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import jv

from tests.reference import lateral_torsional as published

NU = published.POISSON


def test_what_there_is():
    assert published.points("experiment").shape == (9, 2)
    assert published.points("fem_shell").shape == (51, 2)
    for name in ("extensible_1d_a5.10", "sadowsky_1d", "linear_rod_1d"):
        table = published.curve(name)
        assert len(table) > 150
        assert np.all(np.diff(table[:, 0]) >= 0)


def test_critical_weight_of_the_rod_is_a_root_of_a_bessel_function():
    """Michell 1899: with EI and GJ of a thin rectangle, q l^3 = 6 z sqrt(EI GJ), J_{-1/6}(z) = 0."""
    z = brentq(lambda x: jv(-1 / 6, x), 1.5, 2.8)
    bending, torsion = 1 - NU**2, 2 * (1 - NU)  # D w
    assert (1 - NU**2) * published.gamma_rod(NU) == pytest.approx(6 * z * np.sqrt(bending * torsion), rel=3e-5)


def test_curves_leave_the_axis_at_the_critical_lengths():
    rod, sadowsky = published.curve("linear_rod_1d"), published.curve("sadowsky_1d")
    assert rod[0, 0] == pytest.approx(published.gamma_rod(NU) ** (1 / 3), abs=5e-3)
    assert sadowsky[sadowsky[:, 1].argmin(), 0] == pytest.approx(published.gamma_sadowsky(NU) ** (1 / 3), abs=5e-3)
    ratio = published.bifurcation("sadowsky")
    critical = published.gamma_sadowsky(NU) / published.gamma_rod(NU)
    assert ratio[ratio[:, 1] < 0.02, 0] == pytest.approx(critical, abs=2e-3)


@pytest.mark.parametrize(
    ("name", "lk", "reading"),
    [("linear_rod", np.inf, 0.03), ("extensible_A_lk0.0157", published.BIFURCATION_LK, 0.1)],
)
def test_curves_begin_with_koiters_slope(name, lk, reading):
    """(d / l)^2 = 2 (gamma / gamma_c - 1) / k, the first points of the figure's curves.

    reading: 5e-4 in d / l = 0.03, where the extensible curve begins to be read, is 3 % of the square, 8 % at its foot.
    """
    table = published.bifurcation(name)
    over, squared = table[:, 0] - 1, table[:, 1] ** 2
    near = (over > 0.04) & (over < 0.2)
    slope = np.polynomial.Polynomial.fit(over[near], squared[near] / over[near], 2)(0.0)
    assert slope == pytest.approx(2 / published.koiter(lk, NU), rel=reading)


def test_units_of_the_paper():
    assert published.l_kappa_star(218.05, published.WIDTH, published.THICKNESS, NU) == pytest.approx(0.244246, abs=1e-6)
