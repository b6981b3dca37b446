"""From few segments to many: the same states as by the long way, in few steps, and None where that is not safe."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from ribbon import Clamp, Closure, Gravity, RibbonInputError, Strip, Wall, refine, solve
from ribbon.find import doubling
from ribbon.problems import prolonged, transfer
from ribbon.problems.layout import STRIDE
from ribbon.solvers import choose, newton_near
from ribbon.solvers.problem import Minimum
from tests.ribbon.problems.test_mixed import CASES, problem

STRIP = Strip(1.0, 0.05, 0.4, gamma=10.0)
END = Clamp((0.1, 0.2, 0.7), (0, 0.6, 0.8), (0, 0.8, -0.6))
THICK = Strip(1.0, 0.1, 0.4, gamma=5.0, thickness=0.01)
BODIES = {
    "two clamps": {"end": END},
    "curled": {"end": END, "strip": Strip(1.0, 0.05, 0.4, (8.0, 6.0), 10.0)},
    "sadowsky": {"end": END, "energy": "sadowsky"},
    "by rows": {"end": END, "held_by": "constraints"},
    "exact weight": {"end": END, "gravity": Gravity((0, 1, 0), exact=True)},
    "moebius": {"clamp": None, "gravity": None, "closure": Closure("moebius")},
    "circle": {"clamp": None, "gravity": None, "closure": Closure("circle")},
    "held at its end": {"clamp": None, "end": Clamp((0, 0, 0))},
    "bends in its plane": {"strip": THICK, "energy": "kirchhoff", "end": END, "in_plane": True},
}


#: States with a motion that nothing resists.
INDIFFERENT = ("circle", "held at its end")


def found(name, segments=330, **changes):
    arguments = {"strip": STRIP, "clamp": Clamp(), "gravity": Gravity((0, 1, 0)), **BODIES[name], **changes}
    first = [arguments.pop(key) for key in ("strip", "clamp", "gravity")]
    return solve(*first, **arguments, segments=segments, formulation="mixed")


def as_minimum(e):
    return Minimum(e.x, e.multipliers, e.rows, e.residual, e.iterations, 0, "", True, 0.0, e.solver)


def cut(p):
    return p.with_changes(lengths=np.repeat(p.lengths / 2, 2))


@pytest.mark.parametrize("name", BODIES)
def test_the_state_is_that_of_the_long_way(name, monkeypatch):
    one = found(name)
    monkeypatch.setattr(doubling, "is_possible", lambda *_: False)
    other = found(name)
    assert (one.status, other.moved) == (other.status, None)
    assert one.energy.total == pytest.approx(other.energy.total, rel=1e-10, abs=1e-10)
    assert one.problem.joints(one.x)[0] == pytest.approx(other.problem.joints(other.x)[0], abs=3e-9)
    assert one.rows.size == other.rows.size
    assert (one.active_bounds > 0) == (name == "sadowsky")  # its rulings lie on their bounds
    if name not in ("sadowsky", *INDIFFERENT):
        assert one.moved is not None


def test_how_far_the_joints_moved_is_more_than_what_is_missing():
    e = found("two clamps")
    fine = refine(e, 4)
    missing = np.linalg.norm(fine.problem.joints(fine.x)[0][::4] - e.problem.joints(e.x)[0], axis=1).max()
    assert 0.0 < missing < e.moved < 1e-3


def test_refining_is_following_and_ends_where_the_long_way_does(monkeypatch):
    e = found("two clamps", 160)
    one = [refine(e, parts) for parts in (2, 3)]
    assert [each.moved is not None for each in one] == [True, True]
    monkeypatch.setattr(doubling, "is_possible", lambda *_: False)
    for each, parts in zip(one, (2, 3), strict=True):
        other = refine(e, parts)
        assert each.problem.joints(each.x)[0] == pytest.approx(other.problem.joints(other.x)[0], abs=1e-9)


def test_the_long_way_is_gone_where_it_is_asked_for_or_not_safe():
    p = found("two clamps", 20).problem
    assert doubling.is_possible(p, None)
    assert not doubling.is_possible(p, {"mu_init": 1e-5})
    assert not doubling.is_possible(p.with_changes(walls=(Wall((0, -0.3, 0), (0, 1, 0)),)), None)
    assert not doubling.is_possible(p.with_changes(model="matrix"), None)
    with choose.using("ipopt"):
        assert not doubling.is_possible(p, None)


def saddle():
    """The third planar arc between level clamps, unstable in four ways."""
    ends = [Clamp((0, 0, z), ruling="straight") for z in (0.0, 0.9)]
    first = solve(
        Strip(1.0, 0.02, 0.4), ends[0], None, end=ends[1], segments=40, formulation="mixed", seed_curvature=1.0
    )
    p = first.problem
    x = p.state(5.0 * np.cos(6.0 * np.pi * prolonged.joints(p.lengths)), np.zeros(41))
    rows = prolonged.multipliers(p, np.zeros(p.row_count), p, x)
    lower, upper = p.bounds()
    at = newton_near.Iterate(p, lower < upper, np.ones(p.row_count, dtype=bool))
    for _ in range(12):
        worst = at.at(x, rows)
        if worst <= 1e-11:
            break
        x, rows = at.step()
    assert worst <= 1e-10
    return replace(first, x=x, rows=rows), at.negative


def test_a_saddle_is_not_followed(monkeypatch):
    e, negative = saddle()
    p = e.problem
    assert negative == 4
    assert p.value(e.x) == pytest.approx(36.4563, abs=1e-3)
    assert doubling.doubled(p, as_minimum(e), cut(p)) is None
    step = newton_near.Iterate.step

    def blind(at):
        found = step(at)
        at.negative = 0
        return found

    monkeypatch.setattr(newton_near.Iterate, "step", blind)  # the inertia is what refused it
    above = doubling.doubled(p, as_minimum(e), cut(p))
    assert above is not None
    assert above.moved < 1e-3


def test_wrong_multipliers_of_the_clamp_are_found_out(monkeypatch):
    e = found("two clamps", 160)
    p = cut(e.problem)
    good = doubling.doubled(e.problem, as_minimum(e), p)
    assert good is not None
    steps = good.iterations - e.iterations
    turned = replace(as_minimum(e), rows=-3.0 * e.rows)
    bad = doubling.doubled(e.problem, turned, p)
    assert bad is None or bad.iterations - e.iterations > steps


def test_events_are_solved_on_their_own(monkeypatch):
    e = found("two clamps", 640)
    p = cut(e.problem)
    few = doubling.doubled(e.problem, as_minimum(e), p)
    monkeypatch.setattr(newton_near, "_windows", lambda _: None)
    more = doubling.doubled(e.problem, as_minimum(e), p)
    assert few.iterations - e.iterations <= 4
    assert more is None or more.iterations - e.iterations >= 6
    if more is not None:
        assert p.joints(few.x)[0] == pytest.approx(p.joints(more.x)[0], abs=1e-10)


@pytest.mark.parametrize("left", [newton_near._ENDING, doubling.EXACT])
def test_the_inertia_is_not_older_than_windows(left, monkeypatch):
    """Windows that leave a small residual, or none, are followed by a step with a factor of its own."""
    e, calls = found("two clamps", 160), []
    step, again = newton_near.Iterate.step, newton_near.Iterate.again

    def windows(at):
        before = [*calls, "windows"]
        while at.at(*step(at)) > left:
            pass
        calls[:] = before
        return at.x, at.y

    monkeypatch.setattr(newton_near, "_windows", windows)
    monkeypatch.setattr(newton_near.Iterate, "step", lambda at: calls.append("step") or step(at))
    monkeypatch.setattr(newton_near.Iterate, "again", lambda at: calls.append("again") or again(at))
    assert doubling.doubled(e.problem, as_minimum(e), cut(e.problem)) is not None
    after = [second for first, second in pairwise([*calls, "end"]) if first == "windows"]
    assert after
    assert set(after) == {"step"}


@pytest.mark.parametrize("body", CASES)
def test_multipliers_of_the_glue_balance_the_joints(body):
    p = problem(**CASES[body])
    rng = np.random.default_rng(3)
    n = p.lengths.size
    x = p.state(rng.normal(size=n + 1), 0.1 * rng.normal(size=n + 1))
    rows = rng.normal(size=p.row_count)
    y = prolonged.multipliers(p, rows, p, x)
    assert np.array_equal(y[8 * n :], rows[8 * n :])
    slope = p.gradient(x) + p.jacobian_matrix(x).T @ y
    inner = slope[STRIDE : STRIDE * n + 9]
    given = np.concatenate([np.arange(STRIDE * j, STRIDE * j + 7) for j in range(n)] + [STRIDE * np.arange(n - 1) + 8])
    given = np.append(given, STRIDE * (n - 1) + 8)
    assert inner[np.unique(given)] == pytest.approx(0.0, abs=1e-11 * max(1.0, np.abs(y).max()))


def test_fields_are_prolonged_to_the_fourth_order():
    """A spline that is fitted to a smooth curve becomes one that is, up to h^4; linear only to h^2."""

    def fitted(f, s):
        h = np.diff(s)
        m = np.diag(np.append(h, 0) / 3 + np.append(0, h) / 3) + np.diag(h / 6, 1) + np.diag(h / 6, -1)
        b = np.zeros(s.size)
        for x, w in zip(*np.polynomial.legendre.leggauss(6), strict=True):
            t = s[:-1] + 0.5 * (1 + x) * h
            b[:-1] += 0.5 * w * h * f(t) * 0.5 * (1 - x)
            b[1:] += 0.5 * w * h * f(t) * 0.5 * (1 + x)
        return np.linalg.solve(m, b)

    errors, plain = [], []
    for k in (16, 32, 64, 128):
        s, t = np.linspace(0, 1, k + 1), np.linspace(0, 1, 2 * k + 1)
        values = fitted(np.sin, s), fitted(np.sin, t)
        inside = slice(2 * k // 4, -2 * k // 4)  # ends have layers of their own
        errors.append(np.abs(prolonged.finer(s, values[0], t) - values[1])[inside].max())
        plain.append(np.abs(np.interp(t, s, values[0]) - values[1])[inside].max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 3.6)
    assert np.all(np.log2(np.array(plain[:-1]) / plain[1:]) < 2.3)


def test_coarse_joints_are_joints_of_the_fine():
    p = found("two clamps", 20).problem
    assert doubling.nested(p, cut(p))
    assert not doubling.nested(p, p.with_changes(lengths=np.full(30, 1 / 30)))
    odd = p.with_changes(lengths=np.full(323, 1 / 323))
    few = doubling.few(odd)
    assert doubling.FEWEST <= few.lengths.size < 2 * doubling.FEWEST
    assert doubling.nested(few, odd)
    assert transfer.merged is transfer.merged


def test_a_weight_that_nothing_carries_is_refused():
    band = {"closure": Closure("circle"), "segments": 12}
    weighed = Gravity((0, 1, 0))
    table, slope, side = (Wall((0, -1, 0), n) for n in ((0, 1, 0), (0, 0.8, 0.6), (1.0, 0, 0)))
    for walls in ((), (side,), (slope,)):
        with pytest.raises(RibbonInputError, match="falls or slides"):
            solve(STRIP, None, weighed, walls=walls, **band)
    assert solve(STRIP, None, None, **band).ok
    assert solve(STRIP, None, weighed, walls=(table,), **band).residual < 1e-8
