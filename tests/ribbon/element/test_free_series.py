"""Series of a segment whose twist is free: against an ODE solver and a closed form; jets by their Taylor orders."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from ribbon.element import free_series, free_values
from ribbon.element.series import EXPONENT_LIMIT

# a, b, n, m (, c, d), L: the last ones turn by some tens of radians, in several sub-segments
MILD = [(3.0, 2.0, 0.5, -1.0), (3.0, 2.0, 0.5, -1.0, 1.5, -0.7), (0.0, 0.0, 4.0, 2.0), (-2.0, 5.0, 0.0, 3.0, 0.0, 0.0)]
STRONG = [(-40.0, 60.0, 30.0, -25.0), (50.0, -20.0, -35.0, 40.0, 20.0, 15.0)]
LENGTH = 0.8


def skew(k):
    return np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])


def curvatures(q, s):
    a, b, n, m, *rest = q
    c, d = rest or (0.0, 0.0)
    return np.array([a * s + b, c * s + d, n * s + m])


def integrated(q, length):
    """Frame (9, by rows), integrals of the tangent, of that and of t_x at the end, by a Runge-Kutta solver."""

    def rate(s, y):
        frame = y[:9].reshape(3, 3)
        return np.concatenate([(frame @ skew(curvatures(q, s))).ravel(), frame[:, 2], y[9:12], frame[:, 0]])

    start = np.concatenate([np.eye(3).ravel(), np.zeros(9)])
    return solve_ivp(rate, (0.0, length), start, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]


def jets(q, length=LENGTH, rows=18):
    """Jets (rows, components) of one segment, and its number of sub-segments."""
    q = np.array([q])
    states = np.empty((1, rows, free_series.COMPONENTS[q.shape[1] // 2 - 2]))
    return states[0], free_series.walk(q, np.array([length]), EXPONENT_LIMIT, states)


def values(q, length=LENGTH):
    frame, p, j = np.empty((3, 3)), np.empty(3), np.empty(3)
    count = free_values.segment_values(np.array(q), length, EXPONENT_LIMIT, frame, p, j)
    return np.concatenate([frame.ravel(), p, j]), count


@pytest.mark.parametrize("q", MILD + STRONG)
def test_frame_and_integrals_are_those_of_an_ode_solver(q):
    expected = integrated(q, LENGTH)
    found, count = values(q)
    states, sub_segments = jets(q)
    assert count == sub_segments
    assert count >= (10 if q in STRONG else 1)
    assert np.abs(found - expected[:15]).max() < 2e-12
    # the walk's rows are those of Q^T for a row-wise frame (`ribbon.element.series.STATES`)
    assert np.abs(states[:, 0] - expected).max() < 2e-12
    frame = found[:9].reshape(3, 3)
    assert np.abs(frame.T @ frame - np.eye(3)).max() < 1e-13


def test_constant_curvatures_turn_about_one_axis():
    q = (0.0, 3.0, 0.0, -2.1, 0.0, 1.4)
    turn = Rotation.from_rotvec(LENGTH * np.array([3.0, 1.4, -2.1])).as_matrix()
    assert np.abs(values(q)[0][:9].reshape(3, 3) - turn).max() < 1e-14
    out = np.empty(13)
    free_values.body_values(np.array(q), LENGTH, EXPONENT_LIMIT, 0, out)
    assert np.abs(Rotation.from_quat(out[:4], scalar_first=True).as_matrix() - turn).max() < 1e-14


def test_six_parameters_without_kappa_2_are_four():
    four, six = jets(STRONG[0])[0], jets((*STRONG[0], 0.0, 0.0))[0]
    pairs = [(i, j) for i in range(6) for j in range(i, 6)]
    kept = [0, 1, 2, 3, 4, *(7 + k for k, pair in enumerate(pairs) if max(pair) < 4)]
    assert np.abs(six[:, kept] - four).max() < 1e-13 * np.abs(four).max()


@pytest.mark.parametrize("q", [MILD[0], MILD[1], *STRONG])
def test_second_derivatives_leave_an_error_of_third_order(q):
    """Beside an independent solver: the jet's second-order polynomial misses it by a third power of the step."""
    jet, _ = jets(q)
    rng = np.random.default_rng(5)
    for _ in range(2):
        d = rng.normal(size=len(q))
        outer = np.array([d[i] * d[j] * (0.5 if i == j else 1.0) for i in range(len(q)) for j in range(i, len(q))])

        def miss(step, d=d, outer=outer):
            guess = jet[:, 0] + step * jet[:, 1 : 1 + len(q)] @ d + step**2 * jet[:, 1 + len(q) :] @ outer
            return np.linalg.norm(guess - integrated(np.array(q) + step * d, LENGTH))

        order = np.log2(miss(2e-2) / miss(1e-2))
        assert abs(order - 3.0) < 0.1, order


@pytest.mark.parametrize("count", [4, 6])
def test_jets_of_a_straight_segment_are_the_limit_of_those_beside_it(count):
    """All terms of its values are zero, those of its derivatives are not: the second one by slopes begins in term 4."""
    straight, beside = jets((0.0,) * count)[0], jets((1e-9,) * count)[0]
    assert np.abs(straight - beside).max() < 1e-8
    assert np.abs(straight[:, 1 + count]).max() > 0.01  # by the slope of kappa_1 twice


def test_segments_in_lanes_do_not_see_each_other():
    rng = np.random.default_rng(2)
    q = rng.normal(size=(7, 6)) * 20.0
    lengths = rng.uniform(0.05, 0.6, size=7)
    together = np.empty((7, 15, 28))
    free_series.walk(q, lengths, EXPONENT_LIMIT, together)
    for k in range(7):
        alone = np.empty((1, 15, 28))
        free_series.walk(q[k : k + 1], lengths[k : k + 1], EXPONENT_LIMIT, alone)
        assert np.abs(together[k] - alone[0]).max() < 1e-13 * np.abs(alone).max()
