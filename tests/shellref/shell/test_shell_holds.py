"""Ends of which a part is held: the hinged elastica, pendulums, and motions that nothing resists taken out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import ellipe, ellipk

from shellref import ShellInputError, ShellOptions, ShellProblem, ShellStatus, ShellSurface
from shellref.holds import motions
from shellref.seam import gauge
from shellref.shell.clamps import Control, PosePath
from shellref.shell.edges import PivotEdge, middle_weights
from shellref.shell.grid import Grid, knots_across
from shellref.shell.problem import IDENTITY, Pose, Waypoint

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.path.begin import begun  # noqa: E402

UP = (0.0, 0.0, 1.0)
#: Tangent down, normal along y.
DOWN = ((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0))
HANGING = ShellProblem(
    0.1, 1e-3, 0.0, clamp_frame=DOWN, gamma=0.1, up=UP, elements=(10, 2), grading=(1.0, 1.0),
    holds=("position", "all"), sections=("free", "undeformed"),
)  # fmt: skip


def find(problem, start=None, **options):
    return begun(problem, ShellOptions(**options), lambda event: None, start).result


def hinged(chord, elements=(20, 2), section="undeformed"):
    """Two hinges on z, the strip bent from flat as an arc between them."""
    turn = brentq(lambda t: 2.0 * math.sin(t / 2.0) - t * chord, 0.1, 6.2)

    def frame(angle):
        c, s = math.cos(angle), math.sin(angle)
        return ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c))

    return ShellProblem(
        0.1, 1e-3, 0.0, clamp_frame=frame(-turn / 2.0), end=Pose((0.0, 0.0, chord), frame(turn / 2.0)),
        start_curvature=turn, elements=elements, grading=(1.0, 1.0), path=(Waypoint(natural=1.0, name="natural"),),
        holds=("position", "position"), sections=(section, section),
    )  # fmt: skip


def elastica(chord):
    """Force (D w / l^2) of a hinged elastica bent once: P = 4 K(m)^2, chord = 2 E(m) / K(m) - 1 (Love 1927, 263)."""
    m = brentq(lambda m: 2.0 * ellipe(m) / ellipk(m) - 1.0 - chord, 1e-9, 0.8)
    return 4.0 * ellipk(m) ** 2


def test_two_hinges_are_those_of_the_elastica():
    """Force and work: P of fourth order in the elements, no moment, and dE = -P d(chord) judged by the energies."""
    exact = elastica(0.8)
    found = [find(hinged(0.8, (n, 2))) for n in (10, 20)]
    for result in found:
        assert (result.status, result.stable, result.negative_eigenvalues) == (ShellStatus.CONVERGED, True, 0)
        for clamp in result.clamps.values():
            assert np.abs(clamp["moment"]).max() < 1e-6
    errors = [abs(result.clamps["start"]["force"][2] / exact - 1.0) for result in found]
    assert errors[1] < 2e-5
    assert errors[0] / errors[1] > 8.0
    step = 1e-3
    work = [find(hinged(0.8 + sign * step)).energy["elastic"] for sign in (1.0, -1.0)]
    assert (work[1] - work[0]) / (2.0 * step) == pytest.approx(found[1].clamps["start"]["force"][2], rel=1e-4)


def test_a_point_of_a_free_edge_carries_what_a_straight_edge_does():
    """The same on every mesh but for the little by which an edge gives way that is held in its middle."""
    exact = elastica(0.8)
    found = [find(hinged(0.8, mesh, "free")) for mesh in ((12, 2), (24, 4))]
    less = [result.clamps["start"]["force"][2] / exact - 1.0 for result in found]
    assert all(result.stable for result in found)
    assert -3e-4 < less[1] < -1e-4
    assert less[0] == pytest.approx(less[1], abs=5e-5)
    assert np.abs(found[0].clamps["start"]["moment"]).max() < 1e-6


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_the_held_point_of_an_edge_is_its_middle(count):
    """Of cubics in v exactly, whatever the mesh across; of one element its middle node."""
    grid = Grid(np.array([0.0, 1.0]), knots_across(count, 0.3, 0.1))
    v = grid.v_nodes
    weights = middle_weights(v, grid.nodal_shares(1))
    np.testing.assert_allclose([weights @ v**k for k in range(4)], [1.0, 0.0, 0.0, 0.0], atol=1e-15)
    assert (np.abs(weights[[0, -1]]) < 1e-14).all() == (count == 1)


def test_a_hanging_strip_is_a_compound_pendulum():
    """Slowest swing in its own plane, omega^2 = (Gamma / 2) / (1/3 + w^2 / 12); the turn about the vertical is none."""
    result = find(HANGING)
    assert (result.status, result.stable) == (ShellStatus.CONVERGED, True)
    assert result.lowest_eigenvalue == pytest.approx(0.05 / (1.0 / 3.0 + 0.01 / 12.0), rel=1e-4)
    np.testing.assert_allclose(result.clamps["start"]["force"], [0.0, 0.0, 0.1], atol=1e-9)


def test_a_strip_that_stands_on_its_hinge_falls_two_ways():
    """Two unstable directions, and not the turn about the vertical; begun hanging it is stable (the test above)."""
    hanging = find(HANGING).surface
    standing = ShellSurface(
        hanging.s_nodes, hanging.v_nodes, hanging.points * [-1.0, 1.0, -1.0], hanging.directors * [-1.0, 1.0, -1.0]
    )
    result = find(HANGING, standing, begin="given", kick=False)
    assert (result.status, result.negative_eigenvalues) == (ShellStatus.UNSTABLE, 2)
    assert result.lowest_eigenvalue == pytest.approx(-0.05 / (1.0 / 3.0), rel=1e-3)


def test_it_does_not_matter_which_components_hold_it(monkeypatch):
    """Other components give the same shape, reactions and spectrum: nothing is resisted where there is no support."""
    problem = hinged(0.8, (10, 2), "free")
    one = find(problem)
    usual = gauge.held

    def other(found):
        mask = usual(found)
        return usual(np.where(mask, 0.0, found[..., :3])) if mask.any() else mask

    monkeypatch.setattr(gauge, "held", other)
    two = find(problem)
    assert two.lowest_eigenvalue == pytest.approx(one.lowest_eigenvalue, rel=1e-5)
    assert two.energy["elastic"] == pytest.approx(one.energy["elastic"], rel=1e-8)
    assert two.clamps["start"]["force"][2] == pytest.approx(one.clamps["start"]["force"][2], rel=1e-7)


P0, P1 = np.zeros(3), np.array([0.3, 0.0, 0.4])
LOAD = np.array(UP)
COUNTS = {
    "nothing": ([], [], 6),
    "nothing, heavy": ([], [LOAD], 3),
    "a point": ([motions.Support(P0, False)], [], 3),
    "a point, heavy": ([motions.Support(P0, False)], [LOAD], 1),
    "two points": ([motions.Support(P0, False), motions.Support(P1, False)], [], 1),
    "two points, heavy": ([motions.Support(P0, False), motions.Support(P1, False)], [LOAD], 0),
    "two points on a plumb line": ([motions.Support(P0, False), motions.Support(0.5 * LOAD, False)], [LOAD], 1),
    "a frame": ([motions.Support(None, True)], [], 3),
    "a frame, heavy": ([motions.Support(None, True)], [LOAD], 2),
    "all": ([motions.Support(P0, True)], [], 0),
    "a bead on a wire": ([motions.Support(P0, False, np.array([1.0, 0.0, 0.0]))], [], 2),
    "a frame on a wire": ([motions.Support(P0, True, np.array([1.0, 0.0, 0.0]))], [], 1),
}


@pytest.mark.parametrize("case", COUNTS)
def test_the_motions_that_are_left(case):
    """Their number; a finite one moves no held point and changes no potential."""
    supports, loads, count = COUNTS[case]
    centre = np.array([0.2, -0.1, 0.3])
    found = motions.free(supports, loads, centre)
    assert len(found) == count
    cloud = np.random.default_rng(1).normal(size=(7, 3))
    for shift, turn in (np.split(motion, 2) for motion in found):
        generator = np.zeros((4, 4))
        generator[:3, :3] = np.cross(np.eye(3), -turn)
        generator[:3, 3] = shift - np.cross(turn, centre)
        from scipy.linalg import expm

        moved = expm(0.7 * generator)

        def of(points, moved=moved):
            return points @ moved[:3, :3].T + moved[:3, 3]

        for held in supports:
            if held.point is not None and held.slide is None:
                np.testing.assert_allclose(of(held.point), held.point, atol=1e-12)
            if held.point is not None and held.slide is not None:
                assert np.abs(np.cross(of(held.point) - held.point, held.slide)).max() < 1e-12
        for load in loads:
            assert np.sum((of(cloud) - cloud) @ load) == pytest.approx(0.0, abs=1e-11)


def test_a_pivot_has_the_derivatives_of_its_rotation():
    """First and second differences of the turned edge, along its own axes, one by one and two at a time."""
    rng = np.random.default_rng(3)
    across, nodes = np.array([-0.05, -0.02, 0.0, 0.02, 0.05]), np.arange(5)
    path = PosePath((Pose((0.0,) * 3, IDENTITY),))
    edge = PivotEdge("start", nodes, across, path, np.eye(3))
    axes, at = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix(), np.array([0.1, 0.2, -0.3])

    def placed(turn):
        frame = Rotation.from_rotvec(axes @ turn).as_matrix() @ axes
        return np.hstack([at + np.outer(across, frame[:, 0]), np.tile(frame[:, 1], (5, 1))])

    state, force, step = placed(np.zeros(3)), rng.normal(size=(5, 6)), 1e-4
    np.testing.assert_allclose(edge.axes(state), axes, atol=1e-12)
    np.testing.assert_allclose(edge.placed(state, Control()), state, atol=1e-12)
    unit = step * np.eye(3)
    first = [(placed(u) - placed(-u)) / (2.0 * step) for u in unit]
    np.testing.assert_allclose(np.moveaxis(edge.tangents(state, Control())[:, :, 3:], 2, 0), first, atol=1e-7)

    def work(turn):
        return float(np.sum(force * placed(turn)))

    second = np.array(
        [[(work(a + b) - work(a - b) - work(b - a) + work(-a - b)) / (4.0 * step**2) for a in unit] for b in unit]
    )
    whole = edge.coupling(state, force, Control()) + np.diag(edge.curvature(state, force, Control()))
    np.testing.assert_allclose(whole[3:, 3:], second, atol=1e-5)
    assert np.abs(second - np.diag(np.diag(second))).max() > 0.1
    assert not whole[:3].any()


def test_the_tangent_has_the_mixed_derivatives_of_a_pivot(monkeypatch):
    """What they add to the assembled tangent is the edge's own block, on its unknowns and nowhere else."""
    from shellref.path.newton import Equilibrium, Increments
    from shellref.shell.naghdi import NaghdiModel
    from shellref.shell.strip import build_strip

    options = ShellOptions()
    strip = build_strip(replace(HANGING, sections=("undeformed", "undeformed")), options)
    model = NaghdiModel(strip.body, options.stabilisation)
    equilibrium = Equilibrium(model, options)
    state = strip.initial_state(model.nodes)
    force = np.random.default_rng(5).normal(size=state.shape)

    def tangent():
        equilibrium.assemble(state, model.stress(state), force)
        matrix = equilibrium.matrix
        every = np.arange(equilibrium.unknowns, dtype=np.int32)
        return matrix.getValues(every, every)

    whole = tangent()
    monkeypatch.setattr(Increments, "couplings", lambda *given: [])
    change = whole - tangent()
    ((edge,), last) = equilibrium.supports.edges, slice(-3, None)
    block = edge.coupling(state, force, model.control)
    assert np.abs(block).max() > 0.01
    np.testing.assert_allclose(change[last, last], block, atol=1e-6)
    change[last, last] = 0.0
    assert np.abs(change).max() < 1e-6


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"holds": ("half", "all")}, "holds"),
        ({"holds": ("frame", "all")}, "holds"),
        ({"holds": ("all", "position")}, "end"),
        ({"clamp": "corners"}, "clamp"),
        ({"transverse_curvature": 3.0}, "holds"),
        ({"half_turns": 0, "sections": ("undeformed", "undeformed")}, "sections"),
        ({"slide": ((1.0, 0.0, 0.0), None)}, "slide"),
    ],
)
def test_what_cannot_be_held_is_refused_by_name(change, key):
    with pytest.raises(ShellInputError) as caught:
        replace(HANGING, **change)
    assert caught.value.key == key
