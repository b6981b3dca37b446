"""Continuation on systems of closed form: a closed branch, forks near each other and double, a fork's side branch."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from compare.continuation import bordered, locate
from compare.continuation.correct import first_point
from compare.continuation.deflate import deflated
from compare.continuation.finer import relocated
from compare.continuation.follow import follow, leaving, switched
from compare.continuation.point import Options, Point
from compare.continuation.system import Unbounded
from tests.compare.continuation.toys import Dense, Toy

CIRCLE = Toy(lambda z, t: np.array([z[0] ** 2 + (t - 0.5) ** 2 - 0.16]), 1)


def forks(*places):
    """One pitchfork in each unknown, at these t; the trivial branch is stable before all of them."""
    return Toy(lambda z, t: np.array([x * (p - t + x * x) for x, p in zip(z, places, strict=True)]), len(places))


def cornered():
    """A double eigenvalue at t = 0.5 with square symmetry: four branches along the axes, four along the diagonals."""
    return Toy(lambda z, t: np.array([z[0] * (0.5 - t + z @ z) + z[0] ** 3, z[1] * (0.5 - t + z @ z) + z[1] ** 3]), 2)


def test_a_circle_closes_and_its_folds_are_where_they_are():
    start = first_point(CIRCLE, np.array([0.4]), 0.5, 1e-12)
    run = follow(start, options=Options(tolerance=1e-12))
    assert run.ended == "closed"
    assert [s.kind for s in run.specials] == ["fold", "fold"]
    assert [s.point.t for s in run.specials] == pytest.approx([0.9, 0.1], abs=1e-12)
    assert abs(run.points[-1].arc - 2.0 * np.pi * 0.4) < 0.2
    assert max(abs(p.z[0] ** 2 + (p.t - 0.5) ** 2 - 0.16) for p in run.points) < 1e-11
    assert {p.unstable for p in run.points} == {0, 1}


@pytest.mark.parametrize("apart", [0.3, 1e-4, 5e-5])
def test_two_forks_however_near_are_two(apart):
    system = forks(0.4, 0.4 + apart)
    run = follow(first_point(system, np.zeros(2), 0.0, 1e-12))
    assert run.ended == "range"
    assert [s.point.t for s in run.specials] == pytest.approx([0.4, 0.4 + apart], abs=1e-10)
    for k, special in enumerate(run.specials):
        assert special.kind == "branch_point"
        assert abs(special.modes[k, 0]) == pytest.approx(1.0, abs=1e-5)
        found = switched(special, size=0.3 * np.sqrt(apart))
        assert sorted(np.sign(p.z[k]) for p in found) == [-1.0, 1.0]
        assert all(p.t == pytest.approx(0.4 + k * apart + p.z[k] ** 2, abs=1e-9) for p in found)


def test_a_double_eigenvalue_is_one_point_with_two_modes_and_eight_branches():
    system = cornered()
    run = follow(first_point(system, np.zeros(2), 0.0, 1e-12))
    (special,) = run.specials
    assert special.kind == "branch_point"
    assert special.change == 2
    assert special.modes.shape == (2, 2)
    assert special.point.t == pytest.approx(0.5, abs=1e-10)
    found = switched(special)
    angles = sorted(round(np.degrees(np.arctan2(p.z[1], p.z[0])) % 45.0, 3) % 45.0 for p in found)
    assert len(found) == 8
    assert angles == pytest.approx([0.0] * 8, abs=1e-3)


def mixed(turn, a, b, c):
    """A double eigenvalue at t = 0.5 with the energy a x^4 / 4 + b x^2 y^2 / 2 + c y^4 / 4, axes turned."""
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])

    def gradient(z, t):
        x, y = axes @ z
        return axes.T @ np.array([x * (0.5 - t + a * x * x + b * y * y), y * (0.5 - t + b * x * x + c * y * y)])

    return Toy(gradient, 2)


@pytest.mark.parametrize("sizes", [(2.0, 1.0, 2.0), (1.0, 3.0, 1.0), (1.0, 0.2, 1.0), (3.0, 1.0, 1.5), (1.2, 1.0, 2.5)])
@pytest.mark.parametrize("turn", [0.0, 0.2, 0.7, 1.3])
def test_all_four_pairs_leave_a_double_point_however_its_modes_lie(sizes, turn):
    """Pure ones along both axes, mixed ones where a x^2 + b y^2 = b x^2 + c y^2."""
    a, b, c = sizes
    system = mixed(turn, a, b, c)
    (special,) = follow(first_point(system, np.zeros(2), 0.0, 1e-12)).specials
    found, circle = leaving(special)
    slope = np.arctan(np.sqrt((a - b) / (c - b)))
    exact = np.sort((np.array([0.0, 0.5 * np.pi, slope, -slope])[:, None] + [0.0, np.pi]).ravel() % (2.0 * np.pi))
    angles = np.sort([(np.arctan2(p.z[1], p.z[0]) - turn + 1e-6) % (2.0 * np.pi) - 1e-6 for p in found])
    assert not circle
    assert angles == pytest.approx(exact, abs=1e-5)
    assert max(np.abs(system.residual(p.z, p.t)).max() for p in found) < 1e-9


def test_of_a_circle_of_branches_one_is_followed_and_is_stable():
    system = mixed(0.4, 1.0, 1.0, 1.0)
    (special,) = follow(first_point(system, np.zeros(2), 0.0, 1e-12)).specials
    found, circle = leaving(special)
    assert circle
    (first,) = found
    run = follow(first)
    assert run.ended == "range"
    assert run.specials == ()
    assert {p.unstable for p in run.points} == {0}
    last = run.points[-1].z
    assert np.hypot(*last) == pytest.approx(np.sqrt(0.5), abs=1e-9)
    assert last / np.hypot(*last) == pytest.approx(first.z / np.hypot(*first.z), abs=1e-7)


def test_a_fork_is_found_again_on_the_branch_that_leaves_it():
    system = forks(0.4)
    run = follow(first_point(system, np.array([0.7]), 0.89, 1e-12, along=-1.0), options=Options(tolerance=1e-12))
    (special,) = run.specials
    assert special.kind == "branch_point"
    assert special.change == 0
    assert special.point.t == pytest.approx(0.4, abs=1e-9)
    assert special.point.z[0] == pytest.approx(0.0, abs=1e-8)
    assert run.points[-1].z[0] == pytest.approx(-np.sqrt(0.6), abs=1e-8), "it goes on to the other side"
    found = switched(special)
    assert sorted(np.sign(p.t - 0.4) for p in found) == [-1.0, 1.0]
    assert max(abs(p.z[0]) for p in found) < 1e-8


def test_an_imperfect_fork_folds_and_is_not_leapt_over():
    bent = Toy(lambda z, t: np.array([z[0] * (0.4 - t + z[0] ** 2) + 1e-3]), 1)
    exact = 0.4 + 3.0 * (1e-3 / 2.0) ** (2.0 / 3.0)
    start = first_point(bent, np.array([0.77]), 0.99, 1e-12, along=-1.0)
    run = follow(start, options=Options(tolerance=1e-12))
    (fold,) = run.specials
    assert fold.kind == "fold"
    assert fold.point.t == pytest.approx(exact, abs=1e-10)
    assert run.ended == "range"
    assert run.points[-1].t == 1.0
    assert 0.0 < run.points[-1].z[0] < 0.01
    assert relocated(fold, Options(tolerance=1e-12)).point.t == pytest.approx(exact, abs=1e-10)


def test_the_bordered_solve_is_exact_where_the_matrix_is_singular():
    rng = np.random.default_rng(3)
    basis = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    for least in (1.0, 1e-8, 1e-15):
        matrix = basis @ np.diag([least, 1.0, -2.0, 3.0, 0.5, 4.0]) @ basis.T
        g, c, f = rng.normal(size=(3, 6))
        x, y = bordered.solve(Dense(matrix), g, c, 0.3, f, 0.7)
        whole = np.block([[matrix, g[:, None]], [c[None, :], np.array([[0.3]])]])
        assert np.append(x, y) == pytest.approx(np.linalg.solve(whole, np.append(f, 0.7)), rel=1e-7)


def test_eigenvalues_near_zero_are_those_of_the_pencil():
    rng = np.random.default_rng(4)
    matrix = rng.normal(size=(12, 12))
    matrix = matrix + matrix.T
    system = Toy(lambda z, t: matrix @ z, 12)
    values, vectors = bordered.near_zero(system, Dense(matrix), 3)
    exact = np.linalg.eigvalsh(matrix)
    exact = np.sort(exact[np.argsort(np.abs(exact))[:3]])
    assert values == pytest.approx(exact, rel=1e-6)
    assert matrix @ vectors == pytest.approx(vectors * values, abs=1e-4)


def test_deflation_finds_each_root_once_and_then_none():
    system = forks(0.1, 0.2)  # at t = 1: x in {0, +-sqrt(0.9)}, y in {0, +-sqrt(0.8)}
    known = []
    guess = np.array([0.3, 0.2])
    for _ in range(40):
        found = deflated(system, guess, 1.0, known, 1e-12)
        if found is None:
            break
        known.append(found[0])
    sides = {(round(z[0] / np.sqrt(0.9)), round(z[1] / np.sqrt(0.8))) for z in known}
    assert len(sides) == len(known) >= 5
    for z in known:
        assert np.abs(system.residual(z, 1.0)).max() < 1e-11
        a, b = deflated(system, z + 1e-3, 1.0, [], 1e-12)
        assert a == pytest.approx(z, abs=1e-8)
        assert b == int(abs(z[0]) < 0.1) + int(abs(z[1]) < 0.1)


@dataclass(frozen=True)
class _Resting(Unbounded):
    """z = 0 at every t."""

    size: int = 1

    def residual(self, z, t):
        return z.copy()

    def norm(self, residual):
        return float(np.abs(residual).max())

    def rate(self, z, t):
        return np.zeros(1)

    def factor(self, z, t):
        return _One()

    def mass(self, v):
        return v

    def stepped(self, z, dz):
        return z + dz

    def energy(self, z, t):
        return 0.0


@dataclass(frozen=True)
class _Chattering(_Resting):
    """It has a condition that each change of it breaks again 1e-5 further on."""

    since: float | None = None

    def slacks(self, z, t):
        behind = None if self.since is None else abs(t - self.since)
        return np.array([0.05 - t if behind is None else 1e3 * behind * (1e-5 - behind)])

    def beyond(self, z, t, condition, directions):
        return replace(self, since=t), z, directions, "changes"


@dataclass(frozen=True)
class _LettingGo(_Resting):
    """It has twelve conditions of which each changes at t = 0.05, once."""

    gone: frozenset[int] = frozenset()

    def slacks(self, z, t):
        return np.array([t - 0.05 if k in self.gone else 0.05 - t for k in range(12)])

    def beyond(self, z, t, condition, directions):
        return replace(self, gone=self.gone | {condition}), z, directions, "lets go"


@dataclass(frozen=True)
class _Cornered(_Resting):
    """Two conditions are met at t = 0.05, of which a change of one alone breaks the other, and back: with both changed
    the branch goes on, and a third one is met at 0.5."""

    gone: frozenset[int] = frozenset()

    def slacks(self, z, t):
        past = t - 0.05
        both = {0, 1} <= self.gone
        pair = [past if both else (abs(past) if k in self.gone else -past) for k in range(2)]
        return np.array([*pair, t - 0.5 if 2 in self.gone else 0.5 - t])

    def beyond(self, z, t, condition, directions):
        return replace(self, gone=self.gone ^ {condition}), z, directions, f"{condition} changes"


@dataclass(frozen=True)
class _Dipping(_Resting):
    """Condition 0 is met at t = 0.05, where 1 is kept: that one was broken from 0.03 to 0.045, and is from 0.052 on."""

    gone: frozenset[int] = frozenset()

    def slacks(self, z, t):
        own = np.array([0.05 - t, -1e4 * (t - 0.03) * (t - 0.045) * (t - 0.052)])
        return np.where([k in self.gone for k in range(2)], 1.0, own)

    def beyond(self, z, t, condition, directions):
        return replace(self, gone=self.gone | {condition}), z, directions, f"{condition} changes"


def test_what_is_broken_first_is_found_though_it_is_kept_where_another_one_is_met():
    run = follow(first_point(_Dipping(), np.zeros(1), 0.0, 1e-10), options=Options(step=0.1))
    assert [(special.condition, round(special.point.t, 9)) for special in run.specials] == [(1, 0.03), (0, 0.05)]


@dataclass(frozen=True)
class _Ending(_Resting):
    """Nothing is known beyond t = 0.05."""

    def slacks(self, z, t):
        return np.array([0.05 - t])

    def beyond(self, z, t, condition, directions):
        return self, z, directions, "ends"


@dataclass(frozen=True)
class _One:
    unstable: int = 0

    def solve(self, b):
        return b

    solve_transposed = solve


def test_a_branch_ends_where_its_system_knows_none_beyond():
    run = follow(first_point(_Ending(), np.zeros(1), 0.0, 1e-10))
    assert run.ended == "spread"
    (last,) = run.specials
    assert (last.kind, last.what, last.change) == ("event", "ends", 0)
    assert run.points[-1].t == pytest.approx(0.05, abs=1e-12)
    assert max(point.t for point in run.points) <= 0.05 + 1e-12


def test_a_branch_on_which_nothing_keeps_to_a_condition_ends_there():
    """Sadowsky's twisted strip on moving elements went to and fro over one bound for all points that it was allowed."""
    start = first_point(_Chattering(), np.zeros(1), 0.0, 1e-10)
    run = follow(start, options=Options(least=1e-3))
    assert run.ended == "stuck"
    assert len(run.points) < 30
    assert all(special.kind == "event" for special in run.specials)


def test_conditions_that_change_at_one_place_once_each_do_not_end_a_branch():
    """A strip that lies on a wall and lets go of it everywhere at once."""
    run = follow(first_point(_LettingGo(), np.zeros(1), 0.0, 1e-10))
    assert run.ended == "range"
    assert {special.condition for special in run.specials} == set(range(12))
    assert [special.point.t for special in run.specials] == pytest.approx([0.05] * 12, abs=1e-9)
    assert run.points[-1].t == 1.0


def test_conditions_that_are_met_at_one_place_change_together():
    """Sadowsky's arch on moving elements: two bounds of rulings that are mirror images, each broken by the other."""
    run = follow(first_point(_Cornered(), np.zeros(1), 0.0, 1e-10))
    assert run.ended == "range"
    assert [special.condition for special in run.specials] == [0, 1, 2]
    assert run.specials[0].point is run.specials[1].point
    assert [special.point.t for special in run.specials] == pytest.approx([0.05, 0.05, 0.5], abs=1e-9)


@dataclass(frozen=True)
class _Curled(_Resting):
    """Its density ceases to be convex at t = 0.4; it has an unstable mode where `unstable`."""

    unstable: int = 1

    def factor(self, z, t):
        return _One(self.unstable)

    def convexity(self, z, t):
        return 0.4 - t


@pytest.mark.parametrize(("unstable", "ended", "last"), [(1, "unposed", 0.4), (0, "range", 1.0)])
def test_an_unstable_branch_ends_where_its_density_ceases_to_be_convex(unstable, ended, last):
    run = follow(first_point(_Curled(unstable=unstable), np.zeros(1), 0.0, 1e-10))
    assert run.ended == ended
    assert run.points[-1].t == pytest.approx(last, abs=1e-10)
    assert [special.kind for special in run.specials] == (["event"] if unstable else [])


@dataclass(frozen=True)
class _CurledLate(_Curled):
    """Stable where its density ceases to be convex, with an unstable mode from t = 0.6 on."""

    def factor(self, z, t):
        return _One(int(t > 0.6))


@pytest.mark.parametrize("most", [0.01, 0.1, 0.5])
def test_a_stable_branch_without_convexity_ends_where_its_modes_change(most):
    """However long its steps are: also with both in one."""
    run = follow(first_point(_CurledLate(), np.zeros(1), 0.0, 1e-10), options=Options(step=most, most=most))
    assert run.ended == "unposed"
    assert run.points[-1].t == pytest.approx(0.6, abs=2e-7)
    assert [special.condition for special in run.specials] == [locate.LOST]


@dataclass(frozen=True)
class _Rays(_Resting):
    """At (0, 0) a branch that comes with z, nearly at a fold, ends; with condition 0 changed what is kept is that
    branch gone back, with condition 1 a branch on, along which t falls a little; with both none."""

    gone: frozenset[int] = frozenset()

    def rate(self, z, t):
        return np.array([{frozenset({1}): 10.0}.get(self.gone, -50.0)])

    def slacks(self, z, t):
        side = {frozenset({0}): -z[0], frozenset({1}): z[0], frozenset({0, 1}): -1.0}.get(self.gone, -z[0])
        return np.array([side, side])

    def beyond(self, z, t, condition, directions):
        return replace(self, gone=self.gone | {condition}), z, directions, f"{condition} changes"


def test_of_rays_near_a_fold_the_one_that_goes_on_is_taken():
    """dt alone is -0.0004 of the ray that was come along, gone back, and -0.002 of the one that goes on."""
    size = np.hypot(1.0, 0.02)
    here = Point(_Rays(), np.zeros(1), 0.0, (np.array([1.0 / size]), 0.02 / size), 0, 0.0, 0, 0.0)
    ray, _, chosen = locate._together(here, [0, 1])
    assert chosen == (1,)
    assert (ray.tangent[0][0], ray.tangent[1]) == pytest.approx((10.0 / np.sqrt(101.0), -1.0 / np.sqrt(101.0)))
