"""Pages that are older than the code: which they are, what moved, and what changed when they were made again."""

from __future__ import annotations

import datetime
import math
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

from tests.validation.record import Pages, Record

#: Exit codes of a measurement in a process of its own.
DONE, FAILED, ABSENT = 0, 1, 3
#: What a process prints before the reason why a measurement cannot be made here.
MISSING = "cannot be made here: "


@dataclass(frozen=True)
class Status:
    """How a page stands to the code. moved: modules (and files it reads) that changed, came or went since it was made;
    edited: files of its own that are no longer what was written."""

    name: str
    record: Record | None
    key: str
    moved: tuple[str, ...]
    edited: tuple[str, ...]

    @property
    def stale(self) -> bool:
        return self.record is None or self.record.key != self.key or bool(self.edited)

    @property
    def seconds(self) -> float:
        """What it took last; infinite where nobody knows."""
        return math.inf if self.record is None else self.record.seconds

    def why(self, most: int = 3) -> str:
        """Why it is stale, in words; "" where it is not."""
        if self.record is None:
            return "no data yet"
        parts = []
        if self.moved:
            more = f" and {len(self.moved) - most} more" if len(self.moved) > most else ""
            parts.append(f"{len(self.moved)} moved: " + ", ".join(self.moved[:most]) + more)
        if self.edited:
            parts.append("changed since: " + ", ".join(self.edited))
        return "; ".join(parts)


@dataclass
class Outcome:
    """What was done about a page: "12 s", "failed", "not here: why"; "" where nothing was."""

    done: str = ""
    failed: bool = field(default=False)


def status(pages: Pages, name: str) -> Status:
    """How the page of a measurement stands to the code of its tree."""
    record, modules = pages.read(name), pages.modules(name)
    if record is None:
        return Status(name, None, pages.key(name), (), ())
    differ = [one for one in sorted({*modules, *record.modules}) if modules.get(one) != record.modules.get(one)]
    first = pages.module(name)
    differ.sort(key=lambda one: (one != first, not one.startswith("tests."), one))
    edited = [
        file for file, digest in record.files.items()
        if not (pages.root / file).is_file() or pages.digest(pages.root / file) != digest
    ]  # fmt: skip
    return Status(name, record, pages.key(name), tuple(differ), tuple(edited))


def statuses(pages: Pages, names: Iterable[str]) -> list[Status]:
    """Those of all `names`, cheap ones first, the unknown last."""
    return sorted((status(pages, name) for name in names), key=lambda one: one.seconds)


def make(name: str) -> tuple[int, str]:
    """A measurement in a process of its own, its words passed on: (exit code, why it cannot be made here or "")."""
    command = [sys.executable, "-m", "tests.validation", name]
    environment, why = {**os.environ, "PYTHONUNBUFFERED": "1"}, ""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment, cwd=Pages().root) as process:
        assert process.stdout is not None
        for line in process.stdout:
            print(line, end="", flush=True)
            if MISSING in line:
                why = line.partition(MISSING)[2].strip()
    return process.returncode, why


def remake(
    names: Sequence[str],
    every: bool,
    make: Callable[[str], tuple[int, str]] = make,
    pages: Callable[[], Pages] = Pages,
    jobs: int = 1,
) -> dict[str, Outcome]:
    """Makes the stale pages again (all where `every`), cheap ones first; what failed does not stop the others. A page
    that reads others' files is made after all that read none, and once more when these have changed. What is done is
    kept page by page: after an interruption the same call goes on with the rest. With more `jobs` those that need not
    have the machine for themselves go first, so many at once, then the others one by one."""
    outcomes = {name: Outcome() for name in names}
    tried: dict[str, str] = {}

    def one(status: Status) -> None:
        tried[status.name] = status.key
        code, why = make(status.name)
        made = pages().read(status.name)
        if code == ABSENT:
            outcomes[status.name] = Outcome(f"not here: {why}")
        elif code != DONE or made is None:
            outcomes[status.name] = Outcome(f"failed (exit code {code})", failed=True)
        else:
            outcomes[status.name] = Outcome(f"{made.seconds:.0f} s")

    while True:
        now = pages()
        wanted = [
            each for each in statuses(now, names)
            if (each.stale or (every and each.name not in tried)) and tried.get(each.name) != each.key
        ]  # fmt: skip
        if not wanted:
            return outcomes
        # who reads others' files waits for them, unless nothing else is left to be made
        first = [each for each in wanted if not now.has(each.name, "READS")]
        wanted = first or wanted
        together = [each for each in wanted if jobs > 1 and not now.alone(each.name)]
        if together:
            with ThreadPoolExecutor(jobs) as pool:
                for done in [pool.submit(one, each) for each in together]:
                    done.result()
        for each in wanted:
            if each not in together:
                one(each)


def age(record: Record | None, now: datetime.datetime | None = None) -> str:
    """How long ago a page was made."""
    if record is None:
        return "no data"
    passed = (now or datetime.datetime.now(datetime.UTC)) - datetime.datetime.fromisoformat(record.time)
    days, hours, minutes = passed.days, passed.seconds // 3600, passed.seconds // 60 % 60
    return f"{days} d {hours} h" if days else f"{hours} h {minutes:02d} min"


def largest(record: Record | None) -> str:
    """The largest change of a page's numbers since it was made before, in units of the error stated then."""
    if record is None or not record.numbers:
        return "no numbers"
    if record.before is None or not record.before.numbers:
        return "first time"
    gone = [name for name in record.before.numbers if name not in record.numbers]
    changes = record.changes()
    parts = [f"{len(gone)} gone"] if gone else []
    if changes:
        name = max(changes, key=lambda one: changes[one])
        parts.insert(0, f"{changes[name]:.2g} ({name})")
    return ", ".join(parts) or "none has an error"


def findings(name: str, record: Record | None) -> list[str]:
    """What changed by more than its error, and what is gone: to be explained on the page."""
    if record is None or record.before is None:
        return []
    old = record.before.numbers
    found = [
        f"{name}.{one}: {old[one]} -> {record.numbers[one]} {record.numbers[one].unit}".rstrip()
        + f", {times:.2g} times its error {old[one].error:.1e}"
        for one, times in record.changes().items()
        if times > 1.0
    ]
    return found + [f"{name}.{one}: {old[one]} -> no longer measured" for one in old if one not in record.numbers]


def listing(found: Sequence[Status]) -> str:
    """The stale pages with their age, what they took last, and what moved; how many stand."""
    stale = [one for one in found if one.stale]
    rows = [
        [one.name, age(one.record), "?" if one.record is None else f"{one.seconds:.0f} s", one.why()] for one in stale
    ]
    lines = columns(["page", "age", "took", "why"], rows) if rows else []
    return "\n".join([*lines, f"{len(stale)} of {len(found)} pages are stale"])


def summary(pages: Pages, outcomes: dict[str, Outcome]) -> str:
    """The closing table: page, age, remade, largest change in units of its stated error; then the findings."""
    rows, said = [], []
    for name, outcome in outcomes.items():
        record = pages.read(name)
        rows.append([name, age(record), outcome.done, largest(record)])
        said += [f"finding: {line}" for line in findings(name, record)]
    return "\n".join([*columns(["page", "age", "remade", "largest change / error"], rows), *said])


def columns(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines with the cells of a column below each other."""
    widths = [max(len(row[k]) for row in (heads, *rows)) for k in range(len(heads))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in (heads, *rows)]  # fmt: skip
