"""How a program in an interpreter of its own is asked: bars as JSON to a script, points of centrelines back."""

from __future__ import annotations

import functools
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compare.suite.answers import Absent, Answer, Answers, BrokeDown, NotRepresentable
from compare.suite.case import Ask, Case, Value, first_scene
from compare.suite.reading import read_off
from compare.suite.section import Bar, bar_of

if TYPE_CHECKING:
    from compare.scene.scene import Scene

Text = Callable[[Bar, int], str]
VARIABLE = "RIBBONBENCH_PEERS"
#: Questions that points of a centreline answer; seconds by which a script ends itself before it is ended.
OF_POINTS, EARLIER = ("position", "radius", "ratio", "extent"), 3.0


@dataclass(frozen=True)
class Reply:
    """Points (size + 1, 3) of the centreline of each bar; processor time (s) of the solves alone, None where the script
    does not tell; how they were run."""

    points: tuple[np.ndarray, ...]
    seconds: float | None = None
    settings: str = ""


@functools.cache
def interpreter(library: str) -> tuple[str, str]:
    """The path of the first python of `VARIABLE` that has the library, and the library's version. Raises `Absent`."""
    for python in (*os.environ.get(VARIABLE, "").split(os.pathsep), sys.executable):
        if not python:
            continue
        asked = f"import importlib.metadata as m; print(m.version({library!r}))"
        done = subprocess.run([python, "-I", "-c", asked], capture_output=True, text=True, check=False)
        if done.returncode == 0:
            return python, done.stdout.strip()
    raise Absent(f"{library} is in no interpreter here; pip install {library} into one and name it in {VARIABLE}")


def scenes(case: Case, ask: Ask) -> Iterator[Scene]:
    """The scenes that a question is about: one, or one for each value that it is asked over."""
    scene = first_scene(case)
    if ask.over is None:
        yield scene
        return
    for value in ask.over[1]:
        yield scene.replace({ask.over[0]: value})


def of_points(case: Case) -> None:
    """Raises `NotRepresentable` for a case with a question that points of a centreline do not answer."""
    for ask in case.asks:
        if ask.of not in OF_POINTS:
            raise NotRepresentable(f"this adapter does not answer {ask.of}")


def run(
    case: Case, budget: float, library: str, script: str, sizes: tuple[int, ...], text: Text | None = None
) -> Answers:
    """Every question of the case that is about positions, on two meshes or more of `sizes` elements; text: what makes
    a model of a bar, where the script takes models."""
    python, version = interpreter(library)
    of_points(case)
    bars = {ask.name: [bar_of(scene, case.theory) for scene in scenes(case, ask)] for ask in case.asks}
    until = time.perf_counter() + budget

    def reply(ask: Ask, size: int) -> Reply:
        asked = {
            "bars": [bar.to_dict() for bar in bars[ask.name]], "size": size,
            "texts": [text(bar, size) for bar in bars[ask.name]] if text is not None else [],
        }  # fmt: skip
        return points_of(python, script, asked, until - time.perf_counter())

    return answers_of(case, sizes, reply, f"{library} {version}")


def answers_of(case: Case, sizes: Sequence[int], reply: Callable[[Ask, int], Reply], version: str) -> Answers:
    """Answers from what a program replies to each question on each mesh; one that asks the same is not asked again."""
    begun = time.perf_counter()
    kept: dict[tuple[object, int], Reply] = {}
    answers = {}
    for ask in case.asks:
        over = None if ask.over is None else (ask.over[0], str(ask.over[1]))
        told: list[Value] = []
        for size in sizes:
            if (over, size) not in kept:
                kept[over, size] = reply(ask, size)
            rows = [read_off(ask, points * case.length) for points in kept[over, size].points]
            told.append(tuple(rows) if ask.over is not None else rows[0])
        apart = np.subtract(np.asarray(told[-1], dtype=float), np.asarray(told[-2], dtype=float))
        answers[ask.name] = Answer(told[-1], float(np.abs(apart).max()))
    how = next((one.settings for one in reversed(kept.values()) if one.settings), "")
    settings = f"elements: {', '.join(map(str, sizes))}" + (how and f"; {how}")
    return Answers(answers=answers, version=version, settings=settings, seconds=time.perf_counter() - begun)


def points_of(python: str, script: str, asked: Mapping[str, object], left: float) -> Reply:
    """What a script replies; asked: for its standard input. Raises `BrokeDown`, `NotRepresentable`."""
    if left <= 0.0:
        raise BrokeDown("out of budget: nothing is left of it for the next mesh")
    place = Path(__file__).with_name(script)
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    words = json.dumps({**asked, "seconds": max(0.5 * left, left - EARLIER)})
    try:
        done = subprocess.run(
            [python, "-I", str(place)], input=words, capture_output=True, text=True, timeout=left, env=environment,
            check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise BrokeDown(f"out of budget: it had not ended after {left:.3g} s") from None
    if done.returncode:
        raise RuntimeError((done.stderr.strip().splitlines() or ["no word"])[-1])
    said = json.loads(done.stdout.splitlines()[-1])
    if "not" in said:
        raise NotRepresentable(said["not"])
    if "broke" in said:
        raise BrokeDown(said["broke"])
    return Reply(tuple(map(np.array, said["points"])), said.get("seconds"), said.get("settings", ""))
