"""The flexible section: its curvature in even Legendre polynomials, and what follows from it by integration.

Over t = v / a in [-1, 1], a = w / 2, shallow (Martin et al. 2017, eq. 6 to 8):

    kappa = kappa^i P_2i(t),   beta = z,v = a kappa^i q_i(t),   z = a^2 kappa^i r_i(t),
    q_i = int_0 P_2i dt,       r_i = int q_i dt with mean 0.

z points from the centroid to the edges where kappa > 0. One term is the plain model, an arc of angle beta = a kappa^0;
three are the enriched one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre, leggauss
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

HALF_POINTS = 8
"""Gauss points on half the section, exact to degree 31 over the whole: four factors z,s of three terms have 24."""


@dataclass(frozen=True)
class Section:
    """A tape's section. width, thickness in l; curvature across at rest times l (> 0: edges away from the normal);
    terms of its curvature that are free; warped: the membrane warps along so that it does not shear (`warping`)."""

    width: float
    thickness: float
    poisson: float
    curvature: float
    terms: int = 3
    warped: bool = False

    def __post_init__(self) -> None:
        if self.terms < 1:
            raise ValueError(f"terms = {self.terms}: a section has one or more")
        if not 0.0 < self.thickness < self.width:
            raise ValueError(f"thickness = {self.thickness}, width = {self.width}: 0 < thickness < width is needed")

    @property
    def half(self) -> float:
        """a = w / 2."""
        return 0.5 * self.width

    @property
    def stretching(self) -> float:
        """A / D = E h / D = 12 (1 - nu^2) / h^2, in 1 / l^2."""
        return 12.0 * (1.0 - self.poisson**2) / self.thickness**2

    @cached_property
    def polynomials(self) -> tuple[list[Polynomial], list[Polynomial], list[Polynomial]]:
        """P_2i, q_i and r_i over t."""
        p = [Legendre.basis(2 * i).convert(kind=Polynomial) for i in range(self.terms)]
        q = [one.integ() for one in p]
        r = [one.integ() for one in q]
        r = [one - 0.5 * (one.integ()(1.0) - one.integ()(-1.0)) for one in r]
        return p, q, r

    def tables(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """P_2i, a q_i and a^2 r_i (k, terms) at t (k,): factors of kappa^i in the curvature, the slope and z."""
        p, q, r = (np.array([f(t) for f in row]).T for row in self.polynomials)
        return p, self.half * q, self.half**2 * r

    @cached_property
    def points(self) -> tuple[FloatArray, FloatArray]:
        """Gauss points t (8,) on half the section and weights of the mean over the section, sum 1."""
        t, weight = leggauss(2 * HALF_POINTS)
        return t[HALF_POINTS:], weight[HALF_POINTS:]

    @cached_property
    def rest(self) -> FloatArray:
        """kappa^i (terms,) at rest: an arc."""
        found = np.zeros(self.terms)
        found[0] = self.curvature
        return found

    @cached_property
    def matrices(self) -> tuple[FloatArray, FloatArray]:
        """Means <P_i P_j> and a^4 <r_i r_j> (terms, terms)."""
        t, weight = self.points
        p, _, z = self.tables(t)
        return p.T @ (weight[:, None] * p), z.T @ (weight[:, None] * z)

    def warping(self, t: FloatArray) -> FloatArray:
        """a^4 g_ij (k, terms, terms) at t (k,): e11 of the displacement along, a^4 (g_ij kappa^i kappa^j')'.

        An inextensible section moves by v = -1/2 int beta^2 across; without shear u,v = -v' - z' beta, so that u =
        a^4 g_ij kappa^i kappa^j', g_ij = int (int q_i q_j - q_i r_j), of mean 0. Empty (0, terms, terms) if not warped.
        """
        n = self.terms
        if not self.warped:
            return np.empty((0, n, n))
        _, q, r = self.polynomials
        found = np.empty((len(t), n, n))
        for i in range(n):
            for j in range(n):
                g = ((q[i] * q[j]).integ() - q[i] * r[j]).integ()
                found[:, i, j] = self.half**4 * (g(t) - 0.5 * (g.integ()(1.0) - g.integ()(-1.0)))
        return found

    @cached_property
    def bending(self) -> FloatArray:
        """Quadratic form (m, m), m = 2 + 3 terms, of < b11^2 + b22^2 + 2 nu b11 b22 + 2 (1 - nu) b12^2 > by
        (e, k, kappa - kappa0, kappa', kappa''): b11 = -k + z'', b22 = kappa - kappa0, b12 = beta'."""
        t, weight = self.points
        p, slope, z = self.tables(t)
        n, nu = self.terms, self.poisson
        b11, b22, b12 = (np.zeros((len(t), 2 + 3 * n)) for _ in range(3))
        b11[:, 1], b11[:, 2 + 2 * n :] = -1.0, z
        b22[:, 2 : 2 + n], b12[:, 2 + n : 2 + 2 * n] = p, slope
        w = weight[:, None]
        mixed = b11.T @ (w * b22)
        straight = b11.T @ (w * b11) + b22.T @ (w * b22) + 2.0 * (1.0 - nu) * b12.T @ (w * b12)
        return np.asarray(straight + nu * (mixed + mixed.T))
