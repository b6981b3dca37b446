"""The strip of finite width and thickness: Audoly and Neukirch's energy with what changes along the strip.

Per length in D w / l^2, with f the deflection of the relaxed section along the normal
(docs/theory.md, eq. (10.12), (10.13))::

    e = e_extensible(k, t) + w^2 / 24 t'^2 + (1 - nu) <(d f_y / ds)^2>
    f_y = w [nu kb xi - c4 k B Theta(xi; c4 k^2)]

The second term is restrained warping: the curvature along the strip is k - y t' across. The third is the twist of a
section whose shape changes along s, with the exact derivative of f_y by k', t' and K'; < > is the mean over the width.
Nothing is fitted. With k' = t' = K' = 0 it is `extensible`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.energies import extensible
from ribbon.energies.energy import FreeTwist
from ribbon.energies.section.profile import FINITE
from ribbon.energies.section.relaxed import slopes


@njit(cache=True)
def density(k, t, dk, dt, natural, slope, section, out):
    """Fills `out` (15,) (layout: `ribbon.energies.free`)."""
    extensible.density(k, t, dk, dt, natural, slope, section, out)
    half_width, thickness, nu, _ = section
    width = 2.0 * half_width
    square = width * width
    c4 = 3.0 * (1.0 - nu * nu) * square * square / (thickness * thickness)
    out[0] += square / 24.0 * dt * dt
    out[4] += square / 12.0 * dt
    out[14] += square / 12.0
    # d f_y / ds = w [p xi - m Theta - n dTheta/dy], with c = k B
    q1, r1, s1, u1, q2, r2, s2, u2, q3, r3, s3 = slopes(c4 * k * k)
    by, byy = 2.0 * c4 * k, 4.0 * c4 * c4 * k * k  # y_k, y_k^2; y_kk = 2 c4
    a1, a2, a3 = by * r1, by * r2, by * r3  # by k: of twist, square, change
    b1, b2 = by * s1, by * s2  # by k: of d twist / dy, d square / dy
    aa1, aa2, aa3 = byy * s1 + 2.0 * c4 * r1, byy * s2 + 2.0 * c4 * r2, byy * s3 + 2.0 * c4 * r3
    bb1, bb2 = byy * u1 + 2.0 * c4 * s1, byy * u2 + 2.0 * c4 * s2
    kk, tt, kt = k * k, t * t, k * t
    p = nu * (dk - slope)
    c_k = nu * k * (3.0 * k - 2.0 * natural) + tt
    c_kk = nu * (6.0 * k - 2.0 * natural)
    m = c4 * (c_k * dk + 2.0 * kt * dt - nu * kk * slope)
    e = 2.0 * c4 * c4
    n_d = e * kk * (nu * k * (k - natural) + tt)  # n = n_d dk
    n_dk = e * k * (nu * k * (4.0 * k - 3.0 * natural) + 2.0 * tt)
    n_dt = e * 2.0 * kk * t
    n = n_d * dk
    first = np.empty((2, 4))
    second = np.zeros((2, 10))
    first[0, 0] = c4 * (c_kk * dk + 2.0 * t * dt - 2.0 * nu * k * slope)
    first[0, 1] = 2.0 * c4 * (t * dk + k * dt)
    first[0, 2] = c4 * c_k
    first[0, 3] = 2.0 * c4 * kt
    first[1, 0] = n_dk * dk
    first[1, 1] = n_dt * dk
    first[1, 2] = n_d
    first[1, 3] = 0.0
    second[0, 0] = c4 * nu * (6.0 * dk - 2.0 * slope)
    second[0, 1] = 2.0 * c4 * dt
    second[0, 2] = c4 * c_kk
    second[0, 3] = 2.0 * c4 * t
    second[0, 4] = 2.0 * c4 * dk
    second[0, 5] = 2.0 * c4 * t
    second[0, 6] = 2.0 * c4 * k
    second[1, 0] = e * (nu * k * (12.0 * k - 6.0 * natural) + 2.0 * tt) * dk
    second[1, 1] = 4.0 * e * kt * dk
    second[1, 2] = n_dk
    second[1, 4] = 2.0 * e * kk * dk
    second[1, 5] = n_dt
    # S = p^2 / 12 - 2 p x + m^2 q2 + m n r2 + n^2 q3, x = m q1 + n r1
    x = m * q1 + n * r1
    x_k, x_kk = m * a1 + n * b1, m * aa1 + n * bb1  # by k through q1, r1 alone
    u, v = 2.0 * m * q2 + n * r2, m * r2 + 2.0 * n * q3
    u_k, v_k = 2.0 * m * a2 + n * b2, m * b2 + 2.0 * n * a3
    w_k = m * m * a2 + m * n * b2 + n * n * a3
    w_kk = m * m * aa2 + m * n * bb2 + n * n * aa3
    factor = (1.0 - nu) * square
    out[0] += factor * (p * p / 12.0 - 2.0 * p * x + 0.5 * (u * m + v * n))
    place = 5
    pair = 0
    for i in range(4):
        p_i = nu if i == 2 else 0.0
        m_i, n_i = first[0, i], first[1, i]
        x_i = m_i * q1 + n_i * r1
        y_i = u * m_i + v * n_i
        if i == 0:
            x_i += x_k
            y_i += w_k
        out[1 + i] += factor * (p * p_i / 6.0 - 2.0 * (p_i * x + p * x_i) + y_i)
        for j in range(i, 4):
            p_j = nu if j == 2 else 0.0
            m_j, n_j = first[0, j], first[1, j]
            x_j = m_j * q1 + n_j * r1
            x_ij = second[0, pair] * q1 + second[1, pair] * r1
            y_ij = u * second[0, pair] + v * second[1, pair]
            y_ij += 2.0 * q2 * m_i * m_j + r2 * (m_i * n_j + n_i * m_j) + 2.0 * q3 * n_i * n_j
            if i == 0:
                x_ij += m_j * a1 + n_j * b1
                y_ij += u_k * m_j + v_k * n_j
                if j == 0:
                    x_j += x_k
                    x_ij += m_j * a1 + n_j * b1 + x_kk
                    y_ij += u_k * m_j + v_k * n_j + w_kk
            out[place] += factor * (p_i * p_j / 6.0 - 2.0 * (p_i * x_j + p_j * x_i + p * x_ij) + y_ij)
            place += 1
            pair += 1


ENERGY = FreeTwist(
    density,
    needs=("thickness",),
    holds_twist=True,
    section=FINITE,
    words="strip of finite width and thickness: extensible, with restrained warping and sections that change along it",
)
