"""Curvature-element ribbon: inextensible, developable, normal curvature linear and ruling linear on each segment.

    >>> from ribbon import Strip, Clamp, Gravity, solve
    >>> strip = Strip(length=1.0, width=0.03, poisson=0.4, natural_curvature=10.0, gamma=100.0)
    >>> result = solve(strip, Clamp(), Gravity(up=(1, 0, 0)), energy="wunderlich", segments=20)
    >>> result.status.code, result.energy.bending, result.surface(400, 8).points.shape  # doctest: +SKIP

What is given of the strip and of what holds it is in the strip's own unit of length, whatever that is; abscissae and
all that a result tells are in l and D w; a derivative is what is told per what is given; `si` is SI (`ribbon.strip`).
"""

import importlib
from typing import TYPE_CHECKING, Any

from ribbon.element import kernel_cache

if TYPE_CHECKING:
    from ribbon.sensitivity.gradients import Gradients, gradients
    from ribbon.session import Move, Session

with kernel_cache.in_use():
    from ribbon.boundary import Clamp, Closure
    from ribbon.contact import Wall
    from ribbon.errors import NotDifferentiable, RibbonInputError
    from ribbon.find.continuation import follow, switch
    from ribbon.find.many import Many, solve_many
    from ribbon.find.solve import refine, solve
    from ribbon.forces import WallForce
    from ribbon.loads import Gravity
    from ribbon.result import Energy, Equilibrium, Force, Pose, Status
    from ribbon.strip import Strip
    from ribbon.surface import Surface

__all__ = [
    "Clamp",
    "Closure",
    "Energy",
    "Equilibrium",
    "Force",
    "Gradients",
    "Gravity",
    "Many",
    "Move",
    "NotDifferentiable",
    "Pose",
    "RibbonInputError",
    "Session",
    "Status",
    "Strip",
    "Surface",
    "Wall",
    "WallForce",
    "follow",
    "gradients",
    "refine",
    "solve",
    "solve_many",
    "switch",
]

#: Names that are looked up when they are first used, with their modules: a solve does not need them.
_LATER = {
    "Gradients": "ribbon.sensitivity.gradients",
    "Move": "ribbon.session",
    "Session": "ribbon.session",
    "gradients": "ribbon.sensitivity.gradients",
}


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    with kernel_cache.in_use():
        return getattr(importlib.import_module(_LATER[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_LATER})
