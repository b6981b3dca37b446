"""Linear algebra of a branch: the bordered system, and the eigenvalues of the second variation that are nearest zero.

    [ K   g ] [x]   [f]
    [ c^T d ] [y] = [e]

is solved with the factor of K alone, also where K is all but singular (mixed block elimination: W. Govaerts & J. D.
Pryce 1993, doi:10.1007/BF01990529). Near eigenvalues: subspace iteration with K^-1 M, Ritz values of that pencil.
"""

from __future__ import annotations

import numpy as np
import scipy  # its parts are loaded where they are first used

from compare.continuation.system import Factor, FloatArray, System

#: Vectors beside those asked for, and rounds of the iteration.
_BESIDE, _ROUNDS = 3, 12
_SETTLED = 1e-11


def solve(
    factor: Factor, g: FloatArray, c: FloatArray, d: float, f: FloatArray, e: float
) -> tuple[FloatArray, float] | None:
    """x (n,), y of the bordered system; None where it is singular."""
    w = factor.solve_transposed(c)
    v = factor.solve(g)
    below, above = d - float(w @ g), d - float(c @ v)
    if below == 0.0 or above == 0.0 or not np.isfinite(below * above):
        return None
    first = (e - float(w @ f)) / below
    rest = factor.solve(f - g * first)
    second = (e - d * first - float(c @ rest)) / above
    x, y = rest - v * second, first + second
    return (x, y) if np.isfinite(y) and bool(np.all(np.isfinite(x))) else None


def near_zero(
    system: System, factor: Factor, count: int, start: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """The `count` eigenvalues (count,) of K x = lambda M x nearest zero, ascending, and their vectors (n, count) of
    length 1 in M; start (n, m): vectors to begin with."""
    wanted = count + _BESIDE
    basis = np.random.default_rng(0).normal(size=(system.size, wanted))
    if start is not None:
        basis[:, : min(wanted, start.shape[1])] = start[:, :wanted]
    last = np.full(count, np.inf)
    inverse, vectors = np.ones(wanted), basis
    for _ in range(_ROUNDS):
        weighed = np.column_stack([system.mass(v) for v in vectors.T])
        moved = factor.solve(weighed)
        gram = moved.T @ np.column_stack([system.mass(v) for v in moved.T])
        gram = 0.5 * (gram + gram.T)
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        values, turns = np.linalg.eigh(gram / np.outer(scale, scale))
        kept = values > 1e-13 * values[-1]
        basis = (moved / scale) @ (turns[:, kept] / np.sqrt(values[kept]))
        weighed = np.column_stack([system.mass(v) for v in basis.T])
        small = weighed.T @ factor.solve(weighed)
        inverse, mixed = scipy.linalg.eigh(0.5 * (small + small.T))
        order = np.argsort(-np.abs(inverse))
        inverse, vectors = inverse[order], basis @ mixed[:, order]
        found = inverse[:count]
        if found.size == last.size and np.all(np.abs(found - last) <= _SETTLED * np.abs(found)):
            break
        last = found
    values = 1.0 / inverse[:count]
    order = np.argsort(values)
    return values[order], vectors[:, :count][:, order]
