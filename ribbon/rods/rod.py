"""A rod as data: its section, what holds it at its ends, what loads it. Unit l = 1, stiffnesses in D w.

Frames (3, 3) have the columns d_1 (across), d_2 (normal), d_3 (tangent); curvatures kappa_1 = omega, kappa_2 in the
plane of the strip, tau: d_3' = kappa_2 d_1 - kappa_1 d_2, d_1' = -kappa_2 d_3 + tau d_2, d_2' = kappa_1 d_3 - tau d_1.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.law import Law

FloatArray = NDArray[np.float64]

#: A straight rod at rest: kappa_1, kappa_2, tau at s = 0 and s = 1.
STRAIGHT: tuple[Law, Law, Law] = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))


@dataclass(frozen=True)
class RodEnd:
    """What holds an end: position (3,), along `slide` (3,) free if given, and material frame (3, 3); None: free."""

    position: FloatArray | None = None
    frame: FloatArray | None = None
    slide: FloatArray | None = None

    @property
    def free(self) -> bool:
        """Nothing is held."""
        return self.position is None and self.frame is None


@dataclass(frozen=True)
class Rod:
    """A rod of edges of `lengths` (n,), their sum 1.

    stiffness: E I_1, E I_2, G J in D w; rest: kappa_1, kappa_2, tau at rest (`ribbon.law`); weight: Gamma times the
    unit vector upwards (3,); force (3,), moment (3,): dead loads at s = 1.
    """

    lengths: FloatArray
    stiffness: tuple[float, float, float]
    rest: tuple[Law, Law, Law] = STRAIGHT
    start: RodEnd = field(default_factory=RodEnd)
    end: RodEnd = field(default_factory=RodEnd)
    weight: FloatArray = field(default_factory=lambda: np.zeros(3))
    force: FloatArray = field(default_factory=lambda: np.zeros(3))
    moment: FloatArray = field(default_factory=lambda: np.zeros(3))

    @property
    def edges(self) -> int:
        """Number of edges n."""
        return int(self.lengths.size)

    @property
    def vertices(self) -> FloatArray:
        """Abscissae (n + 1,) of the vertices."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @property
    def cells(self) -> FloatArray:
        """Lengths (n + 1,) of the cells around the vertices: from the middle of an edge to that of the next."""
        half = 0.5 * self.lengths
        return np.concatenate([half, [0.0]]) + np.concatenate([[0.0], half])

    @property
    def middles(self) -> FloatArray:
        """Abscissae (n + 1,) of the middles of the cells."""
        s, half = self.vertices, 0.5 * self.lengths
        low = s - np.concatenate([[0.0], half])
        return low + 0.5 * self.cells

    def at_rest(self, s: FloatArray) -> FloatArray:
        """kappa_1, kappa_2, tau (k, 3) of the rod at rest at s (k,)."""
        return np.column_stack([law.at(one, s) for one in self.rest])


def rotation(vector: FloatArray) -> FloatArray:
    """The rotation (3, 3) about `vector` (3,) by its length (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    skew = np.array([[0.0, -vector[2], vector[1]], [vector[2], 0.0, -vector[0]], [-vector[1], vector[0], 0.0]])
    return np.asarray(
        np.eye(3) + np.sinc(angle / np.pi) * skew + 0.5 * np.sinc(0.5 * angle / np.pi) ** 2 * (skew @ skew)
    )


def transported(frame: FloatArray, tangent: FloatArray) -> FloatArray:
    """A frame (3, 3) carried without spin from its tangent to the unit vector `tangent` (3,)."""
    old = frame[:, 2]
    turn = frame - np.outer(old + tangent, tangent @ frame) / (1.0 + old @ tangent)
    turn[:, 2] = tangent
    return np.asarray(turn)


def marched(rod: Rod, position: FloatArray, frame: FloatArray, strains: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Vertices (n + 1, 3) and frames (n, 3, 3) of the edges of the rod that starts at `position`, `frame` with kappa_1,
    kappa_2, tau = `strains` (n + 1, 3) in its cells."""
    frames = np.empty((rod.edges, 3, 3))
    points = np.empty((rod.edges + 1, 3))
    points[0] = position
    for j, length in enumerate(rod.lengths):
        frame = frame @ rotation(rod.cells[j] * strains[j])
        frames[j] = frame
        points[j + 1] = points[j] + length * frame[:, 2]
    return points, frames
