"""What a solve of several strips returns: the verdict on the whole, every strip by itself, what joins them exerts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ribbon.element import quaternion
from ribbon.problems.conditions import Rows
from ribbon.problems.strips.between import BetweenRows
from ribbon.problems.strips.joint import End, FrameRows
from ribbon.problems.strips.problem import StripsProblem
from ribbon.result import Energy, Equilibrium, Status

FloatArray = NDArray[np.float64]

#: Multiplier above which a pair counts as in contact, units D_0 w_0 / l_0^2.
_TOUCHES = 1e-6
#: Part of the largest friction by which it may be less and slip.
_SLIPS = 1e-6


@dataclass(frozen=True)
class JointForce:
    """What a joint exerts on the strip whose end is joined to `one` (the opposite on that): force (3,) in
    D_0 w_0 / l_0^2, moment (3,) about it in D_0 w_0 / l_0; at: where it is (3,), l_0; and by how much it is missed:
    opened (l_0), turned (rad, of the components that it holds)."""

    one: End
    other: End
    at: FloatArray
    force: FloatArray
    moment: FloatArray
    opened: float
    turned: float


@dataclass(frozen=True)
class TouchForce:
    """Places of two strips that are held apart: abscissae s and places v across, each in its own l; at: the places
    (3,) in l_0; force (3,) on the first, the opposite on the other, in D_0 w_0 / l_0^2; gap between them, l_0."""

    one: int
    other: int
    s: float
    v: float
    s_other: float
    v_other: float
    at: FloatArray
    at_other: FloatArray
    force: FloatArray
    gap: float


@dataclass(frozen=True)
class SlideForce:
    """Where strips rub on each other at the end of an increment.

    s, v and s_other, v_other: particles of both, each in its own l; point (3,) at which the forces act, l_0; push N and
    friction (3,) on the first, the opposite on the other, D_0 w_0 / l_0^2; slip (3,): how far the first went along the
    other in the increment, l_0; slips: whether friction is all that mu N allows.
    """

    one: int
    other: int
    s: float
    v: float
    s_other: float
    v_other: float
    point: FloatArray
    push: float
    friction: FloatArray
    slip: FloatArray
    slips: bool


@dataclass(frozen=True, repr=False)
class StripsEquilibrium:
    """Several strips at rest, or where the minimiser stopped; lengths in l_0 and energies in D_0 w_0 / l_0 of the first
    strip, those of `strips` each in its own.

    strips: every strip as an `Equilibrium` (shape, energies, what its clamps exert; status and stability are the
    whole's); depth: how far (l_0) strips are nearer to each other than they are kept, None: nothing keeps them apart;
    error: largest distance (l_0) from the same strips on segments half as long, None: not known; left: how far above
    (D_0 w_0 / l_0) the saddle was that was left for it, None: none; rubbed: what friction took away (D_0 w_0 / l_0)
    along a path so far, None: without friction; before: the state at the end of the increment before, on which it
    depends.
    """

    problem: StripsProblem
    status: Status
    message: str
    x: FloatArray
    rows: FloatArray
    multipliers: FloatArray
    residual: float
    iterations: int
    stable: bool | None
    lowest_eigenvalue: float
    mode: FloatArray
    unstable_modes: int | None
    seconds: dict[str, float]
    solver: str
    strips: tuple[Equilibrium, ...]
    depth: float | None = None
    error: float | None = None
    left: float | None = None
    rubbed: float | None = None
    before: StripsEquilibrium | None = None

    @property
    def penetration(self) -> float | None:
        """How far (l_0) a strip reaches beyond a wall, anywhere; None without walls, and without a shape."""
        each = [strip.penetration for strip in self.strips]
        known = [over * depth for over, depth in zip(self.problem.lengths_over, each, strict=True) if depth is not None]
        return max(known) if known and len(known) == len(each) else None

    @property
    def ok(self) -> bool:
        """Converged and stable."""
        return self.status is Status.CONVERGED

    @cached_property
    def energy(self) -> Energy:
        """Of all strips, D_0 w_0 / l_0."""
        return Energy(*(float(v) for v in self.problem.energies(self.x).sum(axis=0)))

    def positions(self, k: int, s: FloatArray) -> FloatArray:
        """Places (n, 3) of strip k at abscissae s over its length, l_0."""
        return self.problem.lengths_over[k] * self.strips[k].position(s)

    @cached_property
    def joints(self) -> tuple[JointForce, ...]:
        """What every joint exerts."""
        problem, slices, found = self.problem, self.problem.block_slices(), []
        for number, joint in enumerate(problem.joints):
            name = f"joint_{number}_"
            position = problem.blocks()[name + "position"]
            columns = problem.end_columns(joint.other)[0]
            moment, turned = np.zeros(3), 0.0
            if name + "frame" in slices:
                frame = problem.blocks()[name + "frame"]
                assert isinstance(frame, FrameRows)
                moment = -_moment(frame, self.x, self.rows[slices[name + "frame"]])
                turned = float(np.abs(frame.values(self.x)).max())
            at = problem.lengths_over[joint.other.strip] * self.x[columns]
            opened = float(np.linalg.norm(position.values(self.x)))
            force = -self.rows[slices[name + "position"]]
            found.append(JointForce(joint.one, joint.other, at, force, moment, opened, turned))
        return tuple(found)

    @cached_property
    def slides(self) -> tuple[SlideForce, ...]:
        """Where strips rub on each other."""
        term, problem = self.problem.friction, self.problem
        if term is None:
            return ()
        found = []
        each = zip(problem.slides, term.points(self.x), term.forces(self.x), term.slips(self.x), strict=True)
        for slide, point, force, slip in each:
            if slide.bound <= _TOUCHES * problem.mu:
                continue
            one, other = slide.spots
            slips = bool(np.linalg.norm(force) > slide.bound * (1.0 - _SLIPS))
            found.append(SlideForce(slide.one, slide.other, one.particle, one.v, other.particle, other.v, point,
                                    slide.bound / problem.mu, -force, slip, slips))  # fmt: skip
        return tuple(found)

    @cached_property
    def touching(self) -> tuple[TouchForce, ...]:
        """Where strips touch each other, and what they exert there."""
        found: list[TouchForce] = []
        for name, where in self.problem.block_slices().items():
            rows: Rows = self.problem.blocks()[name]
            if isinstance(rows, BetweenRows):
                one, other = (int(word) for word in name.split("_")[1:])
                found += self._pushes(rows, -self.rows[where], one, other)
        return tuple(found)

    def _pushes(self, rows: BetweenRows, push: FloatArray, one: int, other: int) -> list[TouchForce]:
        at, at_other = rows.ends(self.x)
        found = []
        for k, place in enumerate(rows.places(self.x)):
            if push[k] <= _TOUCHES:
                continue
            apart = at[k] - at_other[k]
            gap = float(np.linalg.norm(apart))
            feet = [
                self._foot(strip, float(place[2 * side]), float(place[2 * side + 1]))
                for side, strip in enumerate((one, other))
            ]
            found.append(
                TouchForce(
                    one, other, feet[0], float(place[1]), feet[1], float(place[3]), at[k], at_other[k],
                    push[k] * apart / gap, gap,
                )
            )  # fmt: skip
        return found

    def _foot(self, k: int, s: float, u: float) -> float:
        """Abscissa S of the particle at the place u of the ruling at s: S = s + u eta."""
        part = self.problem.parts[k]
        return s if part.fields.free else s + u * float(self.strips[k].eta([s])[0])


def _moment(frame: FrameRows, x: FloatArray, rows: FloatArray) -> FloatArray:
    """Derivative (3,) of rows . frame by a turn of the joined end about the fixed axes: dq' = e_k o q' / 2."""
    by_q = np.einsum("k,kab,a->b", rows, frame.forms, x[frame.first])
    q = x[frame.last]
    return np.array([0.5 * by_q @ quaternion.compose(np.eye(4)[1 + k], q) for k in range(3)])
