"""Energy densities of the ribbon: one file each, with value, gradient, Hessian and source.

A density maps the local state (omega, eta, x), ``x = w eta' / 2``, to the energy per unit length in units of D w / l^2
and fills ten numbers::

    0 value | 1..3 d/domega d/deta d/dx | 4..9 omega-omega omega-eta omega-x eta-eta eta-x x-x

`CODES` maps the name of an energy to the integer by which the kernels of `ribbon.element.element` call it through
`density`: a new energy is a file of its own, its name there and its line here (docs/extend.md). The natural curvature
is a term of its own (`natural`), absent when the strip is naturally flat.
"""

from numba import njit

from ribbon.energies import sadowsky, wunderlich

#: Name of an elastic energy -> code in the kernels.
CODES = {"sadowsky": 0, "wunderlich": 1}
SADOWSKY = CODES["sadowsky"]
WUNDERLICH = CODES["wunderlich"]


@njit(cache=True, forceinline=True)
def density(code, omega, eta, x, out):
    """Fills `out` (10,) with the density of the energy `code`; one that does not know the width leaves x alone."""
    if code == SADOWSKY:
        sadowsky.density(omega, eta, out)
    else:
        wunderlich.density(omega, eta, x, out)
