"""One point of a sweep: its model answers, and the states become rows of plain numbers.

This runs in a worker process; nothing that a case does ends the sweep: every end is a record with a status.
"""

from __future__ import annotations

import errno
import functools
import time
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.models import RICHEST, model
from compare.models.capabilities import Batches
from compare.page.remedies import message
from compare.scene.scene import Scene
from compare.store.provenance import now
from compare.store.shared import shared_store
from compare.store.store import disk_full
from compare.sweep.row import Row, row_of
from compare.sweep.shapes import packed
from ribbonbench.errors import BadInput, Missing, RibbonbenchError

if TYPE_CHECKING:
    from compare.models.base import State

Record = dict[str, Any]

#: Ends of a case at which a second try could find something else: they are not kept as finished.
PASSING = ("crashed", "error", "missing")
#: The solver that is no model, but the comparison of one with its shells.
COMPARE = "compare"


@dataclass(frozen=True)
class Task:
    """What a worker gets: the case's key and scene, the solver and its options, the folder of the sweep's results.

    slice: number of the slice whose cases are solved together (`run_cases`); None: the case goes alone. shapes: points
    of each centreline that is kept in the record (`shapes`, one for each row), 0: none.
    """

    key: str
    scene: Scene
    solver: str
    errors: bool
    leave_saddle: bool | None
    folder: str
    slice: int | None = None
    shapes: int = 0


def slice_key(task: Task) -> Hashable | None:
    """What cases have in common that can be solved together; None: the case goes alone.

    Together go cases of a model that takes them so (`Batches`) and of which nothing is asked but
    the state.
    """
    if task.solver == COMPARE or task.errors or task.leave_saddle:
        return None
    batches = _batches(task.solver)
    return None if batches is None else batches.together(task.scene)


@functools.cache
def _batches(solver: str) -> Batches | None:
    """The model of this name, where it takes cases together."""
    requested = model(solver)
    return requested if isinstance(requested, Batches) else None


def run_cases(tasks: Sequence[Task]) -> list[Record]:
    """The records of cases that a worker gets at once, each as `run_case` makes it.

    A slice (`Task.slice`) is solved as one batch, without what is made ready for a case alone; `together` is then
    true in its records, and `seconds` the solve's own and an equal share of the rest. A saddle goes again alone, where
    it is left. Where something is raised, the cases go one by one, and each says for itself what it was.
    """
    if tasks[0].slice is None:
        return [run_case(task) for task in tasks]
    clock = time.perf_counter()
    try:
        states = states_of(tasks)
        rows = [row_of(task.scene, state) for task, state in zip(tasks, states, strict=True)]
    except Exception:
        return [run_case(task) for task in tasks]
    own = [0.0 if state.seconds is None else state.seconds.first for state in states]
    share = max(0.0, time.perf_counter() - clock - sum(own)) / len(tasks)
    return [
        recorded(task, row, state, seconds + share)
        for task, row, state, seconds in zip(tasks, rows, states, own, strict=True)
    ]


def states_of(tasks: Sequence[Task]) -> list[State]:
    """The states of cases that are solved together. Raises whatever is wrong with one of them."""
    requested = model(tasks[0].solver)
    for task in tasks:
        refused = requested.refusal(task.scene)
        if refused is not None:
            raise refused
    assert isinstance(requested, Batches)
    return requested.solve_together([task.scene for task in tasks])


def recorded(task: Task, row: Row, state: State, seconds: float) -> Record:
    """The record of a case that was solved together with others; a saddle goes again alone, where it is left."""
    if state.stable is False and task.leave_saddle is None:
        return run_case(task)
    return {
        "status": worst([row]), "message": message(state), "rows": [row], "together": True, "seconds": seconds,
        "time": now(), **_shapes(task, [state]),
    }  # fmt: skip


def run_case(task: Task, answer: Callable[[Task], Record] | None = None) -> Record:
    """The record of a case: `status`, `message`, `rows`, `seconds` (wall time of the whole case, s), `time`.

    answer: gives the first three; None: the model of `task.solver` does.

    status: the solver's own word; "refused" (bad input that only the solver sees), "missing" (a library), "error"
    (anything else), with the message. `disk_full` holds the errno of a disk that took nothing more.
    """
    clock = time.perf_counter()
    record: Record = {"status": "error", "message": "", "rows": []}
    try:
        record.update((answer or _solved)(task))
    except Exception as error:
        record.update(_fault(error))
    record["seconds"] = time.perf_counter() - clock
    record["time"] = now()
    return record


def _fault(error: Exception) -> Record:
    full = disk_full(error)
    if full is not None:
        return {"status": "error", "message": str(error), "disk_full": full.errno or errno.ENOSPC}
    if isinstance(error, Missing):
        return {"status": "missing", "message": str(error)}
    if isinstance(error, BadInput) or type(error).__name__ == "RibbonInputError":
        return {"status": "refused", "message": " ".join(str(error).split())}
    if isinstance(error, RibbonbenchError):
        return {"status": "error", "message": str(error)}
    return {"status": "error", "message": " ".join(f"{type(error).__name__}: {error}".split())}


def crashed(message: str) -> Record:
    """The record of a case whose worker died."""
    return {"status": "crashed", "message": message, "rows": [], "seconds": None, "time": now()}


def _solved(task: Task) -> Record:
    """One row for each solve that the scene asks the model for."""
    from compare.models.base import Options

    requested = model(task.solver)
    # a way is not resumed here: a case is short, and its end is what is kept
    store = None if task.scene.path and task.solver != RICHEST else shared_store(Path(task.folder))
    options = Options(leave_saddle=task.leave_saddle, error=task.errors and task.solver != RICHEST, store=store)
    rows: list[Row] = []
    states: list[State] = []
    messages: list[str] = []
    variants = requested.variants(task.scene)
    for variant in variants:
        state = requested.solve(variant.scene, options=options)
        states.append(state)
        rows.append({**variant.keys, **row_of(task.scene, state, task.errors)})
        label = ", ".join(f"{_LABELS.get(key, key)} = {value:g}" for key, value in variant.keys.items())
        text = message(state)
        messages.append(f"{label}: {text}" if label else text)
    return {"status": worst(rows), "message": "; ".join(messages), "rows": rows, **_shapes(task, states)}


def _shapes(task: Task, states: Sequence[State]) -> Record:
    return {"shapes": [packed(state, task.shapes) for state in states]} if task.shapes else {}


_LABELS = {"width_to_thickness": "w/h"}


def worst(rows: list[Row]) -> str:
    """ "converged" when every row is; else the first other status, a passing one before the others."""
    others = [str(row["status"]) for row in rows if row["status"] != "converged"]
    passing = [status for status in others if status in PASSING]
    return (passing or others or ["converged"])[0]
