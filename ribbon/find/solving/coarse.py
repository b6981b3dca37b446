"""A strip held at s = 0 that turns far in one segment: the state on finer segments is a start for the coarse ones.

Where a segment turns the strip by half a turn or more, omega and eta linear on it cannot uncoil one turn after the
other: coils are let down segment by segment, and the discrete energy has minima in which some are not (K l = 100 on 20
segments rests 139 D w / l above the lowest that is known). They are of the segments, not of the strip: cut in two, the
same shape is no minimum any more and goes on down. What it comes to, sampled on the given segments, is a start there,
and the lower of both states is the answer. That is no proof that none is lower.

Of 3,678 random coils (abs(K l) 20 to 150, Gamma 0.05 to 3 times its square, 10 to 40 segments that turn by more than
`TURNED`) 681 have a lower state by this, below `TURNED` one in a hundred.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ribbon.find.minima import Seen, lower
from ribbon.find.solving import refine, search
from ribbon.find.solving.request import How
from ribbon.problems import transfer
from ribbon.problems.chained import ChainedProblem
from ribbon.result import Equilibrium, Minima
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import FloatArray

#: Turn of the tangent (rad) in one segment from which a lower state is looked for.
TURNED = 3.0
#: How often, each time from the lower state that was found.
_ROUNDS = 3


def turn(problem: ChainedProblem, x: FloatArray) -> float:
    """The greatest turn (rad) of the tangent in one segment."""
    omega, _ = problem.joint_values(x)
    return float(np.max(np.abs(omega[1:] + omega[:-1]) * 0.5 * problem.lengths))


def lowest(state: Equilibrium, how: How) -> Equilibrium:
    """The lowest state of the same segments that their halves lead to, what was seen in its `minima`; `state` itself
    where its segments are short enough, or options are given."""
    problem = state.problem
    if not isinstance(problem, ChainedProblem) or not state.ok or how.options:
        return state
    if turn(problem, state.x) <= TURNED:
        return state
    plain, seen = How(), Seen()
    seen.add(problem, state.x)
    for _ in range(_ROUNDS):
        if spent():
            break
        seen.tries += 1
        fine = refine.cut_into(state, 2, replace(plain, check=False))
        if not np.all(np.isfinite(fine.x)):
            break
        assert isinstance(fine.problem, ChainedProblem)
        found = search.from_state(problem, transfer.on_joints(fine.problem, fine.x, problem), plain)
        if not found.ok:
            break
        seen.add(problem, found.x)
        if not lower(found.energy.total, state.energy.total):
            break
        state = replace(found, iterations=state.iterations + found.iterations)
    energies = tuple(sorted(seen.energies))
    told = Minima(energies, seen.add(problem, state.x), int(problem.lengths.size), seen.tries, flipped=False)
    return replace(state, minima=told, message=f"{state.message}; {told}" if len(energies) > 1 else state.message)
