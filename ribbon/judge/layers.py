"""Where the layers of a ruled strip lie on each other in a plane: stations, as those of a round rod's strands.

Rulings of a plane state are parallel, and parts that face each other touch along lines: no place along them is nearest
(docs/theory.md, eq. (5.18)). As with strands (`ribbon.judge.strands`) what is held is a fixed set, the joints of the
part that comes first, each against the nearest place of the other part, which alone slides; and the strip's end against
the layer that it lies on, for its foot is at no joint. In the plane one place of a ruling, its middle, tells the gap of
all of it; out of it two places do (`across`).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.judge import nearness, strands
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]

#: Segments within which two places of one strand are the same.
_NEXT = 1.0
#: Places of a ruling, over half the width, at which half of a force each does what a pressure that is the same all
#: across it does, to the third degree.
_GAUSS = 3.0**-0.5
#: Part of a segment up to which abscissae that stay are one.
_AT = 1e-6


def stations(
    problem: MixedProblem, x: FloatArray, below: float, more: Iterable[float] = ()
) -> list[tuple[float, Pair]]:
    """Gaps (l) and pairs, in the middle of rulings, of joints and the abscissae `more` nearer to another layer of the
    shape x (n,) than `below` (l) beyond what parts keep (`problem.apart`)."""
    joints = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    joints[-1] = 1.0
    own = np.union1d(joints, np.fromiter(more, dtype=float))
    s = np.union1d(nearness.abscissae(problem, x), own)
    s = s[np.concatenate([[True], np.diff(s) > 1e-13])]
    here = nearness.shape(problem, x, s)
    at = np.searchsorted(s, own - 1e-12)
    reach = problem.apart + below + float(np.diff(s).max())
    near = scipy.spatial.cKDTree(here.r).query_ball_point(here.r[at], reach, return_sorted=True)
    found: list[Pair] = []
    for i, others in zip(at, near, strict=True):
        j = np.asarray(others, dtype=np.int64)
        one, other = here.turned[i], here.turned[j]
        if i == s.size - 1:
            j = j[nearness.facing(problem, other, np.broadcast_to(one, other.shape), here.turned[-1])]
        else:
            j = j[nearness.facing(problem, one, other, here.turned[-1])]
        distance = np.linalg.norm(here.r[j] - here.r[i], axis=1)
        found += [Pair(float(s[i]), 0.0, float(s[j[k]]), 0.0, True, True) for k in strands.valleys(j, distance)]
    gaps, places = nearness.narrowed(problem, x, found)
    kept: list[tuple[float, Pair]] = []
    for k in np.argsort(gaps, kind="stable"):
        if gaps[k] < below and not any(alike(problem, places[k], pair) for _, pair in kept):
            kept.append((float(gaps[k]), places[k]))
    return sorted(kept, key=lambda each: each[1])


def is_through(problem: MixedProblem, x: FloatArray) -> bool:
    """Whether middles of rulings that face each other are nearer than half of what parts keep: more than too near."""
    s = nearness.abscissae(problem, x)
    here = nearness.shape(problem, x, s)
    near = scipy.spatial.cKDTree(here.r).query_pairs(0.5 * problem.apart, output_type="ndarray")
    one, other = here.turned[near[:, 0]], here.turned[near[:, 1]]
    return bool(nearness.facing(problem, one, other, here.turned[-1]).any())


def alike(problem: MixedProblem, one: Pair, other: Pair) -> bool:
    """Whether two stations hold the same: one place against the same layer, at the same end of the ruling."""
    h = float(problem.lengths.max())
    return abs(one.s - other.s) < _AT * h and one.u == other.u and abs(one.s_other - other.s_other) < _NEXT * h


def across(problem: MixedProblem, x: FloatArray, pairs: Iterable[Pair]) -> list[Pair]:
    """Stations in the middles of rulings held at two places of each ruling, at the shape x (n,): its places stay, those
    of the other layer slide, along it and across it."""
    pairs, place = list(pairs), _GAUSS * problem.half_width
    one, other = (
        nearness.shape(problem, x, np.array([getattr(pair, side) for pair in pairs])).ruling
        for side in ("s", "s_other")
    )
    facing = np.sign(np.einsum("ki,ki->k", one, other))
    return [
        pair._replace(u=side * place, u_other=float(sign) * side * place, held=False)
        for pair, sign in zip(pairs, facing, strict=True)
        for side in (1.0, -1.0)
    ]
