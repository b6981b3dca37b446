"""The picture of a sweep while it runs, as often as it costs little."""

from __future__ import annotations

import time
from collections.abc import Callable

from compare.sweep.large.aside import Aside

#: Time (s) before the first picture and between two, and the part of a run's time that pictures may take.
FIRST, BETWEEN, SHARE = 10.0, 30.0, 0.02


class Meanwhile:
    """Lets a picture be drawn in a process beside the run, again and again."""

    def __init__(self, first: float = FIRST, between: float = BETWEEN) -> None:
        self._next, self._between = time.monotonic() + first, between
        self._drawing: Aside | None = None
        self._begun = 0.0

    def look(self, begin: Callable[[], Aside]) -> None:
        """Begins a picture where it is time for one and none is being drawn. A picture that fails is left out: the one
        at the end says why."""
        now = time.monotonic()
        if self._drawing is not None:
            if self._drawing.over():
                self.end()
                self._next = now + max(self._between, (now - self._begun) / SHARE)
        elif now >= self._next:
            self._begun = now
            self._drawing = begin()

    def end(self) -> None:
        """No picture is drawn any more."""
        if self._drawing is not None:
            self._drawing.end()
            self._drawing = None
