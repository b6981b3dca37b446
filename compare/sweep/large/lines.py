"""Neighbouring cases of a grid, begun at each other's states, and their rows without a state's own record of each.

The cases are cut into blocks by their numbers alone, so that a row depends on its block, and on nothing that a run
does: not on shards, workers or kills. In a block, the cases that differ along the last axis alone are a line
(`compare.models.capabilities.Lines`). The row of a case that was begun at its neighbours' differs from that of a case
solved alone in the numbers that the model gives; that nothing else does is checked on cases that are known both ways.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compare.models import model
from compare.models.base import State
from compare.models.capabilities import Line, Lines
from compare.scene.scene import Scene
from compare.studies.axes import Grid, Point
from compare.sweep.case import COMPARE, Record, Task, recorded, slice_key, states_of
from compare.sweep.file import Sweep
from compare.sweep.finished import Case
from compare.sweep.large.columns import rows_of_case
from compare.sweep.large.quick import Quick
from compare.sweep.row import reach, row_of
from ribbonbench.errors import RibbonbenchError

#: Cases of a block, and fewest cases of a line whose neighbours are begun at each other's states.
BLOCK, FEWEST = 64, 8
#: Difference, over the size and at least 1, up to which a number of two ways is one.
_SAME = 1e-5

Rows = list[dict[str, Any]]


def line_with(grid: Grid, number: int) -> range:
    """The line of a case: the cases of its block that differ from it along the last axis alone."""
    along = len(grid.axes[-1].values) if grid.axes else 1
    block, row = number - number % BLOCK, number - number % along
    return range(max(block, row), min(block + BLOCK, row + along, len(grid)))


def goes_by_lines(sweep: Sweep, grid: Grid) -> bool:
    """Whether cases are begun at their neighbours' states: where that is asked for, and these are near."""
    if not sweep.neighbours:
        return False
    if sweep.solver == COMPARE or sweep.errors or sweep.leave_saddle or sweep.shapes:
        return False
    if not grid.axes or len(grid.axes[-1].values) < FEWEST or grid.scene.several_equilibria:
        return False
    return Quick(grid).able and isinstance(model(sweep.solver), Lines)


@dataclass(frozen=True)
class Gone:
    """A line that was gone. points, records: of the cases that were solved alone; rows: of the others; seconds: of
    each."""

    points: dict[int, Point]
    records: dict[int, Record]
    rows: dict[int, dict[str, Any]]
    seconds: float


class Alone(Exception):
    """The cases of a line are solved alone, and each says for itself what is wrong with it."""


class _Solved:
    """The cases of a line that are solved alone, each once."""

    def __init__(self, task: Task, quick: Quick, line: range) -> None:
        self._task, self._quick, self._line = replace(task, slice=0), quick, line
        self.points: dict[int, Point] = {}
        self.states: dict[int, State] = {}

    def __call__(self, places: Sequence[int]) -> list[State]:
        """Their states. `Alone` where the scenes cannot be put together, are not solved together, or one is refused."""
        # one of a line is held against the strict way, the others are put together of the same values
        points = self._quick.points([self._line[place] for place in places], check=not self.points)
        if points is None:
            raise Alone("points that have to be read one by one")
        tasks = [self.task(point) for point in points]
        if any(slice_key(task) is None for task in tasks):
            raise Alone("cases that are solved alone")
        try:
            states = states_of(tasks)
        except (RibbonbenchError, ValueError) as error:  # a solver's refusal is a ValueError
            raise Alone("cases that are refused") from error
        self.points |= zip(places, points, strict=True)
        self.states |= zip(places, states, strict=True)
        return states

    def task(self, point: Point) -> Task:
        """The task of a point."""
        return replace(self._task, scene=point.scene)


def gone(task: Task, grid: Grid, quick: Quick, line: range) -> Gone | None:
    """Goes along a line; task: of any of its cases. None where it cannot be gone: all of its cases are solved alone."""
    if len(line) < FEWEST:
        return None
    clock = time.perf_counter()
    solved = _Solved(task, quick, line)
    try:
        given = quick.given(line)
        requested = model(task.solver)
        if given is None or not isinstance(requested, Lines):
            return None
        gamma, curvature = np.array(given[0]), np.array(given[1])
        found = requested.solve_line(gamma, curvature, solved)
        if found is None:
            return None
        rows = {place: row_of(solved.points[place].scene, state) for place, state in solved.states.items()}
        records = {
            line[place]: recorded(solved.task(point), rows[place], solved.states[place], 0.0)
            for place, point in solved.points.items()
        }
    except (Alone, RibbonbenchError):  # the latter: a point that cannot be read
        return None
    between = _rows_between(grid, line, gamma, found, solved.points, records)
    if between is None:
        return None
    each = (time.perf_counter() - clock) / len(line)
    points = {point.number: point for point in solved.points.values()}
    return Gone(points, {n: {**r, "seconds": each} for n, r in records.items()}, between, each)


def _rows_between(
    grid: Grid, line: range, gamma: np.ndarray[Any, Any], found: Line, points: dict[int, Point],
    records: dict[int, Record],
) -> dict[int, dict[str, Any]] | None:  # fmt: skip
    """The rows of the cases that were not solved alone; None where those that are known both ways do not agree."""
    both = [place for place in points if np.isfinite(found.numbers["residual"][place])]
    scene = points[both[0]].scene if both else None
    columns = {name: values.tolist() for name, values in found.numbers.items()}
    columns["iterations"] = [0 if math.isnan(steps) else int(steps) for steps in columns["iterations"]]
    columns |= {"case": list(line), "gamma": gamma.tolist(), **(_reached(scene, found) if scene is not None else {})}
    own: dict[str, Any] = {}
    for place in both:
        (row,) = rows_of_case(Case(points[place], "", records[line[place]], False))
        constant = {key: value for key, value in row.items() if key not in columns and key not in points[place].values}
        agree = all(_same(name, values[place], row.get(name)) for name, values in columns.items())
        if not agree or (own and constant != own):
            return None
        own = constant
    rows = {}
    for place, number in enumerate(line):
        if place not in points:
            row = {**own, **grid.values(number)}
            row.update((name, values[place]) for name, values in columns.items())
            row["warm"] = number - 1
            rows[number] = row
    return rows if own or not rows else None


def _reached(scene: Scene, found: Line) -> dict[str, list[float]]:
    """y / x of the cases, by the positions of their ends."""
    if scene.up is None or scene.start_position is None:
        return {}
    ends = np.column_stack([found.numbers[f"end.{axis}"] for axis in "xyz"])
    return {"y_over_x": reach(ends - scene.start_position, scene.up).tolist()}


def _same(name: str, one: Any, other: Any) -> bool:
    """Whether a number of a row is that of the other way; how a state was come to is not."""
    if name in ("residual", "iterations"):
        return other is not None
    return isinstance(other, int | float) and abs(one - other) <= _SAME * max(1.0, abs(other))
