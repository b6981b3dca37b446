"""Points and triangles of the ribbon's surface in the strip's material coordinates.

The developable surface is ``phi(s, u) = r(s) + u q(s)``, ``q = t_x + eta t_z`` (thesis, eq. 2.2; docs/theory.md,
eq. (1.4), (1.6)), but (s, u) is not material: the particle (S, v) of the flat strip lies on the ruling whose foot s
solves ``s + v eta(s) = S``. As ``|eta'| <= 2 / w`` the left side grows with s for every |v| <= w/2, and as eta is
linear by segments the root has a closed form. Near a short end whose ruling is oblique a corner of the rectangle lies
beyond the last ruling; there the surface goes on with the end's own (omega, eta), the developable continuation with
continuous curvature.

A closed band has no such corners: what lies beyond its seam is its other end, of a Moebius band turned by pi about the
tangent (thesis, eq. 6.1). `seam`: 0 for an open strip, 1 for a circle, -1 for a Moebius band. Past the seam

    r(s + 1) = r(s),   (t_x, t_y)(s + 1) = seam (t_x, t_y)(s),   (omega, eta)(s + 1) = seam (omega, eta)(s),

so that the particles (1, v) and (0, seam v), which are one, are found on one ruling and fall together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ribbon.element.kinematics import segment_values

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Surface:
    """A triangulated strip.

    points (N, 3) in units of l; material (N, 2): (S, v) of every point in the flat strip, units of l; triangles (T, 3):
    indices of points; shape: (along, across) numbers of points, N = along * across, the last index runs fastest.
    """

    points: FloatArray
    material: FloatArray
    triangles: NDArray[np.int64]
    shape: tuple[int, int]

    @property
    def grid(self) -> FloatArray:
        """The points as (along, across, 3)."""
        return self.points.reshape(*self.shape, 3)


def grid_triangles(along: int, across: int) -> NDArray[np.int64]:
    """Triangles (2 (along - 1) (across - 1), 3) of a grid of points, last index fastest."""
    corner = (np.arange(along - 1)[:, None] * across + np.arange(across - 1)[None, :]).ravel()
    lower = np.column_stack([corner, corner + across, corner + 1])
    upper = np.column_stack([corner + 1, corner + across, corner + across + 1])
    return np.concatenate([lower, upper])


def grid_material(width: float, along: int, across: int) -> FloatArray:
    """Particles (S, v) ((along + 1) (across + 1), 2) of a strip of `width` w / l, equally spaced, units of l."""
    grid_s, grid_v = np.meshgrid(
        np.linspace(0.0, 1.0, along + 1), np.linspace(-0.5 * width, 0.5 * width, across + 1), indexing="ij"
    )
    return np.column_stack([grid_s.ravel(), grid_v.ravel()])


@njit(cache=True)
def _evaluate(free, q, lengths, points, frames, s, limit, r, frame, omega, eta):
    p = lengths.size
    beyond = np.zeros(q.shape[1])
    f = np.empty((3, 3))
    c = np.empty(3)
    j = np.empty(3)
    starts = np.empty(p + 1)
    starts[0] = 0.0
    for i in range(p):
        starts[i + 1] = starts[i] + lengths[i]
    for k in range(s.size):
        t = s[k]
        sign = 1.0
        if t < 0.0:
            i = 0
            omega[k], eta[k] = q[0, 1], q[0, 3]
            # backwards: frame and centreline of the curvatures with the opposite sign (a ruling keeps its own)
            beyond[1] = -omega[k]
            beyond[3] = -eta[k] if free else eta[k]
            if q.shape[1] == 6:
                beyond[5] = -q[0, 5]
            segment_values(free, beyond, -t, limit, f, c, j)
            sign = -1.0
        elif t > starts[p]:
            i = p
            h = lengths[p - 1]
            omega[k] = q[p - 1, 0] * h + q[p - 1, 1]
            eta[k] = q[p - 1, 2] * h + q[p - 1, 3]
            beyond[1], beyond[3] = omega[k], eta[k]
            if q.shape[1] == 6:
                beyond[5] = q[p - 1, 4] * h + q[p - 1, 5]
            segment_values(free, beyond, t - starts[p], limit, f, c, j)
        else:
            i = min(max(np.searchsorted(starts, t, side="right") - 1, 0), p - 1)
            h = t - starts[i]
            omega[k] = q[i, 0] * h + q[i, 1]
            eta[k] = q[i, 2] * h + q[i, 3]
            if h > 0.0:
                segment_values(free, q[i], h, limit, f, c, j)
            else:
                f[:, :] = np.eye(3)
                c[:] = 0.0
        for a in range(3):
            r[k, a] = points[i, a]
            for b in range(3):
                r[k, a] += sign * frames[i, a, b] * c[b]
                frame[k, a, b] = 0.0
                for d in range(3):
                    frame[k, a, b] += frames[i, a, d] * f[d, b]


def behind_seam(s: FloatArray, seam: int) -> tuple[FloatArray, FloatArray]:
    """Where in [0, 1] abscissae s (k,) lie, and the sign (k,) that their t_x, t_y, omega, eta and v take there."""
    if seam == 0:
        return s, np.ones_like(s)
    outside = (s < 0.0) | (s > 1.0)
    turns = np.where(outside, np.floor(s), 0.0)
    return s - turns, np.where(turns % 2.0 == 0.0, 1.0, float(seam))


def centreline(
    q: FloatArray,
    lengths: FloatArray,
    points: FloatArray,
    frames: FloatArray,
    s: FloatArray,
    limit: float,
    seam: int = 0,
    free: bool = False,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Positions (k, 3), frames (k, 3, 3), omega (k,) and eta (k,) at abscissae s (k,), units of l.

    q (p, 4 or 6): parameters of the segments; points, frames: of the joints; free: the twist is, and stands in the
    place of eta here too. Beyond the ends: omega and eta held, or those behind the seam.
    """
    s, sign = behind_seam(np.ascontiguousarray(s, dtype=float), seam)
    r = np.empty((s.size, 3))
    frame = np.empty((s.size, 3, 3))
    omega, eta = np.empty(s.size), np.empty(s.size)
    _evaluate(free, q, lengths, points, frames, s, limit, r, frame, omega, eta)
    if seam != 0:
        frame[:, :, :2] *= sign[:, None, None]
    return r, frame, sign * omega, eta if free else sign * eta


def ruling_foot(q: FloatArray, lengths: FloatArray, material: FloatArray, seam: int = 0) -> FloatArray:
    """Foot s (N,) of the ruling through each particle (S, v) of `material` (N, 2): the root of s + v eta(s) = S.

    Of an open strip below 0 or above 1 on the continuation of its ends, of a closed band where it lies behind the seam.
    """
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    eta = np.concatenate([q[:, 3], [q[-1, 2] * lengths[-1] + q[-1, 3]]])
    if seam != 0:
        starts = np.concatenate([starts[:-1] - starts[-1], starts[:-1], starts + starts[-1]])
        eta = np.concatenate([seam * eta[:-1], eta[:-1], seam * eta])
        q, lengths = np.concatenate([seam * q, q, seam * q]), np.tile(lengths, 3)
    foot = np.empty(len(material))
    for v in np.unique(material[:, 1]):
        rows = np.nonzero(material[:, 1] == v)[0]
        target = material[rows, 0]
        joints = starts + v * eta  # grows along the ribbon while rulings do not cross
        i = np.clip(np.searchsorted(joints, target, side="right") - 1, 0, len(lengths) - 1)
        slope = 1.0 + v * q[i, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            inside = starts[i] + np.where(slope > 0, (target - joints[i]) / slope, 0.0)
        s = np.clip(inside, starts[i], starts[i + 1])
        s = np.where(target < joints[0], target - v * eta[0], s)
        foot[rows] = np.where(target > joints[-1], target - v * eta[-1], s)
    return foot


def surface(
    q: FloatArray,
    lengths: FloatArray,
    points: FloatArray,
    frames: FloatArray,
    limit: float,
    width: float,
    along: int,
    across: int,
    seam: int = 0,
) -> Surface:
    """Surface with `along` x `across` cells, equally spaced in the material coordinates; `width` is w / l."""
    material = grid_material(width, along, across)
    foot = ruling_foot(q, lengths, material, seam)
    r, frame, _, eta = centreline(q, lengths, points, frames, foot, limit, seam)
    ruling = frame[:, :, 0] + eta[:, None] * frame[:, :, 2]
    return Surface(
        r + material[:, 1:] * ruling, material, grid_triangles(along + 1, across + 1), (along + 1, across + 1)
    )
