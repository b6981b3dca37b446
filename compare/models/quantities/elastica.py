"""What an elastica's result holds beside that of every model."""

from __future__ import annotations

from typing import Any

from compare.models.quantities import Answered, walls_of
from compare.record.quantity import ABSENT, DATA, Quantity


def contacts(a: Answered) -> Any:
    """As of a ribbon: where parts that are kept apart touch, both places in the middle of the width (s over l), the
    force on the first (D w / l^2) and the gap (l); of a scene that keeps them."""
    if a.scene.apart is None:
        return ABSENT
    y, x = -a.scene.frame[:, 1], a.scene.frame[:, 2]
    return [
        {"s": touch.s, "v": 0.0, "s_other": touch.other, "v_other": 0.0,
         "force": touch.force[0] * x + touch.force[1] * y, "gap": touch.gap + a.scene.apart}
        for touch in a.state.native.touches if touch.barrier is None
    ]  # fmt: skip


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
    Quantity("contacts", kind=DATA, of=contacts),
    Quantity("walls", kind=DATA, of=lambda a: walls_of(a.state) if a.scene.obstacles else ABSENT),
    Quantity("penetration", unit="l", kind=DATA,
             of=lambda a: ABSENT if a.state.native.through is None else a.state.native.through),
)  # fmt: skip
