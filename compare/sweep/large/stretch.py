"""Neighbouring cases of a grid as one job: the points are made in the worker, and their rows come back as one line of
the journal, so that the process that hands them out has next to nothing to do for a case."""

from __future__ import annotations

import contextlib
import functools
import pickle
from collections.abc import Sequence
from dataclasses import dataclass, replace

from compare.scene.scene import Scene
from compare.studies.axes import Grid, Point
from compare.sweep.case import COMPARE, PASSING, Record, Task, crashed, run_case, run_cases, slice_key
from compare.sweep.file import Sweep
from compare.sweep.finished import Case
from compare.sweep.journal import line_of
from compare.sweep.large.columns import Field, by_column, fields_of, rows_of_case
from compare.sweep.large.lines import goes_by_lines, gone, line_with
from compare.sweep.large.quick import Quick
from compare.sweep.row import Row
from compare.sweep.shapes import of_rows
from ribbonbench.errors import BadInput

#: Cases that a worker gets at once, and how many workers may die of them before those that begin at each other's states
#: go one by one.
TOGETHER, TRIES = 64, 2
#: The end of a case that was begun at its neighbours' states, without its row.
_FOLLOWED: Record = {"status": "converged", "message": "", "rows": []}


@dataclass(frozen=True)
class Chunk:
    """What comes of a stretch. line: its rows, for the journal; converged: how many cases are; seconds: of all."""

    line: bytes
    cases: int
    converged: int
    seconds: float
    disk_full: int | None = None


@dataclass(frozen=True)
class Stretch:
    """Cases (numbers) of a grid that go to a worker at once; block: of the table in which they are.

    given: the sweep, pickled once for all stretches; folder: of its results; tries: how many workers died of it, where
    its cases begin at each other's states (`compare.sweep.large.lines`).
    """

    block: int
    numbers: tuple[int, ...]
    given: bytes
    folder: str
    tries: int = 0

    def work(self) -> Chunk:
        """Solves the cases: along lines where neighbours can be begun at each other's states, else those that fit
        together at once."""
        sweep, grid, _ = _sweep(self.given)
        points, ends, rows = self._along() if self.tries < TRIES and by_lines(self.given) else ({}, {}, {})
        rest = [number for number in self.numbers if number not in ends]
        with contextlib.suppress(BadInput):
            points |= {point.number: point for point in _quick(self.given).points(rest) or ()} if rest else {}
        groups: dict[object, list[int]] = {}
        for number in rest:
            if number not in points:
                try:
                    points[number] = grid.point(number)
                except BadInput as error:
                    ends[number] = {**crashed(str(error)), "status": "refused", "seconds": 0.0}
                    continue
            key = slice_key(self._task(sweep, points[number].scene))
            groups.setdefault(("alone", number) if key is None else key, []).append(number)
        for key, members in groups.items():
            alone = isinstance(key, tuple) and key[0] == "alone"
            tasks = [replace(self._task(sweep, points[n].scene), slice=None if alone else 0) for n in members]
            ends |= zip(members, _records(tasks), strict=True)
        return self._chunk(points, ends, rows)

    def _along(self) -> tuple[dict[int, Point], dict[int, Record], dict[int, Row]]:
        """Of the cases of lines that can be gone: points of those that were solved alone, ends of all, rows of those
        that were begun at their neighbours' states."""
        sweep, grid, _ = _sweep(self.given)
        task, own = self._task(sweep, grid.scene), set(self.numbers)
        points: dict[int, Point] = {}
        ends: dict[int, Record] = {}
        rows: dict[int, Row] = {}
        for line in dict.fromkeys(line_with(grid, number) for number in self.numbers):
            found = gone(task, grid, _quick(self.given), line)
            if found is not None:
                points |= found.points
                rows |= {number: row for number, row in found.rows.items() if number in own}
                ends |= {number: end for number, end in found.records.items() if number in own}
                ends |= {number: {**_FOLLOWED, "seconds": found.seconds} for number in found.rows if number in own}
        return points, ends, rows

    def _task(self, sweep: Sweep, scene: Scene) -> Task:
        return Task("", scene, sweep.solver, sweep.errors, sweep.leave_saddle, self.folder, shapes=sweep.shapes)

    def apart(self) -> list[Stretch]:
        """The cases one by one; where they begin at each other's states, once more as they are."""
        if by_lines(self.given) and self.tries < TRIES:
            return [replace(self, tries=self.tries + 1)]
        return [replace(self, numbers=(number,)) for number in self.numbers] if len(self.numbers) > 1 else []

    def died(self, why: str) -> Chunk:
        """Rows of a crash."""
        _, grid, _ = _sweep(self.given)
        points = {number: grid.point(number) for number in self.numbers}
        return self._chunk(points, {number: crashed(why) for number in self.numbers}, {})

    def _chunk(self, points: dict[int, Point], ends: dict[int, Record], known: dict[int, Row]) -> Chunk:
        sweep, grid, fields = _sweep(self.given)
        rows = []
        for number in self.numbers:
            if number in known:
                rows.append(known[number])
                continue
            point = points.get(number) or Point(number, grid.values(number), sweep.scene)
            rows += rows_of_case(Case(point, "", ends[number], False))
        seconds = [[number, ends[number]["seconds"]] for number in self.numbers]
        full = [end["disk_full"] for end in ends.values() if "disk_full" in end]
        line = {"block": self.block, "columns": by_column(fields, rows), "seconds": seconds}
        if sweep.shapes:
            line["shapes"] = of_rows(ends[number] for number in self.numbers)
        return Chunk(
            line_of(line, ready=not sweep.shapes),
            len(self.numbers),
            sum(end["status"] == "converged" for end in ends.values()),
            sum(value or 0.0 for _, value in seconds),
            full[0] if full else None,
        )


def given(sweep: Sweep, grid: Grid) -> bytes:
    """The sweep as stretches have it."""
    return pickle.dumps((sweep, grid))


@functools.lru_cache(maxsize=2)
def _sweep(packed: bytes) -> tuple[Sweep, Grid, tuple[Field, ...]]:
    sweep, grid = pickle.loads(packed)
    return sweep, grid, fields_of(sweep, grid)


@functools.lru_cache(maxsize=2)
def by_lines(packed: bytes) -> bool:
    """Whether cases begin at each other's states."""
    sweep, grid, _ = _sweep(packed)
    return goes_by_lines(sweep, grid)


@functools.lru_cache(maxsize=2)
def _quick(packed: bytes) -> Quick:
    return Quick(_sweep(packed)[1])


def _records(tasks: Sequence[Task]) -> list[Record]:
    if tasks[0].solver != COMPARE:
        return run_cases(tasks)
    from compare.sweep.pair import compared

    return [run_case(task, compared) for task in tasks]


#: The ends at which a later run tries again.
AGAIN = PASSING
