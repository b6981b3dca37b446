"""A dead force at the end of a shell, and an end that is guided: moves as one without turning."""

from dataclasses import replace

import numpy as np
import pytest

from shellref import Pose, ShellInputError, ShellProblem, ShellStatus, Waypoint
from shellref.shell.body import Control
from shellref.shell.clamps import PosePath, rotation
from shellref.shell.director import FREE, HELD, Increments
from shellref.shell.edges import RigidEdge
from shellref.shell.strip import build_strip

FRAME = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))  # t_x = -e_z, t_y = e_y, t_z = e_x
CANTILEVER = ShellProblem(
    width=0.05, thickness=5e-4, poisson=0.0, clamp_frame=FRAME, elements=(20, 2), tip=(0.0, -10.0, 0.0)
)
GUIDED = replace(CANTILEVER, end=Pose((0.0, 0.0, 0.0), FRAME), guided=True)
RNG = np.random.default_rng(14)

shell = pytest.mark.shell


def solve(problem, **more):
    pytest.importorskip("dolfinx")
    from shellref.path.solve import solve as solve_shell

    return solve_shell(problem, **more)


def test_nodes_that_move_together_are_three_unknowns():
    """P and its transpose are one map; the projection in rows is the same."""
    held, directors = np.zeros((7, 3), dtype=bool), np.full(7, FREE)
    together = np.arange(7) >= 4
    held[together], directors[together] = True, HELD
    edge = RigidEdge(
        "end", np.flatnonzero(together), np.eye(3), np.eye(3), PosePath((Pose((0, 0, 0), FRAME),)), np.eye(3)
    )
    found = Increments(held, directors, edges=(edge,))
    assert found.unknowns == 4 * 5 + 3
    normals = RNG.standard_normal((7, 3))
    state = np.hstack([np.zeros((7, 3)), normals / np.linalg.norm(normals, axis=1)[:, None]])
    bases = found.bases(state, Control())
    reduced, full = RNG.standard_normal(found.unknowns), RNG.standard_normal((7, 6))
    moved = found.expand(reduced, bases)
    assert np.ptp(moved[4:], axis=0) == pytest.approx(0.0)
    assert np.sum(moved * full) == pytest.approx(reduced @ found.reduce(full, bases))
    indptr, columns, values = found.projection(bases)
    rows = np.repeat(np.arange(42), np.diff(indptr))
    product = np.zeros(42)
    np.add.at(product, rows, values * reduced[columns])
    np.testing.assert_allclose(product.reshape(7, 6), moved, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"tip": (0.0, 1.0)}, "tip"),
        ({"tip": (0.0, float("nan"), 1.0)}, "tip"),
        ({"end": Pose((0.5, 0.0, 0.0), FRAME)}, "tip"),
        ({"end": Pose((0.5, 0.0, 0.0), FRAME), "slide": (None, (1.0, 0.0, 0.0))}, "tip"),  # the force is along -e_y
        ({"clamp": "free", "clamp_frame": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))}, "clamp"),
        ({"guided": True}, "guided"),
        ({"guided": 1.0, "end": Pose((0.5, 0.0, 0.0), FRAME)}, "guided"),
        ({"path": (Waypoint(tip=0.5), {"tip": "all"})}, "path.tip"),
    ],
)
def test_what_cannot_be_is_named(change, key):
    with pytest.raises(ShellInputError) as caught:
        replace(CANTILEVER, **change)
    assert caught.value.key == key


@shell
def test_a_column_between_a_clamp_and_one_that_slides_is_eulers_and_beyond():
    """A dead force along the slide does the work F . delta x of the only component that is free. The column leaves its
    straight shape at 4 pi^2 D w / l^2, and beyond it is the inflectional elastica of four quarters (A. E. H. Love 1927,
    article 263): F = 16 K(k)^2, end at 2 E / K - 1, middle 2 k / sqrt(F) . 2 aside, moment F / 2 of that."""
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipk

    column = replace(
        CANTILEVER, end=Pose((1.0, 0.0, 0.0), FRAME), slide=(None, (1.0, 0.0, 0.0)), tip=(-45.0, 0.0, 0.0),
        elements=(40, 2),
    )  # fmt: skip
    below, found = solve(replace(column, tip=(-39.0, 0.0, 0.0))), solve(column)
    assert below.section(0.5)["position"][1] == pytest.approx(0.0, abs=1e-9)
    assert below.stable
    assert found.stable
    m = brentq(lambda m: 16.0 * ellipk(m) ** 2 - 45.0, 1e-9, 0.9)
    aside = 4.0 * np.sqrt(m / 45.0)
    assert found.section(1.0)["position"] == pytest.approx([2.0 * ellipe(m) / ellipk(m) - 1.0, 0.0, 0.0], abs=1e-4)
    assert abs(found.section(0.5)["position"][1]) == pytest.approx(aside, rel=1e-3)
    assert found.clamps["start"]["force"] == pytest.approx([45.0, 0.0, 0.0], abs=1e-4)
    assert found.clamps["end"]["force"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-4)
    assert abs(found.clamps["end"]["moment"][2]) == pytest.approx(22.5 * aside, rel=1e-3)
    assert found.energy["tip"] == pytest.approx(45.0 * found.section(1.0)["position"][0], rel=1e-9)


def test_the_force_grows_with_the_weight_and_on_the_path():
    both = replace(CANTILEVER, gamma=3.0, up=(0.0, 1.0, 0.0))
    assert [(s.start.load, s.end.load, s.end.weight) for s in build_strip(both, options()).stages] == [(0.0, 1.0, 1.0)]
    halfway = replace(both, path=(Waypoint(tip=0.5),))
    assert [(s.end.load, s.end.weight) for s in build_strip(halfway, options()).stages] == [(0.5, 0.0), (1.0, 1.0)]


def options():
    from shellref import ShellOptions

    return ShellOptions()


@pytest.fixture(scope="module")
def guided():
    return solve(replace(GUIDED, gamma=4.0, up=(0.0, 1.0, 0.0), tip=(2.0, -10.0, 0.0)))


@shell
def test_the_start_carries_force_and_weight_and_the_guide_a_moment(guided):
    assert guided.status is ShellStatus.CONVERGED
    start, end = guided.clamps["start"], guided.clamps["end"]
    np.testing.assert_allclose(start["force"], [-2.0, 14.0, 0.0], atol=1e-5)
    np.testing.assert_allclose(end["force"], 0.0, atol=1e-5)
    lever = np.array(guided.section(1.0)["position"])
    weighed = np.cross(guided.surface.centreline(np.linspace(0.0, 1.0, 4001)), [0.0, -4.0, 0.0]).mean(axis=0)
    balance = start["moment"] + end["moment"] + np.cross(lever, [2.0, -10.0, 0.0]) + weighed
    np.testing.assert_allclose(balance, 0.0, atol=1e-4)
    assert guided.energy["tip"] == pytest.approx(-lever @ [2.0, -10.0, 0.0], rel=1e-12)
    assert guided.energy["total"] == pytest.approx(sum(guided.energy[k] for k in ("elastic", "gravity", "tip")))


@shell
def test_a_guided_edge_stays_straight_in_its_frame_and_is_objective(guided):
    edge = guided.surface.points[-1]
    np.testing.assert_allclose(np.diff(edge, axis=0)[:, :2], 0.0, atol=1e-12)
    np.testing.assert_allclose(guided.surface.directors[-1], [[0.0, 1.0, 0.0]] * len(edge), atol=1e-12)
    turn = rotation(np.array([0.3, -0.7, 0.4]))
    frame = tuple(map(tuple, (turn @ np.array(FRAME)).tolist()))
    problem = replace(
        guided.problem, clamp_frame=frame, end=Pose((7.0, 0.0, 0.0), frame), up=tuple(turn @ [0.0, 1.0, 0.0]),
        tip=tuple(turn @ [2.0, -10.0, 0.0]),
    )  # fmt: skip
    other = solve(problem)
    np.testing.assert_allclose(other.surface.points, guided.surface.points @ turn.T, atol=1e-7)


@shell
def test_a_guided_end_turns_along_a_path():
    """Twisted by 0.1 and pulled: the moment is G J of the angle, J = w h^3 / 3; clamped ends add some 0.5 w / l."""
    turn = rotation(np.array([0.1, 0.0, 0.0]))
    frame = tuple(map(tuple, (turn @ np.array(FRAME)).tolist()))
    found = solve(replace(GUIDED, end=Pose((0.0, 0.0, 0.0), frame), tip=(1.0, 0.0, 0.0)))
    assert found.status is ShellStatus.CONVERGED
    end = found.section(1.0)
    np.testing.assert_allclose(end["frame"], frame, atol=1e-9)
    np.testing.assert_allclose(end["position"][1:], 0.0, atol=1e-9)
    assert 0.0 < 1.0 - end["position"][0] < 1e-5
    assert 0.1 * 2.0 < found.clamps["end"]["moment"][0] < 0.1 * 2.0 * 1.05  # G J = 2 (1 - nu) D w at nu = 0


@shell
def test_lateral_buckling_under_an_end_load_is_prandtl_s():
    """F l^2 = 4.0126 sqrt(B C) (Prandtl 1899), B = Y I, C = 2 (1 - nu) (1 - 0.63 h / w) D w, for w / l -> 0."""
    pytest.importorskip("dolfinx")
    from shellref.path.buckling import buckling

    rod = 4.0126 * np.sqrt(2.0 * (1.0 - 0.63 * 0.05))
    strip = replace(CANTILEVER, width=0.02, thickness=1e-3, elements=(20, 4), tip=(0.0, 0.0, -1.4 * rod))
    found = buckling(strip)
    assert found.status is ShellStatus.CONVERGED
    assert 1.0 < 1.4 * found.critical < 1.02
