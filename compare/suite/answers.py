"""What a runner says of a case: answers by the questions' names, or why there are none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from compare.suite.case import Value

#: How a runner's attempt ended.
ANSWERED, NOT_REPRESENTABLE, BROKE_DOWN, MISTAKE = "answered", "not representable", "broke down", "adapter's mistake"


class NotRepresentable(Exception):
    """Raised by a runner: its program has no such physics, question or theory; the text says which."""


class BrokeDown(Exception):
    """Raised by a runner: its program was asked rightly and found no answer; the text says how it ended. A solver that
    stops at a limit point has no defect, and ends so all the same: the text says that it was one."""


class Absent(Exception):
    """Raised by a runner before anything else: its program is not on this machine; the text says how to get it."""


@dataclass(frozen=True)
class Answer:
    """A value and its own discretisation error (the change from half as fine; of a curve the largest; None: not known),
    in the unit of the question."""

    value: Value
    error: float | None = None


@dataclass(frozen=True)
class Answers:
    """All that one way of a runner says of a case.

    way: which of its models, "" where it has one; ended: "answered", "not representable", "broke down" or "adapter's
    mistake"; why: in words, where it is not answered; states: name of a question -> what the program itself said of the
    state ("saddle", ...); settings: those that it was run with; seconds: of all of it, of one thread.
    """

    way: str = ""
    ended: str = ANSWERED
    answers: Mapping[str, Answer] = field(default_factory=dict)
    why: str = ""
    states: Mapping[str, str] = field(default_factory=dict)
    settings: str = ""
    version: str = ""
    seconds: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """As in answers.json."""
        told = {
            name: {"value": list(a.value) if isinstance(a.value, tuple) else a.value, "error": a.error}
            for name, a in self.answers.items()
        }
        return {
            "way": self.way, "ended": self.ended, "answers": told, "why": self.why, "states": dict(self.states),
            "settings": self.settings, "version": self.version, "seconds": self.seconds,
        }  # fmt: skip

    @classmethod
    def from_dict(cls, said: Mapping[str, Any]) -> Answers:
        """From a record of answers.json. Raises KeyError, TypeError or ValueError for one that is none."""
        answers = {
            str(name): Answer(
                tuple(map(float, a["value"])) if isinstance(a["value"], list) else a["value"], a.get("error")
            )
            for name, a in said.get("answers", {}).items()
        }
        ended = said.get("ended", ANSWERED)
        if ended not in (ANSWERED, NOT_REPRESENTABLE, BROKE_DOWN, MISTAKE):
            raise ValueError(f"{ended!r} is no end of an answer")
        known = {key: said[key] for key in ("way", "why", "states", "settings", "version", "seconds") if key in said}
        return cls(ended=ended, answers=answers, **known)
