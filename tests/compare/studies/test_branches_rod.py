"""Branches of the shearable rod: its tangent, and a heavy mast with its sides beside another model."""

from dataclasses import replace

import numpy as np
import pytest

from compare.continuation.correct import first_point
from compare.continuation.finer import relocated
from compare.continuation.follow import follow
from compare.continuation.point import Options
from compare.models.antman.model import AntmanModel
from compare.scene.scene import loads
from compare.studies.branches.along import Along
from compare.studies.branches.run import Asked, diagram
from ribbonbench.errors import BadInput

MAST = """
title = "Mast"
[strip]
length = 1.0
width = 0.02
thickness = 1e-3
poisson = 0.3
gamma = 5.0
[gravity]
up = [1.0, 0.0, 0.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[model]
energy = "antman"
elements = 8
"""
GREENHILL = 7.8373474


def begun(gamma=5.0, change=None):
    scene = loads(MAST).replace({"strip.gamma": gamma, **(change or {})})
    along = Along.of(scene, "strip.gamma", gamma, 10.0)
    start = AntmanModel().branch_start(along.scene_at)
    return along, start


@pytest.fixture(scope="module")
def bent():
    """A system at an equilibrium that is bent in space."""
    held = {
        "clamp.start.tangent": [0.8, 0.6, 0.0],
        "clamp.start.normal": [0.0, 0.0, 1.0],
        "tip": {"force": [0.0, 1.0, 2.0]},
    }
    _, start = begun(1.0, held)
    point = first_point(start.system, start.z, 0.0, Options().tolerance)
    return start.system, point.z


def test_the_tangent_is_the_derivative(bent):
    system, z = bent
    x = np.random.default_rng(1).normal(size=system.size)
    wrong = []
    for step in (1e-5, 1e-6):
        moved = (system.residual(z + step * x, 0.0) - system.residual(z - step * x, 0.0)) / (2.0 * step)
        back = system.factor(z, 0.0).solve(moved) - x
        wrong.append(np.abs(system.split(back)[0]).max())
    assert wrong[1] < 1e-3
    assert wrong[1] == pytest.approx(1e-2 * wrong[0], rel=0.1)  # of second order in the step: nothing else is left


def test_the_transposed_tangent_is_its_transpose(bent):
    system, z = bent
    factor = system.factor(z, 0.0)
    b, c = np.random.default_rng(2).normal(size=(2, system.size))
    one, other = c @ factor.solve(b), b @ factor.solve_transposed(c)
    assert one == pytest.approx(
        other, abs=1e-8 * np.linalg.norm(c) * np.linalg.norm(factor.solve(b))
    )  # stretch is 1e7 times stiffer than bending


def test_a_heavy_mast_falls_over_where_greenhill_says():
    found = diagram(loads(MAST), "strip.gamma", 5.0, 10.0, ("antman", "wunderlich"), Asked(branches=3, errors=False))
    for model in ("antman", "wunderlich"):
        own, up, down = (branch for branch in found.branches if branch.model == model)
        (fork,) = own.special
        assert fork.parameter == pytest.approx(GREENHILL, rel=1e-4)
        assert {p.unstable for p in up.points} == {0}
        assert up.points[-1].end[2] == pytest.approx(-down.points[-1].end[2], abs=1e-6)
    rod, ribbon = (next(b for b in found.branches if b.model == m and b.leaves) for m in ("antman", "wunderlich"))
    assert np.abs(rod.points[-1].end) == pytest.approx(np.abs(ribbon.points[-1].end), abs=2e-3)


def test_a_moment_without_potential_is_refused():
    with pytest.raises(BadInput) as refused:
        begun(5.0, {"tip": {"moment": [0.1, 0.0, 0.0]}})
    assert refused.value.key == "tip.moment"


def test_an_error_holds_what_finer_elements_give():
    along, start = begun(7.0)
    run = follow(first_point(start.system, start.z, 0.0, Options().tolerance))
    (fork,) = run.specials
    finer = relocated(fork)
    finest = relocated(finer)
    first, second, third = (abs(along.value(one.point.t) - GREENHILL) for one in (fork, finer, finest))
    assert third < second < first
    assert replace(start.system).size < finest.point.system.size


def test_what_a_thin_rod_hides_is_not_said_to_move_nothing():
    """At w/h = 1e4 a norm allows for so much rounding of stretch that it sees nothing of the weight that bends it."""
    scene = loads(MAST).replace({"strip.thickness": 2e-6, "model.elements": 20})
    with pytest.raises(BadInput) as refused:
        diagram(scene, "strip.gamma", 7.6, 8.0, asked=Asked(branches=1, errors=False))
    assert "rounding" in refused.value.problem


def test_shear_and_stretch_can_be_off_in_a_thin_rod():
    """Ten times as stiff where double precision bears no more: solved, and known to move next to nothing."""
    level = {"clamp.start.tangent": [0.0, 1.0, 0.0], "clamp.start.normal": [1.0, 0.0, 0.0]}
    scene = loads(MAST).replace({"strip.thickness": 2e-6, "strip.gamma": 3.0, "model.elements": 10, **level})
    own = AntmanModel().solve(scene)
    assert own.ok
    for effect in AntmanModel().effects(scene):
        if effect.key in ("shear", "stretch"):
            off = AntmanModel().solve(scene.replace(effect.changes))
            assert off.ok
            line = np.linspace(0.0, 1.0, 11)
            assert np.abs(off.shape.centreline(line) - own.shape.centreline(line)).max() < 1e-6
