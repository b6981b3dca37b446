"""All places of a shell that may touch something: on walls, on bodies, on other parts of the shell itself."""

from __future__ import annotations

from typing import Any

import numpy as np

from shellref.contact.pairs import PairRows
from shellref.contact.rows import HELD, Block, BodyRows, Rows, Touching
from shellref.contact.sheet import Sheet
from shellref.contact.walls import WallPath


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
        blocks.append(PairRows.of(sheet, slaves, nodes, path.apart, closed, len(path.springs) - 1))
    return Touching(tuple(blocks), 0.5 * thickness)
