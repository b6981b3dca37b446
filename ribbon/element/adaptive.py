"""Integrals over the segments of a strip by two Gauss rules, on intervals that are halved until both agree (NumPy).

Of no kernel of the energies: what a fixed or a foreseeing rule says is judged by it (`ribbon.judge.quadrature`), and
parts of an energy are integrated with it (`ribbon.analysis.parts`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Points of both rules of an interval, most halvings, and difference over the integral that is rounding.
FEW, MANY = 10, 16
HALVINGS = 40
_ROUNDING = 1e-13
_RULES = tuple(np.polynomial.legendre.leggauss(n) for n in (FEW, MANY))


def beside_zero(q: FloatArray, lengths: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Segments (m,), and intervals on them from (m,) to (m,): whole, or on both sides of where the curvature
    q_0 s + q_1 passes zero, for parameters q (p, 4 or 6) and lengths (p,)."""
    segments = np.arange(lengths.size)
    with np.errstate(divide="ignore", invalid="ignore"):
        zero = -q[:, 1] / q[:, 0]
    inside = (zero > 0.0) & (zero < lengths)
    first = np.where(inside, zero, lengths)
    return (
        np.concatenate([segments, segments[inside]]),
        np.concatenate([np.zeros(lengths.size), zero[inside]]),
        np.concatenate([first, lengths[inside]]),
    )


def integrated(
    density: Callable[[IntArray, FloatArray], FloatArray],
    i: IntArray,
    begin: FloatArray,
    end: FloatArray,
    tolerance: float,
) -> FloatArray:
    """Sums (c,) of the integrals from `begin` to `end` (m,) of ``density(i, s)`` (m, g, c) at s (m, g) on segments i
    (m,); inf where a density is not finite, or no halving makes the rules agree to `tolerance` of the whole."""
    total = np.zeros(density(i[:1], begin[:1, None]).shape[-1])
    for _ in range(HALVINGS):
        length = end - begin
        few, many = (
            0.5 * length[:, None] * np.einsum("mgc,g->mc", density(i, begin[:, None] + np.outer(length, t)), weights)
            for t, weights in ((0.5 * (nodes + 1.0), weights) for nodes, weights in _RULES)
        )
        if not np.all(np.isfinite(many)):
            return np.full_like(total, np.inf)
        size = np.abs(total) + np.abs(many).sum(axis=0)
        apart = np.abs(many - few)
        poor = ((apart > tolerance * size / (8.0 * len(i))) & (apart > _ROUNDING * np.abs(many))).any(axis=1)
        total += many[~poor].sum(axis=0)
        if not poor.any():
            return total
        i, begin, end = i[poor], begin[poor], end[poor]
        middle = 0.5 * (begin + end)
        i, begin, end = np.tile(i, 2), np.concatenate([begin, middle]), np.concatenate([middle, end])
    return np.full_like(total, np.inf)
