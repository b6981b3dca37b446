"""Thesis 7.2: the shift at which the arch gives way, of every model and of shells, over meshes and with its error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.measure.mesh_limit import Settled, settled
from ribbon import Equilibrium
from ribbon.find.branch.critical import Critical, critical
from ribbon.find.branch.passages import Grading, passages
from ribbon.find.branch.passages import settled as on_passages
from ribbon.find.continuation import switch
from tests.validation.workbench.shift_sweeps import FIRST, Case, tilt

#: Tilt of the middle's normal (degrees) above which a state is not on the arch's own branch.
UPRIGHT = 1e-2
#: Largest shift looked at, first step, step on finer elements, which begin this far before the coarser ones' answer.
LAST, STEP, NEAR, BEFORE = 0.6, 0.05, 0.01, 0.03
#: To what a critical shift is located on its elements.
WITHIN = 3e-4


@dataclass(frozen=True)
class Ladder:
    """A case on three (or `rungs`) meshes: elements graded to its passages, or equal ones (grading None), halved."""

    case: Case
    grading: Grading | None
    rungs: int = 3

    @property
    def name(self) -> str:
        """For files."""
        placed = "" if self.grading is None else f"_{self.grading.longest:g}_{self.grading.least:g}"
        return f"lost_{self.case.name}{placed}_{self.rungs}"


def _solve(ladder: Ladder, rung: int, shift: float, near: Equilibrium) -> Equilibrium:
    problem = ladder.case.problem(shift)
    if ladder.grading is not None:
        return on_passages(problem, near, ladder.grading.finer(2.0**rung))
    equal = np.full(ladder.case.segments * 2**rung, 1.0 / (ladder.case.segments * 2**rung))
    placed: Any = problem
    return switch(placed.with_changes(lengths=equal), near)


def climbed(ladder: Ladder) -> list[dict[str, Any]]:
    """Where the arch is lost on each mesh: "p", "shift" (None: it is not), "located", "kind", "states" (shift, lowest
    eigenvalue), "passages" of the last stable state; coarse to fine, each begun near the answer of the one before."""
    found, at, step, told = ladder.case.arch(), FIRST, STEP, []
    for rung in range(ladder.rungs):
        found = _solve(ladder, rung, at, found)
        lost: Critical = critical(
            lambda shift, near, k=rung: _solve(ladder, k, shift, near),  # type: ignore[misc]
            found, at, LAST, step, WITHIN, lambda state: tilt(state) < UPRIGHT,
        )  # fmt: skip
        told.append({
            "p": int(lost.last.problem.lengths.size), "shift": lost.value, "located": lost.located, "kind": lost.kind,
            "states": lost.states, "passages": passages(lost.last).tolist(),
        })  # fmt: skip
        print(f"  {ladder.name}: p = {told[-1]['p']}, {lost.value}, {lost.kind}, {lost.located:.1e}", flush=True)
        if lost.value is None:
            break
        at, step = max(FIRST, lost.value - BEFORE), NEAR
        found = _solve(ladder, rung, at, lost.last)
    return told


def limit(rungs: Sequence[dict[str, Any]], ratio: float = 2.0) -> Settled:
    """The critical shift of the strip, from that on its meshes."""
    values = [np.nan if rung["shift"] is None else float(rung["shift"]) for rung in rungs]
    return settled(values, max(float(rung["located"]) for rung in rungs), ratio)
