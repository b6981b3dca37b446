"""What every effect of a scene, on or off, is worth: how far it moves the strip, what it holds, what it costs.

Moves are the model's own, to first order (`compare.models.capabilities.Prices`), with those of whole solves beside them
where these were made (`compare.studies.effects_measured`). What an effect costs is a difference of whole solves with
and without it, in CPU time and in turns: the median of the differences and half the distance of their quartiles. The
first of each, and every solve in which a kernel was compiled, does not count; pairs that take long are not repeated.
The whole solves with and without an effect tell its move too, whether it is on or off.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from compare.models.base import Options
from compare.models.capabilities import NotDifferentiable, Priced, Prices
from compare.models.choice import chosen
from compare.models.timing import compiled
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.studies.effects import Explanation
from compare.studies.effects_measured import Pair, Solves, between
from ribbonbench.clock import within
from ribbonbench.errors import BadInput

#: Pairs of solves of one effect at most, and the time (s) after which no other pair is begun.
PAIRS = 7
SPENT = 0.6
#: Fewest pairs that have a spread; CPU time (s) of one pair above which there is no other.
FEWEST = 3
DEAR = 2.0
#: What tells a move; first order goes before whole solves where it may be off by no more than this part of itself.
FIRST_ORDER, WHOLE_SOLVES, ESTIMATE = "first order", "whole solves", "estimate"
_GOOD = 0.5
#: Move (l) above which a whole solve alone is no sign that the strip is in the same state.
FAR = 0.05


@dataclass(frozen=True)
class Cost:
    """What an effect adds to a solve, s: median and half the distance of the quartiles of `pairs` differences; share:
    median of the difference over the solve with the effect, at most 1."""

    seconds: float
    spread: float
    share: float
    pairs: int


@dataclass(frozen=True)
class PricedEffect:
    """An effect with all that is known of it. solved: how far the strip moves by whole solves with and without (l)."""

    priced: Priced
    solved: float | None = None
    cost: Cost | None = None

    @property
    def known_by(self) -> str:
        """What tells its move: first order where that is good to half of itself, else whole solves, else first order
        as far as it goes; an estimate has no error; "": nothing tells it."""
        one = self.priced
        if one.moves is not None and one.moves_error is not None and one.moves_error <= _GOOD * one.moves:
            return FIRST_ORDER
        if self.solved is not None:
            return WHOLE_SOLVES
        if one.moves is None or one.doubtful:
            return ""
        return ESTIMATE if one.moves_error is None else FIRST_ORDER

    @property
    def moves(self) -> float | None:
        """How far it moves the strip (l), as well as is known; None where nothing tells it."""
        return {"": None, WHOLE_SOLVES: self.solved}.get(self.known_by, self.priced.moves)

    def elsewhere(self, error: float) -> bool:
        """Whether whole solves end further apart than first order has it, with their own discretisation error (l)."""
        one = self.priced
        if self.known_by != FIRST_ORDER or self.solved is None:
            return False
        return self.solved > (one.moves or 0.0) + 2.0 * ((one.moves_error or 0.0) + error)


@dataclass(frozen=True)
class PricedEffects:
    """All effects of a scene, those that move the strip most first; refused: why the state has no first order, ""."""

    rows: tuple[PricedEffect, ...]
    refused: str = ""

    @property
    def untold(self) -> tuple[str, ...]:
        """Effects of which nothing tells how far they move the strip: first order is further off than it is worth, and
        no whole solve was made."""
        return tuple(row.priced.effect for row in self.rows if row.priced.doubtful and row.moves is None)

    def apart(self, error: float) -> tuple[str, ...]:
        """Effects with which the strip solved anew may be in another state: first order contradicts it, or says nothing
        of what is off and moves by more than `FAR`; error: discretisation error of the state (l)."""
        return tuple(
            row.priced.effect
            for row in self.rows
            if row.elsewhere(error)
            or (not row.priced.on and row.known_by == WHOLE_SOLVES and (row.solved or 0.0) > FAR)
        )


def priced(scene: Scene, found: Explanation, solves: Solves, reporter: Reporter) -> PricedEffects | None:
    """The prices at the scene's own state; None for a model that knows none, and for what is no equilibrium."""
    model = chosen(scene)
    if not isinstance(model, Prices) or not solves.state.is_equilibrium:
        return None
    reporter.step("first order of every effect")
    refused = ""
    told: tuple[Priced, ...] = ()
    try:
        told = model.prices(scene, solves.state)
    except NotDifferentiable as refusal:
        refused = str(refusal)
    by_name = {one.effect: one for one in told}
    for effect in found.effects:
        if effect.key not in by_name:
            why = effect.fixed or refused or effect.why
            by_name[effect.key] = Priced(effect.key, effect.on, None, why=why)
    grid = solves.grid if solves.surface else None
    switched = {effect.key: effect for effect in found.effects if effect.on and effect.changes is not None}
    rows = []
    for name, one in by_name.items():
        off = solves.without.get(name)
        moved = None if off is None else off.moved
        cost = None
        if solves.without:
            pair = one.pair
            if pair is None and name in switched and off is not None and not switched[name].same_size:
                pair = (switched[name].changes or {}, {})
            if pair is not None:
                reporter.step(f"cost of {name}")
                if off is None:
                    moved = between(scene, solves.state, pair, grid, solves.each)
                cost = cost_of(scene, pair, solves.each)
        rows.append(PricedEffect(one, moved, cost))
    return PricedEffects(tuple(sorted(rows, key=_first)), refused)


def _first(row: PricedEffect) -> tuple[float, bool]:
    """What moves the strip most stands first, what is not known last."""
    return -(-1.0 if row.moves is None else row.moves), not row.priced.on


def cost_of(scene: Scene, pair: Pair, each: float = math.inf) -> Cost | None:
    """What the keys of the second of a pair cost beside those of the first; None where one is refused or has no state
    within its CPU time `each` (s), or the pairs took too long to be repeated."""
    try:
        without, with_it = (scene.replace(dict(keys)) for keys in pair)
    except BadInput:
        return None
    times: list[tuple[float, float]] = []
    begun = time.perf_counter()
    for turn in range(PAIRS + 1):
        with compiled() as count:
            spent = [_spent(one, each) for one in ((with_it, without) if turn % 2 else (without, with_it))]
            fresh = count() > 0
        if None in spent:
            return None
        if fresh:
            begun = time.perf_counter()
            continue
        first, second = (value or 0.0 for value in spent)
        if first + second > DEAR:
            return None
        times.append((second, first) if turn % 2 else (first, second))
        if len(times) > FEWEST and time.perf_counter() - begun > SPENT:
            break
    return _cost(times[1:]) if len(times) > FEWEST else None


def _spent(scene: Scene, each: float) -> float | None:
    """CPU time (s) of one whole solve; None where it is refused, or comes to no equilibrium within `each`."""
    begun = time.process_time()
    try:
        with within(each):
            state = chosen(scene).solve(scene, options=Options(repeats=0))
    except BadInput:
        return None
    return time.process_time() - begun if state.is_equilibrium else None


def _cost(times: list[tuple[float, float]]) -> Cost:
    """Of times (s) without and with an effect."""
    without, with_it = np.array(times).T
    more = with_it - without
    low, high = np.quantile(more, (0.25, 0.75))
    return Cost(float(np.median(more)), float(0.5 * (high - low)), float(np.median(more / with_it)), len(times))
