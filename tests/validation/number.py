"""A measured number with its error: what a measurement's `run` returns by name, and what probes are held to.

It imports nothing of ours, so that no key of a page moves when the keeping of pages changes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

#: What two processors may differ by where nothing is open: a part of the number itself.
ROUNDING = 1e-12
#: What rounding leaves may be so many times as large on another processor.
PROCESSORS = 10.0


@dataclass(frozen=True)
class Number:
    """One number of a page.

    value: in `unit` ("" for a pure number, "l", "ms", "%", ...). error: absolute, in the same unit; what the
    measurement leaves open (from p, 2 p, 4 p or a tolerance halved twice; 0 for a count or what is exact but for
    rounding). None where it has none, and then `why` ("wall time of one run"). shown: the format of the pages.

    Raises ValueError for a value or an error that is not finite, a negative error, and for none without a reason.
    """

    value: float
    error: float | None
    unit: str = ""
    shown: str = ".4g"
    why: str = ""

    def __post_init__(self) -> None:
        if not math.isfinite(self.value):
            raise ValueError(f"value = {self.value}: a measured number is finite")
        if self.error is None and not self.why:
            raise ValueError(f"value = {self.value:g}, error = None: say why there is none")
        if self.error is not None and not 0.0 <= self.error < math.inf:
            raise ValueError(f"value = {self.value:g}, error = {self.error}: an error is finite and not negative")
        format(self.value, self.shown)

    def __str__(self) -> str:
        return format(self.value, self.shown)

    def apart(self, value: float) -> float | None:
        """How many times its error `value` is away; None where it has no error. Above 1: not the same number."""
        if self.error is None:
            return None
        distance, allowed = abs(value - self.value), self.error + ROUNDING * abs(self.value)
        return 0.0 if distance == 0.0 else distance / allowed if allowed else math.inf


def of_settled(record: Mapping[str, Any], shown: str = ".4f") -> Number:
    """A critical number as `compare.measure.mesh_limit.Settled.record` has it: with its error, or why there is none."""
    why = "" if record["error"] is not None else "it does not settle over its meshes"
    return Number(record["value"], record["error"], record["unit"], shown, why)


def rounding(value: float, unit: str = "", shown: str = ".0e") -> Number:
    """A number that is a rounding error itself: elsewhere it is another, and at most `PROCESSORS` times as large."""
    return Number(value, (PROCESSORS - 1.0) * abs(value), unit, shown)
