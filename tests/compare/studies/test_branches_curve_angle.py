"""Branches of the curve-angle rod: critical weights in closed form, a fork by shooting, its tangent by differences."""

import numpy as np
import pytest

from compare.battery.cases.branches.forks import greenhill
from compare.battery.cases.branches.scenes import CLAMPS, MAST, SHIFT
from compare.battery.judge.turning import turning
from compare.models.base import Options
from compare.models.branches.curve_angle import branch_start
from compare.registry import model
from compare.scene.scene import loads
from compare.studies.branches.run import Asked, diagram
from ribbonbench.errors import BadInput

ROD = {"model.energy": "curve_angle", "rod.torsion": 0.8}


def test_a_mast_falls_over_its_soft_and_its_stiff_side_where_greenhill_says():
    scene = loads(MAST, "mast").replace({**ROD, "rod.bending": [1.0, 1.3], "model.elements": 16})
    found = diagram(scene, "strip.gamma", 5.0, 11.0, asked=Asked(branches=1))
    (own,) = found.branches
    soft, stiff = [p for p in own.points if p.kind == "branch_point"]
    for place, weight in ((soft, greenhill()), (stiff, 1.3 * greenhill())):
        assert place.settled.settles
        assert abs(place.settled.value - weight) < place.settled.error < 2e-3
        assert place.settled.value == pytest.approx(weight, rel=1e-6)
    assert [own.points[0].unstable, own.points[-1].unstable] == [0, 2]


def test_an_arch_turns_over_where_shooting_says_and_its_energy_is_the_states():
    scene = loads(CLAMPS, "arch").replace({**ROD, "rod.bending": [1.0, 1e3], "model.elements": 24})
    found = diagram(scene, SHIFT, 0.3, 0.5, asked=Asked(branches=1))
    (own,) = found.branches
    (place,) = [p for p in own.points if p.kind == "branch_point"]
    assert abs(place.settled.value - turning(0.2)) < place.settled.error < 1e-3
    start = next(iter(found.starts.values()))
    assert own.points[0].energy == pytest.approx(start.energy.total, rel=1e-9)


def started(keys):
    scene = loads(CLAMPS, "arch").replace({**ROD, "rod.bending": [1.0, 40.0], "model.elements": 10, **keys})
    at = lambda t: scene.replace({"clamp.end.position": [0.8, 0.05 * t, 0.1 + 0.2 * t]})  # noqa: E731
    return branch_start(at, model("curve_angle").solve(at(0.0), options=Options(error=False)))


def test_its_tangent_is_the_derivative_of_its_residual():
    start = started({})
    system = start.system
    rng = np.random.default_rng(3)
    z = start.z + 0.01 * rng.normal(size=system.size)
    v = rng.normal(size=system.size)
    at = [system.residual(z + k * 2e-5 * v, 0.3) for k in (-2, -1, 1, 2)]
    slope = (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / 2.4e-4
    back = system.factor(z, 0.3).solve(slope)
    assert np.abs(back - v).max() < 2e-5 * np.abs(v).max()
    other, moved, _ = system.moved(z, 0.3, np.zeros((z.size, 0)))
    assert other is system
    assert moved is z


def test_frames_told_anew_leave_the_balance_as_it_is():
    start = started({})
    system = start.system
    own = system.own
    y, _ = own.whole(start.z, 0.0)
    anew = own.__class__(own.rod_at, own.lengths, own.problem(0.0).anchored(y).anchors, own.free)
    assert anew.norm(anew.residual(start.z, 0.0)) < 1e-9
    assert anew.factor(start.z, 0.0).unstable == own.factor(start.z, 0.0).unstable


def test_a_dead_moment_and_moving_elements_are_refused():
    cantilever = loads(MAST, "m").replace({**ROD, "rod.bending": [1.0, 2.0], "model.elements": 6})
    turned = cantilever.replace({"tip.moment": [0.0, 0.1, 0.0]})
    with pytest.raises(BadInput, match=r"tip\.moment"):
        diagram(turned, "strip.gamma", 1.0, 2.0)
    with pytest.raises(BadInput, match="--moving"):
        diagram(cantilever, "strip.gamma", 1.0, 2.0, asked=Asked(moving=True))
