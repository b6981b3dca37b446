"""Wunderlich's equations of equilibrium as a system of first order, and its integrator.

Lengths in l, energies in D w / l, weightless. With ``L = omega^2 (1 + eta^2)^2 H(x) / 2``, ``x = w eta' / 2``,
``H = artanh(x) / x`` (E. L. Starostin and G. H. M. van der Heijden 2007, doi:10.1038/nmat1929), and the moment
conjugate to the ruling, ``p = dL / d eta'``, the conditions of equilibrium are, ``kappa = (omega, 0, eta omega)``,

    M' = -kappa x M - e_z x R^T n ,   n constant,   N := M_1 + eta M_3 = dL / d omega ,   p' = dL / d eta - omega M_3 .

Solved for x: with ``x = tanh(b / 2)`` the two definitions of N and p give one equation without omega,

    q := 4 p (1 + eta^2)^2 / (w N^2) = H' / H^2 = 2 (sinh b - b) / b^2 ,                                            (*)

which rises from -infinity to infinity with b, and then

    omega = N tanh(b/2) / ((b/2) (1 + eta^2)^2) ,  eta' = (2/w) tanh(b/2) ,  p' = omega (2 eta N / (1 + eta^2) - M_3) .

So the equations are an explicit system of first order in (r, R, M, eta, p). Where the curvature passes zero, N does:
q is infinite there, ``w eta' / 2`` is 1 or -1 by the sign of p, and omega falls like N / ln(1 / N^2): the right side is
continuous, and the integrator's steps go through it. Along a solution ``N omega / 2 + p eta' + n . t_z`` is constant.
State y (12,): r, R as a quaternion, M, eta, p.
"""

from __future__ import annotations

import numpy as np
from numba import njit

#: Numbers of a state, and of what moves it: state and force.
STATE, ALL = 12, 15


@njit(cache=True)
def bent(q):
    """b of (*), real, from a finite q."""
    size = abs(q)
    if size < 1e-3:
        b = 3.0 * size - 1.35 * size**3  # q = b / 3 + b^3 / 60
    else:
        b = min(3.0 * size, np.log(2.0 + size * (1.0 + np.log(1.0 + size)) ** 2))
    for _ in range(60):
        step = (ratio(b) - size) / ratio_slope(b)
        step = max(-1.0, min(1.0, step))
        b = max(0.5 * b, b - step)
        if abs(step) <= 4e-16 * b:
            break
    return b if q >= 0.0 else -b


@njit(cache=True)
def ratio(b):
    """q of (*)."""
    if abs(b) < 0.3:
        c = b * b
        return b / 3.0 * (1.0 + c / 20.0 * (1.0 + c / 42.0 * (1.0 + c / 72.0 * (1.0 + c / 110.0))))
    return 2.0 * (np.sinh(b) - b) / (b * b)


@njit(cache=True)
def ratio_slope(b):
    """dq / db."""
    if abs(b) < 0.3:
        c = b * b
        return (1.0 + c / 20.0 * (3.0 + c / 42.0 * (5.0 + c / 72.0 * (7.0 + 9.0 * c / 110.0)))) / 3.0
    return 2.0 * (b * np.cosh(b) - 2.0 * np.sinh(b) + b) / b**3


@njit(cache=True)
def bent_at(y, width):
    """b of (*) at a state, real."""
    u, bending = 1.0 + y[10] * y[10], y[7] + y[10] * y[9]
    return bent((4.0 * y[11] * u * u / (width * bending * bending)).real)


@njit(cache=True)
def slope(y, force, width, b, out):
    """y' (12,), real or by a complex step (imaginary parts tiny), of a state under the force n (3,) in world axes; b:
    `bent_at` its real part."""
    a, i, j, k = y[3], y[4], y[5], y[6]
    m1, m2, m3, eta, p = y[7], y[8], y[9], y[10], y[11]
    u = 1.0 + eta * eta
    bending = m1 + eta * m3
    q = 4.0 * p * u * u / (width * bending * bending)
    half = 0.5 * (b + 1j * q.imag / ratio_slope(b))
    x = np.tanh(half)
    flat = x / half if abs(half) > 1e-5 else 1.0 - half * half / 3.0
    omega = bending * flat / (u * u)
    tau = eta * omega
    # columns of R from the quaternion (a; i, j, k)
    tx = (a * a + i * i - j * j - k * k, 2.0 * (i * j + a * k), 2.0 * (i * k - a * j))
    ty = (2.0 * (i * j - a * k), a * a - i * i + j * j - k * k, 2.0 * (j * k + a * i))
    tz = (2.0 * (i * k + a * j), 2.0 * (j * k - a * i), a * a - i * i - j * j + k * k)
    f1 = tx[0] * force[0] + tx[1] * force[1] + tx[2] * force[2]
    f2 = ty[0] * force[0] + ty[1] * force[1] + ty[2] * force[2]
    out[0], out[1], out[2] = tz[0], tz[1], tz[2]
    out[3] = -0.5 * (i * omega + k * tau)
    out[4] = 0.5 * (a * omega + j * tau)
    out[5] = 0.5 * (k * omega - i * tau)
    out[6] = 0.5 * (a * tau - j * omega)
    out[7] = tau * m2 + f2  # -(kappa x M)_1 = kappa_3 M_2, -(e_z x f)_1 = f_2
    out[8] = omega * m3 - tau * m1 - f1
    out[9] = -omega * m2
    out[10] = 2.0 / width * x
    out[11] = omega * (2.0 * eta * bending / u - m3)


@njit(cache=True)
def tangent(z, force, width, columns, out):
    """(y', Y') of z = (y, Y), Y (12, columns) the derivatives of y by the state and the force it began with."""
    y, pull, got = np.empty(12, np.complex128), np.empty(3, np.complex128), np.empty(12, np.complex128)
    y[:], pull[:] = z[:12], force
    b = bent_at(y, width)
    slope(y, pull, width, b, got)
    out[:12] = got.real
    if not columns:
        return
    by = np.zeros((12, 15))
    for c in range(3, 15):
        y[:], pull[:] = z[:12], force
        if c < 12:
            y[c] += 1e-40j
        else:
            pull[c - 12] += 1e-40j
        slope(y, pull, width, b, got)
        by[:, c] = got.imag / 1e-40
    whole = z[12:].reshape(12, 15)
    moved = np.ascontiguousarray(by[:, :12]) @ whole
    moved[:, 12:] += by[:, 12:]
    out[12:] = moved.ravel()


@njit(cache=True)
def integrate(z, force, width, columns, length, tolerance):
    """z after `length` by the pair of Dormand and Prince (1980, doi:10.1016/0771-050X(80)90013-3), orders 5 and 4, each
    step's error of y at most `tolerance` times the larger of 1 and the component, of Y that of its columns' size;
    steps, 0 where it breaks down."""
    a = np.array([
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ])  # fmt: skip
    e = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
    k, trial = np.empty((7, z.size)), np.empty(z.size)
    z, done, step, steps = z.copy(), 0.0, 0.1 * length, 0
    while done < length:
        step = min(step, length - done)
        for stage in range(7):
            trial[:] = z
            for j in range(stage):
                trial += step * a[stage, j] * k[j]
            tangent(trial, force, width, columns, k[stage])
        worst = 0.0
        for i in range(12):
            error = 0.0
            for j in range(7):
                error += step * e[j] * k[j, i]
            worst = max(worst, abs(error) / (tolerance * max(1.0, abs(trial[i]))))
            if not np.isfinite(error):
                worst = 1e30
        if worst <= 1.0:
            done = length if step == length - done else done + step
            z[:] = trial
            steps += 1
        step *= min(4.0, max(0.2, 0.9 * max(worst, 1e-12) ** -0.2))
        if step < 1e-14:
            return z, 0
    return z, steps
