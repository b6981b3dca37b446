"""Contact between the joints (docs/theory.md, eq. (5.7)): its rows, and that no equilibrium goes through a wall."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ribbon import Clamp, Equilibrium, Gravity, Status, Strip, Wall, solve
from ribbon.element import quaternion
from ribbon.find.continuation import follow
from ribbon.find.solve import build
from ribbon.judge.penetration import TOLERANCE, deepest
from ribbon.problems.touching import Touch, TouchRows

UP = (0.0, 1.0, 0.0)
STRIP = Strip(1.0, 0.2, gamma=3.0, thickness=0.01)
ENERGIES = ("wunderlich", "finite", "kirchhoff")


def tilted(energy: str, plate: float | None = None, where: str = "any"):
    """A free strip between a tilted wall and a plate, and a shape of it that is not glued. where "fixed": held at
    points in its segments; else where its segments are nearest, "inside" them or at "any" place."""
    walls = (Wall((0.1, -0.2, 0.3), (0.6, 0.8, 0.0)), Wall((0.0, 2.0, 0.0), (0.0, -1.0, 0.0), plate))
    problem = build(
        STRIP, Clamp(None, None, None), Gravity(UP), walls=walls, energy=energy, segments=[0.2, 0.3, 0.5],
        formulation="mixed",
    )  # fmt: skip
    points = Touch(0, 0.05, 1.0), Touch(0, 0.33, -1.0), Touch(1, 0.9, 1.0)
    problem = problem.with_changes(touching=tuple(point._replace(slides=where != "fixed") for point in points))
    rng = np.random.default_rng(1)
    n = problem.lengths.size + 1
    x = problem.state(3.0 * rng.normal(size=n), 0.3 * rng.normal(size=n), rng.normal(size=n))
    for touch in problem.touching:  # rows ask for no glue: each segment is turned at will
        joint = problem.layout.joint(problem.segment_at(touch.s))
        rows = problem.blocks()[f"touch_{touch.wall}"]
        row = [other for other in problem.touching if other.wall == touch.wall].index(touch)
        for _ in range(1000 if where == "inside" else 1):
            q = rng.normal(size=4)
            x[joint.quaternion] = q / np.linalg.norm(q)
            if 0.0 < rows.places(x)[row] < problem.lengths[rows.segments[row]]:
                break
    return problem, x, rng


@pytest.mark.parametrize("plate", [None, 50.0])
@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("where", ["fixed", "inside"])
def test_derivatives_have_their_orders(energy, plate, where):
    """Of the distance of a point, and of the least distance of a segment, whose place moves with the shape."""
    problem, x, rng = tilted(energy, plate, where)
    ways = rng.normal(size=(4, x.size))
    steps = 0.002 * 0.5 ** np.arange(4)
    for name in ("touch_0", "touch_1"):
        rows = problem.blocks()[name]
        push = rng.normal(size=rows.count)
        jacobian, hessian = np.zeros((rows.count, x.size)), np.zeros((x.size, x.size))
        np.add.at(jacobian, rows.jacobian_structure(), rows.jacobian(x))
        np.add.at(hessian, rows.hessian_structure(), rows.hessian(x, push))
        hessian += np.tril(hessian, -1).T
        first, second = np.zeros(steps.size), np.zeros(steps.size)
        for path in ways:
            left = np.array([push @ (rows.values(x + h * path) - rows.values(x) - h * jacobian @ path) for h in steps])
            first += left**2
            second += (left - 0.5 * steps**2 * (path @ hessian @ path)) ** 2
        assert 1.9 < 0.5 * np.log2(first[-2] / first[-1]) < 2.1
        assert 2.8 < 0.5 * np.log2(second[-2] / second[-1]) < 3.2


def integrated(equilibrium: Equilibrium, s: np.ndarray) -> np.ndarray:
    """Both edges (2, k, 3) at s (k,): r' = t_z and t' = kappa x t integrated from the first joint, of omega and eta at
    the joints alone (docs/theory.md, eq. (1.1))."""
    joints = np.concatenate([[0.0], np.cumsum(equilibrium.problem.lengths)])
    omega, eta = equilibrium.problem.joint_values(equilibrium.x)
    points, frames = equilibrium.joints

    def rate(t, y):
        m = y[3:].reshape(3, 3)
        bend, slope = np.interp(t, joints, omega), np.interp(t, joints, eta)
        turn = np.array([[0, -slope * bend, 0.0], [slope * bend, 0, -bend], [0.0, bend, 0]])
        return np.concatenate([m[:, 2], (m @ turn).ravel()])

    y = np.concatenate([points[0], frames[0].ravel()])
    out = np.empty((12, s.size))
    for a, b in pairwise(joints):
        inside = (s >= a) & ((s < b) | (b == joints[-1]))
        run = solve_ivp(rate, (a, b), y, dense_output=True, rtol=1e-10, atol=1e-13)
        out[:, inside], y = run.sol(s[inside]), run.y[:, -1]
    ruling = out[3:].reshape(3, 3, -1)[:, 0] + np.interp(s, joints, eta) * out[3:].reshape(3, 3, -1)[:, 2]
    half = equilibrium.problem.half_width
    return np.stack([(out[:3] + side * half * ruling).T for side in (1.0, -1.0)])


def beyond(equilibrium: Equilibrium, per_segment: int = 15) -> float:
    """How far the edges reach beyond a rigid wall, integrated apart from the solver."""
    joints = np.concatenate([[0.0], np.cumsum(equilibrium.problem.lengths)])
    shares = np.arange(per_segment) / per_segment
    s = np.append((joints[:-1, None] + equilibrium.problem.lengths[:, None] * shares).ravel(), joints[-1])
    edges = integrated(equilibrium, s)
    return max(-float(((edges - w.point) @ np.asarray(w.normal)).min()) for w in equilibrium.problem.walls)


@pytest.mark.parametrize("where", ["fixed", "any", "inside"])
@pytest.mark.parametrize("energy", ["wunderlich", "kirchhoff"])
def test_a_row_is_the_least_distance_of_its_edge(energy, where):
    """Against the distances at joints of a segment that is cut at many places, where the row's place is one of them."""
    problem, x, _ = tilted(energy, where=where)
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    for k in (0, 1):
        rows = problem.blocks()[f"touch_{k}"]
        assert isinstance(rows, TouchRows)
        touches = [touch for touch in problem.touching if touch.wall == k]
        for value, place, touch in zip(rows.values(x), rows.places(x), touches, strict=True):
            i = problem.segment_at(touch.s)
            tried = [] if where == "fixed" else np.linspace(starts[i], starts[i + 1], 41)
            cuts = np.unique(np.append(tried, starts[i] + place))
            far = problem.with_changes(touching=(), lengths=np.diff(np.unique(np.append(starts, cuts))))
            finer = np.concatenate([[0.0], np.cumsum(far.lengths)])
            fields = [np.interp(finer, starts, v) for v in problem.joint_values(x)]
            bent = None if energy == "wunderlich" else np.interp(finer, starts, problem.in_plane_values(x))
            own, first = problem.layout.joint(i), int(np.argmin(np.abs(finer - starts[i])))
            # the shape from the segment's own start: its cuts, walked from there
            y = far.with_changes(start=None).state(*fields, bent)
            turned = far.layout.joint(first)
            distances = []
            last = int(np.argmin(np.abs(finer - starts[i + 1])))
            at = [int(np.argmin(np.abs(finer - starts[i] - place)))]
            for joint in at if where == "fixed" else range(first, last + 1):
                distances.append(
                    _edge_distance(far, y, turned, joint, x[own.position], x[own.quaternion], k, touch.side)
                )
            assert value == pytest.approx(min(distances), abs=1e-11)
            if where == "inside":
                assert 0.0 < place < problem.lengths[i]


def _edge_distance(problem, y, first, joint, position, q, k, side) -> float:
    """Distance of an edge at a joint of the shape y from wall k, the shape moved rigidly so that its joint `first`
    stands at `position` and is turned as the quaternion q."""
    points, frames = problem.joints(y)
    here = round(first.position[0] / (problem.layout.joint(1).position[0] - problem.layout.joint(0).position[0]))
    turn = quaternion.matrix(q) @ frames[here].T
    eta = 0.0 if problem.fields.free else y[problem.layout.joint(joint).eta]
    ruling = frames[joint][:, 0] + eta * frames[joint][:, 2]
    place = position + turn @ (points[joint] - points[here] + side * problem.half_width * ruling)
    wall = problem.walls[k]
    return float((place - np.asarray(wall.point)) @ np.asarray(wall.normal))


def table(gamma: float, height: float, segments: int = 40, **more) -> Equilibrium:
    """A strip held level at `height` above a table, under its weight."""
    floor = Wall((0.0, -height, 0.0), UP)
    return solve(Strip(1.0, 0.05, gamma=gamma), Clamp(), Gravity(UP), walls=[floor], segments=segments, **more)


@pytest.mark.parametrize(("gamma", "height"), [(1e5, 0.0), (1e5, 0.1), (1e3, 1e-12), (1e3, 1e-6), (1e3, 1e-3)])
def test_a_heavy_strip_does_not_sag_into_its_table(gamma, height):
    found = table(gamma, height)
    assert found.status is Status.CONVERGED
    assert beyond(found) < TOLERANCE
    assert found.penetration == pytest.approx(max(0.0, beyond(found, 60)), abs=1e-8)
    weight = found.walls[0].force + found.start.force
    np.testing.assert_allclose(weight, gamma * np.array(UP), rtol=0.0, atol=1e-8 * gamma)


def test_what_is_held_between_the_joints_is_not_held_for_nothing():
    """The rows that stay push; without them the strip goes through."""
    found = table(1e3, 1e-3)
    slices = found.problem.block_slices()
    assert len(found.problem.touching) > 0
    assert (-found.rows[slices["touch_0"]]).min() > 0.0
    free = found.problem.with_changes(touching=())
    from ribbon.find import relax

    assert deepest(free, relax.from_near(free, found.x).x) > 10.0 * TOLERANCE


def test_a_roof_at_the_arch_is_not_crossed_and_balances():
    floor = Wall((0.0, 0.0, 0.0), UP)  # at the clamps' own height
    roof = Wall((0.0, 0.18, 0.0), (0.0, -1.0, 0.0))
    strip = Strip(1.0, 0.2, 0.5, gamma=10.0)
    found = solve(
        strip, Clamp(ruling="free"), Gravity(UP), end=Clamp((0.0, 0.0, 0.9), ruling="free"), walls=(floor, roof),
        segments=36, seed_curvature=(-8.0, 8.0, 8.0, -8.0),
    )  # fmt: skip
    assert found.ok, found.message
    assert beyond(found) < TOLERANCE
    held = [wall.force for wall in found.walls] + [found.start.force, found.end_support.force]
    np.testing.assert_allclose(np.sum(held, axis=0), 10.0 * np.array(UP), atol=1e-7)


def test_a_way_ends_on_its_walls_side():
    """A table that rises under a hanging strip; on the way the strip may sag in, and says by how much."""
    first = table(200.0, 0.3, 24, formulation="mixed")

    def at(t: float):
        floor = Wall((0.0, -(0.3 - 0.25 * t), 0.0), UP)
        strip = first.problem.strip
        return build(strip, Clamp(), Gravity(UP), walls=[floor], segments=24, formulation="mixed")

    states: list[Equilibrium] = []
    last = follow(at, first, steps=5, on_step=lambda record, state: states.append(state))
    assert last.ok, last.message
    assert len(states) >= 5
    for state in states:
        assert state.penetration == pytest.approx(max(0.0, beyond(state, 40)), rel=0.02, abs=1e-8)
        assert state.penetration < TOLERANCE or "beyond a wall" in state.message
    assert last.penetration < TOLERANCE
    assert beyond(last) < TOLERANCE
