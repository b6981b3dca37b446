"""What the results of each model hold beside those of every model (`compare.page.state.STATE`), one module a model.

They are read wherever a table is made: none of them loads a solver before it takes a value.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

if TYPE_CHECKING:
    from compare.models.base import State
    from compare.record.quantity import Quantity
    from compare.scene.scene import Scene


@dataclass(frozen=True)
class Answered:
    """A model's answer with what was asked: the item that quantities of a state are taken from."""

    scene: Scene
    state: State


@runtime_checkable
class Declares(Protocol):
    """A model whose results hold more than those of every model; a model need not."""

    @property
    def quantities(self) -> tuple[Quantity[Answered], ...]:
        """What it adds; of the key of a quantity of every model in the place of that one."""


def walls_of(state: State) -> list[dict[str, Any]]:
    """The walls that a state touches, with the errors of the ends of their `lines` (l) and of pressures (D / l^3), None
    with the reason where one is not known."""
    if not state.is_equilibrium:  # finer elements may have found one, so that it has errors without forces
        return []
    walls = list(state.supports.walls)
    known = state.errors.get("lines") or [None] * len(walls)
    unlike = "on finer elements it touches in more or fewer lines" if state.errors else "not asked for"
    found = []
    for k, (wall, error) in enumerate(zip(walls, known, strict=True)):
        nowhere = not len(wall["lines"])
        why = f"{unlike} ({state.error_why})" if state.error_why else unlike
        if nowhere:
            why = NO_LENGTH if len(wall["contacts"]) else "it touches nowhere"
        sure = None if nowhere else error
        entry = {**wall, "lines_error": sure, **({} if sure is not None else {"lines_error_why": why})}
        for name in ("mean_pressure", "greatest_pressure"):
            entry |= with_error(wall, name, state.errors, k, state.error_why) if name in wall else {}
        if "friction" in wall:
            off = state.errors.get("friction", {}).get(str(k))
            entry |= {"friction_error": off, **({} if off is not None else {"friction_error_why": unlike})}
        found.append(entry)
    return found


#: Why a wall has no mean pressure.
NO_LENGTH = "it touches along no length"


def with_error(wall: Mapping[str, Any], name: str, errors: Mapping[str, Any], k: int, error_why: str) -> dict[str, Any]:
    """A number of wall k and its error, each with the reason where it is not known."""
    value, known = wall[name], (errors.get(f"{name}s") or {}).get("walls") or ()
    error = known[k] if k < len(known) else None
    entry = {name: value, f"{name}_error": error}
    entry |= {f"{name}_why": NO_LENGTH} if value is None else {}
    unlike = "on other elements it touches along no length" if errors and name == "mean_pressure" else "not asked for"
    why = NO_LENGTH if value is None else f"{unlike} ({error_why})" if error_why else unlike
    return entry if error is not None else {**entry, f"{name}_error_why": why}
