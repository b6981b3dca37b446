"""Rigid motions that nothing resists taken out before two shapes are compared.

A band that nothing holds has no place of its own: its solver fixes the start, so that a small change of shape near the
start turns the whole band. A distance between two such shapes means something only after the best rigid motion, among
those that change neither energy nor constraints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Motions:
    """Motions that change nothing: translations (k, 3) and axes (m, 3) of rotations, orthonormal; pivot (3,): a held
    point that every rotation goes through, None: there is none."""

    translations: FloatArray
    axes: FloatArray
    pivot: FloatArray | None = None


def aligned(points: FloatArray, reference: FloatArray, motions: Motions | None) -> FloatArray:
    """`points` (k, m, 3) moved as close to `reference` (same particles) as the free `motions` allow.

    Closest in the sense of least squares over the particles; units of l.
    """
    if motions is None or (not len(motions.translations) and not len(motions.axes)):
        return points
    from scipy.spatial.transform import Rotation  # not before it is needed: it loads half of scipy

    translations, axes = motions.translations, motions.axes
    moved = points.reshape(-1, 3)
    target = reference.reshape(-1, 3)
    pivots = (moved.mean(axis=0), target.mean(axis=0)) if motions.pivot is None else (motions.pivot, motions.pivot)
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
