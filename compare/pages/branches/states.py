"""What `ribbonbench solve --all` says and writes of other equilibria: a table, `states` of result.json, states.npz."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from compare.page.si import for_reader
from compare.page.table import Column, Table
from compare.page.wording import length, within
from compare.scene.units import Units
from compare.store.arrays import npz_bytes
from compare.store.store import atomic_write_bytes
from compare.studies.branches.bars import known
from compare.studies.branches.measured import LINE
from compare.studies.branches.states import SPENT, Barrier, Seen, States

SHAPES = "states.npz"
#: Heights of barriers that are told, lowest first.
_BARRIERS = 5
#: Unit of energies.
_ENERGY = "D w / l"
FILES = {SHAPES: "centrelines (states, 101, 3) in l, in the order of `states`"}
_COLUMNS = (
    Column("state", "state", kind="integer"),
    Column("own", "own", kind="truth", rank=6, legend="where the scene's seed leads"),
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


def table(found: States, units: Units) -> Table:
    """A row for every state, by energy; in SI where it is known, else with the unit in the heading."""
    rows = tuple(
        (k, k == found.own, s.energy, _error(s, "energy"), s.unstable, s.distance, s.image_of, s.found_by)
        for k, s in enumerate(found.seen)
    )
    made = Table("Equilibria that were seen", _COLUMNS, rows)
    if units.known:
        shown = for_reader(made, units)
        # states that differ little are told apart
        fine = (replace(c, kind="digits:6") if c.key == "energy_si" else c for c in shown.columns)
        return replace(shown, columns=tuple(fine))
    headed = (replace(c, heading=f"{c.heading} / ({c.unit})") if c.key == "energy" else c for c in _COLUMNS)
    return replace(made, columns=tuple(headed))


def _error(seen: Seen, name: str) -> float | None:
    return known(seen.bars, name) if seen.settles else None


def sentences(found: States, units: Units) -> list[str]:
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
    said.append(
        f"{len(found.seen)} equilibria were seen from {found.tries} starts, {stable} of them stable; the scene's seed "
        f"leads to state {found.own}."
    )
    if found.lower:
        least = min(found.lower, key=_energy)
        said.append(
            f"{len(found.lower)} stable states lie below the scene's own, the lowest at "
            f"{units.text(least.energy, _ENERGY, 6)}, {length(units, least.distance)} away."
        )
    heights = _heights(found)
    said += [_between(same, units) for same in heights[:_BARRIERS]]
    if len(heights) > _BARRIERS:
        said.append(f"{len(heights) - _BARRIERS} more heights stand in result.json (states_search.barriers).")
    if found.left or not found.barriers:
        said.append(_without(found))
    if not found.complete:
        said.append("The time was spent before all starts were gone from, and all saddles to both sides.")
    said.append("A list is no proof: other equilibria may lie where none of these starts led.")
    return said


def _heights(found: States) -> list[list[Barrier]]:
    """The barriers, lowest first, those together that are images of each other by their energies."""
    groups: dict[tuple[int, ...], list[Barrier]] = {}
    for barrier in found.barriers:
        images = [found.seen[k].image_of for k in (barrier.saddle, *barrier.ends)]
        alike = (
            k if image is None else image for k, image in zip((barrier.saddle, *barrier.ends), images, strict=True)
        )
        groups.setdefault(tuple(alike), []).append(barrier)
    return list(groups.values())


def _between(same: Sequence[Barrier], units: Units) -> str:
    """What is told of barriers of one height."""
    first, saddles = same[0], sorted(b.saddle for b in same)
    below = f"state {first.ends[0]} or {first.ends[1]}"
    if any(b.ends != first.ends for b in same):
        below += ", or to their images"
    one, other = (
        f"{units.text(height, _ENERGY, 4)}{within(error, _ENERGY, units, height)}"
        for height, error in zip(first.heights, first.errors, strict=True)
    )
    if len(saddles) == 1:
        return f"From state {saddles[0]}, a saddle, the strip falls to {below}: barriers of {one}; and {other}."
    names = ", ".join(map(str, saddles))
    top = f"each of {len(saddles)} saddles of one energy (states {names})"
    return f"From {top} the strip falls to {below}: barriers of {one}; and {other}."


def _without(found: States) -> str:
    """Why saddles have no barrier, or why there is none at all."""
    if not found.downhill:
        return "No barriers: of this model no steps downhill from a saddle are known."
    if not found.saddles:
        return "No barriers: no saddle with one unstable mode was seen, which is no proof that there is none."
    whys: dict[str, list[int]] = {}
    for one in found.left:
        whys.setdefault(one.why, []).append(one.saddle)
    told = [f"{why} (state{'s' * (len(of) > 1)} {', '.join(map(str, of))})" for why, of in whys.items()]
    return (
        f"{len(found.left)} of {found.saddles} saddles with one unstable mode gave no barrier, which is no proof that "
        f"there is none: {'; '.join(told)}."
    )


def _energy(seen: Seen) -> float:
    return seen.energy


def record(found: States, units: Units) -> dict[str, Any]:
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
    search = {
        "tries": found.tries, "complete": found.complete, "proof": False, "distances": found.distances(),
        **_barriers(found, units),
    }  # fmt: skip
    return {"states": seen, "states_search": search}


def _barriers(found: States, units: Units) -> dict[str, Any]:
    """`barriers`, with the reason where there is none, and `saddles`: how many have one unstable mode, how many of them
    were tried, and which gave no barrier."""
    barriers = [
        {
            "saddle": b.saddle,
            "states": list(b.ends),
            "heights": list(b.heights),
            "errors": list(b.errors),
            **_errors_why(b),
            "si": _in_si(b, units),
        }
        for b in found.barriers
    ]
    untried = sum(one.why == SPENT for one in found.left)
    tried = len(found.barriers) + len(found.left) - untried
    left = [{"saddle": one.saddle, "why": one.why} for one in found.left]
    why = {} if barriers else {"barriers_why": _without(found)}
    return {
        "barriers": barriers if found.downhill else None,
        **why,
        "saddles": {"seen": found.saddles, "tried": tried, "left": left},
    }


def _in_si(barrier: Barrier, units: Units) -> dict[str, Any] | None:
    """Heights and errors in J; None where SI is not known."""
    one = units.energy
    if one is None:
        return None
    return {
        "heights": [height * one for height in barrier.heights],
        "errors": [None if error is None else error * one for error in barrier.errors],
        **_errors_why(barrier),
    }


def _errors_why(barrier: Barrier) -> dict[str, str]:
    return {"errors_why": "a state does not settle on finer elements"} if None in barrier.errors else {}


def write_shapes(out: Path, found: States) -> None:
    """The centrelines."""
    lines = np.array([s.centreline for s in found.seen])
    atomic_write_bytes(out / SHAPES, npz_bytes({"s": np.linspace(0.0, 1.0, LINE), "centreline": lines}))
