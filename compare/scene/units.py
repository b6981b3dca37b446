"""From dimensionless numbers to those of a workshop: metres, newtons, newton metres, joules.

Everything is solved with l = 1 and D w / l = 1 (theory sheet, section 2). A scene that gives Young's modulus says what
these are: `scene.units`. A scene with `strip.gamma` in its place has no such units, and only lengths in l are told.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from compare.scene.loads import stiffness_of
from compare.scene.spec import StripSpec
from ribbonbench.errors import BadInput

#: SI base unit -> (least size, factor, unit), large sizes first: how values of this size are told.
_READ: dict[str, tuple[tuple[float, float, str], ...]] = {
    "m": ((1.0, 1.0, "m"), (1e-6, 1e3, "mm"), (1e-8, 1e6, "µm"), (0.0, 1e9, "nm")),
    "N m": ((1.0, 1.0, "N m"), (1e-6, 1e3, "N mm"), (0.0, 1e6, "N µm")),
    **{
        base: tuple(
            (least, 1.0 / least if least else 1e9, prefix + base)
            for least, prefix in ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (0.0, "n"))
        )
        for base in ("N", "J", "Pa")
    },
}


#: Unit of a dimensionless number, as tables name it -> its base unit in SI; "moment" is D w / l, "D / l^2" an energy by
#: area, "D / l^3" a pressure.
_BASES = {
    "l": "m", "1/l": "1/m", "D w / l^2": "N", "D w / l": "J", "moment": "N m", "D / l^2": "J/m^2", "D / l^3": "Pa",
}  # fmt: skip


def base_of(unit: str) -> str | None:
    """The base unit in SI of a unit as tables name it; None: it has none, or is one."""
    return _BASES.get(unit)


#: What is told of a number that is none.
UNKNOWN = "not known"


@dataclass(frozen=True)
class Units:
    """What one unit of each dimensionless number is: length l in m, stiffness D w (Y I of a rod) in N m^2, width in m.

    length, width and stiffness are None together, where the scene gives no Young's modulus.
    """

    length: float | None = None
    width: float | None = None
    stiffness: float | None = None

    @classmethod
    def of(cls, strip: StripSpec) -> Units:
        """The units of a strip; without values where it gives no stiffness in SI."""
        stiffness = stiffness_of(strip)
        if not stiffness > 0.0 or not math.isfinite(stiffness):
            return cls()
        return cls(strip.length, strip.width, stiffness)

    @classmethod
    def asked(cls, strip: StripSpec, choice: str = "auto") -> Units:
        """The units that numbers are told in: "auto", SI where it is known; "si", SI, or `BadInput` that names the keys
        that are missing; "l", none, so that all is told without dimensions."""
        if choice == "l":
            return cls()
        found = cls.of(strip)
        if choice == "si" and not found.known:
            missing = [f"strip.{key}" for key in ("young", "thickness") if getattr(strip, key) is None]
            remedy = f"give {' and '.join(missing)}" if missing else "give others"
            if strip.gamma is not None:
                remedy = "give strip.young, strip.density and strip.thickness in place of strip.gamma"
            raise BadInput("--units", choice, "is not known of this scene", f"{remedy}, or use --units l")
        return found

    @property
    def known(self) -> bool:
        """Whether the scene says what its units are."""
        return self.length is not None

    @property
    def bending(self) -> float | None:
        """D = Y h^3 / (12 (1 - nu^2)) in N m."""
        return None if self.stiffness is None or not self.width else self.stiffness / self.width

    @property
    def force(self) -> float | None:
        """D w / l^2 in N."""
        return None if self.stiffness is None or self.length is None else self.stiffness / self.length**2

    @property
    def energy(self) -> float | None:
        """D w / l in J; of a moment in N m."""
        return None if self.stiffness is None or self.length is None else self.stiffness / self.length

    def si(self, value: float, unit: str) -> tuple[float, str] | None:
        """A dimensionless value in SI: (value, base unit); None where the scene does not say, or for another unit.

        unit: as tables name it (`base_of`).
        """
        if self.length is None or self.stiffness is None or not self.width:
            return None
        force, energy = self.stiffness / self.length**2, self.stiffness / self.length
        factors = {
            "l": self.length,
            "1/l": 1.0 / self.length,
            "D w / l^2": force,
            "D w / l": energy,
            "moment": energy,
            "D / l^2": energy / self.length / self.width,
            "D / l^3": force / self.length / self.width,
        }
        return (value * factors[unit], _BASES[unit]) if unit in factors else None

    def text(self, value: float, unit: str, digits: int = 3) -> str:
        """A value as a reader wants it: "0.96 mm", "12.3 mN", "4.5 N mm", "1.2 mJ"; in l and D w where SI is not
        known: "0.0032 l"; "not known" where it is not finite."""
        if not math.isfinite(value):
            return UNKNOWN
        found = self.si(value, unit)
        if found is None:
            return f"{value:.{digits}g} {'D w / l' if unit == 'moment' else unit}"
        return quantity(*found, digits=digits)

    def reading(self, size: float, unit: str) -> tuple[float, str] | None:
        """Factor from dimensionless values of up to `size` to those that a reader wants, and their unit; None where SI
        is not known."""
        found = self.si(1.0, unit)
        if found is None:
            return None
        factor, name = reading(size * found[0], found[1])
        return factor * found[0], name

    def to_dict(self) -> dict[str, Any]:
        """For `units` of result.json: what one dimensionless unit of each kind is, in SI; None: not known."""
        return {
            "length_m": self.length, "force_N": self.force, "moment_Nm": self.energy, "energy_J": self.energy,
            "bending_stiffness_Nm": self.bending,
        }  # fmt: skip


def reading(size: float, base: str) -> tuple[float, str]:
    """Factor and unit in which a reader wants values of up to `size`, of either sign, in an SI base unit: lengths in mm
    below 1 m, moments in N mm below 1 N m, forces and energies with a prefix; nothing at all, and what is not finite,
    in the base unit."""
    if size == 0.0 or base not in _READ or not math.isfinite(size):
        return 1.0, base
    return next((factor, unit) for least, factor, unit in _READ[base] if abs(size) >= least)


def quantity(value: float, base: str, digits: int = 3) -> str:
    """A value in an SI base unit as a reader wants it (`reading`); "not known" where it is not finite."""
    if not math.isfinite(value):
        return UNKNOWN
    factor, unit = reading(abs(value), base)
    return f"{value * factor:.{digits}g} {unit}"
