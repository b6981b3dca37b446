"""The tape spring as a model: its scenes, its numbers in SI, what it refuses, its way, its shape."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from compare.models import solve
from compare.models.base import Status, check_keys
from compare.registry import model
from compare.scene.scene import load
from ribbonbench.errors import BadInput
from tests.validation.ribbon.tape import top_of

COARSE = {"model.energy": "tape_plain", "model.elements": 200}
#: A turn of 0.05 rad of both ends: before the fold.
C, S = float(np.cos(0.05)), float(np.sin(0.05))
LITTLE = {
    "clamp.start.tangent": [0.0, -S, C], "clamp.start.normal": [0.0, C, S], "clamp.end.tangent": [0.0, S, C],
    "clamp.end.normal": [0.0, C, -S],
}  # fmt: skip


@functools.cache
def little():
    return solve(load("tape_4_1").replace({**COARSE, **LITTLE}))


def test_a_little_turn_is_a_beam():
    state = little()
    assert state.status is Status.CONVERGED
    assert state.stable
    # M = (M / k)_0 k with k = 0.1 / m, before the section flattens by much (1.36115e7 N mm^2)
    moment = float(np.linalg.norm(state.supports.end.moment)) * state.units.energy * 1e3
    assert moment == pytest.approx(1.36115e7 * 1e-4, rel=0.15)
    assert moment < 1.36115e7 * 1e-4
    np.testing.assert_allclose(state.supports.end.moment, -state.supports.start.moment, rtol=1e-6)
    assert np.abs(state.supports.end.force).max() < 1e-4
    # opposite sense: the tangent turns towards the normal, the moment at the end about -t_x
    assert state.supports.end.moment[0] < 0.0


def test_its_energy_is_the_work_of_the_ends():
    state = little()
    turn = [row["turn_end"] - row["turn_start"] for row in state.log]
    moment = [row["moment_end"] for row in state.log]
    from scipy.interpolate import CubicSpline

    work = CubicSpline(turn, moment).integrate(0.0, turn[-1])
    assert state.energy.elastic == pytest.approx(work, rel=1e-3)
    assert sum(state.energy.parts.values()) == pytest.approx(state.energy.elastic, rel=1e-12)


def test_shape_holds_its_clamps_and_is_round_at_them():
    state, scene = little(), load("tape_4_1").replace({**COARSE, **LITTLE})
    shape = state.shape
    np.testing.assert_allclose(shape.centreline(np.array([0.0]))[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(shape.frames(np.array([0.0]))[0], scene.frame, atol=1e-9)
    np.testing.assert_allclose(shape.frames(np.array([1.0]))[0], scene.end_frame, atol=1e-9)
    assert abs(shape.centreline(np.array([1.0]))[0, 1]) < 1e-12
    edge = shape.points(np.array([0.0]), np.array([-0.03, 0.03]))[0]
    assert np.linalg.norm(edge[1] - edge[0]) == pytest.approx(2.0 * 0.05 * np.sin(0.6), rel=1e-9)
    # kt > 0: the edges stand away from the normal
    assert np.all(edge @ scene.frame[:, 1] < 0.0)
    fields = shape.fields(np.linspace(0.0, 1.0, 7), np.array([-0.03, 0.0, 0.03]))
    assert fields["omega"].max() < 0.0  # opposite sense: omega kt < 0
    np.testing.assert_allclose(np.linalg.norm(fields["normal"], axis=2), 1.0, rtol=1e-12)
    # the normal stands on the surface
    s, v = np.linspace(0.3, 0.7, 5), np.array([-0.02, 0.01])
    step = 1e-6
    across = (shape.points(s, v + step) - shape.points(s, v - step)) / (2.0 * step)
    assert np.abs(np.sum(across * shape.fields(s, v)["normal"], axis=2)).max() < 1e-6


def test_the_error_is_that_of_halved_elements():
    from compare.models.base import Options

    scene = load("tape_4_1").replace({**COARSE, **LITTLE, "model.elements": 50})
    state = solve(scene, options=Options(error=True))
    assert 0.0 < state.error < 1e-4
    finer = model("tape").refined(state)
    assert finer.numbers["segments"] == 100
    assert finer.ok


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"clamp.end.position": [0.1, 0.0, 1.0]}, "model.energy"),
        ({"clamp.end.slide": [0.6, 0.0, 0.8]}, "model.energy"),
        ({"strip.transverse_curvature": 60.0}, "strip.transverse_curvature"),
        ({"strip.natural_curvature": 3.0}, "strip.natural_curvature"),
        ({"gravity.up": [0.0, 1.0, 0.0]}, "gravity.up"),
    ],
)
def test_what_a_tape_is_not_is_refused_by_name(changes, key):
    scene = load("tape_4_1").replace(changes)
    with pytest.raises(BadInput) as refused:
        check_keys(model("tape"), scene)
    assert refused.value.key == key


def test_stages_that_hold_other_things_are_refused():
    scene = load("tape_4_2").replace({"path": [{"clamp.end.slide": [0.0, 1.0, 0.0]}]})
    with pytest.raises(BadInput, match="hold"):
        solve(scene)


@pytest.mark.validate
@pytest.mark.parametrize(
    ("name", "moment", "force"),
    [("tape_4_1", 1270.36, None), ("tape_4_1_equal", 993.6, None), ("tape_4_2", None, 1.6514)],
)
def test_shipped_scenes_end_in_stable_folds(name, moment, force):
    state = solve(load(name))
    assert state.ok
    if moment is not None:
        found = max(abs(row["moment_end"]) for row in state.log) * state.units.energy * 1e3
        assert found == pytest.approx(moment, rel=2e-3)
    if force is not None:
        # the top lies between steps: by the parabola through three, the same on 100 to 800 elements to 4e-4
        top = top_of([[row["end_y"], abs(row["force_y"]) * state.units.force] for row in state.log])
        assert top[1] == pytest.approx(force, rel=5e-4)
