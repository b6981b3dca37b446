"""The elastic energy of a developable strip of segments with linear omega and eta, by quadrature, with derivatives.

The densities are (2.2) to (2.4) and (2.7) of docs/theory.md, written again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: |x| below which H and its derivatives are summed as series, and the series' terms.
_SMALL = 0.25
_TERMS = 30


def width_factor(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """H(x) = artanh(x) / x, H', H'' for |x| < 1."""
    k = np.arange(_TERMS)
    small = np.abs(x) < _SMALL
    safe = np.where(small, 0.5, x)
    value = np.arctanh(safe) / safe
    slope = (1.0 / (1.0 - safe**2) - value) / safe
    bend = (2.0 * safe / (1.0 - safe**2) ** 2 - 2.0 * slope) / safe
    y = np.where(small, x, 0.0)[..., None]
    weights = 1.0 / (2 * k + 1)
    near = (weights * y ** (2 * k)).sum(-1)
    near_slope = (2 * k[1:] * weights[1:] * y ** (2 * k[1:] - 1)).sum(-1)
    near_bend = (2 * k[1:] * (2 * k[1:] - 1) * weights[1:] * y ** (2 * k[1:] - 2)).sum(-1)
    chosen = np.where(small, near, value), np.where(small, near_slope, slope), np.where(small, near_bend, bend)
    return chosen


@dataclass(frozen=True)
class Elastic:
    """Energy (without the constant of the natural curvature), gradient (p, 4), Hessian (p, 4, 4) by (a, b, n, m)."""

    value: float
    gradient: FloatArray
    hessian: FloatArray


def elastic(
    q: FloatArray, lengths: FloatArray, energy: str, width: float, poisson: float, curvature: tuple[float, float]
) -> Elastic:
    """Of segments q (p, 4) of `lengths` (p,): energy "sadowsky" or "wunderlich", width w / l, curvature K l at s = 0
    and s = 1."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    u = 0.5 * (nodes + 1.0)
    s = u * lengths[:, None]  # (p, g)
    weight = 0.5 * weights * lengths[:, None]
    start = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    law = curvature[0] + (curvature[1] - curvature[0]) * (start[:, None] + s)
    a, b, n, m = (q[:, k, None] for k in range(4))
    omega, eta = a * s + b, n * s + m
    x = np.broadcast_to(0.5 * width * n, s.shape)
    factor = width_factor(x) if energy == "wunderlich" else (np.ones_like(x), np.zeros_like(x), np.zeros_like(x))
    g = 1.0 + eta**2
    # derivatives of 1/2 omega^2 g^2 H - K omega (1 + nu eta^2) by (omega, eta, x)
    h, dh, ddh = factor
    value = 0.5 * omega**2 * g**2 * h - law * omega * (1.0 + poisson * eta**2)
    slope = np.stack([
        omega * g**2 * h - law * (1.0 + poisson * eta**2),
        2.0 * omega**2 * g * eta * h - 2.0 * law * poisson * omega * eta,
        0.5 * omega**2 * g**2 * dh,
    ])  # fmt: skip
    bend = np.empty((3, 3, *s.shape))
    bend[0, 0] = g**2 * h
    bend[0, 1] = bend[1, 0] = 4.0 * omega * g * eta * h - 2.0 * law * poisson * eta
    bend[0, 2] = bend[2, 0] = omega * g**2 * dh
    bend[1, 1] = 2.0 * omega**2 * (g + 2.0 * eta**2) * h - 2.0 * law * poisson * omega
    bend[1, 2] = bend[2, 1] = 2.0 * omega**2 * g * eta * dh
    bend[2, 2] = 0.5 * omega**2 * g**2 * ddh
    # (omega, eta, x) by (a, b, n, m)
    by = np.zeros((3, 4, *s.shape))
    by[0, 0], by[0, 1], by[1, 2], by[1, 3], by[2, 2] = s, 1.0, s, 1.0, 0.5 * width
    gradient = np.einsum("pg,ipg,ikpg->pk", weight, slope, by)
    hessian = np.einsum("pg,ijpg,ikpg,jlpg->pkl", weight, bend, by, by)
    return Elastic(float((weight * value).sum()), gradient, hessian)
