"""What a round rod may do for nothing: turn about the axis of its clamps, and, as a ring, slide along itself.

Straight at rest, both bendings alike, held at both ends along one axis, a rod may bend to any side: its shape turns
about the axis, its sections turn back in it, and energy and contact are the same, on segments too. Where both ends are
at one place (or joined) every place of it may moreover be the seam; what is left of that motion on segments is O(h^4).
Two linear rows hold them, on the place r(1/2) halfway (docs/theory.md, eq. (5.19))::

    (r(1/2) - r(0)) . t_x(0) = 0 ,     and of a ring     (r(1/2) - r(0)) . t_z(0) = 0

Of a ring that is alike about an axis across s and s + 1/2 the second says that |r(s + 1/2) - r(s)| is greatest or
least at the seam: it stays at the apex of a loop, or where strands cross. Of a circle's and a straight rod's modes,
which come in pairs turned against each other by a quarter wave or a right angle, they leave one of each. At an
equilibrium nothing pushes against them but what segments do to it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbon.boundary import Clamp, Closure
from ribbon.element import quaternion
from ribbon.energies import code_of
from ribbon.energies.free import in_plane_stiffness
from ribbon.energies.section.rod import stiffnesses
from ribbon.problems.conditions import LinearRows, Rows
from ribbon.problems.fields import Fields
from ribbon.problems.layout import MixedLayout

#: How near (l) to the axis the place halfway is where the first row says nothing of a turn about it.
_ON_AXIS = 1e-6
#: Difference of the bending stiffnesses, relative, and of the tangents at both ends, that is none.
_ALIKE, _TANGENT = 1e-9, 1e-9


def bends_alike(fields: Fields) -> bool:
    """Whether a rod bends in every direction as easily, and bending knows nothing of twist."""
    if not fields.in_plane or fields.code != code_of("kirchhoff"):
        return False
    return abs(in_plane_stiffness(fields.section) / stiffnesses(fields.section)[0] - 1.0) < _ALIKE


def coaxial(start: Clamp | None, end: Clamp | None, closure: Closure | None) -> bool:
    """Whether a rod is held, or joined, along one axis at both ends, and in no other way."""
    if closure is not None:
        return start is None
    if start is None or end is None or not (start.is_whole and end.is_whole):
        return False
    one, other = start.frame[:, 2], end.frame[:, 2]
    chord = np.subtract(np.asarray(end.position), np.asarray(start.position))
    return bool(one @ other > 1.0 - _TANGENT and np.linalg.norm(np.cross(one, chord)) <= _TANGENT)


def gauge(layout: MixedLayout, position: NDArray[np.float64], turned: NDArray[np.float64], joined: bool) -> LinearRows:
    """The rows, of a rod whose start is at r(0) = position (3,) and turned by the quaternion (4,), as a ring or not."""
    across = quaternion.matrix(turned).T[[0, 2] if joined else [0]]
    one, other = layout.joint(layout.segments // 2), layout.joint((layout.segments + 1) // 2)
    if layout.segments % 2 == 0:
        return LinearRows(across, one.position, across @ position)
    columns = np.concatenate([one.position, other.position])
    return LinearRows(0.5 * np.hstack([across, across]), columns, across @ position)


def idle(rows: Rows, layout: MixedLayout, x: NDArray[np.float64], turned: NDArray[np.float64]) -> bool:
    """Whether the first row holds another motion than the turn about the axis: r(1/2) is on it."""
    across = quaternion.matrix(turned)[:, 1]
    first, half = layout.joint(0), layout.segments // 2
    middle = layout.positions(x)[half : half + 1 + layout.segments % 2].mean(axis=0)
    return bool(abs(across @ (middle - x[first.position])) < _ON_AXIS and abs(float(rows.values(x)[0])) < _ON_AXIS)
