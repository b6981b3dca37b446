"""What `ribbonbench shell` says, draws and writes of shells.

Neither the ribbon nor its numba and Ipopt are imported.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from compare.export.vtu import write_vtu
from compare.measure.energy_map import Mapped, by_name, density_on_grid
from compare.measure.grid import Grid
from compare.models.base import State
from compare.page.page import SHELL, Picture, Surface
from compare.page.si import dimensions, for_reader, si_of, with_si
from compare.page.study import Study
from compare.page.table import Column, ColumnOf, Table
from compare.page.verdict import Verdict
from compare.pages.presenter import Presenter
from compare.pages.result import errors_result
from compare.pages.solve import answer as state_answer
from compare.pages.written import Written
from compare.scene.scene import Scene
from compare.scene.units import Units
from compare.store.made_by import provenance

PICTURE = "shell.png"
MESH_PICTURE = "mesh.png"
Entry = Mapping[str, Any]


def _of(name: str, part: str) -> Callable[[Entry], Any]:
    return lambda entry: (entry[name] or {}).get(part)


def _error(entry: Entry) -> Any:
    """The error of the shape; where the mesh was refined for something else, of that."""
    own = entry["discretisation_error"]
    return (entry["discretisation"] or {}).get("estimate") if own is None else own


_COLUMNS: tuple[ColumnOf[Entry], ...] = (
    (Column("width_to_thickness", "w/h", kind="digits", rank=0), lambda e: e["width_to_thickness"]),
    (Column("status", "status", kind="word", rank=1), lambda e: e["status"]),
    (Column("share.membrane", "membrane %", kind="share", legend="share of the elastic energy", rank=1),
     _of("share", "membrane")),
    (Column("share.shear", "shear %", kind="share", legend="the same", rank=4), _of("share", "shear")),
    (Column("energy.elastic", "elastic", "D w / l", "digits:6"), _of("energy", "elastic")),
    (Column("energy.gravity", "gravity", "D w / l", "digits:6"), _of("energy", "gravity")),
    (Column("middle", "middle / l", "l", "decimals:5", rank=7), _of("middle", "position")),
    (Column("end", "end / l", "l", "decimals:5", rank=6), _of("end", "position")),
    (Column("elements", "elements", kind="sizes", rank=2), lambda e: e["model"]["elements"]),
    (Column("error", "error", "l", "exponent:1", legend="of the discretisation, by another mesh or by refinement: "
            "Hausdorff / l, or of what shell.goal says", rank=2), _error),
    (Column("seconds", "s", "s", "seconds:3", legend="of the solve, compilation apart", rank=3),
     _of("seconds", "warm")),
    (Column("reused", "kept", kind="truth", legend="solved by an earlier run", rank=6), lambda e: e["reused"]),
)  # fmt: skip
_LEGEND = "Energies in D w / l without the constant of the natural curvature, positions in l."


_PLACES = tuple((place, axis) for place in ("middle", "end") for axis in range(3))
_PATH: tuple[ColumnOf[tuple[float, Entry]], ...] = (
    (Column("width_to_thickness", "w/h", kind="digits", rank=0), lambda at: at[0]),
    *(
        (column, lambda at, key=column.key: at[1][key])
        for column in (
            Column("stage", "stage", kind="word"),
            Column("method", "method", kind="word"),
            Column("load", "load", kind="digits"),
            Column("accepted", "accepted", kind="truth"),
            Column("iterations", "iterations", kind="integer"),
            Column("factorisations", "factorisations", kind="integer"),
            Column("seconds", "s", "s", "seconds", rank=3),
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


def ratio_of(state: State) -> float:
    """w/h of a shell, as its problem has it."""
    problem = state.native.data["problem"]
    return float(f"{problem['width'] / problem['thickness']:.12g}")  # 50 and not 50.00000000000001


# -- one shell --------------------------------------------------------------------------------------------------------


def result(scene: Scene, state: State) -> dict[str, Any]:
    """The contract's keys of one shell; none of its own for one whose process died."""
    if state.shape is None:
        return {}
    data = state.native.data
    problem, spent = data["problem"], data["seconds"]
    start, end = (
        None if found is None else {"force": found.force.tolist(), "moment": found.moment.tolist()}
        for found in (state.supports.start, state.supports.end)
    )
    return {
        "width_to_thickness": ratio_of(state),
        "status": state.word,
        "message": state.message,
        "stable": state.stable,
        "negative_eigenvalues": data["negative_eigenvalues"],
        "lowest_eigenvalue": state.lowest_eigenvalue,
        "residual": state.residual,
        "residual_absolute": data["residual"]["absolute"],
        "iterations": state.iterations,
        "factorisations": data["factorisations"],
        "energy": {
            **({} if state.energy is None else state.energy.to_dict()),
            "elastic_with_constant": data["energy"]["elastic"],
        },
        "share": data["share"],
        "end": data["end"],
        "middle": data["middle"],
        "max_abs_eta": None,
        "max_abs_eta_prime_w_half": None,
        "forces": {"start": start and start["force"], "end": end and end["force"], "walls": []},
        "moments": {"start": start and start["moment"], "end": end and end["moment"]},
        "load_factor": data["load_factor"],
        "path_factor": data["path_factor"],
        "discretisation": data["discretisation"],
        "discretisation_error": state.error,
        "discretisation_error_why": state.error_why,
        **errors_result(state),
        "seconds": {"first": spent["total"], "warm": state.seconds.warm, "parts": spent},
        "memory_mb": data["memory_mb"],
        "model": {
            "energy": "naghdi",
            "formulation": data["options"]["iteration"],
            "elements": data["elements"],
            "unknowns": state.unknowns,
            "clamp": problem["clamp"],
            "corner": problem["corner"],
            "start_curvature": problem["start_curvature"],
        },
        "start": state.native.start,
        "reused": state.reused,
    }


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
    units = Units.of(scene)
    entries = [result(scene, state) for state in states]
    if len(entries) > 1:
        entries = [{**entry, "si": si_of(entry, units)} for entry in entries]
    data = states[-1].native.data
    shell = data["provenance"]
    options = {**data["options"], "processes": shell["processes"]}
    found = {"scene": scene.name, "title": scene.title, **entries[-1]}
    if len(entries) > 1:
        found["rows"] = entries
    found.update(_dimensions(scene, entries[-1]))
    found["complete"] = all(state.ok for state in states)
    found["provenance"] = {**provenance(scene, options), "shell": shell, "linear_solver": shell["linear_solver"]}
    return found


def _dimensions(scene: Scene, last: Entry) -> dict[str, Any]:
    """The scene's dimensions, w/h being the shell's own, and `si` of the last shell."""
    found = dimensions(scene)
    found["width_to_thickness"] = last.get("width_to_thickness", found["width_to_thickness"])
    return {**found, "si": si_of(last, Units.of(scene))}


def path_table(states: Sequence[State]) -> Table:
    """Every attempt on the paths (`shellref.shell.result.LoadStep`), one row each."""
    steps = [(ratio_of(state), step) for state in states for step in state.native.data["steps"]]
    return Table.of("Steps of the paths", _PATH, steps)


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
    from compare.pictures import shell as shell_figure

    files, surfaces = {"path.csv": "every step of the paths"}, []
    for state in states:
        ratio = ratio_of(state)
        name = "shell" if len(states) == 1 else f"shell_w{ratio:g}"
        label = f"shell, w/h = {ratio:g}"
        case = state.native
        midpoints, density = case.density()
        case.surface.save(out / f"{name}.npz", cell_midpoints=midpoints, energy_density=density)
        write_surface(out / f"{name}.vtu", case)
        surfaces.append(Surface(f"{name}.vtu", label, SHELL, "membrane_share", ratio))
        files[f"{name}.vtu"] = f"{label}: surface with energies (ParaView)"
        files[f"{name}.npz"] = f"{label}: nodes and directors (NumPy)"
    shell_figure.picture(out / PICTURE, scene, [(ratio_of(state), state.native) for state in states])
    graded = [(ratio_of(s), s.native.data["discretisation"]) for s in states if goal_of(s) is not None]
    pictures: tuple[Picture, ...] = (picture(states),)
    if graded:
        shell_figure.mesh_picture(out / MESH_PICTURE, scene, graded)
        pictures = (*pictures, _mesh_picture(graded))
    return Written(files, pictures, tuple(surfaces), {"path.csv": with_si(path_table(states), Units.of(scene))})


def goal_of(state: State) -> str | None:
    """What the mesh was refined for, column by column (`shell.goal`); None: nothing of that kind."""
    found = (state.native.data.get("discretisation") or {}).get("goal")
    return None if found is None else str(found)


def _mesh_picture(graded: Sequence[tuple[float, Entry]]) -> Picture:
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
    """`compare.pictures.shell` in words."""
    shares = [(100 * state.native.data["share"]["membrane"], ratio_of(state)) for state in states]
    membrane = ", ".join(f"{share:.3g} % at w/h = {ratio:g}" for share, ratio in shares)
    return Picture(
        PICTURE,
        "The deformed shells in space and from the side, and the flat strip, coloured by the membrane's local share of "
        f"the elastic energy. Share over the strip: {membrane}.",
        "Shape and local share of the membrane energy.",
    )


def table(scene: Scene, states: Sequence[State]) -> Table:
    """One row for each shell."""
    return Table.of("Shells", _COLUMNS, [result(scene, state) for state in states], _LEGEND)


def answer(scene: Scene, states: Sequence[State], units: Units | None = None) -> Verdict:
    """Whether every shell is in a stable equilibrium, where, and how accurately: of the thinnest one; of the first that
    is none."""
    bad = [state for state in states if not state.ok]
    shown = bad[0] if bad else max(states, key=ratio_of)
    found = state_answer(scene, shown, units, "shell")
    if shown.shape is None:
        return found
    return Verdict(
        f"Shell, w/h = {ratio_of(shown):g}: {found.text[:1].lower()}{found.text[1:]}", found.grade, found.checks
    )


def write_all(out: Path, scene: Scene, states: Sequence[State], again: str = "") -> None:
    """result.json, page.json and the files of `write_states`. again: as of `Page`."""
    written = write_states(out, scene, states)
    Study(
        "shell",
        scene.title,
        verdict=answer(scene, states),
        tables=(for_reader(table(scene, states), Units.of(scene)),),
        sentences=tuple(said for state in states for said in sentences(scene, state)),
        pictures=written.pictures,
        surfaces=written.surfaces,
        data=written.data,
        files={"result.json": "all numbers", **written.files},
    ).write(out, document(scene, states), again, scene)


PRESENTER = Presenter(result=result, rows=rows, sentences=sentences, write=write)
