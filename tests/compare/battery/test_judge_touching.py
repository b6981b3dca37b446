"""The judge of strips that touch: distances against a search, and that it turns red for what is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from compare.battery.cases.touching.itself import fold
from compare.battery.cases.touching.rubbing import _law, pressed
from compare.battery.judge.touching import Sheet, apart, balanced, kept, of_itself, pushed

THICK = 0.02


@pytest.fixture(scope="module")
def folded():
    found = fold(THICK, 0.16)
    assert found.ok
    return found, Sheet(found), of_itself(found)


def _red(checks):
    return [check.what for check in checks if not check.ok]


def test_segments_are_as_far_apart_as_a_search_finds():
    rng = np.random.default_rng(3)
    for _ in range(40):
        r, a, p, b = rng.normal(size=(4, 3)) * np.array([[1.0], [0.6], [1.0], [0.9]])

        def distance(u, r=r, a=a, p=p, b=b):
            return float(np.sum((r + u[0] * a - p - u[1] * b) ** 2))

        known = min(
            minimize(distance, start, bounds=[(-1, 1)] * 2, tol=1e-14).fun
            for start in ((0.0, 0.0), (0.9, -0.9), (-0.9, 0.9))
        )
        assert apart(r, a, p, b) == pytest.approx(np.sqrt(known), abs=1e-6)
    side = np.array([1.0, 0.0, 0.0])
    assert apart(np.zeros(3), side, np.array([0.5, 0.0, 0.3]), side) == pytest.approx(0.3, abs=1e-14)


def test_a_sheet_is_the_strip_s_surface(folded):
    found, sheet, _ = folded
    for at in ((0.3, 0.02), (0.71, -0.025), (0.0, 0.0)):
        s, place = sheet.particle(at)
        foot, there, _ = found.rulings(np.array([at]))
        assert s == pytest.approx(foot[0], abs=1e-12)
        assert place == pytest.approx(there[0], abs=1e-10)


def test_a_fold_that_touches_is_judged_good(folded):
    found, sheet, told = folded
    assert told
    assert _red([*kept([sheet], THICK, told), balanced(found, sheet, told)]) == []


def test_parts_that_are_nearer_than_they_are_kept_are_seen(folded):
    _, sheet, told = folded
    assert any("nearer" in what for what in _red(kept([sheet], THICK + 2e-6, told)))
    assert any("gap" in what for what in _red(pushed([sheet], THICK + 2e-6, told)))


def test_a_wrong_push_is_seen(folded):
    found, sheet, told = folded
    more = [replace(told[0], force=told[0].force * (1.0 + 1e-5)), *told[1:]]
    assert not balanced(found, sheet, more).ok
    assert not balanced(found, sheet, told[1:]).ok
    turned = [replace(told[0], force=told[0].force + 1e-4 * np.linalg.norm(told[0].force) * np.eye(3)[1]), *told[1:]]
    assert any("aside" in what for what in _red(pushed([sheet], THICK, turned)))
    pulls = [replace(told[0], force=-told[0].force), *told[1:]]
    assert any("pull" in what for what in _red(pushed([sheet], THICK, pulls)))


def test_another_coefficient_of_friction_is_seen():
    states, arrived = pressed(0.3, 2)
    assert arrived
    assert _law(states[1:], 0.3).ok
    assert not _law(states[1:], 0.29).ok
