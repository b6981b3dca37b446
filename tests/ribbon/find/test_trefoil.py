"""A closed trefoil of a round rod: its strands lie along each other all the way round, on one line without ends."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon.find.jointed.touching import Line, Touching
from tests.reference.knot_type import determinant
from tests.reference.trefoil_limit import thin
from tests.validation.ribbon.ply import complementarity, depth
from tests.validation.ribbon.trefoil import begun, tension, trefoil


def test_a_closed_line_holds_its_seam_once():
    facing = (0.5, 0.63, 0.75, 0.87, 1.0)
    pairs = Touching((), (Line(0.0, 0.5, facing, True),)).pairs()
    assert [pair.s_other for pair in pairs] == list(facing[:-1])
    assert len(Touching((), (Line(0.0, 0.5, facing),)).pairs()) == 5


def test_a_thin_trefoil_is_a_circle_covered_twice_and_its_first_correction():
    """The excess over 8 pi^2 B / l of two diameters is the correction of second order by the other code, and what is
    left falls with the fourth power; it touches all along, and is tied."""
    known, left = thin(), []
    for diameter in (0.02, 0.01):
        _, here = begun(diameter)
        state = here.state
        assert state.ok
        assert state.lowest_eigenvalue > 0.0
        assert here.pushes.min() > 0.0
        assert depth(state) < 1e-6
        assert complementarity(state) < 1e-8
        assert determinant(state.position(np.arange(240) / 240)) == 3
        left.append(state.energy.total - known.energy(diameter))
    assert 0.0 < left[1] < 2e-3 * known.excess * 0.01**2 * 2.0
    assert left[0] / left[1] == pytest.approx(16.0, rel=0.2)


def test_the_tension_is_how_the_energy_changes_with_the_diameter():
    """From the force where its ends are held, beside the energy's change with ln h by the thin limit and the fourth
    power left over; it falls with the square of a segment."""
    known, diameter = thin(), 0.02
    off = []
    for segments in (48, 96):
        here = trefoil(diameter, segments)
        left = here.state.energy.total - known.energy(diameter)
        off.append(tension(here) / (2.0 * known.excess * diameter**2 + 4.0 * left) - 1.0)
    assert 0.0 < off[1] < 0.02
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.2)


def test_the_limit_touches_all_along():
    known = thin()
    assert 0.0 < known.least < known.most
    assert known.excess < known.even
