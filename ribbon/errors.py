"""What `ribbon` raises: bad input, and a derivative that does not exist."""

from __future__ import annotations

from typing import Any


class RibbonInputError(ValueError):
    """Input that no ribbon can have; the message names the argument, its value and what would be right.

    Attributes: ``key`` (name of the argument), ``value`` (what was given), ``remedy`` (what would be right).
    """

    def __init__(self, key: str, value: object, remedy: str) -> None:
        super().__init__(f"{key} = {value!r}: {remedy}")
        self.key = key
        self.value = value
        self.remedy = remedy

    def __reduce__(self) -> tuple[Any, ...]:
        # an exception is pickled by its args (the finished line); these are what __init__ takes
        return type(self), (self.key, self.value, self.remedy)


class NotDifferentiable(ValueError):
    """An equilibrium that has no derivative by its parameters; the message says why.

    Attributes: ``reason``: the status of a state that is no stable equilibrium ("not_converged", "saddle", ...),
    "singular" (a fold, a bifurcation, a motion that nothing resists) or "degenerate" (a contact that touches without
    pushing), "itself" (a strip that touches itself).
    """

    def __init__(self, reason: str, message: str) -> None:
        super().__init__(f"no derivative: {message}")
        self.reason = reason
        self.message = message

    def __reduce__(self) -> tuple[Any, ...]:
        # an exception is pickled by its args (the finished line); these are what __init__ takes
        return type(self), (self.reason, self.message)
