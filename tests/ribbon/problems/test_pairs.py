"""Places that are held apart: derivatives of the least distance, and where it is."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Strip
from ribbon.element import quaternion
from ribbon.find.solve import build
from ribbon.judge import nearness
from ribbon.problems.itself.pairs import Pair
from ribbon.surface import centreline

STRIP = Strip(1.0, 0.2, thickness=0.01)
LENGTHS = [0.2, 0.3, 0.5]


def faced(energy: str, pair: Pair):
    """A strip in three pieces, the last one turned and moved so that it faces the first at the places of a pair, 0.03
    away, both convex towards each other and rulings askew: the nearest places are beside these and inside."""
    problem = build(STRIP, Clamp(None, None, None), energy=energy, segments=LENGTHS, formulation="mixed")
    problem = problem.with_changes(apart=0.01, pairs=(pair,))
    rows = problem.pair_rows()
    rng = np.random.default_rng(3)
    x = problem.state(np.array([5.0, 6.0, 7.0, 5.0]), np.array([0.3, 0.2, -0.1, 0.2]), np.zeros(4))
    frames = []
    for side in range(2):
        found = rows._side(x, side, rows._begin[:, 2 * side : 2 * side + 2], False)
        along = found.by_t[0, :, 0] / np.linalg.norm(found.by_t[0, :, 0])
        normal = np.cross(found.by_t[0, :, 1], along)
        normal *= -np.sign(normal @ found.tt[0, :, 0, 0]) / np.linalg.norm(normal)  # to the convex side
        frames.append((found.place[0], np.column_stack([along, np.cross(normal, along), normal])))
    (place, frame), (other, turned) = frames
    askew = np.array([[np.cos(1.0), np.sin(1.0), 0.0], [np.sin(1.0), -np.cos(1.0), 0.0], [0.0, 0.0, -1.0]])
    spin = frame @ askew @ turned.T
    joint = problem.layout.joint(2)
    x[joint.quaternion] = quaternion.compose(quaternion.from_matrix(spin), x[joint.quaternion])
    start = x[joint.position].copy()
    x[joint.position] = place + 0.03 * frame[:, 2] + spin @ (start - other)
    return problem, x, rng


@pytest.mark.parametrize("energy", ["wunderlich", "finite", "kirchhoff"])
@pytest.mark.parametrize(
    "pair", [Pair(0.1, 0.02, 0.8, -0.03), Pair(0.08, 0.05, 0.8, -0.04, True), Pair(0.1, 0.0, 0.8, 0.0, True, True)]
)
def test_derivatives_have_their_orders(energy, pair):
    problem, x, rng = faced(energy, pair)
    rows = problem.pair_rows()
    assert (rows._at(x)["inside"] == rows._loose).all()
    assert rows.gaps(x)[0] == pytest.approx(0.02, abs=5e-3)
    way = rng.normal(size=x.size)
    jacobian, hessian = np.zeros((1, x.size)), np.zeros((x.size, x.size))
    np.add.at(jacobian, rows.jacobian_structure(), rows.jacobian(x))
    np.add.at(hessian, rows.hessian_structure(), rows.hessian(x, np.ones(1)))
    hessian += np.tril(hessian, -1).T
    first, second = [], []
    for step in 2e-3 * 0.5 ** np.arange(3):
        low, here, high = (rows.values(x + k * step * way)[0] for k in (-1.0, 0.0, 1.0))
        first.append(abs((high - low) / (2.0 * step) - jacobian[0] @ way) / abs(jacobian[0] @ way))
        second.append(abs((high - 2.0 * here + low) / step**2 - way @ hessian @ way) / abs(way @ hessian @ way))
    for errors in (first, second):
        assert errors[-1] < 1e-3
        assert errors[0] > 10.0 * errors[-1] or errors[-1] < 1e-6


def test_the_nearest_places_are_those_of_all_pairs_of_points():
    """A strip bent to a loop that passes over itself, askew: against all points with all."""
    problem = build(Strip(1.0, 0.06, thickness=0.01), segments=24, energy="wunderlich", formulation="mixed")
    problem = problem.with_changes(apart=0.01)
    s = np.linspace(0.0, 1.0, 25)
    x = problem.state(7.2 + 1.5 * np.cos(2 * np.pi * s), 0.12 + 0.05 * np.sin(3.0 * s))
    found = nearness.minima(problem, x, 0.3)
    assert found
    q, (points, frames) = problem.parameters(x), problem.joints(x)
    at = np.linspace(0.0, 1.0, 301)
    r, frame, omega, eta = centreline(q, problem.lengths, points, frames, at, problem.exponent_limit)
    u = np.linspace(-0.03, 0.03, 9)
    cloud = r[:, None] + u[:, None] * (frame[:, :, 0] + eta[:, None] * frame[:, :, 2])[:, None]
    turned = np.concatenate([[0.0], np.cumsum(0.5 * np.abs(omega[1:] + omega[:-1]) * np.diff(at))])
    least = np.inf
    for i in range(0, 301):
        far = turned - turned[i] > 3.0
        if far.any():
            apart = np.linalg.norm(cloud[far][:, :, None] - cloud[i][None, None], axis=-1)
            least = min(least, float(apart.min()))
    gap, pair = found[0]
    assert 0.0 < least - (gap + 0.01) < 2e-3
    assert pair.s < pair.s_other


def test_a_coil_on_itself_tells_each_place_once_and_the_nearest_first():
    """Three turns on each other: hundreds of places, no two within a twentieth of a segment, all of them through."""
    problem = build(Strip(1.0, 0.06, thickness=0.01), segments=24, energy="kirchhoff", formulation="mixed")
    problem = problem.with_changes(apart=0.01)
    found = nearness.minima(problem, problem.state(np.full(25, 20.0), np.zeros(25)), 0.0)
    gaps = np.array([gap for gap, _ in found])
    places = np.array([pair[:4] for _, pair in found])
    assert gaps.size > 50
    assert (np.diff(gaps) >= 0.0).all()
    assert gaps[0] == pytest.approx(-0.01, abs=1e-9)
    apart = np.abs(places[:, None] - places[None]).max(axis=2) + np.eye(gaps.size)
    assert apart.min() >= 0.05 / 24.0
    assert nearness.same(problem, found[0][1], found[0][1])
    assert not nearness.same(problem, found[0][1], found[1][1])
