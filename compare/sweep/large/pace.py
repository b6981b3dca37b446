"""How far a sweep is, how many cases a second it makes, and how long it will take."""

from __future__ import annotations

import time

from compare.models.timing import WORDS
from compare.store.progress import Reporter


class Pace:
    """The progress of a run. Its rate leaves out what ended with kernels that were compiled for it, and what came
    before: what is left needs none."""

    def __init__(self, reporter: Reporter) -> None:
        self._reporter, self._since, self._before, self._done = reporter, time.perf_counter(), 0, 0
        self._compiling = 0

    def compiles(self, begins: bool) -> None:
        """A worker begins to compile kernels, or what it made with them has come (`compare.sweep.workers.Crew`)."""
        if begins:
            self._compiling += 1
            self._reporter.aside(WORDS)
            return
        self._compiling = max(0, self._compiling - 1)
        self._since, self._before = time.perf_counter(), self._done

    def ended(self, done: int, total: int, failed: int) -> None:
        """So many of the cases have ended."""
        self._done = done
        seconds = 0.0 if self._compiling else time.perf_counter() - self._since
        self._reporter.detail(progress(done, total, failed, seconds, self._before))


def progress(done: int, total: int, failed: int, seconds: float, before: int = 0) -> str:
    """The progress line: how far, how many failed, how many a second, time left from the mean since `before` cases had
    ended; no rate where none has since, or in no time."""
    words = f"{done} of {total} cases" + (f", {failed} not converged" if failed else "")
    if done <= before or not seconds > 0.0:
        return words
    rate = (done - before) / seconds
    return f"{words}, {rate:.3g} a second, about {duration((total - done) / rate)} left"


def duration(seconds: float) -> str:
    """E.g. "40 s", "5 min", "2.5 h"."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
