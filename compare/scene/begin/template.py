"""A first scene as TOML text: every key with its unit and meaning, the frame explained, what else there is in comments.

The meanings are those of the declared keys (`compare.scene.keys`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from compare.scene.begin.materials import MATERIALS
from compare.scene.begin.sketch import commented
from compare.scene.declare import LENGTH, NONE, literal
from compare.scene.keys import KEYS
from compare.scene.spec import STANDARD_GRAVITY, USUAL_ACCURACY

HELD = {
    "one": "clamped at one end, horizontally: a cantilever",
    "hanging": "clamped at its upper end, hanging down",
    "two": "clamped at both ends, which face each other",
    "ring": "closed to a ring, clamped at its seam",
    "moebius": "closed to a Moebius band, weightless and free in space",
}
"""How a strip of the template is held, in words."""

#: Gamma over the root of the slack up to which an arch stands well between two clamps.
_STANDS = 150.0
#: Gamma beyond which a ring is not found from a circle.
_HEAVY_RING = 300.0

#: By how much a stage makes it heavier.
_HEAVIER = 10.0
_COLUMN = 36
_LINE = 120
_SI = {LENGTH: "m", "1/length": "1/m", NONE: "", None: ""}
_FREE = {LENGTH: "the unit of length", "1/length": "1/length", "m": "the unit of length", NONE: "", None: ""}


@dataclass(frozen=True)
class Start:
    """What a first scene says.

    si: in m, Pa and kg/m^3, with `young`, `density` and `thickness`; otherwise in any unit of length, with `gamma`.
    apart: distance of the two clamps, as a part of the length; weight: whether the strip weighs anything; material:
    whose typical values stand in it where they are not `given` (names of fields).
    """

    title: str
    length: float
    width: float
    poisson: float
    si: bool = True
    thickness: float | None = None
    young: float | None = None
    density: float | None = None
    gamma: float | None = None
    natural_curvature: tuple[float, ...] = (0.0,)
    held: str = "one"
    apart: float = 0.9
    weight: bool = True
    material: str | None = None
    given: frozenset[str] = frozenset()

    @property
    def closed(self) -> bool:
        """A band without ends."""
        return self.held in ("ring", "moebius")

    @property
    def weighs(self) -> bool:
        """Whether there is a [gravity]: a free Moebius band would fall for ever."""
        return self.weight and self.held != "moebius"


def text_of(start: Start) -> str:
    """The scene. It is not checked here: `compare.scene.scene.loads` does."""
    lines = [
        f"# A strip {HELD[start.held]}.",
        "# Behind every value: what it is and its unit. What else a scene can say: ribbonbench keys",
        "# Lengths in m, Young's modulus in Pa, density in kg/m^3."
        if start.si
        else "# Lengths in any one unit; gamma says how heavy the strip is against its stiffness.",
        "#",
        commented(),
        "",
        _line(start, "title", start.title),
        *_strip(start),
        *_gravity(start),
        *_supports(start),
        *_path(start),
        *_model(start),
        *_shell(start),
    ]
    return "\n".join(lines) + "\n"


def _line(start: Start, key: str, value: object, more: str = "", off: bool = False) -> str:
    """A key with its value, unit and meaning; `off`: as a comment."""
    about = KEYS[key]
    unit = (_SI if start.si else _FREE).get(about.unit, about.unit)
    said = about.about if about.unit is None else f"{about.about}, {f'in {unit}' if unit else 'no unit'}"
    shown = f"{'# ' if off else ''}{about.field} = {number(value) if isinstance(value, float) else literal(value)}"
    line = f"{shown:<{_COLUMN}} # {said}{f': {more}' if more else ''}"
    if len(line) <= _LINE:
        return line
    return f"{shown:<{_COLUMN}} # {said}:\n{'':<{_COLUMN}} # {more}"


def number(value: float) -> str:
    """A number as TOML, as one would write it: 2.1e11, 0.0001, 7850.0."""
    short = f"{value:.12g}" if abs(value) < 1e6 else f"{value:.11e}"
    shown = short if float(short) == value else repr(value)
    if "e" in shown:
        digits, exponent = shown.split("e")
        return f"{digits.rstrip('0').rstrip('.') if '.' in digits else digits}e{int(exponent)}"
    return shown if "." in shown else f"{shown}.0"


def _strip(start: Start) -> list[str]:
    def source(field: str) -> str:
        if start.material is None or field in start.given:
            return ""
        known = MATERIALS[start.material]
        return f"typical of {known.words}{f' ({known.spread})' if field == 'young' else ''}, measure yours"

    curvature = start.natural_curvature[0] if len(start.natural_curvature) == 1 else list(start.natural_curvature)
    flat = not any(start.natural_curvature)
    text = "naturally flat; positive: bends away from t_y" if flat else "positive: bends away from t_y"
    lines = ["", "[strip]", _line(start, "strip.length", start.length), _line(start, "strip.width", start.width)]
    if start.thickness is not None:
        lines.append(_line(start, "strip.thickness", start.thickness))
    lines.append(_line(start, "strip.poisson", start.poisson, source("poisson")))
    if start.si:
        assert start.young is not None
        assert start.density is not None
        lines.append(_line(start, "strip.young", start.young, source("young")))
        lines.append(_line(start, "strip.density", start.density, source("density")))
    elif start.gamma is not None and start.weighs:
        lines.append(_line(start, "strip.gamma", start.gamma))
    return [*lines, _line(start, "strip.natural_curvature", curvature, text)]


def _gravity(start: Start) -> list[str]:
    if not start.weighs:
        why = "nothing holds the band" if start.held == "moebius" else "weightless"
        return ["", f"# Without a section [gravity]: {why}."]
    return ["", "[gravity]", _line(start, "gravity.up", [0.0, 1.0, 0.0], "e_y points up")]


def _supports(start: Start) -> list[str]:
    if start.held == "moebius":
        return ["", "[closure]", _line(start, "closure.kind", "moebius", "glued after half a turn")]
    down = start.held == "hanging"
    tangent, normal = ([0.0, -1.0, 0.0], [0.0, 0.0, 1.0]) if down else ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0])
    leaves = "the strip leaves the clamp downwards" if down else "the strip leaves the clamp along e_z, horizontally"
    across = "so t_x = t_y x t_z = e_x" if down else "e_y, up; so t_x = t_y x t_z = e_x"
    lines = [
        "", "[clamp.start]", _line(start, "clamp.start.position", [0.0, 0.0, 0.0], "the origin"),
        _line(start, "clamp.start.tangent", tangent, leaves), _line(start, "clamp.start.normal", normal, across),
    ]  # fmt: skip
    if start.held == "ring":
        return [*lines, "", "[closure]", _line(start, "closure.kind", "circle", "the end is glued to the start")]
    lines.append(_line(start, "clamp.start.ruling", "straight", 'the clamp holds the whole edge; or "free"'))
    if start.held != "two":
        return [*lines, "", "# [clamp.end] with the same keys would hold the other end; without it, it is free."]
    bend, words = _buckled(start), "an arch towards t_y (up); other signs: away from it"
    if _hangs(start):
        bend, words = -bend, "away from t_y (down): no arch stands under this weight"
    return [
        *lines,
        "",
        "[clamp.end]",
        _line(
            start, "clamp.end.position", [0.0, 0.0, float(f"{start.apart * start.length:.12g}")],
            f"{start.apart:g} of the length from the start",
        ),
        _line(start, "clamp.end.tangent", [0.0, 0.0, 1.0], "out of the strip, so the same as at the start"),
        _line(start, "clamp.end.normal", [0.0, 1.0, 0.0], "e_y, up"),
        _line(start, "clamp.end.ruling", "straight", 'the clamp holds the whole edge; or "free"'),
        "",
        "[seed]                               # where the search for the equilibrium begins",
        _line(start, "seed.curvature", [-bend, bend, -bend], words),
    ]  # fmt: skip


def _buckled(start: Start) -> float:
    """Curvature at the ends, and against it in the middle, of a strip that is clamped at both and slightly compressed:
    the angle a s (1 - 2 s) of one half, and the same with the other sign of the other, shortens it by a^2 / 240 of its
    length, and turns its end by nothing."""
    slack = max(1.0 - start.apart, 0.0)
    return float(f"{math.sqrt(240.0 * slack) / start.length:.4g}")


def _hangs(start: Start) -> bool:
    """Whether the strip between two clamps weighs so much that it hangs: its arch is pushed through at Gamma = 250
    sqrt(1 - apart) (0.5 to 0.98 of the length apart, by `ribbon.solve`: 249 to 312)."""
    return _gamma(start) > _STANDS * math.sqrt(max(1.0 - start.apart, 0.0))


def _gamma(start: Start) -> float:
    """Gamma of the strip, 0 without weight."""
    if not start.weighs:
        return 0.0
    if not start.si:
        return start.gamma or 0.0
    assert start.young is not None
    assert start.density is not None
    assert start.thickness is not None
    bending = start.young * start.thickness**2 / (12.0 * (1.0 - start.poisson**2))
    return start.density * STANDARD_GRAVITY * start.length**3 / bending


def _path(start: Start) -> list[str]:
    """The way to a heavy ring: it begins light, for the circle is no seed of a ring that folds under its weight, and no
    stage makes it more than `_HEAVIER` times as heavy."""
    gamma = _gamma(start)
    if start.held != "ring" or gamma <= _HEAVY_RING:
        return []
    key, whole, words = "strip.gamma", gamma, "Gamma, no unit"
    if start.si:
        key, whole, words = "gravity.acceleration", STANDARD_GRAVITY, "acceleration of gravity, in m/s^2"
    lines = []
    light, comment = 0.5 * _HEAVY_RING, "so heavy a ring is reached from a lighter one"
    while light < gamma:
        shown = f'"{key}" = {number(float(f"{whole * light / gamma:.2g}"))}'
        lines += ["", f"{'[[path]]':<{_COLUMN}} # {comment}", f"{shown:<{_COLUMN}} # {words}"]
        light, comment, words = _HEAVIER * light, "heavier", "as above"
    return lines


def _model(start: Start) -> list[str]:
    if start.held == "moebius":
        return ["", "[model]", _line(start, "model.tolerance", 1e-3, "a Moebius band is bent sharply in places")]
    finer = _line(start, "model.tolerance", 1e-3, "finer: 1e-4", off=True)
    if start.thickness is not None and _path(start):
        placed = _line(start, "model.tolerance", 2e-4, "a heavy ring folds sharply")
        return ["", "[model]", _line(start, "model.energy", "finite", "one along the whole path"), placed]
    if start.thickness is not None:
        return ["", "[model]", _line(start, "model.accuracy", USUAL_ACCURACY), finer]
    return [
        "",
        "# [model]                            # how the ribbon is computed; the defaults are right for most scenes",
        finer,
    ]


def _shell(start: Start) -> list[str]:
    if start.thickness is not None:
        return [
            "",
            "# [shell]                            # shells beside the ribbon; without it, one as thick as the strip",
            _line(start, "shell.width_to_thickness", [20, 50, 100], off=True),
        ]
    return ["", "[shell]", _line(start, "shell.width_to_thickness", [20, 50, 100], "one shell each, gamma kept")]
