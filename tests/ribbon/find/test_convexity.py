"""Where an energy of free twist is not convex elements alone hold the state: against densities of our own."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip, solve
from ribbon.find.solve import build
from ribbon.judge import convexity
from tests.ribbon.energies.densities import density
from tests.ribbon.find.test_quadrature import turned

W, NU = 0.1, 0.3
STEP = 1e-4


def least(energy, thickness, k, t):
    """Lowest eigenvalue of the Hessian of a density without gradients in (k, t), by central differences."""
    scale = sqrt(60.0 / (1.0 - NU**2)) * thickness / W**2  # of k

    def e(i, j):
        return density(energy, (W, thickness, NU), k + i * STEP * scale, t + j * STEP, 0.0, 0.0, 0.0)

    kk = (e(1, 0) - 2.0 * e(0, 0) + e(-1, 0)) / (STEP * scale) ** 2
    tt = (e(0, 1) - 2.0 * e(0, 0) + e(0, -1)) / STEP**2
    kt = (e(1, 1) - e(1, -1) - e(-1, 1) + e(-1, -1)) / (4.0 * STEP**2 * scale)
    return float(np.linalg.eigvalsh([[kk, kt], [kt, tt]])[0])


@pytest.mark.parametrize("energy", ["sano", "extensible"])
def test_the_share_of_a_passage(energy):
    """One state, curvature from -2 to 4 and twist from 1 to 2 along the strip: where own differences say so."""
    thickness = 1e-3
    problem = build(
        Strip(1, W, NU, gamma=5, thickness=thickness), Clamp(), Gravity((1, 0, 0)), energy=energy, segments=7
    )
    joints = np.linspace(0.0, 1.0, 8)
    x = problem.state(-2.0 + 6.0 * joints, 1.0 + joints)
    s = (np.arange(6000) + 0.5) / 6000
    bad = [least(energy, thickness, -2.0 + 6.0 * at, 1.0 + at) < 0.0 for at in s]
    assert 0.01 < np.mean(bad) < 0.5
    assert convexity.share(problem, x) == pytest.approx(np.mean(bad), rel=0.05)


@pytest.mark.parametrize("factor", [0.98, 1.02])
def test_no_curvature_is_convex_up_to_the_twist_of_the_theory(factor):
    """At k = 0, K = 0 of `sano`: zeta |tau| = sqrt(1 + nu) (docs/theory.md, "Passages")."""
    thickness = 1e-4
    zeta = sqrt((1.0 - NU**2) / 60.0) * W**2 / thickness
    assert (least("sano", thickness, 0.0, factor * sqrt(1.0 + NU) / zeta) < 0.0) == (factor > 1.0)


@pytest.mark.parametrize(("energy", "thickness", "bites"), [("extensible", 1e-5, True), ("extensible", 1e-2, False)])
def test_turned_clamps(energy, thickness, bites):
    """One of two clamps turned by 1 rad: h / w = 1e-4 is stable on its elements, and not convex; 0.1 is."""
    found = solve(**turned(energy, 20, thickness))
    assert found.ok
    assert (found.nonconvex > 0.0) is bites


@pytest.mark.parametrize("energy", ["kirchhoff", "wunderlich"])
def test_what_is_convex_everywhere_has_no_share(energy):
    assert solve(Strip(1, W, NU, gamma=5, thickness=1e-3), Clamp(), Gravity((1, 0, 0)), energy=energy).nonconvex is None
