"""`ribbonbench shell`: the shell alone, in this very process (or all of an mpirun), resumable, and its result.json.

Neither the ribbon nor its numba and Ipopt are imported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compare.errors import BadInput, Missing
from compare.models.shell_build import natural_constant, shell_elements, shell_options, shell_problem
from compare.models.shell_process import ShellCase, event_text, shell_key, stored_case
from compare.scene.scene import Scene
from compare.store.made_by import provenance
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.store.world import World
from shellref.inputs import ShellInputError
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem


@dataclass(frozen=True)
class ShellRun:
    """One w/h: its case (the same on all processes) and the problem solved."""

    width_to_thickness: float
    problem: ShellProblem
    options: ShellOptions
    case: ShellCase

    @property
    def ok(self) -> bool:
        """Converged and not known to be unstable."""
        return self.case.ok

    @property
    def status(self) -> str:
        """The shell's word; a converged state that is not stable is "unstable"."""
        return self.case.status if self.ok or self.case.status != "converged" else "unstable"


def run(scene: Scene, store: CaseStore, reporter: Reporter, world: World, iteration: str = "mixed") -> list[ShellRun]:
    """One run per w/h of the scene. Finished cases are taken from `store`; an unfinished one goes on.

    Raises `BadInput` for what the shell cannot do, `Missing` without dolfinx; on all processes.
    """
    options = shell_options(scene, iteration=iteration)
    found = []
    for ratio in scene.require_shell():
        problem = shell_problem(scene, ratio)
        size = " x ".join(map(str, problem.elements))
        shared = f", {world.size} processes" if world.size > 1 else ""
        reporter.step(f"shell: w/h = {ratio:g}, {size} elements{shared}")
        found.append(ShellRun(ratio, problem, options, _case(problem, options, store, reporter, world)))
    return found


def _case(
    problem: ShellProblem, options: ShellOptions, store: CaseStore, reporter: Reporter, world: World
) -> ShellCase:
    """The finished case of a problem, solved here when there is none."""
    key = world.on_first(lambda: shell_key(problem, options))
    case = world.on_first(lambda: stored_case(store, key))
    if case is not None:
        return case
    holder: Any = store.unfinished(key, lambda: reporter.step("another run works on this case: waiting for it"))
    unfinished = world.on_first(holder.__enter__)
    error: BaseException | None = None
    try:
        case = world.on_first(lambda: stored_case(store, key))  # finished by the run that was waited for
        if case is None:
            case = _solve(problem, options, store, key, unfinished.folder, reporter, world)
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
) -> ShellCase:
    """Solves, with checkpoints in `folder`, and keeps the case."""
    try:
        from shellref.path.solve import solve

        result = solve(
            problem,
            options,
            lambda event: reporter.detail(event_text(event) or ""),
            processes="world" if world.size > 1 else "self",
            folder=folder / "path",
        )
    except ShellInputError as error:
        raise BadInput(f"shell.{error.key}", error.value, "cannot be used", error.remedy) from None
    except ImportError as error:
        raise Missing(str(error), "") from None
    kept = world.on_first(lambda: store.put(key, lambda place: result.save(place, "shell", {"start": "path"})))
    data = world.on_first(lambda: {**result.to_dict(), "start": "path"})
    return ShellCase(data, kept, False)


# -- result.json ------------------------------------------------------------------------------------------------------


def _energy(scene: Scene, data: dict[str, Any]) -> dict[str, Any]:
    """Parts in D w / l; `elastic` without the constant of the natural curvature, like the ribbon's.

    The constant belongs to the whole natural curvature: a state that has not got it has no such energy.
    """
    energy = dict(data["energy"])
    whole = abs(data["natural_factor"] - 1.0) < 1e-12
    elastic = energy["elastic"] - natural_constant(scene) if whole else None
    return {
        "elastic": elastic,
        "gravity": energy["gravity"],
        "total": None if elastic is None else elastic + energy["gravity"],
        "bending": energy["bending"],
        "membrane": energy["membrane"],
        "shear": energy["shear"],
        "elastic_with_constant": energy["elastic"],
    }


def entry(scene: Scene, found: ShellRun) -> dict[str, Any]:
    """The contract's keys of one run."""
    data = found.case.data
    clamps = data["clamps"]
    spent = data["seconds"]
    free = {"force": None, "moment": None}
    start, end = clamps.get("start", free), clamps.get("end", free)
    return {
        "width_to_thickness": found.width_to_thickness,
        "status": found.status,
        "message": data["message"],
        "stable": data["stable"],
        "negative_eigenvalues": data["negative_eigenvalues"],
        "lowest_eigenvalue": data["lowest_eigenvalue"],
        "residual": data["residual"]["relative"],
        "residual_absolute": data["residual"]["absolute"],
        "iterations": data["newton_iterations"],
        "factorisations": data["factorisations"],
        "energy": _energy(scene, data),
        "share": data["share"],
        "end": data["end"],
        "middle": data["middle"],
        "max_abs_eta": None,
        "max_abs_eta_prime_w_half": None,
        "forces": {"start": start["force"], "end": end["force"], "walls": []},
        "moments": {"start": start["moment"], "end": end["moment"]},
        "load_factor": data["load_factor"],
        "path_factor": data["path_factor"],
        "discretisation": data["discretisation"],
        "seconds": {"first": spent["total"], "warm": found.case.seconds, "parts": spent},
        "memory_mb": data["memory_mb"],
        "model": {
            "energy": "naghdi",
            "formulation": found.options.iteration,
            "elements": data["elements"],
            "unknowns": data["dofs"],
            "clamp": found.problem.clamp,
            "corner": found.problem.corner,
            "start_curvature": found.problem.start_curvature,
        },
        "start": found.case.start,
        "reused": found.case.reused,
    }


def result(scene: Scene, runs: Sequence[ShellRun]) -> dict[str, Any]:
    """`result.json`: the keys of the last run, all of them in `rows` where there are several."""
    rows = [entry(scene, found) for found in runs]
    shell = runs[-1].case.data["provenance"]
    options = {**runs[-1].options.to_dict(), "processes": shell["processes"]}
    document = {"scene": scene.name, "title": scene.title, **rows[-1]}
    if len(rows) > 1:
        document["rows"] = rows
    document["complete"] = all(found.ok for found in runs)
    document["provenance"] = {**provenance(scene, options), "shell": shell, "linear_solver": shell["linear_solver"]}
    return document


__all__ = ["ShellRun", "entry", "result", "run", "shell_elements"]
