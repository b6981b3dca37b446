"""The [[path]] of a scene of several strips: its stages in order, then the scene itself, and what is between.

A stage changes clamps, loads at ends, walls, obstacles and the direction of the weight, on top of the stages before
it. Between two of them numbers vary linearly, frames by the shortest rotation, directions along their great circle
(`compare.scene.homotopy`).
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from compare.scene.homotopy import moves_between
from compare.scene.stages import stage_name
from compare.scene.strips.scene import StripsScene
from compare.scene.strips.write import assign
from ribbonbench.errors import BadInput

#: Where stages may change something: sections of all, and of a strip's own.
_SHARED, _OWN = ("wall", "obstacle", "gravity"), ("clamp", "tip")

Build = Callable[[Mapping[str, Any]], StripsScene]


def read_stages(document: Mapping[str, Any], build: Build) -> tuple[tuple[StripsScene, ...], tuple[int | None, ...]]:
    """The scenes of the stages in order, without the scene itself, and the number of steps to each (None: chosen); the
    last number is that of the steps to the scene itself, which none says."""
    data = document.get("path", [])
    if not isinstance(data, list) or not all(isinstance(entry, Mapping) for entry in data):
        raise BadInput("path", None, "is not an array of tables", "write every stage as a section [[path]]")
    changed = copy.deepcopy({name: value for name, value in document.items() if name != "path"})
    stages: list[StripsScene] = []
    steps: list[int | None] = []
    for number, entry in enumerate(data):
        steps.append(_steps(entry, number))
        keys = dict(_flattened({name: value for name, value in entry.items() if name != "steps"}))
        if not keys:
            raise BadInput(
                stage_name(number), None, "changes no key", 'add one, e.g. "strip.left.clamp.end.position" = [0, 0, 1]'
            )
        for key, value in keys.items():
            _check_key(key, number)
            try:
                assign(changed, key, value)
            except BadInput as error:
                raise BadInput(stage_name(number, error.key), error.value, error.problem, error.remedy) from None
        try:
            stages.append(build(copy.deepcopy(changed)))
        except BadInput as error:
            raise BadInput(stage_name(number, error.key), error.value, error.problem, error.remedy) from None
    return tuple(stages), (*steps, None)


def _steps(entry: Mapping[str, Any], number: int) -> int | None:
    steps = entry.get("steps")
    if steps is None:
        return None
    if isinstance(steps, bool) or not isinstance(steps, int) or steps < 1:
        raise BadInput(stage_name(number, "steps"), steps, "is not a number of steps", "give a whole number >= 1")
    if number == 0:
        raise BadInput(
            stage_name(number, "steps"), steps,
            "counts the steps from the stage before, and this is the first: it is reached from the seeds",
            "remove it, or write it into the stage after",
        )  # fmt: skip
    return steps


def _flattened(data: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in data.items():
        if isinstance(value, Mapping):
            yield from _flattened(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _check_key(key: str, number: int) -> None:
    words = key.split(".")
    if words[0] in _SHARED or (words[0] == "strip" and len(words) > 3 and words[2] in _OWN):
        return
    raise BadInput(
        stage_name(number, key), None, "cannot change along a path of several strips",
        "give keys of clamps (strip.NAME.clamp.end.position), loads (strip.NAME.tip.force), walls, obstacles or "
        "gravity",
    )  # fmt: skip


def way(first: StripsScene, last: StripsScene, build: Build) -> Callable[[float], StripsScene]:
    """The scene at t, 0 <= t <= 1, between two stages; `BadInput` where something cannot vary step by step."""
    moves: list[tuple[str, Callable[[float], dict[str, Any]]]] = []
    for name, one, other in zip(last.names, first.strips, last.strips, strict=True):
        own, switched = moves_between(one, other)
        if switched:
            section = switched[0].partition(".")[0]
            key = f"strip.{name}.{switched[0]}" if section in _OWN else switched[0]
            raise BadInput(
                "path", key, "cannot vary from stage to stage step by step", "change numbers and directions alone"
            )
        moves += [(name, move) for move in own]

    def at(t: float) -> StripsScene:
        if t <= 0.0 or t >= 1.0:
            return first if t <= 0.0 else last
        document = copy.deepcopy({name: value for name, value in last.document.items() if name != "path"})
        for name, move in moves:
            for key, value in move(t).items():
                own = key.partition(".")[0] in _OWN
                assign(document, f"strip.{name}.{key}" if own else key, np.asarray(value).tolist())
        try:
            return build(document)
        except BadInput as error:
            problem = f"{error.problem} (on the way between two stages, {t:.3g} of it behind)"
            raise BadInput(error.key, error.value, problem, "add a [[path]] stage in between") from None

    return at
