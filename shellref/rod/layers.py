r"""What the elements of a rod miss of the layers in which a force straightens it.

Along a force N a rod of bending stiffness B bends as exp(-lambda s), lambda = sqrt(N / B), or, pushed, as cos(lambda s)
(A. E. H. Love 1927, section 262): its curvature's derivative of degree q is lambda^q times itself. Rotations of degree
q have a curvature of degree q - 1, which misses on an element of length h, in the root mean square (Legendre; P. J.
Davis, Interpolation and Approximation, Dover 1975, section 10.3),

    C_q (lambda h)^q ,   C_q = q! / (2 q)! / sqrt(2 q + 1)

times itself, and at the most itself. The root of the mean square along the rod, weighed by the bending, is the relative
error of the curvature in L2; the energy's is its square. It is least, at a number of elements, where each has the same
part of int f^(2/(2q+1)), f being the bending times lambda^q.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from shellref.law import inner
from shellref.rod.elements import Array, Elements, State
from shellref.rod.problem import RodProblem

#: Part of the joints that are spread evenly; bending over the largest that is none.
EVEN, NONE = 0.25, 1e-5


def _rough(elements: Elements, state: State, problem: RodProblem) -> tuple[Array, Array]:
    """Bending (e, g) at the Gauss points, 1/l, and lambda there, at least pi."""
    stress = elements.stress(state, problem)
    stiffness = problem.section.stiffness
    bending: Array = np.linalg.norm(stress[..., 3:] / stiffness[3:], axis=2)
    bending[bending < NONE * bending.max(initial=0.0)] = 0.0
    pulled = np.sqrt(np.linalg.norm(stress[..., :3], axis=2) / float(np.min(stiffness[3:5])))
    return bending, np.maximum(pulled, math.pi)


def missed(elements: Elements, state: State, problem: RodProblem, joints: Array | None = None) -> float:
    """Relative error of the curvature, estimated, on the rod's own elements or on those between other `joints`; 0 for a
    rod that is not bent."""
    bending, rate = _rough(elements, state, problem)
    whole = float(np.sum(elements.weights * bending**2))
    if whole <= np.finfo(float).tiny:
        return 0.0
    q = elements.degree
    constant = math.factorial(q) / math.factorial(2 * q) / math.sqrt(2 * q + 1)
    length = np.diff(elements.joints)[:, None]
    if joints is not None:
        length = np.diff(joints)[np.clip(np.searchsorted(joints, elements.points) - 1, 0, len(joints) - 2)]
    part = np.minimum(constant * (rate * length) ** q, 1.0)
    return math.sqrt(float(np.sum(elements.weights * (bending * part) ** 2)) / whole)


def fitted(elements: Elements, state: State, problem: RodProblem) -> Array:
    """Joints (E + 1,) of as many elements, each with the same part of int f^(2/(2q+1)) as far as joints at the points
    of the laws of the rest shape let it."""
    bending, rate = _rough(elements, state, problem)
    own, q = elements.joints, elements.degree
    sizes = np.diff(own)
    share = np.sum(elements.weights * (bending * rate**q) ** (2.0 / (2 * q + 1)), axis=1)
    whole = float(share.sum())
    density = (1.0 - EVEN) * (share / whole if whole > 0.0 else sizes) / sizes + EVEN
    # spread a little: a layer may be thinner than the element that it is seen on
    density = np.maximum(density, 0.5 * np.maximum(np.append(density[1:], 0.0), np.append(0.0, density[:-1])))
    reached = np.concatenate([[0.0], np.cumsum(density * sizes)])
    kept = np.concatenate([[0.0], inner(*problem.rest), [1.0]])
    ends = np.interp(kept, own, reached)
    places = np.append(0, np.cumsum(_shared(np.diff(ends), sizes.size)))
    joints = np.interp(np.interp(np.arange(places[-1] + 1), places, ends), reached, own)
    joints[places] = kept
    return joints


def _shared(parts: Array, count: int) -> NDArray[np.intp]:
    """Of so many elements how many each part has, one at the least, so that the largest element is smallest."""
    counts = np.ones(parts.size, dtype=np.intp)
    for _ in range(count - parts.size):
        counts[np.argmax(parts / counts)] += 1
    return counts
