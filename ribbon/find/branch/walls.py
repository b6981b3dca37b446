"""What holds a strip on walls' sides along a branch, where places of contact move along its edges.

Where `ribbon.find.contacts` found places that slide, every segment has a row of either edge that slides
(`ribbon.problems.touching`), of which few are in force: a place that comes to a joint goes over into the next segment.
The edge of a developable strip runs along t_z, so that a place in a segment before joint j is inside it as long as

    <normal, t_z(j)> >= 0 ,     one in the segment behind j as long as     <normal, t_z(j)> <= 0

and at the joint both rows say the same: distance, slope, force. Line contact stays on its joints (`WallRows`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.contact import Wall
from ribbon.problems import prolonged
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.touching import Touch

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: The edges, as `Touch.side`.
SIDES = (1.0, -1.0)
#: Places nearer to each other than so many segments are one; part of the largest push that is one, and no rest of a
#: minimiser that comes from inside.
_NEAR, _PUSHES = 1.6, 1e-5
#: Slope of the distance at a joint by which a place has gone over it: one that stays on it, as symmetry may make it, is
#: in either segment, and in one of them.
_OVER = 1e-7


class _Push(NamedTuple):
    """s: abscissa, l; side: edge, 0.0 for a whole ruling; force, D w / l^2; joint: -1 between joints."""

    s: float
    side: float
    force: float
    joint: int


def slides(problem: MixedProblem) -> bool:
    """Whether places of contact slide, all of them on planes."""
    return bool(problem.touching) and all(
        touch.slides and abs(touch.side) == 1.0 and isinstance(problem.walls[touch.wall], Wall)
        for touch in problem.touching
    )


def everywhere(problem: MixedProblem) -> tuple[Touch, ...]:
    """A place that slides on either edge of every segment, for every wall."""
    s = prolonged.joints(problem.lengths)
    middles = 0.5 * (s[1:] + s[:-1])
    return tuple(Touch(k, float(m), side, True) for k in range(len(problem.walls)) for m in middles for side in SIDES)


def _pushes(problem: MixedProblem, x: FloatArray, rows: FloatArray, wall: int) -> list[_Push]:
    """What pushes at x."""
    s, slices = prolonged.joints(problem.lengths), problem.block_slices()
    found = []
    joints = problem.wall_rows(wall).joints
    for j, pair in zip(joints, -rows[slices[f"wall_{wall}"]].reshape(-1, 2), strict=True):
        found += [_Push(float(s[j]), side, float(f), int(j)) for side, f in zip(SIDES, pair, strict=True) if f > 0.0]
    touches = [touch for touch in problem.touching if touch.wall == wall]
    if touches:
        block = problem.touch_rows(wall)
        at = s[block.segments] + block.places(x)
        found += [
            _Push(float(place), touch.side, float(f), -1)
            for touch, place, f in zip(touches, at, -rows[slices[f"touch_{wall}"]], strict=True)
            if f > 0.0
        ]
    return found


def carried(few: MixedProblem, x: FloatArray, rows: FloatArray, many: MixedProblem, y: FloatArray) -> FloatArray:
    """Multipliers of the rows of `many` at y, which is the shape x of `few`: 0 of what does not push, and of glue what
    balances."""
    out = np.zeros(many.row_count)
    old, new = few.block_slices(), many.block_slices()
    for name, where in new.items():
        if name.startswith("wall_"):
            wall = int(name.removeprefix("wall_"))
            pushes = _pushes(few, x, rows, wall)
            if slides(many):
                out[new[f"touch_{wall}"]] = _on_segments(many, y, wall, pushes)
                continue
            out[where] = _on_joints(few, many, wall, pushes)
            if f"touch_{wall}" in new:
                out[new[f"touch_{wall}"]] = rows[old[f"touch_{wall}"]]
        elif not name.startswith("touch_"):
            out[where] = rows[old[name]]
    return prolonged.multipliers(many, out, many, y)


def _on_segments(many: MixedProblem, y: FloatArray, wall: int, pushes: list[_Push]) -> FloatArray:
    """Multipliers of rows that slide: every place in the segment in which the distance is least."""
    segments = many.lengths.size
    out = np.zeros((segments, 2))
    slopes = _slopes(many, y, wall)
    least = _PUSHES * max((push.force for push in pushes), default=0.0)
    for column, side in enumerate(SIDES):
        own = sorted(push for push in pushes if push.side == side and push.force > least)
        while own:
            group = [push for push in own if push.s - own[0].s <= _NEAR * float(many.lengths.max())]
            own = own[len(group) :]
            force = sum(push.force for push in group)
            i = many.segment_at(sum(push.s * push.force for push in group) / force)
            beside = [j for j in (i, i - 1, i + 1) if 0 <= j < segments]
            near = [j for j in beside if slopes[j] <= _OVER and slopes[j + 1] >= -_OVER]
            out[near[0] if near else i, column] = -force
    return out.ravel()


def _on_joints(few: MixedProblem, many: MixedProblem, wall: int, pushes: list[_Push]) -> FloatArray:
    """Multipliers of rows at joints: those of a line contact on all joints of the line, with the force per length that
    the line had."""
    joints = many.wall_rows(wall).joints
    out = np.zeros((joints.size, 2))
    here, there = prolonged.joints(few.lengths), prolonged.joints(many.lengths)[joints]
    for column, side in enumerate(SIDES):
        force = {push.joint: push.force for push in pushes if push.side == side and push.joint >= 0}
        for j, f in force.items():
            at = int(np.argmin(np.abs(there - here[j])))
            alone = j - 1 not in force and j + 1 not in force
            out[at, column] = -f * (1.0 if alone else few.lengths.size / many.lengths.size)
            if j + 1 in force:
                inside = (there > here[j] + 1e-12) & (there < here[j + 1] - 1e-12)
                out[inside, column] = -0.5 * (f + force[j + 1]) * few.lengths.size / many.lengths.size
    return out.ravel()


def _slopes(problem: MixedProblem, x: FloatArray, wall: int) -> FloatArray:
    """<normal, t_z> (p + 1,) at the joints, the slope of the distance along the edges."""
    plane = problem.walls[wall]
    assert isinstance(plane, Wall)
    return np.asarray(problem.joints(x)[1][:, :, 2] @ np.asarray(plane.normal))


def _beside(problem: MixedProblem, active: BoolArray) -> tuple[BoolArray, BoolArray]:
    """Whether (walls, joints, edges) a place is in the segment before the joint, and behind it; across the seam of a
    band of an odd number of half turns edges change places. Ends of a strip are none."""
    slices = problem.block_slices()
    held = np.array([active[slices[f"touch_{k}"]].reshape(-1, 2) for k in range(len(problem.walls))])
    none = np.zeros_like(held[:, :1])
    before, behind = np.concatenate([none, held], axis=1), np.concatenate([held, none], axis=1)
    before[:, -1] = behind[:, 0] = False
    if problem.closure is not None:
        behind[:, 0] = held[:, 0]
        before[:, 0] = held[:, -1, ::-1] if problem.closure.sign < 0 else held[:, -1]
    return before, behind


def on_way(problem: MixedProblem, x: FloatArray, active: BoolArray) -> FloatArray:
    """For every wall, joint and edge how far (slope of the distance) a place is from going over the joint, 1 where
    there is none."""
    before, behind = _beside(problem, active)
    slope = np.array([_slopes(problem, x, k) for k in range(len(problem.walls))])[:, :, None]
    return np.asarray(np.where(before == behind, 1.0, _OVER + np.where(before, slope, -slope)).ravel())


def represented(problem: MixedProblem, active: BoolArray) -> BoolArray:
    """Rows (m,) next to a place in force on the same edge: near the joint they say what it says."""
    out = np.zeros(active.size, dtype=bool)
    slices = problem.block_slices()
    before, behind = _beside(problem, active)
    for k in range(len(problem.walls)):
        out[slices[f"touch_{k}"]] = (before[k, :-1] | behind[k, 1:]).ravel()
    return out & ~active


def handed_over(
    problem: MixedProblem, condition: int, active: BoolArray, rows: FloatArray
) -> tuple[BoolArray, FloatArray, str]:
    """Rows in force and multipliers once a place has gone over a joint (`on_way`), and in words what happened."""
    joints = problem.lengths.size + 1
    wall, joint, edge = np.unravel_index(condition, (len(problem.walls), joints, 2))
    start = problem.block_slices()[f"touch_{wall}"].start
    swapped = joint == 0 and problem.closure is not None and problem.closure.sign < 0
    before = start + 2 * ((joint - 1) % (joints - 1)) + (1 - edge if swapped else edge)
    behind = start + 2 * joint + edge
    one, other = (before, behind) if active[before] else (behind, before)
    active, rows = active.copy(), rows.copy()
    active[one], active[other] = False, True
    rows[one], rows[other] = 0.0, rows[one]
    s = float(prolonged.joints(problem.lengths)[joint])
    return active, rows, f"a contact slides over s = {s:.3g} l"
