"""Several strips on shorter segments: how far their state is from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ribbon.find.strips import rubbing, sliding, solve
from ribbon.find.strips.result import StripsEquilibrium


def refined(state: StripsEquilibrium, parts: int = 2) -> StripsEquilibrium:
    """The same strips on segments cut into `parts`, begun at `state`."""
    old = state.problem
    fresh = old.with_parts(
        [{"lengths": np.repeat(part.lengths / parts, parts), "touching": (), "rubs": ()} for part in old.parts]
    )
    if state.before is not None and old.apart:
        return sliding.finer(fresh, state)
    if state.before is not None:
        return rubbing.finer(fresh, state)
    return solve.begun_near(fresh, solve.carried(state, fresh))


def with_error(state: StripsEquilibrium) -> StripsEquilibrium:
    """The state with its distance from the same strips on segments half as long; not known where they find none."""
    if not state.ok:
        return state
    finer = refined(state)
    return replace(state, error=solve.distance(state, finer)) if finer.ok else state
