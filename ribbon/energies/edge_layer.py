"""How much a bent and twisted strip of finite thickness gains across its width (Audoly & Neukirch 2021; Reissner).

"A one-dimensional model for elastic ribbons: a little stretching makes a big difference", eq. for the energy per
length, written with g(z) instead of phi(v), v = 2 z^2 (docs/theory.md, eq. (10.2), (10.3), (10.6)):

    W = 1/2 (1 - nu^2) (kappa - K)^2 + (1 - nu) tau^2 + b^2 (1/2 - g(z)) ,   b = nu (kappa - K) + tau^2 / kappa
    g(z) = (cosh z - cos z) / (z (sinh z + sin z)) ,   z = c sqrt|kappa| ,   c = (3 (1 - nu^2))^(1/4) w / sqrt h

in units of D w / l (lengths in l). g(0) = 1/2: a rod, free to curve across; g ~ 1/z: developable but for layers along
both edges, of width about sqrt(h / kappa). For g = 0 W is Sadowsky's energy: softening = - b^2 g is what the
inextensible ribbon misses, with tau = eta kappa: b = nu (kappa - K) + eta^2 kappa.

Part of W is energy of stretching. W is a minimum over the section's shape, and the membrane's stiffness A = 12 D / h^2
enters z as A^(1/4): by the envelope theorem membrane = A dW/dA = - (z / 4) g'(z) b^2 (~ b^2 / (4 z) for large z).

Transverse shear lets the twisting moment fall to zero at the free edges over a length h / sqrt 10 (a Reissner-Mindlin
plate with shear factor 5/6): the term of the twist becomes (1 - nu) tau^2 (1 - q), q = tanh(a) / a with
a = sqrt(10) w / (2 h) (the known factor 1 - 0.63 h / w of a thin rectangle's torsion), of which, by the same theorem
(a ~ S^(1/2)), shear = (1 - nu) tau^2 (tanh(a) / a - sech^2 a) / 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cosh, sqrt, tanh

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: g's coefficient of z^4 at z = 0: 1/2 - g = z^4 phi, phi(0) = 1/360.
_QUARTIC = -1.0 / 360.0


def layer(z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """g(z), z g'(z) and z^2 g''(z) for z >= 0, each of z's shape (`ribbon.energies.section.relaxed`)."""
    from ribbon.energies.section.relaxed import fill_layers

    z = np.asarray(z, dtype=float)
    out = np.empty((3, z.size))
    fill_layers(z.ravel(), out)
    value, first, second = out.reshape(3, *z.shape)
    return value, first, second


@dataclass(frozen=True)
class Section:
    """A cross-section: Poisson's ratio, width and thickness (in l)."""

    poisson: float
    width: float
    thickness: float

    @property
    def scale(self) -> float:
        """c in z = c sqrt|kappa|."""
        return float((3.0 * (1.0 - self.poisson**2)) ** 0.25 * self.width / sqrt(self.thickness))

    @property
    def _a(self) -> float:
        return sqrt(10.0) * self.width / (2.0 * self.thickness)

    @property
    def twist_loss(self) -> float:
        """q: share of the twist's energy that shear at the edges saves."""
        return tanh(self._a) / self._a

    @property
    def twist_shear(self) -> float:
        """Share of the thin plate's energy of twist that is energy of shear."""
        a = self._a
        return 0.5 * (tanh(a) / a - (1.0 / cosh(a) ** 2 if a < 300.0 else 0.0))

    def softening(
        self, kappa: FloatArray, eta: FloatArray, natural: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """- b^2 g(z) - (1 - nu) q (eta kappa)^2 with its derivatives by (kappa, eta), D w / l^2.

        Value (k,), gradient (k, 2), Hessian (k, 2, 2).

        kappa, natural (k,) in 1/l, eta (k,).
        """
        nu, scale = self.poisson, self.scale
        b = nu * (kappa - natural) + eta**2 * kappa
        bk, be, bke, bee = nu + eta**2, 2.0 * eta * kappa, 2.0 * eta, 2.0 * kappa
        g, zg, zzg = layer(scale * np.sqrt(np.abs(kappa)))
        flat = np.abs(kappa) < 1e-12
        safe = np.where(flat, 1.0, kappa)
        gk = np.where(flat, 0.0, 0.5 * zg / safe)  # dz/dkappa = z / (2 kappa); g is even and smooth in kappa
        gkk = np.where(flat, 2.0 * _QUARTIC * scale**4, 0.25 * (zzg - zg) / safe**2)
        twist = (1.0 - nu) * self.twist_loss
        value = -b * b * g - twist * (eta * kappa) ** 2
        by_kappa = -(2.0 * b * bk * g + b * b * gk) - 2.0 * twist * eta**2 * kappa
        by_eta = -2.0 * b * be * g - 2.0 * twist * kappa**2 * eta
        kk = -(2.0 * bk * bk * g + 4.0 * b * bk * gk + b * b * gkk) - 2.0 * twist * eta**2
        ke = -(2.0 * (be * bk + b * bke) * g + 2.0 * b * be * gk) - 4.0 * twist * eta * kappa
        ee = -2.0 * (be * be + b * bee) * g - 2.0 * twist * kappa**2
        hessian = np.stack([np.stack([kk, ke], -1), np.stack([ke, ee], -1)], -2)
        return value, np.stack([by_kappa, by_eta], axis=-1), hessian

    def membrane(self, kappa: FloatArray, eta: FloatArray, natural: FloatArray) -> FloatArray:
        """Membrane energy (k,) per length, D w / l^2: - (z / 4) g'(z) b^2."""
        b = self.poisson * (kappa - natural) + eta**2 * kappa
        _, zg, _ = layer(self.scale * np.sqrt(np.abs(kappa)))
        return np.asarray(-0.25 * zg * b * b)

    def shear(self, kappa: FloatArray, eta: FloatArray) -> FloatArray:
        """Energy (k,) of transverse shear per length, D w / l^2, of the twist eta kappa."""
        return np.asarray((1.0 - self.poisson) * self.twist_shear * (eta * kappa) ** 2)
