"""Series of a segment seen from its end: against multiple precision, an ODE solver and the jets seen from its start."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from ribbon.element import kernel_cache, series

with kernel_cache.in_use():
    from ribbon.element import body_series, kinematics

LIMIT = series.EXPONENT_LIMIT
PAIRS = list(zip(series.PAIR_FIRST, series.PAIR_SECOND, strict=True))
# a, b, n, m, L: signs, zeros, one part and many, several turns
CASES = [
    (4, 10, 1, 0.3, 0.05),
    (40, -10, 60, -1.5, 0.05),
    (-7, 3, 2, -2, 0.7),
    (-30, 40, 3, -1, 1),
    (0, 60, 0, 0.3, 0.5),
    (0, 0, 5, 1, 0.3),
    (0, 0, 0, 0, 0.2),
    (1e-8, 1e-8, 0, 0, 1),
]


def body(parameters, level=2, limit=LIMIT):
    jets = np.full((13, 15), np.nan)
    *q, length = map(float, parameters)
    many = jets[None]
    count = kinematics.body_jets_many(False, np.array([q]), np.array([length]), limit, level, many)
    return jets, count


def multiply(x, y):
    """Hamilton product, scalars first; entries of any kind."""
    return [
        x[0] * y[0] - x[1] * y[1] - x[2] * y[2] - x[3] * y[3],
        x[0] * y[1] + x[1] * y[0] + x[2] * y[3] - x[3] * y[2],
        x[0] * y[2] + x[2] * y[0] + x[3] * y[1] - x[1] * y[3],
        x[0] * y[3] + x[3] * y[0] + x[1] * y[2] - x[2] * y[1],
    ]


def rotation(q):
    """Columns of the rotation matrix: q o e_i o conjugate(q)."""
    inverse = [q[0], -q[1], -q[2], -q[3]]
    axes = np.eye(4)[1:]
    return np.array([multiply(multiply(q, axis), inverse)[1:] for axis in axes]).T


def product(x, y):
    """Jet of a product, from the definition."""
    out = np.empty(15)
    out[0] = x[0] * y[0]
    out[1:5] = x[0] * y[1:5] + y[0] * x[1:5]
    for k, (i, j) in enumerate(PAIRS, start=5):
        out[k] = x[0] * y[k] + x[k] * y[0] + x[1 + i] * y[1 + j] + x[1 + j] * y[1 + i]
    return out


#: Digits of `exact` behind the point, in whole numbers of 2^-BITS: a tenth of the time of floating-point ones.
BITS = 210


def exact(a, b, n, m, length):
    """The 13 values in 50 digits, by Taylor steps of the equations of q, u, v, t of the module, in S / h."""
    size = (abs(b) + abs(a) * length) * (1 + abs(m) + abs(n) * length)
    pieces = max(1, int(mp.ceil(length * size / 2)))
    h = length / pieces
    along, tiny = _fixed(h), _fixed(mp.mpf(10) ** -48)
    y = [int(i == 0) << BITS for i in range(13)]
    for piece in range(pieces):
        s = piece * h
        omega = (_fixed((a * s + b) * h), _fixed(a * h**2))
        twist = [(n * s + m) * (a * s + b), n * (a * s + b) + (n * s + m) * a, n * a]
        twist = [_fixed(v * h ** (j + 1)) for j, v in enumerate(twist)]
        terms = [y]
        total = list(y)
        for k in range(1, 200):
            rate = [0] * 13
            for j, past in enumerate(terms[: -len(twist) - 1 : -1]):
                one, three = (omega[j] if j < 2 else 0), twist[j]
                turn = multiply(past[:4], [0, one, 0, three])
                for i in range(4):
                    rate[i] += turn[i] >> 1
                for i in (4, 7, 10):
                    rate[i] += three * past[i + 1]
                    rate[i + 1] += one * past[i + 2] - three * past[i]
                    rate[i + 2] -= one * past[i + 1]
            rate = [r >> BITS for r in rate]
            for i in range(3):
                rate[7 + i] += terms[-1][4 + i] * along >> BITS
            if k == 1:
                rate[6] += along
                rate[10] += along
            terms.append([r // k for r in rate])
            total = [t + part for t, part in zip(total, terms[-1], strict=True)]
            if k > 8 and max(map(abs, terms[-1])) <= tiny:
                break
        y = total
    return [mp.ldexp(mp.mpf(v), -BITS) for v in y]


def _fixed(value):
    """A number in units of 2^-BITS."""
    return int(mp.floor(mp.ldexp(mp.mpf(value), BITS)))


#: Derivatives of the strongest case in many digits take a minute and more: in `make validate`.
JETS = [pytest.param(case, marks=pytest.mark.validate) if case == (-30, 40, 3, -1, 1) else case for case in CASES]


@pytest.mark.parametrize("parameters", JETS)
def test_jets_against_multiple_precision(parameters):
    jets, _ = body(parameters)
    with mp.workdps(50):
        step = mp.mpf(10) ** -12
        base = [mp.mpf(v) for v in parameters]

        def at(*moves):
            y = list(base)
            for index, sign in moves:
                y[index] += sign * step
            return np.array(exact(*y))

        here = at()
        plus, minus = [at((i, 1)) for i in range(4)], [at((i, -1)) for i in range(4)]
        expected = np.empty((13, 15), dtype=object)
        expected[:, 0] = here
        for i in range(4):
            expected[:, 1 + i] = (plus[i] - minus[i]) / (2 * step)
        for k, (i, j) in enumerate(PAIRS, start=5):
            if i == j:
                expected[:, k] = (plus[i] - 2 * here + minus[i]) / step**2
            else:
                mixed = at((i, 1), (j, 1)) + at((i, -1), (j, -1))
                expected[:, k] = (mixed - plus[i] - minus[i] - plus[j] - minus[j] + 2 * here) / (2 * step**2)
    expected = expected.astype(float)
    for rows in (slice(0, 4), slice(4, 7), slice(7, 10), slice(10, 13)):
        size = np.abs(expected[rows]).max(axis=0)
        # relative to the largest entry of the derivative; a derivative that is tiny by symmetry, to L and its powers
        length = float(parameters[4])
        assert np.all(np.abs(jets[rows] - expected[rows]).max(axis=0) <= 1e-12 * np.maximum(size, 1e-3 * length**6))


@settings(max_examples=80)
@given(
    a=st.floats(-60, 60), b=st.floats(-60, 60), n=st.floats(-8, 8), m=st.floats(-2, 2), length=st.floats(1e-3, 1.0)
)  # fmt: skip
def test_agrees_with_the_jets_seen_from_the_start(a, b, n, m, length):
    jets, count = body((a, b, n, m, length))
    start = np.empty((15, 15))
    assert series.segment_jets(a, b, n, m, length, LIMIT, start) == count
    frame = start[:9].reshape(3, 3, 15)
    q = jets[:4]
    assert np.abs(rotation(q[:, 0]) - frame[:, :, 0]).max() < 1e-13
    scale = np.abs(start).max(axis=0) + 1e-3 * np.abs(start).max()
    # the first column of Q is 1 - 2 (y y + z z), 2 (x y + w z), 2 (x z - w y)
    square = -2 * (product(q[2], q[2]) + product(q[3], q[3]))
    square[0] += 1
    assert np.all(np.abs(square - frame[0, 0]) < 1e-12 * scale)
    assert np.all(np.abs(2 * (product(q[1], q[2]) + product(q[0], q[3])) - frame[1, 0]) < 1e-12 * scale)
    assert np.all(np.abs(2 * (product(q[1], q[3]) - product(q[0], q[2])) - frame[2, 0]) < 1e-12 * scale)
    norm = sum(product(row, row) for row in q)
    assert abs(norm[0] - 1) < 1e-13
    assert np.all(np.abs(norm[1:]) < 1e-12 * scale[1:])
    for first, row in ((9, 4), (12, 7)):
        for c in range(3):
            expected = sum(product(frame[r, c], start[first + r]) for r in range(3))
            assert np.all(np.abs(jets[row + c] - expected) < 1e-12 * scale)


@pytest.mark.parametrize("limit", [1.0, 18.0])
@pytest.mark.parametrize("parameters", CASES)
def test_sub_segments_make_the_same_segment(parameters, limit):
    jets, _ = body(parameters)
    other, _ = body(parameters, limit=limit)
    tolerance = 1e-12 if limit < 10 else 1e-9
    assert np.all(np.abs(jets - other) <= tolerance * (np.abs(jets).max(axis=0) + 1e-3 * np.abs(jets).max()))


@pytest.mark.parametrize("turns", [0.25, 1, 2, 3, 10])
def test_a_full_turn_changes_the_sign_of_the_quaternion(turns):
    angle = 2 * np.pi * turns
    expected = [np.cos(angle / 2), np.sin(angle / 2), 0, 0]
    out = np.empty(13)
    body_series.body_values(0.0, angle, 0.0, 0.0, 1.0, LIMIT, 0, out)
    assert np.abs(out[:4] - expected).max() < 1e-14 * (1 + angle)
    assert np.abs(body((0, angle, 0, 0, 1), level=0)[0][:4, 0] - expected).max() < 1e-14 * (1 + angle)


def test_values_against_an_ode_solver():
    a, b, n, m, length = -30.0, 20.0, 4.0, -1.0, 1.0

    def rate(s, y):
        kappa = np.array([a * s + b, 0, (n * s + m) * (a * s + b)])
        turn = np.array(multiply(y[:4], [0, *kappa])) / 2
        u, v, t = y[4:7], y[7:10], y[10:]
        return np.concatenate(
            [turn, [0, 0, 1] - np.cross(kappa, u), u - np.cross(kappa, v), [1, 0, 0] - np.cross(kappa, t)]
        )

    end = solve_ivp(rate, (0, length), np.eye(13)[0], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    out = np.empty(13)
    assert body_series.body_values(a, b, n, m, length, LIMIT, 2, out) > 1
    assert np.abs(out - end).max() < 1e-11


@pytest.mark.parametrize("level", [0, 1, 2])
@pytest.mark.parametrize("parameters", CASES)
def test_a_level_fills_its_rows_alone_and_values_agree(parameters, level):
    jets, count = body(parameters, level)
    rows = 7 + 3 * level
    whole = body(parameters)[0][:rows]  # compiled apart: the last digit is the processor's
    np.testing.assert_allclose(jets[:rows], whole, rtol=0.0, atol=1e-14 * np.abs(whole).max())
    assert np.isnan(jets[rows:]).all()
    out = np.full(13, np.nan)
    assert body_series.body_values(*map(float, parameters), LIMIT, level, out) == count
    assert np.abs(out[:rows] - jets[:rows, 0]).max() < 1e-14
    assert np.isnan(out[rows:]).all()


def test_many_segments_are_those_one_by_one():
    rng = np.random.default_rng(3)
    q = rng.normal(size=(23, 4)) * [30, 30, 2, 0.5]
    lengths = rng.uniform(0.02, 0.8, 23)
    for level in range(3):
        jets = np.full((23, 13, 15), np.nan)
        count = kinematics.body_jets_many(False, q, lengths, LIMIT, level, jets)
        single = [body((*parameters, length), level) for parameters, length in zip(q, lengths, strict=True)]
        assert count == sum(parts for _, parts in single)
        assert count > 23
        for one, (expected, _) in zip(jets, single, strict=True):
            rows = 7 + 3 * level
            size = np.abs(expected[:rows]).max(axis=0)
            assert np.all(np.abs(one[:rows] - expected[:rows]) <= 1e-14 * size)


def test_parameters_that_are_no_numbers_give_no_numbers():
    jets, _ = body((np.nan, 1, 0, 0, 0.1))
    assert np.isnan(jets[:, 0]).all()
