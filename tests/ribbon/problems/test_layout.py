"""Places, slices, columns and views name the same unknowns, in every formulation."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip, Wall
from ribbon.find.solve import build
from ribbon.problems.layout import ChainedLayout, MatrixLayout, MixedLayout, at_joints
from ribbon.thesis.matrix import MatrixProblem

SEGMENTS = 4


@pytest.fixture
def shape():
    rng = np.random.default_rng(2)
    return rng.normal(size=SEGMENTS + 1), 0.2 * rng.normal(size=SEGMENTS + 1)


def problem(formulation):
    lengths = np.array([0.1, 0.4, 0.3, 0.2])
    strip = Strip(1.0, 0.05, gamma=3.0)
    walls = () if formulation == "chained" else (Wall((0.0, -5.0, 0.0), (0.0, 1.0, 0.0), 20.0),)
    made = build(
        strip, Clamp(ruling="free"), Gravity((0, 1, 0)), walls=walls, segments=lengths, formulation=formulation
    )
    if formulation != "matrix":
        return made
    return MatrixProblem(strip, made.start, None, None, walls, made.gravity, made.energy, lengths)


@pytest.mark.parametrize("formulation", ["chained", "mixed", "matrix"])
def test_a_shape_is_stored_and_read_back(formulation, shape):
    made = problem(formulation)
    x = made.state(*shape)
    assert x.size == made.size == made.layout.size
    for wanted, found in zip(shape, at_joints(made.parameters(x), made.lengths), strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-14)
    if formulation != "matrix":
        for wanted, found in zip(shape, made.joint_values(x), strict=True):
            np.testing.assert_allclose(found, wanted, atol=1e-14)
        columns, slopes = made.parameter_map()
        np.testing.assert_allclose(
            np.einsum("pik,pk->pi", slopes, x[columns]), made.parameters(x), atol=1e-12, err_msg="linear"
        )


def test_every_column_of_a_glued_ribbon_has_one_name():
    layout = MixedLayout(SEGMENTS, plates=2)
    seen = np.zeros(layout.size, dtype=int)
    for part in (layout.omega, layout.eta, layout.slope, layout.heights):
        seen[part] += 1
    numbers = np.arange(float(layout.size))
    for view in (layout.positions(numbers), layout.quaternions(numbers)):
        seen[view.ravel().astype(int)] += 1
    assert (seen == 1).all()
    for i in (0, 2, -1):
        joint = layout.joint(i)
        assert list(joint.position) == list(layout.positions(numbers)[i])
        assert list(joint.quaternion) == list(layout.quaternions(numbers)[i])
        assert (joint.omega, joint.eta) == (numbers[layout.omega][i], numbers[layout.eta][i])
    assert list(layout.columns(7)) == list(numbers[layout.omega])
    assert layout.columns(0, 1, 2).tolist() == layout.positions(numbers).tolist()


def test_every_column_of_the_other_formulations_has_one_name():
    layout = MatrixLayout(SEGMENTS, plates=1)
    numbers = np.arange(float(layout.size))
    parts = layout.positions(numbers), layout.frames(numbers), layout.parameters(numbers), numbers[layout.heights]
    assert sorted(np.concatenate([part.ravel() for part in parts])) == list(numbers)
    assert list(numbers[layout.slope]) == list(layout.parameters(numbers)[:, 2])
    chained = ChainedLayout(SEGMENTS)
    numbers = np.arange(chained.size)
    assert sorted([*numbers[chained.bending], *numbers[chained.ruling]]) == list(numbers)
    assert list(numbers[chained.bending]) == [chained.omega, *numbers[chained.omega_slope]]
    assert list(numbers[chained.ruling]) == [chained.eta, *numbers[chained.eta_slope]]


def test_views_write_into_the_unknowns_and_refuse_others():
    layout = MixedLayout(SEGMENTS)
    x = np.zeros(layout.size)
    layout.positions(x)[:] += [1.0, 2.0, 3.0]
    assert x.sum() == 6.0 * (SEGMENTS + 1)
    assert list(x[layout.joint(-1).position]) == [1.0, 2.0, 3.0]
    with pytest.raises(ValueError, match="unknowns"):
        layout.positions(x[:-1])


def test_problems_without_rows_say_so_and_those_with_rows_count_them():
    assert problem("chained").row_count == 0
    assert problem("chained").block_slices() == {}
    assert problem("chained").anchor(np.zeros(10)) is None
    mixed = problem("mixed")
    assert (
        mixed.row_count == len(mixed.constraint_bounds()[0]) == len(mixed.constraints(mixed.state(*np.zeros((2, 5)))))
    )
    assert [len(free) for free in problem("chained").free_motions()] == [0, 0]
