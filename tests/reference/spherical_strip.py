r"""A Sadowsky strip that carries a moment and no force: its centreline lies on a sphere (E. L. Starostin and G. H. M.
van der Heijden 2018, doi:10.1103/PhysRevE.97.023001), by two ways that share nothing but the energy.

Lengths in l, energies in D w / l, W = kappa^2 (1 + eta^2)^2 / 2, tau = eta kappa. The moment M is the same vector
everywhere, and its parts in the strip's frame are :math:`M_1 = \partial W / \partial \kappa = \kappa (1 - \eta^4)`,
:math:`M_3 = \partial W / \partial \tau = 2 \kappa \eta (1 + \eta^2)`, whence

    eta = tan(atan2(M_3, M_1) / 2) ,   kappa = sqrt(M_1^2 + M_3^2) / (1 + eta^2)^2 .

`by_moment` integrates the frame with these: an initial value problem, of which M and the frame at s = 0 are all.
`by_ruling` eliminates the frame: the balance of moments leaves kappa (1 + eta^2) = c and, with |M|,

    eta' = -M_2 / (2 (1 + eta^2)) ,   M_2^2 = M^2 - c^2 (1 + eta^2)^2 ,

so that M_2' = c^2 eta; then (1 / kappa)^2 + ((1 / kappa)' / tau)^2 = (M / c^2)^2, a sphere of the radius |M| / c^2. The
curve is then found by Frenet's equations from curvature and torsion, in mpmath's Taylor series.
"""

from __future__ import annotations

import mpmath
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

FloatArray = NDArray[np.float64]


def by_moment(
    curvature: float, ruling: float, across: float, s: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places (k, 3) and frames (k, 3, 3) with columns t_x, t_y, t_z at abscissae s, from the origin and the frame of
    the axes; kappa and eta (2, k) there. across: M_2 at s = 0, the part of the moment about t_y."""
    moment = np.array([curvature * (1.0 - ruling**4), across, 2.0 * curvature * ruling * (1.0 + ruling**2)])

    def strains(frame: FloatArray) -> tuple[float, float]:
        m1, _, m3 = frame.T @ moment
        eta = np.tan(0.5 * np.arctan2(m3, m1))
        return float(np.hypot(m1, m3) / (1.0 + eta**2) ** 2), float(eta)

    def rates(_s: float, y: FloatArray) -> FloatArray:
        frame = y[3:].reshape(3, 3)
        kappa, eta = strains(frame)
        tau = kappa * eta
        spin = np.array([[0.0, -tau, 0.0], [tau, 0.0, -kappa], [0.0, kappa, 0.0]])
        return np.concatenate([frame[:, 2], (frame @ spin).ravel()])

    begin = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    y = solve_ivp(rates, (0.0, 1.0), begin, t_eval=s, method="DOP853", rtol=1e-12, atol=1e-13).y.T
    frames = y[:, 3:].reshape(-1, 3, 3)
    return y[:, :3], frames, np.array([strains(frame) for frame in frames]).T


def by_ruling(curvature: float, ruling: float, across: float, s: float) -> FloatArray:
    """The place (3,) at s of the same strip."""
    c = curvature * (1 + ruling**2)

    def rates(_s, y):  # type: ignore[no-untyped-def]
        eta, m2, t, n, b = y[0], y[1], y[2:5], y[5:8], y[8:11]
        kappa = c / (1 + eta**2)
        tau = kappa * eta
        turned = [kappa * x for x in n]
        bent = [tau * z - kappa * x for x, z in zip(t, b, strict=True)]
        return [-m2 / (2 * (1 + eta**2)), c**2 * eta, *turned, *bent, *(-tau * x for x in n), *t]

    # The curvature vector of a frame that turns about t_x by kappa is -t_y; Frenet's binormal is t_z x (-t_y) = t_x.
    begin = [ruling, across, 0, 0, 1, 0, -1, 0, 1, 0, 0, 0, 0, 0]
    with mpmath.workdps(20):
        found = mpmath.odefun(rates, 0, begin, tol=mpmath.mpf(10) ** -13)(s)
    return np.array([float(x) for x in found[11:]])
