"""Rotations of several turns: no singular angle, no problem of size."""

import numpy as np
import pytest

from shellref import ShellOptions, ShellProblem, ShellStatus
from shellref.shell.body import Body, Control, Stage, Supports, line_force
from shellref.shell.director import HELD
from shellref.shell.grid import Grid
from shellref.shell.midsurface import Cylinder, natural_curve

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.path.arc import Point  # noqa: E402
from shellref.path.newton import Equilibrium  # noqa: E402
from shellref.path.solve import solve  # noqa: E402
from shellref.path.walk import Walk, Walker  # noqa: E402
from shellref.shell.naghdi import NaghdiModel  # noqa: E402


@pytest.mark.parametrize("arc", ["auto", "always"])
def test_an_end_couple_closes_the_circle(arc):
    """M = 2 pi D / l per width, nu = 0: a full turn; the end comes back to the clamp (load steps, and arc length).

    Two elements across: with one, bending moments of this size bring out the hourglass modes of the reduced rule.
    """

    def clamped(grid, nodes):
        return Supports.none(len(nodes)).hold(nodes[:, 0] < 1e-9, "xyz", HELD)

    width = 0.1
    grid = Grid(np.linspace(0, 1, 25), np.linspace(0, width, 3))
    couples = line_force(0, 1.0, (-2 * np.pi, 0.0, 0.0))
    body = Body(Cylinder(), grid, 1e-3, 0.0, clamped, normaliser=width, couples=couples)
    options = ShellOptions(arc_length=arc, stability=False)
    model = NaghdiModel(body, options.stabilisation)
    walker = Walker(Equilibrium(model, options), (Stage("couple", Control(), Control(load=1.0)),), options)
    walk = Walk(Point(0.0, model.reference.copy(), model.stress(model.reference)))
    walker.start(walk)
    walker.run(walk)
    assert walker.verdict(walk)[0] is ShellStatus.CONVERGED
    state = walk.point.state
    s = model.nodes[:, 0]
    z, y = natural_curve(s, (-2 * np.pi, -2 * np.pi))
    np.testing.assert_allclose(state[:, 2], z, atol=2e-4)
    np.testing.assert_allclose(state[:, 1], y, atol=2e-4)
    np.testing.assert_allclose(state[s > 1 - 1e-9][:, :3] - model.reference[s < 1e-9][:, :3], 0.0, atol=3e-4)
    energies = model.energies(state)
    assert energies.elastic == pytest.approx(0.5 * (2 * np.pi) ** 2, rel=3e-4)
    assert energies.membrane + energies.shear < 1e-3 * energies.bending


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_strip_rolls_up_by_four_turns_from_flat(sign):
    """K = 25 in steps from the flat strip: the director turns by 25 radians; nothing is left of it in the energy."""
    k = 25.0 * sign
    problem = ShellProblem(
        width=0.03, thickness=1e-3, poisson=0.5, natural_curvature=(k, k), elements=(48, 1), grading=(1.0, 1.0)
    )
    result = solve(problem, ShellOptions(natural_path="stepped"))
    assert (result.status, result.stable) == (ShellStatus.CONVERGED, True)
    z, y = natural_curve(result.surface.s_nodes, (k, k))
    np.testing.assert_allclose(result.surface.points[:, 1], np.stack([0 * z, y, z], axis=1), atol=2e-3)
    frames = result.surface.frames(np.linspace(0, 1, 401))
    turn = np.unwrap(np.arctan2(-frames[:, 1, 2], frames[:, 2, 2]))
    assert turn[-1] == pytest.approx(k, rel=5e-3)
    assert result.energy["elastic"] < 1e-3 * 0.5 * k**2


def test_a_heavy_coil_hangs_from_its_clamp():
    """K = 40, nu = 1/2: six turns opened by their weight, in balance, below the unloaded coil and its energy."""
    problem = ShellProblem(
        width=0.03,
        thickness=3e-4,
        poisson=0.5,
        natural_curvature=(40.0, 40.0),
        gamma=500.0,
        up=(0.0, 1.0, 0.0),
        elements=(40, 2),
        grading=(0.5, 1.0),
    )
    result = solve(problem)
    assert result.status is ShellStatus.CONVERGED
    assert result.stable
    np.testing.assert_allclose(result.clamp_force, [0.0, 500.0, 0.0], atol=1e-4)
    _, coil = natural_curve(np.linspace(0, 1, 2001), (40.0, 40.0))
    assert result.energy["total"] < 500.0 * np.mean(coil) - 5.0
    assert result.section(1.0)["position"][1] < 2 * np.min(coil)
    # the clamp carries the weight's moment: the lever is the centre of mass, by Simpson's rule along and across
    weights = [np.zeros(len(x)) for x in (result.surface.s_nodes, result.surface.v_nodes)]
    for weight, x in zip(weights, (result.surface.s_nodes, result.surface.v_nodes), strict=True):
        for offset, share in ((0, 1 / 6), (1, 4 / 6), (2, 1 / 6)):
            weight[offset : offset + len(x) - 2 : 2] += share * np.diff(x[::2])
    centre = np.einsum("a,b,abk->k", *weights, result.surface.points) / problem.width
    np.testing.assert_allclose(result.clamp_moment, np.cross(centre, [0.0, 500.0, 0.0]), atol=1e-4)
