"""The kernels of the curve-angle rod: Taylor orders of energy and gradient, objectivity, no choice of anchors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ribbon.rods.curve_angle import CurveAngle
from ribbon.rods.rod import Rod, RodEnd, marched, rotation
from ribbon.rods.start import from_frames

EDGES = 5


def random_rod(seed: int, held: bool = True) -> tuple[CurveAngle, np.ndarray]:
    """A rod between two clamps in a shape of nothing in particular, with anchors that are not where it is."""
    rng = np.random.default_rng(seed)
    lengths = rng.uniform(0.1, 0.3, EDGES)
    lengths /= lengths.sum()
    frame = Rotation.random(random_state=seed).as_matrix()
    bare = Rod(lengths, (1.0, 7.0, 0.6), ((1.0, 3.0), (0.5, -1.0), (2.0, -1.0)), weight=np.array([0.0, 3.0, 1.0]))
    strains = rng.normal(size=(EDGES + 1, 3)) * 4.0
    points, frames = marched(bare, np.zeros(3), frame, strains)
    end = frames[-1] @ rotation(0.3 * rng.normal(size=3))
    rod = replace(bare, start=RodEnd(np.zeros(3), frame if held else None), end=RodEnd(None, end if held else None))
    problem, y = from_frames(rod, points, frames)
    return problem, y + 0.03 * rng.normal(size=y.size)


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_taylor_orders(seed, held):
    """Central differences of the energy give the gradient, those of the gradient the Hessian, to order 2."""
    problem, y = random_rod(seed, held)
    rows = np.random.default_rng(seed + 9).normal(size=EDGES)
    path = np.random.default_rng(seed + 5).normal(size=y.size)
    slope = problem.gradient(y) @ path
    bend = problem.hessian_matrix(y, rows) @ path

    def pulled(at: np.ndarray) -> np.ndarray:
        return problem.gradient(at) + problem.jacobian_matrix(at).T @ rows

    misses = []
    for step in (2e-4, 1e-4):
        more, less = y + step * path, y - step * path
        first = (problem.value(more) - problem.value(less)) / (2 * step) - slope
        second = (pulled(more) - pulled(less)) / (2 * step) - bend
        misses.append((abs(first), np.abs(second).max()))
    orders = np.log2(np.array(misses[0]) / misses[1])
    assert orders == pytest.approx([2.0, 2.0], abs=0.15)
    assert misses[1][1] < 1e-3 * np.abs(bend).max()


def test_rows_and_their_derivatives():
    problem, y = random_rod(4)
    path = np.random.default_rng(0).normal(size=y.size)
    step = 1e-5
    difference = (problem.constraints(y + step * path) - problem.constraints(y - step * path)) / (2 * step)
    assert problem.jacobian_matrix(y) @ path == pytest.approx(difference, abs=1e-9)


def test_a_turned_rod_has_the_same_energy():
    problem, y = random_rod(6)
    turn = Rotation.from_rotvec([0.3, -1.0, 0.7]).as_matrix()
    rod = problem.rod
    moved = replace(
        rod,
        start=RodEnd(None, turn @ rod.start.frame),
        end=RodEnd(None, turn @ rod.end.frame),
    )
    points, frames = problem.positions(y) @ turn.T + [1.0, 2.0, 3.0], turn @ problem.frames(y)
    last = problem.evaluated(y).strain[-1, 2]
    other, z = from_frames(moved, points, frames, turn=last)
    assert other.evaluated(z).energy == pytest.approx(problem.evaluated(y).energy, rel=1e-12)
    assert other.evaluated(z).strain == pytest.approx(problem.evaluated(y).strain, abs=1e-11)


def test_anchors_change_nothing():
    """Energy, frames and strains are the same with the reference frames at y as anchors; so is the twisting moment."""
    problem, y = random_rod(7)
    other = problem.anchored(y)
    assert other.evaluated(y).strain == pytest.approx(problem.evaluated(y).strain, abs=1e-11)
    assert other.frames(y) == pytest.approx(problem.frames(y), abs=1e-12)
    assert other.gradient(y)[3::4] == pytest.approx(problem.gradient(y)[3::4], abs=1e-9)


def test_cells_balance_themselves():
    """A cell's energy does not change when all of it turns: what turns one side is minus what turns the other."""
    problem, y = random_rod(8)
    here = problem.anchored(y)
    ends = here.evaluated(y).ends
    t = np.concatenate([[here.anchors.frames[0, :, 2]], here.tangents(y), [here.anchors.frames[-1, :, 2]]])
    before = np.cross(t[:-1], ends[:, :3]) + ends[:, 3:4] * t[:-1]
    after = np.cross(t[1:], ends[:, 4:7]) + ends[:, 7:8] * t[1:]
    assert before == pytest.approx(-after, abs=1e-9)
    assert np.abs(after).max() > 1.0
