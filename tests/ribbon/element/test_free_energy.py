"""The energy of a segment with free twist is its integral, where the curvature passes zero too, with derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon.element import free_energy
from ribbon.energies.free import FREE_CODES, FREE_ENERGIES
from ribbon.energies.names import FREE_CODE
from tests.ribbon.energies.densities import adaptive, density

#: Places of second derivatives by (a, b, n, m) in a jet (15,).
PAIRS = {pair: 5 + n for n, pair in enumerate((i, j) for i in range(4) for j in range(i, 4))}
#: w, h, nu of strips whose passage through zero is long, short, and very short.
STRIPS = [(0.05, 5e-3, 0.3), (0.1, 1e-3, 0.3), (0.15, 1.5e-5, 0.4)]
NATURAL = (1.5, -2.0)


def jet(name, strip, q, length, natural=(0.0, 0.0)):
    w, h, nu = strip
    out = np.empty(15)
    free_energy.free_jet(FREE_CODE + FREE_CODES[name], q, length, *natural, (0.5 * w, h, nu, 0.0), out)
    return out


def exact(name, strip, q, length, natural=(0.0, 0.0)):
    """The integral by QUADPACK of the density written for the tests."""

    def along(s):
        k, t = q[0] * s + q[1], q[2] * s + q[3]
        return density(name, strip, k, t, q[0], q[2], natural[0] + natural[1] * s)

    return adaptive(along, q, length)


def segments(count, seed):
    """Parameters (a, b, n, m) and length of segments on which the curvature passes zero, comes near it, or does not."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        length = 10.0 ** rng.uniform(-2.5, -0.7)
        first, last = rng.normal(size=2) * 6.0
        if number % 3 == 1:
            last = -np.sign(first) * 10.0 ** rng.uniform(-6.0, 0.0)
        if number % 3 == 2:
            last = np.sign(first) * 10.0 ** rng.uniform(-6.0, 0.5)
        twist = rng.normal(size=2) * 1.5
        yield np.array([(last - first) / length, first, (twist[1] - twist[0]) / length, twist[0]]), length


@pytest.mark.parametrize("strip", STRIPS)
@pytest.mark.parametrize("name", FREE_CODES)
def test_the_energy_of_a_segment_is_its_integral(name, strip):
    for q, length in segments(15, 5):
        if name == "sadowsky_kt" and q[1] * (q[1] + q[0] * length) < 0.0:
            continue
        for natural in ((0.0, 0.0), NATURAL):
            value = exact(name, strip, q, length, natural)
            size = abs(value) + 0.5 * max(natural) ** 2 * length
            assert abs(jet(name, strip, q, length, natural)[0] - value) <= (5e-9 if name == "finite" else 3e-10) * size


@pytest.mark.parametrize("strip", STRIPS)
@pytest.mark.parametrize("name", ["sano", "extensible", "finite"])
def test_derivatives_are_of_the_integral(name, strip):
    """Gradient and Hessian against fourth-order differences of value and gradient, which panels follow (`finite`:
    across the jump of the third derivative where H is continued)."""
    rounding = 1e-6 if name == "finite" else 1e-7
    for q, length in segments(9, 11):
        here = jet(name, strip, q, length)
        zeta = np.sqrt((1.0 - strip[2] ** 2) / 60.0) * strip[0] ** 2 / strip[1]
        step = 2e-3 * min(1.0 / zeta, 1.0) * np.array([1.0 / length, 1.0, 1.0 / length, 1.0])
        for i in range(4):
            move = step[i] * np.eye(4)[i]
            at = [jet(name, strip, q + n * move, length) for n in (-2, -1, 1, 2)]
            got = (8.0 * (at[2] - at[1]) - (at[3] - at[0])) / (12.0 * step[i])
            exactly = [here[1 + i], *(here[PAIRS[min(i, j), max(i, j)]] for j in range(4))]
            sizes = [np.abs(here[:5]).max() / step[i], *(np.abs(here[1:5]) / step[i])]
            for value, right, size in zip(got[:5], exactly, sizes, strict=True):
                assert abs(value - right) <= 1e-6 * abs(right) + rounding * size


def test_a_twisted_strip_cannot_pass_zero_curvature_with_sadowskys_energy():
    strip = STRIPS[0]
    through, along = np.array([-40.0, 2.0, 0.0, 1.0]), np.array([-40.0, 2.0, -20.0, 1.0])
    assert jet("sadowsky_kt", strip, through, 0.1)[0] == np.inf
    # where the twist vanishes with the curvature the ruling is constant, and a plane strip may pass
    assert jet("sadowsky_kt", strip, along, 0.1)[0] == pytest.approx(exact("sadowsky_kt", strip, along, 0.1), rel=1e-12)
    flat = np.array([-40.0, 2.0, 0.0, 0.0])
    assert jet("sadowsky_kt", strip, flat, 0.1)[0] == pytest.approx(0.5 * (8.0 / 120.0 * 2.0), rel=1e-12)


def test_a_segment_without_passage_takes_the_energys_own_points():
    """The rule of before: four points where the curvature hardly changes."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    for name in ("extensible", "sano", "sadowsky_kt", "kirchhoff"):
        q, length, strip = np.array([4.0, 6.0, 3.0, 0.7]), 0.05, STRIPS[1]
        s = 0.5 * length * (nodes + 1.0)
        plain = sum(
            0.5 * length * w * density(name, strip, q[0] * v + q[1], q[2] * v + q[3], q[0], q[2], 0.0)
            for v, w in zip(s, weights, strict=True)
        )
        assert jet(name, strip, q, length)[0] == pytest.approx(plain, rel=1e-12)


def test_a_panel_of_neighbouring_numbers_is_not_halved():
    """The curvature comes to zero at the segment's end to rounding: there a panel is one number long, whose middle is
    its end. Halved all the same it filled its list of panels, and the memory behind it."""
    a, b, m, length = (
        float.fromhex(h)
        for h in ("-0x1.3fe1d6b4054a5p+5", "0x1.129ea099b9d07p+2", "0x1.4963b2438b974p+0", "0x1.b78da22a13985p-4")
    )
    found = jet("sadowsky_kt", STRIPS[0], np.array([a, b, 0.0, m]), length)
    last = a * length + b
    assert 0.0 < last < 1e-13
    assert np.isfinite(found).all()
    assert found[0] > 0.1 * m**4 / (2.0 * abs(a) * b)


@pytest.mark.parametrize("name", FREE_CODES)
def test_the_value_alone_is_that_of_the_jet(name):
    """Where no derivatives are asked for, on the same panels; with a natural twist and a curvature in the plane too."""
    code, rest = FREE_CODE + FREE_CODES[name], (0.4, -0.7, 0.3, 0.2)
    known = FREE_ENERGIES[name].pretwist is not None
    for strip in STRIPS:
        section = (0.5 * strip[0], *strip[1:], 0.0)
        for q, length in segments(12, 7):
            if name == "sadowsky_kt" and q[1] * (q[1] + q[0] * length) < 0.0:
                continue
            for parameters, components in ((q, 15), (np.append(q, [1.0, -2.0]), 28)):
                whole, alone = np.empty(components), np.empty(1)
                own = rest if known else (0.0, 0.0, *rest[2:])
                for natural in (own, free_energy.NOTHING):
                    free_energy.free_jet(code, parameters, length, *NATURAL, section, whole, natural)
                    free_energy.free_jet(code, parameters, length, *NATURAL, section, alone, natural)
                    assert alone[0] == pytest.approx(whole[0], rel=1e-13, abs=1e-13 * length)
