"""A state carried from segment to segment: its fields at the joints of other segments, as unknowns of their problem."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbon.problems.chained import ChainedProblem
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]

#: Turn of the tangent (rad) that a shape may gain or lose anywhere where it is sampled on fewer segments.
_TURNS = 0.3


def merged(lengths: FloatArray) -> FloatArray:
    """Neighbouring segments joined in pairs."""
    pairs = lengths[: lengths.size // 2 * 2].reshape(-1, 2).sum(axis=1)
    if lengths.size % 2:
        pairs[-1] += lengths[-1]
    return pairs


def resample(problem: MixedProblem, x: FloatArray, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
    """omega and eta (k + 1,) of the shape x at the joints of other `lengths` (k,)."""
    return resampled(*problem.joint_values(x), problem.lengths, lengths)


def resampled(
    omega: FloatArray, eta: FloatArray, lengths: FloatArray, others: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """omega and eta (p + 1,) at the joints of `lengths` (p,), at those of `others` (k,).

    A peak of omega narrower than the `others` turns the strip by as much there (`_spread`): sampled on segments four
    times as long, a quarter of a turn beside a clamp would be a whole one, and the strip begin with a loop.
    """
    old = np.concatenate([[0.0], np.cumsum(lengths)])
    new = np.concatenate([[0.0], np.cumsum(others)])
    bent, turned = np.interp(new, old, omega), np.interp(new, old, eta)
    if others.size < lengths.size:
        there, here = _turns(omega, lengths), _turns(bent, others)
        if float(np.abs(np.interp(new, old, there) - here).max()) > _TURNS:
            bent = _spread(omega, old, new)
    return bent, turned


def _turns(omega: FloatArray, lengths: FloatArray) -> FloatArray:
    """The angle (p + 1,) by which the tangent has turned at the joints, from s = 0."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (omega[1:] + omega[:-1]) * lengths)])


def _spread(omega: FloatArray, old: FloatArray, new: FloatArray) -> FloatArray:
    """omega (p + 1,) at abscissae `old`, at fewer ones `new` (k + 1,), its integral kept: the adjoint of interpolation,
    over the integrals of the hats: ``omega_J = sum_i N_J(s_i) m_i omega_i / M_J`` (m_i, M_J: of the hats)."""
    hats = np.stack([np.interp(old, new, hat) for hat in np.eye(new.size)])
    masses = np.zeros(old.size)
    masses[:-1] += 0.5 * np.diff(old)
    masses[1:] += 0.5 * np.diff(old)
    whole = np.zeros(new.size)
    whole[:-1] += 0.5 * np.diff(new)
    whole[1:] += 0.5 * np.diff(new)
    return np.asarray(hats @ (masses * omega) / whole)


def transferred(old: MixedProblem, x: FloatArray, fresh: MixedProblem) -> FloatArray:
    """The shape x of `old` as unknowns of `fresh`, whatever its segments, walls and clamps; left where it was."""
    if np.array_equal(old.lengths, fresh.lengths):
        y = np.zeros(fresh.size)
        y[: fresh.layout.ribbon] = x[: old.layout.ribbon]
        return y
    omega, eta = resample(old, x, fresh.lengths)
    bent = old.in_plane_values(x)
    if bent is not None:
        there, here = (np.concatenate([[0.0], np.cumsum(problem.lengths)]) for problem in (fresh, old))
        bent = np.interp(there, here, bent)
    first = old.layout.joint(0)
    reference = tuple(x[first.quaternion]) if fresh.start_quaternion is None else fresh.reference
    anchored = fresh.with_changes(reference=reference, origin=tuple(x[first.position]))
    start = fresh.start_position
    y = anchored.state(omega, eta, bent)
    if start is None:
        fresh.layout.positions(y)[:] += x[first.position] - y[first.position]
    return y


def on_joints(old: ChainedProblem, x: FloatArray, fresh: ChainedProblem) -> FloatArray:
    """The fields of the shape x of `old` at the joints of `fresh`, linear between them, as its unknowns."""
    s, there = (np.concatenate([[0.0], np.cumsum(each.lengths)]) for each in (old, fresh))
    bent = old.in_plane_values(x)
    omega, eta = resampled(*old.joint_values(x), old.lengths, fresh.lengths)
    return fresh.state(omega, eta, None if bent is None else np.interp(there, s, bent))
