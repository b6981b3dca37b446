"""Compiled kernels, kept beside the compiled forms; one signature each, known when its module is read.

A kernel is looked up, or compiled, while its module is imported, by one process at a time: numba's index of what it
keeps is read, changed and written back, and would mix up what two processes compile at once. The folder is the one of
the forms (`shellref.fenics.cache`), which is code that nobody else may write.
"""

from __future__ import annotations

import contextlib
import fcntl
import importlib
from collections.abc import Callable, Iterator
from typing import Any

from llvmlite import binding
from numba import njit
from numba.core import caching
from numba.core import config as _config
from numba.core import dispatcher as _dispatcher

from shellref.fenics.cache import cache_folder

config: Any = _config  # numba's settings are made at import, unknown to type checkers
dispatcher: Any = _dispatcher
_ORDINARY: Any = caching.FunctionCache

#: Rounding may differ from a compiler's plain order of a product and a sum, not from their meaning.
FAST = {"contract"}


class Quick(_ORDINARY):  # type: ignore[misc]
    """numba's cache, without making ready to compile (which takes longer than loading) before there is need to."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The kept kernel for a signature, or None."""
        if not _TOLD:  # the memory functions that kernels call, by name
            helpers: Any = importlib.import_module("numba.core.runtime._nrt_python").c_helpers
            for name, address in helpers.items():
                binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)
            _TOLD.append(True)
        with self._guard_against_spurious_io_errors():
            found = self._load_overload(sig, target_context)
            if found is not None:
                return found
        target_context.refresh()
        return None


_TOLD: list[bool] = []


@contextlib.contextmanager
def _kept() -> Iterator[None]:
    """Kernels that are decorated inside are kept in our folder, which no other process changes meanwhile."""
    folder = cache_folder() / "kernels"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    before = config.CACHE_DIR, dispatcher.FunctionCache
    with open(folder / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        config.CACHE_DIR = str(folder)
        if hasattr(_ORDINARY, "_load_overload"):
            dispatcher.FunctionCache = Quick
        try:
            yield
        finally:
            config.CACHE_DIR, dispatcher.FunctionCache = before


def kernel(signature: str) -> Callable[[Callable[..., Any]], Any]:
    """A function compiled for one signature, now."""

    def compiled(function: Callable[..., Any]) -> Any:
        with _kept():
            return njit(signature, cache=True, fastmath=FAST, error_model="numpy")(function)

    return compiled


def part(function: Callable[..., Any]) -> Any:
    """A function that kernels of its module call, compiled into them."""
    return njit(fastmath=FAST, error_model="numpy")(function)
