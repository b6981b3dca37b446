"""Two ways to a Sadowsky strip that carries no force agree, and both lie on the sphere that the theorem says."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference.spherical_strip import by_moment, by_ruling


@pytest.mark.parametrize(("curvature", "ruling", "across"), [(3.0, 0.5, 1.0), (5.0, -0.6, 2.0)])
def test_both_ways_agree_on_the_sphere(curvature, ruling, across):
    s = np.linspace(0.0, 1.0, 9)
    places, frames, (kappa, eta) = by_moment(curvature, ruling, across, s)
    np.testing.assert_allclose(by_ruling(curvature, ruling, across, 0.5), places[4], atol=1e-11)
    c = curvature * (1.0 + ruling**2)
    np.testing.assert_allclose(kappa * (1.0 + eta**2), c, rtol=1e-9)
    moment = np.array([curvature * (1.0 - ruling**4), across, 2.0 * curvature * ruling * (1.0 + ruling**2)])
    size = np.linalg.norm(moment) / c**2
    # Four points fix a sphere; the others lie on it.
    ahead = places[[2, 5, 8]] - places[0]
    centre = places[0] + np.linalg.solve(2.0 * ahead, np.sum(ahead**2, axis=1))
    np.testing.assert_allclose(np.linalg.norm(places - centre, axis=1), size, rtol=1e-8)
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1), np.broadcast_to(np.eye(3), frames.shape), atol=1e-10)
