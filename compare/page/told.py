"""Lengths, forces and vectors as a reader is told them, in SI where a scene knows it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compare.scene.units import Units

FloatArray = NDArray[np.float64]


def length(units: Units, value: float | None) -> str:
    """A length given in l: "0.96 mm (0.32 % of the length)", without the millimetres where the scene has none."""
    if value is None or not math.isfinite(value):
        return "an unknown length"
    part = f"{100.0 * value:.2g} %"
    return f"{units.text(value, 'l')} ({part} of the length)" if units.known else f"{part} of the length"


def force(values: FloatArray, units: Units) -> str:
    """A force (3,) given in D w / l^2: in newtons, the dimensionless one in brackets; that alone without SI."""
    plain = f"{vector(values, '.6g')} D w / l^2"
    found = units.si(1.0, "D w / l^2")
    if found is None:
        return plain
    size = float(np.abs(values).max()) * found[0]
    factor, unit = (1.0, "N") if size >= 1.0 or size == 0.0 else (1e3, "mN") if size >= 1e-3 else (1e6, "µN")
    return f"{vector(values * found[0] * factor, '.4g')} {unit} ({plain})"


def vector(values: FloatArray, form: str = ".6f") -> str:
    """Components (3,) for a reader, those that are zero to rounding as 0."""
    rounding = 1e-10 * max(1.0, float(np.abs(values).max()))
    return " ".join(format(0.0 if abs(c) < rounding else c, form) for c in values)
