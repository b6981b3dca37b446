"""Kernels of the thesis's own mixed model (5.2): a full matrix per segment, orthonormality, off-diagonal glue (numba).

Every segment owns sixteen numbers, its place, its frame by rows, and its shape::

    r (0..2) | R (3..11), R[r, c] at 3 + 3 r + c | a (12) | b (13) | n (14) | m (15)

With Q, p, J of `ribbon.element.series`, seen from the start of the segment, its end is ``v = r + R p``, ``G = R Q``.
Rows, in this order:

* orthonormality of every frame that is not known, six (thesis, eq. 5.5): ``|R_x|^2 - 1``, ``|R_y|^2 - 1``,
  ``|R_z|^2 - 1``, ``<R_y, R_z>``, ``<R_z, R_x>``, ``<R_x, R_y>``;
* the glue from a segment to the next (marked '), eight (thesis, eq. 5.6): ``r' - v`` (units of l), the off-diagonal
  products ``<R'_y, G_z>``, ``<R'_z, G_x>``, ``<R'_x, G_y>`` (small turns about x, y, z), ``b' - b - a L``,
  ``m' - m - n L``;
* with a seam, the same eight from the last segment to the first, with opposite signs (end less start) and with
  ``(delta R'_x, delta R'_y, R'_z)``, ``delta b'``, ``delta m'`` (thesis, eq. 6.1).

Diagonal products ``<R'_x, G_x> - 1`` have no gradient where they vanish (thesis, 5.1). The off-diagonal ones do not
tell right frames from wrong ones: with orthonormal frames they vanish as well for ``R' = G diag(+-1, +-1, +-1)`` and
when the columns of R' are, up to signs, those of G moved on by one; seven right-handed turns thus pass for none.

Weight: ``Gamma (L <r, e> + <R V, e>)``, V = J, and for the exact one (thesis, eq. 2.9)
``V = J + n w^2/12 (T + eta(L) p - n J)``, ``T = int Q e_x ds``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ribbon.element.body_series import body_values
from ribbon.element.element import bending_value, natural_value
from ribbon.element.quaternion import rotate
from ribbon.element.series import FURTHEST, PAIR_FIRST, PAIR_SECOND
from ribbon.problems.layout import MATRIX_A as A
from ribbon.problems.layout import MATRIX_B as B
from ribbon.problems.layout import MATRIX_FRAME as FRAME
from ribbon.problems.layout import MATRIX_M as M
from ribbon.problems.layout import MATRIX_N as N
from ribbon.problems.layout import MATRIX_STRIDE as STRIDE

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: First place of (a, b, n, m); rows of orthonormality; rows of a glue.
SHAPE = A
ORTHONORMAL = 6
GLUE = 8
_ORTHONORMAL_ENTRIES = 27
_GLUE_ENTRIES = 81
# columns of the products of a frame with itself, beside the three squares
_FIRST = (1, 2, 0)
_SECOND = (2, 0, 1)


def _joined(p: int, seam: int) -> tuple[np.ndarray, np.ndarray]:
    """First unknowns of the segments that are glued (own) and of those they are glued to."""
    own = np.arange(p if seam else p - 1)
    return STRIDE * own, STRIDE * ((own + 1) % p)


def core_rows(p: int, first: int, seam: int) -> int:
    """Rows of p segments, the first `first` of them with a known frame; with those of a seam (``seam != 0``)."""
    return ORTHONORMAL * (p - first) + GLUE * (p if seam else p - 1)


def entries(p: int, first: int, seam: int) -> tuple[int, int]:
    """Numbers of entries of the core's Jacobian and Hessian."""
    glues = p if seam else p - 1
    return _ORTHONORMAL_ENTRIES * (p - first) + _GLUE_ENTRIES * glues, 46 * p + 18 * (p - first) + 63 * glues


def jacobian_structure(p: int, first: int, seam: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of the core's Jacobian, in the order in which `jacobian` fills the values."""
    rows: list[int] = []
    columns: list[int] = []
    for c in range(3):
        rows += [c] * 3
        columns += [FRAME + 3 * r + c for r in range(3)]
    for c in range(3):
        rows += [3 + c] * 6
        columns += [FRAME + 3 * r + k for k in (_FIRST[c], _SECOND[c]) for r in range(3)]
    i = np.arange(first, p)[:, None]
    found = [((ORTHONORMAL * (i - first) + np.array(rows)).ravel(), (STRIDE * i + np.array(columns)).ravel())]
    # of a glue: columns of the next segment are marked by next = 1
    rows, columns, following = [], [], []
    for k in range(3):
        rows += [k] * 9
        columns += [k, k, *range(FRAME + 3 * k, FRAME + 3 * k + 3), *range(SHAPE, SHAPE + 4)]
        following += [1] + [0] * 8
    for k in range(3):
        rows += [3 + k] * 16
        columns += [FRAME + 3 * r + _FIRST[k] for r in range(3)] + list(range(FRAME, SHAPE + 4))
        following += [1] * 3 + [0] * 13
    for k, (slope, value) in enumerate(((SHAPE, SHAPE + 1), (SHAPE + 2, SHAPE + 3))):
        rows += [6 + k] * 3
        columns += [value, value, slope]
        following += [1, 0, 0]
    own, other = _joined(p, seam)
    base = np.where(np.array(following) == 1, other[:, None], own[:, None])
    at = ORTHONORMAL * (p - first) + GLUE * np.arange(own.size)[:, None]
    found.append(((at + np.array(rows)).ravel(), (base + np.array(columns)).ravel()))
    return np.concatenate([f[0] for f in found]), np.concatenate([f[1] for f in found])


def hessian_structure(p: int, first: int, seam: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of the lower triangle, in the order in which `hessian` fills the values."""
    own = STRIDE * np.arange(p)[:, None]
    pairs = [(SHAPE + int(j), SHAPE + int(i)) for i, j in zip(PAIR_FIRST, PAIR_SECOND, strict=True)]
    pairs += [(SHAPE + z, FRAME + k) for z in range(4) for k in range(9)]
    local = np.array(pairs)
    found = [((own + local[:, 0]).ravel(), (own + local[:, 1]).ravel())]
    local = np.array([(FRAME + 3 * r + i, FRAME + 3 * r + j) for r in range(3) for i in range(3) for j in range(i + 1)])
    found.append(((own[first:] + local[:, 0]).ravel(), (own[first:] + local[:, 1]).ravel()))
    pairs = [(FRAME + 3 * r + _FIRST[k], FRAME + 3 * r + c) for k in range(3) for r in range(3) for c in range(3)]
    pairs += [(FRAME + 3 * r + _FIRST[k], SHAPE + z) for k in range(3) for r in range(3) for z in range(4)]
    local = np.array(pairs)
    joined, other = _joined(p, seam)
    rows, columns = (other[:, None] + local[:, 0]).ravel(), (joined[:, None] + local[:, 1]).ravel()
    found.append((np.maximum(rows, columns), np.minimum(rows, columns)))
    return np.concatenate([f[0] for f in found]), np.concatenate([f[1] for f in found])


@njit(cache=True)
def _to_matrix(q, out):
    """out (3, 3): the rotation of the unit quaternion q (4,)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    out[0, 0] = w * w + x * x - y * y - z * z
    out[1, 1] = w * w - x * x + y * y - z * z
    out[2, 2] = w * w - x * x - y * y + z * z
    out[0, 1], out[1, 0] = 2.0 * (x * y - w * z), 2.0 * (x * y + w * z)
    out[0, 2], out[2, 0] = 2.0 * (x * z + w * y), 2.0 * (x * z - w * y)
    out[1, 2], out[2, 1] = 2.0 * (y * z - w * x), 2.0 * (y * z + w * x)


@njit(cache=True)
def ends(x, lengths, limit, points, frames):
    """Ends v (p, 3) and G (p, 3, 3) of all segments."""
    out = np.empty(13)
    q = np.empty((3, 3))
    chord = np.empty(3)
    for i in range(lengths.size):
        k = STRIDE * i
        body_values(x[k + A], x[k + B], x[k + N], x[k + M], lengths[i], limit, 0, out)
        _to_matrix(out[0:4], q)
        rotate(out[0:4], out[4:7], chord)
        frame = x[k + FRAME : k + SHAPE].reshape(3, 3)
        for r in range(3):
            points[i, r] = x[k + r]
            for c in range(3):
                points[i, r] += frame[r, c] * chord[c]
                frames[i, r, c] = frame[r, 0] * q[0, c] + frame[r, 1] * q[1, c] + frame[r, 2] * q[2, c]


@njit(cache=True)
def energy_and_rows(
    x, lengths, code, section, natural, curvature, poisson, gamma, up, exact, limit, first, seam, parts, rows, tail,
):  # fmt: skip
    """Fills `parts` (3,): bending, natural-curvature and gravity energy, and the core's `rows`; nan where the segments
    turn further than `FURTHEST` (unglued, they may be anywhere).

    first: number of known frames (0 or 1); seam: 0 or delta; tail (5, 3): Q_x, Q_y, Q_z, p and ``Q_x + eta(L) Q_z`` of
    the last segment, for what holds the end.
    """
    parts[:] = 0.0
    turned = 0.0
    slope = curvature[1] - curvature[0]
    count = lengths.size
    out = np.empty(13)
    v = np.empty(3)
    chord = np.empty(3)
    q = np.empty((3, 3))
    level = 0
    if gamma != 0.0:
        level = 2 if exact else 1
    s = 0.0
    for i in range(count):
        k = STRIDE * i
        length = lengths[i]
        a, b, n, m = x[k + A], x[k + B], x[k + N], x[k + M]
        turned += length * (abs(b) + abs(a) * length) * (1.0 + abs(m) + abs(n) * length)
        if not turned <= FURTHEST:
            parts[:] = np.nan
            rows[:] = np.nan
            return
        parts[0] += bending_value(code, a, b, n, m, length, section)
        if natural:
            parts[1] += natural_value(a, b, n, m, length, curvature[0] + slope * s, slope, poisson)
        s += length
        body_values(a, b, n, m, length, limit, level, out)
        frame = x[k + FRAME : k + SHAPE].reshape(3, 3)
        if gamma != 0.0:
            if exact:
                f = section[0] * section[0] / 3.0 * n
                for c in range(3):
                    out[7 + c] += f * (out[10 + c] + (m + n * length) * out[4 + c] - n * out[7 + c])
            rotate(out[0:4], out[7:10], v)
            for r in range(3):
                height = length * x[k + r] + frame[r, 0] * v[0] + frame[r, 1] * v[1] + frame[r, 2] * v[2]
                parts[2] += gamma * up[r] * height
        _to_matrix(out[0:4], q)
        rotate(out[0:4], out[4:7], chord)
        if i >= first:
            at = ORTHONORMAL * (i - first)
            for c in range(3):
                d, e = _FIRST[c], _SECOND[c]
                rows[at + c] = frame[0, c] ** 2 + frame[1, c] ** 2 + frame[2, c] ** 2 - 1.0
                rows[at + 3 + c] = frame[0, d] * frame[0, e] + frame[1, d] * frame[1, e] + frame[2, d] * frame[2, e]
        last = i == count - 1
        if last:
            for r in range(3):
                tail[3, r] = chord[r]
                for c in range(3):
                    tail[c, r] = q[r, c]
                tail[4, r] = q[r, 0] + (m + n * length) * q[r, 2]
            if seam == 0:
                continue
        flip = -1.0 if last else 1.0
        delta = float(seam) if last else 1.0
        j = 0 if last else k + STRIDE
        at = ORTHONORMAL * (count - first) + GLUE * i
        for r in range(3):
            end = x[k + r] + frame[r, 0] * chord[0] + frame[r, 1] * chord[1] + frame[r, 2] * chord[2]
            rows[at + r] = flip * (x[j + r] - end)
        for c in range(3):
            d, e = _FIRST[c], _SECOND[c]
            total = 0.0
            for r in range(3):
                g = frame[r, 0] * q[0, e] + frame[r, 1] * q[1, e] + frame[r, 2] * q[2, e]
                total += x[j + FRAME + 3 * r + d] * g
            rows[at + 3 + c] = flip * (delta if d < 2 else 1.0) * total
        rows[at + 6] = flip * (delta * x[j + B] - b - length * a)
        rows[at + 7] = flip * (delta * x[j + M] - m - length * n)


@njit(cache=True)
def gradient(x, lengths, local, gamma, up, weight, out):
    """Gradient (>= 16 p,) of the energy from the elastic jets (p, 15) and the weight's (p, 3, 15); zeroed first."""
    out[:] = 0.0
    for i in range(lengths.size):
        k = STRIDE * i
        for z in range(4):
            out[k + SHAPE + z] = local[i, 1 + z]
        if gamma == 0.0:
            continue
        for r in range(3):
            g = gamma * up[r]
            out[k + r] = g * lengths[i]
            for c in range(3):
                out[k + FRAME + 3 * r + c] = g * weight[i, c, 0]
                for z in range(4):
                    out[k + SHAPE + z] += g * x[k + FRAME + 3 * r + c] * weight[i, c, 1 + z]


@njit(cache=True)
def jacobian(x, lengths, states, first, seam, out):
    """Values of the core's Jacobian in the order of `jacobian_structure`; states (p, >= 12, 15): jets of Q and p."""
    count = lengths.size
    h = np.empty(3)
    at = 0
    for i in range(first, count):
        frame = x[STRIDE * i + FRAME : STRIDE * i + SHAPE].reshape(3, 3)
        for c in range(3):
            for r in range(3):
                out[at + 3 * c + r] = 2.0 * frame[r, c]
                out[at + 9 + 6 * c + r] = frame[r, _SECOND[c]]
                out[at + 12 + 6 * c + r] = frame[r, _FIRST[c]]
        at += _ORTHONORMAL_ENTRIES
    for i in range(count if seam != 0 else count - 1):
        last = i == count - 1
        flip = -1.0 if last else 1.0
        delta = float(seam) if last else 1.0
        k = STRIDE * i
        j = 0 if last else k + STRIDE
        jet = states[i]
        frame = x[k + FRAME : k + SHAPE].reshape(3, 3)
        other = x[j + FRAME : j + SHAPE].reshape(3, 3)
        for r in range(3):
            out[at] = flip
            out[at + 1] = -flip
            for c in range(3):
                out[at + 2 + c] = -flip * jet[9 + c, 0]
            for z in range(1, 5):
                out[at + 4 + z] = -flip * (
                    frame[r, 0] * jet[9, z] + frame[r, 1] * jet[10, z] + frame[r, 2] * jet[11, z]
                )
            at += 9
        for c in range(3):
            d, e = _FIRST[c], _SECOND[c]
            f = flip * (delta if d < 2 else 1.0)
            for r in range(3):
                out[at + r] = f * (frame[r, 0] * jet[e, 0] + frame[r, 1] * jet[3 + e, 0] + frame[r, 2] * jet[6 + e, 0])
                for t in range(3):
                    out[at + 3 + 3 * r + t] = f * other[r, d] * jet[3 * t + e, 0]
                h[r] = f * (frame[0, r] * other[0, d] + frame[1, r] * other[1, d] + frame[2, r] * other[2, d])
            for z in range(1, 5):
                out[at + 11 + z] = h[0] * jet[e, z] + h[1] * jet[3 + e, z] + h[2] * jet[6 + e, z]
            at += 16
        for _ in range(2):
            out[at] = flip * delta
            out[at + 1] = -flip
            out[at + 2] = -flip * lengths[i]
            at += 3


@njit(cache=True)
def hessian(x, lengths, multipliers, factor, local, states, gamma, up, weight, first, seam, out):
    """Values of the lower triangle of ``factor d2E + sum multipliers d2 core``, in the order of `hessian_structure`.

    The glue and the weight are linear in R, ``<Y, R Q> + force . R p + g . R V``, with ``Y_e = lambda R'_d``.
    """
    count = lengths.size
    weigh = gamma != 0.0 and factor != 0.0
    mixed = count if seam != 0 else count - 1
    glue = ORTHONORMAL * (count - first)
    y = np.zeros((3, 3))
    back = np.zeros((3, 3))
    force = np.zeros(3)
    turned = np.zeros(3)
    g = factor * gamma * up
    own = np.zeros(3)
    at = 0
    square = 46 * count
    pair = square + 18 * (count - first)
    for i in range(count):
        k = STRIDE * i
        jet = states[i]
        frame = x[k + FRAME : k + SHAPE].reshape(3, 3)
        if i < mixed:
            last = i == count - 1
            flip = -1.0 if last else 1.0
            delta = float(seam) if last else 1.0
            j = 0 if last else k + STRIDE
            row = glue + GLUE * i
            for r in range(3):
                force[r] = -flip * multipliers[row + r]
            for c in range(3):
                d, e = _FIRST[c], _SECOND[c]
                f = flip * (delta if d < 2 else 1.0) * multipliers[row + 3 + c]
                for r in range(3):
                    y[r, e] = f * x[j + FRAME + 3 * r + d]
                    for t in range(3):
                        out[pair + 9 * c + 3 * r + t] = f * jet[3 * t + e, 0]
                    for z in range(4):
                        out[pair + 27 + 12 * c + 4 * r + z] = f * (
                            frame[r, 0] * jet[e, 1 + z]
                            + frame[r, 1] * jet[3 + e, 1 + z]
                            + frame[r, 2] * jet[6 + e, 1 + z]
                        )
            pair += 63
        else:
            y[:] = 0.0
            force[:] = 0.0
        for c in range(3):
            turned[c] = frame[0, c] * force[0] + frame[1, c] * force[1] + frame[2, c] * force[2]
            own[c] = frame[0, c] * g[0] + frame[1, c] * g[1] + frame[2, c] * g[2]
            for e in range(3):
                back[c, e] = frame[0, c] * y[0, e] + frame[1, c] * y[1, e] + frame[2, c] * y[2, e]
        for s in range(5, 15):
            t = factor * local[i, s]
            for c in range(3):
                t += turned[c] * jet[9 + c, s]
                for e in range(3):
                    t += back[c, e] * jet[3 * c + e, s]
            if weigh:
                t += own[0] * weight[i, 0, s] + own[1] * weight[i, 1, s] + own[2] * weight[i, 2, s]
            out[at + s - 5] = t
        at += 10
        for z in range(1, 5):
            for r in range(3):
                for c in range(3):
                    t = force[r] * jet[9 + c, z]
                    t += y[r, 0] * jet[3 * c, z] + y[r, 1] * jet[3 * c + 1, z] + y[r, 2] * jet[3 * c + 2, z]
                    if weigh:
                        t += g[r] * weight[i, c, z]
                    out[at + 3 * r + c] = t
            at += 9
        if i >= first:
            row = ORTHONORMAL * (i - first)
            for _ in range(3):
                # places 00, 10, 11, 20, 21, 22; rows yz, zx, xy
                out[square] = 2.0 * multipliers[row]
                out[square + 1] = multipliers[row + 5]
                out[square + 2] = 2.0 * multipliers[row + 1]
                out[square + 3] = multipliers[row + 4]
                out[square + 4] = multipliers[row + 3]
                out[square + 5] = 2.0 * multipliers[row + 2]
                square += 6


@dataclass(frozen=True)
class EndRows:
    """Rows ``held <form, r> + <form, R e> - value - height`` at the end of the last segment, e from its series.

    forms (k, 3); mix (k, 5): e in terms of Q_x, Q_y, Q_z, p and the ruling ``Q_x + eta(L) Q_z``; held is the part of p;
    base: first unknown of the segment. The jets of those five are given as (5, 3, 15), their values as (5, 3).
    """

    forms: FloatArray
    mix: FloatArray
    value: FloatArray
    base: int
    plate: int = -1
    lower: float = 0.0
    upper: float = 0.0

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.value)

    def values(self, x: FloatArray, tail: FloatArray) -> FloatArray:
        """(count,); tail (5, 3)."""
        own = x[self.base : self.base + STRIDE]
        ends = self.mix[:, 3:4] * own[:FRAME] + (self.mix @ tail) @ own[FRAME:SHAPE].reshape(3, 3).T
        return (self.forms * ends).sum(axis=1) - self.value - (x[self.plate] if self.plate >= 0 else 0.0)

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """r, R, (a, b, n, m) (and the plate's height)."""
        columns = np.append(self.base + np.arange(STRIDE), [self.plate] if self.plate >= 0 else []).astype(np.int64)
        return np.repeat(np.arange(self.count), columns.size), np.tile(columns, self.count)

    def jacobian(self, x: FloatArray, jets: FloatArray) -> FloatArray:
        """In the order of the structure; jets (5, 3, 15)."""
        e = np.tensordot(self.mix, jets[:, :, :5], 1)
        turned = self.forms @ x[self.base + FRAME : self.base + SHAPE].reshape(3, 3)
        out = np.empty((self.count, STRIDE + int(self.plate >= 0)))
        out[:, :FRAME] = self.mix[:, 3:4] * self.forms
        out[:, FRAME:SHAPE] = (self.forms[:, :, None] * e[:, None, :, 0]).reshape(-1, 9)
        out[:, SHAPE:STRIDE] = np.einsum("kc,kcz->kz", turned, e[:, :, 1:])
        out[:, STRIDE:] = -1.0
        return out.ravel()

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """The shape by itself and by R."""
        pairs = [(SHAPE + int(j), SHAPE + int(i)) for i, j in zip(PAIR_FIRST, PAIR_SECOND, strict=True)]
        pairs += [(SHAPE + z, FRAME + k) for k in range(9) for z in range(4)]
        local = self.base + np.array(pairs)
        return local[:, 0], local[:, 1]

    def hessian(self, x: FloatArray, multipliers: FloatArray, jets: FloatArray) -> FloatArray:
        """In the order of the structure; jets (5, 3, 15)."""
        # what pulls at each of the five: (3, 5)
        pull = (multipliers[:, None] * self.forms).T @ self.mix
        turned = x[self.base + FRAME : self.base + SHAPE].reshape(3, 3).T @ pull
        seconds = np.tensordot(turned, jets[:, :, 5:], ([1, 0], [0, 1]))
        return np.concatenate([seconds, np.tensordot(pull, jets[:, :, 1:5], 1).ravel()])
