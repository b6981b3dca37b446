"""Where an equilibrium goes when small terms are added to its energy: to first order, all by one factored tangent.

The energy gains ``g . q``, q the parameters of the segments (linear in the unknowns) and g the term's derivative at the
equilibrium (docs/theory.md, eq. (11.2) with F = g). Strips with a free twist are taken with bending in their own plane
as a field, whether they have it or not: what that moves is their first step towards the equilibrium with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon.problems.chained import ChainedProblem
from ribbon.problems.mixed import MixedProblem
from ribbon.result import Equilibrium
from ribbon.sensitivity.pulled_chain import along_the_chain
from ribbon.sensitivity.system import Point, System, point, require_equilibrium

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Pulled:
    """The shapes, in the order of the terms, and the one that bends in its plane too. Only the unknowns, and what
    follows from them, belong to these."""

    terms: tuple[Equilibrium, ...]
    in_plane: Equilibrium


def pulled(equilibrium: Equilibrium, gradients: Sequence[FloatArray]) -> Pulled:
    """Where an equilibrium with a free twist goes by each term alone; gradients: derivatives (p, 4 or 6) by the
    parameters of every segment, D w / l.

    Raises `ribbon.errors.NotDifferentiable` for what is no equilibrium and where its tangent is singular.
    """
    require_equilibrium(equilibrium, unstable=True)
    chained = equilibrium.problem
    moved = along_the_chain(chained, equilibrium.x, gradients) if isinstance(chained, ChainedProblem) else None
    problem, x, moves = moved or _by_the_glue(equilibrium, gradients)
    found = [replace(equilibrium, problem=problem, x=x + move, at=None) for move in moves]
    return Pulled(tuple(found[:-1]), found[-1])


def _by_the_glue(
    equilibrium: Equilibrium, gradients: Sequence[FloatArray]
) -> tuple[MixedProblem, FloatArray, FloatArray]:
    """The glued problem with bending in the plane, its unknowns (n,), and where they go (k + 1, n): by each gradient,
    and by what bends the strip in its plane; from the factored tangent of all its unknowns."""
    here = point(equilibrium, unstable=True)
    problem: Any = here.problem
    if not problem.fields.in_plane:
        freed = problem.with_changes(in_plane=True).anchored(problem.anchor(here.x))
        x = freed.state(*problem.joint_values(here.x))
        here = Point(freed, x, _rows_of(problem, freed, here.rows), np.zeros(x.size))
        problem = freed
    system = System.of(here)
    columns, slopes = problem.parameter_map()
    pulls = np.zeros((len(gradients) + 1, problem.size))
    for pull, gradient in zip(pulls, gradients, strict=False):
        np.add.at(pull, columns, np.einsum("pj,pjk->pk", gradient, slopes[:, : gradient.shape[1]]))
    pulls[-1] = problem.gradient(here.x) + system.jacobian.T @ here.rows
    still = np.zeros((here.rows.size, len(pulls)))
    moves, _ = system.solve(pulls.T, still, np.zeros(pulls.T.shape))
    return problem, here.x, moves.T


def _rows_of(problem: Any, freed: Any, rows: FloatArray) -> FloatArray:
    """The multipliers (m,) of a strip as those of the one that bends in its plane too; what holds that alone (the seam
    of a closed band) exerts nothing yet."""
    found = np.zeros(freed.row_count)
    known, wanted = problem.block_slices(), freed.block_slices()
    glue = rows.size - sum(where.stop - where.start for where in known.values())
    found[:glue] = rows[:glue]
    for name, where in known.items():
        found[wanted[name]] = rows[where]
    return found
