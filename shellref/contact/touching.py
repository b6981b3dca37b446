"""All places of a shell that may touch something: on walls, on bodies, on other parts of the shell itself."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import coo_matrix, vstack

from shellref.contact.bodies import BodyRows
from shellref.contact.edges import EdgeRows
from shellref.contact.pairs import PairRows
from shellref.contact.rows import HELD, MOST_PARTS, Block, Rows
from shellref.contact.sheet import Sheet
from shellref.contact.walls import Standing, WallPath


class Touching:
    """All places of a shell, of blocks one after the other: (m,) their nodes, what they touch, their sides, and two
    numbers that tell them from each other, `keys` (both faces of a node have one) and `labels`."""

    def __init__(self, blocks: tuple[Block, ...], lever: float):
        """lever: h / 2."""
        self.blocks, self.lever = blocks, lever
        self.nodes, self.walls, self.sides, parts = (
            np.concatenate([getattr(block, name) for block in blocks]) for name in ("nodes", "walls", "sides", "parts")
        )
        self.keys = (self.nodes.astype(np.int64) * MOST_PARTS + parts) * (
            int(self.walls.max(initial=0)) + 1
        ) + self.walls
        self.labels = 3 * self.keys + self.sides.astype(np.int64) + 1
        self._ends = np.cumsum([0] + [len(block.nodes) for block in blocks])

    def __len__(self) -> int:
        return len(self.nodes)

    @property
    def normals(self) -> np.ndarray:
        """(m, 3)."""
        return np.concatenate([block.normals for block in self.blocks])

    def at(self, state: np.ndarray, standing: Standing) -> tuple[Touching, np.ndarray | None]:
        """The places with their gradients at a state, and which of these each is (m,), -1 none; None: the same."""
        found = [block.at(state, standing) for block in self.blocks]
        if all(one is block for (one, _), block in zip(found, self.blocks, strict=True)):
            return self, None
        new = Touching(tuple(block for block, _ in found), self.lever)
        if all(old is None for _, old in found):
            return new, None
        before = [
            np.arange(len(one.nodes)) + first if old is None else np.where(old < 0, -1, old + first)
            for one, (_, old), first in zip(self.blocks, found, self._ends, strict=False)
        ]
        return new, np.concatenate(before)

    def passed(self, before: np.ndarray, after: np.ndarray, standing: tuple[Standing, Standing]) -> bool:
        """Whether from one state (n, 6) to the next the strip went through a body, or parts of it each other."""
        return any(block.passed(before, after, standing) for block in self.blocks)

    def crossing(self, state: np.ndarray) -> tuple[float, float] | None:
        """S of a place where a state crosses itself, and S of the other part there; None: it does not, or may."""
        found = (block.crossing(state) for block in self.blocks)
        return next((place for place in found if place is not None), None)

    def _joined(self, name: str, *given: Any) -> np.ndarray:
        return np.concatenate([getattr(block, name)(*given) for block in self.blocks])

    def _split(self, values: np.ndarray) -> list[np.ndarray]:
        return np.split(values, self._ends[1:-1])

    def points(self, state: np.ndarray) -> np.ndarray:
        """Where the places are (m, 3), of a state (n, 6)."""
        return self._joined("points", state)

    def gaps(self, state: np.ndarray, standing: Standing, heights: np.ndarray) -> np.ndarray:
        """(m,)."""
        return self._joined("gaps", state, standing, heights)

    def applied(self, field: np.ndarray) -> np.ndarray:
        """b . field (m,), of nodal increments (n, 6)."""
        return self._joined("applied", field)

    def rates(self, rate: Standing) -> np.ndarray:
        """By what (m,) gaps fall while what is touched moves at a rate."""
        return self._joined("rates", rate)

    def forces(self, pushes: np.ndarray, n: int) -> np.ndarray:
        """sum of b lambda (n, 6)."""
        parts = [block.forces(own, n) for block, own in zip(self.blocks, self._split(pushes), strict=True)]
        return np.asarray(sum(parts, np.zeros((n, 6))))

    def matrix(self, some: np.ndarray, n: int) -> Any:
        """The rows `some` (numbers, ascending) over all components (k, 6 n), scipy.sparse."""
        parts = [
            block.matrix(some[(some >= first) & (some < last)] - first, n)
            for block, first, last in zip(self.blocks, self._ends, self._ends[1:], strict=False)
        ]
        return vstack(parts, format="csr") if len(parts) > 1 else parts[0]

    def curvature(self, pushes: np.ndarray, n: int) -> Any:
        """Sum of lambda times the gaps' second derivatives (6 n, 6 n), scipy.sparse; None: it vanishes."""
        found = [block.curvature(own, n) for block, own in zip(self.blocks, self._split(pushes), strict=True)]
        entries = [one for one in found if one is not None]
        if not entries:
            return None
        rows, columns, values = (np.concatenate([one[k] for one in entries]) for k in range(3))
        return coo_matrix((values, (rows, columns)), shape=(6 * n, 6 * n)).tocsr()


def touching(
    path: WallPath, sheet: Sheet, nodes: np.ndarray, places: np.ndarray, thickness: float, projection: Any, closed: bool
) -> Touching:
    """sheet: the shell's surface; nodes (n, 2): S and v; places (n,): mask of the nodes that may touch something;
    projection (6 n, unknowns): P, scipy.sparse; closed: whether its ends are one."""
    some = np.flatnonzero(places)
    blocks: list[Block] = []
    if len(path.normals):
        blocks.append(Rows.of(path, some, thickness).kept(projection))
    if path.bodies:
        blocks.append(BodyRows.of(path, some, thickness).kept(projection))
    if path.apart is not None:
        size = np.asarray(abs(projection).sum(axis=1)).reshape(-1, 6)[:, :3].max(axis=1)
        slaves = np.flatnonzero(places & (size > HELD))
        number = len(path.springs) - 1
        blocks.append(PairRows.of(sheet, slaves, nodes, path.apart, closed, number))
        blocks.append(EdgeRows.of(sheet, nodes, path.apart, closed, number))
    return Touching(tuple(blocks), 0.5 * thickness)
