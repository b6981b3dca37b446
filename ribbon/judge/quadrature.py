"""The elastic energy of a state of free twist by a rule of its own, against the one that was minimised.

An energy whose minimum hangs on its quadrature is none (issue: minima whose peaks stand between the points of a rule).
`ribbon.element.free_energy` follows the state; here the densities alone are integrated once more on the state's linear
curvatures, segment by segment, by two Gauss rules that know nothing of it, on intervals that begin and end where the
curvature passes zero and are halved until both rules agree.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.element.adaptive import beside_zero, integrated
from ribbon.energies.free import free_numbers, in_plane_stiffness, natural_numbers
from ribbon.problems.protocol import Problem

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Largest relative difference of both integrals at which a state counts as one of the energy.
TOLERANCE = 1e-8
#: Part of `TOLERANCE` that the adaptive integral may err by.
_SHARE = 1e-2


def error(problem: Problem, x: FloatArray, own: float) -> float | None:
    """|E - E_adaptive| over the elastic energy, both with the constant of the natural curvature, of the unknowns x
    (n,), whose energy by the problem's rule is `own` (D w / l); None for polynomials (energies of rulings, the
    rod), whose rule is exact, inf where the integral has no value."""
    fields = problem.fields
    if fields.energy.reach == float("inf"):
        return None
    constant = law.constant(problem.strip.curvature)
    exact = elastic(problem, x)
    size = max(abs(exact + constant), 1e-6 * constant, float(np.finfo(float).tiny))
    return abs(own - exact) / size if np.isfinite(exact) else float("inf")


def elastic(problem: Problem, x: FloatArray) -> float:
    """Elastic energy, D w / l, without the constant of the natural curvature, integrated adaptively."""
    q, lengths, fields = problem.parameters(x), problem.lengths, problem.fields
    own = problem.material.curvature
    plane = in_plane_stiffness(fields.section) if fields.in_plane else 0.0

    def density(i: IntArray, s: FloatArray) -> FloatArray:
        """Energy per length (m, g, 1) at s (m, g) on the segments i (m,)."""
        a, b, n, m = (q[i, k, None] for k in range(4))
        k, t = a * s + b, n * s + m
        natural = own[i, 0, None] + own[i, 1, None] * s
        out = np.empty((s.size, 15))
        free_numbers(
            fields.density_code, k.ravel(), t.ravel(), np.repeat(q[i, 0], s.shape[1]),
            np.repeat(q[i, 2], s.shape[1]), natural.ravel(), 0.0, fields.section, out,
        )  # fmt: skip
        rest = problem.material.rest[i]
        twist = rest[:, 0, None] + rest[:, 1, None] * s
        natural_numbers(fields.density_code, k.ravel(), t.ravel(), natural.ravel(), twist.ravel(), fields.section, out)
        found = out[:, 0].reshape(s.shape)
        if plane:
            found = found + 0.5 * plane * ((q[i, 4] - rest[:, 3])[:, None] * s + (q[i, 5] - rest[:, 2])[:, None]) ** 2
        return found[:, :, None]

    return float(integrated(density, *beside_zero(q, lengths), _SHARE * TOLERANCE)[0])
