"""What an elastica's result holds beside that of every model."""

from __future__ import annotations

from compare.models.quantities import Answered
from compare.record.quantity import ABSENT, DATA, Quantity

QUANTITIES: tuple[Quantity[Answered], ...] = (
    Quantity("model.energy", kind=DATA, of=lambda a: "elastica"),
    Quantity("model.formulation", kind=DATA, of=lambda a: "theta"),
    Quantity("model.elements", kind=DATA, of=lambda a: len(a.state.native.nodes) - 1),
    Quantity("model.degree", kind=DATA, of=lambda a: a.state.native.degree),
    Quantity("path.reached", kind=DATA, of=lambda a: a.state.native.load_factor),
    Quantity("path.steps", kind=DATA, of=lambda a: a.state.native.steps),
    Quantity("path.limit_points", kind=DATA, of=lambda a: a.state.native.limits),
    Quantity("path.switches", kind=DATA, of=lambda a: a.state.native.switches),
    Quantity("tip_load", unit="D w / l^2", kind=DATA,
             of=lambda a: ABSENT if a.scene.tip is None else a.scene.tip_load),
)  # fmt: skip
