"""Many ribbons that are held at s = 0 only, of one energy and one set of segments, solved as one batch.

No process, no file and no picture for a case: threads take slices of the cases, and nearly all of their time is spent
in kernels that release the interpreter's lock (`ribbon.solvers.chained_newton`, `ribbon.solvers.eigen`).
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon.boundary import Clamp
from ribbon.errors import RibbonInputError
from ribbon.find import nested, stability
from ribbon.find.inertia import Pencil
from ribbon.find.relax import RESIDUAL_TOLERANCE
from ribbon.find.solve import build, solve, solve_from, starting_shapes
from ribbon.loads import Gravity
from ribbon.problems.chained import ChainedProblem
from ribbon.result import Equilibrium, Status
from ribbon.solvers import choose
from ribbon.solvers.problem import Minimum
from ribbon.solvers.threads import alone
from ribbon.strip import Strip

FloatArray = NDArray[np.float64]
#: Cases that a thread takes at a time.
TOGETHER = 64


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


@alone
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
    """Equilibria of many ribbons that are held at s = 0 only, from their stress-free shapes, several at once.

    Parameters
    ----------
    strips: one for each case; clamp, gravity, tip: one for all, or one for each, as in `ribbon.solve`.
    energy, segments, stiffness, in_plane: the same for all.
    warm: a case begins at the solution of the one before it, in the order given. Quicker along a curve of states, but
        where there are several states the answer then depends on the neighbours; without, each case is solved as
        `ribbon.solve` does.
    threads: how many at once; None: the usable cores. progress: called with (finished, all).

    What does not plainly converge to a stable state goes to `ribbon.solve`. Raises `RibbonInputError` on bad input,
    naming the case.
    """
    clock = time.perf_counter()
    shared: dict[str, Any] = {"energy": energy, "segments": segments, "stiffness": stiffness, "in_plane": in_plane}
    problems = _problems(strips, clamp, gravity, tip, {**shared, "formulation": "chained"})
    if not problems:
        return Many((), np.empty((0, 0)), (), np.empty(0), np.empty(0, dtype=np.int64), np.empty(0), {}, 0.0)
    ends: list[_End] = []
    slices = [problems[i : i + TOGETHER] for i in range(0, len(problems), TOGETHER)]
    with ThreadPoolExecutor(threads or len(os.sched_getaffinity(0))) as pool:
        contexts = [copy_context() for _ in slices]  # the solver asked for around this
        for part in pool.map(lambda some, context: context.run(_solved, some, warm), slices, contexts):
            ends += part
            if progress is not None:
                progress(len(ends), len(problems))
    again = {}
    for i, end in enumerate(ends):
        if not end.plain:
            problem = problems[i]
            again[i] = found = solve(
                problem.strip, problem.clamp, problem.gravity, tip=problem.tip, formulation="chained", **shared
            )  # fmt: skip
            ends[i] = _End(found.x, found.residual, found.iterations, found.lowest_eigenvalue, False)
    return Many(
        tuple(problems),
        np.array([end.x for end in ends]),
        tuple(again[i].status if i in again else Status.CONVERGED for i in range(len(ends))),
        np.array([end.residual for end in ends]),
        np.array([end.iterations for end in ends]),
        np.array([end.eigenvalue for end in ends]),
        again,
        time.perf_counter() - clock,
    )


@dataclass(frozen=True)
class _End:
    """Where a case ended; plain: converged, and its lowest eigenvalue is clearly positive."""

    x: FloatArray
    residual: float
    iterations: int
    eigenvalue: float
    plain: bool


def _solved(problems: Sequence[ChainedProblem], warm: bool) -> list[_End]:
    """The cases one after the other; almost all of it in kernels that release the interpreter's lock."""
    ends: list[_End] = []
    before: FloatArray | None = None
    for problem in problems:
        end = None if before is None else _end(problem, choose.minimise(problem, before, near=True))
        if end is None or not end.plain:
            end = _end(problem, nested.minimum(problem, _start(problem)))
        before = end.x if warm and end.plain else None
        problem._cache.clear()
        ends.append(end)
    return ends


def _end(problem: ChainedProblem, found: Minimum) -> _End:
    eigenvalue, plain = np.nan, found.residual <= RESIDUAL_TOLERANCE
    if plain:
        pencil = Pencil(problem, found.x, stability.held_at(problem, found.x))
        eigenvalue = pencil.lowest()[0] if pencil.free else np.inf
        plain = eigenvalue > stability.INDIFFERENT * pencil.largest()
    return _End(found.x, found.residual, found.iterations, eigenvalue, plain)


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
