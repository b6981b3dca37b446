"""Derivatives of ribbons whose twist is free, against differences of solved ones."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Gravity, RibbonInputError, Strip, gradients, solve

STRIP = {
    "length": 2.0, "width": 0.1, "poisson": 0.3, "natural_curvature": (4.0, 3.0), "gamma": 60.0, "thickness": 1e-3,
}  # fmt: skip
STEPS = {"width": 1e-4, "thickness": 1e-6, "poisson": 1e-4, "gamma": 1e-2}
HALF = 2.0**-0.5


def solved(energy, **changes):
    clamp = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (-HALF, HALF, 0.0))
    strip = Strip(**{**STRIP, **changes})
    return solve(strip, clamp, Gravity((1.0, 0.0, 0.0)), energy=energy, segments=8, formulation="mixed")


@pytest.mark.parametrize("energy", ["finite", "kirchhoff"])
def test_derivatives_are_those_of_solved_neighbours(energy):
    found = gradients(solved(energy), [*STEPS, "natural_curvature"]).position(1.0)
    for name, step in STEPS.items():
        more, less = (solved(energy, **{name: STRIP[name] + sign * step}).end.position for sign in (1.0, -1.0))
        assert np.asarray(found[name]).ravel() == pytest.approx((more - less) / (2 * step), rel=2e-5, abs=1e-7)
    more, less = (solved(energy, natural_curvature=(4.0, 3.0 + s)).end.position for s in (1e-3, -1e-3))
    assert found["natural_curvature"][..., 1].ravel() == pytest.approx((more - less) / 2e-3, rel=2e-5, abs=1e-7)


def test_the_density_by_curvature_at_a_point_is_refused():
    with pytest.raises(RibbonInputError, match="natural_curvature") as error:
        gradients(solved("finite"), ["natural_curvature(s)"])
    assert error.value.key == "wrt"
