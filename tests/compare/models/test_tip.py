"""Loads at the end, `[tip]`: every model that takes them carries them alike."""

from __future__ import annotations

import numpy as np
import pytest

from compare.models import solve
from compare.models.base import Options
from compare.scene.scene import loads

CANTILEVER = """
[strip]
length = 1.0
width = 0.05
thickness = 5e-4
poisson = 0.0
[clamp.start]
position = [0.1, 0.2, 0.3]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[shell]
elements = [30, 2]
"""
START = np.array([0.1, 0.2, 0.3])
GUIDED = {"clamp.end.position": "free", "clamp.end.tangent": [0.0, 0.0, 1.0], "clamp.end.normal": [0.0, 1.0, 0.0]}
MODELS = [
    pytest.param(name, marks=[pytest.mark.shell] if name == "shell" else []) for name in ("elastica", "ribbon", "shell")
]

#: F l^2 / (E I): drop and shortening over l of a cantilever with a dead end force (K. Mattiasson, Int. J. Numer. Meth.
#: Engng 17 (1981) 145, doi:10.1002/nme.1620170113, tables 1 and 2, five digits).
MATTIASSON = {1.0: (0.30172, 0.05643), 2.0: (0.49346, 0.16064), 5.0: (0.71379, 0.38763), 10.0: (0.81061, 0.55500)}


def state(model: str, changes: dict):
    if model == "shell":
        pytest.importorskip("dolfinx")
    found = solve(loads(CANTILEVER, "cantilever").replace(changes), model, options=Options())
    assert found.ok, found.message
    return found


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("force", [10.0])
def test_a_cantilever_with_an_end_force_is_mattiasson_s(model, force):
    drop, shortening = MATTIASSON[force]
    found = state(model, {"tip.force": [0.0, -force, 0.0]})
    place = found.shape.centreline(np.array([1.0]))[0]
    np.testing.assert_allclose(place - START, [0.0, -drop, 1.0 - shortening], atol=1e-5)
    np.testing.assert_allclose(found.supports.start.force, [0.0, force, 0.0], atol=1e-5)
    assert found.energy.tip == pytest.approx(force * place[1], rel=1e-10)


def test_all_of_mattiasson_s_loads():
    for force, (drop, shortening) in MATTIASSON.items():
        place = state("elastica", {"tip.force": [0.0, -force, 0.0]}).shape.centreline(np.array([1.0]))[0]
        np.testing.assert_allclose(place - START, [0.0, -drop, 1.0 - shortening], atol=6e-6)


@pytest.mark.parametrize("model", MODELS)
def test_a_guided_end_carries_a_moment_and_no_force(model):
    """Each half is a cantilever of half the length with the same force, the two point-symmetric."""
    found = state(model, {"tip.force": [0.0, -10.0, 0.0], **GUIDED})
    np.testing.assert_allclose(found.supports.end.force, 0.0, atol=1e-5)
    np.testing.assert_allclose(found.supports.start.force, [0.0, 10.0, 0.0], atol=1e-5)
    half = state("elastica", {"tip.force": [0.0, -2.5, 0.0]}).shape.centreline(np.array([1.0]))[0] - START
    place = found.shape.centreline(np.array([1.0]))[0] - START
    np.testing.assert_allclose(place, half, atol=1e-5)
    assert found.supports.end.moment[0] == pytest.approx(-10.0 * 0.5 * place[2], rel=1e-5)


@pytest.mark.parametrize("model", MODELS)
def test_a_tension_stiffens(model):
    """A small force f on a cantilever pulled by T sinks by (f / T) (1 - tanh a / a), a^2 = T l^2 / B."""
    tension, force = 25.0, 1e-3
    found = state(model, {"tip.tension": tension, "tip.force": [0.0, -force, 0.0]})
    drop = (found.shape.centreline(np.array([1.0]))[0] - START)[1]
    a = np.sqrt(tension)
    assert drop == pytest.approx(-force / tension * (1.0 - np.tanh(a) / a), rel=1e-3)
    np.testing.assert_allclose(found.supports.start.force, [0.0, force, -tension], atol=1e-4)


@pytest.mark.shell
def test_a_moment_in_space_turns_a_shell_as_a_rod():
    """Bending and torsion by a moment of fixed direction: the shell tends to the shearable rod with w, w/h = 10
    and nu = 0 kept."""
    pytest.importorskip("dolfinx")
    far = []
    for width in (0.05, 0.02):
        scene = loads(CANTILEVER, "cantilever").replace(
            {
                "strip.width": width, "strip.thickness": 0.1 * width, "strip.poisson": 0.0, "model.energy": "antman",
                "tip.moment": [3.0, 1.0, 1.5], "shell.width_to_thickness": None, "shell.elements": [40, 4],
            }
        )  # fmt: skip
        rod, shell = (solve(scene, model, options=Options()) for model in ("antman", "shell"))
        assert rod.ok
        assert shell.ok
        assert shell.stable is None
        np.testing.assert_allclose(shell.supports.start.moment, [-3.0, -1.0, -1.5], atol=1e-6)
        s = np.linspace(0.0, 1.0, 41)
        far.append(float(np.linalg.norm(rod.shape.centreline(s) - shell.shape.centreline(s), axis=1).max()))
    assert far[0] < 0.015
    assert far[1] == pytest.approx(0.4 * far[0], rel=0.1)
