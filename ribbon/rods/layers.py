r"""What the edges of a curve-angle rod miss of the layers in which a tension straightens it.

Beside a clamp that makes the angle a with a tension N a rod bends as exp(-lambda s), lambda = sqrt(N / B) (A. E. H.
Love 1927, section 262). On edges of length h, with x = lambda h, the balance of the edges' angles, which begin half an
edge from the clamp, is

    theta_(i+1) - 2 theta_i + theta_(i-1) = x^2 theta_i ,   theta_1 - 3 theta_0 + 2 a = x^2 theta_0

The moment of the clamp is then a B lambda (1 - x^2 / 8), the layer takes a^2 / (4 lambda) (1 - 3 x^2 / 8) of the length
that is to spare, and stores a^2 B lambda / 4 (1 + x^2 / 8): between clamps, where that length is given, an energy that
is off by the part -x^2 / 4, and at the most all of it. Missed is its root, x / 2. It is least, at a number of edges,
where each has the same part of int f^(1/3), f being lambda^2 times the square of the bending.
"""

from __future__ import annotations

import math

import numpy as np

from ribbon.rods.result import FloatArray, RodShape

#: Part of the vertices that are spread evenly; bending over the largest that is none.
EVEN, NONE = 0.25, 1e-5


def _rough(shape: RodShape) -> tuple[FloatArray, FloatArray]:
    """Square of the bending (n + 1,) at the vertices, 1/l^2, and of lambda (n,) on the edges, 1/l^2."""
    rod = shape.rod
    bending: FloatArray = np.sum((shape.strains - rod.at_rest(rod.middles))[:, :2] ** 2, axis=1)
    bending[bending < NONE**2 * bending.max(initial=0.0)] = 0.0
    carried = -(shape.reactions[0][0] + np.cumsum(shape.problem.loads, axis=0)[:-1])  # on every edge, by what is behind
    pull = np.maximum(np.einsum("ej,ej->e", carried, shape.edges[:, :, 2]), 0.0)
    return bending, pull / min(rod.stiffness[:2])


def missed(shape: RodShape, lengths: FloatArray | None = None) -> float:
    """The root of the energy's relative error, estimated, on its own edges or on those of other `lengths`; 0 for a rod
    that is not bent or that nothing pulls."""
    rod = shape.rod
    bending, pull = _rough(shape)
    stored = rod.cells * bending
    whole = float(stored.sum())
    if whole <= np.finfo(float).tiny:
        return 0.0
    h = rod.lengths
    if lengths is not None:
        middle, there = 0.5 * (rod.vertices[1:] + rod.vertices[:-1]), np.cumsum(lengths)
        h = lengths[np.clip(np.searchsorted(there, middle), 0, lengths.size - 1)]
    part = np.minimum(0.25 * pull * h**2, 1.0)
    at = 0.5 * (np.append(part, part[-1]) + np.append(part[0], part))
    return math.sqrt(float(stored @ at) / whole)


def fitted(shape: RodShape) -> FloatArray:
    """Lengths (n,) over l of as many edges, each with the same part of int f^(1/3)."""
    own, (bending, pull) = shape.rod.lengths, _rough(shape)
    share = own * (0.5 * (bending[1:] + bending[:-1]) * pull) ** (1.0 / 3.0)
    whole = float(share.sum())
    density = EVEN + (1.0 - EVEN) * (share / whole / own if whole > 0.0 else np.ones(own.size))
    # spread a little: a layer may be thinner than the edge that it is seen on
    density = np.maximum(density, 0.5 * np.maximum(np.append(density[1:], 0.0), np.append(0.0, density[:-1])))
    reached = np.concatenate([[0.0], np.cumsum(density * own)])
    return np.diff(np.interp(np.linspace(0.0, reached[-1], own.size + 1), reached, shape.rod.vertices))
