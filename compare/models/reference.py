"""The finest state of a model and its own error, for the errors of all its coarser ones (`ribbonbench cost`).

And the errors of a state on a mesh, from the same state on another one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from compare.measure.align import aligned
from compare.measure.distance import grid_hausdorff
from compare.measure.error import beyond, error_of_first, error_of_last
from compare.measure.grid import Grid
from compare.measure.numbers import errors_of, numbers_of
from compare.models.base import Model, Options, Shape, Size, State
from compare.models.capabilities import Reference, Refers

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter

#: Fewest elements along and across of a coarser mesh that an error is told from: one element across cannot bend the
#: section (its energies are 8 to 9 % off); and cells up to which a finer mesh is as cheap as the usual one.
COARSEST = (10, 2)
#: Parts of a share that stretch; the error of one is no more than the sum of what both change.
STRETCHING = ("membrane", "shear")
CHEAP = 1600


def reference(
    model: Model,
    scene: Scene,
    sizes: Sequence[Size],
    *,
    near: Shape | None = None,
    options: Options | None = None,
    say: Reporter | None = None,
) -> Reference:
    """The model's own `reference` (`compare.models.base.Refers`), or, of a model that has none, the `usual` one."""
    if isinstance(model, Refers):
        return model.reference(scene, sizes, near=near, options=options, say=say)
    return usual(model, scene, sizes, near=near, options=options, say=say)


def usual(
    model: Model,
    scene: Scene,
    sizes: Sequence[Size],
    *,
    near: Shape | None = None,
    options: Options | None = None,
    say: Reporter | None = None,
) -> Reference:
    """The last of `sizes` (small ones first) `cut`; where the model does not refine, that size itself, against the one
    before it: their distance bounds its error where the sizes at least halve it."""
    options = replace(options or Options(), error=False, repeats=0)
    assert options.grid is not None, "a reference's error is measured on a grid"

    def solved(size: Size) -> State:
        if say is not None:
            say.step(f"reference of the {model.name}: {size.label}")
        return model.solve(scene, size, near=near, options=options, say=say)

    state = solved(sizes[-1])
    if not state.ok:
        return Reference(state, state.size.label, None, "nothing")
    found = cut(model, state, options.grid)
    if found.state is not state:
        return found
    before = [size for size in sizes[:-1] if size.ladder == sizes[-1].ladder][-1:]
    if not before:
        return Reference(state, state.size.label, None, "nothing: there is one size")
    other = solved(before[0])
    return Reference(state, state.size.label, _apart(state, other, options.grid), _checked(other))


def cut(model: Model, state: State, grid: Grid, unit: str = "") -> Reference:
    """The state refined twice, its error from those refined once and three times: the rest as a geometric series; fewer
    times where the model does not go on (`state` itself then without an error). unit: of the sizes, in words."""
    chain = [state]
    while len(chain) < 4 and chain[-1].ok:
        finer = model.refined(chain[-1])
        if finer is None:
            break
        chain.append(finer)

    def words(of: State) -> str:
        return f"{of.size.label} {unit}".strip()

    if len(chain) < 3 or not chain[2].ok:
        error = _apart(chain[-1], state, grid) if len(chain) == 2 else None
        return Reference(chain[-1], words(chain[-1]), error, words(state) if len(chain) == 2 else "nothing")
    fine = chain[2]
    if len(chain) < 4 or not chain[3].ok:
        return Reference(fine, words(fine), None, _checked(chain[-1], words(chain[-1])))
    first, last = _apart(fine, chain[1], grid), _apart(fine, chain[3], grid)
    error = None if first is None or last is None else beyond(first, last)
    return Reference(fine, words(fine), error, words(chain[3]))


def coarser(elements: tuple[int, int]) -> tuple[int, int]:
    """Half as many elements each way, at least one."""
    return max(1, elements[0] // 2), max(1, elements[1] // 2)


def beside_mesh(elements: tuple[int, int]) -> tuple[int, int]:
    """The mesh that tells the error of another: the `coarser` one, a fourth of the cells, where that is still a mesh
    (`COARSEST`); else one of twice as many each way, or across alone where that is more than `CHEAP` cells."""
    along, across = elements
    half = coarser(elements)
    if half[0] >= COARSEST[0] and half[1] >= COARSEST[1]:
        return half
    if 4 * along * across <= CHEAP:
        return 2 * along, 2 * across
    return half if half[1] >= COARSEST[1] else (along, 2 * across)


def judged(scene: Scene, state: State, partner: State, grid: Grid | None = None) -> State:
    """A state with its errors, from the same one on another mesh: of the shape (Hausdorff / l), of energies, forces,
    moments and the lowest eigenvalue, each by its own change (`compare.measure.numbers`).

    The change to a coarser mesh bounds the state's own error as long as halving the elements more than halves the
    error; of the change to a finer one that is so of twice the change. Unknown where one is not stable, nor kept.
    """
    mesh = partner.size.label
    if not (state.stands and partner.stands) or state.shape is None or partner.shape is None:
        return replace(state, error_why=state.error_why if not state.stands else f"on {mesh} elements: {partner.word}")
    finer = math.prod(partner.size.values) > math.prod(state.size.values)
    times, chain = (2.0, (state, partner)) if finer else (1.0, (partner, state))
    grid = grid or Grid.for_shape(scene, state.shape.bend)
    points = grid.of(state.shape)
    error = times * grid_hausdorff(points, aligned(grid.of(partner.shape), points, state.motions))
    errors = errors_of([numbers_of(one) for one in chain], error_of_first if finer else error_of_last)
    here, there = (one.numbers.get("share") for one in (state, partner))
    change = None if not here or not there else times * sum(abs(here[part] - there[part]) for part in STRETCHING)
    return replace(
        state, error=error, errors=errors, error_why=f"by the change to {mesh} elements",
        numbers={**state.numbers, "share_error": change},
    )  # fmt: skip


def _apart(state: State, other: State, grid: Grid) -> float | None:
    """Distance (Hausdorff / l) of another state after the rigid motions that nothing resists; None without a shape."""
    if state.shape is None or other.shape is None or not other.ok:
        return None
    points = grid.of(state.shape)
    return grid_hausdorff(points, aligned(grid.of(other.shape), points, other.motions))


def _checked(other: State, words: str | None = None) -> str:
    words = words or other.size.label
    return words if other.ok else f"{words}: {other.word}"
