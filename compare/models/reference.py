"""The finest state of a model and its own error, for the errors of all its coarser ones (`ribbonbench cost`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from compare.measure.align import aligned
from compare.measure.distance import grid_hausdorff
from compare.measure.error import beyond
from compare.models.base import Model, Options, Reference, Shape, Size, State

if TYPE_CHECKING:
    from compare.measure.grid import Grid
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter


def reference(
    model: Model,
    scene: Scene,
    sizes: Sequence[Size],
    *,
    near: Shape | None = None,
    options: Options | None = None,
    say: Reporter | None = None,
) -> Reference:
    """The model's own `reference` (`compare.models.base.Model`), or, of a model that has none, the `usual` one."""
    own = getattr(model, "reference", None)
    if own is None:
        return usual(model, scene, sizes, near=near, options=options, say=say)
    return own(scene, sizes, near=near, options=options, say=say)  # type: ignore[no-any-return]


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


def _apart(state: State, other: State, grid: Grid) -> float | None:
    """Distance (Hausdorff / l) of another state after the rigid motions that nothing resists; None without a shape."""
    if state.shape is None or other.shape is None or not other.ok:
        return None
    points = grid.of(state.shape)
    return grid_hausdorff(points, aligned(grid.of(other.shape), points, other.motions))


def _checked(other: State, words: str | None = None) -> str:
    words = words or other.size.label
    return words if other.ok else f"{words}: {other.word}"
