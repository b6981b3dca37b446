"""Sadowsky's strips without a force lie on spheres (Starostin and van der Heijden, Phys. Rev. E 97, 023001, 2018): an
exact property of that energy that neither Wunderlich's nor a rod's has, and that the solver knows nothing of."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ribbon import Clamp, Strip, solve
from tests.validation.ribbon import forceless as page


def turned(energy, segments):
    """A strip whose far end has its frame held, turned out of the plane, and its place free: no force, but a moment."""
    frame = Rotation.from_euler("zyx", [0.7, -2.0, 0.4]).as_matrix()
    end = Clamp(None, tangent=frame[:, 0], normal=frame[:, 2], ruling="free")
    width = 0.1 if energy == "wunderlich" else 0.02
    strip = Strip(1.0, width, 0.3, thickness=1e-3) if energy == "kirchhoff" else Strip(1.0, width, 0.3)
    start = Clamp((0, 0, 0), tangent=(1, 0, 0), normal=(0, 0, 1), ruling="free")
    found = solve(strip, start, end=end, energy=energy, segments=segments, seed_curvature=3.0, seed_ruling=0.2)
    assert found.ok
    return found


def off_sphere(found):
    """Distance (l) of the centreline from the sphere that fits it best, and its radius."""
    line = found.position(np.linspace(0.0, 1.0, 101))
    terms = np.column_stack([2.0 * line, np.ones(len(line))])
    fitted = np.linalg.lstsq(terms, (line**2).sum(axis=1), rcond=None)[0]
    radius = np.sqrt(fitted[3] + fitted[:3] @ fitted[:3])
    return np.abs(np.linalg.norm(line - fitted[:3], axis=1) - radius).max(), radius


def test_a_forceless_sadowsky_strip_lies_on_a_sphere():
    (coarse, _), (fine, radius) = (off_sphere(turned("sadowsky", p)) for p in (20, 80))
    assert coarse < 1e-7
    assert fine < coarse / 100.0  # of order four: 256
    assert 0.2 < radius < 0.3
    found = turned("sadowsky", 20)
    line = found.position(np.linspace(0.0, 1.0, 101))
    assert np.linalg.svd(line - line.mean(axis=0))[1][2] > 0.1  # it is no circle, which lies on any sphere


@pytest.mark.parametrize(("energy", "least"), [("wunderlich", 1e-5), ("kirchhoff", 1e-3)])
def test_other_energies_are_off_it(energy, least):
    away, _ = off_sphere(turned(energy, 40))
    assert away > least


def test_along_a_branch_it_is_off_the_sphere_in_proportion_to_the_end_force():
    every = page.passed(20)
    least = page.at_middle(20)
    assert min(p.away for p in every) == pytest.approx(-page.HALF)
    assert max(p.away for p in every) == pytest.approx(page.HALF)
    assert abs(least.away) < 1e-9
    assert least.force < 1e-4
    assert least.off < 1e-7
    low, high = page.along_force(20)
    assert low > 1e-3
    assert high < 1.1 * low
    assert least.radius == pytest.approx(least.by_moment, abs=2e-7)
