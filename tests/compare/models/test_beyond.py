"""What the strip of finite thickness leaves out, against committed shells; and that it has one answer."""

from __future__ import annotations

import numpy as np
import pytest

from compare.models import solve
from compare.models.ribbon.neglected import beside, beyond, thin, to_shell
from compare.scene.scene import load
from compare.studies.limits import with_clamp
from tests.compare.models.test_models_4_3 import shells
from tests.validation.workbench.hit_solve import with_model

S = np.linspace(0.0, 1.0, 201)


@pytest.mark.parametrize("name", ["curl_4_3", "curl_4_3_down"])
@pytest.mark.parametrize("ratio", [10.0, 20.0, 100.0, 400.0])
def test_the_estimate_is_of_the_size_of_the_distance(name, ratio):
    """Between 0.5 and 4 times the distance of the centrelines that was measured, over two decades of w/h."""
    scene = thin(load(name), ratio)
    state = solve(scene, "ribbon")
    nine = shells()[name, ratio]
    measured = float(np.linalg.norm(state.shape.centreline(np.linspace(0.0, 1.0, 9)) - nine, axis=1).max())
    estimated = to_shell(scene, state.native, state.native)
    assert 0.4 * measured < estimated < 4.0 * measured


def test_terms_that_have_no_cause_are_nothing():
    """No Poisson's effect and no twist: nothing but the fold's own length, and that of a straight ruling is none."""
    scene = load("cantilever").replace({"strip.poisson": 0.0, "shell.width_to_thickness": [20.0]})
    flat = thin(scene)
    parts = beyond(flat, solve(flat, "ribbon").native).parts
    assert max(parts.values()) < 1e-9


def test_one_answer_from_two_starts():
    """Wide, folded at its clamp: from Wunderlich's shape and from the scene's own seed. Between four Gauss points of an
    element there was a minimum 9 D w / l lower whose true energy is 1e6 higher."""
    scene = with_clamp(load("limits_7_3"), "edge").replace({"strip.width": 0.1, "strip.gamma": 1000.0})
    far = beside(scene, solve(scene, "ribbon").native, 100.0)
    near = solve(thin(scene, 100.0), "ribbon").native
    assert far.ok
    assert near.ok
    assert far.energy.total == pytest.approx(near.energy.total, rel=1e-9)
    assert np.abs(far.position(S) - near.position(S)).max() < 1e-6


def test_a_curvature_that_jumped_is_not_the_answer():
    """On short elements at the clamp, from Wunderlich's shape: a state 5 D w / l higher whose curvature is 14, -16, 19
    on neighbouring joints; the scene's own seed leads below it."""
    scene = with_clamp(load("limits_7_3"), "edge").replace(
        {"strip.poisson": 0.0, "strip.width": 0.05, "strip.gamma": 1000.0, "strip.thickness": 1e-3}
    )
    scene = with_model(scene.replace({"shell.width_to_thickness": None}), "wunderlich")
    found = beside(scene, solve(scene, "ribbon").native)
    assert found.ok
    assert found.energy.total < -432.0
    assert found.omega(np.linspace(0.0, 0.1, 50)).min() > 0.0


def test_few_elements_do_not_hide_another_state():
    """Thin and coarse: the curvature may not jump through zero within the first element."""
    scene = thin(load("curl_4_3"), 400.0)
    coarse, fine = (
        solve(scene.replace({"model.elements": n, "model.grading": "clamp"}), "ribbon").native for n in (20, 80)
    )
    assert np.abs(coarse.position(S) - fine.position(S)).max() < 2e-3
    assert coarse.omega(S).min() > 0.0


@pytest.mark.parametrize(("held", "along"), [("start", -1.0), ("end", 1.0)])
def test_a_strip_on_a_nail_is_begun_where_it_hangs(held, along):
    """Straight down from a point: the strip of finite thickness is the same, in few steps, and what it leaves out moves
    nothing; begun along e_z, where a free start has no pose of its own, it swung down, and was told 5.8 l away."""
    nail = load("cantilever").replace(
        {"clamp.start": None, f"clamp.{held}": {"position": [0.0, 0.0, 0.0]}, "seed": None, "model.elements": 8}
    )
    state = solve(nail.replace({"model.energy": "wunderlich"}), "ribbon").native
    thick = thin(nail, 100.0)
    there = beside(nail, state, 100.0)
    assert there.ok
    assert there.iterations < 10
    drop = there.position([1.0])[0] - there.position([0.0])[0]
    np.testing.assert_allclose(drop, along * np.asarray(nail.up), atol=1e-9)
    assert beyond(thick, there).distance < 1e-9
    assert to_shell(nail, state, there, 100.0) < 1e-9
