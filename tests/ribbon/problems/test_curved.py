"""Contact with cylinders and spheres: gaps and their derivatives, and what equilibria beside them must satisfy."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ribbon import Clamp, Equilibrium, Gravity, RibbonInputError, Strip, Wall, gradients, solve
from ribbon.find.solve import build
from ribbon.obstacle import Obstacle
from ribbon.problems.curved.placed import placed
from ribbon.problems.touching import Touch

TILTED = np.array([0.6, 0.48, 0.64])
OBSTACLES = {
    "cylinder": Obstacle("cylinder", (0.1, -0.6, 0.3), 0.4, TILTED),
    "tube": Obstacle("cylinder", (0.1, -0.6, 0.3), 3.0, TILTED, inside=True),
    "sphere": Obstacle("sphere", (0.1, -0.6, 0.3), 0.4),
    "ball": Obstacle("sphere", (0.1, -0.6, 0.3), 3.0, inside=True),
}
UP = (0.0, 1.0, 0.0)
STRIP = Strip(1.0, 0.1, 0.3, gamma=20.0, thickness=5e-3)
ENERGIES = ("wunderlich", "finite", "kirchhoff")


def turn(q: np.ndarray, y: np.ndarray) -> np.ndarray:
    """R(q) y, not normalised, of a complex quaternion (4,) too (docs/theory.md, eq. (4.1))."""
    w, v = q[0], q[1:]
    return (w * w - v @ v) * y + 2.0 * (v @ y) * v + 2.0 * w * np.cross(v, y)


@pytest.mark.parametrize("name", OBSTACLES)
def test_the_gap_of_a_point_by_complex_steps(name):
    """Gradient and second derivative by r, q and two parameters of y, against complex steps of the gap alone."""
    surface, rng = OBSTACLES[name], np.random.default_rng(3)
    linear, quadratic = rng.normal(size=(3, 2)), rng.normal(size=(3, 2, 2))
    quadratic = quadratic + np.swapaxes(quadratic, 1, 2)
    base = rng.normal(size=9)

    def y(z: np.ndarray) -> np.ndarray:
        return np.array([0.2, -0.1, 0.3]) + linear @ z + 0.5 * np.einsum("rij,i,j->r", quadratic, z, z)

    def gap(c: np.ndarray) -> complex:
        return surface.gaps((c[:3] + turn(c[3:7], y(c[7:])))[None, :])[0]

    def full(c: np.ndarray):
        by_z = linear + np.einsum("rij,j->ri", quadratic, c[7:])
        return placed(surface, c[None, :3], c[None, 3:7], y(c[7:])[None, :], by_z[None], quadratic[None])

    here = full(base)
    slope = np.einsum("ka,kac->kc", here.normal, here.slopes)[0]
    steps = 1e-30j * np.eye(9)
    assert slope == pytest.approx([gap(base + step).imag / 1e-30 for step in steps], abs=1e-13)
    for k, way in enumerate(np.eye(9)):
        ahead, behind = (full(base + sign * 1e-5 * way) for sign in (1.0, -1.0))
        change = [np.einsum("ka,kac->kc", at.normal, at.slopes)[0] for at in (ahead, behind)]
        assert here.second[0, k] == pytest.approx((change[0] - change[1]) / 2e-5, abs=1e-7)


def shape_beside(surface: Obstacle, energy: str, touches: tuple[Touch, ...]):
    """A problem beside an obstacle and a shape of it that is not glued."""
    problem = build(
        STRIP, Clamp(None, None, None), Gravity(UP), walls=[Wall((0.0, -9.0, 0.0), UP), surface], energy=energy,
        segments=[0.2, 0.3, 0.5], formulation="mixed",
    )  # fmt: skip
    problem = problem.with_changes(touching=touches)
    rng = np.random.default_rng(1)
    n = problem.lengths.size + 1
    x = problem.state(3.0 * rng.normal(size=n), 0.3 * rng.normal(size=n), rng.normal(size=n))
    for k in range(n):
        x[problem.layout.joint(k).quaternion] += 0.2 * rng.normal(size=4)
    return problem, x, rng


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("name", OBSTACLES)
def test_derivatives_of_rows_have_their_orders(name, energy):
    """At joints; of points on edges and between; where they slide and where they do not."""
    surface = OBSTACLES[name]
    fixed = (Touch(1, 0.05, 1.0), Touch(1, 0.33, -1.0), Touch(1, 0.9, 1.0))
    inner = () if surface.inside else (Touch(1, 0.1, 0.2), Touch(1, 0.37, 0.0), Touch(1, 0.8, 0.0))
    inner += tuple(touch._replace(slides=True) for touch in (*fixed, *inner))
    problem, x, rng = shape_beside(surface, energy, fixed + inner)
    ways = rng.normal(size=(4, x.size))
    steps = 5e-4 * 0.5 ** np.arange(4)
    for block in ("wall_1", "touch_1"):
        rows = problem.blocks()[block]
        jacobian = np.zeros((rows.count, x.size))
        np.add.at(jacobian, rows.jacobian_structure(), rows.jacobian(x))
        for number in range(rows.count):
            push = np.zeros(rows.count)
            push[number] = 1.0
            hessian = np.zeros((x.size, x.size))
            np.add.at(hessian, rows.hessian_structure(), rows.hessian(x, push))
            hessian += np.tril(hessian, -1).T
            first, second = np.zeros(steps.size), np.zeros(steps.size)
            for way in ways:
                ahead = np.array([rows.values(x + h * way)[number] for h in steps])
                left = ahead - rows.values(x)[number] - steps * (jacobian[number] @ way)
                first += left**2
                second += (left - 0.5 * steps**2 * (way @ hessian @ way)) ** 2
            assert 1.85 < 0.5 * np.log2(first[-2] / first[-1]) < 2.15, (block, number)
            assert 2.6 < 0.5 * np.log2(second[-2] / second[-1]) < 3.4, (block, number)


# -- equilibria: what the shape says, read as data and not from rows --------------------------------------------------

LAID = {
    "cylinder": Obstacle("cylinder", (0.0, -0.2, 0.6), 0.1, (1.0, 0.0, 0.0)),
    "skew": Obstacle("cylinder", (0.0, -0.2, 0.6), 0.1, np.array([1.0, 0.2, 0.3]) / np.sqrt(1.13)),
    "sphere": Obstacle("sphere", (0.0, -0.2, 0.6), 0.1),
    "aside": Obstacle("sphere", (0.02, -0.2, 0.6), 0.1),
    "tube": Obstacle("cylinder", (0.0, 0.4, 0.0), 0.5, (0.0, 0.0, 1.0), inside=True),
    "ball": Obstacle("sphere", (0.0, 0.3, 0.3), 0.6, inside=True),
}


@cache
def laid(name: str, energy: str = "wunderlich", mirrored: bool = False, turned: bool = False) -> Equilibrium:
    """A heavy cantilever on an obstacle, or that and its mirror image, or all of it turned in space."""
    surface, flip = LAID[name], np.array([-1.0 if mirrored else 1.0, 1.0, 1.0])
    spin = Rotation.from_rotvec([0.4, -0.9, 0.3] if turned else [0.0, 0.0, 0.0]).as_matrix()
    axis = None if surface.axis is None else spin @ (flip * np.asarray(surface.axis))
    surface = Obstacle(surface.kind, spin @ (flip * np.asarray(surface.point)), surface.radius, axis, surface.inside)
    clamp = Clamp((0.0, 0.0, 0.0), tangent=spin @ [0.0, 0.0, 1.0], normal=spin @ [0.0, 1.0, 0.0])
    found = solve(STRIP, clamp, Gravity(spin @ np.array(UP)), walls=[surface], energy=energy, segments=40)
    assert found.ok, found.message
    return found


def surface_points(found: Equilibrium) -> np.ndarray:
    """Points all over the rulings, or the sections of a free twist, joints and edges among them: (k, 3)."""
    r, frames, _, eta = found.continued(np.linspace(0.0, 1.0, 1601))
    ruling = frames[:, :, 0] + (0.0 if found.has_free_twist else eta[:, None] * frames[:, :, 2])
    half = 0.5 * STRIP.relative_width * np.linspace(-1.0, 1.0, 17)
    return np.asarray(r[:, None, :] + half[:, None] * ruling[:, None, :]).reshape(-1, 3)


@pytest.mark.parametrize("energy", ["wunderlich", "finite"])
@pytest.mark.parametrize("name", LAID)
def test_nothing_is_behind_and_forces_and_moments_balance(name, energy):
    found, surface = laid(name, energy), LAID[name]
    apart = surface_points(found) - np.asarray(surface.point)
    if surface.axis is not None:
        apart = apart - np.outer(apart @ surface.axis, surface.axis)
    gaps = (np.linalg.norm(apart, axis=1) - surface.radius) * (-1.0 if surface.inside else 1.0)
    assert gaps.min() > -1e-6
    assert found.penetration < 1e-6
    (wall,) = found.walls
    assert gaps.min() < 1e-4  # it touches: of points half a grid cell apart
    assert np.linalg.norm(wall.force) > 0.1
    weight = np.array([0.0, -20.0, 0.0])
    assert found.start.force + wall.force + weight == pytest.approx(np.zeros(3), abs=1e-7)
    s = np.linspace(0.0, 1.0, 4001)
    line = np.asarray(found.continued(s)[0])
    centre = 0.5 * (line[1:] + line[:-1]).mean(axis=0)
    left = found.start.moment + wall.moment + np.cross(centre, weight)
    assert left == pytest.approx(np.zeros(3), abs=2e-5)  # of the rule for the centre of mass


@pytest.mark.parametrize("name", LAID)
def test_pushes_are_where_it_touches_and_never_pull(name):
    found = laid(name)
    problem = found.problem
    for block in ("wall_0", "touch_0"):
        if block in problem.block_slices():
            rows = problem.blocks()[block]
            push, gap = -found.rows[problem.block_slices()[block]], rows.values(found.x)
            assert push.min() > -1e-8
            assert float(np.abs(push * np.maximum(gap, 0.0)).max()) < 1e-8


@pytest.mark.parametrize("name", ["skew", "aside", "ball"])
def test_mirror_images_and_turned_scenes_are_the_same_state(name):
    one, other, turned = laid(name), laid(name, mirrored=True), laid(name, turned=True)
    assert other.energy.total == pytest.approx(one.energy.total, abs=2e-7)
    assert turned.energy.total == pytest.approx(one.energy.total, abs=2e-7)
    flip = np.array([-1.0, 1.0, 1.0])
    assert np.asarray(other.end.position) == pytest.approx(flip * np.asarray(one.end.position), abs=2e-5)
    spin = Rotation.from_rotvec([0.4, -0.9, 0.3]).as_matrix()
    assert np.asarray(turned.end.position) == pytest.approx(spin @ np.asarray(one.end.position), abs=2e-5)


def test_a_sphere_that_a_flat_strip_meets_in_its_middle_is_a_cylinder_across():
    """One point between the edges, or both edges: the same planar state (`finite` bends its ruling nowhere)."""
    across, ball = laid("cylinder"), laid("sphere")
    assert ball.energy.total == pytest.approx(across.energy.total, abs=1e-8)
    (wall,) = ball.walls
    assert np.abs(wall.ends[:, 1]).max() < 1e-9  # between the edges
    assert wall.force == pytest.approx(across.walls[0].force, abs=1e-5)


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("kind", ["cylinder", "sphere"])
def test_a_large_radius_is_a_plane(kind, inside):
    """What is left falls with the radius R as 1 / (2 R): the sagitta over the strip's length."""
    plane = solve(STRIP, Clamp(), Gravity(UP), walls=[Wall((0.0, -0.1, 0.0), UP)], segments=40)
    far = []
    for radius in (1e5, 5e5):
        centre = -0.1 + radius * (1.0 if inside else -1.0)
        axis = (1.0, 0.0, 0.0) if kind == "cylinder" else None
        round_one = Obstacle(kind, (0.0, centre, 0.0), radius, axis, inside)
        found = solve(STRIP, Clamp(), Gravity(UP), walls=[round_one], segments=40)
        assert found.ok
        far.append(abs(found.energy.total - plane.energy.total) * radius)
        assert found.walls[0].force == pytest.approx(plane.walls[0].force, abs=20.0 / radius)
    assert far[1] == pytest.approx(far[0], rel=0.05)
    assert far[1] < 10.0


def test_rigid_motions_that_are_left():
    """Two of a strip that nothing else holds in a tube, three turns in a ball; a weight takes what it resists."""
    free = Clamp(None, None, None)

    def left(surface: Obstacle, clamp=free) -> tuple[int, int]:
        problem = build(Strip(1.0, 0.1), clamp, walls=[surface], energy="sadowsky", segments=4, formulation="mixed")
        return tuple(len(part) for part in problem.free_motions())

    tube, ball = LAID["tube"], LAID["ball"]
    assert left(tube) == (1, 1)
    assert left(ball) == (0, 3)
    heavy = Strip(1.0, 0.1, gamma=1.0)
    across, along = Gravity(UP), Gravity((0.0, 0.0, 1.0))
    problem = build(heavy, free, across, walls=[tube], energy="sadowsky", segments=4, formulation="mixed")
    assert tuple(len(part) for part in problem.free_motions()) == (1, 0)
    problem = build(heavy, free, along, walls=[tube, Wall((0, 0, -1), (0, 0, 1))], energy="sadowsky", segments=4,
                    formulation="mixed")  # fmt: skip
    assert tuple(len(part) for part in problem.free_motions()) == (0, 1)
    assert left(tube, clamp=Clamp((0.0, 0.0, 0.0), None, None)) == (0, 0)
    assert left(ball, clamp=Clamp((0.0, 0.0, 0.3), None, None)) == (0, 1)


def test_a_strip_that_nothing_holds_lies_in_a_gutter():
    """Weight is all that there is: what the gutter pushes carries it, and the strip lies along its lowest line."""
    gutter = Obstacle("cylinder", (0.0, 0.5, 0.0), 0.5, (0.0, 0.0, 1.0), inside=True)
    found = solve(Strip(1.0, 0.1, gamma=5.0), Clamp(None, None, None), Gravity(UP), walls=[gutter], segments=10)
    assert found.ok, found.message
    assert found.walls[0].force == pytest.approx([0.0, 5.0, 0.0], abs=1e-7)
    lowest = 0.5 - np.sqrt(0.25 - 0.05**2)
    assert found.energy.gravity == pytest.approx(5.0 * lowest, abs=1e-5)


@pytest.mark.parametrize(
    ("key", "what"),
    [
        ("radius", {"radius": 0.0}), ("radius", {"radius": float("nan")}), ("axis", {"axis": (1.0, 1.0, 0.0)}),
        ("axis", {"axis": None}), ("point", {"point": (0.0, 0.0)}), ("kind", {"kind": "cone"}),
        ("axis", {"kind": "sphere"}),
    ],
)  # fmt: skip
def test_what_is_no_obstacle_is_refused(key, what):
    whole = {"kind": "cylinder", "point": (0.0, 0.0, 0.0), "radius": 1.0, "axis": (1.0, 0.0, 0.0)}
    with pytest.raises(RibbonInputError) as caught:
        Obstacle(**{**whole, **what})
    assert caught.value.key == key


def test_what_cannot_be_beside_an_obstacle_is_refused():
    around = Obstacle("sphere", (0.0, 0.0, 0.0), 0.2)
    with pytest.raises(RibbonInputError, match=r"clamp\.position"):
        solve(STRIP, Clamp(), Gravity(UP), walls=[around], segments=4)
    beside = LAID["cylinder"]
    with pytest.raises(RibbonInputError, match="formulation"):
        solve(STRIP, Clamp(), Gravity(UP), walls=[beside], segments=4, formulation="matrix")
    with pytest.raises(RibbonInputError, match="radius"):
        solve(STRIP, Clamp(), Gravity(UP), walls=[Obstacle("sphere", (0.0, -2e-6, 0.5), 1e-6)], segments=4)
    falls = Obstacle("cylinder", (0.0, 0.0, 0.0), 0.5, UP, inside=True)
    with pytest.raises(RibbonInputError, match="gravity"):
        solve(STRIP, Clamp(None, None, None), Gravity(UP), walls=[falls], segments=4)


def test_the_weight_gradient_of_the_energy_is_the_gravity_part():
    """Derivatives of equilibria know of round obstacles, but for those by the width, which are refused."""
    found = laid("skew")
    slope = gradients(found, ["gamma"]).energy()["gamma"]
    assert float(slope) == pytest.approx(found.energy.gravity / 20.0, rel=1e-8)
