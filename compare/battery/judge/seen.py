"""What a user sees of a ribbon, judged: result.json, ribbon.npz and the first line, by `compare.battery.judge.ribbon`.

Nothing is taken from a solver's object: the curvatures, the frames and the numbers are those of the files; clamps,
loads and stiffness are the scene's.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.battery.case import Check, holds
from compare.battery.judge.ribbon import judged
from compare.measure.grades import GOOD, YARDSTICK
from compare.scene.scene import Scene

FloatArray = NDArray[np.float64]

#: Digits that the first line gives.
_TOLD = 0.06


@dataclass(frozen=True)
class Seen:
    """An equilibrium as its files have it, in the words that the judge reads (`ribbon.Equilibrium`)."""

    problem: Any
    parameters: FloatArray
    joints: tuple[FloatArray, FloatArray]
    line: tuple[FloatArray, FloatArray, FloatArray]
    status: Any
    energy: Any
    lowest_eigenvalue: float
    walls: tuple[Any, ...]
    has_free_twist: bool
    at: None = None

    @classmethod
    def of(cls, folder: Path, scene: Scene) -> Seen:
        """What `ribbonbench solve` has written into a folder."""
        from compare.models.ribbon.build import ribbon_problem

        result = json.loads((folder / "result.json").read_text())
        with np.load(folder / "ribbon.npz") as stored:
            found = {name: np.asarray(stored[name]) for name in stored.files}
        lengths = scene.strip.length * found["segment_lengths"]
        free = "curvature_parameters" in found
        energy = {"elastic": math.nan, "gravity": 0.0, "total": math.nan, **(result["energy"] or {})}
        lowest = result["lowest_eigenvalue"]
        same = scene.replace(
            {
                "model.element_lengths": lengths.tolist(), "model.energy": result["model"]["energy"],
                "model.accuracy": None,
            }
        )  # fmt: skip
        return cls(
            problem=ribbon_problem(same, result["model"]["formulation"]),
            parameters=found["curvature_parameters" if free else "parameters"],
            joints=(found["joint_positions"], found["joint_frames"]),
            line=(found["line_s"], found["line_position"], found["line_frame"]),
            status=SimpleNamespace(code=result["status"]),
            energy=SimpleNamespace(**energy),
            lowest_eigenvalue=math.inf if lowest is None else lowest,
            walls=tuple(SimpleNamespace(contacts=wall["contacts"]) for wall in result.get("walls", ())),
            has_free_twist=free,
        )

    def position(self, s: FloatArray) -> FloatArray:
        """Stored positions (k, 3) at abscissae (k,): joints, and those of the stored centreline."""
        return np.array([self._stored(x)[0] for x in s])

    def frame(self, s: FloatArray) -> FloatArray:
        """Stored frames (k, 3, 3)."""
        return np.array([self._stored(x)[1] for x in s])

    def _stored(self, s: float) -> tuple[FloatArray, FloatArray]:
        ends = np.concatenate([[0.0], np.cumsum(self.problem.lengths)])
        joint = int(np.argmin(np.abs(ends - s)))
        if abs(ends[joint] - s) < 1e-12:
            return self.joints[0][joint], self.joints[1][joint]
        at, positions, frames = self.line
        place = int(np.argmin(np.abs(at - s)))
        if abs(at[place] - s) > 1e-12:
            raise ValueError(f"nothing is stored at s = {s!r}")
        return positions[place], frames[place]


def as_seen(folder: Path, scene: Scene, first: str) -> Iterator[Check]:
    """Checks of what `ribbonbench solve` left in a folder and said in its `first` line."""
    result = json.loads((folder / "result.json").read_text(), parse_constant=_no_constant)
    yield from told(result, scene, first)
    if result["status"] in ("converged", "saddle") and not scene.walls:
        yield from judged(Seen.of(folder, scene))


def told(result: Mapping[str, Any], scene: Scene, first: str) -> Iterator[Check]:
    """Checks of the numbers alone: nothing unnamed, an error beside each, the first line says what they say."""
    answer, equilibrium = result["answer"], result["status"] in ("converged", "saddle")
    line = f"{answer['text']}." if answer["grade"] == "unknown" else f"{answer['text']}: {answer['grade']}."
    yield holds("the first line is the answer's", _words(first) == _words(line), first)
    yield from rests_on_checks(result)
    if answer["grade"] == GOOD:
        error = result["discretisation_error"]
        sure = result["status"] == "converged" and result["stable"] is True and error is not None
        yield holds("good is a stable state with an error", sure and error <= YARDSTICK, f"{result['stable']}, {error}")
    if not equilibrium:
        return
    for name in ("forces", "moments"):
        values, errors = result[name], result[f"{name}_error"]
        for place, value in _pairs(values):
            error = dict(_pairs(errors or {})).get(place)
            why = result.get(f"{name}_why") or result.get("errors_why") or ""
            known = value is None or error is not None or bool(why)
            yield holds(f"{name}.{place} has an error, or a reason for none", known, why)
    yield from _heights(result, scene, first)


def rests_on_checks(result: Mapping[str, Any]) -> Iterator[Check]:
    """Whether the answer of a command is as good as what was checked of it."""
    answer = result["answer"]
    bad = [check["name"] for check in answer["checks"] if check["grade"] != GOOD]
    right = answer["grade"] != GOOD or (bool(answer["checks"]) and not bad)
    yield holds("good rests on every check", right, ", ".join(bad))


def _heights(result: Mapping[str, Any], scene: Scene, first: str) -> Iterator[Check]:
    """How far the first line says that the strip hangs, against the position in the file."""
    found = re.search(r"(hangs|stands) ([0-9.e+-]+) (m|mm|µm|nm) ", first)
    place = result["middle" if scene.clamp_end is not None else "end"]
    if found is None or place is None or scene.up is None or scene.start_position is None:
        return
    metres = float(found[2]) * {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "nm": 1e-9}[found[3]]
    height = float((np.asarray(place["position"]) - scene.start_position) @ scene.up) * scene.strip.length
    right = (height > 0.0) == (found[1] == "stands")
    yield holds("below or above as the file has it", right, f"{height:.4g} m, {first}")
    off = abs(metres - abs(height)) / max(abs(height), 1e-12)
    yield Check("height in the first line apart from the file's, relative", off, _TOLD, said=first)


def _pairs(values: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Places and values of forces: walls by their number."""
    found = [(name, value) for name, value in values.items() if name != "walls"]
    return found + [(f"walls.{k}", value) for k, value in enumerate(values.get("walls") or ())]


def _words(text: str) -> str:
    return " ".join(text.split())


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is no number of JSON")
