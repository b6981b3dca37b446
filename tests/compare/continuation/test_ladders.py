"""The ladders of branches: quick rungs here, all of them in `make validate`."""

import pytest

from compare.battery import run
from tests.compare.continuation.ladders import CASES


def rungs(long):
    return [
        pytest.param(case, rung, id=run.label(case, rung))
        for case in CASES
        for rung in (case.long if long else case.rungs)
    ]


def judged(case, rung):
    tried = run.attempt(case, rung, timed=False)
    if tried.ended == run.KNOWN:
        pytest.xfail(tried.why)
    assert tried.ended != run.MENDED, "it holds now: take it out of `known`"
    lines = [f"{c.what}: {c.value:.6g} > {c.bound:.3g} ({c.said})" for c in run.failed(tried, timed=False)]
    assert tried.ended == run.PASSED, "\n".join([tried.why, *lines])


@pytest.mark.parametrize(("case", "rung"), rungs(long=False))
def test_the_quick_rungs_hold(case, rung):
    judged(case, rung)


@pytest.mark.validate
@pytest.mark.parametrize(("case", "rung"), rungs(long=True))
def test_the_long_rungs_hold(case, rung):
    judged(case, rung)
