"""Elastic energy of a solved ribbon, from point to point: over s and over the surface, natural curvature included."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ribbon.energies import wunderlich

if TYPE_CHECKING:
    from ribbon.result import Equilibrium

FloatArray = NDArray[np.float64]


def segment_of(equilibrium: Equilibrium, s: FloatArray) -> NDArray[np.int64]:
    """Number of the segment, from 0, on which each abscissa (k,) lies; beyond an end that of the end."""
    joints = np.concatenate([[0.0], np.cumsum(equilibrium.problem.lengths)])
    return np.clip(np.searchsorted(joints, s, side="right") - 1, 0, len(joints) - 2)


def _local(equilibrium: Equilibrium, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """omega, eta, eta' and natural curvature K at abscissae (k,); beyond the ends eta' = 0 (the surface goes on so)."""
    slope = equilibrium.parameters[segment_of(equilibrium, s), 2]
    slope = np.where((s < 0.0) | (s > 1.0), 0.0, slope)
    start, end = equilibrium.problem.strip.curvature
    return equilibrium.omega(s), equilibrium.eta(s), slope, start + (end - start) * np.clip(s, 0.0, 1.0)


def line_density(equilibrium: Equilibrium, s: FloatArray) -> FloatArray:
    """Elastic energy per length (k,) in D w / l^2 at abscissae in [0, 1], without the constant K^2 / 2.

    Its integral over [0, 1] is the ribbon's elastic energy in D w / l (thesis, eq. 2.11 and 2.12).
    """
    omega, eta, slope, curvature = _local(equilibrium, np.asarray(s, dtype=float))
    density = 0.5 * omega**2 * (1.0 + eta**2) ** 2
    if equilibrium.problem.energy == "wunderlich":
        half = equilibrium.problem.half_width
        density = density * np.array([wunderlich.width_factor(half * x)[0] for x in slope])
    return density - curvature * omega * (1.0 + equilibrium.problem.strip.poisson * eta**2)


def area_density(equilibrium: Equilibrium, foot: FloatArray, v: FloatArray) -> FloatArray:
    """Elastic energy per material area (k,) in D / l^2 at particles on the rulings of `foot` (k,) at `v` (k,).

    With j = 1 + v eta' (dS dv = j ds dv): Wunderlich ``1/2 omega^2 (1 + eta^2)^2 / j^2``; Sadowsky, which takes the
    rulings as parallel, ``1/2 omega^2 (1 + eta^2)^2 / j``; both with ``- K omega (1 + nu eta^2) / j``. Over the width
    either gives `line_density`; over the strip the elastic energy in D, which is w / l times that in D w / l (up to the
    corners beyond the last rulings, where the end's own curvature goes on). NaN where rulings cross.
    """
    omega, eta, slope, curvature = _local(equilibrium, foot)
    stretch = 1.0 + v * slope
    stretch = np.where(stretch > 0.0, stretch, np.nan)
    bending = 0.5 * omega**2 * (1.0 + eta**2) ** 2 / stretch
    if equilibrium.problem.energy == "wunderlich":
        bending = bending / stretch
    return bending - curvature * omega * (1.0 + equilibrium.problem.strip.poisson * eta**2) / stretch
