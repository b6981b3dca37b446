"""Energy densities: values, Taylor orders of their derivatives, limits and symmetries; H to near rounding."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest

from ribbon import Clamp, Gravity, RibbonInputError, Strip, energies, solve
from ribbon.element.element import bending_jet, bending_value, natural_jet, natural_value
from ribbon.element.series import PAIR_INDEX
from ribbon.energies import CODES, natural, wunderlich
from ribbon.energies.names import FREE
from tests.energy_integrals import over_s, over_surface


def exact_width_factor(x):
    """(H, H', H'') in 50 digits, by series near 0."""
    with mp.workdps(60):
        z = mp.mpf(float(x))
        if abs(z) < mp.mpf("0.01"):
            k = range(40)
            return (
                sum(z ** (2 * i) / (2 * i + 1) for i in k),
                sum(2 * i * z ** (2 * i - 1) / (2 * i + 1) for i in k if i),
                sum(2 * i * (2 * i - 1) * z ** (2 * i - 2) / (2 * i + 1) for i in k if i),
            )
        h = mp.atanh(z) / z
        d = (1 / (1 - z * z) - h) / z
        return h, d, (2 * z / (1 - z * z) ** 2 - 2 * d) / z


POINTS = np.concatenate(
    [
        np.linspace(-1, 1, 801)[1:-1],
        1 - 10.0 ** -np.arange(1, 16),
        -1 + 10.0 ** -np.arange(1, 16),
        10.0 ** -np.arange(1, 200, 3),
        [0.3, np.nextafter(0.3, 0), np.nextafter(0.3, 1), np.nextafter(1, 0), -np.nextafter(1, 0), 0.0],
    ]
)


def test_width_factor_on_the_whole_interval():
    """H, H', H'' to 1e-13, 1e-12, 1e-11 relative on (-1, 1)."""
    worst = np.zeros(3)
    for x in POINTS:
        got = wunderlich.width_factor(float(x))
        for k, exact in enumerate(exact_width_factor(x)):
            if exact == 0:
                assert got[k] == 0
            else:
                worst[k] = max(worst[k], abs(float((mp.mpf(got[k]) - exact) / exact)))
    assert worst[0] < 1e-13
    assert worst[1] < 1e-12
    assert worst[2] < 1e-11


@pytest.mark.parametrize("x", [1.0, -1.0, 1.5, -7.0])
def test_width_factor_is_infinite_where_rulings_meet(x):
    h, d, c = wunderlich.width_factor(x)
    assert h == np.inf
    assert d == np.copysign(np.inf, x)
    assert c == np.inf


SECTION = (0.05, 1e-3, 0.3)  # w / (2 l), h / l, nu


def density(name, omega, eta, x, poisson=0.3, curvature=7.0):
    out = np.empty(10)
    if name == "natural":
        natural.density(omega, eta, curvature, poisson, out)
    else:
        energies.density(CODES[name], omega, eta, x, SECTION, out)
    return out


def hessian(d):
    return np.array([[d[4], d[5], d[6]], [d[5], d[7], d[8]], [d[6], d[8], d[9]]])


@pytest.mark.parametrize("name", [*CODES, "natural"])
@pytest.mark.parametrize("at", [(3.0, 0.4, 0.2), (-12.0, -1.3, -0.7), (0.5, 0.0, 0.0), (8.0, 2.0, 0.95)])
def test_taylor_orders(name, at):
    """The remainder falls as step^2 after the gradient and as step^3 after the Hessian, bounded from both sides."""
    at = np.array(at)
    direction = np.array([0.6, -0.5, 0.04])
    base = density(name, *at)
    steps = 0.1 * 0.5 ** np.arange(5)
    first, second = [], []
    for h in steps:
        moved = density(name, *(at + h * direction))[0]
        linear = base[0] + h * base[1:4] @ direction
        first.append(abs(moved - linear))
        second.append(abs(moved - linear - 0.5 * h * h * direction @ hessian(base) @ direction))
    assert 1.9 < np.log2(first[-2] / first[-1]) < 2.1
    assert 2.8 < np.log2(second[-2] / second[-1]) < 3.3


def test_wunderlich_tends_to_sadowsky_and_is_even_in_x():
    for x in (1e-3, 1e-6):
        difference = density("wunderlich", 5.0, 0.7, x)[0] / density("sadowsky", 5.0, 0.7, 0)[0] - 1
        assert difference == pytest.approx(x * x / 3, rel=1e-2)
    plus, minus = density("wunderlich", 5.0, 0.7, 0.4), density("wunderlich", 5.0, 0.7, -0.4)
    assert plus[0] == minus[0]
    assert plus[3] == -minus[3]


def test_bending_and_natural_terms_are_the_plate_energy_of_a_developable_strip():
    """D/2 [(1 - nu) b:b + nu (tr b)^2], b = curvature - K e_z (x) e_z, less K^2 / 2, is Sadowsky's density (w -> 0).

    Curvature tensor of rank one with ruling direction q = e_x + eta e_z: b = omega (e_z - eta e_x) (x) (e_z - eta e_x).
    """
    rng = np.random.default_rng(1)
    for omega, eta, k, nu in rng.uniform([-5, -2, -5, -0.5], [5, 2, 5, 0.5], (20, 4)):
        normal = np.array([-eta, 1.0])  # components along e_x, e_z; orthogonal to the ruling (1, eta)
        b = omega * np.outer(normal, normal)
        b[1, 1] -= k
        plate = 0.5 * ((1 - nu) * np.sum(b * b) + nu * np.trace(b) ** 2) - 0.5 * k * k
        ours = density("sadowsky", omega, eta, 0)[0] + density("natural", omega, eta, 0, nu, k)[0]
        assert ours == pytest.approx(plate, rel=1e-12, abs=1e-12)


#: Energies whose density on a segment is a polynomial times a function of x, in mpmath: the factor.
EXACT = {"sadowsky": lambda x: mp.mpf(1), "wunderlich": lambda x: mp.atanh(mp.mpf(x)) / mp.mpf(x)}


@pytest.mark.parametrize("name", CODES)
def test_segment_energy_is_exact(name):
    """Four Gauss points integrate the segment exactly: against mpmath where the formula is known, else 40 points.

    Jets agree with the values.
    """
    a, b, n, m, length, half_width = -8.0, 3.0, 4.0, -0.6, 0.3, 0.05
    k_start, k_slope, nu = 5.0, -2.0, 0.35
    with mp.workdps(30):
        if name in EXACT:
            h = EXACT[name](half_width * n)
            bending = mp.quad(lambda s: h * (a * s + b) ** 2 * (1 + (n * s + m) ** 2) ** 2 / 2, [0, length])
        else:
            nodes, weights = np.polynomial.legendre.leggauss(40)
            s = 0.5 * length * (nodes + 1)
            bending = 0.5 * length * weights @ [density(name, a * t + b, n * t + m, half_width * n)[0] for t in s]
        work = mp.quad(lambda s: -(k_start + k_slope * s) * (a * s + b) * (1 + nu * (n * s + m) ** 2), [0, length])
    code, section = CODES[name], (half_width, *SECTION[1:])
    assert bending_value(code, a, b, n, m, length, section) == pytest.approx(float(bending), rel=1e-14)
    assert natural_value(a, b, n, m, length, k_start, k_slope, nu) == pytest.approx(float(work), rel=1e-14)
    jet, other = np.empty(15), np.empty(15)
    bending_jet(code, a, b, n, m, length, section, jet)
    natural_jet(a, b, n, m, length, k_start, k_slope, nu, other)
    assert jet[0] == pytest.approx(float(bending), rel=1e-14)
    assert other[0] == pytest.approx(float(work), rel=1e-14)
    q = np.array([a, b, n, m])
    for got, evaluate in ((jet, bending_jet), (other, natural_jet)):
        last = (code, section) if evaluate is bending_jet else (k_start, k_slope, nu)

        def at(x, evaluate=evaluate, last=last):
            out = np.empty(15)
            if evaluate is bending_jet:
                bending_jet(last[0], *x, length, last[1], out)
            else:
                natural_jet(*x, length, *last, out)
            return out

        scale = np.abs(got).max()
        for i in range(4):
            step = 1e-4 * np.eye(4)[i]
            # fourth-order differences of the jet itself
            slope = (8 * (at(q + step) - at(q - step)) - (at(q + 2 * step) - at(q - 2 * step))) / 12e-4
            assert abs(got[1 + i] - slope[0]) < 1e-10 * scale
            for k in range(4):
                assert abs(got[PAIR_INDEX[i, k]] - slope[1 + k]) < 1e-9 * scale


@pytest.mark.parametrize("name", CODES)
@pytest.mark.parametrize("x", [-0.8, 0.0, 0.3])
def test_the_spread_over_a_ruling_has_the_density_as_its_mean(name, x):
    nodes, weights = np.polynomial.legendre.leggauss(60)
    across = energies.ENERGIES[name].across
    mean = density(name, 3.0, 0.4, x)[0]
    if across is not None:
        many = np.ones(nodes.size)
        mean = 0.5 * weights @ across(3.0 * many, 0.4 * many, x * many, nodes, SECTION)
    assert mean == pytest.approx(density(name, 3.0, 0.4, x)[0], rel=1e-12)


@pytest.mark.parametrize("name", CODES)
def test_whether_it_knows_the_width_and_its_factor(name):
    energy = energies.ENERGIES[name]
    narrow, wide = density(name, 3.0, 0.4, 0.0)[0], density(name, 3.0, 0.4, 0.5)[0]
    assert (wide != narrow) == energy.knows_width
    factor = energy.factor(0.5)
    assert np.isnan(factor) or wide == pytest.approx(factor * density("sadowsky", 3.0, 0.4, 0.5)[0], rel=1e-15)


@pytest.mark.parametrize("name", CODES)
def test_the_exported_densities_integrate_to_the_elastic_energy(name):
    """Over s and over the surface, on a ribbon that leaves the plane, with natural curvature and oblique rulings."""
    strip = Strip(1.0, 0.2, poisson=0.4, natural_curvature=(8.0, 5.0), gamma=60.0, thickness=1e-3)
    clamp = Clamp(normal=(-(0.5**0.5), 0.5**0.5, 0.0), ruling="free")
    found = solve(strip, clamp, Gravity(up=(1, 0, 0)), energy=name, segments=8)
    assert found.ok
    assert found.max_abs_eta_prime_w_half > 0.1
    assert over_s(found) == pytest.approx(found.energy.elastic, rel=1e-12)
    assert over_surface(found) == pytest.approx(found.energy.elastic, rel=1e-10)


def test_what_an_energy_needs_is_asked_for_by_name(monkeypatch):
    needing = replace(energies.ENERGIES["sadowsky"], needs=("thickness",))
    monkeypatch.setitem(energies.ENERGIES, "sadowsky", needing)
    assert solve(Strip(1.0, 0.1, thickness=1e-3), energy="sadowsky", segments=2).ok
    with pytest.raises(RibbonInputError) as refusal:
        solve(Strip(1.0, 0.1), energy="sadowsky", segments=2)
    assert refusal.value.key == "thickness"


def test_scenes_know_the_registry_without_loading_a_solver():
    code = (
        "import sys; from compare.scene.spec import ENERGIES; from compare.scene import load; load('cantilever')\n"
        "print(*ENERGIES); print(*{m.split('.')[0] for m in sys.modules} & {'numba', 'ribbon', 'cyipopt'})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names, loaded = done.stdout.split("\n")[:2]
    assert names.split() == ["auto", *CODES, *FREE, "elastica", "curve_angle", "antman", "tape", "tape_plain"]
    assert not loaded
