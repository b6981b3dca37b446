"""Newton's iteration along the strip: the states of Ipopt, warm starts, honest ends, and who is asked when it fails."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ribbon import Clamp, Closure, Gravity, RibbonInputError, Strip, Wall, solve
from ribbon.find.relax import transferred
from ribbon.solvers import choose, cyipopt_api, ipopt, newton_rows
from ribbon.solvers.cyipopt_api import IpoptMissing

STRIP = Strip(1.0, 0.05, 0.4, gamma=10.0)
END = Clamp((0.1, 0.2, 0.7), (0, 0.6, 0.8), (0, 0.8, -0.6))
BODIES = {
    "two clamps": {"end": END},
    "by rows": {"end": END, "held_by": "constraints"},
    "moebius": {"clamp": None, "gravity": None, "closure": Closure("moebius")},
    "on a table": {"walls": (Wall((0, -0.3, 0), (0, 1, 0)),)},
    "on a soft table": {"walls": (Wall((0, -0.3, 0), (0, 1, 0), stiffness=30.0),)},
    "bends in its plane": {
        "strip": Strip(1.0, 0.1, 0.4, gamma=5.0, thickness=0.01),
        "energy": "kirchhoff",
        "end": END,
        "in_plane": True,
    },
}


def found(name, solver, **changes):
    arguments = {
        "strip": STRIP,
        "clamp": Clamp(),
        "gravity": Gravity((0, 1, 0)),
        "segments": 14,
        **BODIES[name],
        **changes,
    }
    first = [arguments.pop(key) for key in ("strip", "clamp", "gravity")]
    with choose.using(solver):
        return solve(*first, **arguments, formulation="mixed")


@pytest.mark.parametrize("name", BODIES)
def test_newton_and_ipopt_find_the_same_state(name):
    one, other = found(name, "newton"), found(name, "ipopt")
    assert one.residual <= 1e-9
    assert other.residual <= 1e-9
    assert one.energy.total == pytest.approx(other.energy.total, rel=1e-10, abs=1e-10)
    assert one.problem.joints(one.x)[0] == pytest.approx(other.problem.joints(other.x)[0], abs=1e-8)
    assert one.lowest_eigenvalue == pytest.approx(other.lowest_eigenvalue, rel=1e-5, abs=1e-8)


def test_the_steps_are_ipopts_own():
    e = found("two clamps", "ipopt")
    few = e.problem
    many = few.with_changes(lengths=np.full(60, 1 / 60))
    start = transferred(few, e.x, many)
    for options in ({"mu_init": 1e-5}, {"mu_init": 1e-2, "max_iter": 4}):
        one, other = (m.minimise(many, start, options) for m in (newton_rows, ipopt))
        assert one.iterations == other.iterations
        assert one.code == other.code
        assert one.x == pytest.approx(other.x, abs=1e-9)
        assert one.rows == pytest.approx(other.rows, abs=1e-6)


def test_a_warm_start_with_multipliers_ends_at_once_and_where_a_row_is_violated_too():
    e = found("on a table", "newton")
    p = e.problem
    again = newton_rows.minimise(p, e.x, None, None, (e.rows, e.multipliers))
    assert again.code == newton_rows.SOLVED
    assert again.iterations <= 3
    higher = p.with_changes(walls=(Wall((0, -0.2999, 0), (0, 1, 0)),))
    moved = newton_rows.minimise(higher, e.x, None, None, (e.rows, e.multipliers))
    assert moved.code == newton_rows.SOLVED
    assert moved.residual <= 1e-9


def test_it_says_how_it_ended_and_ipopt_is_asked_where_it_found_nothing():
    e = found("two clamps", "newton")
    p = e.problem
    start = p.state(np.zeros(15), np.zeros(15))
    short = newton_rows.minimise(p, start, {"max_iter": 2})
    assert (short.code, short.iterations, short.finished) == (newton_rows.MOST, 2, False)
    assert newton_rows.minimise(p, np.full(p.size, np.nan)).code == newton_rows.NOT_FINITE
    far = p.with_changes(end=Clamp((0.0, 0.0, 1.5)))  # beyond the strip's length
    ended = newton_rows.minimise(far, start, {"max_iter": 60})
    assert ended.code in (newton_rows.NO_STEP, newton_rows.MOST)
    with choose.using("newton"):
        requested = choose.minimise(far, start, {"max_iter": 60})
    assert not requested.finished
    assert "Ipopt" in requested.message or requested.residual == ended.residual


def test_other_names_are_refused():
    with pytest.raises(RibbonInputError), choose.using("bfgs"):
        pass


def test_the_message_says_where_ipopt_found_it(monkeypatch):
    good = newton_rows.minimise

    def gives_up(*arguments, **how):
        return replace(good(*arguments, **how), code=newton_rows.NO_STEP, residual=np.inf)

    assert "Ipopt" not in found("two clamps", "auto").message
    monkeypatch.setattr(newton_rows, "minimise", gives_up)
    e = found("two clamps", "auto")
    assert (e.solver, e.ok) == ("Ipopt", True)
    assert e.message.endswith("found by Ipopt") or "found by Ipopt;" in e.message
    assert "found by" not in found("two clamps", "ipopt").message


def test_without_ipopt_newtons_answer_stands_and_says_what_was_not_tried(monkeypatch):
    good = newton_rows.minimise

    def gives_up(*arguments, **how):
        return replace(good(*arguments, **how), code=newton_rows.NO_STEP, residual=1.0, finished=False)

    def absent():
        raise IpoptMissing("absent", "cyipopt is not installed")

    monkeypatch.setattr(ipopt, "wrapper", absent)
    monkeypatch.setattr(cyipopt_api, "wrapper", absent)
    assert found("two clamps", "auto").ok  # nothing asks for it
    monkeypatch.setattr(newton_rows, "minimise", gives_up)
    e = found("two clamps", "auto")
    assert (e.solver, e.ok, e.stable) == ("Newton", False, None)
    assert "cyipopt is not installed" in e.message
    with pytest.raises(IpoptMissing):
        found("two clamps", "ipopt")
