"""Where the unknowns of each formulation stand: places with names, columns, and views of the vector of unknowns.

Kernels use the constants, all else the layout of its problem. Places of a segment's unknowns::

    glued     r (0..2) | q (3..6) | omega (7) | eta (8) | slope of eta (9)     and those of the next joint, from NEXT on
    matrices  r (0..2) | frame by rows (3..11) | a (12) | b (13) | n (14) | m (15)
    chained   slope of omega (0) | slope of eta (1)     after omega (0) and eta (1) at s = 0

Where the twist is free (`ribbon.energies.free`) eta is its place: the twist kappa_3 stands there. An in-plane
curvature kappa_2 is a third field: of a chained ribbon behind eta in every group, of a glued one joint by joint behind
the ribbon.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Glued ribbon: unknowns of a segment, and of the last joint, which has no slope behind it.
STRIDE, JOINT = 10, 9
POSITION, QUATERNION, OMEGA, ETA, SLOPE = 0, 3, 7, 8, 9
#: From a place of a joint to the same place of the next one.
NEXT = STRIDE
#: Ribbon of the thesis's matrices.
MATRIX_STRIDE = 16
MATRIX_FRAME, MATRIX_A, MATRIX_B, MATRIX_N, MATRIX_M = 3, 12, 13, 14, 15


def at_joints(parameters: FloatArray, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
    """omega and eta (p + 1,) at the joints from (a, b, n, m) of every segment (p, 4)."""
    a, b, n, m = parameters.T
    return np.append(b, b[-1] + a[-1] * lengths[-1]), np.append(m, m[-1] + n[-1] * lengths[-1])


@dataclass(frozen=True)
class Joint:
    """Columns of a joint of a glued ribbon: position (3,), quaternion (4,), omega, eta."""

    position: IntArray
    quaternion: IntArray
    omega: int
    eta: int


@dataclass(frozen=True)
class MixedLayout:
    """Unknowns of a glued ribbon of p segments, joint by joint, then its in-plane curvature, if it has one, then the
    heights of its pressure plates."""

    segments: int
    plates: int = 0
    in_plane: bool = False

    @property
    def last(self) -> int:
        """First column of the last joint."""
        return STRIDE * self.segments

    @property
    def ribbon(self) -> int:
        """Number of unknowns of the ribbon itself."""
        return self.last + JOINT + (self.segments + 1 if self.in_plane else 0)

    @property
    def size(self) -> int:
        """Number of unknowns, 10 p + 9, p + 1 for an in-plane curvature and one for every pressure plate."""
        return self.ribbon + self.plates

    @property
    def sideways(self) -> slice:
        """The in-plane curvature at the joints (p + 1), or nothing."""
        return slice(self.last + JOINT, self.ribbon)

    @property
    def omega(self) -> slice:
        """omega at the joints (p + 1)."""
        return slice(OMEGA, self.last + JOINT, STRIDE)

    @property
    def eta(self) -> slice:
        """eta at the joints (p + 1)."""
        return slice(ETA, self.last + JOINT, STRIDE)

    @property
    def slope(self) -> slice:
        """The slope of eta on the segments (p)."""
        return slice(SLOPE, self.last, STRIDE)

    @property
    def heights(self) -> slice:
        """Heights of the pressure plates."""
        return slice(self.ribbon, self.size)

    def joint(self, i: int) -> Joint:
        """Columns of joint i; -1 is the last one."""
        k = STRIDE * (i % (self.segments + 1))
        return Joint(k + np.arange(POSITION, QUATERNION), k + np.arange(QUATERNION, OMEGA), k + OMEGA, k + ETA)

    def columns(self, *places: int) -> IntArray:
        """Columns of these places at every joint, (p + 1,) for one place, else (p + 1, k)."""
        found = STRIDE * np.arange(self.segments + 1)[:, None] + np.array(places)
        return found[:, 0] if len(places) == 1 else found

    def positions(self, x: FloatArray) -> FloatArray:
        """View (p + 1, 3) of the positions in x."""
        return self._view(x, POSITION, 3)

    def quaternions(self, x: FloatArray) -> FloatArray:
        """View (p + 1, 4) of the quaternions in x."""
        return self._view(x, QUATERNION, 4)

    def _view(self, x: FloatArray, place: int, count: int) -> FloatArray:
        if x.shape != (self.size,):
            raise ValueError(f"unknowns of shape {x.shape}, not ({self.size},)")
        step = x.strides[0]
        return as_strided(x[place:], (self.segments + 1, count), (STRIDE * step, step))


@dataclass(frozen=True)
class MatrixLayout:
    """Unknowns of a ribbon of matrices of p segments, then the heights of its pressure plates."""

    segments: int
    plates: int = 0

    @property
    def last(self) -> int:
        """First column of the last segment."""
        return MATRIX_STRIDE * (self.segments - 1)

    @property
    def ribbon(self) -> int:
        """Number of unknowns of the ribbon itself."""
        return MATRIX_STRIDE * self.segments

    @property
    def size(self) -> int:
        """Number of unknowns, 16 p and one for every pressure plate."""
        return self.ribbon + self.plates

    @property
    def slope(self) -> slice:
        """The slope of eta on the segments (p)."""
        return slice(MATRIX_N, self.ribbon, MATRIX_STRIDE)

    @property
    def heights(self) -> slice:
        """Heights of the pressure plates."""
        return slice(self.ribbon, self.size)

    def table(self, x: FloatArray) -> FloatArray:
        """View (p, 16) of x, segment by segment."""
        return x[: self.ribbon].reshape(-1, MATRIX_STRIDE)

    def positions(self, x: FloatArray) -> FloatArray:
        """View (p, 3) of the positions of the segments' starts."""
        return self.table(x)[:, POSITION:MATRIX_FRAME]

    def frames(self, x: FloatArray) -> FloatArray:
        """Frames (p, 3, 3) at the segments' starts."""
        return self.table(x)[:, MATRIX_FRAME:MATRIX_A].reshape(-1, 3, 3)

    def parameters(self, x: FloatArray) -> FloatArray:
        """View (p, 4) of (a, b, n, m)."""
        return self.table(x)[:, MATRIX_A:]


@dataclass(frozen=True)
class ChainedLayout:
    """Unknowns of a chained ribbon of p segments: its fields at s = 0, then their slopes, segment by segment.

    fields: 2, omega and eta (or the twist), or 3: the in-plane curvature too.
    """

    segments: int
    fields: int = 2

    @property
    def size(self) -> int:
        """Number of unknowns, 2 p + 2 or 3 p + 3."""
        return self.fields * (self.segments + 1)

    @property
    def omega(self) -> int:
        """omega at s = 0."""
        return 0

    @property
    def eta(self) -> int:
        """eta at s = 0."""
        return 1

    @property
    def omega_slope(self) -> slice:
        """Slopes of omega on the segments (p)."""
        return slice(self.fields, None, self.fields)

    @property
    def eta_slope(self) -> slice:
        """Slopes of eta on the segments (p)."""
        return slice(self.fields + 1, None, self.fields)

    @property
    def bending(self) -> slice:
        """omega at s = 0 and its slopes (p + 1)."""
        return slice(0, None, self.fields)

    @property
    def ruling(self) -> slice:
        """eta at s = 0 and its slopes (p + 1)."""
        return slice(1, None, self.fields)

    @property
    def sideways(self) -> slice:
        """The in-plane curvature at s = 0 and its slopes (p + 1), or nothing."""
        return slice(2, None, 3) if self.fields == 3 else slice(0, 0)

    def unknowns(
        self, omega: FloatArray, eta: FloatArray, lengths: FloatArray, in_plane: FloatArray | None = None
    ) -> FloatArray:
        """Unknowns of omega, eta and in-plane curvature (p + 1,) at the joints, linear between them; None: no such."""
        x = np.zeros(self.size)
        if in_plane is not None and self.fields == 3:
            x[self.sideways] = np.concatenate([in_plane[:1], np.diff(in_plane) / lengths])
        x[self.omega], x[self.eta] = omega[0], eta[0]
        x[self.omega_slope] = np.diff(omega) / lengths
        x[self.eta_slope] = np.diff(eta) / lengths
        return x

    def values(self, x: FloatArray, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
        """omega and eta (p + 1,) at the joints, of unknowns or of a mode."""
        steps = np.concatenate([[0.0], np.cumsum(x[self.omega_slope] * lengths)])
        turns = np.concatenate([[0.0], np.cumsum(x[self.eta_slope] * lengths)])
        return x[self.omega] + steps, x[self.eta] + turns
