"""A sweep of any number of cases in little memory: cases flow to the workers, their rows into journals, full journals
into parts of a table (`compare.sweep.large.parts`). A run that is killed goes on, and ends in the same table."""

from __future__ import annotations

import contextlib
import functools
import itertools
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from compare.store.progress import Reporter
from compare.studies.axes import Grid, at_point
from compare.sweep.file import Sweep
from compare.sweep.journal import Growing
from compare.sweep.large import parts, stretch
from compare.sweep.large.aside import Aside, aside
from compare.sweep.large.columns import fields_of
from compare.sweep.large.join import join
from compare.sweep.large.lines import BLOCK, goes_by_lines
from compare.sweep.large.meanwhile import Meanwhile
from compare.sweep.large.pace import Pace
from compare.sweep.large.parts import Layout, Stock
from compare.sweep.large.stretch import TOGETHER, Chunk, Stretch, by_lines, given
from compare.sweep.run import check_point, software_digest
from compare.sweep.shard import IDENTITY, Identity, Shard, identity_of, sweep_key
from compare.sweep.shard import joinable as joinable_shards
from compare.sweep.workers import Crew
from ribbonbench.errors import BadInput

#: Cases of a grid above which its table is in parts; and at most.
LARGE, MOST = 100_000, 1_000_000_000
#: Blocks of lines for each shard from which on shards take whole ones.
MANY = 16
#: Points of a grid that are looked at before anything runs, besides every value of every axis.
LOOKED_AT = 200
CSV, PARQUET = "csv", "parquet"


def grid_of(sweep: Sweep) -> Grid:
    """The grid of a sweep. `BadInput`: a key is varied twice, it has too many cases, or one of the points that are
    looked at (every value of every axis beside the first and the last of the others, and some between) cannot be
    solved."""
    grid = Grid(sweep.scene, sweep.axes, MOST)
    for number in sorted(_looked_at(grid)):
        point = grid.point(number)
        try:
            check_point(sweep, point)
        except BadInput as error:
            raise at_point(error, number, point.values) from None
    return grid


def _looked_at(grid: Grid) -> set[int]:
    found = set(range(0, len(grid), max(1, len(grid) // LOOKED_AT))) | {len(grid) - 1}
    step = 1
    for axis in reversed(grid.axes):
        places = {round(k * (len(axis.values) - 1) / LOOKED_AT) for k in range(LOOKED_AT + 1)}
        found |= {place * step for place in places}
        found |= {len(grid) - 1 - place * step for place in places}
        step *= len(axis.values)
    return found


def cases_of(sweep: Sweep, grid: Grid, shard: Shard) -> Iterator[int]:
    """The cases of a shard, in order: by the values of each; of a great grid whose cases begin at their neighbours'
    states whole blocks, by the values of their first case."""
    if shard.whole:
        yield from range(len(grid))
    elif goes_by_lines(sweep, grid) and len(grid) >= MANY * BLOCK * shard.of:
        for first in range(0, len(grid), BLOCK):
            if shard.takes(grid.values(first)):
                yield from range(first, min(first + BLOCK, len(grid)))
    else:
        yield from (number for number in range(len(grid)) if shard.takes(grid.values(number)))


def layout_of(sweep: Sweep, grid: Grid) -> Layout:
    """The table of a sweep."""
    units = None if any(key.startswith("strip.") for key in sweep.keys) else sweep.scene.units
    told = None if units is None else {**units.to_dict(), "known": units.known}
    key = sweep_key(sweep, grid, software_digest(sweep.solver, stretch.__name__))
    return Layout(key, sweep.name, sweep.title, sweep.solver, fields_of(sweep, grid), told, sweep.shapes)


@dataclass(frozen=True)
class Streamed:
    """A run that ended. cases: of the shard, new: those that this run made; seconds: its wall time; workers: how many
    it had; damaged: what is wrong with parts that could not be read; missing: cases that are in no part."""

    sweep: Sweep
    grid: Grid
    shard: Shard
    layout: Layout
    cases: int
    new: int
    seconds: float
    workers: int
    damaged: tuple[str, ...] = ()
    missing: int = 0


@dataclass
class _Run:
    """What is known while a sweep runs; left: of every part that is open, the cases that have not come back."""

    sweep: Sweep
    grid: Grid
    shard: Shard
    out: Path
    layout: Layout
    rows: int
    stock: dict[int, Stock]
    journals: dict[int, Growing] = field(default_factory=dict)
    left: dict[int, int] = field(default_factory=dict)
    handed: set[int] = field(default_factory=set)
    full: list[int] = field(default_factory=list)
    cases: int = 0
    kept: int = 0

    def blocks(self) -> Iterator[tuple[int, list[int]]]:
        """The cases of each part: `rows` of them, of the last one up to twice as many less one."""
        own = cases_of(self.sweep, self.grid, self.shard)
        block, waiting = 0, list(itertools.islice(own, self.rows))
        while waiting:
            more = list(itertools.islice(own, self.rows))
            if len(more) < self.rows:
                yield block, waiting + more
                return
            yield block, waiting
            block, waiting = block + 1, more

    def stretches(self) -> Iterator[Stretch]:
        """What is left to do, in the order of the grid."""
        packed, folder = given(self.sweep, self.grid), os.path.abspath(self.out)
        for block, numbers in self.blocks():
            self.cases += len(numbers)
            todo = self._todo(block, numbers)
            self.kept += len(numbers) - len(todo)
            self.left[block] = len(todo)
            for together in self._together(todo, by_lines(packed)):
                yield Stretch(block, together, packed, folder)
            self.handed.add(block)
            self._look(block)

    @staticmethod
    def _together(todo: list[int], lines: bool) -> Iterator[tuple[int, ...]]:
        """What goes to a worker at once: so many, or what is of one block of lines."""
        if lines:
            for _, numbers in itertools.groupby(todo, lambda number: number // BLOCK):
                yield tuple(numbers)
            return
        for first in range(0, len(todo), TOGETHER):
            yield tuple(todo[first : first + TOGETHER])

    def _todo(self, block: int, numbers: list[int]) -> list[int]:
        journal = parts.journal(self.out, block)
        stock = self.stock.get(block)
        if stock is not None and stock.cases == len(numbers) and not stock.again:
            journal.unlink(missing_ok=True)  # of a run that was killed before it could
            return []
        done = parts.finished_in(journal)
        if stock is not None:
            done |= aside(parts.finished_of, self.out, block, self.layout.key, bool(self.layout.shapes))
        if done and len(done) == len(numbers):
            self.full.append(block)
        return [number for number in numbers if number not in done]

    def take(self, stretch: Stretch, chunk: Chunk) -> None:
        """Keeps what came of a stretch."""
        block = stretch.block
        if block not in self.journals:
            parts.journal(self.out, block).parent.mkdir(exist_ok=True)
            self.journals[block] = Growing(parts.journal(self.out, block))
        self.journals[block].add(chunk.line)
        self.left[block] -= chunk.cases
        self._look(block)

    def _look(self, block: int) -> None:
        if not self.left[block] and block in self.handed and block in self.journals:
            self.journals.pop(block).close()
            self.full.append(block)


def run(
    sweep: Sweep, grid: Grid, shard: Shard, out: Path, crew: Crew, reporter: Reporter, fresh: bool = False,
    rows: int = parts.ROWS, picture: Callable[[str], Aside] | None = None,
) -> Streamed:  # fmt: skip
    """Runs what is not finished of a shard. The folder must be held (`compare.store.store.occupied`).

    rows: of a part; picture: begins one of the parts that are there (of a table's key), every now and then. Raises
    `BadInput` where the folder holds another sweep, OSError when the disk is full.
    """
    clock = time.perf_counter()
    layout = layout_of(sweep, grid)
    claim(out, Identity(layout.key, sweep.name, len(grid), shard, PARQUET, rows), fresh)
    found = aside(parts.stock, out, layout.key, bool(layout.shapes)) if parts.blocks(out) else {}
    damaged = tuple(one.fault for one in found.values() if one.fault)
    for fault in damaged:
        reporter.step(f"a damaged part of the table: its cases are made again ({fault})")
    work = _Run(sweep, grid, shard, out, layout, rows, found)
    about = len(grid) if shard.whole else round(len(grid) / shard.of)
    share = "" if shard.whole else f" in all, about {about} of them in part {shard}"
    reporter.step(f"sweep: {len(grid)} cases{share}, solver {sweep.solver}, {crew.size} at once")
    new = failed = 0
    writing: Aside | None = None
    meanwhile, pace = Meanwhile(), Pace(reporter)
    crew.compiles = pace.compiles
    try:
        with contextlib.closing(crew.flow(work.stretches())) as ends:  # type: ignore[type-var]
            for end in ends:
                chunk: Chunk = end.outcome
                if chunk.disk_full is not None:
                    raise OSError(chunk.disk_full, os.strerror(chunk.disk_full))
                assert isinstance(end.job, Stretch)
                work.take(end.job, chunk)
                new += chunk.cases
                failed += chunk.cases - chunk.converged
                left = about - work.kept
                pace.ended(new, max(left, new), failed)
                writing = _write(work, writing, wait=len(work.full) > 1)
                if picture is not None:
                    meanwhile.look(functools.partial(picture, layout.key))
        for block in sorted(work.journals):  # of cases that came to nothing
            work.journals.pop(block).close()
            work.full.append(block)
        while work.full or writing is not None:
            writing = _write(work, writing, wait=True)
    finally:
        meanwhile.end()
        for handle in work.journals.values():
            with contextlib.suppress(OSError):
                handle.close()
        if writing is not None:
            writing.end()
    with contextlib.suppress(OSError):
        (out / parts.JOURNALS).rmdir()
    seconds = time.perf_counter() - clock
    return Streamed(sweep, grid, shard, layout, work.cases, new, seconds, crew.size if new else 0, damaged)


def _write(work: _Run, writing: Aside | None, wait: bool) -> Aside | None:
    """Goes on with writing parts, one at a time."""
    if writing is not None:
        if not wait and not writing.over():
            return writing
        writing.result()
    return Aside(parts.compact, work.out, work.full.pop(0), work.layout) if work.full else None


def claim(out: Path, mine: Identity, fresh: bool) -> None:
    """Says whose the folder is. `BadInput` where it holds another sweep, or another part of this one; fresh: that
    goes."""
    own = None if fresh else identity_of(out, "--out")
    if own is not None and replace(own, rows=mine.rows) != mine:
        other = own.key != mine.key
        what = "a sweep of another grid, option or version" if other else f"part {own.shard} in {own.table}"
        raise BadInput("--out", out.name or ".", f"holds {what}", "give another folder, or --fresh to forget that one")
    if own is not None and own.rows != mine.rows:
        raise BadInput("--out", out.name or ".", f"has parts of {own.rows} rows", "give another folder, or --fresh")
    if fresh or own is None:
        forget(out)
    mine.write(out)


def forget(out: Path) -> None:
    """Removes the table of a folder."""
    (out / IDENTITY).unlink(missing_ok=True)
    for kind in (parts.TABLE, parts.TIMES, parts.SHAPES, parts.JOURNALS):
        for path in (out / kind).glob("*"):
            path.unlink()


def joinable(folders: Sequence[str], sweep: Sweep, grid: Grid) -> list[tuple[Path, Identity]]:
    """The folders with the shards of a sweep; `BadInput` as of `compare.sweep.shard.joinable`."""
    mine = Identity(layout_of(sweep, grid).key, sweep.name, len(grid), Shard(), PARQUET, parts.ROWS)
    return joinable_shards(folders, mine)


def joined(
    sweep: Sweep, grid: Grid, out: Path, folders: Sequence[tuple[Path, Identity]], reporter: Reporter,
    fresh: bool = False, rows: int = parts.ROWS,
) -> Streamed:  # fmt: skip
    """The parts of shards as those of one run. What is damaged is named and left out."""
    clock = time.perf_counter()
    layout = layout_of(sweep, grid)
    claim(out, Identity(layout.key, sweep.name, len(grid), Shard(), PARQUET, rows), fresh)
    reporter.step(f"joining {len(folders)} folders")
    for folder, own in folders:
        if (folder / parts.JOURNALS).exists():
            reporter.step(f"{folder.name}: part {own.shard} is not finished; what is in its table is read")
    damaged, missing = aside(join, out, [folder for folder, _ in folders], layout, len(grid), rows)
    for fault in damaged:
        reporter.step(f"damaged, and left out: {fault}")
    seconds = time.perf_counter() - clock
    return Streamed(sweep, grid, Shard(), layout, len(grid), 0, seconds, 0, tuple(damaged), missing)
