"""Rows of sweeps beside the same cases alone (`tests.validation.workbench.lines`): what has no number is not the same
as a number."""

from __future__ import annotations

import numpy as np

from tests.validation.workbench.lines import _apart

KEYS = ("end.x", "end.y", "end.z", "middle.x", "middle.y", "middle.z", "energy.total")


def table(**changed: float | None) -> dict:
    """Three rows of ones, the first of them changed."""
    columns = {key: [1.0, 1.0, 1.0] for key in KEYS}
    for name, value in changed.items():
        columns[name.replace("_", ".")] = [value, 1.0, 1.0]
    return {**columns, "status": ["ok", "ok", "ok"]}


def test_a_number_that_one_side_alone_lacks_is_a_difference():
    for lacking in ({"end_x": None}, {"middle_z": np.nan}, {"energy_total": None}):
        for pair in ((table(**lacking), table()), (table(), table(**lacking))):
            assert np.isinf(_apart(*pair)).tolist() == [True, False, False]


def test_what_both_lack_hides_no_other_difference():
    far = _apart(table(end_x=None, end_y=1.5), table(end_x=None))
    assert far.tolist() == [0.5, 0.0, 0.0]
    assert _apart(table(energy_total=None), table(energy_total=None)).tolist() == [0.0, 0.0, 0.0]
