"""Energies of the ribbon: one file each, registered by its name in `ribbon.energies.names` (docs/extend.md).

A density maps the local state (omega, eta, x), ``x = w eta' / 2``, to the energy per unit length in units of D w / l^2
and fills ten numbers::

    0 value | 1..3 d/domega d/deta d/dx | 4..9 omega-omega omega-eta omega-x eta-eta eta-x x-x

An energy is the `ENERGY` of its file (`ribbon.energies.energy.EnergyDensity`): kernels, spread over the surface, what
it needs, what a strip of finite thickness gains beyond it, words. `ENERGIES` has them by name; the kernels of
`ribbon.element.element` call them by their code (`ribbon.energies.dispatch`). `ribbon.analysis.along` has the densities
of a solved ribbon. The natural curvature is a term of its own (`natural`), absent when the strip is naturally flat.
"""

from ribbon.energies.dispatch import CODES, ENERGIES, density, factor
from ribbon.energies.energy import ElasticEnergy, EnergyDensity, FieldSet, SectionNumbers
from ribbon.energies.free import FREE_CODES, FREE_ENERGIES, FreeTwist, free_density
from ribbon.energies.names import FREE_CODE
from ribbon.errors import RibbonInputError
from ribbon.strip import Strip

__all__ = [
    "CODES",
    "ENERGIES",
    "FREE_CODES",
    "FREE_ENERGIES",
    "ElasticEnergy",
    "EnergyDensity",
    "FieldSet",
    "FreeTwist",
    "SectionNumbers",
    "chosen",
    "code_of",
    "density",
    "factor",
    "free_density",
]


def chosen(name: str, strip: Strip) -> ElasticEnergy:
    """The energy of this name for this strip; `RibbonInputError` for an unknown name or what the strip has not."""
    found: ElasticEnergy | None = ENERGIES.get(name, FREE_ENERGIES.get(name))
    if found is None:
        raise RibbonInputError("energy", name, f"use one of {', '.join(sorted([*ENERGIES, *FREE_ENERGIES]))}")
    for key in found.needs:
        if getattr(strip, key) is None:
            raise RibbonInputError(key, None, f'the energy "{name}" needs it')
    return found


def code_of(name: str) -> int:
    """The code of an energy in the kernels of segments (`ribbon.energies.codes` says what it tells)."""
    return FREE_CODE + FREE_CODES[name] if name in FREE_CODES else CODES[name]
