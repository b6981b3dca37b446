"""Energies of free twist: curvature k and twist t of the centreline independent of each other, no rulings.

Names in `ribbon.energies.names.FREE`, one file each. A density maps the local state (k, t, dk, dt), derivatives by s,
to the energy per length in D w / l^2, without the constant K^2 / 2, and fills fifteen numbers::

    0 value | 1..4 d/dk d/dt d/d(dk) d/d(dt) | 5..14 k k, k t, k dk, k dt, t t, t dk, t dt, dk dk, dk dt, dt dt

In-plane bending is separable, 1/2 `in_plane_stiffness` kappa_2^2, for those energies and scenes that have kappa_2.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module

from numba import njit

from ribbon.energies.energy import FreeSectionNumbers, FreeTwist
from ribbon.energies.names import FREE

__all__ = [
    "FREE_CODES", "FREE_ENERGIES", "FreeSectionNumbers", "FreeTwist", "add_pretwist", "free_density",
    "free_value", "in_plane_stiffness", "natural_numbers",
]  # fmt: skip

#: Name of an energy of free twist -> the energy.
FREE_ENERGIES: dict[str, FreeTwist] = {name: import_module(f"ribbon.energies.{name}").ENERGY for name in FREE}
#: Name of an energy of free twist -> code in the kernels.
FREE_CODES = {name: code for code, name in enumerate(FREE)}


def in_plane_stiffness(section: Sequence[float]) -> float:
    """(1 - nu^2) w^2 / h^2, stiffness of bending in the strip's plane in D w (docs/theory.md, eq. (10.5))."""
    half_width, thickness, poisson = section[:3]
    return (1.0 - poisson**2) * (2.0 * half_width / thickness) ** 2


def _chosen(kernel: str) -> str:
    """Source of ``free_density(code, ...)`` or ``free_value(code, ...)``: one comparison after the other, as
    `ribbon.energies.dispatch` does."""
    given = "k, t, dk, dt, natural, slope, section, out"
    lines = [f"def free_{kernel}(code, {given}):"]
    lines += [f"    if code == {code}:\n        return {kernel}_{name}({given})" for name, code in FREE_CODES.items()]
    lines[-1] = f"    return {kernel}_{FREE[-1]}({given})"
    return "\n".join(lines)


def _pretwisted() -> str:
    """Source of ``add_pretwist(code, ...)``, over the energies that know a natural twist."""
    given = "k, t, natural, rest, section, out"
    lines = [f"def add_pretwist(code, {given}):"]
    for name, code in FREE_CODES.items():
        if FREE_ENERGIES[name].pretwist is not None:
            lines.append(f"    if code == {code}:\n        pretwist_{name}({given})")
    return "\n".join(lines)


for _name, _energy in FREE_ENERGIES.items():
    globals()[f"density_{_name}"] = _energy.density
    globals()[f"value_{_name}"] = _energy.value or _energy.density
    globals()[f"pretwist_{_name}"] = _energy.pretwist
exec(_chosen("density"))
exec(_chosen("value"))
exec(_pretwisted())
free_density = njit(forceinline=True)(globals()["free_density"])
free_value = njit(forceinline=True)(globals()["free_value"])
add_pretwist = njit(forceinline=True)(globals()["add_pretwist"])


@njit(cache=True)
def free_numbers(code, k, t, dk, dt, natural, slope, section, out):
    """Fills `out` (m, 15) with the numbers of the energy `code` at k, t, dk, dt and K (m,), dK/ds = `slope`."""
    for i in range(k.size):
        free_density(code, k[i], t[i], dk[i], dt[i], natural[i], slope, section, out[i])


@njit(cache=True)
def natural_numbers(code, k, t, natural, rest, section, out):
    """Adds to `out` (m, 15) what a natural twist `rest` (m,) changes in the states k, t, K (m,)."""
    for i in range(k.size):
        add_pretwist(code, k[i], t[i], natural[i], rest[i], section, out[i])
