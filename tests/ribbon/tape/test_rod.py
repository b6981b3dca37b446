"""Energy, gradient and Hessian of a tape against complex steps, rigid motions, holds, orders of its elements."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon.tape.band import factor, solve
from ribbon.tape.held import Hold
from ribbon.tape.law import uniform, uniform_section
from ribbon.tape.rod import Rod
from ribbon.tape.section import Section
from ribbon.tape.surface import parts

FREE = Hold(undeformed=False)


def rod(terms=3, n=4, start=FREE, end=FREE, warped=False, **more):
    lengths = np.linspace(1.0, 1.5, n)
    return Rod(Section(0.06, 1.5e-4, 0.3, 20.0, terms, warped), lengths / lengths.sum(), start, end, **more)


def state(of, seed=1, size=1e-2):
    x = of.straight()
    generator = np.random.default_rng(seed)
    nodes = generator.normal(size=(len(of.s), of.fields)) * size
    nodes[:, 4:] *= 300.0
    x[of.column[:, None] + np.arange(of.fields)] += nodes
    return x


def dense(band):
    n, rows = band.shape
    found = np.zeros((n, n))
    for d in range(min(rows, n)):
        i = np.arange(n - d)
        found[i + d, i] = found[i, i + d] = band[: n - d, d]
    return found


def energy(of, x):
    """The energy as `ribbon.tape.kernel` defines it, straight from the strains; complex x allowed (NumPy twin)."""
    t, w = of.gauss
    section = of.section
    along, weight = section.points
    p, slope, z = section.tables(along)
    nodes = x[of.column[:, None] + np.arange(of.fields)]
    total = 0.0
    for e, h in enumerate(of.lengths):
        ends = np.concatenate([nodes[e].reshape(-1, 2), nodes[e + 1].reshape(-1, 2)], axis=1)
        for g, u in enumerate(t):
            a = np.array([1 - 3 * u**2 + 2 * u**3, h * (u - 2 * u**2 + u**3), 3 * u**2 - 2 * u**3, h * (u**3 - u**2)])
            b = np.array([6 * u**2 - 6 * u, h * (1 - 4 * u + 3 * u**2), 6 * u - 6 * u**2, h * (3 * u**2 - 2 * u)]) / h
            c = np.array([12 * u - 6, h * (6 * u - 4), 6 - 12 * u, h * (6 * u - 2)]) / h**2
            (x1, y1), (x2, y2) = ends[:2] @ b, ends[:2] @ c
            kappa, first, second = ends[2:] @ a, ends[2:] @ b, ends[2:] @ c
            k = (x1 * y2 - y1 * x2) / (x1 * x1 + y1 * y1)
            e11 = (x1 * x1 + y1 * y1 - 1.0) / 2.0 + k * (z @ kappa) + (z @ first) ** 2 / 2.0
            for warp_i, warp in enumerate(section.warping(along)):
                e11[warp_i] += first @ warp @ first + kappa @ warp @ second
            b11, b22, b12 = z @ second - k, p @ (kappa - of.rest[e, g]), slope @ first
            nu = section.poisson
            u2 = section.stretching * e11**2 + b11**2 + b22**2 + 2 * nu * b11 * b22 + 2 * (1 - nu) * b12**2
            total = total + 0.5 * h * w[g] * (weight @ u2)
    return total


@pytest.mark.parametrize(("terms", "warped"), [(1, False), (3, False), (1, True), (3, True)])
def test_gradient_and_hessian_by_complex_step(terms, warped):
    of = rod(terms, dent=0.2, warped=warped)
    x = state(of)
    value, gradient, band = of.energy(x)
    assert value == pytest.approx(float(energy(of, x)), rel=1e-12)
    steps = [energy(of, x + 1e-30j * np.eye(of.size)[i]).imag / 1e-30 for i in range(of.size)]
    np.testing.assert_allclose(gradient, steps, rtol=1e-10, atol=1e-11 * np.abs(gradient).max())
    hessian = dense(band)
    direction = np.random.default_rng(2).normal(size=of.size)

    def slopes(step):
        return (of.energy(x + step * direction)[1] - of.energy(x - step * direction)[1]) / (2.0 * step)

    wanted = hessian @ direction
    misses = [np.abs(slopes(step) - wanted).max() / np.abs(wanted).max() for step in (4e-4, 2e-4)]
    assert misses[1] < 1e-4
    assert misses[0] / misses[1] == pytest.approx(4.0, rel=0.05)


def test_the_equations_are_the_slope_of_the_lagrangian():
    start = Hold((0.1, 0.05), None, 0.2, undeformed=False)
    of = rod(3, 3, start, Hold((0.9, 0.1), 0.3, None, undeformed=False))
    x = state(of, 3)
    x[of.multipliers[0]], x[of.multipliers[1]] = [1e6, -2e6, 3e5], [5e5]
    targets = np.concatenate([of.start.targets, of.end.targets])
    gradient, band = of.equations(x, targets)
    hessian = dense(band)
    direction = np.random.default_rng(4).normal(size=of.size)
    misses = []
    for step in (2e-3, 1e-3):
        found = (of.equations(x + step * direction, targets)[0] - of.equations(x - step * direction, targets)[0]) / (
            2.0 * step
        )
        misses.append(np.abs(found - hessian @ direction).max() / np.abs(found).max())
    assert misses[0] / misses[1] == pytest.approx(4.0, rel=0.1)
    values = of.start.rows(x[:10], of.middle)[0]
    np.testing.assert_allclose(gradient[of.multipliers[0]], of.start.targets - values)


def test_rigid_motions_cost_nothing():
    of = rod()
    x = state(of)
    nodes = of.nodes(x)
    angle, shift = 1.1, np.array([0.4, -0.2])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = nodes.copy()
    moved[:, [0, 2]] = nodes[:, [0, 2]] @ turn.T + shift
    moved[:, [1, 3]] = nodes[:, [1, 3]] @ turn.T
    y = x.copy()
    y[of.column[:, None] + np.arange(of.fields)] = moved
    assert of.energy(y)[0] == pytest.approx(of.energy(x)[0], rel=1e-11)
    # and at rest exactly three motions of the free tape have no stiffness
    _, _, band = of.energy(of.straight())
    full = dense(band)
    scale = 1.0 / np.sqrt(np.diag(full))
    values = np.linalg.eigvalsh(scale[:, None] * full * scale)
    assert np.abs(values[:3]).max() < 1e-13
    assert values[3] > 1e-9


def test_plain_is_the_enriched_tape_with_one_term():
    plain, rich = rod(1), rod(3)
    x = state(plain)
    nodes = np.zeros((len(rich.s), rich.fields))
    nodes[:, :6] = plain.nodes(x)
    y = np.zeros(rich.size)
    y[rich.column[:, None] + np.arange(rich.fields)] = nodes
    one, other = plain.energy(x), rich.energy(y)
    assert other[0] == pytest.approx(one[0], rel=1e-12)
    found = other[1][rich.column[:, None] + np.arange(6)].ravel()
    np.testing.assert_allclose(found, one[1], rtol=1e-9, atol=1e-9 * np.abs(found).max())


def test_energy_per_length_of_plain_is_that_of_the_integrated_section():
    # Martin et al. 2017 with the section integrated: I2 = 2 a^3/45, I3 = 4 a^4/945, I4 = 2 a^5/945, per unit s over D w
    of = rod(1, 2)
    section, a = of.section, of.section.half
    from ribbon.tape.kernel import density

    beta, first, second, k, e = 0.35, 2.0, -30.0, 1.3, 2e-3
    q = np.array([e, k, beta / a, first / a, second / a])
    value = density(section.stretching, section.bending, section.rest, *of.tables, q, np.empty(5), np.empty((5, 5)))
    i2, i3, i4, nu, beta0 = 2 * a**3 / 45, 4 * a**4 / 945, 2 * a**5 / 945, 0.3, 0.6
    membrane = 2 * a * e**2 + i2 * (beta**2 * k**2 + e * first**2) + i3 * beta * k * first**2 + i4 * first**4 / 4
    bend = (
        2 * a * k**2 + i2 * second**2 + 2 * (beta - beta0) ** 2 / a - 4 * nu * k * (beta - beta0)
        + (4 * a / 3) * (1 - nu) * first**2
    )  # fmt: skip
    assert value * 2.0 * a == pytest.approx(0.5 * (section.stretching * membrane + bend), rel=1e-12)


@pytest.mark.parametrize("warped", [False, True])
def test_parts_make_the_energy(warped):
    of = rod(warped=warped)
    x = state(of)
    assert sum(parts(of, x)) == pytest.approx(of.energy(x)[0], rel=1e-12)


def test_band_factors_count_negative_pivots_and_solve():
    generator = np.random.default_rng(5)
    n, rows = 40, 6
    band = generator.normal(size=(n, rows))
    band[:, 0] += np.where(generator.uniform(size=n) < 0.3, -9.0, 9.0)
    for j in range(n):
        band[j, n - j :] = 0.0
    full, right = dense(band), generator.normal(size=(n, 2))
    factors, found = band.copy(), right.copy()
    assert factor(factors) == np.sum(np.linalg.eigvalsh(full) < 0.0)
    solve(factors, found)
    np.testing.assert_allclose(full @ found, right, atol=1e-9)


@pytest.mark.parametrize("terms", [1, 3])
def test_order_of_the_elements_on_an_arc_of_uniform_bending(terms):
    # the energy of the interpolated exact state: the line is an arc, its cubic of order 4, its energy at least
    k, misses = 2.0, []
    section = Section(0.06, 1.5e-4, 0.3, 20.0, terms)
    kappa, wanted = uniform_section(section, k), uniform(section, k)[0]
    for n in (10, 20, 40, 80):
        of = Rod(section, np.full(n, 1.0 / n), FREE, FREE)
        nodes = np.zeros((n + 1, of.fields))
        nodes[:, 0], nodes[:, 1] = np.sin(k * of.s) / k, np.cos(k * of.s)
        nodes[:, 2], nodes[:, 3] = (1.0 - np.cos(k * of.s)) / k, np.sin(k * of.s)
        nodes[:, 4::2] = kappa
        misses.append(abs(of.energy(nodes.ravel())[0] - wanted))
    orders = np.log2(np.array(misses[:-1]) / misses[1:])
    assert 3.5 < orders[-1] < 8.5, orders
    assert misses[-1] < 1e-6 * wanted
