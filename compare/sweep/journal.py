"""The finished cases of a sweep: a file that only grows, one line per case, each with a checksum.

A cheap case takes 10 ms, a folder of its own with its fsyncs several: so cases are lines here. A line is written at
once and forced to the disk at most every second: a killed process loses nothing, a machine without power a second's
cases. A torn or altered line is not a case, and is made anew; the lines after it count.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import time
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

from compare.store.store import jsonable
from ribbonbench.errors import BadInput
from ribbonbench.system import NOT_FOR_CHILDREN

JOURNAL = "journal.jsonl"
FORMAT = 1
"""Of the journal; one of another format is put aside, not read."""

_KIND = "ribbonbench sweep"
_FORCED = 1.0  # s between two fsyncs
_DIGITS = 16  # hexadecimal digits of a line's checksum


def line_of(value: Mapping[str, Any], ready: bool = False) -> bytes:
    """A line with its checksum; ready: the value is of dicts, lists and Python's own values alone, but for numbers that
    are not finite."""
    try:
        text = _text(value if ready else jsonable(value))
    except ValueError:
        text = _text(jsonable(value))
    return f"{_sum(text)} {text}\n".encode("ascii")


def _text(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), ensure_ascii=True, allow_nan=False)


def _sum(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]


def value_in(line: bytes) -> Any:
    """What stands in a line (without its end); None for one that is torn or altered."""
    try:
        checksum, blank, text = line.decode("ascii").partition(" ")
        return json.loads(text) if blank and checksum == _sum(text) else None
    except ValueError:
        return None


def _appended(handle: int, size: int, data: bytes) -> int:
    """The size (bytes) of an open file of this size with `data` behind it; where that fails it stays as it was."""
    written = 0
    try:
        while written < len(data):
            written += os.pwrite(handle, data[written:], size + written)
    except BaseException:
        with contextlib.suppress(OSError):
            os.ftruncate(handle, size)
        raise
    return size + len(data)


class Growing:
    """A file to whose end whole lines are added, forced to the disk at most every second."""

    def __init__(self, path: Path) -> None:
        self._handle = os.open(path, os.O_RDWR | os.O_CREAT | NOT_FOR_CHILDREN, 0o666)
        self._size = os.fstat(self._handle).st_size
        self._forced = time.monotonic()
        if self._size and os.pread(self._handle, 1, self._size - 1) != b"\n":
            self.add(b"\n")  # the torn line of a process that was killed

    def add(self, data: bytes) -> None:
        """Adds to its end; on a full disk it stays as it was, and OSError passes."""
        self._size = _appended(self._handle, self._size, data)
        if time.monotonic() - self._forced > _FORCED:
            os.fsync(self._handle)
            self._forced = time.monotonic()

    def close(self) -> None:
        """Forces it to the disk and closes it."""
        try:
            os.fsync(self._handle)
        finally:
            os.close(self._handle)


class Journal:
    """Finished cases of a folder of results, by key; one process writes at a time (`compare.store.store.occupied`).

    found: key -> record; damaged: lines that are none; others: cases that another version, or other sources, of
    ribbonbench made (their keys are others); aside: the name that a journal of another format was given, or None.
    """

    def __init__(self, folder: Path, software: str, fresh: bool = False) -> None:
        self.path = folder / JOURNAL
        self.software = software
        self.found: dict[str, dict[str, Any]] = {}
        self.damaged = 0
        self.others = 0
        self.aside: str | None = None
        self._forced = time.monotonic()
        self._handle = -1
        raw = b"" if fresh else self._read()
        if fresh:
            with contextlib.suppress(FileNotFoundError):
                self.path.unlink()
        self._size = len(raw)
        self._torn = bool(raw) and not raw.endswith(b"\n")

    def __enter__(self) -> Journal:
        self._handle = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            if self._size == 0:
                self._append(line_of({"kind": _KIND, "format": FORMAT}))
            elif self._torn:
                self._append(b"\n")
        except BaseException:
            os.close(self._handle)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            os.fsync(self._handle)
        except OSError:
            if kind is None:
                raise
        finally:
            os.close(self._handle)

    def add(self, key: str, record: Mapping[str, Any]) -> None:
        """Keeps a finished case; on a full disk the journal stays as it was, and OSError passes."""
        self._append(line_of({"key": key, "software": self.software, "record": record}))
        if time.monotonic() - self._forced > _FORCED:
            os.fsync(self._handle)
            self._forced = time.monotonic()

    def _append(self, data: bytes) -> None:
        self._size = _appended(self._handle, self._size, data)

    def _read(self) -> bytes:
        """The bytes of the journal that is gone on with; fills `found`."""
        try:
            raw = self.path.read_bytes()
        except FileNotFoundError:
            return b""
        except (IsADirectoryError, NotADirectoryError):
            raise self._foreign() from None
        head, *lines = raw.split(b"\n")
        first = value_in(head)
        if not isinstance(first, dict) or first.get("kind") != _KIND:
            if not lines and line_of({"kind": _KIND, "format": FORMAT}).startswith(head):
                return b""  # killed while the first line was written
            known = [value for value in map(value_in, lines) if isinstance(value, dict) and "record" in value]
            if not known:
                raise self._foreign()
            self.damaged += 1  # the first line alone is damaged: its cases are its proof
        elif first.get("format") != FORMAT:
            self.aside = f"journal-format-{str(first.get('format'))[:8]}.jsonl"
            os.replace(self.path, self.path.with_name(self.aside))
            return b""
        for line in lines:
            value = value_in(line)
            if isinstance(value, dict) and isinstance(value.get("record"), dict) and isinstance(value.get("key"), str):
                self.found[value["key"]] = value["record"]
                self.others += value.get("software") != self.software
            elif line:
                self.damaged += 1
        return raw

    def _foreign(self) -> BadInput:
        return BadInput(
            "--out", self.path.parent.name, f"its {JOURNAL} is not the journal of a sweep",
            "give another folder or move that file away",
        )  # fmt: skip
