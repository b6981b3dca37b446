"""The planar elastica's boundary value problem by scipy's collocation, for every kind of held end.

Unknowns (theta, m, x, y) with m = theta' - K, and the constant force R of the end's support as parameters:
m' = <t_perp, p>, p = Gamma (1 - s) u - F - R, (x, y)' = t; as many conditions as unknowns and parameters.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_bvp

from shellref.elastica.problem import ElasticaProblem


def collocation(problem: ElasticaProblem, guess, reaction=(), tolerance: float = 1e-10, points: int = 81):
    """scipy's solution from a guess: `guess(s)` (N,) -> (theta, m, x, y) (4, N), `reaction` (m,) along the normals.

    Raises AssertionError when the collocation does not converge to `tolerance`.
    """
    s = np.linspace(0.0, 1.0, points)
    normals = problem.normals
    ends = [problem.start_angle, problem.end_angle]

    def rates(s, y, held):
        px, py = problem.carried(s)
        push = np.asarray(held) @ normals if len(normals) else np.zeros(2)
        px, py = px - push[0], py - push[1]
        turn = -np.sin(y[0]) * px + np.cos(y[0]) * py
        return np.array([y[1] + problem.natural_curvature(s), turn, np.cos(y[0]), np.sin(y[0])])

    def conditions(a, b, held):
        rows = [a[2], a[3]]
        rows += [at[0] - angle if angle is not None else at[1] for at, angle in zip((a, b), ends, strict=True)]
        if problem.end is not None:
            rows += list(normals @ (b[2:] - problem.end))
        return np.array(rows)

    if len(normals):
        solution = solve_bvp(
            rates, conditions, s, guess(s), p=np.asarray(reaction, dtype=float), tol=tolerance, max_nodes=60_000
        )
    else:
        solution = solve_bvp(
            lambda s, y: rates(s, y, ()),
            lambda a, b: conditions(a, b, ()),
            s,
            guess(s),
            tol=tolerance,
            max_nodes=60_000,
        )
    assert solution.status == 0, solution.message
    return solution


def near(result):
    """A guess for `collocation` from a solved elastica, roughened so that nothing of it can survive unsolved."""

    def guess(s):
        theta = result.angle(s) + 0.02 * np.sin(3.0 * s)
        rate = np.gradient(result.angle(s), s)
        place = result.position(s).T + 0.02 * s * (1.0 - s)
        return np.vstack([theta, rate - result.problem.natural_curvature(s), place])

    force = np.asarray(result.forces.end) - result.problem.force
    return guess, 1.01 * result.problem.normals @ force + 0.05
