"""Pages that are older than the code: which they are, what moved, and what changed when they were made again."""

from __future__ import annotations

import datetime
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from tests.validation.record import Pages, Record

#: Exit codes of a measurement in a process of its own.
DONE, FAILED, ABSENT = 0, 1, 3
#: What a process prints before the reason why a measurement cannot be made here.
MISSING = "cannot be made here: "


@dataclass(frozen=True)
class Status:
    """How a page stands to the code. moved: modules (and files it reads) that changed, came or went since it was made;
    edited: files of its own that are no longer what was written. key: digest of all that it may depend on; current: of
    what its record counts."""

    name: str
    record: Record | None
    key: str
    current: str
    moved: tuple[str, ...]
    edited: tuple[str, ...]

    @property
    def stale(self) -> bool:
        return self.record is None or self.record.key != self.current or bool(self.edited)

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


def status(pages: Pages, name: str) -> Status:
    """How the page of a measurement stands to the code of its tree."""
    record, key = pages.read(name), pages.key(name)
    if record is None:
        return Status(name, None, key, key, (), ())
    only = None if record.wide else record.modules
    modules = pages.modules(name, only)
    differ = [one for one in sorted({*modules, *record.modules}) if modules.get(one) != record.modules.get(one)]
    first = pages.module(name)
    differ.sort(key=lambda one: (one != first, not one.startswith("tests."), one))
    edited = [
        file for file, digest in record.files.items()
        if not (pages.root / file).is_file() or pages.digest(pages.root / file) != digest
    ]  # fmt: skip
    return Status(name, record, key, pages.key(name, only), tuple(differ), tuple(edited))


def statuses(pages: Pages, names: Iterable[str]) -> list[Status]:
    """Those of all `names`, cheap ones first, the unknown last."""
    return sorted((status(pages, name) for name in names), key=lambda one: one.seconds)


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


def listing(found: Sequence[Status], expected: Callable[[Status], float]) -> str:
    """The stale pages with their age, what they will take by `expected` (s), and what moved; how many stand."""
    stale = [one for one in found if one.stale]
    rows = [
        [one.name, age(one.record), "?" if math.isinf(expected(one)) else f"{expected(one):.0f} s", one.why()]
        for one in stale
    ]
    lines = columns(["page", "age", "takes", "why"], rows) if rows else []
    total = sum(expected(one) for one in stale if math.isfinite(expected(one)))
    text = f"{len(stale)} of {len(found)} pages are stale; those whose time is known take {total:.0f} s"
    return "\n".join([*lines, text])


def rules(pages: Pages, names: Iterable[str]) -> str:
    """How many modules and files each page counts of those that it may depend on, and by which rule."""
    rows = []
    for name in names:
        record, most = pages.read(name), len(pages.modules(name))
        if record is not None:
            rule = f"all: {record.wide}" if record.wide else "what it had loaded"
            rows.append([name, str(len(record.modules)), str(most), rule])
    return "\n".join(columns(["page", "counted", "of", "rule"], rows))


def summary(pages: Pages, done: Mapping[str, str]) -> str:
    """The closing table: page, age, remade (`done`: page -> in words), largest change in units of its stated error;
    then the findings."""
    rows, said = [], []
    for name, words in done.items():
        record = pages.read(name)
        rows.append([name, age(record), words, largest(record)])
        said += [f"finding: {line}" for line in findings(name, record)]
    return "\n".join([*columns(["page", "age", "remade", "largest change / error"], rows), *said])


def columns(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines with the cells of a column below each other."""
    widths = [max(len(row[k]) for row in (heads, *rows)) for k in range(len(heads))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in (heads, *rows)]  # fmt: skip
