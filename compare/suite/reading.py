"""What a question about a centreline asks for, read off its points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from compare.suite.case import Ask


def read_off(ask: Ask, points: NDArray[np.float64]) -> float:
    """Of points (k, 3), evenly along the centreline: of all for an extent, else of the place `ask.at`."""
    if ask.of == "extent":
        return float(np.ptp(points[:, "xyz".index(ask.axis)]))
    place = ask.at * (len(points) - 1)
    below = min(int(place), len(points) - 2) if len(points) > 1 else 0
    share = place - below
    point = points[below] + share * (points[min(below + 1, len(points) - 1)] - points[below])
    if ask.of == "position":
        return float(ask.sign * point["xyz".index(ask.axis)])
    first, second = (float(point["xyz".index(axis)]) for axis in ask.axes)
    return float(np.hypot(first, second)) if ask.of == "radius" else ask.sign * first / second
