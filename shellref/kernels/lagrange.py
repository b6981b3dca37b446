"""Lagrange polynomials on the Gauss-Lobatto-Legendre nodes of [0, 1], the nodes of dolfinx's elements. NumPy only."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import legendre


@cache
def lobatto(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights (degree + 1,) of the Gauss-Lobatto-Legendre rule on [0, 1].

    Nodes: 0, 1 and the zeros of P_k'; weights 1 / (k (k + 1) P_k(x)^2) on the unit interval. Degree 2 is Simpson's
    rule.
    """
    p = np.zeros(degree + 1)
    p[degree] = 1.0
    x = np.concatenate([[-1.0], np.sort(legendre.legroots(legendre.legder(p)).real), [1.0]])
    weights = 1.0 / (degree * (degree + 1) * legendre.legval(x, p) ** 2)
    return 0.5 * (1.0 + x), weights


@cache
def _coefficients(degree: int) -> np.ndarray:
    """(degree + 1, degree + 1): Legendre coefficients (rows) of the Lagrange polynomials (columns) on [-1, 1]."""
    nodes = 2.0 * lobatto(degree)[0] - 1.0
    return np.linalg.inv(legendre.legvander(nodes, degree))


def values(degree: int, t: np.ndarray) -> np.ndarray:
    """Lagrange polynomials of the nodes at t in [0, 1]: (..., degree + 1)."""
    return np.moveaxis(legendre.legval(2.0 * np.asarray(t) - 1.0, _coefficients(degree)), 0, -1)


def slopes(degree: int, t: np.ndarray) -> np.ndarray:
    """Their derivatives: (..., degree + 1)."""
    derivative = 2.0 * legendre.legder(_coefficients(degree))
    return np.moveaxis(legendre.legval(2.0 * np.asarray(t) - 1.0, derivative), 0, -1)
