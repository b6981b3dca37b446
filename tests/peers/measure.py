"""Every peer's best settings, and all of them in turn with these."""

from __future__ import annotations

import statistics
from typing import Any

from tests.peers import auto, bvp, optimal
from tests.peers.cases import Case, Run, cases, reference
from tests.peers.ours import Ribbon, scaling

OURS = "ribbon.solve"
#: Timed in turn this many times.
ROUNDS = 5
#: Up to this many segments the default solve is asked how it grows.
LARGEST = 100_000


def peers() -> dict[str, Any]:
    """All of them, ours first."""
    return {
        OURS: Ribbon(),
        "ribbon.solve, then refine": Ribbon(refined=True),
        "ribbon.solve, solver = ipopt": Ribbon("ipopt"),
        "AUTO-07p": auto,
        "solve_bvp": bvp,
        "CasADi + Ipopt": optimal,
    }


def compared(found: Case, present: dict[str, Any]) -> dict[str, Run | str]:
    """Median of ROUNDS, all in turn, each with its best settings; in words why one has none."""
    reference(found.name)
    settings: dict[str, Any] = {}
    out: dict[str, Run | str] = {}
    for name, peer in present.items():
        try:
            settings[name] = peer.best(found)
        except AssertionError as error:
            out[name] = str(error)
    runs: dict[str, list[Run]] = {name: [] for name in settings}
    for _ in range(ROUNDS):
        for name, chosen in settings.items():
            runs[name].append(present[name].run(found, chosen))
    for name, done in runs.items():
        out[name] = Run(done[0].settings, max(r.error for r in done), statistics.median(r.seconds for r in done))
        print(f"  {found.name} {name}: {out[name]}", flush=True)
    return {name: out[name] for name in present}


def measure(words: list[str]) -> dict[str, dict[str, Run | str]]:
    """The cases whose name has one of the words, in this process."""
    present = {name: peer for name, peer in peers().items() if peer.absent() is None}
    chosen = [found for found in cases() if not words or any(word in found.name for word in words)]
    return {found.name: compared(found, present) for found in chosen}


def grown() -> list[tuple[int, float, str]]:
    """`scaling` of the lightest coil, in this process."""
    return scaling(cases()[1], LARGEST)
