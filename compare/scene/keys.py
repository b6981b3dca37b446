"""The scene contract as data: every key with its meaning, its unit and a value that is right.

The reader takes its remedies from here, `Scene.to_toml` its comments: a key is described once.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from runpy import run_path

from compare.scene.table import Key


def _registered() -> tuple[str, ...]:
    """The ribbon's registry of energies; its file alone is run, for a scene is read without numba and Ipopt."""
    package = find_spec("ribbon")
    if package is None or package.origin is None:
        return ()
    return tuple(run_path(str(Path(package.origin).parent / "energies" / "names.py"))["NAMES"])


ENERGIES = ("auto", *_registered(), "elastica")


def _quoted(word: str) -> str:
    return f'"{word}"'


def _clamp_keys(end: str, at: str) -> dict[str, Key]:
    """The keys of `[clamp.start]` or `[clamp.end]`, which stands at `at`."""
    return {
        f"clamp.{end}.position": Key(
            f'point held at {at}, three numbers in the unit of length, or "free"', "[0.0, 0.0, 0.0]"
        ),
        f"clamp.{end}.frame": Key(f'"free": neither tangent nor normal is held at {at}', '"free"'),
        f"clamp.{end}.tangent": Key(f"unit tangent t_z held at {at}, three numbers without unit", "[0.0, 0.0, 1.0]"),
        f"clamp.{end}.normal": Key(
            f"unit surface normal t_y held at {at}, orthogonal to the tangent, without unit", "[0.0, 1.0, 0.0]"
        ),
        f"clamp.{end}.across": Key(
            "optional check: t_x = t_y x t_z, the direction of the width, without unit", "[1.0, 0.0, 0.0]"
        ),
        f"clamp.{end}.ruling": Key('"free", or "straight" (eta = 0: the clamp holds the whole edge)', '"straight"'),
    }


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
    "strip.second_moment": Key(
        "second moment of area I of a rod's section about the axis of bending, > 0, in m^4 (with young, instead of "
        "thickness; the rod weighs nothing)",
        "1.2566370614359172e-11",
    ),
    "tip.mass": Key(
        "mass at s = length, >= 0, in kg (with young and second_moment, or young, density and thickness)", "0.005"
    ),
    "tip.load": Key("load at s = length along -up against bending stiffness, >= 0, in D w / l^2 (or Y I / l^2)", "3.9"),
    "gravity.up": Key("unit vector UP, against the weight, no unit", "[1.0, 0.0, 0.0]"),
    "gravity.acceleration": Key("acceleration of gravity, > 0, in m/s^2 (used with young and density)", "9.81"),
    "gravity.exact": Key("weight over the surface (true) or along the centreline (false)", "false"),
    **_clamp_keys("start", "s = 0"),
    **_clamp_keys("end", "s = length"),
    "closure.kind": Key('how the band is closed: "circle", or "moebius" (half a turn at the seam)', '"moebius"'),
    "closure.ruling": Key('"free", or "straight" (eta = 0 at the seam)', '"free"'),
    "closure.turns": Key("number of turns of a circle, a whole number >= 1", "1"),
    "wall.point": Key("a point of the wall, three numbers in the unit of length", "[0.0, 0.0, 0.0]"),
    "wall.normal": Key(
        "unit normal of the wall towards the ribbon's side, three numbers without unit", "[0.0, 1.0, 0.0]"
    ),
    "wall.stiffness": Key(
        "stiffness of the spring that holds the wall as a pressure plate, resting at point, > 0, in D w / l^3", "100.0"
    ),
    "wall.name": Key("name of the wall in keys and results: letters, digits and _, not a number", '"roof"'),
    "model.energy": Key(
        f"energy of the strip: {', '.join(map(_quoted, ENERGIES[:-1]))} or {_quoted(ENERGIES[-1])}", '"wunderlich"'
    ),
    "model.elements": Key("number of elements of equal length, a whole number >= 1", "20"),
    "model.grading": Key(
        '"uniform", or "clamp": from 2.5 w / elements at the clamp growing by 1.5 each until they are equal',
        '"uniform"',
    ),
    "model.element_lengths": Key(
        "lengths of the elements from the start, > 0, summing to strip.length, in its unit", "[0.1, 0.2, 0.7]"
    ),
    "model.tolerance": Key(
        "error to reach by placing the elements (Hausdorff distance / length), 0 < tolerance < 0.1, no unit", "1e-3"
    ),
    "model.formulation": Key(
        '"auto", "chained" (reduced unknowns), "mixed" (glued elements) or "matrix" (glued, the thesis\'s 16 unknowns)',
        '"auto"',
    ),
    "model.held_by": Key('how glued elements hold the start clamp: "elimination" or "constraints"', '"elimination"'),
    "model.arc_length": Key(
        'how the elastica goes from its seed and along [[path]]: by arc length past limit points ("always"), by steps '
        'that stop there ("never"), or as it finds right ("auto")',
        '"always"',
    ),
    "seed.curvature": Key(
        'starting curvature: "natural", or in 1/length a number, [at start, at end] or more at equal distances',
        '"natural"',
    ),
    "seed.ruling": Key(
        "starting ruling eta = tan(angle), no unit: a number, [at start, at end] or more at equal distances", "0.0"
    ),
    "path.steps": Key(
        "number of equal steps from the stage before to this one, a whole number >= 1 (absent: adaptive)", "4"
    ),
    "shell.width_to_thickness": Key(
        "w/h of the shell runs, each > 1, no unit: a number or a list; replaces thickness", "[10, 20, 50, 100, 200]"
    ),
    "shell.clamp": Key(
        'what the shell\'s clamps hold: "edge" (the whole end edge), or "corners" (a cell at each of its two corners)',
        '"edge"',
    ),
    "shell.corner": Key(
        "size of the held corner cells along and across, > 0, two of them less than the width, same unit as length",
        "0.01",
    ),
    "shell.elements": Key(
        "elements of the shell [along, across], whole numbers >= 1; with tolerance those of the first mesh", "[100, 4]"
    ),
    "shell.tolerance": Key(
        "error to reach by refining the shell's mesh (Hausdorff distance / length), 0 < tolerance < 0.1, no unit",
        "1e-3",
    ),
    "shell.grading": Key(
        "size of the elements at the clamps and at the long edges over the even ones in the middle [along, across], "
        "0 < each <= 1, no unit",
        "[0.2, 0.1]",
    ),
    "shell.edge_layer": Key(
        'width of the layer at clamps and edges that gets two elements: "auto" (sqrt(h / curvature)) or, in the unit '
        "of length, a number > 0; instead of grading",
        '"auto"',
    ),
    "shell.start_curvature": Key(
        "curvature in 1/length of the unstressed planar arc where the shell's path begins (absent: the natural one, or "
        "with two clamps that of the arc whose chord is their distance)",
        "0.0",
    ),
}
"""Every key of the contract that this version reads."""

SECTIONS = ("clamp.start", "clamp.end", "closure", "gravity", "tip")
"""Sections that a stage of a path can leave out: their value is then false."""

FIXED_ON_PATH = ("title", "path", "shell")
"""What no stage of a path can change."""

FREE = "free"
"""The value of `position` or `frame` of a clamp that does not hold it."""
LATER_ENERGIES = {
    name: f"choose from {', '.join(repr(energy) for energy in ENERGIES)}"
    for name in ("kirchhoff", "extensible", "sano")
}
FORMULATIONS = ("auto", "chained", "mixed", "matrix")
HELD_BY = ("elimination", "constraints")
ARC_LENGTHS = ("auto", "always", "never")
CLOSURES = ("circle", "moebius")
SHELL_CLAMPS = ("edge", "corners")
RULINGS = ("free", "straight")
GRADINGS = ("uniform", "clamp")
