"""What `ribbonbench solve` says, draws and writes of an elastica beyond what every state has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from compare.measure.grid import Grid
from compare.models.base import BESIDE, State
from compare.models.scope import beyond_the_ribbon
from compare.page import wording
from compare.page.drawing import pictured
from compare.page.page import Picture
from compare.page.remedies import message
from compare.pages.presenter import Presenter
from compare.pages.result import spent
from compare.pages.written import Written
from compare.scene.scene import Scene
from compare.scene.units import Units
from ribbonbench.errors import BadInput

PICTURE = "elastica.png"

BEGAN = {
    "natural": "the natural shape, the loads raised",
    "seed": "the seed as natural shape, then straightened and loaded",
    "path": "the seed, then the stages of the path",
    BESIDE: "the ribbon's shape",
}
"""Where an elastica began, in words."""


def explained(effects: Sequence[Mapping[str, Any]], without: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of the result.json of `explain` that only an elastica has; effects as in its `explanation`, without: solves
    by the name of the effect that is off."""
    rows = [
        {"name": name, "status": off.status, "iterations": off.iterations, "seconds": off.warm, "moves": off.moved}
        for name, off in without.items()
    ]
    return {"command": "explain", "effects": list(effects), "without": rows}


def no_surface(scene: Scene) -> BadInput:
    """Why there is nothing to export, and what to do."""
    return BadInput(
        "model.energy", scene.model.energy, "has a centreline and no surface",
        "the ribbon does not know all that the scene asks for: use the numbers of ribbonbench solve"
        if beyond_the_ribbon(scene) is not None
        else "export with --set 'model.energy=\"wunderlich\"'",
    )  # fmt: skip


def write(out: Path, scene: Scene, state: State, grid: Grid) -> Written:
    """elastica.png: a planar curve, no surface."""

    def draw() -> None:
        from compare.pages.pictures.elastica import elastica_picture

        elastica_picture(out / PICTURE, scene, state)

    drawn = pictured(draw)
    end = state.end
    assert end is not None
    alt = (
        "Angle of the tangent along the elastica, and its shape; the end stands at "
        f"({', '.join(f'{c + 0.0:.3f}' for c in end.position)}) l."
    )
    caption = "The elastica: angle of the tangent along it, and its shape in its plane."
    return Written({}, (Picture(PICTURE, alt, caption),) if drawn else ())


def sentences(scene: Scene, state: State) -> list[str]:
    """The state in a sentence."""
    error = "unknown" if state.error is None else f"{state.error:.1e} l"
    return [f"Elastica: {message(state)}; discretisation error {error}, {state.seconds.warm * 1e3:.3g} ms."]


def rows(scene: Scene, state: State, units: Units | None = None) -> list[tuple[str, str]]:
    """What `ribbonbench solve` prints of an elastica: name and text, of a state that is no equilibrium nothing about
    its place. units: in which forces stand first; None: the scene's."""
    units = units or scene.units
    energy, end = state.energy, state.end
    assert energy is not None
    assert end is not None
    values = {name: value for name, value in energy.to_dict().items() if name in ("elastic", "gravity", "tip")}
    hangs = scene.tip is not None and scene.tip.force is None and scene.tip.tension is None
    force = np.array([scene.tip_load]) if hangs else scene.tip_force
    load = [("load at the tip", wording.force(force, units))] if scene.tip is not None else []
    place = [
        ("energy", wording.energies(values, units, state.errors.get("energy", {}))),
        ("s = l", wording.place(end.position, units)),
        *wording.supports(state, units),
    ]
    return [
        ("status", message(state)),
        *(place if state.is_equilibrium else []),
        *load,
        *(_touched(state, units) if state.is_equilibrium else []),
        ("residual", f"{state.residual:.1e} after {state.iterations} iterations"),
        ("began at", BEGAN[state.start]),
        ("discretisation error", "unknown" if state.error is None else wording.length(units, state.error)),
        ("time", spent(state.seconds)),
    ]


def _touched(state: State, units: Units) -> list[tuple[str, str]]:
    """What touches what, and with which force."""
    r, found = state.native, []
    own = [touch for touch in r.touches if touch.barrier is None]
    if r.problem.apart is not None:
        text = "nowhere"
        if own:
            most = max(own, key=lambda touch: touch.push)
            pushes = wording.force(np.array([sum(touch.push for touch in own)]), units)
            where = f"s = {units.text(most.s, 'l', 4)} and {units.text(most.other, 'l', 4)}"
            text = f"at {len(own)} pair{'s' * (len(own) > 1)} of places, {pushes} in all, most at {where}"
        found.append(("touches itself", text))
    for wall in state.supports.walls:
        text = f"{wording.force(wall['force'], units)}; {len(wall['points'])} points in contact"
        found.append((f"force of obstacle {wall['name']}", text))
    if r.through is not None:
        found.append(("nearer than it may be", f"at most {wording.length(units, r.through)}, anywhere along the strip"))
    return found


PRESENTER = Presenter(rows=rows, sentences=sentences, write=write, explained=explained, no_surface=no_surface)
