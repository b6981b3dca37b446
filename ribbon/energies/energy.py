"""What an energy is, to all that asks for one: kernels for the solver, its spread over the surface, needs and words."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ribbon.energies.edge_layer import Section

if TYPE_CHECKING:  # a ribbon of rulings needs no table of relaxed sections
    from ribbon.energies.section.profile import Profile

FloatArray = NDArray[np.float64]
#: `ribbon.Strip.section`, what a kernel may ask of the cross-section: w / (2 l), h / l (nan: not given), nu.
SectionNumbers = tuple[float, float, float]
#: The same for an energy of free twist: w / (2 l), h / l (nan: not given), nu, 1 for stiffness "plate" or 0.
FreeSectionNumbers = tuple[float, float, float, float]


class FieldSet(Enum):
    """The fields along the strip that an energy takes, each linear on a segment: curvature and ruling (the twist is eta
    omega), curvature and twist, or these and the curvature kappa_2 in the strip's plane."""

    RULED = "curvature and ruling"
    TWISTED = "curvature and twist"
    TWISTED_IN_PLANE = "curvature, twist and curvature in the plane"

    @property
    def free(self) -> bool:
        """Whether the twist is free of the curvature: there are then no rulings."""
        return self is not FieldSet.RULED

    @property
    def in_plane(self) -> bool:
        """Whether kappa_2 is one of them."""
        return self is FieldSet.TWISTED_IN_PLANE

    @property
    def count(self) -> int:
        """How many there are."""
        return 3 if self.in_plane else 2


class RelaxedSection(Protocol):
    """What a section of finite thickness gains by curving and stretching across its width; all in D w / l^2."""

    @property
    def scale(self) -> float:
        """c in z = c sqrt|kappa|: z below about 2 means that the layers of both edges meet."""
        ...

    def softening(
        self, kappa: FloatArray, eta: FloatArray, natural: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """What the energy is short of: value (k,), gradient (k, 2), Hessian (k, 2, 2) by (kappa, eta)."""
        ...

    def membrane(self, kappa: FloatArray, eta: FloatArray, natural: FloatArray) -> FloatArray:
        """Membrane energy (k,)."""
        ...

    def shear(self, kappa: FloatArray, eta: FloatArray) -> FloatArray:
        """Energy of transverse shear (k,)."""
        ...


@dataclass(frozen=True)
class Words:
    """The effect that an energy has beyond another one, for `ribbonbench explain`.

    effect: its name; adds: what it adds to an evaluation; absent: what is spared without it; without: the name of the
    energy that lacks it and nothing else.
    """

    effect: str
    adds: str
    absent: str
    without: str


@njit(cache=True)
def no_factor(x):
    """Not a number: the energy is no multiple of Sadowsky's."""
    return np.nan


@dataclass(frozen=True)
class EnergyDensity:
    """An elastic energy of the ribbon, without its natural curvature (`ribbon.energies.natural`); units D w / l^2.

    density: kernel ``(omega, eta, x, section, out)`` that fills ten numbers (layout: `ribbon.energies`),
    x = w eta' / 2, section: `SectionNumbers`; factor: kernel ``(x)``, the energy over Sadowsky's where that depends on
    x alone (it is then evaluated once a segment), `no_factor` otherwise.
    across: ``(omega, eta, x, t, section)``, arrays (k,) -> (k,): the density at the place t in [-1, 1] of the ruling,
    per width of the strip, whose mean over t is the density; None: the same on the whole ruling.
    knows_width: whether x matters; needs: fields of `ribbon.Strip` that must be given, such as "thickness".
    relaxed: ``(poisson, width, thickness)``, lengths in l -> what a strip of finite thickness gains beyond this energy.
    words: of its own effect; None: it has none.
    """

    density: Any
    factor: Any = no_factor
    across: Callable[[FloatArray, FloatArray, FloatArray, FloatArray, SectionNumbers], FloatArray] | None = None
    knows_width: bool = False
    needs: tuple[str, ...] = ()
    relaxed: Callable[[float, float, float], RelaxedSection] = Section
    words: Words | None = None

    @property
    def fields(self) -> FieldSet:
        """A curvature and a ruling."""
        return FieldSet.RULED

    @property
    def holds_twist(self) -> bool:
        """A clamp with a straight ruling holds eta = 0, and with it the twist."""
        return True

    @property
    def pretwist(self) -> None:
        """A developable strip knows no natural twist."""
        return None

    @property
    def reach(self) -> float:
        """No singularity: polynomials in curvature and ruling on a segment, as for `FreeTwist.reach`."""
        return math.inf


@dataclass(frozen=True)
class FreeTwist:
    """An elastic energy whose curvature k and twist t are free of each other; units D w / l^2.

    density: kernel ``(k, t, dk, dt, natural, slope, section, out)`` that fills fifteen numbers (layout:
    `ribbon.energies.free`); dk, dt: derivatives by s, natural and slope: natural curvature K and dK/ds at this s,
    section: `FreeSectionNumbers`.
    needs: fields of `ribbon.Strip` that must be given; in_plane: the curvature kappa_2 in the strip's plane is a field
    of its own; holds_twist: a clamp with a straight ruling holds t = 0 (the others know no derivative of t).
    points: Gauss points of an element on which the density hardly changes its character (`ribbon.element.element`).
    reach: how far from the real axis the density's nearest singularity lies in the plane of the curvature, times zeta
    (docs/theory.md, eq. (10.26)): inf none, 0 at k = 0; tested: whether its gradients have singularities of their own,
    so that every panel is tested.
    pretwist: kernel ``(k, t, natural, rest, section, out)`` that adds to `out` what a natural twist `rest` changes
    (docs/theory.md, eq. (10.27)); None: the energy knows no natural twist.
    value: kernel with the arguments of `density` that fills the first number alone, to the bit the same, for a search
    that asks for no derivatives; None: `density` does it.
    section: shape of the cross-section and what its energy consists of; words: what it is, for a page.
    """

    density: Any
    needs: tuple[str, ...] = ()
    points: int = 4
    reach: float = math.inf
    tested: bool = False
    in_plane: bool = False
    holds_twist: bool = False
    pretwist: Any = None
    value: Any = None
    section: Profile | None = None
    words: str = ""

    @property
    def fields(self) -> FieldSet:
        """A curvature and a twist, and kappa_2 where a scene does not say otherwise."""
        return FieldSet.TWISTED_IN_PLANE if self.in_plane else FieldSet.TWISTED


#: An energy of the registries.
ElasticEnergy = EnergyDensity | FreeTwist
