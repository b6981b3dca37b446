"""How far each model is from a case's shell (`hit_cases`), on elements so fine that their own error does not count.

Elements: `ELEMENTS`, shorter towards every end that a clamp holds (first one 2.5 w / ELEMENTS, each 1.5 times the one
before it until they are equal). `change` is the distance to the same model on twice as many: what the discretisation
leaves in a distance.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.errors import BadInput
from compare.measure.distance import centreline_distance, grid_hausdorff
from compare.measure.grid import Grid
from compare.models.base import Options, State
from compare.registry import knows_energy, model, name_for
from compare.scene.scene import Scene
from compare.scene.spec import graded_lengths
from compare.store.progress import Reporter
from ribbon.energies.names import FREE
from tests.validation.workbench.hit_cases import Case, Shell

FloatArray = NDArray[np.float64]

#: From the cheapest to the dearest, the shell left out; "extensible" is measured beside them.
MODELS = ("elastica", "sadowsky", "wunderlich", "extensible", "finite")
ELEMENTS = 40
_FIRST = 2.5


@dataclass(frozen=True)
class Measured:
    """A model beside the shell of a case.

    hausdorff, centreline: distances over l, None where there is no state; change: of the shape with twice as many
    elements (Hausdorff / l); status: the solver's word; seconds: of the first solve on `ELEMENTS`.
    """

    model: str
    status: str
    ok: bool
    hausdorff: float | None
    centreline: float | None
    change: float | None
    iterations: int | None
    seconds: float | None


def available() -> tuple[str, ...]:
    """The models of `MODELS` that are there."""
    return tuple(name for name in MODELS if knows_energy(name))


def lengths(scene: Scene, elements: int) -> list[float]:
    """Lengths of the elements in the scene's unit, shorter at each end whose frame is held."""
    first = _FIRST * scene.width / elements
    both = scene.end_frame is not None
    parts = graded_lengths(elements // 2, 2.0 * first) if both else graded_lengths(elements, first)
    whole = [0.5 * part for part in (*parts, *reversed(parts))] if both else list(parts)
    return [scene.strip.length * part for part in whole]


def with_model(scene: Scene, energy: str, elements: int = ELEMENTS) -> Scene:
    """The scene for one model on this many elements."""
    if energy == "elastica":
        return scene.replace({"model.energy": energy, "model.elements": elements})
    keys: dict[str, Any] = {"model.energy": energy, "model.element_lengths": lengths(scene, elements)}
    if energy in FREE and energy != "finite":  # knows no ruling
        held = (("start", scene.clamp_start), ("end", scene.clamp_end))
        keys |= {f"clamp.{end}.ruling": None for end, clamp in held if clamp is not None}
    return scene.replace(keys)


def solve(scene: Scene, energy: str, elements: int = ELEMENTS, say: Reporter | None = None) -> State | None:
    """The state of a model; None where it refuses the scene."""
    found = model(name_for(energy))
    try:
        asked = with_model(scene, energy, elements)
        refused = found.refusal(asked)
        if refused is not None:
            return None
        return found.solve(asked, options=Options(leave_saddle=energy != "elastica"), say=say)  # type: ignore[no-any-return]
    except BadInput:
        return None


def measured(case: Case, shell: Shell, energy: str, say: Reporter | None = None) -> Measured:
    """A model beside the shell of a case."""
    clock = time.perf_counter()
    state = solve(case.scene, energy, ELEMENTS, say)
    seconds = time.perf_counter() - clock
    if state is None:
        return Measured(energy, "refused", False, None, None, None, None, None)
    distance = line = change = None
    if state.is_equilibrium and state.shape is not None and shell.state.ok and shell.state.shape is not None:
        grid = Grid.for_shape(case.scene, max(state.shape.bend, shell.state.shape.bend))
        points = grid.of(state.shape)
        distance = grid_hausdorff(points, grid.of(shell.state.shape))
        line = centreline_distance(state.shape.centreline(grid.s), shell.state.shape.centreline(grid.s))
        finer = solve(case.scene, energy, 2 * ELEMENTS, say)
        if finer is not None and finer.is_equilibrium and finer.shape is not None:
            change = grid_hausdorff(points, grid.of(finer.shape))
    return Measured(energy, state.word, state.ok, distance, line, change, state.iterations, seconds)


def all_measured(case: Case, shell: Shell, models: Iterable[str], say: Reporter | None = None) -> dict[str, Measured]:
    """Every model of `models` beside the shell of a case."""
    return {energy: measured(case, shell, energy, say) for energy in models}
