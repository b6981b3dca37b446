"""No verdict is better than what was checked: each claim forced to fail, by its check and by the fact behind it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from compare.measure.balance import Push, Wrench, unbalanced
from compare.measure.grades import FAIR, GOOD, GRADES, POOR, UNKNOWN, worst
from compare.measure.grid import Grid
from compare.models import solve
from compare.models.base import Energy, Force, Options, Status
from compare.models.ribbon.model import RibbonModel
from compare.page.claims import CLAIMS
from compare.page.pair import Row, Times
from compare.page.verdict import Check, Verdict, nothing
from compare.pages import comparison, converge, explain, limits
from compare.pages.solve import answer
from compare.scene.scene import load, loads
from compare.studies.checks import of_state
from compare.studies.compare import Comparison
from compare.studies.effects import Explanation
from compare.studies.effects_measured import Solves
from compare.studies.limits import Thresholds, quick
from tests.validation.workbench import drawn

SCENES = ("figure_4_1", "roman_6_2", "daisy_5g")


@pytest.fixture(scope="module")
def states():
    placed = {"model.elements": None}  # by the usual tolerance
    found = {name: load(name).replace(placed if name == "figure_4_1" else {}) for name in SCENES}
    return {name: (scene, solve(scene, options=Options(error=True))) for name, scene in found.items()}


@given(st.sampled_from(sorted(CLAIMS)), st.data())
def test_a_verdict_is_as_good_as_the_worst_of_its_checks(command, data):
    names = [claim.name for claim in CLAIMS[command]]
    grades = data.draw(st.lists(st.sampled_from(GRADES), min_size=len(names), max_size=len(names)))
    order = data.draw(st.permutations(list(zip(names, grades, strict=True))))
    found = Verdict.of(command, "So it is", [Check(name, grade, "because") for name, grade in order])
    assert found.grade == worst(*grades)
    assert [check.name for check in found.checks] == names
    assert (found.grade == GOOD) == all(grade == GOOD for grade in grades)
    assert (
        Verdict.from_data({"text": found.text, "grade": found.grade, "checks": [vars(c) for c in found.checks]})
        == found
    )
    if any(grade != GOOD for grade in grades):
        with pytest.raises(ValueError, match="as good as its checks"):
            Verdict("So it is", GOOD, found.checks)


@pytest.mark.parametrize("command", sorted(CLAIMS))
def test_every_claim_wants_its_check_and_nothing_else_counts(command):
    checks = [Check(claim.name, GOOD, "seen") for claim in CLAIMS[command]]
    for left_out in range(len(checks)):
        with pytest.raises(ValueError, match=command):
            Verdict.of(command, "So it is", checks[:left_out] + checks[left_out + 1 :])
    with pytest.raises(ValueError, match=command):
        Verdict.of(command, "So it is", [*checks, nothing("another", "it is no claim")])


@pytest.mark.parametrize("grade", [GOOD, FAIR])
def test_nothing_is_good_without_a_check(grade):
    with pytest.raises(ValueError, match="as good as its checks"):
        Verdict("So it is", grade)
    assert Verdict.from_data({"text": "So it was", "grade": grade}).grade == UNKNOWN
    assert Verdict.from_data({"text": "So it was", "grade": POOR}).grade == POOR


def _heavier(state):
    start = state.supports.start
    more = Force(start.force * (1.0 + 1e-4) + 1e-4, start.moment)
    return replace(state, supports=replace(state.supports, start=more))


def _turned(state):
    start = state.supports.start
    return replace(state, supports=replace(state.supports, start=Force(start.force, start.moment + 1e-2)))


def _nan_force(state):
    start = state.supports.start
    return replace(state, supports=replace(state.supports, start=Force(start.force * np.nan, start.moment)))


#: Claim -> ways to break the fact behind it.
BROKEN = {
    "finite": [
        lambda state: replace(state, energy=Energy(float("nan"))), lambda state: replace(state, shape=None),
        _nan_force, lambda state: replace(state, energy=None),
    ],
    "residual": [
        lambda state: replace(state, residual=None), lambda state: replace(state, residual=float("nan")),
        lambda state: replace(state, status=Status.NOT_CONVERGED, word="not_converged"),
        lambda state: replace(state, status=Status.FAILED, word="failed"),
    ],
    "balance": [_heavier, _turned],
    "convexity": [lambda state: replace(state, nonconvex=1e-9), lambda state: replace(state, nonconvex=1.0)],
    "elements": [lambda state: replace(state, error=None), lambda state: replace(state, error=2e-3)],
    "stability": [lambda state: replace(state, stable=None), lambda state: replace(state, stable=False)],
    "quadrature": [
        lambda state: replace(state, quadrature=1e-7), lambda state: replace(state, quadrature=float("nan")),
    ],
    "forces": [
        lambda state: replace(state, errors={**state.errors, "forces": {}}),
        lambda state: replace(state, errors={**state.errors, "moments": {}}),
    ],
    "branch": [lambda state: replace(state, branch="another"), lambda state: replace(state, branch="slid")],
    "model": [
        lambda state, estimate=estimate: replace(state, numbers={**state.numbers, "auto": {
            "enough": False, "sure": False, "accuracy": 0.01, "chosen": "finite", "skipped": {},
            "steps": [{"model": "finite", "estimate": estimate}],
        }})
        for estimate in (0.05, None)
    ],
}  # fmt: skip


@pytest.mark.parametrize("claim", sorted(BROKEN))
@pytest.mark.parametrize("name", SCENES)
def test_a_broken_fact_turns_its_check_and_the_verdict(claim, name, states):
    scene, state = states[name]
    before = {check.name: check for check in of_state(scene, state)}
    assert before[claim].grade == GOOD
    for breaks in BROKEN[claim]:
        broken = breaks(state)
        after = {check.name: check for check in of_state(scene, broken)}
        assert after[claim].grade != GOOD
        assert answer(scene, broken).grade != GOOD


#: A row that keeps no verdict from being good, and what does, by the claim that is no longer good.
ROW = Row(
    100.0, "converged", True, "", 2e-3, 2e-3, 1e-5, 1e-5, True, None, None, None, None, Times(None, None), (8, 2), 3,
    reused=False, same_state=True, same_why="", warm=True, searched=False,
)  # fmt: skip
OTHER_ROWS = {
    "shell": ({"status": "failed"}, {"stable": False}, {"stable": None}, {"shell_error": None}),
    "same": ({"same_state": None}, {"same_state": False}),
    "distance": (
        {"hausdorff": None},
        {"hausdorff": 0.02},
        {"ribbon_error": None},
        {"claimed": False, "hausdorff": 0.1},
    ),
}


def _compared(scene, state, row):
    return Comparison(scene, state, None, None, (row,), (state,), Grid.for_shape(scene, 10.0), None)


def _converged(scene, state, row):
    limit = SimpleNamespace(d0=SimpleNamespace(both=(-1e-5, 1e-5)))
    return converge.answer([SimpleNamespace(comparison=_compared(scene, state, row), limit=limit, model="ribbon")])


def _limited(scene, state, row):
    (found,) = quick(scene, Thresholds())
    distance = found.distance if row is None else row.hausdorff
    return limits.answer([replace(found, ribbon=state, row=row, share=0.0, distance=distance)])


#: Command -> its answer on a state, beside a shell's row where it has one.
ANSWERS = {
    "solve": lambda scene, state, row: answer(scene, state),
    "shell": lambda scene, state, row: answer(scene, state, command="shell"),
    "explain": lambda scene, state, row: explain.answer(
        scene, Explanation("ribbon", (), None, "", ""), Solves(state, Grid.for_shape(scene, 10.0), True, 0.5, {})
    ),
    "compare": lambda scene, state, row: comparison.answer(_compared(scene, state, row)),
    "converge": _converged,
    "limits": _limited,
    "limits --quick": lambda scene, state, row: _limited(scene, state, None),
}


@pytest.fixture(scope="module")
def held():
    """A strip of which every command is sure."""
    scene = dict(drawn.unseen())["held_07"]
    return scene, RibbonModel().solve(scene, options=Options(error=True))


@pytest.mark.parametrize("command", sorted(ANSWERS))
def test_no_command_is_good_when_a_fact_behind_one_of_its_claims_is_broken(command, held):
    scene, state = held
    claims = {claim.name for claim in CLAIMS[command]}
    assert ANSWERS[command](scene, state, ROW).grade == GOOD
    for claim in claims & set(BROKEN):
        for breaks in BROKEN[claim]:
            found = ANSWERS[command](scene, breaks(state), ROW)
            assert found.grade != GOOD, claim
            assert {check.name: check.grade for check in found.checks}[claim] != GOOD
    for claim in claims & set(OTHER_ROWS) if command != "limits --quick" else ():
        for changes in OTHER_ROWS[claim]:
            assert ANSWERS[command](scene, state, replace(ROW, **changes)).grade != GOOD, (claim, changes)


TURNED = f"""
strip = {{{{length = 1.0, width = 0.1, thickness = {{thickness}}, poisson = 0.3, gamma = 5.0}}}}
gravity.up = [1.0, 0.0, 0.0]
clamp.start = {{{{position = [0.0, 0.0, 0.0], tangent = [0.0, 0.0, 1.0], normal = [0.0, 1.0, 0.0]}}}}
clamp.end = {{{{position = [0.0, 0.1, 0.7], tangent = [0.0, 0.0, 1.0], normal = [{np.sin(1.0)}, {np.cos(1.0)}, 0.0]}}}}
model = {{{{energy = "extensible", elements = 20}}}}
"""


def test_a_passage_that_the_elements_hold_is_not_good():
    """Two clamps, one turned by 1 rad: stable on its elements at h / w = 1e-4, but no minimum of its energy; at 0.1
    it is one."""
    found = {}
    for thickness in (1e-5, 1e-2):
        scene = loads(TURNED.format(thickness=thickness))
        state = solve(scene)
        assert state.ok
        found[thickness] = {c.name: c.grade for c in of_state(scene, state)}["convexity"], answer(scene, state).grade
    assert found[1e-2][0] == GOOD
    assert found[1e-5][0] == UNKNOWN
    assert found[1e-5][1] != GOOD


def test_a_wall_is_checked_where_there_is_one(states):
    scene, state = states["roman_6_2"]
    deep = replace(state, numbers={**state.numbers, "penetration": 1e-5})
    grades = [{c.name: c.grade for c in of_state(scene, one)}["walls"] for one in (state, deep)]
    assert grades == [GOOD, POOR]
    unknown = {name: value for name, value in state.numbers.items() if name != "penetration"}
    assert {c.name: c.grade for c in of_state(scene, replace(state, numbers=unknown))}["walls"] == UNKNOWN


def test_resultants_by_hand():
    """A beam of weight 2 on two walls at 0.25 and 1: 4/3 and 2/3; a share of its own at a clamp; a push that pulls."""
    up = np.array([0.0, 1.0, 0.0])
    centre = np.array([0.0, 0.0, 0.5])
    weight = -2.0 * up
    places = np.array([[0.0, 0.0, 0.25], [0.0, 0.0, 1.0]])
    assert unbalanced([], weight, centre, [Push(up, 2.0 * up, places)]) < 1e-12
    assert unbalanced([], weight, centre, [Push(up, 1.9 * up, places)]) > 0.04
    assert unbalanced([], weight, centre, [Push(up, 2.0 * up, places[1:])]) > 0.39  # it would turn over
    held = Wrench(np.zeros(3), 2.0 * up, np.array([-1.0, 0.0, 0.0]))
    assert unbalanced([held], weight, centre) < 1e-12
    assert unbalanced([Wrench(np.zeros(3), 2.0 * up, np.zeros(3))], weight, centre) > 0.4
    far = np.array([1e6, -2e6, 3e6])
    assert unbalanced([Wrench(far, held.force, held.moment)], weight, centre + far) < 1e-9
    assert np.isnan(unbalanced([Wrench(np.zeros(3), up * np.nan, np.zeros(3))], weight, centre))
