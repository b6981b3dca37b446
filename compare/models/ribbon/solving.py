"""Solving a ribbon as its scene says: from its seed, to its tolerance, along its path."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING

from compare.models.base import Options, Seconds
from compare.models.timing import clocked, repeated

if TYPE_CHECKING:
    from compare.models.ribbon.way import Way
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from ribbon import Equilibrium


def solved(scene: Scene, options: Options, say: Reporter | None) -> tuple[Way | None, Equilibrium, Seconds]:
    """The way (None without a path), its end, and the times: of the whole way, from the first stage's seed."""
    from compare.models.ribbon.way import run_key, run_way

    leave = options.leave_saddle
    if not scene.path:
        found, seconds = clocked(solver(scene, leave), options.repeats)
        return None, found, seconds
    folder = None if options.store is None else options.store.way(run_key(scene, leave))
    detail = None if say is None else say.detail
    way, seconds = clocked(lambda: run_way(scene, folder, leave_saddle=leave, progress=detail, film=True), 0)
    if folder is not None:
        with contextlib.suppress(OSError):  # empty: the way is finished
            folder.rmdir()
    if not way.resumed:  # gone again without the folder: nothing kept may shorten it
        seconds = repeated(lambda: run_way(scene, leave_saddle=leave), seconds.first, options.repeats)
    return way, way.equilibrium, seconds


def solver(scene: Scene, leave_saddle: bool = False) -> Callable[[], Equilibrium]:
    """The whole solve of a scene without a path as a function: from the seed, to the tolerance where there is one."""
    from compare.models.ribbon.build import ribbon_arguments
    from ribbon import solve
    from ribbon.find.adaptive import solve_to_tolerance

    arguments = {**ribbon_arguments(scene), "budget": scene.model.budget}
    tolerance = scene.model.tolerance
    if tolerance is None:
        return lambda: solve(**arguments, leave_saddle=leave_saddle)
    del arguments["segments"]
    first_three = [arguments.pop(name) for name in ("strip", "clamp", "gravity")]
    strict = "model.tolerance" in scene.own_keys
    return lambda: solve_to_tolerance(
        *first_three, **arguments, tolerance=tolerance, leave_saddle=leave_saddle, strict=strict
    )
