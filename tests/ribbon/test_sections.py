"""Surfaces of strips whose sections have a shape of their own: geometry to its order, limits, a solved strip."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from ribbon import Clamp, Gravity, Strip, solve
from ribbon.energies import FREE_ENERGIES
from ribbon.energies.section.profile import Local
from ribbon.sections import local_state, normals, offsets, placed

WIDTHS = np.array([0.2, 0.1, 0.05, 0.025])
SLOPES = 1.5, -3.0, 0.7


def curvatures(s):
    """k, t, K of a strip whose three are linear."""
    return 3.0 + SLOPES[0] * s, 2.0 + SLOPES[1] * s, 1.0 + SLOPES[2] * s


@pytest.fixture(scope="module")
def centreline():
    """r (m, 3) and frames (m, 3, 3) at s (m,) by an integrator of ordinary differential equations."""

    def derivative(s, y):
        k, t, _ = curvatures(s)
        frame = y[3:].reshape(3, 3)
        turn = np.array([[0.0, -t, 0.0], [t, 0.0, -k], [0.0, k, 0.0]])
        return np.concatenate([frame[:, 2], (frame @ turn).ravel()])

    start = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    found = solve_ivp(derivative, (0.0, 1.0), start, rtol=1e-12, atol=1e-13, dense_output=True).sol
    return lambda s: (found(s)[:3].T, found(s)[3:].T.reshape(-1, 3, 3))


def difference(function, h):
    return (8.0 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12.0 * h)


def orders(errors):
    return np.log2(errors[:-1] / errors[1:])


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("energy", ["sadowsky_kt", "finite"])
def test_width_and_right_angles_are_kept_to_the_fourth_order(centreline, energy, side):
    """Curvatures that vary along the strip, h in proportion to w^2 (z the same); normals to the third order."""
    section = FREE_ENERGIES[energy].section
    s = np.array([0.2, 0.45])
    across, angle, turned = [], [], []
    for w in WIDTHS:
        numbers = (0.5 * w, 0.05 * w * w, 0.3, 0.0)

        def place(s, v, numbers=numbers):
            r, frame = centreline(s)
            k, t, natural = curvatures(s)
            local = Local(k, t, *(np.full(s.shape, x) for x in SLOPES[:2]), natural, np.full(s.shape, SLOPES[2]))
            found = offsets(section, local, v, numbers)
            return [np.einsum("kij,kj->ki", frame, part) for part in found], r

        def point(s, v, place=place):
            (offset, _), r = place(s, v)
            return r + offset

        v = side * 0.45 * w
        by_s = difference(lambda h, v=v, point=point: point(s + h, v), 1e-4)
        by_v = difference(lambda h, v=v, point=point: point(s, v + h), 1e-3 * w)
        normal = np.cross(by_s, by_v)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        across.append(np.abs((by_v**2).sum(axis=1) - 1.0).max())
        angle.append(np.abs((by_s * by_v).sum(axis=1)).max())
        turned.append(np.abs(place(s, v)[0][1] - normal).max())
    assert orders(np.array(across))[1:] == pytest.approx(4.0, abs=0.3)
    assert orders(np.array(angle))[1:] == pytest.approx(4.0, abs=0.3)
    assert np.all(orders(np.array(turned))[1:] > 2.7)
    assert across[-1] < 1e-7
    assert angle[-1] < 1e-7


def cylinder(k, t, material):
    """Particles (n, 3) of a strip on a cylinder: straight rulings of slope t / k through a helix, in closed form."""
    s, v = material.T
    foot = s - v * t / k
    spin = np.array([k, 0.0, t])  # in the frame; the same in space
    rate = np.linalg.norm(spin)
    axis = spin / rate
    along = np.array([0.0, 0.0, 1.0])
    frames = Rotation.from_rotvec(foot[:, None] * spin).as_matrix()
    straight, swung = (along @ axis) * axis, along - (along @ axis) * axis
    side = np.cross(axis, swung)
    r = (
        foot[:, None] * straight
        + (np.sin(rate * foot)[:, None] * swung + (1 - np.cos(rate * foot))[:, None] * side) / rate
    )
    return r + v[:, None] * (frames[:, :, 0] + (t / k) * frames[:, :, 2])


def modelled(k, t, material, numbers, energy):
    s = material[:, 0]
    spin = np.array([k, 0.0, t])
    frames = Rotation.from_rotvec(s[:, None] * spin).as_matrix()
    straight = cylinder(k, t, np.column_stack([s, 0.0 * s]))
    zero = np.zeros(1)
    local = Local(zero + k, zero + t, zero, zero, zero, zero)
    section = FREE_ENERGIES[energy].section
    found = np.array([offsets(section, local, float(v), numbers)[0][0] for v in material[:, 1]])
    return straight + np.einsum("kij,kj->ki", frames, found)


def test_an_oblique_cylinder_is_met_to_the_fourth_order_in_the_width():
    """Without thickness; the section's layers are what is left with one, and fall with h."""
    k, t = 3.0, 2.0
    errors = []
    for w in WIDTHS:
        material = np.array([[0.3, 0.5 * w], [0.6, -0.5 * w], [0.9, 0.3 * w], [0.5, 0.0]])
        numbers = (0.5 * w, 1e-3 * w, 0.3, 0.0)
        off = modelled(k, t, material, numbers, "sadowsky_kt") - cylinder(k, t, material)
        errors.append(np.linalg.norm(off, axis=1).max())
    assert orders(np.array(errors))[1:] == pytest.approx(4.0, abs=0.2)
    w = 0.1
    material = np.array([[0.3, 0.5 * w], [0.6, -0.5 * w]])
    limit = modelled(k, t, material, (0.5 * w, 1e-6, 0.3, 0.0), "sadowsky_kt")
    layers = np.array([
        np.abs(modelled(k, t, material, (0.5 * w, h, 0.3, 0.0), "finite") - limit).max() for h in (4e-5, 2e-5, 1e-5)
    ])  # fmt: skip
    assert orders(layers) == pytest.approx(1.0, abs=0.1)


@pytest.fixture(scope="module")
def curl():
    """Thesis, 4.3, with the energy finite at w/h = 100."""
    r = 2**-0.5
    strip = Strip(1.0, 0.03, 0.4, 10.0, 100.0, thickness=3e-4)
    clamp = Clamp((0, 0, 0), tangent=(0, 0, 1), normal=(-r, r, 0), ruling="straight")
    found = solve(strip, clamp, Gravity((1, 0, 0)), energy="finite", segments=16)
    assert found.ok
    return found


def test_a_solved_strip_keeps_its_middle_line_and_its_lengths(curl):
    surface = curl.surface(800, 8)
    grid, s = surface.grid, np.linspace(0.0, 1.0, 801)
    assert np.abs(grid[:, 4] - curl.position(s)).max() == 0.0  # v = 0 is the centreline
    step = np.diff(grid, axis=0)
    along = np.linalg.norm(step, axis=2)
    chord = 1.0 - curl.omega(0.5 * (s[1:] + s[:-1])) ** 2 / (24.0 * 800.0**2)
    assert np.abs(along[:, 4] * 800.0 - chord).max() < 2e-6
    assert np.abs(along.sum(axis=0) - 1.0).max() < 6e-5  # a straight section would stretch its edges by 7.5e-4
    straight = curl.position(s) + 0.015 * curl.frame(s)[:, :, 0]
    assert np.linalg.norm(np.diff(straight, axis=0), axis=1).sum() - 1.0 > 7e-4
    across = np.linalg.norm(np.diff(curl.surface(40, 200).grid, axis=1), axis=2).sum(axis=1)
    assert across == pytest.approx(0.03, rel=1e-6)


def test_normals_stand_on_the_surface(curl):
    surface = curl.surface(640, 16)
    grid = surface.grid
    by_s, by_v = (grid[2:, 1:-1] - grid[:-2, 1:-1]), (grid[1:-1, 2:] - grid[1:-1, :-2])
    normal = np.cross(by_s, by_v)
    normal /= np.linalg.norm(normal, axis=2)[..., None]
    rows = np.arange(1, 640)
    inside = (rows % 40 > 2) & (rows % 40 < 38)  # at a joint tau' jumps, and with it what changes along the strip
    normals = curl.normals(surface.material).reshape(grid.shape)
    assert np.abs(normals[1:-1, 1:-1] - normal)[inside].max() < 6e-4
    flat = curl.frame(np.linspace(0.0, 1.0, 641))[1:-1, None, :, 1]
    assert np.abs(flat - normal)[inside].max() > 0.05  # what a straight section would be off by
    assert np.linalg.norm(normals, axis=2) == pytest.approx(1.0, abs=1e-12)


def test_the_local_state_is_that_of_the_elements(curl):
    s = np.linspace(0.01, 0.99, 30)
    local = local_state(curl, s)
    assert np.abs(local.k - curl.omega(s)).max() < 1e-12
    assert np.abs(local.t - curl.tau(s)).max() < 1e-12
    h = 1e-6
    inside = np.abs(s[:, None] * 16 - np.arange(17)).min(axis=1) > 1e-3
    assert (curl.omega(s + h) - curl.omega(s - h))[inside] / (2 * h) == pytest.approx(local.dk[inside], abs=1e-4)
    assert (curl.tau(s + h) - curl.tau(s - h))[inside] / (2 * h) == pytest.approx(local.dt[inside], abs=1e-4)
    assert np.all(local.natural == 10.0)
    assert np.all(local.slope == 0.0)


@pytest.mark.parametrize("energy", sorted(name for name, law in FREE_ENERGIES.items() if law.section is not None))
def test_sections_are_even_across(energy):
    """Shapes and densities of one side serve both."""
    section = FREE_ENERGIES[energy].section
    rng = np.random.default_rng(4)
    local = Local(*(rng.normal(size=9) * size for size in (8.0, 3.0, 20.0, 20.0, 5.0, 2.0)))
    y, numbers = np.array([0.003, 0.02, 0.049]), (0.05, 1e-3, 0.3, 0.0)
    here, there = (section.shape(local, side * y, numbers) for side in (1.0, -1.0))
    for name, side in (("f", 1.0), ("across", -1.0), ("along", 1.0)):
        one, other = getattr(here, name), side * getattr(there, name)
        assert np.abs(one - other).max() <= 1e-12 * np.abs(one).max()
    one, other = (section.shares(local, side * y, numbers).total for side in (1.0, -1.0))
    assert np.abs(one - other).max() <= 1e-12 * np.abs(one).max()


def test_particles_stand_where_they_stand_one_by_one():
    """In any order, on both sides and on the middle line, some places along on one line only."""
    strip = Strip(1.0, 0.1, poisson=0.3, natural_curvature=4.0, gamma=20.0, thickness=1e-3)
    found = solve(strip, Clamp(), Gravity(up=(0.6, 0.0, 0.8)), energy="finite", segments=10)
    s, v = np.meshgrid([0.0, 0.31, 0.5, 1.0], [-0.05, -0.01, 0.0, 0.01, 0.05], indexing="ij")
    material = np.random.default_rng(1).permutation(np.column_stack([s.ravel(), v.ravel()]))
    material = np.vstack([material, [[0.77, 0.01], [0.4, 0.03]]])
    section, numbers = FREE_ENERGIES["finite"].section, found.problem.fields.section
    for k, several in enumerate((placed(found, material), normals(found, material))):
        for row, told in zip(material, several, strict=True):
            own = offsets(section, local_state(found, row[:1]), float(row[1]), numbers)[k][0]
            assert np.abs(told - own).max() < 1e-14
