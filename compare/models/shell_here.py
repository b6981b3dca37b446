"""The shell in this very process (or all of an mpirun), resumable: `ribbonbench shell`.

Neither the ribbon nor its numba and Ipopt are imported.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from compare.models import half_turns
from compare.models.base import State
from compare.models.effects.price import check_price
from compare.models.reference import beside_mesh, judged
from compare.models.scope import require_shell
from compare.models.shell import state_of
from compare.models.shell_build import shell_elements, shell_options, shell_problem
from compare.models.shell_process import ShellCase, event_text, shell_key, stored_case
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from ribbonbench.errors import BadInput, Missing
from ribbonbench.world import World
from shellref.inputs import ShellInputError
from shellref.path.begin import begun
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem
from shellref.shell.surface import ShellSurface


def run(scene: Scene, store: CaseStore, reporter: Reporter, world: World, iteration: str = "mixed") -> list[State]:
    """One state per w/h of the scene, the same on all processes. Finished cases are taken from `store`; an unfinished
    one goes on.

    Raises `BadInput` for what the shell cannot do, `Missing` without dolfinx; on all processes.
    """
    options = shell_options(scene, iteration=iteration)
    requested = check_price(scene)
    found = []
    for ratio in require_shell(scene):
        problem = shell_problem(scene, ratio)
        size = " x ".join(map(str, problem.elements))
        shared = f", {world.size} processes" if world.size > 1 else ""
        shared += f", {requested.text}" if requested.said else ""
        reporter.step(f"shell: w/h = {ratio:g}, {size} elements{shared}")
        state = half_turns.counted(scene, state_of(scene, _case(problem, options, store, reporter, world)))
        if state.stands and scene.shell.tolerance is None:
            state = _judged(scene, state, ratio, options, store, reporter, world)
        found.append(state)
    return found


def _judged(
    scene: Scene, state: State, ratio: float, options: ShellOptions, store: CaseStore, reporter: Reporter, world: World
) -> State:
    """The state with its errors, by another mesh that begins at it (`compare.models.shell.beside_mesh`)."""
    mesh = beside_mesh(shell_elements(scene))
    size = " x ".join(map(str, mesh))
    reporter.step(f"shell: w/h = {ratio:g}, {size} elements, for the discretisation error")
    near = replace(options, begin="given", coarse=False)
    try:
        problem = shell_problem(scene, ratio, mesh)
        case = _case(problem, near, store, reporter, world, state.native.surface)
    except BadInput as refused:  # a mesh that cannot have the held corners' knots
        return replace(state, error_why=f"on {size} elements: {refused}")
    return judged(scene, state, half_turns.counted(scene, state_of(scene, case)))


def _case(
    problem: ShellProblem,
    options: ShellOptions,
    store: CaseStore,
    reporter: Reporter,
    world: World,
    start: ShellSurface | None = None,
) -> ShellCase:
    """The finished case of a problem, solved here when there is none; start: where it begins, None: on its own."""
    key = world.on_first(lambda: shell_key(problem, options, start))
    case = world.on_first(lambda: stored_case(store, key))
    if case is not None:
        return case
    holder: Any = store.unfinished(key, lambda: reporter.step("another run works on this case: waiting for it"))
    unfinished = world.on_first(holder.__enter__)
    error: BaseException | None = None
    try:
        case = world.on_first(lambda: stored_case(store, key))  # finished by the run that was waited for
        if case is None:
            case = _solve(problem, options, store, key, unfinished.folder, reporter, world, start)
        return case
    except BaseException as raised:
        error = raised
        raise
    finally:
        if world.first:
            holder.__exit__(type(error) if error else None, error, error.__traceback__ if error else None)


def _solve(
    problem: ShellProblem,
    options: ShellOptions,
    store: CaseStore,
    key: str,
    folder: Path,
    reporter: Reporter,
    world: World,
    start: ShellSurface | None,
) -> ShellCase:
    """Solves, with checkpoints in `folder`, and keeps the case."""
    try:
        found = begun(
            problem,
            options,
            lambda event: reporter.detail(event_text(event) or ""),
            start=start,
            folder=folder / "path",
            processes="world" if world.size > 1 else "self",
        )
    except ShellInputError as error:
        raise BadInput(f"shell.{error.key}", error.value, "cannot be used", error.remedy) from None
    except ImportError as error:
        raise Missing(str(error), "") from None
    result, extra = found.result, {"start": found.how, "begun": found.notes}
    kept = world.on_first(lambda: store.put(key, lambda place: result.save(place, "shell", extra)))
    data = world.on_first(lambda: {**result.to_dict(), **extra})
    return ShellCase(data, kept, False)
