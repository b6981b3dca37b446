"""Shell solutions against closed forms, an independent elastica, balances and symmetries."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from shellref import ShellOptions, ShellProblem, ShellStatus
from shellref.shell.midsurface import natural_curve
from shellref.shell.strip import strip_grid

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.path.solve import solve  # noqa: E402

ROOT = 0.5**0.5
CURL = ShellProblem(  # thesis 4.3, on a coarse mesh
    width=0.03,
    thickness=3e-4,
    poisson=0.4,
    natural_curvature=(10.0, 10.0),
    gamma=100.0,
    up=(1.0, 0.0, 0.0),
    clamp_frame=((ROOT, -ROOT, 0.0), (ROOT, ROOT, 0.0), (0.0, 0.0, 1.0)),
    elements=(40, 4),
)
SMALL = replace(CURL, elements=(24, 2))
BEAM = ShellProblem(width=0.03, thickness=3e-4, poisson=0.0, gamma=10.0, up=(0.0, 1.0, 0.0), elements=(20, 1))


def elastica_end(gamma: float, stiffness: float = 1.0) -> tuple[float, float]:
    """(z, y) of the end of a cantilever under its weight along -y: theta'' = -(gamma / B) (1 - s) cos(theta)."""
    s, y = np.linspace(0, 1, 101), np.zeros((4, 101))
    for load in np.linspace(0.1, 1.0, 10) * gamma / stiffness:
        sol = solve_bvp(
            lambda s, y, load=load: np.array([y[1], -load * (1 - s) * np.cos(y[0]), np.cos(y[0]), -np.sin(y[0])]),
            lambda a, b: np.array([a[0], b[1], a[2], a[3]]),
            s,
            y,
            tol=1e-10,
            max_nodes=50000,
        )
        assert sol.success
        s, y = sol.x, sol.y
    return float(y[2, -1]), float(y[3, -1])


def end(result) -> np.ndarray:
    return np.array(result.section(1.0)["position"])


@pytest.mark.parametrize("law", [(10.0, 10.0), (-10.0, -10.0), (-4.0, 12.0)])
def test_without_weight_the_natural_cylinder_is_the_solution(law):
    """Positions against the natural curve, order 3.5 in the element size at least; energy order 3."""
    errors, energies = [], []
    for n in (10, 20, 40):
        problem = replace(CURL, natural_curvature=law, gamma=0.0, elements=(n, 2), grading=(1.0, 1.0))
        result = solve(problem, ShellOptions(stability=False))
        assert result.status is ShellStatus.CONVERGED
        assert result.load_factor == 1.0
        frame, surface = np.array(problem.clamp_frame), result.surface
        z, y = natural_curve(surface.s_nodes, law)
        exact = (np.outer(z, frame[:, 2]) + np.outer(y, frame[:, 1]))[:, None] + np.outer(surface.v_nodes, frame[:, 0])
        errors.append(np.max(np.linalg.norm(surface.points - exact, axis=-1)))
        energies.append(result.energy["elastic"])
    assert errors[-1] < 1e-4
    assert np.log2(errors[-2] / errors[-1]) > 3.5
    assert np.log2(energies[-2] / energies[-1]) > 3.0
    assert energies[-1] < 1e-4 * 0.5 * 100
    np.testing.assert_allclose(result.clamp_force, 0.0, atol=1e-6)


def test_natural_curvature_of_a_full_turn_closes_the_circle():
    k = 2 * np.pi
    result = solve(replace(CURL, natural_curvature=(k, k), gamma=0.0, elements=(60, 1), grading=(1.0, 1.0)))
    np.testing.assert_allclose(end(result), 0.0, atol=2e-5)
    np.testing.assert_allclose(result.section(0.5)["position"], -np.array(CURL.clamp_frame)[:, 1] / np.pi, atol=2e-5)
    np.testing.assert_allclose(result.section(1.0)["frame"], CURL.clamp_frame, atol=2e-3)


def test_stepped_curvature_reaches_the_same_equilibrium():
    exact, stepped = (solve(SMALL, ShellOptions(natural_path=path)) for path in ("exact", "stepped"))
    assert exact.status is stepped.status is ShellStatus.CONVERGED
    np.testing.assert_allclose(stepped.surface.points, exact.surface.points, atol=1e-9)
    assert stepped.energy["total"] == pytest.approx(exact.energy["total"], abs=1e-9)
    assert len([s for s in stepped.steps if s.stage == "natural"]) > 2


@pytest.fixture(scope="module")
def curl():
    return solve(CURL)


def test_the_case_of_the_thesis_balances(curl):
    """The clamp carries the weight: force Gamma up (D w / l^2) and the weight's moment about the clamp (D w / l)."""
    assert curl.status is ShellStatus.CONVERGED
    assert curl.stable is True
    assert curl.lowest_eigenvalue > 0
    assert curl.residual["relative"] < 1e-7
    np.testing.assert_allclose(curl.clamp_force, [100.0, 0.0, 0.0], atol=1e-6)
    s, v = curl.surface.s_nodes, curl.surface.v_nodes
    simpson = [np.zeros(len(x)) for x in (s, v)]
    for weights, x in zip(simpson, (s, v), strict=True):
        for offset, w in ((0, 1 / 6), (1, 4 / 6), (2, 1 / 6)):
            weights[offset : offset + len(x) - 2 : 2] += w * np.diff(x[::2])
    centre = np.einsum("a,b,abk->k", *simpson, curl.surface.points) / CURL.width
    np.testing.assert_allclose(curl.clamp_moment, np.cross(centre, [100.0, 0.0, 0.0]), atol=1e-6)
    assert curl.energy["gravity"] == pytest.approx(100.0 * centre[0], rel=1e-12)
    parts = [curl.energy[name] for name in ("bending", "membrane", "shear")]
    assert sum(parts) + curl.energy["stabilisation"] == pytest.approx(curl.energy["elastic"], rel=1e-14)
    areas = strip_grid(CURL).areas(curl.cell_midpoints)
    np.testing.assert_allclose(areas @ curl.energy_density / CURL.width, parts, rtol=1e-12)


def test_plain_newton_finds_the_same_state_in_more_iterations():
    mixed, plain = (solve(SMALL, ShellOptions(iteration=iteration)) for iteration in ("mixed", "plain"))
    assert plain.status is ShellStatus.CONVERGED
    np.testing.assert_allclose(plain.surface.points, mixed.surface.points, atol=1e-9)
    assert plain.newton_iterations > 1.5 * mixed.newton_iterations


def test_energies_do_not_depend_on_the_frame_of_the_room(curl):
    q = np.linalg.qr(np.random.default_rng(5).standard_normal((3, 3)))[0]
    q *= np.sign(np.linalg.det(q))
    turned = replace(
        CURL,
        up=tuple(q @ CURL.up),
        clamp_frame=tuple(map(tuple, q @ np.array(CURL.clamp_frame))),
        clamp_position=(1.0, -2.0, 0.5),
    )
    result = solve(turned)
    for name in ("bending", "membrane", "shear"):
        assert result.energy[name] == pytest.approx(curl.energy[name], rel=1e-8)
    assert result.energy["elastic"] == pytest.approx(curl.energy["elastic"], rel=1e-9)
    np.testing.assert_allclose(result.surface.points, curl.surface.points @ q.T + [1.0, -2.0, 0.5], atol=1e-9)
    np.testing.assert_allclose(result.clamp_moment, q @ curl.clamp_moment, atol=1e-6)


def test_mirror_image_has_the_mirror_solution(curl):
    """Reflection x_across -> -x_across in the clamp's frame: `up` reflected, same curvature, points reflected."""
    tx = np.array(CURL.clamp_frame)[:, 0]
    mirror = np.eye(3) - 2 * np.outer(tx, tx)
    result = solve(replace(CURL, up=tuple(mirror @ CURL.up)))
    np.testing.assert_allclose(result.surface.points, curl.surface.points[:, ::-1] @ mirror, atol=1e-9)
    assert result.energy["total"] == pytest.approx(curl.energy["total"], rel=1e-10)


def test_both_signs_of_curvature_are_different_problems_and_turning_the_clamp_over_maps_them():
    """K -> -K with the clamp turned half round its tangent (t_x, t_y -> -t_x, -t_y) is the same strip."""
    over = tuple(map(tuple, np.array(CURL.clamp_frame) * [-1, -1, 1]))
    negative = replace(SMALL, natural_curvature=(-10.0, -10.0))
    curl, other, turned = (solve(problem) for problem in (SMALL, negative, replace(negative, clamp_frame=over)))
    assert other.status is ShellStatus.CONVERGED
    assert abs(other.energy["total"] - curl.energy["total"]) > 1.0
    np.testing.assert_allclose(turned.surface.points[:, ::-1], curl.surface.points, atol=1e-9)


@pytest.mark.parametrize(
    ("ratio", "gamma"),
    [
        (10000.0, 10.0),
        (10000.0, 100.0),
        *(pytest.param(r, g, marks=pytest.mark.validate) for r in (100.0, 1000.0) for g in (10.0, 100.0)),
    ],
)
def test_cantilever_without_poisson_is_the_elastica_and_does_not_lock(gamma, ratio):
    """nu = 0: a planar strip is exactly a beam; the tip error falls with the mesh alike from w/h = 100 to 10000."""
    exact = elastica_end(gamma)
    errors = []
    for n in (10, 20, 40):
        result = solve(replace(BEAM, gamma=gamma, thickness=0.03 / ratio, elements=(n, 1)))
        assert result.status is ShellStatus.CONVERGED
        errors.append(np.hypot(*(end(result)[[2, 1]] - exact)))
    # mostly the stabilisation's own error, c = 0.01 (ten times smaller c: 1.0e-6, 2.1e-7, 4.4e-8); see docs/shell.md
    limit = {10.0: (6.2e-6, 1.8e-6, 4.5e-7), 100.0: (2e-4, 2e-5, 3e-6)}[gamma]
    assert all(error < most for error, most in zip(errors, limit, strict=True)), errors
    assert errors[0] > 2.5 * errors[1] > 6.25 * errors[2]


def test_small_weight_gives_the_linear_cantilever():
    """y / l = Gamma / 8 + Gamma / (2 (5/6) G h): for nu = 0 the shear stiffness is 5 / h^2, here 3e-4 of the whole."""
    h = 0.02
    result = solve(replace(BEAM, width=0.2, thickness=h, gamma=1e-3, elements=(40, 1)))
    shear = 0.5 / (5.0 / h**2)
    assert -end(result)[1] / 1e-3 == pytest.approx(1 / 8 + shear, rel=2e-5)


def test_poisson_effect_lies_between_plate_and_beam():
    """Bending stiffness: D (1 - nu^2) where w^2 kappa / h << 1 (anticlastic bending is free), D where it is >> 1."""
    nu, gamma = 0.4, 2.0
    plate, beam = elastica_end(gamma)[1], elastica_end(gamma, 1 - nu**2)[1]
    problem = replace(BEAM, poisson=nu, gamma=gamma, elements=(40, 4), grading=(0.2, 0.3))
    position = [
        (end(solve(replace(problem, thickness=h)))[1] - beam) / (plate - beam) for h in (3e-3, 3e-5)
    ]  # 0: beam, 1: plate
    assert -0.02 < position[0] < 0.15
    assert 0.7 < position[1] < 1.02


def test_lateral_buckling_is_noticed_left_and_bracketed():
    """Strip on edge under its weight, Gamma_c = 18.2 (1 - nu) sqrt(1 + nu) + 14.5 w / l (thesis 7.1)."""
    nu, w = 0.35, 0.05
    critical = 18.2 * (1 - nu) * np.sqrt(1 + nu) + 14.5 * w  # 14.47
    strip = ShellProblem(width=w, thickness=w / 20, poisson=nu, up=(1.0, 0.0, 0.0), elements=(20, 4))
    stay = ShellOptions(kick=False)
    below, above = (solve(replace(strip, gamma=factor * critical), stay) for factor in (0.93, 1.07))
    assert below.status is ShellStatus.CONVERGED
    assert (below.stable, below.negative_eigenvalues) == (True, 0)
    assert above.status is ShellStatus.UNSTABLE
    assert (above.stable, above.negative_eigenvalues) == (False, 1)
    assert below.lowest_eigenvalue > 0 > above.lowest_eigenvalue
    assert "kick" in above.message
    events = []
    left = solve(replace(strip, gamma=1.5 * critical), ShellOptions(), events.append)
    assert left.status is ShellStatus.CONVERGED
    assert left.stable
    assert any(event["event"] == "kick" for event in events)
    assert any(step.method == "relax" for step in left.steps)
    assert "unstable" in left.message
    flat = solve(replace(strip, gamma=1.5 * critical), stay)
    assert left.energy["total"] < flat.energy["total"] - 0.1
    assert abs(end(left)[1]) > 0.1 > 1e-6 > abs(end(flat)[1])


def test_failures_are_statuses_that_keep_the_last_good_step():
    start = solve(CURL, ShellOptions(max_newton=1))
    assert start.status is ShellStatus.NOT_CONVERGED
    assert start.stable is None
    assert "max_newton" in start.message
    stuck = solve(CURL, ShellOptions(first_step=1.0, max_step=1.0, min_step=0.9, arc_length="never"))
    assert stuck.status is ShellStatus.NOT_CONVERGED
    assert stuck.load_factor == 0.0
    assert "min_step" in stuck.message
    assert np.all(np.isfinite(stuck.surface.points))
    half = solve(CURL, ShellOptions(max_newton=4, min_step=0.15, arc_length="never"))
    assert half.status is ShellStatus.NOT_CONVERGED
    assert 0.0 < half.load_factor < 1.0
    assert half.residual["relative"] < 1e-6  # the last good state, at its own load
    assert half.clamp_force[0] == pytest.approx(100.0 * half.load_factor, rel=1e-6)
    assert not half.steps[-1].accepted
    half.to_dict()
