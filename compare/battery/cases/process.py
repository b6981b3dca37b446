"""Killed, interrupted, without room, with damaged or foreign files."""

from __future__ import annotations

import os
import random
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from compare.battery.case import Case, Check, Rung, holds
from compare.battery.processes import Started, apart, damaged, leftovers, ran, said
from compare.store.store import MANIFEST, CaseStore, case_key

#: A strip that every command takes: a path of three steps for the ribbon, two coarse shells.
SCENE = """
title = "A path"
[strip]
length = 1.0
width = 0.03
thickness = 1e-3
poisson = 0.4
gamma = 10.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[model]
elements = 6
[shell]
width_to_thickness = [10, 20]
elements = [16, 1]
[[path]]
"strip.gamma" = 2.0
[[path]]
"strip.gamma" = 6.0
"""

#: Command -> its words; results go into the folder `o`.
WORDS = {
    "solve": ("solve", "scene.toml", "--quiet", "--out", "o"),
    "compare": ("compare", "scene.toml", "--quiet", "--out", "o"),
    "limits": ("limits", "scene.toml", "--quiet", "--out", "o"),
    "sweep": (
        "sweep", "scene.toml", "--set", "path=[]", "--vary", "strip.gamma=1:8:8", "--workers", "2", "--quiet",
        "--out", "o",
    ),
    "sweep of shells": (
        "sweep", "scene.toml", "--set", "path=[]", "--vary", "strip.gamma=1:4:4", "--workers", "2", "--quiet",
        "--solver", "shell", "--out", "o",
    ),
    "report": ("report", "o", "--quiet"),
    "branches": (
        "branches", "scene.toml", "--set", "path=[]", "--along", "strip.gamma", "--from", "1", "--to", "8", "--model",
        "wunderlich,sadowsky", "--no-errors", "--quiet", "--out", "o",
    ),
    "branches over two": (
        "branches", "scene.toml", "--set", "path=[]", "--along", "strip.gamma", "--from", "1", "--to", "8", "--over",
        "strip.width=0.02,0.03", "--no-errors", "--quiet", "--out", "o",
    ),
}  # fmt: skip
#: Two answers of one command are the same within this (a path that goes on begins at a state that is rounded nowhere).
SAME = 1e-9
#: s of the processor that a command may go on after SIGTERM, with all that it started.
SOON = 3.0


class _Room:
    """A folder for one rung, with the scene in it; removed afterwards."""

    def __enter__(self) -> Path:
        self.place = Path(tempfile.mkdtemp(prefix="ribbonbench-battery-"))
        (self.place / "scene.toml").write_text(SCENE)
        return self.place

    def __exit__(self, *_: object) -> None:
        shutil.rmtree(self.place, ignore_errors=True)


def _room(place: Path) -> Path:
    place.mkdir()
    (place / "scene.toml").write_text(SCENE)
    return place


def _before(command: str, place: Path) -> None:
    """What a command needs to be there."""
    if command == "report":
        ran(WORDS["solve"], place)


def _split(rung: Rung) -> tuple[str, int]:
    """("solve", 20) of "solve, 20 times"."""
    command, _, times = str(rung).partition(", ")
    return command, int(times.split()[0])


def killed(rung: Rung) -> Iterator[Check]:
    """SIGKILL at random moments, then the same command to its end."""
    yield from _interrupted(rung, signal.SIGKILL)


def interrupted(rung: Rung) -> Iterator[Check]:
    """SIGTERM and ctrl-C in turn."""
    yield from _interrupted(rung, signal.SIGTERM)


def _interrupted(rung: Rung, number: int) -> Iterator[Check]:
    command, times = _split(rung)
    words, moments = WORDS[command], random.Random(f"{command} {number}")
    with _Room() as place:
        whole, cut = _room(place / "whole"), _room(place / "cut")
        for folder in (whole, cut):
            _before(command, folder)
        began = time.monotonic()
        answer = ran(words, whole)
        span = time.monotonic() - began
        yield holds("the command itself ends well", answer.plain and answer.code < 2, f"{answer.code}: {answer.err}")
        orphans, longest, hit, faults, wrong = 0, 0.0, 0, [], []
        for _ in range(times):
            started = Started(words, cut)
            time.sleep(moments.uniform(0.0, span))
            sent = number if number == signal.SIGKILL or moments.random() < 0.5 else signal.SIGINT
            started.signal(sent)
            ended = started.end()
            stay, after = started.orphans()
            orphans, longest = orphans + stay, max(longest, after)
            faults += damaged(cut)
            if ended.code in (-sent, 128 + sent):
                hit += 1
                # before and after the command Python itself dies of a signal: silently, the same code to a shell
                if number != signal.SIGKILL and len(said(ended.err)) != (0 if ended.code < 0 else 1):
                    wrong.append(f"{ended.code}: {ended.err}")
            elif ended != answer:
                wrong.append(f"{ended.code}: {ended.err}")
            if ended.code == answer.code and command != "report":
                shutil.rmtree(cut)  # it was over before: another one
                _room(cut)
        yield holds("no orphan", orphans == 0, f"{orphans} of {times}")
        yield Check("until all its processes are gone (s)", longest, SOON, timed=True, said=f"{hit} of {times} in time")
        yield holds("no damaged file", not faults, ", ".join(faults))
        yield holds("nothing but one line", not wrong, "; ".join(wrong[:3]))
        last = ran(words, cut)
        yield holds("it goes on", last.code == answer.code and last.plain, f"{last.code}: {last.err}")
        off, where = apart(whole / "o" / "result.json", cut / "o" / "result.json")
        yield Check("the same answer (relative)", off, SAME, said=where)
        left = [name for name in leftovers(cut) if name not in leftovers(whole)]
        yield holds("no lock, nothing half done left", not left, ", ".join(left))


def full(rung: Rung) -> Iterator[Check]:
    """A disk that takes no file beyond so many bytes."""
    size = int(rung)
    for command in ("solve", "sweep"):
        with _Room() as place:
            whole, cut = _room(place / "whole"), _room(place / "cut")
            first = ran(WORDS[command], cut, before=_limit("RLIMIT_FSIZE", size))
            yield holds(f"{command}: one line", first.code == 3 and first.plain, f"{first.code}: {first.err}")
            yield holds(f"{command}: no damaged file", not damaged(cut), ", ".join(damaged(cut)))
            answer, last = ran(WORDS[command], whole), ran(WORDS[command], cut)
            yield holds(f"{command}: it goes on", last.code == answer.code and last.plain, f"{last.code}: {last.err}")
            off, where = apart(whole / "o" / "result.json", cut / "o" / "result.json")
            yield Check(f"{command}: the same answer (relative)", off, SAME, said=where)


def starved(rung: Rung) -> Iterator[Check]:
    """Address space of so many MB."""
    size = int(rung) * 1_000_000
    with _Room() as place:
        ended = ran(WORDS["solve"], place, before=_limit("RLIMIT_AS", size))
        yield holds("an answer, or one line", ended.plain, f"{ended.code}: {ended.err[-2000:]}")
        yield holds("no damaged file", not damaged(place), ", ".join(damaged(place)))


def _limit(what: str, value: int) -> Callable[[], None]:
    def before() -> None:
        import resource  # POSIX: these cases have no other way to take something away from a process

        resource.setrlimit(getattr(resource, what), (value, value))

    return before


def two_writers(rung: Rung) -> Iterator[Check]:
    """The same command so many times at once, into one folder with one store."""
    with _Room() as place:
        whole, shared = _room(place / "whole"), _room(place / "shared")
        answer = ran(WORDS["solve"], whole)
        crowd = [Started(WORDS["solve"], shared) for _ in range(int(rung))]
        ends = [started.end() for started in crowd]
        wrong = [f"{e.code}: {e.err}" for e in ends if e.code != answer.code or not e.plain]
        yield holds("all end well", not wrong, "; ".join(wrong))
        yield holds("no damaged file", not damaged(shared), ", ".join(damaged(shared)))
        off, where = apart(whole / "o" / "result.json", shared / "o" / "result.json")
        yield Check("the same answer (relative)", off, SAME, said=where)
        left = [name for name in leftovers(shared) if name not in leftovers(whole)]
        yield holds("no lock left", not left, ", ".join(left))


#: Ways of damaging a finished case.
DAMAGE = (
    "truncated", "empty", "one bit flipped", "removed", "a folder instead", "a file of another case", "another case",
    "manifest truncated", "manifest flipped",
)  # fmt: skip


def _damage(way: str, case: Path, other: Path) -> None:
    """Damages a finished case; `other`: the folder of another one."""
    file = case / (MANIFEST if way.startswith("manifest") else "numbers.bin")
    if way.endswith("truncated"):
        os.truncate(file, file.stat().st_size // 2)
    elif way.endswith("flipped"):
        data = bytearray(file.read_bytes())
        data[len(data) // 2] ^= 0x10
        file.write_bytes(data)
    elif way == "empty":
        os.truncate(file, 0)
    elif way == "a file of another case":
        shutil.copy(other / file.name, file)
    elif way == "another case":
        shutil.rmtree(case)
        shutil.copytree(other, case)
    else:
        file.unlink()
        if way == "a folder instead":
            file.mkdir()


def damaged_case(rung: Rung) -> Iterator[Check]:
    """A finished case in the store that is no longer what was written."""
    with _Room() as place:
        store, written = CaseStore(place / "cases"), [0]
        lines: list[str] = []
        keys = [case_key("battery", number) for number in range(2)]

        def write(folder: Path, number: int) -> None:
            written[0] += 1
            (folder / "numbers.bin").write_bytes(random.Random(number).randbytes(1000))

        def found(number: int) -> Path:
            key = keys[number]
            return store.get(key, damaged=lines.append) or store.put(key, lambda folder: write(folder, number))

        folders = [found(number) for number in range(2)]
        found(0)
        yield holds("a whole case is found", written[0] == 2 and not lines, f"{written[0]} written, {lines}")
        _damage(str(rung), *folders)
        again = found(0)
        yield holds("it is made again", written[0] == 3, f"{written[0]} written")
        yield holds("it is said", len(lines) == 1, str(lines))
        intact = (again / "numbers.bin").read_bytes() == random.Random(0).randbytes(1000)
        yield holds("it is right again", intact and store.get(keys[0]) == again)
        yield holds("nothing half done left", not leftovers(place), ", ".join(leftovers(place)))


#: A command whose wall clock goes back by an hour whenever it is asked, or forth by a month.
CLOCK = """
import sys, time
jump, sys.argv = float(sys.argv[1]), ["ribbonbench", *sys.argv[2:]]
true, asked = time.time, [0]
def jumping():
    asked[0] += 1
    return true() + jump * asked[0]
time.time = jumping
import ribbonbench
sys.exit(ribbonbench.main())
"""


def clock(rung: Rung) -> Iterator[Check]:
    """A wall clock that jumps."""
    import json

    jump = {"back": -3600.0, "forth": 30 * 86400.0}[str(rung)]
    with _Room() as place:
        whole, odd = _room(place / "whole"), _room(place / "odd")
        answer = ran(WORDS["solve"], whole)
        ended = ran((str(jump), *WORDS["solve"]), odd, module=("-c", CLOCK))
        yield holds("it ends well", ended.code == answer.code and ended.plain, f"{ended.code}: {ended.err}")
        off, where = apart(whole / "o" / "result.json", odd / "o" / "result.json")
        yield Check("the same answer (relative)", off, SAME, said=where)
        seconds = json.loads((odd / "o" / "result.json").read_text())["seconds"]
        times = [value for value in seconds.values() if value is not None]
        yield holds("no time is negative, or an hour", all(0.0 <= value < 3000.0 for value in times), str(seconds))
        left = [name for name in leftovers(odd) if name not in leftovers(whole)]
        yield holds("no lock left", not left, ", ".join(left))


#: What may be wrong with a cache of kernels.
CACHES = ("missing", "others may write it", "the group may write it", "a file", "of another user")


def _cache(fault: str, cache: Path) -> None:
    """Makes a folder of kernels with a fault."""
    if fault == "a file":
        cache.parent.mkdir(parents=True)
        cache.write_text("no folder")
    elif fault != "missing":
        cache.mkdir(parents=True)
        if fault == "of another user":
            os.chown(cache, 12345, 12345)
        else:
            cache.chmod(0o777 if fault == "others may write it" else 0o770)


def kernels(rung: Rung) -> Iterator[Check]:
    """A cache of compiled code that is not to be trusted."""
    from ribbon.element import kernel_cache
    from ribbonbench.errors import Missing

    if rung == "of another user" and os.geteuid() != 0:
        raise Missing("root, who may give files away", "")
    with _Room() as place:
        cache = place / "cache" / "kernels"
        _cache(str(rung), cache)
        home = kernel_cache.root().parent.parent
        chosen = {"RIBBONBENCH_CACHE": str(cache.parent), "NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": str(home)}
        code = "from ribbon.element import kernel_cache; print(kernel_cache.root())"
        ended = ran((), place, environment=chosen, module=("-c", code))
        trusted = rung == "missing"
        right = Path(ended.out.strip()) == (cache if trusted else home / "ribbonbench" / "kernels")
        yield holds("where kernels are taken from", ended.code == 0 and right, ended.out + ended.err)
        lines = ended.err.splitlines()
        yield holds("one line says so", len(lines) == (0 if trusted else 1), ended.err)


def at_once(rung: Rung) -> Iterator[Check]:
    """So many first solves at once, into one empty cache of kernels."""
    with _Room() as place:
        whole = _room(place / "whole")
        answer = ran(WORDS["solve"], whole)
        own = {"RIBBONBENCH_CACHE": str(place / "cache"), "NUMBA_CACHE_DIR": ""}
        rooms = [_room(place / f"room{number}") for number in range(int(rung))]
        crowd = [Started(WORDS["solve"], room, environment=own) for room in rooms]
        ends = [started.end() for started in crowd]
        wrong = [f"{e.code}: {e.err}" for e in ends if e.code != answer.code or not e.plain]
        yield holds("all end well", not wrong, "; ".join(wrong))
        for room in [*rooms, _room(place / "after")]:
            if room.name == "after":
                ran(WORDS["solve"], room, environment=own)
            off, where = apart(whole / "o" / "result.json", room / "o" / "result.json")
            yield Check(f"{room.name}: the same answer (relative)", off, SAME, said=where)


CASES: tuple[Case, ...] = (
    Case(
        "process/killed",
        "SIGKILL at random moments, imports and writing included, so often",
        "the same command goes on and gives the same answer: files are whole or not there, locks and whoever works for "
        "a command end with it",
        "command",
        killed,
        ("solve, 2 times",),
        (
            "solve, 20 times",
            "compare, 20 times",
            "limits, 20 times",
            "sweep, 20 times",
            "report, 20 times",
            "branches, 10 times",
            "branches over two, 10 times",
        ),
    ),
    Case(
        "process/interrupted",
        "SIGTERM or ctrl-C at random moments",
        "exit code 143 or 130, one line, all processes gone at once, nothing lost",
        "command",
        interrupted,
        (),
        ("solve, 20 times", "compare, 10 times", "sweep, 10 times", "sweep of shells, 10 times", "report, 10 times"),
    ),
    Case(
        "process/disk-full",
        "no file may grow beyond so many bytes",
        "exit code 3 with one line; what was finished is kept, and the same command goes on",
        "bytes",
        full,
        (),
        (20000, 2000, 200),
    ),
    Case(
        "process/memory",
        "little address space",
        "an answer, or one line that says what is missing",
        "MB",
        starved,
        (),
        (4000, 2000, 1500, 1000, 800, 600, 500, 400, 300, 200),
    ),
    Case(
        "process/writers",
        "several commands at once into one folder with one store",
        "one writes after the other, and both give the answer",
        "commands",
        two_writers,
        (),
        (2, 4),
    ),
    Case(
        "process/damaged-case",
        "a finished case in the store was altered",
        "it is seen by the digests of its manifest, said, and made again",
        "damage",
        damaged_case,
        DAMAGE,
    ),
    Case(
        "process/clock",
        "the wall clock jumps by an hour or a month whenever it is asked",
        "times are taken from a clock that does not jump, and locks are no times",
        "jump",
        clock,
        (),
        ("back", "forth"),
    ),
    Case(
        "process/kernels",
        "the cache of compiled code is another user's, or others may write it: code that is run as us",
        "it is not used, in one line, and another one is",
        "cache",
        kernels,
        ("others may write it",),
        tuple(name for name in CACHES if name != "others may write it"),
    ),
    Case(
        "process/first-at-once",
        "so many processes compile the same kernels into an empty cache",
        "each gives the answer, and so does the next, which loads what they kept",
        "processes",
        at_once,
        (),
        (4,),
    ),
)
