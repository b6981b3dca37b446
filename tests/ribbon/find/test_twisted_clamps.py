"""Clamps of which one is turned: the rod's own equations by shooting, images, and where the arch is lost."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation.ribbon import twisted_clamps as page


def test_an_equilibrium_solves_the_rods_equations_by_shooting():
    """What the end misses, begun with the ribbon's force and moment, falls as the elements get shorter."""
    off = []
    for segments in (8, 16):
        scene = page.scene("kirchhoff", 0.1, segments)
        found = page.registry.model("ribbon").branch_start(lambda t, scene=scene: scene, None)
        start = found.state.native.start
        u = np.concatenate([-np.asarray(start.force), -(page._frame(0.0).T @ np.asarray(start.moment))])
        left, jacobian = page.missed(u, 0.1)
        off.append(float(np.abs(np.linalg.solve(jacobian, left)).max()))
    assert off[1] < off[0] / 10.0
    assert off[1] < 0.05


def test_derivatives_of_the_shot_are_its_differences():
    u = np.array([-40.0, 1.0, -3.0, 5.0, -2.0, 1.0])
    _, jacobian = page.missed(u, 0.1)
    step = 1e-5
    for k in (0, 4):
        ahead, behind = (page.missed(u + sign * step * np.eye(6)[k], 0.1)[0] for sign in (1.0, -1.0))
        assert jacobian[:, k] == pytest.approx((ahead - behind) / (2.0 * step), abs=1e-5)


def test_an_image_is_an_image():
    """Of a curve that is symmetric about the bisector: itself; twice: itself."""
    s = np.linspace(0.0, 1.0, 11)
    line = np.column_stack([page.APART * s, 0.0 * s, np.sin(np.pi * s)])
    assert page.image(line, 0.0) == pytest.approx(line, abs=1e-12)
    aside = line + np.column_stack([0.0 * s, s, 0.0 * s])
    assert page.image(page.image(aside, 0.3), 0.3) == pytest.approx(aside, abs=1e-12)
