"""From what was typed to the numbers of a first scene: one list of what can be said, by options or as answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from compare.scene.begin.materials import MATERIALS
from compare.scene.begin.quantities import base_unit, value_of, values_of
from compare.scene.begin.template import HELD, Start, text_of
from compare.scene.scene import Scene, loads
from ribbonbench.errors import BadInput


@dataclass(frozen=True)
class Ask:
    """Something a first scene needs: `name` of the option and of the field; `kind` of `quantities.UNITS`, or "choice";
    `si`: only with SI units (True), only without (False), always (None); default: as one would type it."""

    name: str
    words: str
    kind: str = "number"
    default: str = ""
    si: bool | None = None
    choices: Mapping[str, str] | None = None

    @property
    def option(self) -> str:
        return f"--{self.name.replace('_', '-')}"


_MATERIALS = {name: f"{known.words}, about {known.young / 1e9:g} GPa" for name, known in MATERIALS.items()}

_CURVED = "natural curvature (0: flat; two numbers with a comma: at start, at end)"

#: What is asked, in this order. Numbers without SI units are those of a strip of length 1.
REQUESTED = (
    Ask("length", "length of the strip", "length", "0.3", True),
    Ask("width", "its width", "length", "0.01", True),
    Ask("material", "material, for typical values", "choice", "steel", True, _MATERIALS),
    Ask("thickness", "its thickness", "length", "", True),
    Ask("length", "length of the strip, in any unit", "number", "1", False),
    Ask("width", "its width, in the same unit", "number", "0.03", False),
    Ask("young", "Young's modulus", "stress", "", True),
    Ask("density", "density", "density", "", True),
    Ask("poisson", "Poisson's ratio", "number", "", True),
    Ask("poisson", "Poisson's ratio", "number", "0.3", False),
    Ask("gamma", "weight against bending stiffness, rho h g l^3 / D", "number", "10", False),
    Ask("natural_curvature", _CURVED, "curvature", "0", True),
    Ask("natural_curvature", _CURVED + ", in 1/length", "number", "0", False),
    Ask("held", "how it is held", "choice", "one", None, HELD),
    Ask("apart", "distance of the two clamps over the length", "number", "0.9"),
)


def asked(si: bool) -> tuple[Ask, ...]:
    """What is asked with SI units, or without."""
    return tuple(ask for ask in REQUESTED if ask.si in (None, si))


def default_of(ask: Ask, said: Mapping[str, str]) -> str:
    """The default as typed; of the material where it knows."""
    if ask.default or ask.name not in ("thickness", "young", "density", "poisson"):
        return ask.default
    return f"{getattr(MATERIALS[said.get('material', 'steel')], ask.name):g}"


def checked(ask: Ask, text: str) -> Any:
    """The value that `text` says: a number, several, or one of the choices; `BadInput` when it is none."""
    if ask.choices is not None:
        if text not in ask.choices:
            raise BadInput(ask.option, text, "is not known", f"choose from {', '.join(ask.choices)}")
        return text
    kind = ask.kind
    if ask.name == "natural_curvature":
        values = values_of(text, kind, ask.option)
        if len(values) > 2:
            raise BadInput(ask.option, text, "has more than two numbers", "give one, or two: at start, at end")
        return values
    value = value_of(text, kind, ask.option)
    if ask.name == "poisson" and not -1.0 < value <= 0.5:
        raise BadInput(ask.option, text, "lies outside -1 < nu <= 0.5", "e.g. 0.3")
    if ask.name == "apart" and not 0.0 < value <= 1.0:
        raise BadInput(ask.option, text, "is no distance that the strip spans", "give a number above 0, 1 at most")
    if ask.name == "gamma" and value < 0.0:
        raise BadInput(ask.option, text, "must not be negative", "0 is weightless")
    if ask.kind in ("length", "stress", "density") or ask.name in ("length", "width"):
        unit = base_unit(ask.kind)
        if not value > 0.0:
            raise BadInput(ask.option, text, "must be greater than zero", f"in {unit}" if unit else "")
    return value


def started(said: Mapping[str, str], si: bool, title: str, weight: bool = True) -> tuple[str, Scene]:
    """The text of the scene that the words of options (or answers) say, and the scene read from it.

    said: by the names of `REQUESTED`, as typed; what is not there is as by default. `BadInput` names the option: also
    for what belongs to the other kind of units.
    """
    offered = asked(si)
    for name in said:
        if name not in {ask.name for ask in offered} | {"thickness"}:
            other = "dimensionless scenes, and there are SI units" if si else "SI scenes"
            remedy = "give --young and --density, or leave out --si" if si else "add --si, or give --gamma"
            raise BadInput(f"--{name.replace('_', '-')}", said[name], f"is for {other}", remedy)
    values = {ask.name: checked(ask, said.get(ask.name, default_of(ask, said))) for ask in offered}
    if not si and "thickness" in said:
        values["thickness"] = checked(Ask("thickness", "", "length"), said["thickness"])
    if not values["width"] < values["length"]:
        raise BadInput(
            "--width",
            values["width"],
            f"is not smaller than --length = {values['length']}",
            "a strip is longer than wide",
        )
    thickness = values.get("thickness")
    if thickness is not None and not thickness < values["width"]:
        raise BadInput(
            "--thickness", thickness, f"is not smaller than --width = {values['width']}", "a strip is wider than thick"
        )
    if "apart" in said and values["held"] != "two":
        raise BadInput("--apart", said["apart"], f"is for two clamps, and --held is {values['held']}", "--held two")
    start = Start(title=title, si=si, weight=weight, given=frozenset(said), **values)
    text = text_of(start)
    return text, loads(text, title)
