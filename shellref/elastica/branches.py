r"""Other equilibria of the same problem, and whole diagrams: both branches of a pitchfork, perfect or not.

**Deflation** (P. E. Farrell, A. Birkisson, S. W. Funke, SIAM J. Sci. Comput. 37, A2026 (2015),
doi 10.1137/140984798). Newton on eta(z) G(z) = 0, with eta = prod_i (1 / |z - z_i|^2 + 1) over the known equilibria z_i
(L2 norm of theta), has no roots but the others. Its step is the plain one, d = -J^-1 G, times
1 / (1 - <grad log eta, d>).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from shellref.elastica.arc import ArcOptions, Branch, Point, point_at, switch, trace
from shellref.elastica.problem import Array
from shellref.elastica.system import System, solve_sparse

MOST_TURN = 1.0
"""Radians that a section may turn in one deflated step."""

SAME = 1e-6
"""Distance (L2 norm of the angle) below which two equilibria are one."""


def deflated(
    system: System, guess: Array, t: float, known: Sequence[Array], tolerance: float, iterations: int = 100
) -> Array | None:
    """An equilibrium z (N + m,) at t that is none of `known`; None when Newton from this guess finds none."""
    z = guess.copy()
    for _ in range(iterations):
        residual = system.residual(z, t)
        norm = system.norm(residual)
        if not math.isfinite(norm):
            return None
        if norm <= tolerance:
            return z if all(_distance(system, z, other) > SAME for other in known) else None
        newton = solve_sparse(system.jacobian(z, t), -residual)
        if newton is None:
            return None
        slope = 0.0
        for other in known:
            square = max(_distance(system, z, other) ** 2, 1e-30)
            slope -= 2.0 * system.product(z - other, newton) / (square * (1.0 + square))
        step = newton / (1.0 - slope) if slope != 1.0 else newton
        turn = system.discrete.turned(step[: system.count])
        z += step * min(1.0, MOST_TURN / max(turn, 1e-300))
    return None


def equilibria(system: System, t: float, guesses: Sequence[Array], options: ArcOptions | None = None) -> list[Point]:
    """Every equilibrium at t that deflation reaches from these guesses, those with the lowest eigenvalue last.

    No proof that there are no others: a list of what was found.
    """
    options = options or ArcOptions()
    found: list[Array] = []
    for guess in guesses:
        while (z := deflated(system, guess, t, found, options.tolerance)) is not None:
            found.append(z)
    points = [p for p in (point_at(system, z, t, options) for z in found) if p is not None]
    return sorted(points, key=lambda p: -float(p.eigenvalues[0]))


def diagram(
    system: System,
    start: Point,
    span: tuple[float, float],
    guesses: Sequence[Array] = (),
    options: ArcOptions | None = None,
) -> list[Branch]:
    """The path from `start` through `span`, the branches that leave it, and those not connected with it.

    Branches of bifurcations of the first path come next, in order along it (both sides); then paths through the
    equilibria at span[1] that deflation finds from `guesses` (and from the ends of the branches) and that lie on none
    of those already followed: each is traced back from span[1] until it leaves the span or ends there again.
    """
    options = options or ArcOptions()
    branches = [trace(system, start, 1.0, span, options)]
    for event in branches[0].bifurcations():
        branches += [trace(system, point, _outwards(point), span, options) for point in switch(system, event, options)]
    ends = [b.points[-1].z for b in branches if b.ended == "reached"]
    for point in equilibria(system, span[1], [*guesses, *ends], options):
        if any(_distance(system, point.z, end) < SAME for end in ends):
            continue
        branch = trace(system, point, -1.0, span, options)
        branches.append(branch)
        ends += [point.z, branch.points[-1].z] if branch.ended == "reached" else [point.z]
    return branches


def _outwards(point: Point) -> float:
    """Direction in t in which a switched branch already goes; `trace` keeps the tangent then."""
    return 1.0 if point.tangent[1] >= 0.0 else -1.0


def _distance(system: System, a: Array, b: Array) -> float:
    change = a - b
    return math.sqrt(max(system.product(change, change), 0.0))


def mirrored(system: System, z: Array, angle: float) -> Array:
    """The shape (N + m,) with every section turned to the other side of `angle`, 2 angle - theta: a guess."""
    other = z.copy()
    straight = system.discrete.projected(np.full_like(system.discrete.s, angle))
    other[: system.count] = 2.0 * straight - z[: system.count]
    other[: system.count][system.discrete.given] = z[: system.count][system.discrete.given]
    return other
