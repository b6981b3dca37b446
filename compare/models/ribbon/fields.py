"""The fields on a ribbon's surface. Lengths in l, curvatures in 1/l."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbon import Equilibrium
from ribbon.energies.along import area_density, segment_of

FloatArray = NDArray[np.float64]


def fields(equilibrium: Equilibrium, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
    """Fields on the grid s (k,) x v (m,): numbers (k, m) and vectors (k, m, 3).

    S, v: material coordinates; ruling_foot: abscissa of the ruling through the point; segment: its number, from 0;
    omega, eta; energy_density: `area_density`; ruling, tangent, width_direction, normal: q = t_x + eta t_z, t_z, t_x,
    t_y at the foot. Of a closed band a foot may lie behind the seam, below 0 or above 1; omega, eta and the vectors are
    then those of the strip that goes on through it.
    """
    grid_s, grid_v = np.meshgrid(s, v, indexing="ij")
    material = np.column_stack([grid_s.ravel(), grid_v.ravel()])
    foot, _, frame = equilibrium.rulings(material)
    eta = equilibrium.eta(foot)
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
        "omega": equilibrium.omega(foot).reshape(shape),
        "eta": eta.reshape(shape),
        "energy_density": area_density(equilibrium, foot, material[:, 1]).reshape(shape),
        **{name: values.reshape(*shape, 3) for name, values in vectors.items()},
    }
