"""Scenes that cannot be, and how soon the tool says so."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from typing import Any

from compare.battery.case import Case, Check, Rung, holds
from compare.models import solve
from compare.scene.scene import loads
from compare.scene.toml import toml_text
from ribbonbench.errors import BadInput

#: Time to say that a scene cannot be, s of the processor.
SOON = 2.0
_HELD = {"position": [0.0, 0.0, 0.0], "tangent": [0.0, 0.0, 1.0], "normal": [0.0, 1.0, 0.0]}
_FLOOR = {"point": [0.0, 0.0, 0.0], "normal": [0.0, 1.0, 0.0]}


def _wall(point: list[float], normal: list[float]) -> dict[str, Any]:
    return {"point": point, "normal": normal}


def _clamps(end: Mapping[str, Any], *walls: Mapping[str, Any]) -> dict[str, Any]:
    return {"clamp": {"start": _HELD, "end": {**_HELD, **end}}, "wall": list(walls)}


#: Way of being impossible -> the key that is named, and the scene beside its strip.
IMPOSSIBLE: dict[str, tuple[str, dict[str, Any]]] = {
    "too far": ("clamp.end.position", _clamps({"position": [0.0, 0.0, 1.0 + 1e-9]})),
    "taut and turned": ("clamp.end.normal", _clamps({"position": [0.0, 0.0, 1.0], "normal": [1.0, 0.0, 0.0]})),
    "taut and oblique": (
        "clamp.end.tangent",
        _clamps({"position": [0.0, 0.0, 1.0], "tangent": [0.0, -0.6, 0.8], "normal": [0.0, 0.8, 0.6]}),
    ),
    "clamp under the floor": (
        "clamp.start.position", {"clamp": {"start": _HELD}, "wall": [_wall([0.0, 1e-3, 0.0], [0.0, 1.0, 0.0])]}
    ),
    "end under the floor": ("clamp.end.position", _clamps({"position": [0.0, -0.1, 0.8]}, _FLOOR)),
    "edge under the floor": (
        "clamp.start.position", {"clamp": {"start": {**_HELD, "normal": [1.0, 0.0, 0.0]}}, "wall": [_FLOOR]}
    ),
    "into its floor": (
        "clamp.start.tangent",
        {"clamp": {"start": {**_HELD, "tangent": [0.0, -0.6, 0.8], "normal": [0.0, 0.8, 0.6]}}, "wall": [_FLOOR]},
    ),
    "walls face away": (
        "wall.1.point", {"clamp": {"start": None}, "wall": [_FLOOR, _wall([0.0, -0.1, 0.0], [0.0, -1.0, 0.0])]}
    ),
    "three walls without room": (
        "wall.2.point",
        {
            "clamp": {"start": None},
            "wall": [
                _wall([0.0, 0.1, 0.0], [0.0, 1.0, 0.0]),
                _wall([0.0, 0.0, 0.1], [0.0, -0.6, 0.8]),
                _wall([0.0, 0.0, -0.1], [0.0, -0.6, -0.8]),
            ],
        },
    ),
    "moebius too wide": (
        "strip.width", {"strip": {"length": 1.0, "width": 0.578, "poisson": 0.3}, "closure": {"kind": "moebius"}}
    ),
    "end and closure": ("clamp.end", {"clamp": {"end": _HELD}, "closure": {"kind": "circle"}}),
}  # fmt: skip


def _scene(given: Mapping[str, Any], **model: Any) -> Any:
    data = {"title": "A scene that cannot be", "strip": {"length": 1.0, "width": 0.05, "poisson": 0.3}, **given}
    data["clamp"] = {end: held for end, held in data.get("clamp", {}).items() if held is not None}
    data = {key: value for key, value in data.items() if value not in ({}, [])}
    return loads(toml_text({**data, **({"model": model} if model else {})}), "impossible")


def _refused(rung: Rung) -> Iterator[Check]:
    key, given = IMPOSSIBLE[str(rung)]
    began = time.process_time()
    try:
        _scene(given)
    except BadInput as error:
        yield holds(f"names {key}", error.key == key, str(error))
        yield holds("in one line", "\n" not in str(error), str(error))
    else:
        yield holds("refused before anything is solved", False, "it was read as a scene that can be")
    yield Check("time to say so / s", time.process_time() - began, SOON, timed=True)


def _in_time(rung: Rung) -> Iterator[Check]:
    """A Moebius band that no shape is found of within its budget, and the time that takes."""
    budget = float(rung)
    scene = _scene(
        {"strip": {"length": 1.0, "width": 0.57, "poisson": 0.3}, "closure": {"kind": "moebius"}}, budget=budget
    )
    began = time.process_time()
    state = solve(scene, "ribbon")
    yield holds("no equilibrium", not state.is_equilibrium, state.message)
    yield Check("time over the budget / s", time.process_time() - began - budget, 2.0, timed=True)


CASES: tuple[Case, ...] = (
    Case(
        "infeasible/refused",
        "a scene whose sections contradict each other: a minimiser would look for it for a minute",
        "refused when it is read, in one line that names the key to change; within 2 s",
        "way of being impossible",
        _refused,
        tuple(IMPOSSIBLE),
    ),
    Case(
        "infeasible/budget",
        "a Moebius band of w / l = 0.57, below the bound of 0.577 and wider than the elements reach",
        "it ends without an equilibrium when its budget is spent, and not 40 to 460 s later",
        "budget / s",
        _in_time,
        (),
        (5.0, 20.0),
    ),
)
