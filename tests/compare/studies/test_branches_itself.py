"""Branches of a ribbon that touches itself: a fold until its sides meet, and on with what they push, against the
scene's own solve, the planar elastica and shooting (`tests.reference.touching_fold`)."""

from __future__ import annotations

import numpy as np
import pytest

from compare.models import model, solve
from compare.pages.branches.page import branch_table
from compare.scene.scene import loads
from compare.studies.branches.along import Along
from compare.studies.branches.diagram import Diagram
from compare.studies.branches.run import Asked, diagram
from compare.studies.branches.states import states
from ribbon.find.branch import itself
from ribbon.judge import nearness
from ribbon.judge.stability import judge
from ribbon.solvers.problem import KNOWN, Minimum
from ribbonbench.errors import BadInput
from tests.compare.models.test_contact_itself import FOLD
from tests.reference.touching_fold import folds, touchdown

KEY, LENGTH, THICK = "clamp.end.position[2]", 0.5, 0.02
SCENE = loads(FOLD, "fold").replace({"model.elements": 20})
#: One clamp turned about the strip: its sides meet at two points, each on one edge.
TURNED = {"clamp.end.normal": [0.3, np.sqrt(0.91), 0.0]}


def branch(scene, first, last, **asked):
    (found,) = diagram(scene, KEY, first, last, asked=Asked(branches=1, **{"errors": False, **asked})).branches
    return found


def at(scene, value):
    return scene.replace({"clamp.end.position": [0.0, 0.0, value]})


def pushes(point):
    return np.array([np.linalg.norm(pair.force) for pair in point.shape.equilibrium.pairs])


def nearest(point):
    found = point.shape.equilibrium
    return min((gap for gap, _ in nearness.minima(found.problem, found.x, 0.3)), default=np.inf)


@pytest.fixture(scope="module")
def pressed():
    """From clear of itself to pressed against itself, past a joint."""
    return branch(SCENE, 0.095, 0.06)


def test_it_goes_through_touchdown_on_with_what_it_pushes(pressed):
    """Its last point is where the scene's own path arrives: energy, push and places."""
    assert pressed.ended == "range"
    assert {point.unstable for point in pressed.points} == {0}
    last, own = pressed.points[-1], solve(at(SCENE, 0.06))
    assert own.ok
    assert last.energy == pytest.approx(own.energy.total, rel=1e-8)
    assert pushes(last).sum() == pytest.approx(sum(np.linalg.norm(p.force) for p in own.native.pairs), rel=1e-6)
    here = sorted((pair.s, pair.s_other) for pair in last.shape.equilibrium.pairs)
    assert np.unique(np.round([*here, *((p.s, p.s_other) for p in own.native.pairs)], 6), axis=0).shape == (1, 2)


def test_it_is_never_through_itself_and_never_pulls(pressed):
    touch = next(k for k, point in enumerate(pressed.points) if point.what.endswith("touch"))
    for k, point in enumerate(pressed.points):
        assert nearest(point) > -1e-9
        assert (pushes(point) > 0.0).all()
        assert point.shape.equilibrium.residual < 1e-9
        if k > touch + 1:
            assert nearest(point) < 1e-9
            assert pushes(point).size == 2  # both ends of the rulings that face each other
    assert not any(pushes(point).size for point in pressed.points[:touch])


def test_a_place_slides_over_a_joint_and_nothing_leaps(pressed):
    """Joints are at every twentieth: the places pass 0.1 and 0.9, both edges at once."""
    (over,) = [point for point in pressed.points if "slides over" in point.what]
    assert over.what.split("= ")[1] in ("0.1 l", "0.9 l")
    k = pressed.points.index(over)
    before, behind = pressed.points[k - 1], pressed.points[k + 1]
    assert over.energy == pytest.approx(behind.energy, rel=1e-12)
    assert pushes(over) == pytest.approx(pushes(behind), rel=1e-9)
    for point, side in ((before, 1.0), (pressed.points[-1], -1.0)):
        for pair in point.shape.equilibrium.pairs:
            assert side * (pair.s - 0.1) > 0.0
            assert side * (0.9 - pair.s_other) > 0.0


def test_the_places_where_it_touches_and_lets_go_are_one_and_shootings():
    """Each with its error by finer elements; shooting shares no code."""
    touch, leave = (
        branch(SCENE, a, b, errors=first, points=False)
        for first, a, b in ((True, 0.088, 0.0875), (False, 0.0875, 0.088))
    )
    one, other = ([p for p in found.points if p.kind == "event"] for found in (touch, leave))
    assert [p.what.split()[-1] for p in one] == ["touch"]
    assert {p.what[-6:] for p in other} == {"let go"}
    assert other[0].parameter == pytest.approx(one[0].parameter, abs=1e-10)
    known = LENGTH * touchdown(THICK)
    assert one[0].settles
    assert abs(one[0].settled.value - known) <= one[0].error + 1e-9
    assert one[0].error < 1e-6


def test_in_a_plane_it_is_the_elastica_and_shooting_within_its_error():
    found = branch(SCENE, 0.08005, 0.08, errors=True)
    last = found.points[-1]
    (known,) = folds(np.array([0.08 / LENGTH]), THICK)
    elastica = solve(at(SCENE, 0.08).replace({"model.energy": "elastica", "model.elements": None}))
    assert elastica.ok
    assert last.bars.settles
    for energy in (known.energy, elastica.energy.total):
        assert abs(last.energy - energy) <= 1.05 * last.bars.energy < 5e-3
    assert pushes(last).sum() == pytest.approx(known.push, rel=3e-2)


@pytest.mark.parametrize(
    ("energy", "first", "last", "places"),
    [("kirchhoff", 0.0945, 0.0925, 2), ("finite", 0.0915, 0.09, 2), ("wunderlich", 0.092, 0.0905, 1),
     ("sadowsky", 0.0915, 0.09, 1)],
)  # fmt: skip
def test_in_space_it_touches_where_and_as_solve_says(energy, first, last, places):
    """One clamp turned. Where rulings stay nearly parallel each side's edge lies on the inside of the other, two places
    nearer to each other along the strip than rulings are sampled: with one of both in force the branch stuck."""
    scene = SCENE.replace({"model.energy": energy, **TURNED})
    found = branch(scene, first, last)
    assert found.ended == "range"
    (touch,) = [point for point in found.points if point.kind == "event"]
    assert touch.what.count("s = ") == places
    end, own = found.points[-1], solve(at(scene, last))
    assert own.ok
    assert end.unstable == 0
    assert pushes(end).size == places
    assert end.energy == pytest.approx(own.energy.total, rel=1e-8)
    assert pushes(end).sum() == pytest.approx(sum(np.linalg.norm(pair.force) for pair in own.native.pairs), rel=1e-6)
    assert min(map(nearest, found.points)) > -1e-9


def test_modes_are_counted_on_what_touches():
    """Wunderlich's turned fold folds back at 0.08918, where solve finds nothing: a fork before it, two modes behind."""
    found = branch(SCENE.replace({"model.energy": "wunderlich", **TURNED}), 0.08925, 0.089, steps=10)
    (fork,) = [point for point in found.points if point.kind == "branch_point"]
    assert fork.parameter == pytest.approx(0.08921, abs=2e-5)
    for point in found.points:
        if point.kind == "regular":
            own = point.shape.equilibrium
            minimum = Minimum(own.x, own.multipliers, own.rows, own.residual, 0, 0, "", True, 0.0, KNOWN)
            assert judge(own.problem, minimum).negative == point.unstable
    assert {point.unstable for point in found.points} == {0, 1}


def test_where_parts_come_to_lie_along_each_other_it_ends(monkeypatch):
    """Its gap is made to bend no more where the place comes to s = 0.13 l."""
    monkeypatch.setattr(
        itself, "bends", lambda p, x, on: np.where(on, [pair.s - 0.13 for pair in itself.slid(p, x)], 1.0)
    )
    found = branch(SCENE, 0.0885, 0.08)
    assert found.ended == "spread"
    *_, special, last = found.points
    assert special.what == itself.SPREAD
    assert last.shape.equilibrium.pairs[0].s == pytest.approx(0.13, abs=1e-9)
    assert last.parameter == pytest.approx(special.parameter)
    assert (
        branch_table(Diagram(SCENE, Along.of(SCENE, KEY, 0.0885, 0.08), (found,), {})).records()[0]["ended"] == "spread"
    )


WALL = {"wall": [{"point": [0.0, -1.0, 0.0], "normal": [0.0, 1.0, 0.0]}]}


@pytest.mark.parametrize(
    ("changes", "moving", "word"),
    [
        (WALL, False, "beside a wall"),
        ({"contact.section": "round", "model.energy": "kirchhoff"}, False, "contact.section"),
        ({}, True, "--moving"),
    ],
)
def test_what_is_not_known_is_refused_by_name(changes, moving, word):
    scene = SCENE.replace(changes)
    with pytest.raises(BadInput) as refused:
        model("ribbon").branch_start(lambda _: scene, moving=moving)
    assert word in str(refused.value)


def test_all_states_are_refused_still():
    with pytest.raises(BadInput, match=r"contact\.itself"):
        states(SCENE)
