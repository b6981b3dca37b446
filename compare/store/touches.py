"""Where a strip touches, as pictures and files show it: places, pushes and friction there."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: What touches is named by the wall or obstacle; a strip on itself by this.
ITSELF = "itself"


@dataclass(frozen=True)
class Touches:
    """Places of contact, n of them: points (n, 3) in l on the strip, push and friction (n, 3) on it there in D w / l^2
    (friction 0 without), and by name what it touches there."""

    points: FloatArray
    push: FloatArray
    friction: FloatArray
    on: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.points)

    @classmethod
    def of(cls, rows: Iterable[tuple[FloatArray, FloatArray, FloatArray, str]]) -> Touches:
        """Of rows (point, push, friction, name); with none it is empty."""
        kept = list(rows)
        parts = (np.array([row[k] for row in kept], dtype=float).reshape(-1, 3) for k in range(3))
        points, push, friction = parts
        return cls(points, push, friction, tuple(row[3] for row in kept))

    @property
    def largest(self) -> float:
        """The largest force of any, push or friction, D w / l^2; 0 where nothing touches."""
        sizes = [np.linalg.norm(forces, axis=1) for forces in (self.push, self.friction)]
        return float(np.concatenate(sizes).max()) if len(self) else 0.0
