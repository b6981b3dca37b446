"""Triangulated surfaces as one binary glTF 2.0 file (.glb), which Blender, browsers and viewers read.

Source: Khronos Group, glTF 2.0 Specification, sections 3.6 (buffers and accessors), 3.7 (meshes), 4.4 (binary file).
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.pages.export.formats import colours, one_word, texture_coordinates
from compare.pages.export.vtu import Sheet, grid_sheet

FloatArray = NDArray[np.float64]

_MAGIC, _VERSION, _JSON, _BIN = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
_FLOAT, _UNSIGNED_INT, _UNSIGNED_BYTE = 5126, 5125, 5121
_VERTICES, _INDICES = 34962, 34963
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_PADDING = {_JSON: b" ", _BIN: b"\0"}


class _Buffer:
    """The single buffer of a file, its views and accessors; every view begins at a multiple of four bytes."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: NDArray[Any], component: int, target: int | None, **more: Any) -> int:
        """The number of a new accessor of values (n,) or (n, 2 to 4); target: None for an animation's; `more`:
        normalized, bounds."""
        bounds = more.pop("bounds", False)
        self.data += b"\0" * (-len(self.data) % 4)
        raw = np.ascontiguousarray(values).tobytes()
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw)}
        self.views.append(view if target is None else view | {"target": target})
        self.data += raw
        width = 1 if values.ndim == 1 else values.shape[1]
        accessor = {
            "bufferView": len(self.views) - 1, "byteOffset": 0, "componentType": component, "count": len(values),
            "type": _TYPES[width], **more,
        }  # fmt: skip
        if bounds:
            flat = values.reshape(len(values), width)
            accessor |= {"min": [v.item() for v in flat.min(axis=0)], "max": [v.item() for v in flat.max(axis=0)]}
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def turn(up: Sequence[float]) -> list[float]:
    """The rotation (x, y, z, w) that takes the direction `up` to +y, which is upwards in glTF."""
    u = np.asarray(up, dtype=float) / np.linalg.norm(up)
    if u[1] < -1.0 + 1e-12:
        return [1.0, 0.0, 0.0, 0.0]
    q = np.append(np.cross(u, [0.0, 1.0, 0.0]), 1.0 + u[1])
    return [float(c) for c in q / np.linalg.norm(q)]


def glb_bytes(sheets: Sequence[tuple[str, Sheet]], up: Sequence[float] | None, title: str = "") -> bytes:
    """The named surfaces in one file: positions, normals, texture coordinates, colours, triangles, and every scalar
    field as an attribute _NAME (float32; values that are not known are 0, as NaN is not allowed).

    up: turned into glTF's +y by the root node (None: z); the numbers of the attributes stay in the scene's axes.
    """
    buffer = _Buffer()
    meshes: list[dict[str, Any]] = []
    nodes: list[dict[str, Any]] = [{"name": title or "ribbonbench", "rotation": turn(up or (0.0, 0.0, 1.0))}]
    nodes[0]["children"] = list(range(1, len(sheets) + 1))
    for number, (name, sheet) in enumerate(sheets):
        meshes.append({"name": name, "primitives": [_primitive(buffer, sheet)]})
        nodes.append({"name": name, "mesh": number})
    return _file(buffer, nodes, meshes, {})


def film_bytes(
    grids: FloatArray,
    material: tuple[FloatArray, FloatArray],
    seconds: FloatArray,
    up: Sequence[float] | None,
    title: str,
    beside: Sequence[tuple[str, FloatArray]] = (),
) -> bytes:
    """The states of one strip as a file with an animation: grids (K, k, m, 3) of positions at the particles s (k,) x
    v (m,) of `material`, shown at `seconds` (K,), growing.

    The mesh is the first state; each other state is a morph target (positions and normals), and the animation leads
    their weights from one to the next, linearly. At rest the last state is shown. beside: names and grids of what else
    moves, as arrows of contact do, each a mesh of its own. Source: glTF 2.0, 3.7.2.2 and 3.11.
    """
    buffer, count = _Buffer(), len(grids) - 1
    weights = np.vstack([np.zeros(count), np.eye(count)])
    meshes = [_moving(buffer, "strip", grids, material, weights)]
    for name, own in beside:
        grid = tuple(np.linspace(0.0, 1.0, n) for n in own.shape[1:3])
        meshes.append(_moving(buffer, name, own, (grid[0], grid[1]), weights))
    sampler = {
        "input": buffer.add(seconds.astype("<f4"), _FLOAT, None, bounds=True),
        "output": buffer.add(weights.astype("<f4").ravel(), _FLOAT, None),
        "interpolation": "LINEAR",
    }
    numbers = range(1, len(meshes) + 1)
    root = {"name": title or "ribbonbench", "rotation": turn(up or (0.0, 0.0, 1.0)), "children": list(numbers)}
    nodes: list[dict[str, Any]] = [root, *({"name": mesh["name"], "mesh": k} for k, mesh in enumerate(meshes))]
    channels = [{"sampler": 0, "target": {"node": node, "path": "weights"}} for node in numbers]
    animations = [{"name": "path", "samplers": [sampler], "channels": channels}]
    return _file(buffer, nodes, meshes, {"animations": animations})


def _moving(
    buffer: _Buffer, name: str, grids: FloatArray, material: tuple[FloatArray, FloatArray], weights: FloatArray
) -> dict[str, Any]:
    """The mesh of the first of grids (K, k, m, 3) with a target for each other one, at rest the last."""
    s, v = np.meshgrid(*material, indexing="ij")
    sheets = [grid_sheet(grid, {"S": s, "v": v}) for grid in grids]
    corners = {
        "POSITION": buffer.add(sheets[0].points.astype("<f4"), _FLOAT, _VERTICES, bounds=True),
        "NORMAL": buffer.add(_units(sheets[0].normals()), _FLOAT, _VERTICES),
    }
    texture = texture_coordinates(sheets[0])
    if texture is not None:
        corners["TEXCOORD_0"] = buffer.add(texture.astype("<f4"), _FLOAT, _VERTICES)
    triangles = buffer.add(sheets[0].triangles.astype("<u4").ravel(), _UNSIGNED_INT, _INDICES)
    targets = []
    for sheet in sheets[1:]:
        moved = (sheet.points - sheets[0].points).astype("<f4")
        turned = (sheet.normals() - sheets[0].normals()).astype("<f4")
        targets.append(
            {
                "POSITION": buffer.add(moved, _FLOAT, _VERTICES, bounds=True),
                "NORMAL": buffer.add(turned, _FLOAT, _VERTICES),
            }
        )
    primitive = {"attributes": corners, "indices": triangles, "material": 0, "mode": 4, "targets": targets}
    return {"name": name, "primitives": [primitive], "weights": weights[-1].tolist()}


def _file(buffer: _Buffer, nodes: list[dict[str, Any]], meshes: list[dict[str, Any]], more: dict[str, Any]) -> bytes:
    """The binary file of a scene whose first node holds the others; more: further properties of it."""
    buffer.data += b"\0" * (-len(buffer.data) % 4)
    rough = {"metallicFactor": 0.0, "roughnessFactor": 0.8}
    document = {
        "asset": {"version": "2.0", "generator": "ribbonbench"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [{"name": "strip", "doubleSided": True, "pbrMetallicRoughness": rough}],
        **more,
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()
    chunks = b"".join(_chunk(kind, content) for kind, content in ((_JSON, text), (_BIN, bytes(buffer.data))))
    return struct.pack("<III", _MAGIC, _VERSION, 12 + len(chunks)) + chunks


def _chunk(kind: int, content: bytes) -> bytes:
    content += _PADDING[kind] * (-len(content) % 4)
    return struct.pack("<II", len(content), kind) + content


def _primitive(buffer: _Buffer, sheet: Sheet) -> dict[str, Any]:
    """The triangles of one surface."""
    attributes = {
        "POSITION": buffer.add(sheet.points.astype("<f4"), _FLOAT, _VERTICES, bounds=True),
        "NORMAL": buffer.add(_units(sheet.normals()), _FLOAT, _VERTICES),
    }
    texture = texture_coordinates(sheet)
    if texture is not None:
        attributes["TEXCOORD_0"] = buffer.add(texture.astype("<f4"), _FLOAT, _VERTICES)
    shades = colours(sheet)
    if shades is not None:
        four = np.column_stack([shades[1], np.full(len(shades[1]), 255, dtype=np.uint8)])  # four: aligned to 4 bytes
        attributes["COLOR_0"] = buffer.add(four, _UNSIGNED_BYTE, _VERTICES, normalized=True)
    for name, values in sheet.scalars().items():
        known = np.where(np.isfinite(values), values, 0.0).astype("<f4")
        attributes[f"_{one_word(name).upper()}"] = buffer.add(known, _FLOAT, _VERTICES, bounds=True)
    corners = sheet.triangles.astype("<u4").ravel()
    indices = buffer.add(corners, _UNSIGNED_INT, _INDICES)
    return {"attributes": attributes, "indices": indices, "material": 0, "mode": 4}


def _units(normals: FloatArray) -> NDArray[np.float32]:
    """Unit vectors in single precision."""
    single = normals.astype("<f4")
    return single / np.linalg.norm(single, axis=1, keepdims=True).astype("<f4")
