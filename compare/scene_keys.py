"""The scene contract as data: every key with its meaning, its unit and a value that is right.

The reader takes its remedies from here, `Scene.to_toml` its comments: a key is described once.
"""

from __future__ import annotations

from compare.scene_table import Key

KEYS: dict[str, Key] = {
    "title": Key("title of the scene, one line of text", '"Curl, 4.3"'),
    "strip.length": Key("length l, > 0, in m (any unit when gamma is given or there is no gravity)", "1.0"),
    "strip.width": Key("width w, 0 < w < length, same unit as length", "0.03"),
    "strip.thickness": Key("thickness h, 0 < h < width, same unit as length", "3e-4"),
    "strip.poisson": Key("Poisson's ratio nu, -1 < nu <= 0.5, no unit", "0.4"),
    "strip.natural_curvature": Key("natural normal curvature in 1/length: a number, or [at start, at end]", "10.0"),
    "strip.gamma": Key("weight against bending stiffness rho h g l^3 / D, >= 0, no unit", "100.0"),
    "strip.young": Key("Young's modulus, > 0, in Pa (together with density and thickness, instead of gamma)", "1.8e9"),
    "strip.density": Key(
        "mass density, > 0, in kg/m^3 (together with young and thickness, instead of gamma)", "1000.0"
    ),
    "gravity.up": Key("unit vector UP, against the weight, no unit", "[1.0, 0.0, 0.0]"),
    "gravity.acceleration": Key("acceleration of gravity, > 0, in m/s^2 (used with young and density)", "9.81"),
    "gravity.exact": Key("weight over the surface (true) or along the centreline (false)", "false"),
    "clamp.start.position": Key("point held at s = 0, three numbers in the unit of length", "[0.0, 0.0, 0.0]"),
    "clamp.start.tangent": Key("unit tangent t_z held at s = 0, three numbers without unit", "[0.0, 0.0, 1.0]"),
    "clamp.start.normal": Key(
        "unit surface normal t_y held at s = 0, orthogonal to the tangent, without unit", "[0.0, 1.0, 0.0]"
    ),
    "clamp.start.across": Key(
        "optional check: t_x = t_y x t_z, the direction of the width, without unit", "[1.0, 0.0, 0.0]"
    ),
    "clamp.start.ruling": Key('"free", or "straight" (eta = 0: the clamp holds the whole edge)', '"straight"'),
    "model.energy": Key('energy of the strip: "auto", "sadowsky", "wunderlich" or "elastica"', '"wunderlich"'),
    "model.elements": Key("number of elements of equal length, a whole number >= 1", "20"),
    "model.grading": Key(
        '"uniform", or "clamp": from 2.5 w / elements at the clamp growing by 1.5 each until they are equal',
        '"uniform"',
    ),
    "model.element_lengths": Key(
        "lengths of the elements from the start, > 0, summing to strip.length, in its unit", "[0.1, 0.2, 0.7]"
    ),
    "model.formulation": Key('"auto" or "chained"', '"auto"'),
    "seed.curvature": Key('starting curvature: "natural", or in 1/length a number or [at start, at end]', '"natural"'),
    "seed.ruling": Key("starting ruling eta = tan(angle), no unit: a number or [at start, at end]", "0.0"),
    "shell.width_to_thickness": Key(
        "w/h of the shell runs, each > 1, no unit: a number or a list; replaces thickness", "[10, 20, 50, 100, 200]"
    ),
    "shell.clamp": Key('what of the end edge the shell holds: "edge"', '"edge"'),
    "shell.elements": Key("elements of the shell [along, across], whole numbers >= 1", "[100, 4]"),
}
"""Every key of the contract that this version reads."""

UNAVAILABLE: dict[str, str] = {
    "clamp.end": "remove [clamp.end]: only the start can be clamped so far",
    "closure": "remove [closure] and use [clamp.start]: closed bands come later",
    "wall": "remove [[wall]]: contact comes later",
    "path": "remove [[path]]: the scene is reached from its natural shape so far",
    "model.tolerance": "give model.elements = 20 instead (the error is then estimated by refinement)",
}
"""Keys and sections of the contract that are not built yet, each with what to do."""

ENERGIES = ("auto", "sadowsky", "wunderlich", "elastica")
LATER_ENERGIES = {
    name: f"choose from {', '.join(repr(energy) for energy in ENERGIES)}"
    for name in ("kirchhoff", "extensible", "sano")
}
FORMULATIONS = ("auto", "chained")
LATER_FORMULATIONS = {"mixed": "choose 'auto' or 'chained'"}
SHELL_CLAMPS = ("edge",)
LATER_SHELL_CLAMPS = {"corners": "choose 'edge': the shell then holds the whole end edge"}
RULINGS = ("free", "straight")
GRADINGS = ("uniform", "clamp")
