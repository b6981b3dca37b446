"""Symmetric indefinite elimination along a strip: fronts of a few dozen unknowns, pivoted, with delays (numba).

The unknowns of a sparse symmetric matrix K stand in groups 0, 1, ... in the order in which they are eliminated; an
entry is added to the front of the earlier of its two groups (Duff and Reid 1983, doi:10.1145/356044.356047, on a tree
that is a chain). A front holds what earlier fronts left and all that its group touches. Of those whose groups have
come, pivots of one or two unknowns are taken::

    K_rr <- K_rr - K_rk D^-1 K_kr ,   D = K_kk of size 1 or 2,

chosen among them as Ashcraft, Grimes and Lewis 1998 (doi:10.1137/S0895479896296921, bounded Bunch-Kaufman, "rook")
and accepted only if ``|D^-1| |K_kr|`` stays below 1/u over the rest of the front; what is not accepted waits for the
next front, so that the last one takes all. A pivot that is small but allowed ties all others to what comes, and they
wait in ever larger fronts (rulings that move nothing, next to a shift): u is large first, and small only where many
wait; those that wait are tried first, with a partner of a tenth of the greatest there is. By Sylvester the signs of the
pivots are the inertia of K.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Bunch and Kaufman's constant, (1 + sqrt 17) / 8.
ALPHA = 0.6403882032022076
#: What `eliminate` says: done; a front, or the factor, was larger than the room given.
DONE, FRONT_FULL, FACTOR_FULL = 0, 1, 2
#: The u that is asked for as long as no more than so many unknowns have to wait for it.
FIRM, WAITING = 1e-2, 12


@njit(cache=True, error_model="numpy")
def equilibrate(one, other, values, rounds, scale):
    """Scales the entries `values` of one triangle in place, ``K <- scale K scale``, so that the greatest of every row
    comes near 1 (D. Ruiz 2001, Rutherford Appleton Laboratory RAL-TR-2001-034); fills scale (n,)."""
    n = scale.size
    most = np.empty(n)
    scale[:] = 1.0
    for _ in range(rounds):
        most[:] = 0.0
        for e in range(values.size):
            i, j = one[e], other[e]
            v = abs(values[e]) * scale[i] * scale[j]
            if v > most[i]:
                most[i] = v
            if v > most[j]:
                most[j] = v
        for i in range(n):
            if most[i] > 0.0:
                scale[i] /= np.sqrt(most[i])
    for e in range(values.size):
        values[e] *= scale[one[e]] * scale[other[e]]


@njit(cache=True)
def arrange(one, other, group, entries, order, touches):
    """Sorts entries (k,) by the earlier group of their places, stably: order (k,), and entries (G + 1,), where each
    group's begin. Returns the unknowns that each group has or touches, in rising order, and fills touches (G + 1,):
    where each group's begin."""
    groups, n = entries.size - 1, group.size
    entries[:] = 0
    for e in range(one.size):
        entries[min(group[one[e]], group[other[e]]) + 1] += 1
    members = np.zeros(groups + 1, dtype=np.int64)
    for i in range(n):
        members[group[i] + 1] += 1
    for g in range(groups):
        entries[g + 1] += entries[g]
        members[g + 1] += members[g]
    at, begin = entries[:-1].copy(), members[:-1].copy()
    for e in range(one.size):
        g = min(group[one[e]], group[other[e]])
        order[at[g]] = e
        at[g] += 1
    own = np.empty(n, dtype=np.int64)
    for i in range(n):
        own[begin[group[i]]] = i
        begin[group[i]] += 1
    found = np.empty(n + 2 * one.size, dtype=np.int64)
    last = np.full(n, -1, dtype=np.int64)
    to = 0
    for g in range(groups):
        touches[g] = to
        for k in range(members[g], members[g + 1]):
            found[to] = own[k]
            last[own[k]] = g
            to += 1
        for k in range(entries[g], entries[g + 1]):
            e = order[k]
            for side in range(2):
                i = one[e] if side == 0 else other[e]
                if last[i] < g:
                    last[i] = g
                    found[to] = i
                    to += 1
        found[touches[g] : to].sort()
    touches[groups] = to
    return found[:to].copy()


@njit(cache=True, fastmath={"nnan", "nsz"})
def _greatest(front, t, low, high):
    """The greatest size of row t in the places [low, high)."""
    best = 0.0
    for j in range(low, high):
        best = max(best, abs(front[t, j]))
    return best


@njit(cache=True)
def _partner(front, t, low, m):
    """Place in [low, m) of the greatest entry of row t beside the diagonal, and its size; -1 where all are zero."""
    best = max(_greatest(front, t, low, t), _greatest(front, t, t + 1, m))
    if best > 0.0:
        for j in range(low, m):
            if abs(front[t, j]) == best and j != t:
                return j, best
    return -1, best


@njit(cache=True)
def _swap(front, ids, where, s, t, m):
    """Exchanges the unknowns at places s and t of a front of m."""
    if s == t:
        return
    for j in range(m):
        v = front[s, j]
        front[s, j] = front[t, j]
        front[t, j] = v
    for j in range(m):
        v = front[j, s]
        front[j, s] = front[j, t]
        front[j, t] = v
    ids[s], ids[t] = ids[t], ids[s]
    where[ids[s]], where[ids[t]] = s, t


@njit(cache=True)
def _moved(front, ids, where, last, to):
    """Puts the unknown at the last place of a front in another, whose own is gone."""
    if to == last:
        return
    for j in range(last):
        front[to, j] = front[last, j]
    front[to, to] = front[last, last]
    for j in range(last):
        front[j, to] = front[to, j]
    ids[to] = ids[last]
    where[ids[to]] = to


class Entries(NamedTuple):
    """A sparse symmetric matrix and the order of elimination: group (n,); entries (G + 1,): where each group's begin
    in one, other, values (k,), those of one place are added up; touched, touches (G + 1,): the unknowns that each group
    has or touches, every one once."""

    group: IntArray
    entries: IntArray
    one: IntArray
    other: IntArray
    values: FloatArray
    touched: IntArray
    touches: IntArray


class Pivots(NamedTuple):
    """What `eliminate` fills: pivot (n, 2), the second -1 in a pivot of one; inverse (n, 3): of D, by pivots; first
    (n + 1,): where a pivot's entries begin; column, left, right: the unknown and the one or two multipliers of each."""

    pivot: IntArray
    inverse: FloatArray
    first: IntArray
    column: IntArray
    left: FloatArray
    right: FloatArray


@njit(forceinline=True)
def _places(g, matrix, remain, m, ids, where, old):
    """Places in the front of group g, of m unknowns: those still to come first, then those to eliminate; `old` has the
    new places of the first `remain`, which were there. Returns how many are to come."""
    group, touched = matrix.group, matrix.touched
    low = 0
    high = m
    for k in range(remain):
        if group[ids[k]] > g:
            old[k] = low
            low += 1
        else:
            high -= 1
            old[k] = high
    for k in range(matrix.touches[g], matrix.touches[g + 1]):
        i = touched[k]
        if where[i] < 0:
            if group[i] > g:
                where[i] = low
                low += 1
            else:
                high -= 1
                where[i] = high
    return low


@njit(forceinline=True, fastmath={"contract"})
def _assemble(g, matrix, remain, m, before, front, ids, where, old, scratch):
    """The front of group g, of m unknowns: what is left of the one before, at new places, and the group's entries."""
    touched = matrix.touched
    for r in range(m):
        for c in range(m):
            front[r, c] = 0.0
    for r in range(remain):
        for c in range(remain):
            front[old[r], old[c]] = before[r, c]
    for k in range(remain):
        where[ids[k]] = old[k]
    for k in range(remain):
        scratch[k] = ids[k]
    for k in range(remain):
        ids[old[k]] = int(scratch[k])
    for k in range(matrix.touches[g], matrix.touches[g + 1]):
        ids[where[touched[k]]] = touched[k]
    for e in range(matrix.entries[g], matrix.entries[g + 1]):
        i, j = where[matrix.one[e]], where[matrix.other[e]]
        front[i, j] += matrix.values[e]
        if i != j:
            front[j, i] += matrix.values[e]


@njit(forceinline=True, fastmath={"contract"})
def _candidate(front, low, m):
    """The pivot that bounded Bunch and Kaufman take in [low, m): its place, its partner's, and whether it is of two."""
    k = m - 1
    r, size = _partner(front, k, low, m)
    two = False
    if abs(front[k, k]) < ALPHA * size:
        while True:
            s, across = _partner(front, r, low, m)
            if abs(front[r, r]) >= ALPHA * across:
                k = r
                break
            together = abs(front[k, k] * front[r, r]) <= 0.5 * size * size
            if s == k or (0.1 * across <= size and together):
                two = True
                break
            k, r, size = r, s, across
    return k, r, two


@njit(forceinline=True)
def _record(filled, count, at, i, j, u, v, w):
    """Pivot `count`: its unknowns and its inverse; its entries begin at `at`."""
    filled.pivot[count, 0], filled.pivot[count, 1] = i, j
    filled.inverse[count, 0], filled.inverse[count, 1], filled.inverse[count, 2] = u, v, w
    filled.first[count] = at


@njit(forceinline=True, error_model="numpy", fastmath={"contract"})
def _take_one(front, ids, where, k, m, row, filled, at):
    """Eliminates place k of a front of m: its multipliers from `at` on, and what it leaves; where the next begin."""
    d = front[k, k]
    m -= 1
    for j in range(m + 1):
        row[j] = front[k, j]
    row[k] = row[m]
    where[ids[k]] = -2
    _moved(front, ids, where, m, k)
    for i in range(m):
        v = row[i]
        if v != 0.0:
            v /= d
            filled.column[at] = ids[i]
            filled.left[at] = v
            at += 1
            for j in range(m):
                front[i, j] -= v * row[j]
    return at


@njit(forceinline=True, error_model="numpy", fastmath={"contract"})
def _take_two(front, ids, where, k, r, m, u, v, w, row1, row2, filled, at):
    """Eliminates places k and r of a front of m together, with [[u, v], [v, w]] the inverse of their block."""
    for j in range(m):
        row1[j], row2[j] = front[k, j], front[r, j]
    where[ids[k]] = -2
    where[ids[r]] = -2
    for step in range(2):
        m -= 1
        to = max(k, r) if step == 0 else min(k, r)
        _moved(front, ids, where, m, to)
        row1[to], row2[to] = row1[m], row2[m]
    for i in range(m):
        x, y = row1[i], row2[i]
        if x != 0.0 or y != 0.0:
            p = u * x + v * y
            q = v * x + w * y
            filled.column[at] = ids[i]
            filled.left[at] = p
            filled.right[at] = q
            at += 1
            for j in range(m):
                front[i, j] -= p * row1[j] + q * row2[j]
    return at


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def eliminate(matrix, threshold, tiny, room, filled):
    """Eliminates all of an `Entries`; returns (DONE or what was full, pivots, negative, zero, delayed).

    threshold u, tiny: size of what counts as zero; room: largest front; filled: `Pivots`.
    """
    where = np.full(matrix.group.size, -1, dtype=np.int64)
    front, before = np.zeros((room, room)), np.zeros((room, room))
    ids, old = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64)
    row1, row2 = np.empty(room), np.empty(room)
    m = 0
    pivots, negative, zero, delayed = 0, 0, 0, 0
    at = 0
    for g in range(matrix.entries.size - 1):
        remain = m
        for k in range(matrix.touches[g], matrix.touches[g + 1]):
            if where[matrix.touched[k]] < 0:
                m += 1
        if m > room:
            return FRONT_FULL, m, 0, 0, 0
        low = _places(g, matrix, remain, m, ids, where, old)
        front, before = before, front
        _assemble(g, matrix, remain, m, before, front, ids, where, old, row1)
        # pivots from the places [low + failed, m), swapped to the end
        failed, taken = 0, 0
        needed = FIRM
        while True:
            if low + failed >= m:
                if low >= m:
                    break
                if taken == 0:
                    if needed <= threshold or m - low <= WAITING:
                        break
                    needed = threshold
                failed, taken = 0, 0
            k, r, two = _candidate(front, low, m)
            beyond = _greatest(front, k, 0, low)
            a = front[k, k]
            if two:
                b, c = front[k, r], front[r, r]
                det = a * c - b * b
                u, v, w = c / det, -b / det, a / det
                other_beyond = _greatest(front, r, 0, low)
                growth = max(abs(u) * beyond + abs(v) * other_beyond, abs(v) * beyond + abs(w) * other_beyond)
                waits, empty = growth * needed > 1.0, False
            else:
                empty = abs(a) <= tiny  # nothing of its own: zero for good once nothing is beyond it either
                waits = beyond > tiny if empty else abs(a) < needed * beyond
            if waits:
                _swap(front, ids, where, k, low + failed, m)
                failed += 1
                continue
            if not empty and at + m > filled.column.size:
                return FACTOR_FULL, at, 0, 0, 0
            if two:
                _record(filled, pivots, at, ids[k], ids[r], u, v, w)
                at = _take_two(front, ids, where, k, r, m, u, v, w, row1, row2, filled, at)
                negative += 1 if det < 0.0 else 2 if a < 0.0 else 0
                m -= 2
            elif empty:
                _swap(front, ids, where, k, m - 1, m)
                _record(filled, pivots, at, ids[m - 1], -1, 0.0, 0.0, 0.0)
                where[ids[m - 1]] = -2
                zero += 1
                m -= 1
            else:
                _record(filled, pivots, at, ids[k], -1, 1.0 / a, 0.0, 0.0)
                at = _take_one(front, ids, where, k, m, row1, filled, at)
                negative += a < 0.0
                m -= 1
            pivots += 1
            taken += 1
        delayed += m - low
    filled.first[pivots] = at
    return DONE, pivots, negative, zero, delayed


@njit(cache=True)
def substitute(pivots, pivot, inverse, first, column, left, right, b):
    """Solves K x = b in place, b (n, k); zero pivots give zero."""
    for t in range(b.shape[1]):
        for k in range(pivots):
            i, j = pivot[k, 0], pivot[k, 1]
            x = b[i, t]
            if j < 0:
                if x != 0.0:
                    for e in range(first[k], first[k + 1]):
                        b[column[e], t] -= left[e] * x
            else:
                y = b[j, t]
                for e in range(first[k], first[k + 1]):
                    b[column[e], t] -= left[e] * x + right[e] * y
        for k in range(pivots - 1, -1, -1):
            i, j = pivot[k, 0], pivot[k, 1]
            x = b[i, t]
            if j < 0:
                x *= inverse[k, 0]
                for e in range(first[k], first[k + 1]):
                    x -= left[e] * b[column[e], t]
                b[i, t] = x
            else:
                y = b[j, t]
                p = inverse[k, 0] * x + inverse[k, 1] * y
                q = inverse[k, 1] * x + inverse[k, 2] * y
                for e in range(first[k], first[k + 1]):
                    v = b[column[e], t]
                    p -= left[e] * v
                    q -= right[e] * v
                b[i, t], b[j, t] = p, q


@njit(cache=True)
def times(one, other, values, x, out):
    """out = K x for the entries of one triangle; x, out (n, k)."""
    out[:] = 0.0
    for t in range(x.shape[1]):
        for e in range(values.size):
            i, j = one[e], other[e]
            out[i, t] += values[e] * x[j, t]
            if i != j:
                out[j, t] += values[e] * x[i, t]
