"""What `ribbonbench shell` says, draws and writes of shells.

Neither the ribbon nor its numba and Ipopt are imported.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from compare.measure.energy_map import Mapped, by_name, density_on_grid
from compare.measure.grid import Grid
from compare.models.base import State
from compare.models.quantities import Answered
from compare.models.quantities.shell import QUANTITIES
from compare.models.shell_process import LoadStep
from compare.page.page import SHELL as SHELL_SURFACE
from compare.page.page import Picture, Surface
from compare.page.si import for_reader, with_si
from compare.page.state import DIMENSIONS, STATE
from compare.page.study import Study
from compare.page.table import Table
from compare.page.verdict import Verdict
from compare.pages.export.vtu import write_vtu
from compare.pages.presenter import Presenter
from compare.pages.solve import answer as state_answer
from compare.pages.written import Written, write_barriers
from compare.record import views
from compare.record.quantity import Part, Quantity, joined, pick
from compare.scene.scene import Scene
from compare.scene.units import Units
from compare.store.made_by import SHELL_RUN, provenance

#: The command, and what its files are called by.
COMMAND = "shell"
PICTURE = "shell.png"
MESH_PICTURE = "mesh.png"


def _error(a: Answered) -> Any:
    """The error of the shape; where the mesh was refined for something else, of that."""
    own = a.state.error
    return (a.state.native.report.discretisation or {}).get("estimate") if own is None else own


_ALL = joined(STATE, QUANTITIES)
#: What a result says once of all its shells, and what a shell has not.
_ONCE = {"scene", "title", "provenance", "refinements", "branch", "left_saddle"}
_ONCE |= {quantity.key for quantity in DIMENSIONS} - {"width_to_thickness"}
SHELL: tuple[Quantity[Answered], ...] = tuple(quantity for quantity in _ALL if quantity.key not in _ONCE)
_COLUMNS: tuple[Quantity[Answered], ...] = (
    *pick(SHELL, "width_to_thickness"),
    *(replace(quantity, rank=1, note="") for quantity in pick(SHELL, "status")),
    *pick(SHELL, "share", "energy", "middle", "end", "model.elements"),
    Quantity("error", "error", "l", "exponent:1", legend="of the discretisation, by another mesh or by refinement: "
             "Hausdorff / l, or of what shell.goal says", rank=2, of=_error),
    *pick(SHELL, "seconds.warm", "reused"),
)  # fmt: skip
_LEGEND = "Energies in D w / l without the constant of the natural curvature, positions in l."


def _place(name: str) -> Quantity[tuple[float, LoadStep]]:
    parts = tuple(Part(axis, f"{name}_{axis}", f"{name} {axis}") for axis in "xyz")
    return Quantity(name, unit="l", kind="decimals:5", parts=parts, of=lambda at: at[1].values.get(name))


PATH: tuple[Quantity[tuple[float, LoadStep]], ...] = (
    Quantity("width_to_thickness", "w/h", kind="digits", rank=0, note="w/h", of=lambda at: at[0]),
    Quantity("stage", kind="word", of=lambda at: at[1].stage),
    Quantity("method", kind="word", note="load step, arc length, ...", of=lambda at: at[1].method),
    Quantity("load", kind="digits", note="part of the stage aimed at", of=lambda at: at[1].load),
    Quantity("accepted", kind="truth", of=lambda at: at[1].accepted),
    Quantity("iterations", kind="integer", of=lambda at: at[1].iterations),
    Quantity("factorisations", kind="integer", of=lambda at: at[1].factorisations),
    Quantity("seconds", "s", "s", "seconds", rank=3, of=lambda at: at[1].seconds),
    Quantity("correction", kind="exponent:1", note="of the last Newton step", of=lambda at: at[1].correction),
    Quantity("negative", kind="integer", note="eigenvalues below 0", of=lambda at: at[1].negative),
    Quantity("note", kind="word", note="why it was cut back", of=lambda at: at[1].note),
    *(_place(place) for place in ("middle", "end")),
)


def ratio_of(state: State) -> float:
    """w/h of a shell, as its problem has it."""
    return float(state.native.report.width_to_thickness)


# -- one shell --------------------------------------------------------------------------------------------------------


def rows(scene: Scene, state: State, units: Units | None = None) -> list[tuple[str, str]]:
    """What the command prints of one shell: name and text."""
    if state.shape is None:
        return [("status", f"{state.word}: {state.message}")]
    shown = table(scene, [state]).known()
    return list(zip((column.heading for column in shown.columns), shown.texts()[0], strict=True))


def sentences(scene: Scene, state: State) -> list[str]:
    """The state in a sentence."""
    if state.shape is None:
        return [f"Shell: {state.word}: {state.message}"]
    return [f"w/h = {ratio_of(state):g}: {state.word}: {state.message}"]


def write(out: Path, scene: Scene, state: State, grid: Grid) -> Written:
    """shell.npz and shell.vtu at the nodes of the mesh, path.csv, shell.png."""
    return write_states(out, scene, [state]) if state.shape is not None else Written()


# -- several shells ---------------------------------------------------------------------------------------------------


def document(scene: Scene, states: Sequence[State]) -> dict[str, Any]:
    """`result.json`: the keys of the last shell, all of them in `rows` where there are several."""
    units = scene.units
    entries = [{} if state.shape is None else views.document(SHELL, Answered(scene, state)) for state in states]
    several = len(entries) > 1
    report, last = states[-1].native.report, entries[-1]
    shell = report.provenance
    options = {**report.options.to_dict(), "processes": shell["processes"]}
    found = {"scene": scene.name, "title": scene.title, **last}
    if several:
        found["rows"] = [{**entry, "si": views.in_si(SHELL, entry, units)} for entry in entries]
    found |= {**views.document(DIMENSIONS, scene), **{k: v for k, v in last.items() if k == "width_to_thickness"}}
    found["si"] = views.in_si(SHELL, last, units)
    found["complete"] = all(state.ok for state in states)
    found["provenance"] = {**provenance(scene, options), SHELL_RUN: shell, "linear_solver": shell["linear_solver"]}
    return found


def path_table(states: Sequence[State]) -> Table:
    """Every attempt on the paths (`shellref.shell.result.LoadStep`), one row each."""
    steps = [(ratio_of(state), step) for state in states for step in state.native.report.steps]
    return Table.of("Steps of the paths", PATH, steps)


def write_surface(path: Path, case: Mapped) -> Path:
    """The surface at the nodes of the mesh as VTU: material coordinates, director; energies and shares by cell."""
    surface = case.surface
    s, v = np.meshgrid(surface.s_nodes, surface.v_nodes, indexing="ij")
    fields = {"S": s, "v": v, "director": surface.directors}
    k = surface.degree  # k squared cells an element
    density = np.repeat(np.repeat(density_on_grid(case), k, axis=0), k, axis=1)
    return write_vtu(path, surface.points, fields, by_name(density))


def write_states(out: Path, scene: Scene, states: Sequence[State]) -> Written:
    """The table of path.csv, shell.png; shell.npz and shell.vtu, where there are several states shell_wNNNN.* (w/h)."""
    from compare.pages.pictures import shell as shell_figure

    files, surfaces = {"path.csv": "every step of the paths"}, []
    for state in states:
        ratio = ratio_of(state)
        name = COMMAND if len(states) == 1 else f"shell_w{ratio:g}"
        label = f"shell, w/h = {ratio:g}"
        case = state.native
        midpoints, density = case.density()
        case.surface.save(out / f"{name}.npz", cell_midpoints=midpoints, energy_density=density)
        write_surface(out / f"{name}.vtu", case)
        surfaces.append(Surface(f"{name}.vtu", label, SHELL_SURFACE, "membrane_share", ratio))
        files[f"{name}.vtu"] = f"{label}: surface with energies (ParaView)"
        files[f"{name}.npz"] = f"{label}: nodes and directors (NumPy)"
    if len(states) == 1 and states[0].shape is not None:
        around = write_barriers(out, scene, states[0], Grid.for_shape(scene, states[0].shape.bend))
        surfaces += around
        files |= {one.file: f"{one.label}, where the strip ends (ParaView)" for one in around}
    shell_figure.picture(out / PICTURE, scene, [(ratio_of(state), state.native) for state in states])
    graded = [(ratio_of(s), s.native.report.discretisation) for s in states if goal_of(s) is not None]
    pictures: tuple[Picture, ...] = (picture(states),)
    if graded:
        shell_figure.mesh_picture(out / MESH_PICTURE, scene, graded)
        pictures = (*pictures, _mesh_picture(graded))
    return Written(files, pictures, tuple(surfaces), {"path.csv": with_si(path_table(states), scene.units)})


def goal_of(state: State) -> str | None:
    """What the mesh was refined for, column by column (`shell.goal`); None: nothing of that kind."""
    found = (state.native.report.discretisation or {}).get("goal")
    return None if found is None else str(found)


def _mesh_picture(graded: Sequence[tuple[float, Mapping[str, Any]]]) -> Picture:
    said = ", ".join(
        f"{len(data['columns'])} x {len(data['rows'])} at w/h = {ratio:g} (error of the {data['goal']} about "
        f"{data['estimate']:.2g})"
        for ratio, data in graded
    )
    return Picture(
        MESH_PICTURE,
        f"The graded meshes on the flat strip: {said}; bars: what each column and row contributes to that error, by "
        "dual-weighted residuals.",
        "Graded mesh with the indicators of its columns and rows.",
    )


def picture(states: Sequence[State]) -> Picture:
    """`compare.pages.pictures.shell` in words."""
    shares = [(100 * state.native.report.share["membrane"], ratio_of(state)) for state in states]
    membrane = ", ".join(f"{share:.3g} % at w/h = {ratio:g}" for share, ratio in shares)
    return Picture(
        PICTURE,
        "The deformed shells in space and from the side, and the flat strip, coloured by the membrane's local share of "
        f"the elastic energy. Share over the strip: {membrane}.",
        "Shape and local share of the membrane energy.",
    )


def table(scene: Scene, states: Sequence[State]) -> Table:
    """One row for each shell."""
    return Table.of("Shells", _COLUMNS, [Answered(scene, state) for state in states], _LEGEND)


def answer(scene: Scene, states: Sequence[State], units: Units | None = None) -> Verdict:
    """Whether every shell is in a stable equilibrium, where, and how accurately: of the thinnest one; of the first that
    is none."""
    bad = [state for state in states if not state.ok]
    shown = bad[0] if bad else max(states, key=ratio_of)
    found = state_answer(scene, shown, units, COMMAND)
    if shown.shape is None:
        return found
    return Verdict(
        f"Shell, w/h = {ratio_of(shown):g}: {found.text[:1].lower()}{found.text[1:]}", found.grade, found.checks
    )


def write_all(out: Path, scene: Scene, states: Sequence[State], again: str = "") -> None:
    """result.json, page.json and the files of `write_states`. again: as of `Page`."""
    written = write_states(out, scene, states)
    Study(
        COMMAND,
        scene.title,
        verdict=answer(scene, states),
        tables=(for_reader(table(scene, states), scene.units),),
        sentences=tuple(said for state in states for said in sentences(scene, state)),
        pictures=written.pictures,
        surfaces=written.surfaces,
        data=written.data,
        files={"result.json": "all numbers", **written.files},
    ).write(out, document(scene, states), again, scene)


PRESENTER = Presenter(rows=rows, sentences=sentences, write=write)
