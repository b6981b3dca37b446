"""Scenes that say nothing about rulings and elements: the clamp holds the edge, the elements are placed."""

from __future__ import annotations

import numpy as np
import pytest

from compare.models.base import Options, Status
from compare.models.ribbon.model import RibbonModel
from compare.scene.scene import Scene, loads

SI = """
[strip]
length = 0.2
width = 0.02
thickness = 1e-4
poisson = 0.3
young = 2.5e9
density = 800.0

[gravity]
up = [0.0, 0.0, 1.0]

[clamp.start]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
"""
TWISTED = """
[clamp.end]
position = [0.16, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, -1.0, 0.0]
"""


def solved(scene: Scene):
    return RibbonModel().solve(scene, options=Options(error=True))


def test_a_scene_that_says_nothing_is_held_straight_and_exact_to_its_tolerance():
    found = solved(loads(SI + TWISTED))
    assert found.status is Status.CONVERGED
    assert found.error <= 1e-3
    eta = found.native.eta([0.0, 1.0])
    np.testing.assert_allclose(eta, 0.0, atol=1e-12)
    assert found.native.max_abs_eta > 0.1
    coarse = solved(loads(SI + TWISTED + "[model]\nelements = 20\n"))
    assert coarse.error > 3e-3  # equal segments would be wrong by that


def test_a_seed_off_the_plane_is_not_flattened_by_a_straight_clamp():
    """The curl that leaves its plane, chained as mixed, with a constant ruling to start from."""
    text = """
[strip]
length = 1.0
width = 0.03
poisson = 0.5
natural_curvature = 10.0
gamma = 100.0

[gravity]
up = [0.0, 1.0, 0.0]

[clamp.start]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]

[seed]
curvature = 0.0
ruling = 0.01
"""
    ends = [
        solved(loads(f'{text}[model]\nelements = 40\ngrading = "clamp"\nformulation = "{name}"\n'))
        for name in ("chained", "mixed")
    ]
    assert [found.status for found in ends] == [Status.CONVERGED] * 2
    assert abs(ends[0].end.position[0]) > 0.01
    assert np.abs(ends[0].end.position) == pytest.approx(np.abs(ends[1].end.position), abs=1e-6)


def test_what_cannot_place_its_elements_has_equal_ones():
    found = solved(loads(f'{SI}[model]\nformulation = "matrix"\n'))
    assert found.status is Status.CONVERGED
    np.testing.assert_allclose(found.native.problem.lengths, 0.05)


@pytest.mark.parametrize("formulation", ["auto", "chained", "mixed"])
def test_elements_are_placed_in_the_formulation_that_is_asked_for(formulation):
    found = solved(loads(f'{SI}[model]\nformulation = "{formulation}"\n'))
    assert found.status is Status.CONVERGED
    assert found.native.problem.formulation == ("chained" if formulation == "auto" else formulation)
    assert 0.0 < found.native.tolerance_error <= 1e-3
