"""Other equilibria of one problem: Newton's iteration that is turned away from those that are known.

Deflation (P. E. Farrell, A. Birkisson & S. W. Funke 2015, doi:10.1137/140984798): Newton on eta(z) G(z) = 0, with
eta = prod_i (1 / |z - z_i|^2 + 1) over the known z_i in the metric of shapes, has no roots but others. Its step is the
plain one, d = -K^-1 G, times 1 / (1 - <grad log eta, d>). A list of what it finds is no proof that there is no more.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compare.continuation.system import FloatArray, System

#: Newton steps, longest step in the metric, and distance below which two equilibria are one.
STEPS, LONGEST, SAME = 60, 0.5, 1e-4
#: Residual beyond which a start is given up.
_LOST = 1e8


def distance(system: System, one: FloatArray, other: FloatArray) -> float:
    """Distance of two z (n,) in the metric of shapes."""
    change = one - other
    return float(np.sqrt(max(float(system.mass(change) @ change), 0.0)))


def deflated(
    system: System, guess: FloatArray, t: float, known: Sequence[FloatArray], tolerance: float
) -> tuple[FloatArray, int] | None:
    """An equilibrium z (n,) at t that is none of `known`, and the number of its unstable modes; None where Newton's
    iteration from `guess` finds none."""
    z = guess.copy()
    for _ in range(STEPS):
        residual = system.residual(z, t)
        norm = system.norm(residual)
        if not np.isfinite(norm) or norm > _LOST:
            return None
        factor = system.factor(z, t)
        if factor is None:
            return None
        if norm <= tolerance:
            if any(distance(system, z, other) <= SAME for other in known):
                return None
            return (z, factor.unstable) if not np.any(system.slacks(z, t) < -1e-8) else None
        step = -factor.solve(residual)
        if not np.all(np.isfinite(step)):
            return None
        slope = 0.0
        for other in known:
            square = max(distance(system, z, other) ** 2, 1e-30)
            slope -= 2.0 * float(system.mass(z - other) @ step) / (square * (1.0 + square))
        if slope != 1.0:
            step = step / (1.0 - slope)
        size = distance(system, step, np.zeros_like(step))
        step *= min(1.0, LONGEST / max(size, 1e-300))
        z = z + system.reach(z, step) * step
    return None
