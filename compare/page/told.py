"""Lengths, forces and vectors as a reader is told them, in SI where a scene knows it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from compare.scene.units import Units

FloatArray = NDArray[np.float64]

#: Part of the largest of several values below which another one is told as zero.
_ROUNDING = 1e-10


def length(units: Units, value: float | None) -> str:
    """A length given in l: "0.96 mm (0.32 % of the length)", without the millimetres where the scene has none."""
    if value is None or not math.isfinite(value):
        return "an unknown length"
    part = f"{100.0 * value:.2g} %"
    return f"{units.text(value, 'l')} ({part} of the length)" if units.known else f"{part} of the length"


def force(values: FloatArray, units: Units) -> str:
    """A force (3,) given in D w / l^2: in newtons, the dimensionless one in brackets; that alone without SI."""
    return _both(values, "D w / l^2", "D w / l^2", _FORCES, units)


def moment(values: FloatArray, units: Units) -> str:
    """A moment (3,) given in D w / l: in N mm, the dimensionless one in brackets; that alone without SI."""
    return _both(values, "moment", "D w / l", _MOMENTS, units)


def place(values: FloatArray, units: Units) -> str:
    """A position (3,) given in l: in mm or m, the dimensionless one in brackets; that alone without SI."""
    return _both(values, "l", "l", _LENGTHS, units, ".6f")


def energies(values: Mapping[str, float | None], units: Units) -> str:
    """Parts of an energy given in D w / l by name: in mJ or another, the dimensionless ones in brackets."""
    known = {name: value for name, value in values.items() if value is not None}
    plain = ", ".join(f"{name} {value:.6f}" for name, value in known.items())
    found = units.si(1.0, "D w / l")
    if found is None or not known:
        return f"{plain} D w / l"
    largest = max(map(abs, known.values()))
    factor, unit = _prefix(largest * found[0], _ENERGIES)
    told = ", ".join(
        f"{name} {0.0 if abs(value) < _ROUNDING * largest else value * found[0] * factor:.4g}"
        for name, value in known.items()
    )
    return f"{told} {unit} ({plain} D w / l)"


#: The least value in the base unit -> factor and unit in which it is told; the last one for all that is smaller.
_Prefixes = tuple[tuple[float, float, str], ...]
_FORCES: _Prefixes = ((1.0, 1.0, "N"), (1e-3, 1e3, "mN"), (0.0, 1e6, "µN"))
_MOMENTS: _Prefixes = ((10.0, 1.0, "N m"), (1e-5, 1e3, "N mm"), (0.0, 1e6, "mN mm"))
_LENGTHS: _Prefixes = ((1.0, 1.0, "m"), (0.0, 1e3, "mm"))
_ENERGIES: _Prefixes = ((1.0, 1.0, "J"), (1e-3, 1e3, "mJ"), (0.0, 1e6, "µJ"))


def _prefix(size: float, prefixes: _Prefixes) -> tuple[float, str]:
    """Factor and unit for values up to `size`; nothing at all is told in the base unit."""
    least = next(entry for entry in prefixes if size >= entry[0])
    return least[1:] if size > 0.0 else prefixes[0][1:]


def _both(values: FloatArray, unit: str, words: str, prefixes: _Prefixes, units: Units, form: str = ".6g") -> str:
    """Components (3,) in SI, all with one prefix, and without dimensions in brackets."""
    plain = f"{vector(values, form)} {words}"
    found = units.si(1.0, unit)
    if found is None:
        return plain
    factor, name = _prefix(float(np.abs(values).max()) * found[0], prefixes)
    told = np.where(np.abs(values) < _ROUNDING * np.abs(values).max(), 0.0, values) * found[0] * factor
    return f"{' '.join(f'{c + 0.0:.4g}' for c in told)} {name} ({plain})"


def vector(values: FloatArray, form: str = ".6f") -> str:
    """Components (3,) for a reader, those that are zero to rounding as 0."""
    rounding = _ROUNDING * max(1.0, float(np.abs(values).max()))
    return " ".join(format(0.0 if abs(c) < rounding else c, form) for c in values)
