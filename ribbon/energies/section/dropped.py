"""What the energy `finite` leaves out, evaluated on one of its states: no constant is fitted (docs/theory.md, 10).

With f the deflection of the relaxed section, per length in D w / l^2, K the natural curvature, < > the mean over the
width:

- "along": (1 - psi) (1 - nu) <f_sy^2>, twist of a section that changes along the strip, where it is soft (psi: how
  stiff, `ribbon.energies.finite`; Wunderlich's energy has it where it is stiff);
- "odd": -(1 - psi) nu^2 w^2 / 24 t'^2, what restrained warping gains where the section is free to curl oddly;
- "between": (1 - psi^2) 1/2 (k^2 + 1 / zeta^2) (1 + eta^2)^2 (H(x) - 1), by which two ways to pass from soft to stiff
  differ (the factor k^2 psi in the place of k^2 + 1 / zeta^2);
- "clamp", at an end whose edge is held: the section is flat there. Scaled by 1 - p, p = 1 and p' = 0 at the clamp, it
  costs min int A p^2 + B p'^2 + C p''^2 = sqrt(A (B + 2 sqrt(A C))), A the energy that relaxing gains,
  B = (1 - nu) <f_y^2>, C = 1/2 <f^2>.

The section is expanded in the eigenvectors of its own equation (`ribbon.energies.section.relaxed`): with the curvature
c = (1 + y a)^-1 e of the unit profile, f_yy = nu kb e - c4 k B a c.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.energies.finite import added
from ribbon.energies.section.relaxed import operators

FloatArray = NDArray[np.float64]

#: Terms that belong to every length of the strip; "clamp" belongs to an end.
ALONG = ("along", "odd", "between")
CLAMP = "clamp"
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
_STEP = 1e-4


def _derivative() -> FloatArray:
    """(n, n): values at `_NODES` of the polynomial through them -> values of its derivative."""
    powers = np.vander(_NODES, increasing=True)
    slopes = np.zeros_like(powers)
    slopes[:, 1:] = powers[:, :-1] * np.arange(1, _NODES.size)
    return np.asarray(slopes @ np.linalg.inv(powers))


_D = _derivative()


def _basis() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Eigenvalues (n,) of a = 4 <deflection^2>, and in its eigenvectors the unit curvature (n,) and the Gram matrix
    (n, n) of the slope."""
    a, slopes = operators()
    values, vectors = np.linalg.eigh(a)
    return np.maximum(values, 0.0), vectors[0], vectors.T @ slopes @ vectors


_A, _UNIT, _SLOPE = _basis()


@dataclass(frozen=True)
class Dropped:
    """Terms that `finite` drops, for a strip with relative width w / l, thickness h / l, Poisson's ratio nu."""

    width: float
    thickness: float
    poisson: float

    @property
    def _c4(self) -> float:
        return 3.0 * (1.0 - self.poisson**2) * self.width**4 / self.thickness**2

    def stiff(self, k: FloatArray) -> FloatArray:
        """psi (...,), in [0, 1): how stiff the section is against stretching at curvature k (docs/theory.md, 10.13)."""
        return np.asarray(k * k / (k * k + 180.0 / self._c4))

    def crossing(self, k: FloatArray, t: FloatArray, dk: FloatArray, dt: FloatArray) -> FloatArray:
        """x = w eta' / 2 (...,), how near rulings come to meeting on an edge (docs/theory.md, 10.12)."""
        softened = k * k + 180.0 / self._c4
        return np.asarray(0.5 * self.width * (k * dt + t * dk - 2.0 * k * k * t * dk / softened) / softened)

    def curl(self, k: FloatArray, t: FloatArray, natural: FloatArray) -> FloatArray:
        """Coefficients (..., n) of f_yy at curvature k, twist t, natural curvature K, all (...,)."""
        b = self.poisson * k * (k - natural) + t * t
        y = self._c4 * k * k
        free = self.poisson * (k - natural)
        return np.asarray((free[..., None] - (self._c4 * k * b)[..., None] * _A / (1.0 + y[..., None] * _A)) * _UNIT)

    def along(self, q: FloatArray, lengths: FloatArray, natural: FloatArray) -> dict[str, FloatArray]:
        """Energies (p,) of segments with parameters q = (a, b, n, m) (p, 4) and K (p, nodes), by the names of ALONG."""
        s = lengths[:, None] * _NODES
        k, t = q[:, :1] * s + q[:, 1:2], q[:, 2:3] * s + q[:, 3:4]
        curl = self.curl(k, t, natural)
        by_s = _D @ curl / lengths[:, None, None]
        weight = lengths[:, None] * _WEIGHTS * (1.0 - self.stiff(k))
        twist = (1.0 - self.poisson) * self.width**2
        by_k, by_t = (np.repeat(q[:, i], k.shape[1]) for i in (0, 2))
        section = (0.5 * self.width, self.thickness, self.poisson, 0.0)
        ruled = added(k.ravel(), t.ravel(), by_k, by_t, section).reshape(k.shape)
        ruled -= (1.0 - self.stiff(k)) * self.width**2 / 24.0 * q[:, 2:3] ** 2
        return {
            "along": twist * np.sum(weight * np.einsum("pgn,pgn->pg", by_s @ _SLOPE, by_s), axis=1),
            "odd": -((self.poisson * self.width) ** 2) / 24.0 * weight.sum(axis=1) * q[:, 2] ** 2,
            "between": np.sum(weight * (1.0 + self.stiff(k)) * ruled, axis=1),
        }

    def clamp(self, k: FloatArray, t: FloatArray, natural: FloatArray) -> FloatArray:
        """Energy (k,), D w / l, of an end whose edge is held, from k, t, K there (k,)."""
        curl = self.curl(k, t, natural)
        y = self._c4 * k * k
        gained = 0.5 * np.sum(curl**2 * (1.0 + y[..., None] * _A), axis=-1)
        twist = (1.0 - self.poisson) * self.width**2 * np.einsum("...n,...n->...", curl @ _SLOPE, curl)
        bend = 0.125 * self.width**4 * np.sum(curl**2 * _A, axis=-1)
        return np.asarray(np.sqrt(gained * (twist + 2.0 * np.sqrt(gained * bend))))

    def deflection(self, k: FloatArray, t: FloatArray, natural: FloatArray) -> FloatArray:
        """Root of the mean square over the width (k,) of the section's deflection, in l."""
        return np.asarray(0.5 * self.width**2 * np.sqrt(np.sum(self.curl(k, t, natural) ** 2 * _A, axis=-1)))


@dataclass(frozen=True)
class Term:
    """A dropped term on a state: its energy in D w / l, and its derivative by every segment's (a, b, n, m) (p, 4)."""

    name: str
    energy: float
    gradient: FloatArray


def terms(equilibrium: Any, thickness: float, held: Sequence[float] = ()) -> tuple[Term, ...]:
    """The terms on a `ribbon.Equilibrium` of free twist; thickness: h / l; held: ends (0 or 1) whose edge is held."""
    problem = equilibrium.problem
    strip = problem.strip
    dropped = Dropped(strip.relative_width, thickness, strip.poisson)
    lengths = problem.lengths
    first, slope = law.pieces(strip.curvature, lengths).T[:, :, None]
    natural = first + slope * (lengths[:, None] * _NODES)
    q = equilibrium.parameters[:, :4]
    step = _STEP * np.array([1.0, 1.0, 1.0, 1.0]) * np.maximum(1.0, np.abs(q[:, 1::2]).max())
    found = {name: np.zeros(q.shape) for name in ALONG}
    for i in range(4):
        moved = np.zeros(4)
        moved[i] = step[i]
        up, down = dropped.along(q + moved, lengths, natural), dropped.along(q - moved, lengths, natural)
        for name in ALONG:
            found[name][:, i] = (up[name] - down[name]) / (2.0 * step[i])
    here = dropped.along(q, lengths, natural)
    ends = [Term(name, float(here[name].sum()), found[name]) for name in ALONG]
    for at in held:
        ends.append(_end(dropped, q, lengths, strip.curvature, at))
    return tuple(ends)


def _end(dropped: Dropped, q: FloatArray, lengths: FloatArray, curvature: law.Law, at: float) -> Term:
    """The clamp's term at s = 0 or 1."""
    row, s = (0, 0.0) if at == 0.0 else (-1, float(lengths[-1]))
    natural = law.at(curvature, np.array([at]))
    k, t = q[row, 0] * s + q[row, 1], q[row, 2] * s + q[row, 3]
    step = _STEP * max(1.0, abs(k), abs(t))

    def energy(dk: float, dt: float) -> float:
        return float(dropped.clamp(np.array([k + dk]), np.array([t + dt]), natural)[0])

    by_k = (energy(step, 0.0) - energy(-step, 0.0)) / (2.0 * step)
    by_t = (energy(0.0, step) - energy(0.0, -step)) / (2.0 * step)
    gradient = np.zeros(q.shape)
    gradient[row] = s * by_k, by_k, s * by_t, by_t
    return Term(CLAMP, energy(0.0, 0.0), gradient)
