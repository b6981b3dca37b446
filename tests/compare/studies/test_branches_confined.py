"""Roman's strip under a falling roof by `branches`: from a roof that touches nothing yet, its events."""

from __future__ import annotations

import numpy as np
import pytest

from compare.continuation.correct import first_point
from compare.models.branches.confined import ConfinedShape, branch_start, setting_of
from compare.registry import model
from compare.scene.scene import load
from compare.studies.branches.diagram import Branch, BranchPoint
from compare.studies.branches.run import branch
from tests.docs_blocks import ROOT
from tests.validation.ribbon.roman import line_contact

HIGH, LOW = 0.2, 0.15
SCENE = ROOT / "compare" / "scenes" / "roman_6_2.toml"


def test_a_roof_that_falls_touches_and_flattens_the_fold():
    own = load(SCENE).replace({"model.elements": 60, "wall.roof.point": [0.0, HIGH, 0.0]})
    points = list(branch(own, along="wall.roof.point[1]", start=HIGH, stop=LOW, errors=False))
    events = [point for point in points if point.kind == "event"]
    touches, spreads = sorted(events, key=lambda point: -point.parameter)
    assert touches.what.startswith("touches the roof")
    assert spreads.what.endswith("spread into flat parts")
    low = [line_contact(spreads.parameter + side, 0.1, 10.0).low for side in (3e-6, -3e-6)]
    assert low[0] > 0.0 > low[1]
    assert {point.unstable for point in points} == {0}
    assert {point.aside for point in points if point.kind == "regular"} == {0}
    last = min(points, key=lambda point: point.parameter)
    assert last.parameter == pytest.approx(LOW, abs=1e-9)
    shape = last.shape
    assert isinstance(shape, ConfinedShape)
    line = shape.centreline(np.linspace(0.0, 1.0, 401))
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    assert steps == pytest.approx(np.full(400, 1.0 / 400.0), rel=1e-3)
    assert line[-1] == pytest.approx([0.0, 0.0, 0.9], abs=1e-8)
    assert line[:, 1].max() == pytest.approx(LOW, abs=1e-6)
    assert line[:, 1].min() > -1e-9
    frames = shape.frames(np.array([0.5]))[0]
    assert frames == pytest.approx(np.eye(3), abs=1e-6)


def test_modes_aside_are_asked_on_an_even_number_of_elements_whatever_the_scene_has():
    """150 elements are ten of an arc, and were five of a piece, which has no halves."""
    own = load(SCENE).replace({"model.elements": 150})
    start = branch_start(lambda t: own, model("ribbon").solve(own))
    point = first_point(start.system, start.z, 0.0, 1e-10)
    assert point.system.chain.elements == 10
    assert start.aside(point).size == 12
    assert start.aside(point)[0] > 0.0


@pytest.mark.parametrize("change", [
    {"model.energy": "finite", "strip.thickness": 1e-3},
    {"strip.natural_curvature": 1.0},
    {"wall.floor.point": [0.0, -0.01, 0.0]},
    {"wall.roof.stiffness": 100.0},
    {"gravity.up": [0.0, -1.0, 0.0]},
])  # fmt: skip
def test_what_is_no_such_strip_is_followed_as_before(change):
    own = load(SCENE)
    assert setting_of(own).height == pytest.approx(0.185)
    assert setting_of(own.replace(change)) is None


def _branch(*points):
    """A branch of points (kind, unstable modes) or (kind, unstable modes, eigenvalues that are zero there)."""
    place, line = np.zeros(3), np.zeros((2, 3))
    made = [
        BranchPoint(float(k), kind, unstable, 0.0, float(k), place, place, 0.0, float(k), line, critical=(0.0,) * zero)
        for k, (kind, unstable, zero) in enumerate((*one, 1)[:3] for one in points)
    ]
    return Branch("sadowsky", 0, tuple(made), "range")


@pytest.mark.parametrize(("points", "place"), [
    ([("regular", 0), ("event", 0), ("regular", 0), ("event", 1), ("regular", 1), ("branch_point", 1)], 3.0),
    ([("regular", 0), ("branch_point", 0), ("branch_point", 1), ("regular", 2)], 1.0),
    ([("regular", 2), ("branch_point", 0, 2), ("regular", 0)], 1.0),
    ([("regular", 1), ("branch_point", 1), ("fold", 1), ("fold", 0), ("regular", 0)], 3.0),
    ([("regular", 1), ("branch_point", 1), ("regular", 2)], None),
    ([("regular", 0), ("event", 0), ("regular", 0)], None),
    ([("regular", 0), ("ruling", 0), ("regular", 1)], 1.0),
    ([("regular", 0), ("branch_point", 0), ("regular", 0), ("branch_point", 0), ("regular", 1)], 3.0),
    ([("regular", 1), ("branch_point", 1), ("regular", 1), ("branch_point", 0), ("regular", 0)], 3.0),
    ([("regular", 0), ("branch_point", 0), ("regular", 0)], None),
    ([("regular", 0), ("branch_point", 0)], 1.0),
])  # fmt: skip
def test_where_stability_is_lost_or_gained_events_count(points, place):
    """Behind a flat part that buckles a roof's strip was said to lose its stability at the next branch point; the side
    of a pitchfork, where it only touches the fork that it leaves."""
    found = _branch(*points).turning
    assert (None if found is None else found.parameter) == place
