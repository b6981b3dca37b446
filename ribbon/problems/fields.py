"""What bends a strip: which fields its energy takes, and the energy's arguments for the kernels."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ribbon.element.kinematics import COMPONENTS
from ribbon.energies import ElasticEnergy, FieldSet, chosen, code_of
from ribbon.energies.codes import among_free
from ribbon.errors import RibbonInputError
from ribbon.law import values
from ribbon.strip import Strip

#: Values of `stiffness`: bending matched to the ribbon's D w (thesis, 4.4), or Y I, a narrow plate's.
STIFFNESSES = ("matched", "plate")


def _in_plane(strip: Strip, energy: str, law: ElasticEnergy, in_plane: bool | None) -> bool | None:
    """Whether kappa_2 is a field of its own: where the strip has a natural one, it is. `RibbonInputError` for a rest
    shape that the energy does not know."""
    if any(values(strip.twist)) and law.pretwist is None:
        remedy = f'the energy "{energy}" knows no natural twist; "kirchhoff", "extensible" and "sano" do'
        raise RibbonInputError("natural_twist", strip.natural_twist, remedy)
    if not any(values(strip.geodesic)):
        return in_plane
    if not law.fields.free:
        remedy = f'the energy "{energy}" is of rectangles, with kappa_2 = 0; "kirchhoff" and "extensible" know it'
        raise RibbonInputError("natural_geodesic_curvature", strip.natural_geodesic_curvature, remedy)
    if in_plane is False:
        raise RibbonInputError("in_plane", in_plane, "a natural curvature in the plane needs it: leave it out")
    return True


@dataclass(frozen=True)
class Fields:
    """Fields of a strip, linear on every element.

    kind: which they are; energy: whose arguments they are; code: the energy's in the kernels; section: w / (2 l), h / l
    (nan: not given), nu, and 1.0 for the stiffness "plate", else 0.0.
    """

    kind: FieldSet
    energy: ElasticEnergy
    code: int
    section: tuple[float, ...]

    @property
    def free(self) -> bool:
        """Whether the second field is the twist kappa_3 itself, else the ruling eta (twist eta omega)."""
        return self.kind.free

    @property
    def in_plane(self) -> bool:
        """Whether the curvature kappa_2 in the strip's plane is a field."""
        return self.kind.in_plane

    @property
    def count(self) -> int:
        """How many fields there are."""
        return self.kind.count

    @property
    def held_straight(self) -> bool:
        """Whether a clamp's straight ruling holds the second field at zero."""
        return self.energy.holds_twist

    @property
    def components(self) -> int:
        """Components of a jet by the parameters of a segment."""
        return COMPONENTS[2 * self.count]

    @property
    def density_code(self) -> int:
        """The energy's code among those with its fields (`ribbon.energies.density`, `free_density`)."""
        return int(among_free.py_func(self.code)) if self.free else self.code

    @classmethod
    def of(cls, strip: Strip, energy: str, stiffness: str | None = None, in_plane: bool | None = None) -> Fields:
        """The fields of an energy. stiffness: of STIFFNESSES, for energies that leave the choice; in_plane: whether
        kappa_2 is a field, None: as the energy has it. Raises `RibbonInputError` where the energy has no such choice.
        """
        law, code = chosen(energy, strip), code_of(energy)
        in_plane = _in_plane(strip, energy, law, in_plane)
        if not law.fields.free:
            if in_plane:
                raise RibbonInputError("in_plane", in_plane, f'the energy "{energy}" is developable: kappa_2 = 0')
            if stiffness is not None:
                raise RibbonInputError("stiffness", stiffness, f'the energy "{energy}" knows one stiffness only')
            return cls(law.fields, law, code, (*strip.section, 0.0))
        if stiffness is not None and stiffness not in STIFFNESSES:
            raise RibbonInputError("stiffness", stiffness, f"use one of {', '.join(STIFFNESSES)}")
        if stiffness is not None and energy != "kirchhoff":
            raise RibbonInputError("stiffness", stiffness, f'the energy "{energy}" knows one stiffness only')
        third = law.fields.in_plane if in_plane is None else in_plane
        if third and not math.isfinite(strip.section[1]):
            raise RibbonInputError("thickness", None, "bending in the strip's own plane needs it")
        kind = FieldSet.TWISTED_IN_PLANE if third else FieldSet.TWISTED
        return cls(kind, law, code, (*strip.section, 1.0 if stiffness == "plate" else 0.0))
