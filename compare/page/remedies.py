"""What the user of a scene can do about a state that is no stable equilibrium: written once, in keys and flags.

Solvers speak in status codes, numbers and their own options; the words of scenes and commands stand with each model
(`compare.models.capabilities.Advises`).
"""

from __future__ import annotations

from typing import Protocol

from compare.models import model
from compare.models.capabilities import Advises


class Ended(Protocol):
    """What is asked of a state (`compare.models.base.State`)."""

    @property
    def model(self) -> str: ...

    @property
    def word(self) -> str: ...

    @property
    def message(self) -> str: ...

    @property
    def remedy(self) -> str | None: ...


def remedy(name: str, word: str) -> str:
    """What is said after the message of a model's solver that ends with this word; "" where nothing is."""
    found = model(name)
    return found.remedies.get(word, "") if isinstance(found, Advises) else ""


def message(state: Ended) -> str:
    """The solver's message with the remedy."""
    own = state.remedy
    return state.message + (remedy(state.model, state.word) if own is None else own)
