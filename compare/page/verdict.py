"""The answer to a command's question: one sentence in plain words, and a grade."""

from __future__ import annotations

from dataclasses import dataclass

from compare.measure.grades import GRADES, UNKNOWN


@dataclass(frozen=True)
class Verdict:
    """The first line of terminal, page and report. text: a sentence without its full stop; grade: of `GRADES`, shown
    green, yellow, red, or without a colour where it is "unknown".

    ValueError: another grade, or no text.
    """

    text: str
    grade: str = UNKNOWN

    def __post_init__(self) -> None:
        if self.grade not in GRADES or not self.text:
            raise ValueError(f"no verdict: {self.text!r}, {self.grade!r}")

    @property
    def line(self) -> str:
        """The sentence with its grade."""
        return f"{self.text}." if self.grade == UNKNOWN else f"{self.text}: {self.grade}."
