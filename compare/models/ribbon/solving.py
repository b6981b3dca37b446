"""Solving a ribbon as its scene says: from its seed, to its tolerance, along its path."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.models.base import Options, Seconds, State
from compare.models.timing import clocked, repeated

if TYPE_CHECKING:
    from compare.models.capabilities import FloatArray, Line
    from compare.models.ribbon.stages import LoadPath
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from ribbon import Equilibrium


def solved(scene: Scene, options: Options, say: Reporter | None) -> tuple[LoadPath | None, Equilibrium, Seconds]:
    """The way (None without a path), its end, and the times: of the whole way, from the first stage's seed. A way
    downhill of a drawn curve is kept as a path's."""
    from compare.models.ribbon.stages import run_key, run_way

    leave = bool(options.leave_saddle)
    if not (scene.path or _goes_a_way(scene)):
        found, seconds = clocked(solver(scene, leave), options.repeats)
        return None, found, seconds
    folder = None if options.store is None else options.store.way(run_key(scene, leave))
    detail = None if say is None else say.detail
    path, seconds = clocked(
        lambda: run_way(scene, folder, leave_saddle=leave, progress=detail, film=bool(scene.path)), 0
    )
    if folder is not None:
        with contextlib.suppress(OSError):  # empty: the way is finished
            folder.rmdir()
    if not path.resumed:  # gone again without the folder: nothing kept may shorten it
        seconds = repeated(lambda: run_way(scene, leave_saddle=leave), seconds.first, options.repeats)
    if not scene.path:
        return None, replace(path.equilibrium, log=()), seconds
    return path, path.equilibrium, seconds


def _goes_a_way(scene: Scene) -> bool:
    """Whether a scene without a path is solved by a long way too, which is kept and told."""
    return scene.seed.curve is not None or scene.follows


def solver(scene: Scene, leave_saddle: bool = False) -> Callable[[], Equilibrium]:
    """The whole solve of a scene without a path as a function: from the seed, to the tolerance where there is one."""
    from compare.models.ribbon.build import ribbon_arguments
    from ribbon import solve
    from ribbon.find.adaptive import solve_to_tolerance

    if _goes_a_way(scene):
        from compare.models.ribbon.stages import run_way

        return lambda: replace(run_way(scene, leave_saddle=leave_saddle).equilibrium, log=())
    arguments = {**ribbon_arguments(scene), "budget": scene.model.budget}
    tolerance = scene.model.tolerance
    if tolerance is None:
        return lambda: solve(**arguments, leave_saddle=leave_saddle)
    del arguments["segments"]
    first_three = [arguments.pop(name) for name in ("strip", "clamp", "gravity")]
    return lambda: solve_to_tolerance(
        *first_three, **arguments, tolerance=tolerance, leave_saddle=leave_saddle, strict=scene.strict
    )


def together(scene: Scene) -> Hashable | None:
    """What scenes have in common that `solved_together` solves at once; None: the scene asks for more than the state of
    a ribbon that is held at s = 0 only."""
    from compare.models.ribbon.build import ribbon_energy
    from compare.models.ribbon.free import per_thickness

    model = scene.model
    held = scene.start_clamped and scene.clamp_end is None and scene.closure is None and not scene.barriers
    if _goes_a_way(scene):
        return None
    exact = scene.gravity is not None and scene.gravity.exact
    if not held or exact or scene.path or model.tolerance is not None or model.accuracy is not None:
        return None
    if model.solver == "ipopt" or model.formulation not in ("auto", "chained") or per_thickness(scene):
        return None
    return ribbon_energy(scene), model.lengths, model.stiffness, model.in_plane, model.budget, model.solver


def solved_together(scenes: Sequence[Scene]) -> list[State]:
    """States of scenes with the same `together`, each as `RibbonModel.solve` finds it, to the last digit.

    Raises what the solver refuses of one of them (`RibbonInputError`), for all.
    """
    from compare.models.ribbon.build import ribbon_arguments
    from compare.models.ribbon.state import own_size, state_of
    from ribbon import solve_many
    from ribbon.solvers import choose

    given = [ribbon_arguments(scene) for scene in scenes]
    each: dict[str, Any] = {name: [arguments[name] for arguments in given] for name in ("clamp", "gravity", "tip")}
    same: dict[str, Any] = {name: given[0][name] for name in ("energy", "segments", "stiffness", "in_plane")}
    with choose.using(scenes[0].model.solver):
        many = solve_many(
            [arguments["strip"] for arguments in given], **each, **same,
            seeds=[(arguments["seed_curvature"], arguments["seed_ruling"]) for arguments in given],
            budget=scenes[0].model.budget, threads=1,
        )  # fmt: skip
    return [
        state_of(scene, found, own_size(found), Seconds(sum(found.seconds.values())))
        for scene, found in zip(scenes, many.found, strict=True)
    ]


def solved_line(
    gamma: FloatArray, curvature: FloatArray, solved: Callable[[Sequence[int]], Sequence[State]]
) -> Line | None:
    """As `compare.models.capabilities.Lines`: `ribbon.find.solving.neighbours`."""
    from compare.models.capabilities import Line
    from ribbon.find.solving import neighbours

    alone: dict[int, State] = {}

    def native(places: Sequence[int]) -> list[Equilibrium]:
        states = solved(places)
        alone.update(zip(places, states, strict=True))
        return [state.native for state in states]

    found = neighbours.along(gamma, curvature, native)
    if found is None:
        return None
    return Line(alone, _columns(found.numbers, gamma, np.asarray(alone[0].native.problem.gravity.up)))


def _columns(numbers: FloatArray, gamma: FloatArray, up: FloatArray) -> dict[str, FloatArray]:
    """The numbers (k, NUMBERS) of a line by the names of a sweep's columns; the clamp carries the weight Gamma up."""
    from ribbon.solvers import chained_line as at

    elastic, weight = numbers[:, at.BENDING] + numbers[:, at.NATURAL], gamma[:, None] * up
    found = {
        "residual": numbers[:, at.REST], "iterations": numbers[:, at.STEPS],
        "lowest_eigenvalue": numbers[:, at.LOWEST], "max_abs_eta": numbers[:, at.STEEPEST],
        "energy.elastic": elastic, "energy.gravity": numbers[:, at.WEIGHT],
        "energy.total": elastic + numbers[:, at.WEIGHT],
    }  # fmt: skip
    moment = np.cross(numbers[:, at.MOMENT : at.MOMENT + 3], weight)
    vectors = {"end": numbers[:, at.END :], "middle": numbers[:, at.MIDDLE :], "force.start": weight}
    for name, vector in {**vectors, "moment.start": moment}.items():
        found |= {f"{name}.{axis}": vector[:, k] for k, axis in enumerate("xyz")}
    return found
