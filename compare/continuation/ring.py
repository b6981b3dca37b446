r"""All branches that leave a branch point with two null vectors, found around it.

On a small ring in the null space, at z_0 + e (cos a v_1 + sin a v_2) + ..., everything else follows from

    G(z, t) + m M n = 0 ,   <v_1, z - z_0> = e cos a ,   <v_2, z - z_0> = e sin a ,   n = -sin a v_1 + cos a v_2

(Lyapunov and Schmidt; M. Golubitsky & D. G. Schaeffer 1985, Singularities and Groups in Bifurcation Theory I, ch. I.3,
X): t from the force along the ring's radius, m is what is left along the ring. Branches leave where m(a) passes zero,
between which its sign is seen; by their directions alone up to half of them are missed. Where m is zero all round, as
for a section with equal stiffnesses to all sides, a circle of branches leaves: one branch, turned.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from compare.continuation.correct import at
from compare.continuation.journal import journalled
from compare.continuation.pinned import Pinned
from compare.continuation.point import Options, Point, Special, length, product
from compare.continuation.system import FloatArray, System

#: Angles at which the ring is looked at; Newton steps; secants; m in tolerances that is none.
ANGLES, MOST, SECANTS, NOTHING = 48, 15, 4, 100.0


@dataclass(frozen=True)
class Ring:
    """First points of what leaves, tangents away; circle: they are one of a circle of branches, of which one is
    given, held on it (`compare.continuation.pinned`)."""

    points: tuple[Point, ...]
    circle: bool


def around(special: Special, size: float, options: Options) -> Ring | None:
    """What leaves a point with two null vectors; None where the ring is not found at this size."""
    point, modes = special.point, special.modes
    system = point.system
    seen: list[tuple[float, FloatArray, float, float]] = []
    for a in 2.0 * np.pi * (np.arange(ANGLES) + 0.37) / ANGLES:
        found = held(system, point.z, point.t, modes, float(a), size, options.tolerance)
        if found is None:
            return None
        seen.append((float(a), *found))
    force = np.array([m for *_, m in seen])
    noise = NOTHING * options.tolerance / max(system.norm(system.mass(modes[:, 0])), 1e-300)
    if float(np.abs(force).max()) <= noise:
        angle = seen[0][0]
        along = -np.sin(angle) * modes[:, 0] + np.cos(angle) * modes[:, 1]
        pinned = replace(special, point=replace(point, system=Pinned(system, along)))
        first = _first(pinned, *seen[0][:3], size, options)
        return None if first is None else Ring((first,), True)
    found_here: list[Point] = []
    for k, (a, z, t, m) in enumerate(seen):
        b, w, u, n = seen[(k + 1) % ANGLES]
        if m * n > 0.0:
            continue
        after = b + (2.0 * np.pi if b < a else 0.0), w, u, n
        first = _first(special, *_root(special, (a, z, t, m), after, size, options), size, options)
        if first is not None:
            found_here.append(first)
    return Ring(tuple(found_here), False)


def _root(
    special: Special, one: tuple[float, FloatArray, float, float], other: tuple[float, FloatArray, float, float],
    size: float, options: Options,
) -> tuple[float, FloatArray, float]:  # fmt: skip
    """Angle, z and t near where m passes zero between two places of the ring, by a few secants: the corrector goes on
    from there."""
    point = special.point
    for _ in range(SECANTS):
        (a, _, _, m), (b, _, _, n) = one, other
        angle = a - m * (b - a) / (n - m)
        found = held(point.system, point.z, point.t, special.modes, angle, size, options.tolerance)
        if found is None or found[2] == 0.0:
            break
        if (found[2] > 0.0) == (m > 0.0):
            one = angle, *found
        else:
            other = angle, *found
    (a, z, t, m), (b, w, u, n) = one, other
    share = m / (m - n)
    return a + share * (b - a), (1.0 - share) * z + share * w, (1.0 - share) * t + share * u


def _first(special: Special, angle: float, z: FloatArray, t: float, size: float, options: Options) -> Point | None:
    """The equilibrium at the ring's angle, its tangent away."""
    point, modes = special.point, special.modes
    out = np.cos(angle) * modes[:, 0] + np.sin(angle) * modes[:, 1]
    first = at(point, size, options.tolerance, guess=(z, t), across=(out, 0.0))
    if first is None or length(point.system, first.z - z, first.t - t) > 0.1 * size:
        return None
    away = first.z - point.z, first.t - point.t
    return first if product(point.system, away, first.tangent) > 0.0 else first.turned()


@journalled(
    lambda system, *asked: (type(system).__name__, *asked),
    lambda found: [] if found is None else [np.asarray(part) for part in found],
    lambda kept: (kept[0], float(kept[1]), float(kept[2])) if kept else None,
)
def held(
    system: System, z: FloatArray, t: float, modes: FloatArray, angle: float, size: float, tolerance: float
) -> tuple[FloatArray, float, float] | None:
    """z, t and m on the ring around (z, t); None where Newton's iteration does not settle."""
    middle = z
    rows = np.column_stack([system.mass(modes[:, k]) for k in range(2)])
    goal = size * np.array([np.cos(angle), np.sin(angle)])
    across = -np.sin(angle) * rows[:, 0] + np.cos(angle) * rows[:, 1]
    z, m = system.stepped(middle, modes @ goal), 0.0
    for _ in range(MOST):
        left, missed = system.residual(z, t) + m * across, rows.T @ (z - middle) - goal
        norm = system.norm(left)
        if not np.isfinite(norm):
            return None
        if norm <= tolerance and float(np.abs(missed).max()) <= 1e-10:
            return z, t, m
        factor = system.factor(z, t)
        if factor is None:
            return None
        right = np.column_stack([system.rate(z, t), across, left])
        solved = factor.solve(right)
        small = rows.T @ solved
        try:
            dt, dm = np.linalg.solve(small[:, :2], missed - small[:, 2])
        except np.linalg.LinAlgError:
            return None
        dz = -solved[:, 2] - solved[:, :2] @ np.array([dt, dm])
        if not np.all(np.isfinite(dz)) or length(system, dz, dt) > 1.0:
            return None
        z, t, m = system.stepped(z, dz), t + float(dt), m + float(dm)
    return None
