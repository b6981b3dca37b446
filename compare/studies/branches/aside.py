"""Where a branch that its unknowns keep in a plane loses its stability aside of it.

The tangent of the unknowns has no mode out of the plane, so that no inertia of it changes there: the lowest eigenvalues
of the second variation aside (`compare.models.capabilities.BranchStart.aside`) are asked for at every point, and where
another one passes zero the root is found, on elements halved twice too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import scipy.optimize

from compare.continuation.correct import at
from compare.continuation.finer import is_level, refined
from compare.continuation.point import Options, Point
from compare.continuation.system import FloatArray

Asks = Callable[[Point], FloatArray]
Spent = Callable[[], bool]
#: To which part of a step a root is found.
_ROOT = 1e-13


@dataclass(frozen=True)
class Passed:
    """Where one more mode aside is unstable (change = 1) or one less (-1): the point on the branch's own elements, and
    on elements halved once, twice (None: not found there)."""

    point: Point
    finer: tuple[Point | None, ...]
    change: int

    @property
    def what(self) -> str:
        """In words."""
        return "one more mode aside of its plane is unstable" if self.change > 0 else "a mode aside is stable again"


def counts(points: Sequence[Point], asks: Asks, spent: Spent) -> list[int | None]:
    """Number of unstable modes aside at every point; None: there was no more time."""
    return [None if spent() else int((asks(point) < 0.0).sum()) for point in points]


def passed(
    points: Sequence[Point], found: Sequence[int | None], asks: Asks, options: Options, halvings: int, spent: Spent
) -> list[Passed | None]:
    """All places along a branch at which a mode aside changes its stability, in order; None: one that was not found, or
    not looked for without time."""
    made: list[Passed | None] = []
    for here, there, before, after in zip(points, points[1:], found, found[1:], strict=False):
        if before is None or after is None:
            continue
        step = 1 if after > before else -1
        for number in range(before, after, step):
            mode = number if step > 0 else number - 1
            made.append(None if spent() else _located(here, there, mode, step, asks, options, halvings, spent))
    return made


def _located(
    here: Point, there: Point, mode: int, change: int, asks: Asks, options: Options, halvings: int, spent: Spent
) -> Passed | None:
    roots: list[Point | None] = [_root(here, there, mode, asks, options)]
    if roots[0] is None:
        return None
    ends: list[Point | None] = [here, there]
    for _ in range(halvings):
        ends = [None if end is None or spent() else refined(end, is_level(end), options) for end in ends]
        first, last = ends
        roots.append(None if first is None or last is None else _root(first, last, mode, asks, options))
    return Passed(roots[0], tuple(roots[1:]), change)


def _root(here: Point, there: Point, mode: int, asks: Asks, options: Options) -> Point | None:
    """The point between two at which an eigenvalue is zero; from there back where something else touches here."""
    for first, last in ((here, there), (there.turned(), here.turned())):
        far = first.ahead(last.z, last.t) if last.system.size == first.system.size else abs(last.arc - first.arc)
        seen: dict[float, Point] = {0.0: first}

        def value(ahead: float, first: Point = first, seen: dict[float, Point] = seen) -> float:
            point = seen.get(ahead) or at(first, ahead, options.tolerance)
            if point is None:
                raise ArithmeticError
            seen[ahead] = point
            values = asks(point)  # its last one is above zero, and so is what is beyond it
            return float(values[min(mode, values.size - 1)])

        try:
            if value(0.0) * value(far) > 0.0:
                continue
            root = float(scipy.optimize.brentq(value, 0.0, far, xtol=_ROOT * max(far, 1e-3)))
            value(root)
        except ArithmeticError:
            continue
        if (seen[root].system.slacks(seen[root].z, seen[root].t) > -_OVER).all():
            return seen[root]
    return None


#: How far a condition of one side may be passed at a root.
_OVER = 1e-10
