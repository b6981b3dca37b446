"""The chained ribbon's energy in multiple precision (mpmath), written from the thesis's equations alone.

An independent twin of `ribbon.problems.chained`: the frame equation R' = R [kappa]_x (eq. 2.4) is solved on many short
pieces by its Taylor series with tens of digits, the elastic energy (eq. 2.11, 2.12) by Gauss-Legendre quadrature of the
same number of digits. Derivatives are central differences with a step of 10^-10 in 40 digits: exact to about 18 digits.
"""

from __future__ import annotations

import mpmath as mp

DIGITS = 40
STEP = mp.mpf(10) ** -10


def frame_and_chord(a, b, n, m, length, digits=DIGITS):
    """End frame Q (3x3), chord p (3x1) and its integral J (3x1) of a segment, as mpmath matrices."""
    with mp.workdps(digits + 10):
        a, b, n, m, length = (mp.mpf(v) for v in (a, b, n, m, length))
        size = (abs(b) + abs(a) * length) * (1 + abs(m) + abs(n) * length)
        pieces = max(1, int(mp.ceil(length * size / 3)))
        h = length / pieces
        frame, chord, integral = mp.eye(3), mp.zeros(3, 1), mp.zeros(3, 1)
        for piece in range(pieces):
            s = h * piece
            q, p, j = _piece(a, b + a * s, n, m + n * s, h, digits)
            integral = integral + chord * h + frame * j
            chord = chord + frame * p
            frame = frame * q
        return frame, chord, integral


def _piece(a, b, n, m, h, digits):
    """Taylor series of Q' = Q [kappa]_x on [0, h], row by row: (x, y, z)' = (k3 y, k1 z - k3 x, -k1 y).

    In S / h, which makes every term small, and in whole numbers of 2^-bits: a tenth of the time that floating-point
    numbers of so many digits take.
    """
    bits = int((digits + 10) * 3.33) + 40
    one = 1 << bits

    def fixed(value):
        return int(mp.floor(mp.ldexp(value, bits)))

    k1 = (fixed(b * h), fixed(a * h**2))
    k3 = (fixed(m * b * h), fixed((n * b + m * a) * h**2), fixed(n * a * h**3))
    h, tiny = fixed(h), fixed(mp.mpf(10) ** (-digits - 5))
    q, p, j = mp.eye(3), mp.zeros(3, 1), mp.zeros(3, 1)
    for row in range(3):
        terms = [[one * int(row == column) for column in range(3)]]
        sums = list(terms[0])
        chord = sums[2] * h >> bits
        integral = chord * h >> bits + 1
        quiet = 0
        for k in range(1, 1000):
            past = terms[: -len(k3) - 1 : -1]
            x = sum(c * t[1] for c, t in zip(k3, past, strict=False)) >> bits
            y = sum(c * t[2] for c, t in zip(k1, past, strict=False))
            y = (y - sum(c * t[0] for c, t in zip(k3, past, strict=False))) >> bits
            z = -sum(c * t[1] for c, t in zip(k1, past, strict=False)) >> bits
            terms.append([x // k, y // k, z // k])
            for column in range(3):
                sums[column] += terms[-1][column]
            reach = terms[-1][2] * h >> bits
            chord += reach // (k + 1)
            integral += (reach * h >> bits) // ((k + 1) * (k + 2))
            quiet = quiet + 1 if max(map(abs, terms[-1])) <= tiny else 0
            if quiet == 3:
                break
        for column in range(3):
            q[row, column] = mp.ldexp(mp.mpf(sums[column]), -bits)
        p[row], j[row] = mp.ldexp(mp.mpf(chord), -bits), mp.ldexp(mp.mpf(integral), -bits)
    return q, p, j


def width_factor(x):
    """H(x) = artanh(x) / x (thesis, 3.4.1)."""
    return mp.mpf(1) if x == 0 else mp.atanh(x) / x


def segments(x, lengths):
    """(a, b, n, m, L) of every segment from x = b_1, m_1, a_1, n_1, ... (thesis, eq. 3.1, 3.2)."""
    b, m = x[0], x[1]
    for i, length in enumerate(lengths):
        a, n = x[2 + 2 * i], x[3 + 2 * i]
        yield a, b, n, m, length
        b, m = b + length * a, m + length * n


def energy(x, lengths, energy_name, width, poisson, curvature, gamma, up, position, frame):
    """Total energy (units D w / l) of the chained ribbon: elastic (eq. 4.1 or 4.2) and gravity (eq. 4.3).

    Polynomial integrands of degree 6 by Gauss-Legendre with 4 points in the working precision.
    """
    lengths = [mp.mpf(v) for v in lengths]
    x = [mp.mpf(v) for v in x]
    width, poisson, gamma = mp.mpf(width), mp.mpf(poisson), mp.mpf(gamma)
    k0, k1 = (mp.mpf(v) for v in curvature)
    up = mp.matrix([mp.mpf(v) for v in up])
    r = mp.matrix([mp.mpf(v) for v in position])
    frame = mp.matrix([[mp.mpf(v) for v in row] for row in frame])
    points = _gauss()
    total = mp.mpf(0)
    start = mp.mpf(0)
    for a, b, n, m, length in segments(x, lengths):
        h = width_factor(width * n / 2) if energy_name == "wunderlich" else mp.mpf(1)
        for t, weight in points:
            s = t * length
            omega, eta = a * s + b, n * s + m
            k = k0 + (k1 - k0) * (start + s)
            density = omega**2 * (1 + eta**2) ** 2 * h / 2 - k * omega * (1 + poisson * eta**2)
            total += weight * length * density
        if gamma != 0:
            q, p, j = frame_and_chord(a, b, n, m, length, mp.mp.dps)
            total += gamma * mp.fdot(up, r * length + frame * j)
            r = r + frame * p
            frame = frame * q
        start += length
    return total


def _gauss():
    """Nodes and weights of four-point Gauss-Legendre on [0, 1] in the working precision."""
    root = mp.sqrt(mp.mpf(6) / 5) * 2 / 7
    inner, outer = mp.sqrt(mp.mpf(3) / 7 - root), mp.sqrt(mp.mpf(3) / 7 + root)
    w_in, w_out = (18 + mp.sqrt(30)) / 72, (18 - mp.sqrt(30)) / 72
    return [
        ((1 - outer) / 2, w_out),
        ((1 - inner) / 2, w_in),
        ((1 + inner) / 2, w_in),
        ((1 + outer) / 2, w_out),
    ]


def derivatives(function, x):
    """Gradient (list) and Hessian (list of lists) of `function` at x by central differences in DIGITS digits."""
    with mp.workdps(DIGITS):
        x = [mp.mpf(v) for v in x]
        size = len(x)

        def at(*moves):
            y = list(x)
            for index, sign in moves:
                y[index] += sign * STEP
            return function(y)

        here = at()
        plus = [at((i, 1)) for i in range(size)]
        minus = [at((i, -1)) for i in range(size)]
        gradient = [(p - q) / (2 * STEP) for p, q in zip(plus, minus, strict=True)]
        hessian = [[mp.mpf(0)] * size for _ in range(size)]
        for i in range(size):
            hessian[i][i] = (plus[i] - 2 * here + minus[i]) / STEP**2
            for j in range(i):
                both = at((i, 1), (j, 1)) + at((i, -1), (j, -1)) - plus[i] - minus[i] - plus[j] - minus[j] + 2 * here
                hessian[i][j] = hessian[j][i] = both / (2 * STEP**2)
        return [float(v) for v in gradient], [[float(v) for v in row] for row in hessian]
