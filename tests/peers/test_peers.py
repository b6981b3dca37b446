"""Whoever of the peers is there ends where the reference does; AUTO's analytic derivatives are those of differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.peers import auto, bvp, optimal
from tests.peers.cases import TARGET, case
from tests.peers.measure import peers
from tests.peers.ours import Ribbon, scaling

pytestmark = pytest.mark.peers

#: Settings that reach the target on coil_10_100, K l = -10.
GIVEN: dict[str, Any] = {
    "AUTO-07p": auto.Settings(18, 4, 0.05, 0.3, 1e-6),
    "solve_bvp": (2.0, 1e-2, (0.05, 1.2), 1e-5),
    "CasADi + Ipopt": (20, 4),
    "ribbon.solve": (40, 40),
    "ribbon.solve, then refine": (20, 40),
    "ribbon.solve, solver = ipopt": (40, 40),
}


@pytest.mark.parametrize("name", list(GIVEN))
def test_a_peer_ends_at_the_reference(name):
    peer = peers()[name]
    if (why := peer.absent()) is not None:
        pytest.skip(why)
    found = peer.run(case("coil_10_100", -1), GIVEN[name])
    assert found.error <= TARGET, found
    assert found.seconds > 0


@pytest.mark.skipif(auto.absent() is not None, reason=str(auto.absent()))
def test_autos_derivatives_end_where_differences_do():
    """And save it time: a Newton step from wrong ones does not converge to this in ITNW steps."""
    found = case("coil_10_100", 1)
    exact, differences = (auto.solved(found, auto.Settings(20, 4, 0.2, 1.0, 1e-9, given)) for given in (True, False))
    assert exact is not None
    assert differences is not None
    tips = [found.tip(*solution, 4) for solution in (exact, differences)]
    np.testing.assert_allclose(*tips, atol=1e-8)


def test_a_free_end_from_polynomials_is_that_of_the_spline():
    """`Case.tip` of values on a mesh (three methods use it) against the cubic spline of solve_bvp's own mesh."""
    found = case("coil_10_100", 1)
    solution = bvp.continued(found.strong, 1e-7, 60)
    s = np.linspace(0.0, 1.0, 161)
    assert np.linalg.norm(found.tip(s, solution(s), 4) - solution.tip()) < 1e-7


def test_the_time_by_size_is_told_with_its_status():
    rows = scaling(case("coil_10_100", 1), 100)
    assert [(p, status) for p, _, status in rows] == [(10, "converged"), (100, "converged")]
    assert Ribbon().absent() is None
    assert optimal.absent() is None or "PEERS_PYTHON" in optimal.absent()
