"""Scenes of published numbers: edge_published (Audoly and Neukirch 2021), jfig_5_2 (JFIG 2019), rod_4_5 (thesis),
bend_45 (Bathe and Bolourchi 1979), roll_up (Simo and Vu-Quoc 1986)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from compare.models import solve as solve_scene
from compare.models.scope import require_shell
from compare.scene.scene import load
from tests.reference import lateral_torsional as published


def test_edge_published_is_the_papers_strip():
    scene = load("edge_published")
    nu = published.POISSON
    assert scene.strip.length == pytest.approx(3.5 * published.LEG)
    assert scene.strip.width == published.WIDTH
    assert scene.strip.thickness == published.THICKNESS
    assert scene.gamma == pytest.approx((1 - nu**2) * 3.5**3, rel=1e-12)
    assert scene.gamma > 1.6 * (1 - nu**2) * published.gamma_sadowsky(nu)
    assert scene.frame[:, 0] == pytest.approx([0, 0, -1])  # the width is vertical
    rolled = scene.stages()[0].frame
    assert math.acos(np.clip(rolled[:, 1] @ scene.frame[:, 1], -1, 1)) == pytest.approx(0.4)
    assert require_shell(scene) == pytest.approx([published.WIDTH / published.THICKNESS])


def test_edge_published_as_sadowskys_ribbon_is_the_papers_curve():
    """With a free ruling, which the paper's has: read from its figure to 0.005."""
    found = solve_scene(load("edge_published").replace({"model.energy": "sadowsky", "clamp.start.ruling": "free"}))
    assert found.ok
    side = 3.5 * abs(found.shape.centreline(np.array([1.0]))[0, 1])
    curve = published.curve("sadowsky_1d")
    assert side == pytest.approx(np.interp(3.5, *curve.T), abs=5e-3)


def test_a_published_shell_falls_less_far():
    shell = published.points("fem_shell")
    assert np.interp(3.5, *shell.T) / 3.5 == pytest.approx(0.5258, abs=5e-5)
    side = abs(solve_scene(load("edge_published")).shape.centreline(np.array([1.0]))[0, 1])
    assert side == pytest.approx(0.6955, abs=1e-4)


def test_jfig_differs_from_the_thesis_by_the_load_only():
    paper, thesis = load("jfig_5_2"), load("figure_4_1")
    assert thesis.replace({"strip.density": 150.0}).canonical() == paper.canonical()
    areal = paper.strip.density * paper.strip.thickness
    assert areal == pytest.approx(0.015)  # kg/m^2
    rigidity = paper.strip.young * paper.strip.thickness**3 / (12 * (1 - paper.strip.poisson**2))
    assert rigidity == pytest.approx(2e-4)  # N m
    assert paper.gamma == pytest.approx(areal * 9.81 * 0.5**3 / rigidity, rel=1e-12)


def test_jfig_hangs():
    """Energy on the scene's 20 segments; with 160: -113.232132."""
    found = solve_scene(load("jfig_5_2"))
    assert found.ok
    assert found.energy.total == pytest.approx(-113.231284, abs=2e-6)


def test_rod_4_5_is_the_thesiss_rod():
    scene = load("rod_4_5")
    assert scene.width == pytest.approx(1 / 30)
    assert scene.strip.thickness / scene.strip.width == pytest.approx(0.1)
    assert (scene.strip.poisson, scene.curvature, scene.gamma) == (0.4, (10.0, 10.0), 80.0)
    assert scene.model.energy == "kirchhoff"
    assert scene.frame == pytest.approx(load("curl_4_3").frame)


@pytest.mark.parametrize(("gamma", "prototype"), [(20.0, 0.16360), (60.0, 0.20285), (100.0, 0.21369)])
def test_rod_4_5_is_where_a_prototype_has_it(gamma, prototype):
    """sqrt(y^2 + z^2) of the tip; prototype: the balance of moments as a boundary value problem."""
    found = solve_scene(load("rod_4_5").replace({"strip.gamma": gamma, "model.elements": 40}))
    assert found.ok
    tip = found.shape.centreline(np.array([1.0]))[0]
    assert np.hypot(tip[1], tip[2]) == pytest.approx(prototype, abs=5.5e-6)


def test_rod_4_5_of_80():
    """On the scene's 20 elements; with 160: 0.21421."""
    tip = solve_scene(load("rod_4_5")).shape.centreline(np.array([1.0]))[0]
    assert np.hypot(tip[1], tip[2]) == pytest.approx(0.214220, abs=1e-6)


def test_bend_45_is_where_shooting_has_it():
    """tests/shellref/rod/test_rod.py: (15.68480, 47.15044, 53.47486), along t_y's plane and out of it."""
    scene = load("bend_45")
    found = solve_scene(scene)
    assert found.ok
    tip = 25.0 * math.pi * found.end.position
    assert tip == pytest.approx([53.47486, 15.68480, 47.15044], abs=5e-5)
    assert not scene.is_planar()


def test_roll_up_is_a_circle():
    found = solve_scene(load("roll_up"))
    assert found.ok
    assert found.end.position == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    assert found.end.frame == pytest.approx(np.eye(3), abs=2e-6)
    assert found.middle.position == pytest.approx([0.0, -1.0 / math.pi, 0.0], abs=1e-6)
    assert found.energy.total == pytest.approx(2.0 * math.pi**2, abs=1e-4)
    assert found.supports.start.moment == pytest.approx([-2.0 * math.pi, 0.0, 0.0], abs=1e-7)


@pytest.mark.parametrize(("gamma", "kirchhoff"), [(20.0, 0.16360), (100.0, 0.21369)])
def test_rod_4_5_with_shear_and_stretch_is_the_same_rod(gamma, kirchhoff):
    """Figure 4.5: Antman's rod and Kirchhoff's coincide."""
    found = solve_scene(load("rod_4_5").replace({"strip.gamma": gamma, "model.energy": "antman", "model.elements": 40}))
    assert found.ok
    assert np.hypot(*found.end.position[1:]) == pytest.approx(kirchhoff, abs=5e-5)
