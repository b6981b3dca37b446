"""Wunderlich's equations by shooting beside the ribbon's elements, between shifted clamps (thesis 7.2)."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from ribbon.find.branch.passages import Grading
from tests.reference.wunderlich_equations import bent, ratio, ratio_slope
from tests.reference.wunderlich_shooting import Clamped, _determinant
from tests.validation.workbench.shift_shot import begun, state

SHIFT = 0.393


@pytest.mark.parametrize("b", [1e-4, 0.29, 0.31, 3.0, 40.0])
def test_one_equation_for_the_rulings(b):
    """q = H' / H^2 of H = artanh(x) / x at x = tanh(b / 2), in fifty digits; and back."""
    with mp.workdps(50):
        x = mp.tanh(mp.mpf(b) / 2)
        exact = mp.diff(lambda t: mp.atanh(t) / t, x) / (mp.atanh(x) / x) ** 2
        rise = mp.diff(lambda t: 2 * (mp.sinh(t) - t) / t**2, mp.mpf(b))
    assert ratio(b) == pytest.approx(float(exact), rel=1e-12)
    assert ratio_slope(b) == pytest.approx(float(rise), rel=1e-12)
    assert bent(ratio(b)) == pytest.approx(b, rel=1e-12)
    assert bent(-ratio(b)) == -bent(ratio(b))


def test_the_determinants_sign_and_size():
    """Of random matrices, by numpy."""
    for seed in range(8):
        matrix = np.random.default_rng(seed).normal(size=(7, 7))
        assert _determinant(splu(csc_matrix(matrix))) == pytest.approx(np.linalg.slogdet(matrix), rel=1e-10)


def test_the_tilted_strip_is_the_ribbons():
    """From the ribbon's shape alone: the equations have a state beside it, with its force at the clamp."""
    ribbon = state(shift=SHIFT, placed=Grading(0.005, 0.001, 0.05), steps=6)
    assert ribbon.stable
    problem = Clamped(1 / 20, parts=40, tolerance=1e-7)
    found = problem.newton(begun(problem, ribbon, SHIFT), "shift", SHIFT)
    assert found is not None
    assert found["height"] == pytest.approx(ribbon.middle.position[2], abs=2e-3)
    integral = problem.integral(found.v)
    assert np.ptp(integral) < 1e-4 * abs(integral).max()
    near = [found.at("shift", SHIFT + step) for step in (-1e-4, 1e-4)]
    rise = (near[1]["height"] - near[0]["height"]) / 2e-4
    assert rise == pytest.approx(found.ahead("height"), rel=1e-2)
    pull = -(ribbon.frame([0.0])[0] @ found.v[-4:-1])  # what the clamp does to the strip
    np.testing.assert_allclose(ribbon.start.force, pull, atol=0.03 * np.linalg.norm(pull))
