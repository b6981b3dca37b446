"""Other people's solvers beside ours at equal error (tests/peers); the page is remade where all of them are there."""

from __future__ import annotations

from pathlib import Path

from tests.peers.__main__ import report
from tests.peers.measure import grown, measure, peers
from tests.validation import one_core


def run(out: Path) -> None:
    gone = [f"{name}: {why}" for name, peer in peers().items() if (why := peer.absent()) is not None]
    measured = one_core.call(measure, [])
    if gone:
        print("  results/peers.md stays as it is; absent: " + "; ".join(gone), flush=True)
    else:
        report(out, measured, one_core.call(grown))
