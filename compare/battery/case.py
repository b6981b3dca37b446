"""What a hard case is: a ladder of one difficulty, and what has to hold on each of its rungs, as numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from compare.models.base import State

Rung = float | int | str
"""A value of the difficulty parameter: a number, or a name (a scene, a model, a way of going wrong)."""


@dataclass(frozen=True)
class Check:
    """One number and the bound that it has to keep.

    what: what is measured, with its unit; value <= bound passes, NaN does not; timed: seconds, which a command judges
    and a test does not, for a busy machine is no fault; said: what explains the number (a status, where it is largest).
    """

    what: str
    value: float
    bound: float
    timed: bool = False
    said: str = ""

    @property
    def ok(self) -> bool:
        """Whether the bound is kept."""
        return bool(self.value <= self.bound)

    @property
    def strain(self) -> float:
        """How much of the bound is used: 1 at the bound, infinite for NaN and for more than nothing of nothing."""
        if self.ok and self.value <= 0.0:
            return 0.0
        return abs(self.value / self.bound) if self.bound and not math.isnan(self.value) else math.inf


def holds(what: str, true: bool, said: str = "") -> Check:
    """A check of a statement: 0 where it is true, 1 where it is false."""
    return Check(what, 0.0 if true else 1.0, 0.0, said=said)


def near(what: str, value: float, expected: float, bound: float, said: str = "") -> Check:
    """A check of a value: its distance from what is expected, over the larger of 1 and its size."""
    off = abs(value - expected) / max(1.0, abs(expected))
    return Check(what, off, bound, said=said or f"{value:.10g}, expected {expected:.10g}")


def ends_as(state: State, *codes: str) -> Check:
    """A check of a state's status: one of `codes` (`compare.models.base.Status`)."""
    return holds(f"status {' or '.join(codes)}", state.status.code in codes, f"{state.status.code}: {state.message}")


@dataclass(frozen=True)
class Case:
    """A hard case.

    name: "group/name"; hard: what is hard about it; expected: what has to hold, and why; parameter: the difficulty,
    with its unit; run: what checks one rung (raises `ribbonbench.errors.Missing` for a library that is not there; any
    other exception is a failure); rungs: easy ones first, the quick part, for `make test` too; long: those that are for
    the long run alone; known: rung -> why it is known to fail, which stays in the table.
    """

    name: str
    hard: str
    expected: str
    parameter: str
    run: Callable[[Rung], Iterable[Check]]
    rungs: tuple[Rung, ...]
    long: tuple[Rung, ...] = ()
    known: Mapping[Rung, str] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def group(self) -> str:
        """The part of the name before the stroke."""
        return self.name.partition("/")[0]

    def ladder(self, long: bool) -> tuple[Rung, ...]:
        """The rungs of a run."""
        return (*self.rungs, *self.long) if long else self.rungs
