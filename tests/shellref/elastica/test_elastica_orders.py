"""Orders of convergence of every element from both sides, and the heavy cantilever to eight digits."""

from __future__ import annotations

import numpy as np
import pytest

from shellref.elastica.solve import ElasticaProblem, solve
from tests.reference.elastica_closed import heavy_cantilever
from tests.reference.elastica_errors import KINDS, errors, orders


@pytest.mark.parametrize("kind", KINDS)
def test_orders_from_both_sides(kind):
    """theta in L2: degree + 1; tip and energy, functionals: twice the degree; neither less nor more by 0.15.

    The Hermite element nears its orders from below and slowly: its last pair of meshes only, to 0.25.
    """
    _, _, counts, angle_order, end_order = KINDS[kind]
    found = errors(kind)
    last, within = (slice(-1, None), 0.25) if kind == "Hermite" else (slice(1, None), 0.15)
    for name, order in (("angle", angle_order), ("tip", end_order), ("energy", end_order)):
        slopes = orders(found[name], found["elements"])
        assert slopes.shape == (len(counts) - 1,)
        assert np.all(np.abs(slopes[last] - order) < within), (name, slopes)


DIGITS = {  # drop over reach, by Taylor shooting in 30 digits up to 1e3 (test below), then in doubles
    1.0: 0.124561766442,
    10.0: 1.06680232043,
    100.0: 5.88810462333,
    1e3: 21.3354404999,
    1e4: 69.7088295792,
    1e5: 222.6114204,
}


@pytest.mark.parametrize("gamma", DIGITS)
def test_drop_over_reach_to_eight_digits(gamma):
    """Graded quartic elements against the Taylor integrator, which shares nothing with them; the digits are stated."""
    x, drop = heavy_cantilever(gamma)
    assert drop / x == pytest.approx(DIGITS[gamma], rel=1e-11)
    result = solve(ElasticaProblem(gamma=gamma), 100, 4, estimate_error=False)
    assert -result.end[1] / result.end[0] == pytest.approx(drop / x, rel=1e-9)


@pytest.mark.parametrize("gamma", [1.0, 10.0, 100.0])
def test_the_taylor_integrator_in_doubles_is_that_in_many_digits(gamma):
    assert heavy_cantilever(gamma) == pytest.approx(heavy_cantilever(gamma, 30), rel=1e-13)


def test_equal_elements_lose_the_digits_that_graded_ones_keep():
    """Gamma = 1e5 on 60 quartic elements."""
    x, drop = heavy_cantilever(1e5)
    misses = []
    for nodes in (60, np.linspace(0.0, 1.0, 61)):
        end = solve(ElasticaProblem(gamma=1e5), nodes, 4, estimate_error=False).end
        misses.append(abs(-end[1] / end[0] / (drop / x) - 1.0))
    graded, equal = misses
    assert graded < 1e-8
    assert equal > 1e4 * graded
