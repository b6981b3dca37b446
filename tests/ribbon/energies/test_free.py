"""Energies of free twist: Taylor orders, symmetries, limits."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from ribbon import energies
from ribbon.energies.free import FREE_CODES, FREE_ENERGIES, free_density, free_value
from ribbon.energies.section import relaxed
from ribbon.energies.section.rod import torsion_constant

#: Place of the pair (i, j) of (k, t, dk, dt) in the fifteen numbers.
PAIRS = {pair: 5 + n for n, pair in enumerate((i, j) for i in range(4) for j in range(i, 4))}
SECTION = (0.015, 3e-4, 0.4, 0.0)  # w/h = 100
WIDE, THICK = (0.05, 1e-5, 0.3, 0.0), (0.002, 1e-3, 0.4, 0.0)


def density(name, state, natural=0.0, slope=0.0, section=SECTION):
    out = np.full(15, np.nan)
    free_density(FREE_CODES[name], *map(float, state), float(natural), float(slope), section, out)
    return out


@pytest.mark.parametrize("section", [SECTION, WIDE, THICK, (*SECTION[:3], 1.0)])
@pytest.mark.parametrize("name", FREE_CODES)
def test_the_value_alone_is_that_beside_its_derivatives(name, section):
    """A search compares values with those of the states it came from, which have derivatives."""
    for state, natural, slope in (*states(40, 5), (np.array([8.0, 5.0, 300.0, 2e4]), 0.0, 0.0)):
        out = np.full(15, np.nan)
        alone = free_value(FREE_CODES[name], *map(float, state), float(natural), float(slope), section, out)
        assert alone == pytest.approx(density(name, state, natural, slope, section)[0], rel=1e-13, abs=1e-13)


def hessian(out):
    found = np.empty((4, 4))
    for (i, j), place in PAIRS.items():
        found[i, j] = found[j, i] = out[place]
    return found


def states(count, seed):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield rng.normal(size=4) * [8.0, 4.0, 40.0, 40.0], rng.normal() * 6.0, rng.normal() * 10.0


@pytest.mark.parametrize("section", [SECTION, WIDE, THICK, (*SECTION[:3], 1.0)])
@pytest.mark.parametrize("name", FREE_CODES)
def test_derivatives_at_random_states(name, section):
    """Gradient and Hessian against fourth-order differences of value and gradient, k near 0 included."""
    for number, (state, natural, slope) in enumerate(states(12, 3)):
        if number < 4 and name != "sadowsky_kt":
            state[0] *= (0.0, 1e-9, 1e-4, 1e-2)[number]
        z2 = np.sqrt(3.0 * (1 - section[2] ** 2)) * (2 * section[0]) ** 2 / section[1]  # z^2 / |k|
        step = 2e-3 * np.array(
            [min(abs(state[0]) + 1.0 / z2, 10.0) if name != "sadowsky_kt" else abs(state[0]), 1, 1, 1]
        )
        if name == "sano":
            step[0] = min(step[0], 2e-3 / z2)
        if name == "finite":  # eta turns with k over this length
            softened = state[0] ** 2 + 15.0 * (section[1] / section[0] ** 2 / 4.0) ** 2
            step[0] = min(step[0], 2e-3 * softened / (abs(state[0]) + abs(state[1])))
        here = density(name, state, natural, slope, section)
        exact = hessian(here)
        for i in range(4):
            move = step[i] * np.eye(4)[i]
            at = [density(name, state + n * move, natural, slope, section) for n in (-2, -1, 1, 2)]
            got = (8.0 * (at[2] - at[1]) - (at[3] - at[0])) / (12.0 * step[i])
            size = max(abs(at[n][0]) for n in range(4))
            assert abs(got[0] - here[1 + i]) <= 1e-8 * abs(here[1 + i]) + 1e-8 * size / step[i] * 1e-3
            rounding = 1e-11 * np.abs(here[1:5]) / step[i]
            assert np.all(np.abs(got[1:5] - exact[i]) <= 2e-8 * np.abs(exact[i]).max() + rounding)


@pytest.mark.parametrize("name", FREE_CODES)
@pytest.mark.parametrize("at", [(3.0, 0.7, 4.0, -3.0), (-12.0, 3.3, 20.0, 30.0), (0.9, 0.05, 1.0, 1.0)])
def test_taylor_orders(name, at):
    """The remainder falls as step^2 after the gradient and as step^3 after the Hessian, bounded from both sides."""
    at, path = np.array(at), np.array([0.6, -0.5, 2.0, 1.5])
    here = density(name, at, 5.0, 2.0)
    if name == "kirchhoff":  # a polynomial of degree two
        moved = density(name, at + path, 5.0, 2.0)[0]
        assert moved == pytest.approx(here[0] + here[1:5] @ path + 0.5 * path @ hessian(here) @ path, rel=1e-14)
        return
    first, second = [], []
    for h in 0.05 * 0.5 ** np.arange(5):
        rest = density(name, at + h * path, 5.0, 2.0)[0] - here[0] - h * here[1:5] @ path
        first.append(abs(rest))
        second.append(abs(rest - 0.5 * h * h * path @ hessian(here) @ path))
    assert 1.9 < np.log2(first[-2] / first[-1]) < 2.1
    assert 2.7 < np.log2(second[-2] / second[-1]) < 3.3


@pytest.mark.parametrize("section", [SECTION, WIDE, THICK])
@pytest.mark.parametrize("name", FREE_CODES)
def test_mirror_and_reversal(name, section):
    """A mirrored strip has the twist -t; one read from its other end the derivatives -dk, -dt and -dK/ds."""
    for (k, t, dk, dt), natural, slope in states(5, 7):
        value = density(name, (k, t, dk, dt), natural, slope, section)[0]
        assert density(name, (k, -t, dk, -dt), natural, slope, section)[0] == pytest.approx(value, rel=1e-13)
        assert density(name, (k, t, -dk, -dt), natural, -slope, section)[0] == pytest.approx(value, rel=1e-13)
        turned = density(name, (-k, t, -dk, dt), -natural, -slope, section)[0]  # the other face up
        assert turned == pytest.approx(value, rel=1e-13)


def test_finite_without_change_along_the_strip_is_extensible():
    for (k, t, _, _), natural, _ in states(5, 11):
        finite = density("finite", (k, t, 0.0, 0.0), natural)
        assert finite[0] == pytest.approx(density("extensible", (k, t, 0.0, 0.0), natural)[0], rel=1e-15)


def added_by_finite(state, natural, section):
    finite, plain = (density(name, state, natural, 0.0, section)[0] for name in ("finite", "extensible"))
    return finite - plain


def test_thin_strips_have_wunderlichs_energy():
    """`finite` with h -> 0 at w fixed, natural curvature and gradients included: what it is above `extensible` (whose
    limit is Sadowsky's) is Wunderlich's above Sadowsky's, up to where its H is continued; for h ~ w the rod's."""
    k, t, natural = 7.0, 3.0, 4.0
    half_width, eta = 0.015, 3.0 / 7.0
    for x in (0.1, -0.6, 0.95):
        rate = x / half_width
        state = (k, t, 5.0, k * rate + eta * 5.0)
        ruled, plain = np.empty(10), np.empty(10)
        energies.density(energies.CODES["wunderlich"], k, eta, x, SECTION[:3], ruled)
        energies.density(energies.CODES["sadowsky"], k, eta, x, SECTION[:3], plain)
        gone = []
        for h in (1e-6, 1e-7):
            thin = (half_width, h, 0.4, 0.0)
            added = (
                density("finite", state, natural, 0.0, thin)[0] - density("extensible", state, natural, 0.0, thin)[0]
            )
            gone.append(added / (ruled[0] - plain[0]) - 1.0)
        assert abs(gone[1]) < 1e-6
        assert np.log(abs(gone[0] / gone[1])) / np.log(10.0) == pytest.approx(2.0, rel=0.05)
    thick = (5e-4, 1e-3, 0.4, 0.0)
    state = (2.0, 1.0, 5.0, 9.0)
    assert added_by_finite(state, natural, thick) == pytest.approx((2.0 * thick[0]) ** 2 / 24.0 * 81.0, rel=1e-4)


@pytest.mark.parametrize("name", ["extensible", "sano"])
def test_wide_strips_have_sadowskys_energy(name):
    """h -> 0 at w fixed, natural curvature included; the ribbon's energy in (omega, eta) is the same."""
    state, natural = (7.0, 3.0, 0.0, 0.0), 4.0
    limit = density("sadowsky_kt", state, natural)[0]
    gone = [density(name, state, natural, 0.0, (0.015, h, 0.4, 0.0))[0] / limit - 1.0 for h in (1e-6, 1e-8)]
    assert abs(gone[1]) < (2e-3 if name == "extensible" else 1e-9)
    rate = 0.5 if name == "extensible" else 2.0  # 1 / z ~ h^(1/2);  1 / zeta^2 ~ h^2
    assert np.log(gone[0] / gone[1]) / np.log(100.0) == pytest.approx(rate, rel=0.02)
    out, ruled = np.empty(10), np.empty(10)
    energies.density(energies.CODES["sadowsky"], 7.0, 3.0 / 7.0, 0.0, SECTION[:3], out)
    energies.natural.density(7.0, 3.0 / 7.0, natural, 0.4, ruled)
    assert out[0] + ruled[0] == pytest.approx(limit, rel=1e-14)


@pytest.mark.parametrize("name", ["extensible", "sano"])
def test_narrow_strips_are_rods(name):
    """v -> 0: (1 - nu^2) / 2 (k - K)^2 + (1 - nu) t^2 but for the torsion that shear loses; the rest falls as w^4."""
    nu, state, natural = 0.4, (7.0, 3.0, 0.0, 0.0), 4.0
    gone = []
    for w in (1e-2, 5e-3):
        h = 1e-3
        loss = relaxed.torsion_loss(w, h) if name == "extensible" else 0.0
        rod = 0.5 * (1 - nu**2) * 9.0 - 8.0 + (1 - nu) * (1 - loss) * 9.0
        gone.append(density(name, state, natural, 0.0, (0.5 * w, h, nu, 0.0))[0] - rod)
    assert 0.0 < gone[1] < 3e-3
    assert gone[0] / gone[1] == pytest.approx(16.0, rel=0.02)


def test_torsion_of_a_rectangle():
    """Against its series (thesis, 4.4), and the square's known constant 0.1406 a^4."""
    for ratio in (1.0, 2.0, 10.0, 100.0):
        series = sum(mp.tanh(n * mp.pi * ratio / 2) / n**5 for n in range(1, 4001, 2))
        exact = 1 - 192 / (mp.pi**5 * ratio) * series
        assert torsion_constant(ratio, 1.0) == pytest.approx(float(exact), rel=1e-13)
    assert torsion_constant(1.0, 1.0) / 3.0 == pytest.approx(0.1406, abs=5e-5)


def test_where_sadowskys_energy_has_no_value():
    assert density("sadowsky_kt", (0.0, 1.0, 0.0, 0.0), 3.0)[0] == np.inf
    assert density("sadowsky_kt", (0.0, 0.0, 0.0, 0.0), 3.0)[0] == 0.0


def test_registry():
    assert FREE_ENERGIES["kirchhoff"].in_plane
    assert [name for name, energy in FREE_ENERGIES.items() if energy.holds_twist] == ["finite"]
    assert [name for name, energy in FREE_ENERGIES.items() if not energy.needs] == ["sadowsky_kt"]


def test_a_matched_rod_bends_like_the_ribbon():
    """Thesis, 4.4: equal stiffness in normal bending, so that both coincide in the plane."""
    for k in (-3.0, 0.0, 9.0):
        flat = (k, 0.0, 1.0, 2.0)
        assert density("kirchhoff", flat, 5.0)[0] == pytest.approx(density("sadowsky_kt", flat, 5.0)[0], rel=1e-14)
        plate = density("kirchhoff", flat, 5.0, section=(*SECTION[:3], 1.0))[0]
        assert plate + 12.5 == pytest.approx((1 - SECTION[2] ** 2) * 0.5 * (k - 5.0) ** 2, rel=1e-13)


@pytest.mark.parametrize("state", [(7.0, 3.0, 5.0, 40.0), (-0.3, 1.1, -6.0, 9.0), (0.02, -0.4, 30.0, 3.0)])
def test_finites_own_part_has_the_derivatives_of_its_formula(state):
    """What `finite` adds to `extensible`, (10.12) and (10.13), in 40 digits: all fourteen derivatives."""
    half_width, thickness, nu, _ = section = (0.03, 2e-3, 0.4, 0.0)
    with mp.workdps(40):
        w = 2 * mp.mpf(half_width)
        soft = 60 * mp.mpf(thickness) ** 2 / ((1 - mp.mpf(nu) ** 2) * w**4)

        def added(k, t, dk, dt):
            s = k * k + soft
            eta = k * t / s
            x = w / 2 * (k * dt + t * dk - 2 * eta * k * dk) / s
            return s / 2 * (1 + eta**2) ** 2 * (mp.atanh(x) / x - 1) + w**2 / 24 * soft / s * dt**2

        at = [mp.mpf(v) for v in state]
        eta = at[0] * at[1] / (at[0] ** 2 + soft)
        slope = (at[0] * at[3] + at[1] * at[2] - 2 * eta * at[0] * at[2]) / (at[0] ** 2 + soft)
        assert 0 < abs(w / 2 * slope) < 0.9  # where H is not continued
        right = [added(*at), *(mp.diff(added, at, order) for order in np.eye(4, dtype=int).tolist())]
        for i, j in PAIRS:
            right.append(mp.diff(added, at, (np.eye(4, dtype=int)[i] + np.eye(4, dtype=int)[j]).tolist()))
    whole, plain = (density(name, state, section=section) for name in ("finite", "extensible"))
    for n, value in enumerate(right):
        assert float(whole[n] - plain[n]) == pytest.approx(float(value), rel=1e-10, abs=1e-13 * abs(whole[n])), n
