"""How a strip's frame turns along a drawn curve: to where bending and twist cost least."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Strip
from ribbon.energies.free import in_plane_stiffness
from ribbon.energies.section.rod import stiffnesses
from ribbon.find.jointed import framed
from ribbon.find.solve import build


def strip(width=0.01, thickness=0.0005):
    flat = Strip(1.0, width, 0.3, thickness=thickness)
    end = Clamp((0.0, 0.0, 0.5), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    return build(flat, Clamp(), end=end, energy="kirchhoff", segments=10, formulation="mixed").fields


def stiff_of(fields):
    bending, torsion = stiffnesses(fields.section)
    return np.array([bending, in_plane_stiffness(fields.section), torsion])


def test_the_slope_is_that_of_the_energy():
    random = np.random.default_rng(3)
    phi, one, other = random.normal(size=(3, 9))
    stiff, step = np.array([1.0, 40.0, 1.3]), 1e-5
    slope = framed.energy(phi, one, other, stiff)[1]
    for k in range(phi.size):
        d = step * np.eye(phi.size)[k]
        ahead, behind = (framed.energy(phi + way * d, one, other, stiff)[0] for way in (1.0, -1.0))
        assert slope[k] == pytest.approx((ahead - behind) / (2.0 * step), rel=1e-6, abs=1e-6)


def test_a_strip_on_an_arc_on_edge_turns_flat_beside_its_ends():
    """Held on edge on an arc of curvature k it lies flat but for a layer at each end, where phi is half a separatrix of
    the pendulum c phi'' = -(a - b) k^2 sin phi cos phi of energy k (c (a - b))^(1/2)."""
    fields, k = strip(), 5.0
    b, a, c = stiff = stiff_of(fields)
    one, other = np.zeros(framed.PIECES + 1), np.full(framed.PIECES + 1, k)
    phi = framed.turned(fields, one, other, 0.0)
    assert phi[[0, -1]].tolist() == [0.0, 0.0]
    assert abs(np.sin(phi[framed.PIECES // 2])) == pytest.approx(1.0, abs=1e-6)
    layers = framed.energy(phi, one, other, stiff)[0] - 0.5 * b * k**2
    assert layers == pytest.approx(2.0 * k * np.sqrt(c * (a - b)), rel=0.02)


def test_a_normal_turns_over_beside_a_bend_and_not_in_it():
    """Ends half a turn against each other, a bend halfway: a constant twist has the strip on edge in it, and by
    symmetry a search from there ends with all of its turn in the bend; beside it that costs c pi^2 / (2 L) on a length
    L."""
    fields = strip()
    s = np.linspace(0.0, 1.0, framed.PIECES + 1)
    bend = 12.0 * np.exp(-(((s - 0.5) / 0.1) ** 2))
    phi = framed.turned(fields, bend, np.zeros(s.size), np.pi)
    twist = np.abs(np.gradient(phi, s))
    assert twist[np.abs(s - 0.5) < 0.05].max() < 0.02 * twist.max()
    assert abs(np.sin(phi[framed.PIECES // 2])) < 1e-3
    stiff = stiff_of(fields)
    turn = framed.energy(phi, bend, np.zeros(s.size), stiff)[0] - 0.5 * stiff[0] * float((bend**2).mean())
    assert turn < 0.5 * stiff[2] * np.pi**2 / 0.25
