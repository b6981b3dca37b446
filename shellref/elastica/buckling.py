r"""Linear buckling of a straight planar strut: loads and modes, by elements of any degree on scikit-fem.

Around theta_0 (straight), an axial force P towards the start gives (lab sheet, 2.1; docs/theory.md, eq. (8.6))::

    int dtheta' v' - P int dtheta v = 0 ,     dtheta = 0 where theta is given,   int dtheta = 0 where the end slides

    clamped-free       P_i = (2 i - 1)^2 pi^2 / 4 ,  modes sin(sqrt(P_i) s)      (the sheet's formula drops the root)
    pinned-pinned      P_i = i^2 pi^2 ,              modes cos(sqrt(P_i) s)
    clamped-pinned     P_i = x_i^2 with tan x = x    modes 1 - cos(x s) - ... ;  x_1 = 4.4934
    clamped-clamped    P_i = 4 pi^2, 8.9868^2, ...

The mode is that of the angle; the end slides on the axis in all but the first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from shellref.elastica.fem import Discretisation
from shellref.elastica.problem import Array, ElasticaProblem, LoadPath
from shellref.elastica.system import MOST_DENSE, System, dense_pairs, sparse_pairs

ENDS = ("clamped-free", "pinned-pinned", "clamped-pinned", "clamped-clamped")


@dataclass(frozen=True)
class BucklingModes:
    """loads (k,) ascending in D w / l^2; modes (k, n + 1): the angle at the joints s (n + 1,), largest value 1."""

    loads: Array
    s: Array
    modes: Array
    unknowns: int


def strut(ends: str, force: float = 0.0) -> ElasticaProblem:
    """A straight strut along x pushed by `force` (D w / l^2), its end sliding on the axis unless it is free."""
    if ends not in ENDS:
        raise ValueError(f"ends = {ends!r}: must be one of {', '.join(ENDS)}")
    first, second = ends.split("-")
    return ElasticaProblem(
        force=(-force, 0.0),
        start_angle=0.0 if first == "clamped" else None,
        end_angle=0.0 if second == "clamped" else None,
        end=None if second == "free" else (1.0, 0.0),
        slide=None if second == "free" else (1.0, 0.0),
    )


def buckling_modes(
    elements: int | Array, degree: int = 1, count: int = 4, ends: str = "clamped-free", hermite: bool = False
) -> BucklingModes:
    """The first buckling loads and modes of a straight strut on equal elements, or on joints (n + 1,) from 0 to 1."""
    if isinstance(elements, (int, np.integer)):
        if elements < 1:
            raise ValueError(f"elements = {elements}: must be a whole number >= 1")
        elements = np.linspace(0.0, 1.0, int(elements) + 1)
    problem = strut(ends)
    system = System(elements, degree, LoadPath(problem, problem), hermite)
    discrete = system.discrete
    straight = np.zeros(system.size)
    rows = system.holding(straight)[:, discrete.free]
    available = len(discrete.free) - len(rows)
    if not 1 <= count <= available:
        raise ValueError(f"count = {count}: these elements have {available} buckling modes; use more elements")
    stiffness = discrete.tangent(straight[: system.count], problem)
    if len(discrete.free) > MOST_DENSE:
        below = 0.0 if len(discrete.given) else -1.0
        _, vectors = sparse_pairs(stiffness, discrete.mass, rows, count, below)
    else:
        _, vectors = dense_pairs(stiffness, discrete.mass, rows, count)
    return BucklingModes(
        _rayleigh(discrete, vectors), discrete.nodes, _at_joints(discrete, vectors), len(discrete.free)
    )


def _rayleigh(discrete: Discretisation, vectors: Array) -> Array:
    """int v'^2 / int v^2 of modes (F, k): shape (k,).

    Summed at quadrature points, of v' itself: its rounding is of the order of eps n for n elements, that of the
    assembled stiffness eps n^2 (2e-10 for 1000 quadratic elements); the mode's own error enters with its square.
    """
    loads = np.zeros(vectors.shape[1])
    for k, vector in enumerate(vectors.T):
        coefficients = np.zeros(discrete.basis.N)
        coefficients[discrete.free] = vector
        mode = discrete.basis.interpolate(coefficients)
        loads[k] = np.sum(discrete.ds * np.asarray(mode.grad)[0] ** 2) / np.sum(discrete.ds * np.asarray(mode) ** 2)
    return loads


def _at_joints(discrete: Discretisation, vectors: Array) -> Array:
    """Modes at the joints (k, n + 1), largest value 1 and that positive."""
    modes = np.zeros((vectors.shape[1], len(discrete.nodes)))
    for mode, vector in zip(modes, vectors.T, strict=True):
        coefficients = np.zeros(discrete.basis.N)
        coefficients[discrete.free] = vector
        mode[:] = discrete.angle(coefficients, discrete.nodes)
        mode /= mode[np.argmax(np.abs(mode))]
    return modes


def exact_loads(ends: str, count: int = 4) -> Array:
    """The closed forms of the module's head, shape (count,)."""
    order = np.arange(1, count + 1)
    if ends == "clamped-free":
        return (2 * order - 1) ** 2 * math.pi**2 / 4.0
    if ends == "pinned-pinned":
        return order**2 * math.pi**2
    if ends not in ENDS:
        raise ValueError(f"ends = {ends!r}: must be one of {', '.join(ENDS)}")

    def tangent_root(i: int) -> float:
        """i-th x > 0 with tan x = x."""
        low, high = i * math.pi, (i + 0.5) * math.pi
        return float(brentq(lambda x: math.sin(x) - x * math.cos(x), low, high, xtol=1e-15, rtol=1e-15))

    if ends == "clamped-pinned":
        return np.array([tangent_root(i) ** 2 for i in order])
    even = [(2.0 * math.pi * i) ** 2 for i in order]  # and sqrt(P) / 2 a root of tan x = x
    odd = [(2.0 * tangent_root(i)) ** 2 for i in order]
    return np.sort([*even, *odd])[:count]
