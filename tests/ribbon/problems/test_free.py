"""Strips with a free twist: derivatives, chained and glued alike, symmetries, supports, and limits of the energies."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.spatial.transform import Rotation

from ribbon import Clamp, Closure, Gravity, RibbonInputError, Strip, Wall, solve
from ribbon.problems.mixed import MixedProblem

HALF = 2.0**-0.5
ENERGIES = ("kirchhoff", "sadowsky_kt", "sano", "extensible", "finite")
STRIP = Strip(1.0, 0.05, 0.3, natural_curvature=(6.0, 4.0), gamma=60.0, thickness=5e-4)
UP = np.array([1.0, 0.0, 0.0])
S = np.linspace(0.0, 1.0, 33)


def clamp(energy, **changes):
    """A clamp that holds the whole edge where the energy knows of one."""
    given = {"position": (0.0, 0.0, 0.0), "tangent": (0.0, 0.0, 1.0), "normal": (-HALF, HALF, 0.0)}
    return Clamp(**{**given, "ruling": "straight" if energy == "finite" else "free", **changes})


def hung(energy, strip=STRIP, **changes):
    arguments = {"clamp": clamp(energy), "gravity": Gravity(tuple(UP)), "segments": 12, **changes}
    found = solve(strip, energy=energy, **arguments)
    assert found.ok, found.message
    return found


CASES = {
    "weight": {},
    "rod": {"energy": "kirchhoff", "stiffness": "plate"},
    "without thickness": {"energy": "sadowsky_kt", "in_plane": False},
    "two clamps by rows, wall and plate": {
        "end": clamp("finite", position=(0.1, 0.2, 0.3)),
        "held_by": "constraints",
        "walls": (Wall((0, 0, 0.1), (0, 1.0, 0)), Wall((0, 0, 0.1), (0, 0.6, 0.8), stiffness=7.0)),
    },
    "moebius": {"start": None, "closure": Closure("moebius"), "gravity": None},
    **{f"curvature passes zero, {energy}": {"energy": energy} for energy in ("finite", "extensible", "sano")},
}


@pytest.mark.parametrize("case", CASES)
def test_gradient_jacobian_and_hessian_leave_errors_of_their_order(case):
    """Two-sided Taylor orders at points that satisfy nothing, kappa_2 a field where the energy allows; where the
    rule's panels follow the state too."""
    given = {
        "strip": STRIP, "start": clamp("finite"), "end": None, "closure": None, "walls": (),
        "gravity": Gravity((0, 0.6, 0.8)), "energy": "finite", "lengths": np.array([0.3, 0.5, 0.2]), "in_plane": True,
    }  # fmt: skip
    p = MixedProblem(**{**given, **CASES[case]})
    rng = np.random.default_rng(3)
    k, t, c = rng.normal(size=(3, p.lengths.size + 1)) * np.array([[4.0], [2.0], [0.3]])
    bent = 3.0 * k if "passes zero" in case else k + 6.0
    if p.energy == "sadowsky_kt":  # infinite where the curvature passes zero
        bent = 1.0 + np.abs(bent)
    x = p.state(bent, t, c) + 0.05 * rng.normal(size=p.size)
    rows = rng.normal(size=p.constraint_bounds()[0].size)
    gradient, jacobian = p.gradient(x).copy(), p.jacobian_matrix(x).toarray()
    hessian = p.hessian_matrix(x, rows).toarray()
    slope = gradient + jacobian.T @ rows
    assert np.abs(hessian - hessian.T).max() <= 1e-12 * np.abs(hessian).max()
    d = rng.normal(size=p.size)

    def misses(h):
        y = x + h * d
        value = p.value(y) - p.value(x) - h * gradient @ d
        held = p.constraints(y) - p.constraints(x) - h * jacobian @ d
        change = p.gradient(y) + p.jacobian_matrix(y).T @ rows - slope - h * hessian @ d
        return np.array([abs(value), np.linalg.norm(held), np.linalg.norm(change)])

    far, near = misses(2e-4), misses(1e-4)
    kept = [True, rows.size > 0, True]
    assert np.log2(far[kept] / near[kept]) == pytest.approx(np.full(sum(kept), 2.0), abs=0.1)


@pytest.mark.parametrize("in_plane", [False, True])
@pytest.mark.parametrize("energy", ENERGIES)
def test_chained_and_glued_are_one_strip(energy, in_plane):
    one, other = (hung(energy, in_plane=in_plane, formulation=name) for name in ("chained", "mixed"))
    assert one.problem.fields.count == (3 if in_plane else 2)
    assert other.energy.total == pytest.approx(one.energy.total, rel=1e-10)
    assert np.abs(other.position(S) - one.position(S)).max() < 1e-8
    assert other.lowest_eigenvalue == pytest.approx(one.lowest_eigenvalue, rel=1e-5)
    # the clamp carries the weight, and its moment about the clamp
    assert one.start.force == pytest.approx(STRIP.gamma * UP, abs=1e-7)
    assert other.start.force == pytest.approx(STRIP.gamma * UP, abs=1e-6)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    s = ((np.arange(12)[:, None] + 0.5 * (nodes + 1.0)) / 12).ravel()
    centre = np.tile(weights / 24.0, 12) @ one.position(s)
    for found in (one, other):
        assert found.start.moment == pytest.approx(np.cross(centre, STRIP.gamma * UP), abs=1e-5)


@pytest.mark.parametrize("energy", ["kirchhoff", "finite"])
def test_turned_mirrored_and_reversed_strips_are_the_same(energy):
    own = hung(energy, formulation="mixed")
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    away = np.array([0.2, -0.1, 0.4])
    mirror = np.diag([1.0, 1.0, -1.0]) @ turn
    for q in (turn, mirror):
        held = clamp(
            energy, position=tuple(away), tangent=tuple(q @ [0.0, 0.0, 1.0]), normal=tuple(q @ [-HALF, HALF, 0.0])
        )
        moved = hung(energy, clamp=held, gravity=Gravity(tuple(q @ UP)), formulation="mixed")
        assert moved.energy.elastic == pytest.approx(own.energy.elastic, rel=1e-9)
        assert np.abs(moved.position(S) - (away + own.position(S) @ q.T)).max() < 1e-8
        assert moved.tau(S) == pytest.approx(np.linalg.det(q) * own.tau(S), abs=1e-5)
    held = clamp(energy, tangent=(0.0, 0.0, -1.0))
    law = STRIP.natural_curvature[::-1]
    strip = Strip(1.0, 0.05, 0.3, natural_curvature=law, gamma=60.0, thickness=5e-4)
    back = hung(energy, strip, clamp=Clamp(None, None, None), end=held, formulation="mixed")
    assert back.energy.total == pytest.approx(own.energy.total, rel=1e-9)
    assert np.abs(back.position(S)[::-1] - own.position(S)).max() < 1e-7
    assert back.end_support.force == pytest.approx(own.start.force, abs=1e-5)


@pytest.mark.parametrize("name", ["sadowsky", "wunderlich"])
def test_a_developable_strip_does_not_bend_in_its_plane(name):
    with pytest.raises(RibbonInputError) as refused:
        solve(STRIP, clamp(name), energy=name, in_plane=True)
    assert refused.value.key == "in_plane"


def apart(one, other):
    return np.abs(one.position(S) - other.position(S)).max()


def test_extensible_tends_to_sadowsky_as_the_strip_gets_thin():
    """The layers along the edges are as wide as sqrt(h): so is what is left of them in the shape."""

    def strip(thickness):
        return Strip(1.0, 0.03, 0.4, natural_curvature=10.0, gamma=20.0, thickness=thickness)

    limit = hung("sadowsky_kt", strip(1e-3))
    left = [apart(hung("extensible", strip(0.03 * h)), limit) for h in (1e-5, 1e-5 / 16.0, 1e-5 / 256.0)]
    assert left[-1] < 1e-3
    orders = np.log(np.array(left[:-1]) / left[1:]) / np.log(16.0)
    assert orders == pytest.approx([0.5, 0.5], abs=0.1)


def test_extensible_tends_to_the_rod_as_the_strip_gets_narrow():
    """w/h = 10: 1 - q is the torsion constant of that rectangle to 2e-4."""

    def strip(width):
        return Strip(1.0, width, 0.4, natural_curvature=10.0, gamma=20.0, thickness=0.1 * width)

    left = []
    for width in (4e-2, 2e-2, 1e-3):
        rod = hung("kirchhoff", strip(width), stiffness="plate", in_plane=False)
        left.append(apart(hung("extensible", strip(width), in_plane=False), rod))
    assert left[-1] < 2e-4
    assert 3.0 < left[0] / left[1] < 5.0  # w^4 k^2 / h^2: the square of the width


def test_a_planar_strip_without_poissons_ratio_is_the_elastica():
    """theta'' = Gamma (1 - s) cos theta, theta(0) = 0, theta'(1) = -K: solved by collocation."""
    gamma, natural = 30.0, 3.0

    def rate(s, y):
        return np.stack([y[1], gamma * (1.0 - s) * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    def ends(a, b):
        return np.array([a[0], a[2], a[3], b[1] + natural])

    mesh = np.linspace(0.0, 1.0, 200)
    exact = solve_bvp(rate, ends, mesh, np.zeros((4, mesh.size)), tol=1e-10, max_nodes=20000)
    assert exact.success
    for energy in ("finite", "extensible"):
        strip = Strip(1.0, 0.05, 0.0, natural_curvature=natural, gamma=gamma, thickness=5e-4)
        held = clamp(energy, normal=(0.0, 1.0, 0.0))
        left = []
        for segments in (10, 20):
            found = hung(energy, strip, clamp=held, gravity=Gravity((0.0, 1.0, 0.0)), segments=segments)
            line = np.stack([np.zeros_like(S), exact.sol(S)[3], exact.sol(S)[2]], axis=1)
            left.append(np.abs(found.position(S) - line).max())
        assert left[1] < 3e-6
        assert 3.0 < np.log2(left[0] / left[1]) < 5.0
