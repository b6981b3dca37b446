"""What in a scene can hardly be meant: numbers in another unit than the key's. Notes before the solve, never errors.

Bounds are set where nothing usual is touched: no solid strip is lighter than 10 kg/m^3 (foams) or heavier than
25,000 (osmium: 22,600), softer than 1e5 Pa (the softest silicones) or stiffer than diamond (1.2e12 Pa); tapes of 10 m
and sheets of 5 mm are the largest that bend under their weight on a table.
"""

from __future__ import annotations

import math

from compare.scene.data import SceneData
from ribbonbench.accepted import accepted
from ribbonbench.errors import BadInput

HEAVIEST = 1e5
"""Gamma above which a strip hangs like a chain, with layers of length l Gamma^(-1/3) < l / 46 where it is held."""

SOFTEST, STIFFEST = 1e5, 2e12
LIGHTEST, DENSEST = 10.0, 25_000.0
LONGEST, THICKEST = 10.0, 5e-3
FARTHEST = 100.0
"""Length (m) from which a strip with Young's modulus in Pa is one in mm."""

BLUNTEST, SHARPEST = 5.0, 1e4
"""w/h between which a strip is one: below, it is a beam of a full section."""

HEAVY_TIP = 1e4
"""Load at the tip in D w / l^2 above which the strip is pulled straight."""


def implausible(scene: SceneData) -> tuple[str, ...]:
    """One line for each value that looks like a slip of units, with what was probably meant."""
    found = [*_stiffness(scene), *_density(scene), *_lengths(scene), *_acceleration(scene), *_tip(scene)]
    found += _slenderness(scene)
    return (*found, *_weight(scene, bool(found)))


def certain(scene: SceneData) -> tuple[str, ...]:
    """Those of the notes that no strip can be meant by: a modulus, a density, an acceleration of no material and no
    planet, a length of a hundred metres. The others may be meant."""
    found = [*_stiffness(scene), *_density(scene), *_acceleration(scene)]
    return (*found, *(_lengths(scene) if scene.strip.length >= FARTHEST else ()))


def check_meant(scene: SceneData) -> None:
    """`BadInput` for the first of the `certain` notes, unless all is `accepted`."""
    notes = () if accepted() else certain(scene)
    if notes:
        head, _, problem = notes[0].partition(" is ")
        key, _, value = head.partition(" = ")
        raise BadInput(key, value, f"is {problem}", "if it is meant all the same, say --yes")


def _number(value: float) -> str:
    """As one would write it in a scene."""
    digits, exponent, power = f"{value:.6g}".partition("e")
    return f"{digits}e{int(power)}" if exponent else digits


def _stiffness(scene: SceneData) -> list[str]:
    young = scene.strip.young
    if young is None or SOFTEST <= young <= STIFFEST:
        return []
    if young > STIFFEST:
        return [f"strip.young = {_number(young)} Pa is stiffer than diamond: is it in Pa? 210 GPa is 2.1e11"]
    unit, factor = ("GPa", 1e9) if young < 2e3 else ("MPa", 1e6)
    meant = _number(young * factor)
    return [f"strip.young = {_number(young)} Pa is softer than any strip: if it is in {unit}, give {meant} (Pa)"]


def _density(scene: SceneData) -> list[str]:
    density = scene.strip.density
    if density is None or LIGHTEST <= density <= DENSEST:
        return []
    text = f"strip.density = {_number(density)} kg/m^3 is"
    if density > DENSEST:
        return [f"{text} heavier than any metal: if it is in g/m^3, give {_number(density * 1e-3)} (kg/m^3)"]
    unit, factor = ("g/cm^3", 1e3) if density > 1e-2 else ("t/mm^3", 1e12)
    return [f"{text} lighter than any strip: if it is in {unit}, give {_number(density * factor)} (kg/m^3)"]


def _lengths(scene: SceneData) -> list[str]:
    """Of a scene with Young's modulus, whose lengths are in m."""
    strip = scene.strip
    if strip.young is None:
        return []
    if strip.length > LONGEST:
        unit, factor = ("mm", 1e-3) if strip.length >= 100.0 else ("cm", 1e-2)
        return [
            f"strip.length = {_number(strip.length)} m is long for a strip: with young in Pa all lengths are in m; "
            f"{_number(strip.length)} {unit} is {_number(strip.length * factor)}"
        ]
    if strip.thickness is not None and strip.thickness > THICKEST:
        return [
            f"strip.thickness = {_number(strip.thickness)} m is a board: with young in Pa all lengths are in m; "
            f"{_number(strip.thickness)} mm is {_number(strip.thickness * 1e-3)}"
        ]
    return []


def _slenderness(scene: SceneData) -> list[str]:
    strip = scene.strip
    if strip.thickness is None:
        return []
    ratio = strip.width / strip.thickness
    if BLUNTEST <= ratio <= SHARPEST:
        return []
    text = f"strip.thickness = {_number(strip.thickness)} gives w/h = {ratio:.3g}: "
    if ratio < BLUNTEST:
        return [f"{text}a beam rather than a strip, for which these models are not made (w/h of 20 and more)"]
    return [f"{text}a foil; are width and thickness in the same unit?"]


def _acceleration(scene: SceneData) -> list[str]:
    gravity = scene.gravity
    if gravity is None or scene.strip.gamma is not None or gravity.acceleration < 1e3:
        return []
    value = _number(gravity.acceleration)
    return [f"gravity.acceleration = {value} m/s^2 is that of no planet: if it is in mm/s^2, give 9.81"]


def _tip(scene: SceneData) -> list[str]:
    mass = None if scene.tip is None else scene.tip.mass
    if mass is None or scene.tip_load < HEAVY_TIP:
        return []
    return [
        f"tip.mass = {_number(mass)} kg pulls with {scene.tip_load:.3g} D w / l^2 and straightens all: if it is in g, "
        f"give {_number(mass * 1e-3)} (kg)"
    ]


def _weight(scene: SceneData, explained: bool) -> list[str]:
    """Gamma; with the likely reason where no other note has named one."""
    gamma = scene.gamma
    if not HEAVIEST < gamma < math.inf:
        return []
    text = f"Gamma = rho h g l^3 / D = {_number(float(f'{gamma:.3g}'))} is beyond 1e5"
    strip = scene.strip
    if strip.gamma is not None:
        return [f"{text}: the strip hangs like a chain, and solves may take long; is strip.gamma meant?"]
    if explained:
        return [f"{text}: see the note above"]
    assert strip.young is not None
    assert strip.thickness is not None
    return [
        f"{text}: the strip hangs like a chain, and solves may take long; are young = {_number(strip.young)} Pa "
        f"(210 GPa is 2.1e11), length = {_number(strip.length)} m and thickness = {_number(strip.thickness)} m meant?"
    ]
