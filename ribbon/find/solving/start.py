"""Where a search begins: omega and eta at the joints, as they were given, or guessed from what the strip is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ribbon import law
from ribbon.errors import RibbonInputError
from ribbon.find import contacts, seeds
from ribbon.find.bands import whole as band
from ribbon.find.solving.request import Progress, Seed, Values
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.solvers.problem import FloatArray
from ribbon.strip import finite, known

#: omega and eta (p + 1,) at the joints.
Shape = tuple[FloatArray, FloatArray]

#: Mismatch (l, rad) up to which a fitted shape is a promising one, and most shapes to start from.
_FITS = 1e-2
_MOST_STARTS = 5


def shapes(problem: Problem, seed: Seed, progress: Progress | None = None) -> Iterable[Shape]:
    """The shapes to start from, the most promising first; several only if none was given.

    `RibbonInputError` for a seed that is none."""
    s = seeds.joints(problem.lengths)
    rulings = _values("seed_ruling", seed.ruling)
    known("seed_ruling", seed.ruling, rulings)
    eta = seeds.held_straight(problem, seeds.sampled(rulings, s))
    slopes = np.abs(np.diff(eta)) / problem.lengths * problem.half_width
    if slopes.max(initial=0.0) >= 1.0 and not problem.fields.free:
        remedy = "rulings of the starting shape cross inside the strip: keep |eta'| below 2 / width"
        raise RibbonInputError("seed_ruling", seed.ruling, remedy)
    if not isinstance(seed.curvature, str):
        shape = given(problem, seed.curvature, seed.ruling)
        if problem.end is None or problem.walls:  # a fit knows no walls
            return _from_the_walls(problem, *shape)
        return [seeds.brought(_mixed(problem), *shape)]
    if seed.curvature != "natural":
        raise RibbonInputError("seed_curvature", seed.curvature, 'a number, a list of numbers, or "natural"')
    return _natural(problem, eta, progress)


def _natural(problem: Problem, eta: FloatArray, progress: Progress | None) -> Iterable[Shape]:
    """The stress-free shape, and where that says nothing what is held there."""
    curvature, s = problem.strip.curvature, seeds.joints(problem.lengths)
    natural = law.at(curvature, s) if law.is_table(curvature) else seeds.sampled(curvature, s)  # type: ignore[arg-type]
    if problem.closure is not None:
        if problem.closure.sign < 0:
            return [band.moebius(_mixed(problem), progress)]
        return [(band.circle(problem)[0], eta)]
    if problem.end is None:
        layer = seeds.hanging(problem)
        if problem.fields.free and any(law.values(problem.strip.twist)) and not eta.any():
            eta = law.at(problem.strip.twist, s)
        return _from_the_walls(problem, natural if layer is None else layer, eta)
    guesses = seeds.guesses(_mixed(problem))
    if problem.has_natural_curvature:  # which coils, and may end far above what the arcs do
        guesses = [(natural, eta), *guesses]
    return _fitted_in_turn(_mixed(problem), guesses)


def given(problem: Problem, curvature: Values, ruling: Values) -> Shape:
    """omega and eta (p + 1,) of a seed as it was given."""
    s = seeds.joints(problem.lengths)
    values = np.array(_values("seed_curvature", curvature)) * problem.strip.length
    known("seed_curvature", curvature, values)
    omega = seeds.sampled(tuple(values), s)
    return omega, seeds.held_straight(problem, seeds.sampled(_values("seed_ruling", ruling), s))


def _from_the_walls(problem: Problem, omega: FloatArray, eta: FloatArray) -> list[Shape]:
    """The shape; before it those that bend aside where it is straight and meets a wall head on."""
    aside = contacts.bent_aside(_mixed(problem), omega, eta) if problem.walls and problem.end is None else []
    return [*aside, (omega, eta)]


def _fitted_in_turn(problem: MixedProblem, guesses: list[Shape]) -> Iterator[Shape]:
    """The shapes fitted to what is held, those that fit first; each is fitted when it is asked for."""
    poor = []
    count = 0
    for shape in guesses:
        omega, eta, missing = seeds.fitted(problem, *shape)
        if missing > _FITS:
            poor.append((omega, eta))
        elif count < _MOST_STARTS:
            count += 1
            yield omega, eta
    yield from poor[: _MOST_STARTS - count]


def _values(key: str, value: Values) -> tuple[float, ...]:
    if isinstance(value, (tuple, list)):
        if not value:
            raise RibbonInputError(key, value, "one number, or values from s = 0 to s = l")
        return tuple(finite(key, v) for v in value)
    return (finite(key, value),)


def _mixed(problem: Problem) -> MixedProblem:
    """A problem with rows as what it is."""
    assert isinstance(problem, MixedProblem)
    return problem
