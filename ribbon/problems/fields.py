"""What bends a strip: which fields its energy takes, and the energy's arguments for the kernels."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ribbon.element.kinematics import COMPONENTS
from ribbon.energies import CODES, FREE_CODES, FREE_ENERGIES
from ribbon.energies.names import FREE_CODE
from ribbon.errors import RibbonInputError
from ribbon.strip import Strip

#: Values of `stiffness`: bending matched to the ribbon's D w (thesis, 4.4), or Y I, a narrow plate's.
STIFFNESSES = ("matched", "plate")


@dataclass(frozen=True)
class Fields:
    """Fields of a strip, linear on every element.

    free: the second one is the twist kappa_3 itself, else the ruling eta (twist eta omega); count: 2, or 3 with an
    in-plane curvature kappa_2; code: the energy's in the kernels; section: w / (2 l), h / l (nan: not given), nu, and
    1.0 for the stiffness "plate", else 0.0; held_straight: whether a clamp's straight
    ruling holds the second field at zero.
    """

    free: bool
    count: int
    code: int
    section: tuple[float, ...]
    held_straight: bool

    @property
    def components(self) -> int:
        """Components of a jet by the parameters of a segment."""
        return COMPONENTS[2 * self.count]

    @classmethod
    def of(cls, strip: Strip, energy: str, stiffness: str | None = None, in_plane: bool | None = None) -> Fields:
        """The fields of an energy. stiffness: of STIFFNESSES, for energies that leave the choice; in_plane: whether
        kappa_2 is a field, None: as the energy has it. Raises `RibbonInputError` where the energy has no such choice.
        """
        if energy not in FREE_CODES:
            if in_plane:
                raise RibbonInputError("in_plane", in_plane, f'the energy "{energy}" is developable: kappa_2 = 0')
            if stiffness is not None:
                raise RibbonInputError("stiffness", stiffness, f'the energy "{energy}" knows one stiffness only')
            return cls(False, 2, CODES[energy], (*strip.section, 0.0), True)
        free = FREE_ENERGIES[energy]
        if stiffness is not None and stiffness not in STIFFNESSES:
            raise RibbonInputError("stiffness", stiffness, f"use one of {', '.join(STIFFNESSES)}")
        if stiffness is not None and energy != "kirchhoff":
            raise RibbonInputError("stiffness", stiffness, f'the energy "{energy}" knows one stiffness only')
        third = free.in_plane if in_plane is None else in_plane
        if third and not math.isfinite(strip.section[1]):
            raise RibbonInputError("thickness", None, "bending in the strip's own plane needs it")
        section = (*strip.section, 1.0 if stiffness == "plate" else 0.0)
        return cls(True, 3 if third else 2, FREE_CODE + FREE_CODES[energy], section, free.holds_twist)
