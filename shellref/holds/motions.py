"""Rigid motions that supports and loads leave free, and one component of a position held for each of them. NumPy only.

A velocity x -> t + w x (x - c) changes neither the energy nor what is held when

    t + w x (p - c) = 0           at a held point p; along a slide b it may move, and then turns only about b
    w = 0                         where a frame is held
    t . e = 0 ,  e x w = 0        for the direction e of each dead load (weight, force): its potential stays

The last pair is that of a group: a motion that keeps the potential to first order alone is none of these. At an
equilibrium they are null vectors of the tangent, and all of them that supports and loads alone make known. What holds
them is what holds a free band (shellref.seam.gauge): components of positions by which they are told best; the inertia
on the rest is that of the whole tangent without these zeros, and the reactions vanish (docs/theory.md, eq. (7.25)).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

#: Singular value, over the largest, below which a row of conditions is a combination of others: units of l and rad.
RANK = 1e-9


class Support(NamedTuple):
    """What is held at one end: its point (3,) with the slide (3,) along which it may move, and whether its frame is."""

    point: np.ndarray | None
    frame: bool
    slide: np.ndarray | None = None


def _crossed(arm: np.ndarray) -> np.ndarray:
    """(3, 3): w -> w x arm."""
    x, y, z = arm
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])


def free(supports: Sequence[Support], directions: Sequence[np.ndarray], centre: np.ndarray) -> np.ndarray:
    """Orthonormal (k, 6) pairs (t, w) of the motions that are left, about `centre` (3,); directions: of dead loads."""
    none, unit = np.zeros((3, 3)), np.eye(3)
    rows = [np.zeros((1, 6))]
    for held in supports:
        if held.point is not None:
            still = unit if held.slide is None else unit - np.outer(held.slide, held.slide)
            rows.append(still @ np.hstack([unit, _crossed(held.point - centre)]))
            if held.slide is not None:
                rows.append(np.hstack([none, _crossed(held.slide)]))
        if held.frame:
            rows.append(np.hstack([none, unit]))
    for path in directions:
        rows.append(np.hstack([path, np.zeros(3)])[None, :])
        rows.append(np.hstack([none, _crossed(path)]))
    _, sizes, right = np.linalg.svd(np.vstack(rows))
    rank = int(np.sum(sizes > RANK * max(1.0, float(sizes.max()))))
    return np.asarray(right[rank:])


def fields(found: np.ndarray, state: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """(k, n, 6) the motions (k, 6) of nodes with positions and directors (n, 6)."""
    arms, directors = state[:, :3] - centre, state[:, 3:]
    shift, turn = found[:, None, :3], found[:, None, 3:]
    return np.concatenate([shift + np.cross(turn, arms[None]), np.cross(turn, directors[None])], axis=2)


def vanishing(candidates: np.ndarray, still: np.ndarray) -> np.ndarray:
    """Combinations (j, n, 6) of fields (k, n, 6) whose positions vanish at the components `still` (n, 3)."""
    rows = candidates[..., :3][:, still]  # (k, c)
    if not rows.size:
        return candidates
    left, sizes, _ = np.linalg.svd(rows)
    rank = int(np.sum(sizes > RANK * max(1.0, float(sizes.max(initial=0.0)))))
    return np.tensordot(left[:, rank:].T, candidates, axes=1)
