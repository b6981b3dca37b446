"""Factors along the strip: inertia against dense eigenvalues, solutions against the matrix, pivots that must wait."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Closure, Gravity, Strip, Wall
from ribbon.solvers.frontal import Pattern
from ribbon.solvers.saddle import Saddle
from tests.ribbon.problems.test_mixed import CASES, problem

THICK = Strip(1.0, 0.1, 0.4, gamma=5.0, thickness=0.01)
BODIES = {
    **CASES,
    "free start": {"start": None, "end": Clamp((0.1, 0.2, 0.3))},
    "floating over a wall": {"start": None, "walls": (Wall((0, 0, 0.1), (0, 0, 1.0)),)},
    "kirchhoff, bends in its plane": {
        "energy": "kirchhoff",
        "strip": THICK,
        "end": Clamp((0.1, 0.2, 0.3)),
        "in_plane": True,
    },
    "finite, moebius": {
        "energy": "finite",
        "strip": THICK,
        "start": None,
        "closure": Closure("moebius"),
        "gravity": None,
        "in_plane": True,
    },
    "clamped moebius": {"start": Clamp(), "closure": Closure("moebius"), "gravity": Gravity((0, 1, 0))},
}


@pytest.mark.parametrize("segments", [2, 5, 13])
@pytest.mark.parametrize("body", BODIES)
def test_inertia_and_solutions_are_those_of_the_dense_matrix(body, segments):
    rng = np.random.default_rng(segments)
    changes = dict(BODIES[body])
    lengths = rng.uniform(0.5, 1.5, segments)
    changes.setdefault("lengths", lengths / lengths.sum())
    p = problem(**changes)
    lower, upper = p.bounds()
    joints = p.lengths.size + 1
    structure = Saddle(p, lower < upper)
    told = 0
    for shift in (0.0, 0.3, 1e3):
        x = p.state(3.0 * rng.normal(size=joints), 0.1 * rng.normal(size=joints)) + 0.05 * rng.normal(size=p.size)
        x = np.clip(x, 0.9 * lower, 0.9 * upper)
        rows = 10.0 ** rng.uniform(-2, 2) * rng.normal(size=p.row_count)
        soft = rng.uniform(1e-6, 1e-2, size=p.row_count)
        factor = structure.factor(p.hessian(x, rows), p.jacobian(x), shift, soft)
        free = structure.free
        h = p.hessian_matrix(x, rows).toarray()[np.ix_(free, free)] + shift * np.eye(structure.unknowns)
        a = p.jacobian_matrix(x).toarray()[:, free]
        dense = np.block([[h, a.T], [a, -np.diag(soft)]])
        values = np.linalg.eigvalsh(dense)
        if np.abs(values).min() > 1e-12 * np.abs(values).max():
            told += 1
            assert (factor.negative, factor.zero) == ((values < 0).sum(), 0)
        b = rng.normal(size=len(dense))
        solution = factor.solve(b)
        size = np.abs(dense).max() * np.abs(solution).max() + np.abs(b).max()
        assert np.abs(dense @ solution - b).max() <= 1e-14 * size
    assert told >= 2


def test_a_pivot_that_is_small_beside_what_comes_later_waits_for_it():
    # 1e-9 on the diagonal beside 1: eliminated on its own the entry behind would lose nine digits
    one, other = np.array([0, 0, 1]), np.array([0, 1, 1])
    values = np.array([1e-9, 1.0, 0.5])
    factor = Pattern(one, other, np.array([0, 1])).factor(values)
    assert factor.delayed == 1
    assert factor.negative == 1
    dense = np.array([[1e-9, 1.0], [1.0, 0.5]])
    assert factor.solve(np.array([1.0, 2.0])) == pytest.approx(np.linalg.solve(dense, [1.0, 2.0]), rel=1e-14)
    both = Pattern(one, other, np.array([0, 0])).factor(values)
    assert (both.delayed, both.negative) == (0, 1)


def test_a_row_that_repeats_another_is_zero_or_soft():
    one, other = np.array([0, 0, 0, 1, 2]), np.array([0, 1, 2, 1, 2])
    values = np.array([1.0, 1.0, 1.0, 0.0, 0.0])
    pattern = Pattern(one, other, np.array([0, 0, 1]))
    factor = pattern.factor(values)
    assert (factor.negative, factor.zero) == (1, 1)
    soft = pattern.factor(values, np.array([1, 2]))
    assert (soft.negative, soft.zero) == (2, 0)


def test_a_band_matrix_of_any_kind_fits_however_much_must_wait():
    # zero diagonals and far couplings: nothing can be taken until the partners come, fronts and room grow
    n = 300
    rng = np.random.default_rng(5)
    one = np.concatenate([np.arange(n), np.arange(n // 2)])
    other = np.concatenate([np.arange(n), np.arange(n // 2) + n // 2])
    values = np.concatenate([np.where(np.arange(n) < n // 2, 0.0, rng.normal(size=n)), rng.normal(size=n // 2)])
    factor = Pattern(one, other, np.arange(n)).factor(values)
    dense = np.zeros((n, n))
    dense[one, other] = values
    dense[other, one] = values
    assert factor.negative == (np.linalg.eigvalsh(dense) < 0).sum()
    assert factor.delayed > n
    b = rng.normal(size=(n, 2))
    assert dense @ factor.solve(b) == pytest.approx(b, abs=1e-9)


def test_values_that_are_not_finite_are_said():
    pattern = Pattern(np.array([0]), np.array([0]), np.array([0]))
    assert not pattern.factor(np.array([np.nan])).finite


@pytest.mark.parametrize("seed", range(4))
def test_entries_and_touched_unknowns_are_sorted_by_group(seed):
    rng = np.random.default_rng(seed)
    n, k, groups = 40, 150, 7
    group = rng.integers(0, groups, n)
    group[:groups] = np.arange(groups)
    one, other = rng.integers(-1, n, k), rng.integers(0, n, k)
    found = Pattern(one, other, group)
    kept = np.nonzero(one >= 0)[0]
    first = np.minimum(group[one[kept]], group[other[kept]])
    assert np.array_equal(found.taken, kept[np.argsort(first, kind="stable")])
    assert np.array_equal(found.entries, np.searchsorted(np.sort(first), np.arange(groups + 1)))
    for g in range(groups):
        here = found.taken[found.entries[g] : found.entries[g + 1]]
        touched = np.unique(np.concatenate([one[here], other[here], np.nonzero(group == g)[0]]))
        assert np.array_equal(found.touched[found.touches[g] : found.touches[g + 1]], touched)


def test_factors_that_live_do_not_share_their_room():
    p = problem(**CASES["two clamps by rows, wall and plate"])
    lower, upper = p.bounds()
    structure = Saddle(p, lower < upper)
    x, rows = p.state(np.ones(p.lengths.size + 1), np.zeros(p.lengths.size + 1)), np.ones(p.row_count)
    right = np.linspace(1.0, 2.0, structure.unknowns + structure.count)

    def factor(shift):
        return structure.factor(p.hessian(x, rows), p.jacobian(x), shift)

    one = factor(1.0)
    first = one.solve(right)
    other = factor(50.0)
    assert one.filled.left is not other.filled.left
    assert np.array_equal(one.solve(right), first)
    room = other.filled.left
    del other
    third = factor(9.0)
    assert third.filled.left is room
    assert np.array_equal(one.solve(right), first)
    assert not np.array_equal(third.solve(right), first)
