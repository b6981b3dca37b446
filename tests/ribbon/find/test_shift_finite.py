"""`finite` between clamps shifted sideways (7.2): what its elements decide is the layer at the clamps."""

import numpy as np
import pytest

from ribbon import Clamp, Strip, solve
from ribbon.find.branch.passages import Grading, passages
from ribbon.find.continuation import switch
from ribbon.find.solve import build

HELD = {"tangent": (1, 0, 0), "normal": (0, 0, 1), "ruling": "straight"}


def arguments(shift, segments):
    return {
        "strip": Strip(1.0, 0.05, 0.3, thickness=1e-3), "clamp": Clamp((0, 0, 0), **HELD),
        "end": Clamp((0.5, shift, 0), **HELD), "energy": "finite", "segments": segments,
    }  # fmt: skip


@pytest.fixture(scope="module")
def sheared():
    """The arch at a shift of 0.3, on elements graded to its clamps."""
    lengths = Grading(0.01, 0.002, 0.1).lengths(np.zeros(0))
    found = solve(**arguments(0.01, lengths), seed_curvature=[-8.0, 8.0, -8.0], seed_ruling=[1e-3, -1e-3])
    for shift in (0.1, 0.2, 0.26, 0.3):
        found = switch(build(**arguments(shift, lengths)), found)
    return found


def test_elements_at_its_passages_change_nothing_and_at_its_clamps_they_do(sheared):
    at = passages(sheared)
    assert at.shape == (2,)

    def lowest(lengths):
        return switch(build(**arguments(0.3, lengths)), sheared).lowest_eigenvalue

    both = lowest(Grading(0.01, 0.002, 0.1).lengths(at))
    clamps = lowest(Grading(0.01, 0.0005, 0.05).lengths(np.zeros(0)))
    assert both == pytest.approx(sheared.lowest_eigenvalue, abs=3e-4)
    assert sheared.lowest_eigenvalue - clamps > 2e-3
