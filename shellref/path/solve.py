"""From a problem to a result: the path to the full load in adaptive steps, stability, report; refined when asked."""

from __future__ import annotations

import os
import time

from shellref.inputs import ShellInputError
from shellref.path.solver import Progress, Solver
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem
from shellref.shell.result import ShellResult, ShellStatus
from shellref.shell.strip import build_strip
from shellref.shell.surface import ShellSurface


def solve(
    problem: ShellProblem,
    options: ShellOptions | None = None,
    progress: Progress | None = None,
    start: ShellSurface | None = None,
    processes: str = "self",
    folder: str | os.PathLike[str] | None = None,
) -> ShellResult:
    """Equilibrium of a strip under its clamps, natural curvature and weight (units: see ShellProblem, ShellResult).

    `progress` is called with a plain dict at every event ("built", "step", "kick", "mesh", "done"). start: begin at
    this surface, at the full load, instead of walking the path. processes: "self", or "world" for all of an mpirun.
    folder: keep the log and checkpoints there and resume what an interrupted run of the same problem left. A load step
    that cannot be made is a status of the result, not an exception. Raises `ShellInputError` when the mesh cannot carry
    the clamps, or a band that is joined after half turns has no start; `dolfinx_api.DolfinxMissing` where it is not
    there.
    """
    options = options or ShellOptions()
    strip = build_strip(problem, options)
    begin = time.perf_counter()
    from shellref.fenics import dolfinx_api as api

    imported = time.perf_counter()
    comm = api.communicator(processes)
    report = progress if progress is not None and comm.rank == 0 else (lambda event: None)
    if ((problem.released and not problem.closed) or problem.transverse_curvature) and comm.size > 1:
        raise ShellInputError("processes", comm.size, "edges that slide, turn or deform need one process")
    if problem.twisted and comm.size > 1:
        raise ShellInputError("processes", comm.size, "a moment at the end needs one process")
    if problem.half_turns and start is None:
        remedy = "a twisted band begins at a surface: use shellref.path.begin.begun, which finds one"
        raise ShellInputError("half_turns", problem.half_turns, remedy)
    solver = Solver(strip, options, comm, report)
    if options.accuracy is not None and options.goal != "surface":
        from shellref.path.weighted import check

        check(solver)  # before anything is solved
    built = time.perf_counter()
    result = solver.run(start, folder)
    if options.accuracy is not None and result.status is ShellStatus.CONVERGED:
        if options.goal == "surface":
            from shellref.path.adaptive import refine  # not loaded where no accuracy is asked for
        else:
            from shellref.path.graded import refine
        result = refine(result, solver)
    if solver.unfinished is not None:
        solver.unfinished.finish()
    seconds = {"import": imported - begin, "compile": built - imported, **result.seconds}
    result = result.with_seconds({**seconds, "total": time.perf_counter() - begin})
    report(
        {"event": "done", "status": result.status.value, "message": result.message, "seconds": result.seconds["total"]}
    )
    return result
