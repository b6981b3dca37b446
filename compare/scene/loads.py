"""What pulls on the strip: its weight, and loads at its tip; in the file's units and without dimensions."""

from __future__ import annotations

import math

from compare.scene import keys as contract
from compare.scene.spec import GravitySpec, StripSpec, TipSpec
from compare.scene.table import Table, missing
from ribbonbench.errors import BadInput


def read_gravity(table: Table, strip: StripSpec) -> GravitySpec:
    """`[gravity]`: the strip gives its weight."""
    gravity = table.read(GravitySpec)
    if strip.gamma is None and strip.young is None and strip.second_moment is None:
        raise missing(
            "strip.gamma",
            contract.KEYS,
            "[gravity] needs strip.gamma, or strip.young with strip.density and strip.thickness; or remove [gravity]",
        )
    weight = gamma_of(strip, gravity.acceleration)
    if not math.isfinite(weight) or (strip.density is not None and weight == 0.0):
        raise BadInput(
            "strip.young",
            strip.young,
            f"gives Gamma = rho h g l^3 / D = {weight}, which is out of range",
            "check the units: young in Pa, density in kg/m^3, length and thickness in m",
        )
    return gravity


def gamma_of(strip: StripSpec, acceleration: float) -> float:
    """Gamma = rho h g l^3 / D with D = Y h^3 / (12 (1 - nu^2)); no unit. As given, or from Pa, kg/m^3, m, m/s^2."""
    if strip.gamma is not None:
        return strip.gamma
    if strip.young is None or strip.density is None or strip.thickness is None:
        return 0.0
    slenderness = strip.length / strip.thickness
    try:
        return (
            12.0
            * (1.0 - strip.poisson**2)
            * (strip.density * acceleration * strip.length / strip.young)
            * slenderness**2
        )
    except OverflowError:
        return math.inf


def read_tip(table: Table, strip: StripSpec, gravity: GravitySpec | None) -> TipSpec:
    """`[tip]`: a mass, or a load without dimensions, that hangs along -up; a force; a tension."""
    tip = table.read(TipSpec)
    if tip.mass is not None and tip.load is not None:
        raise table.bad("load", "conflicts with tip.mass: both say the load", "remove one of the two")
    if tip == TipSpec():
        raise missing(
            "tip.force", contract.KEYS, "add mass in kg, load in D w / l^2, force or tension, or remove [tip]"
        )
    for name, values in (("force", tip.force or ()), ("tension", () if tip.tension is None else (tip.tension,))):
        if not all(math.isfinite(value * force_scale(strip)) for value in values):
            raise table.bad(name, "gives F l^2 / (D w) out of range", "check the units: N, Pa, m")
    if not all(math.isfinite(value * force_scale(strip) / strip.length) for value in tip.moment or ()):
        raise table.bad("moment", "gives M l / (D w) out of range", "check the units: N m, Pa, m")
    if tip.mass is None and tip.load is None:
        return tip
    if gravity is None:
        raise missing("gravity.up", contract.KEYS, "[tip] hangs along -up: add [gravity] with up, or remove [tip]")
    if tip.load is not None:
        return tip
    if strip.young is None:
        raise missing(
            "strip.young",
            contract.KEYS,
            "tip.mass needs strip.young with strip.second_moment (or with density and thickness); or give tip.load",
        )
    if not math.isfinite(load_of(tip, strip, gravity.acceleration)):
        raise table.bad("mass", "gives M g l^2 / (Y I) out of range", "check the units: kg, Pa, m^4, m")
    return tip


def stiffness_of(strip: StripSpec) -> float:
    """Bending stiffness Y I, or D w of a strip of this thickness, in N m^2; 0.0 when neither is known."""
    if strip.young is None:
        return 0.0
    if strip.second_moment is not None:
        return strip.young * strip.second_moment
    if strip.thickness is None:
        return 0.0
    return strip.young * strip.thickness**3 / (12.0 * (1.0 - strip.poisson**2)) * strip.width


def force_scale(strip: StripSpec) -> float:
    """What one unit of `tip.force` is in D w / l^2: l^2 / (D w) of a newton where the strip gives its stiffness, else
    1; infinite when the stiffness is zero."""
    if strip.young is None:
        return 1.0
    stiffness = stiffness_of(strip)
    return strip.length**2 / stiffness if stiffness > 0.0 else math.inf


def load_of(tip: TipSpec, strip: StripSpec, acceleration: float) -> float:
    """The load along -up at the tip in units of D w / l^2 (Y I / l^2); infinite when a mass meets a stiffness of
    zero."""
    if tip.load is not None:
        return tip.load
    if tip.mass is None:
        return 0.0
    stiffness = stiffness_of(strip)
    return tip.mass * acceleration * strip.length**2 / stiffness if stiffness > 0.0 else math.inf
