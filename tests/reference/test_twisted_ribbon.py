"""The twisted ribbon under tension: the paper's f, and the ribbon between clamps that becomes it."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference import twisted_ribbon


@pytest.mark.parametrize("tension", [3.0, 10.0, 100.0, 400.0])
def test_between_far_clamps_it_is_the_infinitely_long_one(tension):
    """From above, with an error that falls with the square of the length."""
    limit = twisted_ribbon.critical(tension, 0.4)
    excess = [twisted_ribbon.between_clamps(tension, 0.4, turns / limit) / limit - 1.0 for turns in (40.0, 80.0)]
    assert 0.0 < excess[1] < excess[0] < 3e-3
    assert np.log2(excess[0] / excess[1]) == pytest.approx(2.0, abs=0.3)


def test_with_a_short_wave_f_is_the_least_over_all_waves():
    tension, tau = 5.0, 3.0
    bending, torsion = twisted_ribbon.stiffnesses(tau, 0.4)
    q, m = bending * tau**2 / tension, torsion * tau**2 / tension
    x = np.linspace(0.0, 4.0, 40001)
    least = (q * (x - 1.0) ** 2 + m * (x - 1.0) + 1.0 + x).min()
    assert twisted_ribbon.margin(tension, tau, 0.4) == pytest.approx(least, abs=1e-8)


def test_a_rod_s_wave_has_the_wavenumber_of_its_torque():
    """Without torsion's growth and at small twist the buckling of a twisted rod held to one plane of bending."""
    assert twisted_ribbon.critical(1e-4, 0.4) / np.sqrt(1e-4) == pytest.approx(
        twisted_ribbon.critical(1e-6, 0.4) / np.sqrt(1e-6), rel=1e-4
    )
