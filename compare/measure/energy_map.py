"""Where on the flat strip a shell stores its energy: densities by cell, their shares, and their values at particles."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Energy per area, over the largest on the strip, that is added before shares are taken: what stores nothing has none.
FLOOR = 1e-6
#: Energy per area over its mean on the strip, below which a map shows grey in place of shares.
HARDLY = 0.01


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
