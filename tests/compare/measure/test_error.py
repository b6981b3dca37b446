"""The error of a number from its changes between meshes: it covers the true one, whatever the order and the noise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from compare.measure.error import MOST_DROP, SAFETY, behind, error_of_first, error_of_last, extrapolated
from compare.measure.numbers import errors_of

ORDERS = st.floats(1.0, 6.0)
SIZES = st.floats(1e-6, 1e3)
NOISE = st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3)


def sequence(order, size, factors=(1.0, 1.0, 1.0), noise=0.0):
    """Three values of a number that is 0, on elements half as long each time."""
    return [size * 2.0 ** (-order * k) + noise * f for k, f in enumerate(factors)]


@given(order=st.floats(1.0, 4.9), size=SIZES, sign=st.sampled_from([1.0, -1.0]))
def test_the_error_of_one_power_is_found_itself(order, size, sign):
    values = [sign * v for v in sequence(order, size)]
    assert error_of_first(values) == pytest.approx(SAFETY * size, rel=1e-9)


@given(order=ORDERS, size=SIZES, noise=st.floats(0.0, 1e2), factors=NOISE)
def test_the_error_is_covered_for_every_order_and_up_to_the_noise(order, size, noise, factors):
    values = sequence(order, size, factors, noise)
    assert error_of_first(values) + 12.0 * noise >= abs(values[0]) * (1.0 - 1e-9)
    assert error_of_first(values[:2]) + 4.0 * noise >= abs(values[0]) * (1.0 - 1e-9)
    assert error_of_last(values) + 3.0 * noise >= abs(values[-1]) * (1.0 - 1e-9)


@given(st.floats(1.0, 4.0), st.floats(1.0, 4.0), st.floats(0.0, 1.0))
def test_terms_of_two_orders_of_one_sign_are_covered(one, other, part):
    values = [2.0 ** (-one * k) + part * 2.0 ** (-other * k) for k in range(3)]
    assert error_of_first(values) >= values[0]
    assert error_of_first(values[:2]) >= values[0] * (1.0 - 1e-9)


def test_scatter_is_as_uncertain_as_it_is_wide():
    """Moments of a strip under a roof on 60, 120 and 240 segments, as they were: no mesh is surer than they scatter."""
    moments = [[1.2116, 0.0, 0.0], [1.206, 0.0, 0.0], [1.2345, 0.0, 0.0]]
    assert error_of_first(moments) >= 1.2345 - 1.206
    assert error_of_first([1.0, 1.1, 1.0]) >= 0.1


def test_a_change_that_is_small_by_chance_is_not_believed():
    """Errors 0.043 and 0.00016 of two meshes side by side: a fall by 270 where no order allows one by 32."""
    known = error_of_last([0.0, 0.043, 0.043 + 0.00016])
    assert known == pytest.approx(0.043 / MOST_DROP)
    assert behind(1.0, 1e-9, 1.0) > 1.0 + 0.9 / MOST_DROP**2


def test_a_single_value_and_one_that_is_not_finite_have_none():
    assert error_of_first([1.0]) is None
    assert error_of_last([1.0]) is None
    assert error_of_first([1.0, np.nan]) is None
    assert error_of_first([1.0, 1.0, 1.0]) == 0.0


def test_shapes_are_judged_alike():
    line = np.linspace(0.0, 1.0, 11)[:, None, None] * np.array([0.0, 0.0, 1.0]) + np.zeros((11, 2, 3))
    shapes = [line + np.array([0.0, error, 0.0]) for error in sequence(2.0, 1e-3)]
    assert extrapolated(shapes) == pytest.approx(1e-3, rel=1e-3)


def test_numbers_are_nested_as_the_result_has_them_and_never_below_the_least():
    coarse = {"forces.start": [1.0, 0.0, 0.0], "forces.walls.0": [0.0, 2.0, 0.0], "energy.total": 3.0}
    fine = {"forces.start": [1.0, 0.3, 0.4], "forces.walls.0": [0.0, 2.0, 0.0], "energy.total": 2.5}
    found = errors_of([coarse, fine], error_of_first, least=1e-9)
    assert found["forces"] == {"start": pytest.approx(1.0), "end": None, "walls": [1e-9]}
    assert errors_of([coarse, coarse], error_of_first)["energy"]["total"] == pytest.approx(3e-14)
    assert found["moments"] == {"start": None, "end": None}
    assert found["energy"] == {"total": pytest.approx(1.0)}
    unknown = errors_of([coarse], error_of_first)
    assert unknown["forces"] == {"start": None, "end": None, "walls": [None]}
