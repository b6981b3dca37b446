"""Clamps: poses along paths, both ends held, corners, free strips; forces and moments against balances and energies."""

from dataclasses import replace

import numpy as np
import pytest

from shellref import Pose, ShellOptions, ShellProblem, ShellStatus, Waypoint
from shellref.shell.clamps import PosePath, held_nodes, rotation, rotation_vector
from shellref.shell.midsurface import natural_curve
from shellref.shell.problem import IDENTITY

RNG = np.random.default_rng(8)
FLAT = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # t_x = e_y, t_y = e_z, t_z = e_x


def matrix(rows) -> tuple:
    return tuple(map(tuple, np.asarray(rows).tolist()))


def turns(angles):
    for angle in angles:
        axis = RNG.standard_normal(3)
        yield angle * axis / np.linalg.norm(axis)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 0.3, 1.57, 2.0, 3.0, np.pi - 1e-3, np.pi - 1e-7])
def test_rotation_vectors(angle):
    from scipy.spatial.transform import Rotation

    for vector in turns([angle] * 20):
        r = rotation(vector)
        np.testing.assert_allclose(r, Rotation.from_rotvec(vector).as_matrix(), atol=1e-14)
        np.testing.assert_allclose(rotation_vector(r), vector, atol=1e-9)


def test_half_a_turn_is_one_of_its_two_rotation_vectors():
    for axis in [*np.eye(3), *turns([1.0] * 10)]:
        r = 2.0 * np.outer(axis, axis) - np.eye(3)
        vector = rotation_vector(r)
        assert np.linalg.norm(vector) == pytest.approx(np.pi, rel=1e-12)
        np.testing.assert_allclose(rotation(vector), r, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1.0, 3.1, np.pi])
def test_a_pose_path_goes_straight_and_turns_the_shortest_way(angle):
    (vector,) = turns([angle])
    (tilt,) = turns([0.7])
    one = Pose((1.0, 2.0, 3.0), matrix(rotation(tilt)))
    two = Pose((0.0, 2.0, -1.0), matrix(rotation(vector) @ rotation(tilt)))
    path = PosePath((one, two, one))
    for move, pose in ((0.0, one), (1.0, two), (2.0, one)):
        position, frame = path.at(move)
        np.testing.assert_array_equal(position, pose.position)
        np.testing.assert_array_equal(frame, pose.frame)
    last = np.array(one.frame)
    for t in np.linspace(0, 1, 11)[1:]:
        position, frame = path.at(t)
        np.testing.assert_allclose(position, np.array(one.position) * (1 - t) + np.array(two.position) * t, atol=1e-14)
        np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-13)
        step = rotation_vector(frame @ last.T)
        assert np.linalg.norm(step) == pytest.approx(0.1 * angle, abs=1e-12)
        if 0 < angle < np.pi:
            np.testing.assert_allclose(step, 0.1 * vector, atol=1e-9)
        last = frame


def test_held_nodes():
    s, v = np.meshgrid(np.linspace(0, 1, 21), np.linspace(-0.1, 0.1, 9), indexing="ij")
    nodes = np.stack([s.ravel(), v.ravel()], axis=1)
    for at in (0.0, 1.0):
        edge = held_nodes(nodes, "edge", at, 0.1, (0.0, 0.0))
        assert edge.sum() == 9
        assert np.all(nodes[edge, 0] == at)
        corners = held_nodes(nodes, "corners", at, 0.1, (0.1, 0.05))
        assert corners.sum() == 3 * 6
        assert np.all(np.abs(nodes[corners, 1]) > 0.05 - 1e-9)
        assert np.all(np.abs(nodes[corners, 0] - at) < 0.1 + 1e-9)


pytest.importorskip("dolfinx")
from shellref.path.solve import solve  # noqa: E402

shell = pytest.mark.shell

# thesis 7.2: a strip rolled to an arc, let go, both clamps brought 0.5 apart and a little to the side
BRIDGE = ShellProblem(
    width=0.05,
    thickness=5e-4,
    poisson=0.3,
    start_curvature=-2.5,
    end=Pose((0.5, 0.01, 0.0), FLAT),
    path=(Waypoint(natural=1.0, name="release"),),
    clamp_frame=FLAT,
    elements=(24, 2),
)


@pytest.fixture(scope="module")
def bridge():
    return solve(BRIDGE, ShellOptions(tolerance=1e-11))


def moved(position=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0)) -> ShellProblem:
    """The bridge with its end displaced and turned."""
    frame = matrix(rotation(np.array(turn)) @ np.array(FLAT))
    return replace(BRIDGE, end=Pose(tuple(np.add(BRIDGE.end.position, position)), frame))


@shell
def test_both_clamps_hold_what_they_should(bridge):
    assert (bridge.status, bridge.stable) == (ShellStatus.CONVERGED, True)
    assert [s.stage for s in bridge.steps if s.load == 1.0] == ["release", "clamps"]
    points = bridge.surface.points
    across = np.outer(bridge.surface.v_nodes, [0, 1, 0])
    np.testing.assert_allclose(points[0], across, atol=1e-15)
    np.testing.assert_allclose(points[-1], across + np.array(BRIDGE.end.position), atol=1e-15)
    np.testing.assert_allclose(bridge.surface.directors[[0, -1]], np.tile([0.0, 0.0, 1.0], (2, 5, 1)), atol=1e-15)
    assert bridge.share["membrane"] < 0.02
    assert 15.0 < bridge.energy["elastic"] < 30.0  # 4 K(k) (2 E(k) - ...) of the planar arch is about 20


@shell
def test_forces_and_moments_of_both_clamps_balance(bridge):
    start, end = bridge.clamps["start"], bridge.clamps["end"]
    size = np.linalg.norm(start["force"])
    assert size > 10.0
    np.testing.assert_allclose(start["force"] + end["force"], 0.0, atol=1e-8 * size)
    lever = np.cross(BRIDGE.end.position, end["force"])
    np.testing.assert_allclose(start["moment"] + end["moment"] + lever, 0.0, atol=1e-8 * size)


@shell
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_forces_and_moments_are_derivatives_of_the_energy(bridge, axis):
    """Central differences of equilibrium energies with the end displaced, and turned, from the state itself."""
    t, unit = 1e-3, np.eye(3)[axis]
    for key, change in (("force", {"position": t * unit}), ("moment", {"turn": t * unit})):
        pair = []
        for sign in (1, -1):
            problem = moved(**{name: tuple(sign * value) for name, value in change.items()})
            pair.append(solve(problem, ShellOptions(stability=False), start=bridge.surface))
        assert all(other.status is ShellStatus.CONVERGED for other in pair)
        difference = (pair[0].energy["total"] - pair[1].energy["total"]) / (2 * t)
        assert difference == pytest.approx(bridge.clamps["end"][key][axis], rel=2e-3, abs=1e-3 * 52)


@shell
def test_a_strip_between_clamps_with_weight_balances():
    problem = replace(BRIDGE, gamma=8.0, up=(0.0, 0.0, 1.0))
    result = solve(problem)
    assert result.status is ShellStatus.CONVERGED
    total = result.clamps["start"]["force"] + result.clamps["end"]["force"]
    np.testing.assert_allclose(total, [0.0, 0.0, 8.0], atol=1e-6)


CORNERS = ShellProblem(
    width=0.2,
    thickness=5e-3,
    poisson=0.3,
    gamma=1.0,
    up=(0.0, 1.0, 0.0),
    clamp="corners",
    elements=(8, 4),
    grading=(1.0, 1.0),
)


@shell
def test_corners_of_a_size_converge_with_the_mesh_and_corner_cells_do_not():
    """Deflection of the end: corner = c is the same problem on every mesh, one cell of the mesh a smaller clamp."""
    meshes = ((8, 4), (16, 8), (24, 12))
    deflections = {}
    for c in (0.05, None):
        results = [solve(replace(CORNERS, corner=c, elements=mesh), ShellOptions(stability=False)) for mesh in meshes]
        assert all(result.status is ShellStatus.CONVERGED for result in results)
        deflections[c] = [-result.section(1.0)["position"][1] for result in results]
    fixed, cells = deflections[0.05], deflections[None]
    assert abs(fixed[2] - fixed[1]) < 0.4 * abs(fixed[1] - fixed[0])
    assert abs(fixed[2] - fixed[1]) < 0.002 * fixed[2]
    assert cells[0] < cells[1] < cells[2]
    assert cells[2] - cells[1] > 0.05 * cells[2]


@shell
def test_corners_carry_the_weight_and_its_moment():
    corner = solve(replace(CORNERS, corner=0.05))
    assert (corner.status, corner.stable) == (ShellStatus.CONVERGED, True)
    held = corner.surface.points[:2, :2]
    s, v = corner.surface.s_nodes[:2, None], corner.surface.v_nodes[None, :2]
    np.testing.assert_allclose(held, np.stack(np.broadcast_arrays(v, 0.0, s), axis=-1), atol=1e-15)
    np.testing.assert_allclose(corner.clamp_force, [0.0, 1.0, 0.0], atol=1e-7)
    assert corner.clamp_moment[0] == pytest.approx(-0.5, rel=0.02)  # the weight's lever is 1/2, nearly
    np.testing.assert_allclose(corner.clamp_moment[1:], 0.0, atol=1e-7)


@shell
@pytest.mark.parametrize("curvature", [np.pi, 10.0, 3 * np.pi])
@pytest.mark.parametrize("path", ["exact", "stepped"])
def test_a_free_strip_takes_its_natural_shape(curvature, path):
    """Nothing held but rigid motions: no energy, the chord of the natural arc; a quarter turn at the middle too."""
    problem = ShellProblem(
        width=0.05, thickness=5e-4, poisson=0.3, natural_curvature=(curvature,) * 2, clamp="free", elements=(30, 2)
    )
    result = solve(problem, ShellOptions(natural_path=path))
    assert (result.status, result.stable, result.clamps) == (ShellStatus.CONVERGED, True, {})
    assert result.energy["elastic"] < 1e-3 * 0.5 * curvature**2
    ends = np.array([result.section(s)["position"] for s in (0.0, 1.0)])
    z, y = natural_curve(np.array([0.0, 1.0]), (curvature, curvature))
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(np.hypot(np.diff(z), np.diff(y))[0], abs=1e-3)
    assert len(result.to_dict()["clamps"]) == 0


def test_a_pose_is_read_from_a_table():
    assert Pose.read("end", {"position": [0, 0, 1], "frame": IDENTITY}) == Pose((0.0, 0.0, 1.0), IDENTITY)
