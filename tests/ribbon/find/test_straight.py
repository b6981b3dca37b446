"""Strips that are exactly straight: the second variation there is that beside it."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip, solve

HANGING = Clamp((0.0, 0.0, 0.0), tangent=(0.0, -1.0, 0.0), normal=(0.0, 0.0, 1.0))
STRIP = Strip(1.0, 1 / 30, 0.3, gamma=77.0, thickness=1 / 3000)


@pytest.mark.parametrize("formulation", ["chained", "mixed"])
@pytest.mark.parametrize("energy", ["finite", "extensible", "kirchhoff", "wunderlich"])
def test_a_strip_that_hangs_straight_down_is_stable(energy, formulation):
    """`finite` called it a saddle (-3.0 on 24 elements, -1.2 on 48): a series that had ended before its second
    derivatives began."""
    found = solve(STRIP, HANGING, Gravity((0.0, 1.0, 0.0)), energy=energy, segments=12, formulation=formulation)
    assert found.ok
    assert found.stable
    assert found.lowest_eigenvalue > -1e-9


@pytest.mark.parametrize("energy", ["finite", "extensible", "kirchhoff", "sano"])
def test_the_hessian_of_a_straight_strip_is_the_slope_of_its_gradient(energy):
    found = solve(STRIP, HANGING, Gravity((0.0, 1.0, 0.0)), energy=energy, segments=6, formulation="chained")
    problem, x, step = found.problem, np.zeros_like(found.x), 1e-5
    free = np.flatnonzero(problem.bounds()[0] < problem.bounds()[1])
    hessian = np.asarray(problem.hessian(x))[np.ix_(free, free)]
    for i, column in zip(free, hessian.T, strict=True):
        aside = np.zeros_like(x)
        aside[i] = step
        slope = (problem.gradient(aside) - problem.gradient(-aside))[free] / (2.0 * step)
        assert np.abs(column - slope).max() < 1e-7 * max(1.0, np.abs(hessian).max())
