"""Scenes as people write them, through the commands: what the terminal and the files say, judged by other code."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from compare.battery import motions
from compare.battery.case import Case, Check, Rung, holds
from compare.battery.cases.frames import answer
from compare.battery.judge.seen import as_seen, rests_on_checks
from compare.battery.own_scenes import own
from compare.battery.processes import ran
from compare.measure.grades import GOOD
from compare.models.scope import has_shell
from compare.scene import Scene

#: Scenes of a rung, and rungs: 300 scenes in all; beside shells, which take seconds, fewer in a rung.
EACH, RUNGS = 10, 30
WITH_SHELL = 4
_NONE: Mapping[Rung, str] = MappingProxyType({})
#: Several commands in one process, as a user's one after the other: what each says, and its exit code.
_MANY = """
import contextlib, io, json, sys
from compare.cli import main
found = []
for words in json.load(open(sys.argv[1])):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(words)
    found.append([code, out.getvalue(), err.getvalue()])
json.dump(found, open(sys.argv[2], "w"))
"""


@dataclass(frozen=True)
class Said:
    """What a command left: exit code, what it printed, its folder with result.json (None: it wrote none)."""

    code: int
    out: str
    folder: Path
    result: dict[str, Any] | None

    @property
    def first(self) -> str:
        """The first sentence, unfolded: as many words as the answer has."""
        assert self.result is not None
        answer = self.result["answer"]
        line = f"{answer['text']}." if answer["grade"] == "unknown" else f"{answer['text']}: {answer['grade']}."
        return " ".join(self.out.split()[: len(line.split())])


Words = Callable[[Scene], list[str] | None]
Judge = Callable[[Scene, Said], Iterator[Check]]


def of_command(words: Words, judge: Judge, each: int = EACH) -> Callable[[Rung], Iterator[Check]]:
    """What checks the scenes of a rung by one command each; words: of the command, None where it has nothing to say."""

    def run(rung: Rung) -> Iterator[Check]:
        with tempfile.TemporaryDirectory(prefix="ribbonbench-own-") as place:
            folder = Path(place)
            requested = []
            for number in range(int(rung) * each, int(rung) * each + each):
                text, scene = own(number)
                command = words(scene)
                if command is not None:
                    file = folder / f"own_{number}.toml"
                    file.write_text(text, encoding="utf-8")
                    out = folder / f"out_{number}"
                    requested.append((number, scene, out, [command[0], str(file), *command[1:], "--out", str(out)]))
            if requested:
                yield from _worst(_answers(folder, requested, judge))
            else:
                yield holds("no scene of this rung is for the command", True)

    return run


Requested = list[tuple[int, Scene, Path, list[str]]]


def _answers(folder: Path, asked: Requested, judge: Judge) -> Iterator[Check]:
    """The checks of every answer, each with the number of its scene."""
    orders, answers = folder / "orders.json", folder / "answers.json"
    orders.write_text(json.dumps([words for _, _, _, words in asked]))
    ended = ran([str(orders), str(answers)], folder, module=("-c", _MANY))
    yield holds("every command ends", ended.code == 0 and answers.is_file(), ended.err[-200:])
    if not answers.is_file():
        return
    for (number, scene, out, words), (code, printed, err) in zip(asked, json.loads(answers.read_text()), strict=True):
        file = out / "result.json"
        result = json.loads(file.read_text()) if file.is_file() else None
        done = code in (0, 1) and result is not None
        found = [holds(f"{words[0]} ends with an answer", done, f"code {code}: {err[-200:]}")]
        if done:
            found += judge(scene, Said(code, printed, out, result))
        yield from (replace(check, said=f"own {number}: {check.said}") for check in found)


def _worst(checks: Iterator[Check]) -> list[Check]:
    """Of checks of one thing the worst."""
    worst: dict[str, Check] = {}
    for check in checks:
        known = worst.get(check.what)
        if known is None or (not check.ok, check.strain) > (not known.ok, known.strain):
            worst[check.what] = check
    return list(worst.values())


def _solved(scene: Scene, said: Said) -> Iterator[Check]:
    assert said.result is not None
    yield from as_seen(said.folder, scene, said.first)
    status = said.result["status"]
    yield holds("exit code 0 is a stable state", (said.code == 0) == (status == "converged"), f"{said.code}, {status}")


def _quick(scene: Scene, said: Said) -> Iterator[Check]:
    assert said.result is not None
    (row,) = said.result["rows"]
    share, distance = row["estimate"]["share"], row["estimate"]["distance"]
    yield holds("an estimated share is a share", share is None or 0.0 <= share <= 1.0, f"{share}")
    yield holds("an estimate is a number or none", distance is None or distance >= 0.0, f"{distance}")
    words = said.first.lower().split()
    yield holds("nothing unnamed in the first line", not {"nan", "inf", "none"} & set(words), said.first)
    yield from rests_on_checks(said.result)


def _swept(scene: Scene, said: Said) -> Iterator[Check]:
    assert said.result is not None
    good, ok = said.result["answer"]["grade"] == GOOD, said.result["ok"] == said.result["cases"]
    yield holds("good is every case a stable state", ok or not good, f"{said.result['ok']} of {said.result['cases']}")
    yield from rests_on_checks(said.result)


def _compared(scene: Scene, said: Said) -> Iterator[Check]:
    assert said.result is not None
    (row,) = said.result["rows"]
    good = said.result["answer"]["grade"] == GOOD
    known = None not in (row["hausdorff"], row["ribbon_error"], row["shell_error"]) and row["same_state"] is True
    right = known and row["status"] == "converged"
    yield holds("good has one state, a distance and both errors", right or not good, row["status"])
    yield from rests_on_checks(said.result)


def _thicker(scene: Scene) -> list[str]:
    """A sweep over three thicknesses."""
    thickness = scene.strip.thickness
    assert thickness is not None
    return ["sweep", "--vary", f"strip.thickness={thickness!r}:{1.5 * thickness!r}:3"]


#: Gamma beyond which a ring falls out of its plane, to one of several states that rounding chooses among (own 5 has
#: elastic energies of 146.7 and 156.8): moved, it is asked for a state, and not for the same one.
_FALLS = 300.0


def _moved(rung: Rung) -> Iterator[Check]:
    """The mirrored scene, and the one in another unit of length, against the scene itself."""

    def found() -> Iterator[Check]:
        for number in range(int(rung) * EACH, int(rung) * EACH + EACH):
            scene = own(number)[1]
            state = answer(scene)
            band = scene.closure is not None and scene.closure.kind == "moebius"
            others = (
                (motions.mirrored(scene), motions.Alike(across=not band, either=True)),
                (motions.scaled(scene, 1e3), motions.Alike(either=True)),
            )
            for other, alike in others:
                there = answer(other)
                found = alike.apart(state, there, 1e-6)
                if scene.closure is not None and scene.gamma > _FALLS:
                    found = [holds("a heavy ring rests somewhere", there.is_equilibrium, there.message)]
                yield from (replace(check, said=f"own {number}: {check.said}") for check in found)

    yield from _worst(found())


#: Rungs of "moved" that are known to fail, and why.
_SEVERAL: Mapping[Rung, str] = MappingProxyType({
    2: "own 27, silicone of Gamma = 3.2e6, leaves a saddle for one of three states, as rounding will have it: elastic "
    "energies 1049.4, 1048.4, 1048.1, totals within 1e-6, shapes within 1.6e-5 l",
    7: "own 77, silicone of Gamma = 2.8e4, hangs straight and twisted, its twist turns over somewhere on the straight "
    "part, where rounding has it: elastic energies 99.5318, 99.5359, 99.5364, each stated within 0.003 to 0.005; "
    "shapes within 1.9e-6 l, stated within 4.2e-4 l",
    13: "own 131, polycarbonate of Gamma = 2919, as own 77: elastic energies -11.5091 and -11.5057, each stated within "
    "0.01; shapes within 7.2e-5 l, stated within 6.6e-4 l",
})  # fmt: skip


def _case(
    name: str,
    hard: str,
    expected: str,
    run: Callable[[Rung], Iterator[Check]],
    each: int = EACH,
    known: Mapping[Rung, str] = _NONE,
) -> Case:
    return Case(
        name=f"own/{name}",
        hard=hard,
        expected=expected,
        parameter=f"scenes / {each}",
        run=run,
        rungs=(0,),
        long=tuple(range(1, EACH * RUNGS // each)),
        known=known,
    )


CASES: tuple[Case, ...] = (
    _case("solve", "300 strips as `new` writes them: five holds, seven materials, curled, thin, taut",
          "files and first line agree with each other and with the independent judge; good rests on every check; no "
          "force without an error", of_command(lambda scene: ["solve"], _solved)),
    _case("limits", "the same, estimated", "shares are shares, nothing unnamed, good rests on every check",
          of_command(lambda scene: None if scene.closure else ["limits", "--quick"], _quick)),
    _case("sweep", "the same over three thicknesses", "good is every case a stable state",
          of_command(_thicker, _swept)),
    _case("compare", "the same beside shells", "good is one state, with a distance and both errors",
          of_command(lambda scene: ["compare"] if has_shell(scene) else None, _compared, WITH_SHELL), WITH_SHELL),
    _case("moved", "the same mirrored, and in another unit of length", "the same states to 1e-6", _moved,
          known=_SEVERAL),
)  # fmt: skip
