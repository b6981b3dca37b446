"""The strip: dimensions, material and natural curvature, to and from dimensionless groups (thesis, 4.1).

Units, everywhere in `ribbon`. What is given of the strip and of what holds it (lengths, places, curvatures) is in the
strip's own unit of length. What is without a unit when it is given (abscissae, lengths of segments, Gamma, forces,
springs) and all that a result tells is in l and D w. A derivative is what is told per what is given. `si` of a result
or a session has all of it, what goes in too, in m, N, N m and J; the strip's unit is then the metre.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import SupportsFloat

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon import law
from ribbon.errors import RibbonInputError
from ribbon.law import Law

#: Standard acceleration of gravity of the thesis, m/s^2.
STANDARD_GRAVITY = 9.81
#: Share of its length by which an abscissa may lie beyond an end: rounding.
_ROUNDING = 1e-9
#: Relative difference up to which numbers of a strip are those of its material.
_SAME = 1e-12


def finite(key: str, value: object) -> float:
    """`value` as a float; RibbonInputError when it is no finite number."""
    if not isinstance(value, float) and (isinstance(value, (bool, str)) or not isinstance(value, SupportsFloat)):
        raise RibbonInputError(key, value, "a finite number is needed")
    number = float(value)
    if not math.isfinite(number):
        raise RibbonInputError(key, value, "a finite number is needed")
    return number


def abscissae(s: ArrayLike, end: float = 1.0, unit: str = "l") -> NDArray[np.float64]:
    """`s`, of any shape, as numbers in [0, end]; `RibbonInputError` for one beyond the ends and for what is no number.

    unit: of s and `end`, for the message.
    """
    try:
        at = np.asarray(s, dtype=float)
    except (TypeError, ValueError):
        raise RibbonInputError("s", s, "abscissae are numbers") from None
    slack = _ROUNDING * end
    outside = ~((at >= -slack) & (at <= end + slack))
    if outside.any():
        worst = float(at[outside].flat[0])
        raise RibbonInputError("s", worst, f"is not on the strip: abscissae lie in [0, {end:g}], here in {unit}")
    return np.clip(at, 0.0, end)


@dataclass(frozen=True)
class Material:
    """What a strip is made of and where it stands: Y in Pa, rho in kg/m^3, g in m/s^2."""

    young: float
    density: float
    acceleration: float = STANDARD_GRAVITY

    def stiffness(self, thickness: float, poisson: float) -> float:
        """``D = Y h^3 / (12 (1 - nu^2))`` in N m, h in m."""
        return self.young * thickness**3 / (12.0 * (1.0 - poisson * poisson))

    def gamma(self, length: float, thickness: float, poisson: float) -> float:
        """``rho h g l^3 / D``, l and h in m (docs/theory.md, eq. (2.1))."""
        return self.density * thickness * self.acceleration * length**3 / self.stiffness(thickness, poisson)


#: Fields of a strip that say its shape at rest: kappa_1, kappa_2, kappa_3.
NATURAL = ("natural_curvature", "natural_geodesic_curvature", "natural_twist")

#: The dimensionless numbers for which the models are known to work, by argument: what it is, the least, the largest.
#: (Scenes have the same ones: `compare.scene.spec`.)
KNOWN: dict[str, tuple[str, float, float]] = {
    "width": ("w / l", 1e-6, math.inf),
    "thickness": ("h / l", 1e-10, math.inf),
    "natural_curvature": ("K l", -1e4, 1e4),
    "natural_geodesic_curvature": ("kappa_2 l", -1e4, 1e4),
    "natural_twist": ("twist l", -1e4, 1e4),
    "gamma": ("Gamma", 0.0, 1e12),
    "position": ("x / l", -1e6, 1e6),
    "point": ("x / l", -1e6, 1e6),
    "radius": ("R / l", 1e-4, 1e6),
    "rounding": ("r / l", 1e-4, 1e6),
    "size": ("x / l", 1e-4, 1e6),
    "stiffness": ("k", 1e-12, 1e18),
    "turns": ("turns", 1.0, 1000.0),
    "tip": ("F l^2 / (D w)", -1e12, 1e12),
    "seed_curvature": ("omega l", -1e4, 1e4),
    "seed_ruling": ("eta", -1e3, 1e3),
    "segments": ("each / l", 1e-13, 1.0),
}


def known(key: str, value: object, numbers: Iterable[float]) -> None:
    """`RibbonInputError` where one of the dimensionless `numbers` that `value` gives is beyond `KNOWN`; key: the
    argument, with what it stands in before a dot ("clamp.position")."""
    symbol, least, most = KNOWN[key.rpartition(".")[2]]
    for number in numbers:
        if not least <= number <= most:
            within = f"{least:g} <= {symbol} <= {most:g}" if most < math.inf else f"{symbol} >= {least:g}"
            remedy = f"gives {symbol} = {number:.6g}, beyond what the models are known to work for ({within})"
            raise RibbonInputError(key, value, remedy)


def check_known(strip: Strip) -> None:
    """`RibbonInputError` for a strip beyond what the models are known to work for."""
    known("width", strip.width, [strip.relative_width])
    if strip.thickness is not None:
        known("thickness", strip.thickness, [strip.thickness / strip.length])
    for name, one in zip(NATURAL, strip.rest, strict=True):
        known(name, getattr(strip, name), law.values(one))
    known("gamma", strip.gamma, [strip.gamma])


@dataclass(frozen=True)
class Strip:
    """A rectangular strip, flat or naturally curved about its width.

    Parameters
    ----------
    length, width:
        l and w, in any unit of length; 0 < w < l.
    poisson:
        nu in (-1, 0.5]; matters with natural curvature only.
    natural_curvature:
        normal curvature K of the stress-free strip in 1/length: a number, (at s = 0, at s = l) for a linear law, or
        pairs ((s, K), ...) from s = 0 to s = length, linear between them (`ribbon.law`). The flat strip has 0, and
        then the term is absent.
    gamma:
        ``rho h g l^3 / D``, weight against bending stiffness (docs/theory.md, eq. (2.1)); `from_material` computes it;
        0: weightless.
    thickness:
        h, in the unit of length; the inextensible energies do not need it, others may.
    bending_stiffness:
        D in N m, where length and width are in m; `from_material` gives it, and results then have numbers in SI.
    natural_twist, natural_geodesic_curvature:
        twist and curvature in its plane of the stress-free strip in 1/length, each as natural_curvature is given: a
        helicoid, an annular strip. Energies of free twist know them (docs/theory.md, eq. (10.27), (10.28)).
    material:
        `from_material` gives it; derivatives then hold it, so that D and Gamma move with the thickness. None where
        length, thickness, poisson, gamma and bending_stiffness are not what follows from it (`dataclasses.replace`).

    Raises `RibbonInputError` naming the parameter. Below, all is dimensionless: lengths in l, energies in D w / l.
    """

    length: float
    width: float
    poisson: float = 0.5
    natural_curvature: float | Law = 0.0
    gamma: float = 0.0
    thickness: float | None = None
    bending_stiffness: float | None = None
    material: Material | None = None
    natural_twist: float | Law = 0.0
    natural_geodesic_curvature: float | Law = 0.0

    def __post_init__(self) -> None:
        length = finite("length", self.length)
        width = finite("width", self.width)
        poisson = finite("poisson", self.poisson)
        if length <= 0:
            raise RibbonInputError("length", self.length, "a positive length is needed")
        if not 0 < width < length:
            raise RibbonInputError("width", self.width, f"a ribbon needs 0 < width < length = {length:g}")
        if not -1 < poisson <= 0.5:
            raise RibbonInputError("poisson", self.poisson, "Poisson's ratio lies in (-1, 0.5]")
        if finite("gamma", self.gamma) < 0:
            raise RibbonInputError("gamma", self.gamma, "rho h g l^3 / D is not negative; turn `up` instead")
        if self.thickness is not None and not 0 < finite("thickness", self.thickness) < width:
            raise RibbonInputError("thickness", self.thickness, f"a thin strip needs 0 < thickness < width = {width:g}")
        if self.bending_stiffness is not None and finite("bending_stiffness", self.bending_stiffness) <= 0:
            raise RibbonInputError(
                "bending_stiffness", self.bending_stiffness, "a positive stiffness D in N m is needed"
            )
        for name in NATURAL:
            object.__setattr__(self, name, law.read(name, getattr(self, name), length))
        if self.material is not None and not self._is_of(self.material):
            object.__setattr__(self, "material", None)

    def _is_of(self, material: Material) -> bool:
        """Whether D and Gamma are those of the material."""
        if self.thickness is None or self.bending_stiffness is None:
            return False
        stiffness = material.stiffness(self.thickness, self.poisson)
        gamma = material.gamma(self.length, self.thickness, self.poisson)
        return math.isclose(stiffness, self.bending_stiffness, rel_tol=_SAME) and math.isclose(
            gamma, self.gamma, rel_tol=_SAME
        )

    @classmethod
    def from_material(
        cls,
        length: float,
        width: float,
        thickness: float,
        young: float,
        density: float,
        poisson: float,
        natural_curvature: float | Law = 0.0,
        acceleration: float = STANDARD_GRAVITY,
    ) -> Strip:
        """Strip from SI data: metres, pascals, kg/m^3, m/s^2; ``D = Y h^3 / (12 (1 - nu^2))`` per unit width."""
        for key, value in (("young", young), ("density", density), ("thickness", thickness)):
            if finite(key, value) <= 0:
                raise RibbonInputError(key, value, "a positive value is needed")
        nu = finite("poisson", poisson)
        if not -1 < nu <= 0.5:
            raise RibbonInputError("poisson", poisson, "Poisson's ratio lies in (-1, 0.5]")
        material = Material(young, density, finite("acceleration", acceleration))
        gamma = material.gamma(finite("length", length), thickness, nu)
        return cls(length, width, nu, natural_curvature, gamma, thickness, material.stiffness(thickness, nu), material)

    @property
    def relative_width(self) -> float:
        """w / l."""
        return self.width / self.length

    @property
    def section(self) -> tuple[float, float, float]:
        """The cross-section's numbers for the kernels of an energy: w / (2 l), h / l (nan: not given), nu."""
        thickness = math.nan if self.thickness is None else float(self.thickness) / self.length
        return 0.5 * self.relative_width, thickness, float(self.poisson)

    @cached_property
    def curvature(self) -> Law:
        """Natural curvature times l: at both ends where it is linear between them, else ((s / l, K l), ...)."""
        return law.scaled(self.natural_curvature, self.length)  # type: ignore[arg-type]

    @cached_property
    def twist(self) -> Law:
        """Natural twist times l, as `curvature`."""
        return law.scaled(self.natural_twist, self.length)  # type: ignore[arg-type]

    @cached_property
    def geodesic(self) -> Law:
        """Natural curvature kappa_2 in the plane times l, as `curvature`; > 0 turns t_z towards t_x."""
        return law.scaled(self.natural_geodesic_curvature, self.length)  # type: ignore[arg-type]

    @property
    def rest(self) -> tuple[Law, Law, Law]:
        """kappa_1, kappa_2 and kappa_3 at rest, times l."""
        return self.curvature, self.geodesic, self.twist

    @property
    def naturally_straight(self) -> bool:
        """Whether the stress-free strip is flat and straight."""
        return not any(any(law.values(one)) for one in self.rest)
