"""The errors a user may see, each with the exit code it ends the command with.

Exit codes of the command line (a contract): 0 done, 1 computed but not converged or not stable, 2 bad input,
3 something missing on this machine.
"""

from __future__ import annotations

from typing import Any, ClassVar


def _one_line(text: str) -> str:
    """`text` on a single line: every run of white space becomes one blank, and what would move the cursor, colour the
    terminal or turn the line round is named by its number."""
    plain = " ".join(text.split())
    return plain if plain.isprintable() else "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in plain)


class RibbonbenchError(Exception):
    """Base of every error that is shown to the user as one line instead of a traceback."""

    exit_code: ClassVar[int] = 1

    def __str__(self) -> str:
        return _one_line(super().__str__())


class BadInput(RibbonbenchError):
    """A scene key, an option or a path that cannot be used (exit code 2).

    `str` is one line: ``key = value: problem; remedy``.

    Parameters
    ----------
    key : where the value stands, e.g. ``strip.width`` or ``--out``.
    value : the offending value as the user gave it; None (nothing was given) is left out of the line.
    problem : what is wrong with it.
    remedy : what would be right; may be empty.
    """

    exit_code: ClassVar[int] = 2

    def __init__(self, key: str, value: Any = None, problem: str = "is not usable", remedy: str = "") -> None:
        self.key = key
        self.value = value
        self.problem = problem
        self.remedy = remedy
        shown = _shorten(value)
        name = _cut(key)
        head = name if shown is None else f"{name} = {shown}"
        super().__init__(f"{head}: {problem}; {remedy}" if remedy else f"{head}: {problem}")

    def __reduce__(self) -> tuple[Any, ...]:
        # Exception pickles by its args (the finished line); the four parts are what __init__ takes.
        return type(self), (self.key, self.value, self.problem, self.remedy)


class Missing(RibbonbenchError):
    """A program, library or package that this machine lacks (exit code 3).

    Parameters
    ----------
    what : what is missing, e.g. ``dolfinx``.
    remedy : the command that mends it.
    """

    exit_code: ClassVar[int] = 3

    def __init__(self, what: str, remedy: str = "run `make setup`") -> None:
        self.what = what
        self.remedy = remedy
        super().__init__(f"{what} is missing; {remedy}" if remedy else f"{what} is missing")

    @classmethod
    def of(cls, words: str) -> Missing:
        """From a sentence of another process, "WHAT is missing: REMEDY" or one that says only what is wrong."""
        what, said, remedy = words.partition(" is missing")
        return cls(what, remedy.lstrip(":; ")) if said else cls("a library that fits", words)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.what, self.remedy)


class ShellMissing(Missing):
    """The shell cannot be run here, and another model's answer is there already.

    found: its `compare.models.base.State`; scene: the one that it is of.
    """

    def __init__(self, why: Missing, scene: Any, found: Any) -> None:
        super().__init__(why.what, why.remedy)
        self.scene = scene
        self.found = found

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (Missing(self.what, self.remedy), self.scene, self.found)


def _shorten(value: Any, limit: int = 120) -> str | None:
    """The value as shown in the line: None stays None, long texts are cut in the middle."""
    if value is None:
        return None
    return _cut(_one_line(repr(value) if isinstance(value, str) else str(value)), limit)


def _cut(text: str, limit: int = 120) -> str:
    if len(text) <= limit:
        return text
    half = (limit - 5) // 2
    return f"{text[:half]} ... {text[-half:]}"
