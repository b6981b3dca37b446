"""A judge of shells of strips that uses nothing of the solver: resultants, moments and energies from what is exported.

Rigid motions do no work in equilibrium: the forces of clamps and tip against the weight, and their moments about the
start clamp. The weight and its centre come from the exported surface by Gauss points in every element, the bending
energy from the surface and its directors, kappa_ab = phi_,a . d_,b by differences (P. M. Naghdi, Handbuch der Physik
VIa/2, Springer 1972), not from the solver's sums.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.battery.case import Check, holds, near
from ribbonbench import linking

Array = NDArray[np.float64]

#: Two Gauss points of an element, local coordinates; their weights are 1/2.
GAUSS = 0.5 - np.array([0.5, -0.5]) / np.sqrt(3.0)


def _points(joints: Array) -> tuple[Array, Array]:
    """Abscissae and weights (2 n,) of two Gauss points between neighbouring joints (n + 1,)."""
    size = np.diff(joints)
    return (joints[:-1, None] + size[:, None] * GAUSS).ravel(), np.repeat(0.5 * size, 2)


def centre(surface: Any) -> Array:
    """Centre (3,) of the surface by its material area."""
    k = surface.degree
    s, ws = _points(surface.s_nodes[::k])
    v, wv = _points(surface.v_nodes[::k])
    points = surface.grid(s, v)
    return np.asarray(np.einsum("a,b,abk->k", ws, wv, points) / (ws.sum() * wv.sum()))


def bending(surface: Any, poisson: float, natural: tuple[float, float]) -> float:
    """Bending energy (D w / l) of the surface and its directors, by central differences at Gauss points."""
    k = surface.degree
    s, ws = _points(surface.s_nodes[::k])
    v, wv = _points(surface.v_nodes[::k])
    grid_s, grid_v = np.meshgrid(s, v, indexing="ij")
    step = 1e-4 * min(float(np.diff(surface.s_nodes).min()), float(np.diff(surface.v_nodes).min()))

    def slope(of: Any, along: float, across: float) -> Array:
        ahead = of(grid_s + along * step, grid_v + across * step)
        return np.asarray((ahead - of(grid_s - along * step, grid_v - across * step)) / (2.0 * step))

    phi = slope(surface.evaluate, 1, 0), slope(surface.evaluate, 0, 1)
    turn = slope(surface.director, 1, 0), slope(surface.director, 0, 1)
    law = natural[0] + (natural[1] - natural[0]) * grid_s
    k11 = np.sum(phi[0] * turn[0], -1)
    k22 = np.sum(phi[1] * turn[1], -1)
    k12 = 0.5 * (np.sum(phi[0] * turn[1], -1) + np.sum(phi[1] * turn[0], -1))
    # a positive curvature K turns the tangent towards -d: phi_,1 . d_,1 = +K
    k11 = k11 - law
    density = 0.5 * ((1.0 - poisson) * (k11**2 + k22**2 + 2.0 * k12**2) + poisson * (k11 + k22) ** 2)
    return float(np.einsum("a,b,ab->", ws, wv, density) / wv.sum())


def half_turns(surface: Any, width: float, odd: bool) -> float:
    """Half turns of a closed strip of `width` (over l): its centreline linked with a line beside it, which closes after
    one round, or after two where the half turns are odd."""
    s = np.linspace(0.0, 1.0, 300, endpoint=False)
    return linking.half_turns(surface.grid(s, np.array([0.25, 0.0, -0.25]) * width), odd)


def judged(result: Any, balance: float = 1e-5, stiff: float = 0.0) -> Iterator[Check]:
    """The checks of a solved strip (`shellref.shell.result.ShellResult`).

    balance: bound of forces and moments over the largest of them; stiff: what rounding adds to it (eps times the
    membrane's stiffness over the bending's, 12 (l / h)^2).
    """
    yield holds("status converged", result.status.value == "converged", result.message)
    yield holds("no NaN in the surface", bool(np.all(np.isfinite(result.surface.points))))
    problem = result.problem
    weight = problem.gamma * np.asarray(problem.up) if problem.up is not None else np.zeros(3)
    forces = [clamp["force"] for clamp in result.clamps.values()] + [-weight]
    moments = [clamp["moment"] for clamp in result.clamps.values()]
    origin = np.asarray(problem.clamp_position)
    middle = centre(result.surface)
    if "end" in result.clamps and problem.end is not None:
        moments.append(np.cross(np.asarray(problem.end.position) - origin, result.clamps["end"]["force"]))
    moments.append(np.cross(middle - origin, -weight))
    if problem.tip is not None:
        forces.append(np.asarray(problem.tip))
        moments.append(np.cross(result.surface.centreline(np.array(1.0)) - origin, problem.tip))
    scale = max(1.0, *(float(np.linalg.norm(force)) for force in forces))
    yield Check("forces (over the largest)", float(np.linalg.norm(np.sum(forces, axis=0))) / scale, balance + stiff)
    scale = max(1.0, *(float(np.linalg.norm(moment)) for moment in moments))
    yield Check("moments (over the largest)", float(np.linalg.norm(np.sum(moments, axis=0))) / scale, balance + stiff)
    yield near("gravity energy from the surface (relative)", result.energy["gravity"], float(weight @ middle), 1e-6)
    density = float(result.energy_density.sum(axis=1).mean())
    yield holds("energy densities not negative", bool(np.all(result.energy_density >= -1e-9 * max(1.0, density))))
    own = bending(result.surface, problem.poisson, problem.natural_curvature)
    size = max(1.0, abs(result.energy["elastic"]), 0.5 * max(abs(k) for k in problem.natural_curvature) ** 2)
    yield Check(
        "bending energy from surface and directors (relative)", abs(own - result.energy["bending"]) / size, 0.02,
        said=f"{result.energy['bending']:.6g}, by differences {own:.6g}",
    )  # fmt: skip
