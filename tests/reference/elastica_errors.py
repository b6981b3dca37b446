"""Discretisation errors of the planar elastica over meshes, against a far finer solution."""

from __future__ import annotations

import math

import numpy as np

from shellref.elastica.solve import ElasticaProblem, solve

GENERAL = ElasticaProblem(gamma=25.0, up=(0.6, 0.8), curvature=(4.0, -3.0), force=(1.5, -2.0))
#: name -> degree, Hermite or not, numbers of elements, order of theta in L2, order of tip and energy
KINDS = {
    "P1": (1, False, (8, 16, 32, 64, 128), 2, 2),
    "P2": (2, False, (8, 16, 32, 64, 128), 3, 4),
    "P3": (3, False, (8, 16, 32, 64), 4, 6),
    "P4": (4, False, (4, 8, 16, 32), 5, 8),
    "Hermite": (3, True, (8, 16, 32, 64), 4, 6),
}
CELLS = 384


def errors(kind: str, problem: ElasticaProblem = GENERAL) -> dict[str, np.ndarray]:
    """Errors over the meshes of `KINDS`: theta in L2, tip (distance), energy; each (meshes,), elements with them."""
    degree, hermite, counts, _, _ = KINDS[kind]
    reference = solve(problem, np.linspace(0.0, 1.0, CELLS + 1), 4, estimate_error=False)
    points, weights = np.polynomial.legendre.leggauss(6)
    cells = np.linspace(0.0, 1.0, CELLS + 1)  # the joints of every mesh are among them
    s = (0.5 * (cells[1:] + cells[:-1])[:, None] + 0.5 / CELLS * points).ravel()
    weight = np.tile(0.5 / CELLS * weights, CELLS)
    exact = reference.angle(s)
    rows = []
    for count in counts:
        result = solve(problem, np.linspace(0.0, 1.0, count + 1), degree, estimate_error=False, hermite=hermite)
        rows.append([
            math.sqrt(weight @ (result.angle(s) - exact) ** 2),
            math.dist(result.end, reference.end),
            abs(result.energy.total - reference.energy.total),
        ])  # fmt: skip
    angle, tip, energy = np.array(rows).T
    return {"elements": np.array(counts), "angle": angle, "tip": tip, "energy": energy}


def orders(values: np.ndarray, elements: np.ndarray) -> np.ndarray:
    """Observed orders between neighbouring meshes, (meshes - 1,)."""
    return -np.diff(np.log(values)) / np.diff(np.log(elements))
