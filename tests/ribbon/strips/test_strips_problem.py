"""The problem of several strips: rows, derivatives, multipliers of one strip, what is refused."""

import numpy as np
import pytest

from ribbon import Clamp, RibbonInputError, Strip
from ribbon.find.strips.assemble import Member, assembled, shapes
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.strips.between import Touching
from ribbon.problems.strips.joint import End, Joint
from ribbon.problems.strips.place import placed
from tests.ribbon.strips.strips_scenes import OBLIQUE, SECTION, UP, bigon, chain, cut, turn


def mixed_joints(energy):
    """Five strips of different lengths and stiffness with every kind of joint, and two places held apart."""
    sizes = (1.0, 0.7, 1.2, 0.9, 0.5)
    members = [
        Member(
            Strip(length=size, gamma=3.0 * size**3, natural_curvature=0.5, **SECTION), OBLIQUE if k == 0 else None,
            stiffness=1.0 + 0.5 * k, segments=4, curvature=(1.0 + k, 0.5), ruling=(0.1, 0.2),
        )
        for k, size in enumerate(sizes)
    ]  # fmt: skip
    joints = [
        Joint(End(0, -1), End(1, 0), "seamless"), Joint(End(1, -1), End(2, 0), "rigid", turn(1, 40.0)),
        Joint(End(2, -1), End(3, -1), "hinge", turn(0, 20.0)), Joint(End(3, 0), End(4, 0), "pin"),
    ]  # fmt: skip
    problem = assembled(members, joints, UP, energy, apart=0.01)
    touching = (Touching(0, 2, Pair(0.6, 0.01, 0.3, -0.01)), Touching(1, 3, Pair(0.4, 0.02, 0.6, 0.01, True)))
    problem = problem.with_changes(touching=touching)
    x = placed(problem, shapes(problem, members, None))
    return problem, x + 1e-3 * np.random.default_rng(3).normal(size=x.size)


@pytest.mark.parametrize("energy", ["wunderlich", "kirchhoff"])
def test_jacobian_and_hessian_are_those_of_the_values(energy):
    problem, x = mixed_joints(energy)
    rng = np.random.default_rng(5)
    way, rows = rng.normal(size=x.size), rng.normal(size=problem.row_count)
    step = 1e-6

    def slope(y):
        return problem.gradient(y) + problem.jacobian_matrix(y).T @ rows

    ahead, behind = x + step * way, x - step * way
    value = (problem.value(ahead) - problem.value(behind)) / (2 * step)
    assert value == pytest.approx(problem.gradient(x) @ way, rel=1e-7)
    rate = (problem.constraints(ahead) - problem.constraints(behind)) / (2 * step)
    assert np.abs(rate - problem.jacobian_matrix(x) @ way).max() < 1e-7 * np.abs(rate).max()
    bent = (slope(ahead) - slope(behind)) / (2 * step)
    assert np.abs(bent - problem.hessian_matrix(x, rows) @ way).max() < 1e-6 * np.abs(bent).max()


def test_strips_that_are_put_at_their_joints_meet_them():
    problem, _ = mixed_joints("wunderlich")
    members = [Member(part.strip, segments=4) for part in problem.parts]
    x = placed(problem, shapes(problem, members, [1.0] * 5))
    for name, where in problem.block_slices().items():
        if "position" in name or "frame" in name:
            assert np.abs(problem.constraints(x)[where]).max() < 1e-13, name


def test_every_unknown_and_row_is_eliminated_once_and_near_its_strip():
    problem, _ = mixed_joints("kirchhoff")
    column, row = problem.elimination()
    assert column.size == problem.size
    assert row.size == problem.row_count
    assert column.min() >= 0
    assert row.max() <= column.max() + 1


@pytest.mark.parametrize(
    ("members", "joints", "more", "named"),
    [
        (cut(2, 8, 1.0, 0.0), [Joint(End(0, 0), End(1, 0))], {}, "clamp holds this end"),
        (cut(2, 8, 1.0, 0.0), [*chain(2), Joint(End(1, 0), End(0, -1))], {}, "joined already"),
        (cut(2, 8, 1.0, 0.0), [Joint(End(0, -1), End(7, 0))], {}, "no end of a strip"),
        (cut(2, 8, 1.0, 0.0), [], {}, "held by no clamp"),
        (cut(2, 8, 1.0, 0.0, None), chain(2), {"gravity": UP}, "held by no clamp"),
        (bigon(30.0, 1)[0], bigon(30.0, 1)[1], {"apart": 0.01}, "held by no clamp"),
        ([], [], {}, "one strip"),
    ],
)
def test_what_cannot_be_is_refused(members, joints, more, named):
    with pytest.raises(RibbonInputError, match=named):
        assembled(members, joints, **more)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ((End(0, 0), End(1, 0), "glue"), "use one of"),
        ((End(0, 0), End(1, 0), "seamless"), "goes on"),
        ((End(0, -1), End(1, 0), "seamless", turn(1, 5.0)), "not turned"),
    ],
)
def test_a_joint_that_means_nothing_is_refused(arguments, named):
    with pytest.raises(RibbonInputError, match=named):
        Joint(*arguments)


def test_a_ruling_is_straight_where_an_edge_is_joined_and_free_elsewhere():
    members = cut(3, 9, 0.0, 0.0, Clamp())
    problem = assembled(members, [Joint(End(0, -1), End(1, 0)), Joint(End(1, -1), End(2, 0), "pin")])
    assert [(part.start_straight, part.end_straight) for part in problem.parts] == [
        (True, True), (True, False), (False, False),
    ]  # fmt: skip
    freed = assembled(members, chain(3, "rigid"), rulings=["free", "straight"])
    assert [(part.start_straight, part.end_straight) for part in freed.parts] == [
        (True, False), (False, True), (True, False),
    ]  # fmt: skip
