r"""Elements that stand in the layers of a strip that is pulled, and what elements miss of them.

Along a force P (the multiplier of the glue of positions, `ribbon.problems.held`) a bent strip straightens over a length
1 / lambda, lambda = sqrt(P / (D w)): the curvature of a planar one varies as exp(-lambda s) (the elastica's separatrix,
A. E. H. Love 1927, section 262), or, pushed, as cos(lambda s). So its second derivative is f = lambda^2 b with
b = hypot(bending, bending' / lambda), and a linear curvature on an element of length h misses (Legendre; P. J. Davis,
Interpolation and Approximation, Dover 1975, section 10.3), in the root mean square,

    C h^2 f ,   C = 1 / (12 sqrt 5)

Missed: the root of the sum of its squares over that of the bending's own, the relative error of the curvature in L2;
the energy's is its square. It is least, at a number of elements, where each has the same part of int f^(2/5). What a
strip misses elsewhere, as where its rulings meet (`ribbon.find.branch.passages`), is not in it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.mixed_kernels import ROWS

FloatArray = NDArray[np.float64]

#: Of the estimate: C; least lambda (1/l), for a strip that nothing pulls.
_CONSTANT, _LEAST = 1.0 / (12.0 * math.sqrt(5.0)), math.pi
#: Part of the joints that are spread evenly; bending over the largest that is none.
EVEN, NONE = 0.25, 1e-5


def _rough(problem: MixedProblem, x: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Root mean square of the bending (p,) on every segment, 1/l, and of its second derivative, 1/l^3."""
    lengths = problem.lengths
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    omega, other = problem.joint_values(x)
    bend = omega - law.at(problem.strip.curvature, s)
    bend = np.hypot(bend, other) if problem.fields.free else bend * (1.0 + other * other)
    force = np.linalg.norm(rows[: ROWS * lengths.size].reshape(-1, ROWS)[:, :3], axis=1)
    scale = np.maximum(_LEAST, np.sqrt(force))
    first, last = bend[:-1], bend[1:]
    mean = (first * first + first * last + last * last) / 3.0
    bending = np.sqrt(mean + ((last - first) / lengths / scale) ** 2)
    bending[bending < NONE * bending.max(initial=0.0)] = 0.0
    return bending, bending * scale**2


def missed(problem: MixedProblem, x: FloatArray, rows: FloatArray, lengths: FloatArray | None = None) -> float:
    """Relative error of the curvature at x (n,) with multipliers rows (m,), estimated, on its own segments or on those
    of other `lengths`; 0 for a strip that is not bent."""
    bending, rough = _rough(problem, x, rows)
    own = problem.lengths
    whole = float(np.sum(own * bending**2))
    if whole <= np.finfo(float).tiny:
        return 0.0
    h = own
    if lengths is not None:
        here, there = np.cumsum(own) - 0.5 * own, np.cumsum(lengths)
        h = lengths[np.clip(np.searchsorted(there, here), 0, lengths.size - 1)]
    return _CONSTANT * math.sqrt(float(np.sum(own * (h**2 * rough) ** 2)) / whole)


def fitted(problem: MixedProblem, x: FloatArray, rows: FloatArray) -> FloatArray:
    """Lengths (p,) over l of about as many segments, each with the same part of int f^(2/5); those that end at points
    of the natural curvature's law go on to."""
    _, rough = _rough(problem, x, rows)
    own, natural = problem.lengths, problem.strip.curvature
    share = own * rough**0.4
    whole = float(share.sum())
    count = max(1, own.size - len(law.points(natural)[0]) + 2)
    if not whole > 0.0:
        return law.cut(natural, np.full(count, 1.0 / count))
    density = (1.0 - EVEN) * share / whole / own + EVEN
    # spread a little: a layer may be thinner than the segment that it is seen on
    density = np.maximum(density, 0.5 * np.maximum(np.append(density[1:], 0.0), np.append(0.0, density[:-1])))
    reached = np.concatenate([[0.0], np.cumsum(density * own)])
    s = np.concatenate([[0.0], np.cumsum(own)])
    joints = np.interp(np.linspace(0.0, reached[-1], count + 1), reached, s)
    return law.cut(natural, np.diff(joints))
