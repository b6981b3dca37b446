"""Supports along a way as columns, and the picture of force against displacement; of a path and of a sweep."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from compare.measure.load_curve import POSITION, TURN, LoadCurve, LoadPoint
from compare.page.page import Picture
from compare.page.state import FORCE, MOMENT, NUMBER
from compare.page.table import Column
from compare.record.quantity import Quantity
from compare.scene.units import Units

PICTURE = "force_displacement.png"


def _of(name: str) -> Callable[[Mapping[str, float]], Any]:
    return lambda curve: curve.get(name)


def columns_of(name: str, unit: str) -> tuple[Column, ...]:
    """The columns of a vector's components: NAME.x, NAME.y, NAME.z."""
    return tuple(Column(f"{name}.{axis}", f"{name}.{axis}", unit, NUMBER) for axis in "xyz")


#: The curve: how far a held place has been moved and the force along it; or how far a frame has been turned.
CURVE: tuple[Quantity[Mapping[str, float]], ...] = (
    Quantity("displacement", unit="l", kind=NUMBER, legend="of what is moved, along its way", of=_of("displacement"),
             note="of what is moved (the end before the start, a wall), along its way from the first state; of a sweep "
             "with one axis"),
    Quantity("force_along", "force along", FORCE, NUMBER, legend="on the strip, of what is moved, along its way",
             note="of that support on the strip, along its way: its integral is the change of energy",
             of=_of("force_along")),
    Quantity("angle", unit="rad", kind=NUMBER, legend="of a clamp that is turned",
             note="of a clamp that is turned, where nothing is moved", of=_of("angle")),
    Quantity("moment_along", "moment about", MOMENT, NUMBER, legend="of that clamp, about the axis of its turn",
             note="of that clamp on the strip, about the axis of its turn", of=_of("moment_along")),
)  # fmt: skip


def wall_columns(records: Sequence[Mapping[str, Any]]) -> tuple[Column, ...]:
    """The columns of the forces of walls that some of the records have: force.wall.NAME.x, ...; and of their errors,
    force_error.wall.NAME."""
    names = dict.fromkeys(key.rpartition(".")[0] for r in records for key in r if key.startswith("force.wall."))
    errors = dict.fromkeys(key for r in records for key in r if key.startswith("force_error.wall."))
    return (
        *(column for name in names for column in columns_of(name, FORCE)),
        *(Column(name, name, FORCE, NUMBER) for name in errors),
    )


def supports_of(stand: LoadPoint) -> dict[str, float]:
    """Forces and moments of a state under the keys of the columns."""
    found: dict[str, float] = {}
    for kind, vectors in (("force", stand.forces), ("moment", stand.moments)):
        for name, vector in vectors.items():
            for axis, value in zip("xyz", vector, strict=True):
                found[f"{kind}.{name}.{axis}"] = float(value)
    return found


def load_point_of(
    values: Mapping[str, Any], forces: Mapping[str, Any], moments: Mapping[str, Any], walls: Sequence[str] = ()
) -> LoadPoint:
    """A state from the contract's `forces` and `moments`; walls: their names, in keys by name or number."""
    given = {name: forces.get(name) for name in ("start", "end")}
    given |= {f"wall.{name}": force for name, force in zip(walls, forces.get("walls") or (), strict=False)}
    numbers = {f"wall.{number}.": f"wall.{name}." for number, name in enumerate(walls)}
    named = {_renamed(key, numbers): value for key, value in values.items()}
    return LoadPoint(
        named,
        {name: np.asarray(force, dtype=float) for name, force in given.items() if force is not None},
        {name: np.asarray(moments[name], dtype=float) for name in ("start", "end") if moments.get(name) is not None},
    )


def _renamed(key: str, numbers: Mapping[str, str]) -> str:
    for old, new in numbers.items():
        if key.startswith(old):
            return new + key.removeprefix(old)
    return key


def curve_of(load_curve: LoadCurve | None) -> dict[int, dict[str, float]]:
    """The curve under the keys of `CURVE`, by the number of the state; empty for a number, and without a curve."""
    names = {POSITION: ("displacement", "force_along"), TURN: ("angle", "moment_along")}
    if load_curve is None or load_curve.kind not in names:
        return {}
    path, force = names[load_curve.kind]
    found = zip(load_curve.states, load_curve.way, load_curve.force, strict=True)
    return {int(k): {path: float(x), force: float(y)} for k, x, y in found}


def draw(path: Path, load_curve: LoadCurve, units: Units, title: str) -> Picture:
    """Writes the picture, in mm and N where SI is known, and describes it."""
    from matplotlib.figure import Figure

    from compare.page.drawing import save

    x, x_label = _scaled(load_curve.way, _of_path(load_curve), units)
    y, y_label = _scaled(load_curve.force, MOMENT if load_curve.kind == TURN else FORCE, units)
    names = {POSITION: ("displacement", "force along it"), TURN: ("angle", "moment about its axis")}
    along, against = names.get(load_curve.kind, (load_curve.key, "size of the force"))
    held = load_curve.support if load_curve.support.startswith("wall") else f"clamp.{load_curve.support}"
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(x, y, "o-", color="#1f5fa8", ms=3.5, lw=1.2)
    axes.axhline(0.0, color="0.6", lw=0.6)
    axes.set_xlabel(f"{along} of {held}{x_label}" if load_curve.kind in names else f"{load_curve.key}{x_label}")
    axes.set_ylabel(f"{against}{y_label}")
    axes.set_title(title, fontsize=10)
    axes.grid(True, lw=0.3, alpha=0.6)
    save(figure, path)
    ends = f"from {y[0]:.3g} to {y[-1]:.3g}, {y.min():.3g} to {y.max():.3g} in all"
    return Picture(
        path.name,
        f"{against.capitalize()}{y_label}, which {held} exerts on the strip, against {along}{x_label}: {ends}.",
        f"Force against displacement: {held}, {len(x)} states.",
    )


def _of_path(load_curve: LoadCurve) -> str:
    return {POSITION: "l", TURN: "rad"}.get(load_curve.kind, "")


def _scaled(values: Any, unit: str, units: Units) -> tuple[Any, str]:
    """Values for an axis and the unit behind its label, with the prefix that suits the largest of them."""
    array = np.asarray(values, dtype=float)
    told = units.reading(float(np.abs(array).max(initial=0.0)), unit)
    if told is None:
        shown = {MOMENT: "D w / l"}.get(unit, unit)
        return array, f" / ({shown})" if " " in shown else f" / {shown}" if shown else ""
    return array * told[0], f" / {told[1]}"
