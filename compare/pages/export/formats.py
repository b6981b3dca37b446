"""A triangulated surface in other programs' formats: OBJ, PLY, CSV, NPZ, and collections of VTU files (PVD)."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.pages.export.vtu import Sheet

FloatArray = NDArray[np.float64]

_PARTS = ("bending_energy", "membrane_energy", "shear_energy")
#: Fields that colour the vertices of PLY and glTF, the first that a surface has.
COLOURED_BY = ("energy_density", "membrane_share", "omega", "S")
_AXES = "xyz"


def sheet_arrays(sheet: Sheet) -> dict[str, NDArray[Any]]:
    """A surface as arrays: points (N, 3), triangles (T, 3), point_NAME by point, triangle_NAME by triangle, and shape
    (2,), points along and across, where the points are a grid."""
    shape = {} if sheet.shape is None else {"shape": np.array(sheet.shape)}
    points = {f"point_{name}": values for name, values in sheet.fields.items()}
    cells = {f"triangle_{name}": values for name, values in sheet.cells.items()}
    return {"points": sheet.points, "triangles": sheet.triangles, **shape, **points, **cells}


def texture_coordinates(sheet: Sheet) -> FloatArray | None:
    """(N, 2) in [0, 1]: S / l and (v + w / 2) / w, at any scale; None without material coordinates."""
    if "S" not in sheet.fields or "v" not in sheet.fields:
        return None
    s, v = sheet.fields["S"], sheet.fields["v"]
    return np.column_stack([(x - x.min()) / (float(np.ptp(x)) or 1.0) for x in (s, v)])


def colours(sheet: Sheet) -> tuple[str, NDArray[np.uint8]] | None:
    """The name of the field that colours the vertices and their colours (N, 3); None without such a field, or without
    matplotlib, whose colours they are.

    The scale leaves out half a per cent of the points at either end; what is not known is grey.
    """
    try:
        from matplotlib import colormaps
    except ModuleNotFoundError:
        return None
    scalars = sheet.scalars()
    for name in COLOURED_BY:
        values = scalars.get(name)
        if values is None or not np.isfinite(values).any():
            continue
        low, high = np.nanquantile(values, [0.005, 0.995])
        scaled = np.clip((values - low) / ((high - low) or 1.0), 0.0, 1.0)
        shades = colormaps["viridis"](np.where(np.isfinite(scaled), scaled, 0.0))[:, :3]
        shades[~np.isfinite(values)] = 0.6
        return name, np.round(255 * shades).astype(np.uint8)
    return None


def obj_bytes(sheet: Sheet, name: str, unit: str = "l") -> bytes:
    """Wavefront OBJ, unit: of the lengths: positions, normals, triangles; texture coordinates are the material ones."""
    texture = texture_coordinates(sheet)
    out = io.StringIO()
    out.write(f"# ribbonbench; lengths in {unit}\no {''.join(c if c.isalnum() else '_' for c in name)}\n")
    np.savetxt(out, sheet.points, fmt="v %.9g %.9g %.9g")
    if texture is not None:
        np.savetxt(out, texture, fmt="vt %.9g %.9g")
    np.savetxt(out, sheet.normals(), fmt="vn %.6f %.6f %.6f")
    corner = "%d/%d/%d" if texture is not None else "%d//%d"
    repeated = np.repeat(sheet.triangles + 1, corner.count("%d"), axis=1)
    np.savetxt(out, repeated, fmt=f"f {corner} {corner} {corner}")
    return out.getvalue().encode()


def ply_bytes(sheet: Sheet, unit: str = "l") -> bytes:
    """Binary little-endian PLY, unit: of the lengths: positions (double), normals, colours, s t texture coordinates,
    every scalar field and the components of every vector field as float properties NAME, NAME_x, ..."""
    columns: list[tuple[str, str, NDArray[Any]]] = []
    columns += [(axis, "<f8", sheet.points[:, k]) for k, axis in enumerate(_AXES)]
    columns += [(f"n{axis}", "<f4", sheet.normals()[:, k]) for k, axis in enumerate(_AXES)]
    texture = texture_coordinates(sheet)
    if texture is not None:
        columns += [("s", "<f4", texture[:, 0]), ("t", "<f4", texture[:, 1])]
    shades = colours(sheet)
    if shades is not None:
        columns += [(name, "u1", shades[1][:, k]) for k, name in enumerate(("red", "green", "blue"))]
    columns += [(name, "<f4", values) for name, values in _named(sheet, [name for name, _, _ in columns])]
    kinds = {"<f8": "double", "<f4": "float", "u1": "uchar"}
    vertices = np.empty(len(sheet.points), dtype=[(name, kind) for name, kind, _ in columns])
    for name, _, values in columns:
        vertices[name] = values
    faces = np.empty(len(sheet.triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, sheet.triangles
    header = ["ply", "format binary_little_endian 1.0", f"comment ribbonbench, lengths in {unit}"]
    header += [f"element vertex {len(vertices)}", *(f"property {kinds[kind]} {name}" for name, kind, _ in columns)]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    return "\n".join(header).encode("ascii") + vertices.tobytes() + faces.tobytes()


def _named(sheet: Sheet, taken: Sequence[str]) -> list[tuple[str, FloatArray]]:
    """Every field by its own name, vectors by components; in one word, and with a line below where the name is taken
    (a model's own field may be called x)."""
    found = list(sheet.scalars().items())
    for name, values in sheet.fields.items():
        if values.ndim == 2 and values.shape[1] == 3:
            found += [(f"{name}_{axis}", values[:, k]) for k, axis in enumerate(_AXES)]
    used, named = set(taken), []
    for name, values in found:
        word = one_word(name)
        while word in used:
            word += "_"
        used.add(word)
        named.append((word, values))
    return named


def one_word(name: str) -> str:
    """A field's name where a format has no room for blanks and commas."""
    return re.sub(r"[^\w.+-]+", "_", name)


def points_csv(sheet: Sheet) -> bytes:
    """x, y, z and every field, one line a point, names of the columns first; empty where a value is not known."""
    named = [(axis, sheet.points[:, k]) for k, axis in enumerate(_AXES)] + _named(sheet, _AXES)
    return array_csv([name for name, _ in named], np.column_stack([values for _, values in named]))


def line_csv(ribbon: Mapping[str, FloatArray]) -> bytes:
    """The centreline of a `ribbon.npz`: s, position, omega, eta, segment, energy_density (D w / l^2), frame, ruling; of
    one with a free twist tau in place of eta, the energy's parts beside it, and no ruling."""
    free = "line_tau" in ribbon
    second = "tau" if free else "eta"
    named = [(name, ribbon[f"line_{name}"]) for name in ("s", "position", "omega", second, "segment", "energy_density")]
    named += [(name, ribbon[f"line_{name}"]) for name in _PARTS if free]
    names = [part for name, _ in named for part in (_AXES if name == "position" else (name,))]
    parts = [values for _, values in named]
    for k, name in enumerate(("tx", "ty", "tz")):
        names += [f"{name}_{axis}" for axis in _AXES]
        parts.append(ribbon["line_frame"][:, :, k])
    if not free:
        names += [f"ruling_{axis}" for axis in _AXES]
        parts.append(ribbon["line_ruling"])
    return array_csv(names, np.column_stack(parts))


def segments_csv(ribbon: Mapping[str, FloatArray]) -> bytes:
    """The segments of a `ribbon.npz`: number, abscissa of its start, length, a, b, n, m (with a free twist that is bent
    in its own plane also c, d) and the start's position."""
    start = ribbon["joints"][:-1]
    own = ribbon["curvature_parameters" if "curvature_parameters" in ribbon else "parameters"]
    columns = [np.arange(len(start)), start, ribbon["segment_lengths"], own]
    names = ["segment", "start", "length", *"abnmcd"[: own.shape[1]], *_AXES]
    return array_csv(names, np.column_stack([*columns, ribbon["joint_positions"][:-1]]))


def contacts_csv(result: Mapping[str, Any], length: float, force: float) -> bytes | None:
    """Where the strip of a result.json touches, one line a place: a wall or an obstacle by name with the point x, y, z,
    or "itself" with both places s, v (times `length`), the gap likewise, and the push (times `force`); of several
    strips "table on NAME", and "NAME on NAME" with the place of the first in space too; None: none.

    Friction on the strip (of the first of two) stands in lines of its own, "friction of " what it touches, with the
    point at which it acts, the push there, friction in space and whether it sticks."""
    lines = _strips_lines(result, length, force) if "strips" in result else []
    for wall in result.get("walls") or ():
        for point, push in zip(wall.get("points") or (), wall.get("pushes") or (), strict=True):
            at = ",".join(f"{length * value:.12g}" for value in point)
            lines.append(f"{wall['name']},{at},,,,,{force * push:.12g},")
    for pair in result.get("contacts") or ():
        at = ",".join(f"{length * pair[key]:.12g}" for key in ("s", "v", "s_other", "v_other"))
        push = force * float(np.linalg.norm(pair["force"]))
        lines.append(f"itself,,,,{at},{push:.12g},{length * pair['gap']:.12g}")
    if not lines:
        return None
    rubbed = _rubbed(result, length, force)
    names = "touched,x,y,z,s,v,s_other,v_other,push,gap"
    if rubbed:  # the columns are there where something rubs
        names, lines = f"{names},{_FRICTION}", [*(f"{line},,,," for line in lines), *rubbed]
    return "\n".join([names, *lines, ""]).encode()


_FRICTION = "friction_x,friction_y,friction_z,state"


def _rubbed(result: Mapping[str, Any], length: float, force: float) -> list[str]:
    """Lines of all places that rub, of walls and between strips."""
    found = []
    for wall in result.get("walls") or ():
        sides = wall["strips"].items() if "strips" in wall else [("", wall)]
        for name, own in sides:
            found += [(f"{wall['name']} on {name}" if name else wall["name"], rub) for rub in own.get("rubs") or ()]
    contact = result.get("contact") or {}
    found += [(f"{rub['b']} on {rub['a']}", rub) for rub in contact.get("rubs") or ()]
    lines = []
    for name, rub in found:
        at = ",".join(f"{length * value:.12g}" for value in rub["point"])
        rubs = ",".join(f"{force * value:.12g}" for value in rub["friction"])
        lines.append(f"friction of {name},{at},,,,,{force * rub['push']:.12g},,{rubs},{rub['state']}")
    return lines


def _strips_lines(result: Mapping[str, Any], length: float, force: float) -> list[str]:
    lines = []
    for wall in result.get("walls") or ():
        for name, own in wall["strips"].items():
            for point, push in zip(own["points"], own["pushes"], strict=True):
                at = ",".join(f"{length * value:.12g}" for value in point)
                lines.append(f"{wall['name']} on {name},{at},,,,,{force * push:.12g},")
    for pair in (result.get("contact") or {}).get("places") or ():
        at = ",".join(f"{length * value:.12g}" for value in pair["position"])
        own, other = (result["strips"][pair[key]]["length"] for key in "ab")  # s and v are each in its own l
        sizes = [own * pair["s"], own * pair["v"], other * pair["s_b"], other * pair["v_b"]]
        places = ",".join(f"{length * value:.12g}" for value in sizes)
        push = force * float(np.linalg.norm(pair["force"]))
        lines.append(f"{pair['b']} on {pair['a']},{at},{places},{push:.12g},{length * pair['gap']:.12g}")
    return lines


def array_csv(names: Sequence[str], table: FloatArray) -> bytes:
    """Points as CSV: an array (n, k) of numbers under k names, to 12 digits; empty where a value is not known (nan)."""
    out = io.StringIO()
    np.savetxt(out, table, delimiter=",", header=",".join(names), comments="", fmt="%.12g")
    return out.getvalue().replace("nan", "").encode()


def pvd_bytes(entries: Sequence[tuple[float, int, str, str]]) -> bytes:
    """A ParaView collection of (time, part, label, file), files relative to it."""
    from xml.sax.saxutils import quoteattr  # not before it is needed: it loads what asks web servers

    lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">']
    lines.append("  <Collection>")
    for time, part, label, file in entries:
        lines.append(
            f'    <DataSet timestep="{time:.12g}" part="{part}" name={quoteattr(label)} file={quoteattr(file)}/>'
        )
    return "\n".join([*lines, "  </Collection>", "</VTKFile>", ""]).encode()
