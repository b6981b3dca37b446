"""What was seen of a strip in the hand, as a film: the surfaces one after another, as they came."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from compare.pages.export.gltf import film_bytes
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]

#: Surfaces that are remembered, and that a film shows at most; the longest pause (s) and the least time between two.
MOST, SHOWN, PAUSE, LEAST = 3000, 120, 0.4, 1.0 / 60.0


class Seen:
    """Surfaces with when they were seen; beyond `MOST` every second one is let go."""

    def __init__(self) -> None:
        self._taken: list[tuple[float, FloatArray]] = []

    def __len__(self) -> int:
        return len(self._taken)

    def add(self, points: FloatArray) -> None:
        """A surface (k, m, 3), now."""
        self._taken.append((time.monotonic(), points.astype("<f4")))
        if len(self._taken) > MOST:
            self._taken = [*self._taken[:-1:2], self._taken[-1]]

    def film(self, width: float, length: float, up: Sequence[float] | None, title: str) -> bytes:
        """The surfaces as an animated glTF, at most `SHOWN` evenly out of all; width: w / l, length: of l in the unit
        that the file is to have. `BadInput` where there is but one."""
        if len(self._taken) < 2:
            raise BadInput("film", None, "nothing has moved yet", "move a slider first")
        chosen = np.unique(np.linspace(0, len(self._taken) - 1, min(len(self._taken), SHOWN)).round().astype(int))
        when = np.array([at for at, _ in self._taken])
        steps = np.clip(np.diff(when), LEAST, PAUSE)
        seconds = np.concatenate([[0.0], np.cumsum(steps)])[chosen]
        grids = length * np.array([self._taken[k][1] for k in chosen], dtype=float)
        along, across = grids.shape[1:3]
        s = length * np.linspace(0.0, 1.0, along)
        v = length * width * np.linspace(-0.5, 0.5, across)
        return film_bytes(grids, (s, v), seconds, up, title)
