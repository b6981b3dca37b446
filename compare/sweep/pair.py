"""One point of a sweep whose solver is the comparison: the scene's model beside its shells, as rows of plain numbers.

It stands apart from `compare.sweep.case` so that a sweep of one model does not depend on the others.
"""

from __future__ import annotations

from pathlib import Path

from compare.page.remedies import message
from compare.store.progress import Reporter
from compare.store.shared import shared_store
from compare.studies.compare import compare
from compare.sweep.case import Record, Row, Task, row_of, worst


def compared(task: Task) -> Record:
    """A row for each shell beside the scene's model."""
    found = compare(task.scene, shared_store(Path(task.folder)), Reporter(quiet=True), leave_saddle=task.leave_saddle)
    own = found.fast
    rows: list[Row] = []
    for r in found.rows:
        row = row_of(task.scene, own)
        row.pop("segments", None)
        row.update(
            {
                "width_to_thickness": r.width_to_thickness,
                "status": r.status if own.ok else own.word,
                "stable": r.stable,
                "ribbon.status": own.word,
                "ribbon.stable": own.stable,
                "hausdorff": r.hausdorff,
                "centreline": r.centreline,
                "ribbon_error": r.ribbon_error,
                "shell_error": r.shell_error,
                "same_state": r.same_state,
                "claimed": r.claimed,
                "seconds.ribbon": r.seconds["ribbon"],
                "seconds.shell": r.seconds["shell"],
            }
        )
        for name, value in (r.share or {}).items():
            row[f"share.{name}"] = value
        if r.shell_end is not None:
            for axis, value in zip("xyz", r.shell_end["position"], strict=True):
                row[f"shell_end.{axis}"] = float(value)
        rows.append(row)
    messages = [f"{own.model}: {message(own)}", *(f"w/h = {r.width_to_thickness:g}: {r.message}" for r in found.rows)]
    return {"status": worst(rows), "message": "; ".join(messages), "rows": rows}
