"""Kirchhoff's rod in positions and one angle per edge: unknowns, rows and loads as a problem for a minimiser.

Bergou et al. 2008 (doi:10.1145/1360612.1360662), 2010 (doi:10.1145/1778765.1778853); du Peloux 2017, chapter 4.
Unknowns y (4 n + 3,) = x_0, p_0, x_1, p_1, ..., x_n; p_j turns the directors of edge j over a reference frame that goes
with the edge without spin from its anchor (`Anchors`). theta of the Bishop frame is p plus the reference twists up to
the edge (`bishop`): a change of unknowns that makes every term local, and the Hessian a band of 10 (docs/decisions.md).
Rows: every edge's length, their multipliers are the tension; what of the ends slides.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ribbon.element import kernel_cache
from ribbon.rods.rod import FloatArray, Rod, transported

with kernel_cache.in_use():
    from ribbon.rods.cells import BAND, CELL, assemble

IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Anchors:
    """Reference frames (n + 2, 3, 3) of the start clamp, the edges and the end clamp, columns a_1, a_2 and a tangent,
    and the reference twists (n + 1,) of the cells there, which count whole turns."""

    frames: FloatArray
    twists: FloatArray


@dataclass(frozen=True)
class Evaluated:
    """At one y: elastic energy, its gradient (4 n + 3,), lower half band (11, 4 n + 3) of its Hessian, kappa_1, kappa_2
    and tau times the cells' lengths (n + 1, 3), gradients (n + 1, 8) of the cells by free tangents and angles."""

    energy: float
    gradient: FloatArray
    band: FloatArray
    strain: FloatArray
    ends: FloatArray


@dataclass(frozen=True)
class CurveAngle:
    """`ribbon.solvers.problem.ConstrainedProblem` of a rod, with its anchors; at_rest: kappa_1, kappa_2, tau at rest
    (n + 1, 3) in the cells (None: those of the rod)."""

    rod: Rod
    anchors: Anchors
    at_rest: FloatArray | None = None

    # -- unknowns ----------------------------------------------------------------------------------------------------

    @property
    def rows(self) -> CurveAngle:
        """All of it has rows, if none of them holds anything."""
        return self

    @property
    def strip(self) -> None:
        """A rod's residuals have the unit 1."""

    @property
    def slack(self) -> None:
        """As those."""

    @property
    def size(self) -> int:
        """4 n + 3."""
        return 4 * self.rod.edges + 3

    def positions(self, y: FloatArray) -> FloatArray:
        """x (n + 1, 3)."""
        return np.concatenate([y, [0.0]]).reshape(-1, 4)[:, :3]

    def angles(self, y: FloatArray) -> FloatArray:
        """p (n,)."""
        return y[3::4]

    def tangents(self, y: FloatArray) -> FloatArray:
        """t (n, 3)."""
        edges = np.diff(self.positions(y), axis=0)
        return np.asarray(edges / np.linalg.norm(edges, axis=1)[:, None])

    def references(self, y: FloatArray) -> FloatArray:
        """Reference frames (n, 3, 3) of the edges as they are."""
        pairs = zip(self.anchors.frames[1:-1], self.tangents(y), strict=True)
        return np.array([transported(frame, t) for frame, t in pairs])

    def frames(self, y: FloatArray) -> FloatArray:
        """Material frames (n, 3, 3) of the edges."""
        u, p = self.references(y), self.angles(y)[:, None]
        d1 = np.cos(p) * u[:, :, 0] + np.sin(p) * u[:, :, 1]
        return np.stack([d1, np.cross(u[:, :, 2], d1), u[:, :, 2]], axis=2)

    def anchored(self, y: FloatArray) -> CurveAngle:
        """The same rod with its reference frames at y as anchors: y means the same rod there."""
        frames = self.anchors.frames.copy()
        frames[1:-1] = self.references(y)
        p = np.concatenate([[0.0], self.angles(y), [0.0]])
        return replace(self, anchors=Anchors(frames, self.evaluated(y).strain[:, 2] - np.diff(p)))

    def bishop(self, y: FloatArray) -> FloatArray:
        """theta (n,) of the edges over the Bishop frame of the centreline that is the start clamp's (of a start that is
        free: the first edge's reference frame)."""
        strain = self.evaluated(y).strain[:, 2]
        if self.rod.start.frame is None:
            strain[0] = self.angles(y)[0]
        return np.cumsum(strain[:-1])

    # -- energy ------------------------------------------------------------------------------------------------------

    @cached_property
    def _fixed(self) -> tuple[FloatArray, FloatArray, FloatArray, int, int]:
        """Cells' lengths, stiffnesses, rest curvatures, and the range of cells that have energy."""
        rod = self.rod
        first = 0 if rod.start.frame is not None else 1
        last = rod.edges + (1 if rod.end.frame is not None else 0)
        stiffness = np.tile(np.array(rod.stiffness), (rod.edges + 1, 1))
        rest = rod.at_rest(rod.middles) if self.at_rest is None else self.at_rest
        return rod.cells, stiffness, rest, first, last

    @cached_property
    def _kept(self) -> list[tuple[bytes, Evaluated]]:
        return []

    def evaluated(self, y: FloatArray) -> Evaluated:
        """Elastic energy and its derivatives; those of the last y are kept, as a minimiser asks for one by one."""
        key = y.tobytes()
        if self._kept and self._kept[0][0] == key:
            return self._kept[0][1]
        cells, stiffness, rest, first, last = self._fixed
        gradient, band = np.empty(self.size), np.empty((BAND + 1, self.size))
        strain, ends = np.empty((self.rod.edges + 1, 3)), np.empty((self.rod.edges + 1, CELL))
        energy = assemble(
            y, cells, self.anchors.frames, self.anchors.twists, stiffness, rest, first, last, gradient, band, strain,
            ends,
        )  # fmt: skip
        found = Evaluated(float(energy), gradient, band, strain, ends)
        self._kept[:] = [(key, found)]
        return found

    @cached_property
    def loads(self) -> FloatArray:
        """Dead forces on the vertices (n + 1, 3): weight, by halves of the edges beside them, and the load at s = 1."""
        forces = -self.rod.cells[:, None] * self.rod.weight
        forces[-1] += self.rod.force
        return np.asarray(forces)

    @cached_property
    def _load(self) -> FloatArray:
        """The same along the unknowns (4 n + 3,)."""
        along = np.zeros((self.rod.edges + 1, 4))
        along[:, :3] = self.loads
        return along.reshape(-1)[:-1]

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Held positions are fixed unknowns."""
        lower, upper = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        for end, at in ((self.rod.start, 0), (self.rod.end, self.size - 3)):
            if end.position is not None and end.slide is None:
                lower[at : at + 3] = upper[at : at + 3] = end.position
        return lower, upper

    def value(self, y: FloatArray) -> float:
        """Elastic energy and that of the dead forces, D w / l."""
        return self.evaluated(y).energy - float(self._load @ y)

    def gradient(self, y: FloatArray) -> FloatArray:
        """(4 n + 3,)."""
        return np.asarray(self.evaluated(y).gradient - self._load)

    # -- rows --------------------------------------------------------------------------------------------------------

    @cached_property
    def _sliding(self) -> list[tuple[int, FloatArray, float]]:
        """Rows of ends that slide: first unknown, unit normal (3,) of the direction, and where it is held."""
        rows = []
        for end, at in ((self.rod.start, 0), (self.rod.end, self.size - 3)):
            if end.slide is not None and end.position is not None:
                normals = np.linalg.svd(end.slide[None, :])[2][1:]
                rows += [(at, normal, float(normal @ end.position)) for normal in normals]
        return rows

    def constraint_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Equalities."""
        zero = np.zeros(self.rod.edges + len(self._sliding))
        return zero, zero.copy()

    def constraints(self, y: FloatArray) -> FloatArray:
        """(|e|^2 / h^2 - 1) h / 2 of every edge, so that the multiplier is the tension; then what slides."""
        edges, h = np.diff(self.positions(y), axis=0), self.rod.lengths
        own = 0.5 * (np.einsum("ij,ij->i", edges, edges) / h - h)
        return np.concatenate([own, [normal @ y[at : at + 3] - held for at, normal, held in self._sliding]])

    @cached_property
    def _rows(self) -> tuple[IntArray, IntArray]:
        n = self.rod.edges
        row = np.repeat(np.arange(n), 6)
        column = (4 * np.arange(n)[:, None] + np.array([0, 1, 2, 4, 5, 6])).ravel()
        slides = len(self._sliding)
        row = np.concatenate([row, np.repeat(np.arange(n, n + slides), 3)])
        column = np.concatenate([column, *[at + np.arange(3) for at, _, _ in self._sliding]])
        return row.astype(np.int64), column.astype(np.int64)

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns."""
        return self._rows

    def jacobian(self, y: FloatArray) -> FloatArray:
        """Values in that structure."""
        slopes = np.diff(self.positions(y), axis=0) / self.rod.lengths[:, None]
        own = np.concatenate([-slopes, slopes], axis=1).ravel()
        return np.concatenate([own, *[normal for _, normal, _ in self._sliding]])

    def jacobian_matrix(self, y: FloatArray) -> Any:
        """Sparse (rows, 4 n + 3)."""
        shape = self.rod.edges + len(self._sliding), self.size
        return scipy.sparse.csr_matrix((self.jacobian(y), self._rows), shape)

    @cached_property
    def _band(self) -> tuple[IntArray, IntArray]:
        """Rows of the band and columns of its entries that are in the matrix."""
        k, column = np.meshgrid(np.arange(BAND + 1), np.arange(self.size), indexing="ij")
        inside = k + column < self.size
        return k[inside], column[inside]

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the lower half."""
        k, column = self._band
        return k + column, column

    def hessian(self, y: FloatArray, multipliers: FloatArray, factor: float = 1.0) -> FloatArray:
        """Of factor * value + multipliers . constraints, in that structure."""
        band = factor * self.evaluated(y).band
        pull = multipliers[: self.rod.edges] / self.rod.lengths
        for i in range(3):
            band[0, i : self.size - 4 + i : 4] += pull
            band[0, 4 + i :: 4] += pull
            band[4, i : self.size - 4 + i : 4] -= pull
        return np.asarray(band[self._band])

    def hessian_matrix(self, y: FloatArray, multipliers: FloatArray) -> Any:
        """Sparse and symmetric (4 n + 3, 4 n + 3)."""
        row, column = self.hessian_structure()
        values = self.hessian(y, multipliers)
        below = row > column
        both = np.concatenate([row, column[below]]), np.concatenate([column, row[below]])
        return scipy.sparse.csc_matrix((np.concatenate([values, values[below]]), both), (self.size, self.size))
