"""The surface of closed bands: one surface through the seam, with the energy of the ribbon on it."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip, solve
from ribbon.analysis.along import area_density
from ribbon.boundary import Closure
from ribbon.surface import behind_seam, ruling_foot

#: What is left open is the closure's own residual.
CLOSED = 1e-12
#: Frames beside a joint and at it: rounding of the feet (a cosine knows angles to about 1e-8).
SMOOTH = 1e-7


def band(kind, width):
    """A ring that sags askew under its weight, or a Moebius band; rulings oblique at the seam."""
    if kind == "circle":
        up = np.array([0.3, 0.5, 0.8]) / np.linalg.norm([0.3, 0.5, 0.8])
        strip, gravity, segments = Strip(1.0, width, poisson=0.3, gamma=60.0), Gravity(up=up), 24
    else:
        strip, gravity, segments = Strip(1.0, width, poisson=0.3), None, 40
    found = solve(strip, Clamp(ruling="free"), gravity, closure=Closure(kind), segments=segments)
    assert found.ok
    assert abs(found.eta([0.0])[0]) > 1e-3
    return found


@pytest.fixture(
    scope="module", params=[(kind, width) for kind in ("circle", "moebius") for width in (0.01, 0.05, 0.2)], ids=str
)
def closed(request):
    return band(*request.param), 1 if request.param[0] == "circle" else -1, request.param[1]


def test_no_gap_and_no_kink_at_the_seam(closed):
    found, seam, width = closed
    grid = found.surface(200, 6).grid
    assert np.linalg.norm(grid[-1, ::seam] - grid[0], axis=1).max() < CLOSED
    v = np.linspace(-0.5, 0.5, 7) * width
    feet, places, frames = [], [], []
    for s in (1.0, 0.0):
        foot, place, frame = found.rulings(np.column_stack([np.full(7, s), v]))
        feet.append(foot)
        places.append(place)
        frames.append(frame)
    assert np.abs(places[0] - grid[-1]).max() < CLOSED
    assert np.abs(feet[0][::seam] - feet[1] - 1.0).max() < CLOSED  # one ruling, on both sides
    turn = np.diag([seam, seam, 1.0])
    assert np.abs(frames[0][::seam] @ turn - frames[1]).max() < SMOOTH
    assert (feet[0] > 1.0).any()
    assert (feet[1] < 0.0).any()


def test_the_strip_goes_on_behind_the_seam(closed):
    found, seam, _ = closed
    inside = np.array([0.0, 0.013, 0.4, 0.97])
    for turns in (-1.0, 1.0, 2.0):
        sign = seam if turns % 2 else 1
        assert np.abs(found.position(inside[1:] + turns) - found.position(inside[1:])).max() < 1e-12
        assert np.abs(found.omega(inside[1:] + turns) - sign * found.omega(inside[1:])).max() < 1e-9
        assert np.abs(found.eta(inside[1:] + turns) - sign * found.eta(inside[1:])).max() < 1e-9
    step = 1e-7  # no jump of position, frame, omega and eta
    for values, most in ((found.position, 3 * step), (found.frame, 1e-5), (found.omega, 1e-4), (found.eta, 1e-4)):
        below, above = values([1.0 - step, -step]), values([1.0 + step, step])
        assert np.abs(below - above).max() < most


def test_the_whole_band_carries_the_whole_energy(closed):
    """The rulings of a closed band cover all of it: the density over the surface has the ribbon's elastic energy."""
    found, _, width = closed
    nodes, weights = np.polynomial.legendre.leggauss(8)
    cells = np.linspace(0.0, 1.0, 2001)
    s = ((cells[:-1, None] + cells[1:, None]) + np.diff(cells)[:, None] * nodes).ravel() / 2.0
    along = (np.diff(cells)[:, None] * weights / 2.0).ravel()
    total = 0.0
    for x, weight in zip(*np.polynomial.legendre.leggauss(12), strict=True):
        v = np.full(s.size, 0.5 * width * x)
        foot = found.rulings(np.column_stack([s, v]))[0]
        total += 0.5 * weight * float(along @ area_density(found, foot, v))
    assert total == pytest.approx(found.energy.elastic, rel=2e-4)


def test_an_open_strip_has_no_seam():
    s = np.array([-0.2, 0.3, 1.4])
    assert np.array_equal(behind_seam(s, 0)[0], s)
    assert behind_seam(s, -1)[0] == pytest.approx([0.8, 0.3, 0.4])
    assert behind_seam(s, -1)[1].tolist() == [-1.0, 1.0, -1.0]
    q, lengths = np.array([[0.0, 1.0, 0.2, 0.5]]), np.array([1.0])
    assert ruling_foot(q, lengths, np.array([[1.0, -0.1]])) == pytest.approx([1.07])  # eta held beyond the end


def test_curvatures_need_no_series(closed):
    """What is told of curvature and ruling alone is what stands beside the centreline, behind the seam too."""
    found, _, _ = closed
    s = np.concatenate([np.linspace(-0.4, 1.6, 41), np.cumsum(found.problem.lengths)])
    _, _, omega, eta = found.continued(s)
    told = [(found.omega(s), omega), (found.eta(s), eta), (found.tau(s), eta * omega)]
    assert max(float(np.abs(one - other).max()) for one, other in told) < CLOSED
