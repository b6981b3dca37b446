"""Which models there are: a name, the values of `model.energy` that choose it, and where its class stands.

Nothing of a model is imported here: scenes are read, and help is printed, without a solver. A model of one's own is
named by an installed distribution (or any folder on the Python path with a ``NAME.dist-info``) in its entry points,
so that worker processes find it too (docs/extend.md, "A model")::

    [ribbonbench.models]
    thread = my_module:Thread

The entry point's name is the model's, and the value of ``model.energy`` that chooses it.
"""

from __future__ import annotations

import functools
import importlib
import importlib.metadata
import importlib.util
from dataclasses import dataclass
from pathlib import Path
from typing import Any

GROUP = "ribbonbench.models"


def _ribbon_energies() -> tuple[str, ...]:
    """The names in the ribbon's own registry; its file alone is run, for a scene is read without numba and Ipopt."""
    package = importlib.util.find_spec("ribbon")
    if package is None or package.origin is None:
        return ()
    place = Path(package.origin).parent / "energies" / "names.py"
    spec = importlib.util.spec_from_file_location("names", place)
    if spec is None or spec.loader is None:
        return ()
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return (*found.NAMES, *found.FREE)


#: Energies of the ribbon on curvature elements; "auto": the cheapest that is good enough where the strip's thickness
#: tells, else the one that is exact in the width.
RIBBON_ENERGIES = ("auto", *_ribbon_energies())


@dataclass(frozen=True)
class Entry:
    """A model: its name, the values of `model.energy` that choose it (none: it is asked for by name), and its class as
    ``module:Class``.

    rod: its section may be another one than w x h (`[rod]`, `strip.second_moment`); planar: it bends in the plane of
    the start clamp alone.
    """

    name: str
    energies: tuple[str, ...]
    target: str
    rod: bool = False
    planar: bool = False


BUILT_IN = (
    Entry("ribbon", RIBBON_ENERGIES, "compare.models.ribbon.model:RibbonModel"),
    Entry("elastica", ("elastica",), "compare.models.elastica.model:ElasticaModel", rod=True, planar=True),
    Entry("curve_angle", ("curve_angle",), "compare.models.curve_angle.model:CurveAngleModel", rod=True),
    Entry("antman", ("antman",), "compare.models.antman.model:AntmanModel", rod=True),
    Entry("shell", (), "compare.models.shell:ShellModel"),
    Entry("tape", ("tape", "tape_plain"), "compare.models.tape.model:TapeModel"),
)


#: The model that resolves the thickness, to which the others are compared; the one that stands beside it.
RICHEST, USUAL = "shell", "ribbon"
#: How models and energies are named in a sentence, where the value of `model.energy` alone says too little.
WORDS = {
    "sadowsky": "Sadowsky's strip", "wunderlich": "Wunderlich's strip", "finite": "the strip of finite thickness",
    "kirchhoff": "Kirchhoff's rod", "elastica": "the elastica", RICHEST: "the shell",
}  # fmt: skip


@functools.cache
def entries() -> tuple[Entry, ...]:
    """All models, the built-in ones first; of the others those whose name is not taken."""
    found = {entry.name: entry for entry in BUILT_IN}
    for point in importlib.metadata.entry_points(group=GROUP):
        found.setdefault(point.name, Entry(point.name, (point.name,), point.value))
    return tuple(found.values())


def names() -> tuple[str, ...]:
    """The names of all models."""
    return tuple(entry.name for entry in entries())


def energies() -> tuple[str, ...]:
    """All values of `model.energy`."""
    return tuple(energy for entry in entries() for energy in entry.energies)


def knows_energy(value: str) -> bool:
    """Whether `value` is one of `energies`; the built-in ones are looked at first, which costs nothing."""
    return any(value in entry.energies for entry in BUILT_IN) or value in energies()


def name_for(energy: str) -> str:
    """The model that `model.energy` chooses. Raises KeyError for an energy that no model has."""
    for known in (BUILT_IN, entries()):
        for entry in known:
            if energy in entry.energies:
                return entry.name
    raise KeyError(energy)


def chosen_by(energy: str) -> Entry:
    """The entry of the model that `model.energy` chooses. Raises KeyError for an energy that no model has."""
    return entry(name_for(energy))


def home(name: str) -> str:
    """The module that a model's class stands in: what its numbers depend on begins there (`ribbonbench.sources`).
    Raises KeyError for a name that none has."""
    return entry(name).target.partition(":")[0]


def entry(name: str) -> Entry:
    """The entry of the model of this name; the built-in ones are looked at first. KeyError for a name that none has."""
    for known in (BUILT_IN, entries()):
        for found in known:
            if found.name == name:
                return found
    raise KeyError(name)


@functools.cache
def model(name: str) -> Any:
    """The model of this name (`compare.models.base.Model`), made once. Raises KeyError for a name that none has."""
    module, _, attribute = entry(name).target.partition(":")
    return getattr(importlib.import_module(module), attribute)()


def in_words(name: str) -> str:
    """A model or energy as a sentence names it."""
    return WORDS.get(name, f'"{name}"')
