"""How much of its energy a strip with free twist has as stretching, and where, from the model itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from compare.measure.energy_map import stretching_zones
from compare.models.base import State
from compare.scene.scene import Scene

#: Cells along and across at whose midpoints the energy is looked at.
_ALONG, _ACROSS = 400, 40


@dataclass(frozen=True)
class Stretching:
    """share: bending, membrane and shear in the elastic energy (with the constant of the natural curvature, as a shell
    has it); zones: parts of membrane and shear energy within w / 2 of the clamps, beside the edges, and elsewhere."""

    share: Mapping[str, float]
    zones: Mapping[str, float]


def stretching(scene: Scene, state: State) -> Stretching | None:
    """Of a ribbon's state; None where its energy has rulings (it then bends alone), or no thickness."""
    from ribbon.energies.parts import area_densities

    e, energy = state.native, state.energy
    if not e.has_free_twist or e.problem.strip.thickness is None or energy is None or energy.elastic is None:
        return None
    ratio = e.problem.strip.width / e.problem.strip.thickness
    s, v = np.linspace(0.0, 1.0, _ALONG + 1), e.problem.half_width * np.linspace(-1.0, 1.0, _ACROSS + 1)
    density = area_densities(e, 0.5 * (s[1:] + s[:-1]), 0.5 * (v[1:] + v[:-1]))
    whole = energy.elastic + energy.constant
    parts = {name: energy.parts[name] + (energy.constant if name == "bending" else 0.0) for name in energy.parts}
    share = {name: value / whole if whole > 0.0 else 0.0 for name, value in parts.items()}
    return Stretching(share, stretching_zones(scene, s, v, density, ratio)[0])
