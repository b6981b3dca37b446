r"""What the elements of a rod miss of the layers in which a force straightens it.

Along a force N a rod of bending stiffness B bends as exp(-lambda s), lambda = sqrt(N / B), or, pushed, as cos(lambda s)
(A. E. H. Love 1927, section 262): its curvature's derivative of degree q is lambda^q times itself. Rotations of degree
q have a curvature of degree q - 1, which misses on an element of length h, in the root mean square (Legendre; P. J.
Davis, Interpolation and Approximation, Dover 1975, section 10.3),

    C_q (lambda h)^q ,   C_q = q! / (2 q)! / sqrt(2 q + 1)

times itself. The root of the mean square along the rod, weighed by the bending, is the relative error of the curvature
in L2; the energy's is its square.
"""

from __future__ import annotations

import math

import numpy as np

from shellref.rod.elements import Array, Elements, State
from shellref.rod.problem import RodProblem


def missed(elements: Elements, state: State, problem: RodProblem) -> float:
    """Relative error of the curvature, estimated; 0 for a rod that is not bent."""
    stress = elements.stress(state, problem)
    stiffness = problem.section.stiffness
    bending: Array = np.sum((stress[..., 3:] / stiffness[3:]) ** 2, axis=2)
    whole = float(np.sum(elements.weights * bending))
    if whole <= np.finfo(float).tiny:
        return 0.0
    q = elements.degree
    constant = math.factorial(q) / math.factorial(2 * q) / math.sqrt(2 * q + 1)
    rate = np.sqrt(np.linalg.norm(stress[..., :3], axis=2) / float(np.min(stiffness[3:5])))
    part = constant * (np.maximum(rate, math.pi) * np.diff(elements.joints)[:, None]) ** q
    return math.sqrt(float(np.sum(elements.weights * bending * part**2)) / whole)
