"""Equilibria: the scenes of 3.5.2 from the natural shape, invariances, orders, saddles, statuses, bad input."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Gravity, RibbonInputError, Status, Strip, refine, solve
from ribbon.notes import Note
from ribbon.problems.chained import ChainedProblem
from ribbon.solvers import ipopt
from ribbon.solvers.budget import SPENT

HALF = 2**-0.5
CLAMP = Clamp((0, 0, 0), (0, 0, 1), (-HALF, HALF, 0), ruling="free")
UP = Gravity((1, 0, 0))
SCENES = [(10, 100, 10), (40, 1200, 20), (100, 7500, 20)]


def coil(curvature, gamma, segments, energy="sadowsky", **keywords):
    strip = Strip(1.0, 0.03, 0.4, curvature, gamma)
    return solve(strip, CLAMP, UP, energy=energy, segments=segments, **keywords)


@pytest.mark.parametrize(("curvature", "gamma", "segments"), SCENES)
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("energy", ["sadowsky", "wunderlich"])
def test_the_three_scenes_converge_from_the_natural_shape(curvature, gamma, segments, sign, energy):
    result = coil(sign * curvature, gamma, segments, energy)
    assert result.status is Status.CONVERGED
    assert result.residual < 1e-8
    assert result.stable is True
    assert result.lowest_eigenvalue > 1e-3
    assert result.iterations < 100
    # independent of the solver's word: the gradient at the point, and energies that went down
    assert np.abs(result.problem.gradient(result.x) - result.multipliers).max() < 1e-8
    assert result.energy.total < result.problem.value(result.problem.natural_state())
    assert result.max_abs_eta_prime_w_half <= 1
    frames = result.joints[1]
    assert np.abs(np.einsum("kij,kil->kjl", frames, frames) - np.eye(3)).max() < 1e-12
    assert np.all(np.linalg.det(frames) > 0)


def test_tip_error_falls_with_the_fourth_power_of_the_segments():
    chain = [coil(10, 100, 10)]
    for _ in range(4):
        chain.append(refine(chain[-1]))
    ends = np.array([r.end.position for r in chain])
    steps = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    orders = np.log2(steps[:-1] / steps[1:])
    assert all(r.ok for r in chain)
    assert np.all(orders > 3.7)
    assert np.all(orders < 4.4)
    assert steps[0] < 5e-4


def test_the_energy_falls_as_the_space_grows():
    """Cut segments contain the old shapes: the minimum can only go down."""
    coarse = coil(-10, 100, 7, "wunderlich")
    finer = refine(coarse, 3)
    assert finer.energy.total < coarse.energy.total
    assert finer.energy.total > coarse.energy.total - 0.05


def test_weightless_strip_takes_its_natural_shape():
    strip = Strip(2.0, 0.1, 0.3, (1.5, -4.0))
    result = solve(strip, CLAMP, energy="wunderlich", segments=6, seed_curvature=0.5)
    assert result.ok
    assert np.allclose(result.omega([0, 0.25, 1.0]), [3.0, 3.0 - 0.25 * 11.0, -8.0], atol=1e-6)
    assert result.max_abs_eta < 1e-5
    assert result.energy.elastic == pytest.approx(-0.5 * (9 - 24 + 64) / 3, rel=1e-9)
    assert result.energy.gravity == 0.0
    assert result.evaluations["series"] == 0
    assert np.all(result.start.force == 0)


def test_length_unit_and_rigid_motion_change_nothing():
    first = coil(10, 100, 10, "wunderlich")
    rotation = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    frame = rotation @ CLAMP.frame
    strip = Strip(25.0, 0.75, 0.4, 0.4, 100.0)
    clamp = Clamp((2.5, -5.0, 7.5), frame[:, 2], frame[:, 1], ruling="free")
    second = solve(strip, clamp, Gravity(rotation @ [1, 0, 0]), segments=10)
    assert np.abs(second.position([0.3, 1.0]) - first.position([0.3, 1.0]) @ rotation.T - [0.1, -0.2, 0.3]).max() < 1e-9
    assert second.energy.elastic == pytest.approx(first.energy.elastic, rel=1e-10)


def test_mirror_image():
    """Reflection in the plane of t_y and t_z: eta changes sign, omega does not."""
    first = coil(10, 100, 10, "wunderlich")
    mirror = np.eye(3) - 2 * np.outer(CLAMP.frame[:, 0], CLAMP.frame[:, 0])
    second = solve(first.problem.strip, CLAMP, Gravity(mirror @ [1, 0, 0]), segments=10)
    s = np.linspace(0, 1, 9)
    assert np.abs(second.eta(s) + first.eta(s)).max() < 1e-7
    assert np.abs(second.omega(s) - first.omega(s)).max() < 1e-7
    assert np.abs(second.position(s) - first.position(s) @ mirror).max() < 1e-9


def test_si_data_give_the_dimensionless_groups():
    """Figure 4.1: Gamma = rho h g l^3 / D."""
    strip = Strip.from_material(0.5, 0.015, 1e-4, 1.8e9, 1000.0, 0.5, 30.0)
    stiffness = 1.8e9 * 1e-12 / (12 * 0.75)
    assert strip.gamma == pytest.approx(1000 * 1e-4 * 9.81 * 0.125 / stiffness, rel=1e-14)
    assert strip.curvature == (15.0, 15.0)
    assert strip.relative_width == pytest.approx(0.03)


def test_clamp_carries_the_weight_and_its_moment():
    """The moment against a quadrature of the surface's own centreline; the virtual work of turning the clamp."""
    result = coil(10, 100, 20, "wunderlich")
    assert result.start.force == pytest.approx([100.0, 0.0, 0.0], abs=1e-13)
    s = (np.arange(4000) + 0.5) / 4000
    lever = result.position(s).mean(axis=0)
    assert np.allclose(result.start.moment, np.cross(lever, [100, 0, 0]), atol=1e-4)
    axis, angle = np.array([0.36, 0.48, 0.8]), 1e-4
    k = np.cross(np.eye(3), axis)
    energies = []
    for sign in (1, -1):
        turn = np.eye(3) + np.sin(sign * angle) * k + (1 - np.cos(angle)) * k @ k
        frame = turn @ CLAMP.frame
        clamp = Clamp((0, 0, 0), frame[:, 2], frame[:, 1], ruling="free")
        seed = ChainedProblem(result.problem.strip, clamp, UP, "wunderlich", result.problem.lengths)
        energies.append(ipopt.minimise(seed, result.x))
        energies[-1] = seed.value(energies[-1].x)
    assert (energies[0] - energies[1]) / (2 * angle) == pytest.approx(result.start.moment @ axis, abs=1e-5)


def on_edge(gamma, energy="sadowsky", ruling="free", width=0.02):
    """A straight horizontal strip standing on its edge (thesis, 7.1), started exactly symmetric."""
    clamp = Clamp((0, 0, 0), (1, 0, 0), (0, 1, 0), ruling)
    return solve(Strip(1.0, width, 0.3, 0.0, gamma), clamp, Gravity((0, 0, 1)), energy=energy, segments=20)


@pytest.mark.parametrize("energy", ["sadowsky", "wunderlich"])
@pytest.mark.parametrize("ruling", ["free", "straight"])
def test_a_saddle_is_called_a_saddle(energy, ruling):
    """Above the critical weight (about 21 for a free ruling: thesis, 7.1) the straight strip is no minimum.

    Its Hessian at eta = 0 is positive semi-definite: only the search over the rulings, which move nothing, finds out.
    """
    light, heavy = on_edge(12.0, energy, ruling), on_edge(40.0, energy, ruling)
    assert light.status is Status.CONVERGED
    assert "indifferent" in light.message
    assert heavy.end.position == pytest.approx([1.0, 0.0, 0.0], abs=1e-12)
    assert heavy.status is Status.SADDLE
    assert heavy.stable is False
    assert heavy.lowest_eigenvalue < -0.1
    assert not heavy.ok


def test_critical_weight_of_the_strip_on_edge_does_not_depend_on_its_width():
    """Sadowsky, free ruling: about 21 for every w / l (thesis, 7.1; Audoly and Neukirch 2021)."""
    for width in (0.01, 0.1):
        assert on_edge(21.3, width=width).ok
        assert not on_edge(21.7, width=width).ok


@pytest.mark.parametrize("energy", ["sadowsky", "wunderlich"])
def test_a_ruling_that_turns_near_a_straight_clamp_is_found_on_short_segments(energy):
    """w/l = 0.02, segments from w/8 at the clamp on: critical at 21.8 and 21.9 (`results/on_edge`).

    The worst ruling is oblique from about a width on; a search that turns it within the first segment says 23.1.
    """
    lengths = 0.0025 * 1.19 ** np.arange(25)
    clamp = Clamp((0, 0, 0), (1, 0, 0), (0, 1, 0), "straight")
    for gamma, status in ((21.6, Status.CONVERGED), (22.2, Status.SADDLE)):
        strip = Strip(1.0, 0.02, 0.3, 0.0, gamma)
        found = solve(strip, clamp, Gravity((0, 0, 1)), energy=energy, segments=lengths / lengths.sum())
        assert found.status is status


def test_the_saddles_direction_leads_to_a_stable_state():
    heavy = on_edge(40.0)
    problem = heavy.problem
    away = ipopt.minimise(problem, heavy.x + 0.3 * heavy.mode)
    assert problem.value(away.x) < heavy.energy.total - 0.01


def test_symmetric_planar_seed_of_an_unstable_curl_is_reported():
    """A naturally straight strip clamped upright stands on its clamp: unstable above Greenhill's weight 7.837."""
    column = [
        solve(
            Strip(1, 0.05, 0.3, 0.0, gamma),
            Clamp((0, 0, 0), (0, 0, 1), (0, 1, 0), ruling="free"),
            Gravity((0, 0, 1)),
            segments=16,
        )
        for gamma in (7.8, 7.9)
    ]
    assert column[0].status is Status.CONVERGED
    assert column[1].status is Status.SADDLE
    assert column[0].lowest_eigenvalue > -1e-9 > column[1].lowest_eigenvalue


def test_a_symmetric_saddle_is_reached_and_named():
    """Planar, unbent by its weight to omega between 0 and nu K: unstable against the ruling, but eta = 0 stays 0.

    Ipopt, which must shift the Hessian at every step there, does not converge; Newton's own steps do.
    """
    angle = 2.48
    clamp = Clamp((0, 0, 0), (np.cos(angle), np.sin(angle), 0), (-np.sin(angle), np.cos(angle), 0), ruling="free")
    strip = Strip(1.0, 0.05, 0.3, (-10.48, 7.27), 1773.5)
    planar = solve(strip, clamp, Gravity((0, 1, 0)), segments=40)
    assert planar.status is Status.SADDLE
    assert planar.residual < 1e-8
    assert planar.max_abs_eta == 0.0
    left = solve(strip, clamp, Gravity((0, 1, 0)), segments=40, seed_ruling=0.01)
    assert left.ok
    assert left.energy.total < planar.energy.total - 0.1


def test_an_iteration_limit_is_a_status():
    result = coil(40, 1200, 20, options={"max_iter": 3})
    assert result.status is Status.NOT_CONVERGED
    assert result.stable is None
    assert f"({result.solver}: " in result.message
    assert result.residual > 1e-8


def test_exceptions_of_a_callback_surface_with_their_own_traceback(monkeypatch):
    def broken(self, x):
        raise RuntimeError("broken on purpose")

    monkeypatch.setattr(ChainedProblem, "jets", broken)
    with pytest.raises(RuntimeError, match="broken on purpose"):
        coil(10, 100, 10, solver="ipopt")


def test_active_bounds_are_left_out_of_the_stability_check():
    """Sadowsky with a wide strip: |eta'| <= 2/w becomes active, with a multiplier of the right sign."""
    strip = Strip(1.0, 0.5, 0.4, 10.0, 100.0)
    result = solve(strip, Clamp((0, 0, 0), (0, 0, 1), (-HALF, HALF, 0), "straight"), UP, energy="sadowsky", segments=24)
    assert result.status is Status.CONVERGED
    assert result.active_bounds > 0
    assert result.max_abs_eta_prime_w_half == pytest.approx(1.0, abs=1e-6)
    assert result.residual < 1e-8


def test_surface_is_material_and_developable():
    """Edges keep their flat lengths, the material ends are straight, angles between neighbours are kept."""
    result = coil(10, 100, 20, "wunderlich")
    fine = result.surface(2000, 8)
    grid = fine.grid
    assert fine.points.shape == (2001 * 9, 3)
    assert fine.triangles.max() == len(fine.points) - 1
    for column in (0, 4, 8):
        length = np.linalg.norm(np.diff(grid[:, column], axis=0), axis=1).sum()
        assert length == pytest.approx(1.0, abs=2e-5)
    assert np.allclose(grid[:, 4], result.position(np.linspace(0, 1, 2001)), atol=1e-12)
    along = np.diff(grid, axis=0)[:, :-1] * 2000
    across = np.diff(grid, axis=1)[:-1] * 8 / 0.03
    inside = slice(100, -100)
    assert np.abs(np.einsum("ijk,ijk->ij", along, across))[inside].max() < 5e-3
    assert np.abs(np.linalg.norm(across, axis=2) - 1)[inside].max() < 5e-3


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"length": 0.0}, "length"), ({"length": float("nan")}, "length"), ({"width": 1.0}, "width"),
        ({"width": -0.1}, "width"), ({"poisson": 0.6}, "poisson"), ({"poisson": -1.0}, "poisson"),
        ({"gamma": -1.0}, "gamma"), ({"gamma": float("inf")}, "gamma"), ({"thickness": 0.2}, "thickness"),
        ({"natural_curvature": (1.0, 2.0, 3.0)}, "natural_curvature"),
        ({"natural_curvature": "much"}, "natural_curvature"),
        ({"width": True}, "width"),
    ],
)  # fmt: skip
def test_impossible_strips(arguments, key):
    with pytest.raises(RibbonInputError) as caught:
        Strip(**{"length": 1.0, "width": 0.1, **arguments})
    assert caught.value.key == key
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"tangent": (0, 0, 2)}, "tangent"), ({"tangent": (0, 0, 0)}, "tangent"), ({"normal": (0, 0, 1)}, "normal"),
        ({"normal": (0, 1)}, "normal"), ({"position": (0, 0, float("nan"))}, "position"),
        ({"ruling": "loose"}, "ruling"),
    ],
)  # fmt: skip
def test_impossible_clamps(arguments, key):
    with pytest.raises(RibbonInputError) as caught:
        Clamp(**arguments)
    assert caught.value.key == key


def test_other_bad_input():
    strip = Strip(1.0, 0.1)
    for keywords, key in (
        ({"energy": "kirchoff"}, "energy"),
        ({"segments": 0}, "segments"),
        ({"seed_curvature": "flat"}, "seed_curvature"),
        ({"seed_curvature": ()}, "seed_curvature"),
        ({"seed_ruling": float("inf")}, "seed_ruling"),
        ({"seed_curvature": np.empty(0)}, "seed_curvature"),
        ({"seed_curvature": np.ones((2, 3))}, "seed_curvature"),
        ({"seed_ruling": np.array(["much"])}, "seed_ruling"),
    ):
        with pytest.raises(RibbonInputError) as caught:
            solve(strip, **keywords)
        assert caught.value.key == key
    with pytest.raises(RibbonInputError, match="up"):
        Gravity((0, 0, 2))
    for key, value in (("young", 0.0), ("density", -1.0), ("thickness", float("nan"))):
        data = {"young": 1e9, "density": 1e3, "thickness": 1e-4, key: value}
        with pytest.raises(RibbonInputError, match=key):
            Strip.from_material(1.0, 0.1, poisson=0.3, **data)


def test_a_starting_shape_may_be_an_array():
    strip = Strip(1.0, 0.05, 0.3, natural_curvature=3.0)
    values = [2.0, 3.5]
    listed = solve(strip, segments=4, seed_curvature=values, seed_ruling=0.1)
    array = solve(strip, segments=4, seed_curvature=np.array(values), seed_ruling=np.array(0.1))
    assert np.array_equal(array.x, listed.x)


def test_a_message_is_made_of_its_notes():
    """Every code stands for a sentence that is there, and no sentence stands without its code."""
    strip = Strip(1.0, 0.05, 0.3, natural_curvature=3.0, gamma=20.0)
    taut = solve(Strip(1.0, 0.05), Clamp(), end=Clamp((0, 0, 1.0)), segments=8)
    late = solve(strip, Clamp(), Gravity((1, 0, 0)), segments=8, budget=1e-9)
    held = solve(strip, Clamp(), Gravity((1, 0, 0)), segments=8)
    assert taut.notes == (Note.NO_TENSION,)
    assert taut.message == f"{taut.status.value}; {Note.NO_TENSION.text(why=taut.forces_why)}"
    assert late.notes == (Note.STOPPED,)
    assert late.message == Note.STOPPED.text(status=late.status.value, why=SPENT)
    assert (held.notes, held.message) == ((), held.status.value)
