"""A shard of a sweep whose cases are all in memory: its points, and whose its folder is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from compare.studies.axes import Axis, Grid, Point
from compare.sweep.file import Sweep
from compare.sweep.run import software_digest
from compare.sweep.shard import Identity, Shard, identity_of, joinable, sweep_key
from ribbonbench.errors import BadInput

_CSV = "csv"


def only(sweep: Sweep, grid: Sequence[Point], shard: Shard) -> tuple[Sweep, list[Point]]:
    """The cases of a shard, and a sweep over them in one row. `BadInput` where there are none."""
    own = [point for point in grid if shard.takes(point.values)]
    if not own:
        raise BadInput("--shard", str(shard), f"holds none of the {len(grid)} cases", "divide by less")
    values = tuple(tuple(point.values[key] for key in sweep.keys) for point in own)
    return replace(sweep, axes=(Axis(sweep.keys, values),)), own


def _identity(sweep: Sweep, shard: Shard) -> Identity:
    grid = Grid(sweep.scene, sweep.axes)
    key = sweep_key(sweep, grid, software_digest(sweep.solver))
    return Identity(key, sweep.name, len(grid), shard, _CSV, 0)


def claimed(out: Path, sweep: Sweep, shard: Shard, fresh: bool) -> None:
    """Says whose the folder is. `BadInput` where another part of this sweep is in it."""
    mine = _identity(sweep, shard)
    own = None if fresh else identity_of(out, "--out")
    if own is not None and own.key == mine.key and own != mine:
        raise BadInput("--out", out.name or ".", f"holds part {own.shard}", "give each part a folder of its own")
    mine.write(out)


def parts_of(folders: Sequence[str], sweep: Sweep) -> tuple[Path, ...]:
    """The folders with the shards of a sweep; `BadInput` as of `compare.sweep.shard.joinable`."""
    return tuple(folder for folder, _ in joinable(folders, _identity(sweep, Shard())))
