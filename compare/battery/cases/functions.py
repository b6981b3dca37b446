"""The functions of energies and series against mpmath, over their whole range."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from compare.battery.case import Case, Check, Rung
from ribbonbench.errors import Missing

#: Relative error of a function and its derivatives: some 50 roundings of 2e-16.
_ROUNDING = 1e-14


def _mpmath(digits: int) -> Any:
    """mpmath with so many digits."""
    try:
        import mpmath
    except ModuleNotFoundError:
        raise Missing("mpmath", "pip install 'ribbonbench[test]'") from None
    mpmath.mp.dps = digits
    return mpmath.mp


def _apart(found: Any, exact: Any, what: str, bound: float = _ROUNDING) -> Iterator[Check]:
    """Value and two derivatives, relative to their size."""
    for order, (value, true) in enumerate(zip(found, exact, strict=True)):
        size = abs(float(true)) or 1.0
        name = f"{what}{chr(39) * order}, relative error"
        yield Check(name, abs(float(value) - float(true)) / size, bound, said=f"{float(value):.17g}")


def _width_factor(x: Rung) -> Iterator[Check]:
    from ribbon.energies.wunderlich import width_factor

    mp = _mpmath(60)
    z = mp.mpf(float(x))

    def exact(y: Any) -> Any:
        return mp.atanh(y) / y if y else mp.mpf(1)

    if abs(z) < mp.mpf("1e-3"):  # series, for the differences of mpmath lose digits there
        true = [mp.nsum(lambda k, o=o: mp.ff(2 * k, o) * z ** (2 * k - o) / (2 * k + 1) if 2 * k >= o else 0, [0, 30])
                for o in range(3)]  # fmt: skip
    else:
        h, u = exact(z), 1 - z * z
        slope = (1 / u - h) / z
        true = [h, slope, (2 * z / u**2 - 2 * slope) / z]
    yield from _apart(width_factor(float(x)), true, "H")


def _gain(y: Rung) -> Iterator[Check]:
    from ribbon.energies.section.relaxed import gain

    mp = _mpmath(120)
    at = mp.mpf(float(y))

    def g(z: Any) -> Any:
        return (mp.cosh(z) - mp.cos(z)) / (z * (mp.sinh(z) + mp.sin(z)))

    def exact(v: Any) -> Any:
        return (mp.mpf(1) / 2 - g(mp.root(v, 4))) / v

    true = [exact(at), *(mp.diff(exact, at, order, h=at * mp.mpf(10) ** -30, relative=False) for order in (1, 2))]
    yield from _apart(gain(float(y)), true, "phi", 1e-12)


def _rounded(y: Rung) -> Iterator[Check]:
    from ribbon.energies.finite import ROUNDED, rounded_factor

    mp = _mpmath(80)

    def below(v: Any) -> Any:
        z = mp.sqrt(v)
        return mp.atanh(z) / z - 1

    at, edge = mp.mpf(float(y)), mp.mpf(ROUNDED)
    step = mp.mpf(10) ** -25
    if at <= edge:
        true = [below(at), *(mp.diff(below, at, order, h=at * step) for order in (1, 2))]
    else:
        f = [below(edge), *(mp.diff(below, edge, order, h=step) for order in (1, 2))]
        d = at - edge
        true = [f[0] + f[1] * d + f[2] * d * d / 2, f[1] + f[2] * d, f[2]]
    yield from _apart(rounded_factor(float(y)), true, "H - 1", 1e-12)


def _exact_segment(mp: Any, q: Any) -> tuple[Any, Any, Any]:
    """Frame (3, 3), chord (3,), integral of the chord (3,) of a segment, by one Taylor series with many digits.

    q: a, b, n, m and the length."""
    a, b, n, m, length = q
    la = abs(b) * mp.sqrt(1 + m * m), mp.hypot(a, n * b + m * a), abs(n * a)
    turn = 2 * length * (la[0] + length * (la[1] + length * la[2]))
    mp.dps = 40 + int(turn)
    lam = ((b, mp.mpf(0), m * b), (a, mp.mpf(0), n * b + m * a), (mp.mpf(0), mp.mpf(0), n * a))
    terms = [[[mp.mpf(i == j) for j in range(3)] for i in range(3)]]
    total = [row[:] for row in terms[0]]
    chord = [terms[0][i][2] * length for i in range(3)]
    area = [terms[0][i][2] * length**2 / 2 for i in range(3)]
    power, small = mp.mpf(1), mp.mpf(10) ** (-30)
    k = 0
    while True:
        k += 1
        new = [[mp.mpf(0)] * 3 for _ in range(3)]
        for j, (x, y, z) in enumerate(lam):
            if k - 1 - j < 0:
                continue
            old = terms[k - 1 - j]
            for r in range(3):
                o0, o1, o2 = old[r]
                new[r][0] += o1 * z - o2 * y
                new[r][1] += o2 * x - o0 * z
                new[r][2] += o0 * y - o1 * x
        new = [[v / k for v in row] for row in new]
        terms.append(new)
        if k > 3:
            terms[k - 4] = []
        power *= length
        for r in range(3):
            for c in range(3):
                total[r][c] += new[r][c] * power
            chord[r] += new[r][2] * power * length / (k + 1)
            area[r] += new[r][2] * power * length**2 / ((k + 1) * (k + 2))
        if k > turn and max(abs(v) for row in new for v in row) * power < small:
            return total, chord, area


def _values(a: float, b: float, n: float, m: float, length: float) -> list[float]:
    """Nine entries of the frame, three of the chord, three of its integral."""
    from ribbon.element import series

    q, p, j = np.empty((3, 3)), np.empty(3), np.empty(3)
    series.segment_values(a, b, n, m, length, series.EXPONENT_LIMIT, q, p, j)
    return [*q.ravel(), *p, *j]


def _worst(found: Any, exact: Any) -> float:
    return float(np.abs(np.asarray(found, dtype=float) - np.array([float(v) for v in exact])).max())


#: Shapes of the segment of the series' cases, by which (K, 1) is multiplied: a, b over K; n, m.
_SHAPES = ((0.0, 1.0, 0.0, 0.3), (-2.0, 1.0, 0.5, 0.2), (0.9, 0.1, -1.5, 0.8))


def _series(turn: Rung) -> Iterator[Check]:
    mp = _mpmath(50)
    curl = float(turn)
    for a, b, n, m in _SHAPES:
        q = a * curl, b * curl, n, m, 1.0
        frame, chord, area = _exact_segment(mp, [mp.mpf(v) for v in q])
        exact = [*(v for row in frame for v in row), *chord, *area]
        bound = 1e-13 + 2e-15 * abs(curl)
        yield Check("frame, chord, integral (l)", _worst(_values(*q), exact), bound, said=f"a, b, n, m = {q[:4]}")


def _derivatives(turn: Rung) -> Iterator[Check]:
    from ribbon.element import series

    curl = float(turn)
    for shape in _SHAPES:
        q = np.array([shape[0] * curl, shape[1] * curl, *shape[2:]])
        jets = np.empty((series.QUANTITIES, series.COMPONENTS))
        series.segment_jets(q[0], q[1], q[2], q[3], 1.0, series.EXPONENT_LIMIT, jets)
        mp = _mpmath(50)

        def column(at: Any, mp: Any = mp) -> np.ndarray:
            frame, chord, area = _exact_segment(mp, [*at, mp.mpf(1)])
            return np.array([*(v for row in frame for v in row), *chord, *area], dtype=object)

        centre = list(map(mp.mpf, map(float, q)))
        step = mp.mpf(10) ** -12  # beside 40 digits at least: the differences keep 15
        shifted = [
            [column([v + sign * step * (k == i) for i, v in enumerate(centre)]) for sign in (1, -1)] for k in range(4)
        ]
        middle = column(centre)
        for k, (high, low) in enumerate(shifted):
            first = (high - low) / (2 * step)
            second = (high - 2 * middle + low) / step**2
            pair = 5 + int(np.flatnonzero((k == series.PAIR_FIRST) & (k == series.PAIR_SECOND))[0])
            name = "abnm"[k]
            size = max(1.0, max(abs(float(v)) for v in first))
            bound = 1e-13 + 4e-15 * abs(curl)
            yield Check(f"d/d{name}, relative", _worst(jets[:, 1 + k], first) / size, bound)
            size = max(1.0, max(abs(float(v)) for v in second))
            yield Check(f"d2/d{name}2, relative", _worst(jets[:, pair], second) / size, 10.0 * bound)


def _long_helix(turn: Rung) -> Iterator[Check]:
    """Constant ruling, linear curvature: the axis (1, 0, m) stands still, and the chord is Fresnel's integrals."""
    mp = _mpmath(60)
    length, m = 10.0, 0.25
    a, b = 0.5 * float(turn) / length, 0.5 * float(turn)
    s, slant = mp.mpf(length), mp.sqrt(1 + mp.mpf(m) ** 2)

    def angle(v: Any) -> Any:
        return slant * (mp.mpf(b) * v + mp.mpf(a) * v * v / 2)

    # int exp(i angle) over [0, s]: complete the square
    root, shift = mp.sqrt(slant * a / mp.pi), mp.mpf(b) / mp.mpf(a)
    phase = slant * mp.mpf(a) * shift * shift / 2

    def fresnel(v: Any) -> Any:
        return mp.mpc(mp.fresnelc(v), mp.fresnels(v)) / root

    wave = mp.expj(-phase) * (fresnel(root * (s + shift)) - fresnel(root * shift))
    c, d, axis = mp.cos(angle(s)), mp.sin(angle(s)), [1 / slant, mp.mpf(0), mp.mpf(m) / slant]
    # e_z turned by theta about the axis: axis (axis . e_z) (1 - cos) + e_z cos + axis x e_z sin
    along = axis[2]
    cross = [axis[1], -axis[0], mp.mpf(0)]
    frame_z = [axis[i] * along * (1 - c) + (i == 2) * c + cross[i] * d for i in range(3)]
    chord = [axis[i] * along * (s - wave.real) + (i == 2) * wave.real + cross[i] * wave.imag for i in range(3)]
    found = _values(a, b, 0.0, m, length)
    bound = 1e-13 + 2e-15 * float(angle(s))
    text = f"turned by {float(angle(s)):.5g}"
    yield Check("tangent", _worst([found[2], found[5], found[8]], frame_z), bound, said=text)
    yield Check("chord (over the segment's length)", _worst(found[9:12], chord) / length, bound, said=text)


CASES: tuple[Case, ...] = (
    Case(
        "functions/width_factor",
        "H(x) = artanh(x)/x and its derivatives cancel as x -> 0 and grow without bound as x -> 1",
        "relative error of some roundings everywhere, against mpmath with 60 digits",
        "x", _width_factor,
        (0.0, 1e-300, 1e-12, 1e-6, 1e-3, 0.1, 0.2999999, 0.3, 0.5, 0.9, 0.999999, 1.0 - 1e-12),
        (1e-30, 1e-9, 0.05, 0.29, 0.31, 0.7, 0.99, 1.0 - 1e-9, 1.0 - 1e-15),
    ),
    Case(
        "functions/gain",
        "(1/2 - g(z))/z^4 loses all digits as z -> 0, and cosh overflows at z = 710",
        "relative error below 1e-12 of the function and two derivatives, against mpmath with 120 digits",
        "y = z^4", _gain, (1e-8, 1e-2, 1.0, 1e2, 1e4, 1e8, 1e16), (1e-12, 1e-4, 0.1, 10.0, 1e3, 1e6, 1e12, 1e20),
    ),
    Case(
        "functions/rounded_factor",
        "H - 1 by y = x^2 near 0, and its continuation beyond y = 0.97",
        "relative error below 1e-12, the continuation its quadratic with continuous second derivative",
        "y = x^2", _rounded, (1e-10, 1e-3, 0.0899, 0.0901, 0.5, 0.97, 1.0, 10.0), (1e-6, 0.01, 0.9, 0.96, 100.0, 1e6),
    ),
    Case(
        "functions/series",
        "series of a segment that turns many times: terms reach exp(2 K) before they fall",
        "frame, chord and its integral to 1e-13 and some roundings a radian, against one Taylor series in many digits",
        "K l", _series, (0.1, 10.0, 100.0), (-100.0, 300.0, 1000.0, -1000.0),
    ),
    Case(
        "functions/series_derivatives",
        "first and second derivatives of the same, which grow with K and K^2",
        "relative error of some roundings a radian, against differences in multiple precision",
        "K l", _derivatives, (10.0,), (0.1, -100.0, 300.0, 1000.0),
    ),
    Case(
        "functions/long_helix",
        "a segment of length 10 with a curvature up to 1000: thousands of radians on one element",
        "tangent and chord to some roundings a radian, against Fresnel's integrals",
        "K", _long_helix, (1.0, 100.0, 1000.0), (3000.0,),
    ),
)  # fmt: skip
