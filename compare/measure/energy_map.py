"""Where on the flat strip its energy is stored: densities by cell, their shares, zones, values at particles."""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Energy per area, over the largest on the strip, that is added before shares are taken: what stores nothing has none.
FLOOR = 1e-6
#: Energy per area over its mean on the strip, below which a map shows grey in place of shares.
HARDLY = 0.01
#: Layers along free edges are counted over this many times sqrt(h / curvature).
LAYERS = 2.0


class Mapped(Protocol):
    """A shell run: its surface's nodes, and energies per area at the midpoints of its cells."""

    @property
    def surface(self) -> Any: ...

    def density(self) -> tuple[FloatArray, FloatArray]: ...


def density_on_grid(case: Mapped) -> FloatArray:
    """Bending, membrane and shear energy per area (nx, ny, 3), D / l^2, in the order of the mesh."""
    midpoints, density = case.density()
    surface = case.surface
    ends = surface.s_nodes[:: surface.degree], surface.v_nodes[:: surface.degree]
    s, v = (0.5 * (x[1:] + x[:-1]) for x in ends)
    rows = np.argmin(np.abs(midpoints[:, :1] - s), axis=1)
    columns = np.argmin(np.abs(midpoints[:, 1:] - v), axis=1)
    found = np.full((s.size, v.size, density.shape[1]), np.nan)
    found[rows, columns] = density
    return found


def shares(density: FloatArray) -> FloatArray:
    """Shares (..., 3) of the parts of an energy density (..., 3) in their sum, see `FLOOR`."""
    whole = density.sum(axis=-1, keepdims=True)
    floor = FLOOR * float(np.nanmax(whole, initial=0.0)) or 1.0
    return np.asarray(density / (whole + floor))


def hardly_stored(density: FloatArray) -> NDArray[np.bool_]:
    """Where (...) an energy density (..., 3) is below `HARDLY` of its mean: shares there tell of next to nothing. An
    unknown density is not stored either."""
    whole = density.sum(axis=-1)
    known = whole[np.isfinite(whole)]
    least = HARDLY * float(known.mean()) if known.size else 0.0
    return ~(whole > least)


def by_name(density: FloatArray) -> dict[str, FloatArray]:
    """An energy density (..., 3) and its shares under the names of the fields of a surface file."""
    names, part = ("bending", "membrane", "shear"), shares(density)
    energies = {f"{name}_energy": density[..., k] for k, name in enumerate(names)}
    return energies | {f"{name}_share": part[..., k] for k, name in enumerate(names)}


def at_points(
    s_knots: FloatArray, v_knots: FloatArray, density: FloatArray, s: FloatArray, v: FloatArray
) -> FloatArray:
    """A density (nx, ny, q) by cell between knots (nx + 1,), (ny + 1,) at the particles s (k,) x v (m,): (k, m, q)."""
    row = np.clip(np.searchsorted(s_knots, s, side="right") - 1, 0, len(s_knots) - 2)
    column = np.clip(np.searchsorted(v_knots, v, side="right") - 1, 0, len(v_knots) - 2)
    return density[row[:, None], column[None, :]]


class Held(Protocol):
    """What `stretching_zones` asks of a clamp: its tangent, None where it holds a point alone."""

    @property
    def tangent(self) -> object: ...


class Clamped(Protocol):
    """A strip, width in l, with what holds its ends."""

    @property
    def width(self) -> float: ...
    @property
    def clamp_start(self) -> Held | None: ...
    @property
    def clamp_end(self) -> Held | None: ...


def stretching_zones(
    strip: Clamped, s_knots: FloatArray, v_knots: FloatArray, density: FloatArray, width_to_thickness: float
) -> tuple[dict[str, float], float]:
    """Parts of the stretching energy (membrane and shear) near the clamps, beside the free edges and elsewhere; the
    part of the shear energy that is not near a clamp. density (nx, ny, 3): bending, membrane, shear of any model, by
    cell between the knots (nx + 1,), (ny + 1,), in l.

    Near a clamp: within w / 2; beside an edge: within twice sqrt(h / kappa), kappa the curvature that would store the
    strip's bending energy.
    """
    s, v = 0.5 * (s_knots[1:] + s_knots[:-1]), 0.5 * (v_knots[1:] + v_knots[:-1])
    area = np.diff(s_knots)[:, None] * np.diff(v_knots)[None, :]
    energy = np.nan_to_num(density) * area[..., None]
    stretching = energy[..., 1] + energy[..., 2]
    total = float(stretching.sum()) or 1.0
    near = np.zeros(s.size, dtype=bool)
    for at, clamp in ((0.0, strip.clamp_start), (1.0, strip.clamp_end)):
        if clamp is not None and clamp.tangent is not None:
            near |= np.abs(s - at) < 0.5 * strip.width
    bending = float(energy[..., 0].sum()) / strip.width
    curvature = max(math.sqrt(2.0 * bending), 1e-6)
    layer = LAYERS * math.sqrt(strip.width / width_to_thickness / curvature)
    beside = (np.abs(v) > 0.5 * strip.width - layer)[None, :] & ~near[:, None]
    clamps, edges = float(stretching[near].sum()) / total, float(stretching[beside].sum()) / total
    shear = float(energy[..., 2].sum()) or 1.0
    zones = {"clamps": clamps, "edges": edges, "rest": max(1.0 - clamps - edges, 0.0)}
    return zones, float(energy[~near, :, 2].sum()) / shear
