"""All places of a shell that may touch something: on walls, on bodies, on other parts of the shell itself."""

from __future__ import annotations

from typing import Any

import numpy as np

from shellref.contact.rows import Block, BodyRows, Rows, Touching
from shellref.contact.walls import WallPath
from shellref.shell.naghdi import NaghdiModel


def touching(model: NaghdiModel, path: WallPath, places: np.ndarray, projection: Any) -> Touching:
    """places (n,): mask of the nodes that may touch something; projection (6 n, unknowns): P, scipy.sparse."""
    some, thickness = np.flatnonzero(places), model.body.thickness
    blocks: list[Block] = []
    if len(path.normals) or not path.bodies:
        blocks.append(Rows.of(path, some, thickness).kept(projection))
    if path.bodies:
        blocks.append(BodyRows.of(path, some, thickness).kept(projection))
    return Touching(tuple(blocks), 0.5 * thickness)
