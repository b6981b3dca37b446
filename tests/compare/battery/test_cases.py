"""The battery's own cases as tests: the quick rungs in `make test`, all of them in `make validate`."""

from __future__ import annotations

import pytest

from compare.battery import run
from compare.battery.case import Case, Rung
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
