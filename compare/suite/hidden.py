"""The hidden half: cases whose parameters a seed draws at run time, their references computed on the spot.

What is drawn is written here, which numbers come out is not: nobody can have tuned a simulator to them. Every reference
is found twice, by collocation and by shooting, or by closed forms and collocation (`compare.suite.reference`), and
only drawn again where the two do not agree.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from compare.suite.case import Case, first_scene, read
from compare.suite.reference import both_ways, clamped_arch
from compare.suite.section import PLANE, bar_of, saint_venant

Draw = Callable[[np.random.Generator], tuple[str, str, str]]
#: How often a case is drawn again whose references do not agree.
_AGAIN = 20
_HEAD = """version = 1
title = "{title}"
level = "{level}"
units = "dimensionless"
theory = "{theory}"
fast = true
says = "{says}"
licence = "BSD-3-Clause"
cite = ["drawn with the seed {seed} (compare/suite/hidden.py)"]
"""


def _row(*values: float) -> str:
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"


def _clamp(frame: np.ndarray) -> str:
    tangent, normal = _row(*frame[:, 2]), _row(*frame[:, 1])
    return f"\n[physics.clamp.start]\nposition = [0.0, 0.0, 0.0]\ntangent = {tangent}\nnormal = {normal}\n"


def _level(angle: float) -> np.ndarray:
    """A frame whose tangent is level and whose width is turned by `angle` (rad) from the level, up = e_y."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _heavy(draw: np.random.Generator) -> tuple[str, str, str]:
    gamma = math.exp(draw.uniform(math.log(0.5), math.log(200.0)))
    physics = (
        f"\n[physics.strip]\nlength = 1.0\nwidth = 0.05\nthickness = 5e-5\npoisson = 0.0\ngamma = {gamma!r}\n"
        f"\n[physics.gravity]\nup = [0.0, 1.0, 0.0]\n{_clamp(_level(0.0))}"
    )
    return PLANE, "A heavy strip, clamped level, bends in its plane.", physics


def _curl(draw: np.random.Generator) -> tuple[str, str, str]:
    ratio, nu = draw.uniform(0.05, 0.2), draw.uniform(0.2, 0.45)
    torsion = 2.0 * (1.0 - nu) * saint_venant(ratio)
    physics = (
        f"\n[physics.strip]\nlength = 1.0\nwidth = 0.03\nthickness = {0.03 * ratio!r}\npoisson = {nu!r}\n"
        f"natural_curvature = {draw.uniform(2.0, 9.0)!r}\ngamma = {draw.uniform(5.0, 40.0)!r}\n"
        f"\n[physics.rod]\nbending = {_row(1.0, (1 - nu**2) / ratio**2)}\ntorsion = {torsion!r}\n"
        f"shear = [1e8, 1e8]\nstretch = 1e8\n"
        f"\n[physics.gravity]\nup = [0.0, 1.0, 0.0]\n{_clamp(_level(draw.uniform(0.3, 1.2)))}"
    )
    return "rod", "A curl of rectangular section hangs from a clamp, its width askew.", physics


def _pulled(draw: np.random.Generator) -> tuple[str, str, str]:
    stiff, torsion = draw.uniform(1.0, 40.0), draw.uniform(0.4, 2.0)
    force = draw.normal(size=3)
    force *= draw.uniform(0.5, 4.0) / np.linalg.norm(force)
    physics = (
        "\n[physics.strip]\nlength = 1.0\nwidth = 0.02\npoisson = 0.3\n"
        f"\n[physics.rod]\nbending = {_row(1.0, stiff)}\ntorsion = {torsion!r}\nshear = [1e5, 1e5]\nstretch = 2e5\n"
        f"\n[physics.tip]\nforce = {_row(*force)}\n{_clamp(_level(draw.uniform(0.0, 1.5)))}"
    )
    return "rod", "A straight rod, clamped at one end, is pulled by a dead force at the other.", physics


RECIPES: Mapping[str, Draw] = {"heavy": _heavy, "curl": _curl, "pulled": _pulled}


def _question(name: str, of: str, first: float, second: float, by: tuple[str, str], interval: float) -> str:
    """A question with both ways of its reference."""
    ways = "".join(f'  {{ by = "{who}", value = {v!r} }},\n' for who, v in zip(by, (first, second), strict=True))
    head = f'\n[[ask]]\nname = "{name}"\n{of}\nreference = {first!r}\ninterval = {interval!r}\n'
    return f"{head}way = [\n{ways}]\n"


def _ask(axis: str, first: float, second: float, by: tuple[str, str]) -> str:
    width = max(1e-5, 2.0 * abs(first - second))
    return _question(f"{axis} of the end", f'of = "position"\naxis = "{axis}"', first, second, by, width)


def _free(name: str, seed: int, draw: np.random.Generator) -> Case:
    """A clamped-free case of a recipe. Raises ArithmeticError where its two references do not come or agree."""
    theory, says, physics = RECIPES[name](draw)
    head = _HEAD.format(title=says.rstrip("."), level="rods", theory=theory, says=says, seed=seed)
    unknown = "".join(_ask(axis, 0.0, 0.0, ("none", "yet")) for axis in "xyz")
    case = read(head + physics + unknown, f"hidden_{name}")
    one, two = both_ways(bar_of(first_scene(case), theory).free_rod)
    if np.abs(one - two).max() > 1e-6:
        raise ArithmeticError(f"collocation and shooting differ by {np.abs(one - two).max():.1e}")
    by = ("collocation", "shooting")
    asks = "".join(_ask(axis, float(a), float(b), by) for axis, a, b in zip("xyz", one, two, strict=True))
    return read(head + physics + asks, f"hidden_{name}")


def _arch(seed: int, draw: np.random.Generator) -> Case:
    """A strip between two clamps."""
    short = draw.uniform(0.05, 0.5)
    thrust, rise = clamped_arch(short)
    again = _arch_again(short)
    says = "A flat strip between two clamps on one line, nearer to each other than it is long."
    head = _HEAD.format(title=says.rstrip("."), level="planar", theory=PLANE, says=says, seed=seed)
    by = ("elliptic integrals", "quadrature of the inflexional arc")
    questions = (
        ("rise", 'of = "extent"\naxis = "y"', rise, again[0], 1e-5),
        ("thrust", 'of = "force"\naxis = "z"\non = "end"\nsign = -1', thrust, again[1], 5e-5 * thrust),
    )
    asks = "".join(_question(name, of, first, second, by, width) for name, of, first, second, width in questions)
    text = (
        f"{head}\n[physics.strip]\nlength = 1.0\nwidth = 0.05\nthickness = 5e-5\npoisson = 0.0\n{_clamp(_level(0.0))}"
        f"\n[physics.clamp.end]\nposition = [0.0, 0.0, {1.0 - short!r}]\ntangent = [0.0, 0.0, 1.0]\n"
        f"normal = [0.0, 1.0, 0.0]\n\n[begin.seed]\ncurvature = [-8.0, 8.0, -8.0]\n{asks}"
    )
    return read(text, "hidden_arch")


def _arch_again(short: float) -> tuple[float, float]:
    """Rise and thrust by Gauss's quadrature of ds = d phi / sqrt(2 P (cos phi - cos alpha)), sin(phi / 2) =
    sin(alpha / 2) sin t, and bisection in alpha: no elliptic integral of a library."""
    nodes, weights = np.polynomial.legendre.leggauss(80)
    t, w = 0.25 * math.pi * (nodes + 1.0), 0.25 * math.pi * weights

    def arc(alpha: float) -> tuple[float, float]:
        p = math.sin(0.5 * alpha)
        root = np.sqrt(1.0 - (p * np.sin(t)) ** 2)
        return float(w @ (1.0 / root)), float(w @ ((1.0 - 2.0 * (p * np.sin(t)) ** 2) / root))

    low, high = 1e-6, 2.2
    for _ in range(80):
        alpha = 0.5 * (low + high)
        length, along = arc(alpha)
        low, high = (alpha, high) if along / length > 1.0 - short else (low, alpha)
    length, _ = arc(alpha)
    return math.sin(0.5 * alpha) / length, 16.0 * length**2


def drawn(seed: int) -> tuple[Case, ...]:
    """The hidden cases of a seed: one of each recipe, and an arch."""
    found = []
    for place, name in enumerate(RECIPES):
        draw = np.random.default_rng([seed, place])
        for _ in range(_AGAIN):
            try:
                found.append(_free(name, seed, draw))
                break
            except ArithmeticError:
                continue
        else:
            raise ArithmeticError(f"no case of {name} came in {_AGAIN} draws of the seed {seed}")
    return (*found, _arch(seed, np.random.default_rng([seed, len(RECIPES)])))
