r"""A planar rod in SI units, and the dimensionless problem it stands for.

With M a mass at the tip, m the rod's mass per length, L its length and E I its bending stiffness::

    lambda = M g L^2 / (E I)  (tip)        Gamma = m g L^3 / (E I)  (own weight)        K = L kappa_0

The second moment of area I is given, never guessed: for a circular section of radius r it is pi r^4 / 4 about a
diameter, which is what bending needs (`circular`); the polar moment, about the axis, is twice that, pi r^4 / 2
(`circular_polar`), and belongs to torsion. The lab sheet "flambage de la paquerette" takes the polar one for bending;
its critical mass of 6.3 g, between its 5 g and its 10 g, comes from that. With the bending value it is 3.2 g.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from shellref.elastica.problem import ElasticaProblem, Pair


def circular(radius: float) -> float:
    """Second moment of area about a diameter of a full circular section, pi r^4 / 4, in m^4 (radius in m): bending."""
    return math.pi * _positive("radius", radius) ** 4 / 4.0


def circular_polar(radius: float) -> float:
    """Polar second moment of a full circular section, pi r^4 / 2, in m^4: torsion, or a lab sheet to be reproduced."""
    return math.pi * _positive("radius", radius) ** 4 / 2.0


def rectangular(width: float, thickness: float) -> float:
    """Second moment of area w h^3 / 12 in m^4 of a section bent across its thickness (m)."""
    return _positive("width", width) * _positive("thickness", thickness) ** 3 / 12.0


@dataclass(frozen=True)
class Rod:
    """A rod in SI units, upright at s = 0 unless told otherwise.

    length [m], young [Pa], second_moment [m^4] (the one used in bending; see the module), curvature: natural, [1/m],
    at both ends when a pair; mass_per_length [kg/m]; tip_mass [kg]; acceleration of gravity [m/s^2], along -y;
    start_angle [rad] of the clamp from the horizontal.
    """

    length: float
    young: float
    second_moment: float
    curvature: float | Pair = 0.0
    mass_per_length: float = 0.0
    tip_mass: float = 0.0
    acceleration: float = 9.81
    start_angle: float = math.pi / 2

    def __post_init__(self) -> None:
        for name in ("length", "young", "second_moment", "acceleration"):
            _positive(name, getattr(self, name))
        for item in fields(self):
            value = getattr(self, item.name)
            numbers = value if isinstance(value, tuple) else (value,)
            if not all(math.isfinite(number) for number in numbers) or len(numbers) > 2:
                raise ValueError(f"{item.name} = {value}: must be finite")
        for name in ("mass_per_length", "tip_mass"):
            if getattr(self, name) < 0.0:
                raise ValueError(f"{name} = {getattr(self, name)}: must not be negative")

    @property
    def stiffness(self) -> float:
        """E I in N m^2."""
        return self.young * self.second_moment

    def tip_load(self, mass: float) -> float:
        """lambda = M g L^2 / (E I) of a tip mass (kg)."""
        return mass * self.acceleration * self.length**2 / self.stiffness

    @property
    def gamma(self) -> float:
        """Gamma = m g L^3 / (E I) of the rod's own weight."""
        return self.mass_per_length * self.acceleration * self.length**3 / self.stiffness

    @property
    def critical_mass(self) -> float:
        """Euler's M_c = E I pi^2 / (4 g L^2) in kg: straight, upright, weightless but for the tip."""
        return math.pi**2 * self.stiffness / (4.0 * self.acceleration * self.length**2)

    def problem(self, tip_mass: float | None = None) -> ElasticaProblem:
        """The dimensionless problem, with this tip mass (kg) instead of the rod's own; clamped-free."""
        mass = self.tip_mass if tip_mass is None else tip_mass
        ends = self.curvature if isinstance(self.curvature, tuple) else (self.curvature, self.curvature)
        return ElasticaProblem(
            gamma=self.gamma,
            up=(0.0, 1.0),
            curvature=(ends[0] * self.length, ends[1] * self.length),
            force=(0.0, -self.tip_load(mass)),
            start_angle=self.start_angle,
        )


def _positive(name: str, value: float) -> float:
    if not 0.0 < value < math.inf:
        raise ValueError(f"{name} = {value}: must be greater than zero")
    return float(value)
