"""Sweeps as data: a TOML file, strictly read into a scene, axes and the solver that runs at each point."""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from compare.models import name_for, names
from compare.scene.scene import Scene, load
from compare.scene.scene import shipped as shipped_scenes
from compare.studies.axes import Axis, checked, checked_spaced
from ribbonbench.errors import BadInput

COMPARE = "compare"
"""The solver that is no model, but the comparison of the scene's model with its shells."""


def solvers() -> tuple[str, ...]:
    """What a sweep may run at its points: every model, and the comparison."""
    return (*names(), COMPARE)


MAX_BYTES = 5_000_000
"""Size above which a file is not taken for a sweep."""

_KEYS = ("title", "scene", "solver", "set", "axis", "curve", "show", "against", "errors", "leave_saddle")
_AXIS_KEYS = ("key", "keys", "values", "spacing", "first", "last", "count")
_CURVE_KEYS = ("label", "factor", "power")
_EXAMPLE = 'e.g. [[axis]] key = "strip.gamma", spacing = "log", first = 1.0, last = 1e4, count = 9'


@dataclass(frozen=True)
class Curve:
    """A line beside the points of the picture: factor x^power."""

    label: str
    factor: float
    power: float


@dataclass(frozen=True)
class Sweep:
    """A grid of scenes and what is done with it.

    name: of the folder of results; scene: with the assignments of [set]; axes: the last one fastest; show: the quantity
    (a column of cases.csv) in the picture, against: another one on its horizontal axis, "" for the axes themselves;
    solver: a model, or `COMPARE` ("": the model that the scene chooses); errors: whether each discretisation error is
    measured too; shapes: points of every centreline that are kept (`compare.sweep.shapes`), 0: none; neighbours: cases
    of a table in parts are begun at each other's states (`compare.sweep.large.lines`).
    """

    name: str
    title: str
    scene: Scene
    axes: tuple[Axis, ...]
    solver: str = ""
    show: str = ""
    against: str = ""
    errors: bool = False
    leave_saddle: bool | None = None
    curves: tuple[Curve, ...] = ()
    shapes: int = 0
    neighbours: bool = False

    @property
    def keys(self) -> tuple[str, ...]:
        """The varied keys, in the order of the axes."""
        return tuple(key for axis in self.axes for key in axis.keys)

    @property
    def options(self) -> dict[str, Any]:
        """What is asked of each case beside its scene and solver, as far as it is in what is kept."""
        own: dict[str, Any] = {"errors": self.errors, "leave_saddle": self.leave_saddle}
        own |= {"shapes": self.shapes} if self.shapes else {}
        return {**own, "neighbours": True} if self.neighbours else own


def shipped() -> dict[str, Path]:
    """The sweeps that come with the package: name -> file, sorted by name."""
    return {path.stem: path for path in sorted((Path(__file__).parent.parent / "sweeps").glob("*.toml"))}


def load_sweep(name: str, assignments: Mapping[str, Any], varied: Sequence[Axis]) -> Sweep:
    """A shipped sweep, a sweep's file, or a scene (by name or file) with the axes of --vary.

    assignments replace keys of the scene, after the file's own [set]. An axis of `varied` replaces the file's axis over
    the same keys, or is one more. Every fault is a `BadInput`.
    """
    path = shipped().get(name)
    if path is None and name in shipped_scenes():
        return of_scene(load(name), assignments, varied)
    if path is None:
        path = Path(name)
        if not path.exists():
            raise _no_such(name)
    document = _document(path)
    if "strip" in document:
        return of_scene(load(path), assignments, varied)
    found = _of_document(document, path)
    axes = list(found.axes)
    for axis in varied:
        same = [k for k, own in enumerate(axes) if own.keys == axis.keys]
        if same:
            axes[same[0]] = axis
        else:
            axes.append(axis)
    scene = found.scene.replace(dict(assignments)) if assignments else found.scene
    return _with_axes(replace(found, scene=scene), axes, name)


def of_scene(scene: Scene, assignments: Mapping[str, Any], varied: Sequence[Axis]) -> Sweep:
    """A scene with the axes of --vary; assignments replace keys of the scene."""
    if assignments:
        scene = scene.replace(dict(assignments))
    return _with_axes(Sweep(scene.name, scene.title, scene, ()), varied, scene.name)


def _with_axes(sweep: Sweep, axes: Sequence[Axis], given: str) -> Sweep:
    if not axes:
        raise BadInput(
            "SWEEP", given, "varies nothing", "add --vary 'strip.gamma=log(1,1e4,9)', or name a sweep's file"
        )
    own = sweep.solver or name_for(sweep.scene.model.energy)
    return replace(sweep, axes=tuple(axes), solver=own)


def _no_such(name: str) -> BadInput:
    names = [*shipped(), *shipped_scenes()]
    close = difflib.get_close_matches(Path(name).stem, names, n=1, cutoff=0.5)
    hint = f"did you mean {close[0]}? " if close else ""
    return BadInput(
        "SWEEP", name, "does not exist", f"{hint}give the path of a sweep or a scene, a shipped sweep "
        f"({', '.join(shipped())}) or a shipped scene (ribbonbench scenes)",
    )  # fmt: skip


def _document(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
        if len(raw) > MAX_BYTES:
            raise BadInput("SWEEP", str(path), f"is larger than {MAX_BYTES} bytes", "give a sweep's file")
        return tomllib.loads(raw.decode("utf-8-sig"))
    except IsADirectoryError:
        raise BadInput("SWEEP", str(path), "is a folder", "give a sweep's file (.toml)") from None
    except OSError as error:
        raise BadInput("SWEEP", str(path), f"cannot be read ({error.strerror})", "check its permissions") from None
    except UnicodeDecodeError:
        raise BadInput("SWEEP", str(path), "is not a text file (UTF-8)", "give a sweep in TOML") from None
    except (ValueError, RecursionError) as error:
        raise BadInput("SWEEP", str(path), f"is not valid TOML: {error}", "mend that line") from None


def _of_document(document: Mapping[str, Any], path: Path) -> Sweep:
    _known(document, _KEYS, "")
    title = _text(document, "title", path.stem)
    if "scene" not in document:
        raise BadInput("scene", None, "is missing", 'add e.g. scene = "cantilever": a shipped scene, or a path')
    named = _text(document, "scene", "")
    beside = path.parent / named
    scene = load(named if named in shipped_scenes() or not beside.exists() else beside)
    assigned = document.get("set", {})
    if not isinstance(assigned, dict):
        raise BadInput("set", assigned, "is not a table", 'write [set], then e.g. "strip.poisson" = 0.5')
    keys = _flat(assigned)
    solver = _text(document, "solver", "")
    if solver:
        known_solver(solver, "solver")
    return Sweep(
        name=path.stem,
        title=title,
        scene=scene.replace(keys) if keys else scene,
        axes=tuple(_axis(entry, f"axis.{k}") for k, entry in enumerate(_tables(document, "axis"))),
        solver=solver,
        show=_text(document, "show", ""),
        against=_text(document, "against", ""),
        errors=_flag(document, "errors"),
        leave_saddle=_flag(document, "leave_saddle") if "leave_saddle" in document else None,
        curves=tuple(_curve(entry, f"curve.{k}") for k, entry in enumerate(_tables(document, "curve"))),
    )


def _flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Dotted keys of nested tables: strip.poisson = 0.5 and "strip.poisson" = 0.5 are one."""
    found: dict[str, Any] = {}
    for name, value in table.items():
        key = f"{prefix}{name}"
        found.update(_flat(value, f"{key}.") if isinstance(value, dict) else {key: value})
    return found


def known_solver(name: str, key: str) -> None:
    """`BadInput` for a solver that is none of `solvers`; key: where it was given."""
    if name not in solvers():
        raise BadInput(key, name, "is not known", f"choose from {', '.join(solvers())}")


def _known(table: Mapping[str, Any], keys: Sequence[str], where: str) -> None:
    for name, value in table.items():
        if name not in keys:
            close = difflib.get_close_matches(name, keys, n=1)
            hint = f"did you mean {close[0]}? " if close else ""
            shown = None if isinstance(value, dict | list) else value
            raise BadInput(f"{where}{name}", shown, "is not a known key", f"{hint}known here: {', '.join(keys)}")


def _text(table: Mapping[str, Any], key: str, default: str, where: str = "") -> str:
    value = table.get(key, default)
    if not isinstance(value, str) or (key in table and not value.strip()):
        raise BadInput(f"{where}{key}", value, "is not a text", "put it in quotes")
    return value


def _flag(table: Mapping[str, Any], key: str) -> bool:
    value = table.get(key, False)
    if not isinstance(value, bool):
        raise BadInput(key, value, "is neither true nor false", f"e.g. {key} = true")
    return value


def _number(table: Mapping[str, Any], key: str, where: str, default: float | None = None) -> float:
    value = table.get(key, default)
    if value is None:
        raise BadInput(f"{where}{key}", None, "is missing", _EXAMPLE if where.startswith("axis") else "give a number")
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise BadInput(f"{where}{key}", value, "is not a finite number", "give a number")
    return float(value)


def _tables(document: Mapping[str, Any], key: str) -> list[dict[str, Any]]:
    value = document.get(key, [])
    if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
        raise BadInput(key, None, "is not a list of tables", f"write [[{key}]]")
    return value


def _axis(table: Mapping[str, Any], name: str) -> Axis:
    where = f"{name}."
    _known(table, _AXIS_KEYS, where)
    if ("key" in table) == ("keys" in table):
        raise BadInput(name, None, "needs key or keys, one of them", _EXAMPLE)
    single = "key" in table
    keys = (table["key"],) if single else table["keys"]
    if not isinstance(keys, list | tuple) or not keys or not all(isinstance(k, str) and k.strip() for k in keys):
        raise BadInput(
            f"{where}{'key' if single else 'keys'}", keys[0] if single else keys, "names no key of a scene",
            'e.g. key = "strip.gamma"',
        )  # fmt: skip
    if "values" in table:
        spacing = [key for key in ("spacing", "first", "last", "count") if key in table]
        if spacing:
            raise BadInput(f"{where}{spacing[0]}", table[spacing[0]], "stands beside values", "give one or the other")
        return checked(Axis(tuple(keys), _values(table["values"], keys, single, where)), name)
    if not single:
        raise BadInput(f"{where}values", None, "is missing", "several keys take values = [[..., ...], ...]")
    return checked(Axis.of(keys[0], _spaced(table, where)), name)


def _values(values: Any, keys: Sequence[str], single: bool, where: str) -> tuple[tuple[Any, ...], ...]:
    if not isinstance(values, list):
        raise BadInput(f"{where}values", values, "is not a list", "e.g. values = [10.0, 100.0]")
    if single:
        return tuple((value,) for value in values)
    for value in values:
        if not isinstance(value, list) or len(value) != len(keys):
            raise BadInput(
                f"{where}values", value, f"is not a list of {len(keys)} values", f"one for each of {', '.join(keys)}"
            )
    return tuple(tuple(value) for value in values)


def _spaced(table: Mapping[str, Any], where: str) -> list[Any]:
    kind = _text(table, "spacing", "linear", where)
    if kind not in ("linear", "log"):
        raise BadInput(f"{where}spacing", kind, "is not known", 'choose "linear" or "log"')
    for name in ("first", "last", "count"):
        if name not in table:
            raise BadInput(f"{where}{name}", None, "is missing", _EXAMPLE)
    ends = table["first"], table["last"], table["count"]
    return checked_spaced(kind, *ends, given=lambda name: (f"{where}{name}", table.get(name)))


def _curve(table: Mapping[str, Any], name: str) -> Curve:
    where = f"{name}."
    _known(table, _CURVE_KEYS, where)
    return Curve(
        _text(table, "label", name, where), _number(table, "factor", where), _number(table, "power", where, 1.0)
    )
