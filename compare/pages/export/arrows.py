"""Contacts as surfaces in space: an arrow at every place that touches, all of them one grid of points.

An arrow is a surface of revolution about its force: a knob at the place, a shaft, a head. Its first and last row are
points, so that the cells between two arrows have no area.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from compare.store.states import States
from compare.store.touches import Touches

FloatArray = NDArray[np.float64]

#: Names of the two surfaces; the longest arrow and the radius of a knob over the strip's extent.
PUSH, FRICTION = "push", "friction"
LONGEST, KNOB = 0.16, 0.006
#: Most arrows of a surface, evenly out of all; points around.
MOST, AROUND = 150, 7
#: Along an arrow: knob, shaft, head; the head's length and the shaft's radius over the knob's radius.
ROWS, _HEAD, _SHAFT = 6, 3.0, 0.4


def forces(touches: Touches, name: str) -> FloatArray:
    """Pushes or friction (n, 3), D w / l^2."""
    return touches.push if name == PUSH else touches.friction


def grid(touches: Touches, name: str, extent: float, largest: float) -> FloatArray:
    """Arrows of one name as points (`ROWS` k, `AROUND`, 3), in l; extent: of the strip, largest: the force of the
    longest arrow. Places without this force are knobs where they are pushes, and left out where friction."""
    own = forces(touches, name)
    sizes = np.linalg.norm(own, axis=1)
    kept = np.flatnonzero(sizes > 0.0) if name == FRICTION else np.arange(len(own))
    if len(kept) > MOST:
        kept = kept[np.linspace(0, len(kept) - 1, MOST).round().astype(int)]
    each = [_arrow(touches.points[k], own[k], sizes[k] / (largest or 1.0), extent) for k in kept]
    return np.concatenate(each) if each else np.empty((0, AROUND, 3))


def _arrow(place: FloatArray, force: FloatArray, share: float, extent: float) -> FloatArray:
    knob, length = KNOB * extent, LONGEST * extent * share
    way = force / np.linalg.norm(force) if np.any(force) else np.array([0.0, 0.0, 1.0])
    side = np.cross(way, np.eye(3)[np.argmin(np.abs(way))])
    side /= np.linalg.norm(side)
    head = max(length - _HEAD * knob, knob)
    along = [-knob, 0.0, knob, head, head, max(length, knob)]
    out = [0.0, knob, _SHAFT * knob, _SHAFT * knob, knob if length > head else 0.0, 0.0]
    turns = np.linspace(0.0, 2.0 * np.pi, AROUND)
    ring = np.cos(turns)[:, None] * side + np.sin(turns)[:, None] * np.cross(way, side)
    return np.array([place + z * way + r * ring for z, r in zip(along, out, strict=True)])


def extent_of(points: FloatArray) -> float:
    """Largest extent of points (..., 3) along an axis."""
    return float(np.ptp(points.reshape(-1, 3), axis=0).max())


def moving(states: States, name: str) -> States | None:
    """The arrows of one name along a path, as states of their own; None where nothing touches in any, or where that is
    not kept. All states have as many rows: what a state does not have is a point."""
    touches = states.touches
    if touches is None:
        return None
    largest = max(one.largest for one in touches)
    extent = extent_of(states.points[-1])
    grids = [grid(one, name, extent, largest) for one in touches]
    most = max(len(one) for one in grids)
    if not most:
        return None
    points = np.empty((len(grids), most, AROUND, 3))
    for k, own in enumerate(grids):
        points[k, : len(own)] = own
        points[k, len(own) :] = own[-1, 0] if len(own) else states.points[k].reshape(-1, 3).mean(axis=0)
    along = np.linspace(0.0, 1.0, most)
    return replace(states, s=along, v=np.linspace(0.0, 1.0, AROUND), points=points, fields={}, touches=None)
