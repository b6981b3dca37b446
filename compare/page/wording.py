"""Lengths, forces and vectors as a reader is told them, in SI where a scene knows it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from compare.models.base import State
from compare.scene.units import UNKNOWN, Units

FloatArray = NDArray[np.float64]

#: Part of the largest of several values below which another one is told as zero.
_ROUNDING = 1e-10
#: Length (l) below which nothing is told but that it is less.
_LEAST = 1e-9


def length(units: Units, value: float | None) -> str:
    """A length given in l: "0.96 mm (0.32 % of the length)", without the millimetres where the scene has none; what
    only rounding leaves is less than 1e-07 %."""
    if value is None or not math.isfinite(value):
        return "an unknown length"
    if 0.0 < abs(value) < _LEAST:
        return f"less than {percent(_LEAST)} of the length"
    part = percent(value)
    return f"{units.text(value, 'l')} ({part} of the length)" if units.known else f"{part} of the length"


def percent(share: float) -> str:
    """A share in percent, two digits or all before the point: "0.32 %", "100 %", "1240 %"."""
    value = 100.0 * share
    return f"{value:.0f} %" if abs(value) >= 99.5 else f"{value:.2g} %"


def force(values: FloatArray, units: Units) -> str:
    """A force (3,) given in D w / l^2: in newtons, the dimensionless one in brackets; that alone without SI."""
    return _both(values, "D w / l^2", "D w / l^2", units)


def moment(values: FloatArray, units: Units) -> str:
    """A moment (3,) given in D w / l: in N mm, the dimensionless one in brackets; that alone without SI."""
    return _both(values, "moment", "D w / l", units)


def within(error: float | None, unit: str, units: Units, beside: float = 0.0) -> str:
    """How sure a force (unit "D w / l^2"), moment ("moment") or energy ("D w / l") is: ", within 2.1 mN"; without one
    ", its error is not known". beside: the size that it stands beside, whose prefix it takes."""
    if error is None or not math.isfinite(error):
        return ", its error is not known"
    found = units.reading(beside, unit) if beside else None
    return f", within {units.text(error, unit, 2) if found is None else f'{error * found[0]:.2g} {found[1]}'}"


def supports(state: State, units: Units) -> list[tuple[str, str]]:
    """Rows of what holds the strip at its ends: force and moment with their errors."""
    found = []
    for name, where, held in (("start", "s = 0", state.supports.start), ("end", "s = l", state.supports.end)):
        if held is None:
            continue
        errors = [state.errors.get(kind, {}).get(name) for kind in ("forces", "moments")]
        sizes = [float(np.abs(values).max()) for values in (held.force, held.moment)]
        found.append((f"force at {where}", force(held.force, units) + within(errors[0], "D w / l^2", units, sizes[0])))
        found.append((f"moment at {where}", moment(held.moment, units) + within(errors[1], "moment", units, sizes[1])))
    return found


def place(values: FloatArray, units: Units) -> str:
    """A position (3,) given in l: in mm or m, the dimensionless one in brackets; that alone without SI."""
    return _both(values, "l", "l", units, ".6f")


def energies(values: Mapping[str, float | None], units: Units, errors: Mapping[str, float | None] | None = None) -> str:
    """Parts of an energy given in D w / l by name: in mJ or another, the dimensionless ones in brackets; behind them
    the largest of their errors (`State.errors`), which not all parts have. None: not told."""
    known = [value for name, value in (errors or {}).items() if name in values]
    sure = [value for value in known if value is not None]
    largest = max((abs(value) for value in values.values() if value is not None), default=0.0)
    worst = max(sure) if sure and len(sure) == len(known) else None
    behind = "" if errors is None else within(worst, "D w / l", units, largest)
    return _energies(values, units) + (f"; each{behind[1:]}" if sure else behind)


def _energies(values: Mapping[str, float | None], units: Units) -> str:
    known = {name: value for name, value in values.items() if value is not None and math.isfinite(value)}
    if not known:
        return UNKNOWN
    plain = ", ".join(f"{name} {value:.6f}" for name, value in known.items())
    largest = max(map(abs, known.values()), default=0.0)
    found = units.reading(largest, "D w / l")
    if found is None:
        return f"{plain} D w / l"
    told = ", ".join(
        f"{name} {0.0 if abs(value) < _ROUNDING * largest else value * found[0]:.4g}" for name, value in known.items()
    )
    return f"{told} {found[1]} ({plain} D w / l)"


def _both(values: FloatArray, unit: str, words: str, units: Units, form: str = ".6g") -> str:
    """Components (3,) in SI, all with one prefix, and without dimensions in brackets; "not known" where one of them is
    not finite."""
    if not np.all(np.isfinite(values)):
        return UNKNOWN
    plain = f"{vector(values, form)} {words}"
    most = float(np.abs(values).max())
    found = units.reading(most, unit)
    if found is None:
        return plain
    shown = np.where(np.abs(values) < _ROUNDING * most, 0.0, values) * found[0]
    return f"{' '.join(f'{c + 0.0:.4g}' for c in shown)} {found[1]} ({plain})"


def vector(values: FloatArray, form: str = ".6f") -> str:
    """Components (3,) for a reader, those that are zero to rounding as 0."""
    rounding = _ROUNDING * max(1.0, float(np.abs(values).max()))
    return " ".join(format(0.0 if abs(c) < rounding else c, form) for c in values)
