"""Scenes as people write them, through the commands: what the terminal and the files say, judged by other code."""

from __future__ import annotations

import contextlib
import io
import json
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from compare.battery import motions
from compare.battery.case import Case, Check, Rung, holds
from compare.battery.judge.seen import as_seen
from compare.battery.own_scenes import own
from compare.measure.grades import GOOD
from compare.scene import Scene

#: Scenes of a rung, and rungs: 300 scenes in all.
EACH, RUNGS = 10, 30
#: The commonest few through shells: a scene takes seconds.
WITH_SHELL = 4


def said(words: list[str]) -> tuple[int, str]:
    """Exit code and first line of a command, in this process."""
    from compare.cli import main

    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        code = main(words)
    lines = out.getvalue().splitlines()
    blank = lines.index("") if "" in lines else len(lines)
    return code, " ".join(lines[: max(1, blank)])


def answered(command: list[str], text: str, folder: Path) -> tuple[int, str, dict[str, Any]]:
    """What a command says of a scene's text: code, first line, result.json."""
    scene = folder / "own.toml"
    scene.write_text(text, encoding="utf-8")
    out = folder / "out"
    code, first = said([command[0], str(scene), *command[1:], "--out", str(out), "--quiet"])
    file = out / "result.json"
    return code, first, json.loads(file.read_text()) if file.is_file() else {}


def _numbers(rung: Rung, each: int = EACH) -> range:
    return range(int(rung) * each, int(rung) * each + each)


def of_numbers(check: Callable[[int, Path], Iterator[Check]], each: int = EACH) -> Callable[[Rung], Iterator[Check]]:
    """What checks the scenes of a rung, each in a folder of its own; of checks alike the worst."""

    def run(rung: Rung) -> Iterator[Check]:
        worst: dict[str, Check] = {}
        for number in _numbers(rung, each):
            with tempfile.TemporaryDirectory(prefix="ribbonbench-own-") as folder:
                for found in check(number, Path(folder)):
                    named = Check(found.what, found.value, found.bound, said=f"own {number}: {found.said}")
                    known = worst.get(found.what)
                    if known is None or (not named.ok, named.strain) > (not known.ok, known.strain):
                        worst[found.what] = named
        yield from worst.values()

    return run


def _solved(number: int, folder: Path) -> Iterator[Check]:
    text, scene = own(number)
    code, first, result = answered(["solve"], text, folder)
    yield holds("solve ends with an answer", code in (0, 1) and bool(result), f"code {code}")
    if result:
        yield from as_seen(folder / "out", scene, result_line(folder / "out", first))
        yield holds("exit code 0 is a stable state", (code == 0) == (result["status"] == "converged"), result["status"])


def result_line(folder: Path, first: str) -> str:
    """The first sentence of the terminal, folded at its width, unfolded: as many words as the answer has."""
    answer = json.loads((folder / "result.json").read_text())["answer"]
    line = f"{answer['text']}." if answer["grade"] == "unknown" else f"{answer['text']}: {answer['grade']}."
    return " ".join(first.split()[: len(line.split())])


def _quick(number: int, folder: Path) -> Iterator[Check]:
    text, scene = own(number)
    if scene.closure is not None:
        return
    code, first, result = answered(["limits", "--quick"], text, folder)
    yield holds("limits --quick ends with an answer", code in (0, 1) and bool(result), f"code {code}: {first}")
    if not result:
        return
    (row,) = result["rows"]
    share, distance = row["estimate"]["share"], row["estimate"]["distance"]
    yield holds("an estimated share is a share", share is None or 0.0 <= share <= 1.0, f"{share}")
    yield holds("an estimate is a number or none", distance is None or distance >= 0.0, f"{distance}")
    unnamed = "nan" in first.lower() or "inf " in first.lower()
    yield holds("nothing unnamed in the first line", not unnamed, first)


def _swept(number: int, folder: Path) -> Iterator[Check]:
    text, scene = own(number)
    thick = scene.strip.thickness
    assert thick is not None
    vary = f"strip.thickness={thick!r}:{1.5 * thick!r}:3"
    code, first, result = answered(["sweep", "--vary", vary], text, folder)
    yield holds("sweep ends with an answer", code in (0, 1) and bool(result), f"code {code}: {first}")
    if result and result["answer"]["grade"] == GOOD:
        ok = result["cases"] == result["ok"]
        yield holds("good is every case a stable state", ok, f"{result['ok']} of {result['cases']}")


def _compared(number: int, folder: Path) -> Iterator[Check]:
    text, scene = own(number)
    if not scene.has_shell():
        return
    code, first, result = answered(["compare"], text, folder)
    yield holds("compare ends with an answer", code in (0, 1) and bool(result), f"code {code}: {first}")
    if result and result["answer"]["grade"] == GOOD:
        (row,) = result["rows"]
        known = None not in (row["hausdorff"], row["ribbon_error"], row["shell_error"])
        yield holds("good has a distance and both errors", known and row["status"] == "converged", row["status"])


def _moved(number: int, folder: Path) -> Iterator[Check]:
    """The mirrored scene, and the one in another unit of length, against the scene itself."""
    from compare.models import solve

    _, scene = own(number)
    state = solve(scene)
    band = scene.closure is not None and scene.closure.kind == "moebius"
    others: list[tuple[Scene, motions.Alike]] = [
        (motions.mirrored(scene), motions.Alike(across=not band, either=True)),
        (motions.scaled(scene, 1e3), motions.Alike(either=True)),
    ]
    for other, alike in others:
        yield from alike.apart(state, solve(other), 1e-6)


def _case(
    name: str, hard: str, expected: str, check: Callable[[int, Path], Iterator[Check]], each: int = EACH
) -> Case:
    count = EACH * RUNGS // each
    return Case(
        name=f"own/{name}",
        hard=hard,
        expected=expected,
        parameter=f"scenes / {each}",
        run=of_numbers(check, each),
        rungs=(0,),
        long=tuple(range(1, count)),
    )


CASES: tuple[Case, ...] = (
    _case("solve", "300 strips as `new` writes them: five holds, seven materials, curled, thin, taut",
          "files and first line agree with each other and with the independent judge; good rests on every check; no "
          "force without an error", _solved),
    _case("limits", "the same, estimated", "shares are shares, nothing unnamed", _quick),
    _case("sweep", "the same over three thicknesses", "good is every case", _swept),
    _case("compare", "the same beside shells", "good has a distance and both errors", _compared, WITH_SHELL),
    _case("moved", "the same mirrored, and in another unit of length", "the same states to 1e-6", _moved),
)  # fmt: skip
