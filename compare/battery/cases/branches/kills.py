"""A diagram that is killed at any moment, and asked for again."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from compare.battery.case import Case, Check, Rung, holds
from compare.battery.cases.branches.scenes import CLAMPS, SHIFT
from compare.battery.processes import Ended, Started

#: What is compared to the byte.
_FILES = ("branches.json", "points.csv", "special.csv", "shapes.npz")
#: A command that is killed with -9 when so many answers are kept, half of the last one written.
_KILLED = """
import os, signal, sys
from compare.continuation import journal
count = int(sys.argv.pop(1))
keep, write = journal.Journal.keep, os.write
def kept(self, digest, answer):
    keep(self, digest, answer)
    if self.made == count:
        os.ftruncate(self._file.fileno(), self._file.tell() - 7)
        os.kill(os.getpid(), signal.SIGKILL)
journal.Journal.keep = kept
from compare.cli import main
sys.exit(main())
"""


def _killed(times: Rung) -> Iterator[Check]:
    """Killed after so many answers, again and again, until it comes to its end."""
    place = Path(tempfile.mkdtemp(prefix="ribbonbench-battery-"))
    words = ["branches", "scene.toml", "--along", SHIFT, "--from", "0", "--to", "0.55", "--branches", "3", "--quiet"]
    try:
        (place / "scene.toml").write_text(CLAMPS)
        whole = Started([*words, "--out", "whole"], place).end()
        yield holds("it ends well", whole.code == 0, whole.err)
        kills, last = _again([*words, "--out", "again"], place, int(times))
        yield holds(
            "it was killed at least twice, and ended well", kills > 1 and last.code == 0, f"{kills}: {last.err}"
        )
        for name in _FILES:
            same = (place / "whole" / name).read_bytes() == (place / "again" / name).read_bytes()
            yield holds(f"{name} is the same to the byte", same)
        left = [path.name for path in (place / "again").iterdir() if path.suffix == ".journal"]
        yield holds("nothing is left of the journal", not left, str(left))
    finally:
        shutil.rmtree(place, ignore_errors=True)


def _again(words: list[str], place: Path, times: int) -> tuple[int, Ended]:
    kills = 0
    while True:
        ended = Started([str(times), *words], place, module=("-c", _KILLED)).end()
        if ended.code != -9:
            return kills, ended
        kills += 1


CASES: tuple[Case, ...] = (
    Case(
        name="branches/killed",
        hard="killed with -9 after every so many equations that were solved, within a write",
        expected="the same command goes on, and its points, shapes and special points are the same to the byte",
        parameter="equations",
        run=_killed,
        rungs=(90,),
        long=(40, 17),
    ),
)
