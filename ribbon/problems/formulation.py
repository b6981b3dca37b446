"""Which formulation a scene gets, and why (thesis, 5.3: with Ipopt the chained model is faster for few segments)."""

from __future__ import annotations

from ribbon.boundary import Clamp, Closure
from ribbon.contact import Barrier
from ribbon.errors import RibbonInputError
from ribbon.loads import Gravity
from ribbon.obstacle import Obstacle

#: Segments from which the mixed model is faster with Ipopt on a ribbon held at s = 0 only (results/formulations.md).
CHAINED_BELOW = 110
#: The formulations a user may ask for; "matrix" is the mixed model in the thesis's own unknowns.
FORMULATIONS = ("auto", "chained", "mixed", "matrix")


def chained_obstacle(
    start: Clamp | None, end: Clamp | None, closure: Closure | None, walls: tuple[Barrier, ...], gravity: Gravity | None
) -> str | None:
    """What the chained model cannot do here, or None."""
    if closure is not None:
        return "a closed band"
    if end is not None:
        return "a clamp at the end"
    if walls:
        return "contact"
    if start is None or not start.is_whole:
        return "a start that is not clamped"
    if gravity is not None and gravity.exact:
        return "the weight of the surface"
    return None


def choose(
    asked: str,
    start: Clamp | None,
    end: Clamp | None,
    closure: Closure | None,
    walls: tuple[Barrier, ...],
    gravity: Gravity | None,
    segments: int,
    solver: str = "auto",
    apart: bool = False,
) -> tuple[str, str]:
    """The formulation ("chained", "mixed", "matrix") for a solver of `ribbon.solvers.choose`, and why; apart: parts of
    the strip are kept from each other.

    Raises `RibbonInputError` where it cannot be had.
    """
    if asked not in FORMULATIONS:
        raise RibbonInputError("formulation", asked, f"use one of {', '.join(FORMULATIONS)}")
    obstacle = chained_obstacle(start, end, closure, walls, gravity) or ("contact with itself" if apart else None)
    if apart and asked == "matrix":
        raise RibbonInputError("formulation", asked, 'contact with itself needs "mixed" or "auto"')
    if asked == "chained":
        if obstacle is not None and obstacle != "a clamp at the end":
            raise RibbonInputError("formulation", asked, f'{obstacle} needs the mixed model: use "mixed" or "auto"')
        return "chained", "asked for"
    if asked != "auto":
        if asked == "matrix" and any(isinstance(wall, Obstacle) for wall in walls):
            raise RibbonInputError("formulation", asked, 'knows planes alone; round obstacles need "mixed" or "auto"')
        return asked, "asked for"
    if obstacle is not None:
        return "mixed", f"{obstacle} is a constraint, which the mixed model handles robustly"
    if solver != "ipopt":
        return "chained", "held at s = 0 only: no constraint needed, the cost is linear in the segments"
    if segments < CHAINED_BELOW:
        return "chained", f"held at s = 0 only: no constraint needed, faster below {CHAINED_BELOW} segments"
    return "mixed", f"{segments} segments: sparse, faster from {CHAINED_BELOW} segments on"
