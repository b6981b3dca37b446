"""Ipopt judges: every shipped ribbon, as `solve` gives it, is the same state by Newton's method and by Ipopt."""

from __future__ import annotations

import pytest

from tests.validation.ribbon import judge

SCENES = judge.scenes()


@pytest.mark.parametrize("name", list(SCENES))
def test_newton_and_ipopt_end_in_one_state(name):
    found = {solver: state for solver, (state, _) in judge.states(SCENES[name]).items()}
    assert {solver: state.solver.split(",")[0] for solver, state in found.items()} == {
        "auto": "Newton", "ipopt": "Ipopt",
    }  # fmt: skip
    assert found["auto"].status is found["ipopt"].status
    assert judge.apart(name, *found.values()) <= 1e-9
