"""Shells that are no plane at rest: the reference surface, states without stress, clamps, tables of K(s), refusals."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from shellref import ShellOptions, ShellProblem
from shellref.inputs import ShellInputError
from shellref.path.begin import begun
from shellref.rod.problem import RodProblem, rectangle, rest_shape
from shellref.rod.quaternion import rotation
from shellref.shell.midsurface import Annulus, Ruled
from shellref.shell.problem import Pose
from shellref.shell.strip import build_strip, rest_end, strip_grid

TABLE = ((0.0, 1.5), (0.4, -2.0), (1.0, 1.5))
S = np.array([0.0, 0.15, 0.4, 0.63, 1.0])


def solved(**more):
    given = {"width": 0.1, "thickness": 2e-3, "poisson": 0.3, "elements": (8, 2), "grading": (1.0, 1.0)}
    return begun(ShellProblem(**{**given, **more}), ShellOptions(), lambda event: None).result


def test_an_annulus_is_that_of_the_plane():
    """kappa_2 alone: a ring about the point 1 / kappa_2 along t_x, with the ring's own Lame factors."""
    k, v = 2.0, np.full(5, 0.05)
    points, normals = Ruled(in_plane=(k, k)).place(S, v)
    radius, angle = 1.0 / k - v, k * S
    ring, _ = Annulus().place(math.pi - angle, radius)
    np.testing.assert_allclose(points - np.array([1.0 / k, 0.0, 0.0]), ring, atol=1e-15)
    np.testing.assert_allclose(normals, np.tile([0.0, 1.0, 0.0], (5, 1)), atol=1e-15)
    np.testing.assert_allclose(Ruled(in_plane=(k, k)).lame(S, v)[:, 0], k * radius, rtol=1e-14)


def test_a_helicoid_is_that_of_the_formula():
    points, normals = Ruled(twist=(3.0, 3.0)).place(S, np.full(5, 0.05))
    turn = 3.0 * S
    np.testing.assert_allclose(points, np.stack([0.05 * np.cos(turn), 0.05 * np.sin(turn), S], axis=1), atol=1e-15)
    across = np.stack([-np.sin(turn), np.cos(turn), np.full(5, -0.15)], axis=1) / math.hypot(1.0, 0.15)
    np.testing.assert_allclose(normals, across, atol=1e-15)


@pytest.mark.parametrize("laws", [((1.5, 1.5), (2.0, 2.0), (0.7, 0.7)), (TABLE, (2.0, -1.0), (0.7, 3.0))])
def test_coordinates_are_orthogonal_and_lengths_are_lame(laws):
    """By central differences; the frame turns by the rod's own law (1.1)."""
    surface, v, h = Ruled(*laws), np.full(3, 0.04), 1e-5
    s = np.array([0.2, 0.55, 0.9])
    along = (surface.place(s + h, v)[0] - surface.place(s - h, v)[0]) / (2 * h)
    across = (surface.place(s, v + h)[0] - surface.place(s, v - h)[0]) / (2 * h)
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), surface.lame(s, v)[:, 0], rtol=1e-8)
    assert np.abs(np.sum(along * across, axis=1)).max() < 1e-9
    normal = np.cross(along, across) / np.linalg.norm(np.cross(along, across), axis=1)[:, None]
    np.testing.assert_allclose(normal, surface.place(s, v)[1], atol=1e-8)


def test_the_rod_at_rest_stands_on_the_surface():
    """The same kappa: centreline and frames of the shearable rod's own integration, in any place of the frame."""
    problem = RodProblem(rectangle(0.1, 1e-3, 0.3), TABLE, (2.0, -1.0), (0.7, 3.0))
    points, turns = rest_shape(problem, S)
    own, frames = Ruled(TABLE, (2.0, -1.0), (0.7, 3.0)).frames(S)
    np.testing.assert_allclose(own, points, atol=2e-9)
    np.testing.assert_allclose(frames, rotation(turns), atol=2e-9)
    moved, turned = Ruled(TABLE, (2.0, -1.0), (0.7, 3.0), origin=0.4).frames(S)
    np.testing.assert_allclose(own[2] + moved @ frames[2].T, own, atol=1e-12)
    np.testing.assert_allclose(np.einsum("ij,njk->nik", frames[2], turned), frames, atol=1e-12)


@pytest.mark.parametrize("clamp", ["edge", "free"])
def test_a_strip_without_load_is_its_rest_shape(clamp):
    """No energy, no force of the clamp, and every particle where the rod at rest has it."""
    laws = {"natural_curvature": (1.0, 2.0), "natural_twist": (2.0, 1.0), "natural_geodesic_curvature": (1.5, 1.5)}
    result = solved(clamp=clamp, **laws)
    assert result.status == "converged"
    assert abs(result.energy["elastic"]) < 1e-20
    if clamp == "edge":
        surface = Ruled((1.0, 2.0), (1.5, 1.5), (2.0, 1.0))
        s, v = (x.ravel() for x in np.meshgrid(result.surface.s_nodes, result.surface.v_nodes, indexing="ij"))
        np.testing.assert_allclose(result.surface.points.reshape(-1, 3), surface.place(s, v)[0], atol=1e-12)
        assert np.abs(result.clamp_force).max() < 1e-9


def test_both_ends_held_where_the_rest_shape_has_them():
    """Nothing is stressed; a little aside, the clamps' forces balance."""
    problem = ShellProblem(0.1, 2e-3, 0.3, natural_twist=(1.0, 1.0), natural_geodesic_curvature=(1.0, 1.0))
    home = rest_end(problem, problem.start, (0.0, 0.0))
    laws = {"natural_twist": (1.0, 1.0), "natural_geodesic_curvature": (1.0, 1.0)}
    assert abs(solved(end=home, **laws).energy["elastic"]) < 1e-18
    aside = Pose((home.position[0], home.position[1] + 0.05, home.position[2] - 0.05), home.frame)
    result = solved(end=aside, **laws)
    assert result.status == "converged"
    np.testing.assert_allclose(result.clamps["start"]["force"] + result.clamps["end"]["force"], 0.0, atol=1e-7)
    held = result.surface.points[-1]
    np.testing.assert_allclose(held.mean(axis=0), aside.position, atol=1e-12)


def test_work_of_the_end_is_the_change_of_the_energy():
    """The end of an annular strip moved across its plane: dE = F du by central differences (virtual work)."""
    problem = ShellProblem(0.1, 5e-3, 0.3, natural_geodesic_curvature=(2.0, 2.0))
    home = rest_end(problem, problem.start, (0.0, 0.0))

    def at(height):
        end = Pose((home.position[0], height, home.position[2]), home.frame)
        return solved(end=end, thickness=5e-3, natural_geodesic_curvature=(2.0, 2.0))

    low, here, high = (at(0.03 + d) for d in (-5e-4, 0.0, 5e-4))
    slope = (high.energy["elastic"] - low.energy["elastic"]) / 1e-3
    assert here.clamps["end"]["force"][1] == pytest.approx(slope, rel=1e-3)


def test_knots_stand_at_the_points_of_a_table():
    table = ((0.0, 1.0), (0.31, 2.0), (0.8, 3.0), (1.0, 0.0))
    problem = ShellProblem(0.1, 1e-3, 0.0, table, elements=(10, 2), grading=(1.0, 1.0))
    grid = strip_grid(problem)
    for place in (0.31, 0.8):
        assert np.abs(grid.s_knots - place).min() == 0.0
    assert np.diff(grid.s_knots).min() > 0.02
    assert build_strip(problem, ShellOptions()).body.grid.elements[0] in (10, 11)


def stored(result):
    """Bending, membrane and shear energy."""
    return sum(result.energy[part] for part in ("bending", "membrane", "shear"))


def stabilisation_energy(table, size, c, poisson):
    """That of a quadratically interpolated cylinder of curvature K, its elements of length h_e = `size`.

    r_SSS = -K^2 t - K' n, so r_S errs by -r_SSS (h_e / 2)^2 (3 x^2 - 1) / 6 at x in [-1, 1] of an element, which is
    eps_11 = K^2 h_e^2 (3 x^2 - 1) / 24 and gam_1 = K' h_e^2 (3 x^2 - 1) / 24 up to signs (the director errs by h_e^3):
    zero at the reduced points, of mean squares K^4 h_e^4 / 720 and K'^2 h_e^4 / 720. In (7.3), times
    alpha = c (h / h_e)^2:

        E = c h_e^2 int (K^4 / 120 + (1 - nu) K'^2 / 288) dS
    """
    total = 0.0
    for (a, first), (b, last) in pairwise(table):
        slope = (last - first) / (b - a)
        total += (last**5 - first**5) / (5.0 * slope) / 120.0 + (1.0 - poisson) * slope**2 * (b - a) / 288.0
    return c * size**2 * total


def test_a_table_without_load_is_a_cylinder_without_energy():
    """But for the interpolation: h_e^4 of the bending, as strains err by h_e^2, and h_e^2 of the stabilisation."""
    coarse, fine = (solved(natural_curvature=TABLE, elements=(n, 2)) for n in (10, 20))
    linear = solved(natural_curvature=(1.0, 3.0), elements=(10, 2))
    assert 0.0 < coarse.energy["elastic"] < linear.energy["elastic"] < 1e-4  # of the interpolation, as of a linear law
    assert stored(coarse) / stored(fine) > 12.0
    for found, size in ((coarse, 0.1), (fine, 0.05)):
        foreseen = stabilisation_energy(TABLE, size, found.stabilisation["c"], 0.3)
        assert found.energy["stabilisation"] == pytest.approx(foreseen, rel=5.0 * size**2)  # relative h_e^2 left out
    aside = solved(natural_curvature=(TABLE[0], (0.37, -2.0), TABLE[2]), elements=(10, 2))
    assert stored(aside) < stored(coarse)  # no element has a kink in it: 200 times as much where one has
    law = solved(natural_curvature=((0.0, 1.0), (0.3, 1.6), (1.0, 3.0)), elements=(10, 2))  # a knot at 0.3 in both
    plain = solved(natural_curvature=(1.0, 3.0), elements=(10, 2))
    end = [r.surface.centreline(np.array(1.0)) for r in (law, plain)]
    np.testing.assert_allclose(*end, atol=1e-7)


@pytest.mark.parametrize(
    ("given", "key"),
    [
        ({"natural_curvature": ((0.0, 1.0), (0.5, 2.0))}, "natural_curvature"),
        ({"natural_curvature": ((0.0, 1.0), (0.7, 2.0), (0.5, 2.0), (1.0, 0.0))}, "natural_curvature"),
        ({"natural_twist": ((0.0, 1.0), (0.7, 2.0), (0.9, 2.0))}, "natural_twist"),
        ({"natural_twist": "much"}, "natural_twist"),
        ({"natural_geodesic_curvature": (20.0, 20.0)}, "natural_geodesic_curvature"),
        ({"natural_twist": (1.0, 1.0), "transverse_curvature": 3.0}, "transverse_curvature"),
        ({"natural_twist": (1.0, 1.0), "clamp": "corners"}, "clamp"),
        ({"natural_twist": (1.0, 1.0), "clamp": "free", "half_turns": 1}, "half_turns"),
        ({"natural_geodesic_curvature": (1.0, 1.0), "holds": ("position", "all")}, "holds"),
    ],
)
def test_what_cannot_be_is_refused_by_name(given, key):
    with pytest.raises(ShellInputError) as caught:
        ShellProblem(**{"width": 0.1, "thickness": 1e-3, "poisson": 0.3, **given})
    assert caught.value.key == key
