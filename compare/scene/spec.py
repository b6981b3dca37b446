"""The sections of a scene as frozen dataclasses, with the values as the file gives them and the defaults filled in.

Lengths are in the scene's own unit (metres in SI scenes), curvatures in 1/length. The dimensionless numbers that the
solvers use (l = 1, D = 1; theory sheet, section 2) are derived by `compare.scene.Scene`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

Vector = tuple[float, float, float]
Linear = tuple[float, float]
"""A quantity linear in s: (at s = 0, at s = length)."""

STANDARD_GRAVITY = 9.81
"""Default acceleration of gravity in m/s^2, the thesis's value (3.5.2)."""

GROWTH = 1.5
"""Ratio of neighbouring elements where they are graded."""

FIRST_OVER_WIDTH = 2.5
"""Length of the first graded element, times the number of elements, over the strip's width (20 elements: w/8)."""

DEFAULT_ELEMENTS = 20
"""Number of ribbon elements when the scene does not say: the thesis's choice (3.5.1)."""


@dataclass(frozen=True)
class StripSpec:
    """The strip: lengths in the scene's unit, natural curvature in 1/length, young in Pa, density in kg/m^3.

    second_moment in m^4: of a rod's section, in the place of thickness; it bends with Y I where the strip has D w.
    """

    length: float
    width: float
    poisson: float
    thickness: float | None = None
    natural_curvature: Linear = (0.0, 0.0)
    gamma: float | None = None
    young: float | None = None
    density: float | None = None
    second_moment: float | None = None


@dataclass(frozen=True)
class TipSpec:
    """A dead load at s = length along -up: `mass` in kg, or `load` in D w / l^2; exactly one of them."""

    mass: float | None = None
    load: float | None = None


@dataclass(frozen=True)
class GravitySpec:
    """Dead weight: `up` a unit vector, acceleration in m/s^2 (used with young and density only)."""

    up: Vector
    acceleration: float = STANDARD_GRAVITY
    exact: bool = False


@dataclass(frozen=True)
class ClampSpec:
    """A held end: position in the scene's unit, unit tangent t_z, unit normal t_y, ruling "free" or "straight".

    None: not held. Tangent and normal are held together or not at all.
    """

    position: Vector | None
    tangent: Vector | None
    normal: Vector | None
    ruling: str = "free"

    @property
    def holds_all(self) -> bool:
        """True when position and frame are held."""
        return self.position is not None and self.tangent is not None


@dataclass(frozen=True)
class ClosureSpec:
    """A closed band: "circle" (with its number of turns) or "moebius"; ruling at the seam "free" or "straight"."""

    kind: str
    ruling: str = "free"
    turns: int = 1


@dataclass(frozen=True)
class WallSpec:
    """A wall: a point in the scene's unit, the unit normal towards the ribbon.

    `stiffness` in D w / l^3: a pressure plate on a spring that rests at `point`; None: a rigid wall.
    """

    point: Vector
    normal: Vector
    stiffness: float | None = None
    name: str | None = None


@dataclass(frozen=True)
class StageSpec(Mapping[str, Any]):
    """One stage of a path: a mapping from dotted keys to values (lists as tuples), in the order of the file.

    `steps`: how many equal steps lead from the stage before to this one; None: as the continuation finds right.
    """

    changes: tuple[tuple[str, Any], ...]
    steps: int | None = None

    def __getitem__(self, key: str) -> Any:
        return dict(self.changes)[key]

    def __iter__(self) -> Iterator[str]:
        return (key for key, _ in self.changes)

    def __len__(self) -> int:
        return len(self.changes)


def graded_lengths(elements: int, smallest: float) -> tuple[float, ...]:
    """Fractions of the length: from `smallest` at s = 0 growing by GROWTH each up to a largest size, found so that the
    sum is 1; equal ones when `smallest` is not below 1 / elements.

    A clamp that holds the ruling straight bends it over a layer about as long as the strip is wide.
    """
    if smallest * elements >= 1.0:
        return (1.0 / elements,) * elements
    low, high = smallest, 1.0
    for _ in range(200):
        largest = 0.5 * (low + high)
        if math.fsum(_capped(elements, smallest, largest)) < 1.0:
            low = largest
        else:
            high = largest
    lengths = _capped(elements, smallest, high)
    total = math.fsum(lengths)
    return tuple(length / total for length in lengths)


def _capped(elements: int, smallest: float, largest: float) -> list[float]:
    lengths = []
    length = smallest
    for _ in range(elements):
        lengths.append(min(length, largest))
        length = min(length * GROWTH, 1.0)
    return lengths


@dataclass(frozen=True)
class ModelSpec:
    """Energy and discretisation of the ribbon.

    `element_lengths` in the scene's unit, or None for `elements` of them placed by `grading`; `smallest`: the first
    one's length over the strip's when they are graded towards the clamp. `tolerance` (Hausdorff distance / length): the
    elements are to be placed for this error, starting from equal ones. `held_by`: see the thesis, 5.3.3.
    `arc_length`: how the elastica goes along a way, "auto", "always" or "never".
    """

    energy: str = "auto"
    elements: int = DEFAULT_ELEMENTS
    element_lengths: tuple[float, ...] | None = None
    formulation: str = "auto"
    grading: str = "uniform"
    smallest: float | None = None
    tolerance: float | None = None
    held_by: str = "elimination"
    arc_length: str = "auto"

    @property
    def lengths(self) -> tuple[float, ...]:
        """Element lengths as fractions of the strip's length, from the start; their sum is 1 to rounding."""
        if self.element_lengths is None:
            if self.smallest is not None:
                return graded_lengths(self.elements, self.smallest)
            return (1.0 / self.elements,) * self.elements
        total = sum(self.element_lengths)
        return tuple(length / total for length in self.element_lengths)


@dataclass(frozen=True)
class SeedSpec:
    """Starting shape: curvature in 1/length (None: the natural one) and ruling eta without unit.

    Both piecewise linear in s through two or more values at equal distances from s = 0 to s = length.
    """

    curvature: tuple[float, ...] | None = None
    ruling: tuple[float, ...] = (0.0, 0.0)


@dataclass(frozen=True)
class ShellSpec:
    """Shell runs: one per w/h (empty: the strip's own thickness), what is clamped, and the mesh. None: as by default.

    corner, edge_layer in the scene's unit of length, start_curvature in 1/length; elements, grading (along, across).
    tolerance (Hausdorff distance / length): the mesh is refined until its estimated error is below.
    """

    width_to_thickness: tuple[float, ...] = ()
    clamp: str = "edge"
    elements: tuple[int, int] | None = None
    corner: float | None = None
    tolerance: float | None = None
    grading: tuple[float, float] | None = None
    edge_layer: float | str | None = None
    start_curvature: float | None = None
