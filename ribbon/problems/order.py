"""In which order the unknowns and rows of a mixed problem are eliminated along the strip (`ribbon.solvers.frontal`).

From where the ribbon is held to the other end: segment i's glue, what it gives (position, frame and eta of joint
i + 1) and what bends it (omega_i and the slope n_i) stand in one group. With y_(i+1) so eliminated beside its
multipliers what is carried along the strip is the flexibility of the part behind, which is there whatever holds the far
end: rows there, and walls' rows at their joints, come when their unknowns do. Far couplings are a border, eliminated
last: the first joint of a closed band, and the heights of pressure plates.
"""

from __future__ import annotations

import numpy as np

from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.held import Held, IntArray
from ribbon.problems.layout import ETA, OMEGA, POSITION, SLOPE


def elimination(problem: Held) -> tuple[IntArray, IntArray]:
    """Groups of the unknowns (size,) and of the rows (m,), 0, 1, ... in the order of their elimination."""
    layout, p = problem.layout, problem.lengths.size
    closed = problem.closure is not None
    backward = not closed and problem.start is None and problem.end is not None
    joints = np.arange(p + 1)
    given, bent = np.maximum(joints - 1, 0), np.minimum(joints, p - 1)
    if backward:
        given, bent = bent, given
    column = np.full(problem.size, p)
    for place in (*range(POSITION, OMEGA), ETA):
        column[layout.columns(place)] = given
    column[layout.omega] = bent
    column[layout.slope] = np.arange(p)
    if problem.fields.in_plane:
        column[layout.sideways] = bent
    glue = np.repeat(np.arange(p), kernels.ROWS)
    if backward:
        column, glue = p - 1 - column, p - 1 - glue
    if closed:
        column[:SLOPE] = p
        column[layout.sideways.start : layout.sideways.start + problem.fields.in_plane] = p
    column[layout.heights] = p
    lower, upper = problem.bounds()
    local = np.where((lower < upper) & (column < p), column, -1)
    rows = [glue]
    for block in problem.blocks().values():
        place, of = block.jacobian_structure()
        latest = np.full(block.count, -1)
        np.maximum.at(latest, place, local[of])
        rows.append(np.where(latest < 0, p, latest))
    return column, np.concatenate(rows)
