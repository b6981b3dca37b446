"""What there is to export in a folder of results, and writing it in the formats asked for. No solver is imported."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.page.page import ARROWS, PAGE, SHELL, STRIP, Page, Surface, read_page, write_page
from compare.page.study import Study
from compare.page.table import Column, Table
from compare.page.verdict import Verdict
from compare.pages.export import formats as export_formats
from compare.pages.export import gltf as export_gltf
from compare.pages.export.arrows import moving
from compare.pages.export.scale import Scale
from compare.pages.export.vtu import Sheet, read_vtu, vtu_bytes
from compare.store.arrays import npz_bytes
from compare.store.states import States, read_states
from compare.store.store import atomic_write_bytes, atomic_write_json, read_json
from ribbonbench.errors import BadInput

FORMATS = {
    "vtu": "each surface with its fields (ParaView)",
    "pvd": "collection of the VTU files, which come along; shells of several w/h as time steps (ParaView)",
    "obj": "each surface with material texture coordinates (Blender)",
    "ply": "each surface, binary, with fields and colours by vertex (Blender, MeshLab)",
    "gltf": "all surfaces in one .glb, with fields and colours by vertex; a path as an animation (Blender, browsers)",
    "csv": "points of each surface with fields; centreline and segments of the ribbon (spreadsheets)",
    "npz": "everything as arrays (NumPy)",
}
ARRAYS = "ribbon.npz"
#: Stem of the surface to which they belong.
RIBBON = STRIP
_RATIO = re.compile(r"_w([0-9.e+-]+)$")


@dataclass(frozen=True)
class Named:
    """A surface to export: stem of its files, label, kind, w/h of a shell when known, and the surface."""

    stem: str
    label: str
    kind: str
    ratio: float | None
    sheet: Sheet


@dataclass(frozen=True)
class Source:
    """A folder's surfaces; ribbon: arrays of its `ribbon.npz` (empty without); page: what the folder says of itself;
    scale: of the numbers in all of them; states: of the strip along its path, where the folder keeps them."""

    folder: Path
    surfaces: tuple[Named, ...]
    page: Page
    ribbon: dict[str, NDArray[Any]] = field(default_factory=dict)
    result: dict[str, Any] = field(default_factory=dict)
    scale: Scale = field(default_factory=Scale)
    states: States | None = None

    @property
    def has_ribbon(self) -> bool:
        """Whether one of the surfaces is that of the ribbon on curvature elements."""
        return any(found.stem == RIBBON for found in self.surfaces)


def chosen(text: str | None) -> tuple[str, ...]:
    """The formats of a list with commas, all without one; `BadInput` names the known ones."""
    if text is None:
        return tuple(FORMATS)
    names = [name.strip().lower() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in FORMATS:
            raise BadInput("--format", name, "is not a known format", f"known: {', '.join(FORMATS)}")
    if not names:
        raise BadInput("--format", text, "names no format", f"known: {', '.join(FORMATS)}")
    return tuple(dict.fromkeys(names))


def results_in(folder: Path) -> Path:
    """The folder itself, or where it has no results the first command's folder in it that has surfaces."""
    if (folder / PAGE).is_file():
        return folder
    able = [folder / command for command in ("solve", "compare", "shell", "limits", "converge")]
    return next((place for place in able if (place / PAGE).is_file()), folder)


def read_source(folder: Path) -> Source:
    """The surfaces of a folder, those its page names, otherwise its VTU files; `BadInput` when there are none."""
    page = read_page(folder)
    listed = page.surfaces or tuple(_surface(path.name) for path in sorted(folder.glob("*.vtu")))
    if not listed:
        raise BadInput(
            "SOURCE", str(folder), "has no surfaces to export",
            "give a folder that ribbonbench solve, shell or compare has written, or a scene",
        )  # fmt: skip
    found = []
    for surface in listed:
        path = inside(folder, surface.file)
        stem = Path(surface.file).with_suffix("").as_posix().replace("/", "_")
        found.append(Named(stem, surface.label, surface.kind, surface.width_to_thickness, read_vtu(path)))
    ways = [read_states(inside(folder, surface.states)) for surface in listed if surface.states]
    source = Source(folder, tuple(found), page, {}, _result(folder), states=ways[0] if ways else None)
    return replace(source, ribbon=_ribbon(folder)) if source.has_ribbon else source


def inside(folder: Path, name: str) -> Path:
    """The file `name` of a folder; `BadInput` when it is not there or would lie elsewhere."""
    path = folder / name
    if os.path.isabs(name) or ".." in Path(name).parts:
        raise BadInput("FOLDER", str(folder), f"its page.json names {name!r}, outside the folder", "make it again")
    if not path.is_file():
        raise BadInput(
            "FOLDER", str(folder), f"its page.json names {name!r}, which is not there", "run the command again"
        )
    return path


def _surface(name: str) -> Surface:
    stem = Path(name).stem
    ratio = _RATIO.search(stem)
    kind = SHELL if stem.startswith(SHELL) else STRIP
    number = float(ratio[1]) if ratio else None
    label = f"shell, w/h = {number:g}" if number else stem
    return Surface(name, label, kind, width_to_thickness=number)


def _ribbon(folder: Path) -> dict[str, NDArray[Any]]:
    path = folder / ARRAYS
    if not path.is_file():
        return {}
    try:
        with np.load(path, allow_pickle=False) as data:
            return dict(data)
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise BadInput("SOURCE", str(folder), f"{ARRAYS} cannot be read ({error})", "run the command again") from None


def _result(folder: Path) -> dict[str, Any]:
    try:
        found = read_json(folder / "result.json")
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def scaled(source: Source, scale: Scale) -> Source:
    """The source with its surfaces and the ribbon's arrays at a scale."""
    surfaces = tuple(replace(found, sheet=scale.sheet(found.sheet)) for found in source.surfaces)
    states = source.states
    if states is not None:  # alike: the states of one strip
        size = scale.length
        touches = states.touches
        if touches is not None:
            touches = tuple(replace(one, points=size * one.points) for one in touches)
        states = replace(states, s=size * states.s, v=size * states.v, points=size * states.points, touches=touches)
    return replace(source, surfaces=surfaces, ribbon=scale.arrays(source.ribbon), scale=scale, states=states)


def write(out: Path, source: Source, formats: Sequence[str]) -> dict[str, str]:
    """Writes the files, each atomically, and returns their names with what is in them."""
    files: dict[str, str] = {}

    def put(name: str, content: bytes, what: str) -> None:
        atomic_write_bytes(out / name, content)
        files[name] = what

    for found in source.surfaces:
        stem, label, sheet = found.stem, found.label, found.sheet
        if "vtu" in formats or "pvd" in formats:
            put(f"{stem}.vtu", vtu_bytes(sheet), f"{label}: surface with fields, VTU")
        if "obj" in formats:
            put(f"{stem}.obj", export_formats.obj_bytes(sheet, label, source.scale.unit), f"{label}: surface, OBJ")
        if "ply" in formats:
            put(f"{stem}.ply", export_formats.ply_bytes(sheet, source.scale.unit), f"{label}: surface with fields, PLY")
        if found.kind in ARROWS:
            continue  # their points are no one's; contacts.csv has the places
        if "csv" in formats:
            put(f"{stem}_points.csv", export_formats.points_csv(sheet), f"{label}: points with fields, CSV")
        if "npz" in formats:
            arrays: dict[str, Any] = export_formats.sheet_arrays(sheet)
            arrays |= source.ribbon if stem == RIBBON else {}
            put(f"{stem}.npz", npz_bytes(arrays), f"{label}: everything, NPZ")
    if "pvd" in formats:
        put("surfaces.pvd", export_formats.pvd_bytes(_steps(source.surfaces)), "the VTU files as a collection, PVD")
    if "gltf" in formats:
        named = [(found.label, found.sheet) for found in source.surfaces]
        content = export_gltf.glb_bytes(named, source.page.up, source.page.title)
        put("surfaces.glb", content, "all surfaces with fields, binary glTF 2.0")
        path = source.states
        if path is not None and len(path.t) > 1:
            film = export_gltf.film_bytes(
                path.points, (path.s, path.v), path.seconds, source.page.up, source.page.title,
                [(kind, own.points) for kind in ARROWS if (own := moving(path, kind)) is not None],
            )  # fmt: skip
            put("path.glb", film, f"{len(path.t)} states of the path as an animation, binary glTF 2.0")
    if "csv" in formats and source.ribbon:
        put("centreline.csv", export_formats.line_csv(source.ribbon), "centreline of the ribbon, CSV")
        put("segments.csv", export_formats.segments_csv(source.ribbon), "segments of the ribbon, CSV")
    if "csv" in formats and (source.ribbon or "strips" in source.result):
        units, scale = source.result.get("units") or {}, source.scale
        newtons = float(units["force_N"]) if units.get("known") and scale.unit != "l" else 1.0
        touching = export_formats.contacts_csv(source.result, scale.length, newtons)
        if touching is not None:
            put("contacts.csv", touching, "where it touches, with the pushes, CSV")
    return files


def _steps(surfaces: Sequence[Named]) -> list[tuple[float, int, str, str]]:
    """(time, part, label, file) of a collection: one time step for each w/h, the others as parts of every step."""
    ratios = sorted({found.ratio for found in surfaces if found.ratio is not None})
    entries = []
    for time in ratios or [0.0]:
        shown = [found for found in surfaces if found.ratio is None or found.ratio == time]
        entries += [(time, part, found.label, f"{found.stem}.vtu") for part, found in enumerate(shown)]
    return entries


_FILES = (
    Column("file", "file", kind="word"),
    Column("what", "what", kind="word"),
    Column("size", "KiB", "KiB", "decimals:0"),
)


def sizes(out: Path, files: Mapping[str, str]) -> Table:
    """The files of an export with their sizes."""
    return Table(
        "Files", _FILES, tuple((name, what, (out / name).stat().st_size / 1024) for name, what in files.items())
    )


def answer(source: Source, files: Mapping[str, str]) -> Verdict:
    """What was written, with the verdict on the results that it was made from."""
    count = f"{len(source.surfaces)} surface{'s' if len(source.surfaces) != 1 else ''}"
    written = f"{count} written as {len(files)} file{'s' if len(files) != 1 else ''}"
    shown = source.page.verdict
    return (
        Verdict(written)
        if shown is None
        else Verdict(f"{written}; of what it shows: {shown.text}", shown.grade, shown.checks)
    )


def write_page_of(out: Path, source: Source, files: dict[str, str], again: str) -> None:
    """page.json and result.json of the export: the source's result with the list of files."""
    page = source.page
    kept = {found.stem: surface for found, surface in zip(source.surfaces, page.surfaces, strict=False)}
    shown = tuple(
        Surface(f"{stem}.vtu", s.label, s.kind, s.colour, s.width_to_thickness)
        for stem, s in kept.items()
        if f"{stem}.vtu" in files
    )
    text = f"{len(files)} files of {len(source.surfaces)} surfaces. {source.scale.words}"
    verdict = answer(source, files)
    study = Study("export", page.title, (sizes(out, files),), verdict, (text,), surfaces=shown, files=files)
    exported = replace(study.page(again, page.provenance), scene=page.scene, up=page.up)
    more = {"exported": files, "scale": source.scale.to_dict(), "answer": verdict}
    atomic_write_json(out / "result.json", {**source.result, **more})
    write_page(out, exported)
