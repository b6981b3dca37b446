"""The ribbon's compiled kernels: where they are kept, which sources they are of, how many are compiled now."""

from __future__ import annotations

from pathlib import Path

from ribbonbench.kernel_cache import KernelCache

CACHE = KernelCache(Path(__file__).parent.parent)
root, digest, state = CACHE.root, CACHE.digest, CACHE.state
in_use, told = CACHE.in_use, CACHE.told
