"""A state as a row of a sweep: plain numbers under the names of the columns of cases.csv.

It stands apart from the record of all rows (`compare.sweep.record`), so that a sweep of one model does not depend on
the others.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.load_curve import LoadPoint
from compare.models.base import State
from compare.models.quantities import Answered
from compare.page.force_displacement import supports_of
from compare.page.state import ERRORS, NUMBER, STATE, own_of
from compare.record.quantity import ABSENT, Quantity
from compare.record.views import row_of as cells_of
from compare.scene.scene import Scene

Row = dict[str, Any]
FloatArray = NDArray[np.float64]

#: Where a strip that may rest in several ways is compared with its neighbours in the grid, besides middle and end.
_QUARTERS = (0.25, 0.75)
#: What is a key of the row where it is not known, too.
_ALWAYS = ("residual", "iterations", "lowest_eigenvalue", "error")
_STRETCHING = ("energy.bending", "energy.membrane", "energy.shear")


def _reach(a: Answered) -> Any:
    """y / x: how far the free end hangs below the start, over its horizontal distance from it (thesis, 4.5)."""
    scene, end = a.scene, a.state.end
    if end is None or scene.up is None or scene.start_position is None or scene.end_position is not None:
        return ABSENT
    found = float(reach(end.position - scene.start_position, scene.up))
    return found if math.isfinite(found) else ABSENT


def reach(path: FloatArray, up: FloatArray) -> FloatArray:
    """y / x of the ways (..., 3) from the start to the free end; not finite where there is nothing across."""
    drop = -(path @ up)
    across = np.linalg.norm(path + drop[..., None] * up, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(drop / across)


#: What a row holds of a state that result.json says in other words.
OF_ROWS: tuple[Quantity[Answered], ...] = (
    Quantity("segments", kind="integer", note="of the ribbon, or elements of the elastica",
             of=lambda a: a.state.numbers.get("segments", ABSENT)),
    Quantity("elements", note="of the shell", of=lambda a: a.state.numbers.get("elements", ABSENT)),
    Quantity("y_over_x", kind=NUMBER, note="drop of the free end over its horizontal distance", of=_reach),
)  # fmt: skip
_ERRORS = ("discretisation_error", *(quantity.key for quantity in ERRORS))
#: What the row of a case has from elsewhere, or a shell says in columns of its own.
NOT_OF_ROWS = ("status", "stable", "width_to_thickness", "share", "reused")


@functools.cache
def quantities_of_rows(name: str) -> tuple[Quantity[Answered], ...]:
    """What a row holds of a state of the model of this name: what every model has, and what this one adds."""
    known = {quantity.key for quantity in STATE}
    own = [quantity for quantity in own_of(name) if quantity.key not in known]
    return tuple(quantity for quantity in (*STATE, *own, *OF_ROWS) if quantity.key not in NOT_OF_ROWS)


def row_of(scene: Scene, state: State, errors: bool = False) -> Row:
    """A state as a row; errors: its error was asked for. What it does not have, or does not know, has no entry.

    A shell that did not arrive stands at another load: it has its status only.
    """
    row: Row = {"status": state.word, "stable": state.stable}
    if state.shape is None or (state.energy is not None and state.energy.elastic is None):
        return row
    for name, value in state.numbers.items():
        if isinstance(value, Mapping):
            row.update({f"{name}.{part}": number for part, number in value.items()})
    told = errors or state.error is not None
    shown = [q for q in quantities_of_rows(state.model) if told or q.key not in _ERRORS]
    found = cells_of(shown, Answered(scene, state))
    row |= {key: value for key, value in found.items() if value is not None or key in _ALWAYS}
    if any(key not in row for key in _STRETCHING[1:]):  # the parts of models that tell stretching apart, or none
        for key in _STRETCHING:
            row.pop(key, None)
    if scene.clamp_start is None:
        for key in [key for key in row if key.startswith(("force.start", "moment.start"))]:
            del row[key]
    if scene.several_equilibria:
        row["quarters"] = state.shape.centreline(np.array(_QUARTERS)).tolist()
    walls = {f"wall.{wall['name']}": wall["force"] for wall in state.supports.walls}
    row |= supports_of(LoadPoint({}, walls, {}))
    if told:
        sure = zip(state.supports.walls, state.errors.get("forces", {}).get("walls") or (), strict=False)
        row |= {f"force_error.wall.{wall['name']}": float(error) for wall, error in sure if error is not None}
    return row
