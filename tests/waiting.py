"""Waiting for what is sure to come, however busy the machine."""

from __future__ import annotations

import time
from collections.abc import Callable

from tests.patience import PATIENCE


def comes(seen: Callable[[], object]) -> bool:
    """Waits until something is so; whether it is."""
    end = time.monotonic() + PATIENCE
    while not (found := seen()) and time.monotonic() < end:
        time.sleep(0.02)
    return bool(found)
