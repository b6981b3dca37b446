r"""What a planar elastica is asked: its loads, its natural curvature and how its two ends are held.

Lengths in l, energies in D w / l, forces in D w / l^2, moments in D w / l, curvatures in 1/l; the origin is the end
s = 0. Angles are from the x axis. Coordinates and energy: `shellref.elastica`.

**Ends.** Each of theta(0), theta(1) is given (clamped) or free (pinned: no moment). The end s = 1 is free, held at a
point, or slides along a line through that point. Where it is held, the support's force R is a Lagrange multiplier: it
acts as a dead force would, p(s) = Gamma (1 - s) u - F - R, with <n_j, r(1) - end> = 0 for each held direction n_j.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shellref import law
from shellref.elastica.contact.barrier import Barrier
from shellref.law import Law

Array = NDArray[np.float64]
Pair = tuple[float, float]

TAUT = 1e-11
"""Slack of a strip between its ends, in l, below which it is taut: the misfit that a solve leaves
(`ElasticaOptions.tolerance`). Measured: solved with a slack of 1e-10, lost on its way with one of 1e-12."""


@dataclass(frozen=True)
class ElasticaProblem:
    """Planar elastica with l = 1, D w = 1; clamped at s = 0 along x and free at s = 1 unless told otherwise.

    Parameters
    ----------
    gamma : weight against bending stiffness, >= 0.
    up : unit vector (2,) against the weight in plane coordinates (x along t_z, y along -t_y).
    curvature : natural curvature at s = 0 and s = 1, linear between, or points (s, K) of a table (`shellref.law`);
        elements end at its points.
    force : dead force (2,) at s = 1, in D w / l^2.
    start_angle, end_angle : theta at s = 0 and s = 1, in radians; None: free to turn.
    end : point (2,) that holds s = 1, in l; None: free.
    slide : direction (2,) in which the end may still move through `end`; None: not at all.
    apart : distance in l, >= 0, that parts facing each other keep; None: they may pass through each other.
    barriers : lines and circles that the strip cannot cross.

    Raises ValueError, naming the field, for anything else. When theta(0) is free the end must be held: the strip would
    turn about s = 0 without resistance.
    """

    gamma: float = 0.0
    up: Pair = (0.0, 1.0)
    curvature: Law = (0.0, 0.0)
    force: Pair = (0.0, 0.0)
    start_angle: float | None = 0.0
    end_angle: float | None = None
    end: Pair | None = None
    slide: Pair | None = None
    apart: float | None = None
    barriers: tuple[Barrier, ...] = ()

    def __post_init__(self) -> None:
        why = law.fault(self.curvature)
        if why is not None:
            raise ValueError(f"curvature = {self.curvature}: {why}")
        object.__setattr__(self, "curvature", law.plain(self.curvature))
        sizes = {"gamma": 1, "up": 2, "force": 2}
        optional = {"start_angle": 1, "end_angle": 1, "end": 2, "slide": 2}
        sizes |= {name: size for name, size in optional.items() if getattr(self, name) is not None}
        for name, size in sizes.items():
            value = np.atleast_1d(np.asarray(getattr(self, name), dtype=float))
            if value.shape != (size,) or not np.all(np.isfinite(value)):
                raise ValueError(f"{name} = {getattr(self, name)}: must be {size} finite number(s)")
            plain = tuple(float(number) for number in value)  # arrays compare badly: keep plain numbers
            object.__setattr__(self, name, plain if size > 1 else plain[0])
        if self.gamma < 0.0:
            raise ValueError(f"gamma = {self.gamma}: must not be negative; turn `up` instead")
        if abs(math.hypot(*self.up) - 1.0) > 1e-9:
            raise ValueError(f"up = {self.up}: is not a unit vector")
        if self.apart is not None and not 0.0 <= self.apart < 0.5:
            raise ValueError(f"apart = {self.apart}: must be from 0 to below 0.5")
        self._check_ends()

    @property
    def touching(self) -> bool:
        """Whether there is anything that the strip may touch."""
        return self.apart is not None or bool(self.barriers)

    def _check_ends(self) -> None:
        if self.slide is not None:
            if self.end is None:
                raise ValueError(f"slide = {self.slide}: needs `end`, a point of the line")
            if abs(math.hypot(*self.slide) - 1.0) > 1e-9:
                raise ValueError(f"slide = {self.slide}: is not a unit vector")
        if self.end is None and self.start_angle is None:
            raise ValueError("start_angle = None: a strip free to turn at s = 0 needs its end held (`end`)")

    def check_reach(self) -> None:
        """ValueError when the held end is farther from the start than the strip is long (a way may pass there)."""
        for normal in self.normals if self.end is not None else ():
            if abs(float(normal @ self.end)) > 1.0:
                raise ValueError(f"end = {self.end}: farther from the start than the length, 1")
        if self.end is not None and self.slide is None and math.hypot(*self.end) > 1.0 - TAUT:
            raise ValueError(
                f"end = {self.end}: the strip would be taut to {TAUT:.0e} of its length, and its force not determined; "
                "come nearer"
            )

    @property
    def normals(self) -> Array:
        """Directions in which the end is held, shape (m, 2), m = 0, 1 or 2."""
        if self.end is None:
            return np.zeros((0, 2))
        if self.slide is not None:
            return np.array([[-self.slide[1], self.slide[0]]])
        return np.eye(2)

    @property
    def cantilever(self) -> bool:
        """Clamped at s = 0 and free at s = 1."""
        return self.end is None and self.end_angle is None

    @property
    def weight(self) -> Pair:
        """Gamma u."""
        return self.gamma * self.up[0], self.gamma * self.up[1]

    def natural_curvature(self, s: Array) -> Array:
        """K(s), any shape."""
        return law.value(self.curvature, s)

    def natural_turn(self, s: Array) -> Array:
        """int_0^s K, any shape."""
        return law.integral(self.curvature, s)

    def natural_chord(self) -> complex:
        """int_0^1 exp(i natural_turn), the natural shape's chord as x + i y, by 60 Gauss points a piece of the law."""
        x, w = np.polynomial.legendre.leggauss(60)
        joints = law.knots(self.curvature)[0]
        h = np.diff(joints)[:, None]
        s = joints[:-1, None] + 0.5 * h * (x + 1.0)
        return complex(np.sum(0.5 * h * w * np.exp(1j * self.natural_turn(s))))

    def carried(self, s: Array) -> tuple[Array, Array]:
        """The two components of p(s) = Gamma (1 - s) u - F, any shape."""
        lever = self.gamma * (1.0 - s)
        return lever * self.up[0] - self.force[0], lever * self.up[1] - self.force[1]

    def scaled(self, factor: float) -> ElasticaProblem:
        """The same strip under `factor` times the loads."""
        return replace(self, gamma=self.gamma * factor, force=(self.force[0] * factor, self.force[1] * factor))

    def pushed(self, reaction: Array) -> ElasticaProblem:
        """With the force (2,) of the end's support counted as part of the dead force."""
        return replace(self, force=(self.force[0] + float(reaction[0]), self.force[1] + float(reaction[1])))

    @property
    def load(self) -> float:
        """Largest |p(s)|, at the clamp or at the free end, in D w / l^2."""
        return max(math.hypot(*(float(c) for c in self.carried(np.array(s)))) for s in (0.0, 1.0))


@dataclass(frozen=True)
class LoadPath:
    """Problems on a straight line from one to another: `at(0)` is `first`, `at(1)` is `last`, beyond both too.

    Weight vector, force, curvature, angles and end point are linear in the parameter; what is free or held is the same
    in both, else ValueError.
    """

    first: ElasticaProblem
    last: ElasticaProblem

    def __post_init__(self) -> None:
        for name in ("start_angle", "end_angle", "end", "slide"):
            ends = getattr(self.first, name), getattr(self.last, name)
            if (ends[0] is None) != (ends[1] is None) or (name == "slide" and ends[0] != ends[1]):
                raise ValueError(f"{name} = {ends[0]}, then {ends[1]}: a way cannot change how the strip is held")
        if self.first.apart != self.last.apart or len(self.first.barriers) != len(self.last.barriers):
            raise ValueError("apart, barriers: a way cannot change what the strip may touch")

    def at(self, t: float) -> ElasticaProblem:
        """The problem at the parameter t."""

        def mix(a: Pair, b: Pair) -> Pair:
            return a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])

        def angle(a: float | None, b: float | None) -> float | None:
            return None if a is None or b is None else a + t * (b - a)

        a, b = self.first, self.last
        weight = mix(a.weight, b.weight)
        gamma = math.hypot(*weight)
        return replace(
            b,
            gamma=gamma,
            up=(weight[0] / gamma, weight[1] / gamma) if gamma > 0.0 else b.up,
            curvature=law.between(a.curvature, b.curvature, t),
            force=mix(a.force, b.force),
            start_angle=angle(a.start_angle, b.start_angle),
            end_angle=angle(a.end_angle, b.end_angle),
            end=None if a.end is None or b.end is None else mix(a.end, b.end),
            barriers=tuple(one.between(other, t) for one, other in zip(a.barriers, b.barriers, strict=True)),
        )


@dataclass(frozen=True)
class ElasticaEnergy:
    """Parts of the energy in D w / l: bending without the constant 1/2 int K^2, gravity (0 at the clamp), end force."""

    bending: float
    gravity: float
    force: float

    @property
    def total(self) -> float:
        return self.bending + self.gravity + self.force


@dataclass(frozen=True)
class ElasticaForces:
    """What the supports and the dead force do to the strip, in D w / l^2 and D w / l.

    start, end : force (2,) on the strip at s = 0 and s = 1, the dead force included; their sum is Gamma u.
    start_moment, end_moment : couple on the strip about each end, counter-clockwise; 0 where theta is free.
    """

    start: Pair
    end: Pair
    start_moment: float
    end_moment: float
