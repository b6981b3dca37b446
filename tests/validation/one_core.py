"""Measurements in a fresh process whose linear algebra is held to one thread: their CPU times are those of one core."""

from __future__ import annotations

import multiprocessing
import os
import statistics
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any, TypeVar

T = TypeVar("T")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def call(function: Callable[..., T], *arguments: Any) -> T:
    """``function(*arguments)`` in that process; function, arguments and result are pickled."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
            return pool.submit(function, *arguments).result()
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def timed(once: Callable[[], T], repeats: int = 5, budget: float = 2.0) -> tuple[T, float]:
    """Last result and median CPU time (s) of up to `repeats` calls, fewer once `budget` seconds are spent."""
    times: list[float] = []
    while not times or (len(times) < repeats and sum(times) < budget):
        clock = time.process_time()
        result = once()
        times.append(time.process_time() - clock)
    return result, statistics.median(times)
