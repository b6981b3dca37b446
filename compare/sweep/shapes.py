"""Centrelines of a sweep, where they are asked for (`--shapes`): single precision, beside the table and in its order.

In a record and a journal a shape is a text (base 64 of little-endian floats); in a folder `shapes.npy` (rows, points,
3), in l, NaN where a row has no shape, or parts of Parquet with `case` and `shape` (3 points numbers, x y z of one
place after the other).
"""

from __future__ import annotations

import base64
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.models.base import State
from ribbonbench.errors import BadInput
from ribbonbench.replacing import replacing

FILE = "shapes.npy"
#: Fewest and most points of a centreline.
FEWEST, MOST = 2, 1001
_STORED = np.dtype("<f4")


def checked(points: int) -> int:
    """The number of points. `BadInput`: it is none."""
    if not FEWEST <= points <= MOST:
        raise BadInput("--shapes", points, "is no number of points of a centreline", f"give {FEWEST} to {MOST}")
    return points


def packed(state: State, points: int) -> str | None:
    """The centreline at `points` equal distances; None for what is no equilibrium."""
    if state.shape is None or not state.is_equilibrium:
        return None
    line = state.shape.centreline(np.linspace(0.0, 1.0, points))
    return base64.b64encode(np.ascontiguousarray(line, _STORED).tobytes()).decode("ascii")


def flat(text: str | None, points: int) -> NDArray[np.float32] | None:
    """The numbers (3 points,) of a packed shape."""
    return None if text is None else np.frombuffer(base64.b64decode(text), _STORED, 3 * points)


def of_rows(records: Iterable[dict[str, Any]]) -> list[str | None]:
    """The packed shapes of records, one for each row that the table has of them (a case without a result has one)."""
    found: list[str | None] = []
    for record in records:
        rows = record["rows"] or [{}]
        found += record.get("shapes") or [None] * len(rows)
    return found


def write(out: Path, records: Iterable[dict[str, Any]], points: int) -> None:
    """`shapes.npy`, whole or not there."""
    texts = of_rows(records)
    lines = np.full((len(texts), points, 3), np.nan, _STORED)
    for line, text in zip(lines, texts, strict=True):
        numbers = flat(text, points)
        if numbers is not None:
            line[...] = numbers.reshape(points, 3)
    with replacing(out / FILE, sole=True) as stream:
        np.save(stream, lines)
