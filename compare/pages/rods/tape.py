"""What `ribbonbench solve` says, draws and writes of a tape spring beyond what every state has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from compare.measure.grid import Grid
from compare.models.base import State
from compare.page import wording
from compare.page.drawing import pictured
from compare.page.page import Picture
from compare.page.remedies import message
from compare.page.si import array_with_si
from compare.pages.export.formats import array_csv
from compare.pages.presenter import Presenter
from compare.pages.result import spent
from compare.pages.written import Written, write_any
from compare.scene.scene import Scene
from compare.scene.units import Units
from compare.store.store import atomic_write_bytes

PICTURE, PATH = "tape.png", "path.csv"

#: Columns of path.csv with their units; the others are numbers, angles in rad or words.
UNITS = {
    "end_z": "l", "end_y": "l", "force_z": "D w / l^2", "force_y": "D w / l^2", "moment_start": "moment",
    "moment_end": "moment", "fold": "l", "flattest": "1/l",
}  # fmt: skip


def explained(effects: Sequence[Mapping[str, Any]], without: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of the result.json of `explain`: the effects, and the solves without each."""
    rows = [
        {"name": name, "status": off.status, "iterations": off.iterations, "seconds": off.warm, "moves": off.moved}
        for name, off in without.items()
    ]
    return {"command": "explain", "effects": list(effects), "without": rows}


def write(out: Path, scene: Scene, state: State, grid: Grid) -> Written:
    """tape.vtu, centreline.csv, path.csv and tape.png."""
    common = write_any(out, scene, state, grid)
    files = dict(common.files)
    if state.log:
        names = [name for name in state.log[0] if name not in ("accepted",)]
        table = np.array([[float(row[name]) for name in names] for row in state.log])
        units = {name: unit for name, unit in UNITS.items() if name in names}
        atomic_write_bytes(out / PATH, array_csv(*array_with_si(names, table, units, scene.units)))
        files[PATH] = "every point of the way: turns of the ends, force, moments, the fold"

    def draw() -> None:
        from compare.pages.pictures.tape import tape_picture

        tape_picture(out / PICTURE, scene, state)

    pictures: tuple[Picture, ...] = ()
    if state.shape is not None and state.log and pictured(draw):
        alt = f"Moment or force along the way, sections and the tape seen from the side; {message(state)}."
        caption = "Left: the way; middle: sections from the clamp to the fold; right: the tape seen along its width."
        pictures = (Picture(PICTURE, alt, caption),)
    return Written(files, pictures, common.surfaces)


def sentences(scene: Scene, state: State) -> list[str]:
    """The state in a sentence."""
    error = "unknown" if state.error is None else f"{state.error:.1e} l"
    return [f"Tape: {message(state)}; discretisation error {error}, {state.seconds.warm:.3g} s."]


def rows(scene: Scene, state: State, units: Units | None = None) -> list[tuple[str, str]]:
    """What `ribbonbench solve` prints of a tape."""
    units = units or scene.units
    found = [("status", message(state))]
    if state.energy is not None:
        found.append(("energy", wording.energies(state.energy.to_dict(), units, state.errors.get("energy", {}))))
    if state.is_equilibrium and state.end is not None:
        found.append(("s = l", wording.place(np.asarray(state.end.position), units)))
        found += wording.supports(state, units)
        if "fold" in state.numbers:
            place = wording.length(units, state.numbers["fold"])
            across = state.numbers["flattest"] / (scene.transverse_curvature or 1.0)
            found.append(("flattest section", f"at s = {place}, {across:.2g} of its curvature at rest"))
    found.append(("residual", f"{state.residual:.1e} after {state.iterations} iterations"))
    found.append(("elements", f"{state.size.label}, {state.unknowns} unknowns"))
    found.append(("discretisation error", "unknown" if state.error is None else wording.length(units, state.error)))
    found.append(("time", spent(state.seconds)))
    return found


PRESENTER = Presenter(rows=rows, sentences=sentences, write=write, explained=explained)
