"""Critical loads: linearisation (SLEPc) against bisection on the inertia, and both against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from shellref import ShellInputError, ShellOptions, ShellProblem, ShellStatus

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.fenics import dolfinx_api as api  # noqa: E402
from shellref.path.arc import Point  # noqa: E402
from shellref.path.buckling import buckling, carried, find  # noqa: E402
from shellref.path.newton import Equilibrium  # noqa: E402
from shellref.path.walk import Walk, Walker  # noqa: E402
from shellref.shell.body import Body, Control, Stage, Supports, line_force  # noqa: E402
from shellref.shell.director import HELD, tangent_bases  # noqa: E402
from shellref.shell.grid import Grid  # noqa: E402
from shellref.shell.midsurface import Cylinder  # noqa: E402
from shellref.shell.naghdi import NaghdiModel  # noqa: E402

NU = 0.35
STRIP = ShellProblem(  # thesis 7.1: on edge under its weight
    width=0.05, thickness=1e-3, poisson=NU, gamma=18.0, up=(1.0, 0.0, 0.0), elements=(20, 4), grading=(0.3, 0.3)
)


@pytest.fixture(scope="module")
def edge():
    return buckling(STRIP)


def test_linearisation_and_inertia_agree_on_lateral_buckling(edge):
    """Two independent criteria of the same matrix, 1e-6; the estimate's error falls with the square of the distance."""
    assert edge.status is ShellStatus.CONVERGED
    low, high = edge.bracket
    assert high - low <= 1e-6
    assert edge.difference < 2e-6
    errors = {round(1 - e.load / edge.inertia, 4): abs(e.critical / edge.inertia - 1) for e in edge.estimates}
    assert len(errors) > 6
    far, near = errors[0.01], errors[0.001]
    assert 20 < far / near < 500
    assert edge.critical == pytest.approx(18.0 * edge.inertia)


def test_lateral_buckling_of_a_narrow_strip_is_michell_with_the_torsion_of_a_thick_section(edge):
    """18.17 (1 - nu) sqrt(1 + nu) sqrt(1 - 0.63 h / w) for w / l -> 0; w / l = 0.05 adds about 14.5 w / l at most."""
    critical = [edge.critical]
    for width in (0.02, 0.01):
        critical.append(buckling(replace(STRIP, width=width, thickness=width / 50, elements=(20, 4))).critical)
    limit = 18.17 * (1 - NU) * np.sqrt(1 + NU) * np.sqrt(1 - 0.63 / 50)
    excess = [c / limit - 1 for c in critical]
    assert excess[0] > excess[1] > excess[2] > 0
    assert excess[2] < 0.02
    assert 0 < critical[0] - limit < 14.5 * 0.05


def test_mode_is_antisymmetric_sideways_motion(edge):
    """The strip on edge falls sideways (along its normal, y) and twists; the mode has no part in its own plane."""
    mode = edge.mode
    assert np.max(np.abs(mode)) == pytest.approx(1.0, rel=1e-9)
    assert np.max(np.abs(mode[..., 1])) > 0.3
    assert np.max(np.abs(mode[..., [0, 2]])) < 1e-6


def test_a_strip_that_stays_stable_says_so():
    found = buckling(replace(STRIP, gamma=8.0))
    assert found.critical is None
    assert "stable up to its full value" in found.message
    with pytest.raises(ShellInputError, match="gamma"):
        buckling(replace(STRIP, gamma=0.0, up=None))


def test_euler_column_against_its_closed_form():
    """Clamped-free column of width 1/4 pushed at its end, nu = 0. With stretch t, angles psi of the tangent and theta
    of the director, the second variation is t^2 theta'^2 / 2 + S t^2 (theta - psi)^2 / 2 - P t psi^2 / 2, minimal over
    psi: P / (1 - P / (S t)) = t pi^2 / 4, with t = 1 - P / A, A = 12 / h^2 and S = 5 / h^2 (units D w / l^2)."""
    h = 0.02

    def supports(grid: Grid, nodes: np.ndarray) -> Supports:
        return Supports.none(len(nodes)).hold(nodes[:, 0] < 1e-9, "xyz", HELD)

    body = Body(
        surface=Cylinder(),
        grid=Grid(np.linspace(0, 1, 11), np.linspace(-0.125, 0.125, 3)),
        thickness=h,
        poisson=0.0,
        supports=supports,
        normaliser=0.25,
        forces=line_force(0, 1.0, (0.0, 0.0, -4.0)),
    )
    options = ShellOptions(event_tolerance=1e-7, kick=False, arc_length="never")
    model = NaghdiModel(body, comm=api.communicator("self"))
    push = Stage("push", Control(1.0, 0.0, 0.0, 0.0), Control(1.0, 0.0, 1.0, 0.0))
    walker = Walker(Equilibrium(model, options), (push,), options)
    walk = Walk(Point(0.0, model.reference, None))
    walker.start(walk)
    found = find(walker, walk, factor=4.0)
    euler = np.pi**2 / 4
    corrected = euler * (1 - euler * h**2 / 5 - euler * h**2 / 12)
    assert found.status is ShellStatus.CONVERGED
    assert found.difference < 1e-6
    assert found.critical == pytest.approx(corrected, rel=1e-5)
    assert abs(found.critical / euler - 1) > 2e-4  # the correction is seen


def test_carried_tangent_vectors_stay_orthonormal_and_near():
    rng = np.random.default_rng(4)
    d = rng.standard_normal((40, 3))
    d /= np.linalg.norm(d, axis=1)[:, None]
    bases = tangent_bases(d)
    near = d + 1e-3 * rng.standard_normal(d.shape)
    near /= np.linalg.norm(near, axis=1)[:, None]
    moved = carried(bases, near)
    frames = np.concatenate([moved, near[:, :, None]], axis=2)
    np.testing.assert_allclose(np.einsum("nij,nik->njk", frames, frames), np.tile(np.eye(3), (40, 1, 1)), atol=1e-14)
    assert np.max(np.abs(moved - bases)) < 0.01
