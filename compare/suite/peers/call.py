"""How a program in an interpreter of its own is asked: bars as JSON to a script, points of centrelines back."""

from __future__ import annotations

import functools
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from compare.suite.answers import Absent, Answer, Answers, BrokeDown, NotRepresentable
from compare.suite.case import Ask, Case, Value, first_scene
from compare.suite.reading import read_off
from compare.suite.section import Bar, bar_of

Text = Callable[[Bar, int], str]
VARIABLE = "RIBBONBENCH_PEERS"


@functools.cache
def interpreter(library: str) -> tuple[str, str]:
    """The path of a python that has the library, and the library's version. Raises `Absent`."""
    for python in (os.environ.get(VARIABLE, ""), sys.executable):
        if not python:
            continue
        asked = f"import importlib.metadata as m; print(m.version({library!r}))"
        done = subprocess.run([python, "-I", "-c", asked], capture_output=True, text=True, check=False)
        if done.returncode == 0:
            return python, done.stdout.strip()
    raise Absent(f"{library} is in no interpreter here; pip install {library} into one and name it in {VARIABLE}")


def _scenes(case: Case, ask: Ask) -> Iterator[Bar]:
    scene = first_scene(case)
    if ask.over is None:
        yield bar_of(scene, case.theory)
        return
    for value in ask.over[1]:
        yield bar_of(scene.replace({ask.over[0]: value}), case.theory)


def run(
    case: Case, budget: float, library: str, script: str, sizes: tuple[int, int], text: Text | None = None
) -> Answers:
    """Every question of the case that is about positions, on two meshes of `sizes` elements; text: what makes a model
    of a bar, where the script takes models."""
    python, version = interpreter(library)
    for ask in case.asks:
        if ask.of not in ("position", "radius", "ratio", "extent"):
            raise NotRepresentable(f"this adapter does not answer {ask.of}")
    begun = time.perf_counter()
    answers = {}
    kept: dict[str, list[np.ndarray]] = {}
    for ask in case.asks:
        bars = list(_scenes(case, ask))
        told: list[Value] = []
        for size in sizes:
            texts = [text(bar, size) for bar in bars] if text is not None else []
            key = json.dumps({"bars": [bar.to_dict() for bar in bars], "size": size, "texts": texts})
            if key not in kept:
                kept[key] = points_of(python, script, key, budget - (time.perf_counter() - begun))
            rows = [read_off(ask, points * case.length) for points in kept[key]]
            told.append(tuple(rows) if ask.over is not None else rows[0])
        apart = np.subtract(np.asarray(told[1], dtype=float), np.asarray(told[0], dtype=float))
        answers[ask.name] = Answer(told[1], float(np.abs(apart).max()))
    seconds = time.perf_counter() - begun
    settings = f"elements: {sizes[0]}, {sizes[1]}"
    return Answers(answers=answers, version=f"{library} {version}", settings=settings, seconds=seconds)


def points_of(python: str, script: str, asked: str, left: float) -> list[np.ndarray]:
    """Points (size + 1, 3) of the centreline of each bar; asked: JSON for the script. Raises `BrokeDown`,
    `NotRepresentable`."""
    if left <= 0.0:
        raise BrokeDown("the budget has run out")
    place = Path(__file__).with_name(script)
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            [python, "-I", str(place)], input=asked, capture_output=True, text=True, timeout=left, env=environment,
            check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise BrokeDown("the budget has run out") from None
    if done.returncode:
        raise RuntimeError((done.stderr.strip().splitlines() or ["no word"])[-1])
    said = json.loads(done.stdout.splitlines()[-1])
    if "not" in said:
        raise NotRepresentable(said["not"])
    if "broke" in said:
        raise BrokeDown(said["broke"])
    return [np.array(points) for points in said["points"]]
