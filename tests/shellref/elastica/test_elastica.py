"""The planar elastica against closed forms, scipy's boundary value solver and a plain NumPy twin."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.optimize import brentq
from scipy.special import fresnel, jv

from shellref.elastica.fem import Discretisation
from shellref.elastica.solve import (
    ElasticaOptions,
    ElasticaProblem,
    ElasticaStatus,
    embed,
    embed_frames,
    graded_nodes,
    solve,
    to_plane,
)

GENERAL = ElasticaProblem(gamma=25.0, up=(0.6, 0.8), curvature=(4.0, -3.0), force=(1.5, -2.0))


def slope_of(errors, sizes):
    """Observed orders between neighbouring meshes, shape (len - 1,)."""
    return np.diff(np.log(errors)) / np.diff(np.log(sizes))


def collocation(problem: ElasticaProblem, tolerance: float = 1e-10):
    """The same boundary value problem by scipy's collocation, started from its own natural shape and raised in load.

    Unknowns (theta, theta' - K, x, y); (theta' - K)' = <t_perp, p>, theta(0) = 0, (theta' - K)(1) = 0.
    """
    full = math.hypot(problem.gamma, *problem.force)
    shares = [0.0, *np.geomspace(min(1.0, 3.0 / full), 1.0, max(2, int(3 * math.log(max(full, 3.0))))), 1.0]
    s = np.linspace(0.0, 1.0, 61) ** 2
    start, end = problem.curvature
    guess = np.array([start * s + 0.5 * (end - start) * s**2, 0 * s, s, 0 * s])
    for index, share in enumerate(shares):

        def rates(s, y, share=share):
            theta, moment = y[0], y[1]
            px = share * (problem.gamma * (1 - s) * problem.up[0] - problem.force[0])
            py = share * (problem.gamma * (1 - s) * problem.up[1] - problem.force[1])
            natural = start + (end - start) * s
            turn = -np.sin(theta) * px + np.cos(theta) * py
            return np.array([moment + natural, turn, np.cos(theta), np.sin(theta)])

        def ends(at_start, at_end):
            return np.array([at_start[0], at_end[1], at_start[2], at_start[3]])

        last = index == len(shares) - 1
        solution = solve_bvp(rates, ends, s, guess, tol=tolerance if last else 1e-4, max_nodes=100_000)
        assert solution.status == 0, solution.message
        s, guess = solution.x, solution.y
    return solution.sol


@pytest.mark.parametrize("gamma", [1.0, 10.0, 100.0, 1e3, 1e4])
def test_cantilever_agrees_with_collocation(gamma):
    problem = ElasticaProblem(gamma=gamma)
    reference = collocation(problem)
    s = np.linspace(0.0, 1.0, 101)
    for degree in (2, 3):
        result = solve(problem, 200, degree=degree, estimate_error=False)
        assert result.status is ElasticaStatus.CONVERGED
        assert np.max(np.abs(result.position(s) - reference(s)[2:].T)) < 1e-8
    assert np.max(np.abs(result.angle(s) - reference(s)[0])) < 1e-8


@pytest.mark.parametrize(
    "problem",
    [GENERAL, ElasticaProblem(force=(0.0, -30.0)), ElasticaProblem(gamma=40.0, curvature=(6.0, 6.0), up=(0.0, 1.0))],
)
def test_natural_curvature_and_end_force_agree_with_collocation(problem):
    reference = collocation(problem)
    result = solve(problem, 200, estimate_error=False)
    s = np.linspace(0.0, 1.0, 101)
    assert np.max(np.abs(result.position(s) - reference(s)[2:].T)) < 1e-8


def test_the_reported_error_is_the_error():
    """Halving the elements must predict the distance to a far finer solution, neither optimistic nor useless."""
    for problem in (ElasticaProblem(gamma=300.0), GENERAL):
        coarse = solve(problem, 10)
        fine = solve(problem, 80, degree=4, estimate_error=False)
        true = np.max(np.linalg.norm(coarse.position(coarse.nodes) - fine.position(coarse.nodes), axis=1))
        assert coarse.error is not None
        assert 0.5 * true < coarse.error < 5.0 * true
        assert true > 1e-8  # the comparison is about discretisation, not rounding


@pytest.mark.parametrize(("degree", "angle_order", "end_order"), [(1, 2, 2), (2, 3, 4)])
def test_orders_of_convergence(degree, angle_order, end_order):
    """theta in L2: degree + 1; end position, a functional: twice the degree. Both from both sides, on five meshes."""
    reference = solve(GENERAL, np.linspace(0, 1, 321), degree=4, estimate_error=False)
    counts = np.array([8, 16, 32, 64, 128])
    points, weights = np.polynomial.legendre.leggauss(5)
    cells = np.linspace(0.0, 1.0, 321)  # between the joints of every mesh
    s = (0.5 * (cells[1:] + cells[:-1])[:, None] + 0.5 / 320 * points).ravel()
    weight = np.tile(0.5 / 320 * weights, 320)
    angle, end = [], []
    for count in counts:
        result = solve(GENERAL, np.linspace(0, 1, count + 1), degree=degree, estimate_error=False)
        angle.append(math.sqrt(weight @ (result.angle(s) - reference.angle(s)) ** 2))
        end.append(math.dist(result.end, reference.end))
    angle_slopes, end_slopes = slope_of(angle, 1.0 / counts), slope_of(end, 1.0 / counts)
    assert np.all(np.abs(angle_slopes[1:] - angle_order) < 0.1), angle_slopes
    assert np.all(np.abs(end_slopes[1:] - end_order) < 0.15), end_slopes


def test_small_gamma_is_linear_beam_theory():
    """Deflection over reach -> Gamma/8, with a relative remainder of order Gamma^2 (the problem is odd in Gamma)."""
    gammas = np.array([0.04, 0.08, 0.16, 0.32, 0.64])
    remainders = []
    for gamma in gammas:
        x, y = solve(ElasticaProblem(gamma=gamma), 40, degree=3, estimate_error=False).end
        remainders.append(abs(-y / x / (gamma / 8.0) - 1.0))
    slopes = slope_of(remainders, gammas)
    assert np.all(np.abs(slopes - 2.0) < 0.02), slopes
    assert remainders[0] < 1e-5


def test_large_gamma_tends_to_the_square_root():
    """Deflection over reach -> sqrt(Gamma/2), with a relative remainder that falls as Gamma^(-1/2)."""
    gammas = np.array([1e3, 1e4, 1e5, 1e6])
    remainders = []
    for gamma in gammas:
        result = solve(ElasticaProblem(gamma=gamma), 80)
        assert result.status is ElasticaStatus.CONVERGED
        assert result.error is not None
        assert result.error < 1e-7
        x, y = result.end
        remainders.append(1.0 - (-y / x) / math.sqrt(gamma / 2.0))
    assert min(remainders) > 0.0
    slopes = slope_of(remainders, gammas)
    assert np.all(np.abs(slopes + 0.5) < 0.03), slopes


def test_grading_pays_at_large_gamma():
    problem = ElasticaProblem(gamma=1e5)
    graded = solve(problem, 40)
    uniform = solve(problem, np.linspace(0.0, 1.0, 41))
    assert graded.error is not None
    assert uniform.error is not None
    assert graded.error < 1e-6
    assert uniform.error > 1000.0 * graded.error


def test_graded_nodes_resolve_the_layers():
    loaded = ElasticaProblem(gamma=1e4, curvature=(0.0, 20.0))
    nodes = graded_nodes(40, loaded)
    assert nodes[0] == 0.0
    assert nodes[-1] == 1.0
    steps = np.diff(nodes)
    assert np.all(steps > 0.0)
    assert steps[0] < 0.25 * 1e4 ** (-1 / 2)  # four elements in the clamp's layer
    assert steps[-1] < 0.5 * 1e4 ** (-1 / 3)  # two in the free end's
    np.testing.assert_allclose(np.diff(graded_nodes(7, ElasticaProblem(curvature=(5.0, 5.0)))), 1 / 7, rtol=0.2)
    np.testing.assert_allclose(nodes, graded_nodes(80, loaded)[::2], atol=1e-12)  # refinement halves every element


@pytest.mark.parametrize("curvature", [10.0, -10.0, 40.0])
def test_unloaded_strip_is_its_natural_arc(curvature):
    result = solve(ElasticaProblem(curvature=(curvature, curvature)), 40)
    s = np.linspace(0.0, 1.0, 57)
    circle = np.column_stack([np.sin(curvature * s), 1.0 - np.cos(curvature * s)]) / curvature
    np.testing.assert_allclose(result.position(s), circle, atol=1e-11)
    np.testing.assert_allclose(result.angle(s), curvature * s, atol=1e-11)
    assert result.energy.bending == pytest.approx(-0.5 * curvature**2, rel=1e-12)
    assert result.lowest_eigenvalue == pytest.approx(math.pi**2 / 4, rel=1e-6)


def test_linear_natural_curvature_is_a_clothoid():
    rate = 12.0
    result = solve(ElasticaProblem(curvature=(0.0, rate)), 20)
    sine, cosine = fresnel(math.sqrt(rate / math.pi))
    scale = math.sqrt(math.pi / rate)
    assert result.end == pytest.approx((scale * cosine, scale * sine), abs=1e-11)


def test_end_force_known_values():
    """Bisshopp and Drucker 1945 (doi 10.1090/qam/13360): load P l^2 / B = 1 deflects the end by 0.3017 and 0.0564."""
    x, y = solve(ElasticaProblem(force=(0.0, -1.0)), 40).end
    assert -y == pytest.approx(0.30172, abs=1e-5)
    assert 1.0 - x == pytest.approx(0.05643, abs=1e-5)


def test_self_buckling_of_a_column():
    """Greenhill: a straight column loses stability at Gamma = 9/4 j^2, j the first zero of Bessel's J_-1/3."""
    zero = brentq(lambda z: jv(-1.0 / 3.0, z), 1.5, 2.2)
    critical = 2.25 * zero**2
    assert critical == pytest.approx(7.8373, abs=1e-4)

    def lowest(gamma):
        return solve(ElasticaProblem(gamma=gamma, up=(1.0, 0.0)), 40, estimate_error=False).lowest_eigenvalue

    assert brentq(lowest, 7.0, 9.0, xtol=1e-9) == pytest.approx(critical, rel=1e-7)
    above = solve(ElasticaProblem(gamma=8.0, up=(1.0, 0.0)), 20)
    assert above.status is ElasticaStatus.UNSTABLE
    assert not above.stable
    assert "tilt" in above.message
    assert above.end == pytest.approx((1.0, 0.0), abs=1e-12)


def test_euler_load_in_the_eigenvalue():
    """Straight strip pushed by F: the tangent is that of -v'' - F v, lowest eigenvalue pi^2/4 - F; dense and sparse."""
    for count in (16, 400):
        result = solve(ElasticaProblem(force=(-2.0, 0.0)), count, estimate_error=False)
        assert result.lowest_eigenvalue == pytest.approx(math.pi**2 / 4 - 2.0, abs=1e-6)


def test_energy_and_residual_against_a_numpy_twin():
    """P1: the energy written out in NumPy and its gradient by complex step."""
    nodes = np.sort(np.concatenate([[0.0, 1.0], np.random.default_rng(1).uniform(size=8)]))
    discrete = Discretisation(nodes, 1)
    theta = np.concatenate([[0.0], np.random.default_rng(2).normal(size=len(nodes) - 1)])
    points, weights = np.polynomial.legendre.leggauss(14)
    problem = GENERAL

    def energy(angles):
        total = 0.0
        for i, length in enumerate(np.diff(nodes)):
            xi = 0.5 * (points + 1.0)
            s = nodes[i] + length * xi
            value = angles[i] + (angles[i + 1] - angles[i]) * xi
            rate = (angles[i + 1] - angles[i]) / length
            natural = problem.curvature[0] + (problem.curvature[1] - problem.curvature[0]) * s
            px = problem.gamma * (1 - s) * problem.up[0] - problem.force[0]
            py = problem.gamma * (1 - s) * problem.up[1] - problem.force[1]
            density = 0.5 * rate**2 - natural * rate + px * np.cos(value) + py * np.sin(value)
            total = total + 0.5 * length * (weights @ density)
        return total

    assert sum(discrete.energies(theta, problem)) == pytest.approx(energy(theta), rel=1e-12)
    gradient = np.zeros(len(nodes))
    for i in range(len(nodes)):
        step = theta.astype(complex)
        step[i] += 1e-30j
        gradient[i] = energy(step).imag / 1e-30
    np.testing.assert_allclose(discrete.residual(theta, problem), gradient[1:], rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_tangent_is_the_derivative_of_the_residual(degree):
    """Central differences with two steps: the difference falls by a factor of four with the step, and is small."""
    discrete = Discretisation(np.linspace(0.0, 1.0, 8) ** 1.5, degree)
    rng = np.random.default_rng(3)
    theta = rng.normal(size=discrete.basis.N)
    direction = np.zeros(discrete.basis.N)
    direction[discrete.free] = rng.normal(size=len(discrete.free))
    exact = discrete.tangent(theta, GENERAL) @ direction[discrete.free]
    errors = []
    for step in (1e-2, 5e-3, 1e-5):
        ahead = discrete.residual(theta + step * direction, GENERAL)
        behind = discrete.residual(theta - step * direction, GENERAL)
        errors.append(np.linalg.norm((ahead - behind) / (2.0 * step) - exact) / np.linalg.norm(exact))
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.1)
    assert errors[2] < 1e-9


def test_weight_is_the_integral_of_the_height():
    """The weight as a lever equals Gamma times the integral of <r, up>, and dE/dGamma that integral (envelope)."""
    problem = ElasticaProblem(gamma=30.0, up=(0.6, 0.8), curvature=(2.0, 2.0))
    result = solve(problem, 80, degree=3, estimate_error=False)
    points, weights = np.polynomial.legendre.leggauss(60)
    heights = result.position(0.5 * (points + 1.0)) @ np.array(problem.up)
    integral = 0.5 * float(weights @ heights)
    assert result.energy.gravity == pytest.approx(30.0 * integral, rel=1e-9)
    assert result.energy.force == 0.0
    totals = [
        solve(ElasticaProblem(gamma, problem.up, problem.curvature), 80, degree=3, estimate_error=False).energy.total
        for gamma in (29.99, 30.01)
    ]
    assert (totals[1] - totals[0]) / 0.02 == pytest.approx(integral, rel=1e-6)


def test_mirror_symmetry():
    mirrored = ElasticaProblem(25.0, (0.6, -0.8), (-4.0, 3.0), (1.5, 2.0))
    a, b = solve(GENERAL, 30, estimate_error=False), solve(mirrored, 30, estimate_error=False)
    np.testing.assert_allclose(a.position(a.nodes), b.position(b.nodes) * [1.0, -1.0], atol=1e-10)


def test_several_turns_under_weight_pass_their_limit_point():
    """K = -10, Gamma = 100 has a fold on the way: with descents the solve arrives, without it stops; both say so."""
    problem = ElasticaProblem(gamma=100.0, curvature=(-10.0, -10.0))
    result = solve(problem, 60)
    assert result.status is ElasticaStatus.CONVERGED
    assert result.stable
    assert result.snaps >= 1
    assert "snap" in result.message
    assert result.error is not None
    assert result.error < 1e-5
    stopped = solve(problem, 60, options=ElasticaOptions(snaps=0))
    assert stopped.status is ElasticaStatus.LIMIT_POINT
    assert 0.5 < stopped.load_factor < 1.0
    assert stopped.error is None
    assert "snaps" in stopped.message
    assert "arc length" in stopped.message
    assert 0.0 < stopped.lowest_eigenvalue < 0.1  # the last equilibrium lies just before a fold


def test_many_turns_are_solved_at_full_load():
    result = solve(ElasticaProblem(gamma=1200.0, curvature=(40.0, 40.0)), 120)
    assert result.status is ElasticaStatus.CONVERGED
    assert result.residual < 1e-9
    assert result.error is not None
    assert result.error < 1e-4


def test_embedding_in_space():
    """Heights agree; frames are orthonormal and obey R' = R [kappa]_x with kappa_1 = theta'."""
    rng = np.random.default_rng(5)
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    frame *= np.sign(np.linalg.det(frame))
    up = 0.6 * frame[:, 2] + 0.8 * frame[:, 1]
    plane_up, across = to_plane(frame, up)
    assert plane_up == pytest.approx((0.6, -0.8), abs=1e-14)
    assert across == pytest.approx(0.0, abs=1e-14)
    assert to_plane(frame, frame[:, 0])[1] == pytest.approx(1.0)
    result = solve(ElasticaProblem(gamma=20.0, up=plane_up, curvature=(3.0, 3.0)), 40)
    position = np.array([1.0, 2.0, 3.0])
    s = np.linspace(0.0, 1.0, 9)
    space = embed(result, position, frame, s)
    np.testing.assert_allclose((space - position) @ up, result.position(s) @ np.array(plane_up), atol=1e-14)
    np.testing.assert_allclose(embed(result, position, frame)[0], position, atol=1e-15)
    frames = embed_frames(result, frame, s)
    np.testing.assert_allclose(frames[0], frame, atol=1e-14)
    products = np.einsum("nij,nik->njk", frames, frames)
    np.testing.assert_allclose(products, np.broadcast_to(np.eye(3), (9, 3, 3)), atol=1e-14)
    h = 1e-4
    inner = np.array([0.3123, 0.7321])
    turn = (embed_frames(result, frame, inner + h) - embed_frames(result, frame, inner - h)) / (2 * h)
    rate = (result.angle(inner + h) - result.angle(inner - h)) / (2 * h)
    here = embed_frames(result, frame, inner)
    np.testing.assert_allclose(turn[:, :, 2], -rate[:, None] * here[:, :, 1], atol=1e-5)  # t_z' = -omega t_y
    ahead, behind = embed(result, position, frame, inner + h), embed(result, position, frame, inner - h)
    np.testing.assert_allclose((ahead - behind) / (2 * h), here[:, :, 2], atol=1e-6)  # r' = t_z


def test_positive_curvature_turns_towards_minus_t_y():
    frame = np.eye(3)
    result = solve(ElasticaProblem(curvature=(1.0, 1.0)), 10)
    tip = embed(result, np.zeros(3), frame)[-1]
    assert tip == pytest.approx([0.0, -(1.0 - math.cos(1.0)), math.sin(1.0)], abs=1e-12)


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: ElasticaProblem(gamma=-1.0), "gamma = -1.0"),
        (lambda: ElasticaProblem(gamma=math.nan), "gamma"),
        (lambda: ElasticaProblem(up=(0.0, 2.0)), "up = "),
        (lambda: ElasticaProblem(curvature=(math.inf, 0.0)), "curvature"),
        (lambda: ElasticaProblem(force=(1.0,)), "force"),
        (lambda: solve(ElasticaProblem(), 0), "elements = 0"),
        (lambda: solve(ElasticaProblem(), 10, degree=5), "degree = 5"),
        (lambda: solve(ElasticaProblem(), [0.0, 0.5, 0.5, 1.0]), "nodes"),
        (lambda: solve(ElasticaProblem(), [0.1, 1.0]), "nodes"),
        (lambda: solve(ElasticaProblem(), 4).position([1.5]), "abscissae"),
        (lambda: ElasticaOptions(tolerance=0.0), "tolerance = 0.0"),
        (lambda: ElasticaOptions(growth=1.0), "growth = 1.0"),
    ],
)
def test_bad_input_is_named(call, word):
    with pytest.raises(ValueError) as caught:
        call()
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_imports_nothing_it_should_not():
    """Independence: neither dolfinx nor the two packages it is compared with."""
    unwanted = {"dolfinx", "ribbon", "compare"}
    sources = ("solve", "branches", "buckling")
    names = ", ".join([*(f"shellref.elastica.{name}" for name in sources), "tests.validation.elastica.elastica_daisy"])
    code = f"import sys, {names}; print({{m.split('.')[0] for m in sys.modules}} & {unwanted})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
