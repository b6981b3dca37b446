"""From a parsed TOML document to the sections of a scene, each checked on its own and against the others.

Every fault is a `BadInput` naming the dotted key; nothing is guessed and nothing is silently left out.
"""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from itertools import pairwise
from typing import Any

from compare import registry
from compare.scene import keys as contract
from compare.scene.data import Sections
from compare.scene.held import read_clamp, read_closure, read_obstacles, read_walls
from compare.scene.inputs import law
from compare.scene.loads import read_gravity, read_tip
from compare.scene.spec import (
    FIRST_OVER_WIDTH,
    SAY_ELEMENTS,
    THIN,
    USUAL_ACCURACY,
    ContactSpec,
    ModelSpec,
    RodSpec,
    SceneSpec,
    SeedSpec,
    ShellSpec,
    StripSpec,
    UncertaintySpec,
)
from compare.scene.stages import read_path
from compare.scene.table import Table, missing, reject_unknown
from ribbonbench.errors import BadInput

AT_REST = ("natural_curvature", "natural_twist", "natural_geodesic_curvature")
"""Keys of [strip] that say its shape at rest as a law along it."""

SUM_TOLERANCE = 1e-9
"""How far, relatively, the sum of the element lengths may be from the strip's length."""

NEAREST = 1e-4
"""Least distance, over the length, that parts of a strip are kept from each other."""

SPECIFIED_TWICE = "strip.gamma and strip.young, strip.density say the same thing twice"


def read_sections(data: Mapping[str, Any]) -> Sections:
    """The checked sections of a parsed scene document."""
    reject_unknown(data, "", contract.KEYS)
    title = Table(data, "", contract.KEYS).read(SceneSpec).title
    if title != one_line(title):
        raise BadInput("title", title, "is not one line of text", "leave out line breaks and control characters")
    strip = _strip(_section(data, "strip"))
    gravity = read_gravity(_section(data, "gravity"), strip) if "gravity" in data else None
    tip = read_tip(_section(data, "tip"), strip, gravity) if "tip" in data else None
    clamp = _section(data, "clamp")
    if "clamp" in data and not clamp.data:
        raise BadInput("clamp", None, "holds no end", "add [clamp.start] or [clamp.end], or remove [clamp]")
    start, end = (
        read_clamp(_section(clamp.data, name, "clamp")) if name in clamp else None for name in ("start", "end")
    )
    closure = read_closure(_section(data, "closure")) if "closure" in data else None
    walls = read_walls(data.get("wall", []))
    obstacles = read_obstacles(data.get("obstacle", []), walls)
    model = _model(_section(data, "model"), strip)
    seed = _seed(_section(data, "seed"), strip)
    shell = _shell(_section(data, contract.SHELL), strip)
    path = read_path(data.get("path", []), {"wall": walls, "obstacle": obstacles})
    unsure = _uncertainty(_section(data, "uncertainty"), strip)
    rod = _rod(_section(data, "rod"), strip) if "rod" in data else None
    contact = _contact(_section(data, "contact"), strip) if "contact" in data else None
    return Sections(
        title, strip, gravity, tip, start, end, closure, walls, obstacles, model, seed, path, shell, unsure, rod,
        contact,
    )  # fmt: skip


def one_line(text: str) -> str:
    """`text` with every line break, control character, lone surrogate and mark that turns a line round replaced by a
    question mark."""
    return "".join("?" if _moves(letter) else letter for letter in text)


def _moves(letter: str) -> bool:
    turns = unicodedata.bidirectional(letter) in {"LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI"}
    return turns or unicodedata.category(letter) in {"Cc", "Cs", "Zl", "Zp"}


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
    strip = table.read(StripSpec)
    rest: dict[str, Any] = {name: _covering(table, name, getattr(strip, name), strip.length) for name in AT_REST}
    strip = replace(strip, **rest)
    if strip.width >= strip.length:
        raise table.bad(
            "width",
            f"is not smaller than strip.length = {strip.length}",
            f"give a width below {strip.length}: a ribbon is longer than wide",
        )
    if strip.thickness is not None and strip.thickness >= strip.width:
        raise table.bad(
            "thickness",
            f"is not smaller than strip.width = {strip.width}",
            f"give a thickness below {strip.width}: a ribbon is wider than thick",
        )
    for name in AT_REST:
        _check_times_length(table, name, law.values(getattr(strip, name)), strip)
    _check_annulus(table, strip)
    _check_times_length(table, "transverse_curvature", (strip.transverse_curvature,), strip)
    elastic = {"young": strip.young, "density": strip.density, "thickness": strip.thickness}
    dimensional = strip.young is not None or strip.density is not None
    if strip.gamma is not None and dimensional:
        raise table.bad(
            "gamma", f"conflicts: {SPECIFIED_TWICE}", "remove strip.gamma, or remove strip.young and strip.density"
        )
    if strip.second_moment is not None:
        _check_second_moment(table, strip)
    elif dimensional:
        for name, value in elastic.items():
            if value is None:
                raise missing(
                    f"strip.{name}", contract.KEYS, "give young, density and thickness together, in Pa, kg/m^3 and m"
                )
    return strip


def _covering(table: Table, name: str, value: law.Law, length: float) -> law.Law:
    """A law whose table covers the strip."""
    if not law.is_table(value):
        return value
    fault = law.fault(value, length)  # type: ignore[arg-type]
    if fault is not None:
        raise table.bad(name, *fault)
    return law.read(value, length)  # type: ignore[arg-type]


def _check_annulus(table: Table, strip: StripSpec) -> None:
    """The inner edge of an annular strip has a length."""
    bent = max(map(abs, law.values(strip.natural_geodesic_curvature)))
    if bent * strip.width >= 2.0:
        raise table.bad(
            "natural_geodesic_curvature", f"bends a strip of width {strip.width} about a point inside it",
            f"keep it below 2 / width = {2.0 / strip.width:.6g}",
        )  # fmt: skip


def _check_times_length(table: Table, name: str, values: Iterable[float], strip: StripSpec) -> None:
    """Curvatures times the length, which the solvers take, are numbers."""
    if not all(math.isfinite(value * strip.length) for value in values):
        raise table.bad(name, f"times strip.length = {strip.length} is not finite")


def _check_second_moment(table: Table, strip: StripSpec) -> None:
    """I of a rod's section has Young's modulus beside it and nothing that says its stiffness otherwise."""
    for name, value, why in (
        ("gamma", strip.gamma, "gamma is the weight of a strip w x h"),
        ("thickness", strip.thickness, "both say how stiff the strip is"),
        ("density", strip.density, "the area of the section is not known, a rod weighs nothing here"),
    ):
        if value is not None:
            raise table.bad(
                "second_moment", f"conflicts with strip.{name}: {why}", f"remove strip.{name} or strip.second_moment"
            )
    if strip.young is None:
        raise missing("strip.young", contract.KEYS, "strip.second_moment needs strip.young, in Pa, for Y I")


def _model(table: Table, strip: StripSpec) -> ModelSpec:
    model = table.read(ModelSpec)
    if model.arc_length != "auto" and not registry.chosen_by(model.energy).planar:
        raise table.bad(
            "arc_length", "is for the planar elastica only", 'choose model.energy = "elastica", or remove it'
        )
    for chosen, others, why in (
        ("tolerance", ("elements", "grading", "element_lengths"), ", which places the elements"),
        ("element_lengths", ("elements", "grading"), ""),
    ):
        for other in others:
            if chosen in table and other in table:
                raise table.bad(other, f"conflicts with model.{chosen}{why}", "remove one of the two")
    if "tolerance" not in table and (not model.can_place or any(name in table for name in SAY_ELEMENTS)):
        model = replace(model, tolerance=None)
    if "accuracy" not in table and _leaves_its_energy_open(model, strip):
        model = replace(model, accuracy=USUAL_ACCURACY)
    if model.element_lengths is None:
        if model.grading == "clamp":
            return replace(model, smallest=FIRST_OVER_WIDTH * strip.width / (strip.length * model.elements))
        return model
    total = math.fsum(model.element_lengths)
    if not abs(total - strip.length) <= SUM_TOLERANCE * strip.length:
        raise table.bad(
            "element_lengths",
            f"sums to {total!r}, not to strip.length = {strip.length!r}",
            "change the last entry or use model.elements",
        )
    return replace(model, elements=len(model.element_lengths))


def _leaves_its_energy_open(model: ModelSpec, strip: StripSpec) -> bool:
    """Whether an energy can be chosen for a scene that names none: its thickness is known, it is flat at rest and bent
    as a thin plate, and no key asks for what one energy alone has."""
    if model.energy != "auto" or strip.thickness is None or strip.second_moment is not None:
        return False
    if model.formulation == "matrix" or model.stiffness is not None or model.in_plane is not None:
        return False
    if any(law.values(strip.natural_twist)) or any(law.values(strip.natural_geodesic_curvature)):
        return False
    return max(map(abs, law.values(strip.natural_curvature))) * strip.thickness <= THIN


def _seed(table: Table, strip: StripSpec) -> SeedSpec:
    seed = table.read(SeedSpec)
    if seed.curve is not None:
        for name in ("curvature", "ruling"):
            if name in table:
                raise table.bad(name, "and seed.curve both say where the strip begins", "remove one of the two")
    _check_times_length(table, "curvature", seed.curvature or (), strip)
    pieces = len(seed.ruling) - 1
    bound = 2.0 * strip.length / (strip.width * pieces)
    if not all(abs(after - before) < bound for before, after in pairwise(seed.ruling)):
        pair = "|end - start|" if pieces == 1 else "the difference of neighbouring entries"
        raise table.bad(
            "ruling",
            "makes the rulings cross inside the strip: |eta'| reaches 2/w",
            f"keep {pair} below 2 length/width{'' if pieces == 1 else f' / {pieces}'} = {bound:.6g}",
        )
    return seed


def _rod(table: Table, strip: StripSpec) -> RodSpec:
    """[rod], which may say the shape at rest as [strip] does, but not beside it."""
    rod = table.read(RodSpec)
    for own, name in (("natural_twist", "natural_twist"), ("natural_in_plane", "natural_geodesic_curvature")):
        if own in table and any(law.values(getattr(strip, name))):
            raise table.bad(own, f"and strip.{name} say the same thing twice", "remove one of the two")
    return rod


def _contact(table: Table, strip: StripSpec) -> ContactSpec:
    """[contact], whose distance is the thickness where it says none."""
    contact = table.read(ContactSpec)
    if contact.distance is not None and not contact.distance < 0.5 * strip.length:
        raise table.bad(
            "distance", f"is not below half of strip.length = {strip.length}", f"give less than {0.5 * strip.length:g}"
        )
    if contact.itself and contact.distance is None and strip.thickness is None:
        raise missing("contact.distance", contract.KEYS, "give it, or strip.thickness")
    if contact.joints == "follow" and not (contact.itself and contact.section == "round"):
        raise table.bad(
            "joints", "is for a round rod that touches itself",
            'add itself = true and section = "round", or leave joints out',
        )  # fmt: skip
    least = NEAREST * strip.length
    if contact.itself and contact.distance is None and strip.thickness is not None and strip.thickness < least:
        problem = f"is strip.thickness = {strip.thickness}, nearer than parts of a strip can be kept apart"
        raise BadInput("contact.distance", None, problem, f"give at least {least:g}")
    return contact


def _uncertainty(table: Table, strip: StripSpec) -> UncertaintySpec:
    unsure = table.read(UncertaintySpec)
    for field in fields(unsure):
        if getattr(unsure, field.name) is not None and getattr(strip, field.name) is None:
            raise table.bad(
                field.name, f"is about strip.{field.name}, which the scene does not give",
                f"give strip.{field.name}, or remove it",
            )  # fmt: skip
    return unsure


def _shell(table: Table, strip: StripSpec) -> ShellSpec:
    shell = table.read(ShellSpec)
    if shell.start_curvature is not None:
        _check_times_length(table, "start_curvature", (shell.start_curvature,), strip)
    if shell.corner is not None:
        if shell.clamp != "corners":
            raise table.bad(
                "corner",
                f'has no meaning for shell.clamp = "{shell.clamp}"',
                'choose shell.clamp = "corners", or remove it',
            )
        _check_half(table, "corner", shell.corner, strip, "large: two corner cells", "size")
    if shell.edge_layer is not None and shell.grading is not None:
        raise table.bad("edge_layer", "conflicts with shell.grading", "remove one of the two")
    if isinstance(shell.edge_layer, float):
        _check_half(table, "edge_layer", shell.edge_layer, strip, "wide: the layers of both edges", "width")
    return shell


def _check_half(table: Table, name: str, value: float, strip: StripSpec, what: str, size: str) -> None:
    """Two of the size leave a part of the width."""
    if not 2.0 * value < strip.width:
        raise table.bad(
            name, f"is too {what} fill the width {strip.width}", f"give a {size} below {0.5 * strip.width:.6g}"
        )
