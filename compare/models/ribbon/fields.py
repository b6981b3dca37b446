"""The fields on a ribbon's surface, and the shares of stretching there. Lengths in l, curvatures in 1/l."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from compare.measure.energy_map import by_name, stretching_zones
from compare.models.base import State
from compare.scene.inputs.law import at
from compare.scene.scene import Scene
from ribbon import Equilibrium
from ribbon.analysis.along import area_density, segment_of
from ribbon.analysis.parts import area_densities

FloatArray = NDArray[np.float64]


def fields(equilibrium: Equilibrium, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
    """Fields on the grid s (k,) x v (m,): numbers (k, m) and vectors (k, m, 3).

    S, v: material coordinates; ruling_foot: abscissa of the ruling through the point; segment: its number, from 0;
    omega, eta; energy_density: `area_density`; ruling, tangent, width_direction, normal: q = t_x + eta t_z, t_z, t_x,
    t_y at the foot. Of a closed band a foot may lie behind the seam, below 0 or above 1; omega, eta and the vectors are
    then those of the strip that goes on through it.

    Where the twist is free there are no rulings: tau (the twist) stands in place of eta, and with energy_density its
    parts and their shares (`compare.measure.energy_map.by_name`: bending_energy, ..., of the strain from the natural
    shape); normal is that of the curved section, the frame's other vectors those at S.
    """
    if equilibrium.has_free_twist:
        return _free(equilibrium, s, v)
    grid_s, grid_v = np.meshgrid(s, v, indexing="ij")
    material = np.column_stack([grid_s.ravel(), grid_v.ravel()])
    foot = equilibrium.rulings(material)[0]
    _, frame, omega, eta = equilibrium.continued(foot)
    shape = grid_s.shape
    vectors = {
        "ruling": frame[:, :, 0] + eta[:, None] * frame[:, :, 2],
        "tangent": frame[:, :, 2],
        "width_direction": frame[:, :, 0],
        "normal": frame[:, :, 1],
    }
    return {
        "S": grid_s,
        "v": grid_v,
        "ruling_foot": foot.reshape(shape),
        "segment": segment_of(equilibrium, foot).astype(float).reshape(shape),
        "omega": omega.reshape(shape),
        "eta": eta.reshape(shape),
        "energy_density": area_density(equilibrium, foot, material[:, 1]).reshape(shape),
        **{name: values.reshape(*shape, 3) for name, values in vectors.items()},
    }


def _free(equilibrium: Equilibrium, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
    grid_s, grid_v = np.meshgrid(s, v, indexing="ij")
    shape = grid_s.shape
    material = np.column_stack([grid_s.ravel(), grid_v.ravel()])
    frame = np.repeat(equilibrium.frame(s), v.size, axis=0)
    density = area_densities(equilibrium, np.asarray(s, dtype=float), np.asarray(v, dtype=float))
    along = {
        "segment": segment_of(equilibrium, s).astype(float),
        "omega": equilibrium.omega(s),
        "tau": equilibrium.tau(s),
    }
    vectors = {
        "tangent": frame[:, :, 2],
        "width_direction": frame[:, :, 0],
        "normal": equilibrium.normals(material),
    }
    return {
        "S": grid_s,
        "v": grid_v,
        **{name: np.repeat(values[:, None], v.size, axis=1) for name, values in along.items()},
        "energy_density": density.sum(axis=2) - 0.5 * at(equilibrium.problem.strip.curvature, grid_s) ** 2,
        **by_name(density),
        **{name: values.reshape(*shape, 3) for name, values in vectors.items()},
    }


#: Cells along and across at whose midpoints the energy is looked at.
_ALONG, _ACROSS = 400, 40


@dataclass(frozen=True)
class Stretching:
    """share: bending, membrane and shear in the elastic energy (with the constant of the natural curvature, as a shell
    has it); zones: parts of membrane and shear energy within w / 2 of the clamps, beside the edges, and elsewhere."""

    share: Mapping[str, float]
    zones: Mapping[str, float]


def stretching(scene: Scene, state: State) -> Stretching | None:
    """How much of its energy a strip with free twist has as stretching, and where; None where its energy has rulings
    (it then bends alone), or no thickness."""
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
