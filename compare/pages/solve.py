"""What `ribbonbench solve` writes: result.json, the model's own files and pictures, page.json."""

from __future__ import annotations

from pathlib import Path

from compare.measure.grid import Grid
from compare.models.base import State
from compare.page.remedies import message
from compare.page.study import RESULT, Study
from compare.page.table import Column, Table
from compare.pages.result import presenter, spent, state_result
from compare.pages.written import write_any
from compare.scene.scene import Scene
from compare.store.store import atomic_write_json

#: Names and texts: each row has a unit, or several values, of its own.
_LISTED = Column("quantity", "quantity", kind="word"), Column("value", "value", kind="word")


def rows(scene: Scene, state: State) -> list[tuple[str, str]]:
    """What the command prints: name and text."""
    own = presenter(state)
    if own is not None:
        return list(own.rows(scene, state))
    energy = {} if state.energy is None else state.energy.to_dict()
    found = [
        ("status", message(state)),
        ("residual", f"{state.residual:.1e} after {state.iterations} iterations" if state.residual else "-"),
        ("energy / (D w / l)", ", ".join(f"{name} {value:.6f}" for name, value in energy.items() if value is not None)),
    ]
    for name, pose in (("middle", state.middle), ("end", state.end)):
        if pose is not None:
            found.append((f"{name} / l", " ".join(f"{c + 0.0:.6f}" for c in pose.position)))
    found.append(("model", f"{state.model}, {state.size.label} elements"))
    found.append(("discretisation error", "unknown" if state.error is None else f"{state.error:.1e} l"))
    found.append(("time", spent(state.seconds)))
    return found


def sentences(scene: Scene, state: State) -> list[str]:
    """The state in sentences."""
    own = presenter(state)
    if own is not None:
        return list(own.sentences(scene, state))
    error = "unknown" if state.error is None else f"{state.error:.1e} l"
    return [f"{state.model}: {state.message}; discretisation error {error}, {state.seconds.warm * 1e3:.3g} ms."]


def write(out: Path, scene: Scene, state: State, again: str) -> None:
    """result.json first, then the files and pictures of the model, and page.json."""
    result = state_result(scene, state)
    atomic_write_json(out / RESULT, result)
    grid = Grid.for_shape(scene, state.shape.bend if state.shape is not None else 1.0)
    own = presenter(state)
    written = (write_any if own is None else own.write)(out, scene, state, grid)
    Study(
        "solve",
        scene.title,
        tables=(Table(f"The {state.model}", _LISTED, tuple(rows(scene, state))),),
        sentences=tuple(sentences(scene, state)),
        pictures=written.pictures,
        surfaces=written.surfaces,
        data=written.data,
        files={"result.json": "all numbers", **written.files},
    ).write(out, result, again, scene)
