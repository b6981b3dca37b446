"""What the exported energy densities of a solved ribbon integrate to."""

from __future__ import annotations

import numpy as np

from ribbon import Equilibrium
from ribbon.analysis.along import area_density, line_density

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


def over_s(equilibrium: Equilibrium) -> float:
    """Integral of the line density over [0, 1], D w / l: Gauss points on every segment."""
    s, weights = _along(equilibrium)
    return float(weights @ line_density(equilibrium, s))


def over_surface(equilibrium: Equilibrium) -> float:
    """Integral of the area density over (s, v), dS dv = (1 + v eta') ds dv, over w / l: D w / l again."""
    s, weights = _along(equilibrium)
    slope = np.repeat(equilibrium.parameters[:, 2], _NODES.size)
    total = 0.0
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        v = np.full(s.size, equilibrium.problem.half_width * node)
        total += 0.5 * weight * float(weights * (1.0 + v * slope) @ area_density(equilibrium, s, v))
    return total


def _along(equilibrium: Equilibrium) -> tuple[np.ndarray, np.ndarray]:
    """Abscissae and weights (24 p,)."""
    lengths = equilibrium.problem.lengths
    starts = np.concatenate([[0.0], np.cumsum(lengths)])[:-1]
    return (
        (starts[:, None] + lengths[:, None] * 0.5 * (_NODES + 1.0)).ravel(),
        (0.5 * lengths[:, None] * _WEIGHTS).ravel(),
    )
