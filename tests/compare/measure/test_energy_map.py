"""Maps of a shell's energy: where hardly any is stored, shares tell of next to nothing."""

from __future__ import annotations

import numpy as np
import pytest

from compare.measure.energy_map import HARDLY, hardly_stored, shares


def test_hardly_stored_is_told_by_the_mean_of_what_is_known():
    density = np.ones((10, 4, 3))
    density[0] = 0.5 * HARDLY  # by cell 1.5 HARDLY of a mean of about 3 * 0.9
    density[1, 0] = np.nan
    found = hardly_stored(density)
    assert found[0].all()
    assert found[1, 0]
    assert found.sum() == 5
    density[0] = 2.0 * HARDLY
    assert hardly_stored(density).sum() == 1
    assert shares(density)[0, 0] == pytest.approx([1 / 3] * 3, rel=1e-3)


def test_nothing_is_stored_where_nothing_is_known():
    assert hardly_stored(np.full((2, 2, 3), np.nan)).all()
    assert hardly_stored(np.zeros((2, 2, 3))).all()
