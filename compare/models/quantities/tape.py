"""What a tape spring's result holds beside that of every model: the fold and the way."""

from __future__ import annotations

from typing import Any

from compare.models.quantities import Answered
from compare.record.quantity import DATA, Quantity


def _path(a: Answered) -> dict[str, Any]:
    rows = a.state.log
    return {
        "stages": len(a.scene.stages()),
        "steps": len(rows),
        "jumps": sum(bool(row["jump"]) for row in rows),
        "greatest_moment": max((abs(row["moment_end"]) for row in rows), default=None),
        "greatest_force": max((abs(row["force_y"]) for row in rows), default=None),
    }


QUANTITIES: tuple[Quantity[Answered], ...] = (
    Quantity("fold.s", kind=DATA, of=lambda a: a.state.numbers.get("fold")),
    Quantity("fold.curvature_across", kind=DATA, of=lambda a: a.state.numbers.get("flattest")),
    Quantity("path", kind=DATA, of=_path),
)
