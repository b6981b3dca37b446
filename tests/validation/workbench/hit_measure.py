"""How far each model is from a case's shell (`hit_cases`), on the elements of `hit_solve`.

`change` is the distance to the same model on half as many: it bounds what the discretisation leaves in a distance.
What is measured is kept in a file for each case and model (delete the folder after a change of a model).
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

from compare.measure.distance import centreline_distance, grid_hausdorff
from compare.measure.grid import Grid
from compare.registry import knows_energy
from compare.store.progress import Reporter
from tests.validation.kept_rows import KeptRows
from tests.validation.workbench.hit_cases import Case, Shell
from tests.validation.workbench.hit_solve import ELEMENTS, solve

#: From the cheapest to the dearest, the shell left out; "extensible" is measured beside them.
MODELS = ("elastica", "sadowsky", "wunderlich", "extensible", "finite")


@dataclass(frozen=True)
class Measured:
    """A model beside the shell of a case.

    hausdorff, centreline: distances over l, None where there is no state; change: of the shape on half as many elements
    (Hausdorff / l); status: the solver's word; seconds: of the first solve on `ELEMENTS`.
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
        coarser = solve(case.scene, energy, ELEMENTS // 2, say)
        if coarser is not None and coarser.is_equilibrium and coarser.shape is not None:
            change = grid_hausdorff(points, grid.of(coarser.shape))
    return Measured(energy, state.word, state.ok, distance, line, change, state.iterations, seconds)


def all_measured(
    case: Case, shell: Shell, models: Iterable[str], place: Path, say: Reporter | None = None
) -> dict[str, Measured]:
    """Every model of `models` beside the shell of a case, from `place` or kept there."""
    kept = KeptRows(place)
    return {
        energy: Measured(
            **kept.row(f"{case.name}_{energy}", lambda energy=energy: asdict(measured(case, shell, energy, say)))
        )
        for energy in models
    }
