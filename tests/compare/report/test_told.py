"""Numbers as a reader is told them: SI by hand, one prefix for all parts, nothing in SI where nothing is known."""

import re

import numpy as np
import pytest

from compare.page import wording
from compare.scene.units import Units

UNITS = Units(length=0.3, width=0.01, stiffness=1.9e-4)
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")


def numbers(text):
    return [float(found) for found in NUMBER.findall(text.partition("(")[0])]


@pytest.mark.parametrize(
    ("tell", "factor", "unit", "base"),
    [
        (wording.force, 1.9e-4 / 0.09, "mN", 1e3),
        (wording.moment, 1.9e-4 / 0.3, "N mm", 1e3),
        (wording.place, 0.3, "mm", 1e3),
    ],
)
def test_components_in_si(tell, factor, unit, base):
    values = np.array([1.5, -2.25, 1e-14])
    text = tell(values, UNITS)
    assert numbers(text) == pytest.approx([1.5 * factor * base, -2.25 * factor * base, 0.0], rel=1e-3)
    assert f" {unit} (" in text
    assert numbers(tell(values, Units()))[:3] == [1.5, -2.25, 0.0]


def test_energies_have_one_prefix():
    parts = {"elastic": 4.0, "gravity": -0.01, "tip": None, "plates": 1e-16}
    assert numbers(wording.energies(parts, UNITS)) == pytest.approx(
        [4.0 * 1.9e-4 / 0.3 * 1e3, -0.01 * 1.9e-4 / 0.3 * 1e3, 0.0], rel=1e-3
    )
    assert numbers(wording.energies(parts, Units()))[:2] == [4.0, -0.01]


@pytest.mark.parametrize("size", [1e-9, 1e-5, 0.03, 7.0, 1e4])
def test_no_size_is_told_in_a_wrong_prefix(size):
    scale = {"N": 1.0, "mN": 1e-3, "µN": 1e-6, "nN": 1e-9}
    text = wording.force(np.array([size, 0.0, 0.0]), UNITS)
    unit = text.partition(" (")[0].split()[-1]
    assert numbers(text)[0] * scale[unit] == pytest.approx(size * UNITS.force, rel=1e-3)


def test_an_error_has_the_prefix_of_what_it_stands_beside():
    error = wording.within(2e-7, "moment", UNITS, beside=13.0)
    assert error.endswith(" N mm")
    assert numbers(error) == pytest.approx([2e-7 * 1.9e-4 / 0.3 * 1e3], rel=0.05)
    assert not wording.within(2e-7, "moment", UNITS).endswith(" N mm")


def test_of_a_length_that_rounding_leaves_only_the_bound_is_told():
    assert wording.length(UNITS, 3e-15) == wording.length(UNITS, -4e-11) == wording.length(Units(), 1e-12)
    assert numbers(wording.length(UNITS, 3e-15)) == [1e-7]
    assert numbers(wording.length(UNITS, 2e-9)) == pytest.approx([0.3 * 2e-9 * 1e9], rel=1e-2)
