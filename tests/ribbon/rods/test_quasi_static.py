"""Quasi-static twist, and the gradient on the Bishop frame by a backward sum."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon.rods.curve_angle import CurveAngle
from ribbon.rods.quasi_static import QuasiStatic, angles_settled, by_bishop
from ribbon.rods.result import RodShape
from ribbon.rods.rod import transported
from ribbon.rods.solve import solve
from ribbon.rods.start import from_frames
from tests.ribbon.rods.test_cells import random_rod
from tests.ribbon.rods.test_equilibria import wrung


def on_bishop(problem: CurveAngle, points: np.ndarray, theta: np.ndarray, last: float) -> tuple[CurveAngle, np.ndarray]:
    """The rod with these vertices whose material frames are turned by theta over the clamp's frame, carried along."""
    frame, frames = problem.anchors.frames[0], []
    for edge, angle in zip(np.diff(points, axis=0), theta, strict=True):
        frame = transported(frame, edge / np.linalg.norm(edge))
        d1 = np.cos(angle) * frame[:, 0] + np.sin(angle) * frame[:, 1]
        frames.append(np.column_stack([d1, np.cross(frame[:, 2], d1), frame[:, 2]]))
    return from_frames(problem.rod, points, np.array(frames), turn=last)


@pytest.mark.parametrize("seed", [1, 2])
def test_gradient_at_fixed_theta(seed):
    """Differences of the energy at fixed theta, whole frames carried from the clamp each time, order 2; the gradient at
    fixed p is another."""
    problem, y = random_rod(seed)
    theta, points = problem.bishop(y), problem.positions(y)
    last = problem.evaluated(y).strain[-1, 2]
    rng = np.random.default_rng(seed)
    path, turn = rng.normal(size=points.shape), rng.normal(size=theta.size)
    by_place, by_angle = by_bishop(problem, y)
    slope = (by_place * path).sum() + by_angle @ turn

    def energy(step: float) -> float:
        other, z = on_bishop(problem, points + step * path, theta + step * turn, last)
        return other.evaluated(z).energy

    assert energy(0.0) == pytest.approx(problem.evaluated(y).energy, rel=1e-10)
    misses = [abs((energy(h) - energy(-h)) / (2 * h) - slope) for h in (2e-4, 1e-4)]
    assert np.log2(misses[0] / misses[1]) == pytest.approx(2.0, abs=0.2)
    plain = problem.positions(problem.anchored(y).evaluated(y).gradient)
    assert np.abs(plain - by_place).max() > 0.1


def test_no_twisting_moment_is_left():
    problem, y = random_rod(3)
    settled = angles_settled(problem, y)
    assert np.abs(problem.evaluated(settled).gradient[3::4]).max() < 1e-9
    assert problem.evaluated(settled).energy < problem.evaluated(y).energy


def test_derivatives_with_the_angles_eliminated():
    """Gradient and Hessian of the reduced energy by differences of it and of the gradient, order 2."""
    problem, y = random_rod(2)
    y = angles_settled(problem, y)
    reduced = QuasiStatic(problem, y[3::4])
    x = problem.positions(y).ravel()
    rows = np.random.default_rng(8).normal(size=problem.rod.edges)
    path = np.random.default_rng(5).normal(size=x.size)
    slope = reduced.gradient(x) @ path
    lower = reduced.hessian(x, rows)
    hessian = np.zeros((x.size, x.size))
    hessian[reduced.hessian_structure()] = lower
    hessian += np.tril(hessian, -1).T
    bend = hessian @ path

    def pulled(at: np.ndarray) -> np.ndarray:
        return reduced.gradient(at) + reduced.jacobian_matrix(at).T @ rows

    misses = []
    for step in (4e-4, 2e-4):
        more, less = x + step * path, x - step * path
        first = (reduced.value(more) - reduced.value(less)) / (2 * step) - slope
        second = (pulled(more) - pulled(less)) / (2 * step) - bend
        misses.append((abs(first), np.abs(second).max()))
    assert np.log2(np.array(misses[0]) / misses[1]) == pytest.approx([2.0, 2.0], abs=0.3)


def test_the_same_equilibrium():
    """With the angles as unknowns or eliminated."""
    free = wrung(24)
    start = from_frames(free.rod, free.vertices, free.edges)
    problem, y = start
    rng = np.random.default_rng(1)
    y = y + 0.002 * rng.normal(size=y.size)
    found = RodShape(solve(problem, y, quasi_static=True))
    assert found.found.ok
    assert found.vertices == pytest.approx(free.vertices, abs=1e-7)
    assert found.parts.sum() == pytest.approx(free.parts.sum(), rel=1e-9)
