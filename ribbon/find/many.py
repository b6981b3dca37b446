"""Many ribbons that are held at s = 0 only, of one energy and one set of segments, solved as one batch.

No process, no file and no picture for a case: threads take slices of the cases, and most of their time is spent in
kernels that release the interpreter's lock (`ribbon.solvers.chained_newton`, `ribbon.solvers.eigen`). Each case goes
the way of `ribbon.solve`, and ends in the same digits.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon.boundary import Clamp
from ribbon.errors import RibbonInputError
from ribbon.find.solving import coarse, search, start
from ribbon.find.solving.assemble import assembled
from ribbon.find.solving.request import How, Request, Values
from ribbon.find.solving.request import Seed as _Seed
from ribbon.find.solving.verdict import judged
from ribbon.loads import Gravity
from ribbon.notes import Note
from ribbon.problems.chained import ChainedProblem
from ribbon.result import Equilibrium, Status
from ribbon.solvers import choose
from ribbon.solvers.budget import within
from ribbon.strip import Strip
from ribbonbench.system import cores
from ribbonbench.threads import alone

FloatArray = NDArray[np.float64]
#: Cases that a thread takes at a time.
TOGETHER = 64


#: How the starting shape of a case is given: omega in 1/l or "natural", and eta, as to `ribbon.solve`.
Seed = tuple[Values | str, Values]


@dataclass(frozen=True)
class Many:
    """Equilibria of a batch, case by case; lengths in l, energies in D w / l.

    found: as `ribbon.solve` gives them; x: unknowns (k, n); residual, iterations and lowest_eigenvalue (k,); again: the
    cases (numbers) that are not plainly stable; seconds: wall time of all.
    """

    found: tuple[Equilibrium, ...]
    seconds: float

    def __len__(self) -> int:
        return len(self.found)

    @property
    def problems(self) -> tuple[ChainedProblem, ...]:
        """What was solved."""
        return tuple(state.problem for state in self.found)  # type: ignore[misc]

    @property
    def x(self) -> FloatArray:
        """Unknowns (k, n)."""
        return np.array([state.x for state in self.found]).reshape(len(self), -1)

    @property
    def status(self) -> tuple[Status, ...]:
        """How each ended."""
        return tuple(state.status for state in self.found)

    @property
    def residual(self) -> FloatArray:
        """KKT residuals (k,)."""
        return np.array([state.residual for state in self.found])

    @property
    def iterations(self) -> NDArray[np.int64]:
        """Steps of the minimiser (k,)."""
        return np.array([state.iterations for state in self.found], dtype=np.int64)

    @property
    def lowest_eigenvalue(self) -> FloatArray:
        """Of the Hessians (k,)."""
        return np.array([state.lowest_eigenvalue for state in self.found])

    @property
    def again(self) -> dict[int, Equilibrium]:
        """The cases (numbers) that are not converged, not stable, or indifferent."""
        return {i: state for i, state in enumerate(self.found) if not _is_plain(state)}

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Which (k,) are converged and stable."""
        return np.array([state.ok for state in self.found], dtype=bool)

    def ends(self) -> FloatArray:
        """Positions (k, 3) of the ends s = l."""
        return np.array([state.joints[0][-1] for state in self.found])

    def energies(self) -> FloatArray:
        """Bending, natural-curvature and gravity energy (k, 3); with an end force 0 and its own too (k, 5)."""
        return np.array([state.problem.energy_parts(state.x) for state in self.found])

    def equilibrium(self, number: int) -> Equilibrium:
        """A case as `ribbon.solve` gives it."""
        return self.found[number]


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
    seeds: Sequence[Seed] | None = None,
    warm: bool = False,
    budget: float | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Many:
    """Equilibria of many ribbons that are held at s = 0 only, several at once.

    Parameters
    ----------
    strips: one for each case; clamp, gravity, tip: one for all, or one for each, as in `ribbon.solve`.
    energy, segments, stiffness, in_plane: the same for all.
    seeds: (seed_curvature, seed_ruling) of each case as in `ribbon.solve`; None: the stress-free shapes.
    warm: a case begins at the solution of the one before it, in the order given. Quicker along a curve of states, but
        where there are several states the answer then depends on the neighbours; without, each case is solved as
        `ribbon.solve` does, to the last digit.
    budget: time in s on the processor for each case, as in `ribbon.solve`.
    threads: how many at once; None: the usable cores. progress: called with (finished, all).

    Raises `RibbonInputError` on bad input, naming the case.
    """
    clock = time.perf_counter()
    if seeds is not None and len(seeds) != len(strips):
        raise RibbonInputError("seeds", len(seeds), f"one for each of the {len(strips)} strips, or None")
    count = len(strips)
    clamps: Sequence[Clamp | None] = clamp if isinstance(clamp, Sequence) else [clamp] * count
    gravities: Sequence[Gravity | None] = gravity if isinstance(gravity, Sequence) else [gravity] * count
    several = isinstance(tip, (list, tuple, np.ndarray)) and any(t is None or np.ndim(t) == 1 for t in tip)
    tips = cast(Sequence[ArrayLike | None], tip if several else [tip] * count)
    for key, each in (("clamp", clamps), ("gravity", gravities), ("tip", tips)):
        if len(each) != count:
            raise RibbonInputError(key, f"{len(each)} of them", f"one for all, or one for each of the {count} strips")

    def requested(number: int) -> Request:
        return Request.of(
            strips[number], clamps[number], gravities[number], tip=tips[number], energy=energy, segments=segments,
            stiffness=stiffness, in_plane=in_plane, formulation="chained",
        )  # fmt: skip

    problems = _problems(requested, count)
    starts = [_start(number, problem, seeds) for number, problem in enumerate(problems)]
    given = [seeds is not None and not isinstance(seeds[number][0], str) for number in range(count)]
    cases = list(zip(problems, starts, given, strict=True))
    slices = [cases[i : i + TOGETHER] for i in range(0, len(cases), TOGETHER)]
    workers = threads or cores()
    states: list[Equilibrium] = []

    def gather(part: list[Equilibrium]) -> None:
        states.extend(part)
        if progress is not None:
            progress(len(states), len(problems))

    if workers == 1 or len(slices) < 2:
        for some in slices:
            gather(_solved(some, warm, budget))
        return Many(tuple(states), time.perf_counter() - clock)
    with ThreadPoolExecutor(workers) as pool:
        contexts = [copy_context() for _ in slices]  # the solver asked for around this
        for part in pool.map(lambda some, context: context.run(_solved, some, warm, budget), slices, contexts):
            gather(part)
    return Many(tuple(states), time.perf_counter() - clock)


def _solved(
    cases: Sequence[tuple[ChainedProblem, FloatArray, bool]], warm: bool, budget: float | None
) -> list[Equilibrium]:
    """The cases (problem, start, whether its shape was given) one after the other; almost all of it in kernels that
    release the interpreter's lock."""
    done: list[Equilibrium] = []
    before: FloatArray | None = None
    for problem, x, given in cases:
        with within(budget):
            state = None if before is None else judged(problem, choose.minimise(problem, before, near=True), How())
            if state is None or not _is_plain(state):
                state = search.from_state(problem, x, How())
                state = state if given else coarse.lowest(state, How())
        before = state.x if warm and _is_plain(state) else None
        problem._cache.clear()
        done.append(state)
    return done


def _is_plain(state: Equilibrium) -> bool:
    """Converged, and the lowest eigenvalue is clearly positive."""
    return state.ok and state.stable is True and Note.INDIFFERENT not in state.notes


def _problems(requested: Callable[[int], Request], count: int) -> list[ChainedProblem]:
    problems: list[ChainedProblem] = []
    for number in range(count):
        with _named(number):
            problem = assembled(requested(number))
        assert isinstance(problem, ChainedProblem)
        if problem.size != (problems[0].size if problems else problem.size):
            raise RibbonInputError(f"case {number}", problem.size, "another number of unknowns than the first case")
        problems.append(problem)
    return problems


def _start(number: int, problem: ChainedProblem, seeds: Sequence[Seed] | None) -> FloatArray:
    seed = _Seed() if seeds is None else _Seed(*seeds[number])
    with _named(number):
        omega, eta = next(iter(start.shapes(problem, seed)))
    return problem.state(omega, eta)


@contextlib.contextmanager
def _named(number: int) -> Iterator[None]:
    """What is refused inside is said of this case."""
    try:
        yield
    except RibbonInputError as error:
        raise RibbonInputError(f"case {number}: {error.key}", error.value, error.remedy) from None
