"""From the code of an energy to its kernels, inside compiled code: one comparison after the other, written from NAMES.

A flat ``if`` is what the compiler inlines best; a call through a tuple of functions or nested closures is slower.
Kernels written at import have no file and no cache of their own: they are compiled into those that call them.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module

import numpy as np
from numba import njit

from ribbon.energies.energy import EnergyDensity
from ribbon.energies.names import NAMES

#: Name of an elastic energy -> the energy.
ENERGIES: dict[str, EnergyDensity] = {name: import_module(f"ribbon.energies.{name}").ENERGY for name in NAMES}
#: Name of an elastic energy -> code in the kernels.
CODES = {name: code for code, name in enumerate(NAMES)}


def _chosen(kernel: str, arguments: Sequence[str]) -> str:
    """Source of ``kernel(code, *arguments)``: the kernel of the energy `code`; of the last one for any other code."""
    given = ", ".join(arguments)
    lines = [f"def {kernel}(code, {given}):"]
    lines += [f"    if code == {code}:\n        return {kernel}_{name}({given})" for name, code in CODES.items()]
    lines[-1] = f"    return {kernel}_{NAMES[-1]}({given})"
    return "\n".join(lines)


for _name, _energy in ENERGIES.items():
    globals()[f"density_{_name}"], globals()[f"factor_{_name}"] = _energy.density, _energy.factor
exec(_chosen("density", ("omega", "eta", "x", "section", "out")))
exec(_chosen("factor", ("x",)))
density = njit(forceinline=True)(globals()["density"])
factor = njit(forceinline=True)(globals()["factor"])


@njit(cache=True)
def values(code, omega, eta, x, section, out):
    """Fills `out` (k,) with the density of the energy `code` at omega, eta, x (k,)."""
    ten = np.empty(10)
    for i in range(omega.size):
        density(code, omega[i], eta[i], x[i], section, ten)
        out[i] = ten[0]


@njit(cache=True)
def numbers(code, omega, eta, x, section, out):
    """Fills `out` (k, 10) with the ten numbers of the energy `code` at omega, eta, x (k,)."""
    for i in range(omega.size):
        density(code, omega[i], eta[i], x[i], section, out[i])
