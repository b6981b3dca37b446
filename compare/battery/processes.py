"""Commands as processes of their own, to be killed, starved and looked for afterwards."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

#: Environment variable that marks a command and all that it starts.
MARK = "RIBBONBENCH_BATTERY"
#: s until a process that has to end is called an orphan: never reached, however busy the machine.
PATIENCE = 600.0
_ROOT = Path(__file__).resolve().parents[2]
#: What may differ between two runs that give the same answer: times, and how far the first one came.
_APART = {"seconds", "provenance", "time", "iterations", "evaluations", "timing", "warm", "first", "reused", "new"}
_APART |= {"rate", "ratio", "resumed", "slowest", "workers"}
#: How a way was gone: a step that was killed is gone again, another one long.
_APART |= {"log"}


@dataclass(frozen=True)
class Ended:
    """How a command ended: its exit code (minus the signal that killed it), and what it said."""

    code: int
    out: str
    err: str

    @property
    def plain(self) -> bool:
        """Whether it ended as a command does: a known code, no trace, and one line at most where it failed."""
        if "Traceback" in self.err or self.code not in (0, 1, 2, 3, 130, 143):
            return False
        return self.code < 2 or len(said(self.err)) == 1


def said(text: str) -> list[str]:
    """The lines of a text, without notes."""
    return [line for line in text.splitlines() if line.strip() and not line.startswith("ribbonbench: note:")]


class Started:
    """A command `words` in the folder `place`, with all that it starts known by a mark.

    environment: what is set beside this process's own; before: called in the new process before the command.
    """

    def __init__(
        self,
        words: Sequence[str],
        place: Path,
        environment: Mapping[str, str] | None = None,
        before: Callable[[], None] | None = None,
        module: Sequence[str] = ("-m", "ribbonbench"),
    ) -> None:
        place.mkdir(parents=True, exist_ok=True)
        self.mark = uuid.uuid4().hex
        own = {**os.environ, "RIBBONBENCH_STORE": "cases", MARK: self.mark, **(environment or {})}
        own["PYTHONPATH"] = os.pathsep.join(p for p in (str(_ROOT), own.get("PYTHONPATH", "")) if p)
        self._out, self._err = place / f".{self.mark}.out", place / f".{self.mark}.err"
        with self._out.open("w") as out, self._err.open("w") as err:
            self.process = subprocess.Popen(
                [sys.executable, *module, *words],
                cwd=place, env=own, stdin=subprocess.DEVNULL, stdout=out, stderr=err, preexec_fn=before,
            )  # fmt: skip

    def signal(self, number: int) -> None:
        """Sends a signal to the command alone, not to what it started."""
        with contextlib.suppress(ProcessLookupError):
            self.process.send_signal(number)

    def end(self) -> Ended:
        """Waits for it; the files of its words are removed."""
        code = self.process.wait()
        found = Ended(code, self._out.read_text(errors="replace"), self._err.read_text(errors="replace"))
        self._out.unlink()
        self._err.unlink()
        return found

    def left(self) -> list[int]:
        """The processes of this mark that run."""
        return list(marked(self.mark))

    def orphans(self, patience: float = PATIENCE) -> tuple[int, float]:
        """How many processes of this mark stay, and the time in s until the last one was gone; those are killed."""
        began = time.monotonic()
        while self.left() and time.monotonic() - began < patience:
            time.sleep(0.01)
        stay = self.left()
        for pid in stay:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        return len(stay), time.monotonic() - began


def ran(words: Sequence[str], place: Path, **more: Any) -> Ended:
    """A command from its beginning to its end."""
    return Started(words, place, **more).end()


def marked(mark: str) -> Iterator[int]:
    """The running processes with this mark in their environment."""
    wanted = f"{MARK}={mark}".encode()
    for folder in Path("/proc").iterdir():
        if folder.name.isdecimal():
            with contextlib.suppress(OSError):
                if wanted in (folder / "environ").read_bytes().split(b"\0"):
                    state = (folder / "stat").read_text().rpartition(")")[2].split()[0]
                    if state not in "ZX":
                        yield int(folder.name)


def damaged(folder: Path) -> list[str]:
    """Files under `folder` that cannot be read to their end: JSON, archives of arrays, tables."""
    bad = []
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        try:
            if path.suffix == ".json":
                json.loads(path.read_text(encoding="utf-8"))
            elif path.suffix == ".npz":
                with np.load(path, allow_pickle=False) as stored:
                    for name in stored.files:
                        stored[name]
            elif path.suffix in (".csv", ".md", ".html"):
                text = path.read_text(encoding="utf-8")
                if not text.endswith("\n"):
                    raise ValueError("torn")
        except Exception:
            bad.append(path.relative_to(folder).as_posix())
    return bad


def leftovers(folder: Path) -> list[str]:
    """What a finished command has no business to leave: temporary files, locks, unfinished cases."""
    found = []
    for path in folder.rglob("*"):
        inside = path.relative_to(folder)
        if path.is_file() and (path.suffix == ".tmp" or {".partial", ".unfinished", ".busy"} & set(inside.parts)):
            found.append(inside.as_posix())
    return sorted(found)


def numbers(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """The plain values of a result with their places, without times and what tells how it was reached."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            if key not in _APART and not key.startswith("seconds"):
                yield from numbers(item, f"{path}.{key}")
    elif isinstance(value, list):
        for count, item in enumerate(value):
            yield from numbers(item, f"{path}[{count}]")
    else:
        yield path, value


def apart(first: Path, second: Path) -> tuple[float, str]:
    """The largest difference between two results (files of JSON), over the larger of 1 and the size of the numbers,
    and where it is; infinite where words or places differ."""
    one, other = (dict(numbers(json.loads(path.read_text(encoding="utf-8")))) for path in (first, second))
    worst, where = 0.0, ""
    for key in sorted(one.keys() | other.keys()):
        a, b = one.get(key), other.get(key)
        if isinstance(a, int | float) and isinstance(b, int | float):
            off = abs(a - b) / max(1.0, abs(a), abs(b))
        else:
            off = 0.0 if a == b else np.inf
        if off > worst:
            worst, where = float(off), f"{key.lstrip('.')}: {a} and {b}"
    return worst, where
