"""How the shell's kernels are compiled: for one signature each, when their module is read, and kept between runs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit

from ribbonbench.kernel_cache import KernelCache

#: Rounding may differ from a compiler's plain order of a product and a sum, not from their meaning.
FAST = {"contract"}
CACHE = KernelCache(Path(__file__).parent.parent, b"@kernel(", b"@part")


def kernel(signature: str) -> Callable[[Callable[..., Any]], Any]:
    """A function compiled for one signature, now, or taken from the kernels that are kept."""

    def compiled(function: Callable[..., Any]) -> Any:
        with CACHE.in_use():
            return njit(signature, cache=True, fastmath=FAST, error_model="numpy")(function)

    return compiled


def part(function: Callable[..., Any]) -> Any:
    """A function that kernels of its module call, compiled into them."""
    return njit(fastmath=FAST, error_model="numpy")(function)
