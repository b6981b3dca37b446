r"""Joints of a planar elastica where its shape needs them: an estimate of what its elements miss, and a mesh from it.

Where a force |p| pulls, the angle varies as exp(-s sqrt|p|) (a pendulum's separatrix), so that a derivative of the
bending w = hypot(theta' - K, theta'' / lambda) is w lambda, with lambda = max(pi, sqrt|p|), and theta'' - K' =
<t_perp, p> by the equation. The best polynomial of degree q - 1 on an element of length h misses a derivative f of
degree q of the curvature by (Legendre; P. J. Davis, Interpolation and Approximation, Dover 1975, section 10.3)

    C_q h^q f ,   C_q = q! / (2 q)! / sqrt(2 q + 1)        (root mean square),  f = w lambda^q

Missed: the root of the sum of its squares over that of the bending's own, the relative error of the curvature in L2;
the energy's is its square. It is least, at a number of elements, where each has the same part of int f^(2/(2q+1)).
"""

from __future__ import annotations

import math

import numpy as np

from shellref import law
from shellref.elastica.fem import Array
from shellref.elastica.problem import ElasticaProblem
from shellref.elastica.system import System

#: Part of the joints that are spread evenly; bending over the largest that is none.
EVEN, NONE = 0.25, 1e-5


def _rough(system: System, degree: int, z: Array, t: float) -> tuple[Array, Array]:
    """Bending (n, q), 1/l, at the quadrature points, and its derivative f of that degree there."""
    problem, discrete = system.loads(z, t), system.discrete
    theta = discrete.basis.interpolate(z[: system.count])
    angle, rate = np.asarray(theta), np.asarray(theta.grad)[0]
    px, py = problem.carried(discrete.s)
    torque = py * np.cos(angle) - px * np.sin(angle)
    scale = np.maximum(math.pi, np.sqrt(np.hypot(px, py)))
    bending = np.hypot(rate - problem.natural_curvature(discrete.s), torque / scale)
    bending[bending < NONE * bending.max()] = 0.0
    return bending, bending * scale**degree


def missed(system: System, degree: int, z: Array, t: float, nodes: Array | None = None) -> float:
    """Relative error of the curvature at z (N + m,), estimated, on its own elements or on those between other `nodes`;
    0 for a strip that is not bent."""
    bending, rough = _rough(system, degree, z, t)
    ds = system.discrete.ds
    whole = float(np.sum(ds * bending**2))
    if whole <= np.finfo(float).tiny:
        return 0.0
    constant = math.factorial(degree) / math.factorial(2 * degree) / math.sqrt(2 * degree + 1)
    length = np.diff(system.discrete.nodes)[:, None]
    if nodes is not None:
        length = np.diff(nodes)[np.clip(np.searchsorted(nodes, system.discrete.s) - 1, 0, len(nodes) - 2)]
    return constant * math.sqrt(float(np.sum(ds * (length**degree * rough) ** 2)) / whole)


def fitted(system: System, degree: int, z: Array, t: float, elements: int, problem: ElasticaProblem) -> Array:
    """Joints of about as many elements, each with the same part of int f^(2/(2q+1)); joints of the natural curvature's
    law are kept."""
    _, rough = _rough(system, degree, z, t)
    ds = system.discrete.ds
    share = np.sum(ds * rough ** (2.0 / (2 * degree + 1)), axis=1)
    whole = float(share.sum())
    nodes = system.discrete.nodes
    if not whole > 0.0:
        return law.cut(np.linspace(0.0, 1.0, elements + 1), problem.curvature)
    share = (1.0 - EVEN) * share / whole + EVEN * np.diff(nodes)
    density = share / np.diff(nodes)  # spread a little: a layer may be thinner than the element that it is seen on
    density = np.maximum(density, 0.5 * np.maximum(np.append(density[1:], 0.0), np.append(0.0, density[:-1])))
    reached = np.concatenate([[0.0], np.cumsum(density * np.diff(nodes))])
    joints = np.interp(np.linspace(0.0, reached[-1], elements + 1), reached, nodes)
    joints[0], joints[-1] = 0.0, 1.0
    return law.cut(joints, problem.curvature)
