"""Energy of strips with free twist by parts: means over the width, sums, what each energy has."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip, solve
from ribbon.analysis.along import area_density, line_density
from ribbon.analysis.parts import area_densities, line_density_of, line_parts, parts
from ribbon.energies.names import FREE
from tests.energy_integrals import over_s

R = 2**-0.5
NATURAL = (10.0, 6.0)


@pytest.fixture(scope="module")
def solved():
    """A strip of w/h = 20 under its weight, clamped at 45 degrees, by energy; solved once."""
    found = {}

    def one(energy, **options):
        key = energy, *options
        if key not in found:
            strip = Strip(1.0, 0.03, 0.4, NATURAL, 100.0, thickness=1.5e-3)
            clamp = Clamp((0, 0, 0), tangent=(0, 0, 1), normal=(-R, R, 0))
            found[key] = solve(strip, clamp, Gravity((1, 0, 0)), energy=energy, segments=10, **options)
            assert found[key].ok
        return found[key]

    return one


@pytest.mark.parametrize("energy", FREE)
def test_the_mean_over_the_width_is_the_energy_per_length(solved, energy):
    e = solved(energy)
    s = np.linspace(0.003, 0.997, 23)
    constant = 0.5 * (NATURAL[0] + (NATURAL[1] - NATURAL[0]) * s) ** 2
    assert line_parts(e, s).sum(axis=1) - constant == pytest.approx(line_density(e, s), rel=2e-6, abs=2e-6)
    v = 0.015 * np.array([-1.0, -0.3, 0.8])
    density = area_densities(e, s, v)
    assert density.min() > -1e-9 * density.max()
    at = area_density(e, np.repeat(s, 3), np.tile(v, s.size)).reshape(s.size, 3)
    assert at == pytest.approx(density.sum(axis=2) - constant[:, None], abs=1e-9)


@pytest.mark.parametrize("energy", FREE)
def test_parts_add_up_to_the_elastic_energy(solved, energy):
    e = solved(energy)
    found = parts(e)
    assert sum(found.values()) == pytest.approx(e.energy.elastic, rel=1e-12)
    assert over_s(e) == pytest.approx(e.energy.elastic, rel=1e-4)
    with_constant = e.energy.elastic + (NATURAL[0] ** 2 + NATURAL[0] * NATURAL[1] + NATURAL[1] ** 2) / 6.0
    membrane, shear = found["membrane"] / with_constant, found["shear"] / with_constant
    if energy in ("extensible", "finite"):
        assert 1e-3 < membrane < 0.1
        assert 1e-3 < shear < 0.05
    if energy == "sadowsky_kt":
        assert membrane == shear == 0.0


def test_another_energy_in_the_same_state(solved):
    e, s = solved("finite"), np.linspace(0.0, 1.0, 9)
    assert line_density_of("finite", e, s, 1.5e-3) == pytest.approx(line_density(e, s), rel=1e-13)
    less = line_density_of("extensible", e, s, 1.5e-3)
    assert np.all(less <= line_density(e, s) + 1e-12)
    assert np.all(less[:2] < line_density(e, s)[:2] - 0.05)  # restrained warping near the clamp


def test_bending_in_the_plane_is_energy_of_the_membrane(solved):
    e = solved("finite", in_plane=True)
    s = np.linspace(0.0, 1.0, 9)
    constant = 0.5 * (NATURAL[0] + (NATURAL[1] - NATURAL[0]) * s) ** 2
    own = 0.5 * (1.0 - 0.4**2) * 20.0**2 * e.in_plane(s) ** 2
    assert own.max() > 1e-6
    assert line_parts(e, s).sum(axis=1) - constant == pytest.approx(line_density(e, s), rel=2e-6, abs=2e-6)
