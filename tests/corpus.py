"""Frozen behaviour: what six commands print and write for every shipped scene, kept and compared number by number.

A change of the house must not change what users get. Freeze before it, freeze after it, compare:

    python -m tests.corpus freeze FOLDER [--scenes a,b] [--commands solve,limits]
    python -m tests.corpus compare BEFORE AFTER [--tolerance 1e-12]

A folder holds SCENE/COMMAND/ with the files that the command wrote, what it printed (`stdout`, `stderr`) and its exit
code, and `help/COMMAND`. A frozen command is not run again: an interrupted run goes on. Times, dates, versions, keys of
stored results and folders are left out of the comparison; numbers agree within the tolerance, relative to the larger
(absolute below 1e-9, where rounding's remainders live); pictures are not compared.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import multiprocessing
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from compare.scene.scene import shipped

#: Command -> what follows the scene.
COMMANDS: dict[str, tuple[str, ...]] = {
    "solve": (),
    "compare": ("--set", "shell.elements=[25, 2]", "--set", "shell.width_to_thickness=[50]"),
    "limits": ("--quick",),
    "explain": ("--no-run",),
    "export": ("--format", "csv,obj"),
    "sweep": ("--vary", "strip.width=linear(0.03,0.05,8)", "--workers", "1"),
}
#: The command whose numbers are times: its words alone are compared.
TIMED = "explain"
#: Seconds after which a command is ended and counted as such.
LIMIT = 900.0
TEXTS = {".json", ".csv", ".md", ".txt", ".obj", ".toml", ""}
#: Words of a JSON key or a column's head that hang on the clock, the machine or the stored results' keys.
UNSTEADY = re.compile(
    r"second|time|evaluation|^sentences$|\bms\b|_ms$|(^|_| )s$|date|version|digest|^key$|store|commit|memory|processor"
    r"|python|^ratio$"
)
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
CLOCK = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)? ?(?:ms|s|min|h|MB|GB)\b")


def _run(argv: list[str], out: Path) -> None:
    """One command in this process, its printed text and code as files."""
    from compare import cli

    code: Any = 0
    os.chdir(out)
    with (out / "stdout").open("w") as stdout, (out / "stderr").open("w") as stderr:
        os.dup2(stdout.fileno(), 1)
        os.dup2(stderr.fileno(), 2)
        with contextlib.redirect_stdout(stdout), contextlib.redirect_stderr(stderr):
            try:
                code = cli.main(argv)
            except SystemExit as stop:
                code = stop.code
    (out / "code").write_text(f"{code}\n")


def freeze(folder: Path, scenes: list[str], commands: list[str]) -> None:
    """Runs what is not in the folder yet, each command in a process of its own."""
    jobs = [(f"help/{command}", [command, "--help"]) for command in commands]
    for scene in scenes:
        jobs += [(f"{scene}/{command}", [command, scene, *COMMANDS[command]]) for command in commands]
    context = multiprocessing.get_context("fork")
    for number, (place, argv) in enumerate(jobs):
        target = folder / place
        if (target / "code").exists():
            continue
        print(f"corpus: {number + 1} of {len(jobs)}, {place}", file=sys.stderr, flush=True)
        shutil.rmtree(target, ignore_errors=True)
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent) as scratch:
            out = Path(scratch) / "run"
            out.mkdir()
            process = context.Process(target=_run, args=([*argv, "--out", "out"] if scene_of(place) else argv, out))
            process.start()
            process.join(LIMIT)
            if process.is_alive():
                process.terminate()
                process.join()
            if not (out / "code").exists():
                (out / "code").write_text(f"ended by {process.exitcode}\n")
            out.rename(target)


def scene_of(place: str) -> str | None:
    """The scene of a frozen command, None of a help page."""
    return None if place.startswith("help/") else place.split("/")[0]


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """(path, value) of what a JSON document holds, without what is unsteady."""
    if isinstance(value, dict):
        for key, part in value.items():
            if not UNSTEADY.search(str(key)):
                yield from leaves(part, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list):
        for index, part in enumerate(value):
            yield from leaves(part, f"{path}[{index}]")
    else:
        yield path, value


def apart(first: float, second: float) -> float:
    """Relative difference; 0 for two that are not numbers alike, or below rounding's remainders."""
    if first == second or (math.isnan(first) and math.isnan(second)):
        return 0.0
    if max(abs(first), abs(second)) < 1e-9:
        return 0.0
    return abs(first - second) / max(abs(first), abs(second))


def text_differences(before: str, after: str, tolerance: float) -> Iterator[str]:
    """Lines that differ by more than their numbers' tolerance and the clock."""
    first, second = before.splitlines(), after.splitlines()
    if len(first) != len(second):
        yield f"{len(first)} lines before, {len(second)} after"
    for one, two in zip(first, second, strict=False):
        one, two = CLOCK.sub("TIME", one), CLOCK.sub("TIME", two)
        if re.sub(r"\s+", " ", NUMBER.sub("N", one)) != re.sub(r"\s+", " ", NUMBER.sub("N", two)):
            yield f"{one.strip()[:150]!r} -> {two.strip()[:150]!r}"
            continue
        pairs = zip(NUMBER.findall(one), NUMBER.findall(two), strict=True)
        worst = max((apart(float(a), float(b)) for a, b in pairs), default=0.0)
        if worst > tolerance:
            yield f"by {worst:.1e}: {one.strip()[:150]!r} -> {two.strip()[:150]!r}"


def json_differences(before: Any, after: Any, tolerance: float) -> Iterator[str]:
    """Leaves of a document that went, came, or differ by more than the tolerance."""
    first, second = dict(leaves(before)), dict(leaves(after))
    for path in first.keys() - second.keys():
        yield f"{path}: gone"
    for path in second.keys() - first.keys():
        yield f"{path}: added"
    for path in first.keys() & second.keys():
        one, two = first[path], second[path]
        if isinstance(one, str) and isinstance(two, str):
            yield from (f"{path}: {line}" for line in text_differences(one, two, tolerance))
        elif (
            isinstance(one, bool)
            or isinstance(two, bool)
            or not isinstance(one, int | float)
            or not isinstance(two, int | float)
        ):
            if one != two:
                yield f"{path}: {one!r} -> {two!r}"
        elif apart(float(one), float(two)) > tolerance:
            yield f"{path}: {one!r} -> {two!r}, by {apart(float(one), float(two)):.1e}"


def steady_columns(text: str) -> str:
    """A CSV table without its unsteady columns."""
    rows = [line.split(",") for line in text.splitlines()]
    if not rows:
        return text
    kept = [index for index, head in enumerate(rows[0]) if not UNSTEADY.search(head)]
    return "\n".join(",".join(row[index] for index in kept if index < len(row)) for row in rows)


def file_differences(before: Path, after: Path, tolerance: float) -> Iterator[str]:
    """Differences of two files of one name."""
    first, second = before.read_text(errors="replace"), after.read_text(errors="replace")
    if before.suffix == ".json":
        yield from json_differences(json.loads(first), json.loads(second), tolerance)
    elif before.suffix == ".csv":
        yield from text_differences(steady_columns(first), steady_columns(second), tolerance)
    else:
        yield from text_differences(first, second, tolerance)


def texts(folder: Path) -> set[str]:
    """Files of a frozen folder that are compared."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)) for path in files if path.suffix in TEXTS and path.name != "stderr"}


def compare(before: Path, after: Path, tolerance: float) -> Iterator[str]:
    """Differences of two frozen folders; what only one of them ran is said once a place."""
    for place in sorted(_places(before) | _places(after)):
        if not (before / place / "code").exists() or not (after / place / "code").exists():
            yield f"{place}: frozen in one folder only"
            continue
        first, second = texts(before / place), texts(after / place)
        within = math.inf if place.endswith(TIMED) else tolerance
        yield from (f"{place}/{name}: gone" for name in sorted(first - second))
        yield from (f"{place}/{name}: added" for name in sorted(second - first))
        for name in sorted(first & second):
            for line in file_differences(before / place / name, after / place / name, within):
                yield f"{place}/{name}: {line}"


def _places(folder: Path) -> set[str]:
    return {str(path.parent.relative_to(folder)) for path in folder.rglob("code")}


def main(arguments: list[str] | None = None) -> int:
    """Exit code 0: frozen, or without a difference; 1: differences."""
    parser = argparse.ArgumentParser(prog="python -m tests.corpus", description=__doc__.splitlines()[0])
    acts = parser.add_subparsers(dest="act", required=True)
    freezing = acts.add_parser("freeze")
    freezing.add_argument("folder", type=Path)
    freezing.add_argument("--scenes", default=",".join(shipped()))
    freezing.add_argument("--commands", default=",".join(COMMANDS))
    comparing = acts.add_parser("compare")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    comparing.add_argument("--tolerance", type=float, default=1e-12)
    given = parser.parse_args(arguments)
    if given.act == "freeze":
        freeze(given.folder, given.scenes.split(","), given.commands.split(","))
        return 0
    count = 0
    for line in compare(given.before, given.after, given.tolerance):
        count += 1
        print(line)
    print(f"corpus: {count} differences in {len(_places(given.before) | _places(given.after))} commands")
    return int(count > 0)


if __name__ == "__main__":
    sys.exit(main())
