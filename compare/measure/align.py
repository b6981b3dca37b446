"""Motions that nothing resists taken out before two shapes are compared.

A band that nothing holds has no place of its own: its solver fixes the start, so that a small change of shape near the
start turns the whole band. Nor has one of uniform properties a particle to begin with: it slides along itself, so that
equal abscissae are not equal places. A distance between two such shapes means something only after the best motion,
among those that change neither energy nor constraints.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Rows of a grid, at most, on which the slide is sought among all of them, before it is refined between two rows.
ROWS = 64
#: Part of the squared distance that a slide or a mirror must save; below it is rounding, or the grid's.
SAVES = 1e-3


@dataclass(frozen=True)
class Motions:
    """Motions that change nothing: translations (k, 3) and axes (m, 3) of rotations, orthonormal; pivot (3,): a held
    point that every rotation goes through, None: there is none.

    seam: 1 or -1 where a closed band slides along itself, and what its width's direction becomes at the seam; else 0.
    mirror: the mirror image is a state too (of a band, that of the other hand).
    """

    translations: FloatArray
    axes: FloatArray
    pivot: FloatArray | None = None
    seam: int = 0
    mirror: bool = False


@dataclass(frozen=True)
class Alignment:
    """x -> target + turn (x - centre), of the particles that were slid by `slide` (in l, towards larger s) before.

    turn (3, 3) orthogonal, a reflection where `mirrored`; centre, target (3,); seam: as of `Motions`; free: something
    could be moved.
    """

    turn: FloatArray
    centre: FloatArray
    target: FloatArray
    slide: float = 0.0
    seam: int = 0
    free: bool = False

    @property
    def mirrored(self) -> bool:
        """Whether the mirror image is compared."""
        return bool(np.linalg.det(self.turn) < 0.0)

    def of(self, points: FloatArray) -> FloatArray:
        """Points (..., 3) moved."""
        return (points - self.centre) @ self.turn.T + self.target

    def particles(self, points: FloatArray) -> FloatArray:
        """Points (k, m, 3) of the particles that are compared with those of a grid: slid along the band, then moved."""
        return self.of(slid(points, self.slide, self.seam) if self.slide else points)


def even_along(curvature: Sequence[float], seam: int) -> bool:
    """Whether a closed band of this natural curvature (at the points of its law) is the same at every place."""
    first, *rest = curvature
    return all(k == first for k in rest) and first == seam * first


def slid(points: FloatArray, slide: float, seam: int) -> FloatArray:
    """Points (k, m, 3) of a closed band, at equally spaced s in [0, 1] and symmetric v, from those at s + slide; linear
    between rows."""
    rows = len(points) - 1
    place = np.arange(rows + 1) + slide * rows
    low = np.floor(place).astype(int)
    part = (place - low)[:, None, None]
    return (1.0 - part) * _row(points, low, seam) + part * _row(points, low + 1, seam)


def _row(points: FloatArray, number: NDArray[np.int64], seam: int) -> FloatArray:
    """Rows of a band, whatever their number: after a whole turn v is seam v."""
    rows = len(points) - 1
    found = points[number % rows]
    turned = (number // rows) % 2 == 1
    return np.where(turned[:, None, None], found[:, ::seam], found)


def alignment(points: FloatArray, reference: FloatArray, motions: Motions | None) -> Alignment:
    """The motion, among the free ones, that brings `points` (k, m, 3) closest to `reference` (same particles) in the
    sense of least squares over the particles; units of l."""
    none = Alignment(np.eye(3), np.zeros(3), np.zeros(3))
    if motions is None or (not len(motions.translations) and not len(motions.axes)):
        return none
    if not (np.isfinite(points).all() and np.isfinite(reference).all()):
        return none
    best, left = _fitted(points, reference, motions, 0.0)
    if motions.seam:
        step = max(1, (len(points) - 1) // ROWS)
        while (len(points) - 1) % step:
            step -= 1
        few, there = points[::step], reference[::step]
        turns = 2 if motions.seam < 0 else 1
        places = np.arange(turns * (len(few) - 1)) / (len(few) - 1)
        places = np.where(places >= 0.5 * turns, places - turns, places)
        tried = [(_fitted(few, there, motions, float(place))[1], abs(place), float(place)) for place in places]
        coarse = min(tried)[2]
        slide = _least(lambda x: _fitted(points, reference, motions, x)[1], coarse, 1.0 / (len(few) - 1))
        found, rest = _fitted(points, reference, motions, slide)
        if rest < (1.0 - SAVES) * left:
            best = found
    return best


def _least(distance, middle: float, step: float) -> float:
    """Where a smooth function is least within a step of `middle`."""
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(distance, bounds=(middle - step, middle + step), method="bounded", options={"xatol": 1e-7})
    return float(found.x)


def _fitted(points: FloatArray, reference: FloatArray, motions: Motions, slide: float) -> tuple[Alignment, float]:
    """The best motion of the particles slid by so much, and the mean squared distance that it leaves."""
    translations, axes = motions.translations, motions.axes
    moved = (slid(points, slide, motions.seam) if slide else points).reshape(-1, 3)
    target = reference.reshape(-1, 3)
    own, other = (moved.mean(axis=0), target.mean(axis=0)) if motions.pivot is None else (motions.pivot,) * 2
    a, b = moved - own, target - other
    turn = np.eye(3)
    if len(axes) == 3:
        turn = _kabsch(a, b, motions.mirror)
    elif len(axes) == 1:
        turn = _about(axes[0], a, b)
    gap = (target - (own + a @ turn.T)).mean(axis=0)
    found = Alignment(turn, own, own + translations.T @ (translations @ gap), slide, motions.seam, True)
    return found, float(np.mean(np.sum((found.of(moved) - target) ** 2, axis=1)))


def _kabsch(a: FloatArray, b: FloatArray, mirror: bool) -> FloatArray:
    """The rotation (3, 3) that brings a (n, 3) closest to b (Kabsch 1976, doi:10.1107/S0567739476001873); with `mirror`
    the reflection where that leaves less."""
    left, size, right = np.linalg.svd(b.T @ a)
    hand = np.sign(np.linalg.det(left @ right))
    if mirror and hand < 0.0:
        rest = float(np.sum(a * a) + np.sum(b * b) - 2.0 * size.sum())
        if rest < (1.0 - SAVES) * (rest + 4.0 * size[2]):
            hand = 1.0
    return np.asarray(left @ np.diag([1.0, 1.0, hand]) @ right)


def _about(axis: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """The rotation (3, 3) about an axis (3,) that brings a (n, 3) closest to b."""
    from scipy.spatial.transform import Rotation  # not before it is needed: it loads half of scipy

    flat_a, flat_b = (v - np.outer(v @ axis, axis) for v in (a, b))
    sine = float(np.einsum("ij,ij->", np.cross(flat_a, flat_b), np.broadcast_to(axis, a.shape)))
    angle = math.atan2(sine, float(np.einsum("ij,ij->", flat_a, flat_b)))
    return np.asarray(Rotation.from_rotvec(angle * axis).as_matrix())


def both(one: Motions | None, other: Motions | None) -> Motions | None:
    """The motions that two models of one scene allow: the first one's, where it allows any; sliding and mirror images
    where either does."""
    if one is None or other is None:
        return one or other
    seam = one.seam or other.seam
    return Motions(one.translations, one.axes, one.pivot, seam, one.mirror or other.mirror)


def aligned(points: FloatArray, reference: FloatArray, motions: Motions | None) -> FloatArray:
    """`points` (k, m, 3) moved as close to `reference` (same particles) as the free `motions` allow, as `alignment`
    says: of a band that slides, its own particles, moved; units of l."""
    if motions is None or (not len(motions.translations) and not len(motions.axes)):
        return points
    return alignment(points, reference, motions).of(points)
