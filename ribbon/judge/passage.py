"""Whether a strip passed through itself on its way from one state to another.

Every place goes straight from where it was to where it is. No two places come nearer to each other in a share t of the
way than their distance less 2 M t, M how far the one that moves most goes: from a time at which far parts are apart by
delta it may therefore be gone on by delta / (2 M) without a look (conservative advancement; B. Mirtich and J. Canny
1995, doi:10.1145/199404.199436). Where they come nearer than a quarter of what they keep they pass.

A strip whose tangent turns by more than 2 rad did not go straight: a loop may have vanished by being drawn to a point,
and how it went is not known. Nor did one whose frames, the tangents laid upon each other, have turned about them by a
whole turn more at one end than at the other: that is what is left of a passage where the centreline came back to where
it was.

Distances are those of rulings (of a round rod, of points) that are sampled no farther apart than `_SHARE` of what is
kept, and of no more than `_MOST` of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.judge import nearness
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]

#: Part of the distance to be kept below which parts pass, and between two samples; most samples.
_NEAREST, _SHARE, _MOST = 0.25, 0.2, 3000
#: Looks on the way, at the most: what comes no nearer in so many slides along itself.
_LOOKS = 400
#: Turn (rad) of a tangent from one state to the other beyond which places do not go straight.
_TURN = 2.0


class Passage(NamedTuple):
    """Where and when parts pass through each other: abscissae s < s_other (l), share t of the way, and how near (l)
    they come (nan: not known, the strip turns too far at s = s_other)."""

    s: float
    s_other: float
    t: float
    distance: float


def passage(one: MixedProblem, x: FloatArray, other: MixedProblem, x_other: FloatArray) -> Passage | None:
    """Where a strip passes through itself between two states that keep `other.apart`; None: it does not, or
    no parts are kept apart."""
    if not other.apart:
        return None
    count = int(
        min(_MOST, max(np.ceil(1.0 / (_SHARE * other.apart)), nearness.enough(one, x), nearness.enough(other, x_other)))
    )
    s = np.linspace(0.0, 1.0, count + 1)
    begin, end = nearness.shape(one, x, s), nearness.shape(other, x_other, s)
    far = _turned_far(begin.frame, end.frame)
    if far is not None:
        return Passage(float(s[far]), float(s[far]), 0.0, np.nan)
    reach = other.reach
    moves = [end.r - begin.r + side * reach * (end.ruling - begin.ruling) for side in (-1.0, 1.0)]
    most = max(float(np.linalg.norm(move, axis=1).max()) for move in moves)
    least = _NEAREST * other.apart
    if 2.0 * most < other.apart - least:  # nothing goes so far
        return None
    t = 0.0
    for _ in range(_LOOKS):
        r, ruling = begin.r + t * (end.r - begin.r), begin.ruling + t * (end.ruling - begin.ruling)
        ahead = least + 2.0 * most * (1.0 - t)
        found = nearness.nearest(other, s, r, ruling, (begin.turned, end.turned), min(ahead, 4.0 * other.apart))
        distance = min(ahead, 4.0 * other.apart) if found is None else found[0]
        if found is not None and distance < least:
            return Passage(float(s[found[1]]), float(s[found[2]]), t, distance)
        t += max(distance - 0.5 * least, 0.5 * least) / (2.0 * most)
        if t >= 1.0:
            return None
    return None


def _turned_far(begin: FloatArray, end: FloatArray) -> int | None:
    """Which of the frames (k, 3, 3) turned by too much: the one whose tangent did most, or the last."""
    one, other = begin[:, :, 2], end[:, :, 2]
    cosine = np.einsum("ki,ki->k", one, other)
    if float(cosine.min()) < np.cos(_TURN):
        return int(cosine.argmin())
    axis = np.cross(one, other)
    carried = begin[:, :, 0] + np.cross(axis, begin[:, :, 0])
    carried += np.cross(axis, np.cross(axis, begin[:, :, 0])) / (1.0 + cosine)[:, None]  # Rodrigues, tangent on tangent
    across = np.einsum("ki,ki->k", carried, end[:, :, 1])
    turn = np.unwrap(np.arctan2(across, np.einsum("ki,ki->k", carried, end[:, :, 0])))
    return len(turn) - 1 if abs(turn[-1] - turn[0]) > np.pi else None
