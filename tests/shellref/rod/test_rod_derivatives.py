"""Gradient and Hessian of the rod's elements against complex steps and differences; objectivity to rounding."""

from dataclasses import replace

import numpy as np
import pytest

from shellref.rod.elements import Elements, State
from shellref.rod.newton import Balance
from shellref.rod.problem import RodProblem, rectangle, rest_shape, torsion_constant
from shellref.rod.quaternion import PRODUCT, product, quaternion, rotation, turn_between, turned

RANDOM = np.random.default_rng(1)


def disturbed(degree):
    """A bent, sheared, stretched, twisted rod of four elements."""
    problem = RodProblem(
        rectangle(0.3, 0.1, 0.3), (3.0, 4.0), (1.0, 2.0), (0.5, 0.2), *(RANDOM.normal(size=3) for _ in range(3))
    )
    elements = Elements(np.array([0.0, 0.2, 0.5, 0.7, 1.0]), degree)
    r, q = rest_shape(problem, elements.s)
    shake = RANDOM.normal(size=r.shape)
    return elements, problem, State(r + 0.05 * shake, turned(q, 0.3 * shake[:, ::-1]))


def potential(elements, problem, state, step):
    """Stored energy less the work of weight and force at a state moved by step (6 n,), complex."""
    step = step.reshape(-1, 6)
    theta = step[:, 3:]
    angle = np.sqrt(np.sum(theta * theta, axis=1))[:, None] + 0j
    small = np.abs(angle) < 1e-12
    sine = np.where(small, 0.5, np.sin(0.5 * angle) / np.where(small, 1.0, angle))
    turn = np.concatenate([np.cos(0.5 * angle), sine * theta], axis=1)
    moved = State(state.r + step[:, :3], np.einsum("kij,ni,nj->nk", PRODUCT, state.q, turn))
    work = np.sum(elements.loads(state, replace(problem, moment=np.zeros(3)))[:, :3] * moved.r)
    return elements.energy(moved, problem).sum() - work


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_the_residual_is_the_gradient_of_the_energy(degree):
    elements, problem, state = disturbed(degree)
    free = replace(problem, moment=np.zeros(3))
    small = 1e-30
    gradient = [potential(elements, free, state, 1j * small * e).imag / small for e in np.eye(elements.size)]
    residual = elements.residual(state, free).ravel()
    np.testing.assert_allclose(residual, gradient, rtol=0, atol=1e-12 * np.abs(gradient).max())


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_the_tangent_is_its_derivative_and_symmetric(degree):
    elements, problem, state = disturbed(degree)
    free = replace(problem, moment=np.zeros(3))
    tangent = elements.tangent(state, free, elements.stress(state, free)).toarray()
    assert np.abs(tangent - tangent.T).max() < 1e-14 * np.abs(tangent).max()
    small, unit = 1e-30, np.eye(elements.size)

    def slope(step, j):
        return potential(elements, free, state, step + 1j * small * unit[j]).imag / small

    worst = []
    for size in (4e-3, 2e-3, 1e-3):
        misses = []
        for i, j in ((3, 4), (9, 6), (10, 10), (11, 16), (5, 9), (elements.size - 1, elements.size - 3)):
            difference = (slope(size * unit[i], j) - slope(-size * unit[i], j)) / (2.0 * size)
            misses.append(abs(difference - tangent[j, i]))
        worst.append(max(misses) / np.abs(tangent).max())
    assert 1.95 < np.log2(worst[0] / worst[1]) < 2.05  # what is left is the difference's own error
    assert 1.95 < np.log2(worst[1] / worst[2]) < 2.05


def test_the_tangent_of_a_moment_of_fixed_direction():
    """Its work on the turn T(theta) dtheta of the chart q exp(theta / 2), differenced; and it is not symmetric."""
    elements, problem, state = disturbed(1)
    stress = elements.stress(state, problem)
    without = replace(problem, moment=np.zeros(3))
    found = (elements.tangent(state, problem, stress) - elements.tangent(state, without, stress)).toarray()[-3:, -3:]
    frame = rotation(state.q[-1])

    def work(theta):
        small, columns = 1e-6, []
        for e in np.eye(3):
            ends = [turned(state.q[-1], theta + sign * small * e) for sign in (-1.0, 1.0)]
            spin = rotation(turned(state.q[-1], theta)) @ turn_between(*ends) / (2.0 * small)
            columns.append(problem.moment @ spin)
        return -np.array(columns)

    np.testing.assert_allclose(work(np.zeros(3)), -frame.T @ problem.moment, atol=1e-8)
    h = 1e-3
    differences = np.array([(work(h * e) - work(-h * e)) / (2.0 * h) for e in np.eye(3)]).T
    np.testing.assert_allclose(found, differences, atol=1e-5)
    assert np.abs(found + found.T).max() < 1e-14 < np.abs(found).max()


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_strains_do_not_feel_a_rigid_motion(degree):
    elements, _problem, state = disturbed(degree)
    turn = turned(np.array([1.0, 0.0, 0.0, 0.0]), np.array([2.0, -1.0, 2.5]))
    moved = State(state.r @ rotation(turn).T + [3.0, -1.0, 2.0], product(np.broadcast_to(turn, state.q.shape), state.q))
    np.testing.assert_allclose(elements.strains(moved), elements.strains(state), rtol=0, atol=1e-13 * 10)


def test_rotations_and_quaternions_are_each_other():
    for theta in (np.zeros(3), np.array([np.pi, 0.0, 0.0]), np.array([0.0, -3.1, 0.1]), RANDOM.normal(size=3)):
        q = turned(np.array([1.0, 0.0, 0.0, 0.0]), theta)
        r = rotation(q)
        np.testing.assert_allclose(r @ r.T, np.eye(3), atol=1e-15 * 4)
        np.testing.assert_allclose(rotation(quaternion(r)), r, atol=1e-15 * 8)
        back = turn_between(np.array([1.0, 0.0, 0.0, 0.0]), q)
        assert np.abs(back - theta).max() < 1e-14 or np.abs(back + theta).max() < 1e-14


def test_section_of_the_thesis():
    """4.4, figure 4.5: w/l = 1/30, h/w = 1/10, nu = 0.4."""
    section = rectangle(1 / 30, 1 / 300, 0.4)
    assert section.bending == pytest.approx((1.0, 84.0))
    assert section.torsion == pytest.approx(1.12437, abs=5e-6)
    assert section.stretch == pytest.approx(12 * 0.84 * 300**2)
    assert section.shear[0] == pytest.approx(5 * 0.6 * 300**2)
    assert torsion_constant(1.0, 1.0) == pytest.approx(3 * 0.140577, rel=1e-5)  # Timoshenko's square


def test_the_rest_shape_is_a_helix():
    """kappa = (3, 0, 4): radius 3/25, pitch angle by tan = 3/4."""
    problem = RodProblem(rectangle(0.1, 0.01, 0.3), curvature=(3.0, 3.0), twist=(4.0, 4.0))
    s = np.linspace(0.0, 1.0, 21)
    r, _ = rest_shape(problem, s)
    axis = np.array([3.0, 0.0, 4.0]) / 5.0
    np.testing.assert_allclose(r @ axis, 0.8 * s, atol=1e-9)
    chord = np.linalg.norm(r[-1] - r[0] - 0.8 * axis)
    assert chord == pytest.approx(2.0 * 3.0 / 25.0 * np.sin(2.5), abs=1e-9)


def test_negative_pivots_are_negative_eigenvalues():
    """Of the free part of a tangent far from equilibrium, on which nothing is definite."""
    elements, problem, state = disturbed(2)
    free = replace(problem, moment=np.zeros(3))
    counted = set()
    for factor in (-3.0, 0.0, 1.0, 3.0):
        balance = Balance(elements, free)
        whole, found = balance.factor(state, free, factor * elements.stress(state, free))
        dense = (balance.free.T @ whole @ balance.free).toarray()
        assert found.negative == int(np.sum(np.linalg.eigvalsh(dense) < 0.0))
        counted.add(found.negative)
    assert len(counted) > 2
