"""The surface of a tape and its energy density: shallow in the model, drawn with the section of its curvature.

In the model y = v and z = a^2 kappa^i r_i; on the surface beta = a kappa^i q_i is the angle of the section, so that at
rest it is the arc itself: y = int cos beta dv, z - z(0) = int sin beta dv, the middle where the model has it.
"""

from __future__ import annotations

import numpy as np

from ribbon.tape.rod import Rod, bent
from ribbon.tape.section import FloatArray

FINE = 16
"""Gauss points between the middle and a point of the section."""


def middle(rod: Rod, x: FloatArray, s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Plane positions (k, 2) of the line v = 0 and angles phi (k,) of the sections, at s (k,)."""
    fields = rod.at(x, s)
    dx, dy = fields[:, 0, 1], fields[:, 1, 1]
    g = np.hypot(dx, dy)
    z = fields[:, 2:, 0] @ rod.middle
    return np.column_stack([fields[:, 0, 0] + z * dy / g, fields[:, 1, 0] - z * dx / g]), np.arctan2(dy, dx)


def profile(rod: Rod, x: FloatArray, s: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """y, z - z(0) and beta (k, m) of the sections at s (k,), v (m,) in l."""
    kappa = rod.at(x, s)[:, 2:, 0]
    t, weight = np.polynomial.legendre.leggauss(FINE)
    inside = 0.5 * (t + 1.0) * v[:, None]
    slope = rod.section.tables(inside.ravel() / rod.section.half)[1]
    beta = (kappa @ slope.T).reshape(len(s), len(v), FINE)
    w = 0.5 * weight * v[:, None]
    edge = kappa @ rod.section.tables(v / rod.section.half)[1].T
    return np.sum(w * np.cos(beta), axis=2), np.sum(w * np.sin(beta), axis=2), edge


def densities(rod: Rod, x: FloatArray, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
    """Fields (k, m): kappa across and k along in 1/l, e11, energy density in D / l^2 and its part of e11."""
    fields = rod.at(x, s)
    p, slope, z = rod.section.tables(v / rod.section.half)
    kappa, first, second = (fields[:, 2:, d] for d in range(3))
    k = bent(fields)[:, None]
    e = 0.5 * (fields[:, 0, 1] ** 2 + fields[:, 1, 1] ** 2 - 1.0)[:, None]
    e11 = e + k * (kappa @ z.T) + 0.5 * (first @ z.T) ** 2
    if rod.section.warped:
        g = rod.section.warping(v / rod.section.half)
        e11 = e11 + np.einsum("mij,ki,kj->km", g, first, first) + np.einsum("mij,ki,kj->km", g, kappa, second)
    b11 = second @ z.T - k
    factor = rod.rest_at(s)[:, None]
    across = kappa @ p.T
    b22, b12 = across - factor * rod.section.curvature, first @ slope.T
    nu = rod.section.poisson
    membrane = 0.5 * rod.section.stretching * e11**2
    bending = 0.5 * (b11**2 + b22**2 + 2.0 * nu * b11 * b22 + 2.0 * (1.0 - nu) * b12**2)
    return {
        "kappa": across, "curvature": np.broadcast_to(k, e11.shape), "e11": e11,
        "energy_density": membrane + bending, "membrane_density": membrane,
    }  # fmt: skip


def parts(rod: Rod, x: FloatArray) -> tuple[float, float]:
    """Membrane and bending energy, D w / l, by the element's and the section's Gauss points."""
    t, weight = rod.gauss
    s = (rod.s[:-1, None] + rod.lengths[:, None] * t).ravel()
    w = (rod.lengths[:, None] * weight).ravel()
    across, w_across = rod.section.points
    found = densities(rod, x, s, across * rod.section.half)
    membrane = float(w @ found["membrane_density"] @ w_across)
    return membrane, float(w @ found["energy_density"] @ w_across) - membrane
