"""Sets of scene keys with names, of which a model says what it reads: ``STRIP | WEIGHT | BOTH_CLAMPS - RULINGS``.

Every set names its keys one by one (`compare.scene.keys.KEYS` has their meaning), so that a key that is new in the
scene is in none of them until somebody has put it there: what no model reads is refused by name, by all of them.
"""

from __future__ import annotations

from collections.abc import Mapping

Keys = frozenset[str]


def inside(section: str, *names: str) -> Keys:
    """The keys of a section."""
    return frozenset(f"{section}.{name}" for name in names)


TITLE: Keys = frozenset({"title"})
NATURAL = inside("strip", "natural_curvature")
#: The shape at rest that is no plane and no cylinder.
SHAPED = inside("strip", "natural_twist", "natural_geodesic_curvature")
#: What bending in a plane takes of a strip; what more a section of some width has.
BENDING = TITLE | NATURAL | inside("strip", "length", "thickness", "young")
SECTION = inside("strip", "width", "poisson")
CROSS_CURVED = inside("strip", "transverse_curvature")
SECOND_MOMENT = inside("strip", "second_moment")
#: What a strip weighs, and with what pulls at it, which way.
HEAVINESS = inside("strip", "gamma", "density")
WEIGHT = HEAVINESS | inside("gravity", "up", "acceleration")
OVER_THE_SURFACE = inside("gravity", "exact")
STRIP = BENDING | SECTION

TIP_FORCE = inside("tip", "mass", "load", "force", "tension")
TIP_MOMENT = inside("tip", "moment")
TIP = TIP_FORCE | TIP_MOMENT

_ENDS = ("clamp.start", "clamp.end")
_HELD = frozenset[str]().union(*(inside(end, "position", "frame", "tangent", "normal", "across") for end in _ENDS))
CLAMP_RULINGS = frozenset(f"{end}.ruling" for end in _ENDS)
SLIDES = frozenset(f"{end}.slide" for end in _ENDS)
SECTIONS = frozenset(f"{end}.section" for end in _ENDS)
BOTH_CLAMPS = _HELD | CLAMP_RULINGS | SLIDES | SECTIONS
CLOSED = inside("closure", "kind", "turns")
HALF_TURNS = inside("closure", "half_turns")
CLOSURE = CLOSED | inside("closure", "ruling", "twist")
WALLS = inside("wall", "point", "normal", "stiffness", "name")
CONTACT = inside("contact", "itself", "distance", "section")
#: On segments that follow what touches.
FOLLOWED = inside("contact", "joints")
OBSTACLES = inside(
    "obstacle", "kind", "point", "radius", "axis", "normal", "size", "angle", "rounding", "inside", "name"
)
FRICTION = inside("wall", "friction") | inside("obstacle", "friction")
#: Whatever says how rulings stand.
RULINGS = CLAMP_RULINGS | inside("closure", "ruling") | inside("seed", "ruling")

ROD_STRAINS = inside("rod", "bending", "torsion", "natural_twist", "natural_in_plane")
SHEARED_ROD = ROD_STRAINS | inside("rod", "shear", "stretch")
ROD_TWIST = inside("rod", "twist")
ROD = SHEARED_ROD | ROD_TWIST

ENERGY = inside("model", "energy")
STIFFNESS = inside("model", "stiffness")
ELEMENTS = inside("model", "elements", "grading", "element_lengths")
BUDGET = inside("model", "budget")
TOLERANCE = inside("model", "tolerance")
ARC_LENGTH = inside("model", "arc_length")
#: How a ribbon is discretised, held and solved, beyond the number of its elements.
RIBBON_SOLVER = inside("model", "formulation", "held_by", "solver")
RIBBON_CHOICE = inside("model", "accuracy", "in_plane")
MODEL = ENERGY | STIFFNESS | ELEMENTS | BUDGET | TOLERANCE | ARC_LENGTH | RIBBON_SOLVER | RIBBON_CHOICE
SEED = inside("seed", "curvature", "ruling")
DRAWN = inside("seed", "curve")
PATH: Keys = frozenset({"path"})
SHELL = inside(
    "shell", "width_to_thickness", "clamp", "elements", "corner", "tolerance", "goal", "grading", "edge_layer", "start",
    "start_curvature", "contact", "shear_factor",
)  # fmt: skip
UNCERTAINTY = inside("uncertainty", "width", "thickness", "poisson", "natural_curvature", "gamma", "young", "density")


def because(*reasons: tuple[Keys, str]) -> Mapping[str, str]:
    """Keys that a model may be given and that change nothing, each with the reason."""
    return {key: why for keys, why in reasons for key in keys}


#: Of every model.
UNSURE = (UNCERTAINTY, "how sure the inputs are moves no result (compare.studies.inputs)")
#: Of the models of lines.
SHELL_BESIDE = (SHELL, "how the shell beside it is made and held")
