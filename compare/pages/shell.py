"""The files and the page of `ribbonbench shell`. Neither the ribbon nor its numba and Ipopt are imported."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from compare.export.vtu import write_vtu
from compare.measure.energy_map import by_name, density_on_grid
from compare.models.shell_here import ShellRun, result
from compare.models.shell_process import ShellCase
from compare.page.page import Picture, Surface
from compare.page.study import Study
from compare.page.table import Column, ColumnOf, Table
from compare.pictures import shell as shell_figure
from compare.scene.scene import Scene
from compare.store.store import atomic_write_bytes

Entry = Mapping[str, Any]


def _of(name: str, part: str) -> Callable[[Entry], Any]:
    return lambda entry: (entry[name] or {}).get(part)


_COLUMNS: tuple[ColumnOf[Entry], ...] = (
    (Column("width_to_thickness", "w/h", kind="digits"), lambda e: e["width_to_thickness"]),
    (Column("status", "status", kind="word"), lambda e: e["status"]),
    (Column("share.membrane", "membrane %", kind="share", legend="share of the elastic energy"),
     _of("share", "membrane")),
    (Column("share.shear", "shear %", kind="share", legend="the same"), _of("share", "shear")),
    (Column("energy.elastic", "elastic", "D w / l", "digits:6"), _of("energy", "elastic")),
    (Column("energy.gravity", "gravity", "D w / l", "digits:6"), _of("energy", "gravity")),
    (Column("middle", "middle / l", "l", "decimals:5"), _of("middle", "position")),
    (Column("end", "end / l", "l", "decimals:5"), _of("end", "position")),
    (Column("elements", "elements", kind="sizes"), lambda e: e["model"]["elements"]),
    (Column("error", "error", "l", "exponent:1", legend="estimated from the last two meshes where a tolerance refines "
            "(Hausdorff / l)"), _of("discretisation", "estimate")),
    (Column("seconds", "s", "s", "seconds:3", legend="of the solve, compilation apart"), _of("seconds", "warm")),
    (Column("reused", "kept", kind="truth", legend="solved by an earlier run"), lambda e: e["reused"]),
)  # fmt: skip
_LEGEND = "Energies in D w / l without the constant of the natural curvature, positions in l."


def table(document: Entry) -> Table:
    """One row for each shell of a result.json."""
    return Table.of("Shells", _COLUMNS, document.get("rows", [document]), _LEGEND)


_PLACES = tuple((place, axis) for place in ("middle", "end") for axis in range(3))
_PATH: tuple[ColumnOf[tuple[float, Entry]], ...] = (
    (Column("width_to_thickness", "w/h", kind="digits"), lambda at: at[0]),
    *(
        (column, lambda at, key=column.key: at[1][key])
        for column in (
            Column("stage", "stage", kind="word"),
            Column("method", "method", kind="word"),
            Column("load", "load", kind="digits"),
            Column("accepted", "accepted", kind="truth"),
            Column("iterations", "iterations", kind="integer"),
            Column("factorisations", "factorisations", kind="integer"),
            Column("seconds", "s", "s", "seconds"),
            Column("correction", "correction", kind="exponent:1"),
            Column("negative", "negative", kind="integer"),
            Column("note", "note", kind="word"),
        )
    ),
    *(
        (
            Column(f"{place}_{'xyz'[axis]}", f"{place} {'xyz'[axis]}", "l", "decimals:5"),
            lambda at, place=place, axis=axis: at[1]["values"].get(place, (None, None, None))[axis],
        )
        for place, axis in _PLACES
    ),
)


def path_table(runs: Sequence[ShellRun]) -> Table:
    """Every attempt on the paths (`shellref.shell.result.LoadStep`), one row each."""
    steps = [(found.width_to_thickness, step) for found in runs for step in found.case.data["steps"]]
    return Table.of("Steps of the paths", _PATH, steps)


def study(scene: Scene, document: Entry, path: Table, surfaces: Sequence[Surface]) -> Study:
    """document: its result.json; path: of `path_table`; surfaces: one per w/h, in order."""
    entries = document.get("rows", [document])
    membrane = ", ".join(f"{100 * e['share']['membrane']:.3g} % at w/h = {e['width_to_thickness']:g}" for e in entries)
    picture = Picture(
        "shell.png",
        "The deformed shells in space and from the side, and the flat strip, coloured by the membrane's local share of "
        f"the elastic energy. Share over the strip: {membrane}.",
        "Shape and local share of the membrane energy.",
    )
    files = {"result.json": "all numbers", "path.csv": "every step of the paths"}
    for surface in surfaces:
        files[surface.file] = f"{surface.label}: surface with energies (ParaView)"
        files[surface.file.removesuffix("vtu") + "npz"] = f"{surface.label}: nodes and directors (NumPy)"
    return Study(
        "shell",
        scene.title,
        tables=(table(document),),
        sentences=tuple(f"w/h = {e['width_to_thickness']:g}: {e['status']}: {e['message']}" for e in entries),
        pictures=(picture,),
        surfaces=tuple(surfaces),
        data={"path.csv": path},
        files=files,
    )


def write_surface(path: Path, case: ShellCase) -> Path:
    """The surface at the nodes of the mesh as VTU: material coordinates, director; energies and shares by cell."""
    surface = case.surface
    s, v = np.meshgrid(surface.s_nodes, surface.v_nodes, indexing="ij")
    fields = {"S": s, "v": v, "director": surface.directors}
    k = surface.degree  # k squared cells an element
    density = np.repeat(np.repeat(density_on_grid(case), k, axis=0), k, axis=1)
    return write_vtu(path, surface.points, fields, by_name(density))


def write(out: Path, scene: Scene, runs: Sequence[ShellRun], again: str = "") -> Study:
    """result.json, page.json, path.csv, shell.png; shell.npz and shell.vtu, where there are several runs shell_wNNNN.*
    (w/h). again: the command line that remakes them."""
    surfaces = []
    for found in runs:
        name = "shell" if len(runs) == 1 else f"shell_w{found.width_to_thickness:g}"
        assert found.case.folder is not None
        atomic_write_bytes(out / f"{name}.npz", (found.case.folder / "shell.npz").read_bytes())
        write_surface(out / f"{name}.vtu", found.case)
        label = f"shell, w/h = {found.width_to_thickness:g}"
        surfaces.append(Surface(f"{name}.vtu", label, "shell", "membrane_share", found.width_to_thickness))
    shell_figure.picture(out / "shell.png", scene, [(f.width_to_thickness, f.case) for f in runs])
    document = result(scene, runs)
    found_all = study(scene, document, path_table(runs), surfaces)
    found_all.write(out, document, again, scene)
    return found_all
