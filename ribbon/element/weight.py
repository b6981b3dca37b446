"""Energy of a chained ribbon's weight, and its derivatives from the balance of moments (numba).

The jets of the gravity energy ``Gamma int <r, e> ds`` by the parameters of every segment, and the factors u, v of what
two segments share (`ribbon.problems.chained_kernels`; docs/theory.md, eq. (4.2), (4.3)), by the series of
`ribbon.element.balance_series` instead of jets of frame, chord and chord integral. On a sub-segment with the frame
``R`` at its start, ``W_0, W_1`` the first moments of what is behind its ends, each in the frame there,
docs/theory.md, eq. (4.12)::

    dE/dq_c = Gamma int <d_c kappa, m> ds ,    m(0) = W_0 x g(0) ,     W_0 = int M t ds + Q W_1 ,
    u_c = R sigma_c ,      sigma_c = int Q d_c kappa ds ,
    v_c = Gamma R mu_c ,   mu_c = d_c m(0) = Q (W_1 x D_c g(1) - D_c m(1)) ,

with D at held g(0), m(0); the true d_c m is ``D_c m + Q^T mu_c``, hence ::

    d2E/dq_c dq_d = Gamma (int <d_c kappa, D_d m> + <d_cd kappa, m> ds + <sigma_c, mu_d>) .

A segment's sub-segments are joined as segments of a strip are: by ``<u, v>``.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.element.balance_series import ROW, balance, frames
from ribbon.element.series import FMA, PAIR_INDEX, advance

#: Numbers of a sub-segment: the scaled a h^2, b h, n h, m, its start in the segment, its length h.
_PIECE = 6


@njit(cache=True, error_model="numpy")
def cut(q, lengths, limit):
    """The sub-segments (k, 6) of segments with parameters q (p, 4), and the segment (k,) of each."""
    p = lengths.size
    room = p + p // 2 + 8
    pieces, owner = np.empty((room, _PIECE)), np.empty(room, dtype=np.int64)
    count = 0
    for i in range(p):
        a, b, n, m = q[i, 0], q[i, 1], q[i, 2], q[i, 3]
        done = 0.0
        while True:
            if count == room:
                room *= 2
                more, whose = np.empty((room, _PIECE)), np.empty(room, dtype=np.int64)
                more[:count], whose[:count] = pieces[:count], owner[:count]
                pieces, owner = more, whose
            end = advance(a, b, n, m, done, lengths[i], limit)
            h = end - done
            piece = pieces[count]
            piece[0], piece[1], piece[2], piece[3] = a * h * h, (b + a * done) * h, n * h, m + n * done
            piece[4], piece[5] = done, h
            owner[count] = i
            count += 1
            done = end
            if not done < lengths[i]:  # also if it is not a number
                break
    return pieces[:count], owner[:count]


@njit(cache=True, fastmath=FMA, error_model="numpy")
def height(q, lengths, loads, position):
    """int <r, e> ds (units l^2) of a strip with parameters q (p, 4) that begins at `position` (3,)."""
    pieces, owner = cut(q, lengths, loads.limit)
    k = owner.size
    rows, up = np.empty((k, 3, ROW)), loads.up
    frames(pieces, rows)
    behind = 0.0
    for i in range(k):
        behind += pieces[i, 5]
    total = behind * (position[0] * up[0] + position[1] * up[1] + position[2] * up[2])
    frame = loads.frame
    g0 = frame[0, 0] * up[0] + frame[1, 0] * up[1] + frame[2, 0] * up[2]
    g1 = frame[0, 1] * up[0] + frame[1, 1] * up[1] + frame[2, 1] * up[2]
    g2 = frame[0, 2] * up[0] + frame[1, 2] * up[1] + frame[2, 2] * up[2]
    for i in range(k):
        h, row = pieces[i, 5], rows[i]
        z0 = g0 * row[0, 5] + g1 * row[1, 5] + g2 * row[2, 5]
        z1 = g0 * row[0, 6] + g1 * row[1, 6] + g2 * row[2, 6]
        total += h * (behind * z0 - h * z1)
        behind -= h
        g0, g1, g2 = (
            g0 * row[0, 0] + g1 * row[1, 0] + g2 * row[2, 0],
            g0 * row[0, 1] + g1 * row[1, 1] + g2 * row[2, 1],
            g0 * row[0, 2] + g1 * row[1, 2] + g2 * row[2, 2],
        )
    return total


@njit(cache=True, fastmath=FMA, error_model="numpy")
def _placed(pieces, rows, loads, place, behind, starts):
    """Fills frames (k, 3, 3) at the starts of sub-segments, first moments (k + 1, 3) of what is behind in the frames
    there, and `starts` (k, 8) of `balance`; how long (k,) what is behind each start is.

    rows (k, 3, ROW): of `frames`."""
    k = pieces.shape[0]
    up = loads.up
    frame = loads.frame.copy()
    for i in range(k):
        place[i] = frame
        for c in range(3):
            starts[i, c] = frame[0, c] * up[0] + frame[1, c] * up[1] + frame[2, c] * up[2]
        for r in range(3):
            x, y, z = place[i, r, 0], place[i, r, 1], place[i, r, 2]
            for c in range(3):
                frame[r, c] = x * rows[i, 0, c] + y * rows[i, 1, c] + z * rows[i, 2, c]
    lengths = np.empty(k)
    behind[k] = 0.0
    length = 0.0
    for i in range(k - 1, -1, -1):
        h = pieces[i, 5]
        length += h
        lengths[i] = length
        for r in range(3):
            row = rows[i, r]
            moved = row[0] * behind[i + 1, 0] + row[1] * behind[i + 1, 1] + row[2] * behind[i + 1, 2]
            behind[i, r] = h * (length * row[5] - h * row[6]) + moved
        w, g, f = behind[i], starts[i], 1.0 / (length * length)
        starts[i, 3] = f * (w[1] * g[2] - w[2] * g[1])
        starts[i, 4] = f * (w[2] * g[0] - w[0] * g[2])
        starts[i, 5] = f * (w[0] * g[1] - w[1] * g[0])
        starts[i, 6] = h / length
        starts[i, 7] = starts[i, 6] * starts[i, 6]
    return lengths


@njit(cache=True, fastmath=FMA, error_model="numpy")
def _derived(piece, rows, end, result, spin, lift, first, second):
    """Of one sub-segment, by its scaled parameters: sigma (4, 3) `spin` and mu (4, 3) `lift` in the frame at its start,
    first (4,) and second (4, 4) derivatives.

    rows (3, ROW); end (3,): what is behind its end, over the square of the length behind its start, as m is; result
    (11, 5): of `balance`.
    """
    a, b, n, m = piece[0], piece[1], piece[2], piece[3]
    x0, x1, z0, z1, z2 = result[6], result[7], result[8], result[9], result[10]
    for r in range(3):
        row = rows[r]
        spin[0, r] = row[4] + n * row[7] + m * row[6]
        spin[1, r] = row[3] + n * row[6] + m * row[5]
        spin[2, r] = a * row[7] + b * row[6]
        spin[3, r] = a * row[6] + b * row[5]
    for c in range(4):
        g0, g1, g2 = result[0, 1 + c], result[1, 1 + c], result[2, 1 + c]
        y0 = end[1] * g2 - end[2] * g1 - result[3, 1 + c]
        y1 = end[2] * g0 - end[0] * g2 - result[4, 1 + c]
        y2 = end[0] * g1 - end[1] * g0 - result[5, 1 + c]
        for r in range(3):
            lift[c, r] = rows[r, 0] * y0 + rows[r, 1] * y1 + rows[r, 2] * y2
        d = 1 + c
        second[0, c] = x1[d] + n * z2[d] + m * z1[d]
        second[1, c] = x0[d] + n * z1[d] + m * z0[d]
        second[2, c] = a * z2[d] + b * z1[d]
        second[3, c] = a * z1[d] + b * z0[d]
    first[0] = x1[0] + n * z2[0] + m * z1[0]
    first[1] = x0[0] + n * z1[0] + m * z0[0]
    first[2] = a * z2[0] + b * z1[0]
    first[3] = a * z1[0] + b * z0[0]
    # d_cd kappa: omega's parameters with eta's
    second[0, 2] += z2[0]
    second[0, 3] += z1[0]
    second[1, 2] += z1[0]
    second[1, 3] += z0[0]
    for c in range(4):
        for d in range(c, 4):
            second[c, d] += spin[c, 0] * lift[d, 0] + spin[c, 1] * lift[d, 1] + spin[c, 2] * lift[d, 2]


@njit(cache=True, fastmath=FMA, error_model="numpy")
def _unscaled(piece, frame, size, spin, lift, first, second, own, u, v):
    """By the parameters of its segment: what `_derived` found, into own (15,) and into u, v (4, 3), in the fixed frame;
    size: what the weight's moments are over."""
    h, d = piece[5], piece[4]
    hh = h * h
    for r in range(3):
        x, y, z = frame[r, 0], frame[r, 1], frame[r, 2]
        u[0, r] = hh * (x * spin[0, 0] + y * spin[0, 1] + z * spin[0, 2])
        u[1, r] = h * (x * spin[1, 0] + y * spin[1, 1] + z * spin[1, 2])
        u[2, r] = h * (x * spin[2, 0] + y * spin[2, 1] + z * spin[2, 2])
        u[3, r] = x * spin[3, 0] + y * spin[3, 1] + z * spin[3, 2]
        x, y, z = size * x, size * y, size * z
        v[0, r] = hh * (x * lift[0, 0] + y * lift[0, 1] + z * lift[0, 2])
        v[1, r] = h * (x * lift[1, 0] + y * lift[1, 1] + z * lift[1, 2])
        v[2, r] = h * (x * lift[2, 0] + y * lift[2, 1] + z * lift[2, 2])
        v[3, r] = x * lift[3, 0] + y * lift[3, 1] + z * lift[3, 2]
    h0, h1, h2, h3, h4 = size, size * h, size * hh, size * h * hh, size * hh * hh
    own[1], own[2], own[3], own[4] = h2 * first[0], h1 * first[1], h1 * first[2], h0 * first[3]
    own[5], own[6], own[7], own[8] = h4 * second[0, 0], h3 * second[0, 1], h3 * second[0, 2], h2 * second[0, 3]
    own[9], own[10], own[11] = h2 * second[1, 1], h2 * second[1, 2], h1 * second[1, 3]
    own[12], own[13], own[14] = h2 * second[2, 2], h1 * second[2, 3], h0 * second[3, 3]
    if d == 0.0:
        return
    # it begins at d: its own parameters are (a, b + a d, n, m + n d)
    for r in range(3):
        u[0, r] += d * u[1, r]
        u[2, r] += d * u[3, r]
        v[0, r] += d * v[1, r]
        v[2, r] += d * v[3, r]
    own[1] += d * own[2]
    own[3] += d * own[4]
    own[5] += 2.0 * d * own[6] + d * d * own[9]
    own[6] += d * own[9]
    own[7] += d * (own[8] + own[10]) + d * d * own[11]
    own[8] += d * own[11]
    own[10] += d * own[11]
    own[12] += 2.0 * d * own[13] + d * d * own[14]
    own[13] += d * own[14]


@njit(cache=True, fastmath=FMA, error_model="numpy")
def derivatives(q, lengths, loads, local, u, v):
    """Adds the jets of the weight to `local` (p, 15), values left alone, and fills the factors u, v (p, 4, 3).

    q (p, 4); lengths (p,); loads: `ribbon.problems.arguments.Loads`, of which the force at the end is not read.
    """
    pieces, owner = cut(q, lengths, loads.limit)
    k = owner.size
    rows, place, behind = np.empty((k, 3, ROW)), np.empty((k, 3, 3)), np.empty((k + 1, 3))
    starts, results = np.empty((k, 8)), np.empty((k, 11, 5))
    frames(pieces, rows)
    long = _placed(pieces, rows, loads, place, behind, starts)
    balance(pieces, starts, results)
    spin, lift = np.empty((4, 3)), np.empty((4, 3))
    first, second, own = np.empty(4), np.empty((4, 4)), np.empty(15)
    turned, lifted, end = np.empty((4, 3)), np.empty((4, 3)), np.empty(3)
    for j in range(k):
        i = owner[j]
        square = long[j] * long[j]
        for r in range(3):
            end[r] = behind[j + 1, r] / square
        _derived(pieces[j], rows[j], end, results[j], spin, lift, first, second)
        _unscaled(pieces[j], place[j], loads.gamma * square, spin, lift, first, second, own, turned, lifted)
        for c in range(1, 15):
            local[i, c] += own[c]
        if pieces[j, 4] == 0.0:
            u[i], v[i] = turned, lifted
            continue
        for c in range(4):  # the sub-segments before it turn it
            for d in range(4):
                e = PAIR_INDEX[c, d]
                shared = u[i, c, 0] * lifted[d, 0] + u[i, c, 1] * lifted[d, 1] + u[i, c, 2] * lifted[d, 2]
                local[i, e] += 2.0 * shared if c == d else shared
        for c in range(4):
            for r in range(3):
                u[i, c, r] += turned[c, r]
                v[i, c, r] += lifted[c, r]
