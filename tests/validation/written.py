"""What this process writes, by Python's own account (audit events): two measurements at once tell their files apart.

It imports nothing of ours. What a child process writes is not seen: a measurement that starts any has the machine for
itself (`Pages.alone`).
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

_open: list[set[Path]] = []
_hooked = False


def _heard(event: str, arguments: tuple[Any, ...]) -> None:
    if not _open or event not in ("open", "os.rename"):
        return
    if event == "open":
        name, _, flags = arguments
        if not isinstance(flags, int) or not flags & (os.O_WRONLY | os.O_RDWR):
            return
    else:
        name = arguments[1]
    if isinstance(name, str | bytes | os.PathLike):
        path = Path(os.fsdecode(name)).resolve()
        for found in _open:
            found.add(path)


@contextlib.contextmanager
def noted() -> Iterator[set[Path]]:
    """The files that are opened for writing, or put in their place by a renaming, while the block runs."""
    global _hooked
    if not _hooked:
        sys.addaudithook(_heard)
        _hooked = True
    found: set[Path] = set()
    _open.append(found)
    try:
        yield found
    finally:
        _open.remove(found)
