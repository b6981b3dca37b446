"""Running a sweep: what is finished is found again, the rest goes to the workers, each end is kept at once."""

from __future__ import annotations

import contextlib
import math
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from compare.errors import BadInput, Missing
from compare.registry import home, model, name_for, names
from compare.store.progress import Reporter
from compare.store.provenance import software
from compare.store.store import case_key
from compare.studies.axes import Point, points
from compare.sweep.case import COMPARE, PASSING, Record, Task, slice_key
from compare.sweep.file import Sweep
from compare.sweep.journal import FORMAT, Journal
from compare.sweep.workers import Crew


@dataclass(frozen=True)
class Case:
    """A point of the grid with its end; reused: found among the finished cases."""

    point: Point
    key: str
    record: Record
    reused: bool

    @property
    def status(self) -> str:
        """The solver's word, or "refused", "crashed", "error", "missing"."""
        return str(self.record["status"])

    @property
    def ok(self) -> bool:
        """Converged, and not known to be unstable."""
        rows = self.record["rows"]
        return self.status == "converged" and bool(rows) and all(row.get("stable") is not False for row in rows)


@dataclass(frozen=True)
class Finished:
    """A sweep's cases in the order of the grid; seconds: wall time of this run, workers: how many it had."""

    sweep: Sweep
    cases: tuple[Case, ...]
    seconds: float
    workers: int

    @property
    def ok(self) -> bool:
        """Every case converged to a state that is not known to be unstable."""
        return all(case.ok for case in self.cases)


def check(sweep: Sweep) -> list[Point]:
    """The points of a sweep; `BadInput` names the first one that its solver cannot take, before anything runs."""
    found = points(sweep.scene, sweep.axes)
    for point in found:
        try:
            _check_point(sweep, point)
        except BadInput as error:
            where = ", ".join(f"{key} = {value}" for key, value in point.values.items())
            problem = f"{error.problem} (point {point.number}: {where})"
            raise BadInput(error.key, error.value, problem, error.remedy) from None
    return found


def _check_point(sweep: Sweep, point: Point) -> None:
    from compare.models.base import check_keys
    from compare.models.choice import beside_the_shell
    from compare.models.effects.price import check_price
    from compare.scene.given.plausible import check_meant

    scene = point.scene
    check_meant(scene)
    if sweep.leave_saddle and sweep.solver not in ("ribbon", COMPARE):
        raise BadInput("--leave-saddle", None, f"is for the ribbon, and the solver is {sweep.solver}", "leave it out")
    asked = beside_the_shell(scene) if sweep.solver == COMPARE else model(sweep.solver)
    if "model.energy" in sweep.keys and sweep.solver != "shell":
        chosen = name_for(scene.model.energy)
        if chosen != asked.name:
            raise BadInput(
                "model.energy", scene.model.energy, f"is not the {asked.name}'s",
                f"leave it out, or choose solver {chosen}",
            )  # fmt: skip
    check_keys(asked, scene)
    if sweep.solver == COMPARE:
        check_keys(model("shell"), scene)
        check_price(scene)


def software_digest(solver: str) -> str:
    """What stands for versions and sources in a case's key: of the solver, and of what makes a record of its answer; a
    comparison may ask any model."""
    record = "compare.sweep.pair" if solver == COMPARE else "compare.sweep.case"
    asked = names() if solver == COMPARE else (solver,)
    return case_key(software(*sorted({record, *map(home, asked)})))


def key_of(sweep: Sweep, point: Point, digest: str) -> str:
    """The key of a case: all that determines it."""
    options = {"errors": sweep.errors, "leave_saddle": sweep.leave_saddle}
    return case_key("sweep", FORMAT, sweep.solver, options, point.scene.canonical(), digest)


def run(
    sweep: Sweep, grid: Sequence[Point], out: Path, crew: Crew, reporter: Reporter, fresh: bool = False
) -> Finished:
    """Runs what is not finished yet. The folder must be held (`compare.store.store.occupied`).

    fresh: forget what is finished. Raises OSError when the disk is full and `Missing` when every case lacks a library;
    all else that happens to a case is its status.
    """
    clock = time.perf_counter()
    digest = software_digest(sweep.solver)
    keys = [key_of(sweep, point, digest) for point in grid]
    journal = Journal(out, digest, fresh)
    _say_found(journal, set(keys), reporter)
    ends: dict[str, tuple[Record, bool]] = {key: (journal.found[key], True) for key in keys if key in journal.found}
    todo = [(key, point) for key, point in zip(keys, grid, strict=True) if key not in ends]
    tasks = [
        Task(key, point.scene, sweep.solver, sweep.errors, sweep.leave_saddle, os.path.abspath(out))
        for key, point in todo
    ]
    kept = f", {len(grid) - len(tasks)} of them finished before" if len(tasks) < len(grid) else ""
    tasks = sliced(tasks, crew.size)
    workers = min(crew.size, len(tasks))
    at_once = f", {workers} at once" if workers else ""
    reporter.step(f"sweep: {len(grid)} cases, solver {sweep.solver}{kept}{at_once}{_way(tasks)}")
    with journal:
        failed = 0
        with contextlib.closing(crew.run(tasks)) as results:  # type: ignore[type-var]
            for done, (index, record) in enumerate(results, start=1):
                if "disk_full" in record:
                    raise OSError(record["disk_full"], os.strerror(record["disk_full"]))
                key = tasks[index].key
                if record["status"] not in PASSING:
                    journal.add(key, record)
                failed += record["status"] != "converged"
                ends[key] = (record, False)
                reporter.detail(progress(done, len(tasks), failed, time.perf_counter() - clock))
    cases = tuple(Case(point, key, *ends[key]) for key, point in zip(keys, grid, strict=True))
    missing = [case for case in cases if case.status == "missing"]
    if missing and len(missing) == len(cases):
        raise Missing.of(str(missing[0].record["message"]))
    return Finished(sweep, cases, time.perf_counter() - clock, workers)


#: Most cases of a slice, and how many slices each worker gets at least, where there are enough cases.
MOST_TOGETHER, ROUNDS = 64, 4


def sliced(tasks: Sequence[Task], workers: int) -> list[Task]:
    """The tasks with the numbers of their slices: cases that can be solved together (`slice_key`), in their order."""
    groups: dict[Any, list[int]] = {}
    for index, task in enumerate(tasks):
        key = slice_key(task)
        if key is not None:
            groups.setdefault(key, []).append(index)
    found, number = list(tasks), 0
    for members in groups.values():
        size = min(MOST_TOGETHER, math.ceil(len(members) / (ROUNDS * workers)))
        for first in range(0, len(members), size):
            for index in members[first : first + size]:
                found[index] = replace(tasks[index], slice=number)
            number += 1
    return found


def _way(tasks: Sequence[Task]) -> str:
    """How many of the cases are solved together, for the first line of a sweep."""
    slices = {task.slice for task in tasks if task.slice is not None}
    count = sum(task.slice is not None for task in tasks)
    if not count:
        return ", each case alone" if tasks else ""
    alone = f", {len(tasks) - count} cases alone" if count < len(tasks) else ""
    return f", {count} cases together in {len(slices)} slices{alone}"


def progress(done: int, total: int, failed: int, seconds: float) -> str:
    """The progress line: how far, how many failed, time left from the mean so far."""
    left = seconds / done * (total - done)
    words = f"{done} of {total} cases" + (f", {failed} not converged" if failed else "")
    return f"{words}, about {duration(left)} left"


def duration(seconds: float) -> str:
    """E.g. "40 s", "5 min", "2.5 h"."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def _say_found(journal: Journal, wanted: set[str], reporter: Reporter) -> None:
    if journal.aside is not None:
        reporter.step(f"the finished cases here have another format: put aside as {journal.aside}, not used")
    strangers = len(journal.found) - len(wanted & set(journal.found))
    if journal.others:
        reporter.step(
            f"{journal.others} finished cases here were made by another version, or other sources, of ribbonbench: "
            "not used"
        )
    elif strangers:
        reporter.step(f"{strangers} finished cases here belong to another grid, solver or option: kept, not shown")
    if journal.damaged:
        reporter.step(f"{journal.damaged} damaged lines in the journal: their cases are made again")


def summary(finished: Finished) -> dict[str, Any]:
    """Numbers of a sweep: counts by status, times (s), the slowest case."""
    statuses: dict[str, int] = {}
    for case in finished.cases:
        statuses[case.status] = statuses.get(case.status, 0) + 1
    times = sorted(case.record["seconds"] for case in finished.cases if case.record["seconds"] is not None)
    new = sum(not case.reused for case in finished.cases)
    slowest = max(finished.cases, key=lambda case: case.record["seconds"] or 0.0)
    return {
        "cases": len(finished.cases),
        "ok": sum(case.ok for case in finished.cases),
        "new": new,
        "together": sum(bool(case.record.get("together")) for case in finished.cases),
        "statuses": statuses,
        "seconds": {
            "wall": finished.seconds,
            "sum": sum(times),
            "median": times[len(times) // 2] if times else None,
            "slowest": times[-1] if times else None,
        },
        "rate": new / finished.seconds if new and finished.seconds > 0.0 else None,
        "slowest": {"case": slowest.point.number, "values": dict(slowest.point.values)},
        "workers": finished.workers,
    }
