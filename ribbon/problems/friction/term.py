"""What the friction of one increment adds to the energy: of every place of contact, with its largest friction known.

At a particle that a wall pushes, u = (x - place) along the wall is how far it went since the last increment, and T what
it exerts on the wall along it. Coulomb's law in an increment (docs/theory.md, eq. (5.15)),

    |T| <= b ,   u = 0 where |T| < b ,   u = c T with c >= 0 where |T| = b ,      b = mu N ,

is the condition of a minimum of b |u|. With a guess L of T and a stiffness r it is, for a known b, also that of::

    psi(u) = (|t|^2 - <|t| - b>^2 - |L|^2) / (2 r) ,   t = L + r u ,   psi_u = t min(1, b / |t|) = T ,
    psi_uu = r I  (stick, |t| <= b) ,   r (b / |t|) (I - e e^T) , e = t / |t|  (slip) ,

once L = T (augmented Lagrangian: P. Alart and A. Curnier 1991, doi:10.1016/0045-7825(91)90022-X; J. C. Simo and
T. A. Laursen 1992, doi:10.1016/0045-7949(92)90540-G), whatever r: psi is once continuously differentiable, and T
obeys the bound to rounding at every x. b and L are put right between minimisations (`ribbon.find.friction.increment`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ribbon.problems.friction.particles import Vector

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class AlongRows(Protocol):
    """Where places are along a direction, one row each (`ribbon.problems.friction.particles.ParticleRows`)."""

    @property
    def count(self) -> int:
        """Number of rows."""

    @property
    def columns(self) -> IntArray:
        """Columns (k, n) on which each depends."""

    def values(self, x: FloatArray) -> FloatArray:
        """(k,)."""

    def jacobian(self, x: FloatArray) -> FloatArray:
        """By `columns`, row after row."""

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the entries of `hessian`."""

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray:
        """Of the sum of multipliers times rows."""

    def points(self, x: FloatArray) -> FloatArray:
        """Where (k, 3) the places are."""


class Group(NamedTuple):
    """Rubs of one normal: which (k,), two directions along the wall (2, 3), and the rows along each."""

    which: IntArray
    along: FloatArray
    rows: tuple[AlongRows, AlongRows]


def tangents(normal: Sequence[float] | FloatArray) -> FloatArray:
    """Two unit vectors (2, 3) across a unit vector and each other."""
    return np.asarray(np.linalg.svd(np.asarray(normal, dtype=float)[None, :])[2][1:])


def rubbed(t: FloatArray, bound: FloatArray, stiffness: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """psi + |L|^2 / (2 r) (k,), T (k, 2) and its derivative by u (k, 2, 2) of trials t (k, 2), bounds (k,) and
    stiffnesses (k,)."""
    size = np.linalg.norm(t, axis=1)
    slips = size > bound
    safe = np.where(size > 0.0, size, 1.0)
    part = np.where(slips, bound / safe, 1.0)
    over = np.maximum(size - bound, 0.0)
    e = t / safe[:, None]
    turned = np.eye(2) - slips[:, None, None] * e[:, :, None] * e[:, None, :]
    value = (size**2 - over**2) / (2.0 * stiffness)
    return value, part[:, None] * t, (stiffness * part)[:, None, None] * turned


def grouped(rubs: Sequence[Any], rows_of: Callable[[list[Any], FloatArray], AlongRows]) -> list[Group]:
    """The rubs by their normals; rows_of: distances of some of them along a direction (3,)."""
    places: dict[Vector, list[int]] = {}
    for k, rub in enumerate(rubs):
        places.setdefault(rub.normal, []).append(k)
    found = []
    for normal, which in places.items():
        along = tangents(normal)
        own = [rubs[k] for k in which]
        found.append(Group(np.array(which), along, (rows_of(own, along[0]), rows_of(own, along[1]))))
    return found


class Friction:
    """The friction of an increment at `rubs`, in groups of one normal each (`grouped`)."""

    def __init__(self, rubs: Sequence[Any], groups: list[Group]) -> None:
        self.rubs = tuple(rubs)
        self.groups = groups
        self.bound = np.array([rub.bound for rub in rubs])
        self.place = np.array([rub.place for rub in rubs])
        self.guess = np.array([rub.force for rub in rubs])
        self.stiffness = np.array([rub.stiffness for rub in rubs])

    def slips(self, x: FloatArray) -> FloatArray:
        """u (k, 3): how far each particle went along its wall since the last increment, in l."""
        found = np.zeros((len(self.rubs), 3))
        for group in self.groups:
            for e, rows in zip(group.along, group.rows, strict=True):
                found[group.which] += (rows.values(x) - self.place[group.which] @ e)[:, None] * e
        return found

    def points(self, x: FloatArray) -> FloatArray:
        """Where (k, 3) the particles are, in l."""
        found = np.zeros((len(self.rubs), 3))
        for group in self.groups:
            found[group.which] = group.rows[0].points(x)
        return found

    def _of(self, group: Group, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        u = np.column_stack(
            [rows.values(x) - self.place[group.which] @ e for e, rows in zip(group.along, group.rows, strict=True)]
        )
        guess = self.guess[group.which] @ group.along.T
        stiffness = self.stiffness[group.which]
        value, force, slope = rubbed(guess + stiffness[:, None] * u, self.bound[group.which], stiffness)
        return value - np.sum(guess**2, axis=1) / (2.0 * stiffness), force, slope

    def value(self, x: FloatArray) -> float:
        """Sum of psi, D w / l."""
        return float(sum(self._of(group, x)[0].sum() for group in self.groups))

    def forces(self, x: FloatArray) -> FloatArray:
        """T (k, 3): what each particle exerts on its wall along it, D w / l^2."""
        found = np.zeros((len(self.rubs), 3))
        for group in self.groups:
            found[group.which] = self._of(group, x)[1] @ group.along
        return found

    def add_gradient(self, x: FloatArray, out: FloatArray) -> None:
        """Adds the gradient to `out` (n,)."""
        for group in self.groups:
            _, force, _ = self._of(group, x)
            for j, rows in enumerate(group.rows):
                slopes = rows.jacobian(x).reshape(rows.count, -1)
                np.add.at(out, rows.columns, force[:, j : j + 1] * slopes)

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the entries of the lower triangle; entries of one place add up."""
        parts = []
        for group in self.groups:
            parts += [rows.hessian_structure() for rows in group.rows]
            columns = group.rows[0].columns
            one, other = np.tril_indices(columns.shape[1])
            left, right = columns[:, one].ravel(), columns[:, other].ravel()
            parts.append((np.maximum(left, right), np.minimum(left, right)))
        rows, places = zip(*parts, strict=True)
        return np.concatenate(rows), np.concatenate(places)

    def hessian(self, x: FloatArray) -> FloatArray:
        """In the order of the structure."""
        parts = []
        for group in self.groups:
            _, force, slope = self._of(group, x)
            parts += [rows.hessian(x, force[:, j]) for j, rows in enumerate(group.rows)]
            slopes = np.stack([rows.jacobian(x).reshape(rows.count, -1) for rows in group.rows], axis=1)
            block = np.einsum("kai,kab,kbj->kij", slopes, slope, slopes)
            one, other = np.tril_indices(slopes.shape[2])
            parts.append(block[:, one, other].ravel())
        return np.concatenate(parts)
