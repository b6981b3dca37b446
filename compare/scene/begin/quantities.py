"""A number with a unit behind it, as one types it: "30 cm", "0.1mm", "210 GPa"; without one it is in the base unit."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from ribbonbench.errors import BadInput

#: What is asked for -> unit -> its size in the base unit, which is the first one.
UNITS: Mapping[str, Mapping[str, float]] = {
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "in": 0.0254},
    "stress": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9},
    "density": {"kg/m^3": 1.0, "kg/m3": 1.0, "g/cm^3": 1e3, "g/cm3": 1e3},
    "curvature": {"1/m": 1.0, "/m": 1.0, "1/cm": 1e2, "/cm": 1e2, "1/mm": 1e3, "/mm": 1e3},
    "number": {},
}
_WRITTEN = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")


def base_unit(kind: str) -> str:
    """The unit that a number of this kind is in when none stands behind it; "" for what has none."""
    return next(iter(UNITS.get(kind, ())), "")


def value_of(text: str, kind: str, option: str) -> float:
    """The number that `text` says, in the base unit of its kind; `BadInput` names `option` when it says none."""
    found = _WRITTEN.fullmatch(text)
    number = float(found[1]) if found else math.nan
    units = UNITS[kind]
    if found is None or not math.isfinite(number):
        example = {"length": "0.3 or 30cm", "stress": "2.1e11 or 210GPa", "density": "7850 or 7.85g/cm^3"}
        raise BadInput(option, text, "is not a number", f"e.g. {example.get(kind, '0.3')}")
    unit = found[2]
    if unit and unit not in units:
        right = f"give it in {', '.join(units)}" if units else "it is a pure number"
        raise BadInput(option, text, f"has the unit {unit}, which is not known here", right)
    # to 15 digits, so that 30 cm is 0.3 and not 0.30000000000000004
    return float(f"{number * units.get(unit, 1.0):.15g}")


def values_of(text: str, kind: str, option: str) -> tuple[float, ...]:
    """Several of them, between commas, in brackets or not: "10,20", "[10, 20]", "0.1/mm" where one is enough."""
    inside = text.strip()
    if inside.startswith("[") and inside.endswith("]"):
        inside = inside[1:-1]
    return tuple(value_of(part, kind, option) for part in inside.split(","))
