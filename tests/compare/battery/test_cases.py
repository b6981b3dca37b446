"""The battery's own cases as tests: the quick rungs in `make test`, all of them in `make validate`."""

from __future__ import annotations

import pytest

from compare.battery import run
from compare.battery.case import Case, Rung
from compare.battery.cases import own
from compare.battery.groups import GROUPS, cases_of


def _rungs(long: bool) -> list[object]:
    return [
        pytest.param(case, rung, id=run.label(case, rung))
        for group in GROUPS
        for case in cases_of(group)
        for rung in (case.long if long else case.rungs)
    ]


def _judged(case: Case, rung: Rung) -> None:
    tried = run.attempt(case, rung, timed=False)
    if tried.ended == run.SKIPPED:
        pytest.skip(tried.why)
    if tried.ended == run.KNOWN:
        pytest.xfail(tried.why)
    assert tried.ended != run.MENDED, "it holds now: take it out of `known`"
    lines = [f"{c.what}: {c.value:.6g} > {c.bound:.3g} ({c.said})" for c in run.failed(tried, timed=False)]
    assert tried.ended == run.PASSED, "\n".join([tried.why, *lines])


@pytest.mark.parametrize(("case", "rung"), _rungs(long=False))
def test_the_quick_rungs_hold(case: Case, rung: Rung):
    _judged(case, rung)


@pytest.mark.validate
@pytest.mark.parametrize(("case", "rung"), _rungs(long=True))
def test_the_long_rungs_hold(case: Case, rung: Rung):
    _judged(case, rung)


#: Own scenes of the quick rungs of "own/solve" and "own/moved" (tests/slow.json) that take a fifth of their time
#: together: circles, a film between two clamps, strips held at one end, a Moebius band, with and without weight.
BRIEF = (3, 4, 6, 7, 8, 9)


def test_own_scenes_are_answered_and_mean_the_same_moved(monkeypatch):
    """What both rungs ask for, of `BRIEF`."""
    monkeypatch.setattr(own, "EACH", 1)
    checks = [check for number in BRIEF for check in own._moved(number)]
    solved = own.of_command(
        lambda scene: ["solve"] if int(scene.title.split()[1]) in BRIEF else None, own._solved, max(BRIEF) + 1
    )
    checks += solved(0)
    assert len(checks) > 30
    assert [f"{c.what}: {c.value:.6g} > {c.bound:.3g} ({c.said})" for c in checks if not c.ok and not c.timed] == []
