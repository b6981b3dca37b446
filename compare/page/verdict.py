"""The answer to a command's question: one sentence in plain words, and a grade that is made from what was checked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from compare.measure.grades import GOOD, GRADES, POOR, UNKNOWN, worst
from compare.page.claims import CLAIMS


@dataclass(frozen=True)
class Check:
    """One thing that a verdict rests on.

    name: as `compare.page.claims.CLAIMS` lists it; grade: of `GRADES`, "unknown" where it was not checked or stays
    open; said: what came of it, in words; value, bound: what was measured and up to which it is good, where it is a
    number; asked: False where the scene has nothing of the kind (no wall), so that there is nothing to check.

    ValueError: another grade, or no words.
    """

    name: str
    grade: str
    said: str
    value: float | None = None
    bound: float | None = None
    asked: bool = True

    def __post_init__(self) -> None:
        if self.grade not in GRADES or not self.said:
            raise ValueError(f"no check: {self.name!r}, {self.grade!r}, {self.said!r}")


def nothing(name: str, why: str) -> Check:
    """A check of what the scene has not; why: what that is."""
    return Check(name, GOOD, why, asked=False)


def unchecked(name: str, why: str = "not checked") -> Check:
    """A check that was not made, or that left it open."""
    return Check(name, UNKNOWN, why)


def bounded(name: str, value: float, bound: float, what: str) -> Check:
    """A check of a number: good up to `bound`, else poor (NaN too)."""
    return Check(name, GOOD if value <= bound else POOR, f"{what} {value:.1e} (at most {bound:.0e})", value, bound)


@dataclass(frozen=True)
class Verdict:
    """The first line of terminal, page and report.

    text: a sentence without its full stop; grade: shown green, yellow, red, or without a colour where it is "unknown";
    checks: what it rests on. "good" and "fair" need checks, and no verdict is better than its worst one; without checks
    it is "unknown", or "poor" where something failed outright.

    ValueError: another grade than the checks give, or no text.
    """

    text: str
    grade: str = UNKNOWN
    checks: tuple[Check, ...] = ()

    def __post_init__(self) -> None:
        if self.grade not in GRADES or not self.text:
            raise ValueError(f"no verdict: {self.text!r}, {self.grade!r}")
        most = worst(*(check.grade for check in self.checks))
        if self.grade != POOR and self.grade != most:
            raise ValueError(f"a verdict is as good as its checks: {self.grade!r} is said, {most!r} was checked")

    @classmethod
    def of(cls, command: str, text: str, checks: Iterable[Check]) -> Verdict:
        """The verdict of a command, as good as the worst of its checks: all those that `CLAIMS` names, in that order.

        ValueError: a claim of the command without a check, or a check of nothing that it claims.
        """
        found = {check.name: check for check in checks}
        names = [claim.name for claim in CLAIMS[command]]
        if set(found) != set(names):
            raise ValueError(f"{command} claims {names}, checked were {list(found)}")
        ordered = tuple(found[name] for name in names)
        return cls(text, worst(*(check.grade for check in ordered)), ordered)

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Verdict:
        """As stored on a page. What an older version graded without checks is "unknown", or "poor". ValueError and
        TypeError for what is no verdict."""
        checks = tuple(Check(**check) for check in data.get("checks") or ())
        grade = data["grade"]
        if not checks and grade in GRADES and grade != POOR:
            grade = UNKNOWN
        return cls(data["text"], grade, checks)

    @property
    def line(self) -> str:
        """The sentence with its grade."""
        return f"{self.text}." if self.grade == UNKNOWN else f"{self.text}: {self.grade}."

    def doubts(self, *told: str) -> tuple[str, ...]:
        """What keeps the verdict from being good, in words; told: names of checks of which the text speaks."""
        said = (check.said for check in self.checks if check.grade != GOOD and check.name not in told)
        return tuple(dict.fromkeys(said))  # one reason may keep several checks from being made

    def doubted(self, *told: str) -> Verdict:
        """The verdict whose text says its doubts; told: as of `doubts`."""
        more = self.doubts(*told)
        return Verdict("; ".join([self.text, *more]), self.grade, self.checks) if more else self
