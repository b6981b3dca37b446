"""What the finding, the judging and the showing of equilibria ask of a problem, whatever its formulation.

A problem without rows is a bounded minimisation of a few unknowns (`BoundedProblem`, dense Hessian); one with rows is
sparse (`ConstrainedProblem`). `rows` tells, and nothing else needs to be known of the formulation by those who call.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from ribbon.boundary import Clamp, Closure
from ribbon.contact import Barrier
from ribbon.forces import Force, WallForce
from ribbon.loads import Gravity
from ribbon.problems.arguments import Material
from ribbon.problems.fields import Fields
from ribbon.problems.touching import Touch
from ribbon.strip import Strip

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
#: Quaternion and position at s = 0 to which a problem may refer; None: they follow from what it is.
Anchor = tuple[tuple[float, ...], tuple[float, ...]] | None


@dataclass
class Counters:
    """How often the problem was evaluated; an effect that is off has no count."""

    value: int = 0
    gradient: int = 0
    hessian: int = 0
    series: int = 0

    def add(self, other: Counters) -> None:
        """Adds the counts of another problem's evaluations."""
        self.value += other.value
        self.gradient += other.gradient
        self.hessian += other.hessian
        self.series += other.series

    def by_name(self) -> dict[str, int]:
        """The counts by name."""
        return {"value": self.value, "gradient": self.gradient, "hessian": self.hessian, "series": self.series}


class Matrix(Protocol):
    """A matrix (m, n), dense or sparse: what is multiplied by vectors."""

    @property
    def T(self) -> Matrix: ...

    def __matmul__(self, other: FloatArray) -> FloatArray: ...


class SmoothProblem(Protocol):
    """A smooth function of `size` unknowns between bounds, and what a residual is measured against."""

    @property
    def size(self) -> int: ...

    @property
    def rows(self) -> ConstrainedProblem | None:
        """The problem as one with rows of constraints and sparse matrices; None: it has none, and a dense Hessian."""
        ...

    @property
    def strip(self) -> Strip | None:
        """The strip whose weight and curl are the unit of large residuals; None: that is 1."""
        ...

    @property
    def slack(self) -> float | None:
        """By how much (l) held ends are nearer to each other than the strip is long; None without two held points."""
        ...

    def bounds(self) -> tuple[FloatArray, FloatArray]: ...

    def value(self, x: FloatArray) -> float: ...

    def gradient(self, x: FloatArray) -> FloatArray: ...


class BoundedProblem(SmoothProblem, Protocol):
    """A problem without rows; Hessian dense (n, n)."""

    def hessian(self, x: FloatArray) -> FloatArray: ...


class ConstrainedProblem(SmoothProblem, Protocol):
    """A problem with rows ``lower <= c(x) <= upper``; Jacobian and Hessian sparse, in a fixed structure."""

    def constraint_bounds(self) -> tuple[FloatArray, FloatArray]: ...

    def constraints(self, x: FloatArray) -> FloatArray: ...

    def jacobian_structure(self) -> tuple[IntArray, IntArray]: ...

    def jacobian(self, x: FloatArray) -> FloatArray: ...

    def hessian_structure(self) -> tuple[IntArray, IntArray]: ...

    def hessian(self, x: FloatArray, multipliers: FloatArray, factor: float = 1.0) -> FloatArray: ...

    def jacobian_matrix(self, x: FloatArray) -> Matrix: ...


class Problem(SmoothProblem, Protocol):
    """A ribbon as a minimisation problem; lengths in l, energies in D w / l."""

    @property
    def strip(self) -> Strip: ...

    @property
    def start(self) -> Clamp | None: ...

    @property
    def end(self) -> Clamp | None: ...

    @property
    def closure(self) -> Closure | None: ...

    @property
    def walls(self) -> tuple[Barrier, ...]: ...

    @property
    def gravity(self) -> Gravity | None: ...

    @property
    def energy(self) -> str: ...

    @property
    def stiffness(self) -> str | None: ...

    @property
    def in_plane(self) -> bool | None: ...

    @property
    def tip(self) -> tuple[float, float, float] | None:
        """Dead force at s = l, D w / l^2."""
        ...

    @property
    def material(self) -> Material:
        """Kernel arguments: the energy, its section, and what the segments are at rest."""
        ...

    @property
    def touching(self) -> tuple[Touch, ...]:
        """Points between the joints that are held on a wall's side."""
        ...

    @property
    def fields(self) -> Fields:
        """What bends the strip, and the energy's arguments for the kernels."""
        ...

    @property
    def lengths(self) -> FloatArray: ...

    @property
    def exponent_limit(self) -> float: ...

    @property
    def formulation(self) -> str: ...

    @property
    def counters(self) -> Counters: ...

    @property
    def row_count(self) -> int:
        """Number of rows of constraints."""
        ...

    @property
    def half_width(self) -> float: ...

    @property
    def has_gravity(self) -> bool: ...

    @property
    def has_natural_curvature(self) -> bool: ...

    def energy_parts(self, x: FloatArray) -> FloatArray:
        """Bending, natural-curvature and gravity energy, that of plates and of an end force where there may be some."""
        ...

    def block_slices(self) -> dict[str, slice]:
        """Where the rows of what holds the ribbon stand, by name."""
        ...

    def free_motions(self) -> tuple[FloatArray, FloatArray]:
        """Unit translations (k, 3) and axes of rotation (m, 3) that change neither energy nor constraints."""
        ...

    def with_changes(self, **changes: Any) -> Self:
        """The same problem with fields replaced and nothing counted or cached."""
        ...

    # -- shapes -------------------------------------------------------------------------------------------------------

    def state(self, omega: FloatArray, eta: FloatArray, in_plane: FloatArray | None = None) -> FloatArray:
        """Unknowns of the shape with omega, eta (or twist) and kappa_2 (p + 1,; None: natural) at the joints."""
        ...

    def in_plane_values(self, x: FloatArray) -> FloatArray | None:
        """In-plane curvature (p + 1,) at the joints; None without."""
        ...

    def joint_values(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """omega and eta (p + 1,) at the joints, of unknowns or of a mode."""
        ...

    def parameters(self, x: FloatArray) -> FloatArray:
        """(a, b, n, m) of every segment, (p, 4), or with (c, d) of an in-plane curvature (p, 6)."""
        ...

    def parameter_map(self) -> tuple[IntArray, FloatArray]:
        """How they follow from the unknowns: columns (p, k) of those that matter to each, slopes (p, 4 or 6, k)."""
        ...

    def joints(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions (p + 1, 3) and frames (p + 1, 3, 3) at the joints."""
        ...

    def anchor(self, x: FloatArray) -> Anchor:
        """Where the start of the shape x stands, for `anchored`; None where it is no unknown."""
        ...

    def anchored(self, anchor: Anchor) -> Self:
        """The problem with its gauges and the signs of its quaternions referring to `anchor`; unchanged for None."""
        ...

    # -- what holds the ribbon, from the multipliers of the rows ------------------------------------------------------

    def start_force(self, x: FloatArray, rows: FloatArray) -> Force:
        """What the support at s = 0 exerts on the ribbon (zero where nothing is held)."""
        ...

    def end_force(self, x: FloatArray, rows: FloatArray) -> Force | None:
        """What the clamp at s = l exerts; None for a free or closed end."""
        ...

    def wall_forces(self, x: FloatArray, rows: FloatArray) -> tuple[WallForce, ...]:
        """What every wall exerts."""
        ...
