r"""Where a planar elastica is nearer to itself, or to what it cannot cross, than it may be.

**Sides.** A place s and its foot s' on the strip, r(s) on the left (side 1) or the right (-1) of the tangent there.
With the straight line between them the strip's part from one to the other closes to a curve; where nothing else crosses
that line, the curve is simple as long as the strip is, and its tangent turns by 2 pi or -2 pi in all (Hopf's
Umlaufsatz): by tau along the strip, by side pi/2 at the foot, and at s by what is left, between -pi and pi,

    tau + side pi/2 + wrap(-tau - side pi/2) = 2 pi m ,   m = 1 or -1 .

Of most turns tau that holds for one side alone, for a short one for none: these places do not face each other. Where it
holds for both (a coil, tau near 2 pi) the side is that of a state before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shellref.elastica.contact.barrier import Barrier
from shellref.elastica.contact.places import Moving
from shellref.elastica.contact.rows import Beside, Gap, Pair, Row, evaluated, slid
from shellref.elastica.problem import Array

#: Depth (l) from which places count as too near; depth from which it is another branch that a line crosses.
TOO_NEAR, LOST = 2e-7, 0.15
#: Samples of an element; elements between places that are looked at apart; places that one look finds.
SAMPLES, APART, MOST = 4, 1.5, 12
#: Depth (l) that a contact at a joint may leave between joints; sharper ones slide.
BLUNT = 1e-6
#: Turn (rad) between two places that are looked at last, when it is said how near parts are.
FINE = 0.05
#: Turn (rad) from which parts of the strip face each other, of places inside.
FACING = 2.0


def sides(turn: float) -> tuple[float, ...]:
    """Sides on which a place may be of its foot, with this turn from the one of smaller s to the other."""
    found = []
    for side in (1.0, -1.0):
        whole = turn + side * 0.5 * math.pi
        if abs(round((whole + math.remainder(-whole, 2.0 * math.pi)) / (2.0 * math.pi))) == 1:
            found.append(side)
    return tuple(found)


def samples(nodes: Array) -> Array:
    """Abscissae that are looked at (k,)."""
    inner = nodes[:-1, None] + np.diff(nodes)[:, None] * np.arange(SAMPLES) / SAMPLES
    return np.append(inner.ravel(), 1.0)


def finer(moving: Moving, places: Array) -> Array:
    """Places (k,) with more between them, equally many in all, so that the strip turns by at most `FINE` times
    `SAMPLES` from one to the next."""
    theta = moving.shape(places)[0]
    cuts = max(1, math.ceil(float(np.abs(np.diff(theta)).max(initial=0.0)) / (SAMPLES * FINE)))
    inner = places[:-1, None] + np.diff(places)[:, None] * np.arange(cuts) / cuts
    return np.append(inner.ravel(), places[-1])


def too_near(
    moving: Moving,
    nodes: Array,
    apart: float | None,
    barriers: Sequence[Barrier],
    before: Moving | None,
    below: float = -TOO_NEAR,
) -> list[Gap]:
    """Rows of places that are nearer than they may be, the deepest of each region, slid; below: gap (l) under which."""
    s = samples(nodes)
    theta, _, r = moving.shape(s)
    found: list[tuple[float, Row]] = []
    for number, barrier in enumerate(barriers):
        gaps = barrier.gaps(r)
        least = (gaps <= np.append(gaps[1:], np.inf)) & (gaps <= np.append(np.inf, gaps[:-1])) & (gaps < below)
        found += [(float(gaps[i]), Beside(float(s[i]), barrier, number, i in (0, len(s) - 1)))
                  for i in np.flatnonzero(least)]  # fmt: skip
    if apart is not None:
        found += _pairs(s, theta, r, apart, before, below)
    chosen: list[Gap] = []
    regions: list[Row] = []
    for _, row in sorted(found, key=lambda pair: pair[0]):
        if len(chosen) >= MOST:
            break
        if any(beside(row, other, APART * float(np.diff(nodes).max())) for other in regions):
            continue
        regions.append(row)
        gap = settled(moving, nodes, row)
        if gap is not None and gap.gap < below and not any(alike(gap.row, known.row, nodes) for known in chosen):
            chosen.append(gap)
    return chosen


def settled(moving: Moving, nodes: Array, row: Row, line: bool = False) -> Gap | None:
    """A row slid to where it is least; held at a joint beside it of a line, or where it is hardly sharper than one."""
    end = row.s in (0.0, 1.0)
    if not end and not row.held and not line:
        gone = slid(moving, row)
        if gone is not None:
            gap = evaluated(moving, gone, second=False)
            if gap.sharp > blunt(nodes, gone.s):
                return gap
    at = row.s if end else float(nodes[int(np.argmin(np.abs(nodes - row.s)))])
    held = slid(moving, replace(row, s=at, held=True))
    return None if held is None else evaluated(moving, held, second=False)


def blunt(nodes: Array, s: float) -> float:
    """Second derivative of a gap (1/l) from which its least place is told from a joint's."""
    cell = int(np.clip(np.searchsorted(nodes, s, side="right") - 1, 0, len(nodes) - 2))
    return 8.0 * BLUNT / float(nodes[cell + 1] - nodes[cell]) ** 2


def alike(one: Row, other: Row, nodes: Array) -> bool:
    """Whether two rows are of the same places: a twentieth of an element, or the same joint."""
    return beside(one, other, 0.05 * float(np.diff(nodes).min()))


def beside(one: Row, other: Row, reach: float, foot: float | None = None) -> bool:
    """Whether places of two rows are within reach of each other, and their feet too; foot: of these another reach."""
    foot = reach if foot is None else foot
    if isinstance(one, Pair) and isinstance(other, Pair):
        straight = abs(one.s - other.s) < reach and abs(one.other - other.other) < foot
        return straight or (abs(one.s - other.other) < reach and abs(one.other - other.s) < reach)
    if isinstance(one, Beside) and isinstance(other, Beside):
        return one.number == other.number and abs(one.s - other.s) < reach
    return False


def _pairs(
    s: Array, theta: Array, r: Array, apart: float, before: Moving | None, below: float
) -> list[tuple[float, Row]]:
    """Gaps and pairs of samples and feet on the strip."""
    t = np.stack([np.cos(theta), np.sin(theta)], axis=1)
    n = np.stack([-t[:, 1], t[:, 0]], axis=1)
    apart_by = r[:, None, :] - r[None, :, :]
    along = np.einsum("ijk,jk->ij", apart_by, t)
    high = np.einsum("ijk,jk->ij", apart_by, n)
    i, j = np.nonzero((along[:, :-1] >= 0.0) & (along[:, 1:] < 0.0))
    share = along[i, j] / (along[i, j] - along[i, j + 1])
    eta = (1.0 - share) * high[i, j] + share * high[i, j + 1]
    turn = np.where(i < j, 1.0, -1.0) * ((1.0 - share) * theta[j] + share * theta[j + 1] - theta[i])
    ends = (i == 0) | (i == len(s) - 1)
    near = (np.abs(eta) < apart + LOST) & ((np.abs(turn) > FACING) | (ends & (np.abs(turn) > 0.5 * math.pi)))
    found: list[tuple[float, Row]] = []
    for k in np.flatnonzero(near):
        foot = float(s[j[k]] + share[k] * (s[j[k] + 1] - s[j[k]]))
        allowed = sides(float(turn[k]))
        if not allowed:
            continue
        side = allowed[0] if len(allowed) == 1 else _side_before(before, float(s[i[k]]), foot, float(eta[k]))
        gap = side * float(eta[k]) - apart
        if -LOST < gap < below:
            found.append((gap, Pair(float(s[i[k]]), foot, side, apart, bool(ends[k]))))
    return found


def _side_before(before: Moving | None, s: float, foot: float, eta: float) -> float:
    """The side on which s was of s' at a state before; of no state: on which it is."""
    if before is None:
        return math.copysign(1.0, eta)
    theta, _, r = before.shape(np.array([s, foot]))
    return math.copysign(1.0, float((r[0] - r[1]) @ [-math.sin(theta[1]), math.cos(theta[1])]))
