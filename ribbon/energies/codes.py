"""What the code of an energy says, inside kernels: numbers there, `FieldSet` and the registries everywhere else."""

from __future__ import annotations

from numba import njit

from ribbon.energies.names import FREE_CODE


@njit(forceinline=True)
def has_free_twist(code):
    """Whether the energy's second field is the twist itself and no ruling."""
    return code >= FREE_CODE


@njit(forceinline=True)
def among_free(code):
    """The place of such an energy in `ribbon.energies.names.FREE`."""
    return code - FREE_CODE
