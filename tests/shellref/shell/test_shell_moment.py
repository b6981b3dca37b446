"""A moment of fixed direction on the end edge of a shell: its work, its tangent, closed forms, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from shellref import Pose, ShellInputError, ShellOptions, ShellProblem, ShellStatus
from shellref.contact.walls import Wall
from shellref.fenics.rank import Corrected
from shellref.holds.moment import EdgeMoment
from shellref.shell.problem import IDENTITY
from tests.reference.bent_section import stiffness

WIDTH, MOMENT = 0.05, 3.0
ROLLED = ShellProblem(
    width=WIDTH, thickness=0.005, poisson=0.0, tip_moment=(MOMENT, 0.0, 0.0), elements=(40, 2), grading=(1.0, 1.0)
)
RNG = np.random.default_rng(29)


def solve(problem, **more):
    pytest.importorskip("dolfinx")
    from shellref.path.solve import solve as solve_shell

    return solve_shell(problem, **more)


def uneven_edge():
    """A state (9, 6) of an edge at nodes 2 to 8 that is curved, twisted and not straight, and a moment on it."""
    v = np.linspace(-0.3, 0.2, 7)
    state = RNG.standard_normal((9, 6))
    state[2:, :3] = np.outer(v, [0.3, 0.9, 0.2]) + 0.05 * RNG.standard_normal((7, 3))
    state[2:, 3:] = np.array([0.2, 0.1, 1.0]) + 0.2 * RNG.standard_normal((7, 3))
    state[:, 3:] /= np.linalg.norm(state[:, 3:], axis=1)[:, None]
    return state, EdgeMoment.on(np.arange(2, 9), v, RNG.uniform(0.5, 1.0, 7), np.array([0.7, -1.1, 0.4]))


def test_its_work_on_a_rigid_turn_is_that_of_the_moment_and_on_a_motion_none():
    state, moment = uneven_edge()
    f = moment.forces(state)
    omega, way = RNG.standard_normal((2, 3))
    turned = np.hstack([np.cross(omega, state[:, :3]), np.cross(omega, state[:, 3:])])
    assert np.sum(f * turned) == pytest.approx(moment.moment @ omega, rel=1e-12)
    assert np.sum(f[:, :3] @ way) == pytest.approx(0.0, abs=1e-12)


def test_its_tangent_is_that_of_its_forces_and_not_symmetric():
    state, moment = uneven_edge()
    step, size = RNG.standard_normal(state.shape), 1e-6
    exact = (moment.forces(state + size * step) - moment.forces(state - size * step)) / (2.0 * size)
    np.testing.assert_allclose(moment.stiff(state, step), exact, rtol=1e-7, atol=1e-7)
    columns, g = moment.columns(len(state)), moment.tangent(state)
    product = np.einsum("anx,ab,b->nx", columns, g, np.einsum("bmy,my->b", columns, step))
    np.testing.assert_allclose(product, exact, rtol=1e-7, atol=1e-7)
    assert np.abs(g - g.T).max() > 0.1


def test_solves_of_a_changed_matrix():
    """Against the matrix itself."""
    k, u, g = RNG.standard_normal((12, 12)), RNG.standard_normal((12, 3)), RNG.standard_normal((3, 3))

    class Factors:
        def solve(self, right):
            return np.linalg.solve(k, right)

    right = RNG.standard_normal(12)
    found = Corrected(Factors(), u, g).solve(right)
    np.testing.assert_allclose((k - u @ g @ u.T) @ found, right, rtol=0.0, atol=1e-10)


@pytest.mark.shell
def test_a_cantilever_without_contraction_is_the_arc_of_its_moment():
    """kappa = M l / (D w) about e_x, its inner energy M^2 / 2, its clamp exerts -M and no force, and stability, which a
    load without a potential does not have by inertia, is not claimed."""
    result = solve(ROLLED)
    assert result.status is ShellStatus.CONVERGED
    assert result.stable is None
    s = np.linspace(0.0, 1.0, 21)
    arc = np.stack([0.0 * s, (np.cos(MOMENT * s) - 1.0) / MOMENT, np.sin(MOMENT * s) / MOMENT], axis=1)
    np.testing.assert_allclose(result.surface.centreline(s), arc, atol=1e-4)
    assert result.energy["elastic"] == pytest.approx(0.5 * MOMENT**2, rel=1e-3)
    np.testing.assert_allclose(result.clamps["start"]["moment"], [-MOMENT, 0.0, 0.0], atol=1e-7)
    np.testing.assert_allclose(result.clamps["start"]["force"], 0.0, atol=1e-7)


@pytest.mark.shell
def test_edges_that_are_free_curl_as_lambs():
    """The curvature of a long strip with nu = 0.3, away from its ends: M = d/dk of the section's energy."""
    nu, k = 0.3, 3.2
    step = 1e-4

    def energy(k):
        return 0.5 * k**2 * stiffness(nu, WIDTH, 0.005, k)

    moment = (energy(k + step) - energy(k - step)) / (2.0 * step)
    result = solve(replace(ROLLED, poisson=nu, tip_moment=(moment, 0.0, 0.0), elements=(60, 4)))
    tangents = result.surface.frames(np.array([0.4, 0.6]))[:, :, 2]
    turn = np.arccos(np.clip(tangents[0] @ tangents[1], -1.0, 1.0))
    assert turn / 0.2 == pytest.approx(k, rel=1e-3)
    assert abs(k / moment - 1.0) > 0.05  # what D alone would say


@pytest.mark.shell
def test_in_its_plane_it_bends_as_a_beam():
    """About the normal with E h w^3 / 12 = D w (w/h)^2 where nu = 0: what a couple on directors could not do."""
    moment = 2.0
    result = solve(replace(ROLLED, tip_moment=(0.0, moment, 0.0), elements=(20, 2)))
    k = moment * (0.005 / WIDTH) ** 2
    assert result.surface.centreline(np.array([1.0]))[0, 0] == pytest.approx((1.0 - np.cos(k)) / k, rel=2e-3)


@pytest.mark.shell
def test_between_walls_it_settles_too():
    """A wall beneath the end: force and moment of clamp and wall are in balance with the moment."""
    wall = Wall((0.0, -0.2, 0.0), (0.0, 1.0, 0.0))
    result = solve(replace(ROLLED, walls=(wall,)))
    assert result.status is ShellStatus.CONVERGED
    (touch,), start = result.walls, result.clamps["start"]
    assert touch["force"][1] > 1.0
    np.testing.assert_allclose(touch["force"] + start["force"], 0.0, atol=1e-6)
    np.testing.assert_allclose(touch["moment"] + start["moment"] + [MOMENT, 0.0, 0.0], 0.0, atol=1e-6)


@pytest.mark.shell
def test_steps_are_newtons():
    """With the load's own tangent a twisting and bending moment takes few iterations, with none of it many more."""
    problem = replace(ROLLED, tip_moment=(6.0, -4.0, 3.0), elements=(24, 2))
    result = solve(problem, options=ShellOptions())
    assert result.status is ShellStatus.CONVERGED
    assert result.steps[-1].iterations <= 6
    np.testing.assert_allclose(result.clamps["start"]["moment"], [-6.0, 4.0, -3.0], atol=1e-6)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"tip_moment": (1.0, 2.0)}, "tip_moment"),
        ({"tip_moment": (1.0, 2.0, float("inf"))}, "tip_moment"),
        ({"clamp": "free"}, "tip_moment"),
        ({"holds": ("position", "nothing")}, "tip_moment"),
        ({"half_turns": 0}, "tip_moment"),
        ({"end": Pose((0.0, 0.0, 0.9), IDENTITY)}, "tip_moment"),
        ({"end": Pose((0.0, 0.0, 0.9), IDENTITY), "guided": True}, "tip_moment"),
    ],
)
def test_what_cannot_be_is_named(change, key):
    with pytest.raises(ShellInputError) as caught:
        replace(ROLLED, **change)
    assert caught.value.key == key


def test_branches_and_other_goals_refuse_it():
    """Both rest on a tangent that is symmetric."""
    from shellref.follow.equations import refused

    assert "moment" in (refused(ROLLED) or "")
    assert "moment" in (ROLLED.without_goal("end") or "")
