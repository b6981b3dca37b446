"""The curve-angle rod as a model: numbers of the thesis's 4.4, its own error, refusals, every command's view of it."""

from __future__ import annotations

import numpy as np
import pytest

from compare.models import solve
from compare.models.base import Options
from compare.scene.scene import load
from ribbonbench.errors import BadInput

CURVE_ANGLE = {"model.energy": "curve_angle"}
#: sqrt(y^2 + z^2) of the free end at Gamma, a prototype with solve_bvp.
TIP = {20.0: 0.16360, 60.0: 0.20285, 100.0: 0.21369}


@pytest.mark.parametrize("gamma", TIP)
def test_rod_4_5(gamma):
    """Order 2 to the tip of the thesis's rod: extrapolated from 40 and 80 edges it is the prototype's."""
    scene = load("rod_4_5").replace({**CURVE_ANGLE, "strip.gamma": gamma})
    tips = []
    for edges in (40, 80):
        state = solve(scene.replace({"model.elements": edges}))
        assert (state.status.code, state.stable) == ("converged", True)
        height = state.shape.centreline((np.arange(2000) + 0.5) / 2000)[:, 0].mean()
        assert state.energy.gravity == pytest.approx(gamma * height, rel=2.0 / edges**2)
        tips.append(float(np.hypot(*state.end.position[1:])))
    assert (4.0 * tips[1] - tips[0]) / 3.0 == pytest.approx(TIP[gamma], abs=5e-5)


def test_its_own_error():
    scene = load("rod_4_5").replace({**CURVE_ANGLE, "model.elements": 40})
    state = solve(scene, options=Options(error=True))
    fine = solve(scene.replace({"model.elements": 320}))
    s = np.linspace(0.0, 1.0, 101)
    far = np.linalg.norm(state.shape.centreline(s) - fine.shape.centreline(s), axis=1).max()
    assert 0.5 * far < state.error < 2.0 * far
    # the clamp carries the weight
    assert state.supports.start.force == pytest.approx([80.0, 0.0, 0.0], abs=1e-7)


def test_straight_at_rest_under_its_weight():
    """Ipopt does not get there from a straight rod; the loads are then raised."""
    scene = load("rod_4_5").replace({**CURVE_ANGLE, "model.elements": 20, "strip.natural_curvature": 0.0})
    state = solve(scene)
    assert state.ok
    assert state.supports.start.force == pytest.approx([80.0, 0.0, 0.0], abs=1e-7)


def test_beside_curvature_elements():
    """The energy "kirchhoff" on the ribbon's elements is the same rod: the distance falls to order 2 in the edges, to
    what is left of the elements' own error."""
    scene = load("rod_4_5")
    elements = solve(scene.replace({"model.elements": 80}), options=Options(error=True))
    s = np.linspace(0.0, 1.0, 101)
    far, energies = [], []
    for edges in (40, 80, 160):
        rod = solve(scene.replace({**CURVE_ANGLE, "model.elements": edges}))
        far.append(np.linalg.norm(rod.shape.centreline(s) - elements.shape.centreline(s), axis=1).max())
        energies.append(abs(rod.energy.total - elements.energy.total))
    assert elements.error < 0.05 * far[-1]
    for misses in (far, energies):
        assert np.log2(np.array(misses[:-1]) / misses[1:]) == pytest.approx(2.0, abs=0.15)
    assert rod.supports.start.moment == pytest.approx(elements.supports.start.moment, rel=5e-3)


@pytest.mark.parametrize("twist", ["free", "quasi-static"])
def test_eliminated_angles_are_the_same(twist):
    scene = load("rod_4_5").replace({**CURVE_ANGLE, "model.elements": 20, "rod.twist": twist})
    state = solve(scene)
    assert state.ok
    assert state.energy.total == pytest.approx(-51.8148, abs=2e-3)


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"strip.thickness": None}, "strip.thickness"),
        ({"clamp.start": {"position": [0.0, 0.0, 0.0]}}, "clamp.start"),
        ({"wall": [{"point": [-1.0, 0.0, 0.0], "normal": [1.0, 0.0, 0.0]}]}, "wall"),
    ],
)
def test_refused(keys, key):
    with pytest.raises(BadInput) as caught:
        solve(load("rod_4_5").replace({**CURVE_ANGLE, **keys}))
    assert caught.value.key == key


@pytest.mark.parametrize("away", [3.0, 10.0, 1e4])
def test_far_from_the_origin_it_is_the_same_rod(away):
    """Forces are third differences of positions: 3 l from the origin rounding hid them, and nothing converged."""
    turned = {"path": None, "model.elements": 60, "clamp.end.normal": [0.6, 0.8, 0.0]}
    scene = load("rod_wrung").replace(turned)
    move = away * np.array([0.36, 0.48, 0.8])
    held = {
        f"clamp.{end}.position": scene.to_dict()["clamp"][end].get("position", [0.0] * 3) for end in ("start", "end")
    }
    moved = {key: (np.array(place) + move).tolist() for key, place in held.items()}
    near, far = (solve(one, options=Options(error=False)) for one in (scene, scene.replace(moved)))
    assert [near.ok, far.ok] == [True, True]
    rounding = 1e-14 * away
    assert far.energy.elastic == pytest.approx(near.energy.elastic, rel=1e-9 + rounding)
    assert far.shape.centreline(np.linspace(0, 1, 7)) == pytest.approx(
        near.shape.centreline(np.linspace(0, 1, 7)) + move, abs=1e-7 + 10.0 * rounding
    )
    assert far.supports.start.force == pytest.approx(near.supports.start.force, abs=1e-4)
