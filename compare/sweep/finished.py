"""A finished sweep: its cases with their ends, in the order of the grid."""

from __future__ import annotations

from dataclasses import dataclass

from compare.studies.axes import Point
from compare.sweep.case import Record
from compare.sweep.file import Sweep


@dataclass(frozen=True)
class Case:
    """A point of the grid with its end; reused: found among the finished cases; warm: the number of the case at whose
    state it was begun (`compare.sweep.warm`), None: at its own start."""

    point: Point
    key: str
    record: Record
    reused: bool
    warm: int | None = None

    @property
    def status(self) -> str:
        """The solver's word, or "refused", "crashed", "error", "missing"."""
        return str(self.record["status"])

    @property
    def ok(self) -> bool:
        """Converged, and not known to be unstable."""
        rows = self.record["rows"]
        return self.status == "converged" and bool(rows) and all(row.get("stable") is not False for row in rows)


@dataclass(frozen=True)
class Finished:
    """A sweep's cases in the order of the grid; seconds: wall time of this run, workers: how many it had; walks: how
    many cases were begun at a neighbour's state, whatever came of it; part: "3/64" where the cases are one of many
    parts of a grid, in no order that has neighbours."""

    sweep: Sweep
    cases: tuple[Case, ...]
    seconds: float
    workers: int
    walks: int = 0
    part: str = ""

    @property
    def ok(self) -> bool:
        """Every case converged to a state that is not known to be unstable."""
        return all(case.ok for case in self.cases)
