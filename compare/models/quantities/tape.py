"""What a tape spring's result holds beside that of every model: the fold and the way."""

from __future__ import annotations

from compare.models.quantities import Answered
from compare.record.quantity import DATA, Quantity


def _greatest(a: Answered, name: str) -> float | None:
    return max((abs(row[name]) for row in a.state.log), default=None)


QUANTITIES: tuple[Quantity[Answered], ...] = (
    Quantity("fold.s", unit="l", kind=DATA, of=lambda a: a.state.numbers.get("fold")),
    Quantity("fold.curvature_across", unit="1/l", kind=DATA, of=lambda a: a.state.numbers.get("flattest")),
    Quantity("path.stages", kind=DATA, of=lambda a: len(a.scene.stages())),
    Quantity("path.steps", kind=DATA, of=lambda a: len(a.state.log)),
    Quantity("path.jumps", kind=DATA, of=lambda a: sum(bool(row["jump"]) for row in a.state.log)),
    Quantity("path.greatest_moment", unit="moment", kind=DATA, of=lambda a: _greatest(a, "moment_end")),
    Quantity("path.greatest_force", unit="D w / l^2", kind=DATA, of=lambda a: _greatest(a, "force_y")),
)
