"""The page (page.json) of `ribbonbench shell`. Neither the ribbon nor its numba and Ipopt are imported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from compare.page.page import Page, Picture, Surface, Table
from compare.scene.scene import Scene

LEGEND = (
    "Energies in D w / l without the constant of the natural curvature, positions in l; membrane and shear: shares of "
    "the elastic energy; error: estimated from the last two meshes where a tolerance refines (Hausdorff / l); s: "
    "seconds of the solve, compilation apart."
)


def shell_page(
    scene: Scene, result: Mapping[str, Any], rows: Sequence[Sequence[str]], surfaces: Sequence[Surface], again: str
) -> Page:
    """result: its result.json; rows: what the command prints, headings first; surfaces: one per w/h, in order."""
    entries = result.get("rows", [result])
    headings, *lines = rows
    said = [f"w/h = {entry['width_to_thickness']:g}: {entry['status']}: {entry['message']}" for entry in entries]
    membrane = ", ".join(f"{100 * e['share']['membrane']:.3g} % at w/h = {e['width_to_thickness']:g}" for e in entries)
    picture = Picture(
        "shell.png",
        "The deformed shells in space and from the side, and the flat strip, coloured by the membrane's local share of "
        f"the elastic energy. Share over the strip: {membrane}.",
        "Shape and local share of the membrane energy.",
    )
    up = None if scene.up is None else tuple(float(c) for c in scene.up)
    files = {"result.json": "all numbers", "path.csv": "every step of the paths"}
    for surface in surfaces:
        files[surface.file] = f"{surface.label}: surface with energies (ParaView)"
        files[surface.file.removesuffix("vtu") + "npz"] = f"{surface.label}: nodes and directors (NumPy)"
    return Page(
        command="shell",
        title=scene.title,
        verdict=tuple(said),
        tables=(Table("Shells", tuple(headings), tuple(map(tuple, lines)), legend=LEGEND),),
        pictures=(picture,),
        surfaces=tuple(surfaces),
        files=files,
        scene=scene.to_toml(),
        up=up,  # type: ignore[arg-type]
        provenance=result["provenance"],
        again=again,
    )
