"""What the results of each model hold beside those of every model (`compare.page.state.STATE`), one module a model.

They are read wherever a table is made: none of them loads a solver before it takes a value.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

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
