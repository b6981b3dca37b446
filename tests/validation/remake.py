"""Stale pages made again: in which order, how many at once, and until when.

What is cheap goes first, and of what costs about the same the pages that README and docs/which_model take numbers from;
a page that reads files of others waits for these alone. A page that fails stops no other. Each is a process of its own
and keeps its record by itself, so that after an interruption the same call goes on with the rest.
"""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field

from tests.validation import readme
from tests.validation.record import Pages
from tests.validation.stale import ABSENT, DONE, MISSING, Status, statuses

#: Pages that take no longer than this (s) are of one tier: each tier is made whole before the next, what may share the
#: machine first, then what has it for itself.
TIERS = (20.0, 60.0, 180.0, 600.0, math.inf)
#: What measurements that keep no data yet take on a quiet core (s): from trials where they are odd numbers, the rest by
#: the sizes of their work. A record goes before it, so that every remake makes this list shorter.
EXPECTED: Mapping[str, float] = {
    "wunderlich_event": 7, "live": 60, "stability_notes": 9, "which_model": 10, "readme_picture": 20, "shell_curl": 23,
    "clamp_limit": 21, "twisted_tension": 27, "models_minima": 29, "shell_cantilever": 33, "shell_mesh": 33, "tape": 35,
    "placed": 40, "shell_corners": 43, "shell_lateral": 51, "batches": 60, "seeds": 67, "shooting": 60, "sweep": 60,
    "hp": 90, "shell_cost": 100, "shell_start": 100, "peers": 100, "claims": 120, "newton": 120, "strong_form": 120,
    "cost": 120, "shell_formulation": 120, "formulations": 150, "minimisers": 150, "converge": 150, "sze": 150,
    "gallery": 150, "shell_adaptive": 150, "tape_shell": 200, "lateral_torsional": 200, "models_4_3": 250,
    "shell_size": 250, "newton_glued": 300, "shell_shift": 300, "on_edge": 400, "limits": 400, "roman_states": 450,
    "million": 300, "lines": 200, "roman": 600, "battery": 900, "shift": 900, "cost_over_commits": 900,
    "hit_table": 1200, "shift_branches": 3600,
}  # fmt: skip
#: What goes on with what its last run left over, and takes its own budget however long that one took (s).
GOES_ON: Mapping[str, float] = {"unseen_again": 600.0, "rivals_again": 600.0}
#: The templates whose pages go first within their tier.
FRONT = ("README.md", "docs/which_model.md")
#: Seconds between asking a measurement to end and ending it.
GRACE = 10.0


@dataclass
class Outcome:
    """What was done about a page: "12 s", "failed", "not here: why", "no time left: 90 s"; "" where nothing was."""

    done: str = ""
    failed: bool = field(default=False)


def expected(status: Status) -> float:
    """What a page will take (s); infinite where nobody knows."""
    known = EXPECTED.get(status.name, math.inf) if status.record is None else status.seconds
    return GOES_ON.get(status.name, known)


def sources_of(pages: Pages, name: str, others: Sequence[str]) -> set[str]:
    """Which of `others` write the files that a page reads: by their records, else by the first word of the place."""
    found = set()
    for file in pages.reads(name):
        place = file.removeprefix("data/").partition("/")[0].partition(".")[0]
        for other in others:
            record = pages.read(other)
            if place == other or (record is not None and f"results/{file}" in record.files):
                found.add(other)
    return found - {name}


class Processes:
    """Measurements in processes of their own, their words passed on; none goes on beyond `until` (time.monotonic)."""

    def __init__(self, until: float = math.inf) -> None:
        self.until = until
        self._running: set[subprocess.Popen[str]] = set()
        self._guard = threading.Lock()
        self._over = False

    @property
    def left(self) -> float:
        """Seconds until nothing is begun any more."""
        return self.until - time.monotonic()

    def __call__(self, name: str) -> tuple[int, str]:
        """(exit code, why it cannot be made here or was stopped, or "")."""
        command = [sys.executable, "-m", "tests.validation", name]
        return self.run(command, {**os.environ, "PYTHONUNBUFFERED": "1"})

    def run(self, command: Sequence[str], environment: Mapping[str, str]) -> tuple[int, str]:
        """The same of any command."""
        why = ""
        with self._guard:
            if self._over:
                return -signal.SIGTERM, "interrupted"
            process = subprocess.Popen(
                command, stdout=subprocess.PIPE, text=True, env=environment, cwd=Pages().root, start_new_session=True
            )
            self._running.add(process)
        clock = None
        if math.isfinite(self.until):
            clock = threading.Timer(max(0.0, self.left), self._end, [process])
            clock.start()
        try:
            assert process.stdout is not None
            for line in process.stdout:
                print(line, end="", flush=True)
                if MISSING in line:
                    why = line.partition(MISSING)[2].strip()
            code = process.wait()
        finally:
            if clock is not None:
                clock.cancel()
            self._end(process)
            with self._guard:
                self._running.discard(process)
        return code, why or ("no time left" if code < 0 and self.left <= 0.0 else "")

    def stop(self) -> None:
        """Ends all that run; nothing begins after it."""
        with self._guard:
            self._over = True
            running = list(self._running)
        for process in running:
            self._end(process)

    @staticmethod
    def _end(process: subprocess.Popen[str]) -> None:
        """Ends a process with those that it started, where it still runs."""
        if process.poll() is not None:
            return
        for how in (signal.SIGTERM, signal.SIGKILL):
            try:
                os.killpg(process.pid, how)
                process.wait(GRACE)
            except subprocess.TimeoutExpired:
                continue
            except ProcessLookupError:
                pass
            return


def remake(
    names: Sequence[str],
    every: bool,
    make: Callable[[str], tuple[int, str]] | None = None,
    pages: Callable[[], Pages] = Pages,
    jobs: int = 1,
    outcomes: dict[str, Outcome] | None = None,
    left: Callable[[], float] = lambda: math.inf,
) -> dict[str, Outcome]:
    """Makes the stale pages again (all where `every`), in the order that the module's docstring says, and once more
    those whose sources changed meanwhile. With more `jobs` those of a tier that need not have the machine for
    themselves go first, so many at once, then the others one by one. outcomes: filled page by page, so that whoever
    interrupts knows what was done. left: the seconds that are left; a page that takes longer is not begun."""
    outcomes = {} if outcomes is None else outcomes
    outcomes.update({name: Outcome() for name in names})
    work = Processes() if make is None else make
    tried: dict[str, str] = {}

    def one(status: Status) -> None:
        tried[status.name] = status.key
        wanted, rest = expected(status), left()
        if rest <= 0.0 or rest < wanted < math.inf:
            text = "" if math.isinf(wanted) else f": {wanted:.0f} s"
            outcomes[status.name] = Outcome(f"no time left{text}")
            return
        code, why = work(status.name)
        made = pages().read(status.name)
        if code == ABSENT:
            outcomes[status.name] = Outcome(f"not here: {why}")
        elif code < 0 and why:
            outcomes[status.name] = Outcome(f"stopped: {why}")
        elif code != DONE or made is None:
            outcomes[status.name] = Outcome(f"failed (exit code {code})", failed=True)
        else:
            outcomes[status.name] = Outcome(f"{made.seconds:.0f} s")

    over = threading.Event()

    def unless_over(status: Status) -> None:
        if over.is_set():
            return
        try:
            one(status)
        except BaseException:
            over.set()
            raise

    def at_once(several: Sequence[Status]) -> None:
        pool = ThreadPoolExecutor(jobs)
        try:
            for done in as_completed([pool.submit(unless_over, each) for each in several]):
                done.result()
        except BaseException:
            over.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        pool.shutdown()

    front = {name for page in FRONT for name in _named(pages(), page)}
    try:
        while True:
            now = pages()
            wanted = [
                each for each in statuses(now, names)
                if (each.stale or (every and each.name not in tried)) and tried.get(each.name) != each.key
            ]  # fmt: skip
            if not wanted:
                return outcomes
            waiting = [each.name for each in wanted]
            ready = [each for each in wanted if not sources_of(now, each.name, waiting)] or wanted
            tier = min(_tier(each) for each in ready)
            batch = sorted(
                (each for each in ready if _tier(each) == tier),
                key=lambda each: (each.name not in front, expected(each)),
            )
            shared = [each for each in batch if jobs > 1 and not now.alone(each.name)]
            if shared:
                at_once(shared)
            for each in batch:
                if each not in shared:
                    one(each)
    except BaseException:
        if isinstance(work, Processes):
            work.stop()
        raise


def _tier(status: Status) -> int:
    return next(k for k, most in enumerate(TIERS) if expected(status) <= most)


def _named(pages: Pages, page: str) -> set[str]:
    """The measurements that a template takes numbers from; none where there is no template."""
    place = readme.template(pages.root / page)
    return set(readme.named(place.read_text())) if place.exists() else set()
