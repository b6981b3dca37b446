"""One point of a sweep whose solver is the comparison: the scene's model beside its shells, as rows of plain numbers.

It stands apart from `compare.sweep.case` so that a sweep of one model does not depend on the others.
"""

from __future__ import annotations

from pathlib import Path

from compare.page.remedies import message
from compare.record.views import row_of as cells_of
from compare.store.progress import Reporter
from compare.store.shared import shared_store
from compare.studies.compare import compare
from compare.sweep.case import Record, Task, worst
from compare.sweep.record import OF_FAST, OF_PAIR
from compare.sweep.row import Row, row_of


def compared(task: Task) -> Record:
    """A row for each shell beside the scene's model."""
    found = compare(task.scene, shared_store(Path(task.folder)), Reporter(quiet=True), leave_saddle=task.leave_saddle)
    own = found.fast
    rows: list[Row] = []
    for r in found.rows:
        row = row_of(task.scene, own)
        row.pop("segments", None)
        row |= cells_of(OF_FAST, own) | cells_of(OF_PAIR, r)
        row |= {"status": r.status if own.ok else own.word, "stable": r.stable}
        rows.append(row)
    messages = [f"{own.model}: {message(own)}", *(f"w/h = {r.width_to_thickness:g}: {r.message}" for r in found.rows)]
    return {"status": worst(rows), "message": "; ".join(messages), "rows": rows}
