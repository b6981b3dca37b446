"""Shape of a cross-section of an energy of free twist, and what its energy per area consists of.

Positions y across (n,) in l, states (m,) along; f is the deflection along the surface's normal, of mean zero over the
width. Densities are in D / l^2, K^2 / 2 counted: their mean over y is the energy's own value + K^2 / 2.

Relaxed sections (`EXTENSIBLE`): with b_yy = -f_yy across, the plate's densities

    bending   1/2 [a^2 + 2 nu a b_yy + b_yy^2] + (1 - nu) (c t)^2 ,  a = k - K
    membrane  6 (1 - nu^2) / h^2 (k f + t^2 (y^2 / 2 - w^2 / 24))^2
    shear     (1 - nu) t^2 sinh^2(r y) / cosh^2(r w / 2) ,  c = 1 - cosh(r y) / cosh(r w / 2) ,  r = sqrt(10) / h

(docs/theory.md, eq. (10.10), (10.15)). What `ribbon.energies.finite` adds is there. Shear is where it is: along the
edges, in a layer of width h / sqrt(10). A developable section has bending alone, the same all over the width; Sano and
Wada's has, spread evenly, as membrane energy what depends on the membrane's stiffness A (A de/dA). A rod has bending
alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from ribbon.energies.section.rod import stiffnesses
from ribbon.energies.section.unit import unit

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Local:
    """States along the strip, each (m,): curvature and twist with their derivatives by s, natural curvature with its,
    natural twist with its."""

    k: FloatArray
    t: FloatArray
    dk: FloatArray
    dt: FloatArray
    natural: FloatArray
    slope: FloatArray
    twist: FloatArray | float = 0.0
    twist_slope: FloatArray | float = 0.0

    @property
    def stretch(self) -> FloatArray:
        """t^2 - t_0^2 (m,), by which the edges are longer than at rest."""
        return np.asarray(self.t**2 - np.square(self.twist))

    @property
    def stretch_rate(self) -> FloatArray:
        """Its derivative along the strip (m,)."""
        return np.asarray(2.0 * (self.t * self.dt - np.asarray(self.twist) * self.twist_slope))

    @property
    def turned(self) -> FloatArray:
        """t - t_0 (m,)."""
        return np.asarray(self.t - self.twist)


@dataclass(frozen=True)
class Shape:
    """Deflection f of the section along the normal, and its derivatives across and along the strip, each (m, n)."""

    f: FloatArray
    across: FloatArray
    along: FloatArray


@dataclass(frozen=True)
class Shares:
    """Elastic energy per area, each (m, n), D / l^2."""

    bending: FloatArray
    membrane: FloatArray
    shear: FloatArray

    @property
    def total(self) -> FloatArray:
        """Their sum (m, n)."""
        return np.asarray(self.bending + self.membrane + self.shear)


@dataclass(frozen=True)
class Profile:
    """A kind of cross-section.

    shape: ``(local, y, section)`` -> `Shape`; shares: ``(local, y, section)`` -> `Shares`, section: the four numbers of
    `ribbon.energies.energy.FreeSectionNumbers`.
    """

    shape: Callable[[Local, FloatArray, Sequence[float]], Shape]
    shares: Callable[[Local, FloatArray, Sequence[float]], Shares]


def _parabola(curvature: FloatArray, rate: FloatArray, y: FloatArray, width: float) -> Shape:
    """f = curvature (y^2 / 2 - w^2 / 24), its curvature (m,) changing along the strip at the rate (m,)."""
    y = np.asarray(y, dtype=float)
    unit_f = 0.5 * y * y - width**2 / 24.0
    return Shape(curvature[:, None] * unit_f, curvature[:, None] * y, rate[:, None] * unit_f)


def _even(bending: FloatArray, membrane: FloatArray, y: FloatArray) -> Shares:
    """The same (m,) at all places y."""
    one = np.ones(np.shape(y))
    return Shares(bending[:, None] * one, membrane[:, None] * one, np.zeros((bending.size, one.size)))


# -- a rod ------------------------------------------------------------------------------------------------------------


def _rod_shape(local: Local, y: FloatArray, section: Sequence[float]) -> Shape:
    half_width, _, poisson, plate = section
    share = poisson if plate else 0.0  # matched to the ribbon's D w: the section stays flat
    return _parabola(share * (local.k - local.natural), share * (local.dk - local.slope), y, 2.0 * half_width)


def _rod_shares(local: Local, y: FloatArray, section: Sequence[float]) -> Shares:
    bending, torsion = stiffnesses(tuple(float(v) for v in section))
    kb = local.k - local.natural
    return _even(0.5 * bending * kb**2 + 0.5 * torsion * local.turned**2, np.zeros_like(kb), y)


# -- developable sections ---------------------------------------------------------------------------------------------


def _sadowsky_shape(local: Local, y: FloatArray, section: Sequence[float]) -> Shape:
    straight = local.k == 0.0
    k = np.where(straight, 1.0, local.k)
    eta = np.where(straight, 0.0, local.t / k)
    rate = -eta * (2.0 * local.dt - eta * local.dk)
    return _parabola(np.asarray(-eta * local.t), np.asarray(rate), y, 2.0 * section[0])


def _sadowsky_shares(local: Local, y: FloatArray, section: Sequence[float]) -> Shares:
    nu, k, t, natural = section[2], local.k, local.t, local.natural
    with np.errstate(divide="ignore", invalid="ignore"):
        across = np.where(t == 0.0, 0.0, t * t / k)
    value = 0.5 * (k + across) ** 2 - natural * (k + nu * across) + 0.5 * natural**2
    return _even(value, np.zeros_like(value), y)


def _regular(local: Local, section: Sequence[float]) -> tuple[FloatArray, FloatArray, float]:
    """B, 1 / (1 / zeta^2 + k^2) and 1 / zeta^2 of `ribbon.energies.sano`."""
    half_width, thickness, nu, _ = section
    inverse = 60.0 * thickness**2 / ((1.0 - nu**2) * (2.0 * half_width) ** 4)
    return nu * local.k * (local.k - local.natural) + local.stretch, 1.0 / (inverse + local.k**2), inverse


def _sano_shape(local: Local, y: FloatArray, section: Sequence[float]) -> Shape:
    nu, k, kb = section[2], local.k, local.k - local.natural
    b, r, _ = _regular(local, section)
    kb_s = local.dk - local.slope
    b_s = nu * (local.dk * kb + k * kb_s) + local.stretch_rate
    rate = nu * kb_s - r * (b_s * k + b * local.dk) + 2.0 * b * k * k * local.dk * r * r
    return _parabola(nu * kb - b * k * r, rate, y, 2.0 * section[0])


def _sano_shares(local: Local, y: FloatArray, section: Sequence[float]) -> Shares:
    nu, kb = section[2], local.k - local.natural
    b, r, inverse = _regular(local, section)
    value = 0.5 * (1.0 - nu**2) * kb**2 + (1.0 - nu) * local.turned**2 + 0.5 * b * b * r
    membrane = 0.5 * inverse * (b * r) ** 2
    return _even(value - membrane, membrane, y)


# -- relaxed sections -------------------------------------------------------------------------------------------------


def _scale(section: Sequence[float]) -> tuple[float, float]:
    """w and c4 in y = z^4 = c4 k^2."""
    half_width, thickness, nu, _ = section
    width = 2.0 * half_width
    return width, 3.0 * (1.0 - nu**2) * width**4 / thickness**2


def _relaxed_shape(local: Local, y: FloatArray, section: Sequence[float]) -> Shape:
    nu, k, kb = section[2], local.k, local.k - local.natural
    width, c4 = _scale(section)
    xi = np.asarray(y, dtype=float) / width
    psi = unit(c4 * k * k, xi)
    kb_s = local.dk - local.slope
    b = nu * k * kb + local.stretch
    b_s = nu * (local.dk * kb + k * kb_s) + local.stretch_rate
    p, q = (nu * kb)[:, None], (c4 * b * k)[:, None]
    p_s, q_s, y_s = (nu * kb_s)[:, None], (c4 * (b_s * k + b * local.dk))[:, None], (2.0 * c4 * k * local.dk)[:, None]
    flat = 0.5 * xi * xi - 1.0 / 24.0
    return Shape(
        width**2 * (p * flat - q * psi.value),
        width * (p * xi - q * psi.slope),
        width**2 * (p_s * flat - q_s * psi.value - q * y_s * psi.by_y),
    )


def _relaxed_shares(local: Local, y: FloatArray, section: Sequence[float]) -> Shares:
    _, thickness, nu, _ = section
    k, t, kb = local.k, local.turned, local.k - local.natural
    width, c4 = _scale(section)
    y = np.asarray(y, dtype=float)
    xi = y / width
    psi = unit(c4 * k * k, xi)
    b = nu * k * kb + local.stretch
    q = (c4 * b * k)[:, None]
    across = q * psi.curvature - (nu * kb)[:, None]  # -f_yy
    length, twist = kb[:, None] * np.ones_like(y), t[:, None] * (1.0 - _cosh(y, width, thickness))
    bending = 0.5 * (length**2 + 2.0 * nu * length * across + across**2) + (1.0 - nu) * twist**2
    y4 = (c4 * k * k)[:, None]
    phi = 0.5 * xi * xi - 1.0 / 24.0 - y4 * psi.value
    membrane = 2.0 * c4 * (b[:, None] * phi) ** 2
    shear = (1.0 - nu) * (t[:, None] * _sinh(y, width, thickness)) ** 2
    return Shares(bending, membrane, shear)


def _cosh(y: FloatArray, width: float, thickness: float) -> FloatArray:
    """cosh(r y) / cosh(r w / 2), r = sqrt(10) / h."""
    r = sqrt(10.0) / thickness
    return np.asarray(_two(y, r, width, 1.0) / (1.0 + np.exp(-r * width)))


def _sinh(y: FloatArray, width: float, thickness: float) -> FloatArray:
    """sinh(r y) / cosh(r w / 2), r = sqrt(10) / h."""
    r = sqrt(10.0) / thickness
    return np.asarray(_two(y, r, width, -1.0) / (1.0 + np.exp(-r * width)))


def _two(y: FloatArray, r: float, width: float, sign: float) -> FloatArray:
    return np.asarray(np.exp(r * (y - 0.5 * width)) + sign * np.exp(-r * (y + 0.5 * width)))


ROD = Profile(_rod_shape, _rod_shares)
SADOWSKY = Profile(_sadowsky_shape, _sadowsky_shares)
SANO = Profile(_sano_shape, _sano_shares)
EXTENSIBLE = Profile(_relaxed_shape, _relaxed_shares)
