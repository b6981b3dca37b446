"""Edges that slide, turn or have a free section: derivatives, places, reactions; a tape spring in uniform bending."""

from dataclasses import replace

import numpy as np
import pytest

from shellref import Pose, ShellInputError, ShellOptions, ShellProblem, Waypoint
from shellref.shell.body import Control
from shellref.shell.clamps import PosePath, rotation
from shellref.shell.edges import FlatEdge, RigidEdge
from shellref.shell.midsurface import Cylinder
from tests.reference.tape_section import Section

RNG = np.random.default_rng(15)
NU = 0.3
Z = (0.0, 0.0, 1.0)


def frame(angle, whole=None):
    """Turned about t_x by `angle`, and as a whole by the rotation vector `whole`."""
    turned = rotation(np.array([angle, 0.0, 0.0]))
    return tuple(map(tuple, (turned if whole is None else rotation(np.array(whole)) @ turned).tolist()))


def tape(turn, sections=("undeformed", "undeformed"), size=0.1, elements=(3, 6), **more):
    """The seed's tape (1000 mm x 60 mm, 0.15 mm, R = 50 mm), cut to `size` of its length; its ends turn by -+ turn / 2
    from the straight tape, the second slides along z."""
    straight = Waypoint(start=Pose((0, 0, 0), frame(0.0)), end=Pose(Z, frame(0.0)))
    given = {
        "width": 0.06 / size, "thickness": 1.5e-4 / size, "poisson": NU, "transverse_curvature": 20.0 * size,
        "elements": elements, "grading": (1.0, 1.0), "clamp_frame": frame(-0.5 * turn),
        "end": Pose(Z, frame(0.5 * turn)), "slide": (None, Z), "sections": sections, "path": (straight,),
    }  # fmt: skip
    return ShellProblem(**{**given, **more})


# -- kinematics -------------------------------------------------------------------------------------------------------


def _path():
    one = Pose((0.1, 0.2, 0.3), frame(0.2, (0.3, -0.2, 0.5)))
    return PosePath(
        (one, Pose((0.2, 0.1, 0.3), tuple(map(tuple, (np.array(one.frame) @ np.array(frame(0.7))).tolist()))))
    )


def _rest(count=7):
    v = np.linspace(-0.3, 0.3, count)
    return Cylinder(curvature_across=2.0).place(np.zeros(count), v)


def _rigid(turning=True):
    slides = np.linalg.qr(RNG.standard_normal((3, 2)))[0].T
    axis = np.array(_path().poses[0].frame)[:, 0] if turning else None
    return RigidEdge("end", np.arange(2, 9), *_rest(), _path(), slides, axis)


def _flat():
    return FlatEdge("end", np.arange(2, 9), 3, _path(), np.array([[0.6, 0.0, 0.8]]))


def _state(edge, control):
    """An admissible state of eleven nodes, the edge away from where its clamp put it."""
    state = np.hstack([RNG.standard_normal((11, 3)), RNG.standard_normal((11, 3))])
    points, directors = _rest()
    there, at = edge.path.at(control.move, int(control.leg))
    state[edge.nodes] = np.hstack([there + points @ at.T, directors @ at.T]) + 0.05 * RNG.standard_normal((7, 6))
    state[edge.nodes] = edge.placed(state, control)
    return state


def _moved(edge, state, control, q):
    out = state.copy()
    move = np.where(edge.columns >= 0, np.append(q, 0.0)[edge.columns], 0.0)
    out[edge.nodes] += np.einsum("mic,mc->mi", edge.tangents(state, control), move)
    out[edge.nodes] = edge.placed(out, control)
    return out


@pytest.mark.parametrize("make", [_rigid, lambda: _rigid(False), _flat], ids=["turning", "sliding", "flat"])
@pytest.mark.parametrize("move", [0.4, 1.3, -0.6])
def test_tangents_and_curvature_are_derivatives_of_admissible_states(make, move):
    """Also where the clamp goes beyond its path; what is placed stays; first and second differences, of order 2."""
    edge, control = make(), Control(move=move)
    state = _state(edge, control)
    np.testing.assert_allclose(edge.placed(state, control), state[edge.nodes], atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(state[edge.nodes, 3:], axis=1), 1.0, atol=1e-13)
    q, force = RNG.standard_normal(edge.unknowns), RNG.standard_normal((11, 6))
    move_by = np.where(edge.columns >= 0, np.append(q, 0.0)[edge.columns], 0.0)
    first = float(np.sum(np.einsum("mic,mc->mi", edge.tangents(state, control), move_by) * force[edge.nodes]))
    second = float(edge.curvature(state, force, control) @ q**2)
    errors = []
    for t in (4e-3, 2e-3):
        low, here, high = (float(np.sum(_moved(edge, state, control, x * q) * force)) for x in (-t, 0.0, t))
        errors.append((abs((high - low) / (2 * t) - first), abs((high - 2 * here + low) / t**2 - second)))
    for one, other in zip(*errors, strict=True):
        assert other < 1e-7 or one / other == pytest.approx(4.0, rel=0.1)


def test_a_turning_edge_finds_its_angle_and_its_slide():
    edge, control = _rigid(), Control(move=0.5)
    position, at = edge.path.at(0.5)
    c = position + edge.slides.T @ np.array([0.3, -0.7])
    turned = rotation(2.5 * edge.axis) @ at
    state = np.zeros((11, 6))
    state[edge.nodes] = np.hstack([c + edge.arms @ turned.T, edge.directors @ turned.T])
    np.testing.assert_allclose(edge.placed(state, control), state[edge.nodes], atol=1e-13)
    np.testing.assert_allclose(edge.point(state), c, atol=1e-13)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"slide": (None, (0.0, 0.0, 2.0))}, "slide"),
        ({"slide": (0.0, 0.0, 1.0)}, "slide"),
        ({"sections": ("undeformed", "open")}, "sections"),
        ({"turns": True, "sections": ("free", "free")}, "sections"),
        ({"end": None, "path": ()}, "end"),
        ({"guided": True}, "end"),
        ({"turns": 1}, "turns"),
        ({"clamp": "corners"}, "clamp"),
    ],
)
def test_what_cannot_be_is_named(change, key):
    with pytest.raises(ShellInputError) as caught:
        replace(tape(0.1), **change)
    assert caught.value.key == key


# -- equilibria -------------------------------------------------------------------------------------------------------


def solve(problem, stable=True, **options):
    pytest.importorskip("dolfinx")
    from shellref.path.solve import solve as solve_shell

    given = {"arc_length": "never", "kick": False, "first_step": 0.5, "max_step": 0.5}
    found = solve_shell(problem, ShellOptions(**{**given, **options}))
    assert found.status == "converged" or (not stable and found.status == "unstable"), found.message
    return found


@pytest.mark.shell
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_uniform_bending_is_the_sections_own(sense):
    """Free sections: M(k) of the section's own equation up to its greatest moment, order 4 across; w/h = 400.

    In equal sense the edges are pressed, and near the greatest moment the tape would rather twist.
    """
    for k in (1e-4, 0.01, 0.016):
        errors = []
        for across in (4, 8):
            found = solve(tape(sense * k, ("free", "free"), elements=(3, across)), stable=sense < 0)
            p = found.problem
            exact = Section(0.5 * p.width, p.thickness, p.transverse_curvature, NU).moment(sense * k)
            moment = -found.clamps["start"]["moment"] * p.width
            assert moment[1:] == pytest.approx([0.0, 0.0], abs=1e-6)
            assert -found.clamps["end"]["moment"][0] * p.width == pytest.approx(-moment[0], rel=1e-7)
            assert found.clamps["end"]["force"] == pytest.approx(np.zeros(3), abs=1e-6)
            errors.append(abs(moment[0] / exact - 1.0))
        assert errors[0] < 6e-3
        assert errors[1] < 4e-4


@pytest.mark.shell
def test_reactions_are_derivatives_of_the_energy():
    """Moments of both clamps by the turn, force of a sliding hinge by its displacement; what is free has none."""
    turn, t = -0.02, 1e-4
    here, low, high = (solve(tape(x)) for x in (turn, turn - t, turn + t))
    moment = 0.5 * (here.clamps["end"]["moment"][0] - here.clamps["start"]["moment"][0])
    slope = (high.energy["total"] - low.energy["total"]) / (2 * t)
    assert moment == pytest.approx(slope, rel=1e-5)
    assert abs(here.clamps["end"]["force"][2]) < 1e-6 * abs(moment)

    def hinged(down):
        straight = Waypoint(start=Pose((0, 0, 0), frame(0.0)), end=Pose(Z, frame(0.0)))
        return tape(
            0.0, size=0.3, elements=(8, 4), turns=True, end=Pose((0.0, down, 1.0), frame(0.0)), path=(straight,)
        )

    down = 0.02
    here, low, high = (solve(hinged(x)) for x in (down, down - t, down + t))
    force, moment = here.clamps["end"]["force"], here.clamps["end"]["moment"]
    assert force[1] == pytest.approx((high.energy["total"] - low.energy["total"]) / (2 * t), rel=1e-5)
    assert np.abs([force[0], force[2], moment[0]]).max() < 1e-6 * abs(force[1])
    balance = here.clamps["start"]["moment"] + moment + np.cross(here.surface.centreline(np.array(1.0)), force)
    assert balance == pytest.approx(np.zeros(3), abs=1e-6 * abs(force[1]))
    assert here.surface.centreline(np.array(1.0))[:2] == pytest.approx([0.0, down], abs=1e-12)


@pytest.mark.shell
def test_a_tape_moved_as_a_whole_is_the_same():
    """At rest its energy is zero to rounding; bent, turned as a whole in space, it has the same energy and moment."""
    rest = solve(tape(0.0, path=()))
    assert abs(rest.energy["total"]) < 1e-12
    whole = np.array([0.4, -1.1, 0.7])
    turn = rotation(whole)
    place = np.array([0.3, -0.2, 0.9])

    def moved(pose):
        return Pose(
            tuple(place + turn @ np.array(pose.position)), tuple(map(tuple, (turn @ np.array(pose.frame)).tolist()))
        )

    for sections in (("undeformed", "undeformed"), ("free", "undeformed")):
        here = tape(-0.015, sections)
        there = replace(
            here, clamp_position=moved(here.start).position, clamp_frame=moved(here.start).frame, end=moved(here.end),
            slide=(None, tuple(turn @ np.array(Z))),
            path=(Waypoint(start=moved(here.path[0].start), end=moved(here.path[0].end)),),
        )  # fmt: skip
        one, other = solve(here), solve(there)
        assert other.energy["total"] == pytest.approx(one.energy["total"], rel=1e-9)
        moment = turn @ one.clamps["start"]["moment"]
        assert other.clamps["start"]["moment"] == pytest.approx(moment, abs=1e-8 * np.abs(moment).max())


@pytest.mark.shell
def test_the_tangent_of_held_edges_is_the_second_derivative_of_the_energy():
    """q . H q against differences along admissible states out of balance: slide, turn and free section at once."""
    pytest.importorskip("dolfinx")
    from shellref.fenics import dolfinx_api as api
    from shellref.path.newton import Equilibrium
    from shellref.shell.director import retract
    from shellref.shell.naghdi import NaghdiModel
    from shellref.shell.strip import build_strip

    straight = Waypoint(start=Pose((0, 0, 0), frame(0.0)), end=Pose(Z, frame(0.0)))
    problem = tape(0.0, ("free", "undeformed"), turns=True, slide=((0.0, 0.6, 0.8), Z), path=(straight,),
                   thickness=0.05, end=Pose((0.0, 0.1, 1.0), frame(0.0)))  # fmt: skip
    options = ShellOptions()
    strip = build_strip(problem, options)
    model = NaghdiModel(strip.body, options.stabilisation, api.communicator("self"))
    e, stage = Equilibrium(model, options), strip.stages[0]
    model.set_control(stage.at(0.7))
    state = strip.initial_state(model.nodes)
    state[:, :3] += 0.02 * np.sin(3.0 * state[:, [2, 0, 1]])
    state[:, 3:] += 0.05 * np.cos(2.0 * state[:, :3])
    state = e.target(stage, 0.7, retract(state, np.zeros_like(state)))
    stress = model.stress(state)
    force = model.force(state, stress)
    bases = e.assemble(state, stress, force)
    edges = e.increments.edges
    first = e.unknowns - sum(edge.unknowns for edge in edges)
    q = np.zeros(e.unknowns)
    q[first:] = RNG.standard_normal(e.unknowns - first)
    from shellref.fenics import petsc_api as petsc

    exact = float(q @ petsc.multiply(e.matrix, q))
    slope = float(e.increments.reduce(force, bases) @ q)
    curvature = e.increments.constraint_curvature(state, force, model.control)
    errors = []
    for t in (4e-4, 2e-4, 1e-4):
        level = [
            model.energies(e.target(stage, 0.7, retract(state, e.increments.expand(x * q, bases)))).total
            for x in (-t, 0.0, t)
        ]
        errors.append(
            (abs((level[2] - level[0]) / (2 * t) - slope), abs((level[0] - 2 * level[1] + level[2]) / t**2 - exact))
        )
    for k in (0, 1):
        assert np.log2(errors[0][k] / errors[1][k]) == pytest.approx(2.0, abs=0.15)
    # extrapolated by its order, the difference sees the edges' own curvature
    (_, coarse), (_, fine) = errors[-2:]
    assert abs(4.0 * fine - coarse) / 3.0 < 0.02 * abs(curvature @ q**2)
