"""The sections of a scene as frozen dataclasses, with the values as the file gives them and the defaults filled in.

Every key of a scene is declared here, on the field that it sets, and nowhere else (`compare.scene.declare` says how,
`compare.scene.keys` makes the contract of it); a key that sets no field of its own stands as an attribute beside them.
None: as by default, or not held, or absent.

Lengths are in the scene's own unit (metres in SI scenes), curvatures in 1/length. The dimensionless numbers that the
solvers use (l = 1, D = 1; theory sheet, section 2) are derived by `compare.scene.data.SceneData`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from compare import registry
from compare.scene.declare import FORCE, LENGTH, MOMENT, NONE, PER_LENGTH, Key, Kind, declared, key
from compare.scene.inputs.law import Law, Linear

ENERGIES = tuple(energy for entry in registry.BUILT_IN for energy in entry.energies)
"""Values of `model.energy` that are always there; models from outside bring their own (`compare.registry`)."""
Vector = tuple[float, float, float]
"""A quantity linear in s: (at s = 0, at s = length)."""

STANDARD_GRAVITY = 9.81
"""Default acceleration of gravity in m/s^2, the thesis's value (3.5.2)."""

GROWTH = 1.5
"""Ratio of neighbouring elements where they are graded."""

FIRST_OVER_WIDTH = 2.5
"""Length of the first graded element, times the number of elements, over the strip's width (20 elements: w/8)."""

DEFAULT_ELEMENTS = 20
"""Number of ribbon elements where they are not placed and the scene does not say: the thesis's choice (3.5.1)."""

DEFAULT_TOLERANCE = 1e-3
"""Error for which the ribbon's elements are placed when the scene says nothing about them (`ModelSpec.placed`)."""

DEFAULT_BUDGET = 60.0
"""Time in s that a solve of the ribbon may take: a hundred times what a usual scene needs."""

USUAL_ACCURACY = 1e-2
"""`model.accuracy` of a scene that leaves its energy open, and has a thickness (Hausdorff distance / length)."""

THIN = 0.2
"""Largest curvature at rest times thickness up to which a strip is bent as a thin plate."""

SAY_ELEMENTS = ("elements", "grading", "element_lengths")
"""Keys of [model] of which one is enough to say what the ribbon's elements are; none is then placed by default."""


@functools.lru_cache(maxsize=64)
def graded_lengths(elements: int, smallest: float) -> tuple[float, ...]:
    """Fractions of the length: from `smallest` at s = 0 growing by GROWTH each up to a largest size, found so that the
    sum is 1; equal ones when `smallest` is not below 1 / elements.

    A clamp that holds the ruling straight bends it over a layer about as long as the strip is wide.
    """
    if smallest * elements >= 1.0:
        return (1.0 / elements,) * elements
    low, high = smallest, 1.0
    for _ in range(200):
        largest = 0.5 * (low + high)
        if math.fsum(_capped(elements, smallest, largest)) < 1.0:
            low = largest
        else:
            high = largest
    lengths = _capped(elements, smallest, high)
    total = math.fsum(lengths)
    return tuple(length / total for length in lengths)


def _capped(elements: int, smallest: float, largest: float) -> list[float]:
    lengths = []
    length = smallest
    for _ in range(elements):
        lengths.append(min(length, largest))
        length = min(length * GROWTH, 1.0)
    return lengths


# A declaration is a line or two of a table, so the formatter leaves them.
# fmt: off

_RULING = {"free": "", "straight": "eta = 0, the clamp holds the whole edge"}


@dataclass(frozen=True)
class SceneSpec:
    """What stands above all sections."""

    title: str = key(
        Kind.TEXT, "title of the scene, one line of text", example='"Curl, 4.3"', default="",
        absent="the file's name"
    )


@dataclass(frozen=True, kw_only=True)
class StripSpec:
    """The strip. Young's modulus stands with density and thickness, or with the second moment of a rod's section, which
    bends with Y I where the strip has D w."""

    length: float = key(
        Kind.NUMBER, "length l", "m", "> 0", "1.0", note="any unit when gamma is given or there is no gravity"
    )
    width: float = key(Kind.NUMBER, "width w", LENGTH, "0 < w < length", "0.03", known="w / l >= 1e-6")
    thickness: float | None = key(
        Kind.NUMBER, "thickness h", LENGTH, "0 < h < width", "3e-4", default=None, known="h / l >= 1e-10"
    )
    poisson: float = key(Kind.NUMBER, "Poisson's ratio nu", NONE, "-1 < nu <= 0.5", "0.4")
    natural_curvature: Law = key(
        Kind.LAW, "natural normal curvature", PER_LENGTH, example="10.0", default=(0.0, 0.0),
        known="-1e4 <= K l <= 1e4"
    )
    natural_twist: Law = key(
        Kind.LAW, "twist of the strip at rest: a helicoid", PER_LENGTH, example="2.0", default=(0.0, 0.0), newer=True,
        note="rods, the shell and energies of free twist that know it; > 0 turns t_x towards t_y along s",
        known="-1e4 <= twist l <= 1e4"
    )
    natural_geodesic_curvature: Law = key(
        Kind.LAW, "curvature at rest in the strip's plane: an annular strip", PER_LENGTH, example="1.0",
        default=(0.0, 0.0), newer=True,
        note="rods, the shell and energies with kappa_2; > 0 turns the tangent towards t_x",
        known="-1e4 <= kappa_2 l <= 1e4"
    )
    transverse_curvature: float = key(
        Kind.NUMBER, "natural curvature across the strip, of a tape spring", PER_LENGTH, example="20.0", default=0.0,
        newer=True, note="the edges stand away from the normal where it is > 0, as the ends do for natural_curvature",
        known="-1e4 <= k l <= 1e4"
    )
    gamma: float | None = key(
        Kind.NUMBER, "weight against bending stiffness rho h g l^3 / D", NONE, ">= 0", "100.0", default=None,
        hint="give the weight parameter as a number >= 0 and turn gravity.up instead", known="Gamma <= 1e12"
    )
    young: float | None = key(
        Kind.NUMBER, "Young's modulus", "Pa", "> 0", "1.8e9", default=None,
        note="together with density and thickness, instead of gamma", known="1e-100 <= Y <= 1e100"
    )
    density: float | None = key(
        Kind.NUMBER, "mass density", "kg/m^3", "> 0", "1000.0", default=None,
        note="together with young and thickness, instead of gamma", known="1e-100 <= rho <= 1e100"
    )
    second_moment: float | None = key(
        Kind.NUMBER, "second moment of area I of a rod's section about the axis of bending", "m^4", "> 0",
        "1.2566370614359172e-11", default=None, newer=True,
        note="with young, instead of thickness; the rod weighs nothing", known="1e-100 <= I <= 1e100"
    )


@dataclass(frozen=True)
class UncertaintySpec:
    """How sure the inputs are: standard uncertainties, in the unit of the key of `[strip]` that has the same name.

    They move no result; `compare.studies.inputs` says by how much the shape may be off for them.
    """

    width: float | None = key(
        Kind.NUMBER, "standard uncertainty of strip.width", LENGTH, ">= 0", "1e-4", default=None, newer=True,
        known="dw / l <= 1"
    )
    thickness: float | None = key(
        Kind.NUMBER, "standard uncertainty of strip.thickness", LENGTH, ">= 0", "1e-5", default=None, newer=True,
        known="dh / l <= 1"
    )
    poisson: float | None = key(
        Kind.NUMBER, "standard uncertainty of strip.poisson", NONE, ">= 0", "0.02", default=None, newer=True,
        known="dnu <= 1"
    )
    natural_curvature: float | None = key(
        Kind.NUMBER, "standard uncertainty of strip.natural_curvature", PER_LENGTH, ">= 0", "0.1", default=None,
        newer=True, note="of the whole law, shifted as one", known="dK l <= 1e4"
    )
    gamma: float | None = key(
        Kind.NUMBER, "standard uncertainty of strip.gamma", NONE, ">= 0", "2.0", default=None, newer=True,
        known="dGamma <= 1e12"
    )
    young: float | None = key(
        Kind.NUMBER, "standard uncertainty of strip.young", "Pa", ">= 0", "5e7", default=None, newer=True,
        known="dY <= 1e100"
    )
    density: float | None = key(
        Kind.NUMBER, "standard uncertainty of strip.density", "kg/m^3", ">= 0", "10.0", default=None, newer=True,
        known="drho <= 1e100"
    )


@dataclass(frozen=True)
class TipSpec:
    """Dead loads at s = length, which add up: `mass` or `load` along -up, `force`, and `tension` along the strip."""

    mass: float | None = key(
        Kind.NUMBER, "mass at s = length", "kg", ">= 0", "0.005", default=None, newer=True,
        note="with young and second_moment, or young, density and thickness",
        hint="give a mass >= 0 and turn gravity.up instead", known="M <= 1e100"
    )
    load: float | None = key(
        Kind.NUMBER, "load at s = length along -up against bending stiffness", "D w / l^2", ">= 0", "3.9",
        default=None, newer=True, note="Y I / l^2 of a rod; instead of mass",
        hint="give a load >= 0 and turn gravity.up instead", known="P <= 1e12"
    )
    force: Vector | None = key(
        Kind.VECTOR, "force at s = length, its direction fixed; on a shell along the end edge, evenly", FORCE,
        example="[0.0, -0.01, 0.0]", default=None, newer=True, known="-1e12 <= F l^2 / (D w) <= 1e12"
    )
    tension: float | None = key(
        Kind.NUMBER, "force at s = length along the tangent of clamp.end where that leaves the position free, else "
        "along the tangent of clamp.start", FORCE, example="0.5", default=None, newer=True,
        note="its direction fixed; below 0 it pushes", known="-1e12 <= F l^2 / (D w) <= 1e12"
    )
    moment: Vector | None = key(
        Kind.VECTOR, "moment at s = length, its direction fixed", MOMENT,
        example="[0.1, 0.0, 0.0]", default=None, newer=True, note="rods, shells, ribbons among several strips",
        known="-1e4 <= M l / (D w) <= 1e4"
    )


@dataclass(frozen=True)
class GravitySpec:
    """Dead weight; `up` is a unit vector."""

    up: Vector = key(Kind.DIRECTION, "unit vector UP, against the weight", NONE, example="[1.0, 0.0, 0.0]")
    acceleration: float = key(
        Kind.NUMBER, "acceleration of gravity", "m/s^2", "> 0", "9.81", default=STANDARD_GRAVITY,
        note="used with young and density", known="1e-100 <= g <= 1e100"
    )
    exact: bool = key(
        Kind.TRUTH, "weight over the surface (true) or along the centreline (false)", example="false", default=False
    )


@dataclass(frozen=True)
class ClampSpec:
    """A held end: position, unit tangent t_z, unit normal t_y, and the ruling there.

    None: not held. Tangent and normal are held together or not at all.
    """

    position: Vector | None = key(
        Kind.VECTOR, "point held at {at}", LENGTH, example="[0.0, 0.0, 0.0]", words={"free": ("", None)},
        default=None, defaults={"clamp.start": (0.0, 0.0, 0.0)}, known="-1e6 <= x / l <= 1e6"
    )
    frame: ClassVar[Key] = declared(
        Kind.CHOICE, "what of the frame is held at {at}", example='"free"',
        choices={"free": "neither tangent nor normal"}, default=None, absent="tangent and normal say it"
    )
    tangent: Vector | None = key(
        Kind.DIRECTION, "unit tangent t_z held at {at}", NONE, example="[0.0, 0.0, 1.0]", default=None,
        absent="free, with normal"
    )
    normal: Vector | None = key(
        Kind.DIRECTION, "unit surface normal t_y held at {at}, orthogonal to the tangent", NONE,
        example="[0.0, 1.0, 0.0]", default=None, absent="free, with tangent"
    )
    across: ClassVar[Key] = declared(
        Kind.DIRECTION, "optional check: t_x = t_y x t_z, the direction of the width at {at}", NONE,
        example="[1.0, 0.0, 0.0]", default=None
    )
    ruling: str = key(
        Kind.CHOICE, "ruling at {at}", example='"straight"', choices=_RULING, default="straight",
        note="free by default where the frame is free"
    )
    slide: Vector | None = key(
        Kind.DIRECTION, "direction along which the point held at {at} may slide", NONE, example="[0.0, 0.0, 1.0]",
        default=None, newer=True, absent="it stays"
    )
    section: str | None = key(
        Kind.CHOICE, "what the clamp does to the section of a tape spring at {at}", example='"undeformed"',
        choices={"undeformed": "it keeps its shape", "free": "it changes its shape in its plane"}, default=None,
        newer=True, absent='"undeformed"'
    )

    @property
    def holds_all(self) -> bool:
        """True when position and frame are held."""
        return self.position is not None and self.tangent is not None


@dataclass(frozen=True)
class ClosureSpec:
    """A closed band: a circle with its number of turns, or a Moebius band."""

    kind: str = key(
        Kind.CHOICE, "how the band is closed", example='"moebius"',
        choices={"circle": "", "moebius": "half a turn at the seam"}
    )
    ruling: str = key(
        Kind.CHOICE, "ruling at the seam", example='"free"', choices={"free": "", "straight": "eta = 0"},
        default="free"
    )
    turns: int = key(
        Kind.COUNT, "number of turns of a circle", range=">= 1", example="1", default=1, known="turns <= 1000"
    )
    twist: float = key(
        Kind.NUMBER, "angle by which the end is turned about its tangent before it is joined to the start", "rad",
        example="6.28", default=0.0, newer=True, note="rods only", known="-1e4 <= twist <= 1e4"
    )
    half_turns: int | None = key(
        Kind.COUNT, "half turns of the end about its tangent before it is joined: an odd number of a Moebius band, an "
        "even one of a circle", range=">= 1", example="3", default=None, newer=True,
        note="ribbon and shell", absent="1 of a Moebius band, 0 of a circle", known="half_turns <= 20"
    )

    @property
    def turned(self) -> int:
        """Half turns of the band."""
        return (1 if self.kind == "moebius" else 0) if self.half_turns is None else self.half_turns


@dataclass(frozen=True)
class RodSpec:
    """A rod's section, where it is not that of the strip, and its shape at rest.

    Stiffnesses against D w (Y I where the strip gives strip.second_moment); None: that of the rectangle w x h.
    """

    bending: tuple[float, float] | None = key(
        Kind.PAIR, "bending stiffness about t_x (normal curvature) and about t_y (in the plane)", "D w", "each > 0",
        "[1.0, 84.0]", default=None, newer=True, absent="of the section w x h", known="1e-12 <= each <= 1e18"
    )
    torsion: float | None = key(
        Kind.NUMBER, "torsional stiffness", "D w", "> 0", "1.12", default=None, newer=True,
        absent="of the section w x h", known="1e-12 <= G J <= 1e18"
    )
    shear: tuple[float, float] | None = key(
        Kind.PAIR, "shear stiffness along t_x and t_y", "D w / l^2", "each > 0", "[1e5, 1e5]", default=None,
        newer=True, absent="of the section w x h", known="1e-12 <= each <= 1e18"
    )
    stretch: float | None = key(
        Kind.NUMBER, "axial stiffness", "D w / l^2", "> 0", "1e6", default=None, newer=True,
        absent="of the section w x h", known="1e-12 <= Y A <= 1e18"
    )
    natural_twist: Linear = key(
        Kind.LINEAR, "twist at rest, as strip.natural_twist", PER_LENGTH, example="2.0", default=(0.0, 0.0), newer=True,
        known="-1e4 <= twist l <= 1e4"
    )
    natural_in_plane: Linear = key(
        Kind.LINEAR, "curvature at rest in the plane, as strip.natural_geodesic_curvature", PER_LENGTH, example="1.0",
        default=(0.0, 0.0), newer=True, known="-1e4 <= kappa_2 l <= 1e4"
    )
    twist: str | None = key(
        Kind.CHOICE, "how a curve-angle rod finds its angle", example='"quasi-static"',
        choices={"quasi-static": "eliminated for every centreline", "free": "an unknown beside it"}, default=None,
        newer=True, absent='"free"'
    )


@dataclass(frozen=True)
class WallSpec:
    """A wall: a point, the unit normal towards the ribbon; rigid, or a pressure plate on a spring; without friction, or
    with Coulomb's along a path."""

    point: Vector = key(
        Kind.VECTOR, "a point of the wall", LENGTH, example="[0.0, 0.0, 0.0]", known="-1e6 <= x / l <= 1e6"
    )
    normal: Vector = key(
        Kind.DIRECTION, "unit normal of the wall towards the ribbon's side", NONE, example="[0.0, 1.0, 0.0]"
    )
    stiffness: float | None = key(
        Kind.NUMBER, "stiffness of the spring that holds the wall as a pressure plate, resting at point",
        "D w / l^3", "> 0", "100.0", default=None, newer=True, absent="a rigid wall", known="1e-12 <= k <= 1e18"
    )
    name: str | None = key(
        Kind.TEXT, "name of the wall in keys and results: letters, digits and _, not a number", example='"roof"',
        default=None, newer=True, absent="its number"
    )
    friction: float = key(
        Kind.NUMBER, "Coulomb's coefficient: friction along the wall is at most so many times the push on it", NONE,
        ">= 0", "0.3", default=0.0, newer=True, note="along a [[path]]; ribbon", known="mu <= 1e3"
    )


@dataclass(frozen=True)
class ContactSpec:
    """Contact of the strip with itself, without friction."""

    itself: bool = key(
        Kind.TRUTH, "whether parts of the strip that face each other are kept apart", example="true", default=False,
        newer=True, note="ribbon, elastica and shell"
    )
    distance: float | None = key(
        Kind.NUMBER, "distance that they keep, middle surface from middle surface", LENGTH, "0 < distance < length / 2",
        "1e-3", default=None, newer=True, absent="strip.thickness", known="distance / l >= 1e-4"
    )
    section: str = key(
        Kind.CHOICE, "what touches", example='"round"', default="strip", newer=True,
        choices={"strip": "its surface, between its edges too",
                 "round": "a round rod about the centreline, its diameter the distance"}
    )
    joints: str = key(
        Kind.CHOICE, "where the segments of a round rod end", example='"follow"', default="still", newer=True,
        choices={"still": "where model.elements puts them",
                 "follow": "at what touches too: places of contact, ends of lines of contact, all along these"}
    )


@dataclass(frozen=True)
class ObstacleSpec:
    """An obstacle, without friction or along a path with Coulomb's: a cylinder without ends, a sphere, a box, or a half
    space with an edge; the strip stays outside it, or inside. Which keys go with which kind:
    `compare.scene.inputs.bodies`."""

    kind: str = key(
        Kind.CHOICE, "what the obstacle is", example='"cylinder"',
        choices={"cylinder": "without ends", "sphere": "", "box": "", "edge": "the wedge between two faces"}, newer=True
    )
    point: Vector = key(
        Kind.VECTOR, "a point of a cylinder's axis or of an edge, a sphere's or a box's centre", LENGTH,
        example="[0.0, -0.1, 0.5]", newer=True, known="-1e6 <= x / l <= 1e6"
    )
    radius: float | None = key(
        Kind.NUMBER, "radius of a cylinder or a sphere", LENGTH, "> 0", "0.1", default=None, newer=True,
        absent="a box and an edge have none", known="1e-4 <= R / l <= 1e6"
    )
    axis: Vector | None = key(
        Kind.DIRECTION, "unit vector along a cylinder's axis, an edge, a box's first size", NONE,
        example="[1.0, 0.0, 0.0]", default=None, newer=True, absent="a sphere has none"
    )
    normal: Vector | None = key(
        Kind.DIRECTION, "unit vector across the axis: along a box's second size, out of an edge's first face", NONE,
        example="[0.0, 1.0, 0.0]", default=None, newer=True, absent="a cylinder and a sphere have none",
        note="an edge's second face looks along the normal turned about the axis by 180 degrees less the angle"
    )
    size: Vector | None = key(
        Kind.VECTOR, "sizes of a box along axis, normal and axis x normal, each > 0", LENGTH,
        example="[0.4, 0.2, 0.1]", default=None, newer=True, absent="others have none", known="1e-4 <= x / l <= 1e6"
    )
    angle: float | None = key(
        Kind.NUMBER, "of the body at its edge", "degrees", "10 <= angle <= 170", "60.0", default=None, newer=True,
        absent="90 of an edge; others have none"
    )
    rounding: float | None = key(
        Kind.NUMBER, "radius of the edges and corners of a box or an edge, seen from outside", LENGTH, "> 0", "5e-4",
        default=None, newer=True, absent="length / 1000; inside they are sharp", known="1e-4 <= r / l <= 1e6"
    )
    inside: bool = key(
        Kind.TRUTH, "whether the strip is inside it and cannot leave", example="true", default=False, newer=True
    )
    name: str | None = key(
        Kind.TEXT, "name of the obstacle in keys and results: letters, digits and _, not a number", example='"tube"',
        default=None, newer=True, absent="its number"
    )
    friction: float = key(
        Kind.NUMBER, "Coulomb's coefficient, as wall.friction, of a cylinder or a sphere", NONE, ">= 0", "0.3",
        default=0.0, newer=True, note="along a [[path]]; ribbon", known="mu <= 1e3"
    )


@dataclass(frozen=True)
class ModelSpec:
    """Energy and discretisation of the ribbon.

    The elements are `elements` equal ones, those of `element_lengths`, or placed for the error `tolerance` beginning
    with equal ones: this is so by default, unless the scene gives one of SAY_ELEMENTS or the model cannot place
    (`can_place`). `smallest`: the first one's length over the strip's when they are graded towards the clamp.
    """

    energy: str = key(
        Kind.CHOICE, "energy of the strip", example='"wunderlich"', choices=ENERGIES,
        also=registry.knows_energy,
        default="auto"
    )
    stiffness: str | None = key(
        Kind.CHOICE, 'bending stiffness of energy = "kirchhoff"', example='"matched"',
        choices={"matched": "D w, as the ribbon's", "plate": "Y I, as a narrow plate's"}, default=None, newer=True,
        absent='"matched"'
    )
    in_plane: bool | None = key(
        Kind.TRUTH, "whether the strip bends in its own plane (kappa_2); energies with a free twist", example="true",
        default=None, newer=True, absent='true for "kirchhoff"'
    )
    accuracy: float | None = key(
        Kind.NUMBER, "distance to a shell that chooses the energy (Hausdorff / length)", NONE,
        "0 < accuracy < 0.1", "1e-2", default=None, newer=True,
        absent='1e-2 where energy = "auto" and the strip has a thickness; else "auto" is "wunderlich"',
        known="accuracy >= 1e-6"
    )
    elements: int = key(
        Kind.COUNT, "number of elements of equal length", range=">= 1", example="20", default=DEFAULT_ELEMENTS,
        note="where they are not placed by tolerance"
    )
    grading: str = key(
        Kind.CHOICE, "lengths of the elements", example='"uniform"',
        choices={"uniform": "", "clamp": "from 2.5 w / elements at the clamp growing by 1.5 each until they are equal"},
        default="uniform"
    )
    element_lengths: tuple[float, ...] | None = key(
        Kind.LIST, "lengths of the elements from the start, summing to strip.length", LENGTH, "each > 0",
        "[0.1, 0.2, 0.7]", default=None, newer=True, absent="elements, grading", known="each / l >= 1e-13"
    )
    tolerance: float | None = key(
        Kind.NUMBER, "error to reach by placing the elements (Hausdorff distance / length)", NONE,
        "0 < tolerance < 0.1", "1e-3", default=DEFAULT_TOLERANCE,
        note="none where elements, grading or element_lengths say them, or energy or formulation cannot place them",
        known="tolerance >= 1e-12"
    )
    formulation: str = key(
        Kind.CHOICE, "unknowns of the ribbon", example='"auto"',
        choices={"auto": "", "chained": "reduced unknowns", "mixed": "glued elements",
                 "matrix": "glued, the thesis's 16 unknowns"},
        default="auto"
    )
    solver: str = key(
        Kind.CHOICE, "minimiser of the ribbon", example='"auto"',
        choices={"auto": "Newton's where there is one for the scene, else Ipopt", "newton": "nothing else has a try",
                 "ipopt": "the judge of the other"},
        default="auto", newer=True
    )
    held_by: str = key(
        Kind.CHOICE, "how glued elements hold the start clamp (thesis, 5.3.3)", example='"elimination"',
        choices=("elimination", "constraints"), default="elimination", newer=True
    )
    arc_length: str = key(
        Kind.CHOICE, "how the elastica goes from its seed and along [[path]]", example='"always"',
        choices={"auto": "as it finds right", "always": "by arc length past limit points",
                 "never": "by steps that stop there"},
        default="auto", newer=True
    )
    budget: float = key(
        Kind.NUMBER, "time for a solve, spent it ends not converged; on the processor, without compiling", "s", "> 0",
        "60.0", default=DEFAULT_BUDGET, newer=True,
        note="of a path each stage (with elastica and antman all), choice of energy and error estimate: each anew",
        known="budget <= 1e9"
    )
    smallest: float | None = None

    @property
    def can_place(self) -> bool:
        """Whether the elements can be placed by a tolerance: the ribbon's, but for the thesis's matrices."""
        return self.energy in registry.RIBBON_ENERGIES and self.formulation != "matrix"

    @property
    def lengths(self) -> tuple[float, ...]:
        """Element lengths as fractions of the strip's length, from the start; their sum is 1 to rounding."""
        if self.element_lengths is None:
            if self.smallest is not None:
                return graded_lengths(self.elements, self.smallest)
            return (1.0 / self.elements,) * self.elements
        total = sum(self.element_lengths)
        return tuple(length / total for length in self.element_lengths)


@dataclass(frozen=True)
class SeedSpec:
    """Starting shape, both laws piecewise linear in s through values at equal distances from s = 0 to s = length.

    `curvature` None: the natural one.
    """

    curvature: tuple[float, ...] | None = key(
        Kind.PIECEWISE, "starting curvature", PER_LENGTH, example='"natural"', words={"natural": ("", None)},
        default=None, known="-1e4 <= omega l <= 1e4"
    )
    ruling: tuple[float, ...] = key(
        Kind.PIECEWISE, "starting ruling eta = tan(angle)", NONE, example="0.0", default=(0.0, 0.0),
        known="-1e3 <= eta <= 1e3"
    )
    curve: tuple[Vector, ...] | None = key(
        Kind.POINTS, "starting centreline, drawn from the start to the end of the strip", LENGTH,
        example="[[0.0, 0.0, 0.0], [0.0, 0.1, 0.2], [0.1, 0.0, 0.4], [0.0, 0.0, 0.6]]", default=None, newer=True,
        known="-1e6 <= x / l <= 1e6", note="a file stands beside the scene's; instead of curvature and ruling"
    )


@dataclass(frozen=True)
class StageSpec(Mapping[str, Any]):
    """One stage of a path: a mapping from dotted keys to values (lists as tuples), in the order of the file."""

    changes: tuple[tuple[str, Any], ...]
    steps: int | None = key(
        Kind.COUNT, "number of equal steps from the stage before to this one", range=">= 1", example="4",
        default=None, absent="adaptive"
    )

    def __getitem__(self, key: str) -> Any:
        return dict(self.changes)[key]

    def __iter__(self) -> Iterator[str]:
        return (key for key, _ in self.changes)

    def __len__(self) -> int:
        return len(self.changes)


@dataclass(frozen=True)
class ShellSpec:
    """Shell runs: one per w/h (empty: the strip's own thickness), what is clamped, and the mesh."""

    width_to_thickness: tuple[float, ...] = key(
        Kind.NUMBERS, "w/h of the shell runs", NONE, "each > 1", "[10, 20, 50, 100, 200]", default=(),
        note="replaces thickness", absent="strip.thickness", known="w / h <= 1e6"
    )
    clamp: str = key(
        Kind.CHOICE, "what the shell's clamps hold", example='"edge"',
        choices={"edge": "the whole end edge", "corners": "a cell at each of its two corners"}, default="edge"
    )
    elements: tuple[int, int] | None = key(
        Kind.COUNTS, "elements of the shell [along, across]", range=">= 1", example="[100, 4]", default=None,
        note="with tolerance those of the first mesh", absent="by the strip's width"
    )
    corner: float | None = key(
        Kind.NUMBER, "size of the held corner cells along and across", LENGTH, "0 < corner < width / 2", "0.01",
        default=None, newer=True, absent="one cell of the mesh", known="corner / l >= 1e-9"
    )
    tolerance: float | None = key(
        Kind.NUMBER, "error to reach by refining the shell's mesh (Hausdorff distance / length)", NONE,
        "0 < tolerance < 0.1", "1e-3", default=None, newer=True, absent="the mesh as given", known="tolerance >= 1e-9"
    )
    goal: str = key(
        Kind.CHOICE, "what the tolerance is asked of", example='"end"',
        choices={"surface": "the whole surface: all elements are cut in two, along or across",
                 "end": "the end of the centreline; columns and rows are cut where its error comes from (adjoint)",
                 "middle": "its middle, in the same way", "energy": "the total energy over the elastic one, the same"},
        default="surface", newer=True
    )
    grading: tuple[float, float] | None = key(
        Kind.PAIR, "size of the elements [at clamps, at long edges] over the even ones in the middle", NONE,
        "0 < each <= 1", "[0.2, 0.1]", default=None, newer=True, known="each >= 1e-6"
    )
    edge_layer: float | str | None = key(
        Kind.NUMBER, "width of the layer at clamps and edges that gets two elements", LENGTH,
        "0 < layer < width / 2", '"auto"', words={"auto": ("sqrt(h / curvature)", "auto")}, default=None, newer=True,
        note="instead of grading", known="layer / l >= 1e-9"
    )
    start: str = key(
        Kind.CHOICE, "where the solve begins; \"path\" is what is left of all when a beginning is refused",
        example='"path"',
        choices={"auto": "at the ribbon's surface where compare has one and, of a scene with one equilibrium, the path "
                         "on a coarse mesh leads to the same state, else as coarse",
                 "ribbon": "at the ribbon's surface, where that settles in a stable state",
                 "coarse": "at the end of the path on a coarse mesh", "path": "with the path on the mesh itself"},
        default="auto", newer=True
    )
    shear_factor: float = key(
        Kind.NUMBER, "transverse shear stiffness of the shell over G h; a thousand times more leaves no shear", NONE,
        "> 0", "0.833", default=5.0 / 6.0, newer=True, known="1e-3 <= factor <= 1e6"
    )
    contact: str = key(
        Kind.CHOICE, "what of the shell meets the walls", example='"faces"',
        choices={"midsurface": "its middle surface, as the ribbon, which has no thickness: both meet the same walls",
                 "faces": "both faces, at half the thickness from it"},
        default="midsurface", newer=True
    )
    start_curvature: float | None = key(
        Kind.NUMBER, "curvature of the unstressed planar arc where the shell's path begins", PER_LENGTH,
        example="0.0", default=None, newer=True,
        absent="the natural one, or with two clamps that of the arc whose chord is their distance",
        known="-1e4 <= omega l <= 1e4"
    )
