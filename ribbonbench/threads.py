"""One thread for dense linear algebra while a ribbon or a shell is solved, whatever program it is solved in.

The matrices are small: threads only wait for each other (docs/decisions.md). BLAS reads its environment when NumPy
is imported, so that a library that comes later cannot set it and should not, the rest of the program may want threads.
Here the OpenBLAS libraries that are loaded are held to one thread for as long as a call lasts, by their own functions.
What the user has set (OMP_NUM_THREADS, OPENBLAS_NUM_THREADS, GOTO_NUM_THREADS) stays.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import re
import sys
from collections.abc import Callable, Iterator
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

#: Variables by which a user says how many threads OpenBLAS takes.
VARIABLES = ("OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "OMP_NUM_THREADS")
#: Modules that bring a BLAS of their own.
_BRINGERS = ("numpy", "scipy.linalg")
_PREFIXES = ("", "scipy_")
_SUFFIXES = ("", "64_", "_64", "64")
_LIBRARY = re.compile(r"(/\S*openblas\S*\.so\S*)$")

Library = tuple[Callable[[], int], Callable[[int], None]]
"""How many threads a loaded library takes now, and how to set that."""


def loaded() -> tuple[Library, ...]:
    """The OpenBLAS libraries of this process (Linux; elsewhere none is found, and nothing is changed)."""
    return _loaded(tuple(name for name in _BRINGERS if name in sys.modules))


@functools.cache
def _loaded(_: tuple[str, ...]) -> tuple[Library, ...]:
    places: set[str] = set()
    with contextlib.suppress(OSError), open("/proc/self/maps") as maps:
        places = {found[1] for line in maps if (found := _LIBRARY.search(line.rstrip()))}
    return tuple(library for place in sorted(places) if (library := _functions(place)) is not None)


def _functions(place: str) -> Library | None:
    with contextlib.suppress(OSError):
        library = ctypes.CDLL(place)
        for prefix in _PREFIXES:
            for suffix in _SUFFIXES:
                get = getattr(library, f"{prefix}openblas_get_num_threads{suffix}", None)
                put = getattr(library, f"{prefix}openblas_set_num_threads{suffix}", None)
                if get is not None and put is not None:
                    return get, put
    return None


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """One thread inside; afterwards as many as before."""
    if any(name in os.environ for name in VARIABLES):
        yield
        return
    before: list[tuple[Any, int]] = []
    for get, put in loaded():
        count = get()
        if count > 1:
            put(1)
            before.append((put, count))
    try:
        yield
    finally:
        for put, count in before:
            put(count)


def alone(function: Callable[P, R]) -> Callable[P, R]:
    """The function, run with `one_thread`."""

    @functools.wraps(function)
    def run(*arguments: P.args, **keywords: P.kwargs) -> R:
        with one_thread():
            return function(*arguments, **keywords)

    return run
