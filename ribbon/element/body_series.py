"""Power series of one segment seen from its END, with first and second derivatives (numba): the mixed (glued) model.

With the symbols of `ribbon.element.series`, on a segment that starts with ``Q(0) = 1``, ``p(0) = J(0) = 0`` (thesis,
eq. 2.1, 2.4)::

    Q' = Q [kappa]_x ,  p' = Q e_z ,  J' = p ,  T' = Q e_x ,      kappa = (omega, 0, eta omega)

the quantities here are the unit quaternion q of Q, ``q' = (1/2) q o (0, kappa)``, ``q(0) = 1`` (so that a full turn
gives -1), and the vectors seen from the end (docs/theory.md, eq. (3.9))::

    u = Q^T p ,  u' = e_z - kappa x u ;      v = Q^T J ,  v' = u - kappa x v ;      t = Q^T T ,  t' = e_x - kappa x t .

Values
------
have their own series. For ``y' = e - kappa x y`` the recurrence is that of a row of Q. v needs no coupled series: with
``J(L) = L p(L) - int s Q e_z ds`` it is ``v = L u - c``, ``c' = s e_z - kappa x c``. Two sub-segments make::

    q = q1 o q2 ,   u = Q2^T u1 + u2 ,   v = Q2^T (v1 + h2 u1) + v2 ,   t = Q2^T t1 + t2 .

Derivatives
-----------
come from those of Q, p, J, T (`ribbon.element.series.walk`), whose rows share one recurrence and fill the processor's
lanes: u, v and t by the product rule, and those of q, with the axial vector phi of the skew part of ``Q^T dQ``, by::

    phi_c = axial(Q^T d_c Q) ,   d_i q = (1/2) q o phi_i ,   d_ij q = (1/2) q o phi_ij - (1/4) (phi_i . phi_j) q .

(``d_i Q = Q [theta_i]_x``, ``d_ij Q = Q ([theta_j]_x [theta_i]_x + [d_j theta_i]_x)``, ``phi_i = theta_i``,
``phi_ij = d_j theta_i + theta_j x theta_i / 2``, and theta_j o theta_i = theta_j x theta_i - theta_j . theta_i.)

Units: those of `ribbon.element.series` (a 1/length^2, b 1/length, n 1/length, m 1; u, t length; v length^2; q 1).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.element.free_series import parameter_count
from ribbon.element.free_series import product as free_product
from ribbon.element.series import (
    COMPONENTS,
    FMA,
    MAX_TERMS,
    TINY,
    advance,
    next_term,
    product,
    step_length,
)

#: Rows of the jets: quaternion (w, x, y, z), u, v, t.
BODY_QUANTITIES = 13


@njit(cache=True, fastmath=FMA, error_model="numpy")
def _values(a, b, n, m, length, level, out):
    """Quaternion, u, v, t (level: see `body_values`) at the end of one sub-segment of `length`, by their series.

    Vectors have the recurrence of `ribbon.element.series` for (x, y, z, g), with z less what their source brings. The
    quaternion has ``(w, x, y, z)' = (omega / 2) (-g0, g1, g2, g3)``, ``g0 = x + eta z``, ``g1 = w + eta y``,
    ``g2 = z - eta x``, ``g3 = eta w - y``. A number doubled (ww, gg) is that of the term before.
    """
    ha = a * length * length
    hb = b * length
    n = n * length
    # the first two terms: q = 1, u = 0, t = 0; then q' = (0, kappa_0) / 2, u' = e_z, t' = e_x; c begins with the third
    ww, xx, yy, zz = 1.0, 0.0, 0.0, 0.0
    w, x, y, z = 0.0, 0.5 * hb, 0.0, 0.5 * m * hb
    gg0, gg1, gg2, gg3 = 0.0, 1.0, 0.0, m
    sw, sx, sy, sz = 1.0, x, 0.0, z
    ux, uy, uz, uyy, ug, ugg = 0.0, 0.0, 0.0, 0.0, 1.0, 0.0
    su0, su1, su2 = 0.0, 0.0, 1.0
    cx, cy, cz, cyy, cg, cgg = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    sc0, sc1, sc2 = 0.0, 0.0, 0.5
    tx, ty, tz, tyy, tg, tgg = 1.0, 0.0, 0.0, 0.0, -m, 0.0
    st0, st1, st2 = 1.0, 0.0, 0.0
    small = 0
    for k in range(2, MAX_TERMS):
        f = 1.0 / k
        kb = hb * f
        ka = ha * f
        kn = n * (k - 1) * f
        g0 = x + m * z + n * zz
        g1 = w + m * y + n * yy
        g2 = z - m * x - n * xx
        g3 = m * w + n * ww - y
        ww, xx, yy, zz = w, x, y, z
        w = -0.5 * (kb * g0 + ka * gg0)
        x = 0.5 * (kb * g1 + ka * gg1)
        y = 0.5 * (kb * g2 + ka * gg2)
        z = 0.5 * (kb * g3 + ka * gg3)
        gg0, gg1, gg2, gg3 = g0, g1, g2, g3
        sw += w
        sx += x
        sy += y
        sz += z
        ux, uy, uz, uyy, ug, ugg = next_term(ux, uy, uz, uyy, ug, ugg, ka, kb, kn, n, m)
        su0 += ux
        su1 += uy
        su2 += uz
        size = abs(w) + abs(x) + abs(y) + abs(z) + abs(ux) + abs(uy) + abs(uz)
        if level >= 1:
            cx, cy, cz, cyy, cg, cgg = next_term(cx, cy, cz, cyy, cg, cgg, ka, kb, kn, n, m)
            if k == 2:
                cg = 0.5
            sc0 += cx
            sc1 += cy
            sc2 += cz
        if level >= 2:
            tx, ty, tz, tyy, tg, tgg = next_term(tx, ty, tz, tyy, tg, tgg, ka, kb, kn, n, m)
            st0 += tx
            st1 += ty
            st2 += tz
            size += abs(tx) + abs(ty) + abs(tz)
        small = small + 1 if size < TINY else 0
        if small == 3:
            break
    out[0], out[1], out[2], out[3] = sw, sx, sy, sz
    out[4], out[5], out[6] = length * su0, length * su1, length * su2
    if level >= 1:
        square = length * length
        out[7], out[8], out[9] = square * (su0 - sc0), square * (su1 - sc1), square * (su2 - sc2)
    if level >= 2:
        out[10], out[11], out[12] = length * st0, length * st1, length * st2


@njit(cache=True)
def body_values(a, b, n, m, length, limit, level, out):
    """Quaternion, u, v, t at the end of a segment in `out` (13,), walked in sub-segments with C below `limit`.

    `level` 0: quaternion and u alone; 1: and v; 2: and t. What is not asked for is left alone. Returns the number of
    sub-segments.
    """
    h = step_length(a, b, n, m, length, limit)
    _values(a, b, n, m, h, level, out)
    if h >= length:
        return 1
    part = np.empty(BODY_QUANTITIES)
    done = h
    count = 1
    while done < length:
        end = advance(a, b, n, m, done, length, limit)
        h = end - done
        _values(a, b + a * done, n, m + n * done, h, level, part)
        w, x, y, z = part[0], part[1], part[2], part[3]
        if level >= 1:
            for i in range(3):
                out[7 + i] += h * out[4 + i]
        for i in range(4, 7 + 3 * level, 3):
            # y = Q2^T r + part: with f = 2 r x (x, y, z), Q2^T r = r + w f + f x (x, y, z)
            r0, r1, r2 = out[i], out[i + 1], out[i + 2]
            f0, f1, f2 = 2.0 * (r1 * z - r2 * y), 2.0 * (r2 * x - r0 * z), 2.0 * (r0 * y - r1 * x)
            out[i] = r0 + w * f0 + f1 * z - f2 * y + part[i]
            out[i + 1] = r1 + w * f1 + f2 * x - f0 * z + part[i + 1]
            out[i + 2] = r2 + w * f2 + f0 * y - f1 * x + part[i + 2]
        q0, q1, q2, q3 = out[0], out[1], out[2], out[3]
        out[0] = q0 * w - q1 * x - q2 * y - q3 * z
        out[1] = q0 * x + q1 * w + q2 * z - q3 * y
        out[2] = q0 * y + q2 * w + q3 * x - q1 * z
        out[3] = q0 * z + q3 * w + q1 * y - q2 * x
        done = end
        count += 1
    return count


@njit(cache=True, fastmath=FMA)
def _quaternion(state, phi, jets):
    """Derivatives of the quaternion from those of Q (first 9 rows of `state`); its value is in `jets` already.

    `phi` (3, components) is scratch.
    """
    components = jets.shape[1]
    parameters = parameter_count(components)
    q0, q1, q2, q3 = jets[0, 0], jets[1, 0], jets[2, 0], jets[3, 0]
    for c in range(1, components):
        x = y = z = 0.0
        for r in range(0, 9, 3):
            x += state[r + 2, 0] * state[r + 1, c] - state[r + 1, 0] * state[r + 2, c]
            y += state[r, 0] * state[r + 2, c] - state[r + 2, 0] * state[r, c]
            z += state[r + 1, 0] * state[r, c] - state[r, 0] * state[r + 1, c]
        # phi / 2 = (Q^T d_c Q skew) / 2; the sums above are twice the skew part's axial vector
        x *= 0.25
        y *= 0.25
        z *= 0.25
        phi[0, c] = x
        phi[1, c] = y
        phi[2, c] = z
        jets[0, c] = -q1 * x - q2 * y - q3 * z
        jets[1, c] = q0 * x + q2 * z - q3 * y
        jets[2, c] = q0 * y + q3 * x - q1 * z
        jets[3, c] = q0 * z + q1 * y - q2 * x
    k = 1 + parameters
    for i in range(1, 1 + parameters):
        for j in range(i, 1 + parameters):
            s = phi[0, i] * phi[0, j] + phi[1, i] * phi[1, j] + phi[2, i] * phi[2, j]
            jets[0, k] -= s * q0
            jets[1, k] -= s * q1
            jets[2, k] -= s * q2
            jets[3, k] -= s * q3
            k += 1


@njit(cache=True)
def to_body(state, phi, level, jets):
    """Fills `jets` (13, components) from `state` (12, 15 or 18, components), jets of Q, p, J, T by any number of
    parameters; the quaternion's value is in `jets` already. `phi` (3, components) is scratch."""
    _quaternion(state, phi, jets)
    components = jets.shape[1]
    for block in range(level + 1):
        for i in range(3):
            row = 4 + 3 * block + i
            for c in range(components):
                jets[row, c] = 0.0
            for r in range(3):
                if components == COMPONENTS:
                    product(state[3 * r + i], state[9 + 3 * block + r], jets[row])
                else:
                    free_product(state[3 * r + i], state[9 + 3 * block + r], jets[row])
