"""What holds a strip, model beside model: the forces of ends and walls on the ribbon and on every shell, each with its
error."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from compare.models.base import State
from compare.page.pair import Row
from compare.page.table import Cell, Column, Table

FORCE, PRESSURE = "D w / l^2", "D / l^3"
#: Where parts of the strip push each other: what those at larger s exert on the others.
ITSELF = "itself"
TITLE = "Forces, side by side"
COLUMNS = (
    Column(
        "support",
        "support",
        kind="word",
        legend="what exerts it on the strip: an end that is held, a wall, or its own parts at larger s on the others",
    ),
    Column("model", "model", kind="word", legend="the line model, or the shell of a w/h"),
    *(Column(f"force_{axis}", f"force {axis}", FORCE, "digits:6") for axis in "xyz"),
    Column("force_error", "force error", FORCE, "exponent:1", legend="what the discretisation leaves open of it"),
    Column("pressure", "pressure", PRESSURE, "digits:4", legend="of a wall, mean over the width times the length "
           "that touches; empty where that is none"),
    Column("pressure_error", "pressure error", PRESSURE, "exponent:1", legend="of the discretisation"),
    Column("gap", "gap / l", "l", "exponent:1", legend="nearest node's distance from a wall; below 0 behind it"),
)  # fmt: skip


def side_by_side(fast: State, rows: Sequence[Row]) -> Table | None:
    """One row for every support and model; None where nothing is held with a known force."""
    found = [*_of_line(fast), *(cells for row in rows for cells in _of_shell(row))]
    order = {name: k for k, name in enumerate(dict.fromkeys(str(cells[0]) for cells in found))}
    found.sort(key=lambda cells: order[str(cells[0])])
    return Table(TITLE, COLUMNS, tuple(found)) if found else None


def _of_line(fast: State) -> Iterator[tuple[Cell, ...]]:
    """The rows of the model beside the shells."""
    if not fast.ok or "forces" in fast.whys:
        return
    errors = fast.errors.get("forces") or {}
    for name, held in (("start", fast.supports.start), ("end", fast.supports.end)):
        if held is not None:
            yield _row(f"clamp {name}", fast.model, held.force, errors.get(name))
    pressures = (fast.errors.get("mean_pressures") or {}).get("walls") or ()
    yield from _walls(fast.model, fast.supports.walls, errors.get("walls") or (), pressures)
    if fast.supports.itself is not None:
        yield _row(ITSELF, fast.model, fast.supports.itself, errors.get("itself"))


def _of_shell(row: Row) -> Iterator[tuple[Cell, ...]]:
    """The rows of one shell."""
    if row.status != "converged":
        return
    label, errors = f"w/h = {row.width_to_thickness:g}", (row.shell_errors or {}).get("forces") or {}
    for name in ("start", "end"):
        force = row.shell_forces.get(name)
        if force is not None:
            yield _row(f"clamp {name}", label, force, errors.get(name))
    pressures = [wall["mean_pressure_error"] for wall in row.shell_walls]
    yield from _walls(label, row.shell_walls, errors.get("walls") or (), pressures)
    if row.shell_contacts is not None:
        yield _row(ITSELF, label, row.shell_contacts["force"], row.shell_contacts["force_error"])


def _walls(
    label: str, walls: Sequence[Mapping[str, Any]], errors: Sequence[float | None], pressures: Sequence[float | None]
) -> Iterator[tuple[Cell, ...]]:
    """The rows of walls, named or numbered."""
    for k, wall in enumerate(walls):
        error, sure = (known[k] if k < len(known) else None for known in (errors, pressures))
        more = wall.get("mean_pressure"), sure, wall.get("gap")
        yield _row(f"wall {wall['name']}", label, wall["force"], error, more)


def _row(
    support: str, label: str, force: Any, error: float | None, more: Sequence[float | None] = (None, None, None)
) -> tuple[Cell, ...]:
    """more: pressure, its error and gap, of a wall."""
    x, y, z = (float(v) for v in np.asarray(force))
    return (support, label, x, y, z, *(None if number is None else float(number) for number in (error, *more)))
