"""The plate that wrinkles beside finite differences, its own limit and a strip that is not twisted."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from tests.reference import helicoid_plate as plate


def test_an_untwisted_coupling_free_wave_is_a_plates_column():
    """Without the membrane (d large) a long wave buckles as Euler's column of a plate strip: T = -(1 - nu^2) eps^2 k^2,
    less eta^2 / 24 of shortening by twist: at eta -> 0, T / eta^2 -> -(1 - nu^2) d^2 k^2."""
    d, k, poisson = 1e3, 0.02, 0.3
    assert plate.tension(d, k, poisson, 10) == pytest.approx(-(1.0 - poisson**2) * d**2 * k**2, rel=1e-3)


def test_the_limit_is_approached_with_its_slope():
    c, q = plate.slope()
    for d in (1e-3, 2e-3):
        found, k, odd = plate.critical(d, 0.3, 30)
        assert (1.0 / 24.0 - found) / d == pytest.approx(c, rel=1e-4)
        assert k * k * d == pytest.approx(q, rel=1e-3)
        assert not odd


def test_the_slope_beside_finite_differences():
    """Second differences on a line cut off at +-8, (D^2 - q) inverted as a matrix."""
    c, q = plate.slope()
    count = 601
    z = np.linspace(-8.0, 8.0, count)
    h = z[1] - z[0]
    second = (np.diag(np.full(count - 1, 1.0), 1) + np.diag(np.full(count - 1, 1.0), -1) - 2.0 * np.eye(count)) / h**2
    operator = second - q * np.eye(count)
    inverse = np.linalg.inv(operator)
    matrix = operator @ operator + np.diag(0.5 * q * z**2) - 4.0 * q * second @ inverse @ inverse
    found = float(eigh(0.5 * (matrix + matrix.T), eigvals_only=True, subset_by_index=[0, 0])[0]) / q
    assert found == pytest.approx(c, rel=1e-3)
