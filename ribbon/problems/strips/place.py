"""Where several strips begin: each in a shape of its own, put where a clamp or a joint holds it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbon.element import quaternion
from ribbon.problems.strips.joint import End, Joint
from ribbon.problems.strips.part import Part
from ribbon.problems.strips.problem import StripsProblem

FloatArray = NDArray[np.float64]


def placed(problem: StripsProblem, shapes: list[tuple[FloatArray, FloatArray]]) -> FloatArray:
    """Unknowns of the strips with omega and eta (p + 1,) at their joints: those that a clamp holds where it does, then
    one after the other at the joints of those that are placed; loops stay open."""
    found: list[FloatArray | None] = [None] * len(problem.parts)
    for k, part in enumerate(problem.parts):
        if _is_clamped(part):
            found[k] = part.state(*shapes[k])
    waits = list(problem.joints)
    while True:
        ready = [joint for joint in waits if (found[joint.one.strip] is None) != (found[joint.other.strip] is None)]
        if not ready:
            break
        joint = ready[0]
        waits.remove(joint)
        forward = found[joint.other.strip] is None
        known, fresh = (joint.one, joint.other) if forward else (joint.other, joint.one)
        x = found[known.strip]
        assert x is not None
        found[fresh.strip] = _joined(problem, joint, known, fresh, x, shapes[fresh.strip], forward)
    whole = [
        part.state(*shapes[k]) if x is None else x for k, (x, part) in enumerate(zip(found, problem.parts, strict=True))
    ]
    return np.concatenate(whole)


def _is_clamped(part: Part) -> bool:
    """Whether a clamp says where the strip stands."""
    end = part.end_position is not None and part.end_quaternion is not None
    return part.is_held or (end and part.start_quaternion is None)


def _joined(
    problem: StripsProblem, joint: Joint, known: End, fresh: End, x: FloatArray,
    shape: tuple[FloatArray, FloatArray], forward: bool,
) -> FloatArray:  # fmt: skip
    """The strip at the end `fresh` put where the end `known` of a strip with the unknowns x stands."""
    there = problem.parts[known.strip].layout.joint(known.joint)
    r = problem.lengths_over[known.strip] * x[there.position]
    turn = np.asarray(joint.turn)
    q = quaternion.compose(x[there.quaternion], turn if forward else quaternion.conjugate(turn))
    part, sigma = problem.parts[fresh.strip], problem.lengths_over[fresh.strip]
    y = part.state(*shape)
    here = part.layout.joint(fresh.joint)
    spin = quaternion.compose(q, quaternion.conjugate(y[here.quaternion]))
    positions, turned = part.layout.positions(y), part.layout.quaternions(y)
    moved = positions @ quaternion.matrix(spin).T
    positions[:] = moved + r / sigma - moved[0 if fresh.joint == 0 else -1]
    turned[:] = np.array([quaternion.compose(spin, one) for one in turned])
    return y
