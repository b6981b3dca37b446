"""Places of a shell on bodies: nodes of its middle surface, or of both faces. NumPy only.

The gap g of a place is its signed distance from a body (shellref.contact.obstacles): the row is that of the normal
there, and the second derivative H gives the tangent - lambda [[H, s H], [s H, s^2 H]] on (phi_i, d_i), s = sigma h / 2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from shellref.contact.obstacles import GapFunction
from shellref.contact.rows import Entries, NodeRows
from shellref.contact.walls import FACES, Standing, WallPath

#: Places on the way of a node at which bodies are looked for.
STOPS = 17


@dataclass(frozen=True)
class BodyRows(NodeRows):
    """Every place that may touch a body; parts (m,): of its gap functions, see `Obstacle.parts`; toward (m, 3), bends
    (m, 3, 3): gradients and second derivatives of the gaps at the state last seen."""

    parts: np.ndarray
    functions: tuple[GapFunction, ...]
    toward: np.ndarray
    bends: np.ndarray

    @classmethod
    def of(cls, path: WallPath, places: np.ndarray, thickness: float) -> BodyRows:
        """places: nodes that may touch."""
        sides = (1.0, -1.0) if path.surface == FACES else (0.0,)
        functions = [(len(path.normals) + k, part) for k, body in enumerate(path.bodies) for part in body.parts()]
        kinds = [(k, part, side) for part, (k, _) in enumerate(functions) for side in sides]
        walls, parts, side = (np.repeat([kind[i] for kind in kinds], len(places)) for i in range(3))
        m = len(walls)
        return cls(
            np.tile(places, len(kinds)), walls.astype(int), side.astype(float), 0.5 * thickness, path,
            parts.astype(int), tuple(part for _, part in functions), np.zeros((m, 3)), np.zeros((m, 3, 3)),
        )  # fmt: skip

    def chosen(self, mask: np.ndarray) -> BodyRows:
        """Those of a mask (m,)."""
        found = super().chosen(mask)
        return replace(found, parts=self.parts[mask], toward=self.toward[mask], bends=self.bends[mask])

    @property
    def normals(self) -> np.ndarray:
        """(m, 3)."""
        return self.toward

    def at(self, state: np.ndarray, standing: Standing) -> tuple[BodyRows, None]:
        """The same places with their derivatives at a state."""
        _, toward, bends = self._seen(state, standing)
        return replace(self, toward=toward, bends=bends), None

    def passed(self, before: np.ndarray, after: np.ndarray, standing: tuple[Standing, Standing]) -> bool:
        """Whether a place went through a body from one state (n, 6) to the next, each straight on, the body where it
        stands at each: from its outside to its outside, within its `Obstacle.heart` on the way."""
        steps = np.linspace(0.0, 1.0, STOPS)[:, None, None]
        for body, old, new in zip(self.path.bodies, standing[0].centres, standing[1].centres, strict=True):
            if body.heart is None:
                continue
            first, last = before[:, :3] - old, after[:, :3] - new
            gaps = body.gaps((first + steps * (last - first)).reshape(-1, 3), np.zeros(3)).reshape(STOPS, -1)
            if np.any((gaps.min(axis=0) < -body.heart) & (np.minimum(gaps[0], gaps[-1]) > -0.5 * body.heart)):
                return True
        return False

    def _seen(self, state: np.ndarray, standing: Standing) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        points = self.points(state) - standing.centres[self.walls - len(self.path.normals)]
        value, toward, bends = np.zeros(len(self)), np.zeros((len(self), 3)), np.zeros((len(self), 3, 3))
        for k, function in enumerate(self.functions):
            own = self.parts == k
            value[own], toward[own], bends[own] = function(points[own])
        return value, toward, bends

    def gaps(self, state: np.ndarray, standing: Standing, heights: np.ndarray) -> np.ndarray:
        """(m,)."""
        return self._seen(state, standing)[0]

    def rates(self, rate: Standing) -> np.ndarray:
        """(m,)."""
        moved = rate.centres[self.walls - len(self.path.normals)]
        return np.asarray(np.einsum("mi,mi->m", self.toward, moved))

    def curvature(self, pushes: np.ndarray, n: int) -> Entries | None:
        """Of those that push."""
        some = np.flatnonzero(pushes)
        if not len(some):
            return None
        lever = self.lever * self.sides[some]
        weights = np.stack([np.ones_like(lever), lever], axis=1)
        blocks = np.einsum("m,ma,mb,mij->maibj", pushes[some], weights, weights, self.bends[some])
        at = 6 * self.nodes[some][:, None] + np.arange(6)
        shape = (len(some), 6, 6)
        rows, columns = np.broadcast_to(at[:, :, None], shape), np.broadcast_to(at[:, None, :], shape)
        return rows.ravel(), columns.ravel(), blocks.reshape(shape).ravel()
