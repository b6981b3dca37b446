"""A strip too short to go round its tube: where the kinds of contact meet, beside closed forms and shooting."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference import short_coil
from tests.validation.ribbon import short_coil as page
from tests.validation.ribbon.short_coil import apart, change, known


@pytest.mark.parametrize("which", [pytest.param(0, marks=pytest.mark.validate), 1, 2])
def test_kinds_follow_each_other_where_they_are_known_to(which):
    assert change(which, 30) == pytest.approx(known(which), abs=2e-3)


@pytest.mark.parametrize("ratio", [2.5, 3.5, 6.2])
def test_force_place_and_energy_beside_the_elastica(ratio):
    place, force, energy = apart(ratio, 30)
    assert place < 1e-4
    assert force < 3e-3
    assert energy < 1e-5


@pytest.mark.parametrize(("ratio", "kind"), [(2.5, "two"), (3.5, "three"), (4.5, "line"), (6.2, "ends")])
def test_the_kind_is_read_from_what_pushes(ratio, kind, monkeypatch):
    """And not from where the kinds are known, or found, to begin."""
    monkeypatch.setattr(page, "change", lambda which, segments: (10.0, 10.0, 0.0)[which])
    found, _, state = page.state(ratio, 30)
    assert found == kind
    assert abs(state.start.force[1]) < 1e-6 or kind != "two"


def test_the_reference_passes_from_kind_to_kind_without_a_step():
    """Its energy has the same slope in L on both sides of where a contact begins, and the force is the same."""
    for at in (short_coil.threes(), short_coil.lines_begin()[0], short_coil.ends_meet()):
        step = 1e-4
        before, here, after = (short_coil.half(at + k * step) for k in (-1, 0, 1))
        slopes = (here.energy - before.energy) / step, (after.energy - here.energy) / step
        assert slopes[0] == pytest.approx(slopes[1], abs=5e-4)
        assert np.isclose(before.middle, after.middle, atol=5e-3)
