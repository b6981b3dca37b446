"""What `ribbonbench solve --all` says and writes of other equilibria: a table, `states` of result.json, states.npz."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from compare.page.table import Column, Table
from compare.store.arrays import npz_bytes
from compare.store.store import atomic_write_bytes
from compare.studies.branches.bars import known
from compare.studies.branches.measured import LINE
from compare.studies.branches.states import Seen, States

SHAPES = "states.npz"
#: Barriers that are told, lowest first.
_BARRIERS = 5
FILES = {SHAPES: "centrelines (states, 101, 3) in l, in the order of `states`"}
_COLUMNS = (
    Column("state", "state", kind="integer"),
    Column("own", "own", kind="truth", legend="where the scene's seed leads"),
    Column("energy", "energy", "D w / l", "digits:8"),
    Column(
        "energy_error",
        "+-",
        "D w / l",
        "exponent:1",
        legend="to the limit of finer elements; - : not settled or not asked for",
    ),
    Column("unstable", "unstable modes", kind="integer"),
    Column("distance", "from its own", "l", "digits:3", legend="largest distance of points at the same s"),
    Column("image_of", "image of", kind="integer", legend="a state of the same energy"),
    Column("found_by", "found by", kind="word", rank=9),
)


def table(found: States) -> Table:
    """A row for every state, by energy."""
    rows = tuple(
        (k, k == found.own, s.energy, _error(s, "energy"), s.unstable, s.distance, s.image_of, s.found_by)
        for k, s in enumerate(found.seen)
    )
    return Table("Equilibria that were seen", _COLUMNS, rows)


def _error(seen: Seen, name: str) -> float | None:
    return known(seen.bars, name) if seen.settles else None


def sentences(found: States) -> list[str]:
    """What is not settled or not asked for, how many there are, whether one lies lower, what a list is worth."""
    stable = sum(s.stable for s in found.seen)
    said = []
    if found.unsettled:
        said.append(
            f"Not settled: {found.unsettled} of {len(found.seen)} states are these elements' own; on finer ones their "
            "energy, shape or stability is another, or there is none: take more elements (--set model.elements=N)."
        )
    if found.unasked:
        why = "finer elements of this model cost too much" if found.costly else "the time was spent"
        said.append(f"Not asked for: the errors of {found.unasked} of {len(found.seen)} states; {why}.")
    said += [f"{len(found.seen)} equilibria were seen from {found.tries} starts, {stable} of them stable."]
    if found.lower:
        least = min(found.lower, key=_energy)
        said.append(
            f"{len(found.lower)} stable states lie below the scene's own, the lowest at {least.energy:.6g} D w / l, "
            f"{least.distance:.2g} l away."
        )
    said += [
        f"From state {b.saddle}, a saddle, the strip falls to state {b.ends[0]} or {b.ends[1]}: barriers of "
        f"{_height(b.heights[0], b.errors[0])} and {_height(b.heights[1], b.errors[1])} D w / l."
        for b in found.barriers[:_BARRIERS]
    ]  # fmt: skip
    if len(found.barriers) > _BARRIERS:
        said.append(f"{len(found.barriers) - _BARRIERS} more barriers stand in result.json (states_search.barriers).")
    if not found.complete:
        said.append("The time was spent before all starts were gone from, and all saddles to both sides.")
    said.append("A list is no proof: other equilibria may lie where none of these starts led.")
    return said


def _height(height: float, error: float | None) -> str:
    return f"{height:.4g} " + ("(no error)" if error is None else f"+- {error:.1g}")


def _energy(seen: Seen) -> float:
    return seen.energy


def record(found: States) -> dict[str, Any]:
    """`states` of result.json, by energy, and `states_search`: what they were looked for with."""
    seen = [
        {
            "energy": s.energy, "unstable_modes": s.unstable, "stable": s.stable, "own": k == found.own,
            "energy_error": _error(s, "energy"), "shape_error": _error(s, "shape"), "settles": s.settles,
            "distance": s.distance, "image_of": s.image_of, "found_by": s.found_by, "end": s.centreline[-1],
            "middle": s.centreline[LINE // 2], "shape": {"file": SHAPES, "row": k},
        }
        for k, s in enumerate(found.seen)
    ]  # fmt: skip
    barriers = [
        {
            "saddle": b.saddle,
            "states": list(b.ends),
            "heights": list(b.heights),
            "errors": list(b.errors),
            **({"errors_why": "a state does not settle on finer elements"} if None in b.errors else {}),
        }
        for b in found.barriers
    ]
    search = {
        "tries": found.tries, "complete": found.complete, "proof": False, "distances": found.distances(),
        "barriers": barriers,
    }  # fmt: skip
    return {"states": seen, "states_search": search}


def write_shapes(out: Path, found: States) -> None:
    """The centrelines."""
    lines = np.array([s.centreline for s in found.seen])
    atomic_write_bytes(out / SHAPES, npz_bytes({"s": np.linspace(0.0, 1.0, LINE), "centreline": lines}))
