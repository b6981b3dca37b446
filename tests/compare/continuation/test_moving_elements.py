"""Special points on elements that move with the shape: their own elements, not those of the point before."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from compare.continuation.correct import first_point
from compare.continuation.finer import relocated
from compare.continuation.follow import follow
from compare.continuation.placed import on_its_elements
from compare.continuation.point import Options
from tests.compare.continuation.toys import Toy

#: Stiffness that an element of length 1 gives to what is beside its joint, and where the strip has its fork.
HELD, FORK = 4.0, 0.5


@dataclass(frozen=True)
class Graded(Toy):
    """A passage at y = t and a mode x that forks at `FORK`; elements of length `h` with a joint at `placed` add the
    stiffness HELD h (y - placed)^2 + h^2 / 10 to x, which the strip does not have."""

    placed: float = 0.0
    h: float = 1.0

    @classmethod
    def at(cls, placed: float, h: float) -> Graded:
        def gradient(z, t):
            x, y = z
            extra = HELD * h * (y - placed) ** 2 + 0.1 * h * h
            return np.array([x * (FORK - t + extra + x * x), y - t + HELD * h * (y - placed) * x * x])

        return cls(gradient, 2, placed, h)

    def moved(self, z, t, directions):
        if abs(z[1] - self.placed) < 1e-9:
            return self, z, directions
        return Graded.at(float(z[1]), self.h), z, directions

    def finer(self, z, t, directions):
        return Graded.at(self.placed, 0.5 * self.h), z, directions


def test_a_fork_is_located_on_elements_that_stand_at_its_own_passage():
    start = first_point(Graded.at(0.0, 0.5), np.zeros(2), 0.0, 1e-12)
    (special,) = follow(start, options=Options(most=0.2)).specials
    meshes = [special]
    for _ in range(2):
        again = relocated(meshes[-1])
        assert again is not None
        meshes.append(again)
    for one, h in zip(meshes, (0.5, 0.25, 0.125), strict=True):
        beside = one.point.z[1] - one.point.system.placed
        assert abs(beside) < 0.03
        assert one.point.t == pytest.approx(FORK + HELD * h * beside**2 + 0.1 * h * h, abs=1e-9)
    errors = [one.point.t - FORK for one in meshes]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


def test_a_fork_that_is_out_of_reach_on_finer_elements_is_walked_to():
    start = first_point(Graded.at(0.0, 0.5), np.zeros(2), 0.0, 1e-12)
    (special,) = follow(start, options=Options(most=0.02)).specials
    again = relocated(special)
    assert again is not None
    assert special.point.t - again.point.t > 3.0 * special.reach
    assert again.point.t == pytest.approx(FORK + 0.1 * 0.25**2, abs=1e-5)


def test_elements_that_stay_leave_a_special_point_as_it_is():
    fork = Toy(lambda z, t: np.array([z[0] * (FORK - t + z[0] ** 2)]), 1)
    (special,) = follow(first_point(fork, np.zeros(1), 0.0, 1e-12)).specials
    assert on_its_elements(special) is special


def test_a_fork_that_the_elements_of_the_point_before_hold_shut_is_seen():
    """Where they hold it shut at every step: moved, they have it behind the point at once."""
    start = first_point(Graded.at(0.0, 1.1), np.zeros(2), 0.0, 1e-12)
    run = follow(start, options=Options(most=0.1))
    (special,) = run.specials
    assert special.point.t == pytest.approx(FORK + 0.1 * 1.1**2, abs=5e-3)
    assert [p.unstable for p in run.points] == [int(p.t > special.point.t) for p in run.points]
