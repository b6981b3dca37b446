"""Whether two models of a scene are in one state: the question before any distance between them.

A shell that rests near by, within `APART`, is taken to be in the ribbon's state, wherever it began. Where it is farther
the question is asked the other way round, which costs one solve of the ribbon: it begins at the shell's shape (its
curvature and twist), on its own elements and, where the shell did not settle at the ribbon's surface, on finer ones. It
may

- come back to its own state, within `APART`, on all of them: both are in one state, however far the models are from
  each other (few elements may be too long for a fold that finer ones hold). Its discretisation error may be more than
  that: a state within that error is its own only if its energy is too, within the energy's error on finer elements and
  to rounding on the same ones, where one state has one energy;
- rest in another state of its own, whose distance to the shell is less than half of that of the first: the shell is in
  that one, and how far it is from the ribbon's first state says nothing about the models;
- rest anywhere else, or nowhere: not known.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from compare.measure.align import Motions, aligned, both
from compare.measure.distance import grid_hausdorff
from compare.measure.grades import GOOD_UP_TO
from compare.models.base import BESIDE
from compare.models.capabilities import Rests

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from compare.measure.grid import Grid
    from compare.models.base import Model, State
    from compare.scene.scene import Scene

#: Distance (Hausdorff / l) up to which two models are taken to be in one state: states that differ by less are no
#: matter to the grades, whose `good` ends there.
APART = GOOD_UP_TO["distance"]
#: Part of the distance between ribbon and shell below which the ribbon has not moved (nor by `APART`), and a nearer
#: state is nearer.
HALF = 0.5
#: Difference of the total energies of one state on the same elements, relative (at least 1 D w / l).
ROUNDING = 1e-6
#: Into how many parts the ribbon's elements are cut for it, one after the other until it is decided: a fold beside a
#: clamp may be shorter than they are.
FINER = (1, 4)
#: How a start is called that was believed and from which the shell went directly (`compare.models.shell.START`).
SETTLED = (BESIDE, f"{BESIDE} (as the coarse path)")


@dataclass(frozen=True)
class Counterpart:
    """The state of the model beside that is nearest the shell's: its total energy (D w / l), its distance (/ l)."""

    energy: float | None
    distance: float


@dataclass(frozen=True)
class Same:
    """answer: whether two states are the same one, None: not known; why: how that was found, or why it was not; again:
    what came of a shell that began once more at the surface of the model beside it, "" where none did."""

    answer: bool | None
    why: str
    counterpart: Counterpart | None = None
    again: str = ""


def same_state(beside: Model, scene: Scene, fast: State, shell: State, grid: Grid) -> Same:
    """Whether a shell's state is that of the model `beside` it; scene: the one that `fast` is of."""
    if not shell.stands or shell.shape is None or not fast.stands or fast.shape is None:
        return Same(None, "one of the models has no stable state")
    there = grid.of(shell.shape)
    motions = both(fast.motions, shell.motions)
    apart = _apart(fast, there, grid, motions)
    settled = shell.start in SETTLED
    if apart <= APART:
        where = f"the shell settled at the surface of the {fast.model}" if settled else "nearer than states are apart"
        return Same(True, where)
    if fast.kept or shell.kept or not isinstance(beside, Rests):  # nothing comes to rest beside a saddle
        if settled:
            return Same(True, f"the shell settled from the surface of the {fast.model}")
        return Same(None, f"not checked: the {fast.model} cannot begin at the shell's shape")
    found = Same(None, f"the {fast.model} finds no stable state from the shell's shape")
    own = Same(True, f"begun at the shell's shape the {fast.model} comes back to its own state")
    for finer in FINER:
        back = beside.rests(scene, fast, shell.shape, finer)
        if back is None or back.shape is None:
            continue
        moved = _apart(back, grid.of(fast.shape), grid, motions)
        within = (fast.error or 0.0) if _alike(fast, back, finer) else 0.0
        if moved <= max(min(HALF * apart, APART), within):
            if settled:
                return own
            found = own
            continue
        nearer = _apart(back, there, grid, motions)
        known = Counterpart(None if back.energy is None else back.energy.total, nearer)
        if nearer <= HALF * apart:
            return Same(False, f"begun at the shell's shape the {fast.model} rests there, in another state", known)
        found = Same(None, f"begun at the shell's shape the {fast.model} rests in a third state", known)
    return found


def _alike(fast: State, back: State, finer: int) -> bool:
    """Whether the total energies of a state and of one on its elements cut into `finer` parts are one within their
    error; not where that is not known."""
    if fast.energy is None or back.energy is None:
        return False
    one, other = fast.energy.total, back.energy.total
    error = (fast.errors.get("energy") or {}).get("total")
    if one is None or other is None:
        return False
    if finer == 1:
        error = ROUNDING * max(1.0, abs(one))
    return error is not None and bool(abs(one - other) <= error)


def _apart(state: State, there: NDArray[np.float64], grid: Grid, motions: Motions | None) -> float:
    """Distance (Hausdorff / l) of a state to points (k, m, 3), moved as free motions allow."""
    assert state.shape is not None
    return grid_hausdorff(aligned(grid.of(state.shape), there, motions), there)
