"""The curl of growing length (thesis, 4.4): planar and stable below 29 cm, unstable in the plane above."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Status, solve
from tests.validation.ribbon.curl_length import NATURAL, OBLIQUE, SHORT, STEP, WIDTH, Curl, excursion


def test_the_dimensionless_groups():
    """Gamma = rho g h l^3 / D, D = Y h^3 / (12 (1 - nu^2)) = 2e-4 N m."""
    strip = Curl().strip(0.4)
    assert strip.gamma == pytest.approx(1000.0 * 1e-4 * 9.81 * 0.4**3 / 2e-4, rel=1e-12)
    assert strip.curvature == pytest.approx((24.0, 24.0))
    assert strip.relative_width == pytest.approx(WIDTH / 0.4)


@pytest.mark.parametrize("energy", ["sadowsky", "wunderlich"])
@pytest.mark.parametrize("ruling", ["free", "straight"])
def test_planar_and_stable_below_unstable_above(energy, ruling):
    curl = Curl(energy=energy, ruling=ruling)
    below = curl.planar(0.285, (SHORT, curl.solved(SHORT).x))
    assert below.ok
    assert below.lowest_eigenvalue > 0.1
    above = curl.planar(0.297, (0.285, below.x))
    assert above.status is Status.SADDLE
    assert above.lowest_eigenvalue < -1.0
    assert excursion(above) == 0.0


@pytest.mark.parametrize(("energy", "expected"), [("sadowsky", 0.28757), ("wunderlich", 0.29037)])
def test_the_critical_length_is_the_thesis_s_29_cm(energy, expected):
    length, held = Curl(energy=energy).critical()
    assert length == pytest.approx(expected, abs=3e-5)
    assert abs(length - 0.29) < 0.5 * STEP
    # before any point is unbent below nu K, where the energy itself loses convexity in eta
    assert held.omega(np.linspace(0.0, 1.0, 201)).min() > 0.5 * NATURAL * length


@pytest.mark.parametrize(
    ("clamp", "expected"),
    [("horizontal, curls up first", 0.3143), ("points down", 0.2786), ("points up", 0.3038)],
)
def test_other_clamps_give_other_lengths(clamp, expected):
    assert Curl(clamp).critical()[0] == pytest.approx(expected, abs=1e-4)


def test_out_of_the_plane_the_energy_is_lower_and_mirror_images_are_alike():
    curl = Curl()
    planar = curl.planar(0.32, (SHORT, curl.solved(SHORT).x))
    one, other = curl.solved(0.32, OBLIQUE), curl.solved(0.32, -OBLIQUE)
    assert one.ok
    assert other.ok
    assert one.energy.total < planar.energy.total - 0.1
    assert other.energy.total == pytest.approx(one.energy.total, rel=1e-10)
    np.testing.assert_allclose(other.end.position, one.end.position * [-1.0, 1.0, 1.0], atol=1e-7)
    assert excursion(one) > 0.05


def test_the_pitchfork_opens_as_a_square_root():
    curl = Curl()
    critical, _ = curl.critical()
    near, far = (excursion(curl.solved(critical + d, OBLIQUE)) * (critical + d) for d in (2e-4, 8e-4))
    assert near > 1e-3
    assert far / near == pytest.approx(2.0, rel=0.02)


def test_a_short_curl_returns_to_the_plane_from_an_oblique_seed():
    found = solve(
        Curl().strip(0.25),
        Clamp(ruling="free"),
        Gravity((0.0, 1.0, 0.0)),
        segments=20,
        seed_curvature=0.0,
        seed_ruling=0.2,
    )
    assert found.ok
    assert excursion(found) < 1e-7
