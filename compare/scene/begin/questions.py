"""A few questions instead of options: each with its default and unit, asked again until the answer is right."""

from __future__ import annotations

from collections.abc import Callable

from compare.scene.begin.quantities import base_unit
from compare.scene.begin.start import Ask, asked, checked, default_of
from ribbonbench.errors import BadInput

Asking = Callable[[str], str]
"""Shows a question and returns the line that is typed; EOFError: nothing more is typed."""
Saying = Callable[[str], object]


def answers(si: bool, ask: Asking, say: Saying) -> dict[str, str]:
    """Name -> what was typed, for `started` (`compare.scene.begin.start`); an empty line, or the end of input, is the
    default.

    The distance of the clamps is asked only where there are two.
    """
    said: dict[str, str] = {}
    for question in asked(si):
        if question.name == "apart" and said.get("held") != "two":
            continue
        try:
            text = _answer(question, default_of(question, said), ask, say)
        except EOFError:
            say("")
            return said
        if text:
            said[question.name] = text
    return said


def _answer(question: Ask, default: str, ask: Asking, say: Saying) -> str:
    """The answer as typed, "" for the default."""
    if question.choices is not None:
        for word, meaning in question.choices.items():
            say(f"  {word:<14} {meaning}")
    unit = base_unit(question.kind)
    while True:
        text = ask(f"{question.words}{f', in {unit}' if unit else ''} [{default}]: ").strip()
        if not text:
            return ""
        try:
            checked(question, text)
        except BadInput as error:
            say(f"  {error.problem}; {error.remedy}" if error.remedy else f"  {error.problem}")
            continue
        return text
