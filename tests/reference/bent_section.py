"""Energy of a strip bent to a circle, whose free edges curl: closed form of a shallow section (Lamb, Ashwell)."""

from __future__ import annotations

import math


def stiffness(poisson: float, width: float, thickness: float, curvature: float) -> float:
    """Bending energy of a strip bent to a curvature kappa, over that with a straight section, D w kappa^2 / 2 a length.

    The deflection y(v) of the section makes |y'' + nu kappa| small where it can, and stretches the strip by kappa y. Of
    all y the one of least energy has

        D y'''' + E h kappa^2 y = 0 ,   y'' = -nu kappa and y''' = 0 at v = +-w / 2 ,

    so y = A cosh b v cos b v + B sinh b v sin b v with b^4 = 3 (1 - nu^2) (kappa / h)^2, and as the energy is quadratic
    in y, what is left of it is the work of the edges, D nu kappa y'(w / 2):

        U = D w kappa^2 / 2 (1 - nu^2 F(b w)) ,   F(x) = (2 / x) (cosh x - cos x) / (sinh x + sin x)

    F(0) = 1: a narrow strip is a beam of stiffness E h^3 / 12 = (1 - nu^2) D; F = 0: a wide one is a plate of stiffness
    D. x^2 = (3 (1 - nu^2))^(1/2) kappa w^2 / h. Lamb (1891), On the flexure of a flat elastic spring, Phil. Mag. 31,
    182; Ashwell (1950), The anticlastic curvature of rectangular beams and plates, J. R. Aeronaut. Soc. 54, 708.
    Lengths in any unit.
    """
    x = (3.0 * (1.0 - poisson**2)) ** 0.25 * math.sqrt(abs(curvature) / thickness) * width
    ratio = (math.cosh(x) - math.cos(x)) / (math.sinh(x) + math.sin(x)) if x < 300.0 else 1.0
    return 1.0 - poisson**2 * (2.0 / x) * ratio
