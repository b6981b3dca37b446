"""Where an energy of free twist does not say itself how long its states are: the share of the strip without convexity.

With curvature k and twist t free of each other and no gradients in the density e(k, t), a minimum has there a Hessian
e_vv, v = (k, t), that is not negative in any direction (Legendre's condition: I. Gelfand, S. Fomin 1963, "Calculus of
Variations", section 25): else waves as short as one likes lower the energy, and only the elements keep them from it.
Such a state is "stable" on its elements and has no limit on finer ones. Gradients with a Hessian e_dd,
d = v', add q^2 e_dd for waves of the number q; what is shorter than the strip is thick is none of a strip's. So the
density counts as convex where

    e_vv + q^2 e_dd   has no negative eigenvalue,   q = 1 / h

(docs/theory.md, chapter 10, "Passages": `sano` and `extensible` are not where zeta |tau| > sqrt(1 + nu) near k = 0).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.energies.free import free_numbers, natural_numbers
from ribbon.problems.protocol import Problem

FloatArray = NDArray[np.float64]

#: Samples of a segment, evenly in asinh(k / r), so that a passage of zero curvature has its own, however short it is.
SAMPLES = 33
#: Part of an eigenvalue's size that is rounding.
_ROUNDING = 1e-12
#: Imaginary part up to which a root is a real one (a value near it is one of the polynomial all the same).
_REAL = 1e-6


def share(problem: Problem, x: FloatArray) -> float | None:
    """Share of the strip's length (0 to 1) on which the density is not convex, for the unknowns x (n,); None for
    energies that are convex everywhere (of rulings, whose twist is no field, and polynomials)."""
    fields = problem.fields
    if fields.energy.reach == float("inf"):
        return None
    q, lengths = problem.parameters(x), problem.lengths
    s = samples(q, lengths, passage(problem))
    a, b, n, m = (q[:, i, None] for i in range(4))
    starts = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])[:, None]
    natural = law.at(problem.strip.curvature, starts + s)
    numbers = np.empty((s.size, 15))
    k, twist, of_k, of_twist, own = (
        np.broadcast_to(one, s.shape).ravel() for one in (a * s + b, n * s + m, a, n, natural)
    )
    free_numbers(fields.density_code, k, twist, of_k, of_twist, own, 0.0, fields.section, numbers)
    rest = law.at(problem.strip.twist, starts + s).ravel()
    natural_numbers(fields.density_code, k, twist, own, rest, fields.section, numbers)
    bad = (lowest(numbers, fields.section[1]) < 0.0).reshape(s.shape)
    # an interval between samples counts by its bad ends
    return float(np.sum(np.diff(s, axis=1) * 0.5 * (bad[:, 1:].astype(float) + bad[:, :-1])))


def curved_slack(omega: FloatArray, eta: FloatArray, natural: FloatArray, poisson: float) -> FloatArray:
    """omega^2 (1 + eta^2) - nu K omega, 1/l^2, like omega (k,), 1/l, eta (k,) and K (k,), 1/l: Sadowsky's density is
    convex in curvature and twist where it is positive (docs/theory.md, eq. (6.4)).

    With k = omega, t = eta omega the density 1/2 (k^2 + t^2)^2 / k^2 - K (k + nu t^2 / k) has e_tt = 2 + 6 eta^2 -
    2 nu K / k and the determinant (1 + eta^2)^2 (2 (1 + eta^2) - 2 nu K / k)."""
    return np.asarray(omega * omega * (1.0 + eta * eta) - poisson * natural * omega)


def least_slack(omega: FloatArray, eta: FloatArray, natural: FloatArray, poisson: float) -> FloatArray:
    """The least `curved_slack` (p,), 1/l^2, on every segment between joints with these values (p + 1,), which are
    linear in between: at an end, or where the slope of the slack, a polynomial of the fourth degree, is zero."""
    found = curved_slack(omega, eta, natural, poisson)
    least = np.minimum(found[1:], found[:-1])
    for k in range(least.size):
        k_, n, own = (np.array([one[k + 1] - one[k], one[k]]) for one in (omega, eta, natural))
        turned = np.polyadd(np.polymul(n, n), [1.0])
        slack = np.polymul(k_, np.polysub(np.polymul(k_, turned), poisson * own))
        roots = np.roots(np.polyder(slack))
        inside = roots.real[(np.abs(roots.imag) < _REAL) & (roots.real > 0.0) & (roots.real < 1.0)]
        least[k] = min(least[k], np.polyval(slack, inside).min(initial=np.inf))
    return np.asarray(least)


def lowest(numbers: FloatArray, thickness: float) -> FloatArray:
    """Lowest eigenvalue (m,) of e_vv + e_dd / h^2, from the fifteen numbers (m, 15) of `ribbon.energies.free`; what is
    rounding is zero, and where one is not finite it is -inf."""
    short = 0.0 if not thickness > 0.0 else 1.0 / thickness**2
    kk, kt, tt = (numbers[:, i] + short * numbers[:, j] for i, j in ((5, 12), (6, 13), (9, 14)))
    middle, turn = 0.5 * (kk + tt), np.hypot(0.5 * (kk - tt), kt)
    found = middle - turn
    found = np.where(np.abs(found) <= _ROUNDING * (np.abs(middle) + turn), 0.0, found)
    return np.asarray(np.where(np.isfinite(found), found, -np.inf))


def passage(problem: Problem) -> float:
    """r, up to about which the curvature k (1/l) is small for the density (docs/theory.md, eq. (10.26))."""
    half_width, thickness, poisson = problem.fields.section[:3]
    reach = problem.fields.energy.reach
    return float(reach * np.sqrt(60.0 / (1.0 - poisson**2)) * thickness / (4.0 * half_width**2))


def samples(q: FloatArray, lengths: FloatArray, r: float) -> FloatArray:
    """Abscissae (p, SAMPLES) on segments with parameters q (p, 4 or 6), evenly in asinh(k / r); evenly along where the
    curvature hardly changes, or r = 0."""
    even = np.linspace(0.0, 1.0, SAMPLES)
    along = lengths[:, None] * even
    if not r > 0.0:
        return np.asarray(along)
    first, last = q[:, 1], q[:, 0] * lengths + q[:, 1]
    u0, u1 = np.arcsinh(first / r), np.arcsinh(last / r)
    turned = np.abs(u1 - u0) > 1e-6
    k = r * np.sinh(u0[:, None] + (u1 - u0)[:, None] * even)
    with np.errstate(divide="ignore", invalid="ignore"):
        there = (k - first[:, None]) / q[:, 0, None]
    found = np.where(turned[:, None], np.clip(there, 0.0, lengths[:, None]), along)
    found[:, 0], found[:, -1] = 0.0, lengths
    return np.asarray(np.maximum.accumulate(found, axis=1))
