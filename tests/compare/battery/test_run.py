"""How cases are run: what passes, fails, is known to fail or lacks a library; and that an interrupted run goes on."""

from __future__ import annotations

import json
import math

import pytest

from compare.battery import page
from compare.battery.case import Case, Check, holds, near
from compare.battery.groups import GROUPS, cases_of, chosen
from compare.battery.run import FAILED, KNOWN, MENDED, PASSED, SKIPPED, attempt, run
from compare.cli import main
from ribbonbench.errors import BadInput, Missing


def ladder(function, rungs=(1.0, 2.0, 3.0), long=(), known=None):
    return Case("group/name", "hard", "expected", "x", function, rungs, long, known or {})


def up_to(limit):
    return lambda x: [Check("x", float(x), limit)]


@pytest.mark.parametrize(
    ("value", "bound", "ok"), [(1.0, 1.0, True), (1.0 + 1e-12, 1.0, False), (math.nan, 1.0, False), (0.0, 0.0, True)]
)
def test_a_number_passes_up_to_its_bound(value, bound, ok):
    assert Check("x", value, bound).ok is ok


def test_near_is_relative_to_large_values_only():
    assert near("x", 1001.0, 1000.0, 1e-3).ok
    assert not near("x", 0.011, 0.01, 1e-4).ok


def test_it_goes_to_the_last_rung_before_a_failure():
    (outcome,) = run([ladder(up_to(2.5))])
    assert [t.ended for t in outcome.tried] == [PASSED, PASSED, FAILED]
    assert (outcome.reaches, outcome.ended) == (2.0, FAILED)
    assert outcome.worst.value == 3.0


def test_long_rungs_are_for_the_long_run():
    case = ladder(up_to(9.0), long=(4.0,))
    assert [len(o.tried) for long in (False, True) for o in run([case], long)] == [3, 4]


def test_known_failures_stay_and_mended_ones_are_told():
    (outcome,) = run([ladder(up_to(2.5), known={2.0: "was hard", 3.0: "is hard"})])
    assert [t.ended for t in outcome.tried] == [PASSED, MENDED, KNOWN]
    assert "is hard" in outcome.why


def test_an_exception_is_a_failure_and_a_missing_library_is_none():
    def breaks(x):
        raise ZeroDivisionError("no")

    def lacks(x):
        raise Missing("mpmath", "pip install mpmath")

    assert attempt(ladder(breaks), 1.0).ended == FAILED
    assert attempt(ladder(lacks), 1.0).ended == SKIPPED
    assert attempt(ladder(lambda x: []), 1.0).ended == FAILED  # it checked nothing


def test_seconds_are_judged_by_the_command_alone():
    case = ladder(lambda x: [Check("time", 5.0, 2.0, timed=True), holds("it ended", True)])
    assert attempt(case, 1.0).ended == FAILED
    assert attempt(case, 1.0, timed=False).ended == PASSED


def test_what_is_done_is_not_done_again():
    calls, kept = [], {}

    def counted(x):
        calls.append(x)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return [Check("x", float(x), 9.0)]

    case = ladder(counted)
    with pytest.raises(KeyboardInterrupt):
        list(run([case], False, "a", kept, kept.__setitem__))
    (outcome,) = run([case], False, "a", json.loads(json.dumps(kept)), kept.__setitem__)
    assert calls == [1.0, 2.0, 3.0, 3.0]
    assert outcome.ended == PASSED
    list(run([case], False, "other sources", kept))
    assert len(calls) == 7


def test_cases_of_all_groups_are_well_formed():
    names = [case.name for group in GROUPS for case in cases_of(group)]
    assert len(set(names)) == len(names)
    for group in GROUPS:
        for case in cases_of(group):
            rungs = (*case.rungs, *case.long)
            assert len(set(rungs)) == len(rungs), case.name
            assert set(case.known) <= set(rungs), case.name
            assert case.hard, case.name
            assert case.expected, case.name


def test_patterns_choose():
    assert {case.group for case in chosen("functions")} == {"functions"}
    assert [case.name for case in chosen("width_factor")] == ["functions/width_factor"]
    with pytest.raises(BadInput, match="fits no case"):
        chosen("no such thing")


def test_table_and_answer_tell_a_failure(tmp_path):
    outcomes = list(run([ladder(up_to(2.5))]))
    assert page.answer(outcomes).grade == "poor"
    page.write(tmp_path, outcomes, False, "ribbonbench battery")
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["rungs"] == {PASSED: 2, FAILED: 1, KNOWN: 0, MENDED: 0, SKIPPED: 0}
    assert result["cases"][0]["tried"][2]["checks"][0]["value"] == 3.0
    assert (tmp_path / "battery.png").stat().st_size > 0


def test_the_command_runs_and_goes_on(tmp_path, capsys):
    command = ["battery", "functions/rounded", "--out", str(tmp_path), "--json"]
    assert main(command) == 0
    first = json.loads(capsys.readouterr().out)
    assert main(command) == 0
    again = json.loads(capsys.readouterr().out)
    assert [t["seconds"] for t in again["cases"][0]["tried"]] == [t["seconds"] for t in first["cases"][0]["tried"]]
    assert main(["battery", "--list", "--quiet", "--out", str(tmp_path / "list")]) == 0
    names = [case["case"] for case in json.loads((tmp_path / "list" / "result.json").read_text())["cases"]]
    assert names == [case.name for case in chosen()]
    assert main(["battery", "nonsense", "--out", str(tmp_path)]) == 2
