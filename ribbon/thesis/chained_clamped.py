"""Chained problem with its end clamped by six rows: the formulation that fails in the thesis (5.1, 5.3.2, figure 5.4).

Unknowns and energy are those of `ribbon.problems.chained`; the start is clamped by construction, the end by ``r(l) - u
= 0`` (thesis, eq. 5.1), the off-diagonal products of its frame G with the clamp's H (eq. 5.3) and, where the clamp is
straight, ``eta(l) = 0``. Every row depends on all unknowns before it: Jacobian and Hessian of the Lagrangian are dense.

Derivatives. With R_i, r_i at the start of segment i, Q_i, p_i its end frame and chord (`ribbon.element.series`), a
parameter of segment i turns all behind it by the vector phi of the fixed frame, ``[phi]_x = R_i dQ_i Q_i^T R_i^T``, and
moves it (docs/theory.md, eq. (4.4))::

    dG = [phi]_x G ,      dr(l) = R_i dp_i + phi x (r(l) - r_(i+1)) .

A later parameter's phi and dr turn rigidly with an earlier one, so that for a Lagrangian ``<force, r(l)> + <Y, G>``,
with ``S = G Y^T``, the second derivative by parameters of segments j < k is the product of two vectors of the fixed
frame, ``<phi_j, (S - tr(S) 1) phi_k + dr_k x force>``: semi-separable of rank 3 as gravity is, whose assembly
(`ribbon.problems.chained_kernels`) serves here. On the diagonal, with ``G = R_(i+1) N_i`` and ``r(l) = r_(i+1) +
R_(i+1) z_i``::

    <R_i^T force, d2 p_i> + <R_i^T Y N_i^T + R_i^T force z_i^T, d2 Q_i> .
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ribbon.boundary import Clamp
from ribbon.element.series import EXPONENT_LIMIT, FURTHEST, segment_jets_many
from ribbon.errors import RibbonInputError
from ribbon.loads import Gravity
from ribbon.problems import chained_kernels
from ribbon.problems.chained import ChainedProblem, Counters
from ribbon.strip import Strip

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@njit(cache=True)
def _compose(jets, position, frame, points, frames):
    """Positions (p + 1, 3) and frames (p + 1, 3, 3) of the joints from jets (p, >= 12, 15) of the segments."""
    points[0] = position
    frames[0] = frame
    for i in range(jets.shape[0]):
        for r in range(3):
            x, y, z = frames[i, r, 0], frames[i, r, 1], frames[i, r, 2]
            points[i + 1, r] = points[i, r] + x * jets[i, 9, 0] + y * jets[i, 10, 0] + z * jets[i, 11, 0]
            for c in range(3):
                frames[i + 1, r, c] = x * jets[i, c, 0] + y * jets[i, 3 + c, 0] + z * jets[i, 6 + c, 0]


@njit(cache=True)
def motions(jets, points, frames, turn, shift):
    """Turns phi (p, 4, 3) of all that is behind a segment and motions dr (p, 4, 3) of the end, by (a, b, n, m)."""
    p = jets.shape[0]
    d = np.empty((3, 3))
    axis = np.empty(3)
    for i in range(p):
        jet = jets[i]
        arm0 = points[p, 0] - points[i + 1, 0]
        arm1 = points[p, 1] - points[i + 1, 1]
        arm2 = points[p, 2] - points[i + 1, 2]
        for z in range(4):
            # dQ Q^T, antisymmetric: its axial vector, turned into the fixed frame
            for r in range(3):
                for c in range(3):
                    d[r, c] = (
                        jet[3 * r, 1 + z] * jet[3 * c, 0]
                        + jet[3 * r + 1, 1 + z] * jet[3 * c + 1, 0]
                        + jet[3 * r + 2, 1 + z] * jet[3 * c + 2, 0]
                    )
            axis[0] = 0.5 * (d[2, 1] - d[1, 2])
            axis[1] = 0.5 * (d[0, 2] - d[2, 0])
            axis[2] = 0.5 * (d[1, 0] - d[0, 1])
            for r in range(3):
                x, y, w = frames[i, r, 0], frames[i, r, 1], frames[i, r, 2]
                turn[i, z, r] = x * axis[0] + y * axis[1] + w * axis[2]
                shift[i, z, r] = x * jet[9, 1 + z] + y * jet[10, 1 + z] + w * jet[11, 1 + z]
            f0, f1, f2 = turn[i, z, 0], turn[i, z, 1], turn[i, z, 2]
            shift[i, z, 0] += f1 * arm2 - f2 * arm1
            shift[i, z, 1] += f2 * arm0 - f0 * arm2
            shift[i, z, 2] += f0 * arm1 - f1 * arm0


@njit(cache=True)
def second_derivatives(jets, points, frames, turn, shift, force, y, local, v):
    """Second jets `local` (p, 15) of ``<force, r(l)> + <y, G>`` by segment and factors v (p, 4, 3) of `turn` before it.

    force (3,); y (3, 3). The value and the first derivatives in `local` are left alone.
    """
    p = jets.shape[0]
    g = frames[p]
    s = np.zeros((3, 3))
    trace = 0.0
    for r in range(3):
        for c in range(3):
            s[r, c] = g[r, 0] * y[c, 0] + g[r, 1] * y[c, 1] + g[r, 2] * y[c, 2]
        trace += s[r, r]
    f = np.empty(3)
    z = np.empty(3)
    n = np.empty((3, 3))
    w = np.empty((3, 3))
    for i in range(p):
        jet = jets[i]
        own = frames[i]
        behind = frames[i + 1]
        for c in range(3):
            f[c] = own[0, c] * force[0] + own[1, c] * force[1] + own[2, c] * force[2]
            z[c] = 0.0
            for r in range(3):
                z[c] += behind[r, c] * (points[p, r] - points[i + 1, r])
            for k in range(3):
                n[c, k] = behind[0, c] * g[0, k] + behind[1, c] * g[1, k] + behind[2, c] * g[2, k]
        for r in range(3):
            for c in range(3):
                w[r, c] = f[r] * z[c]
                for k in range(3):
                    w[r, c] += (own[0, r] * y[0, k] + own[1, r] * y[1, k] + own[2, r] * y[2, k]) * n[c, k]
        for k in range(5, 15):
            t = f[0] * jet[9, k] + f[1] * jet[10, k] + f[2] * jet[11, k]
            for r in range(3):
                t += w[r, 0] * jet[3 * r, k] + w[r, 1] * jet[3 * r + 1, k] + w[r, 2] * jet[3 * r + 2, k]
            local[i, k] = t
        for k in range(4):
            t0, t1, t2 = turn[i, k, 0], turn[i, k, 1], turn[i, k, 2]
            d0, d1, d2 = shift[i, k, 0], shift[i, k, 1], shift[i, k, 2]
            v[i, k, 0] = s[0, 0] * t0 + s[0, 1] * t1 + s[0, 2] * t2 - trace * t0 + d1 * force[2] - d2 * force[1]
            v[i, k, 1] = s[1, 0] * t0 + s[1, 1] * t1 + s[1, 2] * t2 - trace * t1 + d2 * force[0] - d0 * force[2]
            v[i, k, 2] = s[2, 0] * t0 + s[2, 1] * t1 + s[2, 2] * t2 - trace * t2 + d0 * force[1] - d1 * force[0]


@njit(cache=True)
def by_unknowns(lengths, slopes, out):
    """Rows out (k, 2 p + 2) by the unknowns from slopes (p, 4, k) by (a, b, n, m): a and n move every later b and m."""
    p, _, count = slopes.shape
    for k in range(count):
        tail_b = 0.0
        tail_m = 0.0
        for i in range(p - 1, -1, -1):
            out[k, 2 * i + 2] = slopes[i, 0, k] + lengths[i] * tail_b
            out[k, 2 * i + 3] = slopes[i, 2, k] + lengths[i] * tail_m
            tail_b += slopes[i, 1, k]
            tail_m += slopes[i, 3, k]
        out[k, 0] = tail_b
        out[k, 1] = tail_m


@dataclass(frozen=True)
class ChainedClampedProblem:
    """Energy of the chained ribbon with its end held by rows; dense Jacobian and dense Hessian of the Lagrangian.

    strip, clamp (position and frame at s = 0), gravity (along the centreline), energy, lengths: as in
    `ribbon.problems.chained.ChainedProblem`; end: the clamp at s = l, of which position, frame and ruling may be free.
    """

    strip: Strip
    clamp: Clamp
    end: Clamp
    gravity: Gravity | None
    energy: str
    lengths: FloatArray
    exponent_limit: float = EXPONENT_LIMIT
    counters: Counters = field(default_factory=Counters, compare=False)
    _cache: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)
    _chain: ChainedProblem = field(init=False, repr=False, compare=False)

    formulation = "chained"

    def __post_init__(self) -> None:
        if not self.clamp.is_whole:
            raise RibbonInputError("start", self.clamp, "the chained model starts from a position and a frame")
        if self.gravity is not None and self.gravity.exact:
            raise RibbonInputError("exact", True, "the chained model weighs the centreline; use the mixed one")
        chain = ChainedProblem(
            self.strip,
            self.clamp,
            self.gravity,
            self.energy,
            self.lengths,
            self.exponent_limit,
            counters=self.counters,
        )
        object.__setattr__(self, "_chain", chain)

    @property
    def rows(self) -> ChainedClampedProblem:
        """All of it has rows: those of the clamp at the end."""
        return self

    @property
    def slack(self) -> None:
        """Residuals are measured as without."""

    @property
    def size(self) -> int:
        """Number of unknowns, 2 p + 2."""
        return self._chain.size

    @property
    def has_gravity(self) -> bool:
        """Whether weight acts."""
        return self._chain.has_gravity

    @property
    def has_natural_curvature(self) -> bool:
        """Whether the strip is naturally curved."""
        return self._chain.has_natural_curvature

    @property
    def half_width(self) -> float:
        """w / (2 l)."""
        return self._chain.half_width

    def block_slices(self) -> dict[str, slice]:
        """Where the rows of each block stand; those of the frame are small turns about H_x, H_y, H_z."""
        found: dict[str, slice] = {}
        at = 0
        wanted = (self.end.position is not None, self.end.holds_frame, self.end.ruling == "straight")
        for name, held, count in zip(("end_position", "end_frame", "end_ruling"), wanted, (3, 3, 1), strict=True):
            if held:
                found[name] = slice(at, at + count)
                at += count
        return found

    @property
    def _rows(self) -> int:
        return max((where.stop for where in self.block_slices().values()), default=0)

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds (2 p + 2,) of the unknowns."""
        return self._chain.bounds()

    def constraint_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the rows: all are equations."""
        return np.zeros(self._rows), np.zeros(self._rows)

    def linear(self, curvature: tuple[float, float], ruling: tuple[float, float]) -> FloatArray:
        """Unknowns of omega and eta linear along the whole ribbon, from their values at both ends (omega in 1/l)."""
        return self._chain.linear(curvature, ruling)

    def state(self, omega: FloatArray, eta: FloatArray) -> FloatArray:
        """Unknowns of the shape with omega and eta (p + 1,) at the joints, linear between them."""
        return self._chain.state(omega, eta)

    def parameters(self, x: FloatArray) -> FloatArray:
        """(a, b, n, m) of every segment, (p, 4)."""
        return self._chain.parameters(x)

    def joints(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions (p + 1, 3) in units of l and frames (p + 1, 3, 3) at the joints."""
        return self._chain.joints(x)

    def flipped(self, x: FloatArray) -> bool:
        """Whether the end's clamp is met in a frame turned over: products ``<G_k, H_k>`` of 0 or -1, not 1."""
        if not self.end.holds_frame:
            return False
        return bool(np.any((self.joints(x)[1][-1] * self.end.frame).sum(axis=0) < 0.5))

    def energy_parts(self, x: FloatArray) -> FloatArray:
        """Bending, natural-curvature and gravity energy (3,), units D w / l."""
        return self._chain.energy_parts(x)

    def _too_far(self, x: FloatArray) -> bool:
        a, b, n, m = np.abs(self.parameters(x)).T
        turned = self.lengths * (b + a * self.lengths) * (1.0 + m + n * self.lengths)
        return not bool(turned.sum() <= FURTHEST)

    def value(self, x: FloatArray) -> float:
        """Total energy, units D w / l; nan beyond `FURTHEST`, which makes a minimiser shorten its step."""
        return np.nan if self._too_far(x) else self._chain.value(x)

    def gradient(self, x: FloatArray) -> FloatArray:
        """Gradient (2 p + 2,) of the energy."""
        return self._chain.gradient(x)

    def constraints(self, x: FloatArray) -> FloatArray:
        """The rows: ``r(l) - u``, ``<G_y, H_z>``, ``<G_z, H_x>``, ``<G_x, H_y>``, ``eta(l)``."""
        if self._too_far(x):
            return np.full(self._rows, np.nan)
        points, frames = self.joints(x)
        rows = []
        if self.end.position is not None:
            rows.append(points[-1] - np.asarray(self.end.position) / self.strip.length)
        if self.end.holds_frame:
            rows.append((np.roll(frames[-1], -1, axis=1) * np.roll(self.end.frame, -2, axis=1)).sum(axis=0))
        if self.end.ruling == "straight":
            layout = self._chain.layout
            rows.append(np.array([x[layout.eta] + self.lengths @ x[layout.eta_slope]]))
        return np.concatenate([np.empty(0), *rows])

    def _motions(self, x: FloatArray) -> tuple[FloatArray, ...]:
        key = np.ascontiguousarray(x, dtype=float).tobytes()
        if self._cache.get("key") != key:
            p = self.lengths.size
            jets = np.empty((p, 12, 15))  # no J: the weight is the chain's own
            segment_jets_many(self.parameters(x), self.lengths, self.exponent_limit, jets)
            self.counters.series += p
            points, frames = np.empty((p + 1, 3)), np.empty((p + 1, 3, 3))
            _compose(jets, np.asarray(self.clamp.position) / self.strip.length, self.clamp.frame, points, frames)
            turn, shift = np.empty((p, 4, 3)), np.empty((p, 4, 3))
            motions(jets, points, frames, turn, shift)
            self._cache["key"], self._cache["motions"] = key, (jets, points, frames, turn, shift)
        return self._cache["motions"]  # type: ignore[no-any-return]

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """All places."""
        rows, columns = np.indices((self._rows, self.size))
        return rows.ravel(), columns.ravel()

    def jacobian_matrix(self, x: FloatArray) -> FloatArray:
        """The Jacobian (rows, 2 p + 2), dense."""
        _, _, frames, turn, shift = self._motions(x)
        out = np.zeros((self._rows, self.size))
        where = self.block_slices()
        if "end_position" in where:
            by_unknowns(self.lengths, shift, out[where["end_position"]])
        if "end_frame" in where:
            # <phi x G_(k+1), H_(k+2)> = <phi, G_(k+1) x H_(k+2)>
            axes = np.cross(np.roll(frames[-1], -1, axis=1), np.roll(self.end.frame, -2, axis=1), axis=0)
            by_unknowns(self.lengths, turn @ axes, out[where["end_frame"]])
        if "end_ruling" in where:
            out[where["end_ruling"], self._chain.layout.eta] = 1.0
            out[where["end_ruling"], self._chain.layout.eta_slope] = self.lengths
        return out

    def jacobian(self, x: FloatArray) -> FloatArray:
        """The Jacobian's entries in the order of the structure."""
        return self.jacobian_matrix(x).ravel()

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """The whole lower triangle."""
        rows, columns = np.tril_indices(self.size)
        return rows, columns

    def hessian_matrix(self, x: FloatArray, multipliers: FloatArray, factor: float = 1.0) -> FloatArray:
        """Hessian (2 p + 2, 2 p + 2) of the Lagrangian, dense and symmetric."""
        jets, points, frames, turn, shift = self._motions(x)
        where = self.block_slices()
        force, y = np.zeros(3), np.zeros((3, 3))
        if "end_position" in where:
            force = np.ascontiguousarray(multipliers[where["end_position"]], dtype=float)
        if "end_frame" in where:
            y = np.roll(np.roll(self.end.frame, -2, axis=1) * multipliers[where["end_frame"]], 1, axis=1)
        p = self.lengths.size
        local, v = np.zeros((p, 15)), np.empty((p, 4, 3))
        second_derivatives(jets, points, frames, turn, shift, force, y, local, v)
        out = np.empty((self.size, self.size))
        chained_kernels.assemble_hessian(self.lengths, local, True, turn, v, out)
        if factor != 0.0:
            out += factor * self._chain.hessian(x)
        return out

    def hessian(self, x: FloatArray, multipliers: FloatArray, factor: float = 1.0) -> FloatArray:
        """Lower triangle of ``factor d2E + sum multipliers d2c`` in the order of the structure."""
        if "triangle" not in self._cache:
            self._cache["triangle"] = self.hessian_structure()
        return self.hessian_matrix(x, multipliers, factor)[self._cache["triangle"]]
