"""The glued problem: derivatives, agreement with the chained model, statuses, forces and stability."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Closure, Gravity, RibbonInputError, Status, Strip, Wall, refine, solve
from ribbon.find.relax import transferred
from ribbon.find.solve import build
from ribbon.problems.mixed import MixedProblem

SLANTED = 2.0**-0.5
CURL = Clamp((0, 0, 0), (0, 0, 1), (-SLANTED, SLANTED, 0), ruling="free")


def problem(**changes):
    """A problem with every term on, and its pieces replaced."""
    arguments = {
        "strip": Strip(1.0, 0.1, 0.4, natural_curvature=(3.0, 5.0), gamma=20.0),
        "start": Clamp(ruling="free"),
        "end": None,
        "closure": None,
        "walls": (),
        "gravity": Gravity((0, 0, 1.0)),
        "energy": "wunderlich",
        "lengths": np.array([0.3, 0.5, 0.2]),
    }
    return MixedProblem(**{**arguments, **changes})


CASES = {
    "gravity": {},
    "weightless": {"gravity": None},
    "sadowsky": {"energy": "sadowsky"},
    "exact weight": {
        "gravity": Gravity((0, 0.6, 0.8), exact=True),
        "end": Clamp((0, 0, 0.5), None, None, ruling="free"),
    },
    "two clamps by rows, wall and plate": {
        "end": Clamp((0.1, 0.2, 0.3), ruling="free"),
        "held_by": "constraints",
        "walls": (Wall((0, 0, 0.1), (0, 1.0, 0)), Wall((0, 0, 0.1), (0, 0.6, 0.8), stiffness=7.0)),
    },
    "moebius": {"start": None, "closure": Closure("moebius"), "gravity": None},
    "circle on a wall": {"start": None, "closure": Closure("circle"), "walls": (Wall((0, 0, 0.1), (0, 0, 1.0)),)},
    "one segment": {"lengths": np.ones(1)},
}


@pytest.mark.parametrize("case", CASES)
def test_derivatives_agree_with_differences_at_points_that_satisfy_nothing(case):
    p = problem(**CASES[case])
    rng = np.random.default_rng(3)
    joints = p.lengths.size + 1
    x = p.state(3.0 * rng.normal(size=joints), 0.3 * rng.normal(size=joints)) + 0.05 * rng.normal(size=p.size)
    multipliers = rng.normal(size=p.constraint_bounds()[0].size)
    gradient = p.gradient(x).copy()
    jacobian = p.jacobian_matrix(x).toarray()
    hessian = p.hessian_matrix(x, multipliers).toarray()

    def lagrangian_slope(y):
        return p.gradient(y) + p.jacobian_matrix(y).T @ multipliers

    step = 1e-4

    def difference(function, k):
        """Central difference of fourth order."""
        d = np.zeros(p.size)
        d[k] = step
        near = (function(x + d) - function(x - d)) / (2.0 * step)
        far = (function(x + 2 * d) - function(x - 2 * d)) / (4.0 * step)
        return (4.0 * near - far) / 3.0

    for k in range(p.size):
        assert difference(p.value, k) == pytest.approx(gradient[k], rel=1e-8, abs=1e-8)
        assert difference(p.constraints, k) == pytest.approx(jacobian[:, k], rel=1e-8, abs=1e-8)
        assert difference(lagrangian_slope, k) == pytest.approx(hessian[:, k], rel=1e-7, abs=1e-7)


@pytest.mark.parametrize("energy", ["sadowsky", "wunderlich"])
def test_mixed_and_chained_are_the_same_ribbon(energy):
    strip = Strip(1.0, 0.03, 0.4, natural_curvature=10.0, gamma=100.0)
    one, other = (
        solve(strip, CURL, Gravity((1, 0, 0)), energy=energy, segments=12, formulation=formulation)
        for formulation in ("chained", "mixed")
    )
    assert one.ok
    assert other.ok
    assert other.problem.formulation == "mixed"
    assert other.energy.total == pytest.approx(one.energy.total, rel=1e-11)
    assert other.end.position == pytest.approx(one.end.position, abs=1e-9)
    assert other.lowest_eigenvalue == pytest.approx(one.lowest_eigenvalue, rel=1e-6)
    assert other.start.force == pytest.approx(one.start.force, abs=1e-7)
    assert other.start.moment == pytest.approx(one.start.moment, abs=1e-6)


def test_rows_and_elimination_hold_the_start_alike():
    strip = Strip(1.0, 0.05, 0.5, gamma=10.0)
    end = Clamp((0.0, 0.1, 0.6), (0, 0, 1), (0, 1, 0), ruling="free")
    found = [
        solve(strip, Clamp(ruling="free"), Gravity((0, 1, 0)), end=end, segments=12, held_by=by)
        for by in ("elimination", "constraints")
    ]
    assert all(e.ok for e in found)
    assert found[0].energy.total == pytest.approx(found[1].energy.total, rel=1e-10)
    assert found[0].start.force == pytest.approx(found[1].start.force, abs=1e-6)
    assert found[0].start.moment == pytest.approx(found[1].start.moment, abs=1e-6)


def test_forces_and_moments_balance_between_two_clamps():
    strip = Strip(1.0, 0.05, 0.5, gamma=10.0)
    end = Clamp((0.1, 0.2, 0.7), (0, 0.6, 0.8), (0, 0.8, -0.6), ruling="free")
    e = solve(strip, Clamp(ruling="free"), Gravity((0, 1, 0)), end=end, segments=16)
    assert e.ok
    assert e.start.force + e.end_support.force == pytest.approx([0, 10.0, 0], abs=1e-7)
    nodes, weights = np.polynomial.legendre.leggauss(6)
    s = ((np.arange(16)[:, None] + 0.5 * (nodes + 1.0)) / 16).ravel()
    mean = np.tile(weights / 32.0, 16) @ e.position(s)
    moments = e.start.moment + e.end_support.moment + np.cross(e.end.position, e.end_support.force)
    assert moments == pytest.approx(np.cross(mean, [0, 10.0, 0]), abs=1e-7)


def test_a_multiplier_is_the_derivative_of_the_energy_by_the_place_of_the_clamp():
    strip = Strip(1.0, 0.05, 0.5, gamma=5.0)

    def energy(shift):
        end = Clamp((0.0, 0.1 + shift, 0.7), (0, 0, 1), (0, 1, 0), ruling="free")
        e = solve(strip, Clamp(ruling="free"), Gravity((0, 1, 0)), end=end, segments=12, seed_curvature=(-3, 3, 3, -3))
        assert e.ok
        return e

    step = 1e-3
    near = (energy(step).energy.total - energy(-step).energy.total) / (2 * step)
    far = (energy(2 * step).energy.total - energy(-2 * step).energy.total) / (4 * step)
    assert (4 * near - far) / 3 == pytest.approx(energy(0.0).end_support.force[1], rel=1e-6)


def test_a_moebius_band_needs_its_kind_only_and_has_the_known_energy():
    e = solve(Strip(1.0, 1.0 / 30.0, 0.5), closure=Closure("moebius"), segments=60)
    assert e.ok
    assert e.energy.total / np.pi**2 == pytest.approx(5.93, abs=0.02)  # Starostin and van der Heijden 2007
    assert e.end.position == pytest.approx(e.position([0.0])[0], abs=1e-9)
    assert e.end.frame == pytest.approx(e.frame([0.0])[0] * np.array([-1.0, -1.0, 1.0]), abs=1e-9)
    # symmetric about the event in the middle of the first segment; eta changes its sign beyond the seam
    centre, t = 0.5 / 60, np.linspace(0.05, 0.45, 20)
    assert e.eta(centre + t) == pytest.approx(e.eta(1.0 + centre - t), abs=1e-5)
    assert np.abs(e.omega(centre + t)) == pytest.approx(np.abs(e.omega(1.0 + centre - t)), abs=1e-4)
    assert e.start.force == pytest.approx(np.zeros(3), abs=1e-8)


@pytest.mark.parametrize("width", [0.002, 0.02, 0.3])
def test_moebius_bands_of_all_widths(width):
    e = solve(Strip(1.0, width, 0.5), closure=Closure("moebius"), segments=60)
    assert e.ok
    assert e.residual < 1e-8
    assert e.max_abs_eta_prime_w_half <= 1.0


def test_circles_are_exact():
    for turns in (1, 2):
        e = solve(Strip(1.0, 0.05, 0.5), closure=Closure("circle", turns=turns), segments=9)
        assert e.ok
        assert e.energy.total == pytest.approx(0.5 * (2 * np.pi * turns) ** 2, rel=1e-12)


def test_a_strip_on_edge_is_left_or_called_a_saddle_in_every_formulation():
    strip, clamp, up = (
        Strip(1.0, 0.05, 0.4, gamma=30.0),
        Clamp((0, 0, 0), (0, 0, 1), (1, 0, 0), ruling="free"),
        Gravity((0, 1, 0)),
    )
    left = []
    for formulation in ("chained", "mixed"):
        stuck = solve(strip, clamp, up, formulation=formulation)
        assert stuck.status is Status.SADDLE
        assert stuck.lowest_eigenvalue < -0.1
        left.append(solve(strip, clamp, up, formulation=formulation, leave_saddle=True))
        assert left[-1].ok
    assert left[0].energy.total == pytest.approx(left[1].energy.total, rel=1e-9)
    exact = solve(strip, clamp, Gravity((0, 1, 0), exact=True), leave_saddle=True)
    assert exact.ok
    assert exact.energy.total == pytest.approx(left[0].energy.total, rel=2e-3)


def test_stability_of_many_segments_is_that_of_few():
    strip, clamp, up = (
        Strip(1.0, 0.05, 0.4, gamma=30.0),
        Clamp((0, 0, 0), (0, 0, 1), (1, 0, 0), ruling="free"),
        Gravity((0, 1, 0)),
    )
    many = solve(strip, clamp, up, segments=640, formulation="mixed")
    assert many.status is Status.SADDLE
    assert many.lowest_eigenvalue < -0.1
    curl = Strip(1.0, 0.03, 0.4, natural_curvature=10.0, gamma=100.0)
    few, more = (
        solve(curl, CURL, Gravity((1, 0, 0)), segments=p, formulation=kind)
        for p, kind in ((80, "auto"), (1280, "mixed"))
    )
    assert more.ok
    assert more.lowest_eigenvalue == pytest.approx(few.lowest_eigenvalue, rel=1e-2)
    assert more.energy.total == pytest.approx(few.energy.total, rel=1e-5)


def test_hard_and_impossible_cases_end_in_a_status_that_names_the_cause():
    strip = Strip(1.0, 0.05, 0.4, gamma=100.0)
    up = Gravity((0, 1, 0))
    one = solve(strip, Clamp(ruling="free"), up, end=Clamp((0, 0, 0.9), ruling="free"), segments=1)
    assert one.status is Status.INFEASIBLE
    assert "more segments" in one.message
    room = (Wall((0, -0.2, 0), (0, 1, 0)), Wall((0, -0.3, 0), (0, -1, 0)))
    with pytest.raises(RibbonInputError, match="behind wall 1"):  # known from geometry, before any solve
        solve(strip, Clamp(ruling="free"), up, walls=room, segments=8)
    straight = solve(strip, Clamp(ruling="free"), up, end=Clamp((0, 0, 1.0), ruling="free"), segments=8)
    assert straight.ok
    assert "undetermined" in straight.message
    free = solve(Strip(1.0, 0.05, 0.4), Clamp(None, None, None), segments=4)
    assert free.ok
    assert "indifferent" in free.message  # omega = 0 everywhere: the rulings are not determined
    with pytest.raises(RibbonInputError, match="at most 1"):
        solve(strip, Clamp(ruling="free"), end=Clamp((0, 0, 1.1), ruling="free"))
    with pytest.raises(RibbonInputError, match="three segments"):
        solve(strip, closure=Closure("circle"), segments=2)
    with pytest.raises(RibbonInputError, match="cross inside"):
        solve(strip, Clamp(ruling="free"), end=Clamp((0, 0, 0.9), ruling="free"), seed_ruling=(0.0, 50.0))
    with pytest.raises(RibbonInputError, match="no clamp at its end"):
        solve(strip, closure=Closure("circle"), end=Clamp(ruling="free"))
    with pytest.raises(RibbonInputError, match="contact"):
        solve(strip, Clamp(ruling="free"), up, walls=room, formulation="chained")
    with pytest.raises(RibbonInputError, match="spring"):
        Wall((0, 0, 0), (0, 1, 0), stiffness=0.0)


def test_points_far_out_have_no_value_instead_of_an_endless_series():
    p = problem()
    x = p.state(np.zeros(4), np.zeros(4))
    x[7], x[8] = 1e7, 1e7
    assert np.isnan(p.value(x))
    assert np.isnan(p.constraints(x)).any()
    chained = build(Strip(1.0, 0.1), Clamp(ruling="free"), Gravity(), segments=3, formulation="chained")
    assert np.isnan(chained.value(np.full(8, 1e7)))


def test_refining_keeps_the_branch_and_lowers_the_error():
    strip = Strip(1.0, 0.05, 0.5, gamma=5.0)
    end = Clamp((0.0, 0.1, 0.7), (0, 0, 1), (0, 1, 0), ruling="free")
    coarse = solve(strip, Clamp(ruling="free"), Gravity((0, 1, 0)), end=end, segments=10, seed_curvature=(-3, 3, 3, -3))
    fine = refine(coarse)
    finer = refine(fine)
    assert fine.ok
    assert finer.ok
    first, second = (abs(e.energy.total - finer.energy.total) for e in (coarse, fine))
    assert second < 0.3 * first


def test_other_formulations_are_real_and_report_flipped_frames():
    strip = Strip(1.0, 0.01, 0.5, gamma=1.0)
    end = Clamp((0, 0.05, 0.9), (0, 0.0, 1.0), (0, 1, 0), ruling="free")
    keywords = {"end": end, "segments": 10, "seed_curvature": (-3, 3, 3, -3)}
    mixed, matrix, chained = (
        solve(strip, Clamp(ruling="free"), Gravity((0, 1, 0)), formulation=name, **keywords)
        for name in ("mixed", "matrix", "chained")
    )
    assert mixed.ok
    assert [e.problem.formulation for e in (matrix, chained)] == ["matrix", "chained"]
    assert matrix.energy.total == pytest.approx(mixed.energy.total, rel=1e-9)
    assert chained.energy.total == pytest.approx(mixed.energy.total, rel=1e-9)


def test_a_ruling_that_moves_nothing_does_not_hide_an_instability_between_walls_and_clamps():
    """A straight strip on edge above an untouched wall: the glued check looks for rulings too."""
    clamp, up = Clamp((0, 0, 0), (0, 0, 1), (1, 0, 0), ruling="free"), Gravity((0, 1, 0))
    wall = Wall((0, -2.0, 0), (0, 1, 0))
    light, heavy = (solve(Strip(1.0, 0.05, 0.4, gamma=g), clamp, up, walls=(wall,)) for g in (15.0, 30.0))
    assert light.ok
    assert heavy.status is Status.SADDLE
    left = solve(Strip(1.0, 0.05, 0.4, gamma=30.0), clamp, up, walls=(wall,), leave_saddle=True)
    assert left.ok
    free = solve(Strip(1.0, 0.05, 0.4, gamma=30.0), clamp, up, leave_saddle=True)
    assert left.energy.total == pytest.approx(free.energy.total, rel=1e-8)
    assert left.walls[0].force == pytest.approx(np.zeros(3), abs=1e-6)


def test_pinned_ends_and_free_starts():
    strip, up = Strip(1.0, 0.05, 0.4, gamma=10.0), Gravity((0, 1, 0))
    pinned = solve(
        strip,
        Clamp((0, 0, 0), None, None, ruling="free"),
        up,
        end=Clamp((0, 0, 0.8), None, None, ruling="free"),
        segments=16,
    )
    assert pinned.ok
    assert pinned.start.moment == pytest.approx(np.zeros(3), abs=1e-9)
    assert pinned.end_support.moment == pytest.approx(np.zeros(3), abs=1e-9)
    assert pinned.start.force + pinned.end_support.force == pytest.approx([0, 10.0, 0], abs=1e-7)
    assert pinned.omega([0.0, 1.0]) == pytest.approx([0, 0], abs=0.2)
    held = solve(strip, Clamp((0, 0, 0), ruling="free"), up, segments=16)
    turned = solve(
        strip, Clamp(None, None, None), up, end=Clamp((0, 0, 0), (0, 0, -1), (0, 1, 0), ruling="free"), segments=16
    )
    assert turned.ok
    assert turned.energy.total == pytest.approx(held.energy.total, rel=1e-9)
    roller = solve(
        strip, Clamp((0, 0, 0), ruling="free"), up, end=Clamp(None, (0, 0, 1), (0, 1, 0), ruling="free"), segments=16
    )
    assert roller.ok
    assert roller.end.frame == pytest.approx(np.eye(3), abs=1e-9)
    assert roller.end_support.force == pytest.approx(np.zeros(3), abs=1e-12)


@pytest.mark.parametrize(("length", "formulation"), [(0.4, "chained"), (0.5, "chained"), (0.5, "mixed")])
def test_a_seed_without_torsion_ends_on_the_planar_saddle_and_leaves_it(length, formulation):
    """The curl of 4.4 far beyond the length at which it leaves its plane, from a straight seed."""
    strip = Strip.from_material(length, 0.01, 1e-4, 1.8e9, 1000.0, 0.5, 60.0)
    keywords = {"segments": 20, "seed_curvature": 0.0, "formulation": formulation}
    planar = solve(strip, Clamp(ruling="free"), Gravity((0, 1, 0)), **keywords)
    assert planar.status in (Status.SADDLE, Status.CONVERGED)
    left = solve(strip, Clamp(ruling="free"), Gravity((0, 1, 0)), leave_saddle=True, **keywords)
    assert left.ok
    assert left.max_abs_eta > 0.1
    assert left.energy.total <= planar.energy.total + 1e-9


def test_a_free_band_stays_where_it_is_when_its_segments_change():
    """Joining and cutting segments must not put a ring that nothing clamps back to where its seed stood."""
    strip = Strip(1.0, 0.05, 0.4, gamma=10.0)
    table = Wall((0, -0.2, 0), (0, 1, 0))
    ring = build(strip, None, Gravity((0, 1, 0)), closure=Closure("circle"), walls=(table,), segments=8)
    x = ring.state(np.full(9, -2 * np.pi), np.zeros(9))
    moved = ring.with_changes(reference=(0.6, 0.0, 0.8, 0.0), origin=(0.3, 0.2, 0.1)).state(x[7::10], x[8::10])
    fine = ring.with_changes(lengths=np.full(16, 1 / 16))
    points, frames = fine.joints(transferred(ring, moved, fine))
    old_points, old_frames = ring.joints(moved)
    assert points[::2] == pytest.approx(old_points, abs=1e-13)
    assert frames[::2] == pytest.approx(old_frames, abs=1e-13)
    assert np.linalg.norm(points[0] - x[:3]) > 0.3
