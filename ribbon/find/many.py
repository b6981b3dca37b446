"""Many ribbons that are held at s = 0 only, of one energy and one set of segments, solved as one batch."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon.boundary import Clamp
from ribbon.errors import RibbonInputError
from ribbon.find.relax import RESIDUAL_TOLERANCE
from ribbon.find.solve import build, solve, solve_from, starting_shapes
from ribbon.find.stability import ACTIVE_DISTANCE, INDIFFERENT
from ribbon.loads import Gravity
from ribbon.problems.chained import ChainedProblem
from ribbon.result import Equilibrium, Status
from ribbon.solvers import chained_many, newton
from ribbon.solvers.problem import force_scale
from ribbon.strip import Strip

FloatArray = NDArray[np.float64]
#: Cases that a thread takes at a time.
TOGETHER = 64
_run: Any = chained_many.run


@dataclass(frozen=True)
class Many:
    """Equilibria of a batch, case by case; lengths in l, energies in D w / l.

    problems: what was solved; x: unknowns (k, n); status; residual, iterations and lowest_eigenvalue (k,) as of an
    `Equilibrium`; again: the cases (numbers) that were not plainly stable and were solved by `ribbon.solve`, with what
    it found; seconds: wall time of all.
    """

    problems: tuple[ChainedProblem, ...]
    x: FloatArray
    status: tuple[Status, ...]
    residual: FloatArray
    iterations: NDArray[np.int64]
    lowest_eigenvalue: FloatArray
    again: dict[int, Equilibrium]
    seconds: float

    def __len__(self) -> int:
        return len(self.problems)

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Which (k,) are converged and stable."""
        return np.array([status is Status.CONVERGED for status in self.status])

    def ends(self) -> FloatArray:
        """Positions (k, 3) of the ends s = l."""
        return np.array([problem.joints(x)[0][-1] for problem, x in zip(self.problems, self.x, strict=True)])

    def energies(self) -> FloatArray:
        """Bending, natural-curvature and gravity energy (k, 3); with an end force 0 and its own too (k, 5)."""
        return np.array([problem.energy_parts(x) for problem, x in zip(self.problems, self.x, strict=True)])

    def equilibrium(self, number: int) -> Equilibrium:
        """A case as `ribbon.solve` gives it."""
        if number in self.again:
            return self.again[number]
        return solve_from(self.problems[number], self.x[number], near=True)


def solve_many(
    strips: Sequence[Strip],
    clamp: Clamp | Sequence[Clamp] | None = None,
    gravity: Gravity | Sequence[Gravity | None] | None = None,
    *,
    energy: str = "wunderlich",
    segments: int | ArrayLike = 20,
    stiffness: str | None = None,
    in_plane: bool | None = None,
    tip: ArrayLike | Sequence[ArrayLike | None] | None = None,
    warm: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Many:
    """Equilibria of many ribbons that are held at s = 0 only, from their stress-free shapes, in one kernel.

    Parameters
    ----------
    strips: one for each case; clamp, gravity, tip: one for all, or one for each, as in `ribbon.solve`.
    energy, segments, stiffness, in_plane: the same for all.
    warm: a case begins at the solution of the one before it, in the order given. Quicker along a curve of states, but
        where there are several states the answer then depends on the neighbours; without, each case is solved as
        `ribbon.solve` does (which begins with fewer segments where there are 80 or more).
    threads: how many at once; None: the usable cores. progress: called with (finished, all).

    What does not plainly converge to a stable state goes to `ribbon.solve`. Raises `RibbonInputError` on bad input,
    naming the case.
    """
    clock = time.perf_counter()
    shared: dict[str, Any] = {"energy": energy, "segments": segments, "stiffness": stiffness, "in_plane": in_plane}
    problems = _problems(strips, clamp, gravity, tip, {**shared, "formulation": "chained"})
    if not problems:
        return Many((), np.empty((0, 0)), (), np.empty(0), np.empty(0, dtype=np.int64), np.empty(0), {}, 0.0)
    starts = np.array([_start(problem) for problem in problems])
    xs, found = starts.copy(), np.zeros((len(problems), chained_many.FOUND))
    given = _arguments(problems)
    gradients = np.empty_like(xs)
    slices = np.array_split(np.arange(len(problems)), max(1, -(-len(problems) // TOGETHER)))
    done = 0
    with ThreadPoolExecutor(threads or len(os.sched_getaffinity(0))) as pool:
        rest = (xs, *given, newton.MOST, INDIFFERENT, ACTIVE_DISTANCE, warm, gradients, found)
        for cases, _ in zip(slices, pool.map(lambda cases: _run(cases, *rest), slices), strict=True):
            done += cases.size
            if progress is not None:
                progress(done, len(problems))
    status = [Status.CONVERGED] * len(problems)
    again: dict[int, Equilibrium] = {}
    residual, eigenvalue = found[:, chained_many.RESIDUAL].copy(), found[:, chained_many.LOWEST].copy()
    iterations = found[:, chained_many.ITERATIONS].astype(np.int64)
    scale = np.array([force_scale(problem) for problem in problems])
    residual /= scale
    for i in np.flatnonzero((found[:, chained_many.STABLE] == 0.0) | ~(residual <= RESIDUAL_TOLERANCE)):
        problem = problems[i]
        other = solve(
            problem.strip, problem.clamp, problem.gravity, tip=problem.tip, formulation="chained", **shared,
        )  # fmt: skip
        again[int(i)] = other
        xs[i], status[i], residual[i] = other.x, other.status, other.residual
        eigenvalue[i], iterations[i] = other.lowest_eigenvalue, other.iterations
    return Many(
        tuple(problems), xs, tuple(status), residual, iterations, eigenvalue, again, time.perf_counter() - clock
    )


def _each(key: str, value: Any, count: int, several: bool) -> list[Any]:
    if not several:
        return [value] * count
    if len(value) != count:
        raise RibbonInputError(key, f"{len(value)} of them", f"one for all, or one for each of the {count} strips")
    return list(value)


def _problems(
    strips: Sequence[Strip], clamp: Any, gravity: Any, tip: Any, keywords: dict[str, Any]
) -> list[ChainedProblem]:
    count = len(strips)
    clamps = _each("clamp", clamp, count, isinstance(clamp, (list, tuple)))
    gravities = _each("gravity", gravity, count, isinstance(gravity, (list, tuple)))
    several = isinstance(tip, (list, tuple, np.ndarray)) and any(t is None or np.ndim(t) == 1 for t in tip)
    tips = _each("tip", tip, count, several)
    problems: list[Any] = []
    for number, (strip, held, up, force) in enumerate(zip(strips, clamps, gravities, tips, strict=True)):
        try:
            problem: Any = build(strip, held, up, tip=force, **keywords)
        except RibbonInputError as error:
            raise RibbonInputError(f"case {number}: {error.key}", error.value, error.remedy) from None
        if problem.size != (problems[0].size if problems else problem.size):
            raise RibbonInputError(f"case {number}", problem.size, "another number of unknowns than the first case")
        problems.append(problem)
    return problems


def _start(problem: ChainedProblem) -> FloatArray:
    omega, eta = next(iter(starting_shapes(problem, "natural", 0.0)))
    return problem.state(omega, eta)


def _arguments(problems: Sequence[ChainedProblem]) -> tuple[Any, ...]:
    """The arguments of `chained_many.run` between the unknowns and the number of steps, a row for each problem."""
    each = [newton.arguments(problem) for problem in problems]
    lengths, code = each[0][0], each[0][1]
    sections, natural, curvatures, poissons, gammas, ups, forces, pulled, frames = (
        np.array([row[k] for row in each]) for k in range(2, 11)
    )
    lowers, uppers = (np.array([row[k] for row in each]) for k in (12, 13))
    tolerances = np.array([newton.TOLERANCE * force_scale(problem) for problem in problems])
    return (
        lengths, code, sections, natural, curvatures, poissons, gammas, ups, forces, pulled, frames, each[0][11],
        lowers, uppers, each[0][14], tolerances, newton.EXACT * tolerances,
    )  # fmt: skip
