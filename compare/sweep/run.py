"""Running a sweep: what is finished is found again, the rest goes to the workers, each end is kept at once."""

from __future__ import annotations

import contextlib
import math
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from compare.models import RICHEST, USUAL, home, model, name_for, names
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.provenance import software
from compare.store.store import case_key
from compare.studies.axes import Point, at_point, points
from compare.sweep.case import COMPARE, PASSING, Record, Task, slice_key
from compare.sweep.file import Sweep
from compare.sweep.finished import Case, Finished
from compare.sweep.journal import FORMAT, Journal
from compare.sweep.large.aside import Aside
from compare.sweep.large.meanwhile import Meanwhile
from compare.sweep.large.pace import Pace
from compare.sweep.warm import Walk, mended
from compare.sweep.workers import Crew
from ribbonbench.errors import BadInput, Missing


def check(sweep: Sweep) -> list[Point]:
    """The points of a sweep; `BadInput` names the first one that its solver cannot take, before anything runs."""
    found = points(sweep.scene, sweep.axes)
    for point in found:
        try:
            check_point(sweep, point)
        except BadInput as error:
            raise at_point(error, point.number, point.values) from None
    return found


def check_point(sweep: Sweep, point: Point) -> None:
    """`BadInput` for a point that the solver of a sweep cannot take."""
    from compare.models.base import check_keys
    from compare.models.choice import beside_the_shell
    from compare.models.effects.price import check_price
    from compare.scene.inputs.plausible import check_meant

    scene = point.scene
    check_meant(scene)
    if sweep.shapes and sweep.solver == COMPARE:
        raise BadInput("--shapes", sweep.shapes, "are of one model, and a comparison has several", "choose a --solver")
    if sweep.leave_saddle and sweep.solver not in (USUAL, COMPARE):
        raise BadInput("--leave-saddle", None, f"is for the {USUAL}, and the solver is {sweep.solver}", "leave it out")
    requested = beside_the_shell(scene) if sweep.solver == COMPARE else model(sweep.solver)
    if "model.energy" in sweep.keys and sweep.solver != RICHEST:
        chosen = name_for(scene.model.energy)
        if chosen != requested.name:
            raise BadInput(
                "model.energy", scene.model.energy, f"is not the {requested.name}'s",
                f"leave it out, or choose solver {chosen}",
            )  # fmt: skip
    check_keys(requested, scene)
    if sweep.solver == COMPARE:
        check_keys(model(RICHEST), scene)
        check_price(scene)


def software_digest(solver: str, *more: str) -> str:
    """What stands for versions and sources in a case's key: of the solver, of what makes a record of its answer, and of
    `more` modules; a comparison may ask any model."""
    record = "compare.sweep.pair" if solver == COMPARE else "compare.sweep.case"
    requested = names() if solver == COMPARE else (solver,)
    return case_key(software(*sorted({record, *more, *map(home, requested)})))


def key_of(sweep: Sweep, point: Point, digest: str) -> str:
    """The key of a case: all that determines it."""
    return case_key("sweep", FORMAT, sweep.solver, sweep.options, point.scene.canonical(), digest)


def run(
    sweep: Sweep, grid: Sequence[Point], out: Path, crew: Crew, reporter: Reporter, fresh: bool = False,
    part: str = "", joined: Sequence[Path] = (), picture: Callable[[Finished], Aside] | None = None,
) -> Finished:  # fmt: skip
    """Runs what is not finished yet, then begins again what ended beside its neighbours (`compare.sweep.warm`). The
    folder must be held (`compare.store.store.occupied`).

    fresh: forget what is finished; part: the points are one of many parts of a grid, so that none has its neighbours
    beside it; joined: folders of parts, whose cases are taken and no others made; picture: begins one of what there is
    so far, every now and then. Raises OSError when the
    disk is full and `Missing` when every case lacks a library; all else that happens to a case is its status.
    """
    clock = time.perf_counter()
    digest = software_digest(sweep.solver)
    keys = [key_of(sweep, point, digest) for point in grid]
    journal = Journal(out, digest, fresh)
    work = _Work(sweep, journal, crew, reporter, os.path.abspath(out), closed=bool(joined))
    meanwhile = Meanwhile()

    def look(ends: Mapping[str, tuple[Record, bool]]) -> None:
        def begin() -> Aside:
            assert picture is not None
            known = (Case(point, key, *ends[key]) for key, point in zip(keys, grid, strict=True) if key in ends)
            return picture(Finished(sweep, tuple(known), 0.0, work.workers, part="so far"))

        if picture is not None:
            meanwhile.look(begin)

    with journal:
        for folder in joined:
            _take_over(journal, folder, set(keys), reporter)
        try:
            ends = work.done(keys, [point.scene for point in grid], look=look)
        finally:
            meanwhile.end()
        cases = tuple(Case(point, key, *end) for key, point, end in zip(keys, grid, ends, strict=True))
        missing = [case for case in cases if case.status == "missing"]
        if missing and len(missing) == len(cases):
            raise Missing.of(str(missing[0].record["message"]))

        def walk(walks: Sequence[Walk]) -> list[tuple[Record, bool]]:
            scenes = [walk.scene for walk in walks]
            return work.done([key_of(sweep, Point(0, {}, scene), digest) for scene in scenes], scenes, "again")

        found = Finished(sweep, cases, 0.0, work.workers, part=part)
        if not part:
            work.closed = False
            found = mended(found, walk)
    return replace(found, seconds=time.perf_counter() - clock, workers=work.workers)


@dataclass
class _Work:
    """What solves the cases of a sweep: those of the journal are found, the others go to the crew and into it; workers:
    how many had something to do; closed: what is not found is not made."""

    sweep: Sweep
    journal: Journal
    crew: Crew
    reporter: Reporter
    folder: str
    workers: int = 0
    closed: bool = False

    def done(
        self, keys: Sequence[str], scenes: Sequence[Scene], again: str = "",
        look: Callable[[Mapping[str, tuple[Record, bool]]], None] = lambda ends: None,
    ) -> list[tuple[Record, bool]]:  # fmt: skip
        """The record of each scene, and whether it was found; again: they are begun at a neighbour's state; look: is
        shown what there is after every case."""
        sweep, found = self.sweep, self.journal.found
        if not again:
            _say_found(self.journal, set(keys), self.reporter)
        ends: dict[str, tuple[Record, bool]] = {key: (found[key], True) for key in keys if key in found}
        if self.closed:
            ends |= {key: (_ABSENT, True) for key in keys if key not in found}
        tasks = [
            Task(key, scene, sweep.solver, sweep.errors, sweep.leave_saddle, self.folder, shapes=sweep.shapes)
            for key, scene in zip(keys, scenes, strict=True)
            if key not in ends
        ]
        kept = f", {len(keys) - len(tasks)} of them finished before" if len(tasks) < len(keys) else ""
        tasks = sliced(tasks, self.crew.size)
        workers = min(self.crew.size, len(tasks))
        self.workers = max(self.workers, workers)
        at_once = f", {workers} at once" if workers else ""
        what = f"cases {again} at a neighbour's state" if again else f"cases, solver {sweep.solver}"
        self.reporter.step(f"sweep: {len(keys)} {what}{kept}{at_once}{_way(tasks)}")
        failed, pace = 0, Pace(self.reporter)
        self.crew.compiles = pace.compiles
        with contextlib.closing(self.crew.run(tasks)) as results:  # type: ignore[type-var]
            for done, (index, record) in enumerate(results, start=1):
                if "disk_full" in record:
                    raise OSError(record["disk_full"], os.strerror(record["disk_full"]))
                key = tasks[index].key
                if record["status"] not in PASSING:
                    self.journal.add(key, record)
                failed += record["status"] != "converged"
                ends[key] = (record, False)
                pace.ended(done, len(tasks), failed)
                look(ends)
        return [ends[key] for key in keys]


#: The end of a case that is in none of the folders that are joined.
_ABSENT: Record = {
    "status": "absent", "message": "in none of the joined folders", "rows": [], "seconds": None, "time": None,
}  # fmt: skip


def _take_over(journal: Journal, folder: Path, wanted: set[str], reporter: Reporter) -> None:
    """The finished cases of a part of the sweep into the journal of the whole."""
    theirs = Journal(folder, journal.software)
    if theirs.damaged:
        reporter.step(f"{folder.name}: {theirs.damaged} damaged lines in its journal, the rest is read")
    for key, record in theirs.found.items():
        if key in wanted and key not in journal.found:
            journal.add(key, record)
            journal.found[key] = record


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
        "walks": finished.walks,
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
