"""What is asked of one strip, and how a state of it is looked for: two frozen records for all that solves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon.boundary import Clamp, Closure
from ribbon.contact import Barrier
from ribbon.errors import RibbonInputError
from ribbon.loads import Gravity, tip_force
from ribbon.problems.chained import segment_lengths
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.solid import in_planes
from ribbon.solvers.problem import FloatArray
from ribbon.strip import Strip

#: Called with (iteration, energy, dual infeasibility).
Progress = Callable[[int, float, float], None]
#: Options of a minimiser, by the names that Ipopt has for them.
Options = dict[str, Any]
#: A field of the starting shape: a number, or values at equally spaced abscissae from s = 0 to s = l.
Values = float | tuple[float, ...] | list[float] | NDArray[np.float64]


class StripKeywords(TypedDict, total=False):
    """Keywords of `ribbon.solve` that say what the strip is asked for."""

    end: Clamp | None
    closure: Closure | None
    walls: Sequence[Barrier]
    energy: str
    segments: int | ArrayLike
    formulation: str
    held_by: str
    stiffness: str | None
    in_plane: bool | None
    tip: ArrayLike | None
    apart: float | None
    round_rod: bool


class SolveKeywords(StripKeywords, total=False):
    """All keywords of `ribbon.solve`."""

    seed_curvature: Values | str
    seed_ruling: Values
    leave_saddle: bool
    budget: float | None
    solver: str | None
    options: Options | None
    progress: Progress | None


@dataclass(frozen=True, eq=False)
class Request:
    """A strip, what holds and loads it, and the segments and the formulation that it is solved in.

    start, end: a clamp that holds nothing becomes None; tip: dead force (3,) at s = l in D w / l^2; lengths: of the
    segments, (p,), in l; formulation: one of `ribbon.problems.formulation.FORMULATIONS`. All else as `ribbon.solve` is
    given it.
    """

    strip: Strip
    start: Clamp | None
    end: Clamp | None
    closure: Closure | None
    walls: tuple[Barrier, ...]
    gravity: Gravity | None
    tip: tuple[float, float, float] | None
    energy: str
    lengths: FloatArray
    formulation: str
    held_by: str
    stiffness: str | None
    in_plane: bool | None
    apart: float | None = None
    round_rod: bool = False

    def __post_init__(self) -> None:
        for name, clamp in (("start", self.start), ("end", self.end)):
            if clamp is not None and clamp.position is None and not clamp.holds_frame and clamp.ruling == "free":
                object.__setattr__(self, name, None)

    @classmethod
    def of(
        cls,
        strip: Strip,
        clamp: Clamp | None = None,
        gravity: Gravity | None = None,
        *,
        end: Clamp | None = None,
        closure: Closure | None = None,
        walls: Sequence[Barrier] = (),
        energy: str = "wunderlich",
        segments: int | ArrayLike = 20,
        formulation: str = "auto",
        held_by: str = "elimination",
        stiffness: str | None = None,
        in_plane: bool | None = None,
        tip: ArrayLike | None = None,
        apart: float | None = None,
        round_rod: bool = False,
    ) -> Request:
        """The request of these keywords of `ribbon.solve`.

        Raises `RibbonInputError` for segments or a force that are none."""
        lengths = segment_lengths(segments)
        if clamp is None and closure is None:
            clamp = Clamp()
        return cls(
            strip=strip,
            start=clamp,
            end=end,
            closure=closure,
            walls=in_planes(walls),
            gravity=gravity,
            tip=tip_force(tip),
            energy=energy,
            lengths=lengths,
            formulation=formulation,
            held_by=held_by,
            stiffness=stiffness,
            in_plane=in_plane,
            apart=apart,
            round_rod=round_rod,
        )

    @classmethod
    def again(cls, problem: Problem) -> Request:
        """What a problem was asked for, in the formulation that it has."""
        return cls(
            strip=problem.strip, start=problem.start, end=problem.end, closure=problem.closure, walls=problem.walls,
            gravity=problem.gravity, tip=problem.tip, energy=problem.energy, lengths=problem.lengths,
            formulation=problem.formulation, stiffness=problem.stiffness, in_plane=problem.in_plane,
            held_by=problem.held_by if isinstance(problem, MixedProblem) else "elimination",
            apart=(problem.apart or None) if isinstance(problem, MixedProblem) else None,
            round_rod=isinstance(problem, MixedProblem) and problem.round,
        )  # fmt: skip


@dataclass(frozen=True)
class Seed:
    """The starting shape: omega in 1/length, or "natural", and eta."""

    curvature: Values | str = "natural"
    ruling: Values = 0.0

    def __post_init__(self) -> None:
        for name in ("curvature", "ruling"):
            object.__setattr__(self, name, _listed(f"seed_{name}", getattr(self, name)))


def _listed(key: str, value: object) -> object:
    """Values (k,) of an array as a list, of one without a length as a number; `RibbonInputError` for more columns."""
    if not isinstance(value, np.ndarray):
        return value
    if value.ndim > 1:
        shape = f"an array of the shape {value.shape}"
        raise RibbonInputError(key, shape, "one number, or values from s = 0 to s = l in one row, of the shape (k,)")
    return value.tolist()


@dataclass(frozen=True)
class How:
    """How a state is looked for from a start, and what is done to it.

    options: of the minimiser; leave_saddle: an unstable state is left along its unstable mode; check: stability is
    judged; near: the start may be the state already, and is kept if it is; hold: the strip is held on its walls' side
    between the joints too.
    """

    options: Options | None = None
    progress: Progress | None = None
    leave_saddle: bool = False
    check: bool = True
    near: bool = False
    hold: bool = True


def split(keywords: SolveKeywords) -> tuple[StripKeywords, Seed, How, float | None, str | None]:
    """The keywords of `Request.of`, the seed, the search, the budget and the solver of keywords of `ribbon.solve`."""
    requested = keywords.copy()
    seed = Seed(requested.pop("seed_curvature", "natural"), requested.pop("seed_ruling", 0.0))
    how = How(requested.pop("options", None), requested.pop("progress", None), requested.pop("leave_saddle", False))
    budget, solver = requested.pop("budget", None), requested.pop("solver", None)
    return requested, seed, how, budget, solver
