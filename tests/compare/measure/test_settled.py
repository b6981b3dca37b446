"""Critical numbers over meshes: known sequences are bounded by their errors, what does not settle is said not to."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from compare.measure.mesh_limit import LEAST_ORDER, MOST_ORDER, settled


@given(
    limit=st.floats(-10.0, 10.0),
    factor=st.floats(1e-3, 10.0),
    sign=st.sampled_from([-1.0, 1.0]),
    order=st.floats(LEAST_ORDER + 0.01, MOST_ORDER),
    ratio=st.sampled_from([1.5, 2.0, 3.0]),
    noise=st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4),
    located=st.sampled_from([0.0, 1e-6, 1e-4]),
)
def test_the_error_bounds_what_is_left_of_a_power_of_the_length(limit, factor, sign, order, ratio, noise, located):
    assume(located == 0.0 or order >= 1.0)  # below what was located no order is seen
    values = [limit + sign * factor * ratio ** (-order * k) + located * noise[k] for k in range(4)]
    found = settled(values, located, ratio)
    if located == 0.0:
        assert found.settles
        assert found.order == pytest.approx(order, abs=1e-3) or abs(values[-1] - values[-2]) < 1e-9
    if found.settles:
        assert abs(found.value - limit) <= found.error + 1e-9


@given(
    start=st.floats(-1.0, 1.0),
    step=st.floats(1e-2, 1.0),
    kind=st.sampled_from(["steady", "alternating", "logarithm", "growing", "slow"]),
)
def test_what_does_not_settle_is_said_not_to(start, step, kind):
    walk = {
        "steady": lambda k: step * k,
        "alternating": lambda k: step * (-1.0) ** k,
        "logarithm": lambda k: step * math.log(2.0 + k),
        "growing": lambda k: step * 1.5**k,
        "slow": lambda k: step * 2.0 ** (-0.3 * k),
    }[kind]
    found = settled([start + walk(k) for k in range(4)], located=1e-4)
    assert not found.settles
    assert found.record("l")["error"] is None
    assert found.error >= 0.9 * abs(walk(3) - walk(2))


def test_changes_within_what_was_located_are_its_error():
    found = settled([0.35127, 0.35148, 0.35147], located=1.5e-4)
    assert found.settles
    assert 1e-4 < found.error < 1e-3
    assert found.order is None


@pytest.mark.parametrize("values", [[0.3, math.nan, 0.31], [0.3, 0.31, math.inf], [0.3, 0.31]])
def test_a_mesh_without_the_number_or_too_few_meshes_settle_nothing(values):
    assert not settled(values).settles


@pytest.mark.parametrize(("values", "ratio"), [([0.3], 2.0), ([0.3, 0.2, 0.1], 1.0)])
def test_no_number_is_made_of_nothing(values, ratio):
    with pytest.raises(ValueError, match="settled"):
        settled(values, ratio=ratio)
