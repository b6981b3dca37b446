"""What is compiled while a ribbon is solved: counted, and said as soon as it begins."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from compare.store.progress import Reporter


@contextlib.contextmanager
def compiled() -> Iterator[Callable[[], int]]:
    """While inside, compilations of the ribbon's kernels are counted; yields what says how many there were."""
    from ribbon.element.kernel_cache import told

    counts = [0]
    with told(counts.append):
        yield lambda: counts[-1]


@contextlib.contextmanager
def compiling(say: Reporter | None) -> Iterator[None]:
    """Says that kernels are being compiled, as soon as the first of them is not found in the cache."""
    from ribbon.element.kernel_cache import told

    if say is None:
        yield
        return
    words = "compiling the ribbon's kernels, once after each installation (half a minute to a minute)"
    with told(lambda count: say.aside(words if count == 1 else f"{words}: {count} so far")):
        yield
