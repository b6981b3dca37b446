"""Power series of a segment: against multiple precision, closed forms, an ODE solver; and its derivatives."""

from __future__ import annotations

import functools

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.special import fresnel

from ribbon.element import series
from tests.reference.ribbon_energy import frame_and_chord

LIMITS = {"ours": series.EXPONENT_LIMIT, "thesis": series.EXPONENT_LIMIT_THESIS}


def values(a, b, n, m, length, limit=series.EXPONENT_LIMIT):
    q, p, j = np.empty((3, 3)), np.empty(3), np.empty(3)
    count = series.segment_values(float(a), float(b), float(n), float(m), float(length), limit, q, p, j)
    return q, p, j, count


@functools.cache
def reference(*parameters):
    q, p, j = frame_and_chord(*parameters, digits=30)
    q, p, j = (np.array(matrix.tolist(), dtype=float) for matrix in (q, p, j))
    return q, p[:, 0], j[:, 0]


# a, b, n, m, L: |K| up to 1000 on a unit segment, oblique rulings, changes of sign
STRONG = [
    (0, 1000, 0, 0, 1),
    (0, -1000, 0, 0, 1),
    (0, 1000, 0, 0.3, 1),
    (-2000, 1000, 0.5, 0.2, 1),
    (500, -250, 2, -1, 1),
    (900, 100, -1.5, 0.8, 1),
]
MILD = [(3, 2, 0.5, 0.1, 0.05), (40, 10, 60, -1.5, 0.05), (0, 0, 5, 1, 0.3), (1e-8, 1e-8, 0, 0, 1), (-7, 3, 2, -2, 0.7)]


@pytest.mark.parametrize("parameters", STRONG + MILD)
def test_position_and_frame_to_1e_12(parameters):
    q, p, j, _ = values(*parameters)
    expected = reference(*parameters)
    assert np.abs(q - expected[0]).max() < 1e-12
    assert np.abs(p - expected[1]).max() < 1e-12
    assert np.abs(j - expected[2]).max() < 1e-12
    assert np.abs(q.T @ q - np.eye(3)).max() < 1e-12
    assert np.linalg.det(q) > 0


def test_the_limit_of_the_thesis_loses_digits_that_ours_keeps():
    errors = {}
    for name, limit in LIMITS.items():
        errors[name] = max(
            np.abs(values(*parameters, limit)[0] - reference(*parameters)[0]).max() for parameters in STRONG[2:4]
        )
    assert errors["ours"] < 5e-13 < 1e-12 < errors["thesis"]


@pytest.mark.parametrize("parameters", STRONG[:3] + MILD)
@pytest.mark.parametrize("limit", LIMITS.values(), ids=LIMITS.keys())
def test_every_sub_segment_obeys_the_limit(parameters, limit):
    a, b, n, m, length = (float(v) for v in parameters)
    done = 0.0
    count = 0
    while done < length:
        h = series.step_length(a, b + a * done, n, m + n * done, length - done, limit)
        bb, mm = b + a * done, m + n * done
        norms = [abs(bb) * np.hypot(1, mm), np.hypot(a, n * bb + mm * a), abs(n * a)]
        assert 2 * h * (norms[0] + norms[1] * h + norms[2] * h * h) <= limit * (1 + 1e-6)
        done = min(done + h, length) if length - done - h > 1e-14 else length
        count += 1
    assert count == values(*parameters, limit)[3]


def test_circle_helix_and_clothoid_in_closed_form():
    # circle: omega constant, eta = 0: the tangent turns towards -t_y (t_z' = -omega t_y)
    q, p, j, _ = values(0, 2.0, 0, 0, 1.3)
    angle = 2.6
    assert np.allclose(q[:, 2], [0, -np.sin(angle), np.cos(angle)], atol=1e-15)
    assert np.allclose(p, [0, (np.cos(angle) - 1) / 2, np.sin(angle) / 2], atol=1e-15)
    assert np.allclose(j, [0, (np.sin(angle) / 2 - 1.3) / 2, (1 - np.cos(angle)) / 4], atol=1e-15)
    # helix: constant kappa, rotation by |kappa| s about kappa
    omega, eta, s = 3.0, -0.7, 0.9
    kappa = np.array([omega, 0, eta * omega])
    skew = np.array([[0, -kappa[2], kappa[1]], [kappa[2], 0, -kappa[0]], [-kappa[1], kappa[0], 0]])
    k = np.linalg.norm(kappa)
    rotation = np.eye(3) + np.sin(k * s) / k * skew + (1 - np.cos(k * s)) / k**2 * skew @ skew
    assert np.allclose(values(0, omega, 0, eta, s)[0], rotation, atol=1e-14)
    # clothoid: omega = a s
    a, s = 9.0, 1.1
    sine, cosine = fresnel(s * np.sqrt(a / np.pi))
    scale = np.sqrt(np.pi / a)
    assert np.allclose(values(a, 0, 0, 0, s)[1], [0, -scale * sine, scale * cosine], atol=1e-14)


def test_against_an_ode_solver():
    a, b, n, m, length = -30.0, 20.0, 4.0, -1.0, 1.0

    def rate(s, y):
        frame = y[:9].reshape(3, 3)
        omega, eta = a * s + b, n * s + m
        x = (omega, 0.0, eta * omega)
        skew = np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])
        return np.concatenate([(frame @ skew).ravel(), frame[:, 2], y[9:12]])

    start = np.concatenate([np.eye(3).ravel(), np.zeros(6)])
    end = solve_ivp(rate, (0, length), start, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    q, p, j, _ = values(a, b, n, m, length)
    assert np.abs(np.concatenate([q.ravel(), p, j]) - end).max() < 1e-11


@settings(max_examples=60)
@given(
    a=st.floats(-60, 60), b=st.floats(-60, 60), n=st.floats(-8, 8), m=st.floats(-2, 2),
    length=st.floats(1e-3, 1.0), cut=st.floats(0.05, 0.95),
)  # fmt: skip
def test_two_parts_make_the_whole(a, b, n, m, length, cut):
    first = cut * length
    q, p, j, _ = values(a, b, n, m, length)
    q1, p1, j1, _ = values(a, b, n, m, first)
    q2, p2, j2, _ = values(a, b + a * first, n, m + n * first, length - first)
    assert np.abs(q - q1 @ q2).max() < 2e-13
    assert np.abs(p - p1 - q1 @ p2).max() < 2e-13
    assert np.abs(j - j1 - p1 * (length - first) - q1 @ j2).max() < 2e-13


#: Derivatives of the strongest case in many digits take a minute: in `make validate`.
STRONGEST = pytest.param((-30, 40, 3, -1, 1), marks=pytest.mark.validate)


@pytest.mark.parametrize("parameters", [*MILD, (0, 60, 0, 0.3, 0.5), STRONGEST])
def test_jets_against_multiple_precision(parameters):
    jets = np.empty((15, 15))
    q, p, j, count = values(*parameters)
    assert series.segment_jets(*map(float, parameters), series.EXPONENT_LIMIT, jets) == count
    assert np.abs(jets[:, 0] - np.concatenate([q.ravel(), p, j])).max() < 1e-13
    step = mp.mpf(10) ** -12
    with mp.workdps(50):
        base = [mp.mpf(v) for v in parameters]

        def at(*moves):
            y = list(base)
            for index, sign in moves:
                y[index] += sign * step
            f, c, i = frame_and_chord(*y, digits=40)
            return [f[r, k] for r in range(3) for k in range(3)] + list(c) + list(i)

        here = at()
        plus, minus = [at((i, 1)) for i in range(4)], [at((i, -1)) for i in range(4)]
        for i in range(4):
            expected = np.array([float((u - v) / (2 * step)) for u, v in zip(plus[i], minus[i], strict=True)])
            assert np.abs(jets[:, 1 + i] - expected).max() < 1e-11 * max(1, np.abs(expected).max())
            for k in range(i + 1):
                up, down = at((i, 1), (k, 1)), at((i, -1), (k, -1))
                if i == k:
                    mixed = [(u - 2 * h + v) / step**2 for u, h, v in zip(plus[i], here, minus[i], strict=True)]
                else:
                    mixed = [
                        (up[c] + down[c] - plus[i][c] - minus[i][c] - plus[k][c] - minus[k][c] + 2 * here[c])
                        / (2 * step**2)
                        for c in range(15)
                    ]
                expected = np.array([float(v) for v in mixed])
                got = jets[:, series.PAIR_INDEX[i, k]]
                assert np.abs(got - expected).max() < 1e-10 * max(1, np.abs(expected).max())


def test_jets_of_many_segments_are_those_one_by_one():
    rng = np.random.default_rng(4)
    q = rng.normal(size=(23, 4)) * [30, 30, 2, 0.5]
    lengths = rng.uniform(0.02, 0.8, 23)
    q[5] = 0.0
    jets, single = np.empty((23, 15, 15)), np.empty((23, 15, 15))
    count = series.segment_jets_many(q, lengths, series.EXPONENT_LIMIT, jets)
    parts = [
        series.segment_jets(*parameters, length, series.EXPONENT_LIMIT, out)
        for parameters, length, out in zip(q, lengths, single, strict=True)
    ]
    assert count == sum(parts) > 23
    assert np.all(np.abs(jets - single).max(axis=1) <= 1e-14 * np.abs(single).max(axis=1))


def test_parameters_that_are_no_numbers_give_no_numbers():
    jets = np.zeros((15, 15))
    assert series.segment_jets(np.nan, 1.0, 0.0, 0.0, 0.1, series.EXPONENT_LIMIT, jets) == 1
    assert np.isnan(jets[:9, 0]).any()
