"""A strip between two clamps with a quarter of a turn: with a free twist it has what the strip has, on any elements."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation.workbench.models_minima import minima


def test_a_twisted_strip_has_four_states_whatever_its_elements():
    """Two turns, each bowed to either side; curvature and ruling have more than a dozen (results/models_minima.md)."""
    found = [minima("finite", elements, 14) for elements in (16, 32)]
    for states, lost in found:
        assert len(states) == 4
        assert lost == 0
    coarse, fine = ([state.energy for state in states] for states, _ in found)
    assert coarse == pytest.approx(fine, rel=1e-3)
    middle = [[states[k].points[50] for k in range(4)] for states, _ in found]
    assert np.abs(np.array(middle[0]) - middle[1]).max() < 2e-3
    # either side of the line between the clamps: across and up change sign
    for one, other in ((0, 1), (2, 3)):
        assert np.all(middle[1][one][1:] * middle[1][other][1:] < 0.0)
