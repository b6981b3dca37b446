"""A cantilever of Naghdi's shell that bends in a plane (nu = 0), as an ordinary differential equation; and the
elastica.

Centreline r(s) with r' = e t + g d, t = (cos theta, sin theta) and d = (-sin theta, cos theta) the director, so that

    eps = (e^2 + g^2 - 1) / 2 ,   gam = g ,   kap = r' . d' = -theta' e
    energy per length = kap^2 / 2 + A eps^2 / 2 + S g^2 / 2 ,   A = 12 / h^2 ,  S = 5 / h^2    (D = l = 1, nu = 0)

The weight Gamma acts along -y and the end is free, so the internal force is n = -Gamma (1 - s) e_y. Its components are
n . t = A eps e + theta'^2 e and n . d = A eps g + S g (derivatives of the energy in e and g), the moment is
m = theta' e^2, and m' = g (n . t) - e (n . d). h = 0: the elastica, e = 1 and g = 0. Derived here from the energy of
theory sheet section 5; solved by collocation (scipy.integrate.solve_bvp), continued in Gamma.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_bvp


def strains(theta: np.ndarray, moment: np.ndarray, force: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    """(e, g) at cross-sections with these angles and moments; force (n,): n . e_y. Newton, to rounding."""
    axial, shear = 12.0 / h**2, 5.0 / h**2
    nt, nd = force * np.sin(theta), force * np.cos(theta)
    e, g = np.ones_like(theta), nd / shear
    for _ in range(50):
        eps = 0.5 * (e * e + g * g - 1.0)
        f = np.stack([axial * eps * e + moment**2 / e**3 - nt, axial * eps * g + shear * g - nd])
        fe = axial * (eps + e * e) - 3.0 * moment**2 / e**4
        fg = axial * e * g
        gg = axial * (eps + g * g) + shear
        det = fe * gg - fg * fg
        de, dg = (gg * f[0] - fg * f[1]) / det, (fe * f[1] - fg * f[0]) / det
        e, g = e - de, g - dg
        if np.max(np.abs(de)) + np.max(np.abs(dg)) < 1e-15:
            break
    return e, g


def cantilever(gamma: float, h: float, tolerance: float = 1e-9) -> tuple[float, float]:
    """(z, y) of the end of a horizontal cantilever of thickness h (over l; 0: the elastica) under its weight."""
    s = np.linspace(0.0, 1.0, 201) ** 2
    state = np.zeros((4, len(s)))
    state[2] = s
    for load in np.unique(np.concatenate([np.geomspace(min(1.0, gamma), gamma, 12)])):

        def right(s: np.ndarray, y: np.ndarray, load: float = load) -> np.ndarray:
            theta, moment = y[0], y[1]
            force = -load * (1.0 - s)
            e, g = strains(theta, moment, force, h) if h else (np.ones_like(theta), np.zeros_like(theta))
            nt, nd = force * np.sin(theta), force * np.cos(theta)
            z = e * np.cos(theta) - g * np.sin(theta)
            return np.stack([moment / e**2, g * nt - e * nd, z, e * np.sin(theta) + g * np.cos(theta)])

        found = solve_bvp(
            right,
            lambda a, b: np.array([a[0], b[1], a[2], a[3]]),
            s,
            state,
            tol=tolerance if load == gamma else 1e-4,
            max_nodes=200000,
        )
        if not found.success:
            raise ArithmeticError(f"Gamma = {load:g}: {found.message}")
        s, state = found.x, found.y
    return float(state[2, -1]), float(state[3, -1])
