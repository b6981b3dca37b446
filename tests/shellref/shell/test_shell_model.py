"""The discrete shell against finite differences of itself and against rigid motions."""

import numpy as np
import pytest
import scipy.sparse as sparse

from shellref import ShellOptions, ShellProblem
from shellref.shell import director
from shellref.shell.midsurface import natural_strip

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.path.newton import Equilibrium  # noqa: E402
from shellref.shell.body import Control  # noqa: E402
from shellref.shell.naghdi import NaghdiModel  # noqa: E402
from shellref.shell.strip import build_strip  # noqa: E402

RNG = np.random.default_rng(11)
FRAME = np.linalg.qr(RNG.standard_normal((3, 3)))[0]
FRAME *= np.sign(np.linalg.det(FRAME))


def _problem(**change):
    base = {
        "width": 0.3,
        "thickness": 0.02,
        "poisson": 0.3,
        "natural_curvature": (2.0, -1.0),
        "gamma": 7.0,
        "up": (0.6, 0.8, 0.0),
        "elements": (4, 2),
        "grading": (0.4, 0.5),
        "clamp_frame": tuple(map(tuple, FRAME.tolist())),
    }
    return ShellProblem(**{**base, **change})


def _model(stabilisation=0.01, **change):
    return NaghdiModel(build_strip(_problem(**change), ShellOptions()).body, stabilisation)


def _state(model, size=0.05):
    """A curled and randomly shaken state with unit directors (nodes, 6)."""
    state = np.hstack(natural_strip(*model.nodes.T, np.zeros(3), FRAME, (1.0, 2.0)))
    return director.retract(state, size * RNG.standard_normal(state.shape))


@pytest.fixture(scope="module")
def model():
    model = _model(0.3)
    model.set_control(Control())
    return model


def _slope(function, t):
    """Fourth-order central difference at 0: exact for polynomials of degree 4 and less."""
    return (8 * (function(t) - function(-t)) - (function(2 * t) - function(-2 * t))) / (12 * t)


def test_residual_is_the_derivative_of_the_energy(model):
    """The energy is quartic in the six components, so the difference is exact at any step."""
    state = _state(model)
    residual = model.residual(state)
    for t in (0.03, 0.1, 0.3):
        step = RNG.standard_normal(state.shape)
        slope = _slope(lambda x, step=step: model.energies(state + x * step).total, t)
        assert slope == pytest.approx(np.sum(residual * step), rel=1e-8)


def test_tangent_is_the_derivative_of_the_residual(model):
    """The residual is cubic in the six components."""
    state = _state(model)
    matrix = model.create_tangent()
    model.tangent(matrix, state, model.stress(state))
    indptr, indices, values = matrix.getValuesCSR()
    k = sparse.csr_matrix((values, indices, indptr))
    assert abs(k - k.T).max() < 1e-12 * abs(k).max()
    step = RNG.standard_normal(state.shape)
    exact = (k @ step.ravel()).reshape(state.shape)
    slope = _slope(lambda x: model.residual(state + x * step), 0.01)
    assert np.max(np.abs(slope - exact)) < 1e-10 * np.max(np.abs(exact))


def test_reduced_hessian_is_the_second_derivative_on_the_sphere(model):
    """d2/dt2 E(retract(u, t P q)) = q . H . q, constraint curvature included, far out of balance; order 2."""
    equilibrium = Equilibrium(model, ShellOptions())
    state = _state(model)
    stress = model.stress(state)
    force = model.force(state, stress)
    bases = equilibrium.factor(state, stress, force)
    indptr, indices, values = equilibrium.matrix.getValuesCSR()
    h = sparse.csr_matrix((values, indices, indptr))
    increments = equilibrium.increments
    n = len(model.nodes)
    rotations = increments.nodal(np.zeros(n), np.ones(n), state)  # where the constraint's curvature acts
    turn = rotations * RNG.standard_normal(increments.unknowns)
    exact = turn @ h @ turn
    curvature = increments.constraint_curvature(state, force, model.control)
    assert abs(curvature @ turn**2) > 0.01 * abs(exact)
    errors = []
    for t in (4e-3, 2e-3, 1e-3):
        levels = [
            model.energies(director.retract(state, increments.expand(x * turn, bases))).total for x in (-t, 0.0, t)
        ]
        errors.append(abs((levels[0] - 2 * levels[1] + levels[2]) / t**2 - exact))
    assert errors[-1] < 1e-4 * abs(exact)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_linearised_stress_of_the_mixed_iteration(model):
    """stress(u, du) is the first-order expansion of stress(u + du): the rest is quadratic."""
    state, step = _state(model), RNG.standard_normal((len(model.nodes), 6))
    exact = model.stress(state)
    line = model.stress(state, step)
    for field in ("full", "reduced"):
        t = 1e-3
        ahead, back = (getattr(model.stress(state + sign * t * step), field) for sign in (1, -1))
        slope = getattr(line, field) - getattr(exact, field)
        np.testing.assert_allclose((ahead - back) / (2 * t), slope, atol=1e-8 * np.max(np.abs(slope)))


def test_rigid_motions_cost_nothing_and_change_nothing(model):
    flat = np.hstack(natural_strip(*model.nodes.T, np.zeros(3), np.eye(3), (0.0, 0.0)))
    turn = np.linalg.qr(RNG.standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    plain = _model(natural_curvature=(0, 0), gamma=0.0, up=None)
    moved = np.hstack([flat[:, :3] @ turn.T + [3.0, -1.0, 2.0], flat[:, 3:] @ turn.T])
    assert plain.energies(moved).elastic < 1e-22 * 12 / 0.02**2
    state = _state(model)
    turned = np.hstack([state[:, :3] @ turn.T, state[:, 3:] @ turn.T])
    assert model.energies(turned).elastic == pytest.approx(model.energies(state).elastic, rel=1e-12)


def test_strains_and_energies_of_a_homogeneous_deformation():
    """phi = affine with stretches and shear, d tilted: membrane and shear energies in closed form, whatever c."""
    problem = _problem(natural_curvature=(3.0, 3.0), gamma=0.0, up=None)
    model = NaghdiModel(build_strip(problem, ShellOptions()).body, 0.5)
    a, b, d = np.array([0.0, 0.1, 1.2]), np.array([0.9, 0.0, 0.2]), np.array([0.0, 0.8, 0.6])
    points = np.outer(model.nodes[:, 0], a) + np.outer(model.nodes[:, 1], b)
    state = np.hstack([points, np.tile(d, (len(points), 1))])
    e11, e22, e12 = (a @ a - 1) / 2, (b @ b - 1) / 2, a @ b / 2
    nu, h = problem.poisson, problem.thickness
    plane = 0.5 * ((1 - nu) * (e11**2 + e22**2 + 2 * e12**2) + nu * (e11 + e22) ** 2)
    energies = model.energies(state)
    assert energies.membrane == pytest.approx(12 / h**2 * plane, rel=1e-12)
    assert energies.shear == pytest.approx(0.5 * 5 * (1 - nu) / h**2 * ((a @ d) ** 2 + (b @ d) ** 2), rel=1e-12)
    assert energies.bending == pytest.approx(0.5 * 3.0**2, rel=1e-12)
    np.testing.assert_allclose(energies.density, np.tile([energies.bending, energies.membrane, energies.shear], (8, 1)))


def test_what_holds_the_elements_own_modes_is_no_stretching():
    """Nodes on the natural cylinder: an element of degree 2 stretches between them by K^2 h_e^2 / sqrt(720) (root mean
    square), of which alpha counts: c K^4 h_e^2 / 120, whatever the thickness. No strip stretches there."""
    stretched = []
    for k, n in ((13.5, 50), (13.5, 100), (6.0, 50)):
        found = {}
        for thickness in (6e-3, 1e-3):
            problem = _problem(width=0.2, thickness=thickness, natural_curvature=(k, k), gamma=0.0, up=None,
                               elements=(n, 2), grading=(1.0, 1.0))  # fmt: skip
            model = NaghdiModel(build_strip(problem, ShellOptions()).body, 0.01)
            energies = model.energies(np.hstack(natural_strip(*model.nodes.T, np.zeros(3), FRAME, (k, k))))
            whole = energies.bending + energies.membrane + energies.shear + energies.stabilisation
            assert energies.elastic == pytest.approx(whole, rel=1e-12)
            found[thickness] = energies.stabilisation
        assert found[6e-3] == pytest.approx(found[1e-3], rel=0.05)
        assert found[1e-3] == pytest.approx(0.01 * k**4 / n**2 / 120.0, rel=0.05)
        assert energies.membrane < 0.02 * energies.stabilisation
        stretched.append(energies.membrane)
    assert stretched[0] > 2**7 * stretched[1]  # of the interpolation at the reduced points, where it is fourth order


def test_weight_is_the_area_times_gamma(model):
    state = _state(model)
    total = model.external(state, Control(weight=1.0))[:, :3].sum(axis=0)
    np.testing.assert_allclose(total, -7.0 * np.array([0.6, 0.8, 0.0]), rtol=1e-12)
    np.testing.assert_allclose(model.external(state, Control(weight=0.3)), 0.3 * model.external(state, Control()))


def test_forms_are_compiled_once():
    """Another mesh, thickness, material or load reuses the cached forms."""
    from shellref.fenics.cache import cache_folder

    _model()
    before = {p.name for p in cache_folder().glob("*.c")}
    for k in range(12):
        _model(0.1, elements=(3 + k, 1), thickness=0.01 / (k + 1), poisson=0.1)
    assert {p.name for p in cache_folder().glob("*.c")} == before
