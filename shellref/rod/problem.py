"""What a shearable rod is, what holds and loads it; and all that lies between two such problems.

Units: lengths l, stiffnesses of bending and torsion D w, of shear and stretch D w / l^2, forces D w / l^2, moments
D w / l, weight D w / l^3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from shellref.law import Law, between, cut, value
from shellref.rod.quaternion import Array, conjugate, product, quaternion, right, rotation, turn_between, turned

Pair = tuple[float, float]


@dataclass(frozen=True)
class Section:
    """Stiffnesses: bending about t_x and t_y, torsion, shear along t_x and t_y, stretch."""

    bending: Pair
    torsion: float
    shear: Pair
    stretch: float

    def __post_init__(self) -> None:
        if not all(0.0 < value < math.inf for value in self.stiffness):
            raise ValueError(f"section: every stiffness must be greater than zero: {self}")

    @property
    def stiffness(self) -> Array:
        """(6,) in the order of the strains: Gamma (shear, shear, stretch), kappa (bending, bending, torsion)."""
        return np.array([*self.shear, self.stretch, *self.bending, self.torsion])

    @property
    def inertia(self) -> Array:
        """(3,) rotary inertia over mass per length about t_x, t_y, t_z, in l^2: that of the section whose stretch and
        bending these are."""
        x, y = self.bending[0] / self.stretch, self.bending[1] / self.stretch
        return np.array([x, y, x + y])


def torsion_constant(width: float, thickness: float) -> float:
    """J over w h^3 / 3 of a rectangle: 1 - (192 / pi^5) (h / w) sum over odd n of tanh(n pi w / (2 h)) / n^5 (thesis,
    4.4)."""
    ratio = width / thickness
    odd = np.arange(1.0, 4001.0, 2.0)
    return float(1.0 - 192.0 / math.pi**5 / ratio * np.sum(np.tanh(0.5 * math.pi * ratio * odd) / odd**5))


def rectangle(width: float, thickness: float, poisson: float, plate: bool = False) -> Section:
    """A rectangle w x h (both over l), Y in units of D w with D = Y h^3 / (12 (1 - nu^2)) (docs/theory.md, eq. (12.3)).

    Bending across the thickness D w as the ribbon has it, or Y I = (1 - nu^2) D w (`plate`); shear 5/6 G w h.
    """
    soft = 1.0 - poisson**2
    axial = 12.0 * soft / thickness**2
    shear = 5.0 / 6.0 * axial / (2.0 * (1.0 + poisson))
    return Section(
        bending=(soft if plate else 1.0, soft * (width / thickness) ** 2),
        torsion=2.0 * (1.0 - poisson) * torsion_constant(width, thickness),
        shear=(shear, shear),
        stretch=axial,
    )


@dataclass(frozen=True)
class Held:
    """What is held at an end: the point (3,), the frame (3, 3); slide: a direction in which the point may move."""

    position: Array | None = None
    frame: Array | None = None
    slide: Array | None = None


@dataclass(frozen=True)
class RodProblem:
    """A rod of length 1, s from 0 to 1.

    curvature, in_plane, twist: kappa_1, kappa_2, kappa_3 at rest (`shellref.law`: linear in s, or a table, at whose
    points elements end). weight (3,): force per length; force,
    moment (3,) at s = 1, both of fixed direction. start, end: what holds it.
    """

    section: Section
    curvature: Law = (0.0, 0.0)
    in_plane: Law = (0.0, 0.0)
    twist: Law = (0.0, 0.0)
    weight: Array = field(default_factory=lambda: np.zeros(3))
    force: Array = field(default_factory=lambda: np.zeros(3))
    moment: Array = field(default_factory=lambda: np.zeros(3))
    start: Held = field(default_factory=lambda: Held(np.zeros(3), np.eye(3)))
    end: Held = field(default_factory=Held)

    @property
    def rest(self) -> tuple[Law, Law, Law]:
        """kappa at rest, component by component."""
        return self.curvature, self.in_plane, self.twist

    def at_rest(self, s: Array) -> Array:
        """kappa at rest at s (any shape), with a last axis of 3."""
        return np.stack([value(law, s) for law in self.rest], axis=-1)

    @property
    def conservative(self) -> bool:
        """Whether the loads have a potential: a moment of fixed direction on an end that may turn has none in space."""
        return not np.any(self.moment) or self.end.frame is not None

    @property
    def load(self) -> float:
        """Size of the loads, D w / l^2."""
        return float(np.linalg.norm(self.weight) + np.linalg.norm(self.force) + np.linalg.norm(self.moment))

    def bent(self, curvature: Law) -> RodProblem:
        """Without loads, naturally bent like this, and held at one end as it then lies."""
        zero = np.zeros(3)
        return replace(self, curvature=curvature, weight=zero, force=zero, moment=zero)


def rest_shape(problem: RodProblem, s: Array) -> tuple[Array, Array]:
    """Positions (n, 3) and quaternions (n, 4) of the rod at rest at s (n,) ascending from 0, put where it is held.

    R' = R [kappa]_x, r' = t_z by steps of the fourth order (Magnus, two Gauss points), 400 of them. An end whose
    frame is held places it; with points alone the chord is laid along theirs.
    """
    fine = np.union1d(cut(np.linspace(0.0, 1.0, 401), *problem.rest), s)
    h = np.diff(fine)[:, None]
    middle = fine[:-1] + 0.5 * h[:, 0]
    first, last = (problem.at_rest(middle + side * h[:, 0] * math.sqrt(3.0) / 6.0) for side in (-1.0, 1.0))
    mean = 0.5 * h * (first + last) + math.sqrt(3.0) / 12.0 * h * h * np.cross(first, last)
    one = np.array([1.0, 0.0, 0.0, 0.0])
    turns = turned(np.broadcast_to(one, (len(mean), 4)), mean)
    q = np.empty((len(fine), 4))
    q[0] = one
    for i, turn in enumerate(turns):
        q[i + 1] = right(turn) @ q[i]
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    tangent = rotation(q)[:, :, 2]
    half = 0.5 * h * problem.at_rest(fine[:-1] + 0.25 * h[:, 0])
    between = rotation(turned(q[:-1], half))[:, :, 2]
    steps = h / 6.0 * (tangent[:-1] + 4.0 * between + tangent[1:])
    r = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    pick = np.searchsorted(fine, s)
    r, q = r[pick], q[pick]
    return _placed(problem, r, q)


def _placed(problem: RodProblem, r: Array, q: Array) -> tuple[Array, Array]:
    """The free shape as a rigid body put where the rod is held."""
    start, end = problem.start, problem.end
    turn = np.array([1.0, 0.0, 0.0, 0.0])
    if start.frame is not None:
        turn = quaternion(start.frame)
    elif end.frame is not None:
        turn = product(quaternion(end.frame), conjugate(q[-1]))
    elif start.position is not None and end.position is not None:
        turn = _shortest(r[-1] - r[0], end.position - start.position)
    frame = rotation(turn)
    r = r @ frame.T
    if start.position is not None:
        r = r - r[0] + start.position
    elif end.position is not None:
        r = r - r[-1] + end.position
    return r, product(np.broadcast_to(turn, q.shape), q)


def _shortest(a: Array, b: Array) -> Array:
    """The quaternion of the shortest turn of direction a into direction b."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    q = np.array([1.0 + a @ b, *np.cross(a, b)])
    size = np.linalg.norm(q)
    return np.array([0.0, 1.0, 0.0, 0.0]) if size < 1e-8 else q / size


@dataclass(frozen=True)
class LoadPath:
    """From one problem (t = 0) to another (t = 1) that is held alike: stiffnesses, rest shape, loads and held points go
    straight, held frames by the shortest turn."""

    first: RodProblem
    last: RodProblem

    def at(self, t: float) -> RodProblem:
        """The problem at t; both ends exactly."""
        if t in (0.0, 1.0):
            return self.last if t else self.first
        a, b = self.first, self.last

        def mixed(x: Array, y: Array) -> Array:
            return np.asarray((1.0 - t) * np.asarray(x) + t * np.asarray(y))

        def pair(x: Pair, y: Pair) -> Pair:
            return (1.0 - t) * x[0] + t * y[0], (1.0 - t) * x[1] + t * y[1]

        def held(x: Held, y: Held) -> Held:
            point = y.position if x.position is None or y.position is None else mixed(x.position, y.position)
            frame = y.frame
            if x.frame is not None and y.frame is not None:
                one = quaternion(x.frame)
                frame = rotation(turned(one, t * turn_between(one, quaternion(y.frame))))
            return Held(point, frame, y.slide)

        section = Section(
            pair(a.section.bending, b.section.bending),
            (1.0 - t) * a.section.torsion + t * b.section.torsion,
            pair(a.section.shear, b.section.shear),
            (1.0 - t) * a.section.stretch + t * b.section.stretch,
        )
        return RodProblem(
            section,
            between(a.curvature, b.curvature, t),
            between(a.in_plane, b.in_plane, t),
            between(a.twist, b.twist, t),
            mixed(a.weight, b.weight),
            mixed(a.force, b.force),
            mixed(a.moment, b.moment),
            held(a.start, b.start),
            held(a.end, b.end),
        )
