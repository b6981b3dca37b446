"""What has been written of a state, what is written of a state of any model, and the surfaces of a comparison."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.measure.grid import Grid
from compare.models import model
from compare.models.base import State
from compare.models.capabilities import Surrounds
from compare.page.page import PUSH, RUB, SHELL, STRIP, WALL, Picture, Surface
from compare.page.si import array_with_si
from compare.page.table import Table
from compare.pages.export import arrows
from compare.pages.export.formats import array_csv
from compare.pages.export.surfaces import write_shell, write_surface
from compare.pages.export.vtu import write_vtu
from compare.scene.scene import Scene
from compare.store.states import FILE as STATES
from compare.store.states import States
from compare.store.store import atomic_write_bytes
from compare.store.touches import Touches

if TYPE_CHECKING:
    from compare.studies.compare import Comparison

FloatArray = NDArray[np.float64]

#: Points of a centreline file.
LINE_POINTS = 401
_LENGTHS = dict.fromkeys(("s", "x", "y", "z"), "l")


@dataclass(frozen=True)
class Written:
    """Files with what is in them, pictures and surfaces, by names relative to the folder; data: of the files that are
    yet to be written, their tables."""

    files: Mapping[str, str] = field(default_factory=dict)
    pictures: tuple[Picture, ...] = ()
    surfaces: tuple[Surface, ...] = ()
    data: Mapping[str, Table] = field(default_factory=dict)


def write_any(out: Path, scene: Scene, state: State, grid: Grid) -> Written:
    """NAME.vtu, the surface with the model's fields, and centreline.csv; nothing where there is no shape."""
    if state.shape is None:
        return Written()
    name = f"{state.model}.vtu"
    write_surface(out / name, state.shape, grid)
    s = np.linspace(0.0, 1.0, LINE_POINTS)
    frames = state.shape.frames(s)
    columns = np.column_stack([s, state.shape.centreline(s), *(frames[:, :, column] for column in range(3))])
    names = ["s", "x", "y", "z", *(f"{axis}_{c}" for axis in ("tx", "ty", "tz") for c in "xyz")]
    atomic_write_bytes(out / "centreline.csv", array_csv(*array_with_si(names, columns, _LENGTHS, scene.units)))
    files = {name: "surface with fields (ParaView)", "centreline.csv": "centreline and frame"}
    return Written(files, (), (Surface(name, state.model, STRIP),))


def write_barriers(out: Path, scene: Scene, state: State, grid: Grid) -> tuple[Surface, ...]:
    """wall_NAME.vtu of all that the strip cannot cross, around it; nothing where its model does not tell."""
    found, own = model(state.model), []
    if not scene.barriers or state.shape is None or not isinstance(found, Surrounds):
        return ()
    nets = found.barriers(scene, state, grid.of(state.shape).reshape(-1, 3))
    for number, (name, net) in enumerate(zip(scene.barrier_names, nets, strict=False)):
        s, v = np.meshgrid(*(np.linspace(0.0, 1.0, n) for n in net.shape[:2]), indexing="ij")
        write_vtu(out / f"wall_{name}.vtu", net, {"S": s, "v": v})
        label = f"{'wall' if number < len(scene.walls) else 'obstacle'} {name.removeprefix('obstacle_')}"
        own.append(Surface(f"wall_{name}.vtu", label, WALL))
    return tuple(own)


def write_touches(out: Path, touches: Touches, points: FloatArray, states: States | None = None) -> tuple[Surface, ...]:
    """contacts.vtu and contacts_friction.vtu: arrows where the strip with these points (..., 3), in l, touches, of
    pushes and of friction to one scale; nothing where there are none. states: along a path, for its film."""
    found = []
    film = STATES if states is not None and len(states.t) > 1 and states.touches is not None else ""
    for kind, name, label in ((PUSH, "contacts", "pushes where it touches"), (RUB, "contacts_friction", "friction")):
        net = arrows.grid(touches, kind, arrows.extent_of(points), touches.largest)
        if not len(net):
            continue
        s, v = np.meshgrid(*(np.linspace(0.0, 1.0, n) for n in net.shape[:2]), indexing="ij")
        write_vtu(out / f"{name}.vtu", net, {"S": s, "v": v})
        moves = film if states is not None and film and arrows.moving(states, kind) is not None else ""
        found.append(Surface(f"{name}.vtu", label, kind, states=moves))
    return tuple(found)


def write_fast(out: Path, comparison: Comparison, ending: str = "", before: str = "") -> tuple[Surface, ...]:
    """The surface of the model beside the shells, where it has one; `ending` of the file's name, `before` the label."""
    fast, grid = comparison.fast, comparison.grid
    if fast.shape is None:
        return ()
    name = f"{fast.model}{ending}.vtu"
    write_surface(out / name, fast.shape, grid)
    around = () if ending else write_barriers(out, comparison.scene, fast, grid)
    return (Surface(name, f"{before}{fast.model}", STRIP), *around)


def write_shells(out: Path, comparison: Comparison, colour: str = "") -> tuple[Surface, ...]:
    """shell_wNNNN.vtu (NNNN: w/h) of every shell that has a surface; `colour`: the field to begin with."""
    found = []
    for row, state in zip(comparison.rows, comparison.shells, strict=True):
        if state.ok:
            ratio = row.width_to_thickness
            name = f"shell_w{ratio:g}.vtu"
            write_shell(out / name, state.native, comparison.grid)
            found.append(Surface(name, f"shell, w/h = {ratio:g}", SHELL, colour, width_to_thickness=ratio))
    return tuple(found)
