"""From a parsed TOML document to the sections of a scene, each checked on its own and against the others.

Every fault is a `BadInput` naming the dotted key; nothing is guessed and nothing is silently left out.
"""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from compare.errors import BadInput
from compare.scene import keys as contract
from compare.scene.held import read_clamp, read_closure, read_walls
from compare.scene.loads import read_gravity, read_tip
from compare.scene.spec import (
    DEFAULT_ELEMENTS,
    FIRST_OVER_WIDTH,
    ClampSpec,
    ClosureSpec,
    GravitySpec,
    ModelSpec,
    SeedSpec,
    ShellSpec,
    StageSpec,
    StripSpec,
    TipSpec,
    WallSpec,
)
from compare.scene.stages import read_path
from compare.scene.table import Table, missing, reject_unknown

SUM_TOLERANCE = 1e-9
"""How far, relatively, the sum of the element lengths may be from the strip's length."""

SPECIFIED_TWICE = "strip.gamma and strip.young, strip.density say the same thing twice"


@dataclass(frozen=True)
class Sections:
    """What a scene file says, section by section; None: the section is absent and so is its effect."""

    title: str
    strip: StripSpec
    gravity: GravitySpec | None
    tip: TipSpec | None
    clamp_start: ClampSpec | None
    clamp_end: ClampSpec | None
    closure: ClosureSpec | None
    walls: tuple[WallSpec, ...]
    model: ModelSpec
    seed: SeedSpec
    path: tuple[StageSpec, ...]
    shell: ShellSpec


def read_sections(data: Mapping[str, Any]) -> Sections:
    """The checked sections of a parsed scene document."""
    reject_unknown(data, "", contract.KEYS)
    title = Table(data, "", contract.KEYS).text("title") if "title" in data else ""
    if title != one_line(title):
        raise BadInput("title", title, "is not one line of text", "leave out line breaks and control characters")
    strip = _strip(_section(data, "strip"))
    gravity = read_gravity(_section(data, "gravity"), strip) if "gravity" in data else None
    tip = read_tip(_section(data, "tip"), strip, gravity) if "tip" in data else None
    clamp = _section(data, "clamp")
    if "clamp" in data and not clamp.data:
        raise BadInput("clamp", None, "holds no end", "add [clamp.start] or [clamp.end], or remove [clamp]")
    start, end = (
        read_clamp(_section(clamp.data, name, "clamp"), name == "start") if name in clamp else None
        for name in ("start", "end")
    )
    closure = read_closure(_section(data, "closure")) if "closure" in data else None
    walls = read_walls(data.get("wall", []))
    model = _model(_section(data, "model"), strip)
    seed = _seed(_section(data, "seed"), strip)
    shell = _shell(_section(data, "shell"), strip)
    path = read_path(data.get("path", []), walls)
    return Sections(title, strip, gravity, tip, start, end, closure, walls, model, seed, path, shell)


def one_line(text: str) -> str:
    """`text` with every line break, control character and lone surrogate replaced by a question mark."""
    return "".join("?" if unicodedata.category(letter) in {"Cc", "Cs", "Zl", "Zp"} else letter for letter in text)


def _section(data: Mapping[str, Any], name: str, parent: str = "") -> Table:
    """The table `name` of `data`, its keys known; empty when absent."""
    path = f"{parent}.{name}" if parent else name
    section = data.get(name, {})
    if not isinstance(section, dict):
        shown = None if isinstance(section, list) and any(isinstance(item, dict) for item in section) else section
        raise BadInput(path, shown, "is not a single table", f"write it as a section [{path}]")
    reject_unknown(section, path, contract.KEYS)
    return Table(section, path, contract.KEYS)


def _strip(table: Table) -> StripSpec:
    length = table.positive("length")
    width = table.positive("width")
    if width >= length:
        raise table.bad(
            "width",
            f"is not smaller than strip.length = {length}",
            f"give a width below {length}: a ribbon is longer than wide",
        )
    poisson = table.number("poisson")
    if not -1.0 < poisson <= 0.5:
        raise table.bad("poisson", "lies outside -1 < nu <= 0.5")
    thickness = table.positive("thickness") if "thickness" in table else None
    if thickness is not None and thickness >= width:
        raise table.bad(
            "thickness",
            f"is not smaller than strip.width = {width}",
            f"give a thickness below {width}: a ribbon is wider than thick",
        )
    curvature = table.linear("natural_curvature") if "natural_curvature" in table else (0.0, 0.0)
    if not all(math.isfinite(value * length) for value in curvature):
        raise table.bad("natural_curvature", f"times strip.length = {length} is not finite")
    gamma = table.number("gamma") if "gamma" in table else None
    young = table.positive("young") if "young" in table else None
    density = table.positive("density") if "density" in table else None
    if gamma is not None and gamma < 0.0:
        raise table.bad(
            "gamma", "must not be negative", "give the weight parameter as a number >= 0 and turn gravity.up instead"
        )
    if gamma is not None and (young is not None or density is not None):
        raise table.bad(
            "gamma", f"conflicts: {SPECIFIED_TWICE}", "remove strip.gamma, or remove strip.young and strip.density"
        )
    moment = _second_moment(table, gamma, young, density, thickness)
    if moment is None and (young is not None or density is not None):
        for name, value in (("young", young), ("density", density), ("thickness", thickness)):
            if value is None:
                raise missing(
                    f"strip.{name}", contract.KEYS, "give young, density and thickness together, in Pa, kg/m^3 and m"
                )
    return StripSpec(length, width, poisson, thickness, curvature, gamma, young, density, moment)


def _second_moment(
    table: Table, gamma: float | None, young: float | None, density: float | None, thickness: float | None
) -> float | None:
    """I of a rod's section, with Young's modulus beside it and nothing that says its stiffness otherwise."""
    if "second_moment" not in table:
        return None
    moment = table.positive("second_moment")
    for name, value, why in (
        ("gamma", gamma, "gamma is the weight of a strip w x h"),
        ("thickness", thickness, "both say how stiff the strip is"),
        ("density", density, "the area of the section is not known, a rod weighs nothing here"),
    ):
        if value is not None:
            raise table.bad(
                "second_moment", f"conflicts with strip.{name}: {why}", f"remove strip.{name} or strip.second_moment"
            )
    if young is None:
        raise missing("strip.young", contract.KEYS, "strip.second_moment needs strip.young, in Pa, for Y I")
    return moment


def _model(table: Table, strip: StripSpec) -> ModelSpec:
    energy = table.choice("energy", contract.ENERGIES, contract.LATER_ENERGIES) if "energy" in table else "auto"
    formulation = table.choice("formulation", contract.FORMULATIONS) if "formulation" in table else "auto"
    held_by = table.choice("held_by", contract.HELD_BY) if "held_by" in table else "elimination"
    arc_length = table.choice("arc_length", contract.ARC_LENGTHS) if "arc_length" in table else "auto"
    if arc_length != "auto" and energy != "elastica":
        raise table.bad(
            "arc_length", "is for the planar elastica only", 'choose model.energy = "elastica", or remove it'
        )
    how: dict[str, Any] = {"formulation": formulation, "held_by": held_by, "arc_length": arc_length}
    if "tolerance" in table:
        tolerance = table.number("tolerance")
        if not 0.0 < tolerance < 0.1:
            raise table.bad("tolerance", "lies outside 0 < tolerance < 0.1")
        for other in ("elements", "grading", "element_lengths"):
            if other in table:
                raise table.bad(
                    other, "conflicts with model.tolerance, which places the elements", "remove one of the two"
                )
        return ModelSpec(energy, tolerance=tolerance, **how)
    if "element_lengths" not in table:
        elements = table.count("elements") if "elements" in table else DEFAULT_ELEMENTS
        grading = table.choice("grading", contract.GRADINGS) if "grading" in table else "uniform"
        smallest = FIRST_OVER_WIDTH * strip.width / (strip.length * elements) if grading == "clamp" else None
        return ModelSpec(energy, elements, None, grading=grading, smallest=smallest, **how)
    for other in ("elements", "grading"):
        if other in table:
            raise table.bad(other, "conflicts with model.element_lengths", "remove one of the two")
    if not isinstance(table.require("element_lengths"), list):
        raise table.bad("element_lengths", "is not a list")
    lengths = table.numbers("element_lengths")
    if (len(lengths) > 1 and min(lengths) <= 0.0) or lengths[0] <= 0.0:
        raise table.bad("element_lengths", "has an entry that is not greater than zero")
    total = math.fsum(lengths)
    if not abs(total - strip.length) <= SUM_TOLERANCE * strip.length:
        raise table.bad(
            "element_lengths",
            f"sums to {total!r}, not to strip.length = {strip.length!r}",
            "change the last entry or use model.elements",
        )
    return ModelSpec(energy, len(lengths), lengths, **how)


def _seed(table: Table, strip: StripSpec) -> SeedSpec:
    curvature: tuple[float, ...] | None = None
    if "curvature" in table and table.data["curvature"] != "natural":
        if isinstance(table.data["curvature"], str):
            raise table.bad("curvature", 'is not "natural"', 'give "natural", a number or [start, end] in 1/length')
        curvature = _piecewise(table, "curvature")
        if not all(math.isfinite(value * strip.length) for value in curvature):
            raise table.bad("curvature", f"times strip.length = {strip.length} is not finite")
    ruling = _piecewise(table, "ruling") if "ruling" in table else (0.0, 0.0)
    bound = 2.0 * strip.length / (strip.width * (len(ruling) - 1))
    if not all(abs(after - before) < bound for before, after in pairwise(ruling)):
        pair = "|end - start|" if len(ruling) == 2 else "the difference of neighbouring entries"
        pieces = "" if len(ruling) == 2 else f" / {len(ruling) - 1}"
        raise table.bad(
            "ruling",
            "makes the rulings cross inside the strip: |eta'| reaches 2/w",
            f"keep {pair} below 2 length/width{pieces} = {bound:.6g}",
        )
    return SeedSpec(curvature, ruling)


def _piecewise(table: Table, name: str) -> tuple[float, ...]:
    """A law piecewise linear in s by its values at equal distances, two or more: a single number becomes two."""
    values = table.numbers(name)
    return values if len(values) > 1 else values * 2


def _shell(table: Table, strip: StripSpec) -> ShellSpec:
    ratios: tuple[float, ...] = ()
    if "width_to_thickness" in table:
        ratios = table.numbers("width_to_thickness")
        if not all(ratio > 1.0 for ratio in ratios):
            raise table.bad("width_to_thickness", "has an entry that is not greater than 1")
    clamp = table.choice("clamp", contract.SHELL_CLAMPS) if "clamp" in table else "edge"
    elements: tuple[int, int] | None = None
    if "elements" in table:
        given = table.require("elements")
        if not isinstance(given, list) or len(given) != 2:
            raise table.bad("elements", "is not a list of two whole numbers")
        elements = (_entry(table, given[0]), _entry(table, given[1]))
    tolerance = table.number("tolerance") if "tolerance" in table else None
    if tolerance is not None and not 0.0 < tolerance < 0.1:
        raise table.bad("tolerance", "lies outside 0 < tolerance < 0.1")
    curvature = table.number("start_curvature") if "start_curvature" in table else None
    if curvature is not None and not math.isfinite(curvature * strip.length):
        raise table.bad("start_curvature", f"times strip.length = {strip.length} is not finite")
    return ShellSpec(
        ratios, clamp, elements, _corner(table, clamp, strip), tolerance, *_layers(table, strip), curvature
    )


def _corner(table: Table, clamp: str, strip: StripSpec) -> float | None:
    """The size of the held corner cells; two of them leave a part of the edge free."""
    if "corner" not in table:
        return None
    if clamp != "corners":
        raise table.bad(
            "corner", f'has no meaning for shell.clamp = "{clamp}"', 'choose shell.clamp = "corners", or remove it'
        )
    corner = table.positive("corner")
    if not 2.0 * corner < strip.width:
        raise table.bad(
            "corner",
            f"is too large: two corner cells fill the width {strip.width}",
            f"give a size below {0.5 * strip.width:.6g}",
        )
    return corner


def _layers(table: Table, strip: StripSpec) -> tuple[tuple[float, float] | None, float | str | None]:
    """How the mesh is graded: `grading` and `edge_layer`, at most one of them."""
    if "grading" in table:
        if "edge_layer" in table:
            raise table.bad("edge_layer", "conflicts with shell.grading", "remove one of the two")
        if not isinstance(table.require("grading"), list) or len(table.data["grading"]) != 2:
            raise table.bad("grading", "is not a list of two numbers")
        along, across = table.numbers("grading")
        if not (0.0 < along <= 1.0 and 0.0 < across <= 1.0):
            raise table.bad("grading", "has an entry outside 0 < grading <= 1")
        return (along, across), None
    if "edge_layer" not in table:
        return None, None
    if isinstance(table.data["edge_layer"], str):
        if table.data["edge_layer"] != "auto":
            raise table.bad("edge_layer", 'is not "auto"')
        return None, "auto"
    layer = table.positive("edge_layer")
    if not layer < 0.5 * strip.width:
        raise table.bad(
            "edge_layer",
            f"is too wide: the layers of both edges fill the width {strip.width}",
            f"give a width below {0.5 * strip.width:.6g}",
        )
    return None, layer


def _entry(table: Table, value: Any) -> int:
    if value is None:  # cannot come from TOML, but can from `Scene.replace`
        raise table.bad("elements", "is not a list of two whole numbers")
    return table.count("elements", value)
