"""What a table in parts says in all: counts, extremes, the quantity shown along the axes, rows for a picture. It is
read a group of rows at a time."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from compare.studies.axes import Axis, values_at
from compare.sweep.case import PASSING
from compare.sweep.large import parts
from compare.sweep.large.parts import TABLE, TIMES

#: Failed cases that are named; rows of a picture at most; numbers of which a median is taken at most.
NAMED, DRAWN, SORTED = 20, 20_000, 5_000_000


@dataclass
class Along:
    """A quantity at one value of an axis. count, bad: rows, and those that are no stable state; values: of the rest."""

    count: int = 0
    bad: int = 0
    values: list[np.ndarray[Any, Any]] = field(default_factory=list)

    def spread(self) -> tuple[float | None, float | None, float | None]:
        """Smallest, median and largest; the median None of too many."""
        numbers = np.concatenate(self.values) if self.values else np.empty(0)
        if not numbers.size:
            return None, None, None
        middle = float(np.sort(numbers)[numbers.size // 2]) if numbers.size <= SORTED else None
        return float(numbers.min()), middle, float(numbers.max())


@dataclass
class Summary:
    """Of a table. rows, cases: how many; ok: cases that are stable states; statuses: of the rows; stable: False where
    some row is not, None where some is not known; residual, lowest: extremes; seconds: sum, median, most (s); along:
    for each axis and each of its places that are told; failed: (case, status, message) of the first; infinite: energies
    of stable states that are no numbers; undetermined: rows whose forces are; error: the largest, without_error: stable
    states that have none; drawn: rows for a picture; faults: of parts that cannot be read; bytes: of the table; last:
    the case that was read last, and whether it failed."""

    rows: int = 0
    cases: int = 0
    ok: int = 0
    statuses: Counter[str] = field(default_factory=Counter)
    stable: bool | None = True
    residual: float | None = None
    lowest: float | None = None
    iterations: int = 0
    seconds: tuple[float, float | None, float | None] = (0.0, None, None)
    along: list[dict[int, Along]] = field(default_factory=list)
    failed: list[tuple[int, str, str]] = field(default_factory=list)
    infinite: int = 0
    undetermined: int = 0
    error: float | None = None
    without_error: int = 0
    drawn: list[dict[str, Any]] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    bytes: int = 0
    last: tuple[int, bool] = (-1, False)


def places_told(axis: Axis) -> list[int]:
    """All places of an axis, or seven of many, the ends included."""
    count = len(axis.values)
    return list(range(count)) if count <= 9 else [round(k * (count - 1) / 6) for k in range(7)]


def thinned(axes: tuple[Axis, ...]) -> list[list[int]]:
    """Places of each axis whose product is no more than a picture shows: all, or so many at equal steps."""
    count = [len(axis.values) for axis in axes]
    while math.prod(count) > DRAWN:
        most = count.index(max(count))
        count[most] = max(2, min(count[most] - 1, int(count[most] * 0.9)))
    return [
        sorted({round(k * (len(axis.values) - 1) / max(1, few - 1)) for k in range(few)})
        for axis, few in zip(axes, count, strict=True)
    ]


_NUMBERS = ("residual", "lowest_eigenvalue", "iterations", "energy.total")
_ERRORS = ("error", "ribbon_error", "shell_error")


def summary(folder: Path, key: str, axes: tuple[Axis, ...], wanted: tuple[str, ...]) -> Summary:
    """Reads the parts of a folder; wanted: the columns that are shown, the first one along the axes."""
    found = Summary(along=[{place: Along() for place in places_told(axis)} for axis in axes])
    drawn = [np.isin(np.arange(len(a.values)), p) for a, p in zip(axes, thinned(axes), strict=True)]
    for block in parts.blocks(folder):
        path = parts.part(folder, TABLE, block)
        try:
            have = set(parts.opened(path, key).schema_arrow.names)
            names = {"case", "status", "stable", "message", *_NUMBERS, *_ERRORS, "forces_why", "width_to_thickness"}
            names |= {*wanted, *(k for axis in axes for k in axis.keys)}
            for rows in parts.batches(path, key, sorted(names & have)):
                _add(found, {name: rows[name] for name in rows.column_names}, axes, drawn, wanted)
            found.bytes += path.stat().st_size
        except ValueError as error:
            found.faults.append(str(error))
    found.seconds = _seconds(folder, key)
    return found


def _add(
    found: Summary, columns: dict[str, Any], axes: tuple[Axis, ...], drawn: list[Any], wanted: tuple[str, ...]
) -> None:
    cases = columns["case"].to_numpy()
    statuses = np.array(columns["status"].to_pylist(), dtype=object)
    stable = np.array(columns["stable"].to_pylist(), dtype=object)
    numbers = {
        name: columns[name].to_numpy().astype(float) for name in (*_NUMBERS, wanted[0]) if _is_number(columns, name)
    }
    converged = statuses == "converged"
    bad = ~converged | (stable == False)  # noqa: E712
    found.rows += len(cases)
    own, first = np.unique(cases, return_inverse=True)
    failing = np.zeros(len(own), dtype=bool)
    np.logical_or.at(failing, first, bad)
    goes_on = own[0] == found.last[0]  # rows of one case in two groups
    found.cases += len(own) - int(goes_on)
    found.ok += int((~failing).sum()) - int(goes_on and not found.last[1])
    found.last = int(own[-1]), bool(failing[-1])
    found.statuses.update(statuses.tolist())
    if (stable == False).any():  # noqa: E712
        found.stable = False
    elif found.stable and any(value is None for value in stable):
        found.stable = None
    found.residual = _most(max, found.residual, numbers.get("residual"))
    found.lowest = _most(min, found.lowest, numbers.get("lowest_eigenvalue"))
    found.iterations += int(np.nansum(numbers.get("iterations", np.zeros(1))))
    energy = numbers.get("energy.total", np.full(len(cases), np.nan))
    found.infinite += int((~bad & ~np.isfinite(energy)).sum())
    if "forces_why" in columns:
        found.undetermined += len(cases) - columns["forces_why"].null_count
    errors = [columns[name].to_numpy().astype(float) for name in _ERRORS if _is_number(columns, name)]
    if errors:
        most = np.fmax.reduce(errors)
        found.without_error += int(np.isnan(most[~bad]).sum())
        found.error = _most(max, found.error, most[~bad])
    for k in np.flatnonzero(bad)[: NAMED - len(found.failed)]:
        found.failed.append((int(cases[k]), str(statuses[k]), str(columns["message"][int(k)].as_py() or "")))
    shown = numbers.get(wanted[0], np.full(len(cases), np.nan))
    pick = np.ones(len(cases), dtype=bool)
    step = 1
    for axis, along, some in zip(reversed(axes), reversed(found.along), reversed(drawn), strict=True):
        place = cases // step % len(axis.values)
        step *= len(axis.values)
        pick &= some[place]
        for value, here in along.items():
            there = place == value
            here.count += int(there.sum())
            here.bad += int((bad & there).sum())
            good = shown[there & converged]
            here.values.append(good[np.isfinite(good)])
    chosen = {name: column.take(np.flatnonzero(pick)).to_pylist() for name, column in columns.items()}
    for row in zip(*chosen.values(), strict=True):
        known = {name: value for name, value in zip(chosen, row, strict=True) if value is not None}
        found.drawn.append({**known, **values_at(axes, known["case"])})


def _is_number(columns: dict[str, Any], name: str) -> bool:
    return name in columns and str(columns[name].type) in ("double", "int64")


def _most(pick: Any, before: float | None, values: Any) -> float | None:
    finite = [] if values is None else values[np.isfinite(values)].tolist()
    every = finite if before is None else [before, *finite]
    return pick(every) if every else None


def _seconds(folder: Path, key: str) -> tuple[float, float | None, float | None]:
    """Sum, median (of the logarithmic classes, within a percent) and most of the times of the cases."""
    total, most, classes = 0.0, None, Counter[int]()
    for block in parts.blocks(folder, TIMES):
        try:
            for rows in parts.batches(parts.part(folder, TIMES, block), key, ("seconds",)):
                values = rows["seconds"].drop_null().to_numpy()
                total += float(values.sum())
                most = _most(max, most, values)
                classes.update(np.round(np.log(np.maximum(values, 1e-9)) * 100.0).astype(int).tolist())
        except ValueError:
            continue
    middle = None
    passed = 0
    for one in sorted(classes):
        passed += classes[one]
        if 2 * passed >= sum(classes.values()):
            middle = math.exp(one / 100.0)
            break
    return total, middle, most


def passing(found: Summary) -> int:
    """Rows of cases that a later run tries again."""
    return sum(found.statuses[status] for status in PASSING)
