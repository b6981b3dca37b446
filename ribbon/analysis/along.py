"""Elastic energy of a solved ribbon, from point to point: over s and over the surface, natural curvature included.

Both leave out the constant ``K^2 / 2``. With j = 1 + v eta' a piece of the strip is dS dv = j ds dv; the natural term
is the same on the whole ruling, as that of any energy whose rulings are taken as parallel. Where the twist is free
there are no rulings: sections are square to the centreline, and `ribbon.analysis.parts` has their energy.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.analysis import parts
from ribbon.energies.dispatch import CODES, ENERGIES, values
from ribbon.surface import behind_seam

FloatArray = NDArray[np.float64]


def segment_of(equilibrium: Any, s: FloatArray) -> NDArray[np.int64]:
    """Number of the segment, from 0, on which each abscissa (k,) lies; beyond an end that of the end, or behind the
    seam of a closed band."""
    joints = np.concatenate([[0.0], np.cumsum(equilibrium.problem.lengths)])
    s, _ = behind_seam(np.asarray(s, dtype=float), equilibrium.seam)
    return np.clip(np.searchsorted(joints, s, side="right") - 1, 0, len(joints) - 2)


def line_density(equilibrium: Any, s: FloatArray) -> FloatArray:
    """Elastic energy per length (k,) in D w / l^2 at abscissae in [0, 1] of a `ribbon.Equilibrium`.

    Its integral over [0, 1] is the ribbon's elastic energy in D w / l (thesis, eq. 2.11 and 2.12).
    """
    if equilibrium.has_free_twist:
        return parts.line_density(equilibrium, np.asarray(s, dtype=float))
    omega, eta, x, natural = _local(equilibrium, np.asarray(s, dtype=float))
    return _bending(equilibrium, omega, eta, x) + natural


def area_density(equilibrium: Any, foot: FloatArray, v: FloatArray) -> FloatArray:
    """Elastic energy per material area (k,) in D / l^2 at particles on the rulings of `foot` (k,) at `v` (k,).

    Over the width j times it gives `line_density`; over the strip the elastic energy in D, which is w / l times that in
    D w / l (up to the corners beyond the last rulings, where the end's own curvature goes on). NaN where rulings cross.
    Where the twist is free the foot of a particle is its own abscissa.
    """
    if equilibrium.has_free_twist:
        return _free_area(equilibrium, np.asarray(foot, dtype=float), np.asarray(v, dtype=float))
    foot, sign = behind_seam(np.asarray(foot, dtype=float), equilibrium.seam)
    omega, eta, x, natural = _local(equilibrium, foot)
    problem = equilibrium.problem
    t = sign * np.asarray(v, dtype=float) / problem.half_width
    stretch = 1.0 + t * x
    across = ENERGIES[problem.energy].across
    if across is None:
        bending = _bending(equilibrium, omega, eta, x)
    else:
        with np.errstate(divide="ignore"):
            bending = across(omega, eta, x, t, problem.strip.section)
    return (bending + natural) / np.where(stretch > 0.0, stretch, np.nan)


def _free_area(equilibrium: Any, s: FloatArray, v: FloatArray) -> FloatArray:
    """The parts' sum at the particles (s, v), both (k,), in D / l^2."""
    found = np.empty(s.shape)
    for place in np.unique(v):
        rows = np.nonzero(v == place)[0]
        found[rows] = parts.area_densities(equilibrium, s[rows], np.array([place]))[:, 0].sum(axis=1)
    return found - 0.5 * law.at(equilibrium.problem.strip.curvature, s) ** 2


def _bending(equilibrium: Any, omega: FloatArray, eta: FloatArray, x: FloatArray) -> FloatArray:
    problem = equilibrium.problem
    out = np.empty(omega.shape)
    values(CODES[problem.energy], omega, eta, x, problem.strip.section, out)
    return out


def _local(equilibrium: Any, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """omega, eta, x and the natural term at abscissae (k,); beyond the ends eta' = 0 (the surface goes on so)."""
    strip = equilibrium.problem.strip
    slope = equilibrium.parameters[segment_of(equilibrium, s), 2]
    slope = np.where((s < 0.0) | (s > 1.0), 0.0, slope)
    _, _, omega, eta = equilibrium.continued(s)
    curvature = law.at(strip.curvature, np.clip(s, 0.0, 1.0))
    return omega, eta, equilibrium.problem.half_width * slope, -curvature * omega * (1.0 + strip.poisson * eta**2)
