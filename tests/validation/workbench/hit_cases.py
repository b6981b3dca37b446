"""120 scenes with the shells to which every model is held: the 7.3 grid, the others of `limits`, and 40 drawn ones.

A shell is kept by the scene's name under ``shells``: surface, report, and, on the grid of the edge, its own error
against half as many elements each way. It is taken again while its problem is the same (delete the folder after a
change of the shell itself), so that a new model is measured on all of them in minutes.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from compare.models.base import Options, State
from compare.models.scope import require_shell
from compare.models.shell import mesh_size, state_of
from compare.models.shell_build import WIDE, shell_elements, shell_problem
from compare.models.shell_process import ShellCase
from compare.registry import model
from compare.scene.scene import Scene, load
from compare.store.progress import Reporter
from compare.store.store import CaseStore, atomic_write_json, read_json
from compare.studies.axes import parse_axis, points
from compare.studies.limits import with_clamp
from shellref.shell.problem import ShellProblem
from tests.validation.workbench.drawn import drawn
from tests.validation.workbench.hit_solve import solve
from tests.validation.workbench.limits import GAMMAS, OTHERS, WIDTHS

GROUPS = ("7.3, edge", "7.3, corners", "others", "drawn")
#: The strip at which shells begin, and the meshes of those that do; w / l above which a strip is wide.
BESIDE = "finite"
MESH, WIDE_MESH = (64, 6), (80, 10)
#: Scenes that have no shell to be measured by, and why; the page says so.
LEFT_OUT = {"corners_08": "its path was cut back for 350 s at 4 % of the weight"}
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
        return require_shell(self.scene)[0]


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
        (ratio,) = require_shell(point.scene)
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
    """The shell of a case from its folder; None where there is none, or one of another problem or a coarser mesh."""
    folder = place / case.name
    try:
        said = read_json(folder / "kept.json")
        data = read_json(folder / "shell.json")
    except OSError:
        return None
    then, now = ShellProblem.from_dict(said["problem"]), shell_problem(case.scene, case.ratio, mesh(case), way=False)
    if replace(then, elements=now.elements) != now or then.elements < now.elements:
        return None
    there = folder / "shell.npz"
    found = state_of(case.scene, ShellCase(data, folder if there.exists() else None, True))
    return Shell(case, replace(found, error=said["error"]), folder)


def mesh(case: Case) -> tuple[int, int]:
    """Elements of a case's shell: as `compare` has them on the grid of the edge, elsewhere about half as many."""
    if case.group == GROUPS[0]:
        return shell_elements(case.scene)
    return WIDE_MESH if case.scene.width > WIDE else MESH


def solved(case: Case, place: Path, store: CaseStore, say: Reporter) -> Shell:
    """The shell of a case, settled from the surface of the softest one-dimensional strip (`BESIDE`): this takes a fifth
    of the time of a path from the flat strip, and selects its branch. On the grid of the edge with its own error."""
    found = kept(case, place)
    if found is not None:
        return found
    strip = solve(case.scene, BESIDE, say=say)
    near = strip.shape if strip is not None and strip.ok else None
    options = Options(error=case.group == GROUPS[0], store=store, fallback=True)
    state = model("shell").solve(case.scene, mesh_size(mesh(case)), near=near, options=options, say=say)
    native = state.native
    assert isinstance(native, ShellCase)
    folder = place / case.name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    if native.folder is not None:
        shutil.copy(native.folder / "shell.npz", folder / "shell.npz")
    atomic_write_json(folder / "shell.json", native.data)
    problem = shell_problem(case.scene, case.ratio, mesh(case), way=False)
    atomic_write_json(folder / "kept.json", {"problem": problem.to_dict(), "error": state.error})
    return Shell(case, state, folder)
