"""Scenes as people write them: the templates of `ribbonbench new` in SI with random numbers. One number, one scene."""

from __future__ import annotations

import math
import random

from compare.scene.begin.materials import MATERIALS
from compare.scene.begin.start import started
from compare.scene.begin.template import HELD
from compare.scene.scene import Scene

#: Lengths in m, w / l, w / h, and |K l| (rad) that are drawn, evenly in their logarithms.
LENGTH, SLENDER, THIN, CURL = (0.03, 2.0), (0.01, 0.25), (20.0, 500.0), (0.3, 15.0)
#: Distances of two clamps over the length; one in twenty is taut.
APART, TAUT = (0.2, 0.995), 0.05
#: Parts of a strip's numbers that are kept: as many digits as one measures.
DIGITS = 4


def said(number: int) -> tuple[dict[str, str], bool]:
    """What is typed for `ribbonbench new --si` of own scene `number`, and whether the strip weighs anything."""
    chance = random.Random(1000 + number)

    def between(low: float, high: float) -> float:
        return math.exp(chance.uniform(math.log(low), math.log(high)))

    held = chance.choice(tuple(HELD))
    length = between(*LENGTH)
    width = length * between(*SLENDER)
    typed = {
        "held": held,
        "material": chance.choice(tuple(MATERIALS)),
        "length": _rounded(length),
        "width": _rounded(width),
        "thickness": _rounded(width / between(*THIN)),
    }
    if chance.random() < 0.6 and held != "moebius":
        typed["natural_curvature"] = _rounded(chance.choice((1.0, -1.0)) * between(*CURL) / length)
    if held == "two":
        typed["apart"] = "1" if chance.random() < TAUT else _rounded(chance.uniform(*APART))
    return typed, chance.random() < 0.85


def own(number: int) -> tuple[str, Scene]:
    """The text of own scene `number`, as `new` writes it, and the scene."""
    typed, weight = said(number)
    return started(typed, True, f"own {number}", weight)


def _rounded(value: float) -> str:
    return f"{value:.{DIGITS}g}"
