"""Elastic energy of a solved strip with free twist by its parts: bending, membrane, transverse shear.

Densities per length and per area as in `ribbon.analysis.along`, which asks here; without the constant ``K^2 / 2``
unless it is said to be with it. The parts per area are the section's own (`FREE_ENERGIES[name].section`); over the
length they are integrated adaptively.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.element.adaptive import beside_zero, integrated
from ribbon.energies import FREE_CODES, FREE_ENERGIES
from ribbon.energies.free import free_numbers, in_plane_stiffness, natural_numbers
from ribbon.sections import local_state

FloatArray = NDArray[np.float64]

#: Names of the parts, in their order.
PARTS = ("bending", "membrane", "shear")
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(20)
#: Thicknesses beside an edge that have Gauss points of their own; layers are h / sqrt(10) wide.
_EDGE = 4.0
#: Error, over each part, of the integrals along the strip.
_ALONG = 1e-8


def line_density(equilibrium: Any, s: FloatArray) -> FloatArray:
    """Elastic energy per length (k,) in D w / l^2 at abscissae s (k,)."""
    fields = equilibrium.problem.fields
    return _values(fields.density_code, equilibrium, s, fields.section)


def line_density_of(energy: str, equilibrium: Any, s: FloatArray, thickness: float) -> FloatArray:
    """The same that another energy has in the same state with this thickness (in l)."""
    half_width, _, poisson, _ = equilibrium.problem.fields.section
    return _values(FREE_CODES[energy], equilibrium, s, (half_width, thickness, poisson, 0.0))


def _values(code: int, equilibrium: Any, s: FloatArray, section: tuple[float, ...]) -> FloatArray:
    local = local_state(equilibrium, s)
    out = np.empty((s.size, 15))
    free_numbers(code, local.k, local.t, local.dk, local.dt, local.natural, 0.0, section, out)
    natural_numbers(code, local.k, local.t, local.natural, np.asarray(local.twist), section, out)
    return np.asarray(out[:, 0] + _in_plane(equilibrium, s))


def _in_plane(equilibrium: Any, s: FloatArray) -> FloatArray:
    """Energy per length (k,) of bending in the strip's plane, energy of the membrane."""
    fields = equilibrium.problem.fields
    if not fields.in_plane:
        return np.zeros(s.shape)
    return np.asarray(0.5 * in_plane_stiffness(fields.section) * _bent_in_plane(equilibrium, s) ** 2)


def _bent_in_plane(equilibrium: Any, s: FloatArray) -> FloatArray:
    """kappa_2 (k,) from its natural value."""
    return np.asarray(equilibrium.in_plane(s) - law.at(equilibrium.problem.strip.geodesic, s))


def area_densities(equilibrium: Any, s: FloatArray, v: FloatArray) -> FloatArray:
    """The parts per area (k, m, 3) in D / l^2 at the particles s (k,) x v (m,), with the constant ``K^2 / 2`` (that is
    of the strain from the natural shape, none of them negative)."""
    fields = equilibrium.problem.fields
    section = FREE_ENERGIES[equilibrium.problem.energy].section
    assert section is not None
    own = section.shares(local_state(equilibrium, s), v, fields.section)
    found = np.stack([own.bending, own.membrane, own.shear], axis=-1)
    if fields.in_plane:
        bent = _bent_in_plane(equilibrium, s)[:, None] * v[None, :]
        thickness, poisson = fields.section[1:3]
        found[:, :, 1] += 6.0 * (1.0 - poisson**2) / thickness**2 * bent**2
    return found


def line_parts(equilibrium: Any, s: FloatArray) -> FloatArray:
    """The parts per length (k, 3) in D w / l^2, with the constant ``K^2 / 2``: means of `area_densities`, which are
    even across."""
    v, weight = _across(equilibrium)
    return np.asarray(np.einsum("kmp,m->kp", area_densities(equilibrium, s, v), weight))


def _across(equilibrium: Any) -> tuple[FloatArray, FloatArray]:
    """Points v (m,) across half the width and weights (m,) of a mean over it: `_NODES` from the middle towards the
    edge, and as many in the last `_EDGE` thicknesses, where transverse shear has its layer."""
    half = equilibrium.problem.half_width
    thickness = equilibrium.problem.strip.section[1]
    split = max(half - _EDGE * thickness, 0.5 * half) if np.isfinite(thickness) else 0.5 * half
    panels = [
        (0.5 * (b - a) * (_NODES + 1.0) + a, 0.5 * (b - a) / half * _WEIGHTS) for a, b in ((0, split), (split, half))
    ]
    v, weight = (np.concatenate(found) for found in zip(*panels, strict=True))
    return v, weight


def parts(equilibrium: Any) -> dict[str, float]:
    """Bending, membrane and shear energy in D w / l; their sum is the elastic energy, without the constant: the bending
    is what remains beside the other two."""
    lengths = equilibrium.problem.lengths
    starts = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])

    def density(i: NDArray[np.int64], s: FloatArray) -> FloatArray:
        along = line_parts(equilibrium, (starts[i, None] + s).ravel())
        return np.asarray(along[:, 1:].reshape(*s.shape, 2))

    found = integrated(density, *beside_zero(equilibrium.parameters, lengths), _ALONG)
    membrane, shear = float(found[0]), float(found[1])
    return {"bending": float(equilibrium.energy.elastic) - membrane - shear, "membrane": membrane, "shear": shear}
