"""A call in a process of its own, beside the one that hands out cases: what it needs of memory goes with it, and
libraries with threads of their own are loaded there alone."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from ribbonbench.start import one_thread_each, shielded
from ribbonbench.system import KILL, end_with


class Aside:
    """A call that runs; its function and arguments must be such that another process can have them."""

    def __init__(self, call: Callable[..., Any], *arguments: Any) -> None:
        one_thread_each()
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe(duplex=False)
        self._process = context.Process(target=_run, args=(theirs, os.getpid(), call, arguments), daemon=True)
        with shielded():
            self._process.start()
        theirs.close()

    def over(self) -> bool:
        """Whether it has ended."""
        return self._pipe.poll()

    def result(self) -> Any:
        """What the call returns, when it has; raises what it raises, RuntimeError where its process died."""
        try:
            value, error = self._pipe.recv()
        except EOFError:
            self._process.join()
            raise RuntimeError(f"a process that wrote the table ended with code {self._process.exitcode}") from None
        finally:
            self._pipe.close()
        self._process.join()
        if error is not None:
            raise error
        return value

    def end(self) -> None:
        """Ends it, whatever it is doing: a part is whole or not there."""
        if self._process.is_alive():
            self._process.kill()
        self._process.join()
        self._pipe.close()


def aside(call: Callable[..., Any], *arguments: Any) -> Any:
    """What a call in a process of its own returns."""
    running = Aside(call, *arguments)
    try:
        return running.result()
    except BaseException:
        with contextlib.suppress(OSError):
            running.end()
        raise


def _run(pipe: Connection, parent: int, call: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    end_with(parent, KILL)
    found: tuple[Any, Exception | None] = (None, None)
    try:
        found = (call(*arguments), None)
    except Exception as error:
        found = (None, error)
    pipe.send(found)
