"""The parts of several shards as the parts of one run: merged by the number of the case, a group at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compare.sweep.large import parts
from compare.sweep.large.parts import TABLE, Layout

if TYPE_CHECKING:
    import pyarrow as pa


def join(out: Path, folders: Sequence[Path], layout: Layout, cases: int, rows: int) -> tuple[list[str], int]:
    """Writes the parts of a whole sweep from those of its shards; returns what is wrong with damaged ones, which are
    left out, and how many cases are in none.

    cases: of the whole; rows: of a part. The result is what one run over all cases writes, to the byte.
    """
    damaged: list[str] = []
    sound: dict[Path, list[int]] = {}
    for folder in folders:
        sound[folder] = []
        for block in parts.blocks(folder):
            try:
                for kind in layout.kinds:
                    for _ in parts.batches(parts.part(folder, kind, block), layout.key):
                        pass
                sound[folder].append(block)
            except ValueError as error:
                damaged.append(f"{folder.name}: {error}")
    found = 0
    for kind in layout.kinds:
        readers = [_Reader(folder, kind, sound[folder], layout.key) for folder in folders]
        count = max(1, cases // rows)
        for block in range(count):
            below = cases if block == count - 1 else (block + 1) * rows
            pieces = [piece for reader in readers for piece in reader.below(below)]
            table = parts.sorted_by_case(pieces)
            if table is not None:
                parts.write(table, parts.part(out, kind, block))
                found += len(np.unique(table["case"].to_numpy())) if kind == TABLE else 0
    return damaged, cases - found


class _Reader:
    """The rows of a shard in the order of their cases."""

    def __init__(self, folder: Path, kind: str, blocks: Sequence[int], key: str) -> None:
        self._coming = (
            rows for block in blocks for rows in parts.batches(parts.part(folder, kind, block), key) if rows.num_rows
        )
        self._held: pa.Table | None = None

    def below(self, case: int) -> Iterator[pa.Table]:
        """The next rows, of cases below this one."""
        while True:
            rows = next(self._coming, None) if self._held is None else self._held
            self._held = None
            if rows is None:
                return
            count = int(np.searchsorted(rows["case"].to_numpy(), case))
            if count:
                yield rows.slice(0, count)
            if count < rows.num_rows:
                self._held = rows.slice(count)
                return
