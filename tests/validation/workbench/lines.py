"""Cases of sweeps that begin at their neighbours' states, beside the same cases alone: rows that differ, and what they
take either way, block by block in turns (results/lines.md)."""

from __future__ import annotations

import contextlib
import functools
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.ribbon import solving
from compare.studies.axes import Grid, parse_axis
from compare.sweep.file import load_sweep
from compare.sweep.journal import value_in
from compare.sweep.large import lines
from compare.sweep.large.stretch import TRIES, Stretch, given
from ribbon.find.solving import neighbours
from tests.validation import page
from tests.validation.number import Number
from tests.validation.workbench.million import swept

#: Blocks that are looked at of the grid of the page million, and of each harder one.
MANY, FEW = 80, 16
#: Distance (l) of the ends, and difference of the energies over their size, from which two rows differ.
APART = 1e-7
_LEANING = {"model.elements": 40, "gravity.up": [0.6, 0.0, 0.8]}
#: Harder grids: what is set, and the axes.
HARDER: dict[str, tuple[dict[str, Any], tuple[str, str]]] = {
    "Gamma to 1e4": (_LEANING, ("strip.gamma=log(1000,1e4,40)", "strip.natural_curvature=-10:10:1000")),
    "K l to 40": (_LEANING, ("strip.gamma=log(10,1e4,40)", "strip.natural_curvature=-40:40:1000")),
    "w / l = 0.25": ({**_LEANING, "strip.width": 0.25},
                     ("strip.gamma=log(1,1000,40)", "strip.natural_curvature=-10:10:1000")),
    "clamp turned and moved": (
        {**_LEANING, "clamp.start.position": [0.3, -0.2, 0.5], "clamp.start.tangent": [0.8, 0.0, -0.6],
         "clamp.start.normal": [0.36, 0.8, 0.48]},
        ("strip.natural_curvature=-5:5:40", "strip.gamma=log(1,1000,1000)"),
    ),
    "steps of a tenth": (_LEANING, ("strip.natural_curvature=-2:2:20", "strip.gamma=log(1,1000,64)")),
}  # fmt: skip
_TIME = "time of one run"


@dataclass
class Seen:
    """Of a grid. cases, followed: how many, and how many of them begun at their neighbours'; differ, lower: rows that
    are another state, and in how many of them the neighbours' has less energy; along, alone: CPU (us a case) of the
    blocks either way; parts: of a case on its way along lines."""

    cases: int
    followed: int
    differ: int
    lower: int
    worst: float
    along: list[float]
    alone: list[float]
    parts: dict[str, float]


@contextlib.contextmanager
def _clocked(spent: dict[str, float], name: str, owner: Any, function: str) -> Iterator[None]:
    """Adds the CPU time (s) in a function to what is spent."""
    ordinary: Callable[..., Any] = getattr(owner, function)

    def timed(*given: Any, **more: Any) -> Any:
        began = time.process_time()
        try:
            return ordinary(*given, **more)
        finally:
            spent[name] = spent.get(name, 0.0) + time.process_time() - began

    setattr(owner, function, timed)
    try:
        yield
    finally:
        setattr(owner, function, ordinary)


def _columns(job: Stretch) -> tuple[dict[str, Any], float]:
    began = time.process_time()
    line = job.work().line
    took = time.process_time() - began
    return value_in(line.rstrip(b"\n"))["columns"], took


def _apart(one: dict[str, Any], other: dict[str, Any]) -> np.ndarray[Any, Any]:
    """How far (l, or over the energy) the rows of two tables are apart; inf where a status differs."""
    keys = ("end.x", "end.y", "end.z", "middle.x", "middle.y", "middle.z")
    far = np.max([_off(_numbers(one, key), _numbers(other, key)) for key in keys], axis=0)
    energies = _numbers(one, "energy.total"), _numbers(other, "energy.total")
    far = np.maximum(far, _off(*energies) / np.maximum(1.0, np.nan_to_num(np.abs(energies[1]))))
    same = np.array([a == b for a, b in zip(one["status"], other["status"], strict=True)])
    return np.where(same, far, np.inf)


def _off(one: np.ndarray[Any, Any], other: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """How far numbers are apart: inf where one side alone has none, 0 where neither has."""
    none = np.isnan(one), np.isnan(other)
    return np.where(none[0] & none[1], 0.0, np.where(none[0] | none[1], np.inf, np.abs(one - other)))


def _numbers(columns: dict[str, Any], key: str) -> np.ndarray[Any, Any]:
    return np.array([np.nan if value is None else value for value in columns[key]])


@functools.cache
def _begun() -> None:
    """What is compiled or loaded once in a process: a block across K = 0 in which a saddle is left, both ways."""
    sweep = replace(swept(1000, 1000), neighbours=True)
    first = 820_500 - 820_500 % lines.BLOCK
    job = Stretch(
        0, tuple(range(first, first + lines.BLOCK)), given(sweep, Grid(sweep.scene, sweep.axes)), tempfile.gettempdir()
    )
    _columns(job)
    _columns(replace(job, tries=TRIES))


def seen(sweep: Any, blocks: int) -> Seen:
    """Blocks of a grid at equal steps, either way in turns."""
    grid = Grid(sweep.scene, sweep.axes)
    packed, whole = given(replace(sweep, neighbours=True), grid), len(grid) // lines.BLOCK
    found = Seen(0, 0, 0, 0, 0.0, [], [], {})
    _begun()
    _columns(Stretch(0, tuple(range(lines.BLOCK)), packed, tempfile.gettempdir()))
    for k in range(blocks):
        first = lines.BLOCK * (k * (whole - 1) // (blocks - 1))
        job = Stretch(0, tuple(range(first, first + lines.BLOCK)), packed, tempfile.gettempdir())
        counted: dict[str, float] = {}
        with (
            _clocked(counted, "kernels of cases followed", neighbours, "_follow"),
            _clocked(counted, "states alone", lines, "states_of"),
        ):
            along, took = _columns(job)
        alone, before = _columns(replace(job, tries=TRIES))
        far = _apart(along, alone)
        other = far > APART
        found.cases += lines.BLOCK
        found.followed += _followed(job)
        found.differ += int(other.sum())
        found.lower += int((other & (_numbers(along, "energy.total") < _numbers(alone, "energy.total"))).sum())
        found.worst = max(found.worst, float(far[~other].max(initial=0.0)))
        found.along.append(1e6 * took / lines.BLOCK)
        found.alone.append(1e6 * before / lines.BLOCK)
        counted["points, rows, the line of the journal"] = took - sum(counted.values())
        for name, seconds in counted.items():
            found.parts[name] = found.parts.get(name, 0.0) + 1e6 * seconds / (blocks * lines.BLOCK)
    return found


def _followed(job: Stretch) -> int:
    """How many cases of a block begin at their neighbours' states."""
    count = 0
    ordinary = solving.solved_line

    def told(*given: Any) -> Any:
        nonlocal count
        line = ordinary(*given)
        count += 0 if line is None else given[0].size - len(line.alone)
        return line

    from compare.models.ribbon import model

    model.solved_line = told  # type: ignore[attr-defined]
    try:
        job.work()
    finally:
        model.solved_line = ordinary  # type: ignore[attr-defined]
    return count


@functools.cache
def few() -> tuple[int, int]:
    """Of four blocks of the grid of the page million: rows that differ, and cases that were followed."""
    found = seen(swept(1000, 1000), 4)
    return found.differ, found.followed


PROBES = {"differ_of_few": lambda: few()[0], "followed_of_few": lambda: few()[1]}


def run(folder: Path) -> dict[str, Number]:
    """Writes lines.md into the folder."""
    grids = {"million": seen(swept(1000, 1000), MANY)}
    for name, (keys, axes) in HARDER.items():
        grids[name] = seen(load_sweep("cantilever", keys, [parse_axis(axis) for axis in axes]), FEW)
    first = grids["million"]
    mean, before = statistics.fmean(first.along), statistics.fmean(first.alone)
    harder = [found for name, found in grids.items() if name != "million"]
    numbers = {
        "cases": Number(first.cases, 0, shown="d"),
        "followed": Number(100.0 * first.followed / first.cases, 0, "%", ".1f"),
        "differ": Number(first.differ, 0, shown="d"),
        "along": Number(mean, None, "us", ".0f", why=_TIME),
        "alone": Number(before, None, "us", ".0f", why=_TIME),
        "along_median": Number(statistics.median(first.along), None, "us", ".0f", why=_TIME),
        "alone_median": Number(statistics.median(first.alone), None, "us", ".0f", why=_TIME),
        "harder_cases": Number(sum(found.cases for found in harder), 0, shown="d"),
        "harder_differ": Number(sum(found.differ for found in harder), 0, shown="d"),
        "harder_lower": Number(sum(found.lower for found in harder), 0, shown="d"),
        "differ_of_few": Number(few()[0], 0, shown="d"),
        "followed_of_few": Number(few()[1], 8, shown="d"),
    }
    page.write(
        folder / "lines.md",
        "Cases of sweeps that begin at their neighbours' states",
        "OMP_NUM_THREADS=1 python -m tests.validation lines",
        f"Blocks of {lines.BLOCK} cases at equal steps through grids of cantilevers of 40 segments, on their way of a "
        "worker (points, states, stability, rows, the journal's line) along lines and alone, in turns; CPU times, "
        "without what a process loads or compiles once. A row differs where end, middle or energy is more than "
        f"{APART:g} apart, or the status is another.",
        page.table(
            ("grid", "cases", "followed", "rows that differ", "lower", "the others, at most",
             "along, mean (median)", "alone, mean (median)"),
            [
                (
                    name, str(found.cases), f"{100.0 * found.followed / found.cases:.1f} %", str(found.differ),
                    str(found.lower), f"{found.worst:.1e}",
                    f"{statistics.fmean(found.along):.0f} us ({statistics.median(found.along):.0f})",
                    f"{statistics.fmean(found.alone):.0f} us ({statistics.median(found.alone):.0f})",
                )
                for name, found in grids.items()
            ],
        ),
        "Lower: rows that differ in which the state of the neighbours has less energy than the one that a start of its "
        f"own leads to. On all grids but the first {numbers['harder_differ']} of {numbers['harder_cases']} rows "
        f"differ, {numbers['harder_lower']} of them lower.",
        page.table(
            ("a case of the grid of the page million, along", "us"),
            [(name, f"{spent:.0f}") for name, spent in first.parts.items()],
        ),
    )  # fmt: skip
    return numbers
