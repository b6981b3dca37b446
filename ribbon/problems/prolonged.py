"""The state of a glued ribbon of few segments as a start on others that nest in them: fields, joints, multipliers.

omega and eta are linear on segments and come near their curves f as a least-squares fit does, ``f - h^2 f''/12`` at the
joints, up to h^4 where f is smooth (docs/theory.md, eq. (4.10)). So f is put together first, by cubics through four
joints, then fitted by the shorter segments in the same way: what is missing is of order h^4, h^2 without (de Boor 1978,
A Practical Guide to Splines, chapter II). Joints follow from the fields by the glue, its multipliers from balance at
the joints, from the last to the first (`mixed_kernels.costates`); those of what holds the ribbon stay.
"""

from __future__ import annotations

import numpy as np

from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.chained import ChainedProblem
from ribbon.problems.held import FloatArray
from ribbon.problems.layout import STRIDE
from ribbon.problems.mixed import MixedProblem

#: Part of the way of a slope to its bound that is left at least, where few segments have all of it.
_LEFT = 0.5


def _seconds(s: FloatArray, f: FloatArray) -> FloatArray:
    """Second divided differences (k + 1,), f''/2, of f at the joints s; at the ends those beside."""
    h = np.diff(s)
    out = np.zeros_like(f)
    out[1:-1] = np.diff(np.diff(f) / h) / (h[1:] + h[:-1])
    out[0], out[-1] = out[1], out[-2]
    return out


def _lowered(s: FloatArray) -> FloatArray:
    """How far (k + 1,) a fit lies below its curve at the joints, per f''/2: h^2 / 6, weighed where segments differ."""
    h = np.diff(s)
    one, other = np.append(h[0], h), np.append(h, h[-1])
    return (one**3 + other**3) / (6.0 * (one + other))


def finer(s: FloatArray, f: FloatArray, t: FloatArray) -> FloatArray:
    """Values at the joints t (p + 1,) of what has the values f (k + 1,) at the joints s."""
    if s.size < 4:
        return np.interp(t, s, f)
    bend = _seconds(s, f)
    f = f + bend * _lowered(s)
    j = np.clip(np.searchsorted(s, t, side="right") - 1, 0, s.size - 2)
    low, high = np.maximum(j - 1, 0), np.minimum(j + 2, s.size - 1)
    share = (t - s[low]) / (s[high] - s[low])
    here = (1.0 - share) * bend[j] + share * bend[j + 1]
    part = (t - s[j]) / (s[j + 1] - s[j])
    curve = (1.0 - part) * f[j] + part * f[j + 1] + (t - s[j]) * (t - s[j + 1]) * here
    return np.asarray(curve - ((1.0 - part) * bend[j] + part * bend[j + 1]) * _lowered(t))


def joints(lengths: FloatArray) -> FloatArray:
    """Abscissae (p + 1,) of the joints."""
    return np.concatenate([[0.0], np.cumsum(lengths)])


def fields(few: ChainedProblem, x: FloatArray, many: ChainedProblem) -> FloatArray:
    """The fields of the shape x of a chained ribbon as unknowns of `many`, which has more segments, same clamp."""
    s, t = joints(few.lengths), joints(many.lengths)
    omega, eta = few.joint_values(x)
    bent = few.in_plane_values(x)
    turned = finer(s, eta, t) if many.fields.free else _within(many, finer(s, eta, t), np.interp(t, s, eta))
    turned[0] = eta[0] if few.clamp.ruling == "straight" else turned[0]
    return many.state(finer(s, omega, t), turned, None if bent is None else finer(s, bent, t))


def shape(few: MixedProblem, x: FloatArray, many: MixedProblem) -> FloatArray:
    """The shape x of `few` as unknowns of `many`, which has more segments and the same clamps, left where it was."""
    s, t = joints(few.lengths), joints(many.lengths)
    omega, eta = few.joint_values(x)
    bent = few.in_plane_values(x)
    steep = np.interp(t, s, eta)
    turned = finer(s, eta, t) if many.fields.free else _within(many, finer(s, eta, t), steep)
    straight = (few.start_straight, 0), (few.end_straight, -1)
    for held, joint in straight:
        if held:
            turned[joint] = 0.0
    if many.closure is not None:  # both sides of the seam
        turned[[0, -1]] = steep[[0, -1]]
    wave = finer(s, omega, t)
    if many.closure is not None:
        wave[[0, -1]] = omega[[0, -1]]
    first = few.layout.joint(0)
    anchored = many.anchored(few.anchor(x))
    y = anchored.state(wave, turned, None if bent is None else finer(s, bent, t))
    if many.start_position is None:
        many.layout.positions(y)[:] += x[first.position] - y[:STRIDE][first.position]
    return y


def _within(many: MixedProblem | ChainedProblem, eta: FloatArray, linear: FloatArray) -> FloatArray:
    """eta (p + 1,) where its slopes stay inside of the bounds as far as those of `linear` do, else that."""
    steep, before = (np.abs(np.diff(each)) / many.lengths * many.half_width for each in (eta, linear))
    loud = 1.0 - steep < _LEFT * (1.0 - before)
    if not loud.any():
        return eta
    near = np.convolve(loud, np.ones(5), "same") > 0.5
    at = np.append(near, False) | np.append(False, near)
    mixed = np.where(at, linear, eta)
    steep = np.abs(np.diff(mixed)) / many.lengths * many.half_width
    return mixed if steep.max(initial=0.0) < 1.0 else linear


def multipliers(few: MixedProblem, rows: FloatArray, many: MixedProblem, x: FloatArray) -> FloatArray:
    """Multipliers (m,) of the rows of `many` at x, from those of `few`: both have the same rows beside the glue."""
    glue, old = kernels.ROWS * many.lengths.size, kernels.ROWS * few.lengths.size
    out = np.zeros(many.row_count)
    out[glue:] = rows[old:]
    row, column = many.jacobian_structure()
    jacobian = many.jacobian(x)
    slope = many.gradient(x) + np.bincount(column, jacobian * out[row], minlength=many.size)
    kernels.costates(jacobian, many.fields.components, slope, out[:glue])
    return out
