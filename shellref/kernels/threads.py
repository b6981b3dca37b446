"""One thread for the BLAS in which kernels multiply: the matrices are small, and threads wait for each other.

OpenBLAS reads its environment when it is loaded, and the rest of a program may want threads: it is held to one by its
own functions while a shell is solved. What the user has set (OMP_NUM_THREADS, OPENBLAS_NUM_THREADS) stays.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import re
from collections.abc import Iterator
from typing import Any

SET = ("OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "OMP_NUM_THREADS")
_LIBRARY = re.compile(r"(/\S*openblas\S*\.so\S*)$")


@functools.cache
def _libraries() -> tuple[tuple[Any, Any], ...]:
    """(how many threads, set them) of every OpenBLAS of this process."""
    import scipy.linalg  # noqa: F401  brings the one that numba takes

    with contextlib.suppress(OSError), open("/proc/self/maps") as maps:
        places = {found[1] for line in maps if (found := _LIBRARY.search(line.rstrip()))}
        libraries = [ctypes.CDLL(place) for place in sorted(places)]
        names = [f"{{}}openblas_{{}}_num_threads{end}".format for end in ("", "64_", "_64", "64")]
        return tuple(
            (getattr(library, name(start, "get")), getattr(library, name(start, "set")))
            for library in libraries
            for name in names
            for start in ("", "scipy_")
            if hasattr(library, name(start, "set"))
        )
    return ()


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """One thread inside; afterwards as many as before."""
    before = [] if any(name in os.environ for name in SET) else [(put, get()) for get, put in _libraries()]
    for put, _ in before:
        put(1)
    try:
        yield
    finally:
        for put, count in before:
            put(count)
