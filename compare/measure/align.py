"""Rigid motions that nothing resists taken out before two shapes are compared.

A band that nothing holds has no place of its own: its solver fixes the start, so that a small change of shape near the
start turns the whole band. A distance between two such shapes means something only after the best rigid motion, among
those that change neither energy nor constraints.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ribbon import Equilibrium

FloatArray = NDArray[np.float64]


def aligned(points: FloatArray, reference: FloatArray, equilibrium: Equilibrium) -> FloatArray:
    """`points` (k, m, 3) moved as close to `reference` (same particles) as the free motions of `equilibrium` allow.

    Closest in the sense of least squares over the particles; units of l.
    """
    problem: Any = equilibrium.problem
    if not hasattr(problem, "free_motions"):
        return points
    translations, axes = problem.free_motions()
    moved = points.reshape(-1, 3)
    target = reference.reshape(-1, 3)
    if not len(translations) and not len(axes):
        return points
    held = [r for r in (problem.start_position, problem.end_position) if r is not None]
    pivots = (moved.mean(axis=0), target.mean(axis=0)) if not held else (held[0], held[0])
    a, b = moved - pivots[0], target - pivots[1]
    if len(axes) == 3:
        turn = Rotation.align_vectors(b, a)[0]
        moved = pivots[0] + turn.apply(a)
    elif len(axes) == 1:
        axis = axes[0]
        flat_a, flat_b = (v - np.outer(v @ axis, axis) for v in (a, b))
        sine = float(np.einsum("ij,ij->", np.cross(flat_a, flat_b), np.broadcast_to(axis, a.shape)))
        angle = math.atan2(sine, float(np.einsum("ij,ij->", flat_a, flat_b)))
        moved = pivots[0] + Rotation.from_rotvec(angle * axis).apply(a)
    shift = (target - moved).mean(axis=0)
    return (moved + translations.T @ (translations @ shift)).reshape(points.shape)
