"""The budget of time for a solve (`ribbonbench.clock`); compiling kernels, once after an installation, is not in it."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from typing import Any

from numba.core import event

from ribbon.errors import RibbonInputError
from ribbonbench import clock
from ribbonbench.clock import SPENT, spent

__all__ = ["SPENT", "spent", "within"]


class _Compiling(event.Listener):  # type: ignore[misc]
    """Time (s) that this process has spent in compiling, and in making ready for it."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self._depth, self._begun = 0, 0.0

    def on_start(self, event: Any) -> None:
        if self._depth == 0:
            self._begun = time.thread_time()
        self._depth += 1

    def on_end(self, event: Any) -> None:
        self._depth = max(0, self._depth - 1)
        if self._depth == 0:
            self.seconds += max(0.0, time.thread_time() - self._begun)


_compiling = _Compiling()
event.register("numba:compiler_lock", _compiling)  # held while kernels are compiled, and while kept ones are loaded
clock.UNCOUNTED.append(lambda: _compiling.seconds)


@contextlib.contextmanager
def within(seconds: float | None) -> Iterator[None]:
    """What is solved inside has this much time (s), and no more than what is around it; None: as much as that.

    Raises `RibbonInputError` for a budget that is not positive.
    """
    if seconds is not None and not seconds > 0.0:
        raise RibbonInputError("budget", seconds, "a time in seconds greater than zero")
    with clock.within(seconds):
        yield
