"""All places of a shell that may touch something: on walls, on bodies, on other parts of the shell itself."""

from __future__ import annotations

from typing import Any

import numpy as np

from shellref.contact.pairs import PairRows
from shellref.contact.rows import HELD, Block, BodyRows, Rows, Touching
from shellref.contact.sheet import Sheet
from shellref.contact.walls import WallPath
from shellref.shell.naghdi import NaghdiModel


def touching(model: NaghdiModel, path: WallPath, places: np.ndarray, projection: Any, tie: Any) -> Touching:
    """places (n,): mask of the nodes that may touch something; projection (6 n, unknowns): P, scipy.sparse;
    tie: of a closed strip."""
    some, thickness = np.flatnonzero(places), model.body.thickness
    blocks: list[Block] = []
    if len(path.normals):
        blocks.append(Rows.of(path, some, thickness).kept(projection))
    if path.bodies:
        blocks.append(BodyRows.of(path, some, thickness).kept(projection))
    if path.apart is not None:
        size = np.asarray(abs(projection).sum(axis=1)).reshape(-1, 6)[:, :3].max(axis=1)
        slaves = np.flatnonzero(places & (size > HELD))
        sheet = Sheet(model.grid, model.grid.order(model.nodes))
        closed = tie is not None
        blocks.append(PairRows.of(sheet, slaves, model.nodes, path.apart, closed, len(path.springs) - 1))
    return Touching(tuple(blocks), 0.5 * thickness)
