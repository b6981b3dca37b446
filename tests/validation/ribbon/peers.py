"""Other people's solvers beside ours at equal error (tests/peers); the page is remade where all of them are there."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from tests.peers.__main__ import Grown, Measured, report
from tests.peers.cases import TARGET, Run, case
from tests.peers.measure import OURS, grown, measure, peers
from tests.peers.ours import Ribbon
from tests.validation import one_core
from tests.validation.number import Number

#: The case that the probes ask, K > 0, and segments on which they do; what the reference leaves of a free end (l).
LIGHTEST, REQUESTED, REFERENCE = "coil_10_100", (28, 56), 1e-9
_TIME = "CPU times of one run"


def absent() -> str | None:
    """Which of the peers are not here, and why."""
    gone = [f"{name}: {why}" for name, peer in peers().items() if (why := peer.absent()) is not None]
    return "; ".join(gone) or None


@cache
def _error(segments: int) -> float:
    """Distance (l) of our free end on so many segments to solve_bvp's."""
    return Ribbon().run(case(LIGHTEST, 1), (segments, segments)).error


PROBES = {"error_28": lambda: _error(28), "error_56": lambda: _error(56)}


def _numbers(measured: dict[str, dict[str, Run | str]], sizes: Grown) -> dict[str, Number]:
    """Ratios of times to ours by peer over the cases, the largest error, and what the probes ask."""
    numbers: dict[str, Number] = {}
    done: Measured = {
        name: {who: r for who, r in runs.items() if isinstance(r, Run)} for name, runs in measured.items()
    }
    for who in peers():
        ratios = [runs[who].seconds / runs[OURS].seconds for runs in done.values() if {who, OURS} <= set(runs)]
        if who != OURS and ratios:
            word = "".join(letter if letter.isalnum() else "_" for letter in who.lower())
            numbers[f"{word}_least"] = Number(min(ratios), None, shown=".2g", why=_TIME)
            numbers[f"{word}_most"] = Number(max(ratios), None, shown=".2g", why=_TIME)
    for segments in REQUESTED:
        numbers[f"error_{segments}"] = Number(_error(segments), REFERENCE, "l", ".2e")
    most, seconds, _ = sizes[-1]
    worst = max(r.error for runs in done.values() for r in runs.values())
    return numbers | {
        "error": Number(worst, REFERENCE, "l", ".1e"),
        "target": Number(TARGET, 0, "l", ".0e"),
        "segments": Number(most, 0, shown="d"),
        "microseconds": Number(1e6 * seconds, None, "us", ".3g", why=_TIME),
    }


def run(out: Path) -> dict[str, Number]:
    """Writes peers.md, its tables and its picture."""
    measured, sizes = one_core.call(measure, []), one_core.call(grown)
    report(out, measured, sizes)
    return _numbers(measured, sizes)
