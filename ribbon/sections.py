"""Where the particles of a strip stand whose sections have a shape of their own (energies of a free twist).

The strip's middle line is the centreline r(S), of length 1 and with the frame t_x, t_y, t_z of curvatures k, t; the
particle (S, v) of the flat strip stands at (docs/theory.md, eq. (10.19))::

    x = r + (v + u) t_x + f t_y + g t_z ,   f = F(v) - F(0)

F the deflection of the model's own section (`FREE_ENERGIES[name].section`). In the plane, with ' the derivative along
the strip at a fixed v and f_v that across, u and g follow to the second order in the deflection from

    x_v . x_v = 1 :   u_v = - f_v^2 / 2                                       (lengths across)
    x_S . x_v = 0 :   g_v = t (f - v f_v) - u' - f_v f'                       (right angles)

both zero at v = 0. What is left of either is of the fourth order in w (curvatures fixed). Lengths along,
``x_S . x_S - 1 = 2 k f + t^2 v^2 + ...``, are what the model's membrane energy is of, less their mean. An oblique
cylinder has f = - (t^2 / k) v^2 / 2: its middle line is a helix of unit length, its lengths along are kept, and the
surface is the exact one to the fourth order in w as h -> 0. With r the line of the centroid (mean of f zero), which is
shorter by t^2 w^2 / 24, that would be the second order.

A clamp that holds a whole edge holds it flat; the models hold the twist there at most (t = 0), and the section still
curves by nu (k - K): the surface shows what the energy has.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.energies import FREE_ENERGIES
from ribbon.energies.section.profile import Local, Profile, Shape

FloatArray = NDArray[np.float64]

#: Gauss points between the middle line and a particle; they crowd towards the edge, where the layers are.
_POINTS = 12
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_POINTS)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
#: They and both ends, over the particle's distance from the middle line.
_PLACES = np.concatenate([[0.0], _NODES, [1.0]])


def _differences(nodes: FloatArray) -> FloatArray:
    """(n, n): from the values of a polynomial at the nodes (n,) to those of its derivative (barycentric)."""
    apart = nodes[:, None] - nodes[None, :]
    np.fill_diagonal(apart, 1.0)
    weight = 1.0 / apart.prod(axis=1)
    found = weight[None, :] / weight[:, None] / apart
    np.fill_diagonal(found, 0.0)
    np.fill_diagonal(found, -found.sum(axis=1))
    return found


_BY_NODE = _differences(_NODES)
#: Distance (l) from a joint within which a place is on it.
_JOINT = 1e-10


def local_state(equilibrium: Any, s: FloatArray) -> Local:
    """Curvatures with their derivatives at abscissae (k,) in [0, 1] of a `ribbon.Equilibrium` with a free twist; the
    derivatives jump at the joints, where they are the mean of both sides: whichever side rounding puts `s` on."""
    problem = equilibrium.problem
    q = equilibrium.parameters
    joints = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    last = len(q) - 1
    behind = np.clip(np.searchsorted(joints, s + _JOINT, side="right") - 1, 0, last)
    before = np.clip(np.searchsorted(joints, s - _JOINT, side="left") - 1, 0, last)

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(0.5 * (values[before] + values[behind]))

    h = s - joints[behind]
    k, t = q[behind, 0] * h + q[behind, 1], q[behind, 2] * h + q[behind, 3]
    natural, slope = law.at(problem.strip.curvature, s), mean(problem.material.curvature[:, 1])
    twist, rate = law.at(problem.strip.twist, s), mean(problem.material.rest[:, 1])
    return Local(k, t, mean(q[:, 0]), mean(q[:, 2]), natural, slope, twist, rate)


def offsets(
    section: Profile, local: Local, v: float, numbers: tuple[float, ...], shape: Shape | None = None
) -> tuple[FloatArray, FloatArray]:
    """v + u, f, g (k, 3) of the particles at `v` of sections in the states `local` (`local_state`), units of l, and the
    unit normals (k, 3) of the surface there; both by components along the frame. section: of the energy, numbers: of
    the strip (`FreeSectionNumbers`); shape: of the sections at |v| times `_PLACES`, None: not known yet; it is even
    across."""
    shape = section.shape(local, abs(v) * _PLACES, numbers) if shape is None else shape
    return _moved(local, v, shape), _normals(local, v, shape)


def _moved(local: Local, v: float, shape: Shape) -> FloatArray:
    """v + u, f, g (k, 3) of `offsets`."""
    side = -1.0 if v < 0.0 else 1.0
    f, by_y, by_s = shape.f - shape.f[:, :1], side * shape.across, shape.along - shape.along[:, :1]
    weight = v * _WEIGHTS
    slope, along = by_y[:, 1:-1], by_s[:, 1:-1]
    turned = along @ _BY_NODE.T / v if v != 0.0 else np.zeros_like(along)  # of the slope, along the strip
    u = -0.5 * (slope**2) @ weight
    g = local.t * (2.0 * f[:, 1:-1] @ weight - v * f[:, -1])
    g += (slope * turned) @ (weight * v * (1.0 - _NODES)) - (slope * along) @ weight
    return np.stack([v + u, f[:, -1], g], axis=1)


def _normals(local: Local, v: float, shape: Shape) -> FloatArray:
    """Unit normals (k, 3) of `offsets`."""
    k, t = local.k, local.t
    side = -1.0 if v < 0.0 else 1.0
    f, by_y, by_s = shape.f[:, -1] - shape.f[:, 0], side * shape.across[:, -1], shape.along[:, -1] - shape.along[:, 0]
    across = np.stack([1.0 - 0.5 * by_y**2, by_y, t * (f - v * by_y)], axis=1)
    lengthwise = np.stack([-t * f, v * t + by_s, 1.0 + k * f], axis=1)
    normal = np.cross(lengthwise, across)
    return np.asarray(normal / np.linalg.norm(normal, axis=1)[:, None])


def placed(equilibrium: Any, material: FloatArray) -> FloatArray:
    """v + u, f, g (N, 3) of the particles (S, v) of `material` (N, 2), units of l, of a `ribbon.Equilibrium` with a
    free twist, along the frame (`offsets`)."""
    return _each(equilibrium, material, _moved)


def normals(equilibrium: Any, material: FloatArray) -> FloatArray:
    """Unit normals (N, 3) there, along the frame."""
    return _each(equilibrium, material, _normals)


def _each(equilibrium: Any, material: FloatArray, wanted: Callable[[Local, float, Shape], FloatArray]) -> FloatArray:
    """What is `wanted` (N, 3) at the particles, both sides by one shape of the sections."""
    section = FREE_ENERGIES[equilibrium.problem.energy].section
    assert section is not None
    numbers = equilibrium.problem.fields.section
    found = np.empty((len(material), 3))
    apart = np.abs(material[:, 1])
    known: tuple[FloatArray, Local] | None = None
    for size in np.unique(apart):
        rows = np.nonzero(apart == size)[0]
        s, back = np.unique(material[rows, 0], return_inverse=True)
        if known is None or not np.array_equal(known[0], s):  # of a grid the same for all
            known = s, local_state(equilibrium, s)
        local = known[1]
        shape = section.shape(local, size * _PLACES, numbers)
        for side in (-1.0, 1.0):
            here = np.sign(material[rows, 1]) * side >= 0.0
            if here.any():
                found[rows[here]] = wanted(local, float(side * size), shape)[back[here]]
    return found
