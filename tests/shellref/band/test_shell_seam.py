"""The seam of a closed strip: derivatives across it, inertia against dense eigenvalues, what holds a band that nothing
holds, and input that cannot be closed."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from shellref import Pose, ShellInputError, ShellOptions, ShellProblem, Waypoint
from shellref.band.start import opened, twisted
from shellref.seam import gauge
from shellref.seam.ties import Tie

RNG = np.random.default_rng(11)
BAND = ShellProblem(0.1, 2e-3, 0.3, clamp="free", half_turns=1, elements=(12, 2), start_curvature=-2.0 * np.pi)


def built(problem, engine="kernels", held=True):
    """Solver of a band, and a state of its twisted circle that is no equilibrium; not held: with its null space."""
    pytest.importorskip("dolfinx")
    from shellref.fenics import dolfinx_api as api
    from shellref.path.newton import Equilibrium
    from shellref.path.solver import Solver
    from shellref.shell.body import Supports
    from shellref.shell.strip import build_strip

    options = ShellOptions(engine=engine)
    solver = Solver(build_strip(problem, options), options, api.communicator("self"), lambda event: None)
    state = solver._held(solver.state_of(twisted(problem)))
    if not held:
        free = replace(Supports.none(len(state)), tie=solver.equilibrium.supports.tie)
        solver.equilibrium = Equilibrium(solver.model, options, free)
    return solver, state


def dense(solver, state):
    """The reduced tangent at a state, its stress the state's own."""
    equilibrium, model = solver.equilibrium, solver.model
    stress = model.stress(state)
    bases = equilibrium.assemble(state, stress, model.force(state, stress))
    indptr, indices, values = equilibrium.matrix.getValuesCSR()
    return scipy.sparse.csr_matrix((values, indices, indptr)).toarray(), bases


@pytest.mark.shell
@pytest.mark.parametrize("engine", ["kernels", "forms"])
@pytest.mark.parametrize("half_turns", [0, 1, -3])
def test_gradient_and_hessian_of_the_energy_across_the_seam(engine, half_turns):
    """Differences of the energy along geodesics of the directors (to fourth order), in directions that are nothing but
    at the seam, where both edges move as one."""
    solver, state = built(replace(BAND, half_turns=half_turns, elements=(6, 2)), engine)
    state = solver.equilibrium.supports.tie.placed(state + 0.01 * np.sin(7.0 * state + 1.0))
    state[:, 3:] /= np.linalg.norm(state[:, 3:], axis=1)[:, None]
    tangent, bases = dense(solver, state)
    np.testing.assert_allclose(tangent, tangent.T, atol=1e-9 * np.abs(tangent).max())
    increments, model = solver.equilibrium.increments, solver.model
    numbers = increments.numbers()
    at_seam = np.unique(numbers[increments.tie.nodes])
    gradient = solver.equilibrium.reduced_residual(state)

    def energy(q, t):
        """At t along the geodesic that leaves in the direction q."""
        step = increments.expand(q, bases)
        speed = np.linalg.norm(step[:, 3:], axis=1)[:, None]
        turned = np.cos(t * speed) * state[:, 3:] + t * np.sinc(t * speed / np.pi) * step[:, 3:]
        moved = np.hstack([state[:, :3] + t * step[:, :3], turned])
        np.testing.assert_allclose(moved, increments.tie.placed(moved), atol=1e-14)
        return model.energies(moved).total

    for _ in range(3):
        q = np.zeros(increments.unknowns)
        q[at_seam[at_seam >= 0]] = RNG.standard_normal(int(np.sum(at_seam >= 0)))
        t = 1e-3
        values = np.array([energy(q, k * t) for k in (-2, -1, 0, 1, 2)])
        first = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) @ values / (12.0 * t)
        second = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) @ values / (12.0 * t * t)
        assert first == pytest.approx(gradient @ q, rel=1e-6, abs=1e-6 * np.abs(gradient).max())
        assert second == pytest.approx(q @ tangent @ q, rel=1e-5)


@pytest.mark.shell
@pytest.mark.parametrize("half_turns", [0, 1, 2])
@pytest.mark.parametrize("elements", [(12, 2), (6, 3)])
def test_fronts_of_a_closed_strip_have_the_inertia_of_the_dense_tangent(elements, half_turns):
    """Of a circle and of twisted ones, which are no equilibria and have negative directions."""
    solver, state = built(replace(BAND, half_turns=half_turns, elements=elements))
    tangent, bases = dense(solver, state)
    equilibrium = solver.equilibrium
    equilibrium.factors.factor()
    assert equilibrium.factors.safe  # along the mesh, not by MUMPS
    expected = int(np.sum(np.linalg.eigvalsh(tangent) < 0.0))
    assert expected > 0 or elements == (12, 2)
    assert equilibrium.factors.inertia() == (expected, 0, len(tangent) - expected)
    right = RNG.standard_normal(len(tangent))
    scale = np.abs(tangent) @ np.abs(equilibrium.factors.solve(right))
    assert np.all(np.abs(tangent @ equilibrium.factors.solve(right) - right) < 1e-10 * scale)
    assert np.all(np.isfinite(equilibrium.back(solver.model.residual(state), bases)))


@pytest.mark.shell
@pytest.mark.parametrize(("half_turns", "zeros"), [(1, 7), (0, 6)])
def test_a_free_band_is_judged_without_its_motions(half_turns, zeros):
    """The dense tangent of a band held nowhere has six zeros of a circle (which slides by turning), seven of a Moebius
    band; the next eigenvalue is the lowest one that is told, and none is negative."""
    pytest.importorskip("dolfinx")
    from shellref.path.begin import begun

    problem = replace(BAND, half_turns=half_turns, elements=(24, 3))
    result = begun(problem, ShellOptions(), lambda event: None).result
    assert result.stable is True
    assert result.clamps == {}
    solver, state = built(problem, held=False)
    assert solver.equilibrium.unknowns == result.unknowns + zeros
    state = solver.equilibrium.supports.tie.placed(solver.state_of(result.surface))
    tangent, _ = dense(solver, state)
    values = scipy.linalg.eigh(tangent, np.diag(solver.equilibrium.mass), eigvals_only=True, subset_by_index=(0, 8))
    # of a Moebius band to the mesh's error: it is held where sliding has a force of that size, which turns with it
    assert np.abs(values[:6]).max() < (1e-3 if half_turns else 1e-7) * values[zeros]
    assert np.abs(values[zeros - 1]) < 0.2 * values[zeros]  # sliding from one element to the next is no zero of a mesh
    assert values[zeros] == pytest.approx(result.lowest_eigenvalue, rel=2e-2 if half_turns else 1e-6)
    assert values[zeros] > 5e3


def field(n, m, half_turns, period):
    """A smooth closed band's positions and directors on n + 1 rows, and the same slid by a fraction of its length."""
    s, v = np.linspace(0.0, 1.0, n + 1), np.linspace(-0.1, 0.1, m)
    sign = -1 if half_turns % 2 else 1

    def at(x):
        turn, angle = 2.0 * np.pi * x[:, None], np.pi * half_turns * x[:, None]
        radius = 1.0 + 0.2 * np.cos(period * turn)
        out = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=-1)
        up = np.array([0.0, 0.0, 1.0])
        across = np.cos(angle)[..., None] * up + np.sin(angle)[..., None] * out
        normal = np.cos(angle)[..., None] * out - np.sin(angle)[..., None] * up
        points = radius[..., None] * out + v[None, :, None] * across
        return np.concatenate([points, np.broadcast_to(normal, points.shape)], axis=-1)

    return s, sign, at


@pytest.mark.parametrize("half_turns", [0, 1, 3])
def test_sliding(half_turns):
    """By rows it is the band's own field there; its rate against differences of the field; a circle turns by it."""
    s, sign, at = field(48, 5, half_turns, 2)
    here = at(s)
    np.testing.assert_allclose(gauge.slid(here, 4, sign), at(s[:-1] + 4 / 48), atol=1e-12)
    rate = (at(s[:-1] + 1e-6) - at(s[:-1] - 1e-6)) / 2e-6
    fine = [np.abs(gauge.sliding(at(x), x, 2, sign) - _rate(at, x)).max() for x in (s, np.linspace(0, 1, 97))]
    assert fine[0] < 0.05 * np.abs(rate).max()
    assert fine[0] / fine[1] > 3.5  # second order at ends of elements
    assert not gauge.turns(here, 2, sign)
    circle = field(48, 5, 0, 0)[2](s)
    assert gauge.turns(circle, 2, 1)


def _rate(at, s):
    return (at(s[:-1] + 1e-6) - at(s[:-1] - 1e-6)) / 2e-6


def test_what_is_held_fixes_every_motion():
    s, sign, at = field(48, 5, 1, 2)
    here = at(s)
    slide = gauge.sliding(here, s, 2, sign).reshape(-1, 6)
    motions = gauge.motions(here[:-1].reshape(-1, 6), slide)
    mask = gauge.held(motions)
    assert (motions.shape[0], mask.sum()) == (7, 7)
    rows = np.linalg.qr(motions[..., :3].reshape(7, -1).T)[0][mask.ravel()]
    assert np.linalg.cond(rows) < 30.0


def test_a_tie_gives_what_acts_on_its_nodes_to_their_partners():
    tie = Tie.of_rows(np.array([0, 1, 2]), np.array([6, 7, 8]), 1)
    assert tie.sign == -1
    np.testing.assert_array_equal(tie.owners(9)[[6, 7, 8]], [2, 1, 0])
    nodal = np.arange(18.0).reshape(9, 2)
    joined = tie.joined(nodal)
    np.testing.assert_array_equal(joined[[0, 1, 2]], nodal[[0, 1, 2]] + nodal[[8, 7, 6]])
    np.testing.assert_array_equal(joined[[6, 7, 8]], 0.0)


@pytest.mark.parametrize(
    ("change", "key", "remedy"),
    [
        ({"half_turns": 0.5}, "half_turns", "whole number"),
        ({"half_turns": True}, "half_turns", "whole number"),
        ({"start_curvature": 3.0}, "start_curvature", "multiple of 2 pi"),
        ({"start_curvature": 0.0}, "start_curvature", "multiple of 2 pi"),
        ({"transverse_curvature": 2.0, "start_curvature": None}, "transverse_curvature", "open, or flat across"),
        ({"elements": (4, 2)}, "elements", "6 along"),
        ({"clamp": "corners"}, "clamp", "seam"),
        ({"tip": (0.0, 0.0, 1.0)}, "clamp", "flies away"),
        ({"clamp": "edge", "tip": (0.0, 0.0, 1.0)}, "tip", "no end of its own"),
        ({"clamp": "edge", "end": Pose((0.0, 0.0, 0.0), BAND.clamp_frame)}, "end", "no end of its own"),
        ({"clamp": "edge", "path": (Waypoint(natural=1.0),)}, "path", "no end of its own"),
        ({"gamma": 1.0, "up": (0.0, 0.0, 1.0)}, "clamp", "flies away"),
    ],
)
def test_what_cannot_be_closed(change, key, remedy):
    with pytest.raises(ShellInputError, match=remedy) as caught:
        replace(BAND, **change)
    assert caught.value.key == key
    assert "\n" not in str(caught.value)


def test_a_band_is_uniform_where_its_natural_curvature_is():
    """Half a turn reverses the curvature that a strip has at rest: only of a flat one is every place like the next."""
    assert BAND.slides
    assert not replace(BAND, natural_curvature=(1.0, 1.0)).slides
    assert replace(BAND, half_turns=2, natural_curvature=(1.0, 1.0)).slides
    assert not replace(BAND, half_turns=2, natural_curvature=(1.0, 2.0)).slides
    assert not replace(BAND, clamp="edge").slides
    assert BAND.without_goal("middle") == "is not known for a closed strip"


def test_the_open_strip_ends_where_the_seam_is():
    problem = opened(replace(BAND, elements=(100, 12), half_turns=3))
    assert (problem.half_turns, problem.elements) == (None, (50, 6))
    frames = [np.array(w.end.frame) for w in problem.path if w.end is not None]
    turns = [one.T @ other for one, other in zip([np.eye(3), *frames[:-1]], frames, strict=True)]
    assert all(np.arccos(np.clip(turn[0, 0], -1.0, 1.0)) < 1.0 for turn in turns)
    np.testing.assert_allclose(frames[-1], np.diag([-1.0, -1.0, 1.0]), atol=1e-12)
