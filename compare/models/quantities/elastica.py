"""What an elastica's result holds beside that of every model."""

from __future__ import annotations

from typing import Any

from compare.models.quantities import Answered
from compare.record.quantity import ABSENT, DATA, Quantity


def _model(a: Answered) -> dict[str, Any]:
    r = a.state.native
    return {"energy": "elastica", "formulation": "theta", "elements": len(r.nodes) - 1, "degree": r.degree}


def _path(a: Answered) -> dict[str, Any]:
    r = a.state.native
    return {"reached": r.load_factor, "steps": r.steps, "limit_points": r.limits, "switches": r.switches}


QUANTITIES: tuple[Quantity[Answered], ...] = (
    Quantity("model", kind=DATA, of=_model),
    Quantity("path", kind=DATA, of=_path),
    Quantity("tip_load", unit="D w / l^2", kind=DATA,
             of=lambda a: ABSENT if a.scene.tip is None else a.scene.tip_load),
)  # fmt: skip
