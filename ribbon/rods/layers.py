r"""What the edges of a curve-angle rod miss of the layers in which a tension straightens it.

Beside a clamp that makes the angle a with a tension N a rod bends as exp(-lambda s), lambda = sqrt(N / B) (A. E. H.
Love 1927, section 262). On edges of length h, with x = lambda h, the balance of the edges' angles, which begin half an
edge from the clamp, is

    theta_(i+1) - 2 theta_i + theta_(i-1) = x^2 theta_i ,   theta_1 - 3 theta_0 + 2 a = x^2 theta_0

The moment of the clamp is then a B lambda (1 - x^2 / 8), the layer takes a^2 / (4 lambda) (1 - 3 x^2 / 8) of the length
that is to spare, and stores a^2 B lambda / 4 (1 + x^2 / 8): between clamps, where that length is given, an energy that
is off by the part -x^2 / 4. Missed is its root, x / 2.
"""

from __future__ import annotations

import math

import numpy as np

from ribbon.rods.result import FloatArray, RodShape


def missed(shape: RodShape) -> float:
    """The root of the energy's relative error, estimated; 0 for a rod that is not bent or that nothing pulls."""
    rod, cells = shape.rod, shape.rod.cells
    bending: FloatArray = cells * np.sum((shape.strains - rod.at_rest(rod.middles))[:, :2] ** 2, axis=1)
    whole = float(bending.sum())
    if whole <= np.finfo(float).tiny:
        return 0.0
    carried = -(shape.reactions[0][0] + np.cumsum(shape.problem.loads, axis=0)[:-1])  # on every edge, by what is behind
    pull = np.maximum(np.einsum("ej,ej->e", carried, shape.edges[:, :, 2]), 0.0)
    part = 0.25 * pull * rod.lengths**2 / min(rod.stiffness[:2])
    at = 0.5 * (np.append(part, part[-1]) + np.append(part[0], part))
    return math.sqrt(float(bending @ at) / whole)
