"""Rows of constraints beside the glue of the mixed model: held ends, seams, gauges, contact.

Each kind fills values, Jacobian and Hessian in a fixed sparse structure (row, column) with rows counted from 0. The
multiplier of a row that is a length is a force and that of one that is an angle a moment (thesis, appendix A); they do
not depend on the unknowns that describe the ribbon. Rows: docs/theory.md, eq. (5.1), (5.2), (5.3).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ribbon.element.quaternion import form, left_matrix, right_matrix, rotate, rotate_by_q
from ribbon.problems.layout import ETA, OMEGA, POSITION, QUATERNION

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Rows(Protocol):
    """A block of constraints ``lower <= c(x) <= upper``."""

    @property
    def count(self) -> int: ...

    @property
    def lower(self) -> float: ...

    @property
    def upper(self) -> float: ...

    def values(self, x: FloatArray) -> FloatArray: ...

    def jacobian_structure(self) -> tuple[IntArray, IntArray]: ...

    def jacobian(self, x: FloatArray) -> FloatArray: ...

    def hessian_structure(self) -> tuple[IntArray, IntArray]: ...

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray: ...


_Q = range(QUATERNION, OMEGA)
_NONE = (np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))


@dataclass(frozen=True)
class LinearRows:
    """``coefficients x[columns] = value``: coefficients (count, k), columns (k,), value (count,)."""

    coefficients: FloatArray
    columns: IntArray
    value: FloatArray
    lower: float = 0.0
    upper: float = 0.0

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.value)

    def values(self, x: FloatArray) -> FloatArray:
        """(count,)."""
        return self.coefficients @ x[self.columns] - self.value

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the entries that are not zero."""
        rows, places = np.nonzero(self.coefficients)
        return rows, self.columns[places]

    def jacobian(self, x: FloatArray) -> FloatArray:
        """The entries that are not zero."""
        return self.coefficients[np.nonzero(self.coefficients)]

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """None."""
        return _NONE

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray:
        """None."""
        return np.empty(0)


@dataclass(frozen=True)
class UnitRow:
    """``(|q|^2 - 1) / 2 = 0`` for the quaternion at `columns` (4,): needed once, where no frame is held."""

    columns: IntArray
    count: int = 1
    lower: float = 0.0
    upper: float = 0.0

    def values(self, x: FloatArray) -> FloatArray:
        """(1,)."""
        q = x[self.columns]
        return np.array([0.5 * (q @ q - 1.0)])

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """One row of four."""
        return np.zeros(4, dtype=np.int64), self.columns

    def jacobian(self, x: FloatArray) -> FloatArray:
        """q."""
        return x[self.columns]

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """The diagonal."""
        return self.columns, self.columns

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray:
        """The unit matrix times the multiplier."""
        return np.full(4, multipliers[0])


def imaginary_part(q: FloatArray) -> FloatArray:
    """(3, 4): ``2 Im(conj(q) o p)`` as a matrix applied to p: twice the turn from q to p, for small ones."""
    matrix = np.empty((4, 4))
    left_matrix(q * np.array([1.0, -1.0, -1.0, -1.0]), matrix)
    return 2.0 * matrix[1:]


@dataclass(frozen=True)
class SeamRows:
    """``2 Im(conj(q_0 o delta) o q_p) = 0``: the end's frame is the start's turned by delta (4,) (thesis, 6.1).

    first, last (4,): columns of q_0 and q_p.
    """

    first: IntArray
    last: IntArray
    delta: FloatArray
    count: int = 3
    lower: float = 0.0
    upper: float = 0.0
    _forms: FloatArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        right = np.empty((4, 4))
        right_matrix(np.asarray(self.delta, dtype=float), right)
        # rows of 2 Im(conj(s) o p) are bilinear in s and p: s^T C_k p, column by column of the unit quaternions s
        forms = np.stack([imaginary_part(unit) for unit in np.eye(4)], axis=1)
        object.__setattr__(self, "_forms", np.einsum("sa,ksb->kab", right, forms))

    def values(self, x: FloatArray) -> FloatArray:
        """(3,)."""
        return np.einsum("kab,a,b->k", self._forms, x[self.first], x[self.last])

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """Three rows of eight."""
        return np.repeat(np.arange(3), 8), np.tile(np.concatenate([self.first, self.last]), 3)

    def jacobian(self, x: FloatArray) -> FloatArray:
        """By q_0 and q_p."""
        return np.concatenate([self._forms @ x[self.last], x[self.first] @ self._forms], axis=1).ravel()

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """The block of q_p by q_0."""
        return np.repeat(self.last, 4), np.tile(self.first, 4)

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray:
        """Constant forms times the multipliers."""
        return np.einsum("k,kab->ba", multipliers, self._forms).ravel()


@njit(cache=True)
def _distances(x, joints, stride, point, normal, half_width, oblique, height, out):
    u = np.empty(3)
    edge = np.empty(3)
    for i in range(joints.size):
        k = stride * joints[i]
        u[0], u[1], u[2] = 1.0, 0.0, oblique * x[k + ETA]
        rotate(x[k + QUATERNION : k + OMEGA], u, edge)
        d = -height
        e = 0.0
        for c in range(3):
            d += normal[c] * (x[k + c] - point[c])
            e += normal[c] * edge[c]
        out[2 * i] = d + half_width * e
        out[2 * i + 1] = d - half_width * e


@njit(cache=True)
def _slopes(x, joints, stride, normal, half_width, oblique, plate, out):
    u = np.empty(3)
    edge = np.empty(3)
    by_q = np.empty((3, 4))
    at = 0
    for i in range(joints.size):
        k = stride * joints[i]
        q = x[k + QUATERNION : k + OMEGA]
        u[0], u[1], u[2] = 1.0, 0.0, oblique * x[k + ETA]
        rotate_by_q(q, u, by_q)
        u[0], u[2] = 0.0, 1.0
        rotate(q, u, edge)
        tangent = normal[0] * edge[0] + normal[1] * edge[1] + normal[2] * edge[2]
        for side in range(2):
            f = half_width if side == 0 else -half_width
            for c in range(3):
                out[at + c] = normal[c]
            for c in range(4):
                out[at + 3 + c] = f * (normal[0] * by_q[0, c] + normal[1] * by_q[1, c] + normal[2] * by_q[2, c])
            out[at + 7] = f * oblique * tangent
            at += 8
            if plate:
                out[at] = -1.0
                at += 1


@njit(cache=True)
def _curvatures(x, joints, stride, normal, half_width, oblique, multipliers, out):
    u = np.empty(3)
    n = np.empty((4, 4))
    at = 0
    for i in range(joints.size):
        k = stride * joints[i]
        q = x[k + QUATERNION : k + OMEGA]
        f = half_width * (multipliers[2 * i] - multipliers[2 * i + 1])
        u[0], u[1], u[2] = 1.0, 0.0, oblique * x[k + ETA]
        form(normal, u, n)
        for r in range(4):
            for c in range(r + 1):
                out[at] = 2.0 * f * n[r, c]
                at += 1
        u[0], u[2] = 0.0, oblique
        form(normal, u, n)
        for r in range(4):
            out[at] = 2.0 * f * (n[r, 0] * q[0] + n[r, 1] * q[1] + n[r, 2] * q[2] + n[r, 3] * q[3])
            at += 1


@dataclass(frozen=True)
class WallRows:
    """Both edges of the rulings at `joints` on the wall's side (thesis, eq. 6.2), two rows a joint.

    ``<r +- (w/2) (t_x + eta t_z) - point, normal> - height >= 0``; `plate`: column of the height of a pressure plate,
    or -1. point in units of l, half_width = w / (2 l), stride: unknowns per joint; oblique: 1, or 0 where eta's
    place is the twist's and the sections are square to the centreline.
    """

    joints: IntArray
    stride: int
    point: FloatArray
    normal: FloatArray
    half_width: float
    plate: int = -1
    lower: float = 0.0
    upper: float = np.inf
    oblique: float = 1.0

    @property
    def count(self) -> int:
        """Two rows a joint."""
        return 2 * len(self.joints)

    def values(self, x: FloatArray) -> FloatArray:
        """Distances (count,) of the edges from the wall."""
        out = np.empty(self.count)
        height = x[self.plate] if self.plate >= 0 else 0.0
        _distances(x, self.joints, self.stride, self.point, self.normal, self.half_width, self.oblique, height, out)
        return out

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """r, q, eta (and the plate's height) of the joint."""
        local = np.array([*range(POSITION, OMEGA), ETA])
        columns = np.repeat(self.stride * self.joints, 2)[:, None] + local
        if self.plate >= 0:
            columns = np.column_stack([columns, np.full(self.count, self.plate)])
        return np.repeat(np.arange(self.count), columns.shape[1]), columns.ravel()

    def jacobian(self, x: FloatArray) -> FloatArray:
        """In the order of the structure."""
        out = np.empty(self.count * (9 if self.plate >= 0 else 8))
        _slopes(x, self.joints, self.stride, self.normal, self.half_width, self.oblique, self.plate >= 0, out)
        return out

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """q by q and q by eta of every joint."""
        pairs: list[Any] = [(q, other) for q in _Q for other in range(QUATERNION, q + 1)]
        pairs += [(ETA, q) for q in _Q]
        local = np.array(pairs)
        base = self.stride * self.joints[:, None]
        return (base + local[:, 0]).ravel(), (base + local[:, 1]).ravel()

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray:
        """In the order of the structure."""
        out = np.empty(14 * len(self.joints))
        _curvatures(x, self.joints, self.stride, self.normal, self.half_width, self.oblique, multipliers, out)
        return out
