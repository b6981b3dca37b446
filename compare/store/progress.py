"""What long work says while it runs: a moving line on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from types import TracebackType

from rich.console import Console


class _Moving:
    """A text with the time since it began, drawn anew whenever the line moves."""

    def __init__(self, text: str, began: float) -> None:
        self.text = text
        self.began = began

    def __rich__(self) -> str:
        return f"{self.text}, {time.perf_counter() - self.began:.0f} s"


class Reporter:
    """Says what is being done.

    `step` names a piece of work (kept as a line), `detail` what it is at just now (a moving line on a terminal;
    elsewhere at most one line every `interval` seconds). Quiet when `quiet` is set.
    """

    def __init__(self, console: Console | None = None, quiet: bool = False, interval: float = 20.0) -> None:
        self.console = console or Console(stderr=True)
        self.quiet = quiet
        self.interval = interval
        self._began = time.perf_counter()
        self._last = self._began
        self._step = ""
        self._aside: float | None = None
        self._status = None if quiet or not self.console.is_terminal else self.console.status("")

    def __enter__(self) -> Reporter:
        if self._status is not None:
            self._status.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._status is not None:
            self._status.stop()

    def step(self, text: str) -> None:
        """A new piece of work."""
        self._step = text
        self._aside = None
        self._last = time.perf_counter()
        if not self.quiet:
            self._say(self._last, f"  {text}")
        if self._status is not None:
            self._status.update(text)

    def aside(self, text: str) -> None:
        """What holds the current piece of work up: a moving line with its time, elsewhere one line for all of it."""
        first = self._aside is None
        if self._aside is None:
            self._aside = time.perf_counter()
        if self._status is not None:
            self._status.update(_Moving(text, self._aside))
        elif first and not self.quiet:
            self._say(self._aside, f"    ... {text}")

    def detail(self, text: str) -> None:
        """Where the current piece of work is."""
        if self._status is not None:
            self._status.update(f"{self._step}: {text}")
            return
        now = time.perf_counter()
        if not self.quiet and now - self._last > self.interval:
            self._last = now
            self._say(now, f"    ... {text}")

    def _say(self, now: float, text: str) -> None:
        """A line with its time; where nobody reads any more (a pipe that was closed) the work goes on in silence."""
        try:
            self.console.print(f"[dim]{now - self._began:7.1f} s[/dim]{text}", highlight=False)
        except (BrokenPipeError, SystemExit):  # rich's word for a broken pipe
            self.quiet = True
