"""Where branches of a strip between floor and roof begin: the free arch, folds alike, a hump on a flat part, and what a
given shape touches.

Each gives a chain (`ribbon.find.branch.chain`) and unknowns near its equilibrium, from which Newton's iteration goes
on.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ribbon.find.branch.chain import FLOOR, ROOF, Chain, Setting, filled, nodes
from ribbon.find.branch.confined import Confined

FloatArray = NDArray[np.float64]


def arch(setting: Setting, elements: int) -> tuple[Chain, FloatArray]:
    """The chain of the free arch between the clamps, and z near it: a wave of the clamped column, with its thrust."""
    free = Chain((FLOOR, FLOOR), False, elements)
    size = 2.0 * np.sqrt(setting.delta)
    rest = np.array([1.0, -0.5 * setting.gamma, -4.0 * np.pi**2, 0.0])
    return free, filled(free, [size * np.sin(2.0 * np.pi * nodes(elements))], rest)


def waves(setting: Setting, folds: int, elements: int) -> tuple[Chain, FloatArray]:
    """The chain of so many folds that touch the roof, alike, and z near it, for heights near those without force."""
    planes = (FLOOR, *((ROOF, FLOOR) * folds))
    many = Chain(planes, False, elements)
    length = 0.5 / folds
    half = np.sin(np.pi * nodes(elements))
    amplitude = 2.0 * np.sqrt(setting.delta)
    angles = [(1.0 if k % 2 == 0 else -1.0) * amplitude * half for k in range(many.arcs)]
    lifts = np.full(many.arcs, -0.5 * setting.gamma * length)
    thrust = -((2.0 * np.pi * folds) ** 2)
    return many, filled(many, angles, np.concatenate([np.full(many.arcs, length), lifts, [thrust, 0.0]]))


#: First root but zero of tan a = a: half the length of a hump, over 1 / sqrt(thrust).
HUMP = 4.493409457909064


def humped(system: Confined, z: FloatArray, t: float, size: float = 0.0) -> tuple[Confined, FloatArray]:
    """The system with a hump on the flat part at the end clamp, and z near its equilibrium. Under weight (R. E. Hobbs
    1984, doi:10.1061/(ASCE)0733-947X(1984)110:2(175), an infinite line on its bed)::

        y_xxxx + T y_xx = - Gamma , y = y_x = y_xx = 0 at its ends
        y_x = Gamma T^(-3/2) (sin u / cos a - u) ,  u = sqrt(T) x from - a to a ,  tan a = a

    without it all of the flat length is the hump, of the angle `size` (rad)."""
    setting, old = system.setting_at(t), system.chain
    thrust, xi = -old.tension(z), nodes(old.elements)
    many = replace(old, planes=(*old.planes, FLOOR), flat=setting.gamma > 0.0, weightless=False)
    if setting.gamma > 0.0:
        u = HUMP * (2.0 * xi - 1.0)
        hump, length = setting.gamma * thrust**-1.5 * (np.sin(u) / np.cos(HUMP) - u), 2.0 * HUMP / np.sqrt(thrust)
    else:
        hump, length = size * np.sin(2.0 * np.pi * xi), old.flat_length(z)
    lifts = np.concatenate([old.lifts(z), [-0.5 * setting.gamma * length]])
    last = [old.tension(z)] if many.flat else [old.tension(z), 0.0]
    rest = [np.append(old.lengths(z), length), lifts, np.array(last)]
    angles = [*(old.angle(z, k) for k in range(old.arcs)), hump]
    new = replace(system, chain=many, first=None, buckled=False, entered=None)
    return new, filled(many, angles, np.concatenate(rest))


def touching(
    setting: Setting, s: FloatArray, theta: FloatArray, floor: FloatArray, roof: FloatArray, elements: int
) -> tuple[Chain, FloatArray]:
    """The chain of a shape, angles theta (k,) at s (k,), whose contacts are at abscissae (m,) of floor and roof, and z
    near it: what touches in neighbouring samples is one place, or flat; forces that balance it best."""
    near = 2.5 * float(np.diff(s).max())
    groups = [(a, b, ROOF) for a, b in _groups(roof, near)]
    groups += [(a, b, FLOOR) for a, b in _groups(np.unique(np.concatenate([[0.0], floor, [1.0]])), near)]
    groups.sort()
    # of places that the roof pushes one after the other, without the floor between, the middle one is a place
    parts = [(0.5 * (a + b),) * 2 + (ROOF,) if plane == ROOF else (a, b, plane) for a, b, plane in groups]
    flat = any(b - a > near for a, b, plane in parts if plane == FLOOR)
    parts = [(a, b, plane) if flat else ((0.0 if a == 0.0 else 1.0 if b == 1.0 else 0.5 * (a + b),) * 2 + (plane,))
             for a, b, plane in parts]  # fmt: skip
    made = Chain(tuple(plane for *_, plane in parts), flat, elements, flat and setting.gamma == 0.0)
    angles, lengths = [], []
    for (_, a, _), (b, _, _) in pairwise(parts):
        lengths.append(b - a)
        own = np.interp(a + (b - a) * nodes(elements), s, theta)
        own[0] = own[-1] = 0.0
        angles.append(own)
    z = filled(made, angles, np.concatenate([lengths, np.zeros(made.rows)]))
    kept = slice(0, made.angles + made.arcs)
    matrix = made.jacobian(z, setting)[kept, kept.stop :]
    z[kept.stop :] = np.linalg.lstsq(matrix, -made.residual(z, setting)[kept], rcond=None)[0]
    return made, z


def _groups(places: FloatArray, near: float) -> list[tuple[float, float]]:
    """First and last of those that are neighbours."""
    ordered = np.sort(places)
    if not ordered.size:
        return []
    cuts = np.flatnonzero(np.diff(ordered) > near) + 1
    return [(float(part[0]), float(part[-1])) for part in np.split(ordered, cuts)]
