"""Forces and moments of what holds the ribbon, from the multipliers (thesis, appendix A).

With L = E + multipliers . rows stationary, the force of a support is the derivative of L by the place of the support:
moving the held end by d changes the energy of the equilibrium by <force on the ribbon, d> (docs/theory.md, eq. (5.5),
(5.6)).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ribbon.boundary import Clamp
from ribbon.contact import Barrier, Wall
from ribbon.element import quaternion
from ribbon.forces import Force, PairForce, RubForce, WallForce
from ribbon.problems.conditions import Rows, WallRows
from ribbon.problems.curved.rows import CurvedJointRows
from ribbon.problems.fields import Fields
from ribbon.problems.friction.term import Friction
from ribbon.problems.itself.pairs import Pair, PairRows
from ribbon.problems.layout import MixedLayout
from ribbon.problems.touching import TouchRows
from ribbon.solid import Face

FloatArray = NDArray[np.float64]

#: Multiplier above which a joint counts as in contact, units D w / l^2.
_TOUCHES = 1e-6
#: Abscissae nearer than this (l) are one place of contact.
_ONE_PLACE = 1e-6
#: Joints without a push that two places of one line may have between them: what is lifted there is less than segments
#: resolve.
_PASSED = 2
#: Part of mu N by which friction may miss it and be all of it.
_ALL = 1e-6


class Mixed(Protocol):
    """What is asked of a mixed problem: `ribbon.problems.mixed.MixedProblem` has it."""

    @property
    def start(self) -> Clamp | None: ...

    @property
    def end(self) -> Clamp | None: ...

    @property
    def walls(self) -> tuple[Barrier, ...]: ...

    @property
    def lengths(self) -> FloatArray: ...

    @property
    def layout(self) -> MixedLayout: ...

    @property
    def fields(self) -> Fields: ...

    @property
    def friction(self) -> Friction | None: ...

    @property
    def half_width(self) -> float: ...

    @property
    def pairs(self) -> tuple[Pair, ...]: ...

    def pair_rows(self) -> PairRows: ...

    def parameters(self, x: FloatArray) -> FloatArray: ...

    def gradient(self, x: FloatArray) -> FloatArray: ...

    def jacobian_matrix(self, x: FloatArray) -> Any: ...

    def blocks(self) -> dict[str, Rows]: ...

    def block_slices(self) -> dict[str, slice]: ...


def _moment(by_q: FloatArray, q: FloatArray) -> FloatArray:
    """Moment (3,) about the fixed axes from the derivative (4,) by the quaternion q: dq = e_k o q / 2."""
    return np.array([0.5 * by_q @ quaternion.compose(np.eye(4)[1 + k], q) for k in range(3)])


def start(problem: Mixed, x: FloatArray, rows: FloatArray) -> Force:
    """What the clamp at s = 0 exerts, about that point."""
    counted = rows.copy()
    for name, where in problem.block_slices().items():
        if name.startswith(("start_", "gauge_")):
            counted[where] = 0.0
    slope = problem.gradient(x) + problem.jacobian_matrix(x).T @ counted
    held = problem.start
    first = problem.layout.joint(0)
    force, moment = np.zeros(3), np.zeros(3)
    if held is not None and held.position is not None:
        force = slope[first.position]
    if held is not None and held.holds_frame:
        moment = _moment(slope[first.quaternion], x[first.quaternion])
    return Force(force, moment)


def end(problem: Mixed, x: FloatArray, rows: FloatArray) -> Force | None:
    """What the clamp at s = l exerts, about that point; None where there is none."""
    if problem.end is None:
        return None
    slices, blocks = problem.block_slices(), problem.blocks()
    force, moment = np.zeros(3), np.zeros(3)
    if "end_position" in slices:
        force = -rows[slices["end_position"]]
    if "end_frame" in slices:
        turning = np.zeros(4)
        frame = blocks["end_frame"]
        r, columns = frame.jacobian_structure()
        q = problem.layout.joint(-1).quaternion
        np.add.at(turning, columns - q[0], frame.jacobian(x) * rows[slices["end_frame"]][r])
        moment = -_moment(turning, x[q])
    return Force(force, moment)


def walls(problem: Mixed, x: FloatArray, rows: FloatArray) -> tuple[WallForce, ...]:
    """What every wall exerts, in order."""
    found = _pushes(problem, x, rows)
    return tuple(found if problem.friction is None else _rubbed(problem, x, found))


def _pushes(problem: Mixed, x: FloatArray, rows: FloatArray) -> list[WallForce]:
    found: list[WallForce] = []
    s = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    slices = problem.block_slices()
    for k, wall in enumerate(problem.walls):
        block = problem.blocks()[f"wall_{k}"]
        assert isinstance(block, WallRows | CurvedJointRows)
        push = -rows[slices[f"wall_{k}"]]
        total = push.sum()
        blocks: list[tuple[Any, FloatArray]] = [(block, push)]
        joints, sides = np.nonzero(push.reshape(-1, 2) > _TOUCHES)
        pushes = push[push > _TOUCHES]
        touching = s[block.joints[np.unique(joints)]]
        ends = [np.column_stack([s[block.joints[joints]], block.half_width * (1.0 - 2.0 * sides)])]
        if f"touch_{k}" in slices:
            between = problem.blocks()[f"touch_{k}"]
            assert isinstance(between, TouchRows)
            push = -rows[slices[f"touch_{k}"]]
            total += push.sum()
            blocks.append((between, push))
            places, pushed = s[between.segments] + between.places(x), push > _TOUCHES
            ends.append(np.column_stack([places, between.half_width * between.across(x)])[pushed])
            pushes = np.append(pushes, push[pushed])
            touching = np.union1d(touching, places[pushed])
            touching = touching[np.diff(touching, prepend=-1.0) > _ONE_PLACE]
        height = float(x[block.plate]) if block.plate >= 0 else None
        force, moment = (total * np.asarray(wall.normal), None) if isinstance(wall, Wall) else _round(blocks, x)
        exerted = WallForce(force, touching, np.vstack(ends), height, *_lines(touching, s), moment, pushes)
        before = problem.walls[k - 1] if k else None
        if isinstance(wall, Face) and isinstance(before, Face) and before.room == wall.room:
            found[-1] = _together(found[-1], exerted, s)
        else:
            found.append(exerted)
    return found


def _rubbed(problem: Mixed, x: FloatArray, found: list[WallForce]) -> list[WallForce]:
    """What the walls exert with their friction: minus what the particles exert on them."""
    assert problem.friction is not None
    term = problem.friction
    each: dict[int, list[RubForce]] = {}
    for rub, point, force, slip in zip(term.rubs, term.points(x), term.forces(x), term.slips(x), strict=True):
        mu = problem.walls[rub.wall].friction
        slips = bool(np.linalg.norm(force) >= rub.bound * (1.0 - _ALL))
        own = RubForce(rub.s, rub.side * problem.half_width, point, rub.bound / mu, -force, slip, slips)
        each.setdefault(rub.wall, []).append(own)
    return [
        replace(wall, friction=sum((one.friction for one in each[k]), np.zeros(3)), rubs=tuple(each[k]))
        if k in each
        else wall
        for k, wall in enumerate(found)
    ]


def _together(one: WallForce, other: WallForce, joints: FloatArray) -> WallForce:
    """What two planes of one room exert."""
    assert one.moment is not None
    assert other.moment is not None
    touching = np.union1d(one.contacts, other.contacts)
    touching = touching[np.diff(touching, prepend=-1.0) > _ONE_PLACE]
    ends = np.vstack([one.ends, other.ends])
    return WallForce(
        one.force + other.force, touching, ends, None, *_lines(touching, joints), one.moment + other.moment,
        np.append(one.pushes, other.pushes),
    )  # fmt: skip


def _round(blocks: list[tuple[Any, FloatArray]], x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Force (3,) and moment (3,) about the origin of what pushes along its own normals: rows and pushes (k,)."""
    force, moment = np.zeros(3), np.zeros(3)
    for rows, push in blocks:
        pushed = push[:, None] * rows.normals(x)
        force += pushed.sum(axis=0)
        moment += np.cross(rows.points(x), pushed).sum(axis=0)
    return force, moment


def _lines(touching: FloatArray, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What touches in one piece at the abscissae (k,): first and last of each (n, 2), and how much farther each end may
    reach (n, 2).

    Pushes of a line scatter over its joints, with none on some: two places are of one line where no more than
    `_PASSED` joints stand between them. A line may end anywhere on the segment beyond its last push; one point alone is
    where the strip is nearest.
    """
    if not touching.size:
        return np.empty((0, 2)), np.empty((0, 2))
    passed = np.searchsorted(joints, touching[1:] - _ONE_PLACE) - np.searchsorted(joints, touching[:-1] + _ONE_PLACE)
    breaks = np.flatnonzero(passed > _PASSED)
    lines = np.column_stack([touching[np.append(0, breaks + 1)], touching[np.append(breaks, touching.size - 1)]])
    within = np.zeros_like(lines)
    lengths = np.concatenate([[0.0], np.diff(joints), [0.0]])  # nothing before the strip, nothing behind it
    for (first, last), more in zip(lines, within, strict=True):
        if last - first > _ONE_PLACE:
            more[0] = lengths[np.searchsorted(joints, first - _ONE_PLACE)]
            more[1] = lengths[np.searchsorted(joints, last + _ONE_PLACE, side="right")]
    return lines, within


def pairs(problem: Mixed, x: FloatArray, rows: FloatArray) -> tuple[PairForce, ...]:
    """What parts of the ribbon that touch each other exert, in order of s."""
    if not problem.pairs:
        return ()
    block = problem.pair_rows()
    push = -rows[problem.block_slices()["pairs"]]
    one, other = block.ends(x)
    apart = one - other
    distance = np.linalg.norm(apart, axis=1)
    q, starts = problem.parameters(x), np.concatenate([[0.0], np.cumsum(problem.lengths)])
    found = []
    for k, (s, u, s_other, u_other) in enumerate(block.places(x)):
        if push[k] <= _TOUCHES:
            continue
        feet = [s, s_other]
        for side, across in ((0, u), (1, u_other)):
            i = int(block.segments[side, k])
            if not problem.fields.free:  # the particle on a ruling: S = s + u eta
                feet[side] += across * (q[i, 2] * (feet[side] - starts[i]) + q[i, 3])
        force = push[k] * apart[k] / distance[k]
        found.append(PairForce(feet[0], float(u), feet[1], float(u_other), force, float(distance[k])))
    return tuple(sorted(found, key=lambda pair: (pair.s, pair.v)))
