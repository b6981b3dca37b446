"""States of free twist are minima of their energy, not of its quadrature: against densities and rules of our own."""

from __future__ import annotations

from itertools import islice
from math import cos, sin

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Status, Strip, solve
from ribbon.find.solve import build, on_segments, solve_shape, starting_shapes
from ribbon.judge import quadrature
from tests.ribbon.energies.densities import integral
from tests.ribbon.find.free_twist_set import drawn

#: Difference of both integrals, relative to the elastic energy with its constant.
AGREE = 1e-8
#: Scenes of the random set in `make test`, and in all.
FEW, ALL = 10, 120
TURNED = Clamp((0, 0.1, 0.7), tangent=(0, 0, 1), normal=(sin(1), cos(1), 0))


def turned(energy, segments, thickness):
    """Two clamps, one turned by 1 rad (shared scene turned_clamps): keywords of `solve`."""
    strip = Strip(1, 0.1, 0.3, gamma=5, thickness=thickness)
    return {
        "strip": strip, "clamp": Clamp(), "gravity": Gravity((1, 0, 0)), "end": TURNED, "energy": energy,
        "segments": segments,
    }  # fmt: skip


def difference(found):
    """|E - E of the tests| over the elastic energy with the constant of the natural curvature."""
    first, last = found.problem.strip.curvature
    exact = integral(found)
    return abs(found.energy.elastic - exact) / (exact + (first * first + first * last + last * last) / 6.0)


def assert_of_its_energy(found):
    """What a state says of its integral is so; a state of another one is not called converged."""
    if found.status in (Status.CONVERGED, Status.SADDLE):
        exact = found.problem.energy == "kirchhoff"  # a polynomial
        assert found.quadrature_error is None if exact else found.quadrature_error <= quadrature.TOLERANCE
        assert difference(found) <= AGREE
    else:
        assert found.stable is None


@pytest.mark.parametrize(("energy", "thickness"), [("extensible", 1e-5), ("sano", 1e-5)])
def test_turned_clamps_end_in_a_minimum_of_the_energy(energy, thickness):
    """At b061e3f the elastic energies were 23.7 and 22.4; integrated densely 91.8 and 36.8."""
    found = solve(**turned(energy, 20, thickness))
    assert found.ok, found.message
    assert_of_its_energy(found)


def test_turned_clamps_of_finite_from_one_start():
    """At b061e3f the elastic energy was 24.57 on 20 elements; integrated densely 9942, nearly all of it in one."""
    problem = build(**turned("finite", 40, 1e-3))
    shapes = starting_shapes(problem, "natural", 0.0)
    equilibrium = solve_shape(problem, *next(islice(shapes, 2, None)))
    assert equilibrium.ok, equilibrium.message
    assert_of_its_energy(equilibrium)


@pytest.mark.validate
@pytest.mark.parametrize("segments", [20, 40, 80])
def test_turned_clamps_of_finite(segments):
    found = solve(**turned("finite", segments, 1e-3))
    assert found.ok, found.message
    assert_of_its_energy(found)


@pytest.mark.parametrize("energy", ["extensible", "sano"])
def test_energies_settle_with_an_order(energy):
    """Where the passage is longer than elements (h/w = 0.05): twice the elements, a quarter of the change or less."""
    found = solve(**turned(energy, 20, 5e-3))
    energies = [found.energy.total]
    for count in (40, 80):
        found = on_segments(found, np.full(count, 1.0 / count))
        assert found.ok, found.message
        energies.append(found.energy.total)
    first, second = np.abs(np.diff(energies))
    assert second < 1e-4 * energies[-1]
    assert np.log2(first / second) > 2.0


@pytest.mark.parametrize("number", range(FEW))
def test_random_strips(number):
    assert_of_its_energy(solve(**drawn(number)))


@pytest.mark.validate
@pytest.mark.parametrize("number", range(FEW, ALL))
def test_more_random_strips(number):
    assert_of_its_energy(solve(**drawn(number)))
