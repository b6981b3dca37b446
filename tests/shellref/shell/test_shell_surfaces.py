"""Curved reference surfaces: geometry against finite differences, rigid motions, closed-form energies."""

from dataclasses import replace

import numpy as np
import pytest

from shellref import ShellOptions, ShellProblem, ShellStatus
from shellref.shell.body import Body, Control, Supports
from shellref.shell.director import retract
from shellref.shell.grid import Grid
from shellref.shell.midsurface import Annulus, Cylinder

RNG = np.random.default_rng(21)
SURFACES = [Cylinder(), Cylinder(curvature_along=3.0), Cylinder(curvature_across=-2.0), Annulus()]
NAMES = ["plane", "along", "across", "annulus"]


def rotation() -> np.ndarray:
    q = np.linalg.qr(RNG.standard_normal((3, 3)))[0]
    return q * np.sign(np.linalg.det(q))


@pytest.mark.parametrize("surface", SURFACES, ids=NAMES)
def test_normals_and_lame_factors_against_differences(surface):
    """phi_,v x ... : t_y = t_z x t_x, and |phi_,S|, |phi_,v| by central differences; the coordinates are orthogonal."""
    s, v, t = RNG.uniform(0.1, 0.9, 20), RNG.uniform(0.5, 0.9, 20), 1e-6
    points, normals = surface.place(s, v)
    along = (surface.place(s + t, v)[0] - surface.place(s - t, v)[0]) / (2 * t)
    across = (surface.place(s, v + t)[0] - surface.place(s, v - t)[0]) / (2 * t)
    sizes = np.stack([np.linalg.norm(along, axis=1), np.linalg.norm(across, axis=1)], axis=1)
    np.testing.assert_allclose(surface.lame(s, v), sizes, rtol=1e-8)
    assert np.max(np.abs(np.sum(along * across, axis=1))) < 1e-8
    cross = np.cross(along, across) / np.prod(sizes, axis=1)[:, None]
    np.testing.assert_allclose(normals, cross, atol=1e-8)
    assert points.shape == normals.shape == (20, 3)


@pytest.mark.parametrize(("name", "axis"), [("curvature_along", 0), ("curvature_across", 1)])
def test_curvature_of_a_cylinder_has_the_sign_of_the_bending_strain(name, axis):
    """kap_ii = a_i . d_,i at the surface is its curvature (d_,i = k a_i)."""
    surface, t = Cylinder(**{name: 1.7}), 1e-6
    x = RNG.uniform(-0.5, 0.5, (2, 10))
    step = np.zeros((2, 1))
    step[axis] = t
    (p, d), (q, e) = surface.place(*(x + step)), surface.place(*(x - step))
    np.testing.assert_allclose(np.sum((p - q) * (d - e), axis=1) / (2 * t) ** 2, 1.7, rtol=1e-8)


def test_a_cylinder_is_curved_one_way_only():
    with pytest.raises(ValueError, match="not both"):
        Cylinder(1.0, 1.0)


dolfinx = pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.path.solve import solve  # noqa: E402
from shellref.shell.naghdi import NaghdiModel  # noqa: E402

NU = 0.3


def model(surface, elements=(4, 3), thickness=0.03, s=(0.0, 1.0), v=(0.4, 1.0), c=0.3, **change) -> NaghdiModel:
    grid = Grid(np.linspace(*s, elements[0] + 1), np.linspace(*v, elements[1] + 1))
    body = Body(surface, grid, thickness, NU, lambda grid, nodes: Supports.none(len(nodes)), **change)
    return NaghdiModel(body, c)


@pytest.mark.parametrize("surface", SURFACES, ids=NAMES)
def test_rigid_motions_of_any_reference_cost_nothing(surface):
    shell, q = model(surface), rotation()
    moved = np.hstack([shell.reference[:, :3] @ q.T + [3.0, -1.0, 2.0], shell.reference[:, 3:] @ q.T])
    assert shell.energies(moved).elastic < 1e-22 * 12 / 0.03**2
    assert np.max(np.abs(shell.internal(moved, shell.stress(moved)))) < 1e-10
    spacing = min(np.diff(shell.grid.s_nodes).min(), np.diff(shell.grid.v_nodes).min())
    # of products of difference quotients: coefficients of a quadratic's slope add up to 4 / spacing, 2 factors, 3 axes
    rounding = 4 * 2 * 3 * np.finfo(float).eps * np.abs(moved).max() / spacing
    assert rounding < 1e-12
    for strains in shell.strains(moved):
        assert np.max(np.abs(strains)) < rounding


@pytest.mark.parametrize("surface", SURFACES, ids=NAMES)
def test_energies_are_objective_and_forces_turn_with_the_shell(surface):
    shell, q = model(surface), rotation()
    state = retract(shell.reference, 0.05 * RNG.standard_normal(shell.reference.shape))
    turned = np.hstack([state[:, :3] @ q.T - 1.0, state[:, 3:] @ q.T])
    one, other = shell.energies(state), shell.energies(turned)
    assert one.bending > 1e-3
    for name in ("bending", "membrane", "shear", "stabilisation"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-11)
    f, g = shell.residual(state), shell.residual(turned)
    np.testing.assert_allclose(g, np.hstack([f[:, :3] @ q.T, f[:, 3:] @ q.T]), atol=1e-11 * np.max(np.abs(f)))
    # with no reference left to lean on, nodal forces and couples are in balance
    np.testing.assert_allclose(f[:, :3].sum(axis=0), 0.0, atol=1e-10 * np.max(np.abs(f)))
    moment = np.cross(state[:, :3], f[:, :3]) + np.cross(state[:, 3:], f[:, 3:])
    np.testing.assert_allclose(moment.sum(axis=0), 0.0, atol=1e-9 * np.max(np.abs(f)))


@pytest.mark.parametrize(("name", "axis"), [("curvature_along", 0), ("curvature_across", 1)])
def test_a_cylinder_unrolled_flat_has_the_bending_energy_of_its_curvature(name, axis):
    """1/2 D k^2 per area; the membrane strain of the interpolated reference falls with the fourth power of the mesh."""
    k, errors, membranes = 2.0, [], []
    for n in (3, 6, 12):
        shell = model(Cylinder(**{name: k}), (n, n), v=(-0.5, 0.5), c=0.0)
        flat = np.hstack(Cylinder().place(*shell.nodes.T))
        energies = shell.energies(flat)
        errors.append(abs(energies.bending - 0.5 * k**2))
        membranes.append(energies.membrane)
        full = shell.strains(flat)[0]
        np.testing.assert_allclose(full[..., axis], -k, rtol=0.2)
        assert np.max(np.abs(full[..., [1 - axis, 2]])) < 1e-12
    assert errors[-1] < 1e-3
    assert np.log2(errors[-2] / errors[-1]) > 1.9
    assert np.log2(membranes[-2] / membranes[-1]) > 3.5


def test_a_stretched_annulus_has_the_energy_of_its_area():
    """phi = c phi_0: eps = (c^2 - 1) / 2 in both directions; the weight of the ring is its area."""
    c, inner, outer, angle = 1.1, 0.6, 1.0, 1.5
    shell = model(Annulus(), (8, 2), s=(0.0, angle), v=(inner, outer), weight=(0.0, 0.0, -2.0))
    area = 0.5 * angle * (outer**2 - inner**2)
    assert shell.areas.sum() == pytest.approx(area, rel=1e-12)
    state = shell.reference * ([c] * 3 + [1.0] * 3)
    e, h = 0.5 * (c**2 - 1), 0.03
    energies = shell.energies(state)
    assert energies.membrane == pytest.approx(area * 12 / h**2 * (1 + NU) * e**2, rel=1e-4)
    assert abs(energies.bending) + abs(energies.shear) < 1e-20
    np.testing.assert_allclose(shell.external(state, Control())[:, :3].sum(axis=0), [0, 0, -2.0 * area], rtol=1e-10)


@pytest.mark.parametrize("curvature", [12.0, -12.0])
def test_a_weightless_tape_spring_stays_as_it_is(curvature):
    """The section's curvature is the unstressed one: no energy, no reaction, stable."""
    tape = ShellProblem(width=0.1, thickness=1e-3, poisson=NU, transverse_curvature=curvature, elements=(12, 4))
    result = solve(replace(tape, clamp_position=(1, 2, 3)))
    assert (result.status, result.stable) == (ShellStatus.CONVERGED, True)
    assert result.energy["elastic"] < 1e-15
    np.testing.assert_allclose(result.clamp_force, 0.0, atol=1e-6)
    np.testing.assert_allclose(result.section(1.0)["position"], [1, 2, 4], atol=1e-9)
    edge = result.surface.points[0, -1] - [1, 2, 3]
    turn = curvature * 0.05
    np.testing.assert_allclose(edge, [np.sin(turn) / curvature, (np.cos(turn) - 1) / curvature, 0.0], atol=1e-12)


def test_a_curved_section_stiffens_a_cantilever():
    """Small weight: w = Gamma l^4 / (8 D) over 1 + stiffening; of a shallow arc: + (E h w) k^2 w^4 / 720."""
    w, h, k = 0.1, 1e-3, 4.0
    tips = {}
    for curvature in (0.0, k, -k):
        problem = ShellProblem(
            width=w,
            thickness=h,
            poisson=0.0,
            transverse_curvature=curvature,
            gamma=0.01,
            up=(0.0, 1.0, 0.0),
            elements=(20, 4),
        )
        result = solve(problem, ShellOptions(tolerance=1e-10))
        tips[curvature] = -result.section(1.0)["position"][1]
    assert tips[k] == pytest.approx(tips[-k], rel=1e-2)
    stiffening = 12 / h**2 * k**2 * w**4 / 720
    assert stiffening > 0.2
    assert tips[0.0] / tips[k] == pytest.approx(1 + stiffening, rel=0.02)
