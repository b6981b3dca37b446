"""The strip for the viewer of the reports: its first view, and surfaces as packed numbers."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.page.page import STRIP, Surface
from compare.pages.export.vtu import grid_sheet
from compare.pages.report.surfaces import as_data, view

FloatArray = NDArray[np.float64]

#: Points of the surface along and across.
ALONG, ACROSS = 161, 3


@dataclass(frozen=True)
class Drawn:
    """A surface on a grid: points (k, m, 3) in l; kind: as of `compare.page.page.Surface`; width_to_thickness: of a
    shell."""

    points: FloatArray
    label: str
    kind: str = STRIP
    width_to_thickness: float | None = None


def packed(points: FloatArray) -> str:
    """Numbers as base64 of little-endian 32-bit floats."""
    return base64.b64encode(np.ascontiguousarray(points, dtype="<f4").tobytes()).decode("ascii")


def first_view(surfaces: Sequence[Drawn], up: Sequence[float] | None, alt: str) -> dict[str, Any]:
    """The data of the viewer (`compare.pages.report.surfaces.as_data`)."""
    pairs = []
    for one in surfaces:
        along, across = one.points.shape[:2]
        s, v = np.meshgrid(np.linspace(0.0, 1.0, along), np.linspace(-0.5, 0.5, across), indexing="ij")
        surface = Surface("", one.label, one.kind, width_to_thickness=one.width_to_thickness)
        pairs.append((surface, grid_sheet(one.points, {"S": s, "v": v})))
    direction = None if up is None else (float(up[0]), float(up[1]), float(up[2]))
    found = as_data(view(pairs, direction, ALONG * ACROSS * 4), alt)
    return {**found, "names": {}, "surfaces": [{**one, "fields": {}} for one in found["surfaces"]]}
