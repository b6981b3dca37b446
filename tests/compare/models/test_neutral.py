"""A fold that is free to slide under a roof is neutral, and is said to be; one that cannot is stable."""

import numpy as np
import pytest

from compare.models import solve as solve_scene
from compare.models.base import Options
from compare.pages.result import state_result
from compare.pages.solve import answer
from compare.scene.scene import load
from ribbon.find.solve import solve_shape


def under(height, segments=120):
    return load("roman_6_2").replace({"wall.roof.point": [0.0, height, 0.0], "model.elements": segments})


@pytest.fixture(scope="module", params=[0.17, pytest.param(0.15, marks=pytest.mark.validate)])
def slid(request):
    """Of a roof's height: the scene and the state, judged."""
    scene = under(request.param)
    return scene, solve_scene(scene, "ribbon", options=Options(error=True))


def test_a_fold_with_room_beside_it_is_neutral(slid):
    scene, state = slid
    assert state.stable is None
    found = state.numbers["neutral"]
    assert found["places"] == 2
    assert found["distance"] > 0.005
    assert found["energy"] < 1e-4 * state.energy.total
    limit = state.numbers["eigenvalue_limit"]
    assert abs(limit["value"]) <= limit["error"] < 1e-3
    assert state.errors["lowest_eigenvalue"] >= abs(state.lowest_eigenvalue)
    said = answer(scene, state)
    assert "neutral" in said.text
    assert said.grade not in ("good",)
    assert state_result(scene, state)["neutral"] == found


def test_it_stands_anywhere_at_one_energy(slid):
    """Its curvature moved by a tenth of the room and more, and solved again: one energy, an eigenvalue of zero."""
    _, state = slid
    e = state.native
    omega, eta = e.problem.joint_values(e.x)
    s = np.linspace(0.0, 1.0, omega.size)
    centre = (s * omega**2).sum() / (omega**2).sum()
    for place in (0.47, 0.49, 0.53):
        moved = np.interp(s - place + centre, s, omega, left=0.0, right=0.0)
        there = solve_shape(e.problem.with_changes(touching=()), moved, 0.0 * eta)
        other, _ = there.problem.joint_values(there.x)
        assert there.ok
        assert (s * other**2).sum() / (other**2).sum() == pytest.approx(place, abs=0.01)
        assert there.energy.total == pytest.approx(e.energy.total, rel=1e-4)
        assert abs(there.lowest_eigenvalue) < 2e-3


def test_a_fold_as_long_as_the_strip_is_stable():
    state = solve_scene(under(0.185, 60), "ribbon", options=Options(error=True))
    assert state.stable is True
    assert "neutral" not in state.numbers
    assert state.lowest_eigenvalue > 0.1
