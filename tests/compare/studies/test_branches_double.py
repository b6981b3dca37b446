"""Branch points with two null vectors, or all but two, of scenes whose linear theory is solved: a ring that is curled
more than once round, a column whose second mode one way falls with its first mode the other way."""

import numpy as np

from compare.scene.scene import loads
from compare.studies.branches.run import Asked, diagram

RING = """
title = "A ring that is curled five times as much"
[strip]
length = 1.0
width = 0.02
thickness = 1e-3
poisson = 0.3
gamma = 0.0
natural_curvature = 28.0
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[closure]
kind = "circle"
[model]
energy = "kirchhoff"
elements = 20
"""
COLUMN = """
title = "A column three times as wide as thick"
[strip]
length = 0.3
width = 0.006
thickness = 0.002
poisson = 0.0
young = 7e10
density = 2700.0
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [1.0, 0.0, 0.0]
[tip]
force = [0.0, 0.0, -1.0]
[model]
energy = "kirchhoff"
elements = 20
"""


def curled(torsion, in_plane):
    """K l at which a circle that is bent from the curvature K leaves its plane, of bending stiffness 1.

    Turns psi = (psi_t, psi_n) in the frame of the circle, of curvature k = 2 pi / l, change its twist and its bending
    in the plane of the strip by psi_t' - k psi_n and psi_n' + k psi_t, and the bending that carries the moment
    1 - K / k to second order by half the first times psi_n less half the second times psi_t. With psi_n = a cos 2 k s,
    psi_t = b sin 2 k s the energy is a quadratic form of a and b; it is zero for m = 1 - K / k below zero at
    m^2 - m (C + B) - 3 C B = 0, twice, as cosines and sines have it."""
    both = torsion + in_plane
    return 2.0 * np.pi * (1.0 - 0.5 * (both - np.sqrt(both**2 + 12.0 * torsion * in_plane)))


def test_a_curled_ring_leaves_its_plane_where_linear_theory_says_by_a_circle_of_branches():
    """On twenty elements the circle is one but for what they miss, and its branch goes on all the same."""
    part, nu = 0.05, 0.3  # h / w
    n = np.arange(1, 99, 2)
    torsion = 2.0 * (1.0 - nu) * (1.0 - 192.0 * part / np.pi**5 * np.sum(np.tanh(0.5 * n * np.pi / part) / n**5))
    asked = Asked(branches=2, points=False)
    own, buckled = diagram(loads(RING), "strip.natural_curvature", 28.0, 33.0, asked=asked).branches
    (fork,) = own.special
    assert len(fork.critical) == 2
    assert abs(fork.settled.value - curled(torsion, (1.0 - nu**2) / part**2)) <= fork.error < 1e-4
    assert {point.unstable for point in own.points if point.parameter > fork.parameter} == {2}
    assert (buckled.circle, buckled.ended) == (True, "range")
    assert {point.unstable for point in buckled.points} == {1}


def test_two_branch_points_that_finer_elements_no_longer_tell_apart_each_keep_their_place():
    """Both at nine times Euler's load: 4e-6 of it apart on 20 elements, 2e-8 on 80, where they are one."""
    euler = 0.25 * np.pi**2 * 7e10 * 0.006 * 0.002**3 / 12.0 / 0.3**2
    asked = Asked(branches=1, points=False)
    (own,) = diagram(loads(COLUMN), "tip.force[2]", -1.0, -75.0, asked=asked).branches
    assert [len(fork.critical) for fork in own.special] == [1, 1, 1]
    for fork, times in zip(own.special, (1.0, 9.0, 9.0), strict=True):
        assert abs(fork.settled.value + times * euler) <= fork.error < 1e-5
