"""The ribbon of this repository: `ribbon.solve` alone, and on few segments with `refine`; its solvers."""

from __future__ import annotations

import inspect
import time
from dataclasses import dataclass
from typing import Any

from ribbon import Equilibrium, refine, solve
from tests.peers.cases import BRANCH, TARGET, Case, Run

#: Numbers of segments tried, in this order.
LADDER = (10, 14, 20, 28, 40, 56, 80, 112, 160, 224, 320, 448, 640)
Settings = tuple[int, int]


@dataclass(frozen=True)
class Ribbon:
    """A way to solve: solver None: the default; refined: from few segments, cut in two again and again."""

    solver: str | None = None
    refined: bool = False

    def absent(self) -> str | None:
        """Why it cannot be run; None: it can."""
        known = "solver" in inspect.signature(solve).parameters
        return None if self.solver is None or known else "ribbon.solve takes no solver here"

    def version(self) -> str:
        """What it is."""
        return "this checkout"

    def _solved(self, found: Case, settings: Settings) -> Equilibrium:
        keywords: dict[str, Any] = {} if self.solver is None else {"solver": self.solver}
        ribbon = found.ribbon(settings[0], **keywords)
        while ribbon.problem.lengths.size < settings[1]:
            ribbon = refine(ribbon)
        return ribbon

    def run(self, found: Case, settings: Settings) -> Run:
        """CPU time of solve and refinements, their stability checks and the free end included."""
        begun = time.process_time()
        ribbon = self._solved(found, settings)
        tip = ribbon.end.position
        seconds = time.process_time() - begun
        words = f"p = {settings[1]}" + (f" from {settings[0]}" if settings[0] < settings[1] else "")
        return Run(words if ribbon.ok else f"{words}, {ribbon.status.code}", found.error(tip), seconds)

    def best(self, found: Case) -> Settings:
        """The fewest segments within the target; refined: the fastest such chain."""
        good: list[tuple[float, Settings]] = []
        for first in LADDER:
            if not self.refined:
                if self.run(found, (first, first)).error <= TARGET:
                    return first, first
                continue
            last = first
            tried = self.run(found, (first, first))
            while BRANCH > tried.error > TARGET and last < LADDER[-1]:
                last *= 2
                tried = self.run(found, (first, last))
            if tried.error <= TARGET and last > first:
                good.append((min(self.run(found, (first, last)).seconds for _ in range(3)), (first, last)))
            if len(good) == 4:
                break
        if not good:
            raise AssertionError(f"{found.name}: no more than {LADDER[-1]} segments reach {TARGET:g}")
        return min(good)[1]


def scaling(found: Case, largest: int, budget: float = 30.0) -> list[tuple[int, float, str]]:
    """Segments, CPU s per segment and status of default solves up to `largest`, as long as the next one
    may end within `budget` s."""
    rows, segments = [], 10
    while segments <= largest:
        found.ribbon(segments)
        times = []
        while len(times) < 3 and sum(times) < 2.0:
            begun = time.process_time()
            status = found.ribbon(segments).status.code
            times.append(time.process_time() - begun)
        rows.append((segments, min(times) / segments, status))
        if 12.0 * times[0] > budget:  # ten times as many segments: ten times this, at best
            break
        segments *= 10
    return rows
