"""The command line as it was typed: the one record of it, which every page names as what makes its results again."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Sequence
from pathlib import Path

_OPTION = re.compile(r"(--[a-z-]+=)(/.*)", re.DOTALL)


def recorded(words: Sequence[str]) -> str:
    """`ribbonbench` and the `words` behind it as a shell takes them; typed in the same folder, it asks for the same.

    Relative paths stay as they are. Absolute ones are told from the current folder, since results name no path of the
    machine they were made on; where the two have no folder in common, the file's name alone is left, and the line
    needs the file beside it.
    """
    return shlex.join(["ribbonbench", *(_word(word) for word in words)])


def fed(line: str, file: Path) -> str:
    """The command line with `file` as its standard input."""
    return f"{line} < {shlex.quote(_told_from_here(str(file.resolve())))}"


def _word(word: str) -> str:
    option = _OPTION.fullmatch(word)
    if option:
        return option[1] + _told_from_here(option[2])
    return _told_from_here(word) if word.startswith("/") else word


def _told_from_here(path: str) -> str:
    here = Path.cwd().resolve()
    place = Path(os.path.abspath(path))
    if place.name == "":
        return path
    place = place.parent.resolve() / place.name  # a link keeps its name: scenes are called after their files
    shared = Path(os.path.commonpath([here, place]))
    return os.path.relpath(place, here) if shared != Path("/") else place.name
