"""What `ribbonbench solve` writes: result.json, the model's own files and pictures, page.json."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compare.measure.grades import YARDSTICK
from compare.measure.grid import Grid
from compare.models.base import State, Status
from compare.models.quantities import Answered
from compare.page.remedies import message
from compare.page.state import STATE, own_of
from compare.page.study import RESULT, Study
from compare.page.table import Column, Table
from compare.page.verdict import Verdict
from compare.page.wording import energies, length, place
from compare.pages.presenter import presenter
from compare.pages.result import spent, state_result
from compare.record.quantity import joined
from compare.record.views import cells, document, in_si, unit_of
from compare.scene.scene import Scene
from compare.scene.units import Units, base_of
from compare.store.finite import explained
from compare.store.store import atomic_write_json, jsonable
from compare.studies.checks import of_state
from compare.studies.inputs import input_uncertainty

if TYPE_CHECKING:
    from compare.studies.branches.states import States

#: Names and texts: each row has a unit, or several values, of its own.
_LISTED = Column("quantity", "quantity", kind="word"), Column("value", "value", kind="word")


def answer(scene: Scene, state: State, units: Units | None = None, command: str = "solve") -> Verdict:
    """Whether the state is one that the strip stays in, where that is, and how accurately it is known: as good as what
    was checked of it (`compare.studies.checks`), with what keeps it from being good."""
    units = units or scene.units
    checks = of_state(scene, state, command)
    body = f"the {'band' if scene.closure else 'strip'}"
    if state.stable is False or state.status is Status.UNSTABLE:
        text = f"{body.capitalize()} would not stay in the state that was found: {message(state)}"
        return Verdict.of(command, text, checks)
    if not state.ok:
        return Verdict.of(command, f"No equilibrium was found: {message(state)}", checks)
    if "forces" in state.whys:
        text = f"{body.capitalize()} is straight; its tension is not determined: {remedy(scene, state)}"
        return Verdict.of(command, text, checks)
    kind = "a stable equilibrium" if state.stable else "an equilibrium, whose stability is not known"
    if "neutral" in state.numbers:
        kind = f"a neutral equilibrium: {state.message.partition(', ')[2]}"
    near = f"computed to {length(units, state.error)}"
    if state.error is None:
        near = "how accurately is not known" + (f" ({state.error_why})" if state.error_why else "")
    if state.left_saddle is not None:
        mirror = ", as its mirror image is" if state.left_saddle["mirrored"] else ""
        near += f"; the state beside its seed is a saddle, which it leaves for this one{mirror}"
    unsure = input_uncertainty(scene, state)
    if unsure is not None and unsure.total is not None:
        near += f"; its inputs leave {length(units, unsure.total)} open"
    chosen = presenter(state).chosen(state, units)
    near += f"; {chosen}" if chosen else ""
    text = f"{body.capitalize()} is in {kind}{_where(scene, state, units)}; {near}"
    return Verdict.of(command, text, checks).doubted("elements", *(() if state.stable else ("stability",)))


def remedy(scene: Scene, state: State) -> str:
    """Why the forces of a state are not known, and what its model says of them."""
    more = presenter(state).undetermined(scene)
    return state.whys["forces"] + (f"; {more}" if more else "")


def _where(scene: Scene, state: State, units: Units) -> str:
    """How far the free end, or the middle of what is held at both ends, is from the clamp, or from the point that is
    held where that is all: below or above it under weight; "" where there is no such place."""
    held = scene.clamp_start
    found = state.end if scene.clamp_end is None else state.middle
    if scene.closure or held is None or held.position is None or found is None:
        return ""
    place = "free end" if scene.clamp_end is None else "middle"
    clamp = "the clamp" if held.tangent is not None else "the point that is held, about which it turns freely"
    apart = found.position - np.asarray(held.position, dtype=float) / scene.strip.length
    if scene.up is None or not scene.gamma:
        return f": its {place} is {length(units, float(np.linalg.norm(apart)))} from {clamp}"
    height = float(apart @ np.asarray(scene.up, dtype=float))
    if abs(height) < YARDSTICK:
        return f": its {place} is level with {clamp}"
    stands, side = ("hangs", "below") if height < 0.0 else ("stands", "above")
    return f": its {place} {stands} {length(units, abs(height))} {side} {clamp}"


def rows(scene: Scene, state: State, units: Units | None = None) -> list[tuple[str, str]]:
    """What the command prints: name and text; in SI too where `units` (None: the scene's) are known."""
    units = units or scene.units
    own = presenter(state)
    if own.rows is not None:
        return list(own.rows(scene, state, units))
    energy = {} if state.energy is None else state.energy.to_dict()
    found = [
        ("status", message(state)),
        ("residual", f"{state.residual:.1e} after {state.iterations} iterations" if state.residual else "-"),
        ("energy", energies(energy, units)),
    ]
    for name, pose in (("middle", state.middle), ("end", state.end)):
        if pose is not None and state.is_equilibrium:
            found.append((name, place(np.asarray(pose.position), units)))
    found.append(("model", f"{state.model}, {state.size.label} elements"))
    found.append(("discretisation error", "unknown" if state.error is None else length(units, state.error)))
    found.append(("time", spent(state.seconds)))
    return found


_NUMBERS = (
    Column("key", "key", kind="word", rank=0),
    Column("value", "value", rank=0),
    Column("unit", "unit", kind="word", rank=1),
    Column("si", "in SI", rank=1),
    Column("base", "", kind="word", rank=1),
)
#: Keys of a result that are no numbers of the state.
_NO_NUMBERS = ("scene", "title", "message", "provenance", "units")


def numbers(scene: Scene, state: State, units: Units | None = None) -> Table:
    """Every number of the state's record, in the order of result.json, in its unit and in SI where that is known."""
    units = units or scene.units
    record = joined(STATE, own_of(state.model))
    found = jsonable(document(record, Answered(scene, state)))
    si = in_si(record, found, units) or {}
    rows = []
    for path, value in cells(found):
        if path.partition(".")[0] not in _NO_NUMBERS:
            unit = unit_of(record, path)
            twin = dict(cells(si)).get(path)
            rows.append((path, value, unit, twin, "" if twin is None else base_of(unit)))
    return Table("All numbers", _NUMBERS, tuple(rows))


def sentences(scene: Scene, state: State) -> list[str]:
    """The state in sentences."""
    own = presenter(state)
    if own.sentences is not None:
        return list(own.sentences(scene, state))
    error = "unknown" if state.error is None else f"{state.error:.1e} l"
    return [f"{state.model}: {state.message}; discretisation error {error}, {state.seconds.warm * 1e3:.3g} ms."]


def write(out: Path, scene: Scene, state: State, again: str, seen: States | None = None) -> None:
    """result.json first, then the files and pictures of the model, and page.json; seen: other equilibria, where they
    were asked for: `states` and `states_search` of result.json, states.npz."""
    result = state_result(scene, state)
    more, told, files = [], [], {}
    if seen is not None:
        from compare.pages.branches import states  # and with it what follows branches

        result.update(states.record(seen, scene.units))
        states.write_shapes(out, seen)
        more, told, files = [states.table(seen, scene.units)], states.sentences(seen, scene.units), dict(states.FILES)
    verdict = answer(scene, state)
    atomic_write_json(out / RESULT, explained({**result, "answer": verdict}))
    grid = Grid.for_shape(scene, state.shape.bend if state.shape is not None else 1.0)
    written = presenter(state).write(out, scene, state, grid)
    Study(
        "solve",
        scene.title,
        verdict=verdict,
        tables=(Table(f"The {state.model}", _LISTED, tuple(rows(scene, state))), *more),
        sentences=(*sentences(scene, state), *told),
        pictures=written.pictures,
        surfaces=written.surfaces,
        data=written.data,
        files={"result.json": "all numbers", **written.files, **files},
    ).write(out, result, again, scene)
