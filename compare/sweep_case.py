"""One point of a sweep: the solver runs, and what it finds becomes rows of plain numbers.

This runs in a worker process; nothing that a case does ends the sweep: every end is a record with a status.
"""

from __future__ import annotations

import errno
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compare.errors import BadInput, Missing, RibbonbenchError
from compare.provenance import now
from compare.scene import Scene
from compare.store import disk_full

Record = dict[str, Any]
Row = dict[str, Any]

#: Ends of a case at which a second try could find something else: they are not kept as finished.
PASSING = ("crashed", "error", "missing")


@dataclass(frozen=True)
class Task:
    """What a worker gets: the case's key and scene, the solver and its options, the folder of the sweep's results."""

    key: str
    scene: Scene
    solver: str
    errors: bool
    leave_saddle: bool
    folder: str


def run_case(task: Task) -> Record:
    """The record of a case: `status`, `message`, `rows`, `seconds` (wall time of the whole case, s), `time`.

    status: the solver's own word; "refused" (bad input that only the solver sees), "missing" (a library), "error"
    (anything else), with the message. `disk_full` holds the errno of a disk that took nothing more.
    """
    clock = time.perf_counter()
    record: Record = {"status": "error", "message": "", "rows": []}
    try:
        record.update(_SOLVERS[task.solver](task))
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


def _pose(row: Row, name: str, position: Any) -> None:
    for axis, value in zip("xyz", position, strict=True):
        row[f"{name}.{axis}"] = float(value)


def _reach(scene: Scene, row: Row, end: Any) -> None:
    """y / x: how far the free end hangs below the start, over its horizontal distance from it (thesis, 4.5)."""
    import numpy as np

    if scene.up is None or scene.start_position is None or scene.end_position is not None:
        return
    way = np.asarray(end, dtype=float) - scene.start_position
    drop = -float(way @ scene.up)
    across = float(np.linalg.norm(way + drop * scene.up))
    if across > 0.0:
        row["y_over_x"] = drop / across


def _energy(row: Row, energy: Mapping[str, Any]) -> None:
    for name in ("bending", "membrane", "shear", "elastic", "gravity", "total"):
        if energy.get(name) is not None:
            row[f"energy.{name}"] = float(energy[name])


def _ribbon(task: Task) -> Record:
    import numpy as np

    e = _equilibrium(task)
    row: Row = {
        "status": e.status.code,
        "stable": e.stable,
        "residual": float(e.residual),
        "iterations": int(e.iterations),
        "segments": int(e.problem.lengths.size),
        "lowest_eigenvalue": None if e.lowest_eigenvalue is None else float(e.lowest_eigenvalue),
        "max_abs_eta": float(e.max_abs_eta),
    }
    _energy(row, {name: getattr(e.energy, name) for name in ("elastic", "gravity", "total")})
    _pose(row, "end", e.end.position)
    _pose(row, "middle", e.middle.position)
    _reach(task.scene, row, e.end.position)
    if task.errors:
        from compare.comparison import Grid, ribbon_discretisation_error
        from compare.progress import Reporter

        grid = Grid.for_shape(task.scene, float(np.abs(e.omega(np.linspace(0.0, 1.0, 2001))).max()))
        row["error"] = ribbon_discretisation_error(e, grid, Reporter(quiet=True))
    return {"status": row["status"], "message": e.message, "rows": [row]}


def _equilibrium(task: Task) -> Any:
    """One solve of the scene's ribbon, along its path where it has one."""
    from compare.build import check_model, ribbon_arguments
    from compare.way import run_way
    from ribbon import solve
    from ribbon.adaptive import solve_to_tolerance

    scene, leave = task.scene, task.leave_saddle
    check_model(scene)
    if scene.path:
        return run_way(scene, leave_saddle=leave).equilibrium
    arguments = ribbon_arguments(scene)
    if scene.model.tolerance is None:
        return solve(**arguments, leave_saddle=leave)
    del arguments["segments"]
    first_three = [arguments.pop(name) for name in ("strip", "clamp", "gravity")]
    return solve_to_tolerance(*first_three, **arguments, tolerance=scene.model.tolerance, leave_saddle=leave)


def _elastica(task: Task) -> Record:
    import numpy as np

    from compare.run import elastica_problem
    from shellref.elastica import embed, solve

    scene = task.scene
    r = solve(elastica_problem(scene), estimate_error=task.errors)
    end, middle = embed(r, np.asarray(scene.position), scene.frame, np.array([1.0, 0.5]))
    known = r.status.value != "limit_point"
    datum = 0.0 if scene.up is None else scene.gamma * float(scene.position @ scene.up)
    row: Row = {
        "status": r.status.value,
        "stable": r.stable if known else None,
        "residual": float(r.residual),
        "iterations": int(r.iterations),
        "segments": len(r.nodes) - 1,
        "lowest_eigenvalue": None if r.lowest_eigenvalue is None else float(r.lowest_eigenvalue),
        "max_abs_eta": 0.0,
    }
    _energy(
        row,
        {"elastic": r.energy.bending, "gravity": r.energy.gravity + datum, "total": r.energy.total + datum},
    )
    _pose(row, "end", end)
    _pose(row, "middle", middle)
    _reach(scene, row, end)
    if task.errors:
        row["error"] = r.error
    return {"status": row["status"], "message": r.message, "rows": [row]}


def _shell(task: Task) -> Record:
    from compare.shell_build import natural_constant, shell_options, shell_problem
    from compare.shell_process import run_shell
    from compare.store import CaseStore

    scene = task.scene
    rows: list[Row] = []
    messages: list[str] = []
    for ratio in scene.require_shell():
        case = run_shell(shell_problem(scene, ratio), CaseStore(Path(task.folder) / "cases"), shell_options(scene))
        data = case.data
        row: Row = {"width_to_thickness": float(ratio), "status": case.status, "stable": data.get("stable")}
        if case.status == "converged" and not case.ok:
            row["status"] = "unstable"
        if case.status == "converged":  # otherwise the state is that of another load
            row.update(_shell_numbers(data, natural_constant(scene)))
            _reach(scene, row, data["end"]["position"])
        rows.append(row)
        messages.append(f"w/h = {ratio:g}: {data.get('message', '')}")
    return {"status": _worst(rows), "message": "; ".join(messages), "rows": rows}


def _shell_numbers(data: Mapping[str, Any], constant: float) -> Row:
    row: Row = {"residual": (data.get("residual") or {}).get("relative"), "iterations": data.get("newton_iterations")}
    if data.get("lowest_eigenvalue") is not None:
        row["lowest_eigenvalue"] = float(data["lowest_eigenvalue"])
    if data.get("elements"):
        row["elements"] = " x ".join(str(number) for number in data["elements"])
    energy = dict(data.get("energy") or {})
    if "elastic" in energy:
        energy["elastic"] -= constant
    if "total" in energy:
        energy["total"] -= constant
    _energy(row, energy)
    for name, value in (data.get("share") or {}).items():
        row[f"share.{name}"] = value
    for name in ("end", "middle"):
        if data.get(name):
            _pose(row, name, data[name]["position"])
    row["error"] = (data.get("discretisation") or {}).get("estimate")
    return row


def _compare(task: Task) -> Record:
    from compare.comparison import compare
    from compare.progress import Reporter
    from compare.store import CaseStore

    root = Path(task.folder) / "cases"
    if task.scene.path:  # the state of an unfinished path stands beside the cases: one place for each
        root = root / f"path-{task.key[:16]}" / "cases"
    found = compare(task.scene, CaseStore(root), Reporter(quiet=True), leave_saddle=task.leave_saddle)
    e = found.ribbon.equilibrium
    rows: list[Row] = []
    for r in found.rows:
        row: Row = {
            "width_to_thickness": r.width_to_thickness,
            "status": r.status if e.ok else e.status.code,
            "stable": r.stable,
            "ribbon.status": e.status.code,
            "ribbon.stable": e.stable,
            "hausdorff": r.hausdorff,
            "centreline": r.centreline,
            "ribbon_error": r.ribbon_error,
            "shell_error": r.shell_error,
            "claimed": r.claimed,
            "residual": float(e.residual),
            "iterations": int(e.iterations),
            "lowest_eigenvalue": e.lowest_eigenvalue,
            "max_abs_eta": float(e.max_abs_eta),
            "seconds.ribbon": r.seconds["ribbon"],
            "seconds.shell": r.seconds["shell"],
        }
        _energy(row, {name: getattr(e.energy, name) for name in ("elastic", "gravity", "total")})
        for name, value in (r.share or {}).items():
            row[f"share.{name}"] = value
        _pose(row, "end", e.end.position)
        _pose(row, "middle", e.middle.position)
        _reach(task.scene, row, e.end.position)
        if r.shell_end is not None:
            _pose(row, "shell_end", r.shell_end["position"])
        rows.append(row)
    messages = [f"ribbon: {e.message}", *(f"w/h = {r.width_to_thickness:g}: {r.message}" for r in found.rows)]
    return {"status": _worst(rows), "message": "; ".join(messages), "rows": rows}


def _worst(rows: list[Row]) -> str:
    """ "converged" when every row is; else the first other status, a passing one before the others."""
    others = [str(row["status"]) for row in rows if row["status"] != "converged"]
    passing = [status for status in others if status in PASSING]
    return (passing or others or ["converged"])[0]


_SOLVERS = {"ribbon": _ribbon, "elastica": _elastica, "shell": _shell, "compare": _compare}
