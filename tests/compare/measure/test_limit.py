"""Limits over halved elements: known sequences, and what is said where they tend nowhere."""

import pytest

from compare.measure.limit import MOST_ORDER, limit_of


@pytest.mark.parametrize("order", [0.7, 1.0, 2.0])
def test_a_power_of_the_length_is_extrapolated_exactly(order):
    found = limit_of([-0.3 + 0.8 * 2.0 ** (-order * k) for k in range(3)])
    assert found.value == pytest.approx(-0.3, abs=1e-12)
    assert found.order == pytest.approx(order, rel=1e-12)
    assert found.error == pytest.approx(0.8 * 4.0**-order, rel=1e-9)


def test_higher_orders_are_not_believed():
    found = limit_of([1.0 + 2.0 ** (-5.0 * k) for k in range(3)])
    assert found.order == MOST_ORDER
    assert abs(found.value - 1.0) < found.error


@pytest.mark.parametrize("values", [[1.0, 2.0, 1.5], [1.0, 1.1, 1.3], [0.2, -0.1]])
def test_what_tends_nowhere_is_as_uncertain_as_its_last_step(values):
    found = limit_of(values)
    assert found.value == values[-1]
    assert found.error == pytest.approx(abs(values[-1] - values[-2]))
    assert found.order is None


def test_one_number_has_no_limit_and_the_same_number_is_its_own():
    assert limit_of([1.0]) is None
    assert limit_of([1.0, 1.0, 1.0]).error == 0.0
    assert limit_of([0.1, 0.05]).signed is False
    assert limit_of([0.1, 0.08, 0.075]).signed


def test_the_sign_of_a_number_that_has_just_left_zero_is_not_known():
    """Eigenvalues of a ring that slides and turns for nothing on a floor, of 80, 160 and 320 segments."""
    assert not limit_of([-1.1e-8, -2.2e-8, -8.183e-6]).signed
    assert limit_of([-1.1e-3, -1.0e-3]).signed
    assert limit_of([-0.9e-3, -1.1e-3, -1.15e-3]).signed
