"""The scale of an export: results lie in folders in l and D; other programs get metres, or what is asked for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.pages.export.vtu import Sheet
from ribbonbench.errors import BadInput

#: Fields and arrays that have a unit, as powers of length; of parameters (n, 4 or 6) a power for each column.
POWERS: Mapping[str, Any] = {
    "S": 1, "v": 1, "ruling_foot": 1, "omega": -1, "tau": -1,
    "segment_lengths": 1, "joints": 1, "joint_positions": 1, "line_s": 1, "line_position": 1, "line_omega": -1,
    "line_tau": -1, "width": 1, "parameters": (-2, -1, -1, 0), "curvature_parameters": (-2, -1, -2, -1, -2, -1),
}  # fmt: skip
#: Energies per area (D / l^2) and per length (D w / l^2).
BY_AREA = ("energy_density", "bending_energy", "membrane_energy", "shear_energy")
BY_LENGTH = ("line_energy_density", "line_bending_energy", "line_membrane_energy", "line_shear_energy")


@dataclass(frozen=True)
class Scale:
    """What l is in the files, `unit` in which, and what D / l^2 (J/m^2) and D w / l^2 (J/m) are; words: as a page says
    it."""

    length: float = 1.0
    unit: str = "l"
    by_area: float = 1.0
    by_length: float = 1.0
    words: str = "Lengths in l, curvatures in 1/l."

    @classmethod
    def of(cls, result: Mapping[str, Any], asked: str | None = None) -> Scale:
        """The scale of a folder's result.json; asked: of --scale, None, "l", or a number.

        Metres and joules where the scene gave SI; the unit of `strip.length` where it did not, or l where the folder
        does not say. A number multiplies the lengths.
        """
        if asked == "l":
            return cls()
        factor = 1.0 if asked is None else _number(asked)
        units, length = result.get("units") or {}, result.get("length")
        if units.get("known"):
            metres = float(units["length_m"])
            force = float(units["force_N"])
            area = float(units["bending_stiffness_Nm"]) / metres**2
            found = cls(metres, "m", area, force, f"Lengths in m (l = {metres:g} m), energies in J/m^2 and J/m.")
        elif length is not None:
            found = cls(float(length), "the scene's unit", words=f"Lengths in the scene's unit (l = {length:g}).")
        else:
            found = cls()
        if factor == 1.0:
            return found
        unit = f"{found.unit} / {factor:g}"
        return replace(found, length=factor * found.length, unit=unit, words=f"{found.words} All lengths x {factor:g}.")

    def to_dict(self) -> dict[str, Any]:
        """For result.json of an export."""
        return {"length": self.length, "unit": self.unit, "energy_by_area": self.by_area}

    def sheet(self, sheet: Sheet) -> Sheet:
        """A surface at this scale."""
        return replace(
            sheet, points=self.length * sheet.points, fields=self.arrays(sheet.fields), cells=self.arrays(sheet.cells)
        )

    def arrays(self, arrays: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Named arrays at this scale; those without a unit, and of models from outside, as they are."""
        return {name: self._array(name, values) for name, values in arrays.items()}

    def _array(self, name: str, values: NDArray[Any]) -> NDArray[Any]:
        if name in BY_AREA:
            return self.by_area * values
        if name in BY_LENGTH:
            return self.by_length * values
        power = POWERS.get(name)
        if power is None:
            return values
        powers = np.asarray(power, dtype=float)
        return np.asarray(values * self.length ** (powers[: values.shape[-1]] if powers.ndim else powers))


def _number(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number > 0.0):
        raise BadInput(
            "--scale", text, "is no factor", "give a number above 0 (1000: millimetres of metres), or l for unit length"
        )
    return number
