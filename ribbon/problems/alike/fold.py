"""One fold of a band that is alike about n axes: the 2n-th part of it, between two of its axes of symmetry.

A band of n half turns may have the symmetry D_n: half turns about n axes in a plane and turns by 2 pi k / n about their
normal, each of which maps it onto itself. An axis along the ruling t_x of a particle reverses s and the normal there:
omega and eta are odd about it, twist and in-plane curvature even; an axis along the normal t_y reverses s and the
ruling: omega, eta and twist are even, in-plane curvature odd. They alternate, and by turns about both (the product of
two half turns is a turn by twice the angle between their axes, without a shift where they meet)::

    omega(s + l/n) = -omega(s) ,   eta(s + l/n) = -eta(s) ,   tau(s + l/n) = tau(s) ,   kappa_2(s + l/n) = -kappa_2(s)

so that the part from an axis of the first kind, a = t_x(0), to the next one, of the second, t_y(l / 2n), is all there
is to know, and the rest closes where

    a . t_y = cos(pi / n) ,    r . (a x t_y) = 0                  (r from the first particle: the axes meet)

hold at its end. A stationary point among the symmetric shapes is one among all (principle of symmetric criticality:
Palais 1979, doi:10.1007/BF01941322); whether it is stable among all is another question. docs/theory.md, eq. (5.13).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ribbon.boundary import Clamp
from ribbon.element.quaternion import form
from ribbon.problems.conditions import LinearRows, Rows
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_X, _Y, _Z = np.eye(3)


def _form(along: FloatArray, of: FloatArray) -> FloatArray:
    """N (4, 4): q^T N q = along . R(q) of."""
    out = np.empty((4, 4))
    form(along, of, out)
    return out


@dataclass(frozen=True)
class AxesRows:
    """Two rows: the normal at the joint stands at the angle to e_x whose cosine is `cosine`, and both lines, that of
    e_x through the origin and that of the normal, meet.

    position (3,), frame (4,): columns of r and q of the joint.
    """

    position: IntArray
    frame: IntArray
    cosine: float
    count: int = 2
    lower: float = 0.0
    upper: float = 0.0

    def values(self, x: FloatArray) -> FloatArray:
        """(2,)."""
        r, q = x[self.position], x[self.frame]
        along = [float(q @ one @ q) for one in _FORMS]
        return np.array([along[0] - self.cosine, r[2] * along[1] - r[1] * along[2]])

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """The first row by q, the second by r and q."""
        return np.repeat(np.arange(2), (4, 7)), np.concatenate([self.frame, self.position, self.frame])

    def jacobian(self, x: FloatArray) -> FloatArray:
        """In the order of the structure."""
        r, q = x[self.position], x[self.frame]
        by = [2.0 * one @ q for one in _FORMS]
        place = np.array([0.0, -float(q @ _FORMS[2] @ q), float(q @ _FORMS[1] @ q)])
        return np.concatenate([by[0], place, r[2] * by[1] - r[1] * by[2]])

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """q by q, lower triangle, and q by r_y and r_z."""
        row, column = np.tril_indices(4)
        return (
            np.concatenate([self.frame[row], self.frame, self.frame]),
            np.concatenate([self.frame[column], np.repeat(self.position[1:], 4)]),
        )

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray:
        """In the order of the structure."""
        r, q = x[self.position], x[self.frame]
        own = 2.0 * (multipliers[0] * _FORMS[0] + multipliers[1] * (r[2] * _FORMS[1] - r[1] * _FORMS[2]))
        mixed = 2.0 * multipliers[1] * np.concatenate([-_FORMS[2] @ q, _FORMS[1] @ q])
        return np.concatenate([own[np.tril_indices(4)], mixed])


#: The normal's parts along e_x, e_y and e_z.
_FORMS = (_form(_X, _Y), _form(_Y, _Y), _form(_Z, _Y))


@dataclass(frozen=True)
class Fold(MixedProblem):
    """The 2 `folds`-th part of a band, on its own: its length is the unit, its first axis e_x through the origin.

    level: whether its first and its last segment are halves of segments that go on behind the axes: what is even about
    an axis is constant there.
    """

    folds: int = 3
    level: tuple[bool, bool] = (False, False)

    def _make_blocks(self) -> dict[str, Rows]:
        found = super()._make_blocks()
        first, second = self.layout.joint(0), self.layout.joint(1)
        last, before = self.layout.joint(-1), self.layout.joint(-2)
        found["fold_axes"] = AxesRows(last.position, last.quaternion, math.cos(math.pi / self.folds))
        found["fold_start"] = LinearRows(np.ones((1, 1)), np.array([first.omega]), np.zeros(1))
        same = np.array([[-1.0, 1.0]])
        if self.level[0] and self.fields.free:
            found["fold_twist"] = LinearRows(same, np.array([first.eta, second.eta]), np.zeros(1))
        if self.level[1]:
            found["fold_omega"] = LinearRows(same, np.array([before.omega, last.omega]), np.zeros(1))
            found["fold_eta"] = LinearRows(same, np.array([before.eta, last.eta]), np.zeros(1))
        if self.fields.in_plane:
            start, end = self.layout.sideways.start, self.layout.sideways.stop - 1
            found["fold_in_plane"] = LinearRows(np.ones((1, 1)), np.array([end]), np.zeros(1))
            if self.level[0]:
                found["fold_sideways"] = LinearRows(same, np.array([start, start + 1]), np.zeros(1))
        return found


def first_axis(problem: MixedProblem) -> float:
    """Abscissa (l) of the first axis of a band: the middle of its first segment where its seam slides there
    (`ribbon.problems.held.Held.slides`), else its start."""
    return 0.5 * float(problem.lengths[0]) if problem.slides else 0.0


def fold_of(problem: MixedProblem, folds: int) -> Fold:
    """A fold of a band whose equal segments are a multiple of `folds`."""
    segment, start = 1.0 / problem.lengths.size, first_axis(problem)
    reach = 0.5 / folds
    joints = segment * np.arange(math.ceil(start / segment - 1e-9), problem.lengths.size) - start
    joints = joints[(joints > 1e-9 * segment) & (joints < reach - 1e-9 * segment)]
    lengths = np.diff(np.concatenate([[0.0], joints, [reach]]))
    level = bool(lengths[0] < 0.75 * segment), bool(lengths[-1] < 0.75 * segment)
    strip = replace(problem.strip, length=problem.strip.length * reach)
    ruling = "free" if problem.fields.free else "straight"
    return Fold(
        strip=strip, start=Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), ruling), end=None, closure=None,
        walls=(), gravity=None, energy=problem.energy, lengths=lengths / reach, stiffness=problem.stiffness,
        in_plane=problem.in_plane, folds=folds, level=level,
    )  # fmt: skip


def unfolded(fold: Fold, x: FloatArray, problem: MixedProblem) -> FloatArray:
    """The whole band of a fold x as unknowns of `problem`, whatever its segments."""
    n, reach = fold.folds, 0.5 / fold.folds
    here = reach * np.concatenate([[0.0], np.cumsum(fold.lengths)])
    s = np.concatenate([[0.0], np.cumsum(problem.lengths)]) - first_axis(problem)
    period = np.floor(n * s)
    inside = s - period / n
    back = inside > reach
    inside = np.where(back, 1.0 / n - inside, inside)
    sign = np.where(period % 2.0 == 0.0, 1.0, -1.0)
    omega, eta = (np.interp(inside, here, values) for values in fold.joint_values(x))
    sideways = fold.in_plane_values(x)
    bent = None
    if sideways is not None:
        bent = sign * np.where(back, -1.0, 1.0) * np.interp(inside, here, sideways) / reach
    turned = eta / reach if fold.fields.free else sign * eta
    return problem.state(sign * omega / reach, turned, bent)
