"""Energy, glue, Jacobian and Hessian of the mixed (glued) ribbon, segment by segment (numba), cost linear in p.

Unknowns. Joint j = 0 ... p carries a position r (3), a quaternion q (4, `ribbon.element.quaternion`), omega and eta; segment i
carries its slope n of eta. They are stored joint by joint, ten per segment, so that a segment and its two joints see 19
consecutive numbers::

    r_i (0..2) | q_i (3..6) | omega_i (7) | eta_i (8) | n_i (9) | r_(i+1) (10..12) | q_(i+1) (13..16) | omega_(i+1) (17) | eta_(i+1) (18)

The places have names in `ribbon.problems.layout`. Segment parameters: ``a = (omega_(i+1) - omega_i) / L, b = omega_i, n = n_i, m = eta_i``. Glue (thesis, eq. 5.6), eight
rows a segment, with the end quaternion Q, the chord u and the weight integral v of `ribbon.element.body_series`
(docs/theory.md, eq. (4.5))::

    r_(i+1) - r_i - R(q_(i+1)) u(a, b, n, m) = 0        (multipliers: the internal force, fixed frame)
    q_(i+1) - q_i o Q(a, b, n, m) = 0
    eta_(i+1) - eta_i - L n_i = 0

A quaternion needs no normalisation: |Q| = 1, so that the glue hands the length of q_0 on. It has no singular rotation
either (a rotation vector has one at a full turn, and coils unwind by many turns in one solve) and no flipped frames (the
off-diagonal products of the thesis have).

Weight: ``Gamma (L <r_i, e> + <R(q_(i+1)) V, e>)`` with V = v, and for the exact one (thesis, eq. 2.9) with
``V = v + n w^2/12 (t + eta_(i+1) u - n v)``, because ``int q ds = R (t + [eta p] - n J)`` (docs/theory.md, eq. (4.7),
(2.10)). Eq. 2.9 weighs the surface between the rulings of both ends, not the strip: where they are oblique a triangle
is missing on one side and one too many on the other, and a straight strip could lower its energy without bound by
turning them. `end_weight` corrects it::

    Gamma w^2/12 ( [eta <t_x, e> + eta^2/2 <t_z, e>]_(s=0) - [the same]_(s=l) )  + O(w^4)
"""  # noqa: E501

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.element.body_series import body_values
from ribbon.element.element import bending_value, natural_value
from ribbon.element.quaternion import form, product, rotate, rotate_by_q, unrotate
from ribbon.element.series import PAIR_FIRST, PAIR_SECOND
from ribbon.problems.layout import ETA, NEXT, OMEGA, QUATERNION, SLOPE, STRIDE

#: Rows of the glue per segment.
ROWS = 8
# local places of z = (omega_i, eta_i, n_i, omega_(i+1)), the parameters that bend a segment
Z = np.array([OMEGA, ETA, SLOPE, NEXT + OMEGA])
# the quaternions of a segment's joints
_Q = range(QUATERNION, OMEGA)
_NEXT_Q = range(NEXT + QUATERNION, NEXT + OMEGA)


def jacobian_structure(p: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (69 p,) of the glue's Jacobian, in the order in which `jacobian` fills the values."""
    rows: list[int] = []
    columns: list[int] = []
    for k in range(3):
        rows += [k] * 10
        columns += [k, NEXT + k, *_NEXT_Q, *Z]
    for k in range(4):
        rows += [3 + k] * 9
        columns += [_NEXT_Q[k], *_Q, *Z]
    rows += [7] * 3
    columns += [NEXT + ETA, ETA, SLOPE]
    i = np.arange(p)
    return (
        (ROWS * i[:, None] + np.array(rows)).ravel(),
        (STRIDE * i[:, None] + np.array(columns)).ravel(),
    )


def hessian_structure(p: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (52 p,) of the lower triangle, in the order in which `hessian` fills the values."""
    pairs: list[tuple[int, int]] = []
    pairs += [(int(Z[i]), int(Z[j])) for i, j in zip(PAIR_FIRST, PAIR_SECOND, strict=True)]
    pairs += [(_NEXT_Q[i], _NEXT_Q[j]) for i in range(4) for j in range(i + 1)]
    pairs += [(_NEXT_Q[i], int(z)) for z in Z for i in range(4)]
    pairs += [(_Q[i], int(z)) for z in Z for i in range(4)]
    lower = np.array([(max(a, b), min(a, b)) for a, b in pairs])
    i = np.arange(p)
    return (STRIDE * i[:, None] + lower[:, 0]).ravel(), (STRIDE * i[:, None] + lower[:, 1]).ravel()


JACOBIAN_ENTRIES = 69
HESSIAN_ENTRIES = 52


@njit(cache=True)
def parameters(x, lengths, q):
    """q (p, 4) = (a, b, n, m) of every segment from the unknowns."""
    for i in range(lengths.size):
        k = STRIDE * i
        q[i, 0] = (x[k + NEXT + OMEGA] - x[k + OMEGA]) / lengths[i]
        q[i, 1] = x[k + OMEGA]
        q[i, 2] = x[k + SLOPE]
        q[i, 3] = x[k + ETA]


@njit(cache=True)
def by_unknowns(jet, length):
    """A jet (15,) by (a, b, n, m) turned, in place, into one by z = (omega_0, eta_0, n, omega_1), pairs in order."""
    f = 1.0 / length
    a, b, n, m = jet[1], jet[2], jet[3], jet[4]
    aa, ab, an, am = jet[5], jet[6], jet[7], jet[8]
    bb, bn, bm = jet[9], jet[10], jet[11]
    nn, nm, mm = jet[12], jet[13], jet[14]
    jet[1] = b - f * a
    jet[2] = m
    jet[3] = n
    jet[4] = f * a
    jet[5] = bb - f * (2.0 * ab - f * aa)
    jet[6] = bm - f * am
    jet[7] = bn - f * an
    jet[8] = f * (ab - f * aa)
    jet[9] = mm
    jet[10] = nm
    jet[11] = f * am
    jet[12] = nn
    jet[13] = f * an
    jet[14] = f * f * aa


@njit(cache=True)
def energy_and_glue(
    x, lengths, code, section, natural, curvature, poisson, gamma, up, exact, limit, want_glue, parts, glue
):
    """Fills `parts` (3,) with bending, natural-curvature and gravity energy and, if wanted, `glue` (8 p,)."""
    parts[:] = 0.0
    slope = curvature[1] - curvature[0]
    out = np.empty(13)
    v = np.empty(3)
    rotated = np.empty(3)
    turned = np.empty(4)
    level = 0
    if gamma != 0.0:
        level = 2 if exact else 1
    s = 0.0
    for i in range(lengths.size):
        k = STRIDE * i
        length = lengths[i]
        a = (x[k + NEXT + OMEGA] - x[k + OMEGA]) / length
        b = x[k + OMEGA]
        n = x[k + SLOPE]
        m = x[k + ETA]
        parts[0] += bending_value(code, a, b, n, m, length, section)
        if natural:
            parts[1] += natural_value(a, b, n, m, length, curvature[0] + slope * s, slope, poisson)
        s += length
        if not (want_glue or gamma != 0.0):
            continue
        body_values(a, b, n, m, length, limit, level, out)
        if gamma != 0.0:
            for c in range(3):
                v[c] = out[7 + c]
            if exact:
                f = section[0] * section[0] / 3.0 * n
                for c in range(3):
                    v[c] += f * (out[10 + c] + (m + n * length) * out[4 + c] - n * out[7 + c])
            rotate(x[k + NEXT + QUATERNION : k + NEXT + OMEGA], v, rotated)
            for c in range(3):
                parts[2] += gamma * up[c] * (length * x[k + c] + rotated[c])
        if want_glue:
            g = ROWS * i
            rotate(x[k + NEXT + QUATERNION : k + NEXT + OMEGA], out[4:7], rotated)
            for c in range(3):
                glue[g + c] = x[k + NEXT + c] - x[k + c] - rotated[c]
            product(x[k + QUATERNION : k + OMEGA], out[0:4], turned)
            for c in range(4):
                glue[g + 3 + c] = x[k + NEXT + QUATERNION + c] - turned[c]
            glue[g + 7] = x[k + NEXT + ETA] - m - n * length


@njit(cache=True)
def weight_jets(jets, q, lengths, half_width, exact, weight):
    """Fills `weight` (p, 3, 15) with the jets of V by (a, b, n, m), from the body jets (p, 13, 15)."""
    c = half_width * half_width / 3.0
    f = np.zeros(15)
    for i in range(lengths.size):
        for r in range(3):
            weight[i, r] = jets[i, 7 + r]
        if not exact:
            continue
        n = q[i, 2]
        m = q[i, 3]
        length = lengths[i]
        # V += c n t + c n (m + n L) u - c n^2 v, factors with their own derivatives by n and m
        f[:] = 0.0
        f[0] = c * n
        f[3] = c
        for r in range(3):
            _add_product(f, jets[i, 10 + r], weight[i, r])
        f[0] = c * n * (m + n * length)
        f[3] = c * (m + 2.0 * n * length)
        f[4] = c * n
        f[12] = 2.0 * c * length
        f[13] = c
        for r in range(3):
            _add_product(f, jets[i, 4 + r], weight[i, r])
        f[:] = 0.0
        f[0] = -c * n * n
        f[3] = -2.0 * c * n
        f[12] = -2.0 * c
        for r in range(3):
            _add_product(f, jets[i, 7 + r], weight[i, r])


@njit(cache=True)
def _add_product(f, g, out):
    """out (15,) += jet of f g."""
    for c in range(15):
        out[c] += f[0] * g[c]
    for c in range(1, 15):
        out[c] += g[0] * f[c]
    k = 5
    for i in range(1, 5):
        for j in range(i, 5):
            out[k] += f[i] * g[j] + f[j] * g[i]
            k += 1


@njit(cache=True)
def all_by_unknowns(lengths, local, jets, rows, weight, weighted):
    """Turns the elastic jets (p, 15), the first `rows` body jets and, if `weighted`, the weight's by z, in place."""
    for i in range(lengths.size):
        by_unknowns(local[i], lengths[i])
        for r in range(rows):
            by_unknowns(jets[i, r], lengths[i])
        if weighted:
            for r in range(3):
                by_unknowns(weight[i, r], lengths[i])


@njit(cache=True)
def gradient(x, lengths, local, gamma, up, weight, out):
    """Gradient (>= 10 p + 9,) of the energy; `out` is zeroed first. Jets by z."""
    out[:] = 0.0
    n = np.empty((4, 4))
    e = np.empty(3)
    for i in range(lengths.size):
        k = STRIDE * i
        for z in range(4):
            out[k + Z[z]] += local[i, 1 + z]
        if gamma == 0.0:
            continue
        q = x[k + NEXT + QUATERNION : k + NEXT + OMEGA]
        for c in range(3):
            out[k + c] += gamma * lengths[i] * up[c]
        form(up, weight[i, :, 0], n)
        for r in range(4):
            out[k + NEXT + QUATERNION + r] += (
                2.0 * gamma * (n[r, 0] * q[0] + n[r, 1] * q[1] + n[r, 2] * q[2] + n[r, 3] * q[3])
            )
        unrotate(q, up, e)
        for z in range(4):
            out[k + Z[z]] += gamma * (
                e[0] * weight[i, 0, 1 + z] + e[1] * weight[i, 1, 1 + z] + e[2] * weight[i, 2, 1 + z]
            )


@njit(cache=True)
def jacobian(x, lengths, jets, out):
    """Values (69 p,) of the glue's Jacobian in the order of `jacobian_structure`. Jets by z."""
    rotated = np.empty(3)
    turned = np.empty(4)
    block = np.empty((3, 4))
    at = 0
    for i in range(lengths.size):
        k = STRIDE * i
        q0 = x[k + QUATERNION : k + OMEGA]
        q1 = x[k + NEXT + QUATERNION : k + NEXT + OMEGA]
        jet = jets[i]
        rotate_by_q(q1, jet[4:7, 0], block)
        for r in range(3):
            base = at + 10 * r
            out[base] = -1.0
            out[base + 1] = 1.0
            for c in range(4):
                out[base + 2 + c] = -block[r, c]
        for z in range(4):
            rotate(q1, jet[4:7, 1 + z], rotated)
            for r in range(3):
                out[at + 10 * r + 6 + z] = -rotated[r]
        at += 30
        w, a, b, c = jet[0, 0], jet[1, 0], jet[2, 0], jet[3, 0]
        # - right matrix of Q
        for r in range(4):
            out[at + 9 * r] = 1.0
        out[at + 1], out[at + 2], out[at + 3], out[at + 4] = -w, a, b, c
        out[at + 10], out[at + 11], out[at + 12], out[at + 13] = -a, -w, -c, b
        out[at + 19], out[at + 20], out[at + 21], out[at + 22] = -b, c, -w, -a
        out[at + 28], out[at + 29], out[at + 30], out[at + 31] = -c, -b, a, -w
        for z in range(4):
            product(q0, jet[0:4, 1 + z], turned)
            for r in range(4):
                out[at + 9 * r + 5 + z] = -turned[r]
        at += 36
        out[at] = 1.0
        out[at + 1] = -1.0
        out[at + 2] = -lengths[i]
        at += 3


@njit(cache=True)
def hessian(x, lengths, multipliers, factor, local, jets, gamma, up, weight, out):
    """Values (52 p,) of the lower triangle of ``factor d2E + sum multipliers d2 glue``, `hessian_structure`. Jets by z.

    multipliers (8 p,).
    """
    n = np.empty((4, 4))
    n_weight = np.empty((4, 4))
    force = np.empty(3)
    e = np.empty(3)
    lam = np.empty(3)
    spin = np.empty(4)
    back = np.empty(4)
    weigh = gamma != 0.0 and factor != 0.0
    g = factor * gamma
    at = 0
    for i in range(lengths.size):
        k = STRIDE * i
        row = ROWS * i
        q0 = x[k + QUATERNION : k + OMEGA]
        q1 = x[k + NEXT + QUATERNION : k + NEXT + OMEGA]
        jet = jets[i]
        for c in range(3):
            lam[c] = multipliers[row + c]
        unrotate(q1, lam, force)
        # conj(q0) o mu: the multiplier of the quaternion's glue seen from the joint
        m0, m1, m2, m3 = multipliers[row + 3], multipliers[row + 4], multipliers[row + 5], multipliers[row + 6]
        w, a, b, c0 = q0[0], q0[1], q0[2], q0[3]
        spin[0] = w * m0 + a * m1 + b * m2 + c0 * m3
        spin[1] = w * m1 - a * m0 - b * m3 + c0 * m2
        spin[2] = w * m2 + a * m3 - b * m0 - c0 * m1
        spin[3] = w * m3 - a * m2 + b * m1 - c0 * m0
        for c in range(5, 15):
            t = factor * local[i, c]
            t -= force[0] * jet[4, c] + force[1] * jet[5, c] + force[2] * jet[6, c]
            t -= spin[0] * jet[0, c] + spin[1] * jet[1, c] + spin[2] * jet[2, c] + spin[3] * jet[3, c]
            out[at + c - 5] = t
        if weigh:
            unrotate(q1, up, e)
            for c in range(5, 15):
                out[at + c - 5] += g * (e[0] * weight[i, 0, c] + e[1] * weight[i, 1, c] + e[2] * weight[i, 2, c])
        at += 10
        form(lam, jet[4:7, 0], n)
        if weigh:
            form(up, weight[i, :, 0], n_weight)
        for r in range(4):
            for c in range(r + 1):
                t = -2.0 * n[r, c]
                if weigh:
                    t += 2.0 * g * n_weight[r, c]
                out[at] = t
                at += 1
        for z in range(4):
            form(lam, jet[4:7, 1 + z], n)
            if weigh:
                form(up, weight[i, :, 1 + z], n_weight)
            for r in range(4):
                t = -2.0 * (n[r, 0] * q1[0] + n[r, 1] * q1[1] + n[r, 2] * q1[2] + n[r, 3] * q1[3])
                if weigh:
                    t += (
                        2.0
                        * g
                        * (
                            n_weight[r, 0] * q1[0]
                            + n_weight[r, 1] * q1[1]
                            + n_weight[r, 2] * q1[2]
                            + n_weight[r, 3] * q1[3]
                        )
                    )
                out[at] = t
                at += 1
        for z in range(4):
            # mu o conj(Q_z)
            d0, d1, d2, d3 = jet[0, 1 + z], jet[1, 1 + z], jet[2, 1 + z], jet[3, 1 + z]
            back[0] = m0 * d0 + m1 * d1 + m2 * d2 + m3 * d3
            back[1] = -m0 * d1 + m1 * d0 - m2 * d3 + m3 * d2
            back[2] = -m0 * d2 + m1 * d3 + m2 * d0 - m3 * d1
            back[3] = -m0 * d3 - m1 * d2 + m2 * d1 + m3 * d0
            for r in range(4):
                out[at] = -back[r]
                at += 1


@njit(cache=True)
def end_weight(q, eta, up, factor, by, second):
    """``f = factor (eta <R e_x, up> + eta^2/2 <R e_z, up>)`` at one joint; returns f.

    Fills `by` (5,) with the derivatives by q (4) and eta, `second` (15,) with the lower triangle of the second ones in
    the order (q, eta).
    """
    n_x = np.empty((4, 4))
    n_z = np.empty((4, 4))
    axis = np.zeros(3)
    axis[0] = 1.0
    form(up, axis, n_x)
    axis[0], axis[2] = 0.0, 1.0
    form(up, axis, n_z)
    across = 0.0
    along = 0.0
    at = 0
    for r in range(4):
        d_x = n_x[r, 0] * q[0] + n_x[r, 1] * q[1] + n_x[r, 2] * q[2] + n_x[r, 3] * q[3]
        d_z = n_z[r, 0] * q[0] + n_z[r, 1] * q[1] + n_z[r, 2] * q[2] + n_z[r, 3] * q[3]
        across += q[r] * d_x
        along += q[r] * d_z
        by[r] = factor * (2.0 * eta * d_x + eta * eta * d_z)
        second[10 + r] = factor * 2.0 * (d_x + eta * d_z)
        for c in range(r + 1):
            second[at] = factor * (2.0 * eta * n_x[r, c] + eta * eta * n_z[r, c])
            at += 1
    by[4] = factor * (across + eta * along)
    second[14] = factor * along
    return factor * (eta * across + 0.5 * eta * eta * along)


@njit(cache=True)
def walk(x, lengths, limit):
    """Writes positions, quaternions and eta of joints 1 ... p from joint 0, the omegas and the n: glue satisfied."""
    out = np.empty(13)
    rotated = np.empty(3)
    turned = np.empty(4)
    for i in range(lengths.size):
        k = STRIDE * i
        length = lengths[i]
        body_values(
            (x[k + NEXT + OMEGA] - x[k + OMEGA]) / length, x[k + OMEGA], x[k + SLOPE], x[k + ETA], length, limit, 0, out
        )
        product(x[k + QUATERNION : k + OMEGA], out[0:4], turned)
        for c in range(4):
            x[k + NEXT + QUATERNION + c] = turned[c]
        rotate(turned, out[4:7], rotated)
        for c in range(3):
            x[k + NEXT + c] = x[k + c] + rotated[c]
        x[k + NEXT + ETA] = x[k + ETA] + length * x[k + SLOPE]
