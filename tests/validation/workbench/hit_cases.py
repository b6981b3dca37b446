"""120 scenes with the shells to which every model is held: the 7.3 grid, the others of `limits`, and 40 drawn ones.

A shell is kept by the scene's name under ``shells``: surface, report, and its own error against half as many elements
each way. It is taken again while its problem is the same (delete the folder after a change of the shell itself), so
that a new model is measured on all of them in minutes.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from compare.models.base import Options, State
from compare.models.choice import beside_the_shell
from compare.models.shell import state_of
from compare.models.shell_build import shell_problem
from compare.models.shell_process import ShellCase
from compare.registry import model
from compare.scene.scene import Scene, load
from compare.store.progress import Reporter
from compare.store.store import CaseStore, atomic_write_json, read_json
from compare.studies.axes import parse_axis, points
from compare.studies.compare import several_equilibria
from compare.studies.limits import with_clamp
from shellref.shell.problem import ShellProblem
from tests.validation.workbench.drawn import drawn
from tests.validation.workbench.limits import GAMMAS, OTHERS, WIDTHS

GROUPS = ("7.3, edge", "7.3, corners", "others", "drawn")
_AXES = {"strip.width": "w", "strip.gamma": "g", "shell.width_to_thickness": "wh"}


@dataclass(frozen=True)
class Case:
    """A scene of one w/h (its thickness given) by name, and the group it belongs to (of `GROUPS`)."""

    group: str
    name: str
    scene: Scene

    @cached_property
    def ratio(self) -> float:
        """w/h."""
        return self.scene.require_shell()[0]


def cases() -> tuple[Case, ...]:
    """All 120, those of one group together."""
    found = [
        case
        for clamp, group in (("edge", GROUPS[0]), ("corners", GROUPS[1]))
        for case in _grid(group, f"7_3_{clamp}", with_clamp(load("limits_7_3"), clamp), (WIDTHS, GAMMAS))
    ]
    for number, (name, clamp, keys, axes) in enumerate(OTHERS, start=1):
        found += _grid(GROUPS[2], f"{name}_{number:02d}", with_clamp(load(name), clamp).replace(keys), axes)
    return (*found, *(Case(GROUPS[3], name, scene) for name, scene in drawn()))


def _grid(group: str, name: str, scene: Scene, axes: Sequence[str]) -> list[Case]:
    """The points of a grid, each with a thickness of its own."""
    found = []
    for point in points(scene, [parse_axis(axis) for axis in axes]):
        told = "_".join(f"{_AXES[key]}{value:g}" for key, value in point.values.items())
        (ratio,) = point.scene.require_shell()
        thick = point.scene.strip.thickness or point.scene.strip.width / ratio
        found.append(
            Case(
                group,
                f"{name}_{told}",
                point.scene.replace({"strip.thickness": thick, "shell.width_to_thickness": None}),
            )
        )
    return found


@dataclass(frozen=True)
class Shell:
    """The shell of a case: its state (`.shape`, `.ok`, `.error` over l) and where it is kept."""

    case: Case
    state: State
    folder: Path


def kept(case: Case, place: Path) -> Shell | None:
    """The shell of a case from its folder; None where there is none, or one of another problem."""
    folder = place / case.name
    try:
        said = read_json(folder / "kept.json")
        data = read_json(folder / "shell.json")
    except OSError:
        return None
    if ShellProblem.from_dict(said["problem"]) != shell_problem(case.scene, case.ratio, way=False):
        return None
    there = folder / "shell.npz"
    found = state_of(case.scene, ShellCase(data, folder if there.exists() else None, True))
    return Shell(case, _with(found, said), folder)


def solved(case: Case, place: Path, store: CaseStore, say: Reporter) -> Shell:
    """The shell of a case as `compare` solves it: where there may be several states, from the ribbon's surface."""
    found = kept(case, place)
    if found is not None:
        return found
    near = None
    if several_equilibria(case.scene):
        ribbon = beside_the_shell(case.scene).solve(case.scene, options=Options(store=store), say=say)
        near = ribbon.shape if ribbon.ok else None
    options = Options(error=True, store=store, fallback=True)
    state = model("shell").solve(case.scene, near=near, options=options, say=say)
    native = state.native
    assert isinstance(native, ShellCase)
    folder = place / case.name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    if native.folder is not None:
        shutil.copy(native.folder / "shell.npz", folder / "shell.npz")
    atomic_write_json(folder / "shell.json", native.data)
    said = {
        "problem": shell_problem(case.scene, case.ratio, way=False).to_dict(),
        "error": state.error,
        "share_error": state.numbers.get("share_error"),
    }
    atomic_write_json(folder / "kept.json", said)
    return Shell(case, state, folder)


def _with(state: State, said: dict[str, Any]) -> State:
    """A state with what is kept beside the shell's own report."""
    return replace(state, error=said["error"], numbers={**state.numbers, "share_error": said["share_error"]})
