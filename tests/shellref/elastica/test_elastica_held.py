"""Elasticas whose end is held: closed forms, collocation, forces, limit points with and without arc length."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.linalg

from shellref.elastica import arc as elastica_arc
from shellref.elastica import path as elastica_path
from shellref.elastica import system as elastica_system
from shellref.elastica.arc import Branch, point_at, trace
from shellref.elastica.buckling import buckling_modes, strut
from shellref.elastica.fem import ROUNDING, Discretisation
from shellref.elastica.held import natural_state, path_to, suitable_bow
from shellref.elastica.problem import LoadPath
from shellref.elastica.solve import ElasticaOptions, ElasticaProblem, ElasticaResult, ElasticaStatus, solve
from shellref.elastica.start import solve_along
from shellref.elastica.system import System, dense_pairs, solve_sparse, sparse_pairs
from tests.reference import elastica_closed as closed
from tests.reference.elastica_collocation import collocation, near

ALWAYS = ElasticaOptions(arc_length="always")
NEVER = ElasticaOptions(arc_length="never")
HELD = {
    "clamped-clamped, weight, curvature": ElasticaProblem(
        gamma=20.0, curvature=(2.0, -1.0), end_angle=0.0, end=(0.7, 0.1)
    ),
    "clamped-clamped, straight": ElasticaProblem(end_angle=0.0, end=(0.7, 0.0)),
    "clamped-pinned": ElasticaProblem(gamma=5.0, up=(0.0, -1.0), end=(0.6, 0.0)),
    "pinned-pinned": ElasticaProblem(start_angle=None, curvature=(1.0, 1.0), end=(0.5, 0.2)),
    "sliding, dead force": ElasticaProblem(
        start_angle=None, end=(1.0, 0.0), slide=(1.0, 0.0), force=(-12.0, 0.0), curvature=(0.3, 0.1)
    ),
    "clamped-free, weight, tip load": ElasticaProblem(
        gamma=10.0, curvature=(3.0, 1.0), force=(1.0, -4.0), start_angle=0.5
    ),
}


@cache
def held(name: str) -> ElasticaResult:
    """One of `HELD`, solved once."""
    return solve(HELD[name], 80, degree=4, estimate_error=False)


@pytest.mark.parametrize("name", HELD)
def test_every_kind_of_end_agrees_with_collocation(name):
    """Shape, forces and couples at both ends; the collocation's own tolerance is 1e-10."""
    problem, result = HELD[name], held(name)
    assert result.status is ElasticaStatus.CONVERGED, result.message
    guess, reaction = near(result)
    other = collocation(problem, guess, reaction)
    s = np.linspace(0.0, 1.0, 101)
    theta, moment, x, y = other.sol(s)
    assert np.max(np.abs(result.angle(s) - theta)) < 1e-9
    assert np.max(np.abs(result.position(s) - np.column_stack([x, y]))) < 1e-10
    assert result.forces.start_moment == pytest.approx(-moment[0], abs=1e-7)
    assert result.forces.end_moment == pytest.approx(moment[-1], abs=1e-7)
    if len(problem.normals):
        push = np.asarray(result.forces.end) - problem.force
        assert problem.normals @ push == pytest.approx(other.p, abs=1e-7)


@pytest.mark.parametrize("name", HELD)
def test_forces_and_couples_balance(name):
    """On the whole strip: forces, and moments about the start with the weight's by quadrature."""
    problem, result = HELD[name], held(name)
    f = result.forces
    assert np.add(f.start, f.end) == pytest.approx(problem.weight, abs=1e-10)
    points, weights = np.polynomial.legendre.leggauss(40)
    middle = 0.5 * weights @ result.position(0.5 * (points + 1.0))
    weight = -np.asarray(problem.weight)
    x, y = result.end
    total = f.start_moment + f.end_moment + x * f.end[1] - y * f.end[0] + middle[0] * weight[1] - middle[1] * weight[0]
    assert total == pytest.approx(0.0, abs=1e-7)


def test_the_ends_force_is_the_derivative_of_the_energy():
    """Clamped-clamped: moving the held end by de costs <end force, de>."""
    problem = HELD["clamped-clamped, weight, curvature"]
    force = solve(problem, 40, degree=4, estimate_error=False).forces.end
    for axis in (0, 1):
        totals = []
        for sign in (1.0, -1.0):
            end = list(problem.end)
            end[axis] += sign * 1e-3
            totals.append(solve(replace(problem, end=tuple(end)), 40, 4, estimate_error=False).energy.total)
        assert (totals[0] - totals[1]) / 2e-3 == pytest.approx(force[axis], rel=1e-4)


@pytest.mark.parametrize("alpha", [0.2, *(pytest.param(x, marks=pytest.mark.validate) for x in (0.8, 1.6)), 2.2])
def test_post_buckled_struts_are_elliptic_integrals(alpha):
    """Load against shortening of three struts, and tip angle against load of the clamped-free one."""
    load, x, y = closed.buckled_cantilever(alpha)
    free = solve(ElasticaProblem(force=(-load, 0.0)), 30, 4, ALWAYS, estimate_error=False)
    assert free.status is ElasticaStatus.CONVERGED
    assert free.switches == 1
    assert abs(free.theta[-1]) == pytest.approx(alpha, abs=1e-8)
    assert free.end[0] == pytest.approx(x, abs=1e-8)
    assert abs(free.end[1]) == pytest.approx(y, abs=1e-8)
    load, reach = closed.buckled_pinned(alpha)
    pinned = solve(ElasticaProblem(start_angle=None, end=(reach, 0.0)), 30, 4, estimate_error=False)
    assert -pinned.forces.end[0] == pytest.approx(load, rel=1e-7)
    assert abs(pinned.theta[0]) == pytest.approx(alpha, abs=1e-8)
    load, reach = closed.buckled_clamped(alpha)
    clamped = solve(ElasticaProblem(end_angle=0.0, end=(reach, 0.0)), 30, 4, estimate_error=False)
    assert -clamped.forces.end[0] == pytest.approx(load, rel=1e-6)
    assert np.max(np.abs(clamped.angle(np.linspace(0, 1, 201)))) == pytest.approx(alpha, abs=1e-4)


@pytest.mark.parametrize("tip", [0.1, 0.7, 1.3])
def test_cantilever_with_a_transverse_load_is_an_elliptic_integral(tip):
    load, x, drop = closed.transverse_cantilever(tip)
    result = solve(ElasticaProblem(force=(0.0, -load)), 30, 4, estimate_error=False)
    assert result.end == pytest.approx((x, -drop), abs=1e-10)
    assert result.theta[-1] == pytest.approx(-tip, abs=1e-10)


def test_bow_chooses_the_side():
    problem = ElasticaProblem(end_angle=0.0, end=(0.7, 0.0))
    up = solve(problem, 20, 3, ElasticaOptions(bow=2.0), estimate_error=False)
    down = solve(problem, 20, 3, ElasticaOptions(bow=-2.0), estimate_error=False)
    assert up.middle[1] == pytest.approx(-down.middle[1], abs=1e-9)
    assert abs(up.middle[1]) > 0.3
    strut = ElasticaProblem(end_angle=0.0, end=(1.0, 0.0), slide=(1.0, 0.0), force=(-50.0, 0.0))
    sides = [solve(strut, 20, 3, ElasticaOptions(bow=bow)) for bow in (2.0, -2.0)]
    assert sides[0].middle[1] * sides[1].middle[1] < -0.01
    assert all(side.error < 1e-5 for side in sides)  # halved elements go to the same side


def test_full_circle_has_no_force():
    """Closed with both tangents along x: the circle, moment 2 pi, no force; a stable equilibrium."""
    result = solve(ElasticaProblem(end_angle=2.0 * math.pi, end=(0.0, 0.0)), 20, 3)
    assert result.status is ElasticaStatus.CONVERGED
    assert result.forces.end == pytest.approx((0.0, 0.0), abs=1e-9)
    assert result.forces.end_moment == pytest.approx(2.0 * math.pi, rel=1e-10)
    assert result.energy.bending == pytest.approx(2.0 * math.pi**2, rel=1e-12)


def test_a_strut_below_its_load_stays_straight_and_above_it_says_what_it_did():
    base = ElasticaProblem(start_angle=None, end=(1.0, 0.0), slide=(1.0, 0.0))
    below = solve(replace(base, force=(-9.0, 0.0)), 20, 3)
    assert below.status is ElasticaStatus.CONVERGED
    assert below.end[0] == pytest.approx(1.0, abs=1e-12)
    assert below.lowest_eigenvalue == pytest.approx(math.pi**2 - 9.0, rel=1e-6)
    above = solve(replace(base, force=(-12.0, 0.0)), 20, 3)
    assert above.status is ElasticaStatus.CONVERGED
    assert "branch" in above.message
    stays = solve(replace(base, force=(-12.0, 0.0)), 20, 3, ElasticaOptions(switch=False))
    assert stays.status is ElasticaStatus.UNSTABLE
    assert not stays.stable
    assert stays.lowest_eigenvalue == pytest.approx(math.pi**2 - 12.0, rel=1e-6)


def test_a_limit_point_stops_load_steps_which_offer_arc_length_and_arc_length_passes_it():
    """Several turns under weight fold; past the fold the state agrees with collocation at full load."""
    problem = ElasticaProblem(gamma=100.0, curvature=(-10.0, -10.0))
    stopped = solve(problem, 40, 3, NEVER)
    assert stopped.status is ElasticaStatus.LIMIT_POINT
    assert 0.5 < stopped.load_factor < 1.0
    assert "arc length" in stopped.message
    assert "always" in stopped.message
    assert stopped.error is None
    passed = solve(problem, 80, 4, ALWAYS, estimate_error=False)
    assert passed.status is ElasticaStatus.CONVERGED
    assert passed.limits >= 1
    assert passed.snaps == 0
    guess, _ = near(passed)
    s = np.linspace(0.0, 1.0, 101)
    assert np.max(np.abs(passed.angle(s) - collocation(problem, guess, points=201).sol(s)[0])) < 1e-9


def raised_end(gamma: float, height: float) -> tuple[System, Branch]:
    """Both clamps along x, the strip bent upwards, the far one raised from 0 to `height`: the path and its system."""
    low = ElasticaProblem(gamma=gamma, end_angle=0.0, end=(0.7, 0.0))
    start = solve(low, np.linspace(0.0, 1.0, 25), 4, ElasticaOptions(bow=-2.0), estimate_error=False)
    assert start.middle[1] > 0.3
    system = System(start.nodes, 4, LoadPath(low, replace(low, end=(0.7, height))))
    theta = system.discrete.projected(start.angle(system.discrete.s.ravel()).reshape(system.discrete.s.shape))
    first = point_at(system, np.concatenate([theta, start.forces.end]), 0.0)
    return system, trace(system, first, 1.0, (-1.0, 1.0))


def test_limit_points_in_end_displacement_and_states_past_them():
    """The raised arch snaps down under its weight; the path turns back there, unstable, as collocation confirms."""
    height = 0.6
    system, branch = raised_end(20.0, height)
    folds = [event.point.t * height for event in branch.limits()]
    assert branch.ended == "closed"  # down and up again with the mirror image
    assert len(folds) == 4
    assert sorted(folds) == pytest.approx([-0.552438, -0.427316, 0.427316, 0.552438], abs=2e-6)
    # at the folds that end a stable part the lowest eigenvalue is zero, and rounding alone gives its sign: neither; at
    # the others the second one is, and the state is unstable
    assert {round(abs(e.point.t) * height, 3): e.point.stable for e in branch.limits()} == {0.427: None, 0.552: False}
    past = next(p for p in branch.points[1:] if p.stable is False)
    assert past.t * height < folds[0]
    problem = system.way.at(past.t)
    s = np.linspace(0.0, 1.0, 301)
    theta = system.discrete.angle(past.z[: system.count], s)
    place = system.discrete.position(past.z[: system.count], s).T
    guess = np.vstack([theta, np.gradient(theta, s), place])
    other = collocation(problem, lambda x: np.array([np.interp(x, s, row) for row in guess]), past.z[system.count :])
    assert np.max(np.abs(other.sol(s)[0] - theta)) < 1e-6


def critical(ends: str, options: ElasticaOptions) -> ElasticaResult:
    """The straight strut under the buckling load of its own elements: its tangent is singular."""
    load = float(buckling_modes(20, 3, 1, ends).loads[0])
    return solve(strut(ends, load), np.linspace(0.0, 1.0, 21), 3, options, estimate_error=False)


@pytest.mark.parametrize(
    ("ends", "options"),
    [
        ("clamped-free", ElasticaOptions()),
        ("clamped-free", ALWAYS),
        ("clamped-free", NEVER),
        ("pinned-pinned", ElasticaOptions(switch=False)),
        ("clamped-pinned", ElasticaOptions()),
    ],
)
@pytest.mark.parametrize("noise", [0.0, 0.5, -0.5])
def test_at_its_buckling_load_a_strut_is_neither_stable_nor_unstable(monkeypatch, ends, options, noise):
    """Whatever the rounding of the eigenvalues: `noise` of its bound is added to them."""
    pairs, lowest = System.eigenpairs, Discretisation.lowest_eigenvalue

    def noisy_pairs(self, z, t, *rest):
        values, modes = pairs(self, z, t, *rest)
        return values + noise * self.rounding(z, t), modes

    monkeypatch.setattr(System, "eigenpairs", noisy_pairs)
    monkeypatch.setattr(
        Discretisation,
        "lowest_eigenvalue",
        lambda self, z, loads: lowest(self, z, loads) + noise * self.rounding(z, loads),
    )
    result = critical(ends, options)
    assert (result.status, result.stable) == (ElasticaStatus.CONVERGED, None), result.message
    assert abs(result.lowest_eigenvalue) <= result.rounding < 1e-8
    assert result.load_factor == 1.0
    assert "fold" in result.message
    assert result.end == pytest.approx((1.0, 0.0), abs=1e-9)


@pytest.mark.parametrize(
    ("nodes", "degree", "hermite"), [(12, 3, False), (40, 4, False), (90, 4, False), (30, 3, True)]
)
def test_the_bound_of_rounding_holds_for_states_rounded_anew(nodes, degree, hermite):
    """Eigenvalues of a state, of it with every number changed by eps or less, dense and sparse; none far below it."""
    eps, rng = np.finfo(float).eps, np.random.default_rng(0)
    problem = ElasticaProblem(gamma=100.0, curvature=(3.0, 1.0), force=(1.0, -4.0), start_angle=0.5)
    joints = np.linspace(0.0, 1.0, nodes + 1)
    system = System(joints, degree, LoadPath(problem, problem), hermite)
    z = solve(problem, joints, degree, estimate_error=False, hermite=hermite)._coefficients
    loads, bound = system.loads(z, 1.0), system.rounding(z, 1.0)
    free = system.discrete.free
    below = -system.discrete.highest_pull(z, loads) - 1.0
    values = [system.discrete.lowest_eigenvalue(z, loads)]
    for _ in range(3):
        near = z * (1.0 + eps * rng.uniform(-1.0, 1.0, z.shape))
        matrices = system.discrete.tangent(near, loads), system.discrete.mass, np.zeros((0, len(free)))
        values += [dense_pairs(*matrices, 1)[0][0], sparse_pairs(*matrices, 1, below)[0][0]]
    assert np.ptp(values) < bound
    tangent, mass = system.discrete.tangent(z, loads).toarray(), system.discrete.mass.toarray()
    highest = scipy.linalg.eigvalsh(tangent, mass)[-1]
    assert 0.4 * bound < ROUNDING * eps * highest < bound  # the highest of the elements bounds it, and not by far


@pytest.mark.parametrize("calls", [1, 2, 5, 10**6])
@pytest.mark.parametrize("way", ["auto", "always", "never", "along", "held"])
def test_a_singular_matrix_is_a_status(monkeypatch, way, calls):
    """The first solutions, or all of them, do not come: another step is tried, then it is said where the way ends."""
    left = calls

    def singular(matrix, rhs, original=solve_sparse):
        nonlocal left
        left -= 1
        return None if left >= 0 else original(matrix, rhs)

    for module in (elastica_system, elastica_path, elastica_arc):
        monkeypatch.setattr(module, "solve_sparse", singular)
    problem = HELD["clamped-clamped, straight"] if way == "held" else ElasticaProblem(gamma=10.0, curvature=(2.0, 1.0))
    if way == "along":
        problems = [replace(problem, gamma=0.0), replace(problem, gamma=5.0), problem]
        result = solve_along(problems, 10, estimate_error=False)
    else:
        options = ElasticaOptions() if way == "held" else ElasticaOptions(arc_length=way)
        result = solve(problem, 10, 3, options, estimate_error=False)
    assert left < calls
    assert np.all(np.isfinite(result.theta))
    if result.status is ElasticaStatus.CONVERGED:
        assert calls < 10**6
        assert (result.load_factor, result.stable) == (1.0, True)
    else:
        assert result.status in (ElasticaStatus.NOT_CONVERGED, ElasticaStatus.LIMIT_POINT)
        assert result.load_factor < 1.0
        assert result.message


@pytest.mark.parametrize("gamma", [200.0])
def test_an_arch_that_its_weight_pushes_through(gamma):
    """Clamped-clamped, bent upwards: plain steps stop at the limit point, arc length arrives hanging and stable."""
    arch = ElasticaProblem(gamma=gamma, end_angle=0.0, end=(0.7, 0.0))
    stopped = solve(arch, 20, 3, ElasticaOptions(arc_length="never", bow=-2.0), estimate_error=False)
    assert stopped.status is ElasticaStatus.LIMIT_POINT
    assert "arc length" in stopped.message
    assert 0.1 < stopped.load_factor < 1.0
    passed = solve(arch, 20, 3, ElasticaOptions(bow=-2.0), estimate_error=False)
    assert passed.status is ElasticaStatus.CONVERGED, passed.message
    assert passed.limits >= 1
    hanging = solve(arch, 20, 3, ElasticaOptions(bow=2.0), estimate_error=False)
    assert hanging.middle[1] < -0.3
    assert passed.middle == pytest.approx(hanging.middle, abs=1e-6)


def test_a_branch_passes_the_pitchfork_it_comes_from():
    """Weightless, the raised arch meets its mirror image and the S in a pitchfork; the path goes on beyond it."""
    _, branch = raised_end(0.0, 0.6)
    assert branch.ended == "closed"
    assert sorted(event.point.t * 0.6 for event in branch.limits()) == pytest.approx([-0.551586, 0.551586], abs=2e-6)
    assert all(point.eigenvalues[0] > -1e-6 for point in branch.points)
    assert all(abs(event.point.eigenvalues[0]) < 1e-6 for event in branch.limits())


@pytest.mark.parametrize("hermite", [False, True])
@pytest.mark.parametrize("problem", HELD.values(), ids=HELD)
def test_jacobian_and_rate_are_derivatives(problem, hermite):
    """Central differences of G with two steps: the difference falls by four with the step; G is affine in t."""
    if problem.end is None:
        return
    system = System(np.linspace(0.0, 1.0, 7) ** 1.3, 3, path_to(problem), hermite)
    rng = np.random.default_rng(0)
    z = natural_state(system) + 0.3 * rng.normal(size=system.size)
    v = rng.normal(size=system.size)
    exact = system.jacobian(z, 0.4) @ v
    errors = []
    for step in (1e-2, 5e-3):
        change = system.residual(z + step * v, 0.4) - system.residual(z - step * v, 0.4)
        errors.append(np.linalg.norm(change / (2.0 * step) - exact))
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.3)
    halves = system.residual(z, 0.9) - system.residual(z, 0.4)
    np.testing.assert_allclose(halves, 0.5 * system.rate(z), atol=1e-10)


def test_dense_and_sparse_eigenvalues_agree():
    problem = HELD["clamped-clamped, weight, curvature"]
    for nodes, degree in ((np.linspace(0, 1, 61), 4), (np.linspace(0, 1, 81), 4)):
        system = System(nodes, degree, LoadPath(problem, problem))
        theta = system.discrete.projected(np.sin(2 * np.pi * system.discrete.s))
        z = np.concatenate([theta, [-40.0, 1.0]])
        values, modes = system.eigenpairs(z, 1.0)
        assert values.shape == (3,)
        assert np.max(np.abs(system.holding(z) @ modes[: system.count])) < 1e-9
        if degree == 4 and len(nodes) == 61:
            dense = values
    assert values == pytest.approx(dense, rel=1e-6)


def test_angles_at_points_do_not_depend_on_the_points_asked_before():
    """scikit-fem's hierarchical element keeps the shape functions of its last points by their number."""
    for degree in (3, 4):
        result = solve(ElasticaProblem(gamma=25.0, curvature=(4.0, -3.0)), 6, degree, estimate_error=False)
        alone = [float(result.angle([s])[0]) for s in (0.3, 0.4, 0.7)]
        assert result.angle([0.3, 0.4, 0.7]) == pytest.approx(alone, abs=1e-14)
        assert len(set(alone)) == 3


def test_suitable_bow_turns_as_the_end_asks():
    assert suitable_bow(ElasticaProblem(end_angle=0.0, end=(0.5, 0.0))) == 2.0
    assert suitable_bow(ElasticaProblem(start_angle=1.0, end_angle=-1.0, end=(0.8, 0.0))) == -2.0
    assert suitable_bow(ElasticaProblem(end_angle=9.0, end=(0.0, 0.1))) == 6.0
    assert suitable_bow(ElasticaProblem(end=(0.0, -0.5))) == pytest.approx(-math.pi)


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: ElasticaProblem(start_angle=None), "start_angle = None"),
        (lambda: ElasticaProblem(slide=(1.0, 0.0)), "slide = (1.0, 0.0)"),
        (lambda: ElasticaProblem(end=(0.5, 0.0), slide=(1.0, 1.0)), "slide = (1.0, 1.0)"),
        (lambda: ElasticaProblem(end=(0.5,)), "end = (0.5,)"),
        (lambda: ElasticaProblem(end_angle=math.inf), "end_angle = inf"),
        (lambda: solve(ElasticaProblem(end=(0.8, 0.8)), 10), "end = (0.8, 0.8)"),
        (lambda: solve(ElasticaProblem(end=(1.0, 0.0)), 10), "taut"),
        (lambda: solve(ElasticaProblem(end=(0.0, 2.0), slide=(1.0, 0.0)), 10), "end = (0.0, 2.0)"),
        (lambda: solve(ElasticaProblem(), 10, degree=2, hermite=True), "Hermite"),
        (lambda: ElasticaOptions(arc_length="sometimes"), "arc_length = 'sometimes'"),
        (lambda: ElasticaOptions(bow=0.0), "bow = 0.0"),
        (lambda: LoadPath(ElasticaProblem(), ElasticaProblem(end=(0.5, 0.0))), "end = None"),
        (
            lambda: LoadPath(
                ElasticaProblem(end=(0.5, 0.0), slide=(1.0, 0.0)), ElasticaProblem(end=(0.5, 0.0), slide=(0.0, 1.0))
            ),
            "slide",
        ),
    ],
)
def test_bad_input_is_named(call, word):
    with pytest.raises(ValueError) as caught:
        call()
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)
